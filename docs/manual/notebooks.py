"""The notebooks of examples/notebooks as pages: their code is run here, without Jupyter, and what it shows is shown."""

from __future__ import annotations

import ast
import contextlib
import io
import json
from base64 import b64encode
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
ALL = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))


def cells(notebook: Path) -> Iterator[tuple[str, str]]:
    """Kind, "markdown" or "code", and text of each cell."""
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        yield cell["cell_type"], "".join(cell["source"])


def run(code: str, names: dict[str, Any]) -> tuple[str, list[bytes]]:
    """What a cell prints, its last expression included, and its figures as PNG."""
    import matplotlib.pyplot as plt

    tree, out, pictures = ast.parse(code), io.StringIO(), []
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(out):
        exec(compile(tree, "<cell>", "exec"), names)
        value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), names) if last else None
        if value is not None and not code.rstrip().endswith(";"):
            print(repr(value))
    for number in plt.get_fignums():
        picture = io.BytesIO()
        plt.figure(number).savefig(picture, format="png", dpi=110, bbox_inches="tight")
        pictures.append(picture.getvalue())
    plt.close("all")
    return out.getvalue(), pictures


def page(notebook: Path, run_cells: bool = True) -> str:
    """A notebook as a page."""
    import matplotlib

    matplotlib.use("Agg")
    names: dict[str, Any] = {"__name__": "__main__"}
    lines = list[str]()
    with contextlib.chdir(notebook.parent):
        for kind, text in cells(notebook):
            if kind == "markdown":
                lines += [text, ""]
                continue
            lines += ["```python", text, "```", ""]
            printed, pictures = run(text, names) if run_cells else ("", [])
            if printed:
                lines += ["```{code-block} text", ":class: output", "", printed.rstrip(), "```", ""]
            for picture in pictures:
                data = b64encode(picture).decode()
                lines += [f'<img src="data:image/png;base64,{data}" alt="What the cell shows">', ""]
    lines += [f"[Download this notebook](../examples/notebooks/{notebook.name})"]
    return "\n".join(lines) + "\n"
