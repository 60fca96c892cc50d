"""Neural-BRDF: the network by hand, real files, writing, damage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from binary_files import halved, random_network
from format_cases import GRAY, claimed, directions, file_of
from libraries import switch_off
from places import real

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.formats import load, neural, save

# Neural-BRDF.

NETWORKS = ("gold-metallic-paint", "pink-felt", "yellow-plastic")


def network(name):
    return neural.read(real(f"nbrdf/{name}.h5"))


def forward(m, wi, wo):
    theta_h, theta_d, phi_d = halved(wi, wo)
    s = math.sin(theta_d)
    x = np.array(
        [math.sin(theta_h), 0.0, math.cos(theta_h), s * math.cos(phi_d), s * math.sin(phi_d), math.cos(theta_d)]
    )
    for k in (1, 2):
        x = np.maximum(x @ getattr(m, f"kernel_{k}") + getattr(m, f"bias_{k}"), 0.0)
    return np.exp(x @ m.kernel_3 + m.bias_3) - 1.0


@pytest.mark.parametrize("evaluation", ["uncompiled", pytest.param("compiled", marks=pytest.mark.full)], indirect=True)
def test_neural_is_the_network(evaluation):
    m = random_network()
    wi, wo = directions(100, 1), directions(100, 2)
    expected = [forward(m, a, b) for a, b in zip(wi, wo, strict=True)]
    np.testing.assert_allclose(m.f(wi, wo), expected, rtol=1e-9, atol=1e-12)


def test_neural_on_every_library(library):
    """Matrix products of the libraries that have them; with channels one by one (Dr.Jit), too."""
    m, wi, wo = random_network(), directions(20, 1), directions(20, 2)
    expected = [forward(m, a, b) for a, b in zip(wi, wo, strict=True)]
    found = library.numpy(library.whole(m.f)(library.array(wi), library.array(wo)))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", NETWORKS)
def test_neural_real_files_are_like_published_fits_of_the_same_materials(name, monkeypatch):
    switch_off(monkeypatch)  # the kernel of a network takes longer to compile than all this to compute
    m = network(name)
    w = gn.direction(np.radians([5.0, 30.0, 60.0]), 0.0)
    np.testing.assert_allclose(gn.albedo(m, w), gn.albedo(gn.material(name), w), atol=0.035)


def test_neural_writes(tmp_path):
    m, path = random_network(), tmp_path / "copy.h5"
    save(m, path)
    assert load(path) == m
    assert claimed(path)[0] == "Neural-BRDF"  # before netCDF, which takes all of HDF5
    with pytest.raises(ParameterError, match="not fitted"):
        save(GRAY, path)


def test_neural_damage(tmp_path):
    import h5py

    path = tmp_path / "copy.h5"
    save(random_network(), path)
    data = path.read_bytes()
    for size in (100, 3000, len(data) - 5000):
        with pytest.raises(FormatError):
            neural.read(file_of(tmp_path, data[:size]))
    for k, shape in ((1, (7, 21)), (3, (21, 4))):
        save(random_network(), path)
        with h5py.File(path, "a") as file:
            del file[f"dense_{k}/dense_{k}/kernel:0"]
            file[f"dense_{k}/dense_{k}/kernel:0"] = np.zeros(shape, "f4")
        with pytest.raises(FormatError, match="expected floats of shape"):
            load(path)
    save(random_network(), path)
    with h5py.File(path, "a") as file:
        del file["dense_2/dense_2/bias:0"]
        file["dense_2/dense_2/bias:0"] = h5py.ExternalLink("/etc/passwd", "/")
    with pytest.raises(FormatError, match="in another file"):
        load(path)
    with pytest.raises(ParameterError, match="layer 2"):
        neural.Neural([np.zeros(s) for s in ((6, 21), (21, 20), (21, 3))], [np.zeros(s[1:]) for s in neural.SHAPES])
