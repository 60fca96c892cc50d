"""The rooms of src/gonio: a folder imports only folders above it in ROOMS, and nothing imports in a circle."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter

from places import PACKAGE, ROOT
from rooms import DOORS, MODULES, ROOMS, imported, part, room, users

ARRAY_LIBRARIES = {"torch", "jax", "jaxlib", "drjit", "cupy", "tensorflow", "mitsuba"}
HEAVY = {
    *("pandas", "llvmlite", "xarray", "matplotlib", "scipy", "h5py", "h5netcdf", "zarr", "click", "rich", "PIL"),
    *("OpenEXR", "starlette", "uvicorn", "websockets", *ARRAY_LIBRARIES),
}


def test_rooms_are_the_folders():
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir() and any(path.rglob("*.py"))}
    assert folders == set(ROOMS) - {""}


def test_tests_stand_in_the_folder_of_their_room():
    others = {"attacks", "house", "sweeps", "tools"}
    folders = {path.relative_to(ROOT / "tests").parts[0] for path in (ROOT / "tests").rglob("test_*.py")}
    assert folders <= (set(ROOMS) - {""}) | others, "the tests of src/gonio/ROOM stand in tests/ROOM"


def test_imports_never_go_up():
    floor = {folder: number for number, folder in enumerate(ROOMS)}
    for name in set(MODULES) - DOORS:
        above = sorted(other for other in imported(name)[0] if floor[room(other)] > floor[room(name)])
        assert not above, f"{name} must not import {above}: docs/architecture.md has them below {room(name)}"


def test_imports_never_go_in_a_circle():
    graph = {name: imported(name)[0] - {name} for name in set(MODULES) - DOORS}
    assert list(TopologicalSorter(graph).static_order())


def test_lines_say_what_modules_import():
    for name in set(MODULES) - DOORS:
        for other in imported(name)[0]:
            assert part(name) in users()[part(other)], f"{name} imports {other}"


@cache
def texts() -> dict[str, str]:
    """Modules without their docstrings, as lines, which are read faster than syntax."""
    docstring = re.compile(r'""".*?"""', re.DOTALL)
    return {name: docstring.sub("", path.read_text(encoding="utf-8")) for name, path in MODULES.items()}


@cache
def imports() -> dict[str, set[str]]:
    """Module -> the words that it imports from other modules."""
    statement = re.compile(r"^[ \t]*from \..* import (\([^)]*\)|.*)", re.MULTILINE)
    return {name: set(re.findall(r"\w+", " ".join(statement.findall(text)))) for name, text in texts().items()}


@cache
def classes() -> dict[str, list[tuple[str, str]]]:
    """Name of a class -> its modules, and what it is derived from."""
    places: dict[str, list[tuple[str, str]]] = {}
    for name, text in texts().items():
        for word, bases in set(re.findall(r"^[ \t]*class (\w+)(\([^)]*\))?:", text, re.MULTILINE)):
            places.setdefault(word, []).append((name, bases))
    return places


def test_a_name_leads_to_one_class():
    """What is public, or imported elsewhere, is defined in one file."""
    shared = set().union(*imports().values())
    for word, places in classes().items():
        if not word.startswith("_") or word in shared:
            modules = {name for name, _ in places}
            assert len(modules) == 1, (
                f"class {word} is defined in {modules}: let names say what each holds, or begin with an "
                f"underscore where no other file imports the class"
            )


def test_no_class_is_the_first_half_of_a_file():
    """A class with one subclass, in another file, is an idea of its own if its file makes one, or a third file asks."""
    derived: dict[str, list[str]] = {}
    for name, bases in (place for places in classes().values() for place in places):
        for word in set(re.findall(r"\w+", bases)):
            derived.setdefault(word, []).append(name)
    halves = {}
    for word, ((own, _), *others) in classes().items():
        files = {own, *derived.get(word, ())}
        if others or len(derived.get(word, ())) != 1 or len(files) == 1:
            continue
        is_made = re.search(rf"(?<!class )\b{word}\(", texts()[own])
        if not is_made and not any(word in imports()[name] for name in MODULES.keys() - files):
            halves[word] = sorted(files)
    assert not halves, "make one class of both, or functions of the object, or let one object have the other"


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
