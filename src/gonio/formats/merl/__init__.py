"""MERL's `.binary`: isotropic RGB measurements on a grid of half and difference angles.

A file is three little-endian int32, the numbers of cells of theta_h, theta_d, phi_d (90, 90, 180; 360 in the
variant without reciprocity), then float64: planes R, G, B, each [theta_h][theta_d][phi_d] with phi_d fastest,
of f/`SCALE`; negative or not finite where there is no data. Checked against files written from this
description and against the length of the published ones, which may not be passed on.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from ...arrays import Fixed, Roomy, ops
from ...arrays.kinds import with_channels
from ...base.measured import Measured
from ...base.reflectance import Reflectance
from ...base.results import Hints
from ...declared.arguments import Declared
from ...errors import FormatError, ParameterError
from ...formula.direction import Direction, half_and_cosine, half_difference, on_circle, reflect, select
from ...formula.fields import Ours, channels, kept, option, table
from ...formula.state import state
from ...formula.warp import cosine_hemisphere, cosine_hemisphere_density
from ...pictures.colour import RELATIVE_XYZ, XYZ, rgb_of
from ...tables.gridded import Gridded
from ...tables.nodes import f_at
from .._layout import CHANNEL, FileAxis, Layout
from .._reading import large_tables
from .cells import ALBEDO, ROW, SCALE, SHAPES, N, bordered, centres, is_valid, rings

if TYPE_CHECKING:
    import xarray

NAME = "MERL"
SUFFIXES = (".binary",)
DESCRIPTION = "isotropic RGB on half and difference angles (Matusik et al. 2003)"
ORACLE = "own files from the published description; length and sha256 of the published files"

LAYOUT = Layout(
    "half_difference", {"plane": CHANNEL, **{name: FileAxis(name) for name in ("theta_h", "theta_d", "phi_d")}}
)
AXES = {"theta_h": "half angle", "theta_d": "difference angle", "phi_d": "azimuth of wi about the half vector"}
HEADER = 12


class MERL(Measured):
    """Measured BRDF of an isotropic material, f(theta_h, theta_d, phi_d), from a MERL file.

    Cell (i, j, k) is centred at theta_h = ((i + 1/2)^2/90), theta_d = (j + 1/2), phi_d = (k + 1/2) degrees.
    "trilinear" interpolates between centres, linearly in sqrt(theta_h), theta_d and phi_d; beyond the
    outermost centres theta_h and theta_d stay there, phi_d wraps with period pi (reciprocity), or 2 pi with
    360 cells. Corners without data are left out and the weights of the others renormalized; f is NaN where
    these hold less than 1/1000 of the weight, so also at the very centre of a cell without data. "nearest" is
    the value of the cell around the pair, NaN if it has none.

    Sampling: half vectors as this table has them in diffuse light, in 90 rings of theta_h, mixed with the
    cosine hemisphere, whose share is at least a tenth: weights stay below 10 pi f.

    Shapes   raw: (3, 90, 90, 180 or 360), as in the file. f: (..., 3), RGB as stored.
    Units    f: 1/sr; raw: f/`SCALE`.
    Error    of the grid, for 0.1/pi + 0.9 GGX written and read, both cosines above 0.2: trilinear 6e-4
             (median) to 6e-3 (largest) at alpha = 0.3, 2e-4 to 1.5e-2 at alpha = 0.05; nearest 9e-3 to 8e-2
             and 2e-3 to 0.22. Down to the horizon: trilinear 3 % and 6 % (99th percentiles), NaN for 2e-5 of
             the pairs. Rounding in float32: 8e-7 (99th percentile), 9e-6 (largest).
    Source   Matusik, Pfister, Brand & McMillan 2003, "A data-driven reflectance model", ACM TOG 22(3):759.
             Angles: Rusinkiewicz 1998, "A new change of variables for efficient BRDF representation".
    """

    interpolation = option("trilinear", "nearest", doc="between centres of cells, or the cell's own value")
    raw = table("the numbers of the file, (3, theta_h, theta_d, phi_d)")
    channel = channels("red, green, blue")

    format = NAME
    parameterization = "half_difference"
    cells: Any  # what formulas look up, of bound materials only
    rings: Any
    phi_cells: int = state()

    def __init__(
        self, raw: Any = None, interpolation: str = "trilinear", path: str = "", about: dict[str, Any] | None = None
    ):
        raw = np.empty(0) if raw is None else np.ascontiguousarray(kept(raw), dtype=np.float64)
        super().__init__(path, about, raw=Ours(raw), interpolation=interpolation, channel=len(SCALE))

    def validate(self) -> None:
        if self.raw.shape[:1] != (3,) or self.raw.shape[1:] not in SHAPES:
            raise ParameterError(
                f"MERL(raw): got shape {self.raw.shape}, expected (3, 90, 90, 180) or (3, 90, 90, 360); "
                f"read files with gonio.load"
            )
        self._hold(phi_cells=self.raw.shape[3])

    @property
    def valid(self) -> np.ndarray:
        """True where there is data; shape of `raw`."""
        return is_valid(self.raw)

    @property
    def axes(self) -> dict[str, np.ndarray]:
        """Centres of cells [rad] along each axis."""
        return dict(zip(AXES, centres(self.raw.shape[3]), strict=True))

    @property
    def published(self) -> str | None:
        """Name of the published material whose file this is, bit by bit ("alum-bronze"), or None."""
        digest = hashlib.sha256()
        for part in _tables(self.raw):
            digest.update(part.reshape(-1).view(np.uint8))
        return _published().get(digest.hexdigest())

    @property
    def data(self) -> xarray.Dataset:
        """Variables `raw` (channel, theta_h, theta_d, phi_d), as stored, and `scale`: f = raw * scale."""
        import xarray

        axes: dict[str, Any] = {"channel": ("channel", list("RGB"), {"long_name": "linear RGB as stored"})}
        for name, nodes in self.axes.items():
            axes[name] = (name, np.degrees(nodes), {"units": "degree", "long_name": f"{AXES[name]}, centres of cells"})
        raw = {"units": "1", "long_name": "stored number; negative or not finite: no data"}
        scale = {"units": "sr-1", "long_name": "BRDF per stored number"}
        variables = {"raw": (("channel", *AXES), self.raw, raw), "scale": ("channel", np.array(SCALE), scale)}
        return xarray.Dataset(variables, axes, self.attributes)

    def as_grid(self) -> Gridded:
        """f at the centres of cells, NaN where there is no data; between them trilinear f is the same, to 6e-15."""
        f = self.raw * np.reshape(SCALE, (3, 1, 1, 1))
        f[~self.valid] = np.nan
        periods = {"phi_d": math.radians(self.phi_cells)}
        interpolation = "linear" if self.interpolation == "trilinear" else "nearest"
        return Gridded(
            self.parameterization, self.axes, Ours(LAYOUT.table(f, False)), channels=tuple("RGB"), periods=periods,
            interpolation=interpolation, about={"made_of": repr(self), **self.about},
        )  # fmt: skip

    def _keep(self) -> dict[str, Fixed]:
        """The base's fields, with the tables of the formulas in place of `raw`; they are made when first needed."""
        fields, raw = super()._keep(), self.raw
        del fields["raw"]
        return {**fields, "cells": Roomy(lambda: bordered(raw)), "rings": Fixed(lambda: rings(raw))}

    def formula(self, wi: Direction, wo: Direction) -> Any:
        h, d, p = self._coordinates(wi, wo)
        if self.interpolation == "nearest":
            at_phi = ops.floor(p) + 1.0
            row = ops.to_index(ops.clip(h, 0.0, N - 1.0)) * N + ops.to_index(ops.clip(d, 0.0, N - 1.0))
            value = ops.take(self.cells, self._entry(row * (self.phi_cells + 2) + ops.to_index(at_phi)))
            return ops.where(value >= 0.0, value, math.nan)
        h, d, p = ops.clip(h - 0.5, 0.0, N - 1.0), ops.clip(d - 0.5, 0.0, N - 1.0), p - 0.5
        h0, d0, p0 = ops.minimum(ops.floor(h), N - 2.0), ops.minimum(ops.floor(d), N - 2.0), ops.floor(p)
        stride = self.phi_cells + 2
        corner = (ops.to_index(h0) * N + ops.to_index(d0)) * stride + ops.to_index(p0 + 1.0)
        first, second = self._entry(corner), self._entry(corner + 1)
        # Every channel has its own copy of the weights: arrays of one shape are combined several times faster than by
        # broadcasting.
        zeros = 0.0 * self.channel
        h, d, p = h - h0 + zeros, d - d0 + zeros, p - p0 + zeros
        total, weights = 0.0, 0.0
        for row, along_h in ((0, 1.0 - h), (N, h)):
            for step, along_d in ((row, 1.0 - d), (row + 1, d)):
                for entry, along_p in ((first, 1.0 - p), (second, p)):
                    value = ops.take(self.cells, entry + step * stride * len(SCALE))
                    weight = ops.where(value >= 0.0, along_h * along_d * along_p, 0.0)
                    total, weights = total + weight * value, weights + weight
        enough = weights > 1e-3
        return ops.where(enough, total / ops.where(enough, weights, 1.0), math.nan)

    def _coordinates(self, wi: Direction, wo: Direction) -> tuple[Any, Any, Any]:
        """Positions along theta_h, theta_d, phi_d in cells: cell i is between i and i + 1."""
        theta_h, theta_d, phi_d = half_difference(wi, wo)
        phi_d = ops.where(phi_d < 0.0, phi_d + self.phi_cells * (math.pi / 180.0), phi_d)
        return _ring(theta_h), theta_d * (2.0 * N / math.pi), phi_d * (180.0 / math.pi)

    def _entry(self, cell: Any) -> Any:
        return cell * len(SCALE) + ops.to_index(self.channel)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        choice = ops.to_index(0.0 * u0)
        for step in (64, 32, 16, 8, 4, 2, 1):
            choice = ops.where(ops.take(self.rings, choice + step) <= u0, choice + step, choice)
        (p0, v0, q0), (p1, v1, q1) = self._edge(choice), self._edge(choice + 1)
        u = ops.clip((u0 - p0) / (p1 - p0), 0.0, 1.0)
        r = u * (q0 + q1) / (q0 + ops.sqrt(q0 * q0 + u * (q1 - q0) * (q1 + q0)))
        v = v0 + r * (v1 - v0)
        by_ring = reflect(wo, on_circle(ops.sqrt(ops.maximum(v * (2.0 - v), 1e-20)), u1, 1.0 - v))
        spread = cosine_hemisphere(u, u1)
        return select(choice < N, by_ring, spread)

    def density(self, wi: Direction, wo: Direction) -> Any:
        wm, cos_d = half_and_cosine(wi, wo)
        sin2 = wm.x * wm.x + wm.y * wm.y
        ring = ops.to_index(ops.clip(_ring(ops.arctan2(ops.sqrt(sin2 + 1e-30), wm.z)), 0.0, N - 0.5))
        (p0, v0, q0), (p1, v1, q1) = self._edge(ring), self._edge(ring + 1)
        r = ops.clip((sin2 / (1.0 + wm.z) - v0) / (v1 - v0), 0.0, 1.0)
        by_ring = (p1 - p0) / (math.pi * (v1 - v0)) * (q0 + r * (q1 - q0)) / (q0 + q1)
        spread = 1.0 - ops.take(self.rings, 0 * ring + N)
        return by_ring / (4.0 * cos_d) + spread * cosine_hemisphere_density(wi)

    def _edge(self, ring: Any) -> tuple[Any, ...]:
        return tuple(ops.take(self.rings, ring + row * ROW) for row in range(3))

    @property
    def hints(self) -> Hints:  # `warp` changes there from the rings to the cosine hemisphere
        return Hints(seam=float(self._kept["rings"].numbers[N]))

    def estimate(self, wo: Direction) -> Any:
        return ops.take(self.rings, ops.to_index(0.0 * wo.z) + ALBEDO)


def _ring(theta_h: Any) -> Any:
    # The floor keeps the derivative finite at the pole; both interpolations are constant there.
    return N * ops.sqrt(ops.maximum(theta_h * (2.0 / math.pi), 1e-8))


def _tables(raw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Header and numbers of a file."""
    return np.array(raw.shape[1:], "<i4"), raw.astype("<f8", copy=False)


@cache
def _published() -> dict[str, str]:
    text = (resources.files("gonio") / "data" / "merl_sha256.tsv").read_text(encoding="utf-8")
    rows = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    return {digest: name.removesuffix(".binary") for name, digest in rows[1:]}


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these, or was meant to be: three small numbers first."""
    if len(head) < HEADER:
        return False
    *dims, following = np.frombuffer(head[:16].ljust(16, b"\xff"), "<i4").tolist()
    if tuple(dims) in SHAPES:
        return True
    # More than three small numbers start another format's header, unless the length is right for three.
    return all(0 < n <= 2048 for n in dims) and (size == _size(dims) or not 0 < following <= 2048)


def _size(dims: Sequence[int]) -> int:
    return HEADER + 8 * 3 * math.prod(dims)


def read(path: Path) -> MERL:
    """The material of a MERL file. Raises FormatError for another header or length."""
    with Path(path).open("rb") as file:
        head, size = file.read(HEADER), file.seek(0, os.SEEK_END)
        dims = tuple(np.frombuffer(head.ljust(HEADER, b"\0"), "<i4").tolist())
        cells = "×".join(map(str, dims))
        if dims not in SHAPES:
            raise FormatError(
                f"{path}: not a MERL file: header says {cells}, expected 90×90×180 or 90×90×360 cells of "
                f"theta_h, theta_d, phi_d; fetch it again, or resample it to these cells"
            )
        if size != _size(dims):
            fault = f"{'too long' if size > _size(dims) else 'cut short'}: {size} bytes, expected {_size(dims)}"
            raise FormatError(f"{path}: MERL file {fault} for {cells}; fetch it again")
        raw = large_tables.numbers(file, path, "<f8", (3, *dims), HEADER)
    return MERL(Ours(raw), path=str(path))


def write(
    m: Reflectance,
    path: Path,
    phi_d: Annotated[
        int,
        Declared("cells of phi_d; 360 keep both halves of a material without reciprocity", words=[180, 360]),
    ] = 180,
) -> None:
    """Write f at the centres of cells; a MERL is written as it was read, bit by bit.

    One channel becomes gray; X, Y, Z become linear sRGB. -1 stands for pairs below the horizon, and for values that are
    negative, NaN or infinite. Raises ParameterError for anisotropic materials, delta lobes, channels other than one or
    colours, and maps.

    Example
    >>> gn.save(gn.material("brass"), "brass.binary")
    >>> wi, wo = gn.direction(0.5, 0.0), gn.direction(0.6, 3.0)
    >>> print(gn.material("brass").f(wi, wo).round(3), gn.load("brass.binary").f(wi, wo).round(3))
    [0.223 0.148 0.077] [0.223 0.148 0.077]
    """
    large_tables.write(path, *_tables(m.raw if isinstance(m, MERL) else _tabulated(m, phi_d)))


def _tabulated(m: Reflectance, phi_cells: int) -> np.ndarray:
    colours, names = large_tables.expect_channels(m, NAME) == 3, m.channel_names
    if colours and names not in (None, tuple("RGB"), XYZ, RELATIVE_XYZ):
        raise ParameterError(f"{m!r:.80}: has channels {names!r:.60}, expected one, or colours: R, G, B or X, Y, Z")
    if not m.is_isotropic():
        raise ParameterError(
            f"{m!r:.80}: is anisotropic, and MERL files hold isotropic materials only; take the mean over turns: "
            f"gonio.repair.symmetrize(gonio.repair.resample(m), 'isotropy')"
        )
    to_rgb = rgb_of(names) if colours else None
    raw = np.empty((3, N, N, phi_cells))
    for rows, pairs in LAYOUT.blocks(dict(zip(AXES, centres(phi_cells), strict=True)), rows=10):
        f = with_channels(f_at(m, *pairs), 3)
        f = f if to_rgb is None else f @ to_rgb
        raw[:, rows] = np.moveaxis(np.where(is_valid(f), f / np.array(SCALE), -1.0), -1, 0)
    return raw
