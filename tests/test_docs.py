"""The manual runs: its Python blocks, the values they print, and the names, links and figures it mentions.

A block is run as it stands, all blocks of a page in one process; "```python notest" is left out. Where a comment follows
a print, as in `print(f"{x:.3f}")  # 0.125`, or the loop that it ends, it must be what is printed. A block that starts with `# src/gonio/...py` is a new file of the package: it is put into
a copy of gonio, which the page's other blocks then use. One that starts with `# tests/models.py` holds rows of REFERENCE.
"""

import os
import re
import shutil
import subprocess
import sys
from functools import reduce
from pathlib import Path

import pytest

import gonio as gn

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = Path(gn.__file__).resolve().parent
PAGES = [
    p
    for p in (*sorted((ROOT / "docs").glob("*.md")), ROOT / "CONTRIBUTING.md", ROOT / "README.md")
    if p.exists()
]

BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ANY_BLOCK = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
ROWS = "# tests/models.py"
NEW_FILE = re.compile(r"# src/gonio/(\S+\.py)\n")
PRINTED = re.compile(r"^ *print\(.*\)  # (.+)$|^ +print\(.*\)\n((?:# .*\n)+)", re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)|(?:src|href)=\"([^\"]+)\"")
NAME = re.compile(r"\bgn((?:\.[A-Za-z_]\w*)+)")
MODULE = re.compile(r"`((?:\w+/)*\w+\.py)`")


def by_name(page: Path) -> str:
    return page.name


def new_files(page: Path) -> dict[str, str]:
    """The package's files that a page shows -> their text."""
    blocks = (m.group(1) for m in BLOCK.finditer(page.read_text(encoding="utf-8")))
    return {head.group(1): block for block in blocks if (head := NEW_FILE.match(block))}


def script(page: Path) -> str:
    """The page as a program: its blocks at their own line numbers, all else left out."""
    text = page.read_text(encoding="utf-8")
    lines = [""] * (text.count("\n") + 1)
    for block in BLOCK.finditer(text):
        if not NEW_FILE.match(block.group(1)):
            first = text.count("\n", 0, block.start(1))
            body = block.group(1).splitlines()
            if body[0] == ROWS:
                body[0] = "import pytest; from models import *; rows = ["
                body.append(
                    "]; assert all(r.value(r.made) == pytest.approx(r.expected, r.relative) for r in rows)"
                )
            lines[first : first + len(body)] = body
    return "\n".join(lines)


def told(program: str) -> list[str]:
    """What the comments of a program say that it prints, line by line."""
    found = [one or several for one, several in PRINTED.findall(program)]
    return [line.removeprefix("# ") for part in found for line in part.splitlines()]


def slugs(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    text = ANY_BLOCK.sub("", page.read_text(encoding="utf-8"))
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def test_there_is_a_manual():
    assert ROOT / "docs" / "equations.md" in PAGES


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_page_runs(page, tmp_path):
    home, work = PACKAGE.parent, tmp_path / "work"
    work.mkdir()
    if files := new_files(page):
        home = tmp_path / "package"
        shutil.copytree(PACKAGE, home / "gonio", ignore=shutil.ignore_patterns("__pycache__"))
        for name, text in files.items():
            (home / "gonio" / name).write_text(text, encoding="utf-8")
    program = tmp_path / page.with_suffix(".py").name
    program.write_text(script(page), encoding="utf-8")
    environment = {
        **os.environ,
        "PYTHONPATH": f"{home}{os.pathsep}{ROOT / 'tests'}",
        "MPLBACKEND": "Agg",
        "PYTHONIOENCODING": "utf-8",
    }
    command = [sys.executable, "-W", "error", str(program)]
    done = subprocess.run(command, cwd=work, env=environment, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, f"line numbers are those of {page.name}\n{done.stderr}"
    lines = iter(done.stdout.splitlines())
    wrong = [line for line in told(program.read_text(encoding="utf-8")) if line not in lines]
    assert not wrong, f"{page.name} tells otherwise; printed was\n{done.stdout}"


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_names_exist(page):
    own = {
        name for text in new_files(page).values() for name in re.findall(r"^class (\w+)", text, re.MULTILINE)
    }
    for path in sorted(set(NAME.findall(page.read_text(encoding="utf-8")))):
        names = path[1:].split(".")
        if names[0] not in own:
            reduce(getattr, names, gn)  # AttributeError names what is missing


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_links_lead_somewhere(page):
    for groups in LINK.findall(ANY_BLOCK.sub("", page.read_text(encoding="utf-8"))):
        link = "".join(groups)
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{page.name}: {link}: no such file"
        assert not anchor or anchor in slugs(target), f"{page.name}: {link}: no such heading"


def test_every_equation_has_a_heading():
    headings = re.findall(
        r"^#+ (.*)$", (ROOT / "docs" / "equations.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    numbers = {n for h in headings for n in re.findall(r"\b[RS] (\d\.[\d.]*\d)\b", h)}
    wanted = {f"4.{i}" for i in range(1, 12)} | {"4.1.3", "4.1.5"} | {f"2.{i}" for i in range(81, 86)}
    assert wanted - numbers == set()


def test_figures_are_small_and_shown():
    shown = "".join(p.read_text(encoding="utf-8") for p in PAGES)
    maker = ROOT / "docs" / "figures" / "make.py"
    figures = [p for p in maker.parent.iterdir() if p.suffix in (".svg", ".png")]
    assert {p.stem for p in figures} >= set(re.findall(r'save\(figure, "(\w+)"\)', maker.read_text()))
    for figure in figures:
        assert f"figures/{figure.name}" in shown, f"{figure.name}: on no page"
        assert figure.stat().st_size < 150_000, figure.name


def test_architecture_names_every_module():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = {n for n in MODULE.findall(text) if not n.startswith(("tests/", "docs/", "dev"))}
    files = {p.relative_to(PACKAGE).as_posix() for p in PACKAGE.rglob("*.py")}
    public = {n for n in files if not Path(n).name.startswith("_")}
    assert named - files == set(), "named, but not there"
    assert public - named == set(), "there, but not named"
