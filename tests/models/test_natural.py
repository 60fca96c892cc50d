"""Models of natural surfaces, against independent evaluations in the papers' angles, published numbers, and limits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import gonio as gn
from gonio.formula.direction import Direction
from gonio.models import ross_li
from gonio.models.roujean import roujean_geometric, roujean_volumetric

PI = math.pi
UP = np.array([0.0, 0.0, 1.0])


def degrees(theta_i: float, theta_o: float, phi: float) -> tuple[Direction, Direction]:
    """wi, wo at angles in degrees; phi = 0 is back-scatter."""
    wi, wo = gn.direction(math.radians(theta_i), 0.3), gn.direction(math.radians(theta_o), 0.3 + math.radians(phi))
    return Direction(*wi), Direction(*wo)


def nodes(n: int, low: float = 0.0, high: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (high - low) * (x + 1.0) + low, 0.5 * (high - low) * w


def hemispheres(n: int, azimuths: int) -> tuple[Direction, Direction, np.ndarray]:
    """wi, wo over both hemispheres and weights of the mean over cos(theta_i) cos(theta_o) dwi dwo."""
    theta, w = nodes(n, 0.0, 0.5 * PI)
    w = w * np.sin(2.0 * theta)
    phi, wp = nodes(azimuths, 0.0, PI)
    ti, to, p = np.meshgrid(theta, theta, phi, indexing="ij")
    wi, wo = gn.direction(ti, 0.0 * p), gn.direction(to, p)
    weight = w[:, None, None] * w[None, :, None] * wp[None, None, :] / PI
    return Direction(*np.moveaxis(wi, -1, 0)), Direction(*np.moveaxis(wo, -1, 0)), weight


def compared(
    scalar: Callable[..., float], made: Callable[[np.random.Generator], tuple[Any, dict]], count: int = 200
) -> None:
    """f of random materials and directions against a scalar implementation in angles, to 1e-11."""
    rng = np.random.default_rng(11)
    for k in range(count):
        m, values = made(rng)
        theta_i, theta_o = np.arccos(rng.uniform(0.05, 1.0, 2))
        phi_i, phi_o = rng.uniform(-PI, PI, 2)
        if k % 4 == 0:  # near the hot spot, and near the mirror direction
            theta_o, phi_o = theta_i + 0.02 * rng.normal(), phi_i + (k % 8 // 4) * PI + 0.02 * rng.normal()
            theta_o = abs(min(theta_o, 1.5))
        expected = scalar(theta_i, phi_i, theta_o, phi_o, **values)
        scale = max(abs(expected), values.get("scale", 0.0))
        assert m.f_angles(theta_i, phi_i, theta_o, phi_o) == pytest.approx(expected, abs=1e-11 * scale)


# Ross–Li and Roujean.

KERNELS = [
    ((0, 0, 0), 0.0, 0.0),
    ((45, 0, 0), -0.045862030, -1.106819176),
    ((30, 30, 0), 0.121501519, 0.178632795),
    ((30, 30, 180), -0.134248216, -1.309401077),
    ((60, 45, 90), 0.095366434, -1.5),
]


@pytest.mark.parametrize(("at", "volumetric", "geometric"), KERNELS, ids=str)
def test_modis_kernels(at, volumetric, geometric):
    """Numbers on which two independent evaluations agree: RossThick, LiSparseR with h/b = 2, b/r = 1."""
    wi, wo = degrees(*at)
    assert ross_li.ross_thick(wi, wo) == pytest.approx(volumetric, abs=1e-9)
    assert ross_li.li_sparse_r(wi, wo) == pytest.approx(geometric, abs=1e-9)
    only = {"f_iso": 0.0, "f_vol": 0.0, "f_geo": 0.0}
    f = [float(gn.RossLi(**{**only, name: 1.0}).f(np.array(wi), np.array(wo))) for name in only]
    assert f == pytest.approx([1.0 / PI, volumetric / PI, geometric / PI], abs=1e-9)


def test_white_sky_integrals_of_the_kernels():
    """0.1891864, -1.3776579 by quadrature; Lucht et al. 2000 print 0.189184, -1.377622."""
    wi, wo, weight = hemispheres(100, 60)
    assert (weight * ross_li.ross_thick(wi, wo)).sum() == pytest.approx(0.1891864, abs=1e-6)
    assert (weight * ross_li.li_sparse_r(wi, wo)).sum() == pytest.approx(-1.3776579, abs=2e-5)


def test_hot_spot_kernel():
    """Maignan et al. 2004: at exact back-scatter twice, far from it nearly once, Ross' function."""
    for theta in (0.0, 30.0, 60.0):
        wi, wo = degrees(theta, theta, 0.0)
        twice = 4.0 / (3.0 * PI) * 2.0 * (ross_li.ross_thick(wi, wo) + PI / 4.0) - 1.0 / 3.0
        assert ross_li.ross_thick_hotspot(wi, wo) == pytest.approx(twice, rel=1e-12)
    wi, wo = degrees(0.0, 1.5, 0.0)  # half the excess at xi_0
    once = 4.0 / (3.0 * PI) * (ross_li.ross_thick(wi, wo) + PI / 4.0)
    assert ross_li.ross_thick_hotspot(wi, wo) == pytest.approx(1.5 * once - 1.0 / 3.0, rel=1e-12)


def cosine_rule(ti: float, to: float, phi: float) -> float:
    return max(-1.0, min(1.0, math.cos(ti) * math.cos(to) + math.sin(ti) * math.sin(to) * math.cos(phi)))


def scalar_ross_li(
    ti: float, pi: float, to: float, po: float, weights: Any, h_b: float, b_r: float, kernels: tuple, **_: float
) -> float:
    phi = po - pi
    xi = math.acos(cosine_rule(ti, to, phi))
    leaves = (PI / 2.0 - xi) * math.cos(xi) + math.sin(xi)
    volumetric = {
        "ross_thick": leaves / (math.cos(ti) + math.cos(to)) - PI / 4.0,
        "ross_thin": leaves / (math.cos(ti) * math.cos(to)) - PI / 2.0,
        "ross_thick_hotspot": 4.0 / (3.0 * PI) / (math.cos(ti) + math.cos(to)) * leaves
        * (1.0 + 1.0 / (1.0 + math.degrees(xi) / 1.5)) - 1.0 / 3.0,
    }  # fmt: skip
    ai, ao = math.atan(b_r * math.tan(ti)), math.atan(b_r * math.tan(to))
    cos_xi = cosine_rule(ai, ao, phi)
    d2 = math.tan(ai) ** 2 + math.tan(ao) ** 2 - 2.0 * math.tan(ai) * math.tan(ao) * math.cos(phi)
    secants = 1.0 / math.cos(ai) + 1.0 / math.cos(ao)
    cos_t = h_b * math.sqrt(max(d2, 0.0) + (math.tan(ai) * math.tan(ao) * math.sin(phi)) ** 2) / secants
    t = math.acos(min(cos_t, 1.0))
    O = (t - math.sin(t) * math.cos(t)) * secants / PI  # noqa: E741  (the paper's)
    bright = (1.0 + cos_xi) / (math.cos(ai) * math.cos(ao))
    geometric = {"li_sparse_r": O - secants + 0.5 * bright, "li_dense_r": bright / (secants - O) - 2.0}
    return (weights[0] + weights[1] * volumetric[kernels[0]] + weights[2] * geometric[kernels[1]]) / PI


def test_ross_li_in_angles():
    kernels = itertools.cycle(itertools.product(ross_li.VOLUMETRIC, ross_li.GEOMETRIC))

    def made(rng: np.random.Generator) -> tuple[Any, dict]:
        weights, (h_b, b_r), chosen = rng.uniform(-1.0, 1.0, 3), rng.uniform(0.3, 3.0, 2), next(kernels)
        weights[0] = abs(weights[0])
        values = {"weights": weights, "h_b": h_b, "b_r": b_r, "kernels": chosen, "scale": 10.0}
        return gn.RossLi(*weights, h_b, b_r, *chosen), values

    compared(scalar_ross_li, made)


def scalar_roujean(ti: float, pi: float, to: float, po: float, k: Any, **_: float) -> float:
    phi = abs(math.remainder(po - pi, 2.0 * PI))
    si, so = math.tan(ti), math.tan(to)
    f1 = ((PI - phi) * math.cos(phi) + math.sin(phi)) * si * so / (2.0 * PI)
    f1 -= (si + so + math.sqrt(max(si * si + so * so - 2.0 * si * so * math.cos(phi), 0.0))) / PI
    xi = math.acos(cosine_rule(ti, to, phi))
    f2 = 4.0 / (3.0 * PI) / (math.cos(ti) + math.cos(to)) * ((PI / 2.0 - xi) * math.cos(xi) + math.sin(xi)) - 1.0 / 3.0
    return (k[0] + k[1] * f1 + k[2] * f2) / PI


def test_roujean_in_angles():
    def made(rng: np.random.Generator) -> tuple[Any, dict]:
        k = rng.uniform(-1.0, 1.0, 3)
        k[0] = abs(k[0])
        return gn.Roujean(*k), {"k": k, "scale": 10.0}

    compared(scalar_roujean, made)


def test_roujean_kernels_vanish_at_the_zenith_and_one_is_ross():
    wi, wo = degrees(0.0, 0.0, 0.0)
    assert roujean_geometric(wi, wo) == pytest.approx(0.0, abs=1e-12)
    assert roujean_volumetric(wi, wo) == pytest.approx(0.0, abs=1e-12)
    wi, wo = degrees(40.0, 65.0, 110.0)
    assert roujean_volumetric(wi, wo) == pytest.approx(4.0 / (3.0 * PI) * ross_li.ross_thick(wi, wo), rel=1e-12)


# RPV and Walthall.


def scalar_rpv(ti: float, pi: float, to: float, po: float, rho_0: float, k: float, theta: float, rho_c: float) -> float:
    """In the paper's variables: theta_2, phi = 0 for back-scatter, and the phase function of pi - g."""
    phi = po - pi
    M = (math.cos(ti) * math.cos(to)) ** (k - 1.0) / (math.cos(ti) + math.cos(to)) ** (1.0 - k)
    g = math.acos(cosine_rule(ti, to, phi))
    F = (1.0 - theta**2) / (1.0 + theta**2 - 2.0 * theta * math.cos(PI - g)) ** 1.5
    G2 = math.tan(ti) ** 2 + math.tan(to) ** 2 - 2.0 * math.tan(ti) * math.tan(to) * math.cos(phi)
    return rho_0 * M * F * (1.0 + (1.0 - rho_c) / (1.0 + math.sqrt(max(G2, 0.0)))) / PI


def test_rpv_in_angles():
    def made(rng: np.random.Generator) -> tuple[Any, dict]:
        values = {
            "rho_0": rng.random(),
            "k": 2.0 * rng.random(),
            "theta": rng.uniform(-0.9, 0.9),
            "rho_c": rng.random(),
        }
        return gn.RPV(*values.values()), values

    compared(scalar_rpv, made)


def test_rpv_limits():
    wi, wo = gn.direction(0.8, 0.1), gn.direction(1.1, 2.0)
    assert gn.RPV(0.37, 1.0, 0.0, 1.0).f(wi, wo) == pytest.approx(0.37 / PI, rel=1e-12)
    assert gn.RPV(0.3).rho_c == 0.3
    back, forward = gn.direction(0.8, 0.1), gn.direction(0.8, 0.1 + PI)
    assert gn.RPV(0.2, 1.0, -0.3, 1.0).f(wi, back) > gn.RPV(0.2, 1.0, -0.3, 1.0).f(wi, forward)
    assert gn.RPV(0.2, 1.0, 0.3, 1.0).f(wi, back) < gn.RPV(0.2, 1.0, 0.3, 1.0).f(wi, forward)
    rho_0, k, theta, rho_c = 0.2, 0.6, -0.25, 0.7
    zenith = rho_0 * 2.0 ** (k - 1.0) * (2.0 - rho_c) * (1.0 - theta) / (1.0 + theta) ** 2
    assert PI * gn.RPV(rho_0, k, theta, rho_c).f(UP, UP) == pytest.approx(zenith, rel=1e-12)


def test_rpv_samples_its_grazing_brightness():
    """For k near 0 the cosine hemisphere's weights would run away; the lobe's own stay bounded."""
    m = gn.RPV(0.1, 0.0, 0.0, 1.0)
    u = np.random.default_rng(0).random((20_000, 2))
    weight = m.sample(np.broadcast_to(gn.direction(0.7, 0.0), (len(u), 3)), u).weight
    assert weight.max() < 4.0 * weight.mean()


def test_walthall_in_angles():
    def scalar(ti: float, pi: float, to: float, po: float, a: Any, **_: float) -> float:
        even = a[0] + a[1] * (ti * ti + to * to) + a[2] * ti * ti * to * to
        return (even + a[3] * ti * to * math.cos(po - pi)) / PI

    def made(rng: np.random.Generator) -> tuple[Any, dict]:
        a = rng.uniform(-1.0, 1.0, 4)
        a[0] = abs(a[0])
        return gn.Walthall(*a), {"a": a, "scale": 1.0}

    compared(scalar, made)


# Hapke.


def scalar_H(x: float, w: float, which: str) -> float:
    gamma = math.sqrt(1.0 - w)
    if which == "1981":
        return (1.0 + 2.0 * x) / (1.0 + 2.0 * x * gamma)
    r0 = (1.0 - gamma) / (1.0 + gamma)
    return 1.0 / (1.0 - w * x * (r0 + (1.0 - 2.0 * r0 * x) / 2.0 * math.log((1.0 + x) / x)))


def scalar_roughness(i: float, e: float, psi: float, bar: float) -> tuple[float, float, float]:
    """Hapke 1984's mu_0e, mu_e and S, in his two cases."""
    chi, t = 1.0 / math.sqrt(1.0 + PI * math.tan(bar) ** 2), math.tan(bar)

    def E1(x: float) -> float:
        return math.exp(-2.0 / PI / t / math.tan(x)) if x > 0.0 else 0.0

    def E2(x: float) -> float:
        return math.exp(-1.0 / PI / t**2 / math.tan(x) ** 2) if x > 0.0 else 0.0

    def eta(x: float) -> float:
        return chi * (math.cos(x) + math.sin(x) * t * E2(x) / (2.0 - E1(x)))

    f, half2 = math.exp(-2.0 * math.tan(psi / 2.0)), math.sin(psi / 2.0) ** 2
    if i <= e:
        below = 2.0 - E1(e) - psi / PI * E1(i)
        mu_0e = chi * (math.cos(i) + math.sin(i) * t * (math.cos(psi) * E2(e) + half2 * E2(i)) / below)
        mu_e = chi * (math.cos(e) + math.sin(e) * t * (E2(e) - half2 * E2(i)) / below)
        last = 1.0 - f + f * chi * math.cos(i) / eta(i)
    else:
        below = 2.0 - E1(i) - psi / PI * E1(e)
        mu_0e = chi * (math.cos(i) + math.sin(i) * t * (E2(i) - half2 * E2(e)) / below)
        mu_e = chi * (math.cos(e) + math.sin(e) * t * (math.cos(psi) * E2(i) + half2 * E2(e)) / below)
        last = 1.0 - f + f * chi * math.cos(e) / eta(e)
    return mu_0e, mu_e, mu_e / eta(e) * math.cos(i) / eta(i) * chi / last


def scalar_hapke(
    i: float, pi: float, e: float, po: float, w: float, b: float, c: float, B0: float, h: float, bar: float, which: str
) -> float:
    psi = abs(math.remainder(po - pi, 2.0 * PI))
    g = math.acos(cosine_rule(i, e, psi))
    mu_0e, mu_e, S = scalar_roughness(i, e, psi, bar) if bar > 0.0 else (math.cos(i), math.cos(e), 1.0)
    P = (1.0 + c) / 2.0 * (1.0 - b * b) / (1.0 - 2.0 * b * math.cos(g) + b * b) ** 1.5
    P += (1.0 - c) / 2.0 * (1.0 - b * b) / (1.0 + 2.0 * b * math.cos(g) + b * b) ** 1.5
    B = B0 / (1.0 + math.tan(g / 2.0) / h)
    H = scalar_H(mu_0e, w, which) * scalar_H(mu_e, w, which)
    return w / (4.0 * PI) * mu_0e / (mu_0e + mu_e) * ((1.0 + B) * P + H - 1.0) * S / math.cos(i)


@pytest.mark.parametrize("which", ["1981", "2002"])
def test_hapke_in_angles(which):
    def made(rng: np.random.Generator) -> tuple[Any, dict]:
        w, b, c, B0 = rng.random(), 0.9 * rng.random(), rng.uniform(-1.0, 1.0), 3.0 * rng.random()
        h, bar = rng.uniform(0.01, 1.0), rng.random() * (rng.random() < 0.8)
        values = {"w": w, "b": b, "c": c, "B0": B0, "h": h, "bar": bar}
        return gn.Hapke(*values.values(), which), {**values, "which": which}

    compared(scalar_hapke, made)


def test_hapke_correction_of_roughness_is_continuous():
    """At theta_bar = 0 (nothing happens), at theta_i = theta_o (two cases meet), and at the zenith (no azimuth)."""
    m = gn.Hapke(0.5)
    wi, wo = gn.direction(0.9, 0.1), gn.direction(0.5, 1.0)
    smooth = m.replace(theta_bar=0.0).f(wi, wo)
    changes = [abs(m.replace(theta_bar=bar).f(wi, wo) / smooth - 1.0) for bar in (1e-2, 1e-3, 1e-4)]
    assert changes[0] < 1e-3
    assert changes[1] < 1e-5
    assert changes[2] < 1e-7
    for psi in (0.0, 0.4, 2.0, PI):
        f = [float(m.f_angles(0.9, 0.0, 0.9 + s, psi)) for s in (-1e-9, 0.0, 1e-9)]
        assert f == pytest.approx([f[1]] * 3, rel=1e-7)
    f = [float(m.f_angles(0.9, 0.0, 1e-9, psi)) for psi in (0.0, 1.0, 2.0, PI)]
    assert f == pytest.approx([m.f(gn.direction(0.9, 0.0), UP)] * 4, rel=1e-7)


def test_hapke_limits():
    """Dark and isotropic: Lommel–Seeliger; w = 1, isotropic, smooth: nearly everything returns."""
    wi, wo = gn.direction(0.9, 0.1), gn.direction(0.5, 1.0)
    dark = gn.Hapke(1e-9, b=0.0, B0=0.0, theta_bar=0.0)
    assert dark.f(wi, wo) == pytest.approx(1e-9 / (4.0 * PI * (wi[2] + wo[2])), rel=1e-8)
    white = gn.Hapke(1.0, b=0.0, B0=0.0, theta_bar=0.0)
    at = gn.direction(np.radians([0.0, 40.0, 70.0, 85.0]), 0.0)
    off = {
        which: np.abs(gn.albedo(white.replace(multiple_scattering=which), at) - 1.0).max() for which in ("1981", "2002")
    }
    assert 0.03 < off["1981"] < 0.045
    assert off["2002"] < 0.015
    # The lobes' normalization: the mean of P over the sphere is 1.
    g, weight = nodes(200, 0.0, PI)
    for b, c in ((0.6, 0.3), (0.8, -1.0), (0.4, 1.0)):
        lone = gn.Hapke(1e-9, b=b, c=c, B0=0.0, theta_bar=0.0)
        backward, forward = (1.0 - b) ** -2 * (1.0 + b), (1.0 + b) ** -2 * (1.0 - b)
        expected = 0.5 * (1.0 + c) * backward + 0.5 * (1.0 - c) * forward
        assert lone.f(UP, UP) * 8.0 * PI / 1e-9 == pytest.approx(expected, rel=1e-6)
        P = (1.0 + c) / 2 * (1 - b * b) / (1 - 2 * b * np.cos(g) + b * b) ** 1.5
        P += (1.0 - c) / 2 * (1 - b * b) / (1 + 2 * b * np.cos(g) + b * b) ** 1.5
        assert (P * np.sin(g) * weight).sum() / 2.0 == pytest.approx(1.0, abs=1e-6)


def test_hapke_surge_doubles_single_scattering():
    dark = gn.Hapke(1e-9, b=0.0, B0=1.0, h=0.05, theta_bar=0.0)
    wi = gn.direction(0.6, 0.0)
    single = 1e-9 / (8.0 * PI * wi[2])
    assert dark.f(wi, wi) == pytest.approx(2.0 * single, rel=1e-8)
    g = 2.0 * math.atan(0.05)  # the half width
    wo = gn.direction(0.6 + g, 0.0)
    assert dark.f(wi, wo) * (wi[2] + wo[2]) == pytest.approx(1.5 * single * 2.0 * wi[2], rel=1e-8)


# Cox–Munk.


def scalar_cox_munk(
    ti: float, pi: float, to: float, po: float, wind: float, azimuth: float, n: float, slopes: str, masking: str
) -> float:
    """From the slopes of the facet that reflects, with Fresnel's amplitudes and Smith's function by scipy."""
    x = math.sin(ti) * math.cos(pi) + math.sin(to) * math.cos(po)
    y = math.sin(ti) * math.sin(pi) + math.sin(to) * math.sin(po)
    z = math.cos(ti) + math.cos(to)
    slope = (-x / z, -y / z)  # the surface's gradient
    up, cross = (
        slope[0] * math.cos(azimuth) + slope[1] * math.sin(azimuth),
        -slope[0] * math.sin(azimuth) + slope[1] * math.cos(azimuth),
    )
    if slopes == "isotropic":
        var_u = var_c = 0.5 * (0.003 + 0.00512 * wind)
    else:
        var_u, var_c = 0.00316 * wind, 0.003 + 0.00192 * wind
    eta, xi = up / math.sqrt(var_u), cross / math.sqrt(var_c)
    p = math.exp(-(xi**2 + eta**2) / 2.0) / (2.0 * PI * math.sqrt(var_u * var_c))
    if slopes == "gram_charlier":
        c21, c03, c40, c22, c04 = 0.01 - 0.0086 * wind, 0.04 - 0.033 * wind, 0.40, 0.12, 0.23
        series = 1.0 - c21 / 2.0 * (xi**2 - 1.0) * eta - c03 / 6.0 * (eta**3 - 3.0 * eta)
        series += c40 / 24.0 * (xi**4 - 6.0 * xi**2 + 3.0) + c22 / 4.0 * (xi**2 - 1.0) * (eta**2 - 1.0)
        series += c04 / 24.0 * (eta**4 - 6.0 * eta**2 + 3.0)
        p *= max(series, 0.0)
    omega = 0.5 * math.acos(cosine_rule(ti, to, po - pi))
    inside = math.asin(math.sin(omega) / n)
    rs = (math.cos(omega) - n * math.cos(inside)) / (math.cos(omega) + n * math.cos(inside))
    rp = (n * math.cos(omega) - math.cos(inside)) / (n * math.cos(omega) + math.cos(inside))

    def smith(theta: float, phi: float) -> float:
        if theta < 1e-9:
            return 0.0
        var = var_u * math.cos(phi - azimuth) ** 2 + var_c * math.sin(phi - azimuth) ** 2
        v = 1.0 / math.tan(theta) / math.sqrt(2.0 * var)
        return (math.exp(-v * v) / (v * math.sqrt(PI)) - math.erfc(v)) / 2.0

    a, b = smith(ti, pi), smith(to, po)
    G = {"none": 1.0, "separable": 1.0 / (1.0 + a) / (1.0 + b), "height_correlated": 1.0 / (1.0 + a + b)}[masking]
    beta = math.atan(math.hypot(*slope))
    fresnel = 0.5 * (rs * rs + rp * rp)
    return p * fresnel * G / (4.0 * math.cos(ti) * math.cos(to) * math.cos(beta) ** 4)


SLOPES, MASKING = ("isotropic", "anisotropic", "gram_charlier"), ("height_correlated", "separable", "none")


@pytest.mark.parametrize(("slopes", "masking"), list(itertools.product(SLOPES, MASKING)))
def test_cox_munk_in_angles(slopes, masking):
    def made(rng: np.random.Generator) -> tuple[Any, dict]:
        wind, azimuth, n = rng.uniform(1.0, 20.0), rng.uniform(-PI, PI), rng.uniform(1.1, 2.0)
        values = {"wind": wind, "azimuth": azimuth, "n": n, "slopes": slopes, "masking": masking, "scale": 1e-6}
        return gn.CoxMunk(*list(values.values())[:5]), values

    def scalar(*angles: float, scale: float, **values: Any) -> float:
        return scalar_cox_munk(*angles, **values)

    compared(scalar, made, 60)


def slope_density(m: Any, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """p at slopes along and across the wind, from the model's own parts."""
    z = 1.0 / np.sqrt(1.0 + x * x + y * y)
    wm = Direction(-x * z, -y * z, z)
    return m.facets.D(wm) * z**4 * m._skewed(wm)


@pytest.mark.parametrize("wind", [1.0, 5.0, 14.0])
def test_cox_munk_slopes(wind):
    """p integrates to 1, and its moments are those of the paper; a Gram–Charlier term changes none below its own."""
    x, w = nodes(200, -2.0, 2.0)
    X, Y, W = x[:, None], x[None, :], w[:, None] * w[None, :]
    m = gn.CoxMunk(wind, slopes="isotropic")
    p = slope_density(m, X, Y)
    assert (p * W).sum() == pytest.approx(1.0, abs=1e-9)
    assert (p * W * (X**2 + Y**2)).sum() == pytest.approx(0.003 + 0.00512 * wind, rel=1e-8)
    for slopes, tolerance in (("anisotropic", 1e-9), ("gram_charlier", 1e-3)):
        p = slope_density(gn.CoxMunk(wind, slopes=slopes), X, Y)
        assert (p * W).sum() == pytest.approx(1.0, abs=tolerance)
        if slopes == "anisotropic" or wind < 6.0:
            assert (p * W * X**2).sum() == pytest.approx(0.00316 * wind, rel=tolerance + 1e-8)
            assert (p * W * Y**2).sum() == pytest.approx(0.003 + 0.00192 * wind, rel=tolerance + 1e-8)


def test_cox_munk_negative_density_is_cut_off_as_documented():
    x, w = nodes(200, -2.0, 2.0)
    X, Y, W = x[:, None], x[None, :], w[:, None] * w[None, :]
    excess = [(slope_density(gn.CoxMunk(wind), X, Y) * W).sum() - 1.0 for wind in (5.0, 14.0, 20.0)]
    assert excess == pytest.approx([0.0, 0.0004, 0.0022], abs=5e-5)


def test_cox_munk_skewness():
    """The most probable slope at high wind: its azimuth of ascent points downwind (abstract of Cox & Munk 1954)."""
    m = gn.CoxMunk(14.0, 0.7)
    slopes = np.linspace(-0.3, 0.3, 601)
    steepest = slopes[slope_density(m, slopes, 0.0 * slopes).argmax()]  # towards the wind
    assert -0.1 < steepest < -0.03
    tail = slope_density(m, np.array([0.5, -0.5]), np.zeros(2))
    assert tail[0] > tail[1]
    # Seen from above, with the light on the windward side, facets that face the wind are those that rise downwind.
    beta = 0.06
    facing, leeward = (float(m.f_angles(2.0 * beta, 0.7 + turn, 0.0, 0.0)) for turn in (0.0, PI))
    assert facing > 1.05 * leeward


def test_cox_munk_is_a_beckmann_surface():
    """Isotropic slopes are Beckmann's with alpha^2 = sigma^2; the wind's direction does not matter then."""
    wi, wo = gn.direction(0.9, 0.1), gn.direction(0.8, 3.4)
    alpha = math.sqrt(0.003 + 0.00512 * 7.0)
    for masking in ("height_correlated", "separable"):
        m = gn.CoxMunk(7.0, 1.1, 1.34, "isotropic", masking)
        same = gn.Microfacet(gn.Beckmann(alpha), gn.Dielectric(1.34), masking)
        assert m.f(wi, wo) == pytest.approx(same.f(wi, wo), rel=1e-12)
        assert m.pdf(wi, wo) == pytest.approx(same.pdf(wi, wo), rel=1e-9)


def test_cox_munk_loses_light_unless_unmasked():
    grazing = gn.direction(np.radians([60.0, 80.0, 89.0, 89.9]), 0.4)
    for wind, slopes in itertools.product((0.5, 20.0), SLOPES):
        assert gn.albedo(gn.CoxMunk(wind, slopes=slopes), grazing, tolerance=5e-3).max() < 0.95
    bare = gn.CoxMunk(5.0, slopes="isotropic", masking="none")
    assert gn.albedo(bare, grazing[-1], tolerance=1e-3) > 5.0


# Snow.


def test_snow_in_angles():
    def scalar(ti: float, pi: float, to: float, po: float, r: float) -> float:
        a, b = math.cos(ti), math.cos(to)
        relative = po - pi - PI  # the papers' azimuth, 0 for forward
        T = math.degrees(math.acos(max(-1.0, -a * b + math.sin(ti) * math.sin(to) * math.cos(relative))))
        p = 11.1 * math.exp(-0.087 * T) + 1.1 * math.exp(-0.014 * T)
        R0 = (1.247 + 1.186 * (a + b) + 5.157 * a * b + p) / 4.0 / (a + b)
        return R0 * r ** (3.0 / 7.0 * (1.0 + 2.0 * a) * 3.0 / 7.0 * (1.0 + 2.0 * b) / R0) / PI

    def made(rng: np.random.Generator) -> tuple[Any, dict]:
        r = rng.uniform(0.01, 1.0)
        return gn.SnowART(r), {"r": r}

    compared(scalar, made)


def test_snow_that_absorbs_little_has_its_white_sky_albedo():
    wi, wo, weight = hemispheres(40, 60)
    arrays = np.stack([*wi], -1), np.stack([*wo], -1)
    white = {r: PI * (weight * gn.SnowART(r).f(*arrays)).sum() for r in (1.0, 0.9, 0.7)}
    assert white == pytest.approx({1.0: 1.0033, 0.9: 0.9037, 0.7: 0.7066}, abs=1e-4)
