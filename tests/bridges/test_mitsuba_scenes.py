"""Scenes in Mitsuba: each light, shape and camera gives the picture of `gn.render` there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.errors import ParameterError

PAINT = gn.Lambertian([0.35, 0.12, 0.06]) + gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
FLOOR = gn.Lambertian([0.5, 0.4, 0.3])
STUDIO = gn.EnvironmentLight.studio(height=32)
LAMP = gn.RectangleLight([0.0, -1.0, 2.5], [1.5, 0.0, 0.0], [0.0, -1.0, 0.0], 10.0)
CAMERA = gn.scenes.Camera([1.5, -3.0, 1.6], target=[0.0, 0.2, 0.0], field_of_view=0.8)
TRIANGLE = [[-2.2, -0.6, 0.9], [-1.6, -1.6, 2.6], [-0.6, -2.2, 0.9]]
CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
pytestmark = pytest.mark.slow_because("Mitsuba compiles each scene anew")
SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


@pytest.fixture
def mi() -> Any:
    mitsuba = pytest.importorskip("mitsuba")
    try:
        mitsuba.set_variant("llvm_ad_rgb")
    except ImportError:
        pytest.skip("Mitsuba finds no LLVM")
    return mitsuba


def compare(mi: Any, m: Any, lights: Any = None, size: int = 48, **options: Any) -> None:
    import gonio.bridges.mitsuba

    picture = gn.render(m, lights, size=size, samples=256, **options)
    ours = np.broadcast_to(picture.pixels * picture.alpha[..., None], (size, size, 3))
    scene = gonio.bridges.mitsuba.scene(m, lights, size=size, samples=256, **options)
    theirs = np.array(mi.render(mi.load_dict(scene)))
    np.testing.assert_allclose(theirs.mean(axis=(0, 1)), ours.mean(axis=(0, 1)), rtol=4e-3)
    blocks = [x.reshape(6, size // 6, 6, size // 6, 3).mean(axis=(1, 3)) for x in (ours, theirs)]
    assert np.abs(blocks[0] - blocks[1]).max() < 0.04 * ours.mean() + 0.02 * ours.max()


LIGHTS = [
    gn.PointLight([1.0, -2.0, 2.0], 5.0),
    gn.DistantLight([0.5, -1.0, 1.0], [3.0, 2.0, 1.0]),
    gn.ConstantLight([1.0, 0.5, 0.2]),
    STUDIO.replace(scale=2.0),
    gn.SphereLight([1.0, -2.0, 2.0], 0.5, 10.0),
    gn.DiskLight([1.0, -2.0, 2.0], [-1.0, 2.0, -2.0], 0.7, 10.0),
    gn.DiskLight([0.0, -0.5, 3.0], [0.0, 0.0, -1.0], 0.7, 10.0),
    LAMP,
    gn.PolygonLight(TRIANGLE, 6.0),
    gn.MeshLight((TRIANGLE, [[0, 1, 2]]), [6.0, 3.0, 1.0]),
]


@pytest.mark.parametrize("light", thinned(LIGHTS, LIGHTS[1:6:2]), ids=lambda light: type(light).__name__)
def test_lights(mi, light):
    compare(mi, PAINT, light)


@pytest.mark.parametrize("shape", thinned(["sphere", "plane", "disk", "cylinder"], ["cylinder"]))
def test_shapes_on_the_ground(mi, shape):
    compare(mi, PAINT, LAMP, shape=shape, ground=FLOOR)
    compare(mi, PAINT, [gn.PointLight([1.0, -2.0, 2.0], 2.0), gn.ConstantLight(0.1)], shape=shape)


def test_a_scene_of_two_meshes(mi):
    cube, small = (
        gn.scenes.Mesh((CORNERS, SIDES), PAINT),
        gn.scenes.Mesh((0.4 * CORNERS + [0.0, 0.0, 0.9], SIDES), FLOOR),
    )
    compare(mi, gn.Scene([cube, small]), STUDIO, camera=CAMERA)


@pytest.mark.full
def test_meshes_and_surfaces(mi):
    compare(mi, FLOOR, STUDIO, shape=gn.scenes.Mesh((CORNERS, SIDES), crease=3.0), camera=CAMERA)
    compare(mi, FLOOR, gn.ConstantLight(1.0), shape=gn.surfaces.gaussian(0.3))
    brushed = gn.Microfacet(gn.GGX(0.1, 0.5))
    compare(mi, brushed, STUDIO, camera=CAMERA)
    compare(mi, brushed, STUDIO, shape="plane", camera=CAMERA)
    card = gn.scenes.Mesh((CORNERS[[0, 4, 5, 1]], [[0, 1, 2, 3]]), uv=[[0.0, 1.0], [1.0, 0.5], [1.0, 0.0], [0.0, 0.5]])
    compare(mi, brushed, STUDIO, shape=card, camera=CAMERA)


def test_parts_with_exitance_light_others(mi):
    """Irradiance on the floor of a lamp of its own is that of the lamp as a light."""
    import gonio.bridges.mitsuba

    floor = gn.scenes.Mesh((2.0 * CORNERS[[0, 4, 6, 2]], [[0, 1, 2, 3]]), FLOOR)
    above = 0.2 * CORNERS[[0, 2, 6, 4]] + [0.0, 0.0, 1.0]
    lamp = gn.scenes.Mesh((above, [[0, 1, 2, 3]]), gn.Lambertian(0.0), exitance=np.pi * 5.0)
    look = gn.scenes.OrthographicCamera([0.0, -2.0, 0.3], target=[0.0, 0.0, -1.0], width=1.0)
    scene = gonio.bridges.mitsuba.scene(
        gn.Scene([floor, lamp]), gn.ConstantLight(0.0), size=32, samples=256, camera=look
    )
    theirs = np.array(mi.render(mi.load_dict(scene)))
    light = gn.PolygonLight(above, 5.0)
    ours = gn.render(gn.Scene([floor]), light, size=32, samples=256, camera=look)
    inside = ours.alpha == 1.0
    np.testing.assert_allclose(theirs[inside].mean(axis=0), ours.pixels[inside].mean(axis=0), rtol=5e-3)
    below = gn.scenes.OrthographicCamera([0.0, 0.0, 0.5], target=[0.0, 0.0, 1.0], up=[0.0, 1.0, 0.0], width=0.1)
    scene = gonio.bridges.mitsuba.scene(gn.Scene([lamp]), gn.ConstantLight(0.0), size=8, samples=4, camera=below)
    np.testing.assert_allclose(np.array(mi.render(mi.load_dict(scene))), 5.0, rtol=1e-5)  # and is seen itself


@pytest.mark.parametrize(
    ("m", "options", "message"),
    [
        (PAINT, {"lights": gn.CIESky(1)}, "CIESky.*expected PointLight, DistantLight.*which Mitsuba has too"),
        (PAINT, {"lights": LAMP.replace(sides="both")}, "shines to both sides; expected sides='front'"),
        (PAINT, {"lights": gn.ConstantLight([1.0] * 4)}, "a light of 4 channels; expected one number or RGB"),
        (gn.Scene([gn.scenes.Mesh((CORNERS, SIDES))]), {}, "a part has no material"),
        (
            gn.Microfacet(gn.GGX(0.1, 0.5)),
            {"shape": gn.scenes.Mesh((CORNERS, SIDES))},
            "is anisotropic, on a mesh without uv",
        ),
        (gn.Microfacet(gn.GGX(0.1, 0.5)), {"shape": "cylinder"}, "is anisotropic, on a cylinder"),
        (gn.Lambertian(gn.Texture([[0.5]])), {}, "is a texture; expected numbers"),
    ],
)
def test_what_mitsuba_has_no_equal_of_is_refused(mi, m, options, message):
    import gonio.bridges.mitsuba

    with pytest.raises(ParameterError, match=message):
        gonio.bridges.mitsuba.scene(m, size=8, **options)
