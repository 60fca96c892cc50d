"""Roughness as others state it, to and from `alpha`, the slope scale of gonio's microfacet surfaces.

Plain functions of numbers or NumPy arrays; each `alpha_from_...` has its inverse `..._from_alpha`. Values have no unit
(slopes); angles are in radians. Nothing is clipped; the docstrings say where other programs clamp. A conversion between
different distributions (Gaussian to GGX) keeps the formula's parameter, not the appearance.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import numpy as np

from ..declared.arguments import Declared
from ..declared.arrays import formula, in_range
from ..declared.namespace import own_names

LEAST, MOST = 1e-100, 1e100
"""Bounds of numbers whose squares are numbers too."""

Rough = Annotated[Any, Declared("a roughness, or what it is made of, has no unit", 0.0, MOST)]
AboveZero = Annotated[Any, Declared("what is divided by", LEAST, MOST)]
BelowOne = Annotated[Any, Declared("of the narrower direction", 0.0, 1.0 - 1e-12)]
Share = Annotated[Any, Declared("a slider", 0.0, 1.0)]

convert = partial(formula, double=True)
"""Conversions are computed in double precision."""


# Slopes.


@convert
def alpha_from_beckmann_m(m: Rough) -> Any:
    """alpha = m, the "root mean square slope" of Cook & Torrance 1982 and Beckmann's m: in fact sqrt(2) times it.

    Example
    >>> print(gn.radiometry.roughness.alpha_from_beckmann_m(0.3))
    0.3
    """
    return m


@convert
def beckmann_m_from_alpha(alpha: Rough) -> Any:
    """m = alpha; see `alpha_from_beckmann_m`.

    Example
    >>> print(gn.radiometry.roughness.beckmann_m_from_alpha(0.3))
    0.3
    """
    return alpha


@convert
def alpha_from_rms_slope(sigma: Rough) -> Any:
    """alpha = sqrt(2) sigma, sigma the RMS slope along one axis (x or y) of a Gaussian surface. Heitz 2014, JCGT 3(2).

    Of the whole gradient the RMS is sqrt(2) sigma = alpha. GGX has no finite RMS slope.

    Example
    >>> print(gn.radiometry.roughness.alpha_from_rms_slope(0.1).round(4))
    0.1414
    """
    return np.sqrt(2.0) * sigma


@convert
def rms_slope_from_alpha(alpha: Rough) -> Any:
    """sigma = alpha/sqrt(2), along one axis; see `alpha_from_rms_slope`.

    Example
    >>> print(gn.radiometry.roughness.rms_slope_from_alpha(0.2).round(4))
    0.1414
    """
    return alpha / np.sqrt(2.0)


@convert
def alpha_from_correlation(sigma_height: Rough, correlation_length: AboveZero) -> Any:
    """alpha = 2 sigma_h / tau: a Gaussian surface of RMS height sigma_h and correlation length tau [same unit].

    Its autocovariance is sigma_h^2 exp(-(x/tau)^2), its RMS slope along an axis sqrt(2) sigma_h/tau.
    Beckmann & Spizzichino 1963.

    Example
    >>> print(gn.radiometry.roughness.alpha_from_correlation(sigma_height=0.28, correlation_length=2.0))  # in um
    0.28
    """
    height = sigma_height
    return 2.0 * height / correlation_length


@convert
def alpha_from_ward(alpha: Rough) -> Any:
    """alpha = Ward's alpha, which he calls the standard deviation (RMS) of the surface slope; his lobe is
    exp(-tan^2/alpha^2), Beckmann's. Ward 1992, SIGGRAPH.

    Example
    >>> print(gn.radiometry.roughness.alpha_from_ward(0.15))
    0.15
    """
    return alpha


@convert
def ward_from_alpha(alpha: Rough) -> Any:
    """Ward's alpha = alpha; see `alpha_from_ward`.

    Example
    >>> print(gn.radiometry.roughness.ward_from_alpha(0.15))
    0.15
    """
    return alpha


# Exponents.


@convert
def alpha_from_blinn_phong_n(n: Rough) -> Any:
    """alpha = sqrt(2/(n + 2)), n the exponent of cos(theta_m): same D at the pole. Walter et al. 2007.

    Example
    >>> print(gn.radiometry.roughness.alpha_from_blinn_phong_n([10, 100, 1000]).round(4))
    [0.4082 0.14   0.0447]
    """
    return np.sqrt(2.0 / (n + 2.0))


@convert
def blinn_phong_n_from_alpha(alpha: AboveZero) -> Any:
    """n = 2/alpha^2 - 2; negative for alpha > 1. See `alpha_from_blinn_phong_n`.

    Example
    >>> print(gn.radiometry.roughness.blinn_phong_n_from_alpha(0.25))
    30.0
    """
    return 2.0 / np.square(alpha) - 2.0


@convert
def blinn_phong_n_from_phong_n(n: Rough) -> Any:
    """n_h = 4 n: a lobe cos^n about the mirror direction is about as wide as one cos^(4n) of the half vector.

    The mirror direction moves twice as far as the normal, so theta_r = 2 theta_h in the plane of incidence.

    Example
    >>> n = gn.radiometry.roughness.blinn_phong_n_from_phong_n(20.0)
    >>> print(n, gn.radiometry.roughness.alpha_from_blinn_phong_n(n).round(4))
    80.0 0.1562
    """
    return 4.0 * n


@convert
def phong_n_from_blinn_phong_n(n: Rough) -> Any:
    """n_r = n/4; see `blinn_phong_n_from_phong_n`.

    Example
    >>> print(gn.radiometry.roughness.phong_n_from_blinn_phong_n(80.0))
    20.0
    """
    return n / 4.0


# "Roughness".


@convert
def alpha_from_perceptual(roughness: Rough) -> Any:
    """alpha = roughness^2: Disney (Burley 2012), glTF 2.0, OpenPBR, MaterialX surface shaders, Filament, Unreal.

    Example
    >>> print(gn.radiometry.roughness.alpha_from_perceptual(0.5))
    0.25
    """
    return np.square(roughness)


@convert
def perceptual_from_alpha(alpha: Rough) -> Any:
    """roughness = sqrt(alpha); see `alpha_from_perceptual`.

    Example
    >>> print(gn.radiometry.roughness.perceptual_from_alpha(0.25))
    0.5
    """
    return np.sqrt(alpha)


@convert
def alpha_from_smoothness(smoothness: Share) -> Any:
    """alpha = (1 - smoothness)^2: "gloss" or "smoothness" maps, as in Unity.

    Example
    >>> print(round(gn.radiometry.roughness.alpha_from_smoothness(0.7), 4))
    0.09
    """
    return np.square(1.0 - smoothness)


@convert
def smoothness_from_alpha(alpha: Share) -> Any:
    """smoothness = 1 - sqrt(alpha); see `alpha_from_smoothness`.

    Example
    >>> print(gn.radiometry.roughness.smoothness_from_alpha(0.25))
    0.5
    """
    return 1.0 - np.sqrt(alpha)


@convert
def alpha_from_pbrt(roughness: Rough) -> Any:
    """alpha = sqrt(roughness): pbrt-v4 where "remaproughness" is true, its default.

    Example
    >>> print(gn.radiometry.roughness.alpha_from_pbrt(0.25))
    0.5
    """
    return np.sqrt(roughness)


@convert
def pbrt_from_alpha(alpha: Rough) -> Any:
    """roughness = alpha^2; see `alpha_from_pbrt`.

    Example
    >>> print(gn.radiometry.roughness.pbrt_from_alpha(0.5))
    0.25
    """
    return np.square(alpha)


_PBRT_V3 = (1.62142, 0.819955, 0.1734, 0.0171201, 0.000640711)


@convert
def alpha_from_pbrt_v3(roughness: Rough) -> Any:
    """alpha = 1.62142 + 0.819955 x + 0.1734 x^2 + 0.0171201 x^3 + 0.000640711 x^4, x = log(max(roughness, 0.001)).

    pbrt-v3's remapping, from 0.047 at 0.001 to 1.62 at 1.

    Example
    >>> print(gn.radiometry.roughness.alpha_from_pbrt_v3(0.1).round(4))
    0.4618
    """
    x = np.log(np.maximum(roughness, 1e-3))
    return np.polynomial.polynomial.polyval(x, _PBRT_V3)


@convert
def pbrt_v3_from_alpha(alpha: Any) -> Any:
    """The roughness in [0.001, 1] that pbrt-v3 remaps to alpha; see `alpha_from_pbrt_v3`. By bisection, to rounding.

    Example
    >>> print(gn.radiometry.roughness.pbrt_v3_from_alpha(0.3).round(4))
    0.0464
    """
    ends = alpha_from_pbrt_v3(1e-3), alpha_from_pbrt_v3(1.0)
    goal = in_range("alpha", alpha, Declared("what pbrt-v3 can say", float(ends[0]), float(ends[1]))).astype(float)
    low, high = np.full(goal.shape, np.log(1e-3)), np.zeros(goal.shape)
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = np.polynomial.polynomial.polyval(middle, _PBRT_V3) < goal
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.exp(0.5 * (low + high))[()]


# Two directions.


@convert
def alphas_from_disney(roughness: Rough, anisotropic: Share) -> tuple[Any, Any]:
    """alpha_x = roughness^2/aspect, alpha_y = roughness^2 aspect, aspect = sqrt(1 - 0.9 anisotropic). Burley 2012.

    Example
    >>> alpha_x, alpha_y = gn.radiometry.roughness.alphas_from_disney(0.5, anisotropic=0.8)
    >>> print(round(alpha_x, 4), round(alpha_y, 4))
    0.4725 0.1323
    """
    aspect = np.sqrt(1.0 - 0.9 * anisotropic)
    alpha = alpha_from_perceptual(roughness)
    return alpha / aspect, alpha * aspect


@convert
def disney_from_alphas(alpha_x: AboveZero, alpha_y: Rough) -> tuple[Any, Any]:
    """(roughness, anisotropic) of alpha_x >= alpha_y; see `alphas_from_disney`. Burley's anisotropic ends at
    alpha_y/alpha_x = 0.1.

    Example
    >>> roughness, anisotropic = gn.radiometry.roughness.disney_from_alphas(0.4, 0.2)
    >>> print(round(roughness, 4), round(anisotropic, 4))
    0.5318 0.5556
    """
    x, y = np.asarray(alpha_x), np.asarray(alpha_y)
    range_ = Declared("x is the direction of the greater alpha", 0.1 - 1e-12, 1.0 + 1e-12)
    ratio = in_range("alpha_y/alpha_x", y / x, range_)
    return np.power(x * y, 0.25)[()], np.clip((1.0 - ratio) / 0.9, 0.0, 1.0)[()]


@convert
def alphas_from_openpbr(roughness: Rough, anisotropy: Share) -> tuple[Any, Any]:
    """alpha_x = roughness^2 sqrt(2/(1 + (1 - anisotropy)^2)), alpha_y = (1 - anisotropy) alpha_x. OpenPBR 1.0.

    The mean of alpha_x^2 and alpha_y^2 stays roughness^4.

    Example
    >>> alpha_x, alpha_y = gn.radiometry.roughness.alphas_from_openpbr(0.5, anisotropy=0.8)
    >>> print(round(alpha_x, 4), round(alpha_y, 4))
    0.3467 0.0693
    """
    narrow = 1.0 - anisotropy
    wide = alpha_from_perceptual(roughness) * np.sqrt(2.0 / (1.0 + np.square(narrow)))
    return wide, narrow * wide


@convert
def openpbr_from_alphas(alpha_x: AboveZero, alpha_y: Rough) -> tuple[Any, Any]:
    """(roughness, anisotropy) of alpha_x >= alpha_y; see `alphas_from_openpbr`.

    Example
    >>> roughness, anisotropy = gn.radiometry.roughness.openpbr_from_alphas(0.4, 0.2)
    >>> print(round(roughness, 4), round(anisotropy, 4))
    0.5623 0.5
    """
    x, y = np.asarray(alpha_x), np.asarray(alpha_y)
    ratio = in_range("alpha_y/alpha_x", y / x, Declared("x is the direction of the greater alpha", 0.0, 1.0 + 1e-12))
    mean = 0.5 * (np.square(x) + np.square(y))
    return np.power(mean, 0.25), np.clip(1.0 - ratio, 0.0, 1.0)[()]


@convert
def alphas_from_gltf(roughness: Rough, anisotropy_strength: Share) -> tuple[Any, Any]:
    """alpha_x = a + (1 - a) strength^2, alpha_y = a = roughness^2, x the tangent. KHR_materials_anisotropy.

    Example
    >>> alpha_x, alpha_y = gn.radiometry.roughness.alphas_from_gltf(0.5, anisotropy_strength=0.8)
    >>> print(round(alpha_x, 4), round(alpha_y, 4))
    0.73 0.25
    """
    a = alpha_from_perceptual(roughness)
    return a + (1.0 - a) * np.square(anisotropy_strength), a


@convert
def gltf_from_alphas(alpha_x: Share, alpha_y: BelowOne) -> tuple[Any, Any]:
    """(roughness, anisotropy strength) of 1 >= alpha_x >= alpha_y, alpha_y < 1; see `alphas_from_gltf`.

    Example
    >>> roughness, strength = gn.radiometry.roughness.gltf_from_alphas(0.4, 0.2)
    >>> print(round(roughness, 4), round(strength, 4))
    0.4472 0.5
    """
    x, y = np.asarray(alpha_x), np.asarray(alpha_y)
    range_ = Declared("x is the direction of the greater alpha", -1e-12, 1.0)
    strength2 = in_range("anisotropy strength^2", (x - y) / (1.0 - y), range_)
    return np.sqrt(y), np.sqrt(np.clip(strength2, 0.0, 1.0))[()]


# Matte surfaces.


@convert
def oren_nayar_sigma_from_rms_slope(rms_slope: Rough) -> Any:
    """sigma = arctan(RMS slope) [rad], roughly: Oren and Nayar's sigma is the standard deviation of the facets' angle,
    which for small angles is their slope along the V-cavities' cross-section. Oren & Nayar 1994.

    Example
    >>> print(gn.radiometry.roughness.oren_nayar_sigma_from_rms_slope(0.3).round(4))
    0.2915
    """
    return np.arctan(rms_slope)


@convert
def rms_slope_from_oren_nayar_sigma(
    sigma: Annotated[Any, Declared("the angle of the facets", 0.0, 0.5 * np.pi, "rad")],
) -> Any:
    """RMS slope = tan(sigma), sigma in radians; see `oren_nayar_sigma_from_rms_slope`.

    Example
    >>> print(gn.radiometry.roughness.rms_slope_from_oren_nayar_sigma(0.3).round(4))
    0.3093
    """
    return np.tan(sigma)


__all__, __dir__ = own_names(globals())
