"""Albedo: the directional-hemispherical reflectance; and black-sky, white-sky and blue-sky, as in remote sensing."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from ..arrays import ops
from ..base.angles import check_angle, direction, numbers_of
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..base.reradiation import warn_of_reradiation
from ..declared.arguments import Declared, checked
from ..errors import ParameterError, ShapeError, shown
from ..evaluate.labelled import takes_labels
from . import by_arrays
from .asked import Azimuth, Incidence, ReturnError, Tolerance, Zenith
from .nine import kept_reflectance
from .over_hemisphere import integrate


@takes_labels("wi")
@checked
def albedo(m: Reflectance, wi: Incidence, tolerance: Tolerance = 1e-4, return_error: ReturnError = False) -> Any:
    """Directional-hemispherical reflectance: the fraction of light arriving from wi that leaves, to all sides.

    rho(wi) = integral of f(wi, wo) cos(theta_o) dwo, delta lobes included exactly. Light that fluorescence sends out at
    another wavelength is not in f: a FluorescenceWarning says so. Under light of a spectrum E it is in the albedo of
    `m.under(E)`, and without one in `photon_albedo` and `fate`.

    Shapes   wi: (..., 3) NumPy array; result (...[, C]), or with `return_error` an `Integral` of it and (...).
    Units    1.
    Error    at most `tolerance`, absolute (relative where the result is above 1), or a ToleranceWarning that says what
             was reached. `return_error=True` returns the estimate too, typically 10 times the error, rarely below it.
             Computed in double precision. Of 5760 albedos of GGX, Beckmann and StudentT facets, alpha from 0.001 to 1
             along either axis, at 0 to 89.99 degrees, none was off by more than 6e-5 for 1e-4 (`half_vectors.py`).
             Of many polar angles of an isotropic lobe some are integrated and the others lie between them, to the same
             tolerance: none of 125 random materials was off by more than 0.65 of it (`by_polar_angle.py`).
             Places of a map share integrals (`integrals/maps/`), with an estimate for each: near the defaults of
             all models but ShadingNormal, at 12 of 1500 places each, at most 2.4e-5 for 1e-4. With all of Hapke's
             parameters over their whole bounds one white-sky albedo of 40 was 1.3e-4 off, 1.5 times its estimate.
    Source   lecture 4, eq. 4.2; Nicodemus et al. 1977, NBS Monograph 160; the quadrature: `quadrature.cubature`.
             Directions without measured data count as 0 and are reported by a MissingDataWarning.
    PyTorch and JAX arrays give differentiable albedos, by 4096 samples of the material: 1e-3 typically.

    Example
    >>> m = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    >>> print(gn.albedo(m, gn.direction([0.0, 1.3], 0.0)).round(4))
    [0.3396 0.4903]
    """
    warn_of_reradiation(m, "gn.photon_albedo(m, wi)")
    return kept_albedo(m, wi, tolerance, return_error)


@takes_labels("wi")
def kept_albedo(m: Reflectance, wi: Any, tolerance: float, return_error: bool = False) -> Any:
    """The albedo of f: of fluorescence without the light that leaves at another wavelength."""
    lib, (wi,) = ops.as_arrays(wi)
    if lib.name in ("torch", "jax"):
        if return_error:
            raise ParameterError(f"albedo(return_error=True): expected NumPy directions; got {lib.name}")
        if lib.shape(wi)[-1:] != (3,):
            raise ShapeError(f"albedo: got directions of shape {lib.shape(wi)}, expected (..., 3)")
        return by_arrays.albedo(m, wi, by_arrays.DEFAULT)
    found = integrate(m, wi, tolerance)
    return found if return_error else found.value


@takes_labels(angles=("theta_s", "phi_s"))
@checked
def black_sky_albedo(m: Reflectance, theta_s: Zenith, phi_s: Azimuth = 0.0, tolerance: Tolerance = 1e-4) -> Any:
    """Albedo under the sun alone, at polar angle `theta_s`: the directional-hemispherical reflectance; see `albedo`.

    Shapes   theta_s, phi_s: numbers or arrays that broadcast; result (...[, C]).
    Units    theta_s, phi_s: rad; result: 1.
    Error    `tolerance`.
    Source   Schaepman-Strub et al. 2006, Remote Sens. Environ. 103:27 (case 3); Lucht et al. 2000, IEEE TGRS 38:977.

    Example
    >>> field = gn.RossLi(f_iso=0.2, f_vol=0.1, f_geo=0.03)
    >>> print(gn.remote_sensing.black_sky_albedo(field, theta_s=np.radians([0.0, 45.0])).round(4))
    [0.1592 0.1703]
    """
    check_angle("theta_s", theta_s, 0.0, 0.5 * math.pi)
    warn_of_reradiation(m, "gn.photon_albedo(m, wi)")
    return kept_albedo(m, direction(theta_s, phi_s), tolerance)


@takes_labels()
@checked
def white_sky_albedo(m: Reflectance, tolerance: Tolerance = 1e-4) -> Any:
    """Albedo under a sky of equal radiance everywhere: the bihemispherical reflectance; see `reflectance`.

    Shapes   () or (C,); maps give (...[, C]).
    Units    1.
    Error    `tolerance`.
    Source   Schaepman-Strub et al. 2006, Remote Sens. Environ. 103:27 (case 9); Lucht et al. 2000, IEEE TGRS 38:977.

    Example
    >>> print(gn.remote_sensing.white_sky_albedo(gn.RossLi(f_iso=0.2, f_vol=0.1, f_geo=0.03)).round(4))
    0.1776
    """
    warn_of_reradiation(m, "gn.photon_albedo(m, wi)")
    return kept_reflectance(m, tolerance)


def _share(fraction: Any) -> Any:
    """A share as an array of its library; -1, which is none, for what is no number."""
    try:
        lib = ops.library_of_type(type(fraction))
        if lib is not None and lib.name != "numpy":
            return fraction
        numbers = ops.numbers(fraction)
        return np.array(-1.0) if numbers.dtype.kind == "b" else np.asarray(numbers, dtype=float)
    except ValueError:
        return np.array(-1.0)


def _beside(like: Any, x: Any) -> Any:
    """Numbers of NumPy as an array of another library."""
    return ops.library(like).convert(np.asarray(x), like)


@takes_labels(angles=("theta_s", "diffuse_fraction", "phi_s"))
@checked
def blue_sky_albedo(
    m: Reflectance,
    theta_s: Zenith,
    diffuse_fraction: Annotated[Any, Declared("the sky's share of the irradiance", 0.0, 1.0, "share")],
    phi_s: Azimuth = 0.0,
    tolerance: Tolerance = 1e-4,
) -> Any:
    """Albedo under the sun and a uniform sky, the "actual" one: (1 - d) black-sky + d white-sky albedo.

    d, the diffuse fraction, is the sky's share of the irradiance. `reflectance` takes skies that are not uniform.

    Shapes   theta_s, phi_s, diffuse_fraction: numbers or arrays that broadcast; result (...[, C]).
    Units    theta_s, phi_s: rad; others: 1.
    Error    `tolerance`.
    Source   Lucht et al. 2000, IEEE TGRS 38:977; Schaepman-Strub et al. 2006, Remote Sens. Environ. 103:27.

    Example
    >>> field = gn.RossLi(f_iso=0.2, f_vol=0.1, f_geo=0.03)
    >>> print(gn.remote_sensing.blue_sky_albedo(field, theta_s=np.radians(45.0), diffuse_fraction=0.2).round(4))
    0.1718
    """
    theta_s, phi_s = numbers_of("theta_s", theta_s), numbers_of("phi_s", phi_s)
    d = _share(diffuse_fraction)
    known = ops.library(d).known(d)
    if known is not None and ((known < 0.0) | (known > 1.0)).any():
        given = f"diffuse_fraction={shown(diffuse_fraction)}"
        raise ParameterError(f"{given}: expected the sky's share of light, in [0, 1]")
    shapes = [*map(np.shape, (theta_s, phi_s, d)), map_shape(m)]
    ops.broadcast_shape(shapes, "theta_s, phi_s, diffuse_fraction and parameters")
    check_angle("theta_s", theta_s, 0.0, 0.5 * math.pi)
    warn_of_reradiation(m, "gn.photon_albedo(m, wi)")
    black, white = kept_albedo(m, direction(theta_s, phi_s), tolerance), kept_reflectance(m, tolerance)
    if m.channels is not None:
        d = d[..., None]
    like = next((x for x in (black, white, d) if ops.library(x).name != "numpy"), None)
    if like is not None:
        black, white, d = (x if ops.library(x).name != "numpy" else _beside(like, x) for x in (black, white, d))
    return (1.0 - d) * black + d * white
