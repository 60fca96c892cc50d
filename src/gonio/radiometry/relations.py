"""The relations between radiometric quantities: flux, intensity, radiance, irradiance, reflectance."""

from typing import Any

import numpy as np

from ..declared import arguments
from ..declared.arrays import Array
from ..declared.arrays import formula as _formula
from ..declared.arrays import one_dtype as _one_dtype
from ..declared.arrays import points as _points
from ..declared.arrays import real_numbers as _real_numbers
from ..errors import ParameterError, ShapeError
from .kinds import _VECTOR, _Converted, _Cosine, _Divisor, _EitherSide, _NotNegative, _Positive, _Real, _Reflectance

# Flux, intensity, radiance, irradiance


@_formula
def solid_angle(area: _NotNegative, distance: _Positive, cos_theta: _Cosine = 1.0) -> Array:
    """Solid angle of a small area: dω = dA cosθ/r², θ between its normal and the line of sight.

    Shapes broadcast. Units m², m, 1 -> sr.
    Error  Of a square of diagonal d straight ahead, (d/r)²/8 relative: 2.5e-3 for side 0.1 at distance 1.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.solid_angle(area=1e-4, distance=0.5).round(6))
    0.0004
    """
    return area / distance * cos_theta / distance


@_formula
def radiance(flux: _Real, area: _Positive, dw: _Positive, cos_theta: _Divisor = 1.0) -> Array:
    """Radiance of a beam: L = d²Φ/(dA cosθ dω).

    Shapes broadcast. Units W, m², sr, 1 -> W m⁻² sr⁻¹. Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.radiance(flux=1e-3, area=1e-4, dw=0.01, cos_theta=0.5).round(1))
    2000.0
    """
    return flux / area / dw / cos_theta


@_formula
def basic_radiance(L: _Real, n: _Positive = 1.0) -> Array:
    """Basic radiance L/n²: constant along a ray without losses, through refraction too (L₁/n₁² = L₂/n₂²).

    In vacuum it is L itself: the radiance that leaves p towards q arrives at q, at any distance.

    Shapes broadcast. Units W m⁻² sr⁻¹, refractive index -> W m⁻² sr⁻¹. Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.basic_radiance(L=100.0, n=1.5).round(3))
    44.444
    """
    return L / n / n


@_formula
def etendue(
    area_1: _NotNegative,
    area_2: _NotNegative,
    distance: _Positive,
    cos_theta_1: _Cosine = 1.0,
    cos_theta_2: _Cosine = 1.0,
    n: _Positive = 1.0,
) -> Array:
    """Étendue of the beam between two small areas: G = n² dA₁ cosθ₁ dA₂ cosθ₂/r², the same from either end.

    Shapes broadcast. Units m², m², m, 1, 1, refractive index -> m² sr. Error as `solid_angle`.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.etendue(area_1=1e-4, area_2=1e-4, distance=0.5))
    4e-08
    """
    return (n * area_1 * cos_theta_1 / distance) * (n * area_2 * cos_theta_2 / distance)


@_formula
def flux(L: _Real, G: _NotNegative, n: _Positive = 1.0) -> Array:
    """Flux of radiance L, given where the index is n, in a beam of étendue G: Φ = G L/n².

    Shapes broadcast. Units W m⁻² sr⁻¹, m² sr, refractive index -> W. Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> G = gn.radiometry.etendue(area_1=1e-4, area_2=1e-4, distance=0.5)
    >>> print(gn.radiometry.flux(L=1000.0, G=G))
    4e-05
    """
    return L / n / n * G


@_formula
def intensity(L: _Real, area: _NotNegative, cos_theta: _Cosine = 1.0) -> Array:
    """Intensity of a small flat emitter at θ from its normal: I = L dA cosθ.

    Shapes broadcast. Units W m⁻² sr⁻¹, m², 1 -> W sr⁻¹. Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.intensity(L=1000.0, area=1e-4, cos_theta=0.5))
    0.05
    """
    return L * area * cos_theta


@_formula
def point_irradiance(I: _Real, distance: _Positive, cos_theta: _EitherSide = 1.0) -> Array:  # noqa: E741  (I is intensity)
    """Irradiance by a point source: E = I cos⁺θ/r², zero from behind; θ is at the receiver.

    Shapes broadcast. Units W sr⁻¹, m, 1 -> W m⁻². Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.point_irradiance(I=100.0, distance=2.0, cos_theta=np.cos([0.0, 1.0, 2.0])).round(3))
    [25.    13.508  0.   ]
    """
    return I / distance * np.maximum(cos_theta, 0.0) / distance


@arguments.checked
def irradiance(L: Any, w: Any, dw: Any, normal: Any = (0.0, 0.0, 1.0)) -> Array:
    """Irradiance by light that arrives from directions w: E = Σ L cos⁺θ dω, summed over all of them.

    `irradiance(image, *latlong_pixels(*image.shape[:2]), normal)` is that of an environment map.

    Shapes w (..., 3); dw ...; L ... or (..., C); normal N... + (3,) -> N... or N... + (C,).
    Units  W m⁻² sr⁻¹, 1, sr, 1 -> W m⁻².
    Error  Of the sum for the integral, relative, L = 1: 3.0e-4 on `latlong_pixels(64, 128)`, as 1/height².
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> w, dw = gn.radiometry.latlong_pixels(180, 360)
    >>> print(gn.radiometry.irradiance(np.ones(dw.shape), w, dw).round(3))  # of a sky of radiance 1: pi
    3.142
    """
    read = {"L": _real_numbers("L", L), "w": _points("w", w, _VECTOR), "dw": _real_numbers("dw", dw)}
    read["normal"] = _points("normal", normal, _VECTOR)
    value, directions, weight, n = _one_dtype(read, {"L": L, "w": w, "dw": dw, "normal": normal}).values()
    samples = directions.shape[:-1]
    channels = value.shape[-1:] if value.ndim > len(samples) else ()
    try:
        terms = np.broadcast_to(value, samples + channels).reshape(-1, *(channels or (1,)))
        terms = terms * np.broadcast_to(weight, samples).reshape(-1, 1)
    except ValueError:
        raise ShapeError(
            f"L must have shape {samples} or {(*samples, 'C')} and dw {samples}, one for each direction w, "
            f"got L {value.shape} and dw {weight.shape}: put channels on the last axis"
        ) from None
    total = np.maximum(n @ directions.reshape(-1, 3).T, 0.0) @ terms
    return total if channels else total[..., 0]


def exitance(L: Any, w: Any, dw: Any, normal: Any = (0.0, 0.0, 1.0)) -> Array:
    """Exitance of a surface that emits L towards directions w: M = Σ L_e cos⁺θ dω.

    Shapes, units and error of `irradiance`; the light leaves.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> w, dw = gn.radiometry.latlong_pixels(180, 360)
    >>> print(gn.radiometry.exitance(2.0 * np.ones(dw.shape), w, dw).round(3))
    6.283
    """
    return irradiance(L, w, dw, normal)


def radiosity(L: Any, w: Any, dw: Any, normal: Any = (0.0, 0.0, 1.0)) -> Array:
    """Radiosity of a surface that sends L, emitted and reflected, towards directions w: B = Σ L_o cos⁺θ dω.

    Shapes, units and error of `irradiance`; the light leaves.
    Source Goral et al. 1984, doi:10.1145/964965.808601.

    Example
    >>> w, dw = gn.radiometry.latlong_pixels(180, 360)
    >>> L = gn.Lambertian(0.5).f(np.array([0.0, 0.0, 1.0]), w) * 1000.0  # lit by 1000 W/m^2 from above
    >>> print(gn.radiometry.radiosity(L, w, dw).round(1))
    500.0
    """
    return irradiance(L, w, dw, normal)


@_formula
def radiosity_balance(exitance: _Real, reflectance: _Reflectance, irradiance: _Real) -> Array:
    """Radiosity as emitted plus reflected flux: B = M + ρ E.

    Shapes broadcast. Units W m⁻², 1, W m⁻² -> W m⁻². Error rounding.
    Source Goral et al. 1984, doi:10.1145/964965.808601.

    Example
    >>> print(gn.radiometry.radiosity_balance(exitance=20.0, reflectance=0.5, irradiance=1000.0))
    520.0
    """
    return exitance + reflectance * irradiance


@_formula
def uniform_irradiance(L: _Real) -> Array:
    """Irradiance by the same radiance from the whole hemisphere: E = π L.

    Shapes any. Units W m⁻² sr⁻¹ -> W m⁻². Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.uniform_irradiance(L=100.0).round(2))
    314.16
    """
    return np.pi * L


@_formula
def lambertian_exitance(L: _Real) -> Array:
    """Exitance (or radiosity) of a surface whose radiance is the same in every direction: M = π L.

    Shapes any. Units W m⁻² sr⁻¹ -> W m⁻². Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.lambertian_exitance(L=100.0).round(2))
    314.16
    """
    return np.pi * L


# Reflectance


@_formula
def brdf(dL: _Real, L_i: _Positive, cos_theta_i: _Divisor, dw_i: _Positive) -> Array:
    """BRDF as it is measured, reflected radiance over incident irradiance: f = dL/(L_i cosθ_i dω_i).

    Shapes broadcast. Units W m⁻² sr⁻¹, W m⁻² sr⁻¹, 1, sr -> sr⁻¹. Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.brdf(dL=0.5, L_i=2.0, cos_theta_i=0.8, dw_i=0.01))
    31.25
    """
    return dL / L_i / cos_theta_i / dw_i


@_formula
def lambertian_albedo(f: _Real) -> Array:
    """Directional-hemispherical reflectance of a constant BRDF: ρ = π f.

    Shapes any. Units sr⁻¹ -> 1. Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160.

    Example
    >>> print(gn.radiometry.lambertian_albedo(0.1).round(4))
    0.3142
    """
    return np.pi * f


@_formula
def convert_reflectance(
    value: _Real, source: _Converted, target: _Converted, cos_theta_i: _Cosine = None, cos_theta_o: _Cosine = None
) -> Array:
    """Convert between "brdf" f, "reflectance_factor" π f, "brdf_cos_theta_i" f cosθ_i and "dsf" f cosθ_o.

    A cosine is needed only for its own quantity. Dividing by a cosine of 0 gives NaN: f is not known there.

    Shapes broadcast. Units as in `QUANTITIES`; for transmission pass |cosθ|. Error rounding.
    Source Nicodemus et al. 1977, NBS Monograph 160; ASTM E2387 for the DSF.

    Example
    >>> f = gn.radiometry.convert_reflectance(0.5, "reflectance_factor", "brdf")
    >>> print(f.round(4), gn.radiometry.convert_reflectance(f, "brdf", "dsf", cos_theta_o=0.8).round(4))
    0.1592 0.1273
    """
    factor = {"brdf": 1.0, "reflectance_factor": np.pi, "brdf_cos_theta_i": cos_theta_i, "dsf": cos_theta_o}
    for name in (source, target):
        if factor[name] is None:
            missing = "cos_theta_o" if name == "dsf" else "cos_theta_i"
            raise ParameterError(f"{name} must come with {missing}, got None: pass {missing}=")
    if source == target:
        return +value
    divisor = factor[source]
    if np.any(np.equal(divisor, 0.0)):
        divisor = np.where(np.equal(divisor, 0.0), np.nan, divisor)
    return value / divisor * factor[target]
