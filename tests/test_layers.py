"""The layer table of docs/architecture.md, held against what the modules import."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import gonio

PACKAGE = Path(gonio.__file__).resolve().parent
PAGE = Path(__file__).resolve().parents[1] / "docs" / "architecture.md"
DOORS = {"", "__main__"}  # what users enter by: they import from anywhere
ARRAY_LIBRARIES = {"torch", "jax", "jaxlib", "drjit", "cupy", "tensorflow", "mitsuba"}
HEAVY = {
    *(
        "pandas",
        "llvmlite",
        "xarray",
        "matplotlib",
        "scipy",
        "h5py",
        "h5netcdf",
        "zarr",
        "click",
        "rich",
        "PIL",
        "OpenEXR",
    ),
    *ARRAY_LIBRARIES,
}


def name_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def imported(name: str) -> tuple[set[str], set[str]]:
    """Modules of the package that a module imports anywhere in its text, and names of other packages."""
    path = MODULES[name]
    package = [part for part in name.split(".") if part]
    package = package if path.name == "__init__.py" else package[:-1]
    own, others = set(), set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
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


def table() -> dict[str, int]:
    """Module -> layer, as the page has it; a row without a number belongs to the number above."""
    found, layer = {}, -1
    for first, names in re.findall(r"^\| *(\d*) *\| *(`[^|]*\.py`[^|]*)\|", PAGE.read_text(encoding="utf-8"), re.M):
        layer = int(first) if first else layer
        for name in re.findall(r"`([\w/]+)\.py`", names):
            found[name.replace("/", ".")] = layer
    return found


def layers() -> dict[str, int]:
    """The layer of every module: what is not in the table is as high as the highest of its folder in it."""
    listed = table()
    folders: dict[str, int] = {}
    for name, layer in listed.items():
        folder = name.rpartition(".")[0]
        if folder:
            folders[folder] = max(layer, folders.get(folder, 0))
    return {m: listed.get(m, folders.get(m, folders.get(m.rpartition(".")[0], -1))) for m in MODULES}


def test_every_module_has_a_layer():
    assert set(table()) <= set(MODULES), "the page lists modules that do not exist"
    missing = sorted(m for m, layer in layers().items() if layer < 0 and m not in DOORS)
    assert not missing, f"no layer in {PAGE.name} for {missing}"


def test_imports_never_go_up():
    where = layers()
    for name in set(MODULES) - DOORS:
        above = sorted(other for other in imported(name)[0] if where[other] > where[name])
        assert not above, f"{name} (layer {where[name]}) must not import {above}"


def test_imports_never_go_in_a_circle():
    graph = {name: imported(name)[0] - {name} for name in set(MODULES) - DOORS}
    assert list(TopologicalSorter(graph).static_order())


def test_only_libraries_and_bridges_know_array_libraries():
    for name in MODULES:
        if name.partition(".")[0] not in ("libraries", "bridges"):
            known = imported(name)[1] & ARRAY_LIBRARIES
            assert not known, f"{name} must not import {sorted(known)}"


def test_importing_is_light():
    code = [sys.executable, "-X", "importtime", "-c", "import gonio"]
    lines = subprocess.run(code, capture_output=True, text=True, check=True).stderr.splitlines()
    loaded = {line.rpartition("|")[2].strip().partition(".")[0] for line in lines}
    assert "gonio" in loaded
    assert not loaded & HEAVY
