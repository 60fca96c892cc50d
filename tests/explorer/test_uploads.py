"""Dropped files: safe names, limits on what is said and on what comes, nothing left of what is refused."""

import asyncio

import pytest

from gonio.explorer.server import Server
from gonio.explorer.uploads import UploadError, Uploads, safe


def kept(uploads, name, *pieces):
    async def stream():
        for piece in pieces:
            if isinstance(piece, Exception):
                raise piece
            yield piece

    return asyncio.run(uploads.keep(name, stream()))


@pytest.mark.parametrize(
    "name, expected",
    [
        ("gold.binary", "gold.binary"),
        ("/home/me/gold paint.binary", "gold_paint.binary"),
        (r"C:\files\gold.binary", "gold.binary"),
        ("../..", "file"),
        ("...nc", "nc"),
        ("-rf.nc", "-rf.nc"),
        ("a\r\nb\0.nc", "a_b_.nc"),
        ("x" * 300 + ".bsdf", "x" * 95 + ".bsdf"),
        ("$(reboot);`id`.csv", "_reboot_id_.csv"),
    ],
)
def test_names(name, expected):
    assert safe(name) == expected


def test_files_are_kept(tmp_path):
    uploads = Uploads(tmp_path)
    texts = [kept(uploads, "a.nc", b"12", b"", b"3") for _ in range(2)]
    assert texts == ["upload:1/a.nc", "upload:2/a.nc"]
    assert (tmp_path / "2" / "a.nc").read_bytes() == b"123"
    assert (tmp_path / "2").stat().st_mode & 0o077 == 0


def test_a_stream_that_goes_on_is_cut(tmp_path):
    uploads = Uploads(tmp_path, most=100)
    with pytest.raises(UploadError, match="expected at most"):
        kept(uploads, "a", *[b"x" * 30] * 1000)
    assert not list(tmp_path.iterdir())
    assert kept(uploads, "a", b"x" * 100)


def test_all_files_together_have_a_limit(tmp_path):
    uploads = Uploads(tmp_path, most=100, in_all=250)
    for _ in range(2):
        kept(uploads, "a", b"x" * 100)
    with pytest.raises(UploadError, match="in all"):
        kept(uploads, "a", b"x" * 60)
    assert kept(uploads, "a", b"x" * 50) == "upload:4/a"
    assert len(list(tmp_path.iterdir())) == 3


def test_what_does_not_arrive_whole_is_removed(tmp_path):
    uploads = Uploads(tmp_path, in_all=100)
    for _ in range(10):
        with pytest.raises(ConnectionError):
            kept(uploads, "a", b"x" * 60, ConnectionError())
    assert not list(tmp_path.iterdir())


def asked(server, path, **headers):
    """Status and headers of an answer of the application."""
    sent = []

    async def send(message):
        sent.append(message)

    async def receive():
        return {"type": "http.request", "body": b"", "more_body": False}

    given = [(b"host", b"127.0.0.1:8000"), *((n.encode(), v.encode()) for n, v in headers.items())]
    scope = {"type": "http", "method": "GET", "path": path, "query_string": b"", "headers": given}
    asyncio.run(server(scope, receive, send))
    return sent[0]["status"], dict(sent[0]["headers"])


def test_the_address_for_the_browser_leads_to_the_page_once(tmp_path):
    server = Server(None, Uploads(tmp_path), {}, 8000, "token", "once")
    assert asked(server, "/open/once", origin="http://example.com")[0] == 403
    assert asked(server, "/open/twice")[0] == 404
    status, headers = asked(server, "/open/once")
    assert (status, headers[b"location"]) == (302, b"http://127.0.0.1:8000/token/")
    assert asked(server, "/open/once")[0] == asked(server, "/open/")[0] == 404
