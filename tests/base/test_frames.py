"""Frames and constructions on directions, on every array library, against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.errors import DirectionError, ShapeError

RNG = np.random.default_rng(2)


def unit(*shape):
    return gn.directions.normalize(RNG.normal(size=(*shape, 3)))


W, N, T = unit(40), unit(40), unit(40)
WI, WO = (gn.direction(np.arccos(RNG.random(40)), 6.0 * RNG.random(40)) for _ in range(2))


def through(library, function, *arrays, **more):
    """Results as NumPy arrays of a function of arrays of a library."""
    results = function(*(library.array(x) for x in arrays), **more)
    return [library.numpy(r) for r in results] if isinstance(results, tuple) else library.numpy(results)


def test_local_and_world_are_inverse_and_keep_lengths_and_angles(library):
    local = through(library, gn.directions.to_local, W, N, T)
    np.testing.assert_allclose(through(library, gn.directions.to_world, local, N, T), W, atol=1e-14)
    np.testing.assert_allclose(local[:, 2], (W * N).sum(-1), atol=1e-14)
    assert np.abs(through(library, gn.directions.to_local, T, N, T)[:, 1]).max() < 1e-14


def test_without_a_tangent_the_frame_turns_x_with_the_normal(library):
    np.testing.assert_allclose(through(library, gn.directions.to_local, W, N), gn.directions.to_local(W, N), atol=1e-14)
    axis = np.cross([0.0, 0.0, 1.0], N)
    up = N[:, 2] > 0.0  # about the axis that turns z into n, x turns into d_x
    x = gn.directions.to_world([1.0, 0.0, 0.0], N)
    np.testing.assert_allclose((x * axis).sum(-1)[up], axis[up, 0], atol=1e-14)


def test_reflect_is_the_mirror_image(library):
    mirrored = through(library, gn.directions.reflect, WI, N)
    np.testing.assert_allclose((mirrored * N).sum(-1), (WI * N).sum(-1), atol=1e-14)
    np.testing.assert_allclose(np.cross(mirrored, N), -np.cross(WI, N), atol=1e-14)


def test_refract_obeys_snell_from_both_sides(library):
    eta = 1.5
    t = through(library, gn.directions.refract, WI, N, eta=eta)
    cos = (WI * N).sum(-1)
    relative = np.where(cos > 0.0, eta, 1.0 / eta)
    lost = (1.0 - cos**2) > relative**2
    bent = np.cross(t, N) * relative[:, None]
    np.testing.assert_allclose(bent[~lost], -np.cross(WI, N)[~lost], atol=1e-13)
    assert lost.any() and np.isnan(t).any(-1).tolist() == lost.tolist()
    assert (np.sign((t * N).sum(-1))[~lost] == -np.sign(cos)[~lost]).all()
    np.testing.assert_allclose(np.linalg.norm(t[~lost], axis=-1), 1.0, atol=1e-13)


def test_half_difference_angles_are_rusinkiewicz_and_return(library):
    a = gn.directions.half_difference(*(library.array(w) for w in (WI, WO)))
    half = gn.directions.normalize(WI + WO)
    theta, phi = gn.angles(half)
    np.testing.assert_allclose(library.numpy(a.theta_h), theta, atol=1e-12)
    np.testing.assert_allclose(np.cos(library.numpy(a.phi_h)), np.cos(phi), atol=1e-12)
    np.testing.assert_allclose(library.numpy(a.theta_d), np.arccos((WI * half).sum(-1)), atol=1e-7)
    back = gn.directions.from_half_difference(*a)
    for w, again in zip((WI, WO), back, strict=True):
        np.testing.assert_allclose(library.numpy(again), w, atol=1e-13)


def test_a_direction_in_degrees_is_that_in_radians(library):
    theta, phi = np.degrees(np.arccos(RNG.random(9))), np.linspace(-360.0, 360.0, 9)
    w = through(library, gn.direction, theta, phi, degrees=True)
    np.testing.assert_allclose(w, gn.direction(np.radians(theta), np.radians(phi)), atol=1e-14)
    if "drjit" not in library.name:  # whose values are not known before they are computed
        with pytest.raises(DirectionError, match="in degrees"):
            gn.direction(library.array(theta), library.array(phi))


def test_lists_join_the_arrays_of_a_library(library):
    if library.name == "drjit-array":
        pytest.skip("Array3f holds batches (N, 3) only")
    given = library.array(W)
    assert type(gn.directions.to_local(given, [0.0, 3.0, 4.0])) is type(given)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: gn.directions.normalize([0.0, 0.0, 0.0]), "length 0"),
        (lambda: gn.directions.to_local(W, [0.0, 0.0, 0.0]), "normal: a vector of length 0"),
        (lambda: gn.directions.to_world(W, [0.0, 0.0, 1.0], [0.0, 0.0, 2.0]), "parallel to the normal"),
    ],
)
def test_what_has_no_direction_is_refused(call, words):
    with pytest.raises(DirectionError, match=words):
        call()


def test_vectors_have_three_components():
    with pytest.raises(ShapeError, match=r"wm: got shape \(2,\)"):
        gn.directions.reflect([0.0, 0.0, 1.0], [0.0, 1.0])
