"""Rays of NumPy arrays by functions that take packets of 16, whose addresses a table holds (`numerics/embree.py`)."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

PACKET = 16
"""Rays in a packet."""

ROWS = 24
"""Rows of `PACKET` numbers of 4 bytes that a packet takes, at most."""

FAR, MASK, TRIANGLE, GEOMETRY, INSTANCES = 8, 9, 17, 18, slice(19, 21)
"""Rows of a packet: the distance, the mask of what rays see, and the numbers of what they hit. Before these stand
origin, least distance, direction and time, between them number, flags, and normal (12 to 14) and place (15, 16) of the
hit."""

NEAREST, BLOCKED = 0, 1
"""Ways of shooting: the nearest hit, or whether there is any."""

_PROTOTYPE = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4)


def shot(table: Any, way: int, *rays: Any) -> tuple[Any, ...]:
    """What `ops.nearest` or `ops.blocked` gives for origins, directions, and least and largest distances."""
    pieces = [int(x) for x in np.asarray(table.take(np.arange(12)))]
    nearest, blocked, scene = (sum(p << 16 * k for k, p in enumerate(pieces[a : a + 4])) for a in (0, 4, 8))
    function = _PROTOTYPE(blocked if way == BLOCKED else nearest)
    arrays = np.broadcast_arrays(*rays)
    shape, dtype = arrays[0].shape, np.result_type(*(x for x in rays if hasattr(x, "dtype")))
    count = -(-arrays[0].size // PACKET)
    memory = np.zeros((count * ROWS + 1) * PACKET + PACKET, np.float32)
    start = -memory.ctypes.data % 64 // 4
    packets = memory[start : start + count * ROWS * PACKET].reshape(count, ROWS, PACKET)
    whole = packets.view(np.int32)
    for k, x in zip((0, 1, 2, 4, 5, 6, 3, FAR), arrays, strict=True):
        filled = np.resize(x.astype(np.float32).reshape(-1), count * PACKET) if x.size else 0.0
        packets[:, k] = np.reshape(filled, (count, PACKET))
    whole[:, MASK] = whole[:, GEOMETRY] = whole[:, INSTANCES] = -1
    valid = np.full(2 * PACKET, -1, np.int32)
    at_valid = valid.ctypes.data + -valid.ctypes.data % 64
    for packet in packets:
        function(at_valid, scene, packet.ctypes.data, None)

    def row(rows: np.ndarray, k: int) -> np.ndarray:
        return rows[:, k].reshape(-1)[: arrays[0].size].reshape(shape)

    if way == BLOCKED:
        return (row(packets, FAR) == -np.inf,)
    hit = row(whole, GEOMETRY) != -1
    numbers = (np.where(hit, row(packets, k), 0.0).astype(dtype) for k in (15, 16))
    distance = np.where(hit, row(packets, FAR), np.inf).astype(dtype)
    return distance, *numbers, np.where(hit, row(whole, TRIANGLE), 0).astype(np.intp)
