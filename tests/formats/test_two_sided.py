"""Files of both sides: where each number is on the sphere, what is read by default, round trips, what is refused."""

from __future__ import annotations

import math

import numpy as np
import optical_files as files
import pytest
from binary_files import layered
from format_cases import file_of, grid
from house import WHITE_FACETS
from libraries import thinned
from places import real
from test_window_xml import radiance
from window_xml_texts import block, document, grid_of, numbers_of, tree_file, words

import gonio as gn
from gonio.conversion import comparison
from gonio.errors import FormatError, ParameterError
from gonio.formats import _sides, formats, window_xml
from gonio.formats.window_xml.klems import QUARTER, Klems
from gonio.formula import tree
from gonio.models._quarters import QUARTERS, quarters, sheet_of

TURNED = np.array([-1.0, 1.0, -1.0])
MIRRORED = np.array([1.0, 1.0, -1.0])
DEGREES = math.pi / 180.0


def sphere(n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(-0.98, 0.98, n), 2.0 * np.pi * rng.random(n)
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)


def table(seed: int, oriented: bool, **options) -> gn.Gridded:
    """Random values on a grid of angles that all formats of angles hold."""
    azimuth = np.radians(np.arange(0.0, 360.0, 45.0))
    axes = {"theta_i": np.radians([0.0, 30.0, 70.0]), "theta_o": np.radians([0.0, 20.0, 50.0, 85.0])}
    axes |= {"phi_i": azimuth, "phi_o": azimuth} if oriented else {"phi": azimuth}
    shape = tuple(map(len, axes.values()))
    return gn.Gridded("angles", axes, np.random.default_rng(seed).random(shape), **options)


def sheet(oriented: bool = True) -> gn.Sheet:
    """Four parts that all differ."""
    return gn.Sheet(*(table(seed, oriented) for seed in range(4)))


def of_part(m: gn.Sheet, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f of a Sheet by its definition: the viewer's side in front, light from the other side mirrored at the surface."""
    f = np.empty(len(wi))
    for k, (i, o) in enumerate(zip(wi, wo, strict=True)):
        name = ("front", "forward", "backward", "back")[2 * (i[2] < 0.0) + (o[2] < 0.0)]
        i, o = (i * TURNED, o * TURNED) if o[2] < 0.0 else (i, o)
        f[k] = getattr(m, name).f(i * MIRRORED if i[2] < 0.0 else i, o)
    return f


# The quarters of a reflectance.


@pytest.mark.parametrize(
    "m",
    [
        gn.RoughDielectric(gn.GGX(0.3, 0.5), 1.5),
        gn.TwoSided(gn.Lambertian(0.3), gn.Lambertian(0.1)) + gn.DiffuseTransmission(0.3),
        gn.Across(gn.Microfacet(gn.GGX(0.3, 0.6))),
        0.5 * sheet(),
    ],
    ids=lambda m: type(m).__name__,
)
def test_a_sheet_of_its_quarters_is_the_same(m):
    wi, wo = sphere(2000, 1), sphere(2000, 2)
    np.testing.assert_allclose(sheet_of(quarters(m)).f(wi, wo), m.f(wi, wo), rtol=1e-12)


def test_black_quarters_are_left_out():
    assert [*quarters(gn.Across(gn.Lambertian(0.3)))] == ["forward", "backward"]
    assert [*quarters(gn.Sheet(gn.Lambertian(0.3), gn.Lambertian(0.0), gn.Lambertian(0.0), gn.Lambertian(0.1)))] == [
        "front",
        "backward",
    ]
    assert quarters(gn.Lambertian(0.3)) == {"front": gn.Lambertian(0.3)}


# Where the numbers of a file are.

ROWS = "VARS theta_i,phi_i,theta_s,phi_s,f\n0.5,0.1,0.3,0.2,1\n0.5,0.1,2.8,1,7\n2.5,0.1,3,1,9\n2.5,0.4,0.6,2,5\n"


def test_rows_are_where_their_angles_say(tmp_path):
    m = loaded_both(tmp_path, ROWS)
    for theta_i, phi_i, theta_o, phi_o, f in np.loadtxt(ROWS.splitlines()[1:], delimiter=","):
        assert m.f(gn.direction(theta_i, phi_i), gn.direction(theta_o, phi_o)) == pytest.approx(f, rel=1e-12)
    assert gn.load(tmp_path / "file").f(gn.direction(0.5, 0.1), gn.direction(2.8, 1.0)) == 0.0


def test_rows_that_fill_grids_are_where_their_angles_say(tmp_path):
    thetas, phis = [0.4, 1.1, math.pi - 1.1, math.pi - 0.4], [0.0, 1.0, 3.0, 5.0]
    nodes = [x.ravel() for x in np.meshgrid(thetas, phis, thetas, phis, indexing="ij")]
    f = np.random.default_rng(6).random(nodes[0].shape)
    rows = [",".join(map(repr, row)) for row in np.stack([*nodes, f], 1).tolist()]
    m = loaded_both(tmp_path, "\n".join(["VARS theta_i,phi_i,theta_s,phi_s,f", *rows]) + "\n")
    assert not any(isinstance(part, gn.Scattered) for part in quarters(m).values())
    np.testing.assert_allclose(m.f_angles(*nodes), f, rtol=1e-9)
    one = [k for k in range(len(f)) if nodes[0][k] == 0.4 and nodes[1][k] == 1.0]
    pab = f"#format: theta phi BSDF\n#intheta {math.degrees(0.4)!r}\n#inphi {math.degrees(1.0)!r}\n"
    outgoing = np.stack([np.degrees(nodes[2]), np.degrees(nodes[3]), f], 1)[one].tolist()
    m = loaded_both(tmp_path, pab + "".join(" ".join(map(repr, row)) + "\n" for row in outgoing))
    np.testing.assert_allclose(m.f_angles(*(x[one] for x in nodes)), f[one], rtol=1e-9)


def loaded_both(tmp_path, content, name="file"):
    return gn.load(file_of(tmp_path, content, name), side="both")


@pytest.mark.parametrize("name", ["a.csv", "a.astm"])
@pytest.mark.parametrize("oriented", [False, True])
def test_rows_of_a_sheet_come_back(name, oriented, tmp_path):
    m = sheet(oriented)
    gn.save(m, tmp_path / name)
    back = gn.load(tmp_path / name, side="both")
    wi, wo = sphere(1000, 3), sphere(1000, 4)
    np.testing.assert_allclose(back.f(wi, wo), m.f(wi, wo), rtol=1e-9)
    np.testing.assert_allclose(m.f(wi, wo), of_part(m, wi, wo), rtol=1e-12)
    for quarter in QUARTERS:
        assert np.array_equal(getattr(back, quarter).stored, getattr(m, quarter).stored)
    again = tmp_path / f"again{name[1:]}"
    gn.save(back, again)
    assert gn.load(again, side="both") == back
    front = gn.load(tmp_path / name)
    assert front.sides == "front" and np.array_equal(front.stored, m.front.stored)


def test_pab_holds_what_is_lit_from_one_direction(tmp_path):
    m = sheet(False)
    for theta_i in (30.0, 150.0):
        path = tmp_path / "a.pab"
        gn.save(m, path, "pab-opto", incident=(theta_i * DEGREES, 0.7))
        back = gn.load(path, side="both")
        wo = gn.direction(np.radians([20.0, 50.0, 130.0, 160.0]), 0.7 + np.radians([45.0, 90.0, 135.0, 180.0]))
        wi = gn.direction(theta_i * DEGREES, 0.7)
        np.testing.assert_allclose(back.f(wi, wo), m.f(wi, wo), rtol=1e-9)
        gn.save(back, tmp_path / "b.pab", "pab-opto")
        np.testing.assert_allclose(gn.load(tmp_path / "b.pab", side="both").f(wi, wo), m.f(wi, wo), rtol=1e-9)
    with pytest.raises(ParameterError, match="light from behind"):
        gn.save(m.front, path, "pab-opto", incident=(2.0, 0.0))


def test_zemax_btdf_is_about_straight_through(tmp_path):
    m = gn.load(file_of(tmp_path, files.zemax().replace("ScatterType  BRDF", "ScatterType  BTDF")))
    assert isinstance(m, gn.Sheet)
    assert m.forward is m.backward
    wi = gn.direction(30.0 * DEGREES, 0.4)
    for light in (wi, wi * TURNED):
        assert m.f(light, -light) == pytest.approx(0.2)
        assert m.f(light, light * [-1.0, -1.0, 1.0]) == 0.0
        to_normal = gn.direction(10.0 * DEGREES, 0.4 + math.pi)  # 40 degrees from straight on
        assert m.f(wi, to_normal * MIRRORED) >= 0.0
    gn.save(m, tmp_path / "b.bsdf", "Zemax")
    again = gn.load(tmp_path / "b.bsdf")
    assert again == m and "BTDF" in (tmp_path / "b.bsdf").read_text()


def test_zemax_writes_reflection_or_transmission(tmp_path):
    glass = gn.Sheet(gn.Lambertian(0.2), gn.Lambertian(0.2), *[gn.Microfacet(gn.GGX(0.3, 0.5))] * 2)
    with pytest.raises(ParameterError, match="kind='BRDF' or kind='BTDF'"):
        gn.save(glass, tmp_path / "a.bsdf", "Zemax")
    gn.save(glass, tmp_path / "a.bsdf", "Zemax", kind="BRDF", step=30.0)
    assert gn.load(tmp_path / "a.bsdf").sides == "front"
    gn.save(glass, tmp_path / "a.bsdf", "Zemax", kind="BTDF", step=5.0, rotation=np.arange(0.0, 360.0, 30.0))
    m = gn.load(tmp_path / "a.bsdf")
    wi, wo = -gn.direction(0.4, [0.3, 1.0, 2.0]), gn.direction(0.5, [0.5, 1.5, 1.0])
    np.testing.assert_allclose(m.f(wi, wo), glass.f(wi, wo), rtol=0.03)
    np.testing.assert_allclose(m.f(wi * TURNED, wo * TURNED), glass.f(wi * TURNED, wo * TURNED), rtol=0.03)
    with pytest.raises(ParameterError, match="expected BRDF"):
        gn.save(gn.Lambertian(0.5), tmp_path / "a.bsdf", "Zemax", kind="BTDF")


@pytest.mark.filterwarnings("ignore:.*times the light")  # numbers that tell places apart, no light
def test_lighttools_blocks_are_where_their_angles_say(tmp_path):
    block = files.LIGHTTOOLS[
        files.LIGHTTOOLS.index("AOI 40") : files.LIGHTTOOLS.index("AOI 0\nPOI 90\nSide Front\nW", 300)
    ]
    text = files.LIGHTTOOLS.replace("DataEnd\n", "")
    for kind, side, scale in (("BRDF", "Back", 2), ("BTDF", "Back", 3)):
        more = block.replace("Front", side).replace("BRDF", kind)
        text += more.replace("0.5 0.", f"0.5 {scale}.") + more.replace("AOI 40", "AOI 0").replace("0.5 0.", "0.5 0.")
    m = loaded_both(tmp_path, text + "DataEnd\n")
    wi, wo = gn.direction(40.0 * DEGREES, 0.5 * math.pi), gn.direction(45.0 * DEGREES, np.radians([0.0, 90.0, 270.0]))
    np.testing.assert_allclose(m.f(wi, wo)[:, 0], [0.6, 0.7, 0.8])
    np.testing.assert_allclose(m.f(wi * MIRRORED, wo * MIRRORED)[:, 0], [2.6, 2.7, 2.8])
    np.testing.assert_allclose(m.f(wi * MIRRORED, wo)[:, 0], [3.6, 3.7, 3.8])
    np.testing.assert_allclose(m.f(gn.direction(0.0, 0.0), wo * MIRRORED)[:, 0], 0.02)
    gn.save(m, tmp_path / "b.bsdf", "LightTools")
    assert gn.load(tmp_path / "b.bsdf", side="both") == m
    alone = gn.load(tmp_path / "b.bsdf", side="back")
    assert np.array_equal(alone.f(wi, wo), m.back.f(wi, wo), equal_nan=True)
    np.testing.assert_allclose(alone.f(wi * [-1, 1, 1], wo * [-1, 1, 1])[:, 0], [2.6, 2.7, 2.8])
    gn.save(m.forward, tmp_path / "c.bsdf", "LightTools")  # a reflectance like any other
    assert gn.load(tmp_path / "c.bsdf").sides == "front"


@pytest.mark.parametrize("oriented", [False, True])
def test_lighttools_of_a_sheet(oriented, tmp_path):
    m = sheet(oriented)
    gn.save(m, tmp_path / "a.bsdf", "LightTools")
    back = gn.load(tmp_path / "a.bsdf", side="both")
    wi, wo = sphere(1000, 3), sphere(1000, 4)
    np.testing.assert_allclose(back.f(wi, wo)[:, 0], m.f(wi, wo), rtol=1e-9)


def test_lighttools_of_a_model_of_both_sides(tmp_path):
    wi, wo = sphere(1000, 3), sphere(1000, 4)
    model = gn.TwoSided(gn.Lambertian(0.3), gn.Lambertian(0.1)) + gn.Across(gn.Lambertian(0.2))
    gn.save(model, tmp_path / "a.bsdf", "LightTools")
    back = gn.load(tmp_path / "a.bsdf", side="both")
    np.testing.assert_allclose(back.f(wi, wo)[:, 0], model.f(wi, wo), rtol=1e-9)


def same_from_both(oriented: bool = False, transmission_only: bool = False) -> gn.Sheet:
    R, T = table(0, oriented), table(1, oriented)
    if transmission_only:
        return gn.Sheet(gn.Lambertian(0.0), gn.Lambertian(0.0), T, T)
    return gn.Sheet(R, R, T, T)


@pytest.mark.parametrize("oriented", [False, True])
@pytest.mark.parametrize("transmission_only", [False, True])
def test_ssdd_of_a_sheet(oriented, transmission_only, tmp_path):
    m = same_from_both(oriented, transmission_only)
    gn.save(m, tmp_path / "a.ssdd")
    back = gn.load(tmp_path / "a.ssdd", side="both")
    wi, wo = sphere(1000, 3), sphere(1000, 4)
    np.testing.assert_allclose(back.f(wi, wo), m.f(wi, wo), rtol=1e-9)
    gn.save(back, tmp_path / "b.ssdd")
    assert gn.load(tmp_path / "b.ssdd", side="both") == back
    if transmission_only:
        assert gn.load(tmp_path / "a.ssdd") == back
        with pytest.raises(FormatError, match=r"but transmission of .*; read it with side='both'"):
            gn.load(tmp_path / "a.ssdd", side="front")
    else:
        front = gn.load(tmp_path / "a.ssdd")
        assert front.sides == "front" and len(front.about["other_blocks"]) == 1
        gn.save(front, tmp_path / "c.ssdd")
        assert gn.load(tmp_path / "c.ssdd", side="both") == back


@pytest.mark.parametrize("system", ["spherical", "specular"])
@pytest.mark.filterwarnings("ignore:.*times the light")  # numbers that tell places apart, no light
def test_a_btdf_of_ssdd_has_wo_mirrored_at_the_surface(system, tmp_path):
    """By libbsdf: light at azimuth 0, a direction mirrored at the surface is that of a reflection."""
    brdf = (
        "DATA_TYPE brdf\nCOLOR_MODEL monochrome\n"
        f"PARAM_TYPE {system}_coordinate_system\nPARAM0_LIST 0 45\nPARAM2_LIST 0 30 60\n"
        "PARAM3_LIST 0 90 180 270\nDATA ascii\n" + "\n".join(map(str, range(24))) + "\n"
    )
    m = loaded_both(tmp_path, "VERSION 0.2\n" + brdf + brdf.replace("brdf", "btdf"))
    rng = np.random.default_rng(5)
    wi, wo = (gn.direction(rng.uniform(0.1, 0.7, 200), rng.uniform(0.0, 6.0, 200)) for _ in range(2))
    np.testing.assert_allclose(m.f(wi, wo * MIRRORED), m.f(wi, wo), rtol=1e-9)


@pytest.mark.parametrize("oriented", [False, True])
def test_integra_ddt_is_transmission(oriented, tmp_path):
    T = grid("specular", (3, 5, 8, 4) if oriented else (3, 5, 8))
    m = gn.Sheet(gn.Lambertian(0.0), gn.Lambertian(0.0), T, T)
    gn.save(m, tmp_path / "a.ddt")
    back = gn.load(tmp_path / "a.ddt")
    wi, wo = sphere(1000, 3), sphere(1000, 4)
    expected = m.f(wi, wo)
    np.testing.assert_allclose(back.f(wi, wo), expected, rtol=1e-9)
    for material, name in ((gn.Lambertian(0.5), "b.ddt"), (m, "b.ddr"), (same_from_both(), "b.ddt")):
        with pytest.raises(ParameterError, match=r"ddt files are transmission|has no transmission"):
            gn.save(material, tmp_path / name)


@pytest.mark.parametrize("suffix", ["brdf", "anisotropicbsdf"])
@pytest.mark.parametrize("step", thinned([4.0, 2.0], [4.0]))
def test_speos_of_a_sheet(suffix, step, tmp_path):
    R, T = gn.Lambertian(0.3) + 0.2 * gn.Microfacet(gn.GGX(0.4)), 0.5 * gn.Microfacet(gn.GGX(0.5))
    m = gn.Sheet(R, R, T, T)
    path, again = tmp_path / f"a.{suffix}", tmp_path / f"b.{suffix}"
    gn.save(m, path, "Speos", step=step)
    back = gn.load(path, side="both")
    wi, wo = gn.direction(np.radians([20.0, 40.0, 60.0]), 1.0), gn.direction(np.radians([30.0, 50.0, 10.0]), 2.5)
    for i, o in ((wi, wo), (wi, wo * MIRRORED), (wi * MIRRORED, wo), (wi * TURNED, wo * TURNED)):
        np.testing.assert_allclose(np.squeeze(back.f(i, o)), m.f(i, o), rtol=5e-3)
    gn.save(back, again, "Speos")
    assert gn.load(again, side="both") == back
    assert gn.load(path) == back.front
    gn.save(gn.Across(T), path, "Speos", step=step)
    back = gn.load(path)
    np.testing.assert_allclose(np.squeeze(back.f(wi, wo * MIRRORED)), m.f(wi, wo * MIRRORED), rtol=5e-3)
    with pytest.raises(FormatError, match="read it with side='both'"):
        gn.load(path, side="front")


def test_speos_transmission_is_by_angles_of_the_front(tmp_path):
    """theta 180 is straight on for light along the normal; phi 0 goes on, away from the light."""
    m = table(3, False)
    gn.save(gn.Sheet(gn.Lambertian(0.0), gn.Lambertian(0.0), m, m), tmp_path / "a.brdf", "Speos")
    back = gn.load(tmp_path / "a.brdf")
    part = back.filed.parts["transmission"] if hasattr(back, "filed") else back.forward.filed.parts["transmission"]
    number = part.tables[1]
    theta, phi = number.theta[2], number.phi[3]
    wi = gn.direction(30.0 * DEGREES, 0.0)
    wo = gn.direction(theta * DEGREES, math.pi + phi * DEGREES)
    assert np.squeeze(back.f(wi, wo)) == pytest.approx(number.values[2, 3], rel=1e-9)


# SCATFUN.


@pytest.mark.slow_because("a SCATFUN file holds a million values of each side")
@pytest.mark.parametrize("nodes", [16, pytest.param(64, marks=pytest.mark.full)])
def test_scatfun_of_a_sheet(nodes, tmp_path):
    of = WHITE_FACETS.replace
    m = gn.Sheet(of(alpha=0.5), gn.Lambertian(0.3), of(alpha=0.4), of(alpha=0.6))
    gn.save(m, tmp_path / "a.bsdf", "SCATFUN", nodes=nodes)
    back = gn.load(tmp_path / "a.bsdf", side="both")
    wi, wo = sphere(2000, 5), sphere(2000, 6)
    inside = (np.abs(wi[:, 2]) > 0.2) & (np.abs(wo[:, 2]) > 0.2)
    wi, wo = wi[inside], wo[inside]
    np.testing.assert_allclose(back.f(wi, wo), m.f(wi, wo), rtol=0.01, atol=2e-3)
    gn.save(back, tmp_path / "b.bsdf", "SCATFUN")
    assert (tmp_path / "b.bsdf").read_bytes() == (tmp_path / "a.bsdf").read_bytes()
    front = gn.load(tmp_path / "a.bsdf")
    assert front == back.front
    gn.save(gn.Sheet(back.back, back.front, back.forward, back.backward), tmp_path / "c.bsdf", "SCATFUN")
    turned = gn.load(tmp_path / "c.bsdf", side="both")
    here = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0)
    np.testing.assert_allclose(turned.f(wi[here], wo[here]), 0.3 / math.pi, rtol=5e-3)


def test_series_of_scatfun_are_where_their_cosines_say(tmp_path):
    """Of mu_o and mu_i: light from in front has mu_i < 0."""
    series = {(0.5, -0.5): [0.1], (-0.5, 0.5): [0.2], (-0.5, -0.5): [0.3], (0.5, 0.5): [0.4]}
    m = loaded_both(tmp_path, layered(series))
    wi, wo = gn.direction(math.pi / 3, 0.4), gn.direction(math.pi / 3, 1.0)
    f = [m.f(a, b) for a, b in ((wi, wo), (-wi, -wo), (wi, -wo), (-wi, wo))]
    np.testing.assert_allclose(f, [0.2, 0.4, 0.6, 0.8], rtol=1e-6)


def test_scatfun_radiance_in_a_denser_medium(tmp_path):
    """f holds n_o^2/n_i^2, as pbrt scales the radiance that a file's series transmit."""
    gn.save(gn.Sheet(*[gn.Lambertian(0.5)] * 4), tmp_path / "a.bsdf", "SCATFUN", nodes=16)
    data = bytearray((tmp_path / "a.bsdf").read_bytes())
    data[44:48] = np.float32(1.5).tobytes()
    m = loaded_both(tmp_path, bytes(data), "b.bsdf")
    wi, up = gn.direction(0.5, 1.0), gn.direction(0.7, 2.0)
    f = [m.f(a, b) * math.pi / 0.5 for a in (wi, -wi) for b in (up, -up)]
    np.testing.assert_allclose(f, [1.0, 2.25, 1.0 / 2.25, 1.0], rtol=1e-3)


# WINDOW XML.


def klems_sheet() -> gn.Sheet:
    sides = ("front", "back", "back", "front")
    return gn.Sheet(*(Klems(numbers_of(41, 41, seed), QUARTER, side=s) for seed, s in enumerate(sides)))


def of_bands(*names: str, direction: str) -> str:
    return "".join(block(words(numbers_of(5, 5, seed)), direction, name) for seed, name in enumerate(names))


def world(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Directions [degrees] of Radiance, whose front is WINDOW's back."""
    return gn.direction(np.radians(theta), np.radians(phi)) * TURNED


@pytest.mark.parametrize("way", ["Front", "Back"])
@pytest.mark.parametrize("kind", ["matrix", "tree of 3", "tree of 4"])
def test_one_transmission_is_that_of_both_ways_as_in_radiance(kind, way, tmp_path):
    path = tmp_path / "a.xml"
    if kind == "matrix":
        text = block(words(numbers_of(5, 5)), f"Transmission {way}")
        path = file_of(tmp_path, document(text), "a.xml")
    else:
        dimensions = int(kind[-1])
        grid_text = "{ " + words(grid_of(dimensions, 2), " ") + " }"
        path = file_of(tmp_path, tree_file(dimensions, grid_text, f"Transmission {way}"), "a.xml")
    m = gn.load(path)
    wi, wo = sphere(300, 13), sphere(300, 14)
    np.testing.assert_array_equal(m.f(wi, wo), m.f(wo, wi))
    asked = np.random.default_rng(3).random((200, 4)) * [178.0, 360.0, 178.0, 360.0] + [1.0, 0.0, 1.0, 0.0]
    expected = radiance(path, asked.tolist())[:, 1]
    found = m.f(world(asked[:, 0], asked[:, 1]), world(asked[:, 2], asked[:, 3]))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=3e-4 * expected.max())


@pytest.mark.parametrize(
    "name", ["2011-SA1.XML", "matrix", pytest.param("means", marks=pytest.mark.full), "tree of 3", "tree of 4"]
)
def test_radiance_gives_the_same_on_both_sides_and_across(name, tmp_path):
    path = tmp_path / "a.xml"
    diffuser = gn.Lambertian(0.05) + 0.5 * gn.Microfacet(gn.GGX(0.4))
    brushed = gn.Lambertian(0.1) + 0.3 * gn.Microfacet(gn.GGX(0.3, 0.6))
    if name == "2011-SA1.XML":
        path = real(f"window_xml/{name}")
    elif name == "matrix":
        gn.save(klems_sheet(), path, "WINDOW XML")
    elif name == "means":
        gn.save(gn.Sheet(brushed, gn.Rotated(brushed, 0.5), diffuser, gn.Rotated(brushed, 1.0)), path, "WINDOW XML")
    elif name == "tree of 3":
        gn.save(
            gn.Sheet(diffuser, gn.Lambertian(0.1), diffuser, 0.5 * diffuser), path, "WINDOW XML", tree=3, resolution=16
        )
    else:
        material = gn.Sheet(brushed, gn.Rotated(brushed, 0.5), gn.Rotated(brushed, 2.0), gn.Rotated(brushed, 1.0))
        gn.save(material, path, "WINDOW XML", tree=4, resolution=16)
    m = gn.load(path, side="both")
    asked = np.random.default_rng(3).random((400, 4)) * [178.0, 360.0, 178.0, 360.0] + [1.0, 0.0, 1.0, 0.0]
    expected = radiance(path, asked.tolist())[:, 1]
    found = m.f(world(asked[:, 0], asked[:, 1]), world(asked[:, 2], asked[:, 3]))
    # Radiance changes every patch by up to 3e-4, relative, on purpose.
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=3e-4 * expected.max())


def test_window_sides(tmp_path):
    m = klems_sheet()
    gn.save(m, tmp_path / "a.xml", "WINDOW XML")
    back = gn.load(tmp_path / "a.xml", side="both")
    assert back == m
    assert gn.load(tmp_path / "a.xml") == m.front
    assert gn.load(tmp_path / "a.xml", side="back") == m.back
    doubled = gn.Sheet(
        back.front, back.back, tree.with_notes(back.forward), back.backward.replace(values=2.0 * m.backward.values)
    )
    gn.save(doubled, tmp_path / "b.xml", "WINDOW XML")
    again = gn.load(tmp_path / "b.xml", side="both")
    assert again == doubled and again != m
    gn.save(gn.load(tmp_path / "b.xml"), tmp_path / "c.xml", "WINDOW XML")  # the other blocks are kept
    assert gn.load(tmp_path / "c.xml", side="both") == doubled
    gn.save(back.front, tmp_path / "d.xml", "WINDOW XML")  # of a part alone they are not known
    assert gn.load(tmp_path / "d.xml", side="both") == m.front
    gn.save(back.forward, tmp_path / "d.xml", "WINDOW XML")  # alone it is a reflectance
    assert gn.load(tmp_path / "d.xml").sides == "front"
    swapped = gn.Sheet(back.back, back.front, back.backward, back.forward)
    gn.save(swapped, tmp_path / "e.xml", "WINDOW XML", basis="quarter")
    wi, wo = sphere(500, 7), sphere(500, 8)
    found = gn.load(tmp_path / "e.xml", side="both").f(wi, wo)
    assert np.mean(np.isclose(found, swapped.f(wi, wo), rtol=1e-9)) > 0.98  # edges of patches, mirrored
    with pytest.raises(ParameterError, match=r"side='back'.* has both sides"):
        gn.save(m, tmp_path / "f.xml", "WINDOW XML", side="back")


def test_window_transmission_only(tmp_path):
    path = file_of(tmp_path, document(of_bands("Visible", direction="Transmission Front")))
    m = gn.load(path)
    assert isinstance(m, gn.Sheet) and np.array_equal(m.forward.values, numbers_of(5, 5))
    assert m.f([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]) == numbers_of(5, 5)[0, 0]
    assert m.f([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]) == 0.0
    gn.save(m, tmp_path / "b.xml", "WINDOW XML")
    assert gn.load(tmp_path / "b.xml") == m and (tmp_path / "b.xml").read_text().count("<ScatteringData>") == 1
    with pytest.raises(FormatError, match="but transmission of light on the front; read it with side='both'"):
        window_xml.read(path, side="front")


def test_parts_that_changed_places_are_not_written_as_they_were(tmp_path):
    gn.save(klems_sheet(), tmp_path / "a.xml", "WINDOW XML")
    m = gn.load(tmp_path / "a.xml", side="both")
    other = gn.Sheet(m.back, m.front, m.backward, m.forward)
    gn.save(other, tmp_path / "b.xml", "WINDOW XML", basis="quarter")
    wi = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    assert np.allclose(gn.load(tmp_path / "b.xml", side="both").f(wi, wi), m.f(-wi, -wi))
    only = file_of(tmp_path, document(of_bands("Visible", direction="Transmission Front")))
    gn.save(gn.load(only).forward, tmp_path / "c.xml", "WINDOW XML")
    assert gn.load(tmp_path / "c.xml").sides == "front"


@pytest.mark.slow_because("files of both sides are written and compared four times")
def test_a_two_sided_material_is_converted_and_tabulated(tmp_path, monkeypatch):
    monkeypatch.setattr(comparison, "TOLERANCES", (1e-3, 3e-5))
    monkeypatch.setattr(comparison, "ALONG", 3)
    material = gn.TwoSided(gn.Lambertian(0.3), gn.Lambertian(0.1)) + gn.Across(0.5 * gn.Microfacet(gn.GGX(0.5)))
    report = gn.convert(material, tmp_path / "a.xml", "WINDOW XML", basis="quarter")
    alone = gn.convert(0.5 * gn.Microfacet(gn.GGX(0.5)), tmp_path / "b.xml", "WINDOW XML", basis="quarter")
    assert report.made.sides == "both"
    assert report.error.largest == pytest.approx(alone.error.largest, rel=1e-6)  # Lambertian parts have none
    assert report.error.albedo == pytest.approx(alone.error.albedo, abs=1e-4)  # to which albedos are compared
    assert report.lost["formula"] == "became a table of 41 x 41 numbers"
    again = gn.convert(report.made, tmp_path / "b.xml", "WINDOW XML")
    assert again.error.largest == 0.0 and again.error.albedo == 0.0
    black = gn.convert(
        gn.TwoSided(gn.Lambertian(0.3), gn.Lambertian(0.3)), tmp_path / "a.xml", "WINDOW XML", basis="quarter"
    )
    assert black.error.albedo < 1e-6
    table = gn.tables.tabulate(material, resolution=(18, 18, 36))
    assert isinstance(table, gn.Sheet)
    wi, wo = sphere(300, 11), sphere(300, 12)
    inside = (np.abs(wi[:, 2]) > 0.3) & (np.abs(wo[:, 2]) > 0.3)
    np.testing.assert_allclose(table.f(wi, wo)[inside], material.f(wi, wo)[inside], rtol=0.1)
    gn.save(gn.tables.tabulate(material, resolution=(4, 4, 6)), tmp_path / "a.csv")
    assert {*quarters(gn.load(tmp_path / "a.csv", side="both"))} == {*QUARTERS}


def test_window_bands_that_differ_between_sides(tmp_path):
    colours = of_bands("Visible", "CIE-X", "CIE-Z", direction="Reflection Front")
    path = file_of(tmp_path, document(colours + of_bands("Visible", direction="Transmission Front")))
    with pytest.raises(FormatError, match=r"different bands.*wavelength='Visible'"):
        gn.load(path, side="both")
    m = gn.load(path, side="both", wavelength="Visible")
    assert m.channels is None
    assert gn.load(path).channels == 3


# Every format.


@pytest.mark.parametrize(
    "m", [sheet(), gn.RoughDielectric(), gn.Across(gn.Lambertian(0.5))], ids=["sheet", "glass", "T"]
)
def test_formats_of_one_side_refuse_two(m, tmp_path):
    for module in formats():
        if not hasattr(module, "write") or getattr(module, "TRANSMITS", False):
            continue
        with pytest.raises(ParameterError, match=r"holds reflection of one side only.*WINDOW XML"):
            gn.save(m, tmp_path / f"a{module.SUFFIXES[0]}", module.NAME)
        assert not list(tmp_path.iterdir())


def test_formats_without_sides_refuse_sides_that_differ(tmp_path):
    for name in ("SSDD", "Speos", "Zemax"):
        with pytest.raises(ParameterError, match=r"differ, and .* names no side"):
            gn.save(sheet(False), tmp_path / "a", name)


def test_what_a_material_is_made_of_stays_itself(tmp_path):
    """Every measured part knows its file, once."""
    gn.save(sheet(), tmp_path / "a.astm")
    m = gn.load(tmp_path / "a.astm", side="both")
    assert {part.provenance["format"] for part in quarters(m).values()} == {"ASTM"}
    assert gn.load(tmp_path / "a.astm", side="both") == m
    with pytest.raises(ParameterError, match="one of 'front', 'back', 'both'"):
        gn.load(tmp_path / "a.astm", side="behind")


def test_samples_of_a_measured_sheet_are_drawn_as_the_density_says(tmp_path):
    gn.save(klems_sheet(), tmp_path / "a.xml", "WINDOW XML")
    m = gn.load(tmp_path / "a.xml", side="both")
    u = np.random.default_rng(4).random((40_000, 3))
    for wo in (gn.direction(0.6, 0.4), gn.direction(2.4, 1.0)):
        s = m.sample(np.broadcast_to(wo, (len(u), 3)), u)
        np.testing.assert_allclose(s.weight, m.f(s.wi, wo) * np.abs(s.wi[:, 2]) / s.pdf, rtol=1e-9)
        z = np.random.default_rng(9).uniform(-1.0, 1.0, 200_000)
        around = gn.direction(np.arccos(z), 2.0 * math.pi * np.random.default_rng(10).random(z.shape))
        expected = (m.f(around, wo) * np.abs(around[:, 2])).mean() * 4.0 * math.pi
        assert s.weight.mean() == pytest.approx(expected, rel=0.02)


def test_side_is_an_option_of_every_format_with_sides():
    for module in formats():
        options = module.read.__annotations__
        if "side" in options:
            assert getattr(module, "TRANSMITS", False) or module.NAME == "Excel"
    assert set(_sides.CALLED) == set(QUARTERS)
