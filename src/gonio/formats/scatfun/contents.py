"""The container of SCATFUN files: their parts, from bytes and back.

Layout, little-endian: 64 bytes of header, "SCATFUN", u8 version, then u32 (see `COUNTS`), f32 eta, f32 alpha[2] and
8 bytes unused; f32 nodes mu; u32 counts and f32 positions of textured parameters; f32 cdf[mu_o][mu_i]; u32 (offset,
length)[mu_o][mu_i]; f32 coefficients, per pair of nodes [channel][order]; metadata, in text.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...errors import FormatError

MAGIC = b"SCATFUN\x01"
COUNTS = ("flags", "nodes", "coefficients", "orders", "channels", "bases", "metadata", "parameters", "positions")
HEADER = struct.Struct("<8s9I3f8s")
GZIP, MOST_INFLATED = b"\x1f\x8b", 100


def inflated(data: bytes, where: str) -> bytes:
    """The content of a gzipped file, at most as long as its header says; other files unchanged."""
    if not data.startswith(GZIP):
        return data
    stream = zlib.decompressobj(zlib.MAX_WBITS | 16)
    try:
        head = stream.decompress(data, HEADER.size)
        size = _size(_header(head, where))
        if size > MOST_INFLATED * len(data):
            got = f"header says {size} bytes, more than {MOST_INFLATED} times the {len(data)} of the compressed file"
            raise FormatError(f"{where}: {got}; decompress it with gunzip if you trust it")
        rest = stream.decompress(stream.unconsumed_tail, size - len(head) + 1)
    except zlib.error as error:
        raise FormatError(f"{where}: damaged gzip file: {error}; fetch it again") from None
    if not stream.eof and len(head) + len(rest) <= size:
        raise FormatError(f"{where}: gzip file cut short after {len(head) + len(rest)} bytes; fetch it again")
    return head + rest


def _header(data: bytes, where: str) -> dict[str, Any]:
    if len(data) < HEADER.size:
        raise FormatError(f"{where}: SCATFUN file of {len(data)} bytes, its header alone has {HEADER.size}")
    magic, *numbers = HEADER.unpack_from(data)
    if magic != MAGIC:
        raise FormatError(f"{where}: starts with {magic!r}, expected {MAGIC!r}: SCATFUN, version 1")
    header = dict(zip(COUNTS, numbers, strict=False))
    header |= {"eta": numbers[9], "alpha": tuple(numbers[10:12]), "unused": numbers[12]}
    for name, allowed in (("flags", (1,)), ("channels", (1, 3)), ("bases", (1,)), ("parameters", (0,))):
        if header[name] not in allowed:
            rule = "files that extrapolate series or hold several materials are not read; write it without"
            raise FormatError(f"{where}: {name} is {header[name]}, expected {' or '.join(map(str, allowed))}: {rule}")
    if header["nodes"] < 2:
        raise FormatError(f"{where}: {header['nodes']} nodes, expected at least 2")
    return header


def _size(header: Mapping[str, Any]) -> int:
    pairs = header["nodes"] ** 2
    numbers = header["nodes"] + header["parameters"] + header["positions"] + 3 * pairs + header["coefficients"]
    return HEADER.size + 4 * numbers + header["metadata"]


def parse(data: bytes, where: str) -> dict[str, Any]:
    """The parts of a file; `where` names it in messages. Raises FormatError where they do not fit each other."""
    header = _header(data, where)
    if len(data) != _size(header):
        counts = f"{header['nodes']} nodes and {header['coefficients']} coefficients"
        got = f"SCATFUN file of {len(data)} bytes, expected {_size(header)} for {counts}"
        raise FormatError(f"{where}: {got}: cut short or damaged; fetch it again")
    at, n = HEADER.size, header["nodes"]

    def taken(dtype: str, *shape: int) -> np.ndarray:
        nonlocal at
        part = np.ndarray(shape, dtype, buffer=data, offset=at)
        at += part.nbytes
        return part

    mu = taken("<f4", n)
    parts = {"mu": mu, "positions": taken("<f4", header["positions"]), "cdf": taken("<f4", n, n)}
    parts |= {"places": taken("<u4", n, n, 2), "coefficients": taken("<f4", header["coefficients"])}
    steps = np.diff(mu.astype(float))
    increasing = (steps >= 0.0).all() and (steps[mu[1:] != 0.0] > 0.0).all() and (mu == 0.0).sum() <= 2
    if not (increasing and np.abs(mu).max() <= 1.0):
        raise FormatError(f"{where}: nodes {mu[:4]} ..., expected increasing cosines from -1 to 1, only 0 twice")
    offset, length = np.moveaxis(parts["places"].astype(np.int64), -1, 0)
    count, width = header["coefficients"], header["channels"]
    end = offset + width * length
    if length.max() > header["orders"] or end[length > 0].max(initial=0) > count:
        got = f"pairs of nodes have up to {length.max()} orders, their coefficients end at {end.max()}"
        raise FormatError(f"{where}: {got}; expected {header['orders']} and {count} at most: damaged")
    if width * length.sum() > count:
        raise FormatError(f"{where}: pairs of nodes share coefficients: {width * length.sum()} of {count}; damaged")
    named = {name: header[name] for name in ("channels", "orders", "eta", "alpha", "unused")}
    return {**parts, "metadata": data[at:], **named}


def serialize(parts: Mapping[str, Any]) -> bytes:
    """The file of these parts."""
    nodes, coefficients, metadata, positions = (len(parts[n]) for n in ("mu", "coefficients", "metadata", "positions"))
    counts = (1, nodes, coefficients, parts["orders"], parts["channels"], 1, metadata, 0, positions)
    arrays = b"".join(parts[name].tobytes() for name in ("mu", "positions", "cdf", "places", "coefficients"))
    return HEADER.pack(MAGIC, *counts, parts["eta"], *parts["alpha"], parts["unused"]) + arrays + parts["metadata"]
