"""Laws of all lights: sampling, irradiance in closed form, array libraries, derivatives, and what is refused."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.arrays import ops
from gonio.authoring import Direction, Light, param
from gonio.base.one_channel import of_channel
from gonio.catalogue.expressions import read
from gonio.errors import ParameterError
from gonio.formula import tree
from gonio.lights._photometry import Photometry
from gonio.numerics.lattice import lattice
from gonio.pictures.colour import XYZ_OF_RGB

HERE, NORMAL = np.array([0.05, -0.1, -0.2]), np.array([0.3, -0.1, 0.9]) / math.sqrt(0.91)

PIXELS = np.random.default_rng(1).random((8, 16, 3)) + 0.1

LAMP = Photometry(
    "C",
    np.array([0.0, 20.0, 50.0, 90.0]),
    np.array([0.0, 60.0, 200.0, 360.0]),
    np.array([[90.0, 70.0, 30.0, 5.0], [90.0, 80.0, 20.0, 2.0], [90.0, 60.0, 40.0, 9.0], [90.0, 70.0, 30.0, 5.0]]),
    (np.array([0.0, 90.0]), np.array([1.0, 0.8])),
    1000.0,
)

EXAMPLES: dict[str, Any] = {
    "constant": gn.ConstantLight([1.0, 2.0, 0.5]),
    "distant": gn.DistantLight([0.3, 0.2, 1.0], [1.0, 2.0]),
    "point": gn.PointLight([0.5, 0.4, 1.0], [1.0, 2.0]),
    "spot": gn.SpotLight([0.5, 0.4, 1.0], [-0.3, -0.3, -1.0], [1.0, 2.0], inner=0.05, outer=0.4),
    "luminaire": gn.GoniometricLight(
        LAMP, [0.5, 0.4, 1.0], [-0.3, -0.3, -1.0], [1.0, 0.2, 0.0], efficacy=[100.0, 200.0]
    ),
    "environment": gn.EnvironmentLight(PIXELS, scale=[1.0, 2.0, 0.5]),
    "gray environment": gn.EnvironmentLight(PIXELS[..., 0]),
    "sun": gn.SunLight([0.3, 0.2, 1.0], [1.0, 2.0]),
    "wide sun": gn.SunLight([1.0, 0.2, 0.1], radius=0.4),
    "CIE sky": gn.CIESky(12, [0.5, 0.2, 0.7], [1.0, 2.0]),
    "clear sky": gn.PreethamSky(2.5, [0.5, 0.2, 0.7]),
    "rectangle": gn.RectangleLight([0.3, 0.2, 1.0], [1.0, 0.0, 0.0], [0.0, -0.6, 0.0], [2.0, 1.0]),
    "far rectangle": gn.RectangleLight([3.0, 2.0, 9.0], [0.0, 1.0, 0.0], [0.6, 0.0, 0.0], 2.0),
    "low rectangle": gn.RectangleLight([1.0, 0.1, -0.1], [0.0, 0.0, 1.0], [0.0, 2.0, 0.0], 2.0, "both"),
    "sphere": gn.SphereLight([0.5, 0.2, 1.0], 0.4, [2.0, 1.0]),
    "low sphere": gn.SphereLight([1.5, 0.2, -0.5], 0.6, 2.0),
    "disk": gn.DiskLight([0.5, 0.2, 1.0], [0.1, 0.0, -1.0], 0.4, [2.0, 1.0]),
    "low disk": gn.DiskLight([1.0, 0.2, -0.3], [-1.0, 0.0, 0.2], 0.8, 2.0),
    "polygon": gn.PolygonLight([[0, 0, 1], [0, 1, 1], [1, 1.2, 1], [1, 0, 1]], [2.0, 1.0]),
    "far triangle": gn.PolygonLight([[0, 0, 9], [0, 1, 9], [1, 1.2, 9]], 2.0),
    "turned disk": gn.TurnedLight(gn.DiskLight([0.5, 0.2, 1.0], [0.1, 0.0, -1.0], 0.4, [2.0, 1.0]), 0.7),
    "turned environment": gn.TurnedLight(gn.EnvironmentLight(PIXELS), -2.0),
    "turned point": gn.TurnedLight(gn.PointLight([0.5, 0.4, 1.0], [1.0, 2.0]), 0.7),
    "mesh": gn.MeshLight(([[0, 0, 1], [0, 1, 1.1], [1, 1.2, 1], [1, 0, 1.2]], [[0, 1, 2], [0, 2, 3]]), [2.0, 1.0]),
    "low triangle": gn.PolygonLight([[1, 1, 0.5], [1, -1, 0.5], [1, 0, -1]], 2.0, "both"),
}
"""Positions differ between lights and the axes: an error in one component shows."""

DELTA = [name for name, light in EXAMPLES.items() if light.is_delta]
EXTENDED = [name for name in EXAMPLES if name not in DELTA]
PIXELLED = {"environment", "gray environment", "CIE sky", "clear sky", "turned environment"}
SINGLE = ("environment", "wide sun", "rectangle", "sphere", "disk", "polygon")
CLOSED = [name for name in EXAMPLES if name not in PIXELLED]


def test_all_lights_are_tested():
    classes = {name for name, kind in gn.lights().items() if kind.__module__.startswith("gonio.")}
    assert {type(light).__name__ for light in EXAMPLES.values()} | {"FunctionLight"} == classes


@pytest.mark.parametrize("name", EXTENDED)
def test_the_density_is_that_of_the_warp(name):
    """pdf |dw/du| = 1, and `pdf` says what `sample` says."""
    light, u = EXAMPLES[name], np.random.default_rng(3).random((2000, 2))
    w, pdf = light.sample(u, HERE)
    np.testing.assert_allclose(np.linalg.norm(w, axis=-1), 1.0, rtol=1e-13)
    np.testing.assert_allclose(light.pdf(w, HERE), pdf, rtol=1e-7)
    step = 1e-6
    moved = [[light.sample(u + s * k, HERE) for s in (step, -step)] for k in np.eye(2)]
    area = np.linalg.norm(np.cross(*((a[0] - b[0]) / (2.0 * step) for a, b in moved)), axis=-1)
    # Steps that stay within a pixel, and a triangle, of which a polygon has several: their maps have kinks.
    whole = np.all([np.abs(x[1] / pdf - 1.0) < 1e-3 for pair in moved for x in pair], axis=0)
    right = np.abs(area * pdf - 1.0) < 2e-4
    assert whole.mean() > 0.99
    assert right[whole].mean() > 0.995


@pytest.mark.parametrize("name", EXTENDED)
def test_no_light_comes_from_where_nothing_is_drawn(name):
    light = EXAMPLES[name]
    w, _ = light.sample(lattice(4000), HERE)
    near = w[:200, None] + 0.05 * np.random.default_rng(1).normal(size=(50, 3))
    near /= np.linalg.norm(near, axis=-1, keepdims=True)
    lit = light.incident(near, HERE).max(axis=-1) > 0.0
    assert lit.any()
    assert (light.pdf(near, HERE)[lit] > 0.0).all()
    assert (light.incident(w, HERE).max(axis=-1) > 0.0).all()
    assert (light.distance(w, HERE) > 0.0).all()


@pytest.mark.parametrize(
    ("name", "dtype"),
    thinned(
        product(EXTENDED, (np.float64, np.float32)), {*product(EXTENDED, [np.float64]), *product(SINGLE, [np.float32])}
    ),
)
def test_samples_give_the_irradiance(name, dtype):
    """... in closed form, or where there is none that of directions spread evenly."""
    light = EXAMPLES[name]
    place, normal = HERE.astype(dtype), NORMAL.astype(dtype)
    w, pdf = light.sample(lattice(1 << 15).astype(dtype), place)
    assert w.dtype == pdf.dtype == dtype
    found = (light.incident(w, place) * (np.maximum(w @ normal, 0.0) / pdf)[:, None]).mean(axis=0)
    if name in CLOSED:
        expected = light.irradiance_at(place, normal)
    else:
        assert light.irradiance_at(place, normal) is None
        u = lattice(1 << 17)
        s = 2.0 * np.sqrt(u[:, 1] * (1.0 - u[:, 1]))
        w = np.stack([s * np.cos(2 * np.pi * u[:, 0]), s * np.sin(2 * np.pi * u[:, 0]), 1.0 - 2.0 * u[:, 1]], -1)
        expected = (light.incident(w) * np.maximum(w @ NORMAL, 0.0)[:, None]).mean(axis=0) * 4.0 * np.pi
    np.testing.assert_allclose(found, expected, rtol=2e-3)


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_light_that_is_moved_says_there_what_it_said_here(name):
    light, by = EXAMPLES[name], np.array([3.0, -5.0, 2.0])
    moved = light.moved(by.tolist())
    if light.is_delta:
        pairs = zip(moved.arrival(HERE + by), light.arrival(HERE), strict=True)
    else:
        u = np.random.default_rng(0).random((20, 2))
        (w, density), there = light.sample(u, HERE), HERE + by
        pairs = zip(
            (*moved.sample(u, there), moved.incident(w, there), moved.distance(w, there)),
            (w, density, light.incident(w, HERE), light.distance(w, HERE)),
            strict=True,
        )
    for found, wanted in pairs:
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-12)


def lamp():
    """A light whose place is a number, no vector, and that answers every question that a light may be asked."""

    class Lamp(Light):
        """A lamp at a height."""

        height = param(2.0, 0.0, 10.0, "height", unit="m")
        can_sample = True

        def seen(self, p, w):
            distance = self.height - p.z
            return ops.where(w.z > 0.5, 1.0 / distance, 0.0), distance

        def warp(self, p, u0, u1):
            z, phi = 1.0 - 0.5 * u0, 2.0 * np.pi * u1 + self.height - p.z
            r = ops.sqrt(1.0 - z * z)
            return Direction(r * ops.cos(phi), r * ops.sin(phi), z)

        def density(self, p, w):
            return ops.where(w.z > 0.5, 1.0 / np.pi, 0.0)

        def irradiance_on(self, p, n):
            return n.z / (self.height - p.z)

        def strength(self, p):
            return 1.0 / (self.height - p.z)

        def holds(self, p):
            return p.z > self.height

    return Lamp(2.0)


def test_a_light_that_is_moved_or_turned_answers_as_that_light():
    """Moved by a number that is no vector it forgot its closed form, its strength, and where nobody may be."""
    light, by = lamp(), (3.0, -5.0, 1.0)
    there = HERE + np.array(by)
    for other, place in ((light.moved(by), there), (gn.TurnedLight(light, 0.0), HERE), (of_channel(light, 0), HERE)):
        p = Direction(*map(float, place))
        assert other.irradiance_at(place, NORMAL) == pytest.approx(light.irradiance_at(HERE, NORMAL))
        assert other.strength(p) == pytest.approx(light.strength(Direction(*map(float, HERE))))
        w = other.warp(p, np.array(0.3), np.array(0.7))
        np.testing.assert_allclose([*w], [*light.warp(Direction(*HERE), np.array(0.3), np.array(0.7))])
        other.check_position(place)
        with pytest.raises(ParameterError, match="at the position"):
            other.check_position(place + np.array([0.0, 0.0, 5.0]))


@pytest.mark.parametrize("name", CLOSED)
def test_closed_forms_are_the_integrals(name):
    """... at places and for normals such that the horizon cuts the light, or hides it."""
    light, random = EXAMPLES[name], np.random.default_rng(7)
    for _ in range(6):
        place, normal = 0.3 * random.normal(size=3), gn.directions.normalize(random.normal(size=3))
        E = light.irradiance_at(place, normal)
        if light.is_delta:
            w, irradiance, _ = light.arrival(place)
            expected = irradiance * max(w @ normal, 0.0)
        else:
            w, pdf = light.sample(lattice(1 << 16), place)
            expected = (light.incident(w, place) * (np.maximum(w @ normal, 0.0) / pdf)[:, None]).mean(axis=0)
        np.testing.assert_allclose(E, expected, rtol=3e-3, atol=3e-5)
        np.testing.assert_allclose(gn.irradiance([light], place, 2.0 * normal), E if E.size > 1 else E[0], rtol=1e-12)


def test_closed_forms_of_textbooks():
    up = [0.0, 0.0, 1.0]
    disk = gn.DiskLight([0, 0, 2.0], [0, 0, -1], 1.5)
    assert gn.irradiance(disk) == pytest.approx(math.pi * 2.25 / (2.25 + 4.0), rel=1e-12)
    sphere = gn.SphereLight([0.0, 3.0, 4.0], 1.0, 2.0)
    assert gn.irradiance(sphere) == pytest.approx(2.0 * math.pi / 25.0 * 0.8, rel=1e-12)
    a = 1.0 / math.sqrt(2.0)  # a quarter of a square, parallel, over its corner: Howell's catalogue, B-3
    corner = 2.0 * a * math.atan(a) / (2.0 * math.pi)
    square = gn.RectangleLight([0.5, 0.5, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0])
    assert gn.irradiance(square) == pytest.approx(math.pi * corner, rel=1e-12)
    assert gn.irradiance(square, normal=[0.0, 0.0, -1.0]) == 0.0
    assert gn.irradiance(gn.ConstantLight(3.0), normal=up) == pytest.approx(3.0 * math.pi, rel=1e-12)
    half = gn.SphereLight([5.0, 0.0, 0.0], 3.0)  # the horizon halves it
    edge = math.asin(0.6)
    assert gn.irradiance(half) == pytest.approx(edge - 0.6 * 0.8, rel=1e-9)
    alone = [gn.irradiance(light) for light in (disk, sphere, square)]
    assert gn.irradiance([disk, sphere, square]) == pytest.approx(sum(alone), rel=1e-12)


def test_a_polygon_of_four_corners_is_a_rectangle():
    rectangle = EXAMPLES["rectangle"]
    corners = [[-0.2, 0.5, 1.0], [0.8, 0.5, 1.0], [0.8, -0.1, 1.0], [-0.2, -0.1, 1.0]]
    polygon = gn.PolygonLight(corners, [2.0, 1.0])
    assert gn.irradiance(polygon, HERE, NORMAL) == pytest.approx(gn.irradiance(rectangle, HERE, NORMAL), rel=1e-12)
    w, _ = polygon.sample(lattice(500), HERE)
    np.testing.assert_allclose(rectangle.pdf(w, HERE), polygon.pdf(w, HERE), rtol=1e-9)
    np.testing.assert_allclose(rectangle.distance(w, HERE), polygon.distance(w, HERE), rtol=1e-12)


def test_far_away_lights_obey_the_inverse_square_and_become_distant():
    place = np.array([0.0, 0.0, 1e5])
    sphere = gn.SphereLight(place, 2.0, 3.0)
    point = gn.PointLight(place, 3.0 * math.pi * 4.0)
    assert gn.irradiance(sphere) == pytest.approx(gn.irradiance(point), rel=1e-9)
    assert gn.irradiance(gn.SunLight([0.0, 0.6, 0.8], 7.0)) == pytest.approx(5.6, rel=1e-12)
    m = gn.Microfacet(gn.GGX(0.4), 1.0)
    L = [gn.reflected_radiance(m, light, [0.0, 0.0, 1.0]) for light in (sphere, point)]
    assert L[0] == pytest.approx(L[1], rel=1e-6)


@pytest.mark.few_by_jax("environment", "low disk", "polygon")
@pytest.mark.parametrize("name", EXTENDED)
def test_libraries_agree(name, library):
    light = EXAMPLES[name]
    u, places = lattice(60), HERE + 0.05 * np.random.default_rng(2).normal(size=(60, 3))
    w, pdf = light.sample(u, places)
    there, density = light.sample(library.array(u), library.array(places))
    np.testing.assert_allclose(library.numpy(there), w, atol=2e-7)
    np.testing.assert_allclose(library.numpy(density), pdf, rtol=1e-6)
    if library.name.startswith("drjit"):
        return  # arrays of components have no channel axis
    inwards = library.array(w)
    for found, expected in (
        (light.pdf(inwards, library.array(places)), pdf),
        (light.incident(inwards, library.array(places)), light.incident(w, places)),
        (light.distance(inwards, library.array(places)), light.distance(w, places)),
    ):
        np.testing.assert_allclose(library.numpy(found), expected, rtol=1e-6)


@pytest.mark.parametrize("name", CLOSED)
def test_torch_differentiates_irradiance_by_every_number(name, torch):
    light = EXAMPLES[name]
    start = {path: p.value for path, p in light.parameters.items()}

    def irradiance(values: Any) -> Any:
        changed = tree.with_values(light, values)
        lib = torch if any(hasattr(v, "detach") for v in values.values()) else np
        return gn.irradiance(changed, lib.asarray(HERE), lib.asarray(NORMAL)).sum()

    numbers = {path: torch.tensor(v, dtype=torch.float64, requires_grad=True) for path, v in start.items()}
    slopes = torch.autograd.grad(irradiance(numbers), list(numbers.values()), allow_unused=True)
    for (path, value), slope in zip(start.items(), slopes, strict=True):
        h = 1e-6
        expected = (irradiance({path: value + h}) - irradiance({path: value - h})) / (2.0 * h)
        found = 0.0 if slope is None else float(slope.sum())
        assert found == pytest.approx(expected, rel=1e-5, abs=1e-7), path


@pytest.mark.parametrize("name", ["rectangle", "low sphere", "disk", "polygon", "wide sun", "gray environment"])
def test_reflected_radiance_is_differentiable_under_lights_with_extent(name, torch):
    """By the material and by the light: pathwise where the light has edges."""
    light = EXAMPLES[name]
    path = next(path for path in ("centre.x", "corners.1.x", "direction.z", "scale") if path in light.parameters)
    start, alpha = light.parameters[path].value, 0.35
    wo, place = gn.direction(0.4, 0.3), HERE

    def radiance(a: Any, x: Any, lib: Any) -> Any:
        m = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(a), 0.9)
        at = [lib.asarray(v) for v in (wo, NORMAL, place)]
        return gn.reflected_radiance(
            m, tree.with_values(light, {path: x}), at[0], at[1], position=at[2], samples=1 << (18 if lib is np else 16)
        ).sum()

    a, x = (torch.tensor(v, dtype=torch.float64, requires_grad=True) for v in (alpha, start))
    L = radiance(a, x, torch)
    by_alpha, by_place = torch.autograd.grad(L, (a, x))
    assert L.item() == pytest.approx(radiance(alpha, start, np), rel=3e-3)
    h = 1e-2
    for found, other in ((by_alpha, (h, 0.0)), (by_place, (0.0, h))):
        up, down = (radiance(alpha + s * other[0], start + s * other[1], np) for s in (1.0, -1.0))
        assert found.item() == pytest.approx((up - down) / (2.0 * h), rel=4e-2, abs=2e-3)


def test_jax_differentiates_under_environment_and_constant_light(jax):
    wo = jax.numpy.asarray(gn.direction(0.4, 0.3))
    for light in (gn.ConstantLight(2.0), EXAMPLES["environment"]):

        def radiance(a, light=light):
            return gn.reflected_radiance(gn.Microfacet(gn.GGX(a), 0.9), light, wo).sum()

        def expected(a, light=light):
            return gn.reflected_radiance(gn.Microfacet(gn.GGX(a), 0.9), light, np.asarray(wo), samples=1 << 16).sum()

        slope = jax.jit(jax.grad(radiance))(0.4)
        assert slope == pytest.approx((expected(0.42) - expected(0.38)) / 0.04, rel=0.05, abs=2e-3)


def test_albedo_is_differentiable(torch, jax):
    w = gn.direction(0.5, 0.3)

    def albedo(a, w, of=gn.albedo):
        return of(0.3 * gn.Lambertian(0.5) + gn.Microfacet(gn.GGX(a), gn.Conductor(0.2, 3.9)), w)

    expected = (albedo(0.305, w) - albedo(0.295, w)) / 0.01
    a = torch.tensor(0.3, dtype=torch.float64, requires_grad=True)
    value = albedo(a, torch.tensor(w))
    assert value.item() == pytest.approx(albedo(0.3, w), rel=2e-3)
    assert torch.autograd.grad(value, a)[0].item() == pytest.approx(expected, rel=0.02)
    assert jax.grad(albedo)(0.3, jax.numpy.asarray(w)) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("samples", thinned([1 << 15, 1 << 17], [1 << 15]))
def test_errors_are_standard_errors(samples):
    """Over many places the true error is within three of them, and not far below."""
    m, light = gn.Microfacet(gn.GGX(0.2), 1.0), EXAMPLES["gray environment"]
    wo = gn.direction(np.linspace(0.0, 1.4, 60), np.linspace(0.0, 6.0, 60))
    found = gn.reflected_radiance(m, light, wo, samples=1024, return_error=True)
    exact = gn.reflected_radiance(m, light, wo, samples=samples)
    off = np.abs(found.value - exact) / found.error
    assert np.mean(off < 3.0) > 0.95
    assert np.median(off) > 0.2
    exact = gn.reflected_radiance(gn.Lambertian(0.5), EXAMPLES["disk"], wo, return_error=True)
    assert not exact.error.any()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: gn.RectangleLight(edge_x=[1, 0, 0], edge_y=[2, 0, 0]), "its area is 0"),
        (lambda: gn.RectangleLight(edge_x=[1, 0, 0], edge_y=[1, 1, 0]), "an angle of 45 degrees, expected 90"),
        (lambda: gn.DiskLight(radius=0.0), "radius"),
        (lambda: gn.SphereLight(radius=-1.0), "radius"),
        (lambda: gn.PolygonLight([[0, 0, 1], [1, 0, 1]]), "2 corners, expected 3 to 32"),
        (lambda: gn.PolygonLight([[0, 0, 1], [1, 0, 1], [2, 0, 1]]), "its area is 0"),
        (lambda: gn.PolygonLight([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.5]]), "in no plane"),
        (lambda: gn.PolygonLight([[0, 0, 1], [2, 0, 1], [0.5, 0.5, 1], [0, 2, 1]]), "turn inwards"),
        (lambda: gn.PolygonLight(3.0), "expected a list of corners"),
        (lambda: gn.SpotLight(inner=0.5, outer=0.4), "expected the inner angle to be smaller"),
        (lambda: gn.SpotLight(axis=[0, 0, 0]), "no direction"),
        (lambda: gn.SunLight(radius=2.0), "radius"),
    ],
)
def test_lights_without_area_or_sense_are_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


@pytest.mark.parametrize(
    ("light", "place"),
    [
        (gn.SphereLight([0.0, 0.0, 1.0], 0.5), [0.0, 0.2, 1.0]),
        (gn.DiskLight([0.0, 0.0, 1.0], radius=0.5), [0.2, 0.0, 1.0]),
        (gn.RectangleLight(), [0.2, 0.0, 1.0]),
        (gn.PolygonLight(), [0.2, 0.2, 1.0]),
        (gn.PointLight(), [0.0, 0.0, 1.0]),
        (gn.SpotLight(), [0.0, 0.0, 1.0]),
    ],
)
def test_places_in_a_light_are_refused(light, place):
    for call in (
        lambda: gn.irradiance(light, place),
        lambda: gn.reflected_radiance(gn.Lambertian(), light, [0, 0, 1], position=place),
    ):
        with pytest.raises(ParameterError, match="expected positions outside the light"):
            call()


def test_vectors_are_parameters():
    light = gn.SpotLight([1.0, 2.0, 3.0])
    assert light.parameters["position.y"].value == 2.0
    moved = light.replace({"position.y": 5.0})
    assert repr(moved.position) == "[1.0, 5.0, 3.0]"
    assert moved == gn.SpotLight([1.0, 5.0, 3.0])
    assert read(repr(moved)) == moved
    assert gn.DistantLight([0.0, 0.0, 5.0]).replace(direction=[0, 3, 0]) == gn.DistantLight([0, 1, 0])


def test_pictures_are_lit_by_lights_at_a_place():
    """A lamp near the sphere: its picture is that by the closed form."""
    lamp = gn.DiskLight([-1.5, -2.0, 1.5], [1.5, 2.0, -1.5], 0.5, 30.0)
    picture = gn.render(gn.Lambertian(0.5), lamp, size=16, samples=64).pixels
    assert np.isfinite(picture).all()
    assert picture.max() > 0.2


def test_standard_skies():
    """Types that have names of their own: uniform, overcast (a third at the horizon), and clear as in CIE 22."""
    sun = gn.direction(0.9, 0.4)
    w = gn.direction([0.0, 0.7, 1.3, 1.5707], [0.0, 1.0, 2.0, 0.4])
    np.testing.assert_allclose(gn.CIESky(5, sun, 2.0).incident(w), 2.0)
    assert gn.CIESky(1, sun).incident(w)[-1, 0] == pytest.approx(1.0 / (1.0 + 4.0 * math.exp(-0.7)), rel=1e-3)

    def clear(w):
        gamma = np.arccos(w @ sun)
        return (0.91 + 10.0 * np.exp(-3.0 * gamma) + 0.45 * np.cos(gamma) ** 2) * (1.0 - np.exp(-0.32 / w[..., 2]))

    expected = clear(w) / clear(np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(gn.CIESky(12, sun).incident(w)[:, 0], expected, rtol=5e-4)  # of 0.91
    assert not gn.CIESky(12, sun).incident(gn.direction(1.6, 0.0)).any()
    for wrong in (0, 16, 2.5, "clear", True):
        with pytest.raises(ParameterError, match="expected a whole number from 1 to 15"):
            gn.CIESky(wrong)
    for kind in (gn.CIESky, gn.PreethamSky):
        with pytest.raises(ParameterError, match="the sun is below the horizon"):
            kind(sun=[1.0, 0.0, -0.1])


def test_the_clear_sky_is_that_of_the_paper():
    """Luminance of the zenith, and its chromaticity, from the formulas of the appendix, by hand for T = 2, theta = 0:
    chi = (4/9 - 2/120) pi, and the last column of the tables."""
    zenith = gn.PreethamSky(2.0, sun=[0.0, 0.0, 1.0]).incident([0.0, 0.0, 1.0])
    X, Y, Z = XYZ_OF_RGB @ zenith
    chi = (4.0 / 9.0 - 2.0 / 120.0) * math.pi
    assert pytest.approx((4.0453 * 2.0 - 4.9710) * math.tan(chi) - 0.2155 * 2.0 + 2.4192, rel=1e-6) == Y
    assert pytest.approx(0.25886 + 2.0 * 0.00394, rel=1e-6) == X / (X + Y + Z)
    assert pytest.approx(0.26688 + 2.0 * 0.00516, rel=1e-6) == Y / (X + Y + Z)
    low = gn.PreethamSky(2.0, sun=gn.direction(1.2, 0.0))
    away, horizon = low.incident(gn.direction([0.6, 1.5], math.pi))
    assert away[2] > 1.5 * away[0]  # blue, and paler at the horizon
    assert horizon[2] / horizon[0] < away[2] / away[0]
