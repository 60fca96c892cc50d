"""Radiosity against what is known: closed cavities, form factors, series; what balances; bad input."""

import subprocess
import sys
import time

import numpy as np
import pytest

import gonio as gn
from gonio.arrays.kinds import SCALAR
from gonio.errors import (
    DependencyError,
    FormatError,
    LeftOutWarning,
    NotFoundError,
    ParameterError,
    ShapeError,
    ToleranceWarning,
    TooLargeError,
)
from gonio.evaluate.computation import Computation, composite
from gonio.formula.direction import Direction
from gonio.interreflection import by_rays, dense, lamps, patches
from gonio.radiometry import form_factors as ff

pytest.importorskip("embreex")

FLOOR = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
CEILING = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]
WALLS = [
    [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]],
    [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]],
    [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]],
    [[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]],
]


def quad(corners, rho=0.5, exitance=0.0):
    return gn.scenes.Mesh((corners, [[0, 1, 2, 3]]), gn.Lambertian(rho), exitance)


def cube(rho, exitance):
    return gn.Scene([quad(face, rho, exitance) for face in (FLOOR, CEILING, *WALLS)])


@pytest.mark.parametrize("method, count", [("rays", 300), ("dense", 48)])
def test_a_closed_cavity_that_fluoresces_is_a_geometric_series_of_matrices(method, count):
    D = np.array([[0.2, 0.0, 0.0], [0.45, 0.3, 0.0], [0.1, 0.15, 0.7]])
    ink, M = gn.Donaldson(D, wavelengths=[450.0, 550.0, 650.0]), [4.0, 1.0, 1.0]
    scene = gn.Scene([gn.scenes.Mesh((face, [[0, 1, 2, 3]]), ink, M) for face in (FLOOR, CEILING, *WALLS)])
    light = gn.scenes.radiosity(scene, count, method)
    np.testing.assert_allclose(light.radiosity, [np.linalg.solve(np.eye(3) - D, M)] * count, rtol=1e-6)
    np.testing.assert_allclose(light.balance, 1.0, rtol=1e-6)


def test_a_part_that_sends_out_more_energy_than_arrives():
    ink = gn.Donaldson([[0.5, 0.0], [0.8, 0.1]], wavelengths=[450.0, 550.0])
    with pytest.raises(ParameterError, match=r"part 0 sends back 1\.3 of the energy"):
        gn.scenes.radiosity(gn.Scene(gn.scenes.Mesh((FLOOR, [[0, 1, 2, 3]]), ink, 1.0)), 2)


def test_one_patch_may_be_asked_for():
    light = gn.scenes.radiosity(gn.Scene(quad(FLOOR, 0.5, 2.0)), 1)
    assert len(light.part) == 2  # the triangles of the square
    np.testing.assert_array_equal(light.radiosity, 2.0)


@pytest.mark.parametrize("method, count", [("rays", 600), ("dense", 48)])
def test_a_closed_cavity_of_one_material_is_a_geometric_series(method, count):
    light = gn.scenes.radiosity(cube([0.8, 0.3], [1.0, 2.0]), count, method)
    assert len(light.part) == count
    np.testing.assert_allclose(light.radiosity, np.broadcast_to([5.0, 2.0 / 0.7], (count, 2)), rtol=1e-6)
    np.testing.assert_allclose(light.irradiance, light.radiosity, rtol=1e-6)
    np.testing.assert_allclose(light._operator.rows, 1.0, atol=1e-6)
    np.testing.assert_allclose(light.factors.sum(1), 1.0, atol=1e-6)
    np.testing.assert_allclose(light.balance, 1.0, atol=1e-6)


TURN, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
TURN = TURN * np.sign(np.linalg.det(TURN))  # a rotation, not a mirror
AWAY = np.array([1.0, -0.7, 0.3])
SHEET = [[0.2, 0.2, 0.5], [0.8, 0.2, 0.5], [0.8, 0.8, 0.5], [0.2, 0.8, 0.5]]


def moved(scene, shift, scale=1.0, turn=None):
    """A scene turned and scaled, then shifted by so many of its sizes."""

    def at(x):
        return scale * (x if turn is None else x @ turn.T) + scale * shift * AWAY

    parts = [(at(part.triangles.vertices), part.triangles.faces, part.material, part.exitance) for part in scene.parts]
    return gn.Scene([gn.scenes.Mesh((vertices, faces), m, exitance) for vertices, faces, m, exitance in parts])


def room_with_a_sheet():
    """The floor black, the ceiling the light, a sheet between."""
    rho, exitance = {0: 0.0}, {1: 1.0}
    faces = (FLOOR, CEILING, *WALLS, SHEET)
    return gn.Scene([quad(face, rho.get(k, 0.5), exitance.get(k, 0.0)) for k, face in enumerate(faces)])


@pytest.fixture
def without_embree(monkeypatch):
    def missing(*_, **__):
        raise DependencyError("not installed")

    monkeypatch.setattr(by_rays, "EmbreeTriangles", missing)
    monkeypatch.setitem(sys.modules, "gonio.rays.embree", None)


def test_light_by_rays_of_the_own_tree_is_the_same_wherever_a_room_is(without_embree):
    room = room_with_a_sheet()
    here, there = (gn.scenes.radiosity(moved(room, shift), 60, "rays", tolerance=0.05) for shift in (0.0, 1e7))
    np.testing.assert_allclose(here.balance, 1.0, rtol=0.05)
    assert here.escaped[0] == 0.0 and here.irradiance[here.part == 0].min() > 0.05
    np.testing.assert_allclose(there.radiosity, here.radiosity, rtol=1e-4)
    np.testing.assert_allclose(there.irradiance, here.irradiance, rtol=1e-4)
    np.testing.assert_allclose(there.balance, here.balance, rtol=1e-4)
    np.testing.assert_allclose(there.corners - 1e7 * AWAY, here.corners, atol=1e-8)


def test_a_closed_cavity_is_a_geometric_series_wherever_it_is_and_however_it_is_turned():
    for shift, scale in ((1e3, 1e-6), (1e5, 1e6), (1e7, 1.0)):
        light = gn.scenes.radiosity(moved(cube(0.5, 1.0), shift, scale, TURN), 150, "rays", tolerance=0.05)
        np.testing.assert_allclose(light.radiosity, 2.0, rtol=1e-4)


def test_pictures_and_files_of_light_are_the_same_wherever_a_room_is(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    pictures = []
    for shift in (0.0, 1e7):
        light = gn.scenes.radiosity(moved(room_with_a_sheet(), shift), 60, "rays", tolerance=0.1)
        pictures.append(light.image(shift * AWAY + [0.5, -2.0, 0.5], shift * AWAY + 0.5, size=16))
        light.save(tmp_path / "light.ply")
        mesh = trimesh.load(tmp_path / "light.ply", process=False)
        np.testing.assert_allclose(mesh.vertices[mesh.faces], light.corners, atol=1e-5)  # those of a plane are shared
    assert (pictures[0].alpha == 1.0).sum() > 50
    np.testing.assert_allclose(pictures[1].pixels, pictures[0].pixels, rtol=1e-4)


def test_what_leaves_by_a_missing_wall_is_missing_in_the_balance():
    f = ff.parallel_rectangles(1.0, 1.0, 1.0)
    light = gn.scenes.radiosity(gn.Scene([quad(face, 0.0, 1.0) for face in (FLOOR, *WALLS)]), 400, "rays")
    np.testing.assert_allclose(light.escaped, 1.0 / 5.0, rtol=0.01)  # by reciprocity what the opening would send in
    np.testing.assert_allclose(light.balance + light.escaped, 1.0, atol=1e-12)
    assert f"balance {light.balance[0]:.4f}, escaped 0.2" in repr(light)
    two = gn.scenes.radiosity(gn.Scene([quad(FLOOR, 0.0, 1.0), quad(CEILING, 0.0)]), 400, "rays")
    np.testing.assert_allclose(two.balance, f, rtol=0.02)


def test_backs_absorb_and_let_nothing_escape():
    light = gn.scenes.radiosity(room_with_a_sheet(), 150, "rays")
    assert light.escaped[0] == 0.0
    np.testing.assert_allclose(light.balance, 1.0, rtol=0.01)


def test_a_closed_room_that_loses_light_says_so():
    """Two rooms, so far from each other that no digit of single precision is left for either."""
    rooms = [moved(cube(0.5, 1.0), shift) for shift in (0.0, 1e8)]
    with pytest.warns(ToleranceWarning, match="of the light got out of a closed surface"):
        light = gn.scenes.radiosity(gn.Scene([part for room in rooms for part in room.parts]), 300, "rays")
    assert light.balance[0] < 0.999


def test_a_closed_solid_that_shines_outwards_loses_its_light_unsaid():
    faces = [face[::-1] for face in (FLOOR, CEILING, *WALLS)]
    assert gn.scenes.radiosity(gn.Scene([quad(face, 0.5, 1.0) for face in faces]), 100).escaped == 1.0


@pytest.mark.parametrize(
    "m, words",
    [
        (gn.Microfacet(gn.GGX(0.05), 0.9), r"part 0, Microfacet\(.* counts as matt"),
        (gn.IdealSpecular(0.5), r"part 0, IdealSpecular\(.* counts as matt"),
        (gn.SmoothDielectric(1.5), r"part 0, SmoothDielectric\(.* what it transmits as absorbed"),
    ],
)
def test_what_is_not_matt_is_named(m, words):
    with pytest.warns(LeftOutWarning, match=words) as said:
        gn.scenes.radiosity(gn.Scene([gn.scenes.Mesh((FLOOR, [[0, 1, 2, 3]]), m), quad(CEILING, 0.5, 1.0)]), 8)
    assert len(said) == 1 and "part 1" not in str(said[0].message)


@pytest.mark.parametrize("m", [0.5 * gn.Lambertian(0.5) + gn.Lambertian(0.2), gn.EON(0.5, 0.0)])
def test_of_what_is_matt_nothing_is_said(m):
    gn.scenes.radiosity(gn.Scene([gn.scenes.Mesh((FLOOR, [[0, 1, 2, 3]]), m), quad(CEILING, 0.5, 1.0)]), 8)


def test_two_squares_light_each_other():
    """B₁ = M + ρ F B₂, B₂ = ρ F B₁ of two patches each would be exact; of many the mean is within the unevenness."""
    scene = gn.Scene([quad(FLOOR, 0.5, 1.0), quad(CEILING, 0.8)])
    f = ff.parallel_rectangles(1.0, 1.0, 1.0)
    spread = np.sqrt((1.0 - f) / f / (100 * 512))  # of a share of independent rays; those of a lattice are no worse
    for method, limit in (("dense", 1e-4), ("rays", 3.0 * spread)):
        light = gn.scenes.radiosity(scene, 200, method)
        np.testing.assert_allclose(light.factors[0, 1], f, rtol=limit)
        area = light._patches.areas
        arrives = (area * light.irradiance[:, 0])[light.part == 1].sum()
        assert abs(arrives / (f * 1.0) - 1.0) < 0.02  # what returns once more is ρ₁ ρ₂ F² < 2 %
        assert abs(light.balance[0] + light.escaped[0] - 1.0) < limit


def test_dense_factors_are_reciprocal_and_close():
    divided = patches.patches_of(cube(0.5, 1.0)).divided(96)
    operator = dense.Dense(divided)
    exchange = divided.areas[:, None] * operator.factors
    np.testing.assert_array_equal(np.abs(exchange - exchange.T) < 1e-16, True)
    np.testing.assert_allclose(operator.rows, 1.0, atol=1e-12)
    assert operator.unseen < 1e-3  # before rows were corrected
    pairs = np.random.default_rng(0).integers(96, size=(40, 2))
    for i, j in pairs[divided.face[pairs[:, 0]] // 2 != divided.face[pairs[:, 1]] // 2]:
        want = ff.polygon_to_polygon(divided.corners[i], divided.corners[j])
        assert abs(operator.factors[i, j] - want) < 0.01 * want + 1e-6


def test_what_stands_between_throws_a_shadow():
    screen = [[0.35, 0.35, 0.5], [0.65, 0.35, 0.5], [0.65, 0.65, 0.5], [0.35, 0.65, 0.5]]
    small = [[0.45, 0.45, 0.999], [0.45, 0.55, 0.999], [0.55, 0.55, 0.999], [0.55, 0.45, 0.999]]
    scene = gn.Scene([quad(FLOOR, 0.5), quad(screen, 0.0), quad(small, 0.0, 100.0)])
    light = gn.scenes.radiosity(scene, 3000)
    floor = light.part == 0
    x, y = light._patches.centres[floor, :2].T
    inside = np.maximum(abs(x - 0.5), abs(y - 0.5)) < 0.2  # the shadow reaches to 0.5 ± 0.25
    assert light.irradiance[floor][inside].max() == 0.0
    corner = np.hypot(abs(x - 0.5) - 0.45, abs(y - 0.5) - 0.45) < 0.03
    assert corner.sum() > 10
    seen = [small - np.array([a, b, 0.0]) for a, b in zip(x[corner], y[corner], strict=True)]
    np.testing.assert_allclose(
        light.irradiance[floor][corner, 0], 100.0 * ff.point_to_polygon(np.array(seen)), rtol=0.02
    )


def test_half_shadows_of_exchanged_patches_are_those_of_rays():
    """What is seen in part is looked at by more rays."""
    screen = [[0.2, 0.2, 0.5], [0.8, 0.2, 0.5], [0.8, 0.8, 0.5], [0.2, 0.8, 0.5]]
    scene = gn.Scene([quad(FLOOR, 0.5), quad(screen, 0.0), quad(CEILING, 0.0, 1.0)])
    by = {method: gn.scenes.radiosity(scene, 200, method) for method in ("dense", "rays")}
    arriving = {
        method: (light._patches.areas * light.irradiance[:, 0])[light.part == 0].sum() for method, light in by.items()
    }
    assert arriving["dense"] == pytest.approx(arriving["rays"], rel=0.03)
    assert arriving["dense"] < 0.8 * ff.parallel_rectangles(1.0, 1.0, 1.0)


def test_patches_are_small_where_light_changes():
    small = [[0.45, 0.45, 0.05], [0.45, 0.55, 0.05], [0.55, 0.55, 0.05], [0.55, 0.45, 0.05]]
    light = gn.scenes.radiosity(gn.Scene([quad(FLOOR, 0.5), quad(small, 0.0, 1.0)]), 500, "rays")
    floor = light.part == 0
    near = np.linalg.norm(light._patches.centres[:, :2] - 0.5, axis=1) < 0.15
    assert light._patches.areas[floor & near].mean() < 0.3 * light._patches.areas[floor & ~near].mean()
    assert abs(light._patches.areas[floor].sum() - 1.0) < 1e-12


def test_lamps_by_lambert_are_light_by_rays(monkeypatch):
    lamp = [[0.3, 0.3, 0.99], [0.3, 0.7, 0.99], [0.7, 0.7, 0.99], [0.7, 0.3, 0.99]]
    scene = gn.Scene([quad(FLOOR), quad(CEILING), *[quad(w) for w in WALLS], quad(lamp, 0.0, 10.0)])
    apart = gn.scenes.radiosity(scene, 500, "rays", tolerance=0.002)
    monkeypatch.setattr("gonio.interreflection.solving.LAMPS", 0)
    together = gn.scenes.radiosity(scene, 500, "rays", tolerance=0.002)
    means = [np.bincount(x.part, x._patches.areas * x.irradiance[:, 0])[:6] for x in (apart, together)]
    # a wall's patches send out 2560 rays each, of which 3 % meet the lamp: the spread of their number
    hits = np.bincount(together.part)[:6].min() * 2560 * 0.03
    np.testing.assert_allclose(means[0], means[1], rtol=3.0 / np.sqrt(hits))


def test_an_element_sees_a_triangle_above_its_horizon():
    rng = np.random.default_rng(0)
    points, normals = np.zeros((200, 3)), rng.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    corners = rng.normal(size=(200, 3, 3)) + np.array([0.0, 0.0, 1.0])
    facing = np.einsum(
        "ni,ni->n", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners[:, 0]
    )
    want = np.where(facing < 0.0, ff.point_to_polygon(corners, normals), 0.0)

    def factor(scene, mean, p, n, triangle):
        return (lamps.lambert(Direction(*p), Direction(*n), lamps.three(triangle)),)

    found = Computation(factor, {"p": 3, "n": 3, "triangle": 9}, {"factor": SCALAR})
    arrays = {"p": points, "n": normals, "triangle": corners.reshape(-1, 9)}
    np.testing.assert_allclose(found(composite(), **arrays)["factor"], want, atol=1e-12)


def test_no_ray_is_lost_between_patches():
    divided = patches.patches_of(cube(0.5, 1.0)).divided(2000)
    divided = divided.halved(np.random.default_rng(0).integers(2000, size=100))
    assert (by_rays.ByRays(divided, 256).hits < len(divided)).all()


def test_the_same_twice_and_on_one_thread():
    scene = gn.Scene([quad(FLOOR, 0.5, 1.0), quad(CEILING, 0.8)])
    first = gn.scenes.radiosity(scene, 300, "rays").radiosity
    before = gn.engine.threads()
    gn.engine.threads(1)
    try:
        np.testing.assert_array_equal(gn.scenes.radiosity(scene, 300, "rays").radiosity, first)
    finally:
        gn.engine.threads(before)


def test_pictures_and_files(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    scene = gn.Scene([quad(FLOOR, [0.5, 0.2, 0.1], np.pi), quad(CEILING, 0.0)])
    light = gn.scenes.radiosity(scene, 100)
    picture = light.image([0.5, 0.5, 3.0], [0.5, 0.5, 0.0], size=16, field=10.0, up=[0, 1, 0])
    np.testing.assert_allclose(picture.pixels, 1.0, rtol=1e-6)  # through the back of the ceiling
    assert (picture.alpha == 1.0).all()
    light.save(tmp_path / "light.ply")
    mesh = trimesh.load(tmp_path / "light.ply", process=False)
    assert len(mesh.faces) == 100 and abs(mesh.area - 2.0) < 1e-6
    floor = mesh.vertices[:, 2] == 0.0
    assert (mesh.visual.vertex_colors[floor, :3] == 255).all() and (mesh.visual.vertex_colors[~floor, :3] == 0).all()
    mesh.export(tmp_path / "again.obj")
    again = gn.scenes.Mesh(tmp_path / "again.obj", gn.Lambertian(0.5))
    assert abs(again.triangles.areas.sum() - 2.0) < 1e-6


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda: gn.scenes.radiosity(cube(0.5, 0.0)), ParameterError, "nothing in the scene emits"),
        (lambda: gn.scenes.radiosity(cube(1.0, 1.0), 100), ParameterError, "absorbs nothing"),
        (lambda: gn.scenes.radiosity(cube(0.5, 1.0), 0), ParameterError, "patches=0"),
        (lambda: gn.scenes.radiosity(cube(0.5, 1.0), 6000, "dense"), TooLargeError, "ask for up to 5000"),
        (lambda: gn.scenes.radiosity(cube(0.5, 1.0), method="fast"), ParameterError, "method='fast'"),
        (lambda: gn.scenes.radiosity(cube(0.5, 1.0), tolerance=0.0), ParameterError, "tolerance=0"),
        (lambda: gn.scenes.radiosity(cube([0.5, 0.4, 0.3], [1.0, 1.0])), ShapeError, "part 0 has exitances"),
        (lambda: gn.scenes.radiosity(gn.Lambertian(0.5)), ParameterError, "scene"),
        (lambda: gn.scenes.radiosity(cube(0.5, 1.0), lights=gn.SunLight()), ParameterError, "SunLight.*exitance=1.0"),
        (lambda: gn.Scene([gn.Lambertian(0.5)]), ParameterError, "expected meshes"),
        (lambda: gn.Scene([]), ParameterError, "got none"),
        (
            lambda: gn.scenes.radiosity(gn.Scene(gn.scenes.Mesh((FLOOR, [[0, 1, 2, 3]])))),
            ParameterError,
            "part 0 has no material",
        ),
        (lambda: quad(FLOOR, 0.5, -1.0), ParameterError, "exitance=.*from 0"),
        (lambda: quad(FLOOR, 0.5, np.nan), ParameterError, "exitance=.*from 0"),
        (lambda: gn.scenes.Mesh("no.ply", gn.Lambertian(0.5)), NotFoundError, "no such file"),
        (lambda: gn.scenes.Mesh(3.0, gn.Lambertian(0.5)), ParameterError, "a file, or vertices and faces"),
        (lambda: gn.scenes.Mesh((FLOOR, [[0, 1, 9]]), gn.Lambertian(0.5)), ParameterError, "expected 0 to 3"),
    ],
)
def test_bad_input(call, error, words):
    with pytest.raises(error, match=words):
        call()


LIGHT = """
import sys
import gonio as gn
from gonio.interreflection import by_rays
by_rays.RAYS = 1 << 15
gn.engine.threads(1)
room = [[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]]
scene = gn.Scene([gn.scenes.Mesh((face, [[0, 1, 2, 3]]), gn.Lambertian([0.5, 0.2]), [1.0, 2.0]) for face in room])
gn.scenes.radiosity(scene, 10000, "rays", checkpoint=sys.argv[1])
"""


def test_a_killed_radiosity_goes_on(tmp_path, monkeypatch):
    file = tmp_path / "light.npz"
    with subprocess.Popen([sys.executable, "-c", LIGHT, str(file)]) as child:
        start = time.monotonic()
        while not file.exists() and time.monotonic() < start + 120.0:
            time.sleep(0.002)
        child.kill()
    with np.load(file) as held:
        done = len(held["found"])
    assert 0 < done < 10000
    scene = gn.Scene([quad(face, [0.5, 0.2], [1.0, 2.0]) for face in (FLOOR, CEILING)])
    monkeypatch.setattr(by_rays, "RAYS", 1 << 15)
    shot = []
    shoot = by_rays._Shooter.__call__
    monkeypatch.setattr(by_rays._Shooter, "__call__", lambda s, rows, *u: shot.append(rows) or shoot(s, rows, *u))
    found = gn.scenes.radiosity(scene, 10000, "rays", checkpoint=file)
    assert min(rows.start for rows in shot if isinstance(rows, slice)) == done
    whole = gn.scenes.radiosity(scene, 10000, "rays")
    for name in ("corners", "radiosity", "irradiance"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))
    again = gn.scenes.radiosity(scene, 10000, "rays", checkpoint=file)
    np.testing.assert_array_equal(again.radiosity, whole.radiosity)


def test_a_checkpoint_is_of_one_scene(tmp_path):
    file = tmp_path / "light.npz"
    for method in ("dense", "rays"):
        first = gn.scenes.radiosity(cube(0.5, 1.0), 48, method, checkpoint=file)
        again = gn.scenes.radiosity(cube(0.5, 1.0), 48, method, checkpoint=file)
        np.testing.assert_array_equal(first.radiosity, again.radiosity)
        for other in ((cube(0.4, 1.0), 48), (cube(0.5, 2.0), 48), (cube(0.5, 1.0), 49)):
            with pytest.raises(ParameterError, match="a checkpoint of another radiosity"):
                gn.scenes.radiosity(*other, method, checkpoint=file)
        file.unlink()
    file.write_bytes(b"no zip")
    with pytest.raises(FormatError, match="not a checkpoint of a radiosity"):
        gn.scenes.radiosity(cube(0.5, 1.0), 48, checkpoint=file)


def test_patches_end_where_a_block_stands():
    """A block on the floor, turned: no patch is in part below it, and all light is found again."""
    a = np.radians(20.0) + np.pi / 2.0 * np.arange(4)
    low = np.stack([0.5 + 0.2 * np.cos(a), 0.5 + 0.2 * np.sin(a), 0.0 * a], axis=1)
    top = low + np.array([0.0, 0.0, 0.4])
    sides = [np.array([low[k], low[(k + 1) % 4], top[(k + 1) % 4], top[k]]) for k in range(4)]
    scene = gn.Scene([quad(face, 0.5, 1.0) for face in (FLOOR, CEILING, *WALLS)] + [quad(x) for x in (*sides, top)])
    light = gn.scenes.radiosity(scene, 400, "rays")
    assert abs(light._patches.areas.sum() - (6.0 + 0.08 + 4.0 * 0.4 * 0.2 * np.sqrt(2.0))) < 1e-12
    floor = light.part == 0
    corners = light.corners[floor][..., :2] - 0.5
    c, s = np.cos(-a[0] - np.pi / 4.0), np.sin(-a[0] - np.pi / 4.0)
    turned = np.stack([c * corners[..., 0] - s * corners[..., 1], s * corners[..., 0] + c * corners[..., 1]], axis=-1)
    half = 0.2 / np.sqrt(2.0) + 1e-9
    within = (np.abs(turned.mean(axis=1)) < half).all(axis=1)
    assert within.any() and (np.abs(turned[within]) < half).all()
    lit = light.irradiance[floor, 0]
    assert (lit[within] == 0.0).all() and (lit[~within] > 0.0).all()
    lost = light._patches.areas * (1.0 - light._operator.rows) * light.radiosity[:, 0]
    inside = np.zeros(len(light.part), bool)
    inside[np.flatnonzero(floor)[within]] = True
    assert lost[~inside].sum() == 0.0
