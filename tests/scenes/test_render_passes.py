"""Passes of pictures: points, the noise that they tell, and going on from a checkpoint after a kill."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from house import WHITE_FACETS

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.scenes.points import DIMENSIONS, points

STUDIO = gn.EnvironmentLight.studio(height=32)
METAL = WHITE_FACETS
SMALL = {"lights": STUDIO, "size": 24}


def test_points_fill_every_dimension():
    """One of the first 2^m, and of each 2^m after them, in each of 2^m intervals of every dimension."""
    for start, stop in ((0, 32), (32, 64), (0, 64), (64, 128), (0, 1024)):
        cells = np.sort((points(start, stop) * (stop - start)).astype(int), axis=0)
        assert (cells == np.arange(stop - start)[:, None]).all()
    np.testing.assert_array_equal(points(40, 50), points(0, 64)[40:50])
    assert points(0, 5).shape == (5, DIMENSIONS)


def test_the_noise_is_about_the_error():
    """Of pictures of 8 passes beside one of 256."""
    truth = gn.render(METAL, samples=8192, seed=9, **SMALL).pixels
    picture = gn.render(METAL, samples=256, **SMALL)
    inside = picture.alpha == 1.0
    told, error = (np.sqrt(np.square(x[inside]).mean()) for x in (picture.error, picture.pixels - truth))
    assert 0.7 < told / error < 3.0
    assert picture.error.shape == picture.pixels.shape and picture.samples == 256
    assert (picture.error[picture.alpha == 0.0] == 0.0).all()


def test_without_spread_there_is_no_noise():
    assert gn.render(METAL, samples=32, **SMALL).error is None
    matt = gn.render(gn.Lambertian(0.5), gn.ConstantLight(1.0), size=16, samples=100)
    assert matt.error.max() < 1e-6 and matt.samples == 100


def test_a_picture_is_done_when_its_noise_is_low_enough():
    def noise(picture):
        inside = picture.alpha > 0.0
        return np.sqrt(np.square(picture.error[inside]).mean()) / picture.pixels[inside].mean()

    calls: list[tuple[int, int]] = []
    picture = gn.render(METAL, tolerance=0.05, progress=lambda *at: calls.append(at), **SMALL)
    assert noise(picture) <= 0.05 and 128 <= picture.samples < 4096
    assert calls[-1][0] == calls[-1][1]
    before = gn.render(METAL, samples=picture.samples - 32, **SMALL)
    assert picture.samples == 128 or noise(before) > 0.05
    np.testing.assert_array_equal(gn.render(METAL, samples=picture.samples, **SMALL).pixels, picture.pixels)
    assert gn.render(METAL, tolerance=1e-9, samples=160, **SMALL).samples == 160
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(ParameterError, match=r"expected a (positive )?number"):
            gn.render(METAL, tolerance=wrong, **SMALL)


def test_a_checkpoint_goes_on(tmp_path):
    file = tmp_path / "picture.npz"
    first = gn.render(METAL, samples=64, checkpoint=file, **SMALL)
    again = gn.render(METAL, samples=64, checkpoint=file, **SMALL)
    np.testing.assert_array_equal(first.pixels, again.pixels)
    more, whole = gn.render(METAL, samples=128, checkpoint=file, **SMALL), gn.render(METAL, samples=128, **SMALL)
    for a, b in ((more.pixels, whole.pixels), (more.error, whole.error), (more.alpha, whole.alpha)):
        np.testing.assert_array_equal(a, b)
    others = ({"seed": 1}, {"size": 25}, {"lights": gn.EnvironmentLight.studio(height=16)})
    for other in others:
        with pytest.raises(ParameterError, match="a checkpoint of another picture"):
            gn.render(METAL, samples=128, checkpoint=file, **{**SMALL, **other})
    with pytest.raises(ParameterError, match="a checkpoint of another picture"):
        gn.render(METAL.replace(alpha=0.31), samples=128, checkpoint=file, **SMALL)
    for damage in (file.read_bytes()[:1000], b"", b"\x00" * 100):
        file.write_bytes(damage)
        with pytest.raises(FormatError, match="not a checkpoint"):
            gn.render(METAL, samples=128, checkpoint=file, **SMALL)
    with pytest.raises(ParameterError, match="FunctionLight is none"):
        light = gn.FunctionLight(lambda w: w[..., 0] * 0.0)
        gn.render(METAL, light, size=8, samples=4, checkpoint=tmp_path / "b.npz")


KILLED = """
import sys
import gonio as gn
studio, metal = gn.EnvironmentLight.studio(height=32), gn.Microfacet(gn.GGX(0.3))
gn.render(metal, studio, size=64, samples=1 << 20, checkpoint=sys.argv[1])
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no signals to kill by")
def test_a_killed_render_goes_on_to_the_same_picture(tmp_path):
    """Killed at any time after the first checkpoint, and continued here for a few passes."""
    file = tmp_path / "picture.npz"
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(file)], env=dict(os.environ))
    limit = time.monotonic() + 120.0
    while not file.exists() and process.poll() is None and time.monotonic() < limit:
        time.sleep(0.01)
    time.sleep(0.2)
    process.kill()
    process.wait()
    with np.load(file) as held:
        taken = int(held["counts"][0])
    assert 32 <= taken < 1 << 20
    found = gn.render(METAL, STUDIO, size=64, samples=taken + 96, checkpoint=file)
    whole = gn.render(METAL, STUDIO, size=64, samples=taken + 96)
    for a, b in ((found.pixels, whole.pixels), (found.error, whole.error), (found.alpha, whole.alpha)):
        np.testing.assert_array_equal(a, b)
