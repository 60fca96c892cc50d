"""Built-in materials: which there are, what they are made of, and numbers from their sources."""

import re
from collections import Counter
from importlib import resources

import numpy as np
import pytest
from sweeps import every

import gonio as gn
from gonio.base.measured import Measured
from gonio.catalogue import builtin
from gonio.catalogue.builtin import refractive_index
from gonio.catalogue.citations import _entries, _source
from gonio.errors import NotFoundError, ParameterError
from gonio.formats import formats
from gonio.formula.fields import CLASSES
from gonio.formula.fresnel.conductor import fresnel_conductor
from gonio.formula.fresnel.dielectric import fresnel_dielectric
from gonio.pictures.colour import to_rgb

ENTRIES = gn.materials()
SYMBOLS = {"Ag", "Al", "Au", "Cr", "Cu", "Fe", "H2O", "MgF2", "Ni", "SiO2", "Ti", "TiO2", "W"}


def test_there_are_100_fits_and_13_substances():
    assert Counter(e.kind for e in ENTRIES) == {"measured fit": 100, "metal": 9, "dielectric": 4}
    names = [name.lower() for e in ENTRIES for name in (e.name, *e.aliases)]
    assert len(names) == len(set(names))
    assert all(e.description and "doi:10." in e.source for e in ENTRIES)


@every(entry=ENTRIES)
def test_every_entry_makes_a_reflectance(entry):
    m = gn.material(entry.name)
    w = gn.direction(np.array([0.3, 0.9]), np.array([0.1, 2.0]))
    f = m.f(w, w[::-1])
    assert f.shape == (2, 3) and np.all(f >= 0.0) and np.all(np.isfinite(f))
    assert gn.expression(repr(m)) == m
    assert all(gn.material(alias) == m for alias in entry.aliases)


def test_names_are_read_as_people_write_them():
    gold = gn.material("gold-metallic-paint")
    assert gold == gn.material("Gold Metallic Paint") == gn.material(" gold_metallic_paint ")
    assert gn.material("au") == gn.material("AU") == gn.material("Gold")


def test_metals_and_samples_of_the_same_name_are_told_apart():
    assert isinstance(gn.material("aluminium").terms[1], gn.ABC)
    assert isinstance(gn.material("nickel").terms[1], gn.ABC)
    assert gn.material("pure-aluminium") == gn.material("Al") != gn.material("aluminium")
    assert gn.material("pure-nickel") == gn.material("Ni")
    described = {e.name: e.description for e in ENTRIES}
    assert "pure-aluminium" in described["aluminium"] and "pure-nickel" in described["nickel"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("gold-metalic-paint", "gold-metallic-paint"),
        ("Aluminum foil", "aluminium"),
        ("paint", "paint"),
        ("zzz", "gonio materials"),
        ("", "gonio materials"),
    ],
)
def test_unknown_names(name, said):
    with pytest.raises(NotFoundError, match=re.escape(said)):
        gn.material(name)


# The fits.


def test_fits_hold_the_published_numbers():
    diffuse, lobe = gn.material("chrome").terms
    assert lobe.A[0] == 901.24337
    table = (resources.files("gonio") / "data" / "merl_abc.tsv").read_text(encoding="utf-8")
    for line in table.splitlines():
        name, *numbers = line.split("\t")
        if name != "name" and not line.startswith("#"):
            diffuse, lobe = gn.material(name).terms
            held = [*diffuse.rho, *lobe.A, lobe.B, lobe.C, lobe.eta]
            assert held == [float(x) for x in numbers], name


def test_chrome_has_the_values_of_its_source():
    # f of the fit's own formula (Löw et al. 2012, eq. 10 to 14), evaluated with 50 digits.
    f = gn.material("chrome").f_angles(0.7, 0.1, 0.705, 3.24)
    assert f == pytest.approx([383.23966323932867, 299.54370804789038, 271.77458053503378], rel=1e-12)


def test_fits_have_no_options():
    with pytest.raises(ParameterError, match="pure-aluminium is the metal"):
        gn.material("aluminium", alpha=0.2)
    with pytest.raises(ParameterError, match=r"replace\(\.\.\.\)$"):
        gn.material("brass", wavelengths=500)


# The substances.


@pytest.mark.parametrize(
    ("substance", "nm", "n", "k", "tolerance"),
    [
        ("SiO2", 587.6, 1.458462, 0.0, 2e-6),  # Malitson 1965, Sellmeier formula
        ("water", 589.3, 1.333349, 0.0, 2e-6),  # Daimon & Masumura 2007, 20 C
        ("gold", 630.0, 0.188361, 3.403382, 1e-6),  # Johnson & Christy 1972, between 616.8 and 659.5 nm
        ("Ag", 300.9, 1.34, 0.964, 1e-12),  # Johnson & Christy 1972, a row of the table
    ],
)
def test_refractive_indices(substance, nm, n, k, tolerance):
    assert gn.spectra.refractive_index(substance, nm) == pytest.approx((n, k), abs=tolerance)


def test_refractive_index_keeps_shapes():
    n, k = refractive_index("Au", np.linspace(400.0, 700.0, 6).reshape(2, 3))
    assert n.shape == k.shape == (2, 3)
    assert isinstance(refractive_index("Au", 550)[0], float)
    assert all(np.all(np.diff(t[:, 0]) > 0) for t in builtin._indices().values())
    assert set(builtin._indices()) == SYMBOLS


@pytest.mark.parametrize("nm", [250.0, 2000.0, [500.0, 0.5], np.nan, np.inf, -1.0])
def test_nothing_is_extrapolated(nm):
    with pytest.raises(ParameterError, match="to 1216 nm"):
        refractive_index("gold", nm)
    with pytest.raises(ParameterError, match="nothing is extrapolated"):
        gn.material("gold", wavelengths=nm)


def test_bad_substances_and_wavelengths():
    with pytest.raises(NotFoundError, match=r"gold \(Au\)"):
        refractive_index("platinum", 500)
    with pytest.raises(NotFoundError):
        refractive_index("brass", 500)
    with pytest.raises(ParameterError, match="expected numbers"):
        refractive_index("gold", "red")
    for wavelengths in ([], [[500.0]]):
        with pytest.raises(ParameterError, match="a number or a list"):
            gn.material("gold", wavelengths=wavelengths)
    for alpha in (-0.1, 2.0, np.nan, "x", [0.1, 0.0]):
        with pytest.raises(ParameterError, match="expected"):
            gn.material("gold", alpha=alpha)


def test_metals_are_microfacets_of_their_index():
    gold, three = gn.material("gold"), [630, 532, 465]
    assert gold == gn.Microfacet(gn.GGX(0.1), gold.fresnel) and isinstance(gold.fresnel, gn.Conductor)
    assert gold.channel_names is None  # linear RGB
    assert gn.material("gold", alpha=0.3) == gn.Microfacet(gn.GGX(0.3), gold.fresnel)
    assert gn.material("gold", alpha=0) == gn.IdealSpecular(gold.fresnel)
    by_name = gn.material("gold", wavelengths=three)
    by_index = gn.Conductor(*refractive_index("gold", three))
    assert by_name == gn.Microfacet(gn.GGX(0.1), by_index, wavelengths=three) != gold
    assert by_name != gn.Microfacet(gn.GGX(0.1), by_index)


@pytest.mark.parametrize("entry", [e for e in ENTRIES if e.kind != "measured fit"], ids=lambda e: e.name)
def test_rgb_is_the_colour_of_the_spectrum(entry):
    """The two ways to a picture agree at all angles: RGB, and 421 wavelengths turned into RGB."""
    wavelengths = np.arange(360.0, 781.0)
    w = gn.direction(np.linspace(0.0, 1.57, 80), 0.0)
    spectrum = gn.material(entry.name, alpha=0, wavelengths=wavelengths).delta_reflectance(w)
    reference = spectrum @ to_rgb(wavelengths)
    rgb = gn.material(entry.name, alpha=0).delta_reflectance(w)
    error = {"copper": [0.0032, 0.0002, 0.0004], "gold": [0.0, 0.0007, 0.0014]}.get(entry.name, [6e-4, 3e-4, 3e-4])
    if entry.name == "gold":  # red is held
        np.testing.assert_allclose(rgb[:, 0], spectrum.max(axis=1), atol=0.001)
        assert reference[0, 0] == pytest.approx(1.038, abs=0.001)
        rgb[:, 0] = reference[:, 0]
    assert np.all(np.abs(rgb - reference).max(axis=0) <= error)


def test_a_metal_at_chosen_wavelengths():
    m = gn.material("Cu", wavelengths=[450, 550, 650, 750])
    assert m.channel_names == (450.0, 550.0, 650.0, 750.0)
    assert m.f_angles(0.3, 0.0, 0.3, np.pi).shape == (4,)
    assert m.replace({"distribution.alpha": 0.3}).channel_names == m.channel_names
    assert gn.material("Cu", wavelengths=550).f_angles(0.3, 0.0, 0.3, np.pi).shape == ()
    assert gn.material("Cu", wavelengths=[550]).f_angles(0.3, 0.0, 0.3, np.pi).shape == (1,)


def test_transparent_substances_are_dielectrics_and_opaque_ones_conductors():
    for name in ("water", "silica", "magnesium-fluoride", "titanium-dioxide"):
        assert isinstance(gn.material(name).fresnel, gn.Dielectric), name
    assert isinstance(gn.material("TiO2", wavelengths=[310.0, 500.0]).fresnel, gn.Conductor)
    # What is left out by taking k = 0 below the limit.
    cos, k = np.linspace(0.0, 1.0, 1001), builtin.TRANSPARENT
    for n in (1.33, 1.46, 2.0, 2.7):
        assert np.abs(fresnel_conductor(cos, n, k) - fresnel_dielectric(cos, n)).max() < 1.5e-6


def test_reflectance_at_normal_incidence():
    # |(n - 1 + ik)/(n + 1 + ik)|^2 of the indices above, by hand.
    gold = gn.material("gold", alpha=0, wavelengths=[630.0])
    at = gn.direction(0.0, 0.0)
    n, k = 0.18836065573770486, 3.4033817330210776
    assert gold.delta_reflectance(at)[0] == pytest.approx(((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2), rel=1e-12)
    assert gn.albedo(gn.material("water", alpha=0), at) == pytest.approx([0.0202, 0.0206, 0.0211], abs=1e-4)


# What to cite.


def test_cite_gives_the_papers_of_model_pieces_and_numbers():
    keys = re.findall(r"^@\w+\{(\w+),$", gn.cite("gold"), re.MULTILINE)
    assert {"johnson1972", "polyanskiy2024", "walter2007", "trowbridge1975", "born1999", "gonio"} <= set(keys)
    assert len(keys) == len(set(keys))
    assert "cited =" not in gn.cite("gold")
    assert gn.cite("Au") == gn.cite("gold") == gn.cite(gn.material("gold"))
    fit = gn.cite("chrome")
    assert "low2012" in fit and "matusik2003" in fit and "lambert1760" in fit
    assert "matusik2003" in gn.cite((gn.material("chrome") + gn.Phong()).replace({"1.C": 1.0}))
    formats()
    assert "dupuy2018" in gn.cite("RGL")
    assert "trowbridge1975" in gn.cite("GGX")
    with pytest.raises(NotFoundError, match="nearest: gold"):
        gn.cite("gould")
    with pytest.raises(ParameterError):
        gn.cite(5)


def _below(kind):
    return [each for own in kind.__subclasses__() for each in (own, *_below(own))]


def test_every_class_names_a_source_and_every_entry_is_used():
    assert formats() and gn.tables.tabulate  # these classes are found when they are first used
    sources = {n: _source(k) for n, k in CLASSES.items() if not k._unwritten()}
    assert [n for n, s in sources.items() if not s] == []
    texts = [*sources.values(), *(e.source for e in ENTRIES), *map(_source, formats())]
    texts += [_source(kind) for kind in _below(Measured)]  # those in parts of formats' modules, too
    assert [phrase for phrase in _entries() if not any(phrase in t for t in texts)] == []
    dois = set(re.findall(r"doi = \{(.*)\}", "\n".join(_entries().values())))
    named = {d.rstrip(".") for t in texts for d in re.findall(r"doi:(10\.[^\s,;()]+)", t)}
    assert named <= dois


def test_a_source_without_entry_is_passed_on():
    class _Hair(gn.Reflectance):
        """A model of hair.

        Units    none.
        Source   Somebody 2031, "On hair",
                 doi:10.1000/182. Derived here.
        """

        def formula(self, wi, wo):
            return 0.0 * wi.z

    assert "doi = {10.1000/182}" in gn.cite(_Hair())
    assert 'note = {Somebody 2031, "On hair", doi:10.1000/182. Derived here.}' in gn.cite(_Hair())
