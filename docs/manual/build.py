"""Build the manual as web pages: python3 dev.py manual [--draft]

The pages of the repository are laid out in build/manual/source, with links as they are there, and beside them the pages
that are made: the reference, from docstrings, and the notebooks, which are run. Sphinx runs the examples, and writes
build/manual/html. A warning is an error. --draft runs neither notebooks nor examples.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import notebooks
import reference

HERE = Path(__file__).resolve().parent
DOCS, ROOT = HERE.parent, HERE.parents[1]
BUILD = ROOT / "build" / "manual"

LINK = re.compile(r"(?<=\]\()[^)\s]+(?=\))|(?<=src=\")[^\"]+(?=\")")
CARDS = re.compile(r"^\| \| \| \|\n(?:^\|.*\n)+", re.MULTILINE)
FENCED = re.compile(r"(^ *```.*?^ *```$)", re.MULTILINE | re.DOTALL)


def sources() -> dict[Path, str]:
    """Pages of the repository -> their place in the manual."""
    pages = {page: page.relative_to(DOCS).as_posix() for page in sorted(DOCS.rglob("*.md"))}
    pages |= {page: page.name for page in sorted(ROOT.glob("*.md")) if page.name != "README.md"}
    return pages | {page: f"examples/{page.name}" for page in sorted(ROOT.glob("examples/*.md"))}


def place(path: Path) -> str:
    """Where a file of the repository lies in the manual."""
    if path == ROOT / "README.md":
        return "index.md"
    return path.relative_to(DOCS if path.is_relative_to(DOCS) else ROOT).as_posix()


def relinked(text: str, page: Path, files: set[Path]) -> str:
    """A page's text with links to where the manual has their files, which are added to `files`."""

    def moved(link: re.Match[str]) -> str:
        path, mark, anchor = link[0].partition("#")
        target = (page.parent / path).resolve() if path and ":" not in path else page
        if target == page or not target.is_file() or not target.is_relative_to(ROOT):
            return link[0]
        files.add(target)
        return os.path.relpath(place(target), os.path.dirname(place(page)) or ".").replace(os.sep, "/") + mark + anchor

    pieces = FENCED.split(text)
    return "".join(LINK.sub(moved, piece) if k % 2 == 0 else piece for k, piece in enumerate(pieces))


def carded(text: str) -> str:
    """A page's text, with tables of link, picture and sentence marked for the style sheet to show as cards."""
    return CARDS.sub(lambda rows: f"```{{table}}\n:class: cards\n\n{rows[0]}```\n", text)


MODELS = """
```{toctree}
:hidden:
:glob:

choose
laws
[A-Z]*
```
"""
"""The pages below that of all models."""


def write(path: Path, text: str) -> None:
    """Write a file, unless it is as it should be: Sphinx reads again what is newer."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def stage(source: Path, draft: bool) -> bool:
    """Lay out all that Sphinx reads; what is no longer there goes. Whether there are other files than before."""
    texts, files = dict[str, str](), set(notebooks.ALL)
    for page, name in sources().items():
        texts[name] = carded(relinked(page.read_text(encoding="utf-8"), page, files))
    texts["models/README.md"] += MODELS
    texts |= reference.pages()
    texts |= {f"notebooks/{path.stem}.md": notebooks.page(path, run_cells=not draft) for path in notebooks.ALL}
    texts["programs/GALLERY_HEADER.rst"] = (HERE / "gallery.rst").read_text(encoding="utf-8")
    copies = {place(path): path for path in files if place(path) not in texts}
    copies |= {f"programs/{path.name}": path for path in ROOT.glob("examples/plot_*.py")}
    data = {path for path in ROOT.glob("examples/*.*") if path.suffix not in (".md", ".py")}
    copies |= {f"programs/examples/{path.name}": path for path in data}  # where programs look for them
    before = {path.relative_to(source).as_posix() for path in source.rglob("*") if path.is_file()}
    before = {name for name in before if not name.startswith("gallery/")}
    for name in before - set(texts) - set(copies):
        (source / name).unlink()
    for name, text in texts.items():
        write(source / name, text)
    for name, path in copies.items():
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, source / name)
    return before != set(texts) | set(copies)


def main(words: list[str]) -> int:
    """Build; the exit status is Sphinx's."""
    start, draft = time.monotonic(), "--draft" in words
    source, html = BUILD / "source", BUILD / "html"
    source.mkdir(parents=True, exist_ok=True)
    if stage(source, draft):
        shutil.rmtree(BUILD / "doctrees", ignore_errors=True)  # links of pages that are as they were lead elsewhere
    command = [sys.executable, "-m", "sphinx", "-q", "-n", "-W", "--keep-going", "-b", "html", "-c", str(HERE)]
    command += ["-D", "plot_gallery=0"] if draft else []
    done = subprocess.run([*command, "-d", str(BUILD / "doctrees"), str(source), str(html)])
    if done.returncode == 0:
        print(f"{html / 'index.html'}, in {time.monotonic() - start:.0f} s")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
