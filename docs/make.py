"""Bring the pages of the manual and the stub up to date:
python3 dev.py docs [--text] [--laws] [--pictures [NAME ...]]

Some files are written anew as a whole: the stubs of gonio and its namespaces, docs/formats.md, and all in docs/models/
but docs/models/choose.md. In pages written by hand only the text between <!-- made: NAME --> and <!-- end --> is.

Verdicts on docs/models/laws.md and pictures of models are made where they are missing, for they take seconds each;
those of former models are removed. --text leaves pictures alone; --laws makes every verdict anew; --pictures the
pictures of the models named, or every picture of the manual.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import light_page
import model_pages
import stubs

import gonio as gn
from gonio.base.light import Light
from gonio.declared import discover
from gonio.declared.contents import Folder
from gonio.declared.namespace import namespaces
from gonio.facts.format_table import as_page, format_table
from gonio.formats import formats
from gonio.formula.maskings import MASKINGS
from gonio.laws import LAWS, MODULES

DOCS = Path(__file__).resolve().parent
BY_HAND = ("choose.md",)
"""Pages in docs/models/ that are written by hand."""


def counts() -> str:
    """The number of models, lights, formats ..."""
    words = ("models", "distributions of facet normals", "Fresnel terms")
    numbers = {word: len(classes) for word, classes in zip(words, model_pages.kinds().values(), strict=True)}
    numbers |= {"maskings": len(MASKINGS), "lights": len(discover.classes("gonio.lights", Light))}
    numbers |= {"file formats": len(formats()), "laws": len(LAWS), "built-in materials": len(gn.materials())}
    return ", ".join(f"{number} {name}" for name, number in numbers.items()) + ".\n"


def laws() -> str:
    """The table of the laws: what is measured, the tolerance and its reason."""
    lines = ["| law | measured | holds if | why this tolerance |", "|---|---|---|---|"]
    labels = ("Measured", "Holds if", "Tolerance")
    for name, module in MODULES.items():
        parts = discover.labelled(discover.docstring(module), labels)
        cells = [model_pages.markdown(" ".join(parts[label].split())) for label in labels]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def contents() -> str:
    """All public names on one screen."""
    modules = {name: module for name, module in namespaces() if "." not in name}
    lists = [name for name in gn.__all__ if isinstance(getattr(gn, name), Folder)]
    classes = [name for name in gn.__all__ if isinstance(getattr(gn, name), type)]
    kinds = model_pages.kinds() | {"Lights": discover.classes("gonio.lights", Light)}
    rows = [("every day", [n for n in gn.__all__ if n not in (*modules, *lists, *classes, "errors")])]
    rows += [(f"`gn.{name}`", module.__all__) for name, module in modules.items()]
    rows += [(title, list(of)) for title, of in kinds.items()]
    left = {*classes} - {name for _, of in rows for name in of}
    rows += [("other classes", sorted(left)), ("lists, and modules", [*lists, "errors"])]
    cells = (
        f"| {title} | {', '.join(f'`{name}`' for name in sorted(names, key=str.lower))} |" for title, names in rows
    )
    return "\n".join(["| | |", "|---|---|", *cells]) + "\n"


BLOCKS: dict[str, tuple[Path, Callable[[], str]]] = {
    "contents": (DOCS / "conventions.md", contents),
    "counts": (DOCS.parent / "README.md", counts),
    "laws": (DOCS / "check.md", laws),
    "shapes": (DOCS / "light.md", light_page.shapes),
    "lights": (DOCS / "light.md", light_page.text),
}
"""Blocks in pages written by hand: name -> page, and the function that makes the text."""


def pages(anew: bool = False) -> dict[Path, str]:
    """Every page that is made, as a whole or in part: path -> text. `anew`: every verdict too."""
    models, laws_page = DOCS / "models", DOCS / "models" / "laws.md"
    texts = {DOCS / "formats.md": as_page(format_table())} | stubs.pages()
    texts |= {models / name: text for name, text in model_pages.pages().items()}
    present = laws_page.read_text(encoding="utf-8") if laws_page.exists() and not anew else ""
    texts[laws_page] = model_pages.lawful(present)
    for name, (path, text) in BLOCKS.items():
        head, end = f"<!-- made: {name} -->\n", "<!-- end -->"
        page = texts[path] if path in texts else path.read_text(encoding="utf-8")
        before, _, rest = page.partition(head)
        texts[path] = f"{before}{head}{text()}{end}{rest.partition(end)[2]}"
    return texts


def stale() -> list[Path]:
    """Pages and pictures of classes that no longer exist."""
    texts, classes = pages(), {name for kind in model_pages.kinds().values() for name in kind}
    models = DOCS / "models"
    old = [path for path in models.glob("*.md") if path not in texts and path.name not in BY_HAND]
    return old + [path for path in (models / "pictures").glob("*.jpg") if path.stem not in classes]


def main(words: list[str]) -> None:
    """Write the pages that have changed, and print their names."""
    for path, text in pages(anew="--laws" in words).items():
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
            print(f"written: {path.relative_to(DOCS.parent)}")
    for path in stale():
        path.unlink()
        print(f"deleted: {path.relative_to(DOCS.parent)}")
    if "--text" in words:
        return
    named = [word for word in words if word[:2] != "--"]
    model_pages.draw(DOCS / "models" / "pictures", named, anew="--pictures" in words)
    if "--pictures" in words and not named:
        for script in ("make.py", "lights.py", "fluorescence.py"):
            subprocess.run([sys.executable, str(DOCS / "pictures" / script)], check=True)
        for script in ("figures/make.py", "figures/repair.py", "figures/fits.py"):
            subprocess.run([sys.executable, str(DOCS / script)], check=True)


if __name__ == "__main__":
    main(sys.argv[1:])
