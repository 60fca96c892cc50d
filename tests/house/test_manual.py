"""The manual as web pages: every page has its place, every public name is explained, examples run, it builds.

The pages themselves, their blocks and their links are held to the truth by test_docs.py.
"""

import json
import os
import re
import subprocess
import sys
from importlib.util import find_spec
from runpy import run_path

import pytest
from places import ROOT

import gonio as gn
from gonio.declared.namespace import namespaces

pytestmark = pytest.mark.texts

DOCS = ROOT / "docs"
TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ENTRY = re.compile(r"^(?:.* <)?([\w./*\[\]-]+)>?$", re.MULTILINE)
PROGRAMS = sorted((ROOT / "examples").glob("plot_*.py"))
NEEDED = ("sphinx", "pydata_sphinx_theme", "myst_parser", "sphinx_gallery", "latex2mathml")


@pytest.fixture
def manual(monkeypatch):
    """The folder of what builds the manual, to import from."""
    monkeypatch.syspath_prepend(DOCS / "manual")


@pytest.fixture
def notebooks(manual):
    import notebooks

    return notebooks


@pytest.fixture
def reference(manual):
    import reference

    return reference


def test_the_settings_import(manual):
    settings = run_path(str(DOCS / "manual" / "conf.py"))
    assert settings["version"] == gn.__version__ and settings["html_theme"] == "pydata_sphinx_theme"


def test_every_page_is_in_a_table_of_contents(manual):
    import build

    pages = {name.removesuffix(".md") for name in build.sources().values()}
    listed = {"index"}
    for page, name in build.sources().items():
        texts = page.read_text(encoding="utf-8") + (build.MODELS if name == "models/README.md" else "")
        for block in TOCTREE.findall(texts):
            folder = name.rpartition("/")[0]
            for entry in ENTRY.findall(block):
                path = os.path.normpath(os.path.join(folder, entry))
                pattern = re.escape(path).replace(r"\*", "[^/]*").replace(r"\[A\-Z\]", "[A-Z]")
                listed |= {each for each in pages if re.fullmatch(pattern, each)}
    assert pages - listed == set(), "name it in a toctree of docs/guide.md, docs/how-to.md or docs/more.md"


def test_links_of_the_pages_are_those_of_the_manual(manual):
    import build

    files = set()
    page = DOCS / "models" / "choose.md"
    text = "[a](../../CONTRIBUTING.md#a-light) [b](../../benchmarks/fits.txt) [c](Ward.md) [d](https://e.org/f.md)"
    moved = build.relinked(text, page, files)
    assert moved == "[a](../CONTRIBUTING.md#a-light) [b](../benchmarks/fits.txt) [c](Ward.md) [d](https://e.org/f.md)"
    assert ROOT / "benchmarks" / "fits.txt" in files
    assert build.relinked("```\n[a](../../README.md)\n```\n", page, files) == "```\n[a](../../README.md)\n```\n"


def test_every_public_name_is_explained(reference):
    explained = {name for group in reference.groups().values() if group.module == "gonio" for name in group.names}
    modules = {group.title.removeprefix("gonio.") for group in reference.groups().values()}
    assert set(gn.__all__) - explained - modules == set()
    groups = {group.module: {*group.names} for group in reference.groups().values()}
    for name, module in namespaces():
        assert {n for n in module.__all__ if callable(getattr(module, n))} - groups[f"gonio.{name}"] == set()
    entry = re.compile(r"^\.\. (?:auto\w+:: gonio\.|py:function:: )(\w+)(?:\(\))?$", re.MULTILINE)
    assert explained - set(entry.findall("\n".join(reference.pages().values()))) == set()


def test_methods_of_private_bases_are_explained_with_the_class(reference):
    assert {"f", "pdf", "sample", "jacobian", "replace"} <= set(reference.members(gn.Reflectance))
    assert "f" not in set(reference.members(gn.Microfacet))  # those of gn.Reflectance are explained there


def test_docstrings_become_paragraphs_arguments_and_fields(manual):
    import docstrings

    text = """Rough mirror: f = D(wm) |wi|^2 * k_s.

    `data`: arrays, or
    a path.
    `loss`: see `Fit`.

        alpha   slope
                scale

    Units    f: 1/sr;
             angles: rad.

    Example
    >>> 1 + 1
    2
    """
    lines = "\n".join(docstrings.as_rst(text))
    assert r"f = D(wm) \|wi\|^2 \* k\_s." in lines
    assert "``data``\n   arrays, or a path." in lines and ":py:obj:`Fit <gonio.results.Fit>`" in lines
    assert "``alpha``\n   slope scale" in lines
    assert ":Units: f: 1/sr; angles: rad." in lines
    assert ".. code-block:: pycon\n\n   >>> 1 + 1\n   2" in lines
    assert docstrings.signature(gn.fit)[0].startswith("(data: Any, model: Reflectance, loss: str | None = None, *, ")
    assert "starts: int | None = None" in docstrings.signature(gn.fit)[0]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_programs_are_short_and_draw_a_picture(program, tmp_path):
    assert len(program.read_text(encoding="utf-8").splitlines()) <= 30
    (tmp_path / "examples").symlink_to(ROOT / "examples", target_is_directory=True)
    environment = {**os.environ, "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT / "src"), "PYTHONIOENCODING": "utf-8"}
    command = [sys.executable, "-W", "error", str(program)]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    (picture,) = tmp_path.glob("*.png")
    assert picture.stem == program.stem.removeprefix("plot_") and picture.stat().st_size > 10_000


def test_there_are_programs_and_notebooks(notebooks):
    assert len(PROGRAMS) >= 5 and len(notebooks.ALL) >= 3


NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run_and_keep_no_output(path, notebooks):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells if cell["cell_type"] == "code")
    page = notebooks.page(path)  # an exception in a cell is one here
    assert page.startswith("# ") and page.count("data:image/png") >= 1 and page.count(":class: output") >= 2


@pytest.mark.full
@pytest.mark.skipif(any(find_spec(name) is None for name in NEEDED), reason="pip install 'gonio[docs]' brings Sphinx")
def test_the_manual_builds_without_a_warning(manual, monkeypatch, tmp_path, capfd):
    import build

    monkeypatch.setattr(build, "BUILD", tmp_path)
    assert build.main([]) == 0, capfd.readouterr().err
    html = tmp_path / "html"
    pages = {path: path.read_text(encoding="utf-8") for path in html.rglob("*.html")}
    assert len(pages) > 150 and (html / "searchindex.js").stat().st_size > 100_000
    asked = re.compile(r"""(?:<(?:script|img|link|iframe)\b[^>]*?(?:src|href)=|@import |url\()["']?(?:https?:)?//""")
    outside = {path.name: found[0] for path, text in pages.items() if (found := asked.search(text))}
    outside |= {p.name: f[0] for p in html.rglob("*.css") if (f := asked.search(p.read_text(encoding="utf-8")))}
    assert not outside, "pages ask for nothing on the network"
