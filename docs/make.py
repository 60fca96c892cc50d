"""Bring up to date what the manual and type checkers are told of the package:
python3 dev.py docs [--text] [--laws] [--pictures [NAME ...]]

Files that hold nothing but what the package says are written anew: src/gonio/__init__.pyi, docs/formats.md, and all in
docs/models/ but docs/models/choose.md. In pages written by hand it is what stands between <!-- made: NAME --> and
<!-- end -->.

Verdicts on docs/models/laws.md and pictures of models are made where they are missing, for they take seconds each;
what belongs to no model any more goes. --text leaves pictures alone; --laws makes every verdict anew; --pictures the
pictures of the models named, or every picture of the manual.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import model_pages
import stubs

import gonio as gn
from gonio import discover
from gonio.base.light import Light
from gonio.formats import formats
from gonio.formula.maskings import MASKINGS
from gonio.laws import LAWS, MODULES
from gonio.report.format_table import as_page, format_table

DOCS = Path(__file__).resolve().parent
BY_HAND = ("choose.md",)
"""Pages in docs/models/ that nothing makes."""


def counts() -> str:
    """How many there are of each kind."""
    words = ("models", "distributions of facet normals", "Fresnel terms")
    kinds = {word: len(classes) for word, classes in zip(words, model_pages.kinds().values(), strict=True)}
    kinds |= {"maskings": len(MASKINGS), "lights": len(discover.classes("gonio.lights", Light))}
    kinds |= {"file formats": len(formats()), "laws": len(LAWS), "built-in materials": len(gn.materials())}
    return ", ".join(f"{count} {name}" for name, count in kinds.items()) + ".\n"


def laws() -> str:
    """What each law measures, as a table."""
    lines = ["| law | measured | holds if | why this tolerance |", "|---|---|---|---|"]
    for name, module in MODULES.items():
        said = discover.labelled(discover.docstring(module), ("Measured", "Holds if", "Tolerance"))
        cells = [" ".join(said[label].split()) for label in ("Measured", "Holds if", "Tolerance")]
        lines.append(f"| {name} | {' | '.join(map(model_pages.markdown, cells))} |")
    return "\n".join(lines) + "\n"


BLOCKS: dict[str, tuple[str, Callable[[], str]]] = {
    "counts": ("../README.md", counts),
    "laws": ("check.md", laws),
}
"""What is made in pages written by hand: name -> page, and function."""


def pages(anew: bool = False) -> dict[Path, str]:
    """Every page that is made, or of which a part is: path -> text. `anew`: every verdict too."""
    models = DOCS / "models"
    made = {DOCS / "formats.md": as_page(format_table()), stubs.PAGE: stubs.text()}
    made |= {models / name: text for name, text in model_pages.pages().items()}
    laws_page = models / "laws.md"
    known = laws_page.read_text(encoding="utf-8") if laws_page.exists() and not anew else ""
    made[laws_page] = model_pages.lawful(known)
    for name, (page, text) in BLOCKS.items():
        path = (DOCS / page).resolve()
        head, end = f"<!-- made: {name} -->\n", "<!-- end -->"
        before, _, rest = path.read_text(encoding="utf-8").partition(head)
        made[path] = f"{before}{head}{text()}{end}{rest.partition(end)[2]}"
    return made


def stale() -> list[Path]:
    """Pages and pictures of what is no longer there."""
    made, classes = pages(), {name for kind in model_pages.kinds().values() for name in kind}
    models = DOCS / "models"
    old = [path for path in models.glob("*.md") if path not in made and path.name not in BY_HAND]
    return old + [path for path in (models / "pictures").glob("*.jpg") if path.stem not in classes]


def main(words: list[str]) -> None:
    """Write what has changed, and say so."""
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
        for script in ("pictures/make.py", "figures/make.py", "figures/repair.py"):
            subprocess.run([sys.executable, str(DOCS / script)], check=True)


if __name__ == "__main__":
    main(sys.argv[1:])
