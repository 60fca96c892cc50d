"""A fit as a problem of least squares: data, a model, and what is compared; for our solver and those of others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.kinds import SCALAR, VALUE
from ..base.reflectance import Reflectance
from ..base.sides import require_finite
from ..declared.arguments import checked
from ..errors import NotFoundError, ParameterError, ShapeError, TraceError, needed
from ..evaluate import batch
from ..evaluate.squares import Squares, squares
from ..evaluate.tracing import Task
from ..formula import tree
from ..formula.text import listed
from .asked import By, LossName, ThetaMax
from .losses import LOSSES
from .residual import WIDTHS, costs, difference, scores
from .samples import Samples, samples
from .solver import Box
from .unknowns import Unknowns, unknowns

RUN = 4096
"""Rows that one thread adds up at a time, at most."""

SINGLE = 200_000
"""Values above which sums are made from single precision: residuals then err by 3e-6 of f."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Residuals of a model from data, and their derivatives; `fit_problem` makes one.

    samples    the rows of data
    unknowns   what is fitted
    loss       what is compared, of `LOSSES`
    robust     how much large residuals count, of `ROBUST`
    scale      the residual at which `robust` begins to count less

    Example
    >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
    >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(0.4), loss="plain")
    >>> print(problem.names, problem.loss, len(problem.samples))
    ('rho',) plain 2
    """

    samples: Samples
    unknowns: Unknowns
    loss: str
    robust: str
    scale: float
    single: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the unknowns: paths of parameters, with the number of the channel where each has its own.

        Example
        >>> data = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0]), np.array([[0.1, 0.2], [0.1, 0.2]])
        >>> print(gn.fitting.fit_problem(data, gn.Lambertian()).names)
        ('rho[0]', 'rho[1]')
        """
        return self.unknowns.names

    @cached_property
    def _arrays(self) -> tuple[np.ndarray, ...]:
        """wi and wo (1, N, 3), what the data come to and weights (C, N, 1)."""
        s, dtype = self.samples, np.float32 if self.single else np.float64
        weight = s.valid.astype(float)
        if s.weights is not None:
            weight *= np.sqrt(s.weights)
        if s.u is not None and self.loss == "likelihood":
            weight /= np.where(s.valid, s.u, 1.0)
        weight /= self.scale
        with np.errstate(invalid="ignore", divide="ignore"):
            target = np.where(s.valid, LOSSES[self.loss].compared(s.f, s.wi[:, 2:]), 0.0)
        planes = [np.ascontiguousarray(x.T, dtype)[..., None] for x in (target, weight)]
        return (*(np.ascontiguousarray(w[None], dtype) for w in (s.wi, s.wo)), *planes)

    @cached_property
    def _in_runs(self) -> list[np.ndarray]:
        """The arrays, their rows cut into runs (..., K, RUN, 3 or 1) that threads share; the last filled up by rows of
        weight 0."""
        count = len(self.samples)
        runs = max(1, -(-count // RUN))
        length = -(-count // runs)
        found = []
        for x in self._arrays:
            filled = x
            if runs * length > count:
                filled = np.concatenate([x, np.repeat(x[:, -1:], runs * length - count, axis=1)], axis=1)
            found.append(filled.reshape(1, len(x), runs, length, x.shape[-1]))
        found[-1].reshape(found[-1].shape[1], -1)[:, count:] = 0.0
        return found

    @property
    def size(self) -> float:
        """The weighted sum of squares of what is compared, of the data.

        Example
        >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
        >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(0.4), loss="plain")
        >>> print(round(problem.size, 4))
        0.02
        """
        target, weight = self._arrays[2:]
        return float(((weight * target) ** 2).sum(dtype=float))

    @property
    def box(self) -> Box:
        """The bounds of the unknowns, and how they are treated.

        Example
        >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
        >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(0.4), loss="plain")
        >>> print(problem.box.low, problem.box.high, problem.box.is_linear)
        [0.] [1.] [ True]
        """
        u = self.unknowns
        return Box(u.low, u.high, u.is_log, u.is_linear)

    def squares(self, x: np.ndarray, _: np.ndarray | None = None) -> Squares:
        """The normal equations (B,) of unknowns (B, n).

        Example
        >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
        >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(0.4), loss="plain")
        >>> sums = problem.squares(np.array([[0.4], [0.3]]))
        >>> print(sums.cost.round(6), sums.gradient.round(5).ravel())
        [1.493e-03 4.100e-05] [ 0.01739 -0.00287]
        """
        return self._summed(costs(self.loss, self.robust), x)

    def score_squares(self, x: np.ndarray) -> np.ndarray:
        """Sums (B, n, n) of products of the slopes of each residual's cost.

        Example
        >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
        >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(0.4), loss="plain")
        >>> print(problem.score_squares(np.array([[0.4]])).round(6))
        [[[0.000151]]]
        """
        return self._summed(scores(self.loss, self.robust), x).matrix

    def _summed(self, kernel: Any, x: np.ndarray) -> Squares:
        u = self.unknowns
        cost, gradient, matrix = squares(kernel, u.models(x, axes=3), u.places, self._in_runs, WIDTHS)
        return u.gathered(Squares(cost.sum(axis=2), gradient.sum(axis=2), matrix.sum(axis=2)), x)

    def least_squares(self) -> Problem:
        """The problem with every residual counted by its square.

        Example
        >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
        >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(0.4), loss="plain")
        >>> print(problem.least_squares() is problem)
        True
        """
        return self if self.robust == "none" else replace(self, robust="none", scale=1.0)

    def at(self, rows: Any) -> Problem:
        """The problem for some of the rows.

        Example
        >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
        >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(0.4), loss="plain")
        >>> print(len(problem.at([0]).samples))
        1
        """
        return replace(self, samples=self.samples.at(rows))

    def of_channel(self, c: int) -> Problem:
        """The problem of one channel.

        Example
        >>> data = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0]), np.array([[0.1, 0.2], [0.1, 0.2]])
        >>> print(gn.fitting.fit_problem(data, gn.Lambertian()).of_channel(1).names)
        ('rho',)
        """
        return replace(self, samples=self.samples.of_channel(c), unknowns=self.unknowns.of_channel(c))

    @property
    def x0(self) -> np.ndarray:
        """The numbers of the model (n,), in the order of `names`.

        Example
        >>> data = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0]), [0.1, 0.1]
        >>> problem = gn.fitting.fit_problem(data, gn.Lambertian(0.4))
        >>> print(problem.x0, problem.bounds)
        [0.4] (array([0.]), array([1.]))
        """
        return self.unknowns.numbers(self.unknowns.start)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (n,) of the numbers.

        Example
        >>> data = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0]), [0.1, 0.1]
        >>> print(gn.fitting.fit_problem(data, gn.Lambertian(0.4)).bounds)
        (array([0.]), array([1.]))
        """
        u = self.unknowns
        return u.numbers(u.low), u.numbers(u.high)

    def residuals(self, values: Any) -> Any:
        """Residuals of all values for numbers of the model: those of the first channel, then those of the next.

        `values`: an array (n,) in the order of `names`, of NumPy, PyTorch or JAX, which differentiate the result by
        it; or a mapping from names to numbers. The residual is that of the loss, weighted, before `robust`.

        Shapes   (C N,).
        Error    rounding.

        Example
        >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
        >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(), loss="plain")
        >>> print(problem.residuals(np.array([0.4])).round(4))
        [0.0273 0.0273]
        """
        values = self._ordered(values)
        lib = ops.library(values)
        u, (wi, wo, target, weight) = self.unknowns, self._arrays
        if lib.name == "numpy":
            inputs = (wi, wo, target, weight)
            model = tree.with_values(u.plain(), self._by_path(np.asarray(values, float)))
            flat = batch.run(self._residual, model, inputs)[0]
            return np.broadcast_to(flat, (1, *weight.shape[:-1])).reshape(-1)  # arrays that are kept have an axis more
        inputs = tuple(lib.convert(x, values) for x in (wi, wo, target, weight))
        model = tree.with_values(u.plain(), self._by_path(values))
        residuals = batch.run(self._residual, model, inputs)[0]
        return lib.module.reshape(lib.module.broadcast_to(residuals, (1, *weight.shape[:-1])), (-1,))

    def jacobian(self, values: Any) -> np.ndarray:
        """Derivatives (C N, n) of `residuals` by the numbers, exact. NumPy arrays only.

        Example
        >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
        >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(), loss="plain")
        >>> print(problem.jacobian([0.4]).round(4).ravel())
        [0.3183 0.3183]
        """
        u, inputs = self.unknowns, self._arrays
        model = tree.with_values(u.plain(), self._by_path(np.asarray(self._ordered(values), float)))
        task = Task(difference(self.loss), (VALUE,), WIDTHS, (u.places, ()))
        _, *slopes = batch.compute(task, model, inputs)
        channels, rows = inputs[2].shape[:2]
        found = np.zeros((channels, rows, len(self.names)))
        for k, slope in enumerate(slopes):
            slope = np.broadcast_to(np.reshape(slope, np.shape(slope)[-3:-1]), (channels, rows))
            for c in range(channels):
                found[c, :, u.columns[c, k]] += slope[c]
        return found.reshape(channels * rows, -1)

    @property
    def _residual(self) -> Task:
        return Task(difference(self.loss), (SCALAR,), WIDTHS)

    def _by_path(self, values: Any) -> dict[str, Any]:
        """Numbers (C, 1, 1) or (1, 1, 1) of every free parameter."""
        found, at = dict[str, Any](), 0
        for f, n in self.unknowns.widths:
            found[f.path] = values[at : at + n].reshape(n, 1, 1)
            at += n
        return found

    def _ordered(self, values: Any) -> Any:
        if isinstance(values, Mapping):
            if set(values) != set(self.names):
                raise NotFoundError(f"values: got {listed([*values]) or 'none'}; expected {listed(self.names)}")
            values = [values[name] for name in self.names]
        if isinstance(values, (list, tuple)):
            values = np.array(values, float)
        if tuple(values.shape) != (len(self.names),):
            raise ShapeError(
                f"values: got shape {tuple(values.shape)}, expected ({len(self.names)},): {listed(self.names)}"
            )
        return values

    def to_lmfit(self) -> Any:
        """The problem as an `lmfit.Minimizer`: `.minimize()` fits it, `lmfit.conf_interval` profiles it.

        Names of lmfit are those of the unknowns with _ for all other signs. Uncertainties are those of the data where
        they are known (`scale_covar=False`). Raises DependencyError without lmfit.

        Example
        >>> wi, wo = gn.direction(0.5, np.linspace(0.0, 3.0, 9)), gn.direction(0.3, np.zeros(9))
        >>> problem = gn.fitting.fit_problem((wi, wo, np.full(9, 0.1)), gn.Lambertian())
        >>> minimizer = problem.to_lmfit()  # doctest: +SKIP
        >>> print(minimizer.minimize().params["rho"].value)  # doctest: +SKIP
        0.3141592653589793
        """
        with needed("this needs lmfit", 'pip install "gonio[fit]"'):
            import lmfit
        low, high = self.bounds
        labels = ["".join(c if c.isalnum() else "_" for c in name).strip("_") for name in self.names]
        labels = [label if label[0].isalpha() else f"p{label}" for label in labels]
        parameters = lmfit.Parameters()
        for label, value, a, b in zip(labels, self.x0, low, high, strict=True):
            inside = min(max(value, a + 1e-6 * min(b - a, 1.0)), b - 1e-6 * min(b - a, 1.0))
            parameters.add(label, inside, min=a, max=b)

        def residuals(p: Any) -> np.ndarray:
            residuals: np.ndarray = self.residuals(np.array([p[label].value for label in labels]))
            return residuals

        return lmfit.Minimizer(residuals, parameters, scale_covar=self.loss != "likelihood")


@checked
def fit_problem(
    data: Any,
    model: Reflectance,
    loss: LossName | None = None,
    *,
    by: By | None = None,
    per_channel: bool | Iterable[str] | None = None,
    weights: Any = None,
    theta_max: ThetaMax = 0.5 * math.pi,
) -> Problem:
    """The problem that `fit` solves, for optimizers of others: residuals and derivatives; arguments as those of `fit`.

    `problem.residuals` takes arrays of PyTorch and JAX too, and they differentiate it.

    Example
    >>> data = gn.tables.tabulate(gn.Lambertian(0.3), resolution=(9, 9, 18))
    >>> problem = gn.fitting.fit_problem(data, gn.Lambertian())
    >>> from scipy.optimize import least_squares
    >>> print(least_squares(problem.residuals, problem.x0, problem.jacobian).x.round(6))
    [0.3]
    """
    return make_problem(data, model, loss, "none", (by, per_channel), weights, theta_max)


def make_problem(
    data: Any,
    model: Reflectance,
    loss: str | None,
    robust: str,
    fitted: tuple[Iterable[str] | None, bool | Iterable[str] | None],
    weights: Any,
    theta_max: float,
) -> Problem:
    """The problem of data and a model; `fitted`: by, per_channel. Raises what `fit` does."""
    if isinstance(data, Reflectance) and data.parameters and not model.parameters:
        raise ParameterError(
            f"data={data!r:.60}, model={model!r:.60}: the model has no parameters and the data have; expected the data "
            f"first, gn.fit(data, model)"
        )
    rows = samples(data, theta_max, weights)
    loss = ("cosine" if rows.u is None else "likelihood") if loss is None else loss
    if loss == "likelihood" and rows.u is None:
        raise ParameterError(
            "loss='likelihood': the data have no uncertainties; expected (wi, wo, f, u), or loss='cosine'"
        )
    if loss == "ratio" and (rows.f[rows.valid] <= 0.0).any():
        count = int((rows.f[rows.valid] <= 0.0).sum())
        raise ParameterError(f"loss='ratio': {count} values are 0 or less; expected f > 0, or loss='log'")
    if loss == "log" and (1.0 + rows.f * rows.wi[:, 2:])[rows.valid].min() <= 0.0:
        raise ParameterError("loss='log': f cos(theta_i) reaches -1; expected values above that, or loss='cosine'")
    require_finite(model)
    try:
        free = unknowns(model, rows.f.shape[1], *fitted)
    except TraceError as error:
        raise ParameterError(f"{model!r:.80}: has no derivatives: {error}") from None
    single = rows.f.size > SINGLE
    return Problem(rows, free, loss, robust, 1.0, single)
