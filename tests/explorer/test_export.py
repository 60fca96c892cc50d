"""The explorer as one file: everything inside, nothing from elsewhere, and no file harmed by a failure."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from explorer_server import PAGE

import gonio as gn
from gonio.cli.commands import cli
from gonio.errors import NotFoundError, ParameterError
from gonio.explorer import page
from gonio.explorer.export import export
from gonio.explorer.given import Given


@pytest.fixture(scope="module", autouse=True)
def built():
    files = {name: page.PageFile(text.encode(), page.TYPES[Path(name).suffix]) for name, text in PAGE.items()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "files", lambda: files)
        yield files


class Seen(HTMLParser):
    """Elements of a page with their attributes and texts."""

    def __init__(self, text):
        super().__init__()
        self.elements = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append([tag, dict(attrs), ""])

    def handle_data(self, data):
        if self.elements:
            self.elements[-1][2] += data

    def of(self, tag):
        return [(attributes, text) for name, attributes, text in self.elements if name == tag]


@pytest.fixture(scope="module")
def exported(tmp_path_factory, built):
    tmp_path = tmp_path_factory.mktemp("exported")
    gn.save(gn.tables.tabulate(gn.material("gold-metallic-paint"), resolution=(6, 8, 12)), tmp_path / "table.csv")
    given = [Given("gold", (), ("alpha=0.3",)), Given(str(tmp_path / "table.csv")), Given("Lambertian(0.3)")]
    size = export(tmp_path / "a.html", given)
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert size == len(text.encode()) < 5_000_000
    return Seen(text)


def test_everything_is_inside(exported):
    scripts = {attributes.get("id", attributes.get("type")): text for attributes, text in exported.of("script")}
    assert scripts["module"].strip() == 'window.end = "<\\/script>\\x3c!-- $& ";'
    assert "MIT" in scripts["LICENSES.txt"]
    assert [text.strip() for _, text in exported.of("style")] == [PAGE["explorer.css"].strip()]
    data = json.loads(scripts["gonio-materials"])
    assert [m["title"] for m in data["materials"]] == ["gold, alpha=0.3", "table.csv", "Lambertian(0.3)"]
    assert len(data["checks"]) == len(data["albedo"]) == 3
    assert data["albedo"][2]["values"]["shape"] == [len(data["albedo"][2]["theta"]), 1]
    assert data["materials"][1]["glsl"]["tables"][0]["data"]["base64"]
    order = [attributes.get("id", attributes.get("type")) for attributes, _ in exported.of("script")]
    assert order.index("gonio-materials") < order.index("module")


def test_nothing_comes_from_elsewhere(exported):
    for tag, attributes, _ in exported.elements:
        links = [attributes[name] for name in ("src", "href", "srcset", "action") if name in attributes]
        assert all(link.startswith("data:") for link in links), tag
    (policy,) = [a["content"] for a, _ in exported.of("meta") if a.get("http-equiv") == "Content-Security-Policy"]
    assert policy.startswith("default-src 'none'") and "http" not in policy
    assert not re.search(r"url\(|@import", "".join(text for _, text in exported.of("style")))


def test_a_failure_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.html"
    path.write_text("old")
    with pytest.raises(ParameterError):
        export(path, [Given("Lambertian(1.2)")])
    monkeypatch.setattr(np, "ascontiguousarray", None)
    with pytest.raises(TypeError):
        export(path, [Given("gold")])
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_page_that_was_not_built_whole(tmp_path, built):
    for name, change in (("explorer.js", None), ("index.html", b"<p>no head")):
        kept = built.pop(name)
        if change:
            built[name] = page.PageFile(change, "text/html")
        with pytest.raises(NotFoundError, match="npm run build"):
            export(tmp_path / "a.html", [Given("Lambertian(0.3)")])
        built[name] = kept


def run(*words):
    return CliRunner().invoke(cli, ["view", *map(str, words)])


def test_the_command(tmp_path):
    done = run("Lambertian(0.3)", "-p", "rho=0.4", "--export", tmp_path / "a.html")
    assert done.exit_code == 0 and re.search(r"a\.html: 1 material, \d+\.?\d* kB", done.output)
    assert '"text":"Lambertian(0.3), rho=0.4"' in (tmp_path / "a.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "words, said",
    [
        (["--export", "a.html"], "no MATERIAL"),
        (["gold", "--export", "a.pdf"], "ends in .html"),
        (["gold", "--export", "nowhere/a.html"], "does not exist"),
        (["-"], "standard input"),
        (["gold", "--port", "80"], "1024"),
        (["golf", "--no-browser"], "no built-in material"),
        (["gold", "-p", "alpha=7", "--no-browser"], "out of bounds"),
    ],
)
def test_bad_input(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run(*words)
    assert done.exit_code == 2 and said in done.output
    assert not list(tmp_path.iterdir())


def test_a_port_in_use():
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        done = run("--no-browser", "--port", taken.getsockname()[1])
    assert done.exit_code == 2 and "in use" in done.output
