"""The lobes of a stack that are looked up in tables: light that is scattered more than once, or by what is rough."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Fixed, ops
from ..base.reflectance import Reflectance
from ..base.sides import choose
from ..formula.direction import HORIZON, Direction, select
from ..formula.mueller import Mueller
from ..formula.table_warp import MarginalWarp, Slices
from ..numerics.quadrature import Integrals
from ..tables.drawing import VIEWS, Drawn
from . import polarized
from .layered import _Lobe, upward
from .table import FAR, Tables, albedos


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
        zero, indices, many = ops.to_index(0.0 * wi.z), self._indices(), 1 if self.base is not None else 3

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
                value = getattr(value, name)
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


class _Rest(Drawn, _Table, oriented=False):
    """All other light that a stack reflects, from the side of the viewer."""

    def _keep(self) -> dict[str, Fixed]:
        return self._looked_up()

    def formula(self, wi: Direction, wo: Direction) -> Any:
        if self.base is not None:
            return self.found(0.0, wi, 1.0, wo, 1.0)
        n = choose(self.behind, self._indices()[-1], 1.0)
        return self.found(choose(self.behind, 1.0, 0.0), wi, n, wo, n) * self.over()

    def _collected(self, w: np.ndarray, incident: bool, goal: float, each: Any) -> Integrals:
        return self._collected_by(int(self.behind), w, True)

    def _seen_from(self, wo: Direction) -> tuple[Slices, Any]:
        at, phi = super()._seen_from(wo)
        if self.base is not None:
            return at, phi
        first = ops.to_index(choose(self.behind, float(VIEWS), 0.0) + 0.0 * wo.z)
        return tuple((number + first, weight) for number, weight in at), phi

    @property
    def _lobe(self) -> MarginalWarp:
        return super()._lobe if self.base is not None else super()._lobe._replace(number=2 * VIEWS)


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
