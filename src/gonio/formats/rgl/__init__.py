"""RGL's measured materials: `.bsdf` tensor files on an adaptive grid of half vectors, rgb or spectral."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from ...arrays import Fixed, ops
from ...base.measured import Measured
from ...base.reflectance import Reflectance
from ...base.results import Hints
from ...declared.arguments import Declared
from ...formula import warp
from ...formula.direction import Direction, polar_angle, reflect, select
from ...formula.fields import Ours, channels, kept, table
from ...formula.state import Held, note, state
from ...formula.table_warp import ONE, MarginalWarp, Slices, bilinear, both, bracket, gather, tables_when_needed
from .._reading import tensor_file
from . import writer
from .fields import check, dataset

if TYPE_CHECKING:
    import xarray

NAME = "RGL"
SUFFIXES = (".bsdf",)
SHARED_SUFFIX = True
DESCRIPTION = "tensor file of the RGL material database, rgb or spectral, isotropic or anisotropic"
ORACLE = "Mitsuba 3 `measured`; two real files (isotropic, rgb)"
NO_LAYOUT = "half vectors at other nodes for each wi: `writer.fields` chooses them"

KINDS = ("_cells", "_rows", "_conditional", "_marginal", "_integral")
"""Endings of the names of the tables that `table_warp.tables` makes of a density."""

FACETS = ("ndf", "sigma")
"""The tables over directions alone, azimuths by square roots of polar angles."""

COSINE_SHARE = 0.1  # share of samples that is cosine-distributed: no direction is missed where the table's density is 0


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: other kinds of tensor files have other fields."""
    return head.startswith(tensor_file.MAGIC) and any(n in head for n in (b"vndf", b"theta_i", b"luminance"))


def read(path: Path) -> RGL:
    """The measurement in a file. Raises FormatError where it is damaged."""
    return RGL({name: Ours(a) for name, a in tensor_file.read(path).items()}, str(path))


def write(
    m: Reflectance,
    path: Path,
    resolution: Annotated[int | None, Declared("rows and columns of half vectors", 4, usual=writer.RESOLUTION)] = None,
    theta_i: Annotated[
        int | None, Declared("polar angles of wi from 0 to 90 degrees, denser towards grazing", 2, usual=writer.THETA_I)
    ] = None,
    phi_i: Annotated[int | None, Declared("azimuths of wi, if anisotropic", 8, multiple=4, usual=writer.PHI_I)] = None,
) -> None:
    """Write f as such a file: rgb (one channel becomes gray, X, Y, Z linear sRGB), or spectra for wavelengths.

    A measurement read from such a file is written with every field as it was, bit by bit, unless an option is given.
    Tables that repeat after half or a quarter of the circle of azimuths are stored once.

    Lost: holes, which are filled from their neighbours; values between the nodes. f with both cosines above 0.1
    changes by (mean, 99th percentile, largest; relative) 5e-4, 6e-3, 2e-2 for GGX(0.1), 2e-3, 9e-3, 4e-2 for
    Lambertian + GGX(0.3) of glass, 2e-3, 1e-2, 0.3 for gold-metallic-paint, 4e-3, 3e-2, 0.1 for GGX(0.1, 0.4).
    Raises ParameterError for a delta lobe, maps, and channels that are neither colours nor wavelengths.

    Example
    >>> gn.save(gn.material("gold"), "gold.bsdf", format="RGL", resolution=32)
    >>> m = gn.load("gold.bsdf")
    >>> print(type(m).__name__, m.f_angles(0.5, 0.0, 0.5, np.pi).round(1))
    RGL [10.1  7.5  3.8]
    """
    asked = (("resolution", resolution), ("theta_i", theta_i), ("phi_i", phi_i))
    options = {name: value for name, value in asked if value is not None}
    tensor_file.write(path, m.stored if isinstance(m, RGL) and not options else writer.fields(m, **options))


class RGL(Measured):
    """Measurement on the grid of Dupuy and Jakob: f = S(s) D(wm) / (4 sigma(wi) cos(theta_o)).

    The angles of wm = (wi + wo)/|wi + wo| become u = (sqrt(2 theta_m/pi), (phi_m + pi)/(2 pi)); s is the
    inverse, at u, of the warp whose density is the table `vndf` (the visible normals seen from wi). S
    (`spectra` or `rgb`) and `vndf` are linear in the incident angles (phi_i, theta_i) between their nodes and
    constant beyond them; D (`ndf`) and sigma are tables over the angles of wm and of wi. Isotropic files (one
    or two phi_i) have phi_m - phi_i in place of phi_m. Anisotropic files that cover 1/r of the circle (r = 2
    or 4) hold wi with y <= 0 (and x <= 0); other pairs are turned by pi (r = 2) or mirrored (r = 4) into it.
    Files with jacobian = 0 hold S = f cos(theta_o) without the factors D and sigma.
    Values are kept as they are stored: S may be negative, albedos above 1 occur, and f is not reciprocal.
    f is NaN where an entry that it is interpolated between is not finite (see `valid`), and only there.

    Sampling draws wi with the tables lit from wo: `luminance`, then `vndf`. A share of 0.1 of the samples is
    cosine-distributed instead: weights are at most 10 pi f. Negative or not finite luminances count as 0.

    Shapes   f: (..., 3) for rgb files, (..., number of wavelengths) for spectral ones.
    Units    f: 1/sr. D: 1/sr; S and sigma: 1; wavelengths (`channel_names`): nm.
    Error    float32 against float64: 9e-7 (median), 9e-5 (99th percentile). Against Mitsuba 3.9.1 `measured`
             (float32), 1e5 pairs per file, cosines above 0.01: within 1e-4 |f| + 1e-5 median |f| for 99.99 %
             of the pairs of two real files (isotropic rgb), at most 5 times that; for all of synthetic
             anisotropic ones. No real anisotropic or spectral file was at hand. For wi on the x axis of files
             with r = 2 or 4 Mitsuba takes the wrong end of phi_i; this does not.
    Source   Dupuy & Jakob 2018, "An adaptive parameterization for efficient material acquisition and
             rendering", ACM TOG 37(6):274, doi:10.1145/3272127.3275059.
    """

    format = NAME
    parameterization = "adaptive half vectors"
    quantity: str = note("brdf * cos(theta_o)")
    hints = Hints(seam=COSINE_SHARE)
    breaks: ClassVar[dict[str, str]] = {
        "positivity": "the file's values are kept as they are, with noise around 0",
        "reciprocity": "the tables of every wi are measured and interpolated on their own",
        "energy": "the file's values are kept as they are; some files' albedos exceed 1",
        "furnace": "the file holds f cos(theta_o), which is not 0 at grazing: f grows as 1/cos(theta_o)",
    }

    theta_i = table("polar angles of wi [rad]")
    phi_i = table("azimuths of wi [rad]")
    values = table("S, by phi_i, theta_i, channel, sy, sx")
    ndf = table("D, by phi_m, sqrt(theta_m)")
    sigma = table("projected area of the facets, by phi_i, sqrt(theta_i)")
    channel = channels("number of the channel in `values`")

    stored: dict[str, np.ndarray] = note()
    """The file's fields in their order, as they were read."""
    shapes_held: tuple[tuple[str, tuple[int, ...]], ...] = state()
    planes: int = state()
    main: str = state()
    """Name of the field that holds S: "spectra" or "rgb"."""
    reduction: int = state()
    """Into how many parts of the circle an anisotropic file's content repeats: 1, 2 or 4."""
    isotropic: bool = state()
    """Whether only differences of azimuths count: the file has one or two of them."""
    divided: bool = state()
    """Whether S is f cos(theta_o) divided by D / (4 sigma)."""
    even: tuple[str, ...] = state()
    """Names of those of the tables `ndf` and `sigma` that are the same for all azimuths."""

    luminance_integral: Any  # about the albedo; of bound materials only, as the tables of `_warp`

    def __init__(self, fields: Mapping[str, Any], path: str = ""):
        """From the fields of a tensor file, name -> array. Raises FormatError where they do not fit."""
        stored = Held({name: kept(a) for name, a in fields.items()})
        main, reduction = check(stored, path or "RGL fields")
        about = {"description": stored["description"].tobytes().decode("utf-8", "replace").rstrip("\0")}
        about |= writer.history(stored)
        tables = {name: stored[name] for name in ("theta_i", "phi_i", "sigma")}
        tables |= {"values": _finite_or_nan(stored[main]), "ndf": _finite_or_nan(stored["ndf"])}
        names = tuple(stored["wavelengths"].tolist()) if main == "spectra" else ("R", "G", "B")
        self._hold(
            stored=stored,
            shapes_held=tuple((name, a.shape) for name, a in stored.items()),
            planes=len(names),
            main=main,
            reduction=reduction,
            isotropic=len(stored["phi_i"]) <= 2,
            divided=bool(stored["jacobian"][0]),
            even=tuple(name for name in FACETS if (stored[name] == stored[name][:1]).all()),
            channel_names=names,
        )
        if self.divided:
            self._hold(quantity="brdf * cos(theta_o) / (ndf / (4 sigma))")
        super().__init__(path, about, **{name: Ours(a) for name, a in tables.items()}, channel=len(names))

    def _keep(self) -> dict[str, Fixed]:
        """The base's fields and the tables of the warps; as formulas look them up, entries that they need together lie
        side by side: channels of S, and azimuths of D and sigma, one if all are the same."""
        fields = super()._keep()
        values, vndf, luminance = fields["values"], self.stored["vndf"], self.stored["luminance"]
        facets = {name: self.stored[name][: self._facets(name)[1]] for name in FACETS}
        return {
            **fields,
            "values": Fixed(lambda: np.moveaxis(values.numbers.reshape(self.shapes[self.main]), -3, -1).reshape(-1)),
            **{name: Fixed(_finite_or_nan(a).T.reshape(-1)) for name, a in facets.items()},
            **tables_when_needed([f"vndf{kind}" for kind in KINDS[:-1]], lambda: vndf),
            **tables_when_needed([f"luminance{kind}" for kind in KINDS], lambda: _lit(luminance)),
        }

    def _key(self) -> tuple:
        return (*super()._key(), *((name, self.stored[name]) for name in ("vndf", "luminance")))

    @property
    def _oriented(self) -> bool:  # type: ignore[override]  # asked of the object
        """Whether the file holds data that change as the sample is turned."""
        return not self.isotropic

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Of the fields."""
        return dict(self.shapes_held)

    @property
    def axes(self) -> dict[str, np.ndarray]:
        """Nodes [rad] of the directions of wi; half vectors lie on an adaptive grid for each of them."""
        return {"phi_i": self.stored["phi_i"], "theta_i": self.stored["theta_i"]}

    @property
    def valid(self) -> np.ndarray:
        return np.isfinite(self.stored[self.main])

    @property
    def data(self) -> xarray.Dataset:
        return dataset(self)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wi, wo, _ = self._folded(wi, wo)
        at, x_i, y_i, _ = self._lit_from(wi)
        x, y = self._point(wi + wo, wi)
        sx, sy, _ = self._warp("vndf").invert(at, x, y)
        plane, planes = ops.to_index(self.channel), self.planes
        S = bilinear(self.values, at, self._grid(self.main), sx, sy, (plane, planes))
        if self.divided:
            D = bilinear(self.ndf, ONE, self._facets("ndf"), y, x)
            S = S * (D / (4.0 * bilinear(self.sigma, ONE, self._facets("sigma"), y_i, x_i)))
        return S / wo.z

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        diffuse = u0 < COSINE_SHARE
        flat = warp.cosine_hemisphere(ops.minimum(u0 * (1.0 / COSINE_SHARE), 1.0), u1)
        steep = self._table_warp(wo, ops.clip((u0 - COSINE_SHARE) / (1.0 - COSINE_SHARE), 0.0, 1.0), u1)
        return select(diffuse, flat, steep)

    def density(self, wi: Direction, wo: Direction) -> Any:
        flat, steep = warp.cosine_hemisphere_density(wi), self._table_density(wi, wo)
        return COSINE_SHARE * flat + (1.0 - COSINE_SHARE) * steep

    def estimate(self, wo: Direction) -> Any:
        wo, _, _ = self._folded(wo, wo)
        return gather(self.luminance_integral, self._lit_from(wo)[0], 1, 0)

    def _table_warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        wo, _, (turn_x, turn_y) = self._folded(wo, wo)
        at, _, _, phi_o = self._lit_from(wo)
        x, y = self._warp("vndf").sample(at, *self._warp("luminance").sample(at, u1, u0))
        theta, phi = (0.5 * math.pi) * x * x, (2.0 * y - 1.0) * math.pi
        if self.isotropic:
            phi = phi + phi_o
        s = ops.sin(theta)
        wi = reflect(wo, Direction(s * ops.cos(phi), s * ops.sin(phi), ops.cos(theta)))
        return Direction(turn_x * wi.x, turn_y * wi.y, wi.z)

    def _table_density(self, wi: Direction, wo: Direction) -> Any:
        wo, wi, _ = self._folded(wo, wi)
        at, _, _, _ = self._lit_from(wo)
        h = wi + wo
        x, y = self._point(h, wo)
        sx, sy, density = self._warp("vndf").invert(at, x, y)
        # Solid angle of the half vectors, sin(theta_m) d theta_m d phi_m, then of wi, 4 cos(theta_d) times that, per
        # area of the square; |h| = 2 cos(theta_d). It is 0 at the pole, where x = 0.
        solid = (4.0 * math.pi**2) * x * ops.sqrt(h.x * h.x + h.y * h.y + 1e-20)
        return density * self._warp("luminance").eval(at, sx, sy) / ops.maximum(solid, 1e-12)

    def _folded(self, lit: Direction, other: Direction) -> tuple[Direction, Direction, tuple[Any, Any]]:
        """Both, turned or mirrored so that `lit` lies in the part of the circle that the file covers."""
        if self.reduction == 1:
            return lit, other, (1.0, 1.0)
        one = 1.0 + 0.0 * lit.y
        turn_y = ops.where(lit.y < 0.0, one, -one)
        turn_x = ops.where(lit.x < 0.0, one, -one) if self.reduction == 4 else turn_y
        lit, other = (Direction(turn_x * w.x, turn_y * w.y, w.z) for w in (lit, other))
        return lit, other, (turn_x, turn_y)

    def _lit_from(self, w: Direction) -> tuple[Slices, Any, Any, Any]:
        """For light from w: the tables to interpolate, the place of w in `sigma`, and its azimuth."""
        # Where files are folded y <= 0, and phi = -pi where y = 0 and x < 0, whatever the sign of that zero.
        folded = self.reduction > 1
        phi = -_azimuth(Direction(w.x, ops.absolute(w.y), w.z)) if folded else _azimuth(w)
        theta = polar_angle(w)
        (n_phi,), (n_theta,) = self.shapes["phi_i"], self.shapes["theta_i"]
        at = both(bracket(self.phi_i, n_phi, phi), bracket(self.theta_i, n_theta, theta), n_theta)
        return at, ops.sqrt(theta * (2.0 / math.pi)), (phi + math.pi) * (0.5 / math.pi), phi

    def _point(self, h: Direction, lit: Direction) -> tuple[Any, Any]:
        """u = (x, y) of a half vector of any length."""
        (h_x, h_y), (x, y) = _on_plane(h), _on_plane(lit)
        phi = ops.arctan2(x * h_y - y * h_x, x * h_x + y * h_y) if self.isotropic else ops.arctan2(h_y, h_x)
        turns = (phi + math.pi) * (0.5 / math.pi)
        return ops.sqrt(polar_angle(h) * (2.0 / math.pi)), turns - ops.floor(turns)

    def _grid(self, name: str) -> tuple[int, int]:
        """Rows and columns of a field's tables."""
        rows, columns = self.shapes[name][-2:]
        return rows, columns

    def _facets(self, name: str) -> tuple[int, int]:
        """Rows and columns of D or sigma, as formulas look them up: by polar angle, then azimuth."""
        rows, columns = self._grid(name)
        return columns, 1 if name in self.even else rows

    def _warp(self, name: str) -> MarginalWarp:
        """Of "vndf", visible normals over phi_m and sqrt(theta_m), or of "luminance", samples over s."""
        cells, rows, conditional, marginal = (getattr(self, name + kind) for kind in KINDS[:-1])
        count = math.prod(self.shapes["phi_i"] + self.shapes["theta_i"])
        return MarginalWarp(cells, rows, conditional, marginal, self._grid(name), count)


def _lit(luminance: np.ndarray) -> np.ndarray:
    """The densities that samples are drawn by: even where there is no luminance."""
    with np.errstate(invalid="ignore"):
        density = luminance.astype(np.float64)
        density = np.where(np.isfinite(density) & (density > 0.0), density, 0.0)
    density[density.sum(axis=(-2, -1)) <= 0.0] = 1.0
    return density


def _on_plane(w: Direction) -> tuple[Any, Any]:
    """x and y of a direction; 1 and 0 along the normal, where the azimuth counts as 0, with a finite derivative."""
    flat = w.x * w.x + w.y * w.y < 1e-30
    return ops.where(flat, 1.0, w.x), ops.where(flat, 0.0 * w.y, w.y)


def _azimuth(w: Direction) -> Any:
    """phi in [-pi, pi]."""
    x, y = _on_plane(w)
    return ops.arctan2(y, x)


def _finite_or_nan(a: np.ndarray) -> np.ndarray:
    """The array, with infinities as NaN: neither is a value, and f is NaN there."""
    return a if not np.isinf(a).any() else np.where(np.isinf(a), np.float32(np.nan), a)
