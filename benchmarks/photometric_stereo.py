"""Photometric stereo: texels a second, and errors of normals, beside plain least squares.

    OPENBLAS_NUM_THREADS=1 GONIO_THREADS=1 python benchmarks/photometric_stereo.py > benchmarks/photometric_stereo.txt

The scene is a sphere of 256 x 256 pixels, seen along +y, Lambertian with albedos 0.1 to 0.9, or with a dielectric GGX
lobe; lamps within 55 degrees of the camera; noise of 0.002, where a white surface that faces a lamp has 0.95. Peers are
NumPy's: `lstsq` of all texels at once, which knows no mask, and normal equations with a mask of values above a
threshold, solved in a batch. Errors are angles between normals [degrees], of pixels that face three lamps or more.
"""

from __future__ import annotations

import time

import numpy as np
import timing

import gonio as gn

SIZE, NOISE, E = 256, 0.002, 3.0
WO = np.array([0.0, -1.0, 0.0])
X, Z = np.meshgrid(np.linspace(-1.0, 1.0, SIZE), np.linspace(1.0, -1.0, SIZE))
SPHERE = X * X + Z * Z < 0.98
NORMAL = np.stack([X, -np.sqrt(1.0 - X * X - Z * Z, where=SPHERE, out=np.zeros(X.shape)), Z], axis=-1)[SPHERE]


def directions(count):
    """Unit vectors to lamps about the camera."""
    k = np.arange(count)
    return gn.directions.to_world(gn.direction(np.arccos(1.0 - 0.43 * (k + 0.5) / count), 2.39 * k), normal=WO)


def images(m, lamps, cast=0.0, seed=0):
    """(K, N) of the sphere, float32, with noise; a share `cast` of the values in shadows of other things."""
    random = np.random.default_rng(seed)
    exact = [gn.reflected_radiance(m, lamp, WO, normal=NORMAL, position=NORMAL) for lamp in lamps]
    exact = np.stack(exact)[..., 0]
    exact = np.where(random.random(exact.shape) < cast, 0.0, exact)
    return (exact + NOISE * random.standard_normal(exact.shape)).astype(np.float32)


def lstsq(values, w):
    """Least squares of all values."""
    return np.linalg.lstsq(E * w, values.astype(float), rcond=None)[0].T


def masked(values, w):
    """Normal equations with values above five times the noise, solved in a batch."""
    lit = (values > 5.0 * NOISE).astype(float)
    A = np.einsum("kt,ki,kj->tij", lit, E * w, E * w, optimize=True)
    q = np.einsum("kt,kt,ki->ti", lit, values.astype(float), E * w, optimize=True)
    return np.linalg.solve(A + 1e-9 * np.eye(3), q[..., None])[..., 0]


def best(call, repeats=5):
    """The shortest CPU time [s] of some."""
    seconds = []
    for _ in range(repeats):
        begun = time.process_time()
        call()
        seconds.append(time.process_time() - begun)
    return min(seconds)


def ways(count):
    """Ways to solve for four spheres of texels from some images, and the number of texels."""
    w = directions(count)
    far = [gn.DistantLight(x, E) for x in w]
    near = [gn.PointLight(3.0 * x, 9.0 * E) for x in w]
    m = gn.Lambertian(np.random.default_rng(1).uniform(0.1, 0.9, (len(NORMAL), 1)))
    values, close = (np.tile(images(m, lamps), (1, 4)) for lamps in (far, near))
    colours = np.stack([values, 0.5 * values, 0.2 * values], axis=-1)
    place = np.tile(NORMAL, (4, 1))
    return values.shape[1], {
        "gonio": lambda: gn.reconstruction.photometric_stereo(values, far),
        "gonio, near lamps": lambda: gn.reconstruction.photometric_stereo(close, near, position=place),
        "gonio, RGB": lambda: gn.reconstruction.photometric_stereo(colours, far, coloured=True),
        "gonio, cauchy": lambda: gn.reconstruction.photometric_stereo(values, far, robust="cauchy"),
        "numpy.linalg.lstsq, all values": lambda: lstsq(values, w),
        "numpy masked normal equations": lambda: masked(values, w),
    }


def speed():
    """Texels a second of CPU time, single channel but for RGB."""
    for count in (8, 32):
        texels, several = ways(count)
        print(f"{count} images, {texels} texels, texels a second of CPU time")
        for name, way in several.items():
            print(f"  {name:32} {texels / best(way):.3g}")


def angles(found):
    """Angles [degrees] to the true normals."""
    length = np.linalg.norm(found, axis=-1)
    cosine = (found * NORMAL).sum(axis=-1) / np.where(length > 0.0, length, 1.0)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def errors():
    """Mean error and 95th percentile of each way, on several surfaces."""
    random = np.random.default_rng(1)
    rho = random.uniform(0.1, 0.9, (len(NORMAL), 1))
    gloss = {alpha: gn.Microfacet(gn.GGX(alpha), gn.Dielectric(1.5)) for alpha in (0.1, 0.2, 0.4)}
    surfaces = {"Lambertian": gn.Lambertian(rho)}
    surfaces |= {f"Lambertian + GGX({alpha})": gn.Lambertian(rho) + lobe for alpha, lobe in gloss.items()}
    print("\nerrors of normals [degrees], mean and 95th percentile; cast: share of values in shadows of other things")
    for count in (8, 32):
        w = directions(count)
        lamps = [gn.DistantLight(x, E) for x in w]
        faced = ((w @ NORMAL.T) > 0.0).sum(axis=0) >= 3
        for name, m in surfaces.items():
            for cast in (0.0, 0.05):
                values = images(m, lamps, cast)
                normals = {
                    "lstsq": lstsq(values, w),
                    "masked": masked(values, w),
                    "gonio": gn.reconstruction.photometric_stereo(values, lamps).normal,
                    "with shadow": gn.reconstruction.photometric_stereo(values, lamps, shadow=5.0 * NOISE).normal,
                    "and cauchy": gn.reconstruction.photometric_stereo(
                        values, lamps, shadow=5.0 * NOISE, robust="cauchy"
                    ).normal,
                }
                kept = faced & np.all([np.isfinite(x).all(axis=-1) for x in normals.values()], axis=0)
                off = {way: angles(found)[kept] for way, found in normals.items()}
                text = "  ".join(f"{way} {x.mean():.2f} {np.quantile(x, 0.95):.2f}" for way, x in off.items())
                print(f"{count} images, {name}, cast {cast:.0%}: {text}")


def calibration():
    """The squared error over the squared standard error of normals, on average: 1 is right."""
    print("\nmean of squared error over squared standard error, 100000 texels that face all lamps: normal, albedo")
    random = np.random.default_rng(2)
    normal = gn.direction(random.uniform(0.0, 0.5, 100_000), random.uniform(0.0, 6.0, 100_000))
    for count in (4, 8, 32):
        lamps = [gn.DistantLight(gn.direction(0.6 + 0.1 * (k % 3), 2.39 * k), E) for k in range(count)]
        m = gn.Lambertian(np.full((1, 3), 0.5))
        exact = [gn.reflected_radiance(m, lamp, [0, 0, 1], normal=normal) for lamp in lamps]
        values = np.stack(exact) + NOISE * random.standard_normal((count, *exact[0].shape))
        for robust, u in (("none", NOISE), ("none", None), ("cauchy", None)):
            found = gn.reconstruction.photometric_stereo(values, lamps, u=u, robust=robust, coloured=True)
            off = 2.0 * np.arcsin(0.5 * np.linalg.norm(found.normal - normal, axis=-1)) / found.normal_stderr
            z = (found.albedo - 0.5) / found.albedo_stderr
            said = "u given" if u else "from scatter"
            print(f"  {count} images RGB, robust {robust}, {said}: {np.mean(off**2):.3f}, {np.mean(z**2):.3f}")


if __name__ == "__main__":
    print("\n".join(timing.machine(3)))
    speed()
    errors()
    calibration()
