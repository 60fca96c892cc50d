"""The directions in which light is followed through a stack: nodes that refraction leaves in their place.

A smooth interface keeps s = n sin(theta), so that nodes in s serve every medium: light of node j in front of it is
light of node j behind it. Radiance over n^2 is kept too, and so is the etendue n^2 cos(theta) dcos(theta) = s ds, the
weight of a node. A medium of index n has the nodes with s < n; between two indices there is a panel of its own, of
light that the thinner of two media reflects totally. Each panel is cut into pieces, closer to its horizon.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..machine.caches import kept

SAME = 1e-9  # of two indices, relative

CUTS = (0.0, 0.03, 0.2, 1.0)
"""Where the pieces of a panel end, in its cosine over the widest there."""

LOW = (12, 12)
"""Nodes of the pieces near the horizon, in which thin layers change as exp(-depth/mu)."""


class NodeGrid(NamedTuple):
    """Nodes of s^2, increasing, and the etendue of each, over 2 pi; `panels`: where one ends, by the index there."""

    s2: np.ndarray
    etendue: np.ndarray
    panels: tuple[tuple[complex, int], ...]

    def count(self, n: complex) -> int:
        """The number of nodes, from the first, that light in a medium of index n has."""
        return next(end for index, end in self.panels if abs(index.real - n.real) <= SAME * n.real)

    def parts(self, n: complex) -> list[slice]:
        """The nodes of each panel that light in a medium of index n has."""
        ends = [0, *(end for _, end in self.panels if end <= self.count(n))]
        return [slice(low, high) for low, high in pairwise(ends)]

    def mu(self, n: complex) -> np.ndarray:
        """Cosines of the nodes in a medium of index n."""
        return np.sqrt(1.0 - self.s2[: self.count(n)] / (n * n))

    def cells(self, n: complex) -> tuple[np.ndarray, np.ndarray]:
        """Where the cells of the nodes in a medium of index n begin and end, in s^2: each holds its node's etendue."""
        ends = 2.0 * np.cumsum(self.etendue)
        return (ends - 2.0 * self.etendue)[: self.count(n)], ends[: self.count(n)]

    def root(self, n: complex) -> np.ndarray:
        """Roots of the etendues: light of the same radiance over n^2 from everywhere, as a vector of the basis."""
        return np.sqrt(self.etendue[: self.count(n)])


@kept
def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes, increasing, and weights of the Gauss–Legendre rule on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 * (x + 1.0), 0.5 * w


@kept
def rule(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes, increasing, and weights on [0, 1] of a panel: a Gauss–Legendre rule in each of its pieces."""
    low, size = CUTS[:-1], np.diff(CUTS)
    rules = [gauss(n) for n in (*LOW, count - sum(LOW))]
    x = [start + width * nodes for start, width, (nodes, _) in zip(low, size, rules, strict=True)]
    return np.concatenate(x), np.concatenate([width * w for width, (_, w) in zip(size, rules, strict=True)])


def pieces(count: int) -> list[slice]:
    """The nodes of each piece of a panel, whose nodes decrease, from the horizon on."""
    ends = count - np.cumsum((0, *LOW, count - sum(LOW)))
    return [slice(int(low), int(high)) for high, low in pairwise(ends)]


def grid(indices: Sequence[complex], nodes: int) -> NodeGrid:
    """The grid of a stack of media with these indices, the first in front, for lobes that a rule of so many `nodes`
    from the normal to the horizon resolves.

    In each panel the nodes are those of Gauss–Legendre rules in the cosine in the medium that the panel ends with:
    Fresnel's formulas and attenuation are smooth there.
    """
    ends: list[complex] = []
    for n in sorted(indices, key=lambda n: n.real):
        if not ends or n.real - ends[-1].real > SAME * n.real:
            ends.append(n)
    s2, etendue, before, total = [], [], 0.0 * ends[0], 0
    panels: list[tuple[complex, int]] = []
    for n in ends:
        widest = np.sqrt(1.0 - before * before / (n * n))
        wanted = nodes if not panels else 4 * int(np.ceil(max(8.0, 0.75 * nodes * widest.real) / 4.0))
        count = sum(LOW) + max(10, math.ceil(0.75 * wanted))
        x, w = rule(count)
        mu, w = widest * x[::-1], widest * w[::-1]
        s2.append(n * n * (1.0 - mu * mu))
        etendue.append(n * n * mu * w)
        before, total = n, total + count
        panels.append((n, total))
    return NodeGrid(np.concatenate(s2), np.concatenate(etendue), tuple(panels))
