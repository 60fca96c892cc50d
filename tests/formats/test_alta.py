"""ALTA: rows and streams, its parametrisations against ALTA's own definitions, uncertainties, damage."""

import itertools
import math

import numpy as np
import pytest
from format_cases import f, grid, loaded
from text_files import ALTA, alta_binary

import gonio as gn
from gonio.formats import alta
from gonio.formats.alta import parametrisations
from gonio.tables.angle_systems import angle_system
from gonio.tables.gridded import Gridded

# ALTA


def test_alta_rows_and_bounds(tmp_path):
    m = loaded(tmp_path, ALTA)
    assert f(m, 0.3, 0.0, 0.2, 3.0) == pytest.approx(1.0)  # light at theta_l = 0.3, view at theta_v = 0.2
    assert f(m, 0.3, 0.0, 0.1, 3.0) == pytest.approx(0.5)
    # half the width of 0.45 to 0.60, as a rectangular distribution: GUM 4.3.7
    at = (0, 0, list(m.axes["phi"]).index(3.0))
    assert m.uncertainty[at] == pytest.approx(0.15 / 2 / math.sqrt(3))


@pytest.mark.parametrize("order", ["<", ">"])
def test_alta_streams(tmp_path, order):
    m = loaded(tmp_path, alta_binary(order))
    assert f(m, 0.3, 0.0, 0.1, 3.0) == pytest.approx(0.5 / math.cos(0.1))
    with pytest.raises(gn.errors.FormatError, match=r"cut short: 6\d bytes after line 10, expected 64"):
        loaded(tmp_path, alta_binary(order)[:-14])
    with pytest.raises(gn.errors.FormatError, match="cut short"):
        loaded(tmp_path, alta_binary(order).replace(b"COUNT 2", b"COUNT 999999999999999"))
    with pytest.raises(gn.errors.FormatError, match="END_STREAM"):
        loaded(tmp_path, alta_binary(order).replace(b"COUNT 2", b"COUNT 1"))


VIEW, LIGHT = gn.direction(0.5, 0.4), gn.direction(0.9, 2.5)

DOT = float(VIEW @ LIGHT)

HALF, BACK = (LIGHT + VIEW) / 2, (LIGHT - VIEW) / 2

UNIT = HALF / np.linalg.norm(HALF)

BETWEEN = math.atan2(BACK[1], BACK[0]) - math.atan2(HALF[1], HALF[0])

K = np.array([VIEW[0] - LIGHT[0], VIEW[1] - LIGHT[1], VIEW[2] + LIGHT[2]])

THETA_K = math.acos(K[2] / np.linalg.norm(K))

PHI_K = math.atan2(K[1], K[0]) - 2.5

DEFINED = {  # what ALTA's params.h says the numbers are, of VIEW and LIGHT
    "COS_TLV": [DOT],
    "COS_TH": [UNIT[2]],
    "RUSIN_TH_TD": [math.acos(UNIT[2]), math.acos(UNIT @ VIEW)],
    "COS_TH_TD": [UNIT[2], UNIT @ VIEW],
    "STARK_2D": [math.hypot(*HALF[:2]), np.linalg.norm(BACK)],
    "STARK_3D": [math.hypot(*HALF[:2]), np.linalg.norm(BACK), BETWEEN],
    "NEUMANN_3D": [math.hypot(*HALF[:2]), math.hypot(*BACK[:2]), BETWEEN],
    "ISOTROPIC_TV_TL": [0.5, 0.9],
    "ISOTROPIC_TV_TL_DPHI": [0.5, 0.9, 2.1],
    "ISOTROPIC_TL_TV_PROJ_DPHI": [0.9, 0.5 * math.cos(-2.1), 0.5 * math.sin(-2.1)],
    "SCHLICK_TL_TK_PROJ_DPHI": [0.9, THETA_K * math.cos(PHI_K), THETA_K * math.sin(PHI_K)],
    "SPHERICAL_TL_PL_TV_PV": [0.9, 2.5, 0.5, 0.4],
    "STEREOGRAPHIC": [*(VIEW[:2] / (1 + VIEW[2])), *(LIGHT[:2] / (1 + LIGHT[2]))],
    "CARTESIAN": [*VIEW, *LIGHT],
    "RUSIN_VH": list(UNIT),
}


@pytest.mark.parametrize("name", DEFINED)
def test_parametrisations_are_what_alta_defines(name):
    parameters = parametrisations.PARAMETERS[name]
    x = np.array(DEFINED[name])
    assert len(x) == parameters.size
    theta_i, phi_i, theta_o, phi_o = (np.broadcast_to(a, 1) for a in parameters.to_angles(*x[:, None]))
    light, view = gn.direction(theta_i, phi_i)[0], gn.direction(theta_o, phi_o)[0]
    half, back = (light + view) / 2, (light - view) / 2
    if name in ("CARTESIAN", "STEREOGRAPHIC", "SPHERICAL_TL_PL_TV_PV"):
        np.testing.assert_allclose([*light, *view], [*LIGHT, *VIEW], atol=1e-12)
    if parameters.size >= 3 and name != "RUSIN_VH":
        invariants = [light[2], view[2], light @ view, light[0] * view[1] - light[1] * view[0]]
        expected = [LIGHT[2], VIEW[2], DOT, LIGHT[0] * VIEW[1] - LIGHT[1] * VIEW[0]]
        np.testing.assert_allclose(invariants, expected, atol=1e-12)
    if name == "COS_TLV":
        assert light @ view == pytest.approx(DOT)
    if name in ("COS_TH", "RUSIN_TH_TD", "COS_TH_TD", "RUSIN_VH"):
        assert half[2] / np.linalg.norm(half) == pytest.approx(UNIT[2])
    if name in ("RUSIN_TH_TD", "COS_TH_TD"):
        assert half @ view / np.linalg.norm(half) == pytest.approx(UNIT @ VIEW)
    if name == "STARK_2D":
        np.testing.assert_allclose([math.hypot(*half[:2]), np.linalg.norm(back)], x)


@pytest.mark.parametrize("name", [n for n, p in parametrisations.PARAMETERS.items() if p.of_angles])
def test_parametrisations_invert(name):
    parameters = parametrisations.PARAMETERS[name]
    rng = np.random.default_rng(3)
    given = [rng.uniform(0.05, 1.5, 99), rng.uniform(-3, 3, 99), rng.uniform(0.05, 1.5, 99), rng.uniform(-3, 3, 99)]
    wi, wo = gn.direction(*given[:2]), gn.direction(*given[2:])
    back = parameters.to_angles(*parameters.of_angles(*given))
    light, view = gn.direction(*back[:2]), gn.direction(*back[2:])
    assert np.abs(light[:, 2] - wi[:, 2]).max() < 1e-12
    assert np.abs(view[:, 2] - wo[:, 2]).max() < 1e-12
    assert np.abs(np.sum(light * view, -1) - np.sum(wi * wo, -1)).max() < 1e-12
    if parameters.size > 3:
        assert max(np.abs(light - wi).max(), np.abs(view - wo).max()) < 1e-12


@pytest.mark.filterwarnings("ignore:.*mark of a missing value")  # the holes of its grid, as it was made
def test_alta_half_angles_become_their_grid(tmp_path):
    head = "#DIM 3 3\n#PARAM_IN RUSIN_TH_TD_PD\n"
    nodes = list(itertools.product((0.0, 0.4, 0.8), (0.0, 0.5), (-2.0, 0.0, 2.0)))
    text = head + "".join(f"{h}\t{d}\t{p}\t{h + d}\t{p}\t1\n" for h, d, p in nodes)
    m = loaded(tmp_path, text)
    assert m.parameterization == "half_difference"
    assert m.channel_names == ("R", "G", "B")
    wo, wi = angle_system("half_difference").pairs(0.4, 0.5, 2.0)  # ALTA's phi_d is the view's
    np.testing.assert_allclose(m.f(wi, wo), [0.9, 2.0, 1.0])
    alta.write(m, tmp_path / "a")
    assert gn.load(tmp_path / "a") == m
    two = "#DIM 2 1\n#PARAM_IN COS_TH_TD\n" + "".join(f"{h} {d} {h + 10 * d}\n" for h in (0.9, 1.0) for d in (0.8, 1.0))
    m = loaded(tmp_path, two)
    for phi_d in (0.0, 1.0):  # no matter which
        wi, wo = angle_system("half_difference").pairs(math.acos(0.9), math.acos(0.8), phi_d)
        assert m.f(wi, wo) == pytest.approx(8.9)


def test_alta_keeps_uncertainties_and_cosines(tmp_path):
    m = grid("angles", (3, 3, 4), channels=("R", "G", "B"), quantity="brdf * cos(theta_o)")
    m = Gridded("angles", m.axes, m.stored, channels=m.channel_names, quantity=m.quantity, uncertainty=np.abs(m.stored))
    alta.write(m, tmp_path / "a", binary=True)
    again = gn.load(tmp_path / "a")
    assert again.stored.tobytes() == m.stored.tobytes()
    np.testing.assert_allclose(again.uncertainty, m.uncertainty)
    with pytest.raises(gn.errors.ParameterError, match="holds no azimuth of wi"):
        alta.write(grid("angles", (2, 2, 2, 2)), tmp_path / "b", param_in="RUSIN_TH_TD_PD")
    with pytest.raises(gn.errors.ParameterError, match="expected one of"):
        gn.save(m, tmp_path / "b", "ALTA", param_in="COS_TH")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("ISOTROPIC_TV_TL_DPHI", "UNKNOWN_INPUT", "give param_in="),
        ("#DIM 3 1", "#DIM 2 1", "expected 3 numbers for ISOTROPIC_TV_TL_DPHI"),
        ("#DIM 3 1", "#DIM 3 0", "at least one value"),
        ("#DIM 3 1", "#DIM 3 1 1", "not a known format"),
        ("INV_STERADIAN", "ENERGY", "#PARAM_OUT ENERGY: is no BRDF"),
        ("#VS 2", "#VS 3", "and 0, 1 or 2"),
        ("#VS 2", "#VS 0", "line 6: .*as #DIM and #VS say"),
        ("0.75 0.70 0.80", "0.75 0.70", "line 8: .*6 numbers, not 5"),
        ("0.1 0.3 3.0", "0.1 nan 3.0", "row 2 has no finite ISOTROPIC_TV_TL_DPHI"),
    ],
)
def test_damaged_alta(tmp_path, old, new, says):
    assert old in ALTA
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, ALTA.replace(old, new))


def test_alta_can_be_told_what_it_does_not_say(tmp_path):
    text = ALTA.replace("#PARAM_IN ISOTROPIC_TV_TL_DPHI\n", "")
    assert loaded(tmp_path, text, alta, param_in="ISOTROPIC_TV_TL_DPHI") == loaded(tmp_path, ALTA)
    assert not alta.matches(b"#ALTA FUNC\n#DIM 3 1\n#FUNC nonlinear_function_beckmann\n", 100)
