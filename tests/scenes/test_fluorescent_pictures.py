"""Pictures of what fluoresces: every wavelength that arrives takes part, under each light with its own spectrum."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.errors import ParameterError, ShapeError
from gonio.pictures.colour import daylight, light_to_rgb, to_rgb

D = np.array([[0.2, 0.0, 0.0], [0.45, 0.6, 0.0], [0.1, 0.15, 0.7]])
NM = np.array([450.0, 550.0, 650.0])
INK = gn.Donaldson(D, wavelengths=NM)
LAMP = gn.ConstantLight(gn.Spectrum(NM, [4.0, 1.0, 1.0]))
MIDDLE = (4, 4)


def middle(m, lights, **options):
    return gn.render(m, lights, size=8, samples=16, **options).pixels[MIDDLE]


def test_light_without_a_spectrum_is_daylight():
    E = daylight(NM)
    expected = (D @ E / E) @ to_rgb(NM)
    np.testing.assert_allclose(middle(INK, gn.ConstantLight(1.0)), expected, rtol=1e-4)
    np.testing.assert_allclose(middle(INK, gn.FunctionLight(lambda w: 0.0 * w[..., 2] + 1.0)), expected, rtol=1e-4)
    rgb = [2.0, 1.0, 0.5]
    np.testing.assert_allclose(middle(INK, gn.ConstantLight(rgb)), expected * rgb, rtol=1e-4)


def test_daylight_is_that_of_the_standard():
    np.testing.assert_allclose(
        daylight([290.0, 300.0, 330.0, 355.0, 560.0]), [0.0, 0.0341, 37.0535, 45.775, 100.0], rtol=1e-5
    )


def test_a_lamp_has_its_spectrum():
    expected = (D @ [4.0, 1.0, 1.0]) @ light_to_rgb(NM)
    np.testing.assert_allclose(middle(INK, LAMP), expected, rtol=1e-4)
    shown = gn.render(INK, LAMP, size=8, samples=4, backdrop=True).pixels[0, 0]
    np.testing.assert_allclose(shown, [4.0, 1.0, 1.0] @ light_to_rgb(NM), rtol=1e-4)  # seen once, and not by the ink


def test_every_light_has_its_own_spectrum():
    red = gn.DistantLight([0.0, -1.0, 0.0], gn.Spectrum(NM, [0.0, 0.0, np.pi]))
    np.testing.assert_allclose(middle(INK, [LAMP, red]), middle(INK, LAMP) + middle(INK, red), rtol=1e-3)
    np.testing.assert_allclose(middle(INK, red), middle(gn.Lambertian(np.diagonal(D), wavelengths=NM), red), rtol=1e-4)


def test_channels_that_are_no_colours_come_from_the_bands_of_the_light():
    m = gn.Donaldson(D)
    picture = np.linspace(0.5, 1.5, 96).reshape(4, 8, 3)
    seen = middle(m, gn.EnvironmentLight(picture))
    white = middle(gn.Lambertian(np.ones(3)), gn.EnvironmentLight(picture))
    np.testing.assert_allclose(seen, D @ white, rtol=0.03)


def test_beside_others_in_a_scene():
    left = gn.scenes.Mesh(([[-2, 0, -1], [0, 0, -1], [0, 0, 1], [-2, 0, 1]], [[0, 1, 2, 3]]), INK)
    right = gn.scenes.Mesh(
        ([[0, 0, -1], [2, 0, -1], [2, 0, 1], [0, 0, 1]], [[0, 1, 2, 3]]), gn.Lambertian(np.full(3, 0.5), wavelengths=NM)
    )
    picture = gn.render(gn.Scene([left, right]), LAMP, size=8, samples=4).pixels
    np.testing.assert_allclose(picture[4, 1], (D @ [4.0, 1.0, 1.0]) @ light_to_rgb(NM), rtol=1e-3)


def test_a_checkpoint_knows_the_matrix(tmp_path):
    file = tmp_path / "sums"
    gn.render(INK, LAMP, size=8, samples=4, checkpoint=file)
    other = INK.replace(matrix=D + np.eye(3, k=-1) * 0.01)
    with pytest.raises(ParameterError, match="another"):
        gn.render(other, LAMP, size=8, samples=4, checkpoint=file)


def test_calls_that_draw_f_alone_refuse():
    for call in (
        lambda: gn.scenes.render_stokes(INK, LAMP, size=8, samples=1),
        lambda: gn.scenes.picture_jacobian(INK, LAMP, by=[], size=8, samples=1),
    ):
        with pytest.raises(ParameterError, match=r"fluoresces.*m\.under\(E\)"):
            call()


def test_a_map_of_matrices_names_the_way():
    m = gn.Donaldson(D * np.ones((2, 2, 1, 1)), wavelengths=NM)
    with pytest.raises(ShapeError, match=r"matrix is a map of shape \(2, 2\).*m.replace"):
        gn.render(m, LAMP, size=8, samples=1)
