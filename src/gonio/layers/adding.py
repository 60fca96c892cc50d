"""Scattering matrices of layers, and their sums: what two layers do together.

Fields are Fourier series in the azimuth, sum_m u_m cos(m phi); each order goes its own way. Of an order, u is a vector
over the nodes of `grid`: the roots of their etendues times radiance over n^2. In this basis the matrices of reciprocal
layers are symmetric, and light is conserved where they keep the vector of uniform light, `NodeGrid.root`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Matrices(NamedTuple):
    """What a layer does, by order: (orders, out, in). Light from above and from below, reflected and transmitted."""

    above: np.ndarray
    down: np.ndarray
    up: np.ndarray
    below: np.ndarray


def added(first: Matrices, second: Matrices) -> Matrices:
    """Two layers, the second under the first.

    Between them light goes to and fro: (1 - R1' R2)^-1 = 1 + R1' R2 + R1' R2 R1' R2 + ...
    """
    again, back = first.below @ second.above, first.below @ second.up
    orders = max(len(first.down), len(back))
    into = [np.broadcast_to(x, (orders, *x.shape[1:])) for x in (first.down, back)]
    between = _to_and_fro(again, np.concatenate(into, -1))
    down, sent = np.split(between, [first.down.shape[-1]], axis=-1)
    return Matrices(
        first.above + first.up @ (second.above @ down),
        second.down @ down,
        first.up @ (second.up + second.above @ sent),
        second.below + second.down @ sent,
    )


def under_smooth(first: Matrices, deltas: Matrices, rest: Matrices) -> Matrices:
    """What scatters of a smooth interface and what lies under it, whose matrices are `deltas + rest`.

    Nothing is subtracted: delta lobes are near 1 at the horizon, where the rest is less than their rounding. With
    D = 1 - R1' d light goes to and fro by (D - R1' K)^-1, d the delta lobe and K the rest of what is below.
    """
    (mirror,), again = first.below[:1], first.below @ rest.above
    once = 1.0 - np.diagonal(mirror) * np.diagonal(deltas.above[0])
    once = np.where(once == 0.0, 1.0, once)  # where light would stay for ever, none gets
    orders = max(len(x) for x in (*rest, first.down))
    sent = mirror @ (deltas.up + rest.up)
    into = [np.broadcast_to(x, (orders, *x.shape[1:])) for x in (first.down, sent)]
    between = np.linalg.solve(np.diag(once) - again, np.concatenate(into, axis=-1))
    down, back = np.split(between, [first.down.shape[-1]], axis=-1)
    to_below = deltas.down @ (mirror / once[:, None])
    through = rest.down + to_below @ rest.above
    passed = through @ down
    return Matrices(
        (first.up / once) @ (rest.above @ down),
        passed,
        np.swapaxes(passed, -1, -2),
        rest.below + through @ back + to_below @ rest.up,
    )


def _to_and_fro(again: np.ndarray, light: np.ndarray) -> np.ndarray:
    """(1 - again)^-1 light: none, where what would stay between two mirrors for ever gets none."""
    once = np.eye(again.shape[-1]) - again
    for_ever = ~once.any(axis=-1)
    if for_ever.any():
        once = once + np.eye(again.shape[-1]) * for_ever[..., None]
    return np.linalg.solve(once, light)


def doubled(reflection: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twice the same layer, of a medium: it looks the same from both sides. `change`: what it transmits, less 1.

    A thin layer changes light little: as T itself, its rounding would double with every doubling.
    """
    one = np.eye(reflection.shape[-1])
    twice = reflection @ reflection
    transmission = one + change
    again = np.linalg.solve(one - twice, twice) @ transmission
    more = change + transmission @ (change + again)
    return reflection + transmission @ (reflection @ (transmission + again)), more


def even(x: np.ndarray) -> np.ndarray:
    """The part of matrices that is the same when light goes the other way: all of it, but for rounding."""
    return 0.5 * (x + np.swapaxes(x, -1, -2))
