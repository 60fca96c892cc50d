"""The promise: a thing of a kind is one file, and a function one that is named. Found everywhere once it is there, and
nowhere once it is gone.

The files are those that CONTRIBUTING.md shows, one of each kind, in a copy of gonio and its manual.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from places import PACKAGE, ROOT
from rooms import ROOMS
from test_docs import new_files

pytestmark = pytest.mark.texts

FILES = new_files(ROOT / "CONTRIBUTING.md")
NAMED = '"gloss": "integrals.gloss",'
COUNTED = re.compile(r"<!-- made: counts -->\n(.*)\n")


class Copy:
    """gonio and its manual in a folder of their own."""

    def __init__(self, home: Path):
        self.home = home
        shutil.copytree(PACKAGE, home / "src" / "gonio", ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copytree(ROOT / "docs", home / "docs", ignore=shutil.ignore_patterns("__pycache__", "*.jpg"))
        shutil.copy(ROOT / "README.md", home)
        (home / "work").mkdir()

    def manual(self) -> dict[str, bytes]:
        """Every file of the manual -> what it holds."""
        files = [self.home / "README.md", *(self.home / "docs").rglob("*"), *(self.home / "src").rglob("*.pyi")]
        texts = [path for path in files if path.suffix in (".md", ".py", ".pyi")]
        return {str(path.relative_to(self.home)): path.read_bytes() for path in texts}

    def look(self) -> dict[str, bool | str]:
        """Where the things are found; brings the manual up to date."""
        paths = (self.home / "src", self.home / "docs", ROOT / "tests" / "tools")
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths)), "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, str(ROOT / "tests" / "house" / "promised.py"), str(self.home / "work")]
        done = subprocess.run(command, env=environment, capture_output=True, encoding="utf-8", cwd=self.home)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """What is found with the files and, after they are taken out, without; the manual before, with them and after."""
    copy = Copy(tmp_path_factory.mktemp("promise"))
    before = copy.manual()
    for name, text in FILES.items():
        (copy.home / "src" / "gonio" / name).write_text(text, encoding="utf-8")
    face = copy.home / "src" / "gonio" / "__init__.py"
    bare = face.read_text(encoding="utf-8")
    face.write_text(bare.replace("_ON_USE = {", f"_ON_USE = {{{NAMED}"), encoding="utf-8")
    present, between = copy.look(), copy.manual()
    for name in FILES:
        (copy.home / "src" / "gonio" / name).unlink()
    face.write_text(bare, encoding="utf-8")
    return {"present": present, "absent": copy.look(), "manuals": (before, between, copy.manual())}


def test_every_kind_has_an_example():
    folders = {"models", "distributions", "formula/fresnel", "formula/maskings", "lights", "laws", "scenes/shapes"}
    assert {str(Path(name).parent.as_posix()) for name in FILES} == folders | {"formats", "integrals"}
    assert len(FILES) == 9


def test_examples_stand_in_rooms_that_may_import_what_they_do():
    for name, text in FILES.items():
        here = Path(name).parent
        for dots, module in re.findall(r"^from (\.+)([\w.]*) import", text, re.MULTILINE):
            other = [*here.parts[: len(here.parts) + 1 - len(dots)], *filter(None, module.split("."))][0]
            assert other not in ROOMS or ROOMS.index(other) <= ROOMS.index(here.parts[0]), (name, other)


def test_one_file_makes_a_thing_known_everywhere(seen):
    assert {place: found for place, found in seen["present"].items() if found is not True} == {}


def test_without_its_file_it_is_known_nowhere(seen):
    assert {place: found for place, found in seen["absent"].items() if found is True} == {}
    assert seen["absent"].keys() == seen["present"].keys()


def test_the_manual_counts_it(seen):
    before, between = (
        {what: int(n) for n, what in re.findall(r"(\d+) ([^,.]+)", COUNTED.search(manual["README.md"].decode())[1])}
        for manual in seen["manuals"][:2]
    )
    more = {what: between[what] - number for what, number in before.items()}
    assert more.pop("built-in materials") == 0
    assert len(more) == 7 and set(more.values()) == {1}


def test_the_manual_is_as_before_without_it(seen):
    before, between, after = seen["manuals"]
    assert between.keys() - before.keys() == {
        f"docs/models/{name}.md" for name in ("HenyeyGreenstein", "UniformFacets", "GeneralizedSchlick")
    }
    assert after == before
