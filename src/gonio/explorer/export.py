"""The explorer with its materials as one file, which needs neither a server nor a network."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Sequence
from typing import Any

from ..errors import NotFoundError, ParameterError
from ..files import replacing, target
from . import calls, page
from .given import Given
from .messages import in_base64
from .shelf import Shelf

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:; "
    "connect-src data: blob:; base-uri 'none'; form-action 'none'"
)

_STYLE = re.compile(r"""<link\b[^>]*\bhref=["'](?:\./)?([\w.-]+\.css)["'][^>]*>""")
_SCRIPT = re.compile(r"""<script\b[^>]*\bsrc=["'](?:\./)?([\w.-]+\.js)["'][^>]*>\s*</script>""")


def export(path: str | os.PathLike, given: Sequence[Given], progress: Callable[[int, int], None] | None = None) -> int:
    """Write the page with these materials, their albedos and laws; its size in bytes.

    Raises ParameterError for a name that does not end in .html, NotFoundError where the page has not been built, and
    what the materials raise. A failure leaves a file that was there.
    """
    if not os.fspath(path).lower().endswith((".html", ".htm")):
        raise ParameterError(f"{path}: expected a name that ends in .html")
    target(path)
    files = page.files()
    shelf = Shelf(given)
    parts: dict[str, list[Any]] = {"materials": [], "albedo": [], "checks": []}
    for done, name in enumerate(shelf.given, 1):
        made = calls.material(shelf, name, {})
        is_map = made["glsl"] is None and not made["parameters"] and not made["measured"]
        parts["materials"].append(made)
        parts["albedo"].append(None if is_map else calls.albedo(shelf, name, {}))
        parts["checks"].append(None if is_map else calls.check(shelf, name, {}))
        if progress is not None:
            progress(done, len(shelf.given))
    content = one_file(files, parts).encode()
    with replacing(path) as temporary:
        temporary.write_bytes(content)
    return len(content)


def one_file(files: dict[str, page.PageFile], data: dict[str, Any]) -> str:
    """The page as one text, with styles, code, licences and data inside."""
    html = files[page.INDEX].content.decode()

    def text(name: str) -> str:
        if name not in files:
            raise NotFoundError(f"the built page names {name}, which is not there; build it again: npm run build")
        return files[name].content.decode()

    html = _STYLE.sub(lambda match: f"<style>{_closed(text(match[1]), 'style')}</style>", html)
    packed = json.dumps(in_base64(data), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    head = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    body = f'<script type="application/json" id="gonio-materials">{packed}</script>'
    for name, file in files.items():
        if name.endswith(".txt"):
            body += f'<script type="text/plain" id="{name}">{_closed(file.content.decode(), "script")}</script>'
    scripts = "".join(
        f'<script type="module">{_closed(text(name), "script")}</script>' for name in _SCRIPT.findall(html)
    )
    html = _SCRIPT.sub("", html)
    html = _before(html, "<head>", head, after=True)
    return _before(html, "</body>", body + scripts)


def _closed(text: str, tag: str) -> str:
    """Text within <tag>, which does not end it: in the strings of minified code the same text."""
    text = re.sub(rf"</(?={tag})", r"<\\/", text, flags=re.IGNORECASE)
    return text.replace("<!--", "\\x3c!--") if tag == "script" else text


def _before(html: str, mark: str, text: str, after: bool = False) -> str:
    """The page with a text before (or after) a mark, which it must have."""
    head, matched, rest = html.partition(mark)
    if not matched:
        raise NotFoundError(f"the built page has no {mark}; build it again: npm run build")
    return f"{head}{matched}{text}{rest}" if after else f"{head}{text}{matched}{rest}"
