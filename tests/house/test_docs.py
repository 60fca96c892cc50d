"""The manual runs: its Python blocks, the values they print, and the names, links, paths and figures it mentions.

A block is run as it stands, all blocks of a page as one program; "```python notest" is left out. Comments
behind or below a `print` say what it prints, and are held to it. A block starting with `# src/gonio/...py` is
a new file of the package: it is put into a copy of gonio, which the page's other blocks then use. One that
starts with `# tests/tools/materials.py` holds rows of its table REFERENCE. The lines of "```sh" blocks that
call `gonio`, `cc` or `./` run too, and are held to the comments below them.
"""

import ast
import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tokenize
from functools import reduce
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from places import PACKAGE, ROOT
from test_rooms import ROOMS

import gonio as gn

pytestmark = pytest.mark.texts

EQUATIONS, ARCHITECTURE = ROOT / "docs" / "equations.md", ROOT / "docs" / "architecture.md"
FIGURES = ROOT / "docs" / "figures"

BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ANY_BLOCK = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
NEW_FILE = re.compile(r"# src/gonio/(\S+\.py)\n")
NEEDED = re.compile(r"^import (torch|jax)$", re.MULTILINE)
ROWS = "# tests/tools/materials.py"
PRINTED = re.compile(r"^ *print\(.*\)(?:  # (.+)\n|\n((?:# .*\n)+))", re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s]+)\)|(?:src|href)=\"([^\"]+)\"")
NAME = re.compile(r"\bgn((?:\.[A-Za-z_]\w*)+)")
PATH = re.compile(
    r"(?<![\w./:<~*{-])((?:[A-Za-z_][\w-]*/)*[A-Za-z_][\w-]*\.(?:pyi?|md|txt|bib|tsv|toml)|(?:[a-z_]\w+/)+(?=[^\w(<{*\\]|$))"
)
ROOM = re.compile(r"^\| `(\w+)/`", re.MULTILINE)


def read(page: Path) -> str:
    return page.read_text(encoding="utf-8")


PAGES = {page.name: page for folder in (ROOT / "docs", ROOT) for page in sorted(folder.glob("*.md"))}
PAGES |= {
    f"{page.parent.name}/{page.name}": page
    for folder in ("how-to", "coming-from")
    for page in sorted((ROOT / "docs" / folder).glob("*.md"))
}
MODELS = {f"models/{page.name}": page for page in sorted((ROOT / "docs" / "models").glob("*.md"))}
PAGES["models/choose.md"] = MODELS.pop("models/choose.md")
each_page = pytest.mark.parametrize("page", PAGES.values(), ids=PAGES)
every_page = pytest.mark.parametrize("page", [*PAGES.values(), *MODELS.values()], ids=[*PAGES, *MODELS])


def new_files(page: Path) -> dict[str, str]:
    """The package's files that a page shows -> their text."""
    blocks = (block.group(1) for block in BLOCK.finditer(read(page)))
    return {head.group(1): text for text in blocks if (head := NEW_FILE.match(text))}


def program(page: Path) -> str:
    """The page's blocks at their own line numbers, all else left out, and those that import PyTorch or JAX where it is
    not installed."""
    text = read(page)
    lines = [""] * (text.count("\n") + 1)
    for block in BLOCK.finditer(text):
        needed = NEEDED.findall(block.group(1))
        if NEW_FILE.match(block.group(1)) or any(find_spec(name) is None for name in needed):
            continue
        first = text.count("\n", 0, block.start(1))
        body = block.group(1).splitlines()
        if body[0] == ROWS:  # the fence below the rows makes room for their test
            body[0] = "from materials import *; from pytest import approx; rows = ["
            body.append("]; assert all(r.value(r.made) == approx(r.expected, r.relative) for r in rows)")
        lines[first : first + len(body)] = body
    return "\n".join(lines) + "\n"


def told(text: str) -> list[str]:
    """What the comments of a program say that it prints, line by line."""
    found = [behind or below for behind, below in PRINTED.findall(text)]
    return [line.removeprefix("# ") for part in found for line in part.splitlines()]


def slugs(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    headings = HEADING.findall(ANY_BLOCK.sub("", read(page)))
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def test_the_equations_are_there():
    assert EQUATIONS.name in PAGES


@each_page
def test_page_runs(page, tmp_path):
    home, work, file = PACKAGE.parent, tmp_path / "work", tmp_path / f"{page.stem}.py"
    shutil.copytree(ROOT / "examples", work / "examples")  # pages are read in a clone
    if added := new_files(page):
        home = tmp_path / "package"
        shutil.copytree(PACKAGE, home / "gonio", ignore=shutil.ignore_patterns("__pycache__"))
        for name, text in added.items():
            (home / "gonio" / name).write_text(text, encoding="utf-8")
    file.write_text(program(page), encoding="utf-8")
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(map(str, (home, ROOT / "tests" / "tools"))),
        "PYTHONIOENCODING": "utf-8",
        "MPLBACKEND": "Agg",
    }
    command = [sys.executable, "-W", "error", str(file)]
    done = subprocess.run(command, cwd=work, env=environment, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, f"line numbers are those of {page.name}\n{done.stderr}"
    lines = iter(done.stdout.splitlines())
    wrong = [line for line in told(program(page)) if line not in lines]
    assert not wrong, f"{page.name} says {wrong[0]!r}; printed was\n{done.stdout}"


@every_page
def test_names_exist(page):
    own = set(re.findall(r"^(?:class|def) (\w+)", "\n".join(new_files(page).values()), re.MULTILINE))
    for path in sorted(set(NAME.findall(read(page)))):
        names = path[1:].split(".")
        if names[0] not in own:
            reduce(getattr, names, gn)  # AttributeError names what is missing


def test_names_in_the_guide_exist():
    """Those of classes in the tables, which no block runs."""
    named = re.findall(r"`([A-Z][a-z]\w+|[A-Z]{2,}\w*)(?=[(`])", ANY_BLOCK.sub("", read(PAGES["models/choose.md"])))
    assert len(named) > 20 and set(named) <= set(dir(gn)), set(named) - set(dir(gn))


@every_page
def test_links_lead_somewhere(page):
    for groups in LINK.findall(ANY_BLOCK.sub("", read(page))):
        link = "".join(groups)
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{page.name}: {link}: no such file; python3 dev.py docs draws a model's picture"
        assert not anchor or anchor in slugs(target), f"{page.name}: {link}: no such heading"


def test_every_equation_has_a_heading():
    numbers = {n for h in HEADING.findall(read(EQUATIONS)) for n in re.findall(r"\b[RS] (\d\.[\d.]*\d)\b", h)}
    wanted = {f"4.{i}" for i in range(1, 12)} | {"4.1.3", "4.1.5"} | {f"2.{i}" for i in range(81, 86)}
    assert wanted - numbers == set()


def test_figures_are_small_and_shown():
    shown = "".join(map(read, PAGES.values()))
    figures = [p for p in FIGURES.iterdir() if p.suffix in (".svg", ".png")]
    assert {p.stem for p in figures} >= set(re.findall(r'save\(figure, "(\w+)"\)', read(FIGURES / "make.py")))
    for figure in figures:
        assert f"figures/{figure.name}" in shown, f"{figure.name}: on no page"
        assert figure.stat().st_size < 150_000, figure.name


def spoken(path: Path) -> str:
    """What a page says outside of its code, or a module in docstrings and comments."""
    if path.suffix == ".md":
        return ANY_BLOCK.sub("", read(path)).replace("\\_", "_")
    text = read(path)
    alone = [n.value for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Expr)]
    comments = [t.string for t in tokenize.generate_tokens(io.StringIO(text).readline) if t.type == tokenize.COMMENT]
    return "\n".join([*(str(s.value) for s in alone if isinstance(s, ast.Constant)), *comments])


def test_paths_lead_somewhere():
    """Files and folders that texts name are in the root, the package, the text's folder or the one around it."""
    texts = [
        *PAGES.values(),
        *MODELS.values(),
        *PACKAGE.rglob("*.py"),
        *ROOT.glob("docs/**/*.py"),
        *ROOT.glob("benchmarks/*.py"),
    ]
    nowhere = [
        f"{text.relative_to(ROOT)}: {path}"
        for text in texts
        if text.name != "CHANGELOG.md"  # which says what was
        for path in sorted(set(PATH.findall(spoken(text))))
        if not any((base / path).exists() for base in (ROOT, PACKAGE, text.parent, text.parent.parent))
    ]
    assert not nowhere


def test_architecture_lists_the_rooms():
    assert tuple(ROOM.findall(read(ARCHITECTURE))) == tuple(room for room in ROOMS if room)


@pytest.fixture
def make(monkeypatch):
    """docs/make.py."""
    monkeypatch.syspath_prepend(ROOT / "docs")
    import make

    return make


def test_the_manual_says_what_the_package_says(make):
    for path, text in make.pages().items():
        assert read(path) == text, f"{path.relative_to(ROOT)} is behind the package: python3 dev.py docs"
    assert make.stale() == [], "of nothing that is there: python3 dev.py docs"
    for line in re.findall(r"^m = (.*)$", "\n".join(map(read, MODELS.values())), re.MULTILINE):
        f = gn.expression(line.replace("gn.", "")).f([0.6, 0.0, 0.8], [0.0, 0.6, 0.8])
        assert np.all(f >= 0.0), line


def test_pictures_of_models_are_small_and_shown():
    shown = "".join(map(read, MODELS.values()))
    for picture in (ROOT / "docs" / "models" / "pictures").iterdir():
        assert f"pictures/{picture.name}" in shown, f"{picture.name}: on no page"
        assert picture.stat().st_size < 60_000, picture.name


SHELL = re.compile(r"^(gonio .*?)(?: +#.*)?$", re.MULTILINE)
SLOW = ("check", "show", "render", "report")


def commands() -> list:
    """The lines of the README that call `gonio`; pictures and laws, which take seconds each, are `full`."""
    lines = SHELL.findall("\n".join(re.findall(r"^```sh\n(.*?)^```$", read(ROOT / "README.md"), re.M | re.S)))
    return [pytest.param(x, marks=pytest.mark.full if x.split()[1] in SLOW else (), id=x) for x in lines]


@pytest.mark.parametrize("line", commands())
def test_the_commands_of_the_readme_work_in_a_clone(line, tmp_path):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent), "MPLBACKEND": "Agg", "PYTHONIOENCODING": "utf-8"}
    command = [sys.executable, "-m", "gonio", *shlex.split(line)[1:]]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"


def test_the_readme_shows_commands():
    assert len(commands()) > 8


SH = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)
C_FILE = re.compile(r"^```c\n/\* (\w+\.[ch]) \*/\n(.*?)^```$", re.MULTILINE | re.DOTALL)
CALLED = re.compile(r"^((?:gonio|cc|\./\w+)(?: .*?)?)(?: +#.*)?\n((?:# .*\n)*)", re.MULTILINE)


def scripts() -> list:
    """Pages whose shell blocks call something, and what: (line, what the comments below say that it prints). Lines that
    make pictures or hold materials to the laws take seconds each: pages with such a line are `full`."""
    found = []
    for name, page in PAGES.items():
        lines = CALLED.findall("\n".join(SH.findall(read(page))) + "\n") if page.name != "README.md" else []
        slow = any(line.split()[1:2] and line.split()[1] in SLOW for line, _ in lines)
        if lines:
            found.append(pytest.param(page, lines, marks=pytest.mark.full if slow else (), id=name))
    return found


@pytest.mark.parametrize(("page", "lines"), scripts())
def test_the_commands_of_a_page_work_in_a_clone(page, lines, tmp_path):
    """In order, in one folder, with the C files that the page shows; where there is no C compiler, those of gonio."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    for name, text in C_FILE.findall(read(page)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent), "MPLBACKEND": "Agg", "PYTHONIOENCODING": "utf-8"}
    for line, comments in lines:
        program, *rest = shlex.split(line)
        if program != "gonio" and shutil.which("cc") is None:
            continue
        command = [sys.executable, "-m", "gonio", *rest] if program == "gonio" else [program, *rest]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, encoding="utf-8")
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
        printed = iter(done.stdout.splitlines())
        wrong = [said for said in comments.splitlines() if said.removeprefix("# ") not in printed]
        assert not wrong, f"{page.name} says {wrong[0]!r}; {line} printed\n{done.stdout}"


def test_pictures_of_models_differ_and_none_is_black():
    """Each shows the point of its model: the example in its docstring, under `Looks`, is chosen so."""
    image = pytest.importorskip("PIL.Image")
    small = {}
    for path in sorted((ROOT / "docs" / "models" / "pictures").iterdir()):
        with image.open(path) as picture:
            assert picture.size == (768, 348), f"{path.name}: drawn by an older gonio: python3 dev.py docs --pictures"
            small[path.stem] = np.asarray(picture.convert("RGB").resize((96, 44)), dtype=float)
    for name, codes in small.items():
        sphere = codes[12:32, 10:30]
        assert np.quantile(sphere, 0.98) > 40.0, f"{name}: black; let Looks begin with a brighter example"
    names = list(small)
    table = np.stack([small[name].ravel() for name in names])
    for k, name in enumerate(names):
        apart = np.abs(table[k] - table[k + 1 :]).mean(axis=1)
        alike = [names[k + 1 + j] for j in np.flatnonzero(apart < 1.0)]
        assert not alike, f"{name} and {alike[0]} are the same picture; let the Looks of one begin with another example"


def test_every_light_is_in_the_picture_of_the_lights(monkeypatch):
    """The picture's comment holds what was drawn: that must be what the docstrings say, of every light."""
    image = pytest.importorskip("PIL.Image")
    monkeypatch.syspath_prepend(ROOT / "docs" / "pictures")
    import lights

    again = "python docs/pictures/lights.py draws it again"
    shown = lights.examples()
    assert not [name for name, text in shown.items() if text == f"{name}()"], "Looks of its docstring shows no light"
    with image.open(lights.PICTURE) as picture:
        assert json.loads(picture.info["comment"]) == shown, again
        codes = np.asarray(picture.convert("L"), dtype=float)
    assert lights.PICTURE.stat().st_size < 120_000
    cells = [codes[lights.place(k)] for k in range(len(shown))]
    for name, cell in zip(shown, cells, strict=True):
        assert np.quantile(cell, 0.95) > 60.0, f"{name}: black; let its Looks begin with a brighter one"


def test_every_light_says_its_formula_units_and_source():
    from gonio.facts.models import sections

    for name, kind in gn.lights().items():
        if kind.__module__.startswith("gonio."):
            parts = sections(kind)
            assert {"Looks", "Units", "Source", "Example"} <= set(parts), name
            assert re.search(r"= |\$", parts[""]) or "L(w)" in parts[""], f"{name}: no formula"
