"""Pictures of meshes under the studio: samples a second, and noise at equal samples, beside Mitsuba 3's `direct`.

    python benchmarks/mesh_rendering.py [size] [samples] [repeats]

A bumpy sphere with smooth normals, of 20 thousand and of 2 million triangles, shadows itself; both renderers have the
same triangles, normals, camera and environment map. Times are of processors (all threads), interleaved, the least of
the repeats; what is made of a mesh once is not counted for either. Errors are relative mean squares against own
pictures of 2048 samples, (a - b)^2/(b^2 + 0.01), inside the shape. "equal noise": how much more time Mitsuba's sampler
needs for the same error, as errors fall as 1/samples. Needs `pip install mitsuba embreex`.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import gonio as gn

CONDUCTOR = {"type": "roughconductor", "distribution": "ggx", "material": "none", "specular_reflectance": 1.0}
MATERIALS = {
    "GGX 0.2, F = 1": (gn.Microfacet(gn.GGX(0.2), 1.0, "separable"), {**CONDUCTOR, "alpha": 0.2}),
    "Lambertian": (gn.Lambertian(0.5), {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}),
}
EYE, ANGLE = [0.0, -5.0, 1.0], 0.5


def bumpy(rows: int) -> gn.scenes.Mesh:
    """A sphere with bumps: rows of 2 rows columns of quadrilaterals."""
    theta = np.linspace(0.0, math.pi, rows + 1)[1:-1, None]
    phi = np.linspace(0.0, 2.0 * math.pi, 2 * rows, endpoint=False)
    r = 0.9 + 0.1 * np.sin(9.0 * theta) * np.cos(8.0 * phi) * np.sin(theta)
    ring = np.stack(np.broadcast_arrays(r * np.sin(theta) * np.cos(phi), r * np.sin(theta) * np.sin(phi)), -1)
    around = np.concatenate([ring, (r * np.cos(theta))[..., None]], axis=-1).reshape(-1, 3)
    i, j = np.mgrid[: rows - 2, : 2 * rows]
    after = (j + 1) % (2 * rows)
    a, b = (i * 2 * rows + j).reshape(-1), ((i + 1) * 2 * rows + j).reshape(-1)
    c, d = ((i + 1) * 2 * rows + after).reshape(-1), (i * 2 * rows + after).reshape(-1)
    top, bottom, last = len(around), len(around) + 1, (rows - 2) * 2 * rows
    k = np.arange(2 * rows)
    follows = (k + 1) % (2 * rows)
    caps = [np.stack([0 * k + top, k, follows], -1), np.stack([0 * k + bottom, last + follows, last + k], -1)]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1), *caps])
    return gn.scenes.Mesh((np.concatenate([around, [[0.0, 0.0, 0.9], [0.0, 0.0, -0.9]]]), faces), crease=math.pi)


def normals_of(mesh: gn.scenes.Mesh) -> np.ndarray:
    """Those of the vertices (V, 3), from the corners that all have the same there."""
    found = np.zeros_like(mesh.triangles.vertices)
    found[mesh.triangles.faces.reshape(-1)] = mesh.normals[:, 3:].reshape(-1, 3)
    return found


def scene_of(mi, mesh: gn.scenes.Mesh, bsdf: dict, light: gn.EnvironmentLight, size: int, samples: int, sampler: str):
    """The same scene in Mitsuba."""
    triangles = mesh.triangles
    held = mi.Mesh("mesh", len(triangles.vertices), len(triangles.faces), has_vertex_normals=True)
    values = mi.traverse(held)
    values["vertex_positions"] = triangles.vertices.astype(np.float32).reshape(-1)
    values["vertex_normals"] = normals_of(mesh).astype(np.float32).reshape(-1)
    values["faces"] = triangles.faces.astype(np.uint32).reshape(-1)
    values.update()
    path = Path(os.environ.get("TMPDIR", "/tmp")) / f"gonio-{os.getpid()}.ply"
    held.write_ply(str(path))
    camera = mi.ScalarTransform4f().look_at(origin=EYE, target=[0, 0, 0], up=[0, 0, 1])
    bitmap = mi.Bitmap(np.ascontiguousarray(light.to_mitsuba().pixels, dtype=np.float32))
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1, "hide_emitters": True},
            "sensor": {
                "type": "perspective",
                "fov": math.degrees(ANGLE),
                "to_world": camera,
                "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}},
                "sampler": {"type": sampler, "sample_count": samples},
            },
            "mesh": {"type": "ply", "filename": str(path), "bsdf": bsdf},
            "light": {
                "type": "envmap",
                "bitmap": bitmap,
                "to_world": mi.ScalarTransform4f(light.MITSUBA_TO_WORLD.tolist()),
            },
        }
    )
    path.unlink()
    return scene


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Seconds of processors, and by the clock."""
    start, clock = time.process_time(), time.perf_counter()
    work()
    return time.process_time() - start, time.perf_counter() - clock


def error(a: np.ndarray, truth: np.ndarray) -> float:
    return float((np.square(a - truth) / (truth * truth + 1e-2)).mean())


def compared(mi, mesh: gn.scenes.Mesh, m: gn.Reflectance, bsdf: dict, size: int, samples: int, repeats: int) -> str:
    """A line of figures."""
    light, count = gn.EnvironmentLight.studio(), size * size * samples / 1e6
    camera = gn.scenes.Camera(EYE, field_of_view=ANGLE)
    scenes = [scene_of(mi, mesh, bsdf, light, size, samples, kind) for kind in ("independent", "multijitter")]

    def ours(seed: int = 0, more: int = 1) -> gn.scenes.Image:
        return gn.render(m, light, mesh, size, samples * more, seed, camera=camera)

    def theirs(k: int = 0, seed: int = 0, more: int = 1) -> np.ndarray:
        return np.array(mi.render(scenes[k], spp=samples * more, seed=seed))[..., :3]

    truth = ours(99, 2048 // samples)
    inside = truth.alpha == 1.0
    ours(), theirs()
    times = [(*timed(ours), *timed(theirs)) for _ in range(repeats)]
    a, b = min(x[0] for x in times), min(x[2] for x in times)
    ratios = sorted(x[2] / x[0] for x in times)
    wall = min(x[3] for x in times) / min(x[1] for x in times)
    own = error(ours().pixels[inside], truth.pixels[inside])
    shares = [b / a * error(theirs(k, 1)[inside], truth.pixels[inside]) / own for k in (0, 1)]
    mean = np.mean([theirs(1, 2 + k, 8)[inside].mean() for k in range(3)]) / truth.pixels[inside].mean() - 1.0
    return (
        f"{count / a:5.2f} / {count / b:5.2f}, {b / a:.2f} times the speed (pairs {ratios[0]:.2f} to {ratios[-1]:.2f}, "
        f"by the clock {wall:.2f}); at equal noise {shares[0]:.1f} times independent, {shares[1]:.1f} times "
        f"multijitter; means differ by {100.0 * mean:+.3f} %"
    )


def main(size: int = 256, samples: int = 64, repeats: int = 5) -> None:
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    cpu = next((x.split(":")[1].strip() for x in lines if x.startswith("model name")), "unknown")
    print(f"{cpu}, {os.cpu_count()} processors, busy with {os.getloadavg()[0]:.1f} before; Mitsuba {mi.__version__}")
    print(f"{size} x {size}, {samples} samples; M samples a second of one core, ours / theirs (pixels of the picture)")
    for rows in (72, 708):
        mesh = bumpy(rows)
        for name, (m, bsdf) in MATERIALS.items():
            figures = compared(mi, mesh, m, bsdf, size, samples, repeats)
            print(f"{len(mesh.triangles.faces):7} triangles, {name:16} {figures}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
