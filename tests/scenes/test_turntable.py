"""Lights that go round, and the moving pictures of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gonio as gn
from gonio.errors import ParameterError

WHITE = gn.Lambertian(1.0)


def test_lights_go_round_once_counterclockwise():
    """The sun is behind the camera, to the right, behind the sphere, to the left."""
    sun = gn.DistantLight([0.0, -1.0, 0.0], math.pi)
    frames = gn.scenes.write_turntable(WHITE, lights=sun, frames=4, size=32)
    means = [frame.pixels[16].reshape(2, 16, -1).mean(axis=(1, 2)) for frame in frames]
    assert means[0][0] == pytest.approx(means[0][1], rel=0.02)
    assert means[1][1] > 5.0 * means[1][0] and means[3][0] > 5.0 * means[3][1]
    assert means[2].max() < 1e-6
    np.testing.assert_array_equal(frames[0].pixels, gn.render(WHITE, gn.TurnedLight(sun, 0.0), size=32).pixels)


def test_the_shape_turns_before_a_camera_that_stays():
    """A card that faces the camera, and has its edge there after a quarter of a turn; a sphere looks as before."""
    light = gn.DistantLight([0.0, -1.0, 0.3], math.pi)
    card = np.array([[x, y, z] for z in (-0.6, 0.6) for y in (0.1, 0.14) for x in (-0.8, 0.8)])
    sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    mesh = gn.scenes.Mesh((card, sides))
    camera = gn.scenes.OrthographicCamera([0.0, -4.0, 0.0], width=2.4)
    frames = gn.scenes.write_turntable(WHITE, None, light, 8, mesh, 48, 4, turns="shape", camera=camera)
    widths = [float((frame.alpha > 0.5).any(axis=0).sum()) for frame in frames]
    assert widths[0] == pytest.approx(32.0, abs=2.0) and widths[1] == pytest.approx(widths[0] * 0.707, abs=2.0)
    assert widths[2] <= 2.0
    level = [frame.pixels[frame.alpha > 0.99].mean() for frame in (frames[0], frames[1])]
    assert level[1] / level[0] == pytest.approx(math.cos(math.pi / 4), rel=1e-3)  # lit at a slant
    column = [np.average(np.arange(48), weights=frame.alpha.sum(axis=0)) for frame in (frames[1], frames[7])]
    assert column[0] < 23.5 < column[1]  # behind the axis: counterclockwise, what is behind goes to the left
    one, other = gn.scenes.write_turntable(
        WHITE, None, gn.SunLight([-1.0, -1.0, 1.0]), 2, size=24, samples=64, turns="shape"
    )
    assert gn.scenes.picture_difference(one, other).rms < 0.02


def test_functions_are_turned_as_formulas_are():
    sky = gn.CIESky(12, [0.5, -0.5, 0.7])
    both = [
        gn.scenes.write_turntable(WHITE, lights=light, frames=3, size=24, samples=128)
        for light in (sky, gn.FunctionLight(sky.incident))
    ]
    for formula, function in zip(*both, strict=True):
        np.testing.assert_allclose(formula.pixels[4:20, 4:20], function.pixels[4:20, 4:20], rtol=0.3, atol=0.02)
        assert formula.pixels.mean() == pytest.approx(function.pixels.mean(), rel=0.01)


@pytest.mark.parametrize("suffix", [".png", ".gif"])
def test_the_file_moves(suffix, tmp_path):
    image = pytest.importorskip("PIL.Image")
    path = tmp_path / f"gold{suffix}"
    frames = gn.scenes.write_turntable(
        gn.material("gold"), path, frames=5, size=24, samples=4, seconds=2.0, exposure=1.0
    )
    with image.open(path) as moving:
        assert (moving.n_frames, moving.size, moving.info["duration"]) == (5, (24, 24), 400.0)
        moving.seek(3)
        codes = np.asarray(moving.convert("RGBA"), dtype=float)
    frames[3].save(tmp_path / "one.png", exposure=1.0)
    with image.open(tmp_path / "one.png") as one:
        expected = np.asarray(one, dtype=float)
    inside = expected[..., 3] == 255.0
    np.testing.assert_allclose(codes[inside], expected[inside], atol=0.0 if suffix == ".png" else 16.0)


def test_bad_calls_are_refused(tmp_path):
    for error, words, arguments in (
        (ParameterError, "expected a name that ends in .png or .gif", {"path": tmp_path / "a.mp4"}),
        (
            ParameterError,
            "choose three, channels=",
            {"path": tmp_path / "a.png", "m": gn.Lambertian([0.1, 0.2, 0.3, 0.4])},
        ),
        (ParameterError, "expected 'lights' or 'shape'", {"turns": "camera"}),
        (ParameterError, "frames", {"frames": 1}),
        (ParameterError, "exposure", {"path": tmp_path / "a.png", "exposure": math.nan}),
    ):
        with pytest.raises(error, match=words):
            gn.scenes.write_turntable(**{"m": WHITE, "size": 16, "samples": 4} | arguments)
    with pytest.raises(ParameterError, match="no formula on components"):
        gn.TurnedLight(gn.FunctionLight(lambda w: w[..., 2]), 1.0)
