"""Integrals of maps: each place has what it would have by itself, within the tolerance, however many there are."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from materials import on_sphere
from rooms import MODULES, imported

import gonio as gn
from gonio.declared import discover
from gonio.evaluate.factors import factors
from gonio.formula import tree
from gonio.formula.fields import Param
from gonio.integrals.maps.rows import MaterialRows

SUN = on_sphere(0.6, 0.3)
WIDE = gn.Cone(on_sphere(0.4, 1.0), 0.5)


def random(*shape: int, low: float = 0.0, high: float = 1.0, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(low, high, shape)


def at(m: gn.Reflectance, *place: int) -> gn.Reflectance:
    """The material at one place of its maps."""
    return tree.each(m, lambda x: x[place] if np.ndim(x) > 1 else x)


def ross_li(*shape: int) -> gn.Reflectance:
    limits = ((0.1, 0.4), (0.0, 0.2), (0.0, 0.08))
    return gn.RossLi(*(random(*shape, low=low, high=high, seed=k) for k, (low, high) in enumerate(limits)))


INTEGRALS: dict[str, Any] = {
    "black sky": lambda m, **more: gn.albedo(m, SUN, **more),
    "white sky": lambda m, **more: gn.reflectance(m, **more),
    "to a cone": lambda m, **more: gn.reflectance_factor(m, SUN, WIDE, **more),
    "from a cone": lambda m, **more: gn.reflectance_factor(m, WIDE, SUN, **more),
    "under a sky": lambda m, **more: gn.reflectance_factor(m, gn.Hemisphere(), SUN, sky=gn.ConstantLight(2.0), **more),
}


@pytest.mark.parametrize("name", INTEGRALS)
def test_a_map_is_its_places(name: str) -> None:
    """Of a sum of a kernel model (in shares of its kernels), of a lobe without a map, and of a mirror."""
    integral = INTEGRALS[name]
    m = 0.5 * ross_li(4, 30, 2) + random(30, 1) * gn.Lambertian(0.3) + gn.IdealSpecular(0.1)
    found = integral(m, return_error=True)
    assert found.value.shape == (4, 30, 2) and found.error.shape == (4, 30)
    for place in ((0, 0), (1, 7), (3, 29)):
        one = 0.5 * at(m.terms[0].of, *place) + float(m.terms[1].weight[place[1], 0]) * gn.Lambertian(0.3)
        expected = integral(one + gn.IdealSpecular(0.1))
        assert found.value[place] == pytest.approx(expected, abs=2e-5)
        assert found.error[place] < 1e-4


def test_blue_sky_and_several_suns() -> None:
    m = ross_li(5, 1, 1)
    theta = np.array([0.2, 0.9, 1.2])
    found = gn.remote_sensing.blue_sky_albedo(m, theta, 0.3)
    assert found.shape == (5, 3, 1)
    assert found[3, 1] == pytest.approx(gn.remote_sensing.blue_sky_albedo(at(m, 3, 0), 0.9, 0.3), abs=2e-5)
    own = gn.remote_sensing.black_sky_albedo(m, np.linspace(0.1, 1.0, 5)[:, None])  # a sun for each place
    assert own.shape == (5, 1, 1)
    assert own[2, 0] == pytest.approx(gn.remote_sensing.black_sky_albedo(at(m, 2, 0), 0.55), abs=2e-5)


def test_few_places_are_integrated(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as there are products; and all from few where the formula is no sum of them."""
    counts: list[int] = []
    integrals = MaterialRows.integrals

    def counted(self: Any, rows: np.ndarray, *rest: Any) -> Any:
        counts.append(len(rows))
        return integrals(self, rows, *rest)

    monkeypatch.setattr(MaterialRows, "integrals", counted)
    gn.albedo(ross_li(50, 40, 3), SUN)
    assert sum(counts) == 3
    counts.clear()
    m = gn.RPV(random(1000, 1, low=0.05, high=0.4), random(1000, 1, low=0.6, high=1.1, seed=1), rho_c=0.9)
    found = gn.albedo(m, SUN, return_error=True)
    assert sum(counts) < 400
    assert (found.error <= 1e-4 * np.maximum(1.0, found.value[..., 0])).all()
    for k in (0, 1, 500, int(m.k.argmin()), int(m.k.argmax())):
        assert abs(found.value[k] - gn.albedo(at(m, k), SUN, 1e-8)) < found.error[k] < 1.01e-4


def test_a_place_unlike_the_others_is_integrated_by_itself() -> None:
    alpha = random(2000, 1, low=0.3, high=0.5)
    alpha[700], alpha[701] = 0.02, 0.025
    m = gn.Microfacet(gn.GGX(alpha), gn.Schlick(0.5))
    found = gn.albedo(m, SUN, return_error=True)
    for k in (0, 700, 701):
        assert found.value[k] == pytest.approx(gn.albedo(at(m, k), SUN), abs=1e-4)
    assert (found.error <= 1e-4).all()


@pytest.mark.parametrize("count", [40, 600])
def test_missing_places_stay_missing(count: int) -> None:
    """Alone, and their channel alone, whichever way the integrals are found."""
    w = random(count, 2, low=0.1, high=0.9)
    w[3, 0] = w[5] = math.nan
    w = np.ma.masked_invalid(w)
    for m in (gn.Lambertian(w), gn.Minnaert(w, random(count, 1, low=0.8, high=1.2)), gn.RossLi(w, 0.1, 0.02)):
        for integral in (
            (gn.albedo(m, SUN), gn.remote_sensing.white_sky_albedo(m)) if count < 100 else (gn.albedo(m, SUN),)
        ):
            assert (np.isnan(integral) == np.ma.getmaskarray(w)).all()
        error = gn.albedo(m, SUN, return_error=True).error
        assert np.isfinite(error).all()


def test_channels_that_differ_by_shared_numbers() -> None:
    """Numbers along the channel axis without a map are kept apart; so are lights' channels."""
    m = gn.RossLi(random(6, 5, 1), 0.1, [0.01, 0.02, 0.05], b_r=[0.8, 1.0, 1.5])
    found = gn.albedo(m, SUN)
    assert found.shape == (6, 5, 3)
    expected = gn.albedo(at(m, 2, 3), SUN)
    assert found[2, 3] == pytest.approx(expected, abs=2e-5)
    light = gn.ConstantLight([1.0, 2.0, 0.5])
    for albedo in (random(6, 5, 1), random(6, 5, 3)):
        m = gn.Lambertian(albedo)
        assert gn.reflected_radiance(m, light, SUN) == pytest.approx(albedo * light.radiance, rel=1e-9)
    assert gn.reflected_radiance(gn.Lambertian([0.5]), light, SUN) == pytest.approx([0.5, 1.0, 0.25], rel=1e-9)


@pytest.mark.parametrize("extent", ["constant", "environment"])
def test_radiance_of_textures(extent: str) -> None:
    picture = random(8, 16, 3, seed=5).astype(np.float32)
    light = gn.ConstantLight([1.0, 2.0, 0.5]) if extent == "constant" else gn.EnvironmentLight(picture)
    m = gn.Lambertian(random(12, 40, 3)) + gn.Microfacet(gn.GGX(random(12, 40, 1, low=0.3, high=0.6)))
    normal = on_sphere([[0.0], [0.4]], 1.0)[:, :, None]  # two of them, for all places
    found = gn.reflected_radiance(m, light, SUN, normal, samples=1024)
    assert found.shape == (2, 12, 40, 3)
    for place in ((3, 4), (11, 39)):
        expected = gn.reflected_radiance(at(m, *place), light, SUN, normal[1, 0, 0], samples=1024)
        assert found[1][place] == pytest.approx(expected, rel=1e-4 if extent == "constant" else 2e-2)


MODELS = discover.classes("gonio.models", gn.Reflectance)


@pytest.mark.full
@pytest.mark.parametrize("name", sorted({*MODELS} - {"NormalMapped", "ShadingNormal"}))
def test_every_model(name: str) -> None:
    """All parameters on maps at once, about their defaults; against integrals of some places to 1e-6."""
    rng, count = np.random.default_rng(1), 600

    def mapped(_: str, field: Any, value: Any) -> Any:
        if not isinstance(field, Param) or np.ndim(value):
            return value
        numbers = value * rng.uniform(0.7, 1.3, (count, 1)) if value else rng.uniform(0.0, 0.2, (count, 1))
        return np.clip(numbers, field.low, field.high)

    m = tree.rebuilt(MODELS[name](), mapped)
    found = gn.albedo(m, SUN, return_error=True)
    for k in rng.choice(count, 8):
        expected = np.asarray(gn.albedo(at(m, k), SUN, 1e-8)).reshape(-1)
        assert np.abs(found.value[k] - expected).max() <= max(found.error[k], 1e-6)


def test_factors_of_formulas() -> None:
    x = random(5, 1)
    counts = {gn.Lambertian(x): 1, gn.RossLi(x, x, x): 3, gn.Walthall(x, x, x): 4, gn.RPV(x, rho_c=0.5): 1}
    for m, count in counts.items():
        numbers = factors(m)
        assert numbers is not None and len(numbers) == count
    assert factors(gn.Hapke(x)) is None


def test_the_folder_has_one_door() -> None:
    outside = [name for name in MODULES if not f"{name}.".startswith("integrals.maps.")]
    assert any("integrals.maps" in imported(name)[0] for name in outside)
    for name in outside:
        inner = sorted(other for other in imported(name)[0] if other.startswith("integrals.maps."))
        assert not inner, f"{name} must not import {inner}: integrals/maps/__init__.py is the door"
