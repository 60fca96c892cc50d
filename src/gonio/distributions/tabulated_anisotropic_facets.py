"""Tabulated anisotropic facets: any distribution of normals, given by its values at polar angles and azimuths."""

from __future__ import annotations

import math
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Fixed, ops
from ..errors import ParameterError
from ..formula.direction import Direction, azimuth
from ..formula.distribution import Distribution
from ..formula.fields import table
from ..formula.text import literal
from ..numerics.projected_areas import area_harmonics, polar_nodes, projected_areas, rows_between
from .tabulated_facets import angles_of, cell_of

CELLS = 256  # between rows, equally wide in t = sqrt(2 theta/pi); a power of 2
COLUMNS = 256  # azimuths; a power of 2
HALF = COLUMNS // 2
WIDTH = 2.0 * math.pi / COLUMNS


class TabulatedAnisotropicFacets(Distribution, oriented=True):
    """Distribution of normals from a table: D(theta_m, phi_m) proportional to `values`, linear in between.

    `theta` increases, within [0, pi/2]; below the first and above the last angle D stays. `phi` increases, within
    [0, 2 pi), and is closed to a circle. The values need no normalization: the integral of D cos(theta_m) is made 1.
    They are resampled once, to 257 polar angles that are equally spaced in sqrt(theta), and 256 azimuths; at the pole D
    is the mean over the azimuths. D may lean to a side, which no surface does on average; where less of its facets is
    seen than of a flat surface, G1 is 1.

    Looks    `TabulatedAnisotropicFacets([0, 0.1, 0.5], [0, 1.571, 3.142, 4.712], [[4, 4, 4, 4], [1, 4, 1, 4],
             [0, 1, 0, 1]])` draws a lamp out to a short, soft streak.
    Shapes   theta: (N,), N at least 2; phi: (M,); values: (N, M).
    Units    theta, phi: rad; values: any; D: 1/sr.
    Error    of resampling GGX: D relative 5e-3 (median 7e-4) at alpha = (0.1, 0.4); G1 9e-4 (5e-6). Normals: drawn per
             cell, of two that are opposite as they are seen.
    Source   definition. Lambda: the projected area of facets, integral of D max(w . wm, 0), in Fourier series over the
             azimuth; derived here.

    Example
    >>> theta, phi = np.linspace(0.0, 1.5, 200), np.linspace(0.0, 6.2, 64)
    >>> wm = gn.direction(theta[:, None], phi)
    >>> facets = gn.TabulatedAnisotropicFacets(theta, phi, np.exp(-((wm[..., 0] / 0.1) ** 2 + (wm[..., 1] / 0.4) ** 2)))
    >>> m = gn.Microfacet(facets)
    >>> print(m.f_angles(0.0, 0.0, 0.4, [0.0, 1.571]).round(2))
    [0.04 1.69]
    """

    theta = table("polar angles [rad], increasing")
    phi = table("azimuths [rad], increasing")
    values = table("D at these angles (N, M), in any unit")

    def __init__(
        self,
        theta: Any = (0.0, 0.5 * math.pi),
        phi: Any = (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi),
        values: Any = ((1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0)),
    ):
        try:
            theta, phi, values = (ops.numbers(x) for x in (theta, phi, values))
        except (TypeError, ValueError, OverflowError) as error:
            raise ParameterError(
                f"TabulatedAnisotropicFacets: not numbers: {error}; expected theta (N,), phi (M,) [rad], values (N, M)"
            ) from None
        if theta.ndim != 1 or phi.ndim != 1 or values.shape != (len(theta), len(phi)) or len(theta) < 2 or not len(phi):
            raise ParameterError(
                f"TabulatedAnisotropicFacets: got shapes {theta.shape}, {phi.shape} and {values.shape}, expected theta "
                f"(N,), N at least 2, phi (M,) and values (N, M)"
            )
        super().__init__(theta=theta.astype(float), phi=phi.astype(float), values=values.astype(float))

    def validate(self) -> None:
        theta, phi, values = self.theta, self.phi, self.values
        if not (np.isfinite(values).all() and values.min() >= 0.0 and values.max() > 0.0):
            raise ParameterError(
                "TabulatedAnisotropicFacets(values): expected finite numbers of at least 0, not all of them 0"
            )
        if not (theta[0] >= 0.0 and theta[-1] <= 0.5 * math.pi + 1e-9 and (np.diff(theta) > 0.0).all()):
            raise ParameterError("TabulatedAnisotropicFacets(theta): expected increasing angles in [0, pi/2] rad")
        if not (phi[0] >= 0.0 and phi[-1] < 2.0 * math.pi and (np.diff(phi) > 0.0).all()):
            raise ParameterError(
                "TabulatedAnisotropicFacets(phi): expected increasing azimuths in [0, 2 pi) rad; the first is not "
                "repeated at the end"
            )

    def _keep(self) -> dict[str, Fixed]:
        """Tables made of those given, when first needed."""
        tables = cache(lambda: _tables(self.theta, self.phi, self.values))
        return {name: Fixed(partial(lambda i: tables()[i], i)) for i, name in enumerate(_Tables._fields)}

    def __getattr__(self, name: str) -> Any:  # tables, in formulas where nothing is bound
        if name in self._kept:
            return self._kept[name].numbers
        raise AttributeError(f"TabulatedAnisotropicFacets has no attribute {name!r}")

    def __repr__(self) -> str:
        told = ", ".join(f"{name}={literal(getattr(self, name))}" for name in ("theta", "phi", "values"))
        return f"TabulatedAnisotropicFacets({told})"

    def to_json(self) -> dict[str, Any]:
        named = {name: getattr(self, name).tolist() for name in ("theta", "phi", "values")}
        return {"type": type(self).__name__, **named}

    def D(self, wm: Direction) -> Any:
        i, rest = cell_of(*angles_of(wm), CELLS)
        column, v = _column(wm)
        first, rows = i * (COLUMNS + 1) + ops.to_index(column), []
        for k in (0, COLUMNS + 1):
            low, high = ops.take(self.facets, first + k), ops.take(self.facets, first + (k + 1))
            rows.append(low + v * (high - low))
        return rows[1] + rest * (rows[0] - rows[1])

    def Lambda(self, w: Direction) -> Any:
        # z Lambda, which is smooth, by cubics through four of its values along either angle.
        i, rest = cell_of(*angles_of(w)[::-1], CELLS)
        column, v = _column(w)
        along, around = _cubic(1.0 - rest), _cubic(v)
        first, total = i * (COLUMNS + 3) + ops.to_index(column), 0.0
        for k in range(4):
            row = sum(around[c] * ops.take(self.shown, first + (k * (COLUMNS + 3) + c)) for c in range(4))
            total = total + along[k] * row
        return ops.maximum(total, 0.0) / w.z

    # Drawn is a cell of theta and one of phi, of the mean of D and D of the opposite normals; in it phi is uniform. Of
    # two opposite normals one leans towards wo and is always seen, the other up to some theta. Up to there either is
    # drawn, in the proportion in which they are seen at the inner edge; sin^2(theta) is uniform.

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        i, share = self._found(self.rows, 0, CELLS, u1)
        j, v = self._found(self.cumulated, i * (HALF + 1), HALF, u0)
        cos, sin = ops.turn((j + v) * (1.0 / COLUMNS))
        across = wo.x * cos + wo.y * sin
        near, both = self._near(i, j, across, wo.z)
        far = (1.0 - near) * both  # the share of the cell in which the other one is drawn
        is_far = share < far
        either = ops.where(is_far, share / ops.maximum(1.0 - near, 1e-30), (share - far) / ops.maximum(near, 1e-30))
        x = ops.where(share < both, either, share)
        inner, outer = (ops.take(self.rows, i + (_ROW + k)) for k in (0, 1))
        sin2 = inner + x * (outer - inner)
        s, z = ops.sqrt(sin2 + 1e-30), ops.sqrt(ops.maximum(1.0 - sin2, 0.0))
        s = ops.where((across < 0.0) != is_far, -s, s)
        return Direction(s * cos, s * sin, z)

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        i, _ = cell_of(*angles_of(wm), CELLS)
        column, _ = _column(wm)
        opposite = column >= HALF
        j = ops.to_index(ops.where(opposite, column - HALF, column))
        across = (wo.x * wm.x + wo.y * wm.y) / ops.sqrt(wm.x * wm.x + wm.y * wm.y + 1e-30)
        across = ops.where(opposite, -across, across)
        near, _ = self._near(i, j, across, wo.z)
        alone = 2.0 * wo.z * wm.z - cos_d < 0.0  # the opposite one faces away
        seen = ops.where((across < 0.0) != opposite, 1.0 - near, ops.where(alone, 1.0, near))
        return ops.take(self.densities, i * HALF + j) * wm.z * seen

    def _found(self, table: Any, first: Any, count: int, u: Any) -> tuple[Any, Any]:
        """The cell of a cumulated probability, of `count`, a power of 2, and where in it u is, from 0 to 1."""
        i, step = ops.to_index(0.0 * u), count
        while step := step // 2:
            i = ops.where(ops.take(table, first + i + step) <= u, i + step, i)
        before, after = (ops.take(table, first + i + k) for k in (0, 1))
        return i, ops.clip((u - before) / ops.maximum(after - before, 1e-30), 0.0, 1.0)

    def _near(self, i: Any, j: Any, across: Any, z: Any) -> tuple[Any, Any]:
        """Of two opposite normals of a cell: the share of the one that leans towards wo, where both are seen; and up to
        which share of the cell, in sin^2(theta), they are. `across`: wo along the azimuth of the first."""
        inner, outer = (ops.take(self.rows, i + (_ROW + k)) for k in (0, 1))
        across2 = across * across + 1e-30
        both = ops.clip((z * z / (z * z + across2) - inner) / (outer - inner), 0.0, 1.0)
        up, lean = z * ops.sqrt(1.0 - inner), ops.sqrt(across2 * inner + 1e-30)
        part = ops.take(self.parts, i * HALF + j)
        part = ops.where(across < 0.0, 1.0 - part, part)
        near, far = part * (up + lean), (1.0 - part) * ops.maximum(up - lean, 0.0)
        return near / ops.maximum(near + far, 1e-30), both


_ROW = CELLS + 1


def _column(w: Direction) -> tuple[Any, Any]:
    """The azimuth at or before that of w, and how far it is from there to the next one, from 0 to 1."""
    s = ops.sqrt(w.x * w.x + w.y * w.y + 1e-24)
    cos, sin = azimuth(w, s)
    turns = COLUMNS * (ops.arctan2(sin, cos) * (0.5 / math.pi))
    turns = ops.where(turns < 0.0, turns + COLUMNS, turns)
    count = ops.clip(ops.floor(turns), 0.0, COLUMNS - 1.0)
    return count, turns - count


def _cubic(v: Any) -> tuple[Any, Any, Any, Any]:
    """Weights of the values at -1, 0, 1, 2 of the cubic through them, at v."""
    a, b, c = v + 1.0, v - 1.0, v - 2.0
    return -v * b * c * (1.0 / 6), a * b * c * 0.5, -a * v * c * 0.5, a * v * b * (1.0 / 6)


class _Tables(NamedTuple):
    """What formulas look up, each in one row.

    facets      (257, 257) D, the first azimuth repeated at the end
    shown       (259, 259) z Lambda, one more row at each end, and of azimuths one before and two behind
    rows        cumulated probability (257) of cells of theta, and sin^2 at their edges
    cumulated   (256, 129) cumulated probability of half a turn of each
    parts       (256, 128) the share of these normals, of them and those opposite
    densities   (256, 128) probability of a cell, of both, over the integral of cos in it
    """

    facets: np.ndarray
    shown: np.ndarray
    rows: np.ndarray
    cumulated: np.ndarray
    parts: np.ndarray
    densities: np.ndarray


def _tables(theta: np.ndarray, phi: np.ndarray, values: np.ndarray) -> _Tables:
    t = np.arange(_ROW) / CELLS
    angles = 0.5 * math.pi * t * t
    along = np.stack([np.interp(angles, theta, column) for column in values.T], axis=1)
    columns = np.arange(COLUMNS) * WIDTH
    D = np.stack([np.interp(columns, phi, row, period=2.0 * math.pi) for row in along])
    D[0] = D[0].mean()
    nodes, width = polar_nodes(CELLS)
    at_nodes = rows_between(D, nodes, CELLS)
    share = (at_nodes * (0.5 * np.sin(2.0 * nodes) * width)[:, None]).reshape(CELLS, -1, COLUMNS).sum(axis=1)
    share = 0.5 * WIDTH * (share + np.roll(share, -1, axis=1))  # of cells between azimuths
    total = share.sum()
    D, share, at_nodes = D / total, share / total, at_nodes / total
    ours, theirs = share[:, :HALF], share[:, HALF:]
    both = ours + theirs
    by_row = both.sum(axis=1)
    rows = np.zeros((2, _ROW))
    rows[0, 1:] = np.cumsum(by_row)
    rows[0] /= rows[0, -1]
    rows[1] = np.sin(angles) ** 2
    cumulated = np.zeros((CELLS, HALF + 1))
    cumulated[:, 1:] = np.cumsum(both, axis=1)
    cumulated[:, 1:] /= np.where(by_row > 0.0, by_row, 1.0)[:, None]
    cumulated[by_row == 0.0, 1:] = np.arange(1, HALF + 1) / HALF
    cumulated[:, -1] = 1.0
    parts = np.where(both > 0.0, ours / np.where(both > 0.0, both, 1.0), 0.5)
    densities = both / (0.5 * WIDTH * np.diff(rows[1]))[:, None]
    from_horizon = 0.5 * math.pi - angles
    weighed = at_nodes * (np.sin(nodes) * width)[:, None]
    seen = np.split(from_horizon, range(64, len(from_horizon), 64))  # as much as a processor's cache holds
    areas = [projected_areas(weighed, area_harmonics(nodes, some, COLUMNS)) for some in seen]
    shown = np.concatenate(areas) - np.cos(from_horizon)[:, None]
    beyond = 4.0 * shown[-1] - 6.0 * shown[-2] + 4.0 * shown[-3] - shown[-4]
    shown = np.pad(np.concatenate([shown[1:2], shown, beyond[None]]), ((0, 0), (1, 2)), "wrap")
    D = np.pad(D, ((0, 0), (0, 1)), "wrap")
    return _Tables(*(a.reshape(-1) for a in (D, shown, rows, cumulated, parts, densities)))
