"""Stacks and polarized light: what smooth interfaces do to s and p, on the way in, on the way out and in between.

Refraction turns no axes: in those of the surface, the passage of an interface is a diattenuator, and passages one after
the other multiply. Light that particles scatter, or that is between the layers for long, is unpolarized before its way
out. Every matrix is as bright as f, whose light counts as unpolarized at each interface.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from ..arrays import ops
from ..formula.direction import Direction
from ..formula.fresnel.dielectric import fresnel_dielectric, interface_mueller
from ..formula.mueller import Mueller, diattenuator, scaled_to, turned_axes
from ..formula.sparse import minus, times
from .layer import AnyLayer, Interface, Medium

UNCHANGED = turned_axes(1.0, 0.0)
Passage = Sequence[tuple[Any, Direction, Any]]
"""Share, direction and index, for each layer that light gets straight to."""


def crossed(layers: Iterable[AnyLayer], passage: Passage) -> list[Mueller]:
    """For each layer of a passage, what the smooth interfaces before it do to s and p, over their transmittance."""
    ratio: Any = 1.0
    found = [UNCHANGED]
    for layer, (_, above, _), (_, below, _) in zip(layers, passage, passage[1:], strict=False):
        if isinstance(layer, Interface):
            c, ct = above.z, below.z
            ratio = ratio * (layer.eta * c + ct) / (c + layer.eta * ct)  # t_s/t_p
            found.append(diattenuator(ratio, 1.0))
        else:
            found.append(found[-1])
    return found


def crossed_first(layers: Iterable[AnyLayer], passage: Passage) -> Mueller:
    """What the smooth interfaces on top do together, down to the first other layer."""
    layers, count = list(layers), 0
    while count < len(layers) and isinstance(layers[count], Interface):
        count += 1
    return crossed(layers[:count], passage)[-1]


def between(before: Mueller, M: Mueller, after: Mueller, f: Any) -> Mueller:
    """A Mueller matrix between two passages, as bright as f."""
    return scaled_to(after @ M @ before, f)


def scattered(before: Mueller, after: Mueller, f: Any) -> Mueller:
    """Light that is scattered, and unpolarized by it, between two passages."""
    M: Mueller = after @ Mueller.depolarizer(1.0) @ before * f
    return M


def together(closed: Iterable[Mueller], rest: Mueller) -> Mueller:
    """The sum of closed forms and of the rest, a series: where it rings below 0 the closed forms, as bright as the sum.

    So no light leaves more polarized than can be.
    """
    total = Mueller.depolarizer(0.0 * rest.rows[0][0])
    for M in closed:
        total = total + M
    bright, more = total.rows[0][0], rest.rows[0][0]
    f = bright + more
    below = more < 0.0
    alone = Mueller.depolarizer(ops.where(below & (bright == 0.0), f, 0.0))
    return scaled_to(total, f).where(below) + (total + rest).where(~below) + alone


def mirrored_and_passed(
    layers: Sequence[AnyLayer], passage: Passage, mirror: Mueller | None
) -> tuple[Mueller, Mueller]:
    """What delta lobes reflect of light along a passage, and what they let through, of all layers; `mirror`: those of
    what is below.

    Interfaces and mirrors add what every bounce between them leaves, J + T M (1 - J M)^-1 T, of s and p apart.
    """
    found = Mueller.depolarizer(0.0) if mirror is None else mirror
    passed = UNCHANGED * (1.0 + 0.0 * passage[0][1].z)
    steps = list(zip(layers, passage, passage[1:], strict=False))
    for layer, (_, above, _), (_, below, _) in reversed(steps):
        if isinstance(layer, Medium):
            once = ops.exp(-layer.depth / above.z)
            found, passed = found * (once * once), passed * once
            continue
        eta, c, ct = layer.eta, above.z, below.z
        J = interface_mueller(c, (eta - 1.0) * (eta + 1.0))
        T = diattenuator(eta * c + ct, c + eta * ct) * (1.0 - fresnel_dielectric(c, eta))
        passed = T @ _again(found @ J) @ passed
        found = J + T @ found @ _again(J @ found) @ T
    return found, passed


def _again(M: Mueller) -> Mueller:
    """(1 - M)^-1, of a matrix that exchanges no light between I, Q and U, V."""

    def inverse(rows: tuple[tuple[Any, Any], ...]) -> list[list[Any]]:
        (a, b), (c, d) = rows
        a, d = minus(1.0, a), minus(1.0, d)
        scale = 1.0 / minus(times(a, d), times(b, c))
        return [[times(d, scale), times(b, scale)], [times(c, scale), times(a, scale)]]

    (a, b), (c, d) = (inverse((M.rows[k][k : k + 2], M.rows[k + 1][k : k + 2])) for k in (0, 2))
    return Mueller(((*a, 0.0, 0.0), (*b, 0.0, 0.0), (0.0, 0.0, *c), (0.0, 0.0, *d)))


def mirror_of(lobes: Iterable[tuple[Any, Any]], wo: Direction) -> Mueller | None:
    """The Mueller matrix of all delta lobes of a base together, without what would mix I, Q with U, V: it is isotropic.
    None without such lobes."""
    found: Mueller | None = None
    for weight, lobe in lobes:
        if lobe.is_delta:
            M = lobe.polarized_mirror(wo) * weight
            found = M if found is None else found + M
    if found is None:
        return None
    (a, b, _, _), (c, d, _, _), (_, _, e, f), (_, _, g, h) = found.rows
    return Mueller(((a, b, 0.0, 0.0), (c, d, 0.0, 0.0), (0.0, 0.0, e, f), (0.0, 0.0, g, h)))
