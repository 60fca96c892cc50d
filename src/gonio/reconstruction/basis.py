"""A basis of isotropic reflectances: mean and principal components of ln f of materials, on a grid of angles."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..base.measured import Measured, tabular_shape
from ..base.reflectance import Reflectance
from ..base.sides import refuse_transmission
from ..declared.notebooks import repr_html
from ..errors import ParameterError, shown
from ..formula.direction import Direction, half_difference
from ..numerics.filling import filled_in_layers
from ..tables.angle_systems import SYSTEMS
from ..tables.axes import counts, laid_out
from ..tables.gridded import Gridded
from ..tables.nodes import above, f_at

SYSTEM = SYSTEMS["half_difference"]

PERIODS = {"phi_d": math.pi}
"""Of reciprocal materials."""

RESOLUTION = (90, 32, 9)
"""Nodes of theta_h, theta_d, and phi_d from 0 to pi/2."""

COMPONENTS = 40

OFFSET = 1e-4
"""Added to f [1/sr] in its logarithm."""

DEPARTURE = 0.05
"""Standard deviation of ln f of real materials from such as a basis holds."""

ALONG = 0.3
"""The share of it that real materials depart along each component: from planned directions 20 materials unlike the
basis (benchmarks/reconstruction.txt) were off by 0.13 in ln f with 0.2 to 0.5, by 0.16 to 0.21 with 0."""

GRAZING = 0.01
"""Least cosine of the directions at whose nodes materials are compared."""

FEWEST = 4
"""Materials that a basis needs."""

KEPT = 80
"""Components of all materials in which each is compared with the others."""

LEAST = 1e-12
"""Share of the largest variance from below which there is no component."""

FOLDS = 20
"""Times that some of the materials are left out, to see what the others leave of them."""

TOGETHER = 50_000
"""Pairs of directions that are interpolated at a time."""


class BasisRows(NamedTuple):
    """A basis at n pairs of directions.

    mean      (n,) of ln(f + offset)
    factors   (n, k) change of that by each coefficient
    misfit    (n,) variance of what no coefficient changes
    cells     (n,) number of the nearest node
    """

    mean: np.ndarray
    factors: np.ndarray
    misfit: np.ndarray
    cells: np.ndarray


@dataclass(frozen=True, eq=False)
class ReflectanceBasis:
    """What `reflectance_basis` learnt: ln(f + offset) = mean + factors c + misfit, c independent, N(0, 1).

    axes         nodes [rad] of theta_h, theta_d, and phi_d from 0 to pi/2
    mean         (grid) mean of ln(f + offset) over the materials, f in 1/sr
    factors      (grid..., k) principal components, each times its standard deviation, with that of real materials
    misfit       (grid) variance of what k components leave of a material that they were not learnt from, and of the
                 departure of real materials
    offset        [1/sr]
    materials    the materials it was learnt from, in words
    variances    (k,) share of each component in the variance of all

    Example
    >>> basis = gn.reconstruction.reflectance_basis([gn.Lambertian(r) for r in (0.1, 0.2, 0.4, 0.8)])
    >>> print(len(basis), basis.variances.round(3))  # of brightness alone
    1 [1.]
    """

    _repr_html_ = repr_html

    axes: dict[str, np.ndarray]
    mean: np.ndarray
    factors: np.ndarray
    misfit: np.ndarray
    offset: float
    materials: tuple[str, ...]
    variances: np.ndarray = field(repr=False)

    def __post_init__(self) -> None:
        arrays = isinstance(self.mean, np.ndarray) and isinstance(self.factors, np.ndarray)
        if not arrays or self.factors.shape[:-1] != self.mean.shape or not isinstance(self.axes, dict):
            raise ParameterError(
                f"ReflectanceBasis(axes={shown(self.axes)}): expected what gn.reconstruction.reflectance_basis makes; "
                f"call that"
            )

    def __len__(self) -> int:
        return self.factors.shape[-1]

    @cached_property
    def weights(self) -> np.ndarray:
        """(grid) shares of the nodes in a mean over all pairs of directions, weighted by both cosines.

        Example
        >>> basis = gn.reconstruction.reflectance_basis([gn.Lambertian(r) for r in (0.1, 0.2, 0.4, 0.8)])
        >>> print(basis.weights.shape, basis.weights.sum().round(6))
        (90, 32, 9) 1.0
        """
        theta_h, theta_d, _ = (widths(x) for x in self.axes.values())
        h, d, _ = np.meshgrid(*self.axes.values(), indexing="ij")
        wi, wo = SYSTEM.directions(self.axes)
        across = widths(self.axes["phi_d"])
        solid = np.sin(h) * np.cos(d) * np.sin(d) * theta_h[:, None, None] * theta_d[:, None] * across
        shares = np.where(above(wi, wo), solid * wi[..., 2] * wo[..., 2], 0.0)
        return np.asarray(shares / shares.sum())

    def at(self, wi: np.ndarray, wo: np.ndarray) -> BasisRows:
        """The basis at pairs of directions (n, 3), linear between the nodes.

        Example
        >>> basis = gn.reconstruction.reflectance_basis([gn.Lambertian(r) for r in (0.1, 0.2, 0.4, 0.8)])
        >>> rows = basis.at(gn.direction([0.5], 0.0), gn.direction([0.7], 2.0))
        >>> print(np.exp(rows.mean).round(3), (np.prod([0.1, 0.2, 0.4, 0.8]) ** 0.25 / np.pi).round(3))
        [0.09] 0.09
        """
        parts = [BasisRows(*self._at(wi[k : k + TOGETHER], wo[k : k + TOGETHER])) for k in range(0, len(wi), TOGETHER)]
        return BasisRows(*(np.concatenate(x) for x in zip(*parts, strict=True)))

    def _at(self, wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, ...]:
        every = half_difference(*(Direction(*w.T) for w in (wi, wo)))
        layout, _ = laid_out(SYSTEM.name, self.axes, True, PERIODS)
        around = [axis.around(x, axis.closed(n)) for axis, x, n in zip(layout, every, self.axes.values(), strict=True)]
        shape, k = self.mean.shape, len(self)
        table = np.concatenate([self.mean.reshape(-1, 1), self.factors.reshape(-1, k), self.misfit.reshape(-1, 1)], 1)
        total, best, cells = np.zeros((len(wi), k + 2)), np.zeros(len(wi)), np.zeros(len(wi), int)
        for a, u in around[0]:
            for b, v in around[1]:
                for c, w in around[2]:
                    cell = np.ravel_multi_index(np.broadcast_arrays(a, b, c), shape)
                    share = u * v * w
                    total += share[:, None] * table[cell]
                    cells, best = np.where(share > best, cell, cells), np.maximum(share, best)
        return total[:, 0], total[:, 1:-1], total[:, -1], cells

    def table(
        self, log_f: np.ndarray, log_u: np.ndarray | None, names: tuple[Any, ...] | None, **about: Any
    ) -> Gridded:
        """The table of f of which ln(f + offset) is `log_f` (grid..., C), with half of the 68 % interval as u.

        Example
        >>> basis = gn.reconstruction.reflectance_basis([gn.Lambertian(r) for r in (0.1, 0.2, 0.4, 0.8)])
        >>> print(basis.table(basis.mean[..., None], None, None).f([0, 0, 1], [0, 0, 1]).round(3))
        0.09
        """
        raised = np.exp(log_f)
        f, u = np.maximum(raised - self.offset, 0.0), None if log_u is None else raised * np.sinh(log_u)
        if names is None:
            f, u = f[..., 0], None if u is None else u[..., 0]
        return Gridded(
            SYSTEM.name, self.axes, f, uncertainty=u, channels=names, mirrored=True, periods=PERIODS, about=about
        )

    def __repr__(self) -> str:
        size = " x ".join(map(str, self.mean.shape))
        return f"<ReflectanceBasis of {len(self)} components of {len(self.materials)} materials, {size} nodes>"


def learnt(
    materials: Iterable[tuple[str, Reflectance]],
    components: int,
    resolution: Sequence[int] | None,
    offset: float,
    departure: float,
) -> ReflectanceBasis:
    """The basis of materials, by name; each is looked at once and not kept.

    Raises ParameterError for materials that no isotropic table can hold, and for too few.
    """
    axes = _axes(resolution)
    wi, wo = SYSTEM.directions(axes)
    up = above(wi, wo, 0.999 * GRAZING)
    names, columns, owners = [], [], []
    for name, m in materials:
        values = _logarithms(name, m, wi, wo, up, offset)
        names.append(name)
        columns.append(values)
        owners += [len(names) - 1] * values.shape[1]
    if len(names) < FEWEST:
        raise ParameterError(f"materials: got {len(names)}; expected {FEWEST} at least")
    y, of = np.concatenate(columns, axis=1), np.array(owners)
    y, centre = y - y.mean(axis=1, keepdims=True), y.mean(axis=1)
    variances, combined = _principal(y.T @ y, KEPT)
    if not variances[0] > LEAST * len(y):
        raise ParameterError(f"materials: {len(names)} of the same f; expected some that differ")
    axis = y @ combined / np.sqrt(variances)
    k = min(components, len(variances))
    factors = axis[:, :k] * np.sqrt(variances[:k] / (len(of) - 1) + (ALONG * departure) ** 2 * len(y))
    along = np.sqrt(variances)[:, None] * combined.T
    misfit = ((axis @ _left_over(along, of, components)) ** 2).mean(axis=1) + departure**2
    full = np.full((*up.shape, factors.shape[1] + 2), math.nan)
    full[up] = np.concatenate([centre[:, None], factors, misfit[:, None]], axis=1)
    full = filled_in_layers(full, (False,) * 4)[0]
    return ReflectanceBasis(
        axes, full[..., 0], full[..., 1:-1], full[..., -1], offset, tuple(names), variances[:k] / variances.sum()
    )


def widths(nodes: np.ndarray) -> np.ndarray:
    """The part of an axis that is nearest to each node."""
    edges = np.concatenate([nodes[:1], 0.5 * (nodes[1:] + nodes[:-1]), nodes[-1:]])
    return np.asarray(np.diff(edges))


def _axes(resolution: Sequence[int] | None) -> dict[str, np.ndarray]:
    sizes = RESOLUTION if resolution is None else counts(resolution, (3,), 2, "nodes of theta_h, theta_d, phi_d")
    right = 0.5 * math.pi
    theta_h, theta_d, phi_d = (right * np.linspace(0.0, 1.0, n) for n in sizes)
    return {"theta_h": theta_h**2 / right, "theta_d": theta_d, "phi_d": phi_d}


def _logarithms(name: str, m: Reflectance, wi: np.ndarray, wo: np.ndarray, up: np.ndarray, offset: float) -> np.ndarray:
    """ln(f + offset) (cells, C) of a material at the nodes above the horizon."""
    told = "materials: {} {}; expected isotropic surfaces that reflect alone".format
    refuse_transmission(m, told(name, "transmits light"))
    if m.fluoresces or not m.is_isotropic():
        raise ParameterError(told(name, "fluoresces" if m.fluoresces else "is anisotropic"))
    tabular_shape(m)
    flip = np.array([1.0, -1.0, 1.0])
    images = [(wi, wo)]
    if isinstance(m, Measured):  # each pair holds f of four
        images = [(wi, wo), (wi * flip, wo * flip), (wo, wi), (wo * flip, wi * flip)]
    seen = [np.asarray(ops.numbers(f_at(m, a, b, least=0.999 * GRAZING)), float) for a, b in images]
    f = np.reshape(seen, (len(seen), *up.shape, -1))
    finite = np.isfinite(f)
    f = np.where(finite, f, 0.0).sum(axis=0) / np.where(finite.any(axis=0), finite.sum(axis=0), math.nan)
    if np.isnan(f[up]).any():
        f = filled_in_layers(f, (False,) * 4)[0]
    return np.asarray(np.log(np.maximum(f[up], 0.0) + offset))


def _principal(gram: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """The largest eigenvalues (k,) of a matrix, one at least, and their vectors (N, k)."""
    values, vectors = np.linalg.eigh(gram)
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    k = max(1, min(most, int((values > LEAST * values[0]).sum())))
    return values[:k], vectors[:, :k]


def _left_over(along: np.ndarray, of: np.ndarray, components: int) -> np.ndarray:
    """What of each column of `along` (r, N) the components of others leave, its own material left out of these."""
    left = np.zeros_like(along)
    for out in _folds(of):
        rest = along[:, ~out]
        centre = rest.mean(axis=1, keepdims=True)
        _, axes = _principal((rest - centre) @ (rest - centre).T, components)
        apart = along[:, out] - centre
        left[:, out] = apart - axes @ (axes.T @ apart)
    return left


def _folds(of: np.ndarray) -> Iterator[np.ndarray]:
    """Which columns are left out together: all of a material, and of some materials where there are many."""
    folds = min(FOLDS, int(of.max()) + 1)
    for k in range(folds):
        yield of % folds == k
