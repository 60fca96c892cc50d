"""Directions from which a basis makes the best table of an unknown material."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...declared.notebooks import repr_html
from ...errors import ParameterError, shown
from ...fitting.samples import names_of
from ..basis import ReflectanceBasis
from ..posterior import Reconstruction
from .directions import order_of, pairs_of
from .exchange import Information, best_choice
from .goniometer import Goniometer
from .planned import Planned, aligned, csv_of, noise_told


@dataclass(frozen=True, eq=False)
class TablePlan(Planned):
    """What `plan_table` chose, and how good the table will be. It prints as a table.

    wi, wo     (n, 3) the pairs of directions, in the order of theta_i, phi_i, phi, theta_o
    f          (n,) values to be expected [1/sr]: the median of what is known before
    error      root mean square of the error of ln f to be expected after the measurement, over all pairs of directions,
               weighted by both cosines
    before     of what is known before the measurement
    noise      relative standard uncertainty of a value; `floor`: absolute [1/sr]
    columns    names of the columns of values of `to_csv`

    Error    of first order, for materials like those of the basis. On measured files regular or random directions may
             be as good or better: the best directions lean on what the basis knows (benchmarks/reconstruction.txt).

    Example
    >>> planned = gn.planning.plan_table(5)
    >>> print(len(planned), planned.wi.shape, planned.error < planned.before)
    5 (5, 3) True
    """

    _repr_html_ = repr_html

    wi: np.ndarray
    wo: np.ndarray
    f: np.ndarray
    error: float
    before: float
    noise: float
    floor: float
    columns: tuple[str, ...]
    basis: ReflectanceBasis = field(repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.wi, np.ndarray) or not isinstance(self.basis, ReflectanceBasis):
            raise ParameterError(
                f"TablePlan(wi={shown(self.wi)}): expected what gn.planning.plan_table(n) makes; call that"
            )

    def to_csv(self, path: str | os.PathLike | None = None) -> str:
        """The directions as a CSV table with empty columns of values; written to a file where there is a path.

        Angles are in degrees. With the columns filled, `gn.load` and `gn.reconstruction.reconstruct` read it; a column
        u_f beside may hold standard uncertainties.

        Example
        >>> print(gn.planning.plan_table(1).to_csv().splitlines()[-2])
        theta_i,phi_i,theta_o,phi_o,f
        """
        made_for = f"# planned for: a table by {self.basis!r}"
        by = f"# planned by: gonio, least mean variance of ln f, {noise_told(self.noise, self.floor)}"
        return csv_of(self.angles, self.columns, made_for, by, path)

    def to_json(self) -> dict[str, Any]:
        """The result as numbers, lists and words, for files.

        Example
        >>> print(sorted(gn.planning.plan_table(4).to_json())[:4])
        ['basis', 'before', 'directions', 'error']
        """
        return {
            "basis": repr(self.basis),
            "directions": self._rows_of_angles(),
            "f": self.f.tolist(),
            "error": self.error,
            "before": self.before,
            "noise": self.noise,
            "floor": self.floor,
        }

    def __str__(self) -> str:
        rows = [["theta_i [°]", "phi_i [°]", "theta_o [°]", "phi_o - phi_i [°]", "median f [1/sr]"]]
        for (a, b, c, d), f in zip(self.angles, self.f, strict=True):
            rows.append([f"{a:g}", f"{b:g}", f"{c:g}", f"{d - b:g}", f"{f:.4g}"])
        head = f"{len(self)} pairs of directions for {self.basis!r}; {noise_told(self.noise, self.floor)}"
        told = f"error of ln f to be expected: {self.error:.3g}; before the measurement {self.before:.3g}"
        return "\n".join([head, "", *aligned(rows), "", told])

    def __repr__(self) -> str:
        return f"<TablePlan of {len(self)} pairs of directions: error of ln f {self.error:.3g}>"


def planned_table(
    basis: ReflectanceBasis,
    n: int,
    goniometer: Goniometer | None,
    noise: float,
    floor: float,
    measured: Reconstruction | None,
    candidates: Any,
    starts: int,
    seed: int,
) -> TablePlan:
    """The plan; see `gonio.planning.plan_table`."""
    wi, wo = pairs_of(goniometer, candidates, True)
    if n > len(wi):
        raise ParameterError(f"n={n}: expected at most {len(wi)}, the pairs of directions there are; smaller steps")
    k, names = len(basis), None
    coefficients, covariance, beside, widening = np.zeros((1, k)), np.eye(k)[None], np.zeros(1), np.ones(1)
    if measured is not None:
        if measured.basis is not basis:
            raise ParameterError("measured: a reconstruction by another basis; expected basis=found.basis")
        coefficients, covariance = measured.coefficients.reshape(-1, k), measured.covariance.reshape(-1, k, k)
        beside, widening = np.atleast_1d(measured.discrepancy), np.atleast_1d(measured.widening)
        names = measured.reflectance.channel_names
    rows = basis.at(wi, wo)
    raised = np.exp(rows.mean[:, None] + rows.factors @ coefficients.T)
    f = np.maximum(raised - basis.offset, 0.0)
    variance = (np.hypot(noise * f, floor) / raised) ** 2 + rows.misfit[:, None] * widening + beside**2
    # coordinates in which the mean variance of the table is a weighted sum of those of the coefficients
    squares = np.einsum("...k,...l,...->kl", basis.factors, basis.factors, basis.weights, optimize=True)
    weights, turn = np.linalg.eigh(squares)
    weights = np.maximum(weights, 0.0)
    infos = []
    for c in range(len(covariance)):
        precision = np.linalg.inv(covariance[c])
        own = (rows.factors @ turn / np.sqrt(variance[:, c])[:, None])[:, None, :]
        infos.append(Information(own, turn.T @ precision @ turn, weights, np.ones(k)))
    chosen = best_choice(infos, n, "A", False, starts, seed)
    chosen = chosen[order_of(wi[chosen], wo[chosen])]
    left = float((basis.weights * basis.misfit).sum() * widening.mean())
    after, before = (
        float(np.sqrt(np.mean([(weights * np.diag(np.linalg.inv(info.matrix(at)))).sum() for info in infos]) + left))
        for at in (chosen, chosen[:0])
    )
    columns = tuple("f" if not name else f"f_{name}" for name in names_of(names))
    median = np.exp(np.log(np.maximum(f[chosen], basis.offset)).mean(axis=1))
    return TablePlan(wi[chosen], wo[chosen], median, after, before, noise, floor, columns, basis)
