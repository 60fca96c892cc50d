"""The rooms of src/gonio: a folder imports only folders above it in ROOMS, and nothing imports in a circle."""

from __future__ import annotations

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

from places import PACKAGE, ROOT

ROOMS = (
    *("", "numerics", "radiometry", "trace", "arrays", "compile", "rays", "pictures"),
    *("formula", "evaluate", "base", "polarization"),
    *("surfaces", "distributions", "models", "lights", "tables", "integrals", "layers", "remote_sensing", "formats"),
    *("conversion", "repair", "uncertainty", "laws", "fitting", "texels", "reconstruction", "planning"),
    *("scenes", "interreflection", "instrument"),
    *("catalogue", "bridges", "figures", "report", "explorer", "cli"),
)
"""Folders, from the ground up; "" stands for the modules beside them."""

DOORS = {"", "__main__", "authoring", "testing"}  # what users enter by: they import from anywhere
ARRAY_LIBRARIES = {"torch", "jax", "jaxlib", "drjit", "cupy", "tensorflow", "mitsuba"}
HEAVY = {
    *("pandas", "llvmlite", "xarray", "matplotlib", "scipy", "h5py", "h5netcdf", "zarr", "click", "rich", "PIL"),
    *("OpenEXR", "starlette", "uvicorn", "websockets", *ARRAY_LIBRARIES),
}


def name_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def room(name: str) -> str:
    """The folder that a module is in."""
    return name.partition(".")[0] if "." in name or MODULES[name].name == "__init__.py" else ""


def imported(name: str, executed: bool = False) -> tuple[set[str], set[str]]:
    """Modules of the package that a module imports anywhere in its text, and names of other packages.

    `executed`: without those that only a type checker sees.
    """
    path = MODULES[name]
    package = [part for part in name.split(".") if part]
    package = package if path.name == "__init__.py" else package[:-1]
    own, others = set(), set()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    if executed:
        tree.body = [n for n in tree.body if not (isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            others.update(a.name.partition(".")[0] for a in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            others.add((node.module or "").partition(".")[0])
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] + (node.module.split(".") if node.module else [])
            for a in node.names:
                full = ".".join([*base, a.name])
                own.add(full if full in MODULES else ".".join(base))
    return own - {""}, others


def test_rooms_are_the_folders():
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir() and any(path.rglob("*.py"))}
    assert folders == set(ROOMS) - {""}


def test_tests_stand_in_the_folder_of_their_room():
    others = {"attacks", "house", "tools"}
    folders = {path.parent.relative_to(ROOT / "tests").as_posix() for path in (ROOT / "tests").rglob("test_*.py")}
    assert folders <= (set(ROOMS) - {""}) | others, "the tests of src/gonio/ROOM stand in tests/ROOM"


def test_imports_never_go_up():
    floor = {folder: number for number, folder in enumerate(ROOMS)}
    for name in set(MODULES) - DOORS:
        above = sorted(other for other in imported(name)[0] if floor[room(other)] > floor[room(name)])
        assert not above, f"{name} must not import {above}: {room(name) or 'the ground'} stands below"


def test_imports_never_go_in_a_circle():
    graph = {name: imported(name, executed=True)[0] - {name} for name in set(MODULES) - DOORS}
    assert list(TopologicalSorter(graph).static_order())


def test_only_arrays_and_bridges_know_array_libraries():
    for name in MODULES:
        if room(name) not in ("arrays", "bridges"):
            known = imported(name)[1] & ARRAY_LIBRARIES
            assert not known, f"{name} must not import {sorted(known)}"


def test_importing_is_light():
    code = [sys.executable, "-X", "importtime", "-c", "import gonio"]
    lines = subprocess.run(code, capture_output=True, text=True, check=True).stderr.splitlines()
    loaded = {line.rpartition("|")[2].strip().partition(".")[0] for line in lines}
    assert "gonio" in loaded
    assert not loaded & HEAVY
