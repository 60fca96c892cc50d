"""Radiosity: time, memory, and the difference from Mitsuba's path tracing in a closed box with two blocks.

    python benchmarks/interreflection.py > benchmarks/interreflection.txt

A run in a process of its own for each number of patches; wall and processor time of the second of two runs. The
reference is the irradiance averaged over each patch, twice from independent samples a and b: the mean product of
(ours - a) and (ours - b) is the square of the error without the reference's noise.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from timing import machine

import gonio as gn

sys.path.append(str(Path(__file__).parents[1] / "docs" / "pictures"))
from radiosity import box

SAMPLES = 2048  # of each half of the reference, per patch


def timed(patches: int) -> None:
    scene = box()
    for _ in range(2):
        wall, work = time.perf_counter(), time.process_time()
        light = gn.scenes.radiosity(scene, patches=patches, method="rays")
        wall, work = time.perf_counter() - wall, time.process_time() - work
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    total = (light.balance + light.escaped).round(4)
    print(
        f"{patches:>8} {wall:8.2f} {work:8.2f} {peak:8.2f}   {total} {light.reciprocity:10.1e}",
        flush=True,
    )


def reference(scene: gn.Scene, light: gn.results.Radiosity, seed: int) -> np.ndarray:
    """Irradiance (n, 3) of the patches by Mitsuba's `path`."""
    with tempfile.TemporaryDirectory() as folder:
        loaded = loaded_by_mitsuba(scene, Path(folder))
    return irradiance(loaded, light, seed)


def loaded_by_mitsuba(scene: gn.Scene, folder: Path) -> Any:
    """The scene in Mitsuba, by way of a mesh file for each part."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    world: dict = {"type": "scene"}
    for number, part in enumerate(scene.parts):
        mesh = mi.Mesh(f"part{number}", len(part.triangles.vertices), len(part.triangles.faces))
        values = mi.traverse(mesh)
        values["vertex_positions"] = part.triangles.vertices.astype(np.float32).ravel()
        values["faces"] = part.triangles.faces.astype(np.uint32).ravel()
        values.update()
        name = str(folder / f"{number}.ply")
        mesh.write_ply(name)
        albedo = [float(x) for x in np.broadcast_to(part.material.parameters["rho"].value, 3)]
        world[f"part{number}"] = {
            "type": "ply",
            "filename": name,
            "face_normals": True,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo}},
        }
        if part.exitance.any():
            radiance = [float(x) / np.pi for x in np.broadcast_to(part.exitance, 3)]
            world[f"part{number}"]["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": radiance}}
    return mi.load_dict(world)


def irradiance(loaded: Any, light: gn.results.Radiosity, seed: int) -> np.ndarray:
    """Irradiance (n, 3) of the patches of a scene in Mitsuba."""
    import drjit as dr
    import mitsuba as mi

    path = mi.load_dict({"type": "path", "max_depth": 60, "rr_depth": 12})
    rng = np.random.default_rng(seed)
    n = len(light.part)
    normal = np.cross(light.corners[:, 1] - light.corners[:, 0], light.corners[:, 2] - light.corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    albedo = np.maximum(light.albedo, 1e-6)
    step, total = 128, np.zeros((n, 3))
    for k in range(SAMPLES // step):
        u = rng.random((n, step, 2))
        root = np.sqrt(u[..., 0])
        places = np.stack([1.0 - root, root * (1.0 - u[..., 1]), root * u[..., 1]], axis=-1)
        o = (places @ light.corners + 1e-4 * normal[:, None]).reshape(-1, 3)
        d = np.repeat(-normal, step, axis=0)
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed * 1000 + k, len(o))
        ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(o.T), mi.Vector3f(d.T)))
        radiance, _, _ = path.sample(loaded, sampler, ray)
        dr.eval(radiance)
        total += np.array(radiance).T.reshape(n, step, 3).mean(axis=1)
    return np.pi * total / (SAMPLES // step) / albedo  # of radiance ρ E/π, seen from just above


def compared(patches: int) -> None:
    scene = box()
    light = gn.scenes.radiosity(scene, patches=patches, method="rays")
    a, b = (reference(scene, light, seed) for seed in (1, 2))
    area = np.linalg.norm(
        np.cross(light.corners[:, 1] - light.corners[:, 0], light.corners[:, 2] - light.corners[:, 0]), axis=1
    )[:, None]
    lit = light.part < light.part.max()  # the lamp reflects nothing
    area, e, a, b = area[lit] / area[lit].sum(), light.irradiance[lit], a[lit], b[lit]
    mean = (area * 0.5 * (a + b)).sum(axis=0)
    rms = np.sqrt(np.maximum((area * (e - a) * (e - b)).sum(axis=0), 0.0)) / mean
    absolute = (area * np.abs(e - 0.5 * (a + b))).sum(axis=0) / mean
    noise = (area * np.abs(0.5 * (a - b))).sum(axis=0) / mean
    bias = (area * e).sum(axis=0) / mean - 1.0
    for name, value in (
        ("rms error, noise of the reference taken out", rms),
        ("mean |error|, with it", absolute),
        ("mean |noise| of the reference", noise),
        ("mean irradiance, ours over its - 1", bias),
    ):
        print(f"  {name:<46} {100 * value[0]:6.2f} {100 * value[1]:6.2f} {100 * value[2]:6.2f} %", flush=True)


def main() -> None:
    print("\n".join(machine(2)), "\n512 rays a patch (tolerance 0.01), a box with two blocks, RGB\n", sep="\n")
    print(" patches   wall s    cpu s  peak GB   balance (RGB), reciprocity", flush=True)
    for patches in (1_000, 10_000, 100_000):
        subprocess.run([sys.executable, __file__, "timed", str(patches)], check=True)
    print("\n4000 patches against Mitsuba 3 `path`, over the mean irradiance, red, green, blue", flush=True)
    subprocess.run([sys.executable, __file__, "compared", "4000"], check=True)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        {"timed": timed, "compared": compared}[sys.argv[1]](int(sys.argv[2]))
    else:
        main()
