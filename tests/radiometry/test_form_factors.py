"""Form factors: each closed form against the integral that defines it, reciprocity, closed rooms, bad input."""

import numpy as np
import pytest

from gonio.errors import ParameterError, ShapeError
from gonio.radiometry import form_factors as ff

PI = np.pi
UP = np.array([0.0, 0.0, 1.0])
SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])


def close(got, want, rel=1e-10, abs=1e-12):
    np.testing.assert_allclose(got, want, rtol=rel, atol=abs, equal_nan=False)


def gauss(low, high, n=40):
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (high - low) * (x + 1.0) + low, 0.5 * (high - low) * w


def ended(low, high):
    """Nodes and weights of an integral whose ends are singular: a Gauss rule in t, x = t³ (10 − 15t + 6t²), squared."""
    t, w = gauss(0.0, 1.0, 60)
    for _ in range(2):
        t, w = t**3 * (10.0 - 15.0 * t + 6.0 * t * t), w * 30.0 * t * t * (1.0 - t) ** 2
    return low + (high - low) * t, (high - low) * w


def grid(u, v, point, normal):
    """Points, normals and areas of a surface point(u, v) with unit normals, from two rules."""
    (s, ws), (t, wt) = u, v
    s, t = np.meshgrid(s, t, indexing="ij")
    eps = 1e-6
    x = np.stack(np.broadcast_arrays(*point(s, t)), -1).reshape(-1, 3)
    du, dv = (
        (
            np.stack(np.broadcast_arrays(*point(s + a, t + b)), -1)
            - np.stack(np.broadcast_arrays(*point(s - a, t - b)), -1)
        )
        / (2 * eps)
        for a, b in ((eps, 0.0), (0.0, eps))
    )
    area = np.linalg.norm(np.cross(du, dv), axis=-1).reshape(-1) * np.outer(ws, wt).reshape(-1)
    n = np.stack(np.broadcast_arrays(*normal(s, t)), -1).reshape(-1, 3)
    return x, n, area


def factor(one, other):
    """1/A₁ ∫∫ cosθ₁ cosθ₂/(π r²) dA₂ dA₁ above both horizons."""
    (x, n, a), (y, m, b) = one, other
    total = 0.0
    for start in range(0, len(x), 256):
        r = y - x[start : start + 256, None]
        r2 = np.sum(r * r, -1)
        cos = np.maximum(np.sum(r * n[start : start + 256, None], -1), 0.0)
        total += np.sum(a[start : start + 256, None] * b * cos * np.maximum(-np.sum(r * m, -1), 0.0) / (PI * r2 * r2))
    return total / np.sum(a)


def rectangle(a, b, z, up, n=14):
    x, w = gauss(0.0, 1.0, n)
    return grid((a * x, a * w), (b * x, b * w), lambda s, t: (s, t, z + 0.0 * s), lambda s, t: (0.0 * s, 0.0, up))


def disk(radius, z, up, n=14):
    phi = (np.arange(2 * n) * PI / n, np.full(2 * n, PI / n))
    return grid(
        gauss(0.0, radius, n), phi, lambda r, p: (r * np.cos(p), r * np.sin(p), z), lambda r, p: (0.0 * r, 0.0, up)
    )


def element(theta=0.0):
    return np.zeros((1, 3)), np.array([[np.sin(theta), 0.0, np.cos(theta)]]), np.ones(1)


NEAR = 1e-8  # surfaces' areas are differences of points


def test_from_an_element():
    corner = rectangle(0.7, 1.9, 0.8, -1.0, 40)
    close(ff.point_to_parallel_rectangle(0.7, 1.9, 0.8), factor(element(), corner), rel=NEAR)
    x, n, a = corner  # the same rectangle seen by an element whose normal is the rectangle's x axis
    close(ff.point_to_perpendicular_rectangle(1.9, 0.7, 0.8), factor(element(PI / 2), (x, n, a)), rel=NEAR)
    for offset in (0.0, 0.4, 1.5):
        x, n, a = disk(0.9, 0.6, -1.0, 30)
        want = factor(element(), (x + np.array([offset, 0.0, 0.0]), n, a))
        close(ff.point_to_disk(0.9, 0.6, offset), want, rel=NEAR)
    corners = np.array([[0.0, 0.0, 0.8], [0.7, 0.0, 0.8], [0.7, 1.9, 0.8], [0.0, 1.9, 0.8]])
    close(ff.point_to_polygon(corners), ff.point_to_parallel_rectangle(0.7, 1.9, 0.8))
    close(ff.point_to_polygon(corners, [1.0, 0.0, 0.0]), ff.point_to_perpendicular_rectangle(1.9, 0.7, 0.8))


def test_an_element_and_a_sphere():
    close(ff.point_to_sphere(0.5, 1.0, 0.4), 0.25 * np.cos(0.4))
    tall = np.linspace(0.0, PI, 9)
    rim = ff.point_to_sphere(0.6, 1.0, tall)
    assert np.all(np.diff(rim) <= 0.0) and rim[-1] == 0.0
    polar, turn = gauss(0.0, np.arcsin(0.6), 200), (np.arange(400) * PI / 200, np.full(400, PI / 200))
    a, p = np.meshgrid(polar[0], turn[0], indexing="ij")
    cosine = np.cos(a) * np.cos(1.2) + np.sin(a) * np.cos(p) * np.sin(1.2)
    want = np.sum(np.outer(polar[1], turn[1]) * np.sin(a) * np.maximum(cosine, 0.0)) / PI
    close(ff.point_to_sphere(0.6, 1.0, 1.2), want, rel=1e-5)


def test_rectangles_and_disks():
    close(
        ff.parallel_rectangles(0.7, 1.9, 0.8), factor(rectangle(0.7, 1.9, 0, 1), rectangle(0.7, 1.9, 0.8, -1)), rel=NEAR
    )
    close(ff.coaxial_disks(0.7, 1.1, 0.8), factor(disk(0.7, 0.0, 1.0), disk(1.1, 0.8, -1.0)), rel=NEAR)
    # perpendicular ones: the integral over the first of the closed form from an element, on either side of it
    x, wx = ended(0.0, 0.6)
    y, wy = ended(0.0, 1.3)
    x, y = x[:, None], y[None, :]
    wall = ff.point_to_perpendicular_rectangle(y, 0.9, x) + ff.point_to_perpendicular_rectangle(y[:, ::-1], 0.9, x)
    close(ff.perpendicular_rectangles(1.3, 0.6, 0.9), np.einsum("i,j,ij", wx, wy, wall) / (0.6 * 1.3), rel=1e-9)


def test_spheres():
    turn = (np.arange(24) * PI / 12, np.full(24, PI / 12))
    ball = grid(gauss(0.0, PI, 24), turn, *[lambda a, p: (np.sin(a) * np.cos(p), np.sin(a) * np.sin(p), np.cos(a))] * 2)
    small = (0.3 * ball[0], ball[1], 0.09 * ball[2])
    close(ff.sphere_to_disk(0.8, 1.5), factor(small, disk(0.8, 1.5, -1.0)), rel=1e-3)  # horizons cut the integrand
    want = ff.sphere_to_rectangle(0.7, 0.9, 1.5)
    close(want, factor(small, rectangle(0.7, 0.9, 1.5, -1.0)), rel=1e-3)
    inward = (2.0 * ball[0], -ball[1], 4.0 * ball[2])
    close(ff.concentric_spheres(0.3, 2.0), factor(inward, small), rel=5e-3)
    close(ff.sphere_to_disk(0.8, 1e-15), 0.5)
    for angle in (0.3, 1.0, PI / 2, 2.5):
        cap = grid(
            gauss(0.0, angle, 20), turn, *[lambda a, p: (np.sin(a) * np.cos(p), np.sin(a) * np.sin(p), np.cos(a))] * 2
        )
        r2 = np.sum(np.square(cap[0][:, None] - cap[0]), -1)
        kernel = np.where(r2 > 0.0, 1.0 / (4.0 * PI), 1.0 / (4.0 * PI))
        close(ff.spherical_cavity(angle), np.sum(cap[2] @ kernel @ cap[2]) / np.sum(cap[2]), rel=NEAR)


def test_cylinders_and_cones_close_with_their_ends():
    r, h = 0.7, np.array([0.01, 0.5, 1.0, 30.0])
    base, side = PI * r * r, 2.0 * PI * r * h
    close(2.0 * ff.cylinder_to_base(r, h) + ff.cylinder_to_itself(r, h), 1.0)
    close(ff.coaxial_disks(r, r, h) + ff.cylinder_to_base(r, h) * side / base, 1.0)
    close(ff.conical_cavity(r, h) + base / (PI * r * np.hypot(r, h)), 1.0)
    phi = (np.arange(40) * PI / 20, np.full(40, PI / 20))
    wall = grid(
        gauss(0.5, 1.5, 16), phi, lambda z, p: (np.cos(p), np.sin(p), z), lambda z, p: (-np.cos(p), -np.sin(p), 0.0 * z)
    )
    end = ff.cylinder_to_base(1.0, 1.5) * 1.5 - ff.cylinder_to_base(1.0, 0.5) * 0.5  # of the part from 0.5 to 1.5
    close(end, factor(wall, disk(1.0, 0.0, 1.0)), rel=NEAR)


def test_strips_cylinders_and_tubes_are_crossed_strings():
    """Over a closed section in two dimensions, by the angles that a point sees: ∫ cosθ dθ/2."""

    def seen(x, lines):
        return sum(abs(np.sin(np.arctan2(b[0] - x, b[1])) - np.sin(np.arctan2(a[0] - x, a[1]))) for a, b in lines) / 2.0

    x, w = ended(0.0, 1.3)
    close(ff.parallel_strips(1.3, 0.7, 0.5), np.sum(w * seen(x, [((0.3, 0.5), (1.0, 0.5))])) / 1.3)
    end = 0.8 * np.cos(1.1), 0.8 * np.sin(1.1)
    close(ff.strips_at_angle(1.3, 0.8, 1.1), np.sum(w * seen(x, [((0.0, 0.0), end)])) / 1.3, rel=1e-9)
    # tubes: of the rays cosθ dθ/2 in the plane those that meet the row, by shadows d/cosθ wide over the spacing
    theta, w = gauss(-PI / 2, PI / 2, 400)
    hit = np.minimum(1.0, 0.4 / np.cos(theta))
    close(ff.plane_to_tubes(0.4, 1.0), np.sum(w * np.cos(theta) * hit) / 2.0, rel=1e-4)
    # cylinders: lines of direction θ have a measure dp dθ; those that meet both are counted by their shadows
    t, w = gauss(0.0, PI / 2, 400)
    overlap = np.maximum(0.0, 2.0 - 2.7 * np.sin(t))
    close(ff.parallel_cylinders(1.0, 0.7), 2.0 * np.sum(w * overlap) / (4.0 * PI), rel=1e-4)
    close(ff.parallel_cylinders(1.0, 0.0), 0.5 - 1.0 / PI)


def by_lambert(one, other, split):
    """A₁F12 of triangles: the form factor of an element, integrated over the first, singular towards edge `split`."""
    a, b, c = np.roll(one, -split, axis=0)  # edge a b
    n = np.cross(b - a, c - a)
    (s, ws), (t, wt) = ended(0.0, 1.0), ended(0.0, 1.0)
    s, t = s[:, None, None], t[None, :, None]
    x = (a + s * (b - a)) * (1.0 - t) + t * c
    weight = ws[:, None] * wt * (1.0 - t[..., 0]) * np.linalg.norm(n)
    return np.sum(weight * ff.point_to_polygon(other - x[..., None, :], n / np.linalg.norm(n)))


def test_polygons_apart_and_touching():
    rng = np.random.default_rng(0)
    for angle in (0.01, 0.5, 1.5, 2.5, 3.1):
        first = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [rng.uniform(-0.5, 1.5), 0.8, 0.0]])
        tip = 0.7 * np.array([0.0, np.cos(angle), np.sin(angle)]) + [rng.uniform(0.0, 1.0), 0.0, 0.0]
        second = np.array([first[1], first[0], tip])
        sizes = [0.5 * np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0])) for x in (first, second)]
        got = ff.polygon_to_polygon(first, second)
        if angle > 1.0:  # else the element's factor changes too quickly within the triangle for this rule
            close(got * sizes[0], by_lambert(first, second, 0), rel=0.0, abs=1e-10)
        middle = 0.3 * second[0] + 0.7 * second[2]
        parts = [np.array([second[0], second[1], middle]), np.array([second[1], second[2], middle])]
        close(got, sum(ff.polygon_to_polygon(first, part) for part in parts), rel=0.0, abs=1e-14)
        close(got * sizes[0], ff.polygon_to_polygon(second, first) * sizes[1], rel=0.0, abs=1e-14)
        over = second - second.mean(0) + [0.4, 0.3, 2.0]
        if angle < 1.0:
            close(ff.polygon_to_polygon(first, over) * sizes[0], by_lambert(first, over, 0), rel=0.0, abs=1e-13)


def test_polygons_are_the_closed_forms():
    for d in (0.1, 1.0, 3.0, 50.0):
        close(ff.polygon_to_polygon(SQUARE, SQUARE[::-1] + d * UP), ff.parallel_rectangles(1, 1, d), 0.0, 1e-13)
    for depth, height in ((1.0, 1.0), (0.1, 3.0), (5.0, 0.2)):
        floor = SQUARE * [depth, 1.0, 1.0]
        wall = np.array([[0, 0, 0], [0, 1, 0], [0, 1, height], [0, 0, height]], float)
        close(ff.polygon_to_polygon(floor, wall), ff.perpendicular_rectangles(1.0, depth, height), 0.0, 1e-13)
    tiny = 1e-3 * SQUARE[::-1] + [0.2, 0.3, 1.0]  # its factor to the square is that of an element
    seen = ff.point_to_polygon((SQUARE - tiny.mean(0)), [0.0, 0.0, -1.0])
    close(ff.polygon_to_polygon(tiny, SQUARE), seen, rel=1e-6)


def test_what_is_behind_is_cut_off():
    wall = np.array([[0, 0, -1], [0, 1, -1], [0, 1, 1], [0, 0, 1]], float)  # half of it below the floor
    close(ff.polygon_to_polygon(SQUARE, wall), ff.perpendicular_rectangles(1, 1, 1), 0.0, 1e-13)
    close(ff.polygon_to_polygon(wall, SQUARE), ff.perpendicular_rectangles(1, 1, 1) / 2.0, 0.0, 1e-13)
    assert ff.polygon_to_polygon(SQUARE, SQUARE + UP) == 0.0  # both look up
    assert ff.polygon_to_polygon(SQUARE, SQUARE[::-1] - UP) == 0.0
    assert abs(ff.polygon_to_polygon(SQUARE, SQUARE + np.array([1.0, 0.0, 0.0]))) < 1e-15  # in one plane


def test_reciprocity_and_closed_boxes():
    rng = np.random.default_rng(1)
    for size in (np.array([1.0, 1.0, 1.0]), np.array([0.2, 1.0, 3.0])):
        faces = []
        for axis in range(3):
            for side in (0.0, 1.0):
                face = np.insert(SQUARE[:, :2], axis, side, axis=1) * size
                n = np.cross(face[1] - face[0], face[2] - face[0])
                inside = n @ (0.5 * size - face.mean(0)) > 0.0
                faces.append(face if inside else face[::-1])
        faces = np.array(faces)
        f = ff.polygon_to_polygon(faces[:, None], faces[None, :] + np.zeros((6, 1, 1, 1)))
        np.fill_diagonal(f, 0.0)
        area = np.linalg.norm(np.cross(faces[:, 1] - faces[:, 0], faces[:, 3] - faces[:, 0]), axis=1)
        close(f.sum(1), 1.0, 0.0, 1e-12)
        close(area[:, None] * f, (area[:, None] * f).T, 0.0, 1e-12)
    a, b = rng.normal(size=(2, 300, 3, 3)) + np.array([[[[0.0, 0, 0]]], [[[0.0, 0, 4.0]]]])
    size = [0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) for x in (a, b)]
    close(size[0] * ff.polygon_to_polygon(a, b), size[1] * ff.polygon_to_polygon(b, a), 0.0, 1e-13)


def test_shapes_and_single_precision():
    assert ff.coaxial_disks(np.ones((2, 1)), np.ones(3), 1.0).shape == (2, 3)
    many = np.broadcast_to(SQUARE, (5, 1, 4, 3))
    assert ff.polygon_to_polygon(many, SQUARE[::-1] + UP).shape == (5, 1)
    assert ff.parallel_rectangles(np.float32(1.0), np.float32(1.0), np.float32(1.0)).dtype == np.float32
    assert np.isnan(ff.polygon_to_polygon(np.full((4, 3), np.nan), SQUARE))
    single = SQUARE.astype(np.float32)
    assert ff.polygon_to_polygon(single, single[::-1] + np.float32([0, 0, 1])).dtype == np.float32


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda: ff.coaxial_disks(0.0, 1.0, 1.0), ParameterError, "radius_1=0: expected numbers above 0"),
        (lambda: ff.point_to_sphere(2.0, 1.0), ParameterError, "inside the sphere"),
        (lambda: ff.concentric_spheres(2.0, 1.0), ParameterError, "radius must be at most outer"),
        (lambda: ff.plane_to_tubes(2.0, 1.0), ParameterError, "do not overlap"),
        (lambda: ff.polygon_to_polygon(SQUARE[:2], SQUARE), ShapeError, "vertices_1: shape"),
        (lambda: ff.polygon_to_polygon(0.0 * SQUARE, SQUARE), ParameterError, "vertices_1 has no area"),
        (lambda: ff.polygon_to_polygon(SQUARE + np.eye(4)[:, :3] * 0.1, SQUARE), ParameterError, "not plane"),
    ],
)
def test_bad_input(call, error, words):
    with pytest.raises(error, match=words):
        call()
