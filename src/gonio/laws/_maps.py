"""The laws at every place of a map: of materials whose parameters are maps, such as the kernel weights of a tile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.angles import direction
from ..base.calls import breaches
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..declared.notebooks import repr_html
from ..errors import NotFoundError
from ..evaluate.labelled import takes_labels
from ..formula.text import listed
from ..integrals.albedo import kept_albedo
from . import energy, reciprocity
from ._probes import pairs

PAIRS = 256
"""Pairs of directions at which f is taken at every place."""

AT_ONCE = 1 << 21
"""Values of f at a time."""

ANGLES = np.radians([0.0, 30.0, 60.0, 75.0, 85.0])
"""Angles of incidence of albedos."""

FAINT = 1e-6
"""Part of the mean f of a place that a pair's mean is counted as at least."""


def _in_parts(m: Reflectance) -> Any:
    """f(wi, wo) and f(wo, wi) (K, ...[, C]) for a few pairs at a time."""
    shape = map_shape(m)
    wi, wo = (w.reshape(PAIRS, *(1 for _ in shape), 3) for w in pairs(PAIRS))
    count = max(1, AT_ONCE // (int(np.prod(shape)) * (m.channels or 1)))
    for at in range(0, PAIRS, count):
        part = slice(at, at + count)
        yield m.f(wi[part], wo[part]), m.f(wo[part], wi[part])


@takes_labels()
def _lowest(m: Reflectance) -> Any:
    """The lowest f of each place."""
    return np.min([np.minimum(*both).min(axis=0) for both in _in_parts(m)], axis=0)


@takes_labels()
def _unreciprocal(m: Reflectance) -> Any:
    """The largest |f(wi, wo) - f(wo, wi)| over the mean of both, of each place."""
    size = np.sum([np.abs(there).sum(axis=0) for there, _ in _in_parts(m)], axis=0) / PAIRS
    least = FAINT * size + 1e-300
    return np.max(
        [(np.abs(a - b) / np.maximum(0.5 * np.abs(a + b), least)).max(axis=0) for a, b in _in_parts(m)], axis=0
    )


@takes_labels()
def _largest_albedo(m: Reflectance) -> Any:
    """The largest albedo of each place."""
    return np.max([kept_albedo(m, direction(theta, 0.0), 5e-4) for theta in ANGLES], axis=0)


MEASURES: dict[str, tuple[Callable[[Any], Any], str, float]] = {
    "positivity": (_lowest, "lowest f", 0.0),
    "reciprocity": (_unreciprocal, "largest |f - f swapped|/mean", reciprocity.TOLERANCE),
    "energy": (_largest_albedo, "largest albedo", energy.TOLERANCE),
}
"""Law -> what is measured at each place, a line about it, and the tolerance: at least that for positivity, else at
most."""


@dataclass(frozen=True, eq=False)
class MapReport:
    """What `check` measured at every place (...) of a map. It prints as a table.

    values     law -> (...[, C]) lowest f [1/sr], largest relative difference on exchanging the directions, largest
               albedo; NaN where a parameter is missing. Arrays of xarray or Dask for parameters that are
    declared   law -> the reason that the material's class gives for not obeying it

    Example
    >>> field = gn.RossLi(np.array([[0.1], [0.1]]), np.array([[0.05], [0.05]]), np.array([[0.02], [0.15]]))
    >>> report = gn.check(field)
    >>> print(report.count(), report.holds["positivity"].ravel())
    {'positivity': 1, 'reciprocity': 0, 'energy': 0} [ True False]
    """

    _repr_html_ = repr_html

    material: str
    values: dict[str, Any]
    declared: dict[str, str]

    @property
    def holds(self) -> dict[str, Any]:
        """Law -> whether each place obeys it; True where a parameter is missing.

        Example
        >>> print(gn.check(gn.Lambertian(np.full((2, 2, 1), 0.5)), laws=["energy"]).holds["energy"].all())
        True
        """
        verdicts = {}
        for name, value in self.values.items():
            tolerance = MEASURES[name][2]
            verdicts[name] = ~(value < tolerance) if name == "positivity" else ~(value > tolerance)
        return verdicts

    def count(self) -> dict[str, int]:
        """Law -> how many values break it, in all places and channels.

        Example
        >>> print(gn.check(gn.Lambertian(np.full((2, 2, 1), 0.5)), laws=["energy"]).count())
        {'energy': 0}
        """
        return {name: int((~holds).sum()) for name, holds in self.holds.items()}

    @property
    def passed(self) -> bool:
        """Whether every law holds at every place.

        Example
        >>> print(gn.check(gn.Lambertian(np.full((2, 2, 1), 0.5)), laws=["energy"]).passed)
        True
        """
        return not any(self.count().values())

    def _worst(self, name: str) -> float:
        value = np.asarray(self.values[name])
        finite = value[~np.isnan(value)]
        return float("nan") if not finite.size else float(finite.min() if name == "positivity" else finite.max())

    def to_json(self) -> dict[str, Any]:
        """Numbers of values, of those that break each law, and the worst, for files; None where there is no number.

        Example
        >>> report = gn.check(gn.Lambertian(np.full((2, 2, 1), 0.5)), laws=["energy"])
        >>> print(report.to_json()["laws"]["energy"]["broken"])
        0
        """
        laws = {}
        for name, broken in self.count().items():
            worst = self._worst(name)
            laws[name] = {
                "broken": broken,
                "values": int(np.prod(self.values[name].shape)),
                "worst": None if np.isnan(worst) else worst,
                "tolerance": MEASURES[name][2],
                "declared": self.declared.get(name, ""),
            }
        return {"material": self.material, "passed": self.passed, "laws": laws}

    def __str__(self) -> str:
        shape = " x ".join(str(n) for n in next(iter(self.values.values())).shape)
        lines = [f"{' '.join(self.material.split()):.100}: {shape} values"]
        for name, broken in self.count().items():
            worst = f"{self._worst(name):.4g}"
            reason = f", as declared: {self.declared[name]}" if name in self.declared else ""
            verdict = f"{broken} break it{reason}" if broken else "pass"
            sign = ">=" if name == "positivity" else "<="
            lines.append(f"  {name:<12} {MEASURES[name][1]} = {worst} {sign} {MEASURES[name][2]:g}: {verdict}")
        return "\n".join(lines)


def check_map(m: Reflectance, laws: list[str] | None, progress: Callable[[int, int], None] | None) -> MapReport:
    """The laws of MEASURES, or some of them, at every place."""
    names = [*MEASURES] if laws is None else laws
    for name in names:
        if name not in MEASURES:
            raise NotFoundError(
                f"check: {name!r} is not measured at the places of a map; expected some of {listed([*MEASURES])}, or "
                f"the material of one place: m.replace({{...}}) with its numbers"
            )
    values = {}
    for done, name in enumerate(names, 1):
        with np.errstate(all="ignore"):
            values[name] = MEASURES[name][0](m)
        if progress is not None:
            progress(done, len(names))
    return MapReport(repr(m), values, {name: reason for name, reason in breaches(m).items() if name in values})
