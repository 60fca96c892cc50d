"""The shapes: closed forms of their pictures, places on them, what stands on the ground, cameras and backdrops."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gonio as gn
from gonio.arrays.kinds import SCALAR, VECTOR
from gonio.errors import ArrayTypeError, ParameterError, ShapeError
from gonio.evaluate.computation import Computation, composite
from gonio.formula.direction import Direction
from gonio.scenes.shapes import LOWEST, SHAPES

STUDIO = gn.EnvironmentLight.studio(height=32)
WHITE, GRAY = gn.Lambertian(1.0), gn.Lambertian(0.5)
EVEN = gn.ConstantLight(1.0)
AREAS = {"sphere": math.pi, "disk": math.pi, "plane": 2.0, "cylinder": 2.0}  # as seen


def hits(name, o, d):
    """Where rays meet a shape, as arrays."""

    def kernel(scene, mean, o, d):
        at = SHAPES[name](Direction(*o), Direction(*d))
        none = 0.0 * (o[0] + d[0])
        met = (at.met & (at.distance < 1e9)) * 1.0
        vectors = (Direction(*(x + none for x in w)) for w in (at.point, at.normal, at.tangent))
        return met + none, *vectors, at.u + none, at.v + none, at.distance + none

    kinds = {"met": SCALAR, **dict.fromkeys(("point", "normal", "tangent"), VECTOR)}
    kinds |= dict.fromkeys(("u", "v", "distance"), SCALAR)
    found = Computation(kernel, {"o": 3, "d": 3}, kinds)(composite(one=1.0), o=o, d=d)
    return {key: x[found["met"] > 0.5] for key, x in found.items()}, found["met"] > 0.5


@pytest.fixture(scope="module")
def rays():
    rng = np.random.default_rng(7)
    o = rng.normal(size=(20000, 3))
    o *= 3.0 / np.linalg.norm(o, axis=1, keepdims=True)
    d = rng.normal(size=o.shape) * 0.5 - o
    return o, d / np.linalg.norm(d, axis=1, keepdims=True)


def test_every_shape_is_tried_here():
    assert set(AREAS) == set(SHAPES)


@pytest.mark.parametrize("name", SHAPES)
def test_points_normals_and_places(name, rays):
    """Points on the ray and within the unit ball, frames perpendicular, places in the unit square, which tell points
    apart as the docstrings say."""
    o, d = rays
    at, met = hits(name, o, d)
    np.testing.assert_allclose(o[met] + at["distance"][:, None] * d[met], at["point"], atol=1e-9)
    assert (np.linalg.norm(at["point"], axis=1) < 1.0 + 1e-9).all()
    assert at["point"][:, 2].min() == pytest.approx(LOWEST[name], abs=0.05)
    np.testing.assert_allclose(np.linalg.norm(at["normal"], axis=1), 1.0, rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(at["tangent"], axis=1), 1.0, rtol=1e-9)
    np.testing.assert_allclose(np.einsum("ni,ni->n", at["normal"], at["tangent"]), 0.0, atol=1e-9)
    u, v, p, h = at["u"], at["v"], at["point"], math.sqrt(0.5)
    assert 0.0 <= u.min() < 0.02 and 0.98 < u.max() <= 1.0 and 0.0 <= v.min() < 0.02 and 0.98 < v.max() <= 1.0
    turn = np.exp(2j * math.pi * u)
    if name == "plane":
        np.testing.assert_allclose(np.stack([2 * u - 1, 1 - 2 * v], -1) * h, p[:, [0, 2]], atol=1e-9)
    elif name == "disk":
        np.testing.assert_allclose((1 - v) * turn, p[:, 0] + 1j * p[:, 2], atol=1e-9)
    elif name == "sphere":
        np.testing.assert_allclose(np.sin(math.pi * v) * turn, p[:, 0] + 1j * p[:, 1], atol=1e-9)
        np.testing.assert_allclose(np.cos(math.pi * v), p[:, 2], atol=1e-9)
    elif name == "cylinder":
        end = np.abs(at["normal"][:, 2]) > 0.5
        assert 0.1 < end.mean() < 0.9
        np.testing.assert_allclose(np.where(end, (1 - v) * h, h) * turn, p[:, 0] + 1j * p[:, 1], atol=1e-9)
        np.testing.assert_allclose(np.where(end, np.sign(p[:, 2]), 1 - 2 * v) * h, p[:, 2], atol=1e-9)
        assert (np.sign(at["normal"][end, 2]) == np.sign(p[end, 2])).all()
        assert (np.einsum("ni,ni->n", at["normal"], d[met]) < 1e-9).all()


@pytest.mark.parametrize("name", SHAPES)
def test_white_shapes_in_a_furnace_are_one(name):
    picture = gn.render(WHITE, EVEN, name, size=64, samples=16)
    np.testing.assert_allclose(picture.alpha.sum() * (2.12 / 64) ** 2, AREAS[name], rtol=3e-3)
    inside = picture.alpha == 1.0
    np.testing.assert_allclose(picture.pixels[inside], 1.0, rtol=1e-5)
    turned = gn.render(WHITE, EVEN, name, size=32, samples=16, camera=gn.scenes.Camera([1.0, -4.0, 2.0]))
    np.testing.assert_allclose(turned.pixels[turned.alpha == 1.0], 1.0, rtol=1e-5)


def test_a_plane_is_lit_as_a_plane():
    sun = gn.DistantLight([0.3, -0.8, 0.5], math.pi)
    picture = gn.render(GRAY, sun, "plane", size=16, samples=4)
    cosine = 0.8 / math.sqrt(0.3**2 + 0.8**2 + 0.5**2)
    np.testing.assert_allclose(picture.pixels[8, 8], 0.5 * cosine, rtol=1e-5)


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_stands_on_the_ground_and_shadows_it(name):
    """Under light from straight above, what is dark of the ground is what the shape covers; from behind, it is not."""
    camera = gn.scenes.OrthographicCamera([0.0, -3.0, 3.0], width=4.0)
    above = gn.DistantLight([0.0, 0.0, 1.0], math.pi)
    picture = gn.render(GRAY, above, name, size=64, camera=camera, ground=WHITE)
    assert picture.alpha.min() == 1.0
    np.testing.assert_allclose(picture.pixels[[0, -1]], 1.0, rtol=1e-5)
    slanted = gn.DistantLight([0.0, 1.0, 1.0], math.pi)  # from behind the shape: the shadow is before it
    before = gn.render(GRAY, slanted, name, size=64, camera=camera, ground=WHITE).pixels[-16:, 32, 0]
    assert before.min() < 1e-6 if name != "sphere" else before.min() < 0.5


def test_the_ground_takes_the_share_of_the_sky_that_is_left():
    """Beside a wide square that stands on it, a point of the ground sees half of an even sky: E = pi/2 there."""
    camera = gn.scenes.OrthographicCamera([0.0, -1.0, 3.0], [0.0, -0.004, -math.sqrt(0.5)], width=0.004)
    picture = gn.render(gn.Lambertian(0.0), EVEN, "plane", size=8, samples=256, camera=camera, ground=WHITE)
    np.testing.assert_allclose(picture.pixels.mean(), 0.5, atol=0.01)


def test_cameras_show_sizes_as_geometry_says():
    far = gn.render(WHITE, EVEN, "plane", size=128, samples=16, camera=gn.scenes.Camera([0, -8, 0], field_of_view=0.4))
    width = 2.0 * math.sqrt(0.5) / (2.0 * 8.0 * math.tan(0.2))
    np.testing.assert_allclose(far.alpha.sum() / 128**2, width**2, rtol=2e-3)
    parallel = gn.scenes.OrthographicCamera([0, -8, 0], width=4.0)
    np.testing.assert_allclose(
        gn.render(WHITE, EVEN, "plane", size=128, samples=16, camera=parallel).alpha.sum() / 128**2, 2 / 16, rtol=2e-3
    )
    rolled = gn.scenes.OrthographicCamera([0, -4, 0], up=[1, 0, 1], width=2.12)
    corner = gn.render(WHITE, EVEN, "plane", size=64, samples=16, camera=rolled).alpha
    assert corner[3, 32] == 1.0 and corner[12, 12] == 0.0  # the square stands on a corner


def test_points_that_cameras_cannot_place():
    camera = gn.scenes.Camera([0.0, -4.0, 0.0])
    assert camera.places(np.zeros((0, 3))).shape == (0, 2)
    assert camera.places([[0.0, 0.0, 0.0], [0.0, -9.0, 0.0]]) is None
    for points, error in ((np.zeros(3), ShapeError), (np.zeros((2, 2)), ShapeError), ("here", ArrayTypeError)):
        with pytest.raises(error, match="points"):
            camera.places(points)


def test_up_is_up_and_right_is_right():
    """The camera of nobody's choice and the same by name show the same, in the same orientation."""
    camera = gn.scenes.OrthographicCamera([0, -4, 0], width=2.12)
    a = gn.render(gn.material("gold"), STUDIO, size=32, samples=256)
    b = gn.render(gn.material("gold"), STUDIO, size=32, samples=256, camera=camera)
    np.testing.assert_allclose(a.alpha, b.alpha, atol=1e-6)
    inside = a.alpha == 1.0
    np.testing.assert_allclose(a.pixels[inside], b.pixels[inside], rtol=1e-3, atol=1e-3)


def test_the_backdrop_is_the_light_from_there():
    """Of the pixels beside the shape, of every camera: the radiance from where they look."""
    camera = gn.scenes.Camera([0.0, -4.0, 0.0], [0.0, 0.0, 0.3], field_of_view=1.2)
    picture = gn.render(gn.Lambertian(0.5), STUDIO, size=16, samples=512, camera=camera, backdrop=True)
    assert picture.alpha.min() == 1.0
    y, x = (1.0 - (np.mgrid[:16, :16] + 0.5) / 8.0)[0], ((np.mgrid[:16, :16] + 0.5) / 8.0 - 1.0)[1]
    forward = np.array([0.0, 4.0, 0.3]) / math.hypot(4.0, 0.3)
    right, reach = np.array([1.0, 0.0, 0.0]), math.tan(0.6)
    d = forward + reach * (x[..., None] * right + y[..., None] * np.cross(right, forward))
    seen = STUDIO.incident(d / np.linalg.norm(d, axis=-1, keepdims=True))
    edge = np.zeros((16, 16), bool)
    edge[[0, -1]] = edge[:, [0, -1]] = True
    np.testing.assert_allclose(picture.pixels[edge].mean(axis=0), seen[edge].mean(axis=0), rtol=0.03)
    both = gn.render(gn.Lambertian([0.5, 0.4, 0.3]), EVEN, size=16, backdrop=True)
    np.testing.assert_allclose(both.pixels[0, 0], 1.0, rtol=1e-6)


def test_surfaces_are_shapes():
    flat = gn.surfaces.HeightField(np.zeros((4, 4)))
    picture = gn.render(WHITE, EVEN, flat, size=32)
    np.testing.assert_allclose(picture.pixels[picture.alpha == 1.0], 1.0, rtol=1e-5)
    area = 16.0 * math.sin(math.radians(50.0)) / (2.12 * math.sqrt(8.0) / 32) ** 2
    np.testing.assert_allclose(picture.alpha.sum(), area, rtol=1e-2)
    grooves = gn.render(WHITE, EVEN, gn.surfaces.v_grooves(1.0), size=32)
    assert 0.4 < grooves.pixels[grooves.alpha == 1.0].mean() < 1.0001


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: gn.scenes.Camera([0, 0, 0]), "one point"),
        (lambda: gn.scenes.Camera([0, 0, 4]), "up is along the view"),
        (lambda: gn.scenes.Camera(field_of_view=4.0), "field_of_view"),
        (lambda: gn.scenes.OrthographicCamera(width=0.0), "width"),
        (lambda: gn.render(WHITE, camera=3), "camera"),
        (lambda: gn.render(WHITE, ground=3), "ground"),
    ],
)
def test_cameras_that_are_refused(make, says):
    with pytest.raises(ParameterError, match=says):
        make()


def test_samples_where_a_shape_touches_the_ground_are_counted_once():
    coated = GRAY + gn.Microfacet(gn.GGX(0.08), gn.Dielectric(1.5))
    picture = gn.render(coated, shape="cylinder", size=96, samples=32, ground=GRAY)
    assert picture.alpha.max() == 1.0
