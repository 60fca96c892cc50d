"""Reflection by films: amplitudes at a layer's surface from those at its bottom."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from ..complex import Complex, as_complex

Amplitudes = tuple[Complex, Complex]


def layered(cos_theta: Any, indices: Iterable[Complex], phases: Iterable[Any]) -> Amplitudes:
    """(r_s, r_p) of layers on a substrate, in vacuum, with r_p = -r_s at normal incidence.

    With q = sqrt(n^2 - sin^2) in each medium: at an interface r_s = (q - q')/(q + q') and
    r_p = (n'^2 q - n^2 q')/(n'^2 q + n^2 q'). Above a layer of phase z = exp(2 i q phase), whose bottom reflects R,
    r becomes (r + R z)/(1 + r R z): Airy's sum over all reflections, the same as a product of characteristic matrices,
    and stable in layers that let no light through.

    indices   n + ik of the layers from the top, then of the substrate
    phases    2 pi thickness/wavelength of the layers
    """
    s2 = 1.0 - cos_theta * cos_theta
    media = [(Complex(1.0), Complex(cos_theta))]
    for n in indices:
        e = n * n
        media.append((e, as_complex(e - s2).sqrt()))
    steps = [None, *phases]
    total: Amplitudes | None = None
    for k in range(len(media) - 2, -1, -1):
        (e, q), (e_below, q_below) = media[k], media[k + 1]
        s = (q - q_below) / (q + q_below)
        a, b = e_below * q, e * q_below
        p = (a - b) / (a + b)
        if total is not None:
            z = (Complex(0.0, 2.0) * q_below * steps[k + 1]).exp()
            s, p = (_airy(r, R * z) for r, R in zip((s, p), total, strict=True))
        total = s, p
    assert total is not None
    return total


def _airy(r: Complex, back: Complex) -> Complex:
    return (r + back) / (1.0 + r * back)


def phase(thickness: Any, wavelength: Any) -> Any:
    """2 pi thickness/wavelength."""
    return (2.0 * math.pi) * thickness / wavelength
