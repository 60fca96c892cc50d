"""pab-opto: rows, colours, several incident directions, headers, damage."""

import math

import numpy as np
import pytest
from format_cases import f, loaded
from text_files import PAB

import gonio as gn
from gonio.formats import pab

# pab-opto


DEGREES = math.pi / 180.0


def test_pab_rows(tmp_path):
    m = loaded(tmp_path, PAB)
    assert m.quantity == "brdf * cos(theta_o)"
    assert m.about["sample_name"] == '"tile"'
    assert m.about["upphi"] == "90"
    assert f(m, 30 * DEGREES, 0.0, 60 * DEGREES, math.pi) == pytest.approx(0.4 / 0.5)
    assert f(m, 30 * DEGREES, 0.0, 0.0, 0.0) == pytest.approx(0.25)
    m = loaded(tmp_path, PAB.replace("DSF", "BSDF"))
    assert f(m, 30 * DEGREES, 0.0, 60 * DEGREES, math.pi) == pytest.approx(0.4)


def test_pab_colours(tmp_path):
    text = "#intheta 30\n#inphi 10\n#colorimetry: CIE-XYZ\n#format: theta phi BRDF\n20 190 1 2 3\n30 190 4 5 6\n"
    m = loaded(tmp_path, text)
    assert m.channel_names == ("X", "Y", "Z")
    np.testing.assert_allclose(f(m, 30 * DEGREES, 10 * DEGREES, 30 * DEGREES, 190 * DEGREES), [4, 5, 6])
    pab.write(m, tmp_path / "a")
    assert "#colorimetry: CIE-XYZ\n" in (tmp_path / "a").read_text()
    assert gn.load(tmp_path / "a") == m
    with pytest.raises(gn.errors.ParameterError, match="expected one or X, Y, Z"):
        pab.write(gn.Lambertian([0.1, 0.2, 0.3]), tmp_path / "b", incident=(0.1, 0.0))


def test_pab_of_several_incident_directions(tmp_path):
    m = gn.Microfacet(gn.GGX(0.5), 0.9)
    paths = [tmp_path / f"{degrees}.txt" for degrees in (0, 30, 60)]
    for path in paths:
        pab.write(m, path, incident=(float(path.stem) * DEGREES, 0.0), resolution=(1, 18, 36))
    together = pab.read(paths[0], more=paths[1:])
    assert [len(x) for x in together.axes.values()] == [3, 18, 36]
    assert together.is_mirrored is False
    wo = gn.direction(0.5, 2.0)
    assert together.f(gn.direction(30 * DEGREES, 0.0), wo) == pytest.approx(
        m.f(gn.direction(30 * DEGREES, 0.0), wo), rel=0.02
    )
    with pytest.raises(gn.errors.ParameterError, match="has 3 incident directions there, expected one"):
        pab.write(together, tmp_path / "a")
    pab.write(together, tmp_path / "a", incident=(30 * DEGREES, 0.0))
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
