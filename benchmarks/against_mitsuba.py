"""gonio's sphere against Mitsuba 3's direct integrator on the same scene: largest difference of 8 x 8 block means.

    python benchmarks/against_mitsuba.py [environment.exr] [material.bsdf ...]

Needs `pip install mitsuba`. Without an environment the built-in studio is used. Mitsuba's `measured` plugin takes the
camera's direction for the one the sample was lit from, so measured materials are swapped here before they are compared.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import gonio as gn
from gonio.base.reflectance import Reflectance
from gonio.formula.fields import part
from gonio.lights.environment import EnvironmentLight
from gonio.scenes.estimator import MARGIN


class Swapped(Reflectance):
    """f(wi, wo) of another reflectance with its directions exchanged."""

    of = part(Reflectance, None, "what is swapped")

    def formula(self, wi, wo):
        return self.of.formula(wo, wi)

    def warp(self, wo, u0, u1):
        return self.of.warp(wo, u0, u1)

    def density(self, wi, wo):
        return self.of.density(wi, wo)


def mitsuba_sphere(mi, bsdf: dict, light: EnvironmentLight, size: int, samples: int) -> np.ndarray:
    """The scene of `gonio.render` in Mitsuba: unit sphere, parallel camera along +y, z up; pixels (size, size, 3)."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1, "hide_emitters": True},
            "sensor": {
                "type": "orthographic",
                "to_world": mi.ScalarTransform4f().look_at(origin=[0, -4, 0], target=[0, 0, 0], up=[0, 0, 1])
                @ mi.ScalarTransform4f().scale([MARGIN, MARGIN, 1.0]),
                "film": {
                    "type": "hdrfilm",
                    "width": size,
                    "height": size,
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                },
                "sampler": {"type": "independent", "sample_count": samples},
            },
            "sphere": {"type": "sphere", "bsdf": bsdf},
            "light": {
                "type": "envmap",
                "bitmap": mi.Bitmap(np.ascontiguousarray(light.to_mitsuba().pixels, dtype=np.float32)),
                "to_world": mi.ScalarTransform4f(light.MITSUBA_TO_WORLD.tolist()),
            },
        }
    )
    return np.array(mi.render(scene, spp=samples))


def block_difference(a: np.ndarray, b: np.ndarray, alpha: np.ndarray, block: int = 8) -> tuple[float, float]:
    """Largest and median relative difference of block means, over the blocks that lie wholly inside the disc."""
    n = a.shape[0] // block * block

    def means(x: np.ndarray) -> np.ndarray:
        return x[:n, :n].reshape(n // block, block, n // block, block, -1).mean(axis=(1, 3))

    inside = means(alpha[..., None])[..., 0] >= 1.0
    a, b = means(a)[inside].mean(axis=-1), means(b)[inside].mean(axis=-1)
    difference = np.abs(a - b) / np.maximum(np.abs(b), 1e-6)
    return float(difference.max()), float(np.median(difference))


def main() -> None:
    import mitsuba as mi

    arguments = sys.argv[1:]
    environment = (
        EnvironmentLight(arguments.pop(0), invalid="zero") if arguments and not arguments[0].endswith(".bsdf") else None
    )
    environment = environment or EnvironmentLight.studio()
    mi.set_variant("llvm_ad_rgb" if "llvm_ad_rgb" in mi.variants() else "scalar_rgb")
    conductor = {"type": "roughconductor", "distribution": "ggx", "specular_reflectance": 1.0, "material": "none"}
    cases = {
        "Lambertian 0.5": (gn.Lambertian(0.5), {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}),
        "mirror": (gn.IdealSpecular(1.0), {"type": "conductor", "material": "none"}),
        "GGX 0.1, separable": (gn.Microfacet(gn.GGX(0.1), 1.0, "separable"), {**conductor, "alpha": 0.1}),
        "GGX 0.4, separable": (gn.Microfacet(gn.GGX(0.4), 1.0, "separable"), {**conductor, "alpha": 0.4}),
        "GGX 0.1/0.4 brushed": (
            gn.Microfacet(gn.GGX(0.1, 0.4), 1.0, "separable"),
            {**conductor, "alpha_u": 0.1, "alpha_v": 0.4},
        ),
        **{path: (Swapped(gn.load(path)), {"type": "measured", "filename": path}) for path in arguments},
    }
    size, samples = 64, 8192
    print(f"{size} x {size} pixels; samples: gonio {gn.__version__} {samples}, Mitsuba {mi.__version__} {4 * samples}")
    print(f"{'material':<40} {'max':>8} {'median':>8} {'gonio s':>8} {'mitsuba s':>9}")
    for name, (m, bsdf) in cases.items():
        start = time.perf_counter()
        ours = gn.render(m, environment, size=size, samples=samples)
        middle = time.perf_counter()
        theirs = mitsuba_sphere(mi, bsdf, environment, size, 4 * samples)
        end = time.perf_counter()
        assert ours.alpha is not None
        worst, median = block_difference(ours.pixels, theirs, ours.alpha)
        print(f"{name[-40:]:<40} {worst:8.2%} {median:8.3%} {middle - start:8.1f} {end - middle:9.1f}")


if __name__ == "__main__":
    main()
