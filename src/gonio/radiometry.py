"""Radiometric quantities, the relations between them, and exact solid angles.

Plain functions of numbers or NumPy arrays that broadcast; float32 in gives float32 out. SI units, angles in
radians, wavelengths in nanometres. Directions, vertices and edges are `(..., 3)` and seen from the observer, who
is the origin; `w` and `normal` are unit vectors (the caller's duty). NaN in gives NaN out; other values out of
range raise. "Rounding" in a docstring's Error line means a few units in the last place, below 1e-15 relative.
"""

from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import ArrayTypeError, ParameterError, ShapeError

Array = NDArray[np.floating[Any]]

SPEED_OF_LIGHT = 299_792_458.0  # m s-1, exact in the SI
PLANCK = 6.626_070_15e-34  # J s, exact in the SI


class Quantity(NamedTuple):
    """One row of `QUANTITIES`; the unit is a CF string, as in the attributes of a data set."""

    name: str
    symbol: str
    unit: str
    definition: str
    source: str


_ISO, _NBS, _ASTM = "ISO 80000-7", "Nicodemus et al. 1977, NBS Monograph 160", "ASTM E2387"
_GORAL = "Goral et al. 1984, doi:10.1145/964965.808601"
_ROWS = (
    Quantity("radiant_energy", "Q", "J", "energy carried by light", _ISO),
    Quantity("flux", "Φ", "W", "power carried by light, dQ/dt", _ISO),
    Quantity("photon_flux", "Φ_p", "s-1", "photons per time, Φ λ/(h c) at one wavelength", _ISO),
    Quantity("intensity", "I", "W sr-1", "flux leaving a small source per solid angle, dΦ/dω", _ISO),
    Quantity("irradiance", "E", "W m-2", "flux arriving per area, ∫ L_i cosθ_i dω_i", _ISO),
    Quantity("exitance", "M", "W m-2", "flux emitted per area, ∫ L_e cosθ_e dω_e", _ISO),
    Quantity("radiosity", "B", "W m-2", "flux leaving per area, emitted + reflected, ∫ L_o cosθ_o dω_o", _GORAL),
    Quantity("radiant_exposure", "H", "J m-2", "energy arriving per area, ∫ E dt", _ISO),
    Quantity("radiance", "L", "W m-2 sr-1", "flux per projected area and solid angle, d²Φ/(dA cosθ dω)", _ISO),
    Quantity("basic_radiance", "L/n²", "W m-2 sr-1", "radiance over index squared, constant along a ray", _NBS),
    Quantity("spectral_radiance", "L_λ", "W m-2 sr-1 nm-1", "radiance per wavelength, dL/dλ", _ISO),
    Quantity("spectral_irradiance", "E_λ", "W m-2 nm-1", "irradiance per wavelength, dE/dλ", _ISO),
    Quantity("solid_angle", "ω", "sr", "area on the unit sphere, dω = dA cosθ/r²", _ISO),
    Quantity("projected_solid_angle", "Ω", "sr", "∫ cosθ dω, π for a hemisphere", _NBS),
    Quantity("etendue", "G", "m2 sr", "n² ∫∫ dA cosθ dω of a beam, which carries the flux G L/n²", _ISO),
    Quantity("brdf", "f", "sr-1", "radiance out per irradiance in, dL_o/(L_i cosθ_i dω_i)", _NBS),
    Quantity("brdf_cos_theta_i", "f cosθ_i", "sr-1", "BRDF times the cosine at the light", _NBS),
    Quantity("dsf", "f cosθ_o", "sr-1", "flux out per solid angle and flux in, (1/Φ_i) dΦ_o/dω_o", _ASTM),
    Quantity("reflectance_factor", "R", "1", "flux out over that of the ideal Lambertian, π f", _NBS),
    Quantity("directional_hemispherical_reflectance", "ρ(ω_i; 2π)", "1", "albedo, ∫ f cosθ_o dω_o", _NBS),
    Quantity("hemispherical_directional_reflectance_factor", "R(2π; ω_o)", "1", "∫ f cosθ_i dω_i", _NBS),
    Quantity("bihemispherical_reflectance", "ρ(2π; 2π)", "1", "∫∫ f cosθ_i cosθ_o dω_i dω_o/π", _NBS),
)
QUANTITIES = MappingProxyType({quantity.name: quantity for quantity in _ROWS})
"""The quantities by name: `for q in QUANTITIES.values(): print(q)`."""


class _Range(NamedTuple):
    low: float
    high: float
    rule: str
    hint: str
    open: bool = False  # True: the low end itself is excluded


# Dot products of unit vectors exceed 1 by rounding; 1e-6 is enough for float32.
_ONE = 1.0 + 1e-6
_ORDER = "check the sign, the unit and the order of the arguments"
_REAL = _Range(-np.inf, np.inf, "be a real number", _ORDER)
_POSITIVE = _Range(0.0, np.inf, "be greater than 0", _ORDER, open=True)
_NOT_NEGATIVE = _Range(0.0, np.inf, "be 0 or greater", _ORDER)
_REFLECTANCE = _Range(0.0, 1.0, "lie in [0, 1]", "a surface that adds no light reflects at most what arrives")
_COSINE = _Range(0.0, _ONE, "lie in [0, 1]", "give a cosine, not an angle, and abs() of it if the side is open")
_DIVISOR = _Range(0.0, _ONE, "lie in (0, 1]", "at grazing the quotient is undefined: leave those out", open=True)
_EITHER_SIDE = _Range(-_ONE, _ONE, "lie in [-1, 1]", "give a cosine, not an angle")
_POLAR = _Range(0.0, np.pi, "lie in [0, pi]", "angles are in radians: numpy.radians(degrees)")
_AZIMUTH = _Range(0.0, 2.0 * np.pi, "lie in [0, 2 pi]", "angles are in radians: numpy.radians(degrees)")


def _real(name: str, value: ArrayLike) -> Array:
    try:
        array = np.asarray(value)
    except Exception as error:  # ragged lists, and arrays of other libraries that refuse to be converted
        got = type(value).__name__
        raise ArrayTypeError(f"{name} must be real numbers, got a {got} NumPy cannot read: convert it") from error
    if array.dtype.kind not in "iuf":
        raise ArrayTypeError(f"{name} must be real numbers, got dtype {array.dtype}: convert it to float64")
    return array if array.dtype.kind == "f" else array.astype(np.float64)


def _read(**arguments: tuple[ArrayLike, _Range]) -> Any:
    """The checked arguments in order. Python numbers stay such, so that float32 arrays keep their dtype."""
    values = []
    for name, (value, allowed) in arguments.items():
        array = _real(name, value)
        wrong = (array < allowed.low) | (array > allowed.high) | (allowed.open & (array == allowed.low))
        if np.any(wrong):
            count = f" ({np.sum(wrong)} of {array.size} values)" if array.ndim else ""
            raise ParameterError(f"{name} must {allowed.rule}, got {array[wrong][0]:.9g}{count}: {allowed.hint}")
        values.append(float(array) if isinstance(value, int | float) else array)
    _broadcast(**{name: np.shape(value) for name, value in zip(arguments, values, strict=True)})
    return values if len(values) > 1 else values[0]


def _broadcast(**shapes: tuple[int, ...]) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        got = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ShapeError(f"shapes must broadcast, expected equal axes or 1, got {got}: add axes of 1") from None


def _vectors(**arguments: ArrayLike) -> list[Array]:
    """Finite `(..., 3)` arrays."""
    vectors = [_real(name, value) for name, value in arguments.items()]
    for name, v in zip(arguments, vectors, strict=True):
        if v.ndim == 0 or v.shape[-1] != 3:
            raise ShapeError(f"{name} must have shape (..., 3), got {v.shape}: put x, y, z on the last axis")
        if np.any(np.isinf(v)):
            raise ParameterError(f"{name} must be finite, got inf: use a distant point or a direction instead")
    return vectors


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)


# Flux, intensity, radiance, irradiance --------------------------------------------------------------------


def solid_angle(area: ArrayLike, distance: ArrayLike, cos_theta: ArrayLike = 1.0) -> Array:
    """Solid angle of a small area: dω = dA cosθ/r², θ between its normal and the line of sight.

    Shapes   all broadcast.
    Units    m², m, 1 -> sr.
    Error    For an area of diameter d, about (d/r)²: 2.0e-3 for a square of side 0.063 at distance 1.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    a, r, c = _read(
        area=(area, _NOT_NEGATIVE), distance=(distance, _POSITIVE), cos_theta=(cos_theta, _COSINE)
    )
    return a / r * c / r


def radiance(flux: ArrayLike, area: ArrayLike, dw: ArrayLike, cos_theta: ArrayLike = 1.0) -> Array:
    """Radiance of a beam: L = d²Φ/(dA cosθ dω).

    Shapes   all broadcast.
    Units    W, m², sr, 1 -> W m⁻² sr⁻¹.
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    phi, a, w, c = _read(
        flux=(flux, _REAL), area=(area, _POSITIVE), dw=(dw, _POSITIVE), cos_theta=(cos_theta, _DIVISOR)
    )
    return phi / a / w / c


def basic_radiance(L: ArrayLike, n: ArrayLike = 1.0) -> Array:
    """Basic radiance L/n², which is constant along a ray without losses, through refraction too.

    In vacuum (n = 1) it is the radiance itself: what leaves p towards q arrives at q from p, at any distance. Of
    the light that crosses a boundary L₁/n₁² = L₂/n₂²; multiply by the Fresnel transmittance for what crosses.

    Shapes   all broadcast.
    Units    W m⁻² sr⁻¹, refractive index 1 -> W m⁻² sr⁻¹.
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    value, index = _read(L=(L, _REAL), n=(n, _POSITIVE))
    return value / index / index


def etendue(
    area_1: ArrayLike,
    area_2: ArrayLike,
    distance: ArrayLike,
    cos_theta_1: ArrayLike = 1.0,
    cos_theta_2: ArrayLike = 1.0,
    n: ArrayLike = 1.0,
) -> Array:
    """Étendue of the beam between two small areas: G = n² dA₁ cosθ₁ dA₂ cosθ₂/r², the same from either end.

    Shapes   all broadcast.
    Units    m², m², m, 1, 1, index n of the medium between -> m² sr.
    Error    As `solid_angle`: about (d/r)² for areas of diameter d.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    a, b, r, c, k, index = _read(
        area_1=(area_1, _NOT_NEGATIVE),
        area_2=(area_2, _NOT_NEGATIVE),
        distance=(distance, _POSITIVE),
        cos_theta_1=(cos_theta_1, _COSINE),
        cos_theta_2=(cos_theta_2, _COSINE),
        n=(n, _POSITIVE),
    )
    return index * index * (a / r * c) * (b / r * k)


def flux(L: ArrayLike, G: ArrayLike, n: ArrayLike = 1.0) -> Array:
    """Flux in a beam of étendue G and radiance L: Φ = G L/n².

    Shapes   all broadcast.
    Units    W m⁻² sr⁻¹, m² sr, index n where L is given -> W.
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    value, g, index = _read(L=(L, _REAL), G=(G, _NOT_NEGATIVE), n=(n, _POSITIVE))
    return value / index / index * g


def intensity(L: ArrayLike, area: ArrayLike, cos_theta: ArrayLike = 1.0) -> Array:
    """Intensity of a small flat emitter of radiance L, at θ from its normal: I = L dA cosθ.

    Shapes   all broadcast.
    Units    W m⁻² sr⁻¹, m², 1 -> W sr⁻¹.
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    value, a, c = _read(L=(L, _REAL), area=(area, _NOT_NEGATIVE), cos_theta=(cos_theta, _COSINE))
    return value * a * c


def point_irradiance(I: ArrayLike, distance: ArrayLike, cos_theta: ArrayLike = 1.0) -> Array:  # noqa: E741
    """Irradiance by a point source of intensity I: E = I cos⁺θ/r², zero where it shines on the back.

    Shapes   all broadcast.
    Units    W sr⁻¹, m, 1 (θ between the receiver's normal and the direction to the source) -> W m⁻².
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    value, r, c = _read(I=(I, _REAL), distance=(distance, _POSITIVE), cos_theta=(cos_theta, _EITHER_SIDE))
    return value / r * np.maximum(c, 0.0) / r


def _cosine_sum(L: ArrayLike, w: ArrayLike, dw: ArrayLike, normal: ArrayLike) -> Array:
    directions, n = _vectors(w=w, normal=normal)
    value, weight = _real("L", L), _real("dw", dw)
    samples = directions.shape[:-1]
    channels = value.shape[-1:] if value.ndim > len(samples) else ()
    try:
        value = np.broadcast_to(value, samples + channels)
        weight = np.broadcast_to(weight, samples)
    except ValueError:
        raise ShapeError(
            f"L must have shape {samples} or {samples} + (C,) and dw {samples}, the batch shape of w, "
            f"got L {value.shape} and dw {weight.shape}: one radiance and one solid angle per direction"
        ) from None
    cosine = np.maximum(n @ directions.reshape(-1, 3).T, 0.0)
    total = cosine @ (value.reshape(-1, *(channels or (1,))) * weight.reshape(-1, 1))
    return total if channels else total[..., 0]


def irradiance(L: ArrayLike, w: ArrayLike, dw: ArrayLike, normal: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Irradiance by light that arrives from directions w: E = Σ L cos⁺θ dω, summed over all of them.

    `irradiance(image, *latlong_pixels(*image.shape[:2]), normal)` is that of an environment map.

    Shapes   w: (..., 3); dw: ...; L: ... or (..., C) with a last channel axis; normal: (3,) or any (N..., 3).
             The result is N... or (N..., C).
    Units    W m⁻² sr⁻¹, 1, sr, 1 -> W m⁻².
    Error    That of the quadrature: for L = 1 on `latlong_pixels(64, 128)` 4.0e-4 relative, falling as 1/height².
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    return _cosine_sum(L, w, dw, normal)


def exitance(L: ArrayLike, w: ArrayLike, dw: ArrayLike, normal: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Exitance of a surface that emits L towards directions w: M = Σ L_e cos⁺θ dω.

    Shapes   as `irradiance`.
    Units    W m⁻² sr⁻¹, 1, sr, 1 -> W m⁻².
    Error    as `irradiance`.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    return _cosine_sum(L, w, dw, normal)


def radiosity(L: ArrayLike, w: ArrayLike, dw: ArrayLike, normal: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Radiosity of a surface that sends L, emitted and reflected, towards w: B = Σ L_o cos⁺θ dω.

    Shapes   as `irradiance`.
    Units    W m⁻² sr⁻¹, 1, sr, 1 -> W m⁻².
    Error    as `irradiance`.
    Source   Goral et al. 1984, doi:10.1145/964965.808601.
    """
    return _cosine_sum(L, w, dw, normal)


def radiosity_balance(exitance: ArrayLike, reflectance: ArrayLike, irradiance: ArrayLike) -> Array:
    """Radiosity as what a surface emits plus what it reflects: B = M + ρ E.

    Shapes   all broadcast.
    Units    W m⁻², 1, W m⁻² -> W m⁻².
    Error    Rounding.
    Source   Goral et al. 1984, doi:10.1145/964965.808601.
    """
    m, rho, e = _read(
        exitance=(exitance, _REAL), reflectance=(reflectance, _REFLECTANCE), irradiance=(irradiance, _REAL)
    )
    return m + rho * e


def uniform_irradiance(L: ArrayLike) -> Array:
    """Irradiance by the same radiance L from the whole hemisphere: E = π L.

    Shapes   any.
    Units    W m⁻² sr⁻¹ -> W m⁻².
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    return np.pi * _read(L=(L, _REAL))


def lambertian_exitance(L: ArrayLike) -> Array:
    """Exitance of a Lambertian emitter, whose radiance is L in every direction: M = π L.

    Shapes   any.
    Units    W m⁻² sr⁻¹ -> W m⁻².
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    return np.pi * _read(L=(L, _REAL))


def lambertian_radiance(M: ArrayLike) -> Array:
    """Radiance of a Lambertian surface of exitance (or radiosity) M: L = M/π.

    Shapes   any.
    Units    W m⁻² -> W m⁻² sr⁻¹.
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    return _read(M=(M, _REAL)) / np.pi


# Reflectance ----------------------------------------------------------------------------------------------


def brdf(dL: ArrayLike, L_i: ArrayLike, cos_theta_i: ArrayLike, dw_i: ArrayLike) -> Array:
    """BRDF from what is measured, reflected radiance over incident irradiance: f = dL/(L_i cosθ_i dω_i).

    Shapes   all broadcast.
    Units    W m⁻² sr⁻¹, W m⁻² sr⁻¹, 1, sr -> sr⁻¹.
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    out, light, c, w = _read(
        dL=(dL, _REAL), L_i=(L_i, _POSITIVE), cos_theta_i=(cos_theta_i, _DIVISOR), dw_i=(dw_i, _POSITIVE)
    )
    return out / light / c / w


def lambertian_brdf(albedo: ArrayLike) -> Array:
    """BRDF of a Lambertian surface: f = ρ/π.

    Shapes   any.
    Units    1 -> sr⁻¹.
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    return _read(albedo=(albedo, _REFLECTANCE)) / np.pi


def lambertian_albedo(f: ArrayLike) -> Array:
    """Directional-hemispherical reflectance of a constant BRDF: ρ = π f.

    Shapes   any.
    Units    sr⁻¹ -> 1.
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160.
    """
    return np.pi * _read(f=(f, _REAL))


def convert_reflectance(
    value: ArrayLike,
    source: str,
    target: str,
    cos_theta_i: ArrayLike | None = None,
    cos_theta_o: ArrayLike | None = None,
) -> Array:
    """Convert between "brdf" f, "reflectance_factor" π f, "brdf_cos_theta_i" f cosθ_i and "dsf" f cosθ_o.

    A cosine is needed only where its quantity is the source or the target. Dividing by a cosine of 0 gives NaN:
    at grazing, f cosθ does not say what f is.

    Shapes   all broadcast.
    Units    of the names, see `QUANTITIES`; for transmission give |cosθ|.
    Error    Rounding.
    Source   Nicodemus et al. 1977, NBS Monograph 160; ASTM E2387 (DSF).
    """
    cosines = {"brdf_cos_theta_i": ("cos_theta_i", cos_theta_i), "dsf": ("cos_theta_o", cos_theta_o)}
    factor: dict[str, Any] = {"brdf": 1.0, "reflectance_factor": np.pi}
    for name, (argument, cosine) in cosines.items():
        if cosine is not None:
            factor[name] = _read(**{argument: (cosine, _COSINE)})
        elif name in (source, target):
            raise ParameterError(f"{name} needs {argument}, got None: pass the cosine of each value's direction")
    for name in (source, target):
        if name not in factor:
            names = ", ".join(["brdf", "reflectance_factor", *cosines])
            raise ParameterError(f"quantity must be one of {names}, got {name!r}: name what the data hold")
    number, divisor, multiplier = _read(
        value=(value, _REAL), source=(factor[source], _REAL), target=(factor[target], _REAL)
    )
    if source == target:
        return number
    if np.any(np.equal(divisor, 0.0)):
        divisor = np.where(np.equal(divisor, 0.0), np.nan, divisor)
    return number / divisor * multiplier


# Wavelength, frequency, photons ---------------------------------------------------------------------------


def convert_spectral(value: ArrayLike, wavelength: ArrayLike, source: str, target: str) -> Array:
    """Convert a spectral density (of radiance, flux, ...) between "wavelength", "frequency" and "wavenumber".

    L_ν = L_λ λ²/c and L_σ = L_λ λ², because L_λ dλ = L_ν dν = L_σ dσ in magnitude.

    Shapes   all broadcast.
    Units    per nm, per Hz, per cm⁻¹; the wavelength in vacuum, nm (in air it is 0.03 % shorter).
    Error    Rounding.
    Source   The chain rule; the speed of light is exact in the SI.
    """
    number, nm = _read(value=(value, _REAL), wavelength=(wavelength, _POSITIVE))
    nm_per = {"wavelength": 1.0, "frequency": nm * nm * (1e-9 / SPEED_OF_LIGHT), "wavenumber": nm * nm * 1e-7}
    for name in (source, target):
        if name not in nm_per:
            raise ParameterError(f"density must be one of {', '.join(nm_per)}, got {name!r}: name the abscissa")
    return number / nm_per[source] * nm_per[target]


def photon_flux(flux: ArrayLike, wavelength: ArrayLike) -> Array:
    """Photons per second in a monochromatic flux: Φ_p = Φ λ/(h c).

    Shapes   all broadcast.
    Units    W, nm in vacuum -> s⁻¹ (an irradiance gives s⁻¹ m⁻², and so on).
    Error    Rounding.
    Source   Planck's E = h c/λ; h and c are exact in the SI.
    """
    phi, nm = _read(flux=(flux, _REAL), wavelength=(wavelength, _POSITIVE))
    return phi * nm / (1e9 * PLANCK * SPEED_OF_LIGHT)


def radiant_flux(photon_flux: ArrayLike, wavelength: ArrayLike) -> Array:
    """Monochromatic flux of so many photons per second: Φ = Φ_p h c/λ.

    Shapes   all broadcast.
    Units    s⁻¹, nm in vacuum -> W.
    Error    Rounding.
    Source   Planck's E = h c/λ; h and c are exact in the SI.
    """
    photons, nm = _read(photon_flux=(photon_flux, _REAL), wavelength=(wavelength, _POSITIVE))
    return photons / nm * (1e9 * PLANCK * SPEED_OF_LIGHT)


# Solid angles ---------------------------------------------------------------------------------------------


def solid_angle_cone(half_angle: ArrayLike) -> Array:
    """Solid angle of a circular cone: ω = 2π (1 − cos a) = 4π sin²(a/2).

    Shapes   any.
    Units    rad, 0 to π -> sr.
    Error    Rounding, also for a = 1e-8.
    Source   Archimedes' theorem on the area of a spherical cap.
    """
    half = np.sin(0.5 * _read(half_angle=(half_angle, _POLAR)))
    return 4.0 * np.pi * half * half


def solid_angle_cap(theta_0: ArrayLike, theta_1: ArrayLike) -> Array:
    """Solid angle between two polar angles, all around: ω = 2π (cosθ₀ − cosθ₁); negative for θ₁ < θ₀.

    Shapes   all broadcast.
    Units    rad, 0 to π -> sr.
    Error    Rounding, also for thin belts.
    Source   Archimedes' theorem on the area of a spherical cap.
    """
    return solid_angle_latlong_pixel(theta_0, theta_1, 2.0 * np.pi)


def solid_angle_latlong_pixel(theta_0: ArrayLike, theta_1: ArrayLike, width: ArrayLike) -> Array:
    """Solid angle of a latitude–longitude pixel: ω = Δφ (cosθ₀ − cosθ₁) = 2Δφ sin((θ₀+θ₁)/2) sin((θ₁−θ₀)/2).

    Shapes   all broadcast.
    Units    polar angles 0 to π, width Δφ up to 2π, rad -> sr.
    Error    Rounding, also for thin pixels.
    Source   The integral of sinθ dθ dφ.
    """
    low, high, dphi = _read(theta_0=(theta_0, _POLAR), theta_1=(theta_1, _POLAR), width=(width, _AZIMUTH))
    return 2.0 * dphi * np.sin(0.5 * (low + high)) * np.sin(0.5 * (high - low))


def latlong_pixels(height: int, width: int) -> tuple[Array, Array]:
    """Directions of the pixel centres of an equirectangular map, and the exact solid angles of its pixels.

    z is up, θ = 0 at the upper edge of row 0, φ = 0 at the left edge of column 0, φ from +x towards +y.

    Shapes   -> w: (height, width, 3), dw: (height, width).
    Units    unit vectors; sr.
    Error    MEASURE_MAP
    Source   The integral of sinθ dθ dφ.
    """
    for name, value in (("height", height), ("width", width)):
        if not isinstance(value, int | np.integer) or value < 1:
            raise ParameterError(f"{name} must be a whole number from 1, got {value!r}: give a number of pixels")
    edge = np.linspace(0.0, np.pi, height + 1)
    theta = 0.5 * (edge[:-1] + edge[1:])[:, None]
    phi = (np.arange(width) + 0.5) * (2.0 * np.pi / width)
    w = np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta))
    row = solid_angle_latlong_pixel(edge[:-1], edge[1:], 2.0 * np.pi / width)
    return np.stack(w, axis=-1), np.repeat(row[:, None], width, axis=1)


def solid_angle_sphere(radius: ArrayLike, distance: ArrayLike) -> Array:
    """Solid angle of a sphere whose centre is at a distance: ω = 2π (1 − √(1 − r²/d²)); 4π from inside it.

    Shapes   all broadcast.
    Units    m, m -> sr. On the surface, d = r: 2π, the limit from outside.
    Error    Rounding, also for d/r = 1e12.
    Source   The tangent cone, sin a = r/d.
    """
    r, d = _read(radius=(radius, _NOT_NEGATIVE), distance=(distance, _POSITIVE))
    s = np.minimum(r / d, 1.0)
    outside = 2.0 * np.pi * s * s / (1.0 + np.sqrt((1.0 - s) * (1.0 + s)))
    return np.where(np.less(d, r), 4.0 * np.pi, outside)[()]


def _scaled(*vectors: Array) -> Array:
    """The vectors on axis −2, over a power of two near the largest: exact, and products cannot overflow."""
    try:
        v = np.stack(np.broadcast_arrays(*vectors), axis=-2)
    except ValueError:
        got = ", ".join(str(v.shape) for v in vectors)
        raise ShapeError(f"vertices and edges must broadcast against each other, got {got}: add axes of 1") from None
    exponent = np.frexp(np.max(np.abs(v), axis=(-2, -1), keepdims=True))[1]
    return np.ldexp(v, -exponent)


def _triangle(volume: Array, a: Array, b: Array, c: Array) -> Array:
    """Signed solid angle from the triple product a·(b×c), which callers know better ways to compute."""
    u, v, w = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
    return 2.0 * np.arctan2(volume, u * v * w + _dot(a, b) * w + _dot(b, c) * u + _dot(c, a) * v)


def solid_angle_triangle(a: ArrayLike, b: ArrayLike, c: ArrayLike, signed: bool = False) -> Array:
    """Solid angle of a triangle: tan(ω/2) = a·(b×c)/(|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|).

    With `signed` it is positive where a·(b×c) is; over a closed mesh it then sums to ±4π inside and 0 outside.
    In the plane of the triangle it is 2π inside and 0 outside.

    Shapes   vertices (..., 3), relative to the observer, all broadcast; the result is `...`.
    Units    m (or any length) -> sr.
    Error    MEASURE_TRI
    Source   Van Oosterom & Strackee 1983, doi:10.1109/TBME.1983.325207.
    """
    corners = _scaled(*_vectors(a=a, b=b, c=c))
    nearest = np.argmin(np.linalg.norm(corners, axis=-1), axis=-1, keepdims=True)
    turn = (nearest + np.arange(3)) % 3
    p, q, s = np.moveaxis(np.take_along_axis(corners, turn[..., None], axis=-2), -2, 0)
    # Differences of neighbouring corners are exact; the nearest one as the apex loses least where they are not.
    angle = _triangle(_dot(p, np.cross(q - p, s - p)), p, q, s)
    return angle if signed else np.abs(angle)


def solid_angle_rectangle(corner: ArrayLike, edge_u: ArrayLike, edge_v: ArrayLike) -> Array:
    """Solid angle of a rectangle in any position, from one corner and the two edges that leave it.

    Where the foot of the perpendicular lies inside, ω = Σ atan(|x y|/(z √(x² + y² + z²))) over the four corners
    (x, y, z) in the rectangle's frame, which is stable close to it; elsewhere two triangles, stable far away.

    Shapes   all (..., 3), the corner relative to the observer, all broadcast; the result is `...`.
    Units    m (or any length) -> sr.
    Error    MEASURE_RECT
    Source   Integral of z dx dy/(x² + y² + z²)^(3/2); triangles as `solid_angle_triangle`.
    """
    p, u, v = np.moveaxis(_scaled(*_vectors(corner=corner, edge_u=edge_u, edge_v=edge_v)), -2, 0)
    length_u, length_v = np.linalg.norm(u, axis=-1), np.linalg.norm(v, axis=-1)
    if np.any(np.abs(_dot(u, v)) > 1e-6 * length_u * length_v):
        worst = np.nanmax(np.abs(_dot(u, v)) / np.maximum(length_u * length_v, np.finfo(p.dtype).tiny))
        raise ParameterError(f"edges of a rectangle must be perpendicular, got cosine {worst:.3g}: use two triangles")
    safe_u, safe_v = np.where(length_u > 0.0, length_u, 1.0), np.where(length_v > 0.0, length_v, 1.0)
    x0, y0 = _dot(p, u) / safe_u, _dot(p, v) / safe_v
    x1, y1 = x0 + length_u, y0 + length_v
    z = np.abs(_dot(p, np.cross(u, v))) / (safe_u * safe_v)
    above = sum(np.arctan2(np.abs(x * y), z * np.sqrt(x * x + y * y + z * z)) for x in (x0, x1) for y in (y0, y1))
    flip_u, flip_v = np.abs(x1) < np.abs(x0), np.abs(y1) < np.abs(y0)
    p = p + np.where(flip_u[..., None], u, 0.0) + np.where(flip_v[..., None], v, 0.0)
    u, v = np.where(flip_u[..., None], -u, u), np.where(flip_v[..., None], -v, v)
    volume = np.abs(_dot(p, np.cross(u, v)))
    beside = _triangle(volume, p, p + u, p + u + v) + _triangle(volume, p, p + u + v, p + v)
    return np.where((x0 <= 0.0) & (x1 >= 0.0) & (y0 <= 0.0) & (y1 >= 0.0), above, beside)[()]


def solid_angle_rectangle_on_axis(width: ArrayLike, height: ArrayLike, distance: ArrayLike) -> Array:
    """Solid angle of a rectangle seen from straight above its centre: ω = 4 atan(w h/(2d √(4d² + w² + h²))).

    Shapes   all broadcast.
    Units    m, m, m -> sr.
    Error    Rounding.
    Source   Integral of z dx dy/(x² + y² + z²)^(3/2).
    """
    w, h, d = _read(width=(width, _NOT_NEGATIVE), height=(height, _NOT_NEGATIVE), distance=(distance, _POSITIVE))
    d = d + d
    return 4.0 * np.arctan2(w / d * h, np.hypot(d, np.hypot(w, h)))


# Projected solid angles: the irradiance of uniform light of radiance 1 ------------------------------------


def projected_solid_angle_cone(half_angle: ArrayLike, theta: ArrayLike = 0.0) -> Array:
    """Projected solid angle of the visible part of a cone whose axis is at θ from the normal.

    π sin²a cosθ above the horizon. Across it, with s = √(−cos(θ + a) cos(θ − a)), it is
    atan2(s, cos a) + atan2(s, −cos a cosθ) sin²a cosθ − s cos a. A sphere is the cone of sin a = r/d.

    Shapes   all broadcast.
    Units    rad, 0 to π -> sr.
    Error    MEASURE_PCONE
    Source   Lambert 1760, Photometria: the contour integral, here over the cone's arc and the horizon's.
    """
    a, t = _read(half_angle=(half_angle, _POLAR), theta=(theta, _POLAR))
    k, c, sine = np.cos(a), np.cos(t), np.sin(a)
    s = np.sqrt(np.maximum(-np.cos(t + a) * np.cos(t - a), 0.0))
    return np.arctan2(s, k) + np.arctan2(s, -k * c) * sine * sine * c - k * s


def projected_solid_angle_latlong_pixel(theta_0: ArrayLike, theta_1: ArrayLike, width: ArrayLike) -> Array:
    """Projected solid angle of a pixel about the normal: ½ Δφ (sin²θ₁ − sin²θ₀) of what is above the horizon.

    Shapes   all broadcast.
    Units    polar angles 0 to π, width Δφ up to 2π, rad -> sr; negative for θ₁ < θ₀.
    Error    Rounding, also for thin pixels, but for the last digits of π/2 − θ next to the horizon.
    Source   The integral of cosθ sinθ dθ dφ.
    """
    low, high, dphi = _read(theta_0=(theta_0, _POLAR), theta_1=(theta_1, _POLAR), width=(width, _AZIMUTH))
    low, high = np.minimum(low, 0.5 * np.pi), np.minimum(high, 0.5 * np.pi)
    return 0.5 * dphi * np.sin(high + low) * np.sin(high - low)


def _clip(offset: Array, height: Array) -> Array:
    """Triangles (..., 3, 3) cut at height 0: rings of 6 corners, of which some coincide."""
    ring = []
    for i in range(3):
        here, there = offset[..., i, :], offset[..., (i + 1) % 3, :]
        h, k = height[..., i], height[..., (i + 1) % 3]
        up, next_up = h > 0.0, k > 0.0
