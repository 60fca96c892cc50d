"""Laws of radiometry: exact solid angles, what is conserved, round trips, and what bad input says."""

import inspect
from decimal import Decimal, localcontext
from itertools import pairwise

import numpy as np
import pytest

from gonio import radiometry as rad
from gonio.errors import ArrayTypeError, MeaningWarning, ParameterError, ShapeError

PI = np.pi
AXES = np.eye(3)


def close(got, want, rel=1e-12, abs=0.0):
    np.testing.assert_allclose(got, want, rtol=rel, atol=abs, equal_nan=False)


def rotations(count, seed=0):
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(count, 3, 3)))[0]
    return q * np.sign(np.linalg.det(q))[:, None, None]


def unit_vectors(count, seed=0):
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def gauss(low, high, n):
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (high - low) * (x + 1.0) + low, 0.5 * (high - low) * w


def over_triangle(a, b, c, function, n=40):
    """Integral of function(points) dA over a triangle by a product Gauss rule collapsed on corner a."""
    s, ws = gauss(0.0, 1.0, n)
    s, t = (m.ravel() for m in np.meshgrid(s, s, indexing="ij"))
    weight = np.outer(ws, ws).ravel() * s * np.linalg.norm(np.cross(b - a, c - a))
    return np.sum(weight * function(a + s[:, None] * ((b - a) + t[:, None] * (c - b))))


def clipped(vertices, normal):
    """A convex polygon cut at the horizon, one vertex at a time."""
    out = []
    for p, q in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        hp, hq = p @ normal, q @ normal
        if hp > 0.0:
            out.append(p)
        if (hp > 0.0) != (hq > 0.0):
            out.append(p + hp / (hp - hq) * (q - p))
    return np.array(out)


# Solid angles


def test_an_octant_is_an_eighth_of_the_sphere():
    close(rad.solid_angle_triangle(*AXES), PI / 2, rel=1e-15)


def test_the_faces_of_a_cube_share_the_sphere_from_anywhere_inside():
    observer = np.random.default_rng(1).uniform(-0.999, 0.999, size=(200, 3))
    observer[0] = 0.0
    faces = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            corner = -np.ones(3)
            corner[axis] = side
            u, v = 2.0 * AXES[(axis + 1) % 3], 2.0 * AXES[(axis + 2) % 3]
            faces.append(rad.solid_angle_rectangle(corner - observer, u, v))
    close(np.array(faces)[:, 0], 2.0 * PI / 3.0, rel=1e-15)
    close(np.sum(faces, axis=0), 4.0 * PI, rel=1e-14)


def test_a_closed_mesh_is_4_pi_from_inside_and_0_from_outside():
    tetrahedron = np.array([[1.0, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]])
    faces = tetrahedron[[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]]
    for observer, total in ((np.array([0.05, -0.1, 0.2]), 4.0 * PI), (np.array([2.0, 0.3, -1.0]), 0.0)):
        a, b, c = np.moveaxis(faces - observer, 1, 0)
        signed = rad.solid_angle_triangle(a, b, c, signed=True)
        close(np.abs(np.sum(signed)), total, abs=1e-14)
        close(np.abs(signed), rad.solid_angle_triangle(a, b, c), rel=0.0)


def test_triangles_add_up_when_they_are_split():
    rng = np.random.default_rng(2)
    a, b, c = rng.normal(size=(3, 300, 3))
    share = rng.dirichlet([1.0, 1.0, 1.0], size=300)
    inner = share[:, :1] * a + share[:, 1:2] * b + share[:, 2:] * c
    for whole in (
        rad.solid_angle_triangle,
        lambda *v: rad.projected_solid_angle_polygon(np.stack(v, axis=-2)),
    ):
        parts = whole(inner, b, c) + whole(a, inner, c) + whole(a, b, inner)
        close(parts, whole(a, b, c), rel=1e-11, abs=1e-14)


def test_triangle_solid_angle_is_its_defining_integral():
    rng = np.random.default_rng(3)
    for _ in range(10):
        a, b, c = rng.normal(size=(3, 3)) + 4.0 * AXES[2]
        n = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
        want = over_triangle(a, b, c, lambda p, n=n: np.abs(p @ n) / np.linalg.norm(p, axis=1) ** 3)
        close(rad.solid_angle_triangle(a, b, c), want)


def test_a_triangle_has_the_area_that_spherical_trigonometry_gives():
    # Girard: the sum of the angles minus pi; here also for solid angles up to 2 pi.
    for a, b, c in np.random.default_rng(4).normal(size=(200, 3, 3)):
        n = [np.cross(p, q) / np.linalg.norm(np.cross(p, q)) for p, q in ((a, b), (b, c), (c, a))]
        angles = [np.arccos(np.clip(-n[i] @ n[i - 1], -1.0, 1.0)) for i in range(3)]
        close(rad.solid_angle_triangle(a, b, c), sum(angles) - PI, abs=1e-12)


def test_degenerate_triangles():
    a, b = np.array([1.0, 0.0, 1.0]), np.array([0.0, 1.0, 1.0])
    assert rad.solid_angle_triangle(a, a, b) == 0.0
    assert rad.solid_angle_triangle(a, a, a) == 0.0
    assert rad.solid_angle_triangle([0, 0, 0], a, b) == 0.0
    around = np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]])
    close(rad.solid_angle_triangle(*around), 2.0 * PI, rel=1e-15)  # the observer is in the triangle
    close(rad.solid_angle_triangle(*(around + 1e-13 * AXES[2])), 2.0 * PI)
    assert rad.solid_angle_triangle(*(around + 3.0 * AXES[0])) == 0.0  # in its plane, outside


def dot(p, q):
    return sum(x * y for x, y in zip(p, q, strict=True))


def cross(p, q):
    return [p[i - 2] * q[i - 1] - p[i - 1] * q[i - 2] for i in range(3)]


def exact(function, *vectors):
    """function of the vectors in 60 decimal digits."""
    with localcontext() as context:
        context.prec = 60
        return float(abs(function(*([Decimal(float(x)) for x in v] for v in vectors))))


def exact_thin_triangle(a, b, c):
    """Van Oosterom and Strackee; w = 2 (t - t³/3 + t⁵/5) is enough for a thin or tiny triangle."""
    ra, rb, rc = (dot(v, v).sqrt() for v in (a, b, c))
    t = dot(a, cross(b, c)) / (ra * rb * rc + dot(a, b) * rc + dot(b, c) * ra + dot(c, a) * rb)
    return 2 * (t - t**3 / 3 + t**5 / 5)


def exact_tiny_polygon(n, *vertices):
    """Lambert's formula; theta/sin theta = 1 + s²/6 + 3 s⁴/40 + 5 s⁶/112 is enough for a tiny polygon."""
    unit = [[x / dot(v, v).sqrt() for x in v] for v in vertices]
    total = Decimal(0)
    for p, q in zip(unit, [*unit[1:], unit[0]], strict=True):
        normal = cross(p, q)
        s2 = dot(normal, normal)
        total += dot(n, normal) * (1 + s2 / 6 + 3 * s2**2 / 40 + 5 * s2**3 / 112)
    return total / 2


TINY = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, -0.1], [-0.3, 0.9, 0.4], [-0.6, 0.2, 0.25]])


@pytest.mark.parametrize("size", [1e-4, 1e-6, 1e-8])
def test_tiny_far_triangles_keep_their_digits(size):
    polygon = np.array([0.3, -0.4, 1.2]) + size * TINY
    close(rad.solid_angle_triangle(*polygon[:3]), exact(exact_thin_triangle, *polygon[:3]), rel=1e-15)
    n = np.array([0.36, 0.48, 0.8])
    for vertices in (polygon[:3], polygon):
        want = exact(exact_tiny_polygon, n, *vertices)
        close(rad.projected_solid_angle_polygon(vertices, n), want, rel=3e-15)


def test_triangles_with_one_corner_far_away_keep_their_digits():
    # One long, thin triangle by the observer: the triple product must start at a near corner.
    corners = np.array([[3e7, 1e7, 2e7], [0.6, 0.3, 0.51], [0.6, 0.2, 0.5]])
    want = exact(exact_thin_triangle, *corners)
    for k in range(3):
        close(rad.solid_angle_triangle(*np.roll(corners, k, axis=0)), want, rel=1e-14)


def test_long_rectangles_keep_their_digits():
    # The far corner is a float too, so that only the arithmetic differs.
    along = 11184811.0 * np.array([3.0, 4.0, 0.0])
    across = np.array([-0.4, 0.3, 1.2])
    near = np.array([314573, 104857, 209713]) / 2.0**20
    want = rad.solid_angle_rectangle(near, along, across)
    assert want > 0.1
    close(rad.solid_angle_rectangle(near + along, -along, across), want, rel=1e-13)


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1e30, 1e200])
def test_solid_angles_do_not_depend_on_the_unit_of_length(scale):
    a, b, c = np.array([[1.0, 0.2, 2.0], [-0.4, 1.0, 1.5], [0.1, -1.0, 1.0]])
    u, v = np.array([1.0, 0.5, 0.0]), np.array([-0.5, 1.0, 0.0])
    close(rad.solid_angle_triangle(*(scale * np.array([a, b, c]))), rad.solid_angle_triangle(a, b, c))
    close(rad.solid_angle_rectangle(scale * a, scale * u, scale * v), rad.solid_angle_rectangle(a, u, v))
    polygon = np.array([a, b, c])
    close(rad.projected_solid_angle_polygon(scale * polygon), rad.projected_solid_angle_polygon(polygon))


def test_solid_angles_do_not_depend_on_the_frame():
    turn = rotations(50)
    rng = np.random.default_rng(5)
    a, b, c, n = rng.normal(size=(4, 3))
    n /= np.linalg.norm(n)
    u, v = np.array([1.0, 0.5, 0.0]), np.array([-0.5, 1.0, 0.0])
    corner = np.array([0.4, -1.4, 0.8])
    close(rad.solid_angle_triangle(turn @ a, turn @ b, turn @ c), rad.solid_angle_triangle(a, b, c))
    rectangle = rad.solid_angle_rectangle(corner, u, v)
    close(rad.solid_angle_rectangle(turn @ corner, turn @ u, turn @ v), rectangle)
    polygon = np.array([a, b, c])
    turned = np.einsum("kij,vj->kvi", turn, polygon)
    projected = rad.projected_solid_angle_polygon(polygon, n)
    assert projected > 0.0
    close(rad.projected_solid_angle_polygon(turned, turn @ n), projected)


def on_axis(width, height, distance):
    """Solid angle of a rectangle from straight above its centre, in closed form."""
    return 4.0 * np.arctan(width * height / (2 * distance * np.sqrt(4 * distance**2 + width**2 + height**2)))


@pytest.mark.parametrize("size", [1e-8, 1e-3, 1.0, 1e3, 1e8])
def test_a_rectangle_on_its_axis_has_the_closed_form(size):
    w, h, d = 1.3 * size, 0.7 * size, 1.1
    got = rad.solid_angle_rectangle([-w / 2, -h / 2, d], [w, 0, 0], [0, h, 0])
    close(got, on_axis(w, h, d), rel=1e-15)


def test_a_rectangle_is_two_triangles_and_any_of_its_corners_will_do():
    rng = np.random.default_rng(6)
    turn = rotations(300, seed=6)
    u, v = turn[:, 0] * rng.uniform(0.1, 3.0, (300, 1)), turn[:, 1] * rng.uniform(0.1, 3.0, (300, 1))
    p = rng.normal(size=(300, 3))
    got = rad.solid_angle_rectangle(p, u, v)
    two = rad.solid_angle_triangle(p, p + u, p + u + v) + rad.solid_angle_triangle(p, p + u + v, p + v)
    close(got, two, rel=1e-12, abs=1e-14)
    for other in ((p + u, -u, v), (p + v, u, -v), (p + u + v, -v, -u)):
        close(rad.solid_angle_rectangle(*other), got, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("height", [1e-3, 1e-9, 1e-15, 0.0])
def test_a_rectangle_close_to_the_observer(height):
    wide = rad.solid_angle_rectangle([-1, -1, height], [2, 0, 0], [0, 2, 0])
    # The rest of the half space is close to 4 √2 h for a square of side 2.
    close(2.0 * PI - wide, 4.0 * np.sqrt(2.0) * height, rel=1e-5, abs=2e-15)
    close(rad.solid_angle_rectangle([0.5, -1, 0.0], [1, 0, 0], [0, 2, 0]), 0.0, rel=0.0, abs=1e-30)


def test_cones_caps_and_spheres_agree():
    a = np.array([1e-8, 1e-3, 0.3, 1.2, PI / 2])
    close(rad.solid_angle_cone(a), rad.solid_angle_cap(0.0, a), rel=1e-15)
    close(rad.solid_angle_cone(a) + rad.solid_angle_cone(PI - a), 4.0 * PI, rel=1e-15)
    close(rad.solid_angle_cone([1e-8, 1e-150]), [PI * 1e-16, PI * 1e-300], rel=1e-15)
    close(rad.solid_angle_sphere(np.sin(a), 1.0), rad.solid_angle_cone(a), rel=1e-9)
    close(rad.solid_angle_sphere(1.0, [1e6, 1e12]), [PI * 1e-12 * (1 + 0.25e-12), PI * 1e-24], rel=1e-15)
    close(rad.solid_angle_sphere(1.0, 1.0), 2.0 * PI, rel=1e-15)
    close(rad.solid_angle_sphere(1.0, [0.5, np.nextafter(1.0, 0.0)]), 4.0 * PI, rel=1e-15)
    cut = np.sort(np.random.default_rng(7).uniform(0.0, PI, 9))
    edges = np.concatenate([[0.0], cut, [PI]])
    close(np.sum(rad.solid_angle_cap(edges[:-1], edges[1:])), 4.0 * PI, rel=1e-15)


def test_the_small_area_is_the_limit_of_the_exact_solid_angle():
    for side, error in ((0.1, 2.5e-3), (1e-4, 2.5e-9)):
        exact = rad.solid_angle_rectangle([-side / 2, -side / 2, 1.0], [side, 0, 0], [0, side, 0])
        close(rad.solid_angle(side**2, 1.0) / exact - 1.0, error, rel=2e-3)
    close(rad.solid_angle(2.0, 3.0, 0.5), 1.0 / 9.0, rel=1e-15)


@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (64, 128), (181, 7)])
def test_map_pixels_fill_the_sphere_and_lie_where_the_convention_says(shape):
    height, width = shape
    w, dw = rad.latlong_pixels(height, width)
    assert w.shape == (height, width, 3)
    assert dw.shape == (height, width)
    close(np.sum(dw), 4.0 * PI, rel=1e-14)
    close(np.linalg.norm(w, axis=-1), 1.0, rel=1e-15)
    theta, phi = np.arccos(w[..., 2]), np.arctan2(w[..., 1], w[..., 0]) % (2.0 * PI)
    close(theta, np.broadcast_to(((np.arange(height) + 0.5) * PI / height)[:, None], shape))
    close(phi, np.broadcast_to((np.arange(width) + 0.5) * 2.0 * PI / width, shape))
    edge = np.arange(height + 1) * PI / height
    close(dw[:, 0], rad.solid_angle_latlong_pixel(edge[:-1], np.minimum(edge[1:], PI), 2.0 * PI / width))
    close(dw, dw[::-1], rel=0.0)


# Projected solid angles


def test_projected_pixels_fill_the_hemisphere_and_add_up():
    theta = np.linspace(0.0, PI, 38)
    pixels = rad.projected_solid_angle_latlong_pixel(theta[:-1], theta[1:], 2.0 * PI / 10)
    close(10.0 * np.sum(pixels), PI, rel=1e-14)
    assert np.all(pixels[theta[:-1] > PI / 2] == 0.0)
    close(rad.projected_solid_angle_latlong_pixel(0.3, 0.3 + 1e-9, 1.0), 0.5e-9 * np.sin(0.6), rel=1e-7)
    x, weight = gauss(0.2, 0.9, 20)
    want = 0.4 * np.sum(weight * np.cos(x) * np.sin(x))
    close(rad.projected_solid_angle_latlong_pixel(0.2, 0.9, 0.4), want, rel=1e-14)


def test_projected_cone_about_the_normal():
    a = np.array([1e-150, 1e-8, 0.1, 1.0, PI / 2])
    close(rad.projected_solid_angle_cone(a), PI * np.sin(a) ** 2, rel=1e-15)
    close(rad.projected_solid_angle_cone([PI / 2, 2.0, PI]), PI, rel=1e-15)
    close(rad.projected_solid_angle_cone(PI, np.linspace(0.0, PI, 7)), PI, rel=1e-14)
    close(rad.projected_solid_angle_cone(0.4, [0.7, 0.0]), PI * np.sin(0.4) ** 2 * np.cos([0.7, 0.0]))
    close(rad.projected_solid_angle_cone(0.4, [2.1, PI]), 0.0, rel=0.0, abs=1e-16)
    close(rad.projected_solid_angle_cone(PI / 2, PI / 2), PI / 2, rel=1e-15)


@pytest.mark.parametrize("a", [0.05, 0.6, 1.5, 2.4])
@pytest.mark.parametrize("theta", [0.3, 1.0, 1.56, 1.9, 2.8])
def test_projected_cone_is_its_defining_integral_across_the_horizon(a, theta):
    edges = np.unique(np.clip([0.0, abs(PI / 2 - theta), PI - abs(PI / 2 - theta), a], 0.0, a))
    want = 0.0
    for low, high in pairwise(edges):
        u, weight = gauss(0.0, PI, 60)  # alpha = mean - half cos u takes the square roots at the ends away
        alpha = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(u)
        weight = weight * 0.5 * (high - low) * np.sin(u)
        p, q = np.cos(alpha) * np.cos(theta), np.sin(alpha) * np.sin(theta)
        half = np.arccos(np.clip(-p / q, -1.0, 1.0))  # the part of the circle above the horizon
        want += np.sum(weight * 2.0 * (p * half + q * np.sin(half)) * np.sin(alpha))
    close(rad.projected_solid_angle_cone(a, theta), want, rel=1e-10, abs=1e-14)


def square(half, height):
    return np.array([[-half, -half, height], [half, -half, height], [half, half, height], [-half, half, height]])


def parallel_square(half, height):
    """Projected solid angle of a centred square parallel to the receiver: four corner pieces."""
    x = half / height
    return 4.0 * x / np.sqrt(1.0 + x * x) * np.arctan(x / np.sqrt(1.0 + x * x))


@pytest.mark.parametrize("half", [1e-9, 1e-4, 0.5, 30.0, 1e12])
def test_a_parallel_square_has_the_closed_form(half):
    want = parallel_square(half, 1.0)
    close(rad.projected_solid_angle_polygon(square(half, 1.0)), want, rel=1e-14)
    tilt = 0.2 if half < 1.0 else 0.0  # by symmetry the light's vector is along z
    normal = [np.sin(tilt), 0.0, np.cos(tilt)]
    close(rad.projected_solid_angle_polygon(square(half, 1.0), normal), want * np.cos(tilt), rel=1e-14)


def test_projected_triangle_is_its_defining_integral():
    rng = np.random.default_rng(8)
    for _ in range(10):
        polygon = rng.normal(size=(3, 3)) + 4.0 * AXES[2]
        a, b, c = polygon
        n = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
        want = over_triangle(a, b, c, lambda p, n=n: np.abs(p @ n) * p[:, 2] / np.sum(p * p, axis=1) ** 2)
        close(rad.projected_solid_angle_polygon(polygon), want)


def test_what_is_below_the_horizon_gives_nothing():
    rng = np.random.default_rng(9)
    cut = 0
    for polygon, normal in zip(rng.normal(size=(150, 3, 3)), unit_vectors(150, seed=9), strict=True):
        visible = clipped(polygon, normal)
        cut += len(visible) not in (0, 3)
        want = rad.projected_solid_angle_polygon(visible, normal) if len(visible) else 0.0
        close(rad.projected_solid_angle_polygon(polygon, normal), want, rel=1e-9, abs=2e-15)
        if len(visible):  # the two sides of the receiver share the whole contour: E(n) - E(-n) = n · vector
            flipped = rad.projected_solid_angle_polygon(polygon, -normal)
            p, q = polygon, np.roll(polygon, -1, axis=0)
            cross, r = np.cross(p, q), np.linalg.norm(p, axis=1) * np.linalg.norm(q, axis=1)
            sine, cosine = np.linalg.norm(cross, axis=1), np.sum(p * q, axis=1)
            vector = 0.5 * np.sum((np.arctan2(sine, cosine) / sine)[:, None] * cross, axis=0)
            assert np.all(r > 0.0)
            close(np.abs(want - flipped), np.abs(vector @ normal), rel=1e-9, abs=1e-14)
    assert cut > 30
    assert rad.projected_solid_angle_polygon(square(1.0, -1.0)) == 0.0


def test_four_walls_and_a_lid_fill_the_hemisphere():
    lid = rad.projected_solid_angle_polygon(square(1.0, 0.7))
    wall = np.array([[1.0, -1.0, -0.5], [1.0, 1.0, -0.5], [1.0, 1.0, 0.7], [1.0, -1.0, 0.7]])
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    walls = sum(rad.projected_solid_angle_polygon(wall @ np.linalg.matrix_power(quarter, k).T) for k in range(4))
    close(lid + walls, PI, rel=1e-14)


def test_a_polygon_may_be_concave_and_start_at_any_vertex_in_either_sense():
    arrow = np.array([[0.0, 1.0, -0.4], [-1.0, 1.0, 1.0], [0.0, 1.0, 0.3], [1.2, 1.0, 0.9]])
    parts = rad.projected_solid_angle_polygon(arrow[[0, 1, 2]]) + rad.projected_solid_angle_polygon(arrow[[0, 2, 3]])
    for k in range(4):
        close(rad.projected_solid_angle_polygon(np.roll(arrow, k, axis=0)), parts, rel=1e-14)
        close(rad.projected_solid_angle_polygon(np.roll(arrow[::-1], k, axis=0)), parts, rel=1e-14)


@pytest.mark.parametrize("height", [1e3, 1.0, 1e-3])
def test_a_ceiling_close_above_a_tilted_receiver(height):
    # An infinite ceiling fills the hemisphere but for the wedge below its own horizon: π (1 + cosβ)/2.
    tilt = np.array([0.0, 0.3, 1.0, 1.5])
    normal = np.stack([np.sin(tilt) * 0.6, np.sin(tilt) * 0.8, np.cos(tilt)], axis=-1)
    got = rad.projected_solid_angle_polygon(square(1e6, height), normal)
    close(got, PI * (1.0 + np.cos(tilt)) / 2.0, rel=2e-6 * height, abs=2e-15)


@pytest.mark.parametrize("height", [0.1, 1e-3, 1e-6, 1e-8])
def test_a_diagonal_over_the_observer_does_no_harm(height):
    # Fans from different corners meet the observer with different diagonals.
    quad = np.array([[-1, -1, height], [1.1, -1, height], [1, 1, height], [-1, 1.2, height]])
    for normal in unit_vectors(20, seed=11):
        want = rad.projected_solid_angle_polygon(np.roll(quad, 1, axis=0), normal)
        close(rad.projected_solid_angle_polygon(quad, normal), want, rel=1e-14, abs=1e-14)


def test_form_factors_of_unit_squares():
    # Reference values, on which closed form and literature agree: 0.1998248957 and 0.2000437761.
    x, weight = gauss(-0.5, 0.5, 20)
    grid = np.stack([*np.meshgrid(x, x, indexing="ij"), np.zeros((20, 20))], axis=-1)[..., None, :]
    facing = rad.projected_solid_angle_polygon(square(0.5, 1.0) - grid) / PI
    close(weight @ facing @ weight, 0.1998248957, rel=3e-10)
    # A wall that stands on the edge x = 0 of the floor; x = u³ because the integrand is singular there.
    u, wu = gauss(0.0, 1.0, 40)
    floor = np.stack([*np.meshgrid(u**3, x + 0.5, indexing="ij"), np.zeros((40, 20))], axis=-1)[..., None, :]
    wall = np.array([[0.0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]])
    standing = rad.projected_solid_angle_polygon(wall - floor) / PI
    close((3.0 * u**2 * wu) @ standing @ weight, 0.2000437761, rel=3e-6)


# Relations


def test_radiance_does_not_change_along_a_ray():
    area_1, area_2, r, c1, c2, n = 2e-6, 3e-6, 7.0, 0.8, 0.3, 1.33
    L = 5.0
    G = rad.etendue(area_1, area_2, r, c1, c2)
    close(G, rad.etendue(area_2, area_1, r, c2, c1), rel=1e-15)
    phi = rad.flux(L, G)
    close(phi, rad.intensity(L, area_1, c1) * rad.solid_angle(area_2, r, c2), rel=1e-15)
    arrived = rad.radiance(phi, area_2, rad.solid_angle(area_1, r, c1), c2)
    close(arrived, L, rel=1e-15)
    close(phi / area_2, rad.point_irradiance(rad.intensity(L, area_1, c1), r, c2), rel=1e-15)
    # In a medium: the flux is that of the basic radiance.
    close(rad.flux(L, rad.etendue(area_1, area_2, r, c1, c2, n), n), phi, rel=1e-15)


def test_basic_radiance_survives_refraction():
    # Snell at a flat interface: a beam keeps dA and, loss aside, its flux; its cosθ dω shrinks by 1/n².
    n, theta, d = 1.5, 0.6, 1e-3
    inside = np.arcsin(np.sin([theta, theta + d]) / n)
    outer = rad.projected_solid_angle_latlong_pixel(theta, theta + d, 0.1)
    inner = rad.projected_solid_angle_latlong_pixel(*inside, 0.1)
    L = 7.0
    L_inside = rad.radiance(L * outer, 1.0, inner)
    close(L_inside, n * n * L)
    close(rad.basic_radiance(L_inside, n), rad.basic_radiance(L))


def test_sums_over_directions_converge_to_the_integrals():
    error = []
    for height in (32, 64):
        w, dw = rad.latlong_pixels(height, 2 * height)
        error.append(rad.irradiance(1.0, w, dw) / rad.uniform_irradiance(1.0) - 1.0)
    close(error[1], 3.0e-4, rel=0.01)
    close(error[0] / error[1], 4.0, rel=0.01)  # second order
    for quantity in (rad.exitance, rad.radiosity):
        close(quantity(1.0, w, dw), rad.irradiance(1.0, w, dw), rel=0.0)


def test_gauss_quadrature_gives_the_vector_irradiance():
    # L = 1 + s·w over the upper hemisphere: E = π + (2π/3) s_z.
    z, wz = gauss(0.0, 1.0, 6)
    phi = (np.arange(12) + 0.5) * (2.0 * PI / 12)
    sine = np.sqrt(1.0 - z * z)[:, None]
    w = np.stack(np.broadcast_arrays(sine * np.cos(phi), sine * np.sin(phi), z[:, None]), axis=-1)
    s = np.array([[0.3, -0.2, 0.5], [0.0, 0.0, -0.4]])
    L = 1.0 + w @ s.T
    dw = np.broadcast_to(wz[:, None] * 2.0 * PI / 12, w.shape[:2])
    close(rad.irradiance(L, w, dw), PI + 2.0 * PI / 3.0 * s[:, 2], rel=1e-14)
    close(rad.irradiance(L[..., 0], w, dw), PI + 2.0 * PI / 3.0 * 0.5, rel=1e-14)


def test_irradiance_shapes():
    w, dw = rad.latlong_pixels(4, 8)
    n = unit_vectors(6).reshape(2, 3, 3)
    grey, rgb = np.ones((4, 8)), np.ones((4, 8, 3)) * [1.0, 2.0, 3.0]
    assert rad.irradiance(grey, w, dw).shape == ()
    assert rad.irradiance(grey, w, dw, n).shape == (2, 3)
    assert rad.irradiance(rgb, w, dw).shape == (3,)
    assert rad.irradiance(rgb, w, dw, n).shape == (2, 3, 3)
    close(rad.irradiance(rgb, w, dw, n), rad.irradiance(grey, w, dw, n)[..., None] * [1.0, 2.0, 3.0])
    close(rad.irradiance(rgb, w, dw, n[1, 2]), rad.irradiance(rgb, w, dw, n)[1, 2])
    close(rad.irradiance([2.0, 4.0], [0.0, 0.6, 0.8], 0.5), [0.8, 1.6])  # one direction, two channels
    assert rad.irradiance(3.0, [0.0, 0.0, -1.0], 0.5) == 0.0


def test_a_uniform_sphere_is_a_point_source_by_the_inverse_square_law():
    # E = L Ω with Ω = π r²/d² is exact at any distance, and so is that of a point of intensity L π r².
    r, d = 0.5, np.array([0.6, 2.0, 1e6])
    cone = rad.projected_solid_angle_cone(np.arcsin(r / d))
    close(cone, rad.point_irradiance(rad.intensity(1.0, PI * r * r), d), rel=1e-14)
    close(rad.point_irradiance(2.0, 2.0, [-0.5, 0.0, 0.5]), [0.0, 0.0, 0.25], rel=0.0)


def test_a_closed_lambertian_cavity():
    # B = M + ρ E with E = B everywhere: B = M/(1 − ρ).
    B = 0.0
    for _ in range(200):
        B = rad.radiosity_balance(2.0, 0.8, B)
    close(B, 2.0 / (1.0 - 0.8))
    close(rad.lambertian_exitance(1.5), rad.uniform_irradiance(1.5), rel=0.0)
    # Lambertian under a uniform sky: L = ρ L_sky.
    L = rad.uniform_irradiance(3.0) * (0.4 / PI)
    close(L, 0.4 * 3.0, rel=1e-15)


def test_brdf_of_a_lambertian_surface():
    albedo, L_i, c, dw = 0.3, 4.0, 0.7, 0.01
    dL = albedo / PI * L_i * c * dw
    f = rad.brdf(dL, L_i, c, dw)
    close(rad.lambertian_albedo(f), albedo, rel=1e-15)
    close(rad.convert_reflectance(f, "brdf", "reflectance_factor"), albedo, rel=1e-15)


REFLECTANCES = ["brdf", "reflectance_factor", "brdf_cos_theta_i", "dsf"]


@pytest.mark.parametrize("source", REFLECTANCES)
@pytest.mark.parametrize("target", REFLECTANCES)
def test_reflectance_conversions_close_round_trips(source, target):
    f, ci, co = np.random.default_rng(10).uniform(0.1, 1.0, size=(3, 20))
    there = rad.convert_reflectance(f, source, target, ci, co)
    close(rad.convert_reflectance(there, target, source, ci, co), f, rel=1e-15)
    via = rad.convert_reflectance(rad.convert_reflectance(f, source, "brdf", ci, co), "brdf", target, ci, co)
    close(there, via, rel=1e-15)


def test_reflectance_conversions_are_the_definitions():
    f, ci, co = 0.2, np.array([1.0, 0.5]), np.array([0.25, 1.0])
    close(rad.convert_reflectance(f, "brdf", "dsf", cos_theta_o=co), f * co)
    close(rad.convert_reflectance(f, "brdf", "brdf_cos_theta_i", cos_theta_i=ci), f * ci)
    close(rad.convert_reflectance(f, "brdf", "reflectance_factor"), f * PI)
    # Energy: the DSF integrates over directions to the albedo, with no cosine of its own.
    z, weight = gauss(0.0, 1.0, 8)
    dsf = rad.convert_reflectance(0.6 / PI, "brdf", "dsf", cos_theta_o=z)
    close(2.0 * PI * np.sum(weight * dsf), 0.6, rel=1e-14)
    grazing = rad.convert_reflectance([0.0, 0.1], "dsf", "brdf", cos_theta_o=[0.0, 0.5])
    assert np.isnan(grazing[0])
    assert grazing[1] == 0.2
    assert rad.convert_reflectance(0.1, "dsf", "dsf", cos_theta_o=0.0) == 0.1


def planck(x, form):
    """Planck's law for 3000 K, per nm, per Hz or per cm⁻¹, each from its own textbook form."""
    h, c, kt = 6.62607015e-34, 299792458.0, 1.380649e-23 * 3000.0
    if form == "wavelength":
        m = x * 1e-9
        return 2.0 * h * c**2 / m**5 / np.expm1(h * c / (m * kt)) * 1e-9
    if form == "frequency":
        return 2.0 * h * x**3 / c**2 / np.expm1(h * x / kt)
    k = x * 100.0
    return 2.0 * h * c**2 * k**3 / np.expm1(h * c * k / kt) * 100.0


def test_spectral_conversions_agree_with_plancks_law():
    nm = np.array([300.0, 550.0, 1000.0, 10000.0])
    values = {
        "wavelength": planck(nm, "wavelength"),
        "frequency": planck(299792458.0 / (nm * 1e-9), "frequency"),
        "wavenumber": planck(1e7 / nm, "wavenumber"),
    }
    for source in values:
        for target in values:
            close(rad.convert_spectral(values[source], nm, source, target), values[target], rel=1e-13)


def test_photons():
    # hc/e = 1239.841984... nm: there one watt is 1/e photons per second of one electronvolt.
    one_ev = 6.62607015e-34 * 299792458.0 / 1.602176634e-19 * 1e9
    close(one_ev, 1239.8419843320026)
    close(rad.photon_flux(1.0, one_ev), 1.0 / 1.602176634e-19, rel=1e-15)
    nm = np.array([200.0, 555.0, 2500.0])
    close(rad.radiant_flux(rad.photon_flux(3.0, nm), nm), 3.0, rel=1e-15)
    with pytest.warns(MeaningWarning, match="in micrometres"):
        rad.photon_flux(1.0, nm / 1000.0)


# The table, the contract, and bad input


def test_the_table_of_quantities():
    for name, q in rad.QUANTITIES.items():
        assert name == q.name
        assert all(q)
        for part in q.unit.split():
            assert part.rstrip("-0123456789") in {"W", "J", "m", "sr", "nm", "s", ""} or part == "1"
    assert rad.QUANTITIES["radiance"].unit == "W m-2 sr-1"
    assert rad.QUANTITIES["brdf"].unit == "sr-1"
    assert set(REFLECTANCES) <= set(rad.QUANTITIES)
    with pytest.raises(TypeError):
        rad.QUANTITIES["radiance"] = None


FUNCTIONS = {
    name: f
    for name, f in vars(rad).items()
    if inspect.isfunction(f) and f.__module__.startswith(rad.__name__) and not name.startswith("_")
}


def test_every_function_is_found():
    assert set(FUNCTIONS) == {name for name in rad.__all__ if inspect.isfunction(getattr(rad, name))}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_states_its_contract(name):
    text = inspect.getdoc(FUNCTIONS[name])
    for label in ("shapes", "units", "error", "source"):
        assert label in text.lower(), f"{name}: no {label}"


def test_float32_stays_float32_and_agrees():
    x = np.linspace(0.1, 0.9, 5, dtype=np.float32)
    v = unit_vectors(15).reshape(5, 3, 3)
    v32 = v.astype(np.float32)
    up = np.array([0.0, 0.0, 1.0], np.float32)
    u, w = np.array([1.0, 0.0, 0.0], np.float32), np.array([0.0, 1.0, 0.0], np.float32)
    results = {
        "solid_angle": lambda x, v, up, u, w: rad.solid_angle(x, 2.0),
        "radiance": lambda x, v, up, u, w: rad.radiance(x, 2, 3.0, x),
        "etendue": lambda x, v, up, u, w: rad.etendue(x, x, 2.0),
        "point": lambda x, v, up, u, w: rad.point_irradiance(x, 2.0),
        "uniform": lambda x, v, up, u, w: rad.uniform_irradiance(x),
        "convert": lambda x, v, up, u, w: rad.convert_reflectance(x, "reflectance_factor", "dsf", cos_theta_o=x),
        "spectral": lambda x, v, up, u, w: rad.convert_spectral(x, 500.0, "wavelength", "wavenumber"),
        "cone": lambda x, v, up, u, w: rad.solid_angle_cone(x),
        "pixel": lambda x, v, up, u, w: rad.solid_angle_latlong_pixel(x, 1.0, 0.1),
        "sphere": lambda x, v, up, u, w: rad.solid_angle_sphere(x, 2.0),
        "triangle": lambda x, v, up, u, w: rad.solid_angle_triangle(v[:, 0], v[:, 1], v[:, 2]),
        "rectangle": lambda x, v, up, u, w: rad.solid_angle_rectangle(up, u, w),
        "irradiance": lambda x, v, up, u, w: rad.irradiance(x, v[:, 0], x),
        "projected cone": lambda x, v, up, u, w: rad.projected_solid_angle_cone(x, x),
        "polygon": lambda x, v, up, u, w: rad.projected_solid_angle_polygon(v),
    }
    for name, f in results.items():
        got = f(x, v32, up, u, w)
        assert got.dtype == np.float32, name
        close(got, f(x.astype(float), v32.astype(float), *(a.astype(float) for a in (up, u, w))), 2e-5, 1e-6)


def test_nan_in_gives_nan_out_and_leaves_the_others_alone():
    nan = np.nan
    close(rad.solid_angle([1.0, 4.0], 2.0), [0.25, 1.0])
    for got in (
        rad.solid_angle([nan, 4.0], 2.0),
        rad.point_irradiance(1.0, 1.0, [nan, 1.0]),
        rad.solid_angle_cone([nan, 1.0]),
        rad.solid_angle_sphere([nan, 1.0], 2.0),
        rad.projected_solid_angle_cone([nan, 1.0], 0.2),
        rad.projected_solid_angle_latlong_pixel([nan, 0.1], 1.0, 1.0),
        rad.convert_reflectance([nan, 1.0], "brdf", "reflectance_factor"),
        rad.solid_angle_triangle([[nan, 0, 1], [1, 0, 1]], [0, 1, 1], [1, 1, 1]),
        rad.solid_angle_rectangle([[nan, 0, 1], [1, 0, 1]], [0, 1, 0], [1, 0, 0]),
        rad.projected_solid_angle_polygon([[[1, 0, 1], [0, nan, 1], [1, 1, 1]], [[1, 0, 1], [0, 1, 1], [1, 1, 1]]]),
        rad.projected_solid_angle_polygon([[1, 0, 1], [0, 1, 1], [1, 1, 1]], [[nan, 0, 0], [0, 0, 1]]),
        rad.irradiance(np.array([[nan, 1.0]]), [[0, 0, 1]], 1.0),
    ):
        assert np.isnan(got[0])
        assert np.isfinite(got[1])
        assert got[1] > 0.0


BAD = {
    "distance": (
        lambda: rad.solid_angle(1.0, 0.0),
        ParameterError,
        "distance=0: expected numbers above 0:",
    ),
    "one of many": (
        lambda: rad.solid_angle([1, -2, 3], 1),
        ParameterError,
        r"area=-2 \(1 of 3 values\): expected numbers from 0: check",
    ),
    "cosine": (
        lambda: rad.solid_angle(1.0, 1.0, 1.2),
        ParameterError,
        "cos_theta=1.2: expected numbers from 0 to 1: .*not an angle",
    ),
    "grazing": (
        lambda: rad.radiance(1.0, 1.0, 1.0, 0.0),
        ParameterError,
        "cos_theta=0: expected numbers above 0 up to 1",
    ),
    "degrees": (
        lambda: rad.solid_angle_cone(30.0),
        ParameterError,
        r"half_angle=30: .*in degrees\? numpy.radians\(30\) = 0.5236",
    ),
    "width": (
        lambda: rad.solid_angle_latlong_pixel(0.0, 1.0, 7.0),
        ParameterError,
        "width=7: expected numbers from 0 to 2 pi rad",
    ),
    "negative angle": (
        lambda: rad.projected_solid_angle_cone(-1e-9),
        ParameterError,
        "half_angle=-1e-09: expected numbers from 0",
    ),
    "reflectance": (
        lambda: rad.radiosity_balance(1, 1.1, 1),
        ParameterError,
        "reflectance=1.1: expected numbers from 0 to 1",
    ),
    "wavelength": (lambda: rad.photon_flux(1.0, 0.0), ParameterError, "wavelength=0: expected numbers above 0 nm"),
    "radius": (lambda: rad.solid_angle_sphere(-1.0, 2.0), ParameterError, "radius=-1: expected numbers from 0"),
    "broadcast": (
        lambda: rad.solid_angle(np.ones(2), np.ones(3)),
        ShapeError,
        r"area \(2,\), distance \(3,\)",
    ),
    "not a vector": (
        lambda: rad.solid_angle_triangle([1, 2], [1, 2], [1, 2]),
        ShapeError,
        r"a: shape \(2,\); expected \(\.\.\., 3\)",
    ),
    "vertices": (
        lambda: rad.solid_angle_triangle(np.ones((2, 3)), np.ones((4, 3)), np.ones(3)),
        ShapeError,
        r"broadcast .*a \(2,\), b \(4,\), c \(\)",
    ),
    "two vertices": (lambda: rad.projected_solid_angle_polygon(np.ones((2, 3))), ShapeError, "V >= 3"),
    "infinity": (
        lambda: rad.solid_angle_triangle([np.inf, 0, 0], *AXES[1:]),
        ParameterError,
        "a: inf; expected finite",
    ),
    "skew": (
        lambda: rad.solid_angle_rectangle([0, 0, 1], [1, 0, 0], [1, 1, 0]),
        ParameterError,
        "perpendicular",
    ),
    "quantity": (
        lambda: rad.convert_reflectance(1.0, "brf", "brdf"),
        ParameterError,
        "source='brf'.: expected one of 'brdf', .*did you mean 'brdf'",
    ),
    "no cosine": (lambda: rad.convert_reflectance(1.0, "dsf", "brdf"), ParameterError, "pass cos_theta_o="),
    "density": (
        lambda: rad.convert_spectral(1, 500, "wavelength", "energy"),
        ParameterError,
        "target='energy'.: expected one of 'wavelength'",
    ),
    "pixels": (
        lambda: rad.latlong_pixels(0, 3),
        ParameterError,
        "height must be a whole number from 1, got 0",
    ),
    "half pixels": (lambda: rad.latlong_pixels(2, 2.5), ParameterError, "width must be a whole number"),
    "radiance shape": (
        lambda: rad.irradiance(np.ones(2), np.ones((3, 3)), 1),
        ShapeError,
        r"\(3,\) or \(3, 'C'\)",
    ),
    "complex": (lambda: rad.uniform_irradiance(1j), ArrayTypeError, "L=1j: complex128, .*expected real numbers"),
    "text": (lambda: rad.uniform_irradiance("1"), ArrayTypeError, "L='1': <U1, .*expected real numbers"),
    "ragged": (
        lambda: rad.uniform_irradiance([[1, 2], [3]]),
        ArrayTypeError,
        r"L=\[\[1, 2\], \[3\]\]: rows of unequal length; expected",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_says_rule_value_and_next_step(case):
    call, error, message = BAD[case]
    with pytest.raises(error, match=message) as raised:
        call()
    assert ": " in str(raised.value)
