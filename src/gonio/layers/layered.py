"""What stacks and their lobes share: the layers, their response, its tables, and the lobes that look these up."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import cache, partial
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..arrays import Fixed, ops
from ..base.reflectance import Reflectance
from ..base.sides import choose
from ..caches import physical
from ..errors import TooLargeError
from ..formula.direction import HORIZON, Direction, select
from ..formula.fresnel.dielectric import fresnel_dielectric
from ..formula.mueller import Mueller
from ..formula.state import inferred, state
from ..formula.table_warp import MarginalWarp, Slices, tables_when_needed
from ..numerics.quadrature import Integrals
from ..tables.drawing import KINDS, VIEWS, Drawn, lobe_tables
from . import polarized
from .base import STEP, reflected
from .grid import SAME
from .layer import Layer, Medium, RoughInterface
from .response import Part, Response, Rough, Scatterers, Smooth, response
from .shared import Each, Shared, shared
from .table import FAR, Tables, albedos, shape_for, tabulated

TABLES = ("splines", "shape")


L = TypeVar("L", bound="_Layered")


class _Layered(Reflectance):
    """Base of stacks and of their lobes."""

    breaks: ClassVar[dict[str, str]] = {
        "positivity": "a Fourier series that ends somewhere rings about 0",
    }
    costs = 20

    tolerance: float = state(1e-3)
    paths: tuple[str, ...] = state(())
    """Parameters by which the tables hold slopes, too."""
    behind: Any = state(False)
    """Whether the layers are seen from below, of lobes."""
    bends: bool = state(True)
    """Whether light in front, or behind, can be reflected totally: tables then have panels."""

    base: Any  # fields, of each stack its own
    channel: Any
    splines: Any  # tables, of bound materials only
    shape: Any

    @inferred
    def channel_names(self) -> tuple[Any, ...] | None:
        """Those of the base."""
        base = self.__dict__.get("base")
        return None if base is None else base.channel_names

    @property
    def layers(self) -> tuple[Layer, ...]:
        """The layers, from the top down.

        Example
        >>> print(gn.Stack([gn.Interface(1.5)], gn.Lambertian(0.5)).layers)
        (Interface(eta=1.5),)
        """
        return tuple(self.__dict__[name] for name in self.fields if name not in ("base", "channel", "weight"))

    @property
    def sides(self) -> str:
        """ "front" upon a base, "both" upon nothing.

        Example
        >>> print(gn.Stack([gn.Medium(1.0)]).sides)
        both
        """
        return "front" if "base" in self.fields else "both"

    @property
    def index(self) -> Any:
        if "base" in self.fields:
            return 1.0
        last = self._indices()[-1]
        return 1.0 / last if self.behind else last

    @property
    def kinks(self) -> list[float]:
        return self._kinks(self.behind)

    def _kinks(self, behind: bool) -> list[float]:
        """Sines of the angles in front, or behind, at which total reflection sets in."""
        indices = self._indices()
        here = np.asarray(indices[-1 if behind else 0])
        return sorted({float(x) for n in indices for x in np.ravel(n / here) if x < 1.0 - SAME})

    def _indices(self) -> list[Any]:
        """The index of each medium, from that in front on, over that in front."""
        found: list[Any] = [1.0]
        for layer in self.layers:
            if not isinstance(layer, Medium):
                found.append(found[-1] * layer.__dict__["eta"])
        return found

    def _seen(self) -> tuple[Layer, ...]:
        """The layers, from the side of the viewer on."""
        if not self.behind:
            return self.layers
        return tuple(
            layer if isinstance(layer, Medium) else layer._changed({"eta": 1.0 / layer.__dict__["eta"]})
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
        bare = super()._keep()
        built = cache(self._built)
        tables = {name: Fixed(partial(lambda k: built()[k], k)) for k, name in enumerate(TABLES)}

        def drawn() -> np.ndarray:
            ways = (self.behind,) if self.sides == "front" else (False, True)
            rests = [self._as(_Rest, _kept=bare | tables, behind=behind) for behind in ways]
            return np.concatenate([lobe_tables(rest, False) for rest in rests], axis=1)

        return {**bare, **tables, **tables_when_needed(KINDS, drawn)}

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
        known: dict[Any, Response] = self._derived.setdefault(_Layered._response, {})
        if (channel, path) not in known:
            known[channel, path] = self._computed(channel, path)
        return known[channel, path]

    def _computed(self, channel: int, path: str | None) -> Response:

        def number(layer: Layer, at: int, name: str) -> complex:
            values = np.atleast_1d(np.asarray(layer.__dict__[name], float))
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
        if "base" not in self.fields:
            return response(parts, None, self.tolerance)
        m = self.__dict__["base"]
        by = path.removeprefix("base.") if path is not None and path.startswith("base.") else None

        def base(grid: Any, n: complex) -> tuple[Callable[[range], np.ndarray], np.ndarray]:
            matrices, mirror = reflected(m, grid, n, by)

            def of_channel(orders: range) -> np.ndarray:
                found = matrices(orders)
                of: np.ndarray = found[channel % len(found)]
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
        known, goal = self._derived.setdefault(_Lobe._collected, {}), 4.0 ** math.floor(math.log(goal, 4.0))
        if (incident, goal) not in known:
            across = self.sides == "across" and incident  # then light is on the other side
            known[incident, goal] = shared(self._kinks(self.behind != across), goal, each)
        found: Shared | None = known[incident, goal]
        return None if found is None else found.at(w)

    def passage(self, w: Direction) -> list[tuple[Any, Direction, Any]]:
        """For each layer that light along w gets straight to, and for the base if it does: the share that gets there,
        the direction, and the index."""
        passed, n, to, s2 = 1.0, 1.0, w, w.x * w.x + w.y * w.y
        found = [(passed, to, n)]
        for layer in self._seen():
            if isinstance(layer, RoughInterface):
                break
            if isinstance(layer, Medium):
                passed = passed * ops.exp(-layer.depth / to.z)
            else:
                reflectance = fresnel_dielectric(to.z, layer.__dict__["eta"])
                n = n * layer.__dict__["eta"]
                z2 = 1.0 - s2 / (n * n)
                inside = z2 > 1e-12
                to = Direction(w.x / n, w.y / n, ops.sqrt(ops.where(inside, z2, 1.0)))
                passed = ops.where(inside, passed * (1.0 - reflectance), 0.0)
            found.append((passed, to, n))
        return found

    def crossed(self, w: Direction) -> list[Mueller]:
        """For each place of `passage`, what the interfaces before it do to s and p, over the share that passes."""
        return polarized.crossed(self._seen(), self.passage(w))


def upward(w: Direction) -> Direction:
    """A direction behind, mirrored at the surface."""
    return Direction(w.x, w.y, -w.z)


def turned_over(behind: Any, back: Any) -> Any:
    """Whether layers are seen from below that were so, or not, before they are turned over where `back`: numbers 0
    and 1 for a symbol."""
    if isinstance(back, bool):
        return behind if not back else not behind if isinstance(behind, bool) else 1.0 - behind
    return choose(back, 1.0 - behind, 1.0 * behind)


class _Table(_Lobe):
    """A lobe from tables. `behind` may be a symbol here: one look-up serves both sides."""

    def found(self, block: Any, wi: Direction, n_i: Any, wo: Direction, n_o: Any) -> Any:
        """f/n_o^2 of a block of the response, for light in media of these indices."""
        zero, indices, many = ops.to_index(0.0 * wi.z), self._indices(), 1 if "base" in self.fields else 3

        def noted(at: Any) -> Any:
            return ops.take(self.shape, zero + ops.to_index(at))

        cells, turns, count = (noted(k) for k in range(3))
        first, *reach = (noted(3.0 * block + (3.0 + k)) for k in range(3))
        ends: list[Any] = []
        several = reach[0] * reach[1]
        if self.bends or (self.paths and many > 1):  # where indices move light behind moves to other panels
            for k in range(len(indices)):
                medium, end = noted((3.0 + 3.0 * many + k) + self.channel * float(len(indices))), FAR
                for number, n in enumerate(indices):
                    end = ops.where(ops.absolute(medium - float(number)) < 0.5, n, end)
                ends.append(end)
        else:
            ends, several = [1.0], 1.0
        tables = Tables(self.splines, 0.0, (reach[0], reach[1]), cells, turns, ends)
        values = 3.0 + 3.0 * many + count * float(len(indices))

        def looked_up(number: int) -> Any:
            at = first + (count * float(number) + self.channel) * several
            return tables._replace(first=at).at(wi, n_i, wo, n_o)

        total = looked_up(0)
        for number, path in enumerate(self.paths):
            # The value is 0; its derivative is the slope.
            value: Any = self
            for name in path.split("."):
                value = value.__dict__[name]
            away = value - noted(values + (count * float(number) + self.channel))
            total = total + away * looked_up(1 + number)
        return total

    def _collected_by(self, number: int, w: np.ndarray, by_rows: bool) -> Integrals:
        """What a block of the response sends of light from directions (n, 3), (n, C)."""
        responses = [self._response(c) for c in range(self.channels or 1)]
        z, up = np.clip(w[:, 2], 0.0, 1.0), w[:, 2:] > HORIZON
        found = np.stack([albedos(r.grid, r.blocks[number], z, by_rows) for r in responses], axis=-1)
        value = np.where(np.isnan(w).any(axis=-1, keepdims=True), np.nan, np.where(up, found, 0.0))
        return Integrals(value, np.zeros(len(w)), np.zeros(len(w)))

    def crossed_first(self, w: Direction, behind: Any) -> Mueller:
        """What the smooth interfaces on top do to s and p, or where `behind` those at the bottom."""
        front, back = (
            polarized.crossed_first(lobe._seen(), lobe.passage(w))
            for lobe in (self._as(_Rest, behind=side) for side in (False, True))
        )
        if isinstance(behind, bool):
            return back if behind else front
        return back.where(behind > 0.5) + front.where(behind <= 0.5)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        into, out = self.crossed_first(wi, self.behind), self.crossed_first(wo, self.behind)
        return polarized.scattered(into, out, self.formula(wi, wo))

    def over(self) -> Any:
        """n_o^2, over that in front."""
        n = self._indices()[-1]
        return choose(self.behind, n * n, 1.0)


class _Rest(Drawn, _Table):
    """All other light that a stack reflects, from the side of the viewer."""

    def is_oriented(self) -> bool:
        return False

    def _keep(self) -> dict[str, Fixed]:
        return self._looked_up()

    def formula(self, wi: Direction, wo: Direction) -> Any:
        if "base" in self.fields:
            return self.found(0.0, wi, 1.0, wo, 1.0)
        n = choose(self.behind, self._indices()[-1], 1.0)
        return self.found(choose(self.behind, 1.0, 0.0), wi, n, wo, n) * self.over()

    def _collected(self, w: np.ndarray, incident: bool, goal: float, each: Any) -> Integrals:
        return self._collected_by(int(self.behind), w, True)

    def _seen_from(self, wo: Direction) -> tuple[Slices, Any]:
        at, phi = super()._seen_from(wo)
        if "base" in self.fields:
            return at, phi
        first = ops.to_index(choose(self.behind, float(VIEWS), 0.0) + 0.0 * wo.z)
        return tuple((number + first, weight) for number, weight in at), phi

    @property
    def _lobe(self) -> MarginalWarp:
        return super()._lobe if "base" in self.fields else super()._lobe._replace(number=2 * VIEWS)


class _Through(_Table):
    """All other light that goes through a stack."""

    @property
    def sides(self) -> str:
        return "across"

    def turned(self, back: Any) -> Reflectance:
        return self._as(_Through, behind=turned_over(self.behind, back))

    def formula(self, wi: Direction, wo: Direction) -> Any:
        if isinstance(self.behind, bool):
            front, below = (wi, wo) if self.behind else (wo, wi)
        else:
            behind = self.behind > 0.5
            front, below = select(behind, wi, wo), select(behind, wo, wi)
        return self.found(2.0, front, 1.0, below, self._indices()[-1]) * self.over()

    def _collected(self, w: np.ndarray, incident: bool, goal: float, each: Any) -> Integrals:
        # Light that comes from in front is seen from behind.
        found = self._collected_by(2, w, bool(self.behind) == incident)
        if incident:
            return found
        index = np.atleast_1d(self._indices()[-1])
        return found._replace(value=found.value * (index * index if self.behind else 1.0 / (index * index)))

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        into = self.crossed_first(upward(wi), turned_over(self.behind, True))
        return polarized.scattered(into, self.crossed_first(wo, self.behind), self.formula(wi, wo))
