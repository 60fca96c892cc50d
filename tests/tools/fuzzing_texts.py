"""Damaged luminaires and height maps: minimal files, and what reading one of them comes to."""

from __future__ import annotations

import struct
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from fuzzing import mutated, outcome_of

import gonio as gn

HEIGHTS = np.round(np.sin(np.arange(9) / 3.0)[:, None] * np.cos(np.arange(10) / 4.0), 3)


def _ies() -> bytes:
    head = b"IESNA:LM-63-2002\n[TEST] ours\nTILT=INCLUDE\n1\n2\n0 90\n1 0.9\n1 1000 1 3 2 1 2 0.1 0.2 0\n1 1 50\n"
    return head + b"0 45 90\n0 90\n100 50 10\n90 40 5\n"


def _ldt() -> bytes:
    lines = [
        "ours",
        "1",
        "0",
        "4",
        "90",
        "3",
        "90",
        "report",
        "lamp",
        "1",
        "lamp.ldt",
        "today",
        *["0"] * 11,
        "1,0",
        "0",
        "1",
    ]
    lines += ["1", "LED", "2000", "840", "80", "20", *["0"] * 10, "0", "90", "180", "270", "0", "90", "180"]
    return "\r\n".join([*lines, *map(str, range(12))]).encode()


def _npy() -> bytes:
    file = BytesIO()
    np.save(file, HEIGHTS)
    return file.getvalue()


def _rows(between: str, decimal: str) -> bytes:
    return "\n".join(between.join(f"{z:.3f}".replace(".", decimal) for z in row) for row in HEIGHTS).encode()


def _sdf_text() -> bytes:
    fields = {"ManufacID": "x", "NumPoints": 10, "NumProfiles": 9, "Xscale": 1e-6, "Yscale": 1e-6, "Zscale": 1e-6}
    fields |= {"Zresolution": -1, "Compression": 0, "DataType": 7, "CheckType": 0}
    head = "\r\n".join(["aISO-1.0", *(f"{name} = {x}" for name, x in fields.items())])
    return f"{head}\r\n*\r\n{_rows(' ', '.').decode()}\r\n*\r\n".encode()


def _sdf_binary() -> bytes:
    head = struct.pack("<10s12s12sHHddddBBB", b"x", b"0", b"0", 10, 9, 1e-6, 1e-6, 1e-6, -1.0, 0, 7, 0)
    return b"bISO-1.0" + head + HEIGHTS.tobytes()


def _luminaire(path: Path) -> Any:
    return gn.GoniometricLight(str(path))


def _map(path: Path) -> Any:
    return gn.surfaces.from_map(path, None if path.suffix == ".sdf" else 1.0)


SEEDS: dict[str, tuple[Callable[[], bytes], str, Callable[[Path], Any]]] = {
    "luminaire IES": (_ies, ".ies", _luminaire),
    "luminaire EULUMDAT": (_ldt, ".ldt", _luminaire),
    "height map npy": (_npy, ".npy", _map),
    "height map text": (lambda: _rows(" ", "."), ".txt", _map),
    "height map decimal commas": (lambda: _rows(";", ","), ".csv", _map),
    "height map SDF text": (_sdf_text, ".sdf", _map),
    "height map SDF": (_sdf_binary, ".sdf", _map),
}
"""Name -> minimal file, suffix, reader."""


def trial(name: str, path: Path) -> Callable[[int], str]:
    """Given a path to write damaged files to: what becomes of the mutation with a number."""
    make, suffix, read = SEEDS[name]
    seed, file = make(), path.with_suffix(suffix)
    read_whole(file, seed, read)

    def of(number: int) -> str:
        data = mutated(seed, number)
        file.write_bytes(data)
        return outcome_of(lambda: read(file), len(data))

    return of


def read_whole(file: Path, seed: bytes, read: Callable[[Path], Any]) -> Any:
    """What the file that is not damaged holds."""
    file.write_bytes(seed)
    return read(file)
