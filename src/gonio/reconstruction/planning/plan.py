"""What a plan of a measurement holds: the directions, and what is to be expected of them."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...base.reflectance import Reflectance
from ...declared.notebooks import repr_html
from ...errors import ParameterError, shown
from ...fitting.covariance import correlations
from ...fitting.samples import names_of
from ...numerics.unique_rows import unique_rows
from .planned import Planned, aligned, csv_of, noise_told

CRITERIA = {
    "D": "least determinant of the covariance",
    "A": "least sum of relative variances",
}
"""Criterion -> its meaning."""


@dataclass(frozen=True, eq=False)
class Plan(Planned):
    """What `plan` chose, and what is to be expected of it. It prints as a table.

    wi, wo       (n, 3) the pairs of directions, in the order of theta_i, phi_i, phi, theta_o
    f            (n,) or (n, C) the values to be expected [1/sr]
    names        of the unknowns: paths of parameters, "[2]" after those with a number for each channel
    values       (p,) their expected numbers; those of the first model where there are several
    covariance   (p, p) of the numbers after the measurement, with what was measured before
    criterion    "D" or "A"
    value        of the criterion: ln of the determinant of the covariance, or the sum of relative variances; the mean
                 over the models
    regular      how many pairs of a regular grid have the same criterion: all that the goniometer can set, each as
                 often
    in_plane     how many pairs of scans in the plane of incidence have it, of all polar angles; inf where they cannot
    before       standard errors by name of what was measured before; empty without
    misfit       by how much the model itself may be off, relative; 0 where it was taken for exact
    notes        what should be known before measuring: each a sentence

    Error    of first order: where the model is right, standard errors that fits by likelihood show are these within 3 %
             at 1 % noise. Where it is not, they were 1.0 to 1.5 times these, and the numbers themselves another fit's:
             on two measured files 100 to 250 % from those of the whole file, with `misfit` 37 % and 180 % at best
             (benchmarks/planning.txt).

    Example
    >>> planned = gn.planning.plan(gn.Lambertian(0.5), 4)
    >>> print({name: round(s, 4) for name, s in planned.stderr.items()})  # 1 % of 0.5, over the root of 4
    {'rho': 0.0025}
    """

    _repr_html_ = repr_html

    wi: np.ndarray
    wo: np.ndarray
    f: np.ndarray
    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    criterion: str
    value: float
    regular: float
    in_plane: float
    before: dict[str, float]
    noise: float
    floor: float
    misfit: float
    notes: tuple[str, ...]
    model: Reflectance = field(repr=False)

    def __post_init__(self) -> None:
        known = isinstance(self.covariance, np.ndarray) and isinstance(self.names, tuple)
        if not known or self.covariance.shape != (len(self.names),) * 2 or not isinstance(self.model, Reflectance):
            raise ParameterError(
                f"Plan(names={shown(self.names)}): expected what gn.planning.plan(model, n) makes; call that"
            )

    @property
    def stderr(self) -> dict[str, float]:
        """Expected standard errors by name.

        Example
        >>> print(round(gn.planning.plan(gn.Lambertian(0.5), 4).stderr["rho"], 6))
        0.0025
        """
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlation(self) -> np.ndarray:
        """Expected correlation matrix (p, p).

        Example
        >>> print(gn.planning.plan(gn.Lambertian(0.5), 4).correlation)
        [[1.]]
        """
        return correlations(self.covariance)

    @property
    def efficiency(self) -> float:
        """How many times as much a planned direction tells as one of a regular grid, all in all: `regular` over n.

        Example
        >>> print(round(gn.planning.plan(gn.Lambertian(0.5), 4).efficiency, 3))  # every direction tells the same
        1.0
        """
        return self.regular / len(self)

    def to_csv(self, path: str | os.PathLike | None = None) -> str:
        """The directions as a CSV table with empty columns of values; written to a file where there is a path.

        Angles are in degrees. With the columns filled, `gn.load` and `gn.fit` read it; a column u_f beside may hold
        standard uncertainties.

        Example
        >>> print(gn.planning.plan(gn.Lambertian(0.5), 1).to_csv().splitlines()[-2])
        theta_i,phi_i,theta_o,phi_o,f
        """
        channels = self.model.channel_names
        if self.f.ndim == 1:
            columns = ["f"]
        else:
            columns = [f"f_{name}" for name in names_of(channels if channels is not None else range(self.f.shape[1]))]
        return csv_of(
            self.angles,
            columns,
            f"# planned for: {' '.join(repr(self.model).split()):.300}",
            f"# planned by: gonio, {CRITERIA[self.criterion]}, {self._noise()}",
            path,
        )

    def to_json(self) -> dict[str, Any]:
        """The result as numbers, lists and words, for files; infinite numbers as None.

        Example
        >>> print(sorted(gn.planning.plan(gn.Lambertian(0.5), 4).to_json())[:4])
        ['before', 'correlation', 'covariance', 'criterion']
        """
        return {
            "model": repr(self.model),
            "directions": self._rows_of_angles(),
            "f": self.f.tolist(),
            "parameters": {
                name: {"value": float(v), "stderr": s}
                for (name, s), v in zip(self.stderr.items(), self.values, strict=True)
            },
            "covariance": self.covariance.tolist(),
            "correlation": [[_finite(x) for x in row] for row in self.correlation.tolist()],
            "criterion": self.criterion,
            "value": self.value,
            "regular": _finite(self.regular),
            "in_plane": _finite(self.in_plane),
            "before": {name: _finite(s) for name, s in self.before.items()},
            "noise": self.noise,
            "floor": self.floor,
            "misfit": self.misfit,
            "notes": list(self.notes),
        }

    def rows(self) -> list[list[str]]:
        """The directions as text: theta_i, phi_i, theta_o, phi_o - phi_i [degrees], f, and how often, each once.

        Example
        >>> print(gn.planning.plan(gn.Lambertian(0.5), 4, repeats=True).rows()[0][-1])
        4
        """
        rows = []
        for k in np.sort(unique_rows(self.angles)[0]):
            a, f = self.angles[k], np.atleast_1d(self.f[k])
            times = int((self.angles == a).all(axis=1).sum())
            text = " ".join(f"{x:.4g}" for x in f[:4]) + (" ..." if len(f) > 4 else "")
            rows.append([f"{a[0]:g}", f"{a[1]:g}", f"{a[2]:g}", f"{a[3] - a[1]:g}", text, str(times)])
        return rows

    def _noise(self) -> str:
        off = f", of a model that is off by {100.0 * self.misfit:g} %" if self.misfit else ""
        return noise_told(self.noise, self.floor) + off

    def _summary(self) -> list[str]:
        """Sentences about what it is worth."""
        known = " beside what was measured" if self.before else ""
        lines = [
            f"{len(self)} pairs of directions{known}; {self.criterion}: {CRITERIA[self.criterion]}; {self._noise()}"
        ]
        if self.misfit:
            return [*lines, "an error of the model itself remains, however many directions are measured"]
        told = []
        for number, what in (
            (self.regular, "of a regular grid of these angles"),
            (self.in_plane, "of scans in the plane"),
        ):
            told.append(f"{number:.0f} {what}" if number < 1e7 else f"no number {what}")
        lines.append(f"the same would take {told[0]}, or {told[1]} of incidence")
        return lines

    def _parameters(self) -> list[list[str]]:
        rows = []
        for (name, s), value in zip(self.stderr.items(), self.values, strict=True):
            share = f"{s / abs(value):.2%}" if value else ""
            was = [f"{self.before[name]:.2g}" if math.isfinite(self.before[name]) else "unknown"] if self.before else []
            rows.append([name, f"{value:.4g}", f"{s:.2g}", share, *was])
        return rows

    def __str__(self) -> str:
        head, *rest = self._summary()
        parts = [f"{self.model!r:.200}", head, ""]
        parts += aligned([list(HEADER), *self.rows()])
        before = ["before"] if self.before else []
        parts += ["", *aligned([["parameter", "expected", "std. error", "relative", *before], *self._parameters()])]
        parts += ["", *rest]
        if self.notes:
            parts += ["", "note", *(f"  - {text}" for text in self.notes)]
        return "\n".join(parts)

    def __repr__(self) -> str:
        told = ", ".join(f"{name} ± {s:.2g}" for name, s in [*self.stderr.items()][:8])
        return f"<Plan of {len(self)} pairs of directions: {told}{', ...' if len(self.names) > 8 else ''}>"


HEADER = ("theta_i [°]", "phi_i [°]", "theta_o [°]", "phi_o - phi_i [°]", "expected f [1/sr]", "times")
"""Columns of `Plan.rows`."""


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None
