"""Make the picture of docs/gonioreflectometer.md: python docs/pictures/gonioreflectometer.py [SIZE]

Above the surfaces from above, lit from the left; below what was measured on them, on spheres.
"""

import sys
import warnings
from pathlib import Path

import numpy as np
from PIL import Image

import gonio as gn
from gonio.errors import ToleranceWarning
from gonio.pictures.colour import srgb_encode

HERE = Path(__file__).parent
SIZE, SAMPLES, EXPOSURE = int((sys.argv[1:] or ["300"])[0]), 128, 0.4

METAL = gn.IdealSpecular(gn.Conductor([1.4, 1.0, 0.65], [7.6, 6.6, 5.4]))
SILK = gn.Lambertian([0.35, 0.03, 0.06]) + gn.Microfacet(gn.GGX(0.15), gn.Dielectric(1.5))
GLAZE = gn.Lambertian([0.05, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))

SURFACES = [
    (gn.surfaces.gaussian(0.35), METAL),
    (gn.surfaces.brushed(0.35), gn.Microfacet(gn.GGX(0.2), METAL.reflectance)),
    (gn.surfaces.weave(crimp=0.25), SILK),
    (gn.surfaces.spheres(0.4, sunk=0.6), GLAZE),
]


def relief(surface: gn.surfaces.HeightField) -> np.ndarray:
    """A part of the surface (SIZE, SIZE, 3) in [0, 1], bright where it faces up and left."""
    part = 1 if surface.heights.shape[0] < 200 else 2
    along, across = (x[: x.shape[0] // part, : x.shape[1] // part] for x in surface.slopes)
    shade = (1.0 + 0.7 * along - 0.4 * across) / np.sqrt(1.0 + along**2 + across**2) / np.sqrt(1.65)
    gray = Image.fromarray(np.uint8(255.0 * np.clip(srgb_encode(0.7 * np.clip(shade, 0.0, 1.0)), 0.0, 1.0)))
    return np.asarray(gray.resize((SIZE, SIZE), Image.Resampling.BILINEAR), float)[..., None].repeat(3, 2) / 255.0


def sphere(surface: gn.surfaces.HeightField, facet: gn.Reflectance) -> np.ndarray:
    """A sphere (SIZE, SIZE, 3) in [0, 1] of what was measured."""
    theta_i = np.radians(np.arange(0.0, 90.0, 10.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToleranceWarning)  # the last rows stay noisier: smooth enough for a picture
        m = gn.gonioreflectometer(surface, facet, theta_i, cells=(24, 48), tolerance=0.03, rays=1 << 16, surfaces=12)
    picture = gn.render(m, gn.EnvironmentLight.studio(), size=SIZE, samples=SAMPLES)
    assert picture.alpha is not None
    alpha = picture.alpha[..., None]
    return alpha * np.clip(srgb_encode(picture.pixels * 2.0**EXPOSURE), 0.0, 1.0) + (1.0 - alpha)


if __name__ == "__main__":
    rows = [[relief(surface) for surface, _ in SURFACES], [sphere(*pair) for pair in SURFACES]]
    edge = np.ones((SIZE, SIZE // 20, 3))
    strips = [np.concatenate([x for cell in row for x in (cell, edge)][:-1], axis=1) for row in rows]
    gap = np.ones((SIZE // 20, strips[0].shape[1], 3))
    codes = np.rint(255.0 * np.concatenate([strips[0], gap, strips[1]], axis=0)).astype(np.uint8)
    Image.fromarray(codes).save(HERE / "gonioreflectometer.jpg", quality=93, subsampling=0)
