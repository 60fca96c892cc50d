"""The rehearsal of rows in no grid: half-planes, angles or single rows are left out."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.spatial import KDTree

from ..formula import tree
from ..tables.angle_systems import SYSTEMS
from ..tables.gridded import Gridded
from ..tables.half_planes import ALIKE
from ..tables.interpolation import NEIGHBOURS, Rows, angles_of, at_angles, places_of
from ..tables.scattered import Scattered
from .functionals import Linear
from .rehearsal import FADES, ErrorPart, Rehearsal
from .sensitivity import FEWEST, coefficients

TARGETS = 2000
"""Most nodes of the grid at which rows are left out; an integral takes this many of its nodes."""


class Group(NamedTuple):
    """Rows (n,) that are left out, and then the others; `scale` of the sum of both changes."""

    name: str
    left: np.ndarray
    scale: float


class RowRehearsal:
    """The errors that interpolation may make in results of rows in no grid: those of the grid that stands for them, and
    those of its nodes, by leaving out rows."""

    def __init__(self, m: Scattered):
        self.m, self.grid = m, Rehearsal(m)
        self.table = self.grid.table

    def parts(self, of: Linear, noisy: bool) -> list[ErrorPart]:
        """The parts of the error of results of a linear function."""
        return [*self.grid.parts(of, noisy), *self._by_rows(of, noisy)]

    def _by_rows(self, of: Linear, noisy: bool) -> Iterator[ErrorPart]:
        m, four = self.m, tree.is_oriented(self.m)
        rows = coefficients(m, of, FEWEST if of.sampled else 1).of(0)
        angles = angles_of(m.axes, four)
        some = np.flatnonzero(np.diff(sparse.csc_array(rows).indptr))
        share = 1.0
        if of.sampled and len(some) > TARGETS:
            share = len(some) / TARGETS
            some = np.sort(np.random.default_rng(0).choice(some, TARGETS, replace=False))
        few = sparse.csr_array(rows[:, some] * share)
        there = angles[some]
        neighbours = KDTree(places_of(m.rows, four, m.is_mirrored))
        nearest = neighbours.query(places_of(angles, four, m.is_mirrored))[1] if noisy else None
        for name, left, scale in groups(m):
            changes, noise = [], []
            for without in (left, ~left):
                changes.append(np.nan_to_num(self.table[some] - self._without(without, there)))
                if nearest is not None:
                    noise.append(_less(rows, without[nearest]))
            for factor, sign in ((scale, 1.0), (0.5, -1.0)):
                of_values = sparse.csr_array(factor * (noise[0] + sign * noise[1])) if noise else None
                yield ErrorPart(name, factor * few @ (changes[0] + sign * changes[1]), of_values)
        yield ErrorPart("far", few @ self._far(neighbours, places_of(there, four, m.is_mirrored)))
        if len(_bins(_coordinates(m)[-1], math.inf)) == 1:
            yield ErrorPart("off plane", few @ self._off_plane(some, there))

    def left_out(self) -> Iterator[tuple[float, list[Gridded]]]:
        """For each group of rows two tables: without these, and without the others; and the share of the sum of both
        changes that is the error."""
        angles = angles_of(self.m.axes, tree.is_oriented(self.m))
        for _, left, scale in groups(self.m):
            made = (self._without(without, angles).reshape(self.m.brdf().shape) for without in (left, ~left))
            yield scale, [self.m.with_brdf(np.where(np.isnan(self.m.brdf()), np.nan, f)) for f in made]

    def _without(self, left: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """f (m, C) at angles (m, 4), interpolated without some of the rows."""
        m = self.m
        f = m.row_brdf()[0][~left]
        return at_angles(Rows(m.rows[~left], f, None, tree.is_oriented(m), m.is_mirrored, "hold"), angles)[0]

    def _far(self, neighbours: KDTree, places: np.ndarray) -> np.ndarray:
        """What nodes further from rows than rows are from each other may be off: the spread of rows, by distance."""
        f = self.m.row_brdf()[0].reshape(neighbours.n, -1)
        if neighbours.n < 3:
            return np.zeros((len(places), f.shape[1]))
        usual = np.median(neighbours.query(neighbours.data, k=2)[0][:, 1])
        distance, index = neighbours.query(places, k=min(NEIGHBOURS, neighbours.n))
        size = np.maximum(distance[:, -1], 1e-9)
        ratio = np.where(distance[:, 0] > 2.0 * usual, distance[:, 0] / size, 0.0)
        return ratio[:, None] * np.nan_to_num(np.nanstd(f[index], axis=1))

    def _off_plane(self, some: np.ndarray, there: np.ndarray) -> np.ndarray:
        """What nodes off the only half-plane may be off: as f varies along it."""
        phi = np.mod(there[:, 3] - there[:, 1] - _coordinates(self.m)[-1][0], 2.0 * math.pi)
        off = np.minimum(np.minimum(phi, 2.0 * math.pi - phi) / FADES, 1.0)
        grid = self.table.reshape(*self.grid.shape, -1)
        spread = np.abs(grid - grid.mean(axis=(1, 2), keepdims=True)).reshape(self.table.shape)
        return off[:, None] * spread[some]


def _less(rows: sparse.csr_array, mine: np.ndarray) -> sparse.csr_array:
    """About the coefficients of the change by leaving out the measurements of `mine` (nodes,): those, less the others
    that stand in for them."""
    out, others = rows.multiply(mine[None].astype(float)), rows.multiply(1.0 - mine[None])
    sums = [np.asarray(x.sum(axis=1)).reshape(-1) for x in (out, others)]
    ratio = np.clip(sums[0] / np.where(sums[1] > 0.0, sums[1], np.inf), 0.0, 1.0)
    return sparse.csr_array(out - others.multiply(ratio[:, None]))


def _coordinates(m: Scattered) -> list[np.ndarray]:
    """The angles of rows in which they may lie in order: polar angles, azimuths of half-planes."""
    theta_i, phi_i, theta_o, phi_o = m.rows.T
    if tree.is_oriented(m):
        return [theta_i, theta_o, np.mod(phi_i, 2.0 * math.pi), np.mod(phi_o, 2.0 * math.pi)]
    phi = np.mod(phi_o - phi_i + 0.5 * ALIKE, 2.0 * math.pi)
    return [theta_i, theta_o, np.minimum(phi, 2.0 * math.pi - phi + ALIKE) if m.is_mirrored else phi]


def _bins(angle: np.ndarray, most: float) -> np.ndarray:
    """The different values of an angle, in steps of `ALIKE`, if there are at most so many; else none."""
    values = np.unique(np.floor(angle / ALIKE))
    return values if len(values) <= most else values[:0]


def groups(m: Scattered) -> Iterator[Group]:
    """Halves of the rows: every second of the few values of an angle; and every second row, where there are many."""
    coordinates = _coordinates(m)
    steps, free = [], 0
    for name, angle in zip(SYSTEMS["angles"].axes(tree.is_oriented(m)), coordinates, strict=True):
        span = (angle.max() - angle.min()) / ALIKE
        values = _bins(angle, min(len(angle) / 3.0, 0.5 * span + 1.0))
        if len(values) == 0:
            free += 1
            steps.append(np.floor(angle / math.radians(20.0)))
            continue
        number = np.searchsorted(values, np.floor(angle / ALIKE))
        steps.append(number)
        if len(values) > 1:
            yield Group(name, number % 2 == 1, 1.0 / 3.0)
    if free and len(m.rows) > 3:
        order = np.lexsort((coordinates[1], *steps))
        left = np.zeros(len(m.rows), bool)
        left[order[::2]] = True
        yield Group("rows", left, 0.5 / (2.0 ** (1.5 / free) - 1.0))
