"""Symmetries of a surface that a measurement lacks: averaging over them, with a report of the asymmetry."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..arrays.kinds import with_channels
from ..base.measured import Measured
from ..declared.arguments import checked
from ..errors import expect_one_of
from ..tables.gridded import Gridded
from ..tables.nodes import bracketed, f_at
from ._cells import GridCells, changes_of_all, floor, like, reported, spread, variances

KINDS = ("reciprocity", "isotropy", "plane")
SAME = 1e-5
"""Angles [rad] closer than this are one node."""


@checked
def symmetrize(m: Measured, kind: str, plane: float = 0.0) -> Gridded:
    """The measurement averaged over a symmetry.

    reciprocity   f(wi, wo) = f(wo, wi)
    plane         f(wi, wo) = f of both mirrored at a plane through the normal, at azimuth `plane` [rad]: of brushed
                  metals and weaves. Isotropic tables are averaged with phi -> -phi
    isotropy      f(theta_i, theta_o, phi_o - phi_i): four axes become three

    Where the symmetry maps the grid onto itself, values are averaged in pairs, and the result is symmetric to rounding.
    Elsewhere the second value is interpolated, and the result is about as symmetric as the grid resolves the material.
    If one value of a pair is missing, both get the other. Averages of two have u = sqrt(u1^2 + u2^2)/2.

    `figures`: "asymmetry_median", "asymmetry_rms", "asymmetry_largest": |f1 - f2|/mean, of pairs (for "isotropy" of the
    azimuths of wi from their mean), a measure of the data's quality; "on_grid", 1 if no value was interpolated, else 0;
    and with uncertainties "chi2", the mean of (f1 - f2)^2/(u1^2 + u2^2): about 1 if these explain the asymmetry.

    Example
    >>> axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi": [0.0, np.pi]}
    >>> f = np.array([[[0.1, 0.1], [0.12, 0.12]], [[0.1, 0.1], [0.11, 0.11]]])
    >>> m = gn.repair.symmetrize(gn.Gridded("angles", axes, f), "reciprocity")
    >>> print(m.brdf()[..., 0])
    [[0.1  0.11]
     [0.11 0.11]]
    """
    expect_one_of(KINDS, "kind", kind)
    cells = GridCells(m)
    if kind == "isotropy":
        return _isotropic(cells.m)
    f, u, figures = _paired(cells, kind, plane)
    parameters = {"kind": kind, "plane": plane} if kind == "plane" else {"kind": kind}
    return cells.repaired("symmetrize", parameters, f, u, figures)


def _paired(cells: GridCells, symmetry: str, plane: float) -> tuple[np.ndarray, np.ndarray | None, dict[str, float]]:
    """f averaged with f of the symmetric pairs, its uncertainty, and figures of the asymmetry."""
    image = _positions(cells.m, symmetry, plane)
    if image is not None:
        other, other_u = (None if a is None else _moved(a, *image) for a in (cells.f, cells.u))
        number = np.arange(math.prod(cells.grid)).reshape(cells.grid)
        itself = _moved(number[..., None], *image)[..., 0] == number
    else:
        wi, wo = _mapped(cells.wi, cells.wo, symmetry, plane)
        other = with_channels(f_at(cells.m, wi, wo), len(cells.grid))
        other_u = None if cells.u is None else np.sqrt(f_at(variances(cells.m), wi, wo))
        itself = np.zeros(cells.grid, bool)
    assert other is not None
    f = np.where(np.isnan(cells.f), other, np.where(np.isnan(other), cells.f, 0.5 * (cells.f + other)))
    apart = cells.up & ~itself
    first, second = cells.f[apart], other[apart]
    figures = {**_asymmetry(first, second, cells.f), "on_grid": int(image is not None)}
    if cells.u is None:
        return f, None, figures
    assert other_u is not None
    figures["chi2"] = spread((first - second) / np.hypot(cells.u, other_u)[apart])[0] ** 2
    u = np.where(np.isnan(cells.f), other_u, np.where(np.isnan(other), cells.u, 0.5 * np.hypot(cells.u, other_u)))
    return f, np.where(itself[..., None], cells.u, u), figures


def _asymmetry(first: np.ndarray, second: np.ndarray, table: np.ndarray) -> dict[str, float]:
    """Figures of |first - second| over their mean, or over the `floor` of a table where that is larger."""
    off = np.abs(first - second) / np.maximum(0.5 * (np.abs(first) + np.abs(second)), floor(table))
    rms, largest = spread(off)
    median = float(np.median(off[np.isfinite(off)])) if np.isfinite(off).any() else 0.0
    return {"asymmetry_median": median, "asymmetry_rms": rms, "asymmetry_largest": largest}


def _mapped(wi: np.ndarray, wo: np.ndarray, symmetry: str, plane: float) -> tuple[np.ndarray, np.ndarray]:
    """The symmetric pairs (..., 3) of pairs."""
    if symmetry == "reciprocity":
        return wo, wi
    c, s = math.cos(2.0 * plane), math.sin(2.0 * plane)
    mirror = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, 1.0]])
    return wi @ mirror, wo @ mirror


def _image(m: Gridded, symmetry: str, plane: float) -> Mapping[str, tuple[str, float, float]]:
    """Axis -> the axis to which a symmetry takes its angle, with a sign and a shift."""
    if symmetry == "reciprocity":
        return m.system.exchange
    mirrored = {name: (name, -1.0, 2.0 * plane if name in m.system.turned else 0.0) for name in m.periods}
    return {name: mirrored.get(name, (name, 1.0, 0.0)) for name in m.axes}


def _positions(m: Gridded, symmetry: str, plane: float) -> tuple[list[int], list[np.ndarray]] | None:
    """Nodes after the symmetry: the order of the axes, and numbers of nodes along each; None if some are off the grid.

    Node number i along axis k becomes node number numbers[k][i] along axis order[k].
    """
    image, names = _image(m, symmetry, plane), list(m.axes)
    if not image.keys() >= m.axes.keys():
        return None
    numbers = []
    for k, name in enumerate(names):
        other, sign, shift = image[name]
        at = _numbers(m.axes[other], sign * m.axes[name] + shift, m.periods.get(name, 0.0), m.is_mirrored and k == 2)
        if at is None:
            return None
        numbers.append(at)
    return [names.index(image[name][0]) for name in names], numbers


def _numbers(among: np.ndarray, angles: np.ndarray, period: float, mirrored: bool) -> np.ndarray | None:
    """Number of each angle's node; None if some angle is no node."""
    images = [angles[:, None] - among, angles[:, None] + among] if mirrored else [angles[:, None] - among]
    apart = np.abs(images)
    if period:
        apart = np.minimum(apart % period, period - apart % period)
    apart = apart.min(axis=0)
    at = apart.argmin(axis=1)
    return at if (apart[np.arange(len(angles)), at] < SAME).all() else None


def _moved(values: np.ndarray, order: list[int], numbers: list[np.ndarray]) -> np.ndarray:
    """The values (grid..., C) at the symmetric nodes; `order` and `numbers` as `_positions` returns them."""
    by_axis = [numbers[order.index(k)] for k in range(len(order))]
    return values[np.ix_(*by_axis)].transpose(*order, len(order))


def _isotropic(m: Gridded) -> Gridded:
    """The mean over azimuths of wi, or of the half vector, at fixed relative azimuths; weights are the nodes' arcs."""
    cells = GridCells(m)
    m = cells.m
    names = list(m.axes)
    if len(names) == 3:
        none = {**_asymmetry(cells.f, cells.f, cells.f), "on_grid": 1}
        return cells.repaired("symmetrize", {"kind": "isotropy"}, cells.f, cells.u, none)
    axis = names.index(m.system.turned[0])
    turns, weights = _arcs(m.axes[names[axis]], m.periods[names[axis]])
    slices = [np.take(cells.f, i, axis=axis) for i in range(len(turns))]
    squares = None if cells.u is None else [np.take(cells.u, i, axis=axis) ** 2 for i in range(len(turns))]
    axes = {n: m.axes[n] for k, n in enumerate(names) if k != axis}
    periods = {n: p for n, p in m.periods.items() if n != names[axis]}
    on_grid = True
    if "phi_o" in axes:
        relative_phi, _ = _arcs(axes.pop("phi_o"), periods["phi_o"])
        for i, turn in enumerate(turns):
            lower, upper, w = _bracketed(relative_phi, relative_phi + turn, periods["phi_o"])
            on_grid = on_grid and bool((np.minimum(w, 1.0 - w) < 1e-6).all())
            w = np.where(w < 1e-6, 0.0, np.where(w > 1.0 - 1e-6, 1.0, w))[:, None]
            slices[i] = _mixed(slices[i], lower, upper, 1.0 - w, w)
            if squares is not None:
                squares[i] = _mixed(squares[i], lower, upper, (1.0 - w) ** 2, w**2)
        axes["phi"], periods = relative_phi, {"phi": periods["phi_o"]}
    stack = np.stack(slices)
    finite = ~np.isnan(stack)
    share = np.where(finite, weights.reshape(-1, *[1] * (stack.ndim - 1)), 0.0)
    with np.errstate(invalid="ignore"):
        share = share / share.sum(axis=0)
    f = np.where(finite, share * stack, 0.0).sum(axis=0)
    f = np.where(finite.any(axis=0), f, np.nan)
    u = None
    if squares is not None:
        u = np.sqrt(np.where(finite, share**2 * np.stack(squares), 0.0).sum(axis=0))
    figures = {**_asymmetry(stack, np.broadcast_to(f, stack.shape), cells.f), "on_grid": int(on_grid)}
    table = like(m, axes, f, u, quantity="brdf", periods=periods)
    changes = changes_of_all(int(GridCells(table).up.sum()), 1.0, stack - f)
    return reported(table, m, "symmetrize", {"kind": "isotropy"}, changes, figures)


def _arcs(nodes: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """The nodes of a circle, without a repeated first one, and the share of the circle around each."""
    if len(nodes) > 1 and nodes[-1] - nodes[0] > period - SAME:
        nodes = nodes[:-1]
    gaps = np.diff(nodes, append=nodes[0] + period)
    return nodes, 0.5 * (gaps + np.roll(gaps, 1)) / period


def _bracketed(nodes: np.ndarray, angles: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers of the nodes around each angle, and the weight of the second."""
    lower, w, _ = bracketed(nodes, nodes[0] + (angles - nodes[0]) % period, period)
    return lower, (lower + 1) % len(nodes), w


def _mixed(values: np.ndarray, lower: np.ndarray, upper: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
    """v times the lower and w times the upper node along the last axis of the grid; without weight, NaN counts as 0."""
    first, second = values[..., lower, :], values[..., upper, :]
    return np.where(v == 0.0, 0.0, v * first) + np.where(w == 0.0, 0.0, w * second)
