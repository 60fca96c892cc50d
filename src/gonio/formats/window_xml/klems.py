"""Matrices of a BSDF over patches of two hemispheres, as WINDOW and Radiance use them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from ...arrays import Fixed, ops
from ...errors import ParameterError
from ...formula.direction import Direction, on_circle
from ...formula.fields import Ours, kept, table
from ...formula.state import state
from ...formula.table_warp import bracket
from ...tables.angle_systems import azimuth_of
from . import _cell_tables
from ._cell_tables import MIRRORED, Cellwise

if TYPE_CHECKING:
    import xarray


class AngleBasis(NamedTuple):
    """Patches of a hemisphere: rings between polar angles, each cut into equal azimuths, the first centred at 0.

    edges   polar angles where rings begin and end [degree], from 0 to 90
    counts  number of azimuths of each ring
    """

    name: str
    edges: tuple[float, ...]
    counts: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number of patches."""
        return sum(self.counts)

    @property
    def sines(self) -> np.ndarray:
        """sin^2 of the polar angles `edges`."""
        return np.sin(np.radians(self.edges)) ** 2

    @property
    def solid_angles(self) -> np.ndarray:
        """Projected solid angle of each patch [sr]; pi in all."""
        return np.repeat(math.pi * np.diff(self.sines) / self.counts, self.counts)

    @property
    def patches(self) -> np.ndarray:
        """(size, 4): start and width in sin^2(theta), start and width in phi/(2 pi)."""
        sines, rows = self.sines, []
        for low, high, count in zip(sines, sines[1:], self.counts, strict=False):
            rows += [(low, high - low, (k - 0.5) / count, 1.0 / count) for k in range(count)]
        return np.array(rows)

    @property
    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """theta, the middle of its edges (0 for a cap), and phi of the patches [rad]."""
        middles = [0.5 * (a + b) for a, b in zip(self.edges, self.edges[1:], strict=False)]
        if self.counts[0] == 1:
            middles[0] = 0.0
        phi = [2.0 * math.pi * k / count for count in self.counts for k in range(count)]
        return np.radians(np.repeat(middles, self.counts)), np.array(phi)

    def problem(self) -> str:
        """The rule that it breaks, or ""."""
        edges, counts = self.edges, self.counts
        if not counts or len(edges) != len(counts) + 1 or min(counts) < 1:
            return f"{len(edges)} edges and numbers of azimuths {counts}; expected positive ones, one per ring"
        if not np.isfinite(edges).all() or edges[0] or abs(edges[-1] - 90.0) > 1e-3 or min(np.diff(edges)) <= 0.0:
            return f"edges {edges}; expected them to increase from 0 to 90 degrees"
        return ""


FULL = AngleBasis("LBNL/Klems Full", (0, 5, 15, 25, 35, 45, 55, 65, 75, 90), (1, 8, 16, 20, 24, 24, 24, 16, 12))
HALF = AngleBasis("LBNL/Klems Half", (0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5, 90), (1, 8, 12, 16, 20, 12, 8))
QUARTER = AngleBasis("LBNL/Klems Quarter", (0, 9, 27, 45, 63, 90), (1, 8, 12, 12, 8))
HALF_2021 = AngleBasis("LBNL/Klems Half", (0, 6.5, 19.5, 32.5, 46.5, 61.5, 76.5, 90), (1, 8, 12, 16, 20, 12, 4))

KNOWN = (FULL, HALF, QUARTER, HALF_2021)
"""Bases that a file may name without a definition: those of Radiance since July 2022; the last one before."""


class Klems(Cellwise):
    """Matrix of f over patches of incident and outgoing directions, from WINDOW's or Radiance's XML.

    f(wi, wo) = values[patch of wo, patch of wi]: constant within patches, with jumps between them. Values are kept as
    they are in the file, negative ones too (Radiance takes them for 0), f is NaN where they are not finite.

    In the file the azimuth of an incident direction is that of -wi, so that the mirror direction, and straight
    transmission, are the diagonal. x and y are the same seen from both sides, as in Radiance: f of the front, WINDOW's
    and so Radiance's back, is that of the sample turned about its y axis.

    Sampling draws a patch of wi as the column's values say, seen from the patch of wo, and a direction in it uniformly
    in projected solid angle; a share of 0.1 of all samples is cosine-distributed, so weights are at most 10 pi f.

    Shapes   values: (patches of wo, patches of wi) or (..., C). f: (...) or (..., C).
    Units    f, values: 1/sr.
    Error    none of its own; against Radiance (pyradiance 1.3.1): f 3e-4 relative, which Radiance adds on purpose to
             each patch, hemispherical totals 1e-7; X and Z to 6 %, for it keeps colours in 8 bits.
    Source   Klems 1994, "A new method for predicting the solar heat gain of complex fenestration systems", ASHRAE
             Transactions 100(1):1065; Radiance's bsdf_m.c, read for the conventions.
    """

    breaks: ClassVar[dict[str, str]] = {
        **Cellwise.breaks,
        "reciprocity": "every column of the matrix is measured or computed on its own",
        "isotropy": "patches have edges, which do not turn with the directions",
    }

    values = table("f by patch of wo, patch of wi and channel [1/sr]")

    incident: AngleBasis = state()
    outgoing: AngleBasis = state()
    width: int = state()
    cells: Any  # tables of formulas, of bound materials only
    edges_i: Any
    rings_i: Any
    patches_i: Any
    edges_o: Any
    rings_o: Any

    def __init__(
        self,
        values: Any,
        *bases: AngleBasis,
        side: str = "front",
        channel_names: Sequence[str | float] | None = None,
        **notes: Any,
    ):
        """`bases`: of incident and of outgoing directions, or one for both; `notes`: path and about."""
        incident, outgoing = (bases or (FULL,))[0], (bases or (FULL,))[-1]
        values = np.ascontiguousarray(kept(values), dtype=np.float64)
        names = tuple(channel_names) if channel_names is not None else None
        width = values.shape[2] if values.ndim == 3 else 1
        self._hold(incident=incident, outgoing=outgoing, width=width, channel_names=names)
        channel = values.shape[2] if values.ndim == 3 else 0.0
        super().__init__(side, values=Ours(values), channel=channel, **notes)

    def validate(self) -> None:
        for basis in (self.incident, self.outgoing):
            if basis.problem():
                raise ParameterError(f"Klems: angle basis {basis.name!r}: {basis.problem()}")
        size = (self.outgoing.size, self.incident.size)
        if self.values.shape[:2] != size or self.values.ndim > 3 or 0 in self.values.shape:
            raise ParameterError(f"Klems(values): got shape {self.values.shape}, expected {size} or {(*size, 'C')}")
        super().validate()
        names, width = self.channel_names, self.values.shape[2:]
        if names is not None and (len(names),) != width:
            raise ParameterError(f"Klems(channel_names={names!r:.80}): expected one per channel of values, {width}")

    @property
    def data(self) -> xarray.Dataset:
        """Variable `values`, by the patches of both bases, with their centres [rad] and projected solid angles [sr]."""
        import xarray

        coordinates: dict[str, Any] = {}
        for axis, basis in (("outgoing", self.outgoing), ("incident", self.incident)):
            theta, phi = basis.centres
            numbers = {"theta": (theta, "rad"), "phi": (phi, "rad"), "omega": (basis.solid_angles, "sr")}
            coordinates |= {f"{name}_{axis}": (axis, x, {"units": unit}) for name, (x, unit) in numbers.items()}
        if self.channel_names is not None:
            coordinates["channel"] = ("channel", list(self.channel_names))
        dims = ("outgoing", "incident", "channel")[: self.values.ndim]
        variables = {"values": (dims, self.values, {"units": "sr-1", "long_name": f"BRDF, {self.side}"})}
        return xarray.Dataset(variables, coordinates, {"quantity": self.quantity, "source": self.path})

    def hemispherical_totals(self) -> np.ndarray:
        """Directional-hemispherical reflectance of each incident patch: sum of f over wo, times projected solid angle.

        Shapes   (patches of wi) or (patches of wi, C), in the file's order.
        """
        return np.tensordot(self.outgoing.solid_angles, self.values, axes=(0, 0))

    def rough_albedo(self) -> float:
        return float(np.nanmax(self.hemispherical_totals(), initial=0.0))

    def _keep(self) -> dict[str, Fixed]:
        kept, values = super()._keep(), self.values
        del kept["values"]
        solid = self.incident.solid_angles

        def weights() -> np.ndarray:
            return _cell_tables.magnitude(values).reshape(*values.shape[:2], -1).mean(axis=2) * solid

        kept["cells"] = Fixed(lambda: _cell_tables.with_holes(values).reshape(-1))
        kept.update(_cell_tables.sampling(weights, solid))
        kept["patches_i"] = Fixed(lambda: self.incident.patches.reshape(-1))
        for which, basis in (("i", self.incident), ("o", self.outgoing)):
            starts = np.concatenate([[0], np.cumsum(basis.counts)[:-1]])
            kept[f"edges_{which}"] = Fixed(basis.sines)
            kept[f"rings_{which}"] = Fixed(np.stack([starts, basis.counts], -1).astype(float).reshape(-1))
        return kept

    def formula(self, wi: Direction, wo: Direction) -> Any:
        entry = self._row(wo) + self._incident_patch(wi)
        return ops.take(self.cells, entry * self.width + ops.to_index(self.channel))

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        patch, left = _cell_tables.choose(self.sums, self._row(wo), self.incident.size, u0)
        low, high, turn, width = (ops.take(self.patches_i, patch * 4 + k) for k in range(4))
        sin2 = low + u1 * high
        s, z = ops.sqrt(ops.maximum(sin2, 1e-20)), ops.sqrt(ops.maximum(1.0 - sin2, 1e-20))
        w = on_circle(-s, turn + left * width, z)
        return Direction(MIRRORED[self.side] * w.x, w.y, z)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return ops.take(self.densities, self._row(wo) + self._incident_patch(wi)) * wi.z

    def estimate(self, wo: Direction) -> Any:
        return ops.take(self.reflected, self._outgoing_patch(wo))

    def _row(self, wo: Direction) -> Any:
        """Where the values of an outgoing patch begin, in patches."""
        return self._outgoing_patch(wo) * self.incident.size

    def _outgoing_patch(self, wo: Direction) -> Any:
        return _patch(self.outgoing, self.edges_o, self.rings_o, MIRRORED[self.side] * wo.x, wo.y)

    def _incident_patch(self, wi: Direction) -> Any:
        return _patch(self.incident, self.edges_i, self.rings_i, -MIRRORED[self.side] * wi.x, -wi.y)


def _patch(basis: AngleBasis, edges: Any, rings: Any, x: Any, y: Any) -> Any:
    """Number of the patch of a direction, by its x and y in the file."""
    (ring, _), _ = bracket(edges, len(basis.edges), x * x + y * y)
    start, count = ops.take(rings, 2 * ring), ops.take(rings, 2 * ring + 1)
    k = ops.floor(azimuth_of(Direction(x, y, 0.0)) * (0.5 / math.pi) * count + 0.5)
    k = ops.where(k < 0.0, k + count, ops.where(k >= count, k - count, k))
    return ops.to_index(start + k)
