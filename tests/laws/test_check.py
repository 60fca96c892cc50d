"""`check`: every law fails on a model that breaks it, holds where it is obeyed, and measures what closed forms say."""

from __future__ import annotations

import json
import math
import re
from typing import Any, ClassVar

import numpy as np
import pytest
from click.testing import CliRunner
from libraries import switch_off, thinned
from materials import MODELS
from places import ROOT

import gonio as gn
from gonio.arrays import ops
from gonio.base.reflectance import Reflectance
from gonio.cli.commands import cli
from gonio.declared.discover import docstring, labelled
from gonio.errors import NotFoundError, ParameterError
from gonio.figures import laws_figure
from gonio.formula import tree
from gonio.formula.direction import Direction
from gonio.formula.fields import param
from gonio.formula.mueller import Mueller
from gonio.formula.warp import power_cosine, power_cosine_density
from gonio.integrals.efficiency import sampling_efficiency
from gonio.laws import FOLLOWS, LAWS, MODULES, _overview, cavity, check_all, derivatives, furnace, limit, table
from gonio.laws._verdict import Law, Report
from gonio.models.phong import ModifiedPhong
from gonio.pictures.image import load_image
from gonio.testing import assert_lawful, each_law

PI = math.pi
VERDICTS = (ROOT / "docs" / "models" / "laws.md").read_text(encoding="utf-8")


def law(m: Reflectance, name: str) -> Law:
    """The verdict of one law."""
    return gn.check(m, laws=[name])[name]


# Models that break one law each. Their names start with an underscore, so that nothing else finds them.


class _Negative(Reflectance):
    """Below 0 for light and viewer close to the normal."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.1 - 0.2 * (wi.z * wo.z) * (wi.z * wo.z)


class _NaN(Reflectance):
    """0/0 for light and viewer at the same place."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        d = (wi.x - wo.x) * (wi.x - wo.x) + (wi.y - wo.y) * (wi.y - wo.y)
        return 0.1 * d / d


class _OneWay(Reflectance):
    """Depends on the light's angle alone."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.2 * wi.z


class _Brushed(Reflectance):
    """Brighter along x, but does not say so."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.1 + 0.1 * wi.x * wi.x * wo.x * wo.x


class _Handed(Reflectance):
    """Isotropic, but different on the left and on the right of the light."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        side = wi.x * wo.y - wi.y * wo.x
        return 0.1 + 0.05 * side


class _Bright(Reflectance):
    """Albedo 1.2."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 1.2 / PI + 0.0 * wi.z


class _Resonant(Reflectance):
    """Reflects too much between 50 and 54 degrees, where neither the energy law nor the furnace looks."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        a, b = (wi.z - math.cos(0.91)) / 0.03, (wo.z - math.cos(0.91)) / 0.03
        return 0.3 + 3.0 * ops.exp(-a * a - b * b)


class _WrongDensity(Reflectance):
    """Draws a cosine lobe, and says that it is a narrower one."""

    n = param(3.0, 0.0, 100.0, "exponent")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.2 + 0.0 * wi.z

    def density(self, wi: Direction, wo: Direction) -> Any:
        return power_cosine_density(self.n, wi.z)


class _Unnormalized(Reflectance):
    """Its density integrates to 1.1."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.2 + 0.0 * wi.z

    def density(self, wi: Direction, wo: Direction) -> Any:
        return 1.1 / PI * wi.z


class _Jump(Reflectance):
    """Cut off less than half a degree above the horizon."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return ops.where((wi.z < 0.005) | (wo.z < 0.005), 0.0, 0.3)


class _Growing(Reflectance):
    """Grows as 1/cos^1.5, faster than a beam gets thinner."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.001 / (wi.z * wo.z * ops.sqrt(wi.z * wo.z))


class _Infinite(Reflectance):
    """Infinite at the horizon's last tenth of a degree."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.1 + 0.1 / ops.where(wi.z * wo.z < 1e-4, 0.0, 1.0)


class _Stopped(Reflectance):
    """A factor that differentiation does not see."""

    k = param(0.5, 0.0, 1.0, "strength")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.2 * self.k * (1.0 + ops.stop_gradient(wi.z * wo.z))


class _StoppedParameter(Reflectance):
    """A hundredth of what the parameter does is hidden from differentiation."""

    k = param(0.5, 0.0, 1.0, "strength")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.2 * (0.99 * self.k + 0.01 * ops.stop_gradient(self.k)) + 0.0 * wi.z


class _NoSlope(Reflectance):
    """Its derivative at normal incidence is 0/0."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.1 + 0.05 * ops.sqrt(wi.x * wi.x + wi.y * wi.y) * ops.sqrt(wo.x * wo.x + wo.y * wo.y)


class _Blurred(ModifiedPhong):
    """Says that it becomes a mirror, but never gets narrower than n = 10."""

    def cos_to_mirror(self, wi: Direction, wo: Direction) -> Any:
        return super().cos_to_mirror(wi, wo)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return tree.unchecked(ModifiedPhong, rho_s=self.rho_s, n=ops.minimum(self.n, 10.0)).formula(wi, wo)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return tree.unchecked(ModifiedPhong, rho_s=self.rho_s, n=ops.minimum(self.n, 10.0)).density(wi, wo)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return tree.unchecked(ModifiedPhong, rho_s=self.rho_s, n=ops.minimum(self.n, 10.0)).warp(wo, u0, u1)


class _WrongMirror(ModifiedPhong):
    """Becomes a mirror of another reflectance than it says."""

    def mirror(self, wo: Direction) -> Any:
        return self.rho_s + 0.0 * wo.z  # without the cosine


class _TakesAway(Reflectance):
    """Light of one wavelength makes another one darker."""

    fluoresces = True
    rho = param(0.5, 0.0, 1.0, "albedo")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.rho / PI

    def reradiated(self, light: Reflectance, wi: Direction, wo: Direction) -> Any:
        return 0.01 * (self.rho - 0.5) * wi.z


class _Declared(_Bright):
    """Says that it breaks the law of energy."""

    breaks: ClassVar[dict[str, str]] = {"energy": "made 1.2 on purpose, for this test"}


class _Overpolarized(Reflectance):
    """Leaves more polarized than light can be."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.1 + 0.0 * wi.z

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        f, zero = self.formula(wi, wo), (0.0,) * 4
        return Mueller(((f, 1.1 * f, 0.0, 0.0), (1.1 * f, f, 0.0, 0.0), zero, zero))


class _OneWayPolarized(Reflectance):
    """Light is polarized as it leaves, but none as it arrives is preferred."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return 0.1 + 0.0 * wi.z

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        f, zero = self.formula(wi, wo), (0.0,) * 4
        return Mueller(((f, 0.0, 0.0, 0.0), (0.5 * f, 0.0, 0.0, 0.0), zero, zero))


BROKEN = [
    (_Negative(), "positivity"),
    (_NaN(), "positivity"),
    (_Infinite(), "positivity"),
    (_OneWay(), "reciprocity"),
    (_OneWayPolarized(), "reciprocity"),
    (_Overpolarized(), "realizability"),
    (_Brushed(), "isotropy"),
    (_Bright(), "energy"),
    (_Bright(), "furnace"),
    (_Bright(), "cavity"),
    (_Resonant(), "cavity"),
    (gn.Donaldson([[0.2, 0.0], [0.7, 0.6]], wavelengths=[400.0, 550.0]), "photons"),
    (_WrongDensity(), "sampling"),
    (_Unnormalized(), "pdf"),
    (_Jump(), "grazing"),
    (_Growing(), "grazing"),
    (_Infinite(), "grazing"),
    (_Stopped(), "derivatives"),
    (_StoppedParameter(), "derivatives"),
    (_NoSlope(), "derivatives"),
    (_Blurred(), "limit"),
    (_WrongMirror(), "limit"),
]
GOOD = {
    "Lambertian": gn.Lambertian([0.2, 0.5, 1.0]),
    "white GGX": gn.Microfacet(gn.GGX(0.5), 1.0),
    "very narrow": gn.Microfacet(gn.GGX(0.001), gn.Dielectric(0.7), "v_groove"),
    "anisotropic": gn.Microfacet(gn.Beckmann(0.1, 0.4), gn.Conductor()),
    "mirror": gn.IdealSpecular(gn.Conductor()),
    "sum": 0.3 * gn.Lambertian(0.5) + gn.ABC() + 0.2 * gn.IdealSpecular(),
    "narrow Phong": gn.ModifiedPhong(1.0, 5000.0),
}


@pytest.mark.parametrize(("m", "name"), BROKEN, ids=lambda x: x if isinstance(x, str) else type(x).__name__)
def test_a_law_fails_where_it_is_broken(m, name):
    found = law(m, name)
    assert not found.passed and found.verdict == "FAIL"
    assert found.value > found.tolerance or name == "positivity"
    assert found.where and found.why


@pytest.mark.parametrize("name", thinned(GOOD, [name for name in GOOD if "narrow" not in name]))
def test_laws_hold_where_they_are_obeyed(name):
    report = gn.check(GOOD[name])
    assert report.passed and report.lawful, report


@pytest.mark.parametrize("m", [_Brushed(), _Stopped(), _Jump(), _WrongMirror()], ids=lambda m: type(m).__name__)
def test_only_the_broken_law_fails(m):
    broken = {name for x, name in BROKEN if type(x) is type(m)}
    assert {found.name for found in gn.check(m).laws if not found.passed} == broken


def test_fluorescence_is_held_to_photons():
    ink = gn.Donaldson([[0.2, 0.0], [0.7, 0.6]], wavelengths=[400.0, 550.0])
    report = gn.check(ink)
    assert [found.name for found in report.laws if not found.passed] == ["photons"]
    np.testing.assert_allclose(report["photons"].value, 0.2 + 0.7 * 550.0 / 400.0, rtol=1e-3)
    assert "photons" not in gn.check(gn.Lambertian([0.2, 0.6], wavelengths=[400.0, 550.0])).verdicts
    darker = law(_TakesAway([0.4, 0.6], wavelengths=[400.0, 550.0]), "photons")
    assert not darker.passed and darker.value < 0.0 and "takes light of 400 nm away" in darker.why
    unknown = gn.check(gn.Donaldson([[0.2, 0.0], [0.7, 0.6]]), laws=["photons"])
    assert not unknown.laws and "wavelengths of the channels are not known" in unknown.notes[0]
    against = gn.check(gn.Donaldson([[0.2, 0.1], [0.3, 0.6]], wavelengths=[400.0, 550.0]), laws=["photons"])
    share = 0.1 * 400.0 / 550.0
    assert f"{share / (share + 0.3 * 550.0 / 400.0):.2%}" in against.notes[0] and "Stokes" in against.notes[0]


def test_what_only_the_cavity_sees():
    report = gn.check(_Resonant(), laws=["energy", "furnace", "cavity"])
    assert report.verdicts == {"energy": "pass", "furnace": "pass", "cavity": "FAIL"}


def test_every_law_has_a_model_that_breaks_it():
    assert {name for _, name in BROKEN} == set(LAWS)
    assert set(FOLLOWS) <= set(LAWS)


def test_every_law_has_a_place_of_its_own():
    places = [module.ORDER for module in MODULES.values()]
    assert places == sorted(set(places))


@pytest.mark.parametrize("name", LAWS)
def test_a_law_says_the_tolerance_that_it_has(name):
    module = MODULES[name]
    said = labelled(docstring(module), ("Measured", "Holds if", "Tolerance"))
    assert said["Measured"] and said["Tolerance"]
    numbers = {float(x) for x in re.findall(r"\d[\d.e-]*", said["Holds if"])}
    limits = {getattr(module, limit) for limit in ("TOLERANCE", "GROWTH", "JUMP") if hasattr(module, limit)}
    assert numbers - {1.0, 0.0} == limits


# Values.


@pytest.mark.parametrize("a", [0.0, 0.3, 0.9])
def test_cavity_of_a_lambertian(a):
    L, error = cavity.radiance(gn.Lambertian(a))
    powers = a ** np.arange(1.0, cavity.BOUNCES + 1)
    np.testing.assert_allclose(L, np.broadcast_to(powers[:, None, None], L.shape), rtol=1e-12)
    assert error.max() < 1e-12
    np.testing.assert_allclose(cavity.steady(gn.Lambertian(a), 2.0), 2.0 / (1.0 - a), rtol=1e-12)


def test_cavity_settles_only_where_light_dies_out():
    assert np.isinf(cavity.steady(gn.Lambertian(1.0))).all()
    assert np.isinf(cavity.steady(_Bright())).all()
    np.testing.assert_allclose(cavity.steady(gn.IdealSpecular(0.75)), 4.0, rtol=1e-12)


def test_cavity_of_a_separable_material():
    """f = 3 a z_i z_o/(2 pi): L_k = a z_o (3 a/4)^(k - 1), as z^2 dw integrates to 2 pi/3 and z^3 dw to pi/2."""

    class _Separable(Reflectance):
        def formula(self, wi: Direction, wo: Direction) -> Any:
            return 3.0 * 0.8 / (2.0 * PI) * wi.z * wo.z

    L, error = cavity.radiance(_Separable())
    z = cavity.starts()[:, 2]
    for k in range(4):
        expected = 0.8 * z * (0.75 * 0.8) ** k
        assert (np.abs(L[k, :, 0] - expected) <= 4.0 * error[k, :, 0] + 2e-3 * expected).all(), k


def test_between_plates_directions_stay_parallel():
    """A mirror that reflects more on the side of +x: seen from there, so are all later bounces; y turns over."""

    class _Mirror(Reflectance, oriented=True):
        is_delta: ClassVar[bool] = True

        def formula(self, wi: Direction, wo: Direction) -> Any:
            return 0.0 * wi.z

        def mirror(self, wo: Direction) -> Any:
            return 0.5 + 0.3 * wo.x + 0.1 * wo.y

    L, _ = cavity.radiance(_Mirror(), 3)
    x, y, _ = cavity.starts().T
    here, there = 0.5 + 0.3 * x + 0.1 * y, 0.5 + 0.3 * x - 0.1 * y
    np.testing.assert_allclose(L[..., 0], [here, here * there, here * there * here], rtol=1e-9)


def test_values_of_a_lambertian():
    report = gn.check(gn.Lambertian(0.5))
    assert report["positivity"].value == pytest.approx(0.5 / PI)
    assert report["energy"].value == pytest.approx(0.5)
    assert report["furnace"].value == pytest.approx(0.5)
    assert report["cavity"].value == pytest.approx(0.5)
    assert report["reciprocity"].value == report["isotropy"].value == 0.0
    assert report["grazing"].value == pytest.approx(0.1, rel=1e-3)  # f cos is proportional to the cosine
    assert "limit" not in report.verdicts


def test_furnace_of_white_ggx():
    """1 - ln 2 returns at normal incidence for F = 1 and alpha = 1 (see `Microfacet`)."""
    views, L = furnace.radiance(gn.Microfacet(gn.GGX(1.0), 1.0))
    assert views[0, 2] == 1.0
    assert L[0, 0] == pytest.approx(1.0 - math.log(2.0), abs=1e-3)


def test_size_of_what_is_broken():
    assert law(_OneWay(), "reciprocity").value == pytest.approx(2.0, abs=0.01)
    assert law(_Bright(), "energy").value == pytest.approx(1.2)
    assert law(_Bright(), "cavity").value == pytest.approx(1.2**cavity.BOUNCES)
    assert law(_Unnormalized(), "pdf").value == pytest.approx(0.1, abs=1e-3)
    assert law(_Growing(), "grazing").value == pytest.approx(10.0**0.5, rel=1e-3)
    assert law(_Infinite(), "grazing").value == law(_NoSlope(), "derivatives").value == math.inf
    assert law(_Jump(), "grazing").value == 1.0
    stopped = max(float(s.error.max()) for s in derivatives.slopes(_StoppedParameter()) if s.name == "k")
    assert stopped == pytest.approx(0.01 / (0.99 + 1.0 + 1.0), rel=1e-2)  # of both slopes and f/k
    # cos(theta) against 1, seen from 70 degrees
    assert law(_WrongMirror(), "limit").value == pytest.approx(0.5 * (1.0 - math.cos(math.radians(70.0))), abs=1e-3)


@pytest.mark.parametrize("k", [0.0, 0.5, 1.0])
def test_derivatives_at_the_bounds(k):
    assert law(gn.Lambertian(k), "derivatives").passed
    assert not law(_Stopped(k if k else 1e-3), "derivatives").passed


def test_derivatives_at_kinks():
    """V-grooves have edges, and pairs lie on them: one-sided slopes are what can be asked."""
    wi, wo = derivatives.directions(gn.TorranceSparrow(0.2))
    assert (wi == wo).all(axis=1).sum() > 10
    assert law(gn.TorranceSparrow(0.2), "derivatives").passed
    assert law(gn.Microfacet(gn.GGX(0.01, 0.3), gn.Dielectric(0.5), "v_groove"), "derivatives").passed


def test_limit_follows_all_widths():
    m = gn.Lambertian(0.5) + gn.Microfacet(gn.GGX([0.2, 0.3, 0.4], 0.5), gn.Dielectric(1.5))
    (lobe,) = limit.lobes(m)
    assert {path: end for path, _, end in limit.narrow_ends(lobe)} == {
        "distribution.alpha_x": 1e-3, "distribution.alpha_y": 1e-3
    }  # fmt: skip
    n = limit.narrowing(lobe)
    assert (np.diff(n.outside, axis=0) < 0.0).all()
    np.testing.assert_allclose(n.mirror[-1, 0], 0.04, rtol=1e-12)
    np.testing.assert_allclose(n.albedo[-1], n.mirror[-1], atol=1e-4)
    assert limit.lobes(gn.IdealSpecular()) == limit.lobes(gn.Lambertian()) == []


# Reports.


def test_notes_on_symmetry():
    def notes(m: Reflectance) -> str:
        return " ".join(gn.check(m, laws=["isotropy"]).notes)

    assert "|phi_i - phi_o|" in notes(gn.Lambertian(0.5))
    assert "handed" in notes(_Handed())
    assert "anisotropic" in notes(gn.Microfacet(gn.GGX(0.1, 0.4))) and "phi -> -phi changes nothing" in notes(
        gn.Microfacet(gn.GGX(0.1, 0.4))
    )
    assert gn.check(gn.Microfacet(gn.GGX(0.3)), laws=["isotropy"]).verdicts == {"isotropy": "pass"}
    assert gn.check(gn.Microfacet(gn.GGX(0.1, 0.4)), laws=["isotropy"]).verdicts == {}


def test_declared_breaches():
    report = gn.check(_Declared())
    assert not report.passed and report.lawful
    broken = [found for found in report.laws if not found.passed]
    assert [found.name for found in broken] == ["energy", "furnace", "cavity"]
    assert all(found.verdict == "breaks" and "on purpose" in found.declared for found in broken)
    text = str(report)
    assert text.count("FAIL") == 3 and text.count("on purpose") == 1 and text.count("as for energy") == 2


def test_two_runs_agree():
    m = gn.ModifiedPhong([0.2, 0.1, 0.3])
    assert gn.check(m) == gn.check(m)


def test_what_check_refuses():
    with pytest.raises(NotFoundError, match="no law 'entropy'"):
        gn.check(gn.Lambertian(), laws=["entropy"])


def test_untraceable_formulas_are_checked():
    class _Branching(Reflectance):
        def formula(self, wi: Direction, wo: Direction) -> Any:
            return 0.1 if np.ndim(wi.z) == 0 and wi.z > 2.0 else 0.2 + 0.0 * np.asarray(wi.z)

    report = gn.check(_Branching())
    assert report.passed and "derivatives" not in report.verdicts
    assert any("derivatives: not tested" in note for note in report.notes)


def test_progress_counts_laws():
    seen = []
    gn.check(gn.Lambertian(), progress=lambda done, total: seen.append((done, total)), laws=["energy", "pdf"])
    assert seen == [(1, 2), (2, 2)]


# All models.


def test_all_models(monkeypatch):
    assert set(_overview.models().values()) == set(MODELS)
    few = {"Lambertian": gn.Lambertian, "_Declared": _Declared, "_Brushed": _Brushed}
    monkeypatch.setattr(_overview, "models", lambda: few)
    reports = check_all()
    header, *rows = table(reports)
    assert header == ("model", *LAWS) and [row[0] for row in rows] == list(few)
    verdicts = {row[0]: dict(zip(header, row, strict=True)) for row in rows}
    assert verdicts["Lambertian"]["limit"] == "–" and verdicts["Lambertian"]["energy"] == "pass"
    assert verdicts["_Declared"]["energy"] == verdicts["_Declared"]["cavity"] == "breaks"
    assert verdicts["_Brushed"]["isotropy"] == "FAIL"
    result = CliRunner().invoke(cli, ["check", "--all"])
    assert result.exit_code == 1
    assert "3 models: 1 obey every law, 1 break some as declared, 1 fail" in result.stdout
    assert "_Declared  breaks  energy, furnace, cavity: made 1.2 on purpose" in result.stdout
    few.clear()
    few["_Declared"] = _Declared
    result = CliRunner().invoke(cli, ["check", "--all", "--json"])
    (listed,) = json.loads(result.stdout)
    assert result.exit_code == 0 and listed["name"] == "_Declared" and listed["lawful"] and not listed["passed"]


LISTED = (gn.ABC, gn.Lambertian, gn.Phong)


@pytest.mark.parametrize(
    "model",
    [pytest.param(m, id=m.__name__, marks=() if m in LISTED else pytest.mark.texts) for m in MODELS],
)
def test_every_model_is_lawful(model, monkeypatch):
    """Every verdict of docs/models/laws.md: with default parameters, by every law. With other parameters all models are
    held to the laws by tests/models/test_laws.py."""
    switch_off(monkeypatch)  # a dozen kernels for each take three times as long to compile as the laws to try
    report = gn.check(model())
    assert report.lawful, report
    (row,) = re.findall(rf"^\| \[`{model.__name__}`\].*?\| (.*) \|$", VERDICTS, re.MULTILINE)
    on_page = dict(zip(LAWS, row.replace("*", "").split(" | "), strict=True))
    assert on_page == dict.fromkeys(LAWS, "–") | report.verdicts, "python3 dev.py docs --laws"


# Sampling, figure, command line.


def test_efficiency_of_perfect_sampling():
    rows = sampling_efficiency(gn.Lambertian([0.2, 0.4, 0.6]))
    assert all(row.lobe == "all" and row.chosen == 1.0 for row in rows)
    assert [row.mean for row in rows] == pytest.approx([0.4] * len(rows))
    assert max(row.scatter for row in rows) < 1e-6 and min(row.effective for row in rows) > 1.0 - 1e-12
    assert max(row.lost for row in rows) == 0.0


def test_efficiency_of_a_lobe_that_misses():
    """Seen from theta, a lobe cos(theta)^n sampled by cosines has effective (n + 2)^-2 (2 n + 2): 0.75 for n = 2."""

    class _Squared(Reflectance):
        def formula(self, wi: Direction, wo: Direction) -> Any:
            return 0.1 * wi.z * wi.z * wo.z * wo.z

    row = sampling_efficiency(_Squared())[0]
    # weights 0.1 pi z^2 over the cosine hemisphere: mean of z^2 is 1/2, of z^4 1/3
    assert row.mean == pytest.approx(0.05 * PI, rel=1e-3)
    assert row.effective == pytest.approx(0.75, rel=1e-3)
    assert row.scatter == pytest.approx(3.0**-0.5, rel=1e-3)


def test_efficiency_below_the_horizon():
    """Half of a lobe that is drawn around the horizon is lost."""

    class _Tilted(Reflectance):
        def formula(self, wi: Direction, wo: Direction) -> Any:
            return 0.1 + 0.0 * wi.z

        def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
            w = power_cosine(1.0, u0, u1)
            return Direction(w.z, w.y, w.x)

        def density(self, wi: Direction, wo: Direction) -> Any:
            return power_cosine_density(1.0, wi.x)

    assert sampling_efficiency(_Tilted())[0].lost == pytest.approx(0.5, abs=1e-3)


def test_efficiency_by_lobe():
    m = gn.Lambertian(0.2) + 0.5 * gn.Microfacet(gn.GGX(0.3)) + 0.1 * gn.IdealSpecular()
    rows = [row for row in sampling_efficiency(m) if row.theta_o == 60.0]
    assert [row.lobe for row in rows] == ["all", "0 Lambertian", "1 Microfacet", "2 IdealSpecular"]
    assert sum(row.chosen for row in rows[1:]) == pytest.approx(1.0)
    assert sum(row.mean for row in rows[1:]) == pytest.approx(rows[0].mean, rel=2e-3)
    assert rows[1].effective == pytest.approx(1.0) and rows[3].effective == pytest.approx(1.0)
    assert rows[2].effective < 1.0 and rows[2].lost > 0.0


@pytest.mark.slow_because("a check tries all laws, and sampling at four angles")
def test_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke
    result = run(cli, ["check", "Lambertian(0.2) + ModifiedPhong(0.5)", "--sampling"])
    assert result.exit_code == 0 and "effective" in result.stdout and "1 ModifiedPhong" in result.stdout
    found = json.loads(run(cli, ["check", "Phong()", "--sampling", "--json"]).stdout)
    assert {law["name"]: law["verdict"] for law in found["laws"]}["energy"] == "breaks"
    assert found["lawful"] and not found["passed"]
    assert found["sampling"][0]["theta_o"] == 0.0 and found["sampling"][0]["lobe"] == "all"
    assert run(cli, ["check", "Phong()", "--plot", "a.txt"]).exit_code != 0


@pytest.mark.parametrize("whole", thinned([False, True], [False]))
def test_plot_of_the_command(tmp_path, monkeypatch, whole):
    """The whole figure is drawn by `test_figures_of_odd_materials`, too."""
    if not whole:
        monkeypatch.setattr(laws_figure, "_draw", lambda figure, m, report: figure.add_subplot())
    result = CliRunner().invoke(cli, ["check", "Phong()", "--plot", str(tmp_path / "a.png")])
    assert result.exit_code == 1, result.output
    assert min(load_image(tmp_path / "a.png").pixels.shape[:2]) > 500


@pytest.mark.parametrize("words", [[], ["gold", "--all"], ["--all", "--sampling"], ["--all", "-p", "rho=1"]], ids=str)
def test_command_line_refuses(words):
    result = CliRunner().invoke(cli, ["check", *words])
    assert (result.exit_code == 2 and "expected one of" in result.stderr) or "--all takes no" in result.stderr


@pytest.mark.parametrize("laid", thinned([False, True], [False]))
@pytest.mark.parametrize("m", thinned([gn.IdealSpecular(), _Infinite()], [_Infinite()]), ids=lambda m: type(m).__name__)
def test_figures_of_odd_materials(tmp_path, m, laid, request):
    if not laid:
        request.getfixturevalue("unlaid")
    gn.figures.laws(m, Report("odd", gn.check(m, laws=["positivity"]).laws), tmp_path / "a.png")
    assert min(load_image(tmp_path / "a.png").pixels.shape[:2]) > 500
    with pytest.raises(ParameterError, match="ends in"):
        gn.figures.laws(m, Report("odd", ()), tmp_path / "a.gif")


# For tests of users.


def test_assert_lawful():
    assert assert_lawful(gn.Lambertian(0.5)).passed
    assert_lawful(_Declared())
    assert_lawful(_Bright(), except_=["energy", "furnace", "cavity"])
    assert_lawful(_Brushed(), except_="isotropy", laws=["isotropy", "energy"])
    assert_lawful(_Brushed(), laws="energy")
    with pytest.raises(AssertionError, match=r"breaks isotropy\n.*_Brushed"):
        assert_lawful(_Brushed(), laws=["isotropy"])
    with pytest.raises(AssertionError, match="energy: excepted, but obeyed"):
        assert_lawful(gn.Lambertian(0.5), except_="energy", laws="energy")
    with pytest.raises(NotFoundError, match="entropy"):
        assert_lawful(gn.Lambertian(0.5), except_="entropy")


@each_law
def test_each_law(law):
    assert_lawful(gn.Lambertian(0.5), laws=[law])
