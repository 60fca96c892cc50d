"""What goes through the pipes between server and worker: a number, a length, and as many bytes."""

from __future__ import annotations

import struct
from typing import IO

_HEAD = struct.Struct("<II")


def send(pipe: IO[bytes], number: int, content: bytes) -> None:
    """Write one piece."""
    pipe.write(_HEAD.pack(number, len(content)))
    pipe.write(content)
    pipe.flush()


def receive(pipe: IO[bytes]) -> tuple[int, bytes] | None:
    """The next piece; None where the pipe has ended."""
    head = pipe.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    number, length = _HEAD.unpack(head)
    content = pipe.read(length)
    return None if len(content) < length else (number, content)
