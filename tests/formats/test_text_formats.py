"""Text files of rows (ASTM, pab-opto, ALTA, Integra, SSDD, CSV): what holds of all of them."""

import re

import numpy as np
import pytest
from format_cases import f, grid, loaded, random_pairs, rows
from text_files import ALTA, SEEDS

import gonio as gn
from gonio.formats import alta, astm, csv_table, formats, integra, pab, ssdd
from gonio.formula import tree
from gonio.tables.gridded import Gridded

DEGREES = np.pi / 180.0
MODULES = {"ASTM": astm, "pab-opto": pab, "ALTA": alta, "Integra": integra, "SSDD": ssdd, "CSV": csv_table}


@pytest.mark.parametrize("name", SEEDS)
def test_files_are_recognized_by_their_own_format_only(name):
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
            assert str(tmp_path / "file") in str(error)
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
    assert again.parameterization == "angles" and [len(x) for x in again.axes.values()][:2] == [19, 19]
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


def test_changed_values_are_written_not_those_of_the_file(tmp_path):
    m = loaded(tmp_path, ALTA)
    alta.write(m.with_brdf(2.0 * m.brdf()), tmp_path / "a")
    assert f(gn.load(tmp_path / "a"), 0.3, 0.0, 0.1, 3.0) == pytest.approx(1.0)


@pytest.mark.parametrize("module", [astm, pab, csv_table, alta], ids=["ASTM", "pab-opto", "CSV", "ALTA"])
def test_light_from_one_azimuth_is_an_isotropic_material(tmp_path, module):
    text = "theta_i,phi_i,theta_o,phi_o,f\n" + "".join(
        f"30,10.1,{t},{p},{(t + p) / 1000}\n" for t in (10, 20) for p in (0, 5, 90.3)
    )
    m = loaded(tmp_path, text)
    assert type(m) is Gridded
    assert not tree.is_oriented(m)
    for turn in (0.0, 1.0):
        at = (30 * DEGREES, 10.1 * DEGREES + turn, 20 * DEGREES, 90.3 * DEGREES + turn)
        assert f(m, *at) == pytest.approx(0.1103)
    module.write(m, tmp_path / "a")
    again = gn.load(tmp_path / "a")
    assert f(again, *at) == pytest.approx(0.1103)
    if module is not alta:  # ISOTROPIC_TV_TL_DPHI does not say it
        assert again.about["phi_i"] == m.about["phi_i"] == 10.1 * DEGREES
        np.testing.assert_array_equal(again.axes["phi"], m.axes["phi"])


def test_docstrings_name_what_was_checked():
    for module in MODULES.values():
        assert re.search(r"Checked\s+against", module.__doc__)
