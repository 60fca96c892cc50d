"""`--near` and `--slice`: which tests a change selects."""

from __future__ import annotations

import re
from typing import NamedTuple

import near
import pytest
from places import ROOT
from rooms import ROOMS, above, used, users

FOLDERS = {f"tests/{room}/" for room in ROOMS if room}


def selected(*files: str) -> set[str]:
    return set(near.near(files))


def test_above_goes_on_to_the_top():
    graph = {"trace": {"compile"}, "compile": {"evaluate"}, "evaluate": {"base", "cli"}, "numerics": {"cli"}}
    assert above({"compile"}, graph) == {"compile", "evaluate", "base", "cli"}
    assert above({"numerics", "cli"}, graph) == {"numerics", "cli"}


def test_who_discovers_a_package_by_its_name_stands_above_it():
    assert "bridges" in users()["compile"]  # "gonio.compile.source.languages"
    assert "formats" not in users()["repair"]  # an advice of MERL's: "gonio.repair.symmetrize(...)"


def test_a_format_selects_formats_and_what_imports_them():
    found = selected("src/gonio/formats/merl.py")
    assert {"tests/formats/", "tests/conversion/", "tests/catalogue/", "tests/cli/"} <= found
    assert not found & {"tests/radiometry/", "tests/trace/", "tests/models/", "tests/scenes/"}
    assert {"tests/attacks/test_small_files.py", "tests/house/"} <= found


def test_the_top_selects_itself_and_the_attacks_on_it():
    attacks = {f"tests/attacks/test_{name}.py" for name in ("command_line", "opened_by_texts", "versions")}
    assert selected("src/gonio/cli/commands.py") == {"tests/cli/", "tests/house/", *attacks}
    assert selected("explorer/src/page.js") >= {"tests/explorer/", "tests/cli/", "tests/house/"}


def test_attacks_are_near_to_what_they_name():
    assert used("import gonio as gn\ngn.load(path)") == {"formats"}
    text = "from gonio import files\nfrom gonio.compile import store\ngn.GGX(0.1)"
    assert used(text) == {"files", "compile", "distributions"}


def test_operations_and_graphs_select_nearly_all():
    below = {f"tests/{room}/" for room in ("machine", "declared", "files", "numerics", "radiometry", "pictures")}
    assert selected("src/gonio/arrays/ops.py") >= FOLDERS - below
    formulas = {f"tests/{room}/" for room in ("arrays", "formula", "surfaces", "distributions")}
    assert selected("src/gonio/trace/graph.py") >= FOLDERS - below - formulas


def test_modules_beside_the_rooms_select_what_imports_them():
    assert selected("src/gonio/errors.py") >= FOLDERS - {"tests/radiometry/"}
    for door in ("__init__.py", "__init__.pyi", "testing.py"):
        assert selected(f"src/gonio/{door}") == {"tests/house/"}


def test_a_room_that_is_gone_selects_its_tests():
    assert "tests/formats/" in selected("src/gonio/formats/no_longer_here.py")


def test_texts_select_the_house():
    pages = ["README.md", "docs/engine.md", "docs/figures/make.py", "examples/portrait.py", "benchmarks/engine.txt"]
    assert selected(*pages) == {"tests/house/", "tests/attacks/test_page.py"}


def test_changed_tests_select_themselves():
    assert selected("tests/rays/test_rays.py") == {"tests/rays/test_rays.py"}
    assert selected("tests/formats/corpus/MERL.txt") == {"tests/formats/"}
    assert selected("tests/tools/near.py") == {"tests/house/test_near.py"}
    through_others = selected("tests/tools/fuzzing.py")  # of fuzz_trials.py
    assert "tests/formats/test_fuzz.py" in through_others
    assert selected("tests/tools/of_no_test.py") == selected("pyproject.toml") == {"tests/"}


def test_a_commit_that_is_not_here():
    with pytest.raises(pytest.UsageError, match="expected a commit that is here"):
        near.changed("no-such-commit")


def test_ci_knows_what_was_accepted_last():
    """A commit, for `--near`. Where it is not in the history, CI takes the first commit."""
    assert re.fullmatch(r"[0-9a-f]{40}\n", (ROOT / ".ci" / "accepted").read_text(encoding="utf-8"))


@pytest.mark.parametrize("word", ["", "3", "0/8", "9/8", "a/b", "1/2/3"])
def test_a_slice_that_is_none(word):
    with pytest.raises(pytest.UsageError, match="expected K/N"):
        near.sliced(word)


class Case(NamedTuple):
    """What a selection asks of a test."""

    nodeid: str
    full: bool

    def get_closest_marker(self, name: str) -> bool:
        return self.full and name == "full"


NEAR = [Case(f"tests/rays/test_rays.py::test_it[{n}]", full=n % 2 == 0) for n in range(100)]
FAR = [Case(f"tests/report/test_display.py::test_it[{n}]", full=n % 2 == 0) for n in range(100)]


def chosen(monkeypatch: pytest.MonkeyPatch, file: str, piece: str | None) -> set[Case]:
    monkeypatch.setattr(near, "changed", lambda commit: [file])
    selection = near.Selection("HEAD", piece)
    return {case for case in NEAR + FAR if selection.has(case)}


def test_slices_share_the_tests_out():
    slices = [near.Selection(None, f"{k}/4") for k in (1, 2, 3, 4)]
    parts = [[case for case in NEAR + FAR if piece.has(case)] for piece in slices]
    assert sorted(case for part in parts for case in part) == sorted(NEAR + FAR)
    assert all(len(part) > 20 for part in parts)


def test_what_is_near_is_whole_and_the_rest_a_slice(monkeypatch):
    found = chosen(monkeypatch, "tests/rays/test_rays.py", "1/4")
    assert found >= set(NEAR)
    assert 10 < len(found & set(FAR)) < 50
    assert chosen(monkeypatch, "tests/rays/test_rays.py", None) == set(NEAR)


@pytest.mark.parametrize("file", ["pyproject.toml", "src/gonio/rays/tree.py"])
def test_where_most_is_near_what_is_full_is_a_slice(monkeypatch, file):
    found = chosen(monkeypatch, file, "1/4")
    assert found >= {case for case in NEAR + FAR if not case.full}
    assert 5 < len([case for case in found & set(FAR) if case.full]) < 25
    assert (found >= set(NEAR)) == ("rays" in file), "of the changed room it is whole, if that is not most"
    assert chosen(monkeypatch, file, None) == {*NEAR, *FAR}


def test_files_that_are_far_are_not_read(monkeypatch):
    monkeypatch.setattr(near, "changed", lambda commit: ["src/gonio/cli/commands.py"])
    selection = near.Selection("HEAD", None)
    assert selection.pytest_ignore_collect(ROOT / "tests" / "rays" / "test_rays.py")
    assert not selection.pytest_ignore_collect(ROOT / "tests" / "cli" / "test_commands.py")
    (line,) = selection.pytest_report_header()
    assert line.startswith("near, 1 files changed since HEAD: attacks/test_command_line.py,") and "cli/, house/" in line
    assert not near.Selection("HEAD", "1/4").pytest_ignore_collect(ROOT / "tests" / "rays" / "test_rays.py")
