"""Films against the transfer matrices of the package tmm 0.2.0, and what must hold of them."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import gonio as gn
from gonio.errors import ParameterError
from gonio.formula.json_form import from_json

BY_TMM = [  # indices, thicknesses [nm], angle [degrees], wavelength [nm], r_s, r_p: coh_tmm of tmm 0.2.0
    (
        [1.33, 1.0],
        [400.0],
        30.0,
        550.0,
        -0.13434976797945733 - 0.16576938007013275j,
        0.0810871920901609 + 0.10387598474785868j,
    ),
    (
        [2.4, 2.7 + 3.3j],
        [50.0],
        60.0,
        450.0,
        -0.46914858459160913 + 0.39262666752716846j,
        -0.15730359261054275 - 0.44884984875033546j,
    ),
    (
        [1.5 + 0.1j, 2.2, 0.2 + 3.9j],
        [80.0, 120.0],
        75.0,
        600.0,
        -0.8411678897675233 - 0.44821421479114754j,
        -0.6145646166806076 + 0.5826096247166078j,
    ),
]


def stack(indices, thicknesses):
    films = [gn.Film(complex(n).real, d, complex(n).imag) for n, d in zip(indices[:-1], thicknesses, strict=True)]
    last = complex(indices[-1])
    return gn.FilmStack(*films, eta=last.real, k=last.imag)


def amplitudes(fresnel, cos):
    return [complex(r.re, r.im) for r in fresnel.amplitudes(cos)]


@pytest.mark.parametrize(("indices", "thicknesses", "degrees", "nm", "r_s", "r_p"), BY_TMM)
def test_amplitudes_are_those_of_transfer_matrices(indices, thicknesses, degrees, nm, r_s, r_p):
    cos = np.cos(np.radians(degrees))
    of = [stack(indices, thicknesses)]
    if len(indices) == 2:
        last = complex(indices[1])
        of.append(gn.ThinFilm(indices[0], thicknesses[0], last.real, last.imag))
    for fresnel in of:
        np.testing.assert_allclose(amplitudes(fresnel.at(nm), cos), [r_s, r_p], rtol=0.0, atol=1e-14)
        assert fresnel.at(nm).F(cos) == pytest.approx(0.5 * (abs(r_s) ** 2 + abs(r_p) ** 2), abs=1e-14)


def test_many_stacks_are_those_of_tmm():
    tmm = pytest.importorskip("tmm")
    rng = np.random.default_rng(5)
    for _ in range(100):
        count = int(rng.integers(0, 12))
        n = rng.uniform(1.0, 3.0, count) + 1j * rng.choice([0.0, 1.0], count) * rng.uniform(0.0, 2.0, count)
        d, last = rng.uniform(0.0, 400.0, count), complex(rng.uniform(0.1, 4.0), rng.uniform(0.0, 4.0))
        cos, nm = float(rng.uniform(0.02, 1.0)), float(rng.uniform(380.0, 780.0))
        lists = [1.0, *n, last], [np.inf, *d, np.inf]
        expected = [tmm.coh_tmm(which, *lists, np.arccos(cos), nm)["r"] for which in "sp"]
        found = amplitudes(stack([*n, last], d).at(nm), cos)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


def test_films_of_no_thickness_are_not_there():
    cos = np.linspace(0.01, 1.0, 50)
    bare = gn.Dielectric(1.5).F(cos)
    for fresnel in (gn.FilmStack(eta=1.5), gn.FilmStack(gn.Film(2.0, 0.0), eta=1.5), gn.ThinFilm(2.0, 0.0, 1.5)):
        np.testing.assert_allclose(fresnel.at(500.0).F(cos), bare, atol=1e-14)
    gold = gn.Conductor(0.2, 3.0)
    np.testing.assert_allclose(gn.FilmStack(eta=0.2, k=3.0).at(500.0).F(cos), gold.F(cos), atol=1e-14)


def test_a_film_that_lets_no_light_through_is_its_own_substrate():
    cos = np.linspace(0.01, 1.0, 50)
    silver = gn.FilmStack(gn.Film(0.05, 5000.0, 3.5), eta=1.5).at(500.0)
    np.testing.assert_allclose(silver.F(cos), gn.Conductor(0.05, 3.5).F(cos), atol=1e-14)


def test_quarter_waves_reflect_as_in_the_textbook():
    """R = ((1 - n_s (n_H/n_L)^2N)/(1 + n_s (n_H/n_L)^2N))^2 of N pairs at their own wavelength: Born & Wolf, 1.6.5."""
    for pairs in (1, 4, 10):
        films = pairs * [gn.Film(2.35, 550.0 / 4 / 2.35), gn.Film(1.38, 550.0 / 4 / 1.38)]
        x = 1.52 * (2.35 / 1.38) ** (2 * pairs)
        found = gn.FilmStack(*films, eta=1.52).at(550.0).F(1.0)
        assert found == pytest.approx(((1.0 - x) / (1.0 + x)) ** 2, abs=1e-13)


def test_no_light_is_made_and_zero_thickness_gradients_are_finite():
    rng = np.random.default_rng(1)
    cos = np.concatenate([[0.0, 1e-9], np.linspace(0.0, 1.0, 50)])
    for _ in range(50):
        films = [gn.Film(*rng.uniform([0.5, 0.0, 0.0], [3.0, 500.0, 2.0])) for _ in range(4)]
        F = gn.FilmStack(*films, eta=rng.uniform(0.1, 3.0), k=rng.uniform(0.0, 3.0)).at(500.0).F(cos)
        assert F.max() <= 1.0 + 1e-12 and F.min() >= 0.0
        assert F[0] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("fresnel", "path"),
    [
        (gn.ThinFilm(1.4, 350.0, 1.8, 2.5), "fresnel.thickness"),
        (gn.FilmStack(gn.Film(1.4, 350.0, 0.01), gn.Film(2.0, 120.0), eta=1.6), "fresnel.1.thickness"),
    ],
)
def test_derivatives_by_thickness_are_exact(fresnel, path):
    m = gn.Microfacet(gn.GGX(0.2), fresnel).at([450.0, 550.0, 650.0])
    wi, wo = gn.direction(0.5, 0.3), gn.direction(0.4, 3.0)
    at = m.parameters[path].value

    def difference(h):
        return (m.replace({path: at + h}).f(wi, wo) - m.replace({path: at - h}).f(wi, wo)) / (2.0 * h)

    by_differences = (4.0 * difference(0.004) - difference(0.008)) / 3.0
    exact = m.jacobian(wi, wo, by=path).by[path]
    np.testing.assert_allclose(exact, by_differences, rtol=1e-10, atol=1e-10 * np.abs(exact).max())


def test_stacks_are_values():
    spectrum = gn.Spectrum([400.0, 700.0], [1.3, 1.4])
    m = gn.Microfacet(gn.GGX(0.1), gn.FilmStack(gn.Film(2.0, 100.0), gn.Film(spectrum, 50.0), eta=1.7))
    for x in (m, m.at([450.0, 550.0]), m.at(500.0)):
        assert x == gn.expression(repr(x)) == from_json(x.to_json()) == pickle.loads(pickle.dumps(x))
    assert m.at([450.0, 550.0]).wavelengths.tolist() == [450.0, 550.0]
    thicker = m.at(500.0).replace({"fresnel.0.thickness": 120.0})
    assert thicker.fresnel.films[0] == gn.Film(2.0, 120.0)
    assert gn.Film(2.0, 100.0) != gn.Film(2.0, 101.0)


def test_bad_films():
    with pytest.raises(ParameterError, match=r"gn\.Film"):
        gn.FilmStack(1.5)
    with pytest.raises(ParameterError, match="at most 64"):
        gn.FilmStack(*65 * [gn.Film()])
    with pytest.raises(ParameterError, match=r"m\.at"):
        gn.Microfacet(gn.GGX(0.1), gn.ThinFilm()).f([0, 0, 1], [0, 0, 1])
    with pytest.raises(ParameterError, match="in micrometres"):
        gn.ThinFilm().at(0.55)
