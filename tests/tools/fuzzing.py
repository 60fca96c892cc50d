"""Damaged files: mutations of minimal valid ones, by number, and what reading one of them comes to."""

from __future__ import annotations

import atexit
import io
import json
import os
import re
import resource
import signal
import struct
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from random import Random
from typing import Any
from unittest import mock
from zipfile import ZipFile, ZipInfo

import h5netcdf  # noqa: F401  (loaded before memory is limited)
import numpy as np
import scipy.interpolate
import scipy.spatial
import scipy.special  # noqa: F401  (loaded before memory is limited)
import xarray  # noqa: F401  (loaded before memory is limited)

import gonio as gn
from gonio.evaluate import batch
from gonio.formats._reading import hdf, hdf_probe

# All libraries that reading may need are loaded above: loading one where memory is limited may never end.

LONGEST = 5
"""Seconds of work that reading may take."""

NUMBERS = (
    *("0", "-0", "1", "-1", "2", "1e308", "1e400", "-1e400", "1e-320", "nan", "inf", "-inf", "NaN", "1e12", "1e12.5"),
    *(
        "999999999999",
        "-999999999999",
        "2147483648",
        "18446744073709551616",
        "0x10",
        "1,5",
        "1.2.3",
        "--1",
        "",
        "٣",
        "x",
    ),
    *("90", "90.0001", "180", "360", "0.5", "1" * 400),
)
WORDS = (
    "",
    "NaN",
    "null",
    "{}",
    "[]",
    '"',
    "<",
    ">",
    "&",
    "&a;",
    "<!DOCTYPE a>",
    "#",
    "\0",
    "\ufeff",
    "\x1a",
    "é",
    "\\",
    "]]>",
)
LINE_ENDS = ("\r", "\r\n", "\n\n", "", " ", "\v", "\u2028")
INTEGERS = (0, 1, 2, -1, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 10**12, 2**63 - 1, 2**63)
FLOATS = (float("nan"), float("inf"), -float("inf"), 0.0, -1.0, 1e-40, 1e30, 1e300, 90.0, 1e12)
_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_]\w*")


def mutated(data: bytes, number: int) -> bytes:
    """One to four mutations of a file, always the same for the same number."""
    random = Random(number)
    if data.startswith(b"PK") and random.random() < 0.9:
        return _repacked(data, random)
    return _several(data, random)


def _repacked(data: bytes, random: Random) -> bytes:
    """A zip file with one of its files mutated: its checksums would tell of damage before anybody looks at it."""
    packed = io.BytesIO()
    with ZipFile(io.BytesIO(data)) as old, ZipFile(packed, "w") as new:
        chosen = random.randrange(len(old.namelist()))
        for k, name in enumerate(old.namelist()):
            content = old.read(name)
            new.writestr(ZipInfo(name), _several(content, random) if k == chosen else content)
    return packed.getvalue()


def _several(data: bytes, random: Random) -> bytes:
    is_text, longest = sum(b < 9 for b in data[:512]) == 0, max(len(data), 1 << 20)
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 4))):
        of_text = is_text and random.random() < 0.8
        data = random.choice(_TEXT if of_text else _BYTES)(data, random)
        data = data[:longest]
    return data


def _span(data: bytes, random: Random) -> tuple[int, int]:
    """A stretch of the file, more often a short one near its start."""
    start = int(len(data) * random.random() ** random.choice((1, 3)))
    return start, min(len(data), start + random.choice((1, 2, 4, 8, 32, 200, 2000)))


def _cut(data: bytes, random: Random) -> bytes:
    return data[: _span(data, random)[0]]


def _without(data: bytes, random: Random) -> bytes:
    a, b = _span(data, random)
    return data[:a] + data[b:]


def _twice(data: bytes, random: Random) -> bytes:
    a, b = _span(data, random)
    return data[:b] + data[a:b] * random.choice((1, 1, 2, 50)) + data[b:]


def _exchanged(data: bytes, random: Random) -> bytes:
    (a, b), (c, d) = sorted((_span(data, random), _span(data, random)))
    return data if c < b else data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def _flipped(data: bytes, random: Random) -> bytes:
    if not data:
        return b"\0"
    a, _ = _span(data, random)
    a = min(a, len(data) - 1)
    return data[:a] + bytes([data[a] ^ 1 << random.randrange(8)]) + data[a + 1 :]


def _noise(data: bytes, random: Random) -> bytes:
    a, b = _span(data, random)
    return data[:a] + random.randbytes(b - a) + data[b:]


def _integer(data: bytes, random: Random) -> bytes:
    size = random.choice((1, 2, 4, 8))
    value = (random.choice(INTEGERS) + random.choice((0, 0, 1, -1))) % (1 << 8 * size)
    return _over(data, value.to_bytes(size, random.choice(("little", "little", "big"))), random)


def _real(data: bytes, random: Random) -> bytes:
    form = random.choice(("<f", "<d"))
    value = random.choice(FLOATS)
    return _over(data, struct.pack(form, value if form == "<d" or abs(value) < 1e38 else np.float32("inf")), random)


def _over(data: bytes, new: bytes, random: Random) -> bytes:
    a, _ = _span(data, random)
    a -= a % random.choice((1, len(new)))
    return data[:a] + new + data[a + len(new) :]


def _other_number(data: bytes, random: Random) -> bytes:
    return _replaced(data, _NUMBER, random.choice(NUMBERS).encode(), random)


def _near_number(data: bytes, random: Random) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return data
    at = random.choice(found)
    value = float(at.group()) if len(at.group()) < 30 else 1.0
    new = random.choice((value + 1, value - 1, -value, 2 * value, value / 3, value * 1000, value + 360))
    text = f"{int(new)}" if at.group().isdigit() and abs(new) < 1e15 else f"{new:g}"
    return data[: at.start()] + text.encode() + data[at.end() :]


def _other_word(data: bytes, random: Random) -> bytes:
    found = [m.group() for m in _WORD.finditer(data)] or [b"word"]
    new = random.choice((random.choice(found), random.choice(WORDS).encode(), random.choice(found).upper()))
    return _replaced(data, _WORD, new, random)


def _replaced(data: bytes, what: re.Pattern, new: bytes, random: Random) -> bytes:
    found = list(what.finditer(data))
    if not found:
        return data + new
    at = random.choice(found if random.random() < 0.7 else found[:20])
    return data[: at.start()] + new + data[at.end() :]


def _lines(data: bytes, random: Random) -> bytes:
    lines = data.split(b"\n")
    i, j = random.randrange(len(lines)), random.randrange(len(lines))
    change = random.randrange(5)
    if change == 0:
        lines[i], lines[j] = lines[j], lines[i]
    elif change == 1:
        del lines[i : i + random.choice((1, 1, 2, 10))]
    elif change == 2:
        lines.insert(i, lines[j])
    elif change == 3:
        lines[i] = lines[i] + b" " + lines[j]
    else:
        return random.choice(LINE_ENDS).encode().join(lines)
    return b"\n".join(lines)


def _separators(data: bytes, random: Random) -> bytes:
    old, new = (
        random.choice((b" ", b",", b"\t", b":", b"=", b";")),
        random.choice((b" ", b",", b"\t", b"", b";", b"  ")),
    )
    return data.replace(old, new, random.choice((1, 3, -1)))


_BYTES = (_cut, _without, _twice, _exchanged, _flipped, _flipped, _noise, _integer, _integer, _integer, _real, _real)
_TEXT = (
    _other_number,
    _other_number,
    _near_number,
    _other_word,
    _other_word,
    _lines,
    _lines,
    _separators,
    _cut,
    _without,
)
_TEXT += (_twice, _exchanged, _flipped)


class Hang(BaseException):
    """Reading took longer than `LONGEST`: no Exception, so that nobody but the campaign can catch it."""


def allowed(size: int, times: int = 64) -> int:
    """Bytes of memory that reading a file of this size may take: 64 MB, and so many times its size."""
    return (64 << 20) + times * size


@contextmanager
def bounded_memory(size: int, times: int = 64) -> Iterator[None]:
    """At most `allowed` more memory than now."""
    with Path("/proc/self/statm").open(encoding="ascii") as file:
        now = int(file.read().split()[0]) * resource.getpagesize()
    old = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (now + allowed(size, times), old[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, old)


@contextmanager
def bounded_time() -> Iterator[None]:
    """At most `LONGEST` seconds of work, and ten times as long on a busy machine or waiting."""

    def stop(*_: object) -> None:
        raise Hang

    clocks = {signal.SIGVTALRM: (signal.ITIMER_VIRTUAL, LONGEST), signal.SIGALRM: (signal.ITIMER_REAL, 10 * LONGEST)}
    before = {number: signal.signal(number, stop) for number in clocks}
    for clock, seconds in clocks.values():
        signal.setitimer(clock, seconds)
    try:
        yield
    finally:
        for number, (clock, _) in clocks.items():
            signal.setitimer(clock, 0.0)
            signal.signal(number, before[number])


@contextmanager
def reading(size: int, times: int = 64) -> Iterator[None]:
    """For reading a damaged file of this size, in bounded memory: values may be anything."""
    probed = partial(probed_by_one, allowed(size, times))
    with warnings.catch_warnings(), bounded_memory(size, times), mock.patch.object(hdf, "probed", probed):
        warnings.simplefilter("ignore")  # as said above
        yield


_probes: list[subprocess.Popen] = []
"""The process that `probed_by_one` asks, once there is one."""


@atexit.register
def _end() -> None:
    while _probes:
        asked = _probes.pop()
        asked.kill()
        asked.communicate()


def probed_by_one(memory: int, *words: str) -> bytes:
    """`hdf.probed` by a process that has the libraries already: 5 ms instead of 300."""
    if not _probes:
        limit = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (limit[1], limit[1]))  # what this process may take is not its limit
        command = [sys.executable, str(Path(__file__).with_name("hdf_probes.py")), hdf_probe.__file__]
        _probes.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE))
        resource.setrlimit(resource.RLIMIT_AS, limit)
    asked = _probes[0]
    said = b""
    try:
        asked.stdin.write(json.dumps([memory, *words]).encode() + b"\n")
        asked.stdin.flush()
        while not said.endswith(b"\0"):
            part = os.read(asked.stdout.fileno(), 1 << 16)
            if not part:
                raise EOFError("the process that probes HDF files has ended")
            said += part
    except BaseException:
        _end()
        raise
    return said[:-1]


WI = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [-0.48, 0.64, 0.6]])
WO = np.array([[0.0, 0.6, 0.8], [-0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])


def outcome(data: bytes, path: Path, evaluate: bool = False, times: int = 64) -> str:
    """What reading a file of these bytes comes to: "read", or the error's words without names and numbers.

    Raises whatever is no `gonio.Error`: that is a finding. `evaluate`: look at the values of what was read, too.
    """
    path.write_bytes(data)
    return outcome_of(lambda: gn.load(path), len(data), evaluate, times)


def outcome_of(read: Callable[[], Any], size: int, evaluate: bool = False, times: int = 64) -> str:
    """The same of what a function reads."""
    try:
        with reading(size, times), bounded_time():
            m = read()
            if evaluate:
                shape = np.shape(m.f(WI, WO))
                expected = np.broadcast_shapes(batch.full_shape(m, ()), (3,))  # a damaged file may hold maps
                assert shape[: len(expected)] == expected, (shape, expected)
                _ = getattr(m, "valid", None)
    except gn.Error as error:
        text = re.sub(r"/[\w/]*damaged", "", str(error))
        return type(error).__name__ + re.sub(r"['\"].*?['\"]|[-+\d.]+(e[-+]?\d+)?|nan|inf", "~", text)[:160]
    return "read"
