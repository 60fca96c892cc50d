"""The built page that is shipped, and browsers that do not take the terminal."""

import re
import webbrowser

import pytest

from gonio.errors import NotFoundError
from gonio.explorer import page, serving
from gonio.report.display.results import MARKS


def test_a_page_that_has_not_been_built(tmp_path, monkeypatch):
    monkeypatch.setattr(page.resources, "files", lambda package: tmp_path)
    with pytest.raises(NotFoundError, match="npm run build"):
        page.files.__wrapped__()


def test_files_of_other_kinds_are_not_handed_out(tmp_path, monkeypatch):
    (tmp_path / "static" / "folder.js").mkdir(parents=True)
    for name in ("index.html", "explorer.js", "notes.py", ".hidden"):
        (tmp_path / "static" / name).write_text(name)
    monkeypatch.setattr(page.resources, "files", lambda package: tmp_path)
    assert set(page.files.__wrapped__()) == {"index.html", "explorer.js"}


@pytest.mark.parametrize(
    "kind, is_opened", [(webbrowser.GenericBrowser, False), (webbrowser.BackgroundBrowser, True), (object, True)]
)
def test_browsers_in_the_terminal_are_not_opened(kind, is_opened, monkeypatch):
    opened = []

    class Browser(kind):
        def __init__(self):
            pass

        def open(self, address):
            opened.append(address)

    monkeypatch.setattr(webbrowser, "get", Browser)
    serving._open("http://127.0.0.1:1/open/x")
    assert bool(opened) == is_opened


@pytest.mark.parametrize("verdict, sign", MARKS.items())
def test_verdicts_have_the_signs_that_notebooks_show(verdict, sign):
    script = page.files()["explorer.js"][0].decode()
    assert re.search(rf"[{{,][`\"]?{verdict}[`\"]?:`{sign}`", script)


def test_a_law_that_fails_is_coloured():
    assert ".verdict-FAIL" in page.files()["explorer.css"][0].decode()
