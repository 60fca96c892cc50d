"""Dispersion formulas, against published indices and against the same formulas by mpmath, written down once more."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import gonio as gn
from gonio.errors import ParameterError
from gonio.formula.json_form import from_json

mpmath = pytest.importorskip("mpmath")


def by_mpmath(formula, c, nm):
    """n at a wavelength [nm], in 30 digits, with the sums of the formulas written as loops over C_2, C_3, ..."""
    with mpmath.workdps(30):
        x, C = mpmath.mpf(nm) / 1000, [mpmath.mpf(v) for v in c]
        C = dict(enumerate(C, 1))
        last = max(C)
        if formula in (1, 2, 3, 5, 6):
            total = C[1]
            for i in range(2, last, 2):
                a, b = C[i], C[i + 1]
                total += {
                    1: lambda a=a, b=b: a / (1 - (b / x) ** 2),
                    2: lambda a=a, b=b: a / (1 - b / x**2),
                    3: lambda a=a, b=b: a * mpmath.power(x, b),
                    5: lambda a=a, b=b: a * mpmath.power(x, b),
                    6: lambda a=a, b=b: a * x**2 / (b * x**2 - 1),
                }[formula]()
            square = {1: 1 + total, 2: 1 + total, 3: total, 5: total**2, 6: (1 + total) ** 2}[formula]
        elif formula == 4:
            square = C[1] + C[2] * x ** C[3] / (x * x - C[4] ** C[5]) + C[6] * x ** C[7] / (x * x - C[8] ** C[9])
            square += sum(C[i] * x ** C[i + 1] for i in range(10, last, 2))
        elif formula == 7:
            L = 1 / (x * x - mpmath.mpf("0.028"))
            square = (C[1] + L * (C[2] + L * C[3]) + x * x * (C[4] + x * x * (C[5] + x * x * C[6]))) ** 2
        elif formula == 8:
            g = C[1] + C[2] / (1 - C[3] / x**2) + C[4] * x**2
            square = (1 + 2 * g) / (1 - g)
        else:
            d = x - C[5]
            square = C[1] + C[2] / (x * x - C[3]) + C[4] * d / (d * d + C[6])
        return float(mpmath.sqrt(square))


CASES = {
    1: [0.1, 0.6961663, 0.0684043, 0.4079426, 0.1162414, 0.8974794, 9.896161],
    2: [0.05, 1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653],
    3: [2.3, -0.01, 2.0, 0.012, -2.0, 0.0003, -4.0],
    4: [3.0, 0.24, 0.5, 0.08, 1.5, 0.03, 1.0, 0.2, 2.0, 0.01, 1.0, -0.004, 2.0],
    5: [1.45, 0.0035, -2.0, 0.0001, -4.0],
    6: [0.0001, 0.05792105, 238.0185, 0.00167917, 57.362],
    7: [3.41, 0.16, -0.02, -2e-5, 3e-7, -1e-9],
    8: [0.2, 0.1, 0.05, -0.002],
    9: [2.5, 0.015, 0.03, 0.02, 1.2, 0.5],
}


@pytest.mark.parametrize("formula", CASES)
def test_each_formula_is_that_of_mpmath(formula):
    nm = np.array([401.5, 550.0, 693.7, 980.0])
    n = gn.Dispersion(formula, CASES[formula], [400.0, 1000.0]).at(nm)
    np.testing.assert_allclose(n, [by_mpmath(formula, CASES[formula], x) for x in nm], rtol=2e-15)


PUBLISHED = [
    (1, [0, 0.6961663, 0.0684043, 0.4079426, 0.1162414, 0.8974794, 9.896161], 587.5618, 1.45846, 1e-5, "Malitson 1965"),
    (2, [0, *CASES[2][1:]], 587.5618, 1.5168, 1e-5, "N-BK7, Schott's data sheet: n_d"),
    (2, [0, *CASES[2][1:]], 486.1327, 1.52238, 1e-5, "N-BK7, Schott's data sheet: n_F"),
    (6, [0, 0.05792105, 238.0185, 0.00167917, 57.362], 587.6, 1.00027717, 1e-8, "air at 15 C, Ciddor 1996"),
]


@pytest.mark.parametrize(("formula", "c", "nm", "n", "error", "source"), PUBLISHED)
def test_published_indices(formula, c, nm, n, error, source):
    assert gn.Dispersion(formula, c, [300.0, 2000.0]).at(nm) == pytest.approx(n, abs=error), source


def test_coefficients_that_are_left_out_are_zero():
    assert gn.Dispersion(4, [2.0, 0.2, 0.0, 0.1, 2.0], [400, 900]).at(1000.0 * 0.6) == pytest.approx(
        (2.0 + 0.2 / (0.36 - 0.01)) ** 0.5, rel=1e-15
    )
    assert gn.Dispersion(5, [1.5], [400, 900]).at([500.0, 600.0]).tolist() == [1.5, 1.5]


def test_a_dispersion_is_a_spectrum():
    s = gn.Dispersion(1, CASES[1], [400.0, 1000.0])
    m = gn.Microfacet(gn.GGX(0.2), gn.Dielectric(s))
    assert m == pickle.loads(pickle.dumps(m)) == from_json(m.to_json()) == gn.expression(repr(m))
    assert m.at(587.0).fresnel.eta == s.at(587.0)
    assert s != gn.Dispersion(2, CASES[1], [400.0, 1000.0]) and s != gn.Spectrum(s.wavelengths, s.values)
    with pytest.raises(ParameterError, match="nothing is extrapolated"):
        s.at(399.0)


def test_formulas_that_are_none():
    for formula, c, reach, message in (
        (10, [1.0], [400, 900], "1 to 9"),
        (True, [1.0], [400, 900], "1 to 9"),
        (1, [], [400, 900], "1 to 25"),
        (1, [np.nan], [400, 900], "finite"),
        (3, [-1.0], [400, 900], "no real value"),
        (1, [0.0, 1.0, 0.1], [0.4, 0.9], "in nm"),
        (1, [0.0, 1.0, 0.1], [900, 400], "first < last"),
    ):
        with pytest.raises(ParameterError, match=message):
            gn.Dispersion(formula, c, reach)


def test_a_resonance_within_the_reach_has_no_index_and_elsewhere_there_is_one():
    s = gn.Dispersion(1, [0.0, 1.0, 0.5], [400, 900])  # n^2 = 1 + x^2/(x^2 - 1/4), below 0 from 400 to 500 nm
    assert s.at([600.0, 900.0]) == pytest.approx([(1.0 + x**2 / (x**2 - 0.25)) ** 0.5 for x in (0.6, 0.9)], rel=1e-14)
    m = gn.Microfacet(gn.GGX(0.1), gn.Dielectric(s))
    assert s.reach == (400.0, 900.0) and m == gn.expression(repr(m)) == from_json(m.to_json())
    for call in (lambda: s.at([450.0, 600.0]), lambda: s.bands([480.0, 600.0])):
        with pytest.raises(ParameterError, match="no real value at 4"):
            call()
    assert s.bands([600.0, 620.0]) == pytest.approx(s.at([600.0, 620.0]), rel=1e-3)
    with pytest.raises(ParameterError, match="400 to 900 nm"):
        s.at(399.0)
