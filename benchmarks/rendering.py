"""Pictures of a sphere under the studio: samples a second, and noise at equal samples, beside Mitsuba 3's `direct`.

    python benchmarks/rendering.py [size] [samples]

Times are of processors (all threads), interleaved, the least of five; errors are relative mean squares against own
pictures of 4096 samples, (a - b)^2/(b^2 + 0.01). "equal noise": how much more time Mitsuba's sampler needs for the
same error, as errors fall as 1/samples. Needs `pip install mitsuba`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np

import gonio as gn
from gonio.scenes.estimator import MARGIN

CONDUCTOR = {"type": "roughconductor", "distribution": "ggx", "material": "none", "specular_reflectance": 1.0}
MATERIALS = {
    "GGX 0.2, F = 1": (gn.Microfacet(gn.GGX(0.2), 1.0, "separable"), {**CONDUCTOR, "alpha": 0.2}),
    "GGX 0.5, F = 1": (gn.Microfacet(gn.GGX(0.5), 1.0, "separable"), {**CONDUCTOR, "alpha": 0.5}),
    "Lambertian": (gn.Lambertian(0.5), {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}),
}


def timed(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def error(a: np.ndarray, truth: np.ndarray) -> float:
    return float((np.square(a - truth) / (truth * truth + 1e-2)).mean())


def scene_of(mi, bsdf: dict, light: gn.EnvironmentLight, size: int, samples: int, sampler: str):
    """The scene of `gn.render` in Mitsuba."""
    t = mi.ScalarTransform4f()
    camera = t.look_at(origin=[0, -4, 0], target=[0, 0, 0], up=[0, 0, 1]) @ t.scale([MARGIN, MARGIN, 1.0])
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    bitmap = mi.Bitmap(np.ascontiguousarray(light.to_mitsuba().pixels, dtype=np.float32))
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1, "hide_emitters": True},
            "sensor": {
                "type": "orthographic",
                "to_world": camera,
                "film": film,
                "sampler": {"type": sampler, "sample_count": samples},
            },
            "sphere": {"type": "sphere", "bsdf": bsdf},
            "light": {
                "type": "envmap",
                "bitmap": bitmap,
                "to_world": mi.ScalarTransform4f(light.MITSUBA_TO_WORLD.tolist()),
            },
        }
    )


def compared(mi, m: gn.Reflectance, bsdf: dict, size: int, samples: int) -> str:
    """A line of figures."""
    light, count = gn.EnvironmentLight.studio(), size * size * samples / 1e6
    scenes = [scene_of(mi, bsdf, light, size, samples, kind) for kind in ("independent", "multijitter")]

    def ours(seed: int = 0) -> np.ndarray:
        return gn.render(m, light, size=size, samples=samples, seed=seed).pixels

    def theirs(k: int = 0, seed: int = 0, more: int = 1) -> np.ndarray:
        return np.array(mi.render(scenes[k], spp=samples * more, seed=seed))[..., :3]

    truth = gn.render(m, light, size=size, samples=4096, seed=99)
    inside = truth.alpha == 1.0
    ours(), theirs()
    times = [(timed(ours), timed(theirs)) for _ in range(5)]
    a, b = min(x for x, _ in times), min(x for _, x in times)
    own = error(ours()[inside], truth.pixels[inside])
    shares = [b / a * error(theirs(k, 1)[inside], truth.pixels[inside]) / own for k in (0, 1)]
    mean = theirs(1, 2, 16)[inside].mean() / truth.pixels[inside].mean() - 1.0
    return (
        f"{count / a:5.1f} / {count / b:5.1f}, {b / a:.2f} times the speed; at equal noise {shares[0]:.1f} times "
        f"independent, {shares[1]:.1f} times multijitter; means differ by {100.0 * mean:+.2f} %"
    )


def main(size: int = 192, samples: int = 64) -> None:
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    print(f"{size} x {size}, {samples} samples; M samples a second of one core (pixels of the whole picture)")
    for name, (m, bsdf) in MATERIALS.items():
        print(f"{name:16} {compared(mi, m, bsdf, size, samples)}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
