"""`gn.fitting.fit_map`: every texel is fitted as `gn.fit` would, in any shape of arrays, and bad texels are flagged."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.fitting.maps.maps import AT_BOUND, TOO_FEW, UNDETERMINED
from gonio.fitting.samples import spread_pairs

MODEL = gn.Lambertian() + 1.0 * gn.Microfacet(gn.GGX(), gn.Schlick(0.04))
BY = ["rho", "weight", "alpha"]


def directions(count, seed=0):
    wi, wo = spread_pairs(4000)
    half = wi + wo
    near = half[:, 2] / np.linalg.norm(half, axis=1) > np.cos(0.6)
    usable = np.flatnonzero(near & (np.minimum(wi[:, 2], wo[:, 2]) > 0.2))
    rows = np.random.default_rng(seed).choice(usable, count, replace=False)
    return wi[rows], wo[rows]


def texels(shape, count, noise, seed=1):
    random = np.random.default_rng(seed)
    rho, weight = random.uniform(0.05, 0.8, shape), random.uniform(0.2, 1.0, shape)
    alpha = np.exp(random.uniform(np.log(0.1), np.log(0.5), shape))
    wi, wo = directions(count)
    maps = [x[..., None, None] for x in (rho, weight, alpha)]
    truth = gn.Lambertian(maps[0]) + maps[1] * gn.Microfacet(gn.GGX(maps[2]), gn.Schlick(0.04))
    f = truth.f(wi, wo)[..., 0]
    return wi, wo, f * (1.0 + noise * random.standard_normal(f.shape)), (rho, weight, alpha)


def test_exact_values_give_back_every_texel():
    wi, wo, f, truth = texels((20, 30), 32, 0.0)
    found = gn.fitting.fit_map((wi, wo, f), MODEL, "log", by=BY)
    assert not found.flags.any() and found.rms.shape == (20, 30)
    for name, x in zip(found.values, truth, strict=True):
        assert np.allclose(found.values[name], x, rtol=2e-3), name


def test_texels_are_those_of_single_fits():
    wi, wo, f, _ = texels((12,), 40, 0.02)
    u = 0.02 * f
    found = gn.fitting.fit_map((wi, wo, f, u), MODEL, "likelihood", by=BY)
    for k in range(12):
        one = gn.fit((wi, wo, f[k], u[k]), MODEL, by=BY)
        assert np.allclose([x[k] for x in found.values.values()], one.values, rtol=2e-3)
        assert np.allclose([x[k] for x in found.stderr.values()], list(one.stderr.values()), rtol=0.02)
        assert np.isclose(found.rms[k], one.rms, rtol=1e-3)


def test_intervals_of_texels_cover_the_truth():
    wi, wo, f, truth = texels((2000,), 32, 0.01)
    exact = f / (1.0 + 0.0)
    found = gn.fitting.fit_map((wi, wo, f, 0.01 * exact), MODEL, "likelihood", by=BY)
    for name, x in zip(found.values, truth, strict=True):
        inside = np.abs(found.values[name] - x) < 1.96 * found.stderr[name]
        assert 0.925 < inside.mean() < 0.97, (name, inside.mean())


def test_blocks_of_texels_change_nothing(monkeypatch):
    wi, wo, f, _ = texels((50,), 24, 0.01)
    whole = gn.fitting.fit_map((wi, wo, f), MODEL, "log", by=BY)
    monkeypatch.setattr("gonio.fitting.maps.maps.VALUES_AT_ONCE", 24 * 7)
    calls = []
    parts = gn.fitting.fit_map((wi, wo, f), MODEL, "log", by=BY, progress=lambda done, of: calls.append((done, of)))
    for name in whole.values:
        assert np.allclose(whole.values[name], parts.values[name], rtol=1e-3)
    assert calls[-1] == (50, 50) and len(calls) == 8


def test_directions_of_each_texel():
    wi, wo, _, _ = texels((1,), 30, 0.0)
    turns = np.linspace(0.0, 1.0, 5)
    m = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.3), gn.Schlick(0.04))
    f = np.stack([m.f(wi, np.roll(wo, k, axis=0)) for k in range(5)])
    around = np.stack([np.roll(wo, k, axis=0) for k in range(5)])
    found = gn.fitting.fit_map(
        (wi, around, f), gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick(0.04)), "log", by=["rho", "alpha"]
    )
    assert np.allclose(found.values["0.rho"], 0.3, rtol=1e-3) and found.rms.shape == turns.shape


def test_colours_and_the_model_of_the_map():
    wi, wo = directions(20)
    rho = np.random.default_rng(3).uniform(0.1, 0.9, (6, 7, 3))
    f = gn.Lambertian(rho[..., None, :]).f(wi, wo)
    found = gn.fitting.fit_map((wi, wo, f), gn.Lambertian())
    assert set(found.values) == {"rho[0]", "rho[1]", "rho[2]"}
    assert np.allclose(np.stack(list(found.values.values()), -1), rho, rtol=1e-5)
    assert np.allclose(found.model.f([0, 0, 1], [0, 0, 1]), rho / np.pi, rtol=1e-5)


def test_missing_values_and_flags():
    wi, wo, f, _ = texels((5,), 20, 0.0)
    f[0] = np.nan
    f[1, 3:] = np.nan  # three values for three unknowns
    f[2, ::3] = np.nan
    f[3] = 2.0  # brighter than white
    mask = np.ones(f.shape, bool)
    mask[4, 2:] = False
    found = gn.fitting.fit_map((wi, wo, f), MODEL, "log", by=BY, mask=mask)
    assert list(found.used) == [0, 3, 13, 20, 2]
    assert found.flags[0] == TOO_FEW and found.flags[4] == TOO_FEW
    assert found.flags[2] == 0 and found.flags[3] & AT_BOUND
    assert np.isnan(found.values["0.rho"][[0, 4]]).all() and np.isnan(found.stderr["0.rho"][0])
    assert found.values["0.rho"][3] == 1.0 and found.stderr["0.rho"][3] == 0.0
    assert found.count()["fewer values than unknowns: NaN"] == 2 and "texels" in str(found)
    assert np.isnan(found.model.f([0, 0, 1], [0, 0, 1])[0, 0])


def test_what_the_values_do_not_determine_is_flagged():
    wi = gn.direction(np.linspace(0.1, 1.0, 9), 0.0)
    matt = gn.Lambertian() + 0.0 * gn.Microfacet(gn.GGX(0.2))
    found = gn.fitting.fit_map((wi, gn.direction(0.2, 1.0)[None], np.full((4, 9), 0.1)), matt, by=["rho", "alpha"])
    assert (found.flags == UNDETERMINED).all() and np.isinf(found.stderr["1.of.distribution.alpha_x"]).all()
    assert np.allclose(found.values["0.rho"], 0.1 * np.pi) and np.isfinite(found.stderr["0.rho"]).all()


WI = gn.direction(np.linspace(0.1, 1.0, 6), 0.0)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"f": np.ones((3, 5))}, "for 6 observations"),
        ({"f": np.ones((6, 6))}, "coloured=True"),
        ({"wi": np.ones((6, 2))}, "expected"),
        ({"wi": 2.0 * WI}, "unit vectors"),
        ({"wi": np.ones((2, 6, 3)) / np.sqrt(3.0)}, "broadcast"),
        ({"loss": "chi2"}, "expected one of"),
        ({"loss": "likelihood"}, "there is no u"),
        ({"loss": "likelihood", "u": 0.0}, "above 0"),
        ({"mask": np.ones((3, 6))}, "True where a value is used"),
        ({"mask": np.ones((4, 6), bool)}, "broadcast"),
        ({"model": gn.IdealSpecular(0.3)}, "mirror"),
        ({"f": np.ones((0, 6))}, "at least one texel"),
        ({"f": "values"}, "array of numbers"),
        ({"data": np.full((3, 6), 0.1)}, "expected \\(wi, wo, f\\)"),
        ({"data": (WI, WI)}, "got a tuple of 2; expected"),
        ({"data": gn.Lambertian(0.1)}, "got a Lambertian; expected"),
    ],
)
def test_bad_arguments_are_refused(changes, words):
    values = {"wi": WI, "wo": WI, "f": np.full((3, 6), 0.1), "u": None}
    data = tuple(changes.get(name, value) for name, value in values.items())
    more = {"model": gn.Lambertian(), **{k: x for k, x in changes.items() if k not in (*values, "data")}}
    with pytest.raises(gn.Error, match=words):
        gn.fitting.fit_map(changes.get("data", data), **more)


def test_without_a_compiler_the_numbers_are_the_same(monkeypatch):
    wi, wo, f, _ = texels((6,), 24, 0.01)
    compiled = gn.fitting.fit_map((wi, wo, f), MODEL, "log", by=BY)
    monkeypatch.setattr("gonio.evaluate.planning.available", lambda: False)
    plain = gn.fitting.fit_map((wi, wo, f), MODEL, "log", by=BY)
    for name in compiled.values:
        assert np.allclose(compiled.values[name], plain.values[name], rtol=2e-3)
