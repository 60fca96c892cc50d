"""The built page: its files, which are all that a server hands out, and the headers that keep it to itself."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import NamedTuple

from ..errors import NotFoundError

TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
}
"""Suffix -> media type."""

INDEX = "index.html"


class PageFile(NamedTuple):
    """A file of the page."""

    content: bytes
    type: str


@cache
def files() -> dict[str, PageFile]:
    """Name -> file of the built page. Raises NotFoundError where it has not been built."""
    folder = resources.files(__package__) / "static"
    pages = {}
    if folder.is_dir():
        for path in folder.iterdir():
            suffix = "." + path.name.rpartition(".")[2]
            if path.is_file() and suffix in TYPES:
                pages[path.name] = PageFile(path.read_bytes(), TYPES[suffix])
    if INDEX not in pages:
        raise NotFoundError(
            "the page of the explorer has not been built; in the folder explorer of the source: npm ci, npm run build"
        )
    return pages


def headers(host: str) -> dict[str, str]:
    """Headers of every answer of a server at this host: nothing from elsewhere, in no other page, kept nowhere."""
    policy = {
        "default-src": "'none'",
        "script-src": "'self'",
        "style-src": "'self' 'unsafe-inline'",
        "img-src": "'self' data: blob:",
        "worker-src": "'self' blob:",
        "connect-src": f"'self' ws://{host}",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    return {
        "content-security-policy": "; ".join(f"{name} {value}" for name, value in policy.items()),
        "x-content-type-options": "nosniff",
        "x-frame-options": "DENY",
        "referrer-policy": "no-referrer",
        "cache-control": "no-store",
        "cross-origin-opener-policy": "same-origin",
        "cross-origin-resource-policy": "same-origin",
    }
