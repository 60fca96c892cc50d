"""The server of the page: who may ask, the files of the page, dropped files, and a socket for everything else.

It listens on 127.0.0.1. Every address begins with a token that cannot be guessed; the names of host and origin must be
its own, so that no other page in the browser can ask it, whatever name leads here.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import TYPE_CHECKING, Any

from ..errors import Error, ParameterError, visible
from .calls import CALLS
from .messages import decoded, number_of, refusal, request
from .page import INDEX, PageFile, headers
from .uploads import UploadError, Uploads

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

    from .session import Session

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]

MOST_WAITING = 16
"""Requests of a socket that are worked on or wait; more are not read before one of them is answered."""

OPEN = "open"
"""The first part of the address that leads to the page once."""


class Server:
    """The application, for a host such as 127.0.0.1:8000: an ASGI callable."""

    def __init__(
        self, session: Session, uploads: Uploads, files: dict[str, PageFile], port: int, token: str, once: str
    ):
        from starlette.applications import Starlette
        from starlette.routing import Route, WebSocketRoute

        self.session, self.uploads, self.files = session, uploads, files
        self.token, self.once = token, once
        self.hosts = tuple(f"{name}:{port}" for name in ("127.0.0.1", "localhost"))
        routes = [
            Route("/upload", self._upload, methods=["POST"]),
            WebSocketRoute("/socket", self._socket),
            Route("/", self._file, methods=["GET"]),
            Route("/{name}", self._file, methods=["GET"]),
        ]
        self._pages = Starlette(routes=routes)
        self._pages.router.redirect_slashes = False

    @property
    def path(self) -> str:
        """The path of the page."""
        return f"/{self.token}/"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            return
        host, status = self._judged(scope)
        if status == 302:
            await self._redirect(host, send)
        elif status and scope["type"] == "http":
            await _plain(send, status, host)
        elif status:
            await send({"type": "websocket.close", "code": 1008})
        else:
            rest = scope["path"][len(self.path) - 1 :]
            inside = {**scope, "path": rest, "raw_path": rest.encode(), "root_path": ""}
            await self._pages(inside, receive, _with_headers(send, host))

    def _judged(self, scope: Scope) -> tuple[str, int]:
        """The host of a request, and the status with which it is refused; 0 for one that goes on."""
        pairs = [(name.lower(), value.decode("latin-1").lower()) for name, value in scope["headers"]]
        hosts = [value for name, value in pairs if name == b"host"]
        origins = [value for name, value in pairs if name == b"origin"]
        if len(hosts) != 1 or hosts[0] not in self.hosts:
            return self.hosts[0], 403
        if any(origin != f"http://{hosts[0]}" for origin in origins):
            return hosts[0], 403
        first, _, rest = scope["path"].removeprefix("/").partition("/")
        if scope["type"] == "http" and first == OPEN and self.once and _same(rest, self.once):
            self.once = ""
            return hosts[0], 302
        return hosts[0], 0 if self.knows(scope) else 404

    def knows(self, scope: Scope) -> bool:
        """Whether a request shows the token."""
        first = scope["path"].removeprefix("/").partition("/")[0]
        return _same(first, self.token) and scope["path"].startswith(self.path)

    async def _redirect(self, host: str, send: Send) -> None:
        await _plain(send, 302, host, {"location": f"http://{host}{self.path}"})

    async def _file(self, request: Request) -> Response:
        from starlette.responses import Response

        file = self.files.get(request.path_params.get("name", INDEX))
        return Response(b"not found", 404) if file is None else Response(file.content, media_type=file.type)

    async def _upload(self, request: Request) -> Response:
        from starlette.requests import ClientDisconnect
        from starlette.responses import JSONResponse

        try:
            declared = request.headers.get("content-length", "0")
            self.uploads.refuse(int(declared) if declared.isascii() and declared.isdigit() else 0)
            text = await self.uploads.keep(request.query_params.get("name", ""), request.stream())
        except UploadError as error:
            return JSONResponse({"error": str(error)}, error.status, {"connection": "close"})
        except ClientDisconnect:
            return JSONResponse({"error": "the file did not arrive whole; drop it once more"}, 400)
        except OSError as error:
            words = f"the file cannot be kept: {visible(error.strerror or str(error))}; make room"
            return JSONResponse({"error": words}, 507)
        return JSONResponse({"text": text})

    async def _socket(self, socket: WebSocket) -> None:
        await socket.accept()
        turns = {name: asyncio.Lock() for name in CALLS}
        waiting: set[asyncio.Task[None]] = set()
        try:
            while (message := await socket.receive())["type"] == "websocket.receive":
                task = asyncio.create_task(self._answer(socket, turns, message.get("text")))
                waiting.add(task)
                task.add_done_callback(waiting.discard)
                while len(waiting) >= MOST_WAITING:
                    await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in waiting:
                task.cancel()

    async def _answer(self, socket: WebSocket, turns: dict[str, asyncio.Lock], message: str | None) -> None:
        number = None
        try:
            if message is None:
                raise ParameterError("a binary message; expected text: JSON with id and call")
            data = decoded(message)
            number = number_of(data)
            name, asked = request(data)
            async with turns[name]:
                content = await asyncio.wrap_future(self.session.ask(name, asked))
        except Error as error:
            content = refusal(number, str(error))
        with contextlib.suppress(Exception):  # the page is gone
            await socket.send_bytes(content)


def _same(a: str, b: str) -> bool:
    return hmac.compare_digest(a.encode("utf-8", "surrogatepass"), b.encode())


def _encoded(fields: dict[str, str]) -> list[tuple[bytes, bytes]]:
    return [(name.encode(), value.encode("latin-1")) for name, value in fields.items()]


async def _plain(send: Send, status: int, host: str, more: dict[str, str] | None = None) -> None:
    """An answer without a page."""
    words = {302: b"", 403: b"forbidden", 404: b"not found"}[status]
    fields = {**headers(host), "content-type": "text/plain", "content-length": str(len(words)), **(more or {})}
    await send({"type": "http.response.start", "status": status, "headers": _encoded(fields)})
    await send({"type": "http.response.body", "body": words})


def _with_headers(send: Send, host: str) -> Send:
    async def sending(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", []), *_encoded(headers(host))]}
        await send(message)

    return sending
