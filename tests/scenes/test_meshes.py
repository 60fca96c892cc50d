"""Pictures of meshes: closed forms, Mitsuba's pictures, shadows, materials by part, and meshes that are refused."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from house import WHITE_FACETS
from libraries import thinned

import gonio as gn
import gonio.authoring
from gonio.errors import DependencyError, NotFoundError, ParameterError, ShapeError
from gonio.scenes import _bodies
from gonio.scenes.estimator import MARGIN
from gonio.scenes.mesh import smoothed

STUDIO = gn.EnvironmentLight.studio(height=32)
METAL = WHITE_FACETS
WHITE = gn.Lambertian(1.0)
EVEN = gn.ConstantLight(1.0)

CUBE = (
    np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]),
    np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]),
)
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float), np.array([[0, 1, 2, 3]])
ABOVE = gn.scenes.OrthographicCamera([0, 0, 4], up=[0, 1, 0], width=2.0)


def ball(rows, radius=1.0, centre=(0.0, 0.0, 0.0)):
    """A sphere of 4 rows^2 triangles about, as vertices and faces."""
    theta, phi = np.meshgrid(np.linspace(0, math.pi, rows + 1), np.arange(2 * rows) * (math.pi / rows), indexing="ij")
    vertices = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    i, j = np.mgrid[:rows, : 2 * rows]
    a, b = i * 2 * rows + j, (i + 1) * 2 * rows + j
    c, d = (i + 1) * 2 * rows + (j + 1) % (2 * rows), i * 2 * rows + (j + 1) % (2 * rows)
    faces = np.concatenate([np.stack([a, b, c], -1)[:-1].reshape(-1, 3), np.stack([a, c, d], -1)[1:].reshape(-1, 3)])
    return vertices.reshape(-1, 3).round(12) * radius + np.array(centre), faces


def test_a_white_convex_mesh_in_a_furnace_is_one():
    camera = gn.scenes.Camera([2.0, -3.0, 2.5], field_of_view=0.5)
    for shape in (CUBE, gn.scenes.Mesh(ball(8), crease=0.0)):
        mesh = shape if isinstance(shape, gn.scenes.Mesh) else gn.scenes.Mesh(shape)
        picture = gn.render(WHITE, EVEN, mesh, size=32, camera=camera)
        inside = picture.alpha == 1.0
        assert inside.sum() > 200
        np.testing.assert_allclose(picture.pixels[inside], 1.0, rtol=1e-5)


@pytest.mark.parametrize("samples", thinned([64, 256], [64]))
def test_finer_spheres_come_nearer_to_the_sphere(samples):
    """Facets err by their size, where normals are their own, smooth ones by its square."""
    sun = gn.DistantLight([0.3, -0.9, 0.3], math.pi)
    exact = gn.render(WHITE, sun, size=32, samples=samples).pixels

    def error(rows, crease):
        picture = gn.render(WHITE, sun, gn.scenes.Mesh(ball(rows), crease=crease), size=32, samples=samples)
        return np.abs(picture.pixels - exact)[10:22, 10:22].mean()

    facets, smooth = ([error(rows, crease) for rows in (6, 12, 24)] for crease in (0.0, 1.0))
    assert facets[0] > 1.6 * facets[1] > 2.5 * facets[2]
    assert smooth[0] > 2.8 * smooth[1] > 7.8 * smooth[2]
    assert smooth[2] < 5e-3 < facets[2]


@pytest.fixture(scope="module")
def mi():
    mitsuba = pytest.importorskip("mitsuba")
    before = mitsuba.variant()
    mitsuba.set_variant("scalar_rgb")
    yield mitsuba
    if before is not None:
        mitsuba.set_variant(before)


def test_mitsuba_shows_the_same_mesh(mi, tmp_path):
    """A ring with smooth normals, which shadows itself, seen in perspective: the mean, and blocks of it."""
    rows, size = 12, 24
    a, b = np.meshgrid(np.arange(4 * rows) * (0.5 * math.pi / rows), np.arange(rows) * (2 * math.pi / rows))
    r = 0.7 + 0.3 * np.cos(b)
    vertices = np.stack([r * np.cos(a), r * np.sin(a), 0.3 * np.sin(b)], -1).reshape(-1, 3)
    i, j = np.mgrid[:rows, : 4 * rows]
    after, next_j = (i + 1) % rows, (j + 1) % (4 * rows)
    faces = np.stack([i * 4 * rows + j, i * 4 * rows + next_j, after * 4 * rows + next_j, after * 4 * rows + j], -1)
    mesh = gn.scenes.Mesh((vertices, faces.reshape(-1, 4)), crease=math.pi)
    eye, angle, m = [1.0, -2.5, 2.0], 0.7, gn.Lambertian(0.5)
    held = mi.Mesh("ring", len(vertices), len(mesh.triangles.faces), has_vertex_normals=True)
    normals = np.zeros_like(vertices)
    normals[mesh.triangles.faces.reshape(-1)] = mesh.normals[:, 3:].reshape(-1, 3)
    values = mi.traverse(held)
    values["vertex_positions"] = vertices.astype(np.float32).reshape(-1)
    values["vertex_normals"] = normals.astype(np.float32).reshape(-1)
    values["faces"] = mesh.triangles.faces.astype(np.uint32).reshape(-1)
    values.update()
    held.write_ply(str(tmp_path / "ring.ply"))
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": True},
            "sensor": {
                "type": "perspective",
                "fov": math.degrees(angle),
                "to_world": mi.ScalarTransform4f().look_at(origin=eye, target=[0, 0, 0], up=[0, 0, 1]),
                "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
                "sampler": {"type": "multijitter", "sample_count": 1024},
            },
            "ring": {
                "type": "ply",
                "filename": str(tmp_path / "ring.ply"),
                "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}},
            },
            "light": {
                "type": "envmap",
                "bitmap": mi.Bitmap(np.ascontiguousarray(STUDIO.to_mitsuba().pixels, dtype=np.float32)),
                "to_world": mi.ScalarTransform4f(STUDIO.MITSUBA_TO_WORLD.tolist()),
            },
        }
    )
    theirs = np.array(mi.render(scene))[..., :3]
    picture = gn.render(m, STUDIO, mesh, size, 1024, camera=gn.scenes.Camera(eye, field_of_view=angle))
    ours = picture.pixels * picture.alpha[..., None]
    assert abs(ours.mean() / theirs.mean() - 1.0) < 2e-3
    ours, theirs = (x.reshape(4, 6, 4, 6, 3).mean(axis=(1, 3)) for x in (ours, theirs))
    np.testing.assert_allclose(ours, theirs, rtol=2e-2, atol=2e-3)


def elsewhere(shift, scale=1.0, lamps=3, ground=None):
    """A picture of two balls in each other's shadow, under lamps near to them; all shifted by so many sizes."""

    def at(p):
        return scale * np.asarray(p, float) + scale * shift * np.array([1.0, -0.7, 0.3])

    size, (vertices, faces), half_a_turn = scale * np.eye(3), ball(6), np.array([-1.0, -1.0, 1.0])
    lights = [
        gn.TurnedLight(gn.PointLight(half_a_turn * at([-1.5, -3.0, 2.0]), 20.0 * scale**2), math.pi),
        gn.RectangleLight(at([1.5, -2.0, 2.0]), size[0], -0.7 * size[1], 5.0),
        gn.MeshLight((at([[-2, -2, 2], [-1, -2, 2.2], [-1.5, -1.5, 2.5]]), [[0, 1, 2]]), 9.0),
    ]
    balls = gn.Scene(
        [gn.scenes.Mesh((at(vertices), faces)), gn.scenes.Mesh((at(0.3 * vertices + [1.0, -0.5, 0.8]), faces))]
    )
    camera = gn.scenes.Camera(at([1.5, -4.0, 1.5]), target=at([0.0, 0.0, 0.0]))
    return gn.render(WHITE, lights[:lamps], balls, size=16, samples=8, camera=camera, ground=ground).pixels


def test_pictures_are_the_same_of_whatever_size_a_scene_is():
    here = elsewhere(0.0)
    for shift, scale in ((1e5, 1e-9), (0.0, 1e9)):
        np.testing.assert_allclose(elsewhere(shift, scale), here, atol=1e-4 * here.mean())


def test_pictures_by_the_own_tree_are_the_same_wherever_a_scene_is(monkeypatch):
    def missing(*_):
        raise DependencyError("not installed")

    monkeypatch.setattr(_bodies, "EmbreeTriangles", missing)
    here = elsewhere(0.0, lamps=1)
    np.testing.assert_allclose(elsewhere(1e7, lamps=1), here, atol=1e-4 * here.mean())


def test_the_ground_and_its_texture_stay_below_a_scene_wherever_it_is():
    ground = gn.Lambertian(gn.Texture(np.random.default_rng(0).random((4, 4))))
    here = elsewhere(0.0, lamps=1, ground=ground)
    np.testing.assert_allclose(elsewhere(1e7, lamps=1, ground=ground), here, atol=1e-4 * here.mean())


def test_normals_are_smooth_wherever_a_mesh_is():
    vertices, faces = ball(8)
    normals = gn.scenes.Mesh((vertices + np.array([1e7, 3e6, -2e6]), faces)).normals
    np.testing.assert_allclose(normals, gn.scenes.Mesh((vertices, faces)).normals, atol=1e-6)


class _Glow(gn.authoring.Light):
    """Light of a sky that is dark below a level.

    Shapes   level: a number.
    Units    level: m.
    Error    none.
    Source   made up.
    """

    level = gn.authoring.param(0.0, -1e30, 1e30, "the level", unit="m")

    def seen(self, p, w):
        return gn.authoring.ops.where(p.z > self.level, 1.0, 0.0), 1e30


def test_lights_of_ones_own_that_ask_where_they_are_stay_where_they_are():
    for height in (0.0, 7.0):
        light, cube = _Glow(height), gn.scenes.Mesh((CUBE[0] + [3.0, 0.0, height], CUBE[1]))
        camera = gn.scenes.OrthographicCamera([3.0, -4.0, height], target=[3.0, 0.0, height], width=1.0)
        picture = gn.render(WHITE, light, cube, size=8, samples=16, camera=camera).pixels[..., 0]
        np.testing.assert_allclose(picture[:4], 1.0, rtol=0.2)
        assert (picture[4:] == 0.0).all()


def test_derivatives_by_the_angle_of_a_light_that_goes_round_a_far_axis():
    square = gn.scenes.Mesh((SQUARE[0] * 0.1 + [3.0, 1.0, 0.0], SQUARE[1]))
    camera = gn.scenes.OrthographicCamera([3.0, 1.0, 4.0], target=[3.0, 1.0, 0.0], up=[0, 1, 0], width=0.1)
    arguments = {"shape": square, "size": 4, "samples": 4, "camera": camera}

    def light(angle):
        return gn.TurnedLight(gn.PointLight([2.0, -1.5, 1.0], 5.0), angle)

    _, slopes = gn.scenes.picture_jacobian(gn.Lambertian(0.5), light(0.4), "lights.0.angle", **arguments)
    up, down = (gn.render(gn.Lambertian(0.5), light(0.4 + x), **arguments).pixels for x in (1e-2, -1e-2))
    np.testing.assert_allclose(slopes["lights.0.angle"].pixels, (up - down) / 2e-2, rtol=2e-3)


def test_a_mesh_takes_the_light_of_what_is_behind_it():
    """The shadow of a square on a floor 0.5 below, by light that falls at an angle; seen from below the square."""
    floor = gn.scenes.Mesh((SQUARE[0] * 2.0, SQUARE[1]))
    shade = gn.scenes.Mesh((SQUARE[0] * 0.5 + [0, 0, 0.5], SQUARE[1]))
    camera = gn.scenes.OrthographicCamera([0, 0, 0.4], up=[0, 1, 0], width=2.0)
    for light in (gn.DistantLight([0.6, 0.0, 0.8], math.pi / 0.8), gn.SunLight([0.6, 0.0, 0.8])):
        picture = gn.render(WHITE, light, gn.Scene([floor, shade]), size=32, samples=16, camera=camera).pixels[..., 0]
        y, x = (np.mgrid[:32, :32] + 0.5) / 16.0 - 1.0
        outside = np.maximum(np.abs(x + 0.375), np.abs(y)) - 0.5  # the ray rises by 0.5 over 0.375
        assert picture[outside < -0.05].max() == 0.0
        bright = picture[outside > 0.05]
        np.testing.assert_allclose(bright, bright[0], rtol=1e-3)
        assert bright[0] > 0.0


def test_shadows_of_lights_with_extent_are_soft():
    """Irradiance under a square lamp behind a half plane, by the closed form of the part that is not hidden."""
    lamp = gn.RectangleLight([0.0, 0.0, 2.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], radiance=3.0)
    screen = np.array([[-9, -9, 1], [0, -9, 1], [0, 9, 1], [-9, 9, 1]], float), SQUARE[1]
    scene = gn.Scene([gn.scenes.Mesh(SQUARE), gn.scenes.Mesh(screen)])
    camera = gn.scenes.OrthographicCamera([0, 0, 0.5], up=[0, 1, 0], width=0.4)
    picture = gn.render(WHITE, lamp, scene, size=8, samples=2048, camera=camera)
    at = (np.arange(8) + 0.5) * 0.05 - 0.2
    # From (x, 0, 0) the screen's edge is seen against the lamp at -x: what is to the right of that shines.
    for column, x in enumerate(at):
        half = gn.RectangleLight([0.5 * (0.5 - x), 0.0, 2.0], [0.5 + x, 0.0, 0.0], [0.0, -1.0, 0.0], radiance=3.0)
        expected = gn.irradiance(half, [x, 0.0, 0.0], [0.0, 0.0, 1.0]) / math.pi
        np.testing.assert_allclose(picture.pixels[3:5, column, 0].mean(), expected, rtol=1.5e-2)


def test_parts_have_their_materials():
    left, right = (gn.scenes.Mesh((SQUARE[0] * 0.5 + [x, 0, 0], SQUARE[1])) for x in (-0.5, 0.5))
    red, gray = gn.Lambertian([0.8, 0.1, 0.1]), gn.Lambertian(0.3)
    both = gn.Scene(
        [gn.scenes.Mesh((SQUARE[0] * 0.5 + [x, 0, 0], SQUARE[1]), m) for x, m in ((-0.5, red), (0.5, gray))]
    )
    picture = gn.render(both, EVEN, size=16, samples=8, camera=ABOVE)
    np.testing.assert_allclose(picture.pixels[8, 4], [0.8, 0.1, 0.1], rtol=1e-5)
    np.testing.assert_allclose(picture.pixels[8, 12], 0.3, rtol=1e-5)
    alone = gn.render(gray, EVEN, gn.Scene([left, right]), size=16, samples=8, camera=ABOVE)
    np.testing.assert_allclose(alone.pixels[8, [4, 12]], 0.3, rtol=1e-5)
    mixed = gn.render(gray, EVEN, gn.Scene([right, both.parts[0]]), size=16, samples=8, camera=ABOVE)
    np.testing.assert_array_equal(mixed.pixels, picture.pixels)


def test_a_spectral_part_beside_a_gray_one():
    spectral = gn.Lambertian([0.2, 0.4, 0.6, 0.5], wavelengths=[450.0, 520.0, 600.0, 650.0])
    scene = gn.Scene(
        [
            gn.scenes.Mesh((SQUARE[0] * 0.5 + [x, 0, 0], SQUARE[1]), m)
            for x, m in ((-0.5, spectral), (0.5, gn.Lambertian(0.3)))
        ]
    )
    picture = gn.render(scene, EVEN, size=16, samples=8, camera=ABOVE)
    alone = gn.render(spectral, EVEN, size=8, samples=8)
    np.testing.assert_allclose(picture.pixels[8, 4], alone.pixels[4, 4], rtol=1e-4)
    np.testing.assert_allclose(picture.pixels[8, 12], 0.3, rtol=1e-5)


def test_the_same_picture_again_and_on_from_a_checkpoint(tmp_path):
    scene = gn.Scene(
        [gn.scenes.Mesh(ball(6, 0.5, (x, 0.0, 0.0)), m) for x, m in ((-0.6, METAL), (0.6, gn.Lambertian(0.4)))]
    )
    arguments = {"lights": STUDIO, "size": 12, "ground": gn.Lambertian(0.6), "backdrop": True}
    whole = gn.render(scene, samples=96, **arguments)
    np.testing.assert_array_equal(gn.render(scene, samples=96, **arguments).pixels, whole.pixels)
    file = tmp_path / "picture.npz"
    gn.render(scene, samples=32, checkpoint=file, **arguments)
    same = gn.Scene(
        [gn.scenes.Mesh(ball(6, 0.5, (x, 0.0, 0.0)), m) for x, m in ((-0.6, METAL), (0.6, gn.Lambertian(0.4)))]
    )
    np.testing.assert_array_equal(gn.render(same, samples=96, checkpoint=file, **arguments).pixels, whole.pixels)
    moved = gn.Scene(
        [gn.scenes.Mesh(ball(6, 0.5, (x, 0.1, 0.0)), m) for x, m in ((-0.6, METAL), (0.6, gn.Lambertian(0.4)))]
    )
    with pytest.raises(ParameterError, match="another picture"):
        gn.render(moved, samples=96, checkpoint=file, **arguments)
    was = gn.engine.threads()
    try:
        gn.engine.threads(1)
        np.testing.assert_array_equal(gn.render(scene, samples=96, **arguments).pixels, whole.pixels)
    finally:
        gn.engine.threads(was)


def test_the_own_tree_finds_what_embree_finds(monkeypatch):
    arguments = {"lights": STUDIO, "size": 24, "samples": 32}
    by_embree = gn.render(gn.Lambertian(0.5), shape=gn.scenes.Mesh(ball(12)), **arguments)

    def missing(*_):
        raise DependencyError("not installed")

    monkeypatch.setattr(_bodies, "EmbreeTriangles", missing)
    by_tree = gn.render(gn.Lambertian(0.5), shape=gn.scenes.Mesh(ball(12)), **arguments)
    np.testing.assert_allclose(by_tree.pixels, by_embree.pixels, atol=1e-3)
    np.testing.assert_allclose(by_tree.pixels.mean(), by_embree.pixels.mean(), rtol=1e-5)


def test_normals_are_those_of_the_faces_that_an_edge_is_smooth_for():
    cube = gn.scenes.Mesh(CUBE)
    assert cube.normals.shape == (12, 3)  # edges of 90 degrees stay sharp
    rounded = gn.scenes.Mesh(CUBE, crease=math.pi).normals[:, 3:].reshape(-1, 3)
    corners = CUBE[0][cube.triangles.faces].reshape(-1, 3) / math.sqrt(0.75)
    np.testing.assert_allclose(rounded, corners, atol=1e-12)  # by angles, each side counts as much
    sphere = gn.scenes.Mesh(ball(16))
    vertices = sphere.triangles.corners.reshape(-1, 3)
    np.testing.assert_allclose(sphere.normals[:, 3:].reshape(-1, 3), vertices, atol=2e-2)
    repeated = gn.scenes.Mesh((vertices, np.arange(len(vertices)).reshape(-1, 3)))  # as .stl files are
    np.testing.assert_allclose(repeated.normals, sphere.normals, atol=1e-6)


def test_a_crease_parts_the_faces_of_a_vertex():
    """Of a roof of 100 degrees, whose sides are two triangles each that are turned by little."""
    vertices = [[0, 0, 1], [0, 1, 1], [1, 0, 0], [1, 1, 0.1], [-1, 0, 0], [-1, 1, 0]]
    mesh = gn.scenes.Mesh((vertices, [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4]]))
    normals = smoothed(mesh.triangles, math.radians(40.0)).reshape(4, 3, 3)
    assert np.abs(normals[0, 0] - normals[1, 0]).max() < 1e-12  # both on the right
    assert np.abs(normals[1, 0] - normals[2, 0]).max() > 0.5  # across the ridge


def test_places_on_a_texture_are_those_of_the_vertices():
    uv = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]
    texture = gn.Texture(np.array([[[0.1], [0.2]], [[0.3], [0.4]]]), filter="nearest")
    picture = gn.render(gn.Lambertian(texture), EVEN, gn.scenes.Mesh(SQUARE, uv=uv), size=16, samples=8, camera=ABOVE)
    np.testing.assert_allclose(picture.pixels[[4, 4, 12, 12], [4, 12, 4, 12], 0], [0.1, 0.2, 0.3, 0.4], rtol=1e-4)


def test_files_are_meshes(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.Trimesh(*ball(6), process=False).export(tmp_path / "ball.ply")
    of_file = gn.render(METAL, STUDIO, tmp_path / "ball.ply", size=16, samples=8)
    np.testing.assert_array_equal(of_file.pixels, gn.render(METAL, STUDIO, str(tmp_path / "ball.ply"), 16, 8).pixels)
    np.testing.assert_allclose(
        of_file.pixels, gn.render(METAL, STUDIO, gn.scenes.Mesh(ball(6)), 16, 8).pixels, atol=1e-3
    )


def test_files_keep_the_digits_that_they_hold(tmp_path):
    pytest.importorskip("trimesh")
    x, y = 12345678.125, 5400000.25
    corners = np.array([[x, y, 0.0], [x + 1.0, y, 0.0], [x + 1.0, y + 1.0, 0.5]])
    rows = [" ".join(f"{x:.3f}" for x in corner) for corner in corners]
    head = "ply\nformat ascii 1.0\nelement vertex 3\n" + "".join(f"property double {x}\n" for x in "xyz")
    (tmp_path / "a.obj").write_text("\n".join(f"v {row}" for row in rows) + "\nf 1 2 3\n")
    (tmp_path / "a.off").write_text("\n".join(["OFF", "3 1 0", *rows, "3 0 1 2", ""]))
    (tmp_path / "a.ply").write_text(
        "\n".join(
            [f"{head}element face 1", "property list uchar int vertex_indices", "end_header", *rows, "3 0 1 2", ""]
        )
    )
    for name in ("a.obj", "a.off", "a.ply"):
        np.testing.assert_array_equal(gn.scenes.Mesh(tmp_path / name).triangles.corners[0], corners)


def test_derivatives_of_pictures_of_meshes():
    mesh = gn.scenes.Mesh(ball(6))
    picture, slopes = gn.scenes.picture_jacobian(gn.Lambertian(0.5), STUDIO, ["rho"], mesh, size=16)
    np.testing.assert_allclose(slopes["rho"].pixels * 0.5, picture.pixels, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(
    ("make", "kind", "says"),
    [
        (lambda: gn.scenes.Mesh(([], [])), ShapeError, "expected"),
        (
            lambda: gn.scenes.Mesh(([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]])),
            ParameterError,
            "expected finite",
        ),
        (lambda: gn.scenes.Mesh(([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])), ParameterError, "no area"),
        (lambda: gn.scenes.Mesh(SQUARE, uv=[[0, 0]]), ShapeError, r"expected \(4, 2\)"),
        (lambda: gn.scenes.Mesh(SQUARE, uv=np.full((4, 2), np.nan)), ParameterError, "NaN"),
        (lambda: gn.scenes.Mesh(SQUARE, crease=4.0), ParameterError, "crease"),
        (lambda: gn.render(WHITE, shape="no.ply"), NotFoundError, "no such file"),
        (lambda: gn.render(WHITE, shape="cube"), ParameterError, "expected one of 'cylinder'"),
        (lambda: gn.render(WHITE, shape=[1, 2]), ParameterError, "expected a word"),
        (lambda: gn.render(WHITE, shape=gn.scenes.Mesh(SQUARE, WHITE)), ParameterError, "materials of its own"),
        (lambda: gn.render(gn.Scene(gn.scenes.Mesh(SQUARE))), ParameterError, "no material"),
        (lambda: gn.render(gn.Scene(gn.scenes.Mesh(SQUARE, WHITE)), shape="disk"), ParameterError, "the scene alone"),
        (lambda: gn.render(gn.Scene(gn.scenes.Mesh(SQUARE, WHITE, 1.0))), ParameterError, "light by itself"),
        (lambda: gn.scenes.radiosity(gn.Scene(gn.scenes.Mesh(SQUARE, None, 1.0))), ParameterError, "no material"),
        (
            lambda: gn.render(WHITE, EVEN, gn.scenes.Mesh(CUBE), 16, camera=gn.scenes.Camera([0, 0, 0], [0, 1, 0])),
            ParameterError,
            "backs alone",
        ),
        (
            lambda: gn.render(WHITE, EVEN, gn.scenes.Mesh(CUBE), 16, camera=gn.scenes.Camera([0, -4, 0], [0, -5, 0])),
            ParameterError,
            "nothing is in sight",
        ),
        (
            lambda: gn.render(WHITE, gn.FunctionLight(lambda w: w[..., :1] * 0 + 1), gn.scenes.Mesh(CUBE), 16),
            ParameterError,
            "alone: without shadows",
        ),
        (lambda: gn.scenes.render_stokes(WHITE, shape=gn.scenes.Mesh(CUBE)), ParameterError, "expected"),
        (
            lambda: gn.scenes.picture_jacobian(WHITE, EVEN, ["rho"], gn.scenes.Mesh(CUBE, WHITE)),
            ParameterError,
            "of its own",
        ),
    ],
)
def test_what_is_refused(make, kind, says):
    with pytest.raises(kind, match=says):
        make()


def test_the_picture_of_a_mesh_shows_it_all():
    """By default it is as large in its picture as the sphere in its own, wherever it is."""
    picture = gn.render(WHITE, EVEN, gn.scenes.Mesh(ball(24, 30.0, (100.0, 200.0, -50.0))), size=48)
    np.testing.assert_allclose(picture.alpha.sum(), math.pi * (24 / MARGIN) ** 2, rtol=1e-2)
    assert picture.alpha[[0, -1]].max() == 0.0


def test_meshes_and_scenes_cannot_be_changed():
    mesh = gn.scenes.Mesh(([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]]), gn.Lambertian(0.5))
    scene = gn.Scene([mesh])
    for held, name in ((mesh, "material"), (mesh, "crease"), (scene, "parts")):
        with pytest.raises(AttributeError, match="is a value and cannot be changed"):
            setattr(held, name, None)
    assert pickle.loads(pickle.dumps(mesh)).material == mesh.material
