"""Axes, filters and states of polarized light, beside Jones vectors: amplitudes by complex numbers."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.errors import NotFoundError, ParameterError, ShapeError
from gonio.polarization import (
    analyser,
    angle,
    coherency,
    dop,
    frames,
    polarizer,
    realizable,
    retarder,
    rotator,
    to_frames,
)

RNG = np.random.default_rng(11)


def stokes(E: np.ndarray) -> np.ndarray:
    """Of Jones vectors (..., 2): U + iV = 2 E_x conj(E_y)."""
    x, y = E[..., 0], E[..., 1]
    cross = 2.0 * x * y.conj()
    return np.stack([abs(x) ** 2 + abs(y) ** 2, abs(x) ** 2 - abs(y) ** 2, cross.real, cross.imag], -1)


def mueller(J: np.ndarray) -> np.ndarray:
    """Of a Jones matrix, from what it does to six states."""
    states = np.array([[1, 0], [0, 1], [1, 1], [1, -1], [1, 1j], [1, -1j]]) / [[1], [1], *[[np.sqrt(2)]] * 4]
    return np.linalg.lstsq(stokes(states), stokes(states @ J.T), rcond=None)[0].T


def directions(n: int) -> tuple[np.ndarray, np.ndarray]:
    theta, phi = RNG.uniform(0.05, 1.5, (2, n)), RNG.uniform(0.0, 6.28, (2, n))
    return gn.direction(theta[0], phi[0]), gn.direction(theta[1], phi[1])


E = RNG.normal(size=(20, 2)) + 1j * RNG.normal(size=(20, 2))


@pytest.mark.parametrize("psi", [0.0, 0.4, -2.0])
def test_filters_do_what_they_do_to_amplitudes(psi):
    c, s = np.cos(psi), np.sin(psi)
    turn = np.array([[c, s], [-s, c]])
    along = np.outer([c, s], [c, s])
    late = turn.T @ np.diag([1.0, np.exp(1j * 0.7)]) @ turn  # exp(-i omega t): late is a positive phase
    np.testing.assert_allclose(stokes(E) @ rotator(psi).T, stokes(E @ turn.T), atol=1e-12)
    np.testing.assert_allclose(stokes(E) @ polarizer(psi).T, stokes(E @ along.T), atol=1e-12)
    np.testing.assert_allclose(stokes(E) @ analyser(psi), stokes(E @ along.T)[:, 0], atol=1e-12)
    np.testing.assert_allclose(stokes(E) @ retarder(0.7, psi).T, stokes(E @ late.T), atol=1e-12)


def test_filters_take_arrays():
    psi = np.linspace(0.0, 1.0, 5)
    assert polarizer(psi).shape == rotator(psi).shape == retarder(0.3, psi).shape == (5, 4, 4)
    assert analyser(psi).shape == (5, 4)


def test_degree_and_angle():
    assert dop(stokes(E)) == pytest.approx(np.ones(20))
    mixed = stokes(E[0]) + stokes(np.array([1.0, 0.5j]))
    assert dop(mixed) < 1.0 and dop(mixed, linear=True) < dop(mixed)
    assert np.isnan(dop([0.0, 0.0, 0.0, 0.0]))
    assert angle(stokes(np.array([np.cos(0.3), np.sin(0.3)]))) == pytest.approx(0.3)


def test_a_jones_matrix_has_one_eigenvalue_and_sums_of_such_can_be():
    jones = RNG.normal(size=(30, 2, 2)) + 1j * RNG.normal(size=(30, 2, 2))
    M = np.array([mueller(J) for J in jones])
    values = coherency(M)
    np.testing.assert_allclose(values[:, 3], M[:, 0, 0], rtol=1e-10)
    assert np.abs(values[:, :3]).max() < 1e-12 * values.max()
    assert realizable(M).all() and realizable(M.reshape(10, 3, 4, 4).sum(1)).all()


def test_what_no_passage_of_light_does_is_not_realizable():
    assert not realizable(np.diag([1.0, 1.0, 1.0, -1.0]))
    assert not realizable(np.diag([1.0, 0.9, 0.9, -0.9]))
    assert not realizable(np.diag([1.0, 1.1, 0.0, 0.0]))
    assert not realizable(np.full((4, 4), np.nan))
    assert realizable(np.zeros((4, 4))) and realizable(np.diag([1.0, 0.3, 0.3, -0.3]))


def test_axes_are_right_handed_about_the_way_of_light():
    w, _ = directions(50)
    for arrives in (False, True):
        x, y = frames(w, arrives)
        np.testing.assert_allclose(np.cross(x, y), -w if arrives else w, atol=1e-12)
        assert np.abs(x[:, 2]).max() == 0.0 and (np.cross(w, x)[:, 2] > 0.0).all()  # horizontal, to increasing azimuth
    x, y = frames([0.0, 0.0, 1.0], arrives=True)
    assert x.tolist() == [0.0, 1.0, 0.0] and y.tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("name", ["facet", "mitsuba", "xyxy"])
def test_axes_and_back(name):
    (wi, wo), M = directions(50), RNG.normal(size=(50, 4, 4))
    there = to_frames(M, wi, wo, name)
    assert np.abs(there - M).max() > 0.1
    np.testing.assert_allclose(to_frames(there, wi, wo, "surface", given=name), M, atol=1e-12)
    np.testing.assert_allclose(to_frames(M[:, None], wi, wo, name)[:, 0], there, atol=1e-15)


def test_axes_of_the_facet_are_across_the_plane_of_both_directions():
    """Amplitudes along s and p of that plane, taken along the axes of the surface by scalar products."""
    wi, wo = directions(30)
    s = np.cross(wi, wo)
    s /= np.linalg.norm(s, axis=-1, keepdims=True)
    jones = RNG.normal(size=(30, 2, 2)) + 1j * RNG.normal(size=(30, 2, 2))  # in the axes of the facet
    turns = []
    for w, arrives in ((wi, True), (wo, False)):
        axes = np.stack(frames(w, arrives), 1)
        facet = np.stack([s, np.cross(-w if arrives else w, s)], 1)
        turns.append(facet @ np.swapaxes(axes, -1, -2))
    surface = np.swapaxes(turns[1], -1, -2) @ jones @ turns[0]
    given, expected = (np.array([mueller(J) for J in Js]) for Js in (jones, surface))
    np.testing.assert_allclose(to_frames(given, wi, wo, "surface", given="facet"), expected, atol=1e-10)


def test_axes_that_keep_their_direction_at_the_normal_are_continuous_there():
    M = RNG.normal(size=(4, 4))
    up, turned = gn.direction(0.0, 0.0), [gn.direction(1e-6, phi) for phi in np.linspace(0.0, 6.0, 7)]
    for w in turned:
        in_surface = to_frames(M, w, up, "surface", given="xyxy")
        assert np.abs(to_frames(in_surface, w, up, "xyxy") - M).max() < 1e-12
        x, y = frames(w, arrives=True)
        phi = np.arctan2(w[1], w[0])
        np.testing.assert_allclose(np.cos(phi) * x - np.sin(phi) * (-y), [0.0, 1.0, 0.0], atol=2e-6)


@pytest.mark.parametrize(
    ("wrong", "error", "words"),
    [
        (lambda: to_frames(np.eye(4), [0, 0, 1], [0, 0, 1], "facets"), NotFoundError, "surface, xyxy, facet"),
        (lambda: to_frames(np.eye(3), [0, 0, 1], [0, 0, 1], "facet"), ShapeError, r"\(\.\.\., 4, 4\)"),
        (lambda: frames([0.0, 1.0]), ShapeError, r"\(\.\.\., 3\)"),
        (lambda: dop([1.0, 0.0, 0.0]), ShapeError, "I, Q, U, V"),
        (lambda: polarizer("up"), ParameterError, "psi"),
    ],
)
def test_errors_say_what_is_expected(wrong, error, words):
    with pytest.raises(error, match=words):
        wrong()
