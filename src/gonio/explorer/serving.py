"""The explorer as a whole: the worker, the server on a free port, and the browser, until Ctrl-C."""

from __future__ import annotations

import contextlib
import secrets
import signal
import socket
import threading
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..errors import ParameterError
from . import page
from .given import Given
from .messages import MOST_BYTES
from .server import OPEN, Server
from .session import Session
from .uploads import Uploads

HOST = "127.0.0.1"

PATIENCE = 2
"""Seconds that open sockets have to end."""


def serve(
    given: Sequence[Given],
    port: int = 0,
    told: Callable[[str], None] = print,
    is_opened: bool = True,
) -> None:
    """Serve the explorer of these materials until it is interrupted.

    `port`: 0 takes a free one; `told` is called with the address of the page; `is_opened`: whether a browser opens it.
    Raises ParameterError for a port that is in use, NotFoundError where the page has not been built.
    """
    files = page.files()
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="gonio-view-")))
        session = stack.enter_context(Session(given, folder))
        listener = stack.enter_context(_listening(port))
        port = listener.getsockname()[1]
        server = Server(session, Uploads(folder), files, port, secrets.token_urlsafe(32), secrets.token_urlsafe(16))
        for item in given:
            if not Path(item.text).exists():  # files are the worker's: their errors stand on the page
                item.material()
        told(f"http://{HOST}:{port}{server.path}")
        if is_opened:
            once = f"http://{HOST}:{port}/{OPEN}/{server.once}"
            threading.Thread(target=_open, args=[once], daemon=True).start()
        _run(server, listener)


def _open(address: str) -> None:
    """Open a browser, but none that takes this terminal.

    The command line of a browser is read by other users of the machine: the address leads to the page once.
    """
    with contextlib.suppress(webbrowser.Error, OSError):
        browser = webbrowser.get()
        is_in_terminal = isinstance(browser, webbrowser.GenericBrowser)
        if not is_in_terminal or isinstance(browser, webbrowser.BackgroundBrowser):
            browser.open(address)


@contextlib.contextmanager
def _listening(port: int) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((HOST, port))
        except OSError as error:
            raise ParameterError(f"port {port}: {error.strerror}; expected a free one, or no --port") from None
        listener.listen()
        yield listener


def _run(server: Server, listener: socket.socket) -> None:
    import uvicorn

    from .connections import CONNECTIONS, STRANGERS, Connection

    config = uvicorn.Config(
        server,
        http=Connection,
        ws="websockets-sansio",
        loop="asyncio",
        lifespan="off",
        log_config=None,
        log_level="error",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws_max_size=MOST_BYTES,
        ws_per_message_deflate=False,
        limit_concurrency=CONNECTIONS + STRANGERS,
        timeout_graceful_shutdown=PATIENCE,
    )
    running = uvicorn.Server(config)

    def stop(number: int, frame: Any) -> None:
        running.should_exit = True

    with _handled({"SIGTERM": _ended, "SIGHUP": stop}):
        running.run(sockets=[listener])


def _ended(number: int, frame: Any) -> None:
    """uvicorn raises the signals that it took once more, when it has ended."""
    raise SystemExit(128 + number)


@contextlib.contextmanager
def _handled(handlers: dict[str, Callable[[int, Any], None]]) -> Iterator[None]:
    """Signals handled by functions, as far as this system has them and this is the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    known = {getattr(signal, name): handler for name, handler in handlers.items() if hasattr(signal, name)}
    before = {number: signal.signal(number, handler) for number, handler in known.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
