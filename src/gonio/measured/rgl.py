"""RGL's measured materials: `.bsdf` tensor files on an adaptive grid of half vectors, in colour or as spectra."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from .. import ops, warp
from ..errors import FormatError, ParameterError
from ..geometry import Direction, add, dot, normalize, polar_angle, reflect
from ..measurement import Measured
from ..param import channels, table
from . import _tensor_file
from ._marginal_warp import ONE, MarginalWarp, Slices, bilinear, both, bracket, gather, tables

if TYPE_CHECKING:
    import xarray

NAME = "RGL"
SUFFIXES = (".bsdf",)
SHARED_SUFFIX = True
DESCRIPTION = "tensor file of the RGL material database, rgb or spectral, isotropic or anisotropic"

COSINE_SHARE = 0.1
"""Share of the samples that is cosine-distributed, so that no direction is missed where the table's density is 0."""


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: other kinds of tensor files have other fields."""
    return head.startswith(_tensor_file.MAGIC) and any(n in head for n in (b"vndf", b"theta_i", b"luminance"))


def read(path: Path) -> RGL:
    """The measurement in a file. Raises FormatError where it is damaged."""
    return RGL(_tensor_file.read(path), str(path))


def write(m: RGL, path: Path) -> None:
    """Write a measurement with every field as it was read, bit by bit."""
    if not isinstance(m, RGL):
        raise ParameterError(
            f"{m!r:.80}: expected an RGL measurement; other materials cannot be written as RGL files"
        )
    _tensor_file.write(path, m.stored)


class RGL(Measured):
    """Measurement on the grid of Dupuy and Jakob: f = S(s) D(wm) / (4 sigma(wi) cos(theta_o)), wm = (wi + wo)/|wi + wo|.

    The half vector's angles become u = (sqrt(2 theta_m/pi), (phi_m + pi)/(2 pi)); s is the inverse, at u, of the warp
    whose density is the table `vndf` (the visible normals seen from wi). S (`spectra` or `rgb`) and `vndf` are linear
    in the incident angles (phi_i, theta_i) between their nodes and constant beyond them; D (`ndf`) and sigma are tables
    over the angles of wm and of wi. Isotropic files (one or two phi_i) use phi_m - phi_i for phi_m. Anisotropic files
    that cover 1/r of the circle (r = 2 or 4) hold wi with y <= 0 (and x <= 0); other pairs are turned by pi (r = 2) or
    mirrored (r = 4) into it. Files without Jacobian hold S = f cos(theta_o) itself.
    Values are kept as they are stored: S may be negative, albedos above 1 occur, and f is not reciprocal.
    f is NaN where one of the entries that it is interpolated between is not finite (see `valid`), and only there.

    Sampling draws wi with the tables lit from wo: `luminance`, then `vndf`; a share of 0.1 of the samples is
    cosine-distributed instead, so weights are at most 10 pi f. Negative or not finite luminances count as 0.

    Shapes   f: (..., 3) for rgb files, (..., number of wavelengths) for spectral ones.
    Units    f: 1/sr. D: 1/sr, S and sigma: 1, wavelengths (`channel_names`): nm.
    Error    against Mitsuba 3.9.1 `measured`, see tests/test_rgl.py: @@@
    Source   Dupuy & Jakob 2018, "An adaptive parameterization for efficient material acquisition and rendering",
             ACM TOG 37(6), doi:10.1145/3272127.3275059.
    """

    format = NAME
    quantity = (
        "brdf * cos(theta_o) [1/sr], divided by the microfacet factors ndf / (4 sigma) if jacobian is 1"
    )
    seam = COSINE_SHARE
    breaks: ClassVar[dict[str, str]] = {
        "positivity": "the file's values are kept as they are, with noise around 0",
        "reciprocity": "the tables of every wi are measured and interpolated on their own",
        "energy": "the file's values are kept as they are; some files' albedos exceed 1",
        "furnace": "the file's values are kept as they are; some files' albedos exceed 1",
    }

    theta_i = table("polar angles of wi [rad]")
    phi_i = table("azimuths of wi [rad]")
    values = table("S, by phi_i, theta_i, channel, sy, sx")
    ndf = table("D, by phi_m, sqrt(theta_m)")
    sigma = table("projected area of the facets, by phi_i, sqrt(theta_i)")
    vndf = table("density of visible normals, by phi_i, theta_i, phi_m, sqrt(theta_m)")
    vndf_conditional = table("its integral along a row")
    vndf_marginal = table("its integral over the rows")
    luminance = table("density over s that samples are drawn from, by phi_i, theta_i, sy, sx")
    luminance_conditional = table("its integral along a row")
    luminance_marginal = table("its integral over the rows")
    brightness = table("mean luminance of S, by phi_i, theta_i")
    channel = channels("number of the channel in `values`")

    def __init__(self, fields: Mapping[str, np.ndarray], path: str = ""):
        """A measurement of the fields of a tensor file, name -> array. Raises FormatError where they do not fit."""
        fields = {
            name: np.array(a) if np.asarray(a).flags.writeable else np.asarray(a)
            for name, a in fields.items()
        }
        where = path or "RGL fields"
        main, reduction = _check(fields, where)
        spectral, values = main == "spectra", fields[main]
        jacobian = int(fields["jacobian"][0])
        names = tuple(fields["wavelengths"].tolist()) if spectral else ("R", "G", "B")
        about = {
            "description": fields["description"].tobytes().decode("utf-8", "replace").rstrip("\0"),
            "isotropic": len(fields["phi_i"]) <= 2,
            "reduction": reduction,
            "jacobian": jacobian,
            "resolution": values.shape,
        }
        self.__dict__.update(
            stored=fields, main=main, reduction=reduction, jacobian=jacobian != 0, channel_names=names
        )
        lit = np.maximum(
            np.nan_to_num(fields["luminance"].astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0), 0.0
        )
        lit[lit.sum(axis=(-2, -1)) <= 0.0] = 1.0
        vndf, lum = tables(fields["vndf"]), tables(lit)
        super().__init__(
            path,
            about,
            theta_i=fields["theta_i"],
            phi_i=fields["phi_i"],
            values=_finite_or_nan(values),
            ndf=_finite_or_nan(fields["ndf"]),
            sigma=fields["sigma"],
            **dict(zip(("vndf", "vndf_conditional", "vndf_marginal"), vndf, strict=False)),
            **dict(
                zip(
                    ("luminance", "luminance_conditional", "luminance_marginal", "brightness"),
                    lum,
                    strict=True,
                )
            ),
            channel=values.shape[2],
        )

    @property
    def valid(self) -> np.ndarray:
        return np.isfinite(self.stored[self.main])

    @property
    def data(self) -> xarray.Dataset:
        return _dataset(self)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        wi, wo, _ = self._folded(wi, wo)
        at, x_i, y_i, phi_i = self._lit_from(wi)
        x, y = self._point(add(wi, wo), phi_i)
        sx, sy, _ = self._warps[0].invert(at, x, y)
        _, _, count, *grid = self._shape(self.main)
        S = bilinear(self.values, at, (grid[0], grid[1]), sx, sy, ops.to_index(self.channel), count)
        if self.jacobian:
            D = bilinear(self.ndf, ONE, self._shape("ndf"), x, y)
            S = S * (D / (4.0 * bilinear(self.sigma, ONE, self._shape("sigma"), x_i, y_i)))
        return S / wo.z

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        diffuse = u0 < COSINE_SHARE
        flat = warp.cosine_hemisphere(ops.minimum(u0 * (1.0 / COSINE_SHARE), 1.0), u1)
        steep = self._table_warp(wo, ops.clip((u0 - COSINE_SHARE) / (1.0 - COSINE_SHARE), 0.0, 1.0), u1)
        return Direction(*(ops.where(diffuse, a, b) for a, b in zip(flat, steep, strict=True)))

    def density(self, wi: Direction, wo: Direction) -> Any:
        flat, steep = warp.cosine_hemisphere_density(wi), self._table_density(wi, wo)
        return COSINE_SHARE * flat + (1.0 - COSINE_SHARE) * steep

    def estimate(self, wo: Direction) -> Any:
        wo, _, _ = self._folded(wo, wo)
        return gather(self.brightness, self._lit_from(wo)[0], 1, 0)

    def _table_warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        wo, _, (turn_x, turn_y) = self._folded(wo, wo)
        at, _, _, phi_o = self._lit_from(wo)
        vndf, lum = self._warps
        x, y = vndf.sample(at, *lum.sample(at, u1, u0))
        theta, phi = (0.5 * math.pi) * x * x, (2.0 * y - 1.0) * math.pi
        if self.about["isotropic"]:
            phi = phi + phi_o
        s = ops.sin(theta)
        wi = reflect(wo, Direction(s * ops.cos(phi), s * ops.sin(phi), ops.cos(theta)))
        return Direction(turn_x * wi.x, turn_y * wi.y, wi.z)

    def _table_density(self, wi: Direction, wo: Direction) -> Any:
        wo, wi, _ = self._folded(wo, wi)
        at, _, _, phi_o = self._lit_from(wo)
        wm = normalize(add(wi, wo))
        x, y = self._point(wm, phi_o)
        vndf, lum = self._warps
        sx, sy, density = vndf.invert(at, x, y)
        # Solid angle of the half vectors, then of wi, per area of the square; 0 at the pole, where x = 0.
        sin_m = ops.sqrt(wm.x * wm.x + wm.y * wm.y + 1e-20)
        solid = (8.0 * math.pi**2) * x * sin_m * dot(wo, wm)
        return density * lum.eval(at, sx, sy) / ops.maximum(solid, 1e-12)

    def _folded(self, given: Direction, other: Direction) -> tuple[Direction, Direction, tuple[Any, Any]]:
        """Both directions, turned or mirrored so that `given` lies in the part of the circle that the file covers."""
        if self.reduction == 1:
            return given, other, (1.0, 1.0)
        one = 1.0 + 0.0 * given.y
        turn_y = ops.where(given.y < 0.0, one, -one)
        turn_x = ops.where(given.x < 0.0, one, -one) if self.reduction == 4 else turn_y
        # Minus the magnitude: a y of zero must become -0, for its azimuth is -pi and not pi.
        given = Direction(turn_x * given.x, -ops.absolute(given.y), given.z)
        return given, Direction(turn_x * other.x, turn_y * other.y, other.z), (turn_x, turn_y)

    def _lit_from(self, w: Direction) -> tuple[Slices, Any, Any, Any]:
        """For light from w: the tables to interpolate, the place of w in `sigma`, and its azimuth."""
        theta, phi = polar_angle(w), _azimuth(w)
        n_phi, n_theta = len(self.stored["phi_i"]), len(self.stored["theta_i"])
        at = both(bracket(self.phi_i, n_phi, phi), bracket(self.theta_i, n_theta, theta), n_theta)
        return at, ops.sqrt(theta * (2.0 / math.pi)), (phi + math.pi) * (0.5 / math.pi), phi

    def _point(self, h: Direction, phi_i: Any) -> tuple[Any, Any]:
        """u = (x, y) of a half vector of any length."""
        phi = _azimuth(h) - phi_i if self.about["isotropic"] else _azimuth(h)
        y = (phi + math.pi) * (0.5 / math.pi)
        return ops.sqrt(polar_angle(h) * (2.0 / math.pi)), y - ops.floor(y)

    def _shape(self, name: str) -> tuple[int, ...]:
        return self.stored[name].shape

    @property
    def _warps(self) -> tuple[MarginalWarp, MarginalWarp]:
        vndf, lum = self._shape("vndf")[2:], self._shape("luminance")[2:]
        return (
            MarginalWarp(self.vndf, self.vndf_conditional, self.vndf_marginal, (vndf[0], vndf[1])),
            MarginalWarp(
                self.luminance, self.luminance_conditional, self.luminance_marginal, (lum[0], lum[1])
            ),
        )


def _azimuth(w: Direction) -> Any:
    """phi in [-pi, pi]; 0 along the normal, with a finite derivative there."""
    flat = w.x * w.x + w.y * w.y < 1e-30
    return ops.arctan2(ops.where(flat, 0.0 * w.y, w.y), ops.where(flat, 1.0, w.x))


def _finite_or_nan(a: np.ndarray) -> np.ndarray:
    """The array, with infinities as NaN: both are no values, and NaN is what f shows there."""
    return a if not np.isinf(a).any() else np.where(np.isinf(a), np.float32(np.nan), a)


def _check(fields: Mapping[str, np.ndarray], where: str) -> tuple[str, int]:
    """Which field holds S, and the reduction; FormatError where a field is missing or does not fit the others."""
    phi, theta = (_field(fields, where, name, (None,)) for name in ("phi_i", "theta_i"))
    for name, nodes, low, high in (("phi_i", phi, -math.pi, math.pi), ("theta_i", theta, 0.0, 0.5 * math.pi)):
        if not (np.isfinite(nodes).all() and (np.diff(nodes) > 0.0).all()):
            raise FormatError(f"{where}: {name} is {_short(nodes)}, expected finite, increasing numbers")
        if nodes[0] < low - 0.01 or nodes[-1] > high + 0.01:
            raise FormatError(
                f"{where}: {name} runs from {nodes[0]:g} to {nodes[-1]:g} rad, expected {low:g} to {high:g} at most"
            )
    reduction = 1
    if len(phi) > 2:
        span = float(phi[-1]) - float(phi[0])
        reduction = round(2.0 * math.pi / max(span, 0.1))
        if reduction not in (1, 2, 4) or abs(float(phi[0]) + math.pi) > 0.1:
            raise FormatError(
                f"{where}: phi_i covers {math.degrees(phi[0]):.1f} to {math.degrees(phi[-1]):.1f} degrees, expected "
                f"-180 to 180, 0 or -90: all, a half or a quarter of the circle"
            )
    at = (len(phi), len(theta))
    main = "spectra" if "spectra" in fields else "rgb"
    if main not in fields:
        raise FormatError(
            f"{where}: holds neither spectra nor rgb; its fields: {', '.join(map(repr, fields)):.200}"
        )
    n_channels = 3 if main == "rgb" else len(_field(fields, where, "wavelengths", (None,)))
    lum = _field(fields, where, "luminance", (*at, None, None))
    _field(fields, where, main, (*at, n_channels, *lum.shape[2:]))
    vndf = _field(fields, where, "vndf", (*at, None, None))
    sigma = _field(fields, where, "sigma", (None, None))
    _field(fields, where, "ndf", (None, None))
    _field(fields, where, "description", (None,), "uint8")
    _field(fields, where, "jacobian", (1,), "uint8")
    for name in ("ndf", "sigma", "vndf", "luminance"):
        if min(fields[name].shape[-2:]) < 2:
            raise FormatError(
                f"{where}: {name} has shape {fields[name].shape}, expected at least 2 rows and columns"
            )
    if main == "spectra":
        nm = fields["wavelengths"]
        if not (np.isfinite(nm).all() and (nm > 0.0).all() and (np.diff(nm) > 0.0).all()):
            raise FormatError(
                f"{where}: wavelengths is {_short(nm)}, expected positive, increasing numbers [nm]"
            )
    if not (np.isfinite(sigma).all() and (sigma > 0.0).all()):
        raise FormatError(f"{where}: sigma holds {np.min(sigma):g}, expected positive, finite areas")
    if not (
        np.isfinite(vndf).all() and (vndf >= 0.0).all() and (vndf.sum(axis=(2, 3), dtype=float) > 0.0).all()
    ):
        raise FormatError(
            f"{where}: vndf holds numbers from {np.min(vndf):g} to {np.max(vndf):g}, expected finite ones that are not "
            f"negative, some of them positive for every phi_i and theta_i"
        )
    return main, reduction


def _field(
    fields: Mapping[str, np.ndarray],
    where: str,
    name: str,
    shape: tuple[int | None, ...],
    dtype: str = "float32",
) -> np.ndarray:
    """The field of that name, if it has these axes (None: any length but 0) and this type."""
    if name not in fields:
        raise FormatError(
            f"{where}: field {name!r} is missing; its fields: {', '.join(map(repr, fields)):.200}"
        )
    a = fields[name]
    fits = a.ndim == len(shape) and all(
        n == want if want is not None else n > 0 for n, want in zip(a.shape, shape)
    )
    if not fits or a.dtype != dtype:
        wanted = ", ".join("n" if n is None else str(n) for n in shape)
        raise FormatError(
            f"{where}: {name} is {a.dtype} of shape {a.shape}, expected {dtype} of shape ({wanted})"
        )
    return a


def _short(a: np.ndarray) -> str:
    return np.array2string(a, threshold=6, edgeitems=3, precision=4)


def _dataset(m: RGL) -> xarray.Dataset:
    """The file's fields as they were stored; angles of the grids' nodes as coordinates."""
    import xarray

    lit, third = ("phi_i", "theta_i"), "wavelength" if m.main == "spectra" else "channel"
    axes = {
        "phi_i": (("phi_i",), "rad", "azimuth of the incident direction"),
        "theta_i": (("theta_i",), "rad", "polar angle of the incident direction"),
        "wavelengths": (("wavelength",), "nm", "wavelength"),
        "ndf": (("phi_ndf", "theta_ndf"), "sr-1", "distribution of the half vectors"),
        "sigma": (("phi_sigma", "theta_sigma"), "1", "projected area of the facets"),
        "vndf": (
            (*lit, "phi_m", "theta_m"),
            "1",
            "distribution of the visible half vectors, per area of its grid",
        ),
        "luminance": ((*lit, "s_y", "s_x"), "1", "luminance of the values"),
        m.main: ((*lit, third, "s_y", "s_x"), "1" if m.jacobian else "sr-1", m.quantity),
        "description": (("character",), "1", "description, UTF-8"),
        "jacobian": (("flag",), "1", "1: values are divided by ndf / (4 sigma)"),
        "valid": (("valid_byte",), "1", "bit mask of the measured samples, as stored"),
    }
    variables, coordinates = {}, {}
    for name, a in m.stored.items():
        if name in axes and len(axes[name][0]) == a.ndim and (name != "wavelengths" or third == "wavelength"):
            dims, unit, long_name = axes[name]
            variables[name] = (dims, a, {"units": unit, "long_name": long_name})
        else:
            variables[f"field_{name}"] = (tuple(f"field_{name}_{k}" for k in range(a.ndim)), a, {})
    for name in ("ndf", "sigma", "vndf"):
        (phi, theta), (rows, columns) = axes[name][0][-2:], m.stored[name].shape[-2:]
        coordinates[phi] = (phi, np.linspace(-math.pi, math.pi, rows), {"units": "rad"})
        coordinates[theta] = (theta, 0.5 * math.pi * np.linspace(0.0, 1.0, columns) ** 2, {"units": "rad"})
    coordinates[third] = (
        third,
        list(m.channel_names or ()),
        {"units": "nm"} if third == "wavelength" else {},
    )
    return xarray.Dataset(variables, coordinates, {"source": m.path, "quantity": m.quantity, **m.about})
