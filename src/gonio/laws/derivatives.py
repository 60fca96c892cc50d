"""Derivatives: by parameters and by directions, `jacobian` is finite and agrees with differences.

Where f has a kink (a V-groove's edge, a total reflection) the slopes of both sides differ, and anything from one to the
other will do. Where wi = wo, at mirror pairs and along the normal, derivatives have to be finite, no more.

Measured   `m.jacobian` by every parameter and both directions, against differences, at 2048 pairs; finite at exact ones
           too
Holds if   <= 1e-3, all finite
Tolerance  differences err by 1e-6 in lobes 1e-3 wide; a missing term is off by more
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from ..base.reflectance import Reflectance
from ..errors import ParameterError, TraceError
from ._probes import degrees, everywhere, exact_pairs, is_measured, largest, pairs, some, values
from ._verdict import Findings, at_most

ORDER = 42
COUNT = 2048
EACH = 16
"""Derivatives and differences of f, about, that are kept for a pair of directions."""

STEP_OF_DIRECTIONS, STEP_OF_PARAMETERS = 1e-6, 1e-5  # the latter relative
TOLERANCE = 1e-3  # differences err by 1e-6 in lobes 1e-3 wide; a missing term is off by more


class _Slopes(NamedTuple):
    """Derivatives (N, C) and their differences' slopes to both sides; `size` is the unit of errors."""

    name: str
    exact: np.ndarray
    below: np.ndarray
    above: np.ndarray
    size: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """The central difference."""
        return 0.5 * (self.below + self.above)

    @property
    def error(self) -> np.ndarray:
        """|exact - difference|/size (N, C), less the difference of both sides; infinite where `exact` is not finite."""
        error = np.abs(self.exact - self.middle) - np.abs(self.above - self.below)
        error[~apart(len(error) - len(exact_pairs()[0]))] = 0.0
        lost = ~np.isfinite(self.exact) & np.isfinite(self.middle)
        return np.where(lost, np.inf, np.maximum(np.nan_to_num(error / self.size), 0.0))


def directions(m: Reflectance) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (N, 3): spread out and near mirror pairs, and the exact ones where formulas break."""
    return everywhere(m, *_directions(some(m, COUNT, EACH)))


@cache
def _directions(count: int) -> tuple[np.ndarray, np.ndarray]:
    wi, wo = zip(pairs(count), exact_pairs(), strict=True)
    return np.concatenate(wi), np.concatenate(wo)


@cache
def apart(count: int) -> np.ndarray:
    """Whether each of the directions is a hundred steps away from pairs where slopes may differ from side to side."""
    wi, wo = _directions(count)
    meeting = [(wi + wo)[:, :2], wi - wo, wi[:, :2], wo[:, :2]]
    return np.min([np.linalg.norm(d, axis=-1) for d in meeting], axis=0) > 100.0 * STEP_OF_DIRECTIONS


def inner(m: Reflectance) -> tuple[Reflectance, dict[str, float]]:
    """The material with parameters moved off their bounds, and the step for each: so that both sides are allowed."""
    steps, moved = {}, {}
    for path, p in m.parameters.items():
        size = float(np.abs(p.value).max()) or 1e-2 * min(1.0, p.high - p.low)
        h = min(STEP_OF_PARAMETERS * size, 0.25 * (p.high - p.low))
        if h > 0.0:
            steps[path] = h
            moved[path] = np.clip(p.value, p.low + 2.0 * h, p.high - 2.0 * h)
    m = m.replace(moved) if moved else m
    return m, {path: h for path, h in steps.items() if _moves_alone(m, path, h)}


def _moves_alone(m: Reflectance, path: str, h: float) -> bool:
    """Whether a parameter may change by itself: not one of two indices that have to be equal."""
    try:
        for step in (-h, h):
            m.replace({path: m.parameters[path].value + step})
    except ParameterError:
        return False
    return True


def slopes(m: Reflectance) -> Iterator[_Slopes]:
    """By each parameter, and by each component of both directions. Raises TraceError where there is no jacobian."""
    m, steps = inner(m)
    wi, wo = directions(m)
    exact = m.jacobian(wi, wo, [*steps, "wi", "wo"])
    f = values(m, wi, wo)

    def sides(name: str, slope: np.ndarray, low: np.ndarray, high: np.ndarray, h: float, unit: float) -> _Slopes:
        slope = slope.reshape(f.shape)
        below, above = (f - low) / h, (high - f) / h
        size = np.abs(slope) + 0.5 * np.abs(below + above) + np.abs(f) / unit + 1e-30
        return _Slopes(name, slope, below, above, size)

    for path, h in steps.items():
        value = m.parameters[path].value
        low, high = (values(m.replace({path: value + s}), wi, wo) for s in (-h, h))
        yield sides(path, exact.by[path], low, high, h, h / STEP_OF_PARAMETERS)
    for name in ("wi", "wo"):
        for k, axis in enumerate("xyz"):
            moved = STEP_OF_DIRECTIONS * np.eye(3)[k]
            low, high = (
                values(m, wi + s * moved, wo) if name == "wi" else values(m, wi, wo + s * moved) for s in (-1.0, 1.0)
            )
            yield sides(f"{name}.{axis}", exact.by[name][..., k], low, high, STEP_OF_DIRECTIONS, 1.0)


def law(m: Reflectance) -> Findings:
    """The largest error of a derivative, relative to it and to f over the parameter (for directions, over 1)."""
    if is_measured(m):
        yield "derivatives: not tested, those of a table are its interpolation's"
        return
    try:
        worst = max(slopes(m), key=lambda s: float(s.error.max()))
    except TraceError as error:
        yield f"derivatives: not tested, {error}"
        return
    wi, wo = directions(m)
    value, (n, c) = largest(worst.error)
    why = f"by {worst.name} it is {worst.exact[n, c]:.6g}, but differences give {worst.middle[n, c]:.6g}"
    rule = "|jacobian - difference| = {value} <= {tolerance}"
    yield at_most("derivatives", value, TOLERANCE, rule, degrees(wi[n], wo[n]), why)
