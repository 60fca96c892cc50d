"""Make the picture of docs/textures.md: python docs/pictures/textures.py [SIZE]"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

import gonio as gn
from gonio.pictures.colour import srgb_encode

HERE = Path(__file__).parent
SIZE, SAMPLES, EXPOSURE = int((sys.argv[1:] or ["300"])[0]), 128, 0.4
HEIGHT, WIDTH = 320, 640
V, U = np.meshgrid((np.arange(HEIGHT) + 0.5) / HEIGHT, (np.arange(WIDTH) + 0.5) / WIDTH, indexing="ij")
PLACES = np.moveaxis(gn.direction(np.pi * V, 2.0 * np.pi * U), -1, 0)


def noise(scale: float, seed: int) -> np.ndarray:
    """Smooth numbers from about -1 to 1 on the sphere, of waves in all directions, finer and weaker by octaves."""
    rng, total = np.random.default_rng(seed), np.zeros((HEIGHT, WIDTH))
    for octave in range(4):
        for _ in range(8):
            w = scale * 2.0**octave * gn.directions.normalize(rng.normal(size=3))
            total += 0.5**octave * np.sin(np.tensordot(w, PLACES, 1) + rng.uniform(0.0, 2.0 * np.pi))
    return total / 4.0


def mixed(a: list[float], b: list[float], share: np.ndarray) -> np.ndarray:
    return np.asarray(a) + share[..., None] * (np.asarray(b) - np.asarray(a))


def chequers() -> gn.Reflectance:
    """The same paint, smooth and rough."""
    odd = np.floor(16 * U) % 2 == np.floor(8 * V) % 2
    paint = gn.Lambertian(gn.Texture(mixed([0.5, 0.04, 0.03], [0.75, 0.7, 0.6], odd * 1.0)))
    return paint + gn.Microfacet(gn.GGX(gn.Texture(np.where(odd, 0.45, 0.04))), gn.Dielectric(1.5))


def wood() -> gn.Reflectance:
    """Rings about an axis that leans, disturbed."""
    x, y = PLACES[0] + 0.3 * PLACES[2] + 0.08 * noise(2.0, 1), PLACES[1] + 0.05 * noise(3.0, 2)
    ring = (14.0 * np.hypot(x, y)) % 1.0
    fibre = 0.15 * noise(40.0, 3)
    colours = mixed([0.42, 0.2, 0.08], [0.16, 0.06, 0.02], np.clip(ring**3 + fibre, 0.0, 1.0))
    varnish = gn.Texture(np.clip(0.12 + 0.25 * ring**3, 0.05, 1.0))
    return gn.Lambertian(gn.Texture(colours)) + gn.Microfacet(gn.GGX(varnish), gn.Dielectric(1.5))


def bricks() -> gn.Reflectance:
    """Colours, and a normal map of the joints."""
    rows, columns = 14, 20
    row = np.floor(rows * V)
    x, y = (columns * U + 0.5 * (row % 2)) % 1.0 - 0.5, rows * V - row - 0.5
    edge = np.maximum(np.abs(x) - 0.44, np.abs(y) - 0.4) / 0.04
    height = np.clip(-edge, 0.0, 1.0) + 0.03 * noise(20.0, 4)
    shade = np.random.default_rng(5).uniform(0.6, 1.0, (rows, columns + 1))
    which = shade[row.astype(int), np.floor(columns * U + 0.5 * (row % 2)).astype(int) % columns]
    colours = which[..., None] * mixed([0.5, 0.48, 0.44], [0.42, 0.13, 0.07], np.clip(-2.0 * edge, 0.0, 1.0))
    n = np.stack([-np.gradient(height, axis=1), np.gradient(height, axis=0), np.full_like(height, 0.55)], -1)
    codes = 0.5 * (gn.directions.normalize(n) + 1.0)  # as a .png has them, divided by 255
    return gn.NormalMapped(gn.OrenNayar(gn.Texture(colours), 0.4), *gn.normal_map(codes))


def rust() -> gn.Reflectance:
    """A sum whose weights are a texture and what is left."""
    spread = np.clip(1.5 * noise(3.0, 8) + 0.2, 0.0, 1.0)
    steel = gn.Microfacet(gn.GGX(0.18), gn.Conductor([2.9, 2.9, 2.6], [3.1, 2.9, 2.7]))
    brown = gn.Lambertian(gn.Texture(mixed([0.25, 0.09, 0.03], [0.1, 0.03, 0.015], np.clip(noise(25.0, 9), 0.0, 1.0))))
    return gn.Texture(1.0 - spread) * steel + gn.Texture(spread) * brown


if __name__ == "__main__":
    light = gn.EnvironmentLight.studio()
    cells = []
    for make in (chequers, wood, bricks, rust):
        picture = gn.render(make(), light, size=SIZE, samples=SAMPLES)
        assert picture.alpha is not None
        alpha = picture.alpha[..., None]
        cells.append(alpha * np.clip(srgb_encode(picture.pixels * 2.0**EXPOSURE), 0.0, 1.0) + (1.0 - alpha))
    codes = np.rint(255.0 * np.concatenate(cells, axis=1)).astype(np.uint8)
    Image.fromarray(codes).save(HERE / "textures.jpg", quality=90, subsampling=0)
