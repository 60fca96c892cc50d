"""Rays as LLVM IR: packets of 16 are written to memory, and a function is called whose address a table holds.

The function is Embree's (`numerics/embree.py`), and so is the layout of a packet (`arrays/packets.py`).
"""

from __future__ import annotations

from collections.abc import Sequence

from ...arrays.packets import BLOCKED, FAR, GEOMETRY, INSTANCES, MASK, PACKET, ROWS, TRIANGLE
from .lanes import FLOAT32, IRValue, Lanes

MEMORY = (
    f"%packet = alloca [{ROWS} x <{PACKET} x float>], align 64",
    f"%packet.valid = alloca <{PACKET} x i32>, align 64",
)
"""What a kernel with rays has on its stack."""

_ROWS_OF_RAYS = (0, 1, 2, 4, 5, 6, 3, FAR)
_FLOATS, _WHOLE = f"<{PACKET} x float>", f"<{PACKET} x i32>"


def shot(v: Lanes, table: int, way: int, ray: Sequence[IRValue], going: IRValue) -> list[IRValue]:
    """What rays meet in the lanes that are `going`: origins, directions, least and largest distances."""
    function, scene = _address(v, table, way), _address(v, table, 2)
    wide = f"<{v.width} x float>"
    if v.dtype != FLOAT32:
        ray = [v.emit("real", f"fptrunc {v.types['real']} {x.name} to {wide}") for x in ray]
    ones = v.emit("index", f"sext {v.types['mask']} {going.name} to {v.types['index']}")
    parts = []
    for start in range(0, v.width, PACKET):
        here = range(start, min(start + PACKET, v.width))
        for row, x in zip(_ROWS_OF_RAYS, ray, strict=True):
            _store(v, row, _FLOATS, _lanes(v, wide, x.name, here, PACKET))
        _store(v, 7, _FLOATS, "zeroinitializer")
        for row in (MASK, GEOMETRY, *range(INSTANCES.start, INSTANCES.stop)):
            _store(v, row, _WHOLE, "splat (i32 -1)")
        valid = _lanes(v, v.types["index"], ones.name, here, PACKET, v.width)
        v.write(
            f"store {_WHOLE} {valid}, ptr %packet.valid, align 64",
            f"call void {function}(ptr %packet.valid, ptr {scene}, ptr %packet, ptr null)",
        )
        rows = (FAR,) if way == BLOCKED else (FAR, 15, 16, TRIANGLE, GEOMETRY)
        parts.append([_load(v, row) for row in rows])
    met = [_joined(v, [part[k] for part in parts], k >= 3) for k in range(len(parts[0]))]
    if way == BLOCKED:
        beyond = "splat (float 0xFFF0000000000000)"
        return [v.emit("mask", f"fcmp oeq {wide} {met[0]}, {beyond}")]
    distance, a, b, number, geometry = met
    hit = v.emit("mask", f"icmp ne {v.types['index']} {geometry}, splat (i32 -1)")
    reals = [IRValue("real", x) for x in (distance, a, b)]
    if v.dtype != FLOAT32:
        reals = [v.emit("real", f"fpext {wide} {x.name} to {v.types['real']}") for x in reals]
    results = [v.select(hit, x, v.real(miss)) for x, miss in zip(reals, (float("inf"), 0.0, 0.0), strict=True)]
    return [*results, v.select(hit, IRValue("index", number), v.index(0))]


def _address(v: Lanes, table: int, which: int) -> str:
    """An address that a table holds in four numbers."""
    real, address = v.scalar["real"], "0"
    for k in range(4):
        at = v.emit("address", f"getelementptr {real}, ptr %t{table}, i64 {4 * which + k}").name
        number = v.emit("real", f"load {real}, ptr {at}, align 4").name
        whole = v.emit("address", f"fptoui {real} {number} to i64").name
        moved = v.emit("address", f"shl i64 {whole}, {16 * k}").name
        address = v.emit("address", f"or i64 {address}, {moved}").name
    return v.emit("address", f"inttoptr i64 {address} to ptr").name


def _row(v: Lanes, row: int) -> str:
    return v.emit("address", f"getelementptr i8, ptr %packet, i64 {4 * PACKET * row}").name


def _store(v: Lanes, row: int, row_type: str, value: str) -> None:
    v.write(f"store {row_type} {value}, ptr {_row(v, row)}, align 64")


def _load(v: Lanes, row: int) -> str:
    row_type = _WHOLE if row in (TRIANGLE, GEOMETRY) else _FLOATS
    return v.emit("row", f"load {row_type}, ptr {_row(v, row)}, align 64").name


def _lanes(v: Lanes, vector: str, value: str, lanes: range, count: int, zero: int = 0) -> str:
    """These lanes of a vector as one of `count`; further lanes have lane number 0, or 0 where `zero` is the width."""
    picks = ", ".join(f"i32 {lanes[i] if i < len(lanes) else zero}" for i in range(count))
    return v.emit("lanes", f"shufflevector {vector} {value}, {vector} zeroinitializer, <{count} x i32> <{picks}>").name


def _joined(v: Lanes, parts: Sequence[str], whole: bool) -> str:
    """Rows of packets as one vector of the width of the kernel, at most two."""
    vector, other = (_WHOLE if whole else _FLOATS), parts[-1]
    picks = ", ".join(f"i32 {i}" for i in range(v.width))
    return v.emit("lanes", f"shufflevector {vector} {parts[0]}, {vector} {other}, <{v.width} x i32> <{picks}>").name
