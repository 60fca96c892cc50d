"""A server of `gonio view` in a process of its own, with a page of a few lines, and a client of it.

`python explorer_server.py MATERIAL ...` is `gonio view MATERIAL ...` with more calls: "crash", "hang" and "exhaust",
of which the last two are ended after a second, and "slow", which takes three; a request must be there in two seconds.
"""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

HTML = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>explorer</title>
<link rel="stylesheet" crossorigin href="./explorer.css">
<script type="module" crossorigin src="./explorer.js"></script></head><body><p id="hello">hello</p></body></html>
"""
PAGE = {
    "index.html": HTML,
    "explorer.js": 'window.end = "</script><!-- $& ";\n',
    "explorer.css": "p { color: red; }\n",
    "LICENSES.txt": "MIT </script> http://example.com\n",
}
MORE_CALLS = """
import os, time
from gonio.explorer import calls

def crash(shelf):
    os._exit(3)

def hang(shelf):
    while True:
        time.sleep(0.01)

def exhaust(shelf):
    bytes(1 << 60)

def slow(shelf):
    time.sleep(3.0)
    return {}

calls.CALLS.update({f.__name__: calls.PageCall(f, 1.0) for f in (crash, hang, exhaust)})
calls.CALLS.update(slow=calls.PageCall(slow, 60.0))
"""


def main() -> None:
    """The command line, with this page and these calls."""
    from gonio.cli.commands import main as command_line
    from gonio.explorer import connections, page, process

    files = {name: page.PageFile(text.encode(), page.TYPES[Path(name).suffix]) for name, text in PAGE.items()}
    page.files = lambda: files
    connections.PATIENCE = 2.0
    python, unsafe, code, text = process.command()
    process.command = lambda: [python, unsafe, code, f"exec({MORE_CALLS!r}); {text}"]
    exec(MORE_CALLS, {})  # with globals of their own, as in the worker
    sys.argv = ["gonio", "view", *sys.argv[1:]]
    command_line()


class Explorer:
    """`with Explorer("gold") as explorer`: its address, and what one may ask it."""

    def __init__(self, *words: str):
        command = [sys.executable, str(Path(__file__).resolve()), *words, "--no-browser"]
        environment = {**os.environ, "PYTHONIOENCODING": "utf-8"}
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment)
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().decode().strip()
        if not self.address:
            raise RuntimeError(self.process.communicate()[1].decode())
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/([\w-]+)/", self.address)
        assert found, self.address
        self.port, self.token = int(found[1]), found[2]
        self.host = f"127.0.0.1:{self.port}"

    def get(self, path: str, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and content of a path below the token."""
        return self.raw(f"/{self.token}/{path}", method, **headers)

    def raw(
        self, path: str, method: str = "GET", body: Any = None, **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        """The same for any path."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
        finally:
            connection.close()

    def bytes(self, content: bytes) -> bytes:
        """What comes back for bytes of any kind, until the server hangs up or has nothing to say for two seconds."""
        parts = []
        with socket.create_connection(("127.0.0.1", self.port), timeout=2) as connection:
            connection.sendall(content)
            with contextlib.suppress(TimeoutError):
                while part := connection.recv(65536):
                    parts.append(part)
        return b"".join(parts)

    def upload(self, name: str, content: bytes) -> tuple[int, dict[str, Any]]:
        """Status and answer of a dropped file."""
        status, _, text = self.raw(f"/{self.token}/upload?name={quote(name, safe='')}", "POST", content)
        return status, json.loads(text)

    def socket(self, **more: Any) -> Any:
        """A connected socket."""
        from websockets.sync.client import connect

        more = {"origin": f"http://{self.host}", "max_size": None, "compression": None, **more}
        return connect(f"ws://{self.host}/{self.token}/socket", **more)

    def ask(self, call: str, **arguments: Any) -> dict[str, Any]:
        """The answer to a request, arrays as NumPy arrays."""
        with self.socket() as connection:
            connection.send(json.dumps({"id": 7, "call": call, **arguments}))
            found = unpacked(connection.recv(timeout=120))
        assert found["id"] == 7
        return found

    def result(self, call: str, **arguments: Any) -> Any:
        """The result of a request that succeeds."""
        found = self.ask(call, **arguments)
        assert found["ok"], found["error"]
        return found["result"]

    def children(self) -> list[int]:
        """The numbers of the processes that the server has started."""
        found = []
        for path in Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = path.read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[1]) == self.process.pid and fields[0] != "Z":
                found.append(int(path.parent.name))
        return found

    def stop(self, number: int = signal.SIGINT) -> tuple[int, str]:
        """Exit code and standard error after a signal."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        _, errors = self.process.communicate(timeout=30)
        return self.process.returncode, errors.decode()

    def __enter__(self) -> Explorer:
        return self

    def __exit__(self, *error: Any) -> None:
        if self.process.poll() is None:
            self.process.terminate()
        self.process.communicate(timeout=30)


def unpacked(message: bytes) -> dict[str, Any]:
    """The header of an answer, with its arrays."""
    length = int.from_bytes(message[:4], "little")
    assert length % 4 == 0
    numbers = np.frombuffer(message, "<f4", offset=4 + length)
    header: dict[str, Any] = json.loads(message[4 : 4 + length], parse_constant=_none)

    def filled(value: Any) -> Any:
        if isinstance(value, dict) and {"offset", "length", "shape"} == value.keys():
            first = value["offset"] // 4
            return numbers[first : first + value["length"]].reshape(value["shape"])
        if isinstance(value, dict):
            return {name: filled(x) for name, x in value.items()}
        return [filled(x) for x in value] if isinstance(value, list) else value

    found: dict[str, Any] = filled(header)
    return found


def _none(name: str) -> Any:
    raise ValueError(f"{name} is no JSON")


if __name__ == "__main__":
    main()
