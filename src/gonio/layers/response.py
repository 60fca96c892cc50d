"""What a stack does to light, in numbers: its layers' matrices added up, the parts known in closed form taken out."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..compile.threads import share, threads
from ..numerics.one_thread import one_thread
from . import interfaces, media
from .adding import Matrices, added, even, under_smooth
from .grid import SAME, NodeGrid, grid

CHUNKS = (12, 32, 56, 80, 108, 136, 160, 184, 208, 232, 256)
CHUNKS_OF_ROUGH = (12, 32, 80, 160, 256)
"""Orders that are computed at first, and where these are not enough: of facets fewer times, for they begin anew."""

AROUND = np.pi * np.arange(17) / 16
"""Azimuths at which a series must be as good as it is asked to be."""

FEWEST, FEWEST_OF_ROUGH, MOST = 24, 36, 128
"""Nodes from the normal to the horizon; beside facets' total reflection, which begins by a root, there are more."""

NOTHING = 1e-12
"""What is less is rounding [1/sr]: some 1e-13 remain where light that went straight through is taken away."""

ROUNDING = 1e-11
"""The same, of elements of matrices."""

LOWEST = 0.02
"""The cosine from which on a series is as good as it is asked to be."""


class Smooth(NamedTuple):
    """A smooth interface, by the index behind it over that in front."""

    eta: complex


class Rough(NamedTuple):
    """A rough interface; `kept`: whether what facets scatter more than once is."""

    eta: complex
    alpha: complex
    kept: bool


class Scatterers(NamedTuple):
    """A medium."""

    depth: complex
    albedo: complex
    g: complex


Part = Smooth | Rough | Scatterers
Base = Callable[[NodeGrid, complex], tuple[Callable[[range], np.ndarray], np.ndarray]]
"""Matrices (orders, nodes, nodes) of orders, and delta reflectances (nodes), of what lies below, in a medium of this
index."""


class FourierBlock(NamedTuple):
    """Fourier coefficients (orders, nodes, nodes) of f/n_o^2, and the indices of the media of rows and of columns."""

    rows: complex
    columns: complex
    coefficients: np.ndarray


class Response(NamedTuple):
    """What a stack does, all but the closed forms: reflection; over nothing also that from behind, and transmission,
    by the direction in front and that behind. `media`: the number of the first medium that each panel ends with."""

    grid: NodeGrid
    blocks: tuple[FourierBlock, ...]
    media: tuple[int, ...]

    @property
    def nodes(self) -> int:
        """The number of nodes in front."""
        return int(self.blocks[0].coefficients.shape[1])

    @property
    def orders(self) -> int:
        """The number of orders."""
        return len(self.blocks[0].coefficients)


def nodes_for(parts: Sequence[Part], tolerance: float) -> int:
    """The number of nodes that the narrowest lobe needs.

    Light that passes facets of slope scale alpha is spread by about w = alpha |eta - 1|, and a rule with nodes 2/n
    apart errs by exp(-2 pi w n/2) where it integrates a peak with poles at a distance of w.
    """
    digits = math.log(1.0 / tolerance)
    widths = [p.alpha.real * max(abs(p.eta.real - 1.0), 0.2) for p in parts if isinstance(p, Rough)]
    wanted = max([digits / math.pi / w for w in widths], default=0.0)
    wanted = max([wanted, *(0.5 * terms(p, tolerance) for p in parts if isinstance(p, Scatterers))])
    fewest = FEWEST_OF_ROUGH if widths else FEWEST
    return int(4 * math.ceil(0.25 * min(max(wanted, fewest), MOST)))


def terms(medium: Scatterers, tolerance: float) -> int:
    """Terms of the series of the phase function, up to where they are below a tenth of the tolerance; with g = 0 the
    second, too, which has the slope by g."""
    g = abs(medium.g.real)
    return 2 if g < 1e-12 else min(2 * MOST, 2 + math.ceil(math.log(0.1 * tolerance) / math.log(g)))


def indices(parts: Sequence[Part]) -> list[complex]:
    """The indices of the media, from the first above the stack to that below it."""
    etas: list[complex] = [1.0 + 0.0j]
    for part in parts:
        if not isinstance(part, Scatterers):
            etas.append(etas[-1] * part.eta)
    return etas


def response(parts: Sequence[Part], base: Base | None, tolerance: float) -> Response:
    """The response of a stack on a base, or over nothing.

    The series ends where no order is more than a tenth of the tolerance of the least f around the circle, for any two
    nodes: of forward particles it is what leaves at grazing that takes most.
    """
    whole = _real(indices(parts))
    grating = grid(whole, nodes_for(parts, tolerance))
    ends = [(0, 0)] if base is not None else [(0, 0), (-1, -1), (0, -1)]
    sides = [(whole[a], whole[b]) for a, b in ends]
    clear: list[Any] = [(..., *np.ix_(*(np.flatnonzero(grating.mu(n).real > LOWEST) for n in pair))) for pair in sides]
    roots = [np.outer(*(grating.root(n) for n in pair)) for pair in sides]
    sums: list[Any] = [0.0 for _ in sides]
    by_side: list[list[np.ndarray]] = [[] for _ in sides]
    rough = any(isinstance(part, Rough) for part in parts)
    chunks = CHUNKS_OF_ROUGH if rough else CHUNKS
    with one_thread():
        layers, below = _layers(parts, grating, whole, tolerance), None if base is None else base(grating, whole[-1])
        for start, stop in zip((0, *chunks), chunks, strict=False):
            orders = np.arange(start, stop)
            over = np.pi * np.where(orders == 0, 2.0, 1.0)[:, None, None]
            needed: Any = np.zeros(stop - start, bool)
            for k, (rest, total) in enumerate(_shared(layers, below, grating, whole, range(start, stop), rough)):
                by_side[k].append(rest / (over * roots[k]))
                total, root = (total / (over * roots[k])).real[clear[k]], roots[k].real[clear[k]]
                sums[k] = sums[k] + np.tensordot(np.cos(AROUND[:, None] * orders), total, 1)
                size = np.abs(sums[k])
                least = np.maximum(size.min(axis=0), 1e-6 * size.max(axis=0))
                least = np.maximum(0.1 * tolerance * least, NOTHING + ROUNDING / root)
                needed |= (np.abs(by_side[k][-1][clear[k]]) > least).any(axis=(1, 2))
            last = np.flatnonzero(needed)
            if not len(last) or last[-1] < 0.75 * (stop - start):
                enough = last[-1] + 1 if len(last) else 1 if start == 0 else 0
                for of_side in by_side:
                    of_side[-1] = of_side[-1][:enough]
                break
    media = (
        next(k for k, n in enumerate(whole) if abs(n.real - end.real) <= SAME * end.real) for end, _ in grating.panels
    )
    blocks = (FourierBlock(*pair, np.concatenate(x)) for pair, x in zip(sides, by_side, strict=True))
    return Response(grating, tuple(blocks), tuple(media))


def _real(numbers: Sequence[complex]) -> list[complex]:
    """Plain numbers, where none has an imaginary part: real arithmetic is four times as fast."""
    return list(numbers) if any(np.imag(n) for n in numbers) else [float(np.real(n)) for n in numbers]


def _shared(
    layers: Sequence[_Makes], below: _Below | None, grid: NodeGrid, whole: Sequence[complex], orders: range, rough: bool
) -> list[tuple[np.ndarray, np.ndarray]]:
    """The same as `_rest`, on all threads; `rough`: there are facets, which take them themselves."""
    base = None if below is None else (below[0](orders), below[1])
    step = len(orders) if rough else math.ceil(len(orders) / min(threads(), len(orders)))
    parts = [orders[k : k + step] for k in range(0, len(orders), step)]
    by_part: list[Any] = [None] * len(parts)

    def work(number: int) -> None:
        part = slice(parts[number].start - orders.start, parts[number].stop - orders.start)
        of_part = None if base is None else (base[0][part], base[1])
        blocks = _rest(layers, of_part, grid, whole, parts[number])
        by_part[number] = [[np.broadcast_to(x, (len(parts[number]), *x.shape[1:])) for x in block] for block in blocks]

    share(work, [(number,) for number in range(len(parts))])
    pairs = (zip(*of_block, strict=True) for of_block in zip(*by_part, strict=True))
    return [(np.concatenate(rests), np.concatenate(totals)) for rests, totals in pairs]


def _rest(
    layers: Sequence[_Makes],
    base: tuple[np.ndarray, np.ndarray] | None,
    grid: NodeGrid,
    whole: Sequence[complex],
    orders: range,
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Matrices of the stack, less delta lobes and less what the closed forms have, and with that, for each block of
    `Response`."""
    at = grid.count(whole[-1])
    if base is None:
        deltas, rest = nothing(at), nothing(at, through=0.0)
        closed, straight = rest, np.ones(at)
    else:  # a layer with no nodes below it
        below, mirror = base
        opaque = nothing(at, 0)
        deltas, rest = opaque._replace(above=np.diag(mirror)[None]), opaque._replace(above=below)
        closed, straight = rest, np.ones(0)
    for makes in reversed(layers):
        layer = makes(orders)
        if layer.smooth:
            rest = under_smooth(layer.whole, deltas, rest)
        else:
            total = added(layer.whole, Matrices(*(a + b for a, b in zip(deltas, rest, strict=True))))
            rest = Matrices(*(a - b for a, b in zip(total, added(layer.deltas, deltas), strict=True)))
        deltas = added(layer.deltas, deltas)
        closed = _once(layer, closed, straight)
        common = min(len(layer.straight), len(straight))
        straight = layer.straight[:common] * straight[:common]
    without = Matrices(*(a - b for a, b in zip(rest, closed, strict=True)))
    return list(zip(*(_blocks(x, base is not None) for x in (without, rest)), strict=True))


def _blocks(whole: Matrices, closed: bool) -> list[np.ndarray]:
    """The blocks of `Response`; `closed`: there is a base."""
    through = 0.5 * (whole.up + np.swapaxes(whole.down, -1, -2))
    return [even(whole.above)] if closed else [even(whole.above), even(whole.below), through]


class _LayerMatrices(NamedTuple):
    """What a layer does in all; its delta lobes; what goes straight on at each node; what is scattered once; whether it
    is a smooth interface."""

    whole: Matrices
    deltas: Matrices
    straight: np.ndarray
    once: Matrices
    smooth: bool = False


_Makes = Callable[[range], _LayerMatrices]
_Below = tuple[Callable[[range], np.ndarray], np.ndarray]


def _layers(parts: Sequence[Part], grid: NodeGrid, whole: Sequence[complex], tolerance: float) -> list[_Makes]:
    """What makes each layer, of some orders, from the top down."""
    n, makers = iter(whole), list[_Makes]()
    at = next(n)
    for part in parts:
        upper, at = at, at if isinstance(part, Scatterers) else next(n)
        makes = {Scatterers: _medium, Smooth: _smooth, Rough: _rough}[type(part)]
        makers.append(makes(part, grid, upper, at, tolerance))
    return makers


def _medium(part: Any, grid: NodeGrid, upper: complex, at: complex, tolerance: float) -> _Makes:
    medium = _real(part)
    none = nothing(grid.count(at), through=0.0)

    def makes(orders: range) -> _LayerMatrices:
        whole, through, once = media.slab(grid, at, medium, orders, terms(part, tolerance))
        straight = np.diag(through)[None]
        return _LayerMatrices(whole, Matrices(none.above, straight, straight, none.below), through, once)

    return makes


def _smooth(part: Any, grid: NodeGrid, upper: complex, at: complex, tolerance: float) -> _Makes:
    a, b = grid.count(upper), grid.count(at)
    whole = interfaces.smooth_matrices(grid, upper, at)
    straight = 1.0 - interfaces.smooth(grid, upper, at)[0][: min(a, b)]
    layer = _LayerMatrices(whole, whole, straight, nothing(a, b, through=0.0), smooth=True)
    return lambda orders: layer


def _rough(part: Any, grid: NodeGrid, upper: complex, at: complex, tolerance: float) -> _Makes:
    a, b = grid.count(upper), grid.count(at)
    makes = interfaces.rough(grid, upper, at, part.alpha if part.alpha.imag else part.alpha.real, part.kept)
    none = nothing(a, b, through=0.0)

    def layer(orders: range) -> _LayerMatrices:
        whole, once = makes(orders)
        return _LayerMatrices(whole, none, np.zeros(min(a, b)), once)

    return layer


def nothing(above: int, below: int | None = None, through: float = 1.0) -> Matrices:
    """What reflects nothing, of so many nodes above and below."""
    below = above if below is None else below
    return Matrices(
        np.zeros((1, above, above)),
        through * np.eye(below, above)[None],
        through * np.eye(above, below)[None],
        np.zeros((1, below, below)),
    )


def _once(layer: _LayerMatrices, under: Matrices, straight: np.ndarray) -> Matrices:
    """What is scattered once, in a layer or in those under it, and passes the others straight; `straight`: what passes
    those under it."""
    a, b = layer.once.above.shape[-1], under.below.shape[-1]
    above = layer.once.above + _passed(layer.straight, under.above, layer.straight, (a, a))
    below = under.below + _passed(straight, layer.once.below, straight, (b, b))
    down = _passed(None, under.down, layer.straight, (b, a)) + _passed(straight, layer.once.down, None, (b, a))
    return Matrices(above, down, np.swapaxes(down, -1, -2), below)


def _passed(rows: Any, x: np.ndarray, columns: Any, shape: tuple[int, int]) -> np.ndarray:
    """Matrices times what passes before and after, over more nodes; None is 1."""
    rows = np.ones(shape[0]) if rows is None else rows
    columns = np.ones(shape[1]) if columns is None else columns
    i, j = min(len(rows), x.shape[-2]), min(len(columns), x.shape[-1])
    x = np.outer(rows[:i], columns[:j]) * x[:, :i, :j]
    return np.pad(x, ((0, 0), (0, shape[0] - i), (0, shape[1] - j)))
