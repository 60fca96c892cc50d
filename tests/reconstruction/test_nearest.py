"""The materials most like a given one: distances by hand, ranks, scales, channels, and what cannot be compared."""

import math

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.errors import NotFoundError, ParameterError
from gonio.pictures.colour import LUMINANCE
from gonio.reconstruction import nearness as module
from gonio.reconstruction.nearness import DISTANCES, FEWEST, MIRROR, SCALES

GRAY, DARK = gn.Lambertian(0.6), gn.Lambertian(0.3)
by_all = pytest.mark.parametrize("distance", DISTANCES)


@by_all
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("count", thinned([2, 4], [2]))
def test_a_built_in_material_is_nearest_to_itself(distance, scale, count):
    names = ["brass", "pink-felt", "gold", "silica", "steel", "white-paint"]
    for name in names[:count]:
        first, second = gn.reconstruction.nearest(gn.material(name), names, distance, scale, count=2)
        assert (first.name, first.rank, first.compared) == (name, 1, "RGB")
        assert first.distance < 1e-7 < second.distance
        assert math.isclose(first.factor, 1.0, rel_tol=1e-7)


def test_all_built_in_materials_are_compared():
    found = gn.reconstruction.nearest(gn.material("brass"), count=1000)
    assert sorted(match.name for match in found) == sorted(entry.name for entry in gn.materials())
    assert [match.rank for match in found] == [*range(1, 114)]
    assert np.all(np.diff([match.distance for match in found]) >= 0.0)
    assert not any(match.reason or match.left_out or match.factor != 1.0 for match in found)


@by_all
def test_distances_are_those_worked_out_by_hand(distance):
    """f = rho/pi: the root of the mean square of g(0.6 x) - g(0.3 x), x = cos(theta_i)/pi at the pairs."""
    g = {"log": lambda x: np.log(1.0 + x), "cosine": lambda x: x, "cube_root": lambda x: x ** (1.0 / 3.0)}[distance]
    x = module._pairs()[0][:, 2] / np.pi
    (found,) = gn.reconstruction.nearest(GRAY, DARK, distance)
    assert math.isclose(found.distance, np.sqrt(np.mean((g(0.6 * x) - g(0.3 * x)) ** 2)), rel_tol=1e-12)
    assert found.compared == "gray" and found.what == repr(DARK) and found.material is DARK


def test_pairs_are_high_and_dense_about_the_mirror_direction():
    wi, wo = module._pairs()
    assert min(wi[:, 2].min(), wo[:, 2].min()) >= math.cos(math.radians(80.0))
    half = gn.directions.half_difference(wi, wo).theta_h
    within = [np.mean(half < math.radians(degrees)) for degrees in (0.5, 2.0, 10.0)]
    # theta_h = pi/2 u^2 is below 0.5, 2, 10 degrees at u < 0.075, 0.149, 1/3; four tenths of the pairs are such.
    assert within[0] > 0.02 and within[1] > 0.05 and within[2] > 0.12


@by_all
@pytest.mark.parametrize("others", thinned(["*paint*", "*p*"], ["*paint*"]))
def test_a_free_scale_tells_the_factor(distance, others):
    m = gn.material("brass")
    for true in (1e-3, 0.25, 40.0):
        first = gn.reconstruction.nearest(true * m, ["brass", "steel", "gold"], distance, "free", count=1)[0]
        assert first.name == "brass" and math.isclose(first.factor, true, rel_tol=1e-6)
        assert first.distance < 1e-6
    given, free = (
        gn.reconstruction.nearest(0.25 * m, others, distance, scale, count=113) for scale in ("given", "free")
    )
    of_given = {match.name: match.distance for match in given}
    assert all(match.distance <= of_given[match.name] + 1e-12 for match in free)


def test_the_best_factor_is_no_worse_than_any_of_many():
    """The sum of squares of logarithms can have several minima."""
    own, other = gn.material("brass"), gn.material("chrome-steel")
    (found,) = gn.reconstruction.nearest(own, {"other": other}, scale="free")
    nearest = gn.reconstruction.nearest(own, [s * other for s in np.geomspace(1e-2, 1e2, 81)])[0]
    assert found.distance <= nearest.distance + 1e-12
    assert math.isclose(gn.reconstruction.nearest(own, found.factor * other)[0].distance, found.distance, rel_tol=1e-9)


def test_a_black_material_has_no_scale():
    assert gn.reconstruction.nearest(gn.Lambertian(0.0), count=1)[0].distance > 0.0
    with pytest.raises(ParameterError, match="reflects nothing"):
        gn.reconstruction.nearest(gn.Lambertian(0.0), scale="free")
    assert gn.reconstruction.nearest(GRAY, gn.Lambertian(0.0), scale="free")[0].factor == 1.0


# Channels.


def test_gray_is_compared_by_luminance():
    red = gn.Lambertian([0.6, 0.1, 0.05])
    (found,) = gn.reconstruction.nearest(gn.Lambertian(float(LUMINANCE @ [0.6, 0.1, 0.05])), red)
    assert found.compared == "luminance" and found.distance < 1e-12
    assert "  by luminance" in repr(gn.reconstruction.nearest(red, GRAY))


def test_wavelengths_are_compared_as_rgb():
    """A spectrum of 0.6 everywhere is white at 0.6, whatever the wavelengths."""
    white = gn.Lambertian([0.6, 0.6, 0.6])
    bound = gn.Lambertian(gn.Spectrum([380.0, 780.0], [0.6, 0.6]))
    for m in (bound, bound.at([420.0, 500.0, 600.0, 680.0])):
        (found,) = gn.reconstruction.nearest(m, white)
        assert found.compared == "RGB" and found.distance < 1e-9


def test_channels_without_colour_are_compared_one_by_one_or_by_their_mean():
    bands = gn.Lambertian([0.1, 0.2, 0.3, 0.8]).with_channels(["a", "b", "c", "d"])
    own, other, gray = gn.reconstruction.nearest(
        bands, [bands, bands.with_channels(["e", "f", "g", "h"]), gn.Lambertian(0.35)]
    )
    assert (own.compared, own.distance) == ("4 channels", 0.0)
    assert other.compared == "mean of 4 channels" and gray.compared == "mean of 4 channels and gray"
    assert gray.distance < 1e-12
    assert gn.reconstruction.nearest(bands, "brass")[0].compared == "mean of 4 channels and luminance"


# Mirrors.


def test_mirrors_are_lobes_of_their_reflectance():
    bright, dark = gn.IdealSpecular(0.9), gn.IdealSpecular(0.1)
    lobe = gn.Microfacet(gn.GGX(MIRROR), 0.9)
    found = gn.reconstruction.nearest(
        bright, {"bright": bright, "dark": dark, "lobe": lobe, "diffuse": GRAY}, distance="cube_root"
    )
    assert [match.name for match in found] == ["bright", "lobe", "dark", "diffuse"]
    assert found[0].distance == 0.0
    (metal,) = gn.reconstruction.nearest(gn.material("gold", alpha=0), "metal", count=1)
    assert metal.compared == "RGB"
    assert gn.reconstruction.nearest(gn.material("gold", alpha=0), gn.material("gold", alpha=0))[0].distance == 0.0


# Candidates.


def test_words_for_candidates(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    brass = gn.material("brass")
    assert {match.what.split(",")[0] for match in gn.reconstruction.nearest(brass, "metal", count=99)} == {"metal"}
    assert all("felt" in match.name for match in gn.reconstruction.nearest(brass, "*FELT*"))
    assert [match.name for match in gn.reconstruction.nearest(brass, "Aluminum")] == ["aluminium"]
    assert [match.name for match in gn.reconstruction.nearest(brass, "Lambertian(0.2)")] == ["Lambertian(0.2)"]
    several = gn.reconstruction.nearest(brass, {"mine": GRAY, "theirs": ["gold", "copper"]})
    assert {match.name for match in several} == {"mine", "theirs, gold", "theirs, copper"}
    with pytest.raises(NotFoundError, match="no built-in material matches 'zzz"):
        gn.reconstruction.nearest(brass, "zzz*")
    with pytest.raises(NotFoundError, match="no such file, no built-in material"):
        gn.reconstruction.nearest(brass, ["brass", "brasss"])
    with pytest.raises(ParameterError, match="nothing to compare with"):
        gn.reconstruction.nearest(brass, [])
    with pytest.raises(ParameterError, match="expected materials, their names, files or folders"):
        gn.reconstruction.nearest(brass, 5)


def test_files_of_a_folder_and_those_that_are_none(tmp_path):
    gn.save(gn.material("brass"), tmp_path / "a.json")
    gn.save(GRAY, tmp_path / "b.json")
    (tmp_path / "notes.txt").write_text("no material\n")
    (tmp_path / ".hidden").write_text("no material\n")
    (tmp_path / "folder").mkdir()
    done = []
    found = gn.reconstruction.nearest(gn.material("brass"), tmp_path, progress=lambda *at: done.append(at))
    assert [(match.name, match.rank) for match in found] == [("a.json", 1), ("b.json", 2), ("notes.txt", 0)]
    assert found[0].material == gn.material("brass") and done == [(1, 3), (2, 3), (3, 3)]
    assert math.isnan(found[2].distance) and "not a known format" in found[2].reason
    assert repr(found).splitlines()[2].split("-", 1)[1].strip().startswith("not a known format")
    with pytest.raises(NotFoundError, match="a folder without files"):
        gn.reconstruction.nearest(GRAY, tmp_path / "folder")


def test_what_cannot_be_compared_is_a_row():
    glass = gn.RoughDielectric(gn.GGX(0.2), 1.5)
    painted = gn.Lambertian(np.full((4, 4, 3), 0.2))
    found = gn.reconstruction.nearest(GRAY, {"glass": glass, "dark": DARK, "map": painted})
    assert [(match.name, match.rank) for match in found] == [("dark", 1), ("glass", 0), ("map", 0)]
    assert "transmits light" in found[1].reason and "a map of shape" in found[2].reason
    with pytest.raises(ParameterError, match="transmits light; expected a surface that reflects alone"):
        gn.reconstruction.nearest(glass)
    with pytest.raises(ParameterError, match="none of 1 could be compared; the first, glass"):
        gn.reconstruction.nearest(GRAY, {"glass": glass})
    with pytest.raises(ParameterError, match="a map of shape"):
        gn.reconstruction.nearest(painted)


# Holes.


def table(rho, highest):
    """A diffuse table without values where a direction is more than `highest` degrees from the normal."""
    theta = np.radians(np.linspace(0.0, highest, 7))
    axes = {"theta_i": theta, "theta_o": theta, "phi": np.radians([0.0, 90.0, 180.0, 270.0])}
    return gn.Gridded("angles", axes, np.full((7, 7, 4), rho / np.pi), outside="missing")


def test_pairs_without_a_value_are_left_out_and_counted():
    wi, wo = module._pairs()
    low = math.cos(math.radians(60.0))
    known = np.minimum(wi[:, 2], wo[:, 2]) >= low
    x = np.log1p(0.6 * wi[known, 2] / np.pi) - np.log1p(0.3 * wi[known, 2] / np.pi)
    for a, b in ((table(0.6, 60.0), DARK), (DARK, table(0.6, 60.0))):
        (found,) = gn.reconstruction.nearest(a, b)
        assert found.left_out == (~known).sum() and found.pairs == len(known)
        assert math.isclose(found.distance, np.sqrt(np.mean(x * x)), rel_tol=1e-6)
        assert "% of the pairs left out" in repr(gn.reconstruction.nearest(a, b))


def test_too_few_pairs_are_a_reason():
    narrow = table(0.6, 0.5)
    found = gn.reconstruction.nearest(GRAY, {"narrow": narrow, "dark": DARK})
    assert [match.rank for match in found] == [1, 0]
    assert f"pairs of directions have a value in both, expected {FEWEST} at least" in found[1].reason
    with pytest.raises(ParameterError, match=r"has a value at \d+ of"):
        gn.reconstruction.nearest(narrow)


# Misuse.


def test_misuse_is_refused_in_our_words():
    with pytest.raises(ParameterError, match=r"expected one of 'log', 'cosine', 'cube_root': .*; did you mean 'log'"):
        gn.reconstruction.nearest(GRAY, distance="lo")
    with pytest.raises(ParameterError, match=r"scale='fre'.*: expected 'given' or 'free'.*; did you mean 'free'"):
        gn.reconstruction.nearest(GRAY, scale="fre")
    for call in (lambda: gn.reconstruction.nearest("brass"), lambda: gn.reconstruction.nearest(GRAY, count=0)):
        with pytest.raises(ParameterError, match="nearest"):
            call()
