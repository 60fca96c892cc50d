"""What stacks and their lobes share: the layers, their response and its tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import cache, partial
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..arrays import Fixed, ops
from ..base.reflectance import Reflectance
from ..base.results import Hints
from ..errors import TooLargeError
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import channels as channel_field
from ..formula.fresnel.dielectric import fresnel_dielectric
from ..formula.mueller import Mueller
from ..formula.state import inferred, state
from ..machine.caches import physical
from ..numerics.quadrature import Integrals
from . import polarized
from .base import STEP, reflected
from .grid import SAME
from .layer import AnyLayer, Medium, RoughInterface
from .response import Part, Response, Rough, Scatterers, Smooth, response
from .shared import Each, Shared, shared
from .table import shape_for, tabulated

TABLES = ("splines", "shape")


L = TypeVar("L", bound="_Layered")


class _Layered(Reflectance, costs=20):
    """Base of stacks and of their lobes."""

    breaks: ClassVar[dict[str, str]] = {
        "positivity": "a Fourier series that ends somewhere rings about 0",
    }

    tolerance: float = state(1e-3)
    paths: tuple[str, ...] = state(())
    """Parameters by which the tables hold slopes, too."""
    behind: Any = state(False)
    """Whether the layers are seen from below, of lobes."""
    bends: bool = state(True)
    """Whether light in front, or behind, can be reflected totally: tables then have panels."""

    base: Reflectance | None = None
    """What lies under the layers, a field of stacks that have one."""
    channel = channel_field("number of the channel")
    splines: Any  # tables, of bound materials only
    shape: Any

    @inferred
    def channel_names(self) -> tuple[Any, ...] | None:
        """Those of the base."""
        return None if self.base is None else self.base.channel_names

    @property
    def layers(self) -> tuple[AnyLayer, ...]:
        """The layers, from the top down.

        Example
        >>> print(gn.Stack([gn.Interface(1.5)], gn.Lambertian(0.5)).layers)
        (Interface(eta=1.5),)
        """
        return tuple(part for part in tree.components(self) if isinstance(part, AnyLayer))

    @property
    def sides(self) -> str:
        """ "front" upon a base, "both" upon nothing.

        Example
        >>> print(gn.Stack([gn.Medium(1.0)]).sides)
        both
        """
        return "both" if self.base is None else "front"

    @property
    def index(self) -> Any:
        if self.base is not None:
            return 1.0
        last = self._indices()[-1]
        return 1.0 / last if self.behind else last

    @property
    def hints(self) -> Hints:
        return Hints(kinks=tuple(self._kinks(self.behind)))

    def _kinks(self, behind: bool) -> list[float]:
        """Sines of the angles in front, or behind, at which total reflection sets in."""
        indices = self._indices()
        here = np.asarray(indices[-1 if behind else 0])
        return sorted({float(x) for n in indices for x in np.ravel(n / here) if x < 1.0 - SAME})

    def _indices(self) -> list[Any]:
        """The index of each medium, from that in front on, over that in front."""
        indices: list[Any] = [1.0]
        for layer in self.layers:
            if not isinstance(layer, Medium):
                indices.append(indices[-1] * layer.eta)
        return indices

    def _seen(self) -> tuple[AnyLayer, ...]:
        """The layers, from the side of the viewer on."""
        if not self.behind:
            return self.layers
        return tuple(
            layer if isinstance(layer, Medium) else layer._changed({"eta": 1.0 / layer.eta})
            for layer in reversed(self.layers)
        )

    def _as(self, kind: type[L], **changes: Any) -> L:
        """A lobe of this stack, bound where this is."""
        return kind._made_of(self.__dict__, {"_derived": self._responses(), "_alike": {}}, changes)

    def _responses(self) -> dict[Any, Any]:
        """The responses, as derived values of a copy of other slopes, or of a lobe."""
        return {_Layered._response: self._derived.setdefault(_Layered._response, {})}

    # Tables.

    def _keep(self) -> dict[str, Fixed]:
        built = cache(self._built)
        return super()._keep() | {name: Fixed(partial(lambda k: built()[k], k)) for k, name in enumerate(TABLES)}

    def _built(self) -> tuple[np.ndarray, np.ndarray]:
        """Splines, of all channels one after the other, then those of slopes, and so on for each block of the response;
        and what `_Table.found` must know of them."""
        count = self.channels or 1
        responses = [self._response(c) for c in range(count)]
        cells, turns = shape_for(responses, self.tolerance)
        blocks: list[tuple[int, int, int]] = []
        first = 0
        for of_block in zip(*(r.blocks for r in responses), strict=True):
            ends = [
                (len(r.grid.parts(b.rows)), len(r.grid.parts(b.columns)))
                for r, b in zip(responses, of_block, strict=True)
            ]
            rows, columns = (max(x) for x in zip(*ends, strict=True))
            blocks.append((first, rows, columns))
            first += count * (1 + len(self.paths)) * rows * columns
        size = 8 * first * (cells + 3) ** 2 * (turns + 3)
        if size > physical():
            raise TooLargeError(
                f"Stack: {first} tables of {(turns - 6) // 2} orders take {size / 1e9:.1f} GB and this machine has "
                f"{physical() / 1e9:.1f} GB; take a larger tolerance, or fewer channels at a time"
            )
        splines = np.empty((first, cells + 3, cells + 3, turns + 3))
        for number, (at, rows, columns) in enumerate(blocks):
            for path in (None, *self.paths):
                for c in range(count):
                    r = self._response(c, path)
                    table = tabulated(r.grid, r.blocks[number], (rows, columns), cells, turns)
                    part = table.real if path is None else table.imag / STEP
                    splines[at : at + rows * columns] = part.reshape(-1, *splines.shape[1:])
                    at += rows * columns
        media = np.full((count, len(self._indices())), -1)
        for c, r in enumerate(responses):
            media[c, : len(r.media)] = r.media
        values = [np.broadcast_to(self.parameters[path].value, (count,)) for path in self.paths]
        shape = np.concatenate([[cells, turns, count], np.ravel(blocks), media.reshape(-1), *values])
        return splines.reshape(-1), shape

    def _response(self, channel: int, path: str | None = None) -> Response:
        """The response in a channel; complex, with a step of a parameter."""
        responses: dict[Any, Response] = self._derived.setdefault(_Layered._response, {})
        if (channel, path) not in responses:
            responses[channel, path] = self._computed(channel, path)
        return responses[channel, path]

    def _computed(self, channel: int, path: str | None) -> Response:

        def number(layer: AnyLayer, at: int, name: str) -> complex:
            values = np.atleast_1d(np.asarray(getattr(layer, name), float))
            return complex(values[channel % len(values)], STEP if path == f"{at}.{name}" else 0.0)

        parts: list[Part] = []
        for at, layer in enumerate(self.layers):
            if isinstance(layer, Medium):
                parts.append(Scatterers(*(number(layer, at, n) for n in ("depth", "albedo", "g"))))
            elif isinstance(layer, RoughInterface):
                eta, alpha = (number(layer, at, n) for n in ("eta", "alpha"))
                parts.append(Rough(eta, alpha, layer.further == "kept"))
            else:
                parts.append(Smooth(number(layer, at, "eta")))
        if (m := self.base) is None:
            return response(parts, None, self.tolerance)
        by = path.removeprefix("base.") if path is not None and path.startswith("base.") else None

        def base(grid: Any, n: complex) -> tuple[Callable[[range], np.ndarray], np.ndarray]:
            matrices, mirror = reflected(m, grid, n, by)

            def of_channel(orders: range) -> np.ndarray:
                stacked = matrices(orders)
                of: np.ndarray = stacked[channel % len(stacked)]
                return of

            return of_channel, mirror[channel % len(mirror)]

        return response(parts, base, self.tolerance)


class _Lobe(_Layered):
    """A lobe of a stack, with all that the stack is made of."""

    @property
    def sides(self) -> str:
        return "front"

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        yield 1.0, self

    def _collected(self, w: np.ndarray, incident: bool, goal: float, each: Each) -> Integrals | None:
        """Those between few, kept for goals of about this size."""
        pieces, goal = self._derived.setdefault(_Lobe._collected, {}), 4.0 ** math.floor(math.log(goal, 4.0))
        if (incident, goal) not in pieces:
            pieces[incident, goal] = shared(self._kinks(self._fixed_behind(incident)), goal, each)
        between: Shared | None = pieces[incident, goal]
        return None if between is None else between.at(w)

    def _fixed_behind(self, incident: bool) -> bool:
        """Whether a fixed direction, of the light or of the viewer, is behind."""
        return self.behind

    def passage(self, w: Direction) -> list[tuple[Any, Direction, Any]]:
        """For each layer that light along w gets straight to, and for the base if it does: the share that gets there,
        the direction, and the index."""
        passed, n, to, s2 = 1.0, 1.0, w, w.x * w.x + w.y * w.y
        reached = [(passed, to, n)]
        for layer in self._seen():
            if isinstance(layer, RoughInterface):
                break
            if isinstance(layer, Medium):
                passed = passed * ops.exp(-layer.depth / to.z)
            else:
                reflectance = fresnel_dielectric(to.z, layer.eta)
                n = n * layer.eta
                z2 = 1.0 - s2 / (n * n)
                inside = z2 > 1e-12
                to = Direction(w.x / n, w.y / n, ops.sqrt(ops.where(inside, z2, 1.0)))
                passed = ops.where(inside, passed * (1.0 - reflectance), 0.0)
            reached.append((passed, to, n))
        return reached

    def crossed(self, w: Direction) -> list[Mueller]:
        """For each place of `passage`, what the interfaces before it do to s and p, over the share that passes."""
        return polarized.crossed(self._seen(), self.passage(w))


def upward(w: Direction) -> Direction:
    """A direction behind, mirrored at the surface."""
    return Direction(w.x, w.y, -w.z)
