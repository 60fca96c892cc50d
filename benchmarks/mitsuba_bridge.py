"""gonio's materials in Mitsuba 3 beside Mitsuba's own plugins of the same models: speed, pictures, derivatives.

    python benchmarks/mitsuba_bridge.py [rounds] [measured.bsdf ...] > benchmarks/mitsuba_bridge.txt

Needs `pip install mitsuba`. A sphere under the built-in studio, `direct` integrator, 512 x 512 pixels, 32 samples,
llvm_ad_rgb. Both are rendered in turn; ratios are of one round. Tracing the scene, which Mitsuba repeats for every
picture, counts.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from timing import Case, Engine, machine, table

import gonio as gn
from gonio.bridges import mitsuba as bridge
from gonio.lights.environment import EnvironmentLight

SIZE, SAMPLES = 512, 32
BLOCK = 32
"""Pixels of a side of the blocks whose means are compared."""


def scene(mi: Any, bsdf: Any, size: int = SIZE) -> Any:
    """A sphere under the studio, seen along +y."""
    light = EnvironmentLight.studio()
    camera = mi.ScalarTransform4f().look_at(origin=[0, -4, 0], target=[0, 0, 0], up=[0, 0, 1])
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": True},
            "sensor": {
                "type": "orthographic",
                "to_world": camera,
                "film": {
                    "type": "hdrfilm",
                    "width": size,
                    "height": size,
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                },
                "sampler": {"type": "independent"},
            },
            "sphere": {"type": "sphere", "bsdf": bsdf},
            "light": {
                "type": "envmap",
                "bitmap": mi.Bitmap(np.ascontiguousarray(light.to_mitsuba().pixels, dtype=np.float32)),
                "to_world": mi.ScalarTransform4f(light.MITSUBA_TO_WORLD.tolist()),
            },
        }
    )


def engine(mi: Any, name: str, bsdf: Any, target: float | None = None) -> Engine:
    def build() -> Callable[[], np.ndarray]:
        made = scene(mi, bsdf)
        return lambda: np.array(mi.render(made, spp=SAMPLES))

    def means(picture: np.ndarray) -> np.ndarray:
        n = SIZE // BLOCK
        blocks = picture.reshape(n, BLOCK, n, BLOCK, 3).mean(axis=(1, 3))[4:-4, 4:-4]  # those that the sphere covers
        return np.asarray(blocks, dtype=float)

    return Engine(name, build, target, means)


def cases(mi: Any, files: list[str]) -> list[tuple[str, gn.Reflectance, dict]]:
    """Title, material, and Mitsuba's plugin of the same model."""
    gold = gn.material("gold", alpha=0.2).fresnel

    def rgb(value: Any) -> dict:
        return {"type": "rgb", "value": np.broadcast_to(np.asarray(value, float), 3).tolist()}

    index = {"eta": rgb(gold.eta), "k": rgb(gold.k)}
    colour = [0.8, 0.4, 0.1]
    metal = gn.DisneyPrincipled(colour, metallic=1.0, roughness=0.4, masking="anisotropic")
    glass = {"int_ior": 1.5, "ext_ior": 1.0}
    return [
        ("Lambertian", gn.Lambertian(colour), {"type": "diffuse", "reflectance": rgb(colour)}),
        (
            "GGX 0.2, F = 1",
            gn.Microfacet(gn.GGX(0.2), 1.0, "separable"),
            {"type": "roughconductor", "distribution": "ggx", "material": "none", "alpha": 0.2},
        ),
        (
            "GGX 0.2, gold",
            gn.Microfacet(gn.GGX(0.2), gold, "separable"),
            {"type": "roughconductor", "distribution": "ggx", "alpha": 0.2, **index},
        ),
        (
            "Beckmann 0.2, gold",
            gn.Microfacet(gn.Beckmann(0.2), gold, "separable"),
            {"type": "roughconductor", "distribution": "beckmann", "alpha": 0.2, **index},
        ),
        ("mirror", gn.IdealSpecular(1.0), {"type": "conductor", "material": "none"}),
        (
            "principled metal",
            metal,
            {"type": "principled", "base_color": rgb(colour), "metallic": 1.0, "roughness": 0.4},
        ),
        (
            "rough glass",
            gn.RoughDielectric(gn.GGX(0.3), 1.5),
            {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.3, **glass},
        ),
        ("glass", gn.SmoothDielectric(1.5), {"type": "dielectric", **glass}),
        *((path.rpartition("/")[2], gn.load(path), {"type": "measured", "filename": path}) for path in files),
    ]


def derivatives(mi: Any) -> list[str]:
    """Slopes of the albedo of a plate by `mi.traverse` and `direct`, against differences of gonio's albedo."""
    import drjit as dr

    wo = gn.direction(np.radians(40.0), 0.3)
    camera = mi.ScalarTransform4f().look_at(origin=(3.0 * wo).tolist(), target=[0, 0, 0], up=[0, 0, 1])
    sensor = {
        "type": "orthographic",
        "to_world": camera @ mi.ScalarTransform4f().scale([0.01, 0.01, 1.0]),
        "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
    }
    gold = gn.material("gold", alpha=0.3)
    lines = ["derivatives of a plate's albedo at 40 degrees, 16 x 16 pixels x 8192 samples, against differences"]
    for m in (gn.Lambertian([0.4, 0.2, 0.1]) + 0.5 * gn.Microfacet(gn.GGX(0.4), gn.Dielectric(1.5)), gold):
        made = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "direct"},
                "sensor": sensor,
                "plate": {"type": "rectangle", "bsdf": bridge.bsdf(m)},
                "light": {"type": "constant"},
            }
        )
        numbers = mi.traverse(made)
        for path, parameter in m.parameters.items():
            (key,) = (k for k, _ in numbers if k.endswith("bsdf." + path.replace(".", "_")))
            dr.enable_grad(numbers[key])
            numbers.update()
            dr.backward(dr.mean(mi.render(made, params=numbers, spp=8192, seed=1), axis=None) * 3.0)
            slope = float(np.sum(np.array(dr.grad(numbers[key]))))
            dr.disable_grad(numbers[key])
            value, h = np.asarray(parameter.value), 1e-3
            above, below = (np.sum(gn.albedo(m.replace({path: value + s * h}), wo, tolerance=1e-7)) for s in (1, -1))
            true = float(above - below) / (2.0 * h)
            lines.append(f"   {path:<30} {slope:10.5f} {true:10.5f}  {slope / true - 1.0:+.2%}")
    return lines


def main() -> None:
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    print("\n".join(machine(3)))
    print(f"{SIZE} x {SIZE} pixels x {SAMPLES} samples; the last column: difference of {BLOCK} x {BLOCK} block means")
    for title, m, plugin in cases(mi, sys.argv[2:]):
        ours = engine(mi, "gonio", bridge.bsdf(m))
        peer = engine(mi, f"Mitsuba's {plugin['type']}", plugin, 0.95)
        case = Case(title, SIZE * SIZE * SAMPLES, 0, [ours], [peer])
        print("\n".join(table(case, rounds)), flush=True)
    print("\n".join(derivatives(mi)))


if __name__ == "__main__":
    main()
