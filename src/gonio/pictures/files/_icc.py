"""ICC profiles, as far as they say how codes become linear light: curves of red, green, blue or gray, and primaries.

Source   ICC.1:2022, "Image technology colour management", 7, 10.6 curveType, 10.18 parametricCurveType.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..colour import srgb_decode

SRGB_D50 = np.array([[0.4361, 0.3851, 0.1431], [0.2225, 0.7169, 0.0606], [0.0139, 0.0971, 0.7141]])
"""X, Y, Z of sRGB's red, green and blue under D50, as its profiles have them."""


class Profile(NamedTuple):
    """Linear values (C, N) of codes from 0 to 1, and whether the primaries are sRGB's."""

    light: NDArray[np.float64]
    is_srgb: bool


def profile(data: bytes, count: int, codes: NDArray[np.float64]) -> Profile | None:
    """What a profile of so many channels makes of codes (N,) from 0 to 1; None for one of tables, or a damaged one."""
    try:
        if data[16:20] != {1: b"GRAY", 3: b"RGB "}[count] or data[36:40] != b"acsp":
            return None
        number = min(struct.unpack_from(">I", data, 128)[0], 100)
        tags = {a: (b, c) for a, b, c in (struct.unpack_from(">4s2I", data, 132 + 12 * k) for k in range(number))}
        names = (b"k",) if count == 1 else (b"r", b"g", b"b")
        light = np.stack([_curve(_part(data, tags[name + b"TRC"]), codes) for name in names])
        if not np.isfinite(light).all():
            return None
        is_srgb = True
        if count == 3:
            colours = [struct.unpack_from(">3i", data, tags[name + b"XYZ"][0] + 8) for name in names]
            is_srgb = np.allclose(np.transpose(colours) / 65536.0, SRGB_D50, atol=0.003)
    except (struct.error, LookupError, ValueError, ArithmeticError):
        return None
    exact = srgb_decode(codes)
    return Profile(np.where(np.abs(light - exact).max(axis=1, keepdims=True) < 1e-3, exact, light), bool(is_srgb))


def _part(data: bytes, place: tuple[int, int]) -> bytes:
    return data[place[0] : sum(place)]


def _curve(data: bytes, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """A curve, at values from 0 to 1."""
    if data[:4] == b"curv":
        (count,) = struct.unpack_from(">I", data, 8)
        if count < 2:
            return x ** (struct.unpack_from(">H", data, 12)[0] / 256.0 if count else 1.0)
        table = np.frombuffer(data, ">u2", count, 12) / 65535.0
        return np.interp(x, np.linspace(0.0, 1.0, count), table)
    kind = struct.unpack_from(">H", data, 8)[0]
    g, *rest = (v / 65536.0 for v in struct.unpack_from(f">{(1, 3, 4, 5, 7)[kind]}i", data, 12))
    given: list[float] = [*rest, *[1.0, 0.0, 0.0, 0.0, 0.0, 0.0][len(rest) :]]
    a, b, c, d, e, f = given
    if kind in (1, 2):
        c, d, e, f = 0.0, -b / a, c, c
    return np.where(x >= d, np.maximum(a * x + b, 0.0) ** g + e, c * x + f)
