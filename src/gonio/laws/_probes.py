"""Directions at which laws are tried, and comparisons of values there. Nothing is random: two runs agree."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import angles, direction
from ..base.channel_names import channel as channel
from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..base.results import Sample
from ..base.sides import is_lit
from ..numerics.lattice import lattice

PAIRS = 1 << 17
OPPOSITE = 1 << 14
SAMPLES = 1 << 16
VALUES = 1 << 23
"""Values of f, in all channels, that a law looks at together: those of all pairs, of up to 64 channels."""

AT_ONCE = 1 << 18
"""Values of what is summed up, or bounded, part by part: few enough to stay in a processor's caches."""

INCIDENCE = np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 88.0, 89.5, 89.9])
BESIDE = np.radians([-0.3, 0.3])
VIEWS = np.radians([0.0, 30.0, 60.0, 80.0])


@cache
def pairs(n: int = PAIRS) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions: most spread evenly over both hemispheres, the rest close to mirror pairs and to grazing."""
    a, b = lattice(n, 4)[:, :2], lattice(n, 4)[:, 2:]
    theta_i, theta_o = np.arccos(1.0 - 0.9998 * a[:, 0]), np.arccos(1.0 - 0.9998 * b[:, 0])
    phi_i, phi_o = 2 * np.pi * a[:, 1], 2 * np.pi * b[:, 1]
    near = slice(0, n // 4)  # within a few degrees of the mirror pair, where glossy materials change fastest
    spread = 0.3 * b[near] ** 4 * np.where(a[near] > 0.5, 1.0, -1.0)
    theta_o[near] = np.clip(theta_i[near] + spread[:, 0], 0.0, np.radians(89.99))
    phi_o[near] = phi_i[near] + np.pi + spread[:, 1]
    wi, wo = direction(theta_i, phi_i), direction(theta_o, phi_o)
    wi.flags.writeable = wo.flags.writeable = False
    return wi, wo


@cache
def exact_pairs() -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions where formulas break: wi = wo, mirror pairs, one or both along the normal."""
    few, up = pairs()[0][:: PAIRS // 16], np.array([[0.0, 0.0, 1.0]])
    normal, mirror = np.broadcast_to(up, few.shape), few * np.array([-1.0, -1.0, 1.0])
    wi, wo = zip((few, few), (few, mirror), (few, normal), (normal, few), (up, up), strict=True)
    return np.concatenate(wi), np.concatenate(wo)


@cache
def opposite_pairs(n: int = OPPOSITE) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of nearly opposite directions close to grazing, in float32: wi . wo is next to -1, and 1 + wi . wo has few
    digits or none, and no reliable sign."""
    u = lattice(n, 4)
    z = 0.1 * (2e-5) ** u[:, :2]  # cosines from 0.1 to 2e-6
    turn = np.pi + np.where(u[:, 3] < 0.5, 0.0, 10.0 ** (-14.0 * (u[:, 3] - 0.5) - 1.0))
    theta, phi = np.arccos(z), 2.0 * np.pi * u[:, 2]
    return direction(theta[:, 0], phi).astype("f4"), direction(theta[:, 1], phi + turn).astype("f4")


def some(m: Reflectance, count: int, each: int = 1) -> int:
    """At how many of so many directions a law looks, with `each` values of every channel there: at all, or at a power
    of two of them that have VALUES at most."""
    return _fitting(VALUES, m, count, each)


def together(m: Reflectance, count: int, each: int = 1) -> int:
    """How many of so many directions are a part, AT_ONCE values at most."""
    return _fitting(AT_ONCE, m, count, each)


def _fitting(most: int, m: Reflectance, count: int, each: int) -> int:
    fitting = most // ((m.channels or 1) * each)
    return count if fitting >= count else 1 << max(0, fitting.bit_length() - 1)


def samples(m: Reflectance, view: np.ndarray, count: int = SAMPLES) -> Iterator[Sample]:
    """Samples of one view at evenly spread numbers, part by part."""
    wo, u, step = np.broadcast_to(view, (count, 3)), lattice(count), together(m, count)
    for at in range(0, count, step):
        yield m.sample(wo[at : at + step], u[at : at + step])


def weights(s: Sample, axes: int = 1) -> np.ndarray:
    """Weights (..., C) of samples; 0 for what is no number. A sum shows whether there is any, at less cost."""
    weight = with_channels(s.weight, axes)
    return weight if math.isfinite(float(weight.sum())) else np.nan_to_num(weight)


def precisions(m: Reflectance) -> tuple[type[np.floating], ...]:
    """The precisions to try a material in: of measurements double alone, as their tables are kept once for each."""
    return (np.float64,) if is_measured(m) else (np.float64, np.float32)


def everywhere(m: Reflectance, wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The pairs, for a material that transmits those of either direction mirrored at the surface in turn."""
    if is_lit(m, -1.0):
        k, below = np.arange(len(wi))[:, None], np.array([1.0, 1.0, -1.0], wi.dtype)
        wi, wo = np.where(k & 1, wi * below, wi), np.where(k & 2, wo * below, wo)
    return wi, wo


def index(m: Reflectance) -> Callable[[np.ndarray], np.ndarray]:
    """The refractive index (..., 1 or C) of the medium that directions are in: 1 in front of the surface."""
    behind = np.atleast_1d(np.asarray(m.index, dtype=float))
    return lambda w: np.where(w[..., 2:] < 0.0, behind, 1.0)


def azimuths(m: Reflectance) -> np.ndarray:
    """Azimuths [rad] of incidence that stand for all: one where the material is isotropic."""
    return np.array([0.3]) if m.is_isotropic() else np.radians([0.0, 45.0, 90.0, 200.0])


def incidence(m: Reflectance) -> np.ndarray:
    """Directions (K, 3) at INCIDENCE, beside the kinks of f and at `azimuths`; of a material that transmits from behind
    the surface too."""
    theta = _angles(m)
    if is_lit(m, -1.0):
        theta = np.concatenate([theta, np.pi - _angles(m.turned(True))[::-1]])
    return direction(theta[:, None], azimuths(m)[None, :]).reshape(-1, 3)


def _kinks(lobe: Reflectance) -> list[float]:
    """Sines of the angles in front at which f has kinks: there total reflection sets in."""
    return sorted({*lobe.hints.kinks, *(float(n) for n in np.ravel(lobe.index) if n < 1.0)})


def _angles(m: Reflectance) -> np.ndarray:
    """Angles of incidence [rad] from in front; of many kinks, as of many wavelengths, the first and the last count."""
    sines = [sine for _, lobe in m.lobes() for sine in _kinks(lobe)]
    if not sines:
        return INCIDENCE
    critical = np.arcsin([min(sines), max(sines)])[:, None] + BESIDE
    return np.unique(np.append(INCIDENCE, critical[(critical > 0.0) & (critical < INCIDENCE[-1])]))


def is_measured(m: Reflectance) -> bool:
    """Whether a measurement is part of the material: between its nodes, f is the interpolation's."""
    return any(isinstance(lobe, Measured) for _, lobe in m.lobes())


def values(m: Reflectance, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f with a channel axis: (..., C)."""
    return with_channels(m.f(wi, wo), max(wi.ndim, wo.ndim) - 1)


def largest(x: np.ndarray) -> tuple[float, tuple[int, ...]]:
    """The largest number of an array, and its indices."""
    at = np.unravel_index(int(x.argmax()), x.shape)
    return float(x[at]), tuple(map(int, at))


def difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The distance of two values of f, relative to their mean; 0 where data are missing.

    Values below a millionth of the median count as being of that size: there a difference means nothing.
    """
    scale = 0.5 * (np.abs(a) + np.abs(b)) + 1e-6 * np.nanmedian(np.abs(a)) + 1e-30
    return np.nan_to_num(np.abs(a - b) / scale)


def degrees(wi: Any = None, wo: Any = None) -> dict[str, float]:
    """Directions as angles in degrees, by name."""
    by_name: dict[str, float] = {}
    for name, w in (("i", wi), ("o", wo)):
        if w is not None:
            theta, phi = angles(np.asarray(w, dtype=float))
            by_name |= {f"theta_{name}": math.degrees(float(theta)), f"phi_{name}": math.degrees(float(phi))}
    return by_name


def in_channel(m: Reflectance, c: int, count: int) -> str:
    """ " in channel ...", where there are several."""
    return f" in channel {channel(m, c)}" if count > 1 else ""
