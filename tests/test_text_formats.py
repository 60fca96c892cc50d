"""ASTM, pab-opto, ALTA, Integra, SSDD and CSV: what files by hand mean, round trips, damage."""

import itertools
import math
import re

import numpy as np
import pytest
from text_files import ALTA, ASTM, CSV, INTEGRA, PAB, SEEDS, SSDD, alta_binary, ssdd_binary

import gonio as gn
from gonio.formats import alta, astm, csv_table, formats, integra, pab, ssdd
from gonio.formats.alta import parametrisations
from gonio.tables.angle_systems import angle_system
from gonio.tables.gridded import Gridded
from gonio.tables.scattered import Scattered

DEGREE = math.pi / 180.0
MODULES = {"ASTM": astm, "pab-opto": pab, "ALTA": alta, "Integra": integra, "SSDD": ssdd, "CSV": csv_table}


def loaded(tmp_path, content, module=None, name="file.txt", **options):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return gn.load(path) if module is None else module.read(path, **options)


def f(m, theta_i, phi_i, theta_o, phi_o):
    return m.f_angles(*(np.float64(x) for x in (theta_i, phi_i, theta_o, phi_o)))


def random_pairs(count=400, seed=5):
    rng = np.random.default_rng(seed)
    theta_i, theta_o = np.arccos(rng.uniform(0.05, 1.0, (2, count)))
    phi_i, phi_o = rng.uniform(0.0, 6.28, (2, count))
    return gn.direction(theta_i, phi_i), gn.direction(theta_o, phi_o)


def grid(kind, counts, channels=None, mirrored=False, **options):
    """A grid of random values, at angles with a decimal in degrees."""
    axes = {}
    for name, count in zip(angle_system(kind).axes(len(counts) == 4), counts, strict=True):
        high = 90.0 if name.startswith("theta") else 180.0 if name == "radial" or mirrored else 360.0
        whole = name.startswith("theta") or name == "radial" or mirrored
        axes[name] = np.radians(np.round(np.linspace(0.0, high, count, endpoint=whole), 1))
    shape = (*counts, *(() if channels is None else (len(channels),)))
    values = np.random.default_rng(len(shape)).normal(size=shape)
    return Gridded(kind, axes, values, channels=channels, mirrored=mirrored, **options)


def rows(isotropic=None, channels=(450.0, 550.5), **options):
    rng = np.random.default_rng(8)
    thetas, phis = rng.uniform(0.0, 1.5, (2, 40)), rng.uniform(0.0, 6.2, (2, 40))
    return Scattered(
        thetas[0],
        phis[0],
        thetas[1],
        phis[1],
        rng.normal(size=(40, 2)),
        channels=channels,
        isotropic=isotropic,
        **options,
    )


# All formats


@pytest.mark.parametrize("name", SEEDS)
def test_files_are_recognised_by_their_own_format_only(name):
    content = SEEDS[name]()
    claimed = [m.NAME for m in formats() if m.matches(content[:4096], len(content))]
    assert claimed == [name.removesuffix(" binary")]


@pytest.mark.parametrize("name", [n for n in SEEDS if "binary" not in n])
@pytest.mark.parametrize("change", ["crlf", "cr", "mark", "latin", "blanks"])
def test_line_ends_and_encodings_do_not_matter(tmp_path, name, change):
    text = SEEDS[name]().decode()
    changed = {
        "crlf": text.replace("\n", "\r\n").encode(),
        "cr": text.replace("\n", "\r").encode(),
        "mark": b"\xef\xbb\xbf" + text.encode(),
        "latin": text.encode("latin-1"),
        "blanks": ("\n\n" + text.replace("\n", "  \n") + "\n \n").encode(),
    }[change]
    assert loaded(tmp_path, changed) == loaded(tmp_path, text)


@pytest.mark.parametrize("name", SEEDS)
def test_what_was_read_is_written_as_it_was(tmp_path, name):
    module, content = MODULES[name.removesuffix(" binary")], SEEDS[name]()
    options = {"binary": True} if "binary" in name else {}
    m = loaded(tmp_path, content)
    module.write(m, tmp_path / "again", **options)
    again = gn.load(tmp_path / "again")
    assert again == m
    assert again.about.keys() == m.about.keys()
    module.write(again, tmp_path / "once more", **options)
    assert (tmp_path / "again").read_bytes() == (tmp_path / "once more").read_bytes()


@pytest.mark.parametrize("name", SEEDS)
def test_cut_files_are_refused(tmp_path, name):
    content = SEEDS[name]()
    if name in ("pab-opto", "ALTA", "CSV"):  # these do not say how many rows there are
        content, least = content[: content.rindex(b"\n", 0, -1) - 1], 1
    cut = [content[:k] for k in range(0, len(content) - 3, 7)]
    refused = 0
    for part in cut:
        try:
            loaded(tmp_path, part)
        except gn.errors.FormatError as error:
            refused += 1
            assert "file.txt" in str(error)
    least = 0.5 if name in ("pab-opto", "ALTA", "CSV", "SSDD") else 0.9
    assert refused > least * len(cut)


@pytest.mark.parametrize("module", MODULES.values(), ids=MODULES)
def test_materials_that_fit_no_table_are_refused(tmp_path, module):
    options = {"incident": (0.3, 0.0)} if module is pab else {}
    for m in (gn.IdealSpecular(0.5), gn.Lambertian(np.full((2, 2, 3), 0.5))):
        with pytest.raises(gn.errors.ParameterError):
            module.write(m, tmp_path / "no", **options)
    assert not (tmp_path / "no").exists()
    with pytest.raises(gn.errors.ParameterError, match="resolution"):
        gn.save(gn.Lambertian(0.5), tmp_path / "no", module.NAME, resolution=(3, 0, 3), **options)


@pytest.mark.parametrize("module", MODULES.values(), ids=MODULES)
def test_models_are_written_at_a_grid(tmp_path, module):
    m = gn.Microfacet(gn.GGX(0.4), 0.9) + gn.Lambertian(0.3)
    options = {"incident": (0.3, 0.0)} if module is pab else {"resolution": (31, 31, 24)}
    if module is integra:
        options = {"resolution": (31, 61, 25)}
    module.write(m, tmp_path / "a", **options)
    again = gn.load(tmp_path / "a")
    wi, wo = random_pairs()
    if module is pab:
        wi = np.broadcast_to(gn.direction(0.3, 0.0), wi.shape)
    far = (wi[:, 2] > 0.2) & (wo[:, 2] > 0.2)
    np.testing.assert_allclose(again.f(wi, wo)[far], m.f(wi, wo)[far], rtol=0.25)
    assert np.median(np.abs(again.f(wi, wo) / m.f(wi, wo) - 1.0)[far]) < 0.01


@pytest.mark.parametrize("module", [astm, alta, csv_table], ids=["ASTM", "ALTA", "CSV"])
@pytest.mark.parametrize("counts", [(3, 4, 5), (3, 4, 2, 5)])
@pytest.mark.parametrize("mirrored", [False, True])
def test_grids_come_back_from_rows(tmp_path, module, counts, mirrored):
    if mirrored and len(counts) == 4:
        return
    m = grid("angles", counts, mirrored=mirrored)
    module.write(m, tmp_path / "a")
    again = gn.load(tmp_path / "a")
    wi, wo = random_pairs()
    assert type(again) is Gridded
    np.testing.assert_allclose(again.f(wi, wo), m.f(wi, wo), rtol=1e-9)


@pytest.mark.parametrize("module", [astm, alta, csv_table, ssdd], ids=["ASTM", "ALTA", "CSV", "SSDD"])
def test_measurements_are_written_at_a_grid_that_is_asked_for(tmp_path, module):
    m = gn.Microfacet(gn.GGX(0.5), 0.9) + gn.Lambertian(0.3)
    held = gn.repair.resample(m, "half_difference", resolution=(31, 31, 36))
    module.write(held, tmp_path / "a", resolution=(19, 19, 24))
    again = gn.load(tmp_path / "a")
    assert again.parameterisation == "angles" and [len(x) for x in again.axes.values()][:2] == [19, 19]
    wi, wo = random_pairs()
    far = (wi[:, 2] > 0.2) & (wo[:, 2] > 0.2)
    assert np.median(np.abs(again.f(wi, wo) / m.f(wi, wo) - 1.0)[far]) < 0.02


@pytest.mark.parametrize("module", [astm, alta, csv_table], ids=["ASTM", "ALTA", "CSV"])
def test_rows_come_back_from_rows(tmp_path, module):
    m = rows()
    module.write(m, tmp_path / "a")
    again = gn.load(tmp_path / "a")
    np.testing.assert_allclose(again.rows, m.rows, rtol=1e-15)
    assert again.stored.tobytes() == m.stored.tobytes()


# ASTM


def test_astm_rows(tmp_path):
    m = loaded(tmp_path, ASTM)
    assert m.about == {"TITLE": "grey tile", "SAMPLE_ID": "7"}
    assert m.channel_names == ("R", "G", "B")
    np.testing.assert_allclose(f(m, 0.5, 0.0, 0.5, 3.0), [0.4, 0.5, 0.6])
    np.testing.assert_allclose(f(m, 0.5, 1.0, 0.5, 4.0), [0.4, 0.5, 0.6])  # of one azimuth: isotropic


def test_astm_columns_in_any_order_and_without_phi_i(tmp_path):
    text = "VARS Integrated 300-700nm, theta_s, THETA_I, phi_s\n0.7, 0.2, 0.1, 3\n\n0.8, 0.3, 0.1, 3\n"
    m = loaded(tmp_path, text)
    assert m.channel_names is None
    assert m.about["channel"] == "Integrated 300-700nm"
    assert f(m, 0.1, 0.0, 0.3, 3.0) == pytest.approx(0.8)
    m = loaded(tmp_path, "VARS theta_i,phi_i,theta_s,phi_s,400nm,502.5 nm\n0.1,0,0.2,3,5,6\n")
    assert m.channel_names == (400.0, 502.5)


def test_a_line_that_is_named_like_an_azimuth_is_text(tmp_path):
    m = loaded(tmp_path, "phi_i as in the log\nVARS theta_i,theta_s,phi_s,f\n0.1,0.2,0,5\n0.1,0.3,0,6\n")
    assert type(m) is Gridded
    astm.write(m, tmp_path / "a")
    assert gn.load(tmp_path / "a") == m


def test_rows_without_a_number_are_refused(tmp_path):
    with pytest.raises(gn.errors.FormatError, match="holds no value that is a number"):
        loaded(tmp_path, "VARS theta_i,theta_s,phi_s,f\n0.1,0.2,0,nan\n0.1,0.3,0,nan\n")


def test_negative_polar_angles_lean_to_the_other_side(tmp_path):
    m = loaded(tmp_path, "VARS theta_i,phi_i,theta_s,phi_s,f\n0.5,0,-0.25,0,1\n0.5,0,0.25,0,2\n")
    assert f(m, 0.5, 0.0, 0.25, math.pi) == pytest.approx(1.0)
    assert f(m, 0.5, 0.0, 0.25, 0.0) == pytest.approx(2.0)


def test_transmission_is_kept_beside_the_reflection(tmp_path):
    text = "VARS theta_i,phi_i,theta_s,phi_s,f\n0.5,0,0.3,0,1\n0.5,0,3,1,7\n2.5,0,3,1,9\n0.5,0,0.4,0,2\n"
    m = loaded(tmp_path, text)
    assert f(m, 0.5, 0.0, 0.4, 0.0) == pytest.approx(2.0)
    assert m.about["other_pairs"].values.tolist() == [7.0, 9.0]
    for module in (astm, csv_table):
        module.write(m, tmp_path / "a")
        assert gn.load(tmp_path / "a") == m
        assert gn.load(tmp_path / "a").about["other_pairs"].values.tolist() == [7.0, 9.0]
    back = loaded(tmp_path, text, astm, side="back")
    assert f(back, math.pi - 2.5, 0.0, math.pi - 3.0, 1.0) == pytest.approx(9.0)
    only = "VARS theta_i,phi_i,theta_s,phi_s,f\n0.5,0,3,1,7\n"
    with pytest.raises(gn.errors.FormatError, match="none of 1 rows is reflection on the front"):
        loaded(tmp_path, only)
    with pytest.raises(gn.errors.ParameterError, match="side='top'"):
        gn.load(tmp_path / "file.txt", side="top")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("NUM_POINTS 3", "NUM_POINTS 4", "NUM_POINTS says 4 rows, got 3"),
        ("NUM_POINTS 3", "NUM_POINTS many", "line 3: got 'many'"),
        ("theta_s,", "", "line 4: .*expected theta_i, phi_i, theta_s, phi_s"),
        ("phi_i,theta_s", "theta_i,theta_s", "line 4"),
        ("0.50,3.0,0.4", "0.50,3.0", "line 6: got .* expected 7 numbers, not 6"),
        ("0.50,3.0,0.4", "0.50,3.0,o.4", "line 6: got 'o.4'"),
        ("0.50,3.0,0.4", "nan,3.0,0.4", "row 2: theta_o is nan degrees, expected at most 180"),
        ("0.50,3.0,0.4", "50,3.0,0.4", "row 2: theta_o is 2864.79 degrees"),
    ],
)
def test_damaged_astm(tmp_path, old, new, says):
    assert old in ASTM
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, ASTM.replace(old, new), astm)


# pab-opto


def test_pab_rows(tmp_path):
    m = loaded(tmp_path, PAB)
    assert m.quantity == "brdf * cos(theta_o)"
    assert m.about["sample_name"] == '"tile"'
    assert m.about["upphi"] == "90"
    assert f(m, 30 * DEGREE, 0.0, 60 * DEGREE, math.pi) == pytest.approx(0.4 / 0.5)
    assert f(m, 30 * DEGREE, 0.0, 0.0, 0.0) == pytest.approx(0.25)
    m = loaded(tmp_path, PAB.replace("DSF", "BSDF"))
    assert f(m, 30 * DEGREE, 0.0, 60 * DEGREE, math.pi) == pytest.approx(0.4)


def test_pab_colours(tmp_path):
    text = "#intheta 30\n#inphi 10\n#colorimetry: CIE-XYZ\n#format: theta phi BRDF\n20 190 1 2 3\n30 190 4 5 6\n"
    m = loaded(tmp_path, text)
    assert m.channel_names == ("X", "Y", "Z")
    np.testing.assert_allclose(f(m, 30 * DEGREE, 10 * DEGREE, 30 * DEGREE, 190 * DEGREE), [4, 5, 6])
    pab.write(m, tmp_path / "a")
    assert "#colorimetry: CIE-XYZ\n" in (tmp_path / "a").read_text()
    assert gn.load(tmp_path / "a") == m
    with pytest.raises(gn.errors.ParameterError, match="expected one or X, Y, Z"):
        pab.write(gn.Lambertian([0.1, 0.2, 0.3]), tmp_path / "b", incident=(0.1, 0.0))


def test_pab_of_several_incident_directions(tmp_path):
    m = gn.Microfacet(gn.GGX(0.5), 0.9)
    paths = [tmp_path / f"{degrees}.txt" for degrees in (0, 30, 60)]
    for path in paths:
        pab.write(m, path, incident=(float(path.stem) * DEGREE, 0.0), resolution=(1, 18, 36))
    together = pab.read(paths[0], more=paths[1:])
    assert [len(x) for x in together.axes.values()] == [3, 18, 36]
    assert together.is_mirrored is False
    wo = gn.direction(0.5, 2.0)
    assert together.f(gn.direction(30 * DEGREE, 0.0), wo) == pytest.approx(
        m.f(gn.direction(30 * DEGREE, 0.0), wo), rel=0.02
    )
    with pytest.raises(gn.errors.ParameterError, match="has 3 incident directions there, expected one"):
        pab.write(together, tmp_path / "a")
    pab.write(together, tmp_path / "a", incident=(30 * DEGREE, 0.0))
    assert gn.load(tmp_path / "a") == gn.load(paths[1])
    (tmp_path / "other").write_text(PAB)
    with pytest.raises(gn.errors.FormatError, match="expected the same as"):
        pab.read(paths[0], more=[tmp_path / "other"])


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("DSF", "[uA]", "line 8: .*other quantities are no reflectances"),
        ("#incident_angle 30 0", "#incident_angle 40 0", "#incident_angle is .* but #intheta"),
        ("#intheta 30\n#inphi 0\n", "", None),
        ("#incident_angle 30 0\n", "", None),
        ("#intheta 30", "#intheta", "no incident direction"),
        ("#intheta 30", "#intheta x", "line 3: got 'x'"),
        ("60 0 0.1", "60 0", "line 11: got '60 0', expected 3 numbers"),
        ("60 0 0.1", "60 0 0.1 0.2", "line 11"),
    ],
)
def test_headers_and_damage_of_pab(tmp_path, old, new, says):
    assert old in PAB
    if says is None:
        assert loaded(tmp_path, PAB.replace(old, new)) == loaded(tmp_path, PAB)
        return
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, PAB.replace(old, new), pab)


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


def test_alta_half_angles_become_their_grid(tmp_path):
    head = "#DIM 3 3\n#PARAM_IN RUSIN_TH_TD_PD\n"
    nodes = list(itertools.product((0.0, 0.4, 0.8), (0.0, 0.5), (-2.0, 0.0, 2.0)))
    text = head + "".join(f"{h}\t{d}\t{p}\t{h + d}\t{p}\t1\n" for h, d, p in nodes)
    m = loaded(tmp_path, text)
    assert m.parameterisation == "half_difference"
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


def test_changed_values_are_written_not_those_of_the_file(tmp_path):
    m = loaded(tmp_path, ALTA)
    alta.write(m.with_brdf(2.0 * m.brdf()), tmp_path / "a")
    assert f(gn.load(tmp_path / "a"), 0.3, 0.0, 0.1, 3.0) == pytest.approx(1.0)


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
        ("#DIM 3 1", "#DIM 3 1 1", "#DIM 3 1 1"),
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


# Integra


def test_integra_values_are_times_kbdf_over_pi(tmp_path):
    m = loaded(tmp_path, INTEGRA)
    mirror = (45 * DEGREE, 0.0, 45 * DEGREE, math.pi)
    assert f(m, *mirror) == pytest.approx(7 * 0.5 / math.pi)
    # phi = 0 of the file is towards the normal: 45 - 30 degrees; phi = 180 towards the horizon
    assert f(m, 45 * DEGREE, 0.0, 15 * DEGREE, math.pi) == pytest.approx(8 * 0.5 / math.pi)
    assert f(m, 45 * DEGREE, 0.0, 75 * DEGREE, math.pi) == pytest.approx(11 * 0.5 / math.pi)
    assert f(m, 45 * DEGREE, 1.0, 15 * DEGREE, math.pi + 1.0) == pytest.approx(8 * 0.5 / math.pi)
    m = loaded(tmp_path, INTEGRA.replace("Luminance", "Intensity"))
    assert f(m, 45 * DEGREE, 0.0, 75 * DEGREE, math.pi) == pytest.approx(11 * 0.5 / math.cos(75 * DEGREE))


def test_integra_relative_values_have_the_albedo_of_kbdf(tmp_path):
    nodes = " ".join(map(str, range(0, 181, 10)))
    flat = " ".join(["3"] * 19)
    text = (
        "TypeSym AxiSymmetrical TypeColorModel BW TypeData Luminance Relative sigma 3 0 30 60\n"
        f"theta 19 {nodes}\nbw kbdf 0.2 0.3 0.4 def\n{flat}\n{flat}\n{flat}\nenddef\n"
    )
    m = loaded(tmp_path, text, integra)
    for theta_i, albedo in ((0.0, 0.2), (30 * DEGREE, 0.3), (60 * DEGREE, 0.4)):
        assert f(m, theta_i, 0.0, 0.7, 2.0) == pytest.approx(albedo / math.pi, rel=2e-3)


def test_integra_channels_and_centres(tmp_path):
    three = "\n".join(f"{k} def {v} 2 3 4 5 6 7 8 9 10 11 12 enddef" for k, v in (("BLUE", 3), ("red", 1), ("gre", 2)))
    head = INTEGRA[: INTEGRA.index("bw\n")].replace("TypeColorModel BW", "TypeColorModel rgb")
    m = loaded(tmp_path, head + three)
    np.testing.assert_allclose(f(m, 0.0, 0.0, 0.0, 0.0), np.array([1, 2, 3]) / math.pi)
    turned = INTEGRA.replace("phi 2\n", "sigmaT\n0 50\nphi 2\n")
    m = loaded(tmp_path, turned)
    assert isinstance(m, Scattered)
    where = np.argmin(np.abs(m.rows[:, 0] - 45 * DEGREE) + np.abs(m.rows[:, 2] - 50 * DEGREE))
    np.testing.assert_allclose(m.rows[where, 2], 50 * DEGREE)
    assert m.stored[where] == pytest.approx(7 * 0.5 / math.pi)
    (tmp_path / "a.ddt").write_text(INTEGRA)
    with pytest.raises(gn.errors.FormatError, match="transmission"):
        gn.load(tmp_path / "a.ddt")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("sigma 2", "sigma 3", "line 8: .*angles of sigma"),
        (" 0 45\nphi", " 45 0\nphi", "rising angles"),
        ("theta 3", "theta 9999999999", "angles of theta"),
        ("7 11 12", "7 11", "values by psi"),
        ("7 11 12", "7 11 12 13", "line 21: got '13 numbers', expected 12 values"),
        ("Luminance", "Radiance", "line 5: got 'Radiance'"),
        ("BW", "RGB", "channels .*expected .*R"),
        ("bw\n", "red\n", "channels"),
        ("Absolute", "", "line 6: got 'sigma', expected one of absolute"),
        ("theta 3", "sigma 3", "each list once"),
    ],
)
def test_damaged_integra(tmp_path, old, new, says):
    assert old in INTEGRA
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, INTEGRA.replace(old, new), integra)


@pytest.mark.parametrize("channels", [None, ("R", "G", "B"), (400.0, 500.5)])
@pytest.mark.parametrize(("counts", "mirrored"), [((3, 4, 5), False), ((3, 4, 5), True), ((3, 4, 5, 2), False)])
@pytest.mark.parametrize("quantity", ["reflectance factor", "brdf * cos(theta_o)"])
def test_integra_round_trip(tmp_path, channels, counts, mirrored, quantity):
    m = grid("specular", counts, channels, mirrored, quantity=quantity)
    integra.write(m, tmp_path / "a")
    again = gn.load(tmp_path / "a")
    assert sorted(again.stored.ravel()) == sorted(m.stored.ravel())
    if channels is None and len(counts) == 3:
        np.testing.assert_allclose(again.f(*random_pairs()), m.f(*random_pairs()), rtol=1e-9, atol=1e-12)


# SSDD


def test_ssdd_lambertian_of_the_specification(tmp_path):
    text = (  # doc/SsddFileFormatSpecification.md of libbsdf, version 0.2: its first example
        "VERSION 0.2\n\nDATA_TYPE brdf\nCOLOR_MODEL monochrome\nPARAM_TYPE spherical_coordinate_system\n"
        "PARAM0_LIST 0\nPARAM2_LIST 0\nPARAM3_LIST 0\nDATA ascii\n0.3183\n"
    )
    m = loaded(tmp_path, text)
    assert f(m, 0.3, 1.0, 0.8, 2.0) == pytest.approx(0.3183)


def test_ssdd_order_of_the_table(tmp_path):
    m = loaded(tmp_path, SSDD)
    assert m.about["NAME"] == "graues Gerät"
    assert m.about["SOFTWARE"] == "by hand"
    assert m.periods == {"phi_d": math.pi}
    # PARAM0 (theta_h) runs fastest, then PARAM2 (theta_d), then PARAM3 (phi_d)
    np.testing.assert_allclose(m.stored[1, 0, 0], [4, 5, 6])
    np.testing.assert_allclose(m.stored[0, 1, 0], [7, 8, 9])
    np.testing.assert_allclose(m.stored[0, 0, 1], [19, 20, 21])
    (other,) = m.about["other_blocks"]
    assert other.entries["DATA_TYPE"] == "specular_transmittance"
    np.testing.assert_allclose(other.table.ravel(), [0.05, 0.06])


def test_ssdd_binary_and_specular_azimuth(tmp_path):
    m = loaded(tmp_path, ssdd_binary())
    assert m.channel_names == (450.0, 550.5)
    # index = 2 (channels) * (p0 + 2 * (p2 + 3 * p3)): theta_i = 45, radial = 30, phi = 0 is towards the normal
    number = 2 * (1 + 2 * (1 + 3 * 0))
    np.testing.assert_allclose(f(m, 45 * DEGREE, 0.0, 15 * DEGREE, math.pi), [0.125 * number, 0.125 * (number + 1)])
    number = 2 * (1 + 2 * (1 + 3 * 2))  # phi = 180: towards the horizon
    np.testing.assert_allclose(f(m, 45 * DEGREE, 0.0, 75 * DEGREE, math.pi), [0.125 * number, 0.125 * (number + 1)])
    # phi = 90: libbsdf's direction is (.., +1, ..) for light at phi_i = 0
    side = np.array([0.0, math.sin(30 * DEGREE), 0.0]) + math.cos(30 * DEGREE) * gn.direction(45 * DEGREE, math.pi)
    number = 2 * (1 + 2 * (1 + 3 * 1))
    np.testing.assert_allclose(m.f(gn.direction(45 * DEGREE, 0.0), side)[0], 0.125 * number)
    assert len(m.about["other_blocks"]) == 1


def test_ssdd_grids_about_other_directions_become_rows(tmp_path):
    text = (
        "VERSION 0.2\nDATA_TYPE brdf\nCOLOR_MODEL monochrome\nPARAM_TYPE specular_coordinate_system\n"
        "PARAM0_LIST 0 45\nPARAM2_LIST 0 10\nPARAM3_LIST 0 180\nPARAM4_LIST 0 -5\nDATA ascii\n1 \n2\n3\n4\n5\n6\n7\n8\n"
    )
    m = loaded(tmp_path, text)
    where = (np.abs(m.rows[:, 0] - 45 * DEGREE) < 1e-9) & (np.abs(m.rows[:, 2] - 30 * DEGREE) < 1e-9)
    assert m.stored[where].tolist() == [4.0]  # 40 - 10 degrees: radial 10, phi 0


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("channels", [None, ("R", "G", "B"), ("X", "Y", "Z"), (400.0, 500.5)])
@pytest.mark.parametrize("kind", ["angles", "specular", "half_difference"])
@pytest.mark.parametrize(("counts", "mirrored"), [((3, 4, 5), False), ((3, 4, 5), True), ((3, 4, 5, 2), False)])
def test_ssdd_round_trip(tmp_path, binary, channels, kind, counts, mirrored):
    m = grid(kind, counts, channels, mirrored)
    ssdd.write(m, tmp_path / "a", binary=binary)
    again = gn.load(tmp_path / "a")
    stored = m.stored.astype(np.float32) if binary else m.stored
    assert sorted(again.stored.ravel()) == sorted(stored.ravel())
    if kind != "specular":
        assert binary or again == m
    elif channels is None and not binary:
        np.testing.assert_allclose(again.f(*random_pairs()), m.f(*random_pairs()), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("DATA_TYPE brdf", "DATA_TYPE btdf", "expected one brdf"),
        ("DATA_TYPE brdf", "DATA_TYPE other", "got 'DATA_TYPE other"),
        ("half_difference", "distorted", "PARAM_TYPE"),
        ("rgb", "cmyk", "COLOR_MODEL cmyk"),
        ("rgb", "spectrum", "without WAVELENGTH_LIST"),
        ("PARAM2_LIST 0 45 90\n", "", "without PARAM2_LIST"),
        ("PARAM2_LIST 0 45 90", "PARAM2_LIST 0 45 45", "line 9: .*rising"),
        ("PARAM2_LIST 0 45 90", "PARAM2_LIST 0 45 91", "theta_d runs from"),
        ("16 17 18", "16 17", "line 19: .*expected 3 numbers"),
        ("DATA ascii\n0.05\n0.06\n", "DATA ascii\n0.05\n", "cut short"),
        ("DATA ascii\n# PARAM3: 0", "DATA hex", "expected DATA ascii or DATA binary"),
        ("COLOR_MODEL rgb", "COLOR_MODEL rgb\nCOLOR_MODEL rgb", "each entry of a block once"),
        ("bilateral_symmetry rec", "rotation rec", "REDUCTION_TYPE"),
    ],
)
def test_damaged_ssdd(tmp_path, old, new, says):
    assert old in SSDD
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, SSDD.replace(old, new))


def test_promised_tables_are_not_allocated(tmp_path):
    many = " ".join(map(str, np.linspace(0, 90, 3000)))
    lists = "".join(f"PARAM{k}_LIST {many}\n" for k in (0, 1, 2, 3))
    head = "VERSION 0.2\nDATA_TYPE brdf\nCOLOR_MODEL rgb\nPARAM_TYPE spherical_coordinate_system\n"
    for kind in ("ascii", "binary"):
        with pytest.raises(gn.errors.FormatError, match="cut short"):
            loaded(tmp_path, f"{head}{lists}DATA {kind}\n1 2 3\n")


def test_ssdd_refuses_what_it_cannot_say(tmp_path):
    with pytest.raises(gn.errors.ParameterError, match="has channels"):
        ssdd.write(grid("angles", (2, 2, 2), ("a", "b")), tmp_path / "a")
    with pytest.raises(gn.errors.ParameterError, match="period"):
        ssdd.write(grid("angles", (2, 2, 2), periods={"phi": math.pi}, mirrored=False), tmp_path / "a")


# CSV


def test_csv_rows(tmp_path):
    m = loaded(tmp_path, CSV)
    assert m.about["sample"] == "grey tile"
    np.testing.assert_allclose(f(m, 30 * DEGREE, 0.0, 45 * DEGREE, math.pi), [0.3, 0.4])
    assert np.isnan(f(m, 30 * DEGREE, 0.0, 60 * DEGREE, math.pi)).tolist() == [False, True]
    assert np.nanmax(m.uncertainty) == 0.02


@pytest.mark.parametrize(
    "text",
    [
        "theta_i;phi_i;theta_o;phi_o;f\n30;0;45,5;180;0,25\n30;0;60;180;0,5\n",
        "theta_i\tphi_i\ttheta_o\tphi_o\tf\n30\t0\t45.5\t180\t0.25\n30\t0\t60\t180\t0.5\n",
        "theta_i phi_i theta_o phi_o f\n30 0  45.5 180 0.25\n30 0 60 180 0.5\n",
        'Theta_o,"phi_o",BRDF,theta_i, phi_i\n45.5,180,0.25,30,0\n60,180,0.5,30,0\n',
        "theta_i,theta_o,phi,brf\n30,45.5,180,0.7853981633974483\n30,60,180,1.5707963267948966\n",
        "# angle_unit: rad\ntheta_i,theta_o,phi,f\n0.5235987755982988,0.7941248096574199,3.141592653589793,0.25\n"
        "0.5235987755982988,1.0471975511965976,3.141592653589793,0.5\n",
        "theta_i,theta_o,phi,dsf\n30,45.5,180,0.17522724\n30,60,180,0.25\n",
        "theta_i,theta_o,phi,f_cos_i\n30,45.5,180,0.21650635\n30,60,180,0.4330127\n",
        "theta_i,theta_o,f\n30,-45.5,0.25\n30,-60,0.5\n",
        "theta_i,phi_i,theta_o,phi_o,f\n-30,180,45.5,180,0.25\n30,0,60,-180,0.5\n",
    ],
)
def test_one_table_in_many_forms(tmp_path, text):
    m = loaded(tmp_path, text)
    assert f(m, 30 * DEGREE, 0.0, 45.5 * DEGREE, math.pi) == pytest.approx(0.25)
    assert f(m, 30 * DEGREE, 0.0, 60 * DEGREE, math.pi) == pytest.approx(0.5)


@pytest.mark.parametrize("module", [astm, pab, csv_table, alta], ids=["ASTM", "pab-opto", "CSV", "ALTA"])
def test_light_from_one_azimuth_is_an_isotropic_material(tmp_path, module):
    text = "theta_i,phi_i,theta_o,phi_o,f\n" + "".join(
        f"30,10.1,{t},{p},{t + p}\n" for t in (10, 20) for p in (0, 5, 90.3)
    )
    m = loaded(tmp_path, text)
    assert type(m) is Gridded
    assert not m.is_oriented()
    for turn in (0.0, 1.0):
        at = (30 * DEGREE, 10.1 * DEGREE + turn, 20 * DEGREE, 90.3 * DEGREE + turn)
        assert f(m, *at) == pytest.approx(110.3)
    module.write(m, tmp_path / "a")
    again = gn.load(tmp_path / "a")
    assert f(again, *at) == pytest.approx(110.3)
    if module is not alta:  # ISOTROPIC_TV_TL_DPHI does not say it
        assert again.about["phi_i"] == m.about["phi_i"] == 10.1 * DEGREE
        np.testing.assert_array_equal(again.axes["phi"], m.axes["phi"])


def test_csv_rows_of_one_wavelength_each(tmp_path):
    text = "theta_i,theta_o,phi,wavelength,f,u_f\n" + "".join(
        f"30,{t},180,{w},{t + w},{0.001 * w}\n" for w in (550, 450) for t in (10, 20, 30) if (t, w) != (20, 450)
    )
    m = loaded(tmp_path, text)
    assert m.channel_names == (450.0, 550.0)
    np.testing.assert_allclose(f(m, 30 * DEGREE, 0.0, 30 * DEGREE, math.pi), [480.0, 580.0])
    assert np.isnan(m.stored).sum() == 1
    assert m.uncertainty.ravel()[-1] == 0.55
    with pytest.raises(gn.errors.FormatError, match="each pair once"):
        loaded(tmp_path, text + "30,10,180,450,1,1\n")


@pytest.mark.parametrize("quantity", ["brdf", "brdf * cos(theta_o)", "brdf * cos(theta_i)", "reflectance factor"])
@pytest.mark.parametrize("channels", [None, ("R", "cos"), (400.0, 500.5)])
@pytest.mark.parametrize("kind", ["angles", "specular", "half_difference"])
@pytest.mark.parametrize(("counts", "mirrored"), [((3, 4, 5), False), ((3, 4, 5), True), ((3, 4, 5, 2), False)])
def test_csv_keeps_grids_exactly(tmp_path, quantity, channels, kind, counts, mirrored):
    m = grid(kind, counts, channels, mirrored)
    stored = m.stored.copy()
    stored[1, 2, 3] = np.nan
    about = {"device": "by hand", "remark": "a: b, c"}
    m = Gridded(
        kind,
        m.axes,
        stored,
        quantity=quantity,
        uncertainty=np.abs(stored),
        channels=channels,
        mirrored=mirrored,
        outside="missing",
        interpolation="nearest",
        about=about,
    )
    gn.save(m, tmp_path / "a.csv")
    again = gn.load(tmp_path / "a.csv")
    assert again == m
    assert again.about == about
    assert "angle_unit" not in (tmp_path / "a.csv").read_text()


def test_csv_keeps_what_degrees_cannot_say(tmp_path):
    rng = np.random.default_rng(4)
    axes = {"theta_i": np.sort(rng.uniform(0, 1.5, 30)), "theta_o": np.sort(rng.uniform(0, 1.5, 30)), "phi": [0.0]}
    m = Gridded("angles", axes, rng.normal(size=(30, 30, 1)) * 1e-300, periods={"phi": math.pi})
    csv_table.write(m, tmp_path / "a")
    assert "# angle_unit: rad\n" in (tmp_path / "a").read_text()
    assert gn.load(tmp_path / "a") == m
    reciprocal = grid("half_difference", (3, 3, 4), periods={"phi_d": 2.0 * math.pi})
    csv_table.write(reciprocal, tmp_path / "a")
    assert gn.load(tmp_path / "a") == reciprocal


@pytest.mark.parametrize("isotropic", [True, False])
def test_csv_keeps_rows_exactly(tmp_path, isotropic):
    m = rows(isotropic, quantity="reflectance factor", uncertainty=np.ones((40, 2)) / 3.0, outside="missing")
    csv_table.write(m, tmp_path / "a")
    again = gn.load(tmp_path / "a")
    assert again == m
    assert again.rows.tobytes() == m.rows.tobytes()


def test_half_a_circle_is_mirrored_or_reciprocal_unless_said(tmp_path):
    text = "theta_i,theta_o,phi,f\n" + "".join(f"30,45,{p},{p}\n" for p in (0, 90, 180))
    assert loaded(tmp_path, text).is_mirrored
    assert not loaded(tmp_path, "# mirrored: false\n" + text).is_mirrored
    text = "theta_h,theta_d,phi_d,f\n" + "".join(f"30,45,{p},{p}\n" for p in (0, 90, 180))
    assert loaded(tmp_path, text).periods["phi_d"] == math.pi
    assert loaded(tmp_path, "# period_phi_d: 360\n" + text).periods["phi_d"] == 2.0 * math.pi


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("f_G,u", "g_G,u", "column 'g_G'"),
        ("f_G,u", "brf_G,u", "one quantity"),
        ("f_G,u", "f,u", "one column or one per channel"),
        ("f_G,u", "f_R,u", "column f_R twice"),
        ("u_f_G", "u_f_B", "uncertainties of none or of all"),
        ("phi_i,", "phi_d,", "columns of angles are"),
        ("0.3,0.4", "0.3,0.4,0.5", "line 4: .*8 numbers, not 9"),
        ("0.3,0.4", "0.3,a", "line 4: got 'a'"),
        ("45,180", ",180", "an angle is no number"),
        ("# sample: grey tile", "# angle_unit: gon", "angle_unit: gon"),
        ("# sample: grey tile", "# outside: zeros", "option|outside"),
        ("# sample: grey tile", "# period_phi_o: x", "period_phi_o: 'x'"),
        ("60,180", "190,180", "row 3: theta_o is 190 degrees"),
    ],
)
def test_damaged_csv(tmp_path, old, new, says):
    assert old in CSV
    with pytest.raises(gn.errors.FormatError, match=says):
        loaded(tmp_path, CSV.replace(old, new), csv_table)


@pytest.mark.parametrize("table", ["f\n1\n2\n", "wavelength,f\n400,1\n500,2\n"])
def test_a_csv_table_without_angles_is_no_format_of_directions(tmp_path, table):
    path = tmp_path / "t.csv"
    path.write_text(f"{csv_table.MARK}\n{table}")
    with pytest.raises(gn.errors.FormatError, match=r"columns of angles are missing, expected theta_i"):
        gn.load(path)


def test_csv_refuses_names_that_are_no_columns(tmp_path):
    for names in (("a,b", "c"), ("a b", "c"), ("a", "a")):
        with pytest.raises(gn.errors.ParameterError, match="has channels"):
            csv_table.write(grid("angles", (2, 2, 2), names), tmp_path / "a")


def test_docstrings_name_what_was_checked():
    for module in MODULES.values():
        assert module.ORACLE
        assert re.search(r"Checked\s+against", module.__doc__)
