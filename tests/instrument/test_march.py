"""Rays over height fields: against every triangle tried in turn, and against grooves worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

import gonio as gn
from gonio.arrays import ops
from gonio.arrays.kinds import SCALAR, VECTOR
from gonio.evaluate.computation import Computation, composite
from gonio.formula.direction import Direction
from gonio.instrument.march import FAR, NEAR, SECTORS, RayPlace, march, tables


def _walk(scene, mean, spot, inside, w):
    place, right, met, left = march(scene, RayPlace(spot[0], spot[1], inside[0], inside[1], spot[2]), Direction(*w))
    hit = ops.where(met, 1.0, ops.where(left, 0.0, -1.0))
    return (place.column, place.row, place.z), (place.u, place.v, right), hit


WALK = Computation(_walk, {"spot": 3, "inside": 3, "w": 3}, {"spot": VECTOR, "inside": VECTOR, "hit": SCALAR})


def first_crossing(surface, origin, w, turns):
    """The nearest way to any triangle of the surface and of its copies, one by one; inf where there is none."""
    h = surface.heights.astype(float)
    rows, columns = h.shape
    dx, dy = surface.cell
    i, j = (x.ravel() for x in np.mgrid[-turns * rows : (turns + 1) * rows, -turns * columns : (turns + 1) * columns])
    best = np.inf

    def corner(a, b):
        return h[(i + b) % rows, (j + a) % columns]

    for slopes, side in (
        ((corner(1, 0) - corner(0, 0), corner(1, 1) - corner(1, 0)), 1.0),
        ((corner(1, 1) - corner(0, 1), corner(0, 1) - corner(0, 0)), -1.0),
    ):
        rate = w[2] - w[0] / dx * slopes[0] - w[1] / dy * slopes[1]
        above = origin[2] - corner(0, 0) - slopes[0] * (origin[0] / dx - j) - slopes[1] * (origin[1] / dy - i)
        with np.errstate(divide="ignore", invalid="ignore"):
            way = -above / rate
            u, v = (origin[0] + way * w[0]) / dx - j, (origin[1] + way * w[1]) / dy - i
        inside = (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1) & (side * (u - v) >= 0) & (way > 1e-9) & (rate < 0)
        if inside.any():
            best = min(best, way[inside].min())
    return best


@pytest.mark.parametrize("shape, cell", [((8, 8), (1.0, 1.0)), ((13, 10), (0.7, 1.3)), ((1, 2), (1.0, 1.0))])
def test_rays_meet_the_nearest_triangle(shape, cell):
    rng = np.random.default_rng(5)
    surface = gn.surfaces.HeightField(rng.normal(size=shape), cell)
    theta, phi = rng.uniform(0.6 * np.pi, 0.95 * np.pi, 60), rng.uniform(0.0, 2.0 * np.pi, 60)
    w = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    at = rng.uniform(size=(60, 2))
    place = at * np.array(shape[::-1])
    scale = 1.0 / np.sqrt(cell[0] * cell[1])
    top = float(surface.heights.max())
    spot = np.column_stack([np.floor(place), np.full(60, top * scale)])
    inside = np.column_stack([place - np.floor(place), np.zeros(60)])
    found = WALK(composite(**tables(surface)), spot=spot, inside=inside, w=w)
    expected = np.array([first_crossing(surface, (*(p * cell), top), d, 6) for p, d in zip(place, w, strict=True)])
    assert np.isfinite(expected).all()
    way = (found["spot"][:, 2] / scale - top) / w[:, 2]
    np.testing.assert_allclose(way, expected, rtol=1e-4, atol=1e-5)
    assert (found["hit"] == 1.0).all()


def test_rays_from_facets_leave_or_meet_another_one():
    """Up from the bottom of grooves: the way out, and the other side, by hand."""
    surface = gn.surfaces.v_grooves(1.0)
    low = float(surface.heights.min())
    elevation = np.radians([89.0, 60.0, 46.0, 44.0, 20.0])
    w = np.stack([-np.cos(elevation), 0.0 * elevation, np.sin(elevation)], -1)
    spot, inside = np.tile([0.0, 0.0, low + 0.25], (5, 1)), np.tile([0.25, 0.5, 0.0], (5, 1))
    found = WALK(composite(**tables(surface)), spot=spot, inside=inside, w=w)
    # From x = 1/4, z = 1/4 to the crest at x = -1, z = 1: an elevation of arctan(3/5) = 31 degrees.
    np.testing.assert_array_equal(found["hit"], [0.0, 0.0, 0.0, 0.0, 1.0])
    # On the other side z = -x: 1/4 + t (1/4 - x) = -x.
    t = np.tan(elevation[-1])
    np.testing.assert_allclose(found["spot"][-1, 2] - low, (0.25 + 0.25 * t) / (1.0 - t), rtol=1e-5)


def test_no_ray_falls_through():
    """Many rays, shallow ones too, over random spikes: all of them meet the surface, and are on it then."""
    rng = np.random.default_rng(11)
    surface = gn.surfaces.HeightField(rng.normal(size=(37, 29)))
    count = 1 << 17
    theta, phi = np.arccos(-rng.uniform(0.02, 1.0, count)), rng.uniform(0.0, 2.0 * np.pi, count)
    w = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).astype(np.float32)
    cells = np.column_stack([rng.integers(29, size=count), rng.integers(37, size=count)])
    spot = np.column_stack([cells, np.full(count, surface.heights.max())]).astype(np.float32)
    inside = np.column_stack([rng.uniform(size=(count, 2)), np.zeros(count)]).astype(np.float32)
    found = WALK(composite(**tables(surface)), spot=spot, inside=inside, w=w)
    assert (found["hit"] == 1.0).all()
    h = surface.heights
    j, i = found["spot"][:, 0].astype(int), found["spot"][:, 1].astype(int)
    u, v, right = found["inside"].T
    h00, h10, h01, h11 = h[i, j], h[i, (j + 1) % 29], h[(i + 1) % 37, j], h[(i + 1) % 37, (j + 1) % 29]
    height = np.where(right > 0.5, h00 + (h10 - h00) * u + (h11 - h10) * v, h00 + (h11 - h01) * u + (h01 - h00) * v)
    assert np.abs(height - found["spot"][:, 2]).max() < 1e-4


@pytest.mark.parametrize("shape, cell", [((37, 29), (0.7, 1.3)), ((1, 2), (1.0, 1.0)), ((16, 32), (1.0, 1.0))])
def test_bounds_of_blocks_hold(shape, cell):
    """No corner is higher and no triangle steeper, along any direction of a sector, than its block says."""
    rng = np.random.default_rng(7)
    surface = gn.surfaces.HeightField(rng.normal(size=shape), cell)
    held = tables(surface)
    grades = np.asarray(held["blocks"].numbers).astype(int).reshape(SECTORS, -1, int(held["across"]))
    steepest, summit, around = (grades // 256**k % 256 for k in (2, 1, 0))
    h = np.asarray(surface.heights, float) / np.sqrt(cell[0] * cell[1])
    rows, columns = np.arange(grades.shape[1] * NEAR), np.arange(grades.shape[2] * NEAR)

    def corner(down, right):
        return h[np.ix_((rows + down) % shape[0], (columns + right) % shape[1])]

    h00, h10, h01, h11 = corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)
    top = np.maximum.reduce([h00, h10, h01, h11])
    triangles = [(h10 - h00, h11 - h10), (h11 - h01, h01 - h00)]
    for sector in range(SECTORS):
        directions = 2.0 * np.pi / SECTORS * (sector + np.linspace(0.0, 1.0, 7))
        slopes = [
            np.cos(a) * x * held["per_x"] + np.sin(a) * y * held["per_y"] for a in directions for x, y in triangles
        ]
        for values, bound, low, step, size in (
            (np.maximum.reduce(slopes), steepest[sector], held["gentle"], held["slope_step"], NEAR),
            (top, summit[sector], held["low"], held["high_step"], NEAR),
            (top, around[sector], held["low"], held["high_step"], FAR),
        ):
            blocks = values.reshape(len(rows) // size, size, len(columns) // size, size).max((1, 3))
            stated = low + step * bound[:: size // NEAR, :: size // NEAR]
            assert (stated >= blocks).all()
            if values is top:
                assert (stated <= blocks + 1.01 * step).all()
            else:  # only the sides of a sector are known
                assert (stated <= np.maximum(blocks, blocks / np.cos(np.pi / SECTORS)) + 1.01 * step).all()
    assert held["steepest"] == pytest.approx(held["gentle"] + held["slope_step"] * steepest.max(), rel=1e-12)


def test_a_ray_goes_on_where_it_was_left():
    """Few steps at a time come to the same triangles as all at once."""
    rng = np.random.default_rng(3)
    surface = gn.surfaces.gaussian(0.8, size=64)
    count = 4096
    theta, phi = np.arccos(rng.uniform(-0.9, 0.3, count)), rng.uniform(0.0, 2.0 * np.pi, count)
    w = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).astype(np.float32)
    held = tables(surface)
    spot = np.column_stack([rng.integers(64, size=(count, 2)), np.full(count, held["highest"])]).astype(np.float32)
    inside = np.column_stack([rng.uniform(size=(count, 2)), np.zeros(count)]).astype(np.float32)
    whole = WALK(composite(**held), spot=spot, inside=inside, w=w)
    few = composite(**{**held, "steps": 2.0})
    for _ in range(2000):
        found = WALK(few, spot=spot, inside=inside, w=w)
        going = found["hit"] < 0.0
        spot, inside = (
            np.where(going[:, None], found[name], old) for name, old in (("spot", spot), ("inside", inside))
        )
        if not going.any():
            break
    np.testing.assert_array_equal(found["hit"], whole["hit"])
    met = whole["hit"] == 1.0
    assert 0.5 < met.mean() < 1.0
    place = [x["spot"][met, :2] + x["inside"][met, :2] for x in (found, whole)]
    apart = np.abs(place[0] - place[1])
    assert np.quantile(np.minimum(apart, 64.0 - apart), 0.999) < 1e-3
