"""The versions of Python and of libraries that gonio declares, and what differs between them."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
import textwrap
import tomllib
import warnings
from importlib import import_module, resources
from runpy import run_path

import click
import numpy as np
import pytest
from places import ROOT
from rooms import MODULES, imported

import gonio as gn
from gonio.catalogue import citations
from gonio.cli import options
from gonio.errors import DependencyError
from gonio.formats import scatfun

DECLARED = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = DECLARED["project"]
EXTRAS = PROJECT["optional-dependencies"]
ALL = [*DECLARED["build-system"]["requires"], *PROJECT["dependencies"], *(r for e in EXTRAS.values() for r in e)]
BOUND = re.compile(r"([\w-]+)>=(\d+(?:\.\d+)*)")
BOUNDS = [found.groups() for r in ALL if (found := BOUND.fullmatch(r))]


def number(version: str) -> tuple[int, ...]:
    return tuple(map(int, version.split(".")))


def names(requirements: list[str]) -> set[str]:
    return {found[1].lower() for r in requirements if (found := BOUND.fullmatch(r))}


def test_every_requirement_is_a_lower_bound_said_once():
    """What `dev.py lowest` pins is all that is required: names with >=, each in one place. (D13)"""
    others = [r for r in ALL if not BOUND.fullmatch(r)]
    assert all(r.startswith("gonio[") for r in others), others
    assert len({name for name, _ in BOUNDS}) == len(BOUNDS)
    pinned = run_path(str(ROOT / "dev.py"))["lowest_versions"]()
    left_out = names(EXTRAS["lint"]) | names(EXTRAS["speed"]) | names(EXTRAS["torch"])
    assert sorted(pinned) == sorted(f"{name}=={low}" for name, low in BOUNDS if name not in left_out)


BROKEN = {
    "matplotlib": ("3.8.3", "asks for numpy < 2"),
    "h5py": ("3.10.0", "built for numpy 1: numpy.dtype size changed"),
    "zarr": ("3.0.7", "yanked, as all before it: zarr.load deletes data"),
    "xarray": ("2025.3.0", "cannot write chunks of zeros with zarr 3"),
    "click": ("8.3.3", "does not say which command was meant"),
    "pytest-xdist": ("3.6.0", "yanked"),
    "drjit": ("1.0.0", "mitsuba 3.6.0 asks for 1.0.1"),
    "ruff": ("0.6.0", "formats otherwise"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_versions_seen_to_fail_are_not_allowed(name):
    """Each of these was installed, or refused by pip, with the others in their lowest versions. (D13)"""
    version, reason = BROKEN[name]
    assert number(dict(BOUNDS)[name]) > number(version), reason


@pytest.mark.slow_because("all modules are parsed")
def test_every_library_that_is_imported_is_declared():
    """No module needs what neither the dependencies nor an extra name. (D13)"""
    found = set().union(*(imported(name)[1] for name in MODULES))
    libraries = found - set(sys.stdlib_module_names) - {"gonio"}
    called = {
        "colour": "colour-science",
        "PIL": "pillow",
    }  # where a library is not imported by the name that it is installed by
    assert {called.get(name, name.lower()) for name in libraries} <= names(ALL)
    # `pictures/files/_source.library` imports the first two by their names, uvicorn the third
    by_name = {"openexr", "pillow", "websockets"}
    assert names(PROJECT["dependencies"]) <= {name.lower() for name in libraries} | by_name


def test_every_python_that_is_declared_is_tried():
    """The classifiers, requires-python and .ci/run name the same versions of Python. (D13)"""
    declared = re.findall(r"Programming Language :: Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    tried = re.findall(r"\b3\.1\d\b", (ROOT / ".ci" / "run").read_text(encoding="utf-8"))
    assert sorted(set(tried)) == sorted(declared)
    assert PROJECT["requires-python"] == f">={declared[0]}"


def test_the_package_has_its_data_and_its_types():
    """Wherever gonio is installed: in this environment, and as a wheel in that of the lowest versions. (D13)"""
    here = resources.files("gonio")
    expected = {path.name for path in (ROOT / "src" / "gonio" / "data").iterdir()}
    assert (here / "py.typed").is_file() and expected == {path.name for path in (here / "data").iterdir()}


# Python 3.13 takes the indentation out of docstrings.

INDENTED = """A sheet.

    Shapes   f: (...).
    Source   Author and Author, A Title
             of 2 lines, doi: 10.1000/1.
    """


@pytest.mark.parametrize("text", [INDENTED, inspect.cleandoc(INDENTED)], ids=["3.11", "3.13"])
def test_a_source_is_found_in_docstrings_of_every_python(text):
    """Sources are cited the same whether Python has cleaned the docstring or not. (D13)"""
    kind = type("Sheet", (), {"__doc__": text})
    assert citations._source(kind) == "Author and Author, A Title of 2 lines, doi: 10.1000/1."


@pytest.mark.parametrize("clean", [str, inspect.cleandoc], ids=["3.11", "3.13"])
def test_help_keeps_its_lines_in_every_python(clean):
    """The table of lights in the help of `render` and `show` stays a table. (D13)"""

    def command() -> None: ...

    command.__doc__ = clean("Render a sphere.\n\n    A .png is sRGB.\n    ")
    made = click.command()(options.with_light_help(command))
    text = made.get_help(click.Context(made, info_name="render", max_content_width=80))
    assert re.search(r"^  LIGHT is one of$", text, re.MULTILINE), text
    assert re.search(r"^    studio\[:THETA,PHI\] +made up: a sun", text, re.MULTILINE), text


def test_no_docstring_is_read_as_it_is_indented():
    """Docstrings are read by `discover.docstring`, which cleans them, so that Python 3.11 and 3.13 agree. (D13)"""
    reader = ROOT / "src" / "gonio" / "declared" / "discover.py"
    for path in sorted({*(ROOT / "src").rglob("*.py"), *(ROOT / "docs").rglob("*.py")} - {reader}):
        for line in path.read_text(encoding="utf-8").splitlines():
            if re.search(r"\b(?!self|function|module)\w+\.__doc__\b(?! = (?:doc$|Docstring\())", line):
                assert " docstring(" in line, f"{path}: {line.strip()}"


# NumPy 2.5 gives the roots of a real polynomial as complex numbers.


def test_scatfun_nodes_are_real_by_construction(monkeypatch):
    """Nodes of Gauss and Lobatto's rule, without NumPy's roots, which may be complex. (D13)

    Abramowitz and Stegun 1964, table 25.6: n = 4 and n = 6, in (0, 1].
    """
    eigenvalues = np.linalg.eigvals
    monkeypatch.setattr(np.linalg, "eigvals", lambda a: eigenvalues(a).astype(complex))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert scatfun._cosines(2) == pytest.approx([0.44721360, 1.0], abs=1e-7)
        assert scatfun._cosines(3) == pytest.approx([0.28523152, 0.76505532, 1.0], abs=1e-7)


# Libraries that are not there.


@pytest.mark.parametrize("library", ["torch", "jax"])
def test_a_bridge_without_its_library_names_the_extra(library, monkeypatch):
    """`import gonio.bridges.torch` says which extra has PyTorch, in an error of gonio's. (D13)"""
    monkeypatch.delitem(sys.modules, f"gonio.bridges.{library}", raising=False)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(DependencyError, match=rf"pip install 'gonio\[{library}\]'") as caught:
        import_module(f"gonio.bridges.{library}")
    assert isinstance(caught.value, gn.Error) and isinstance(caught.value, ImportError)


@pytest.mark.parametrize(("name", "head", "extra"), [("a.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "io")])
def test_a_format_without_its_library_names_the_extra(name, head, extra, tmp_path, monkeypatch):
    """As for Zarr and HDF4, which have such tests beside their own. (D13)"""
    monkeypatch.setitem(sys.modules, "xlrd", None)
    (tmp_path / name).write_bytes(head + bytes(2000))
    with pytest.raises(DependencyError, match=rf"pip install 'gonio\[{extra}\]'"):
        gn.load(tmp_path / name)


def test_the_commands_run_without_any_extra(tmp_path):
    """Help, facts and a picture need no more than the dependencies. (D13)"""
    extras = [extra for name, extra in EXTRAS.items() if name not in ("lint", "speed")]
    optional = sorted({n for extra in extras for n in names(extra)} | {"_pytest"})
    code = f"""
        import sys
        sys.modules.update(dict.fromkeys({optional!r}))  # as if none were installed
        from gonio.cli.commands import main
        for line in ("--help", "info gold", "render gold -o a.png --size 16 --samples 1"):
            sys.argv = ["gonio", *line.split()]
            try:
                main()
            except SystemExit as done:
                assert not done.code, line
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0 and not done.stderr, done.stderr
    assert (tmp_path / "a.png").is_file()


def test_what_python_will_change_is_not_relied_on(tmp_path):
    """From Python 3.12 on, asking an XML element whether it is true warns: a file with a Material is read. (D13)"""
    m = gn.tables.tabulate(gn.Lambertian(0.5))
    gn.convert(m, tmp_path / "a.xml", "WINDOW XML")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        held = gn.load(tmp_path / "a.xml")
    assert "Material" in (tmp_path / "a.xml").read_text(encoding="utf-8") and held.about["Name"]
