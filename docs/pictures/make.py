"""Make the pictures of the README and of docs/check.md: python docs/pictures/make.py"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

import gonio as gn
from gonio.pictures.colour import srgb_encode

HERE = Path(__file__).parent
SIZE, SAMPLES, EXPOSURE = 300, 128, 0.4

SPHERES = [
    gn.material("gold"),
    gn.Microfacet(gn.GGX(0.08, 0.35), gn.material("pure-aluminium").fresnel),
    gn.material("copper", alpha=0),
    gn.material("green-metallic-paint"),
    gn.material("red-fabric"),
    gn.material("blue-acrylic"),
    gn.Lambertian([0.75, 0.72, 0.68]) + gn.Microfacet(gn.GGX(0.05), gn.Dielectric(1.5)),
    gn.material("yellow-matte-plastic"),
]


def hero() -> None:
    """Eight spheres in two rows, on white."""
    light = gn.EnvironmentLight.studio()
    cells = []
    for m in SPHERES:
        picture = gn.render(m, light, size=SIZE, samples=SAMPLES)
        assert picture.alpha is not None
        alpha = picture.alpha[..., None]
        cells.append(alpha * np.clip(srgb_encode(picture.pixels * 2.0**EXPOSURE), 0.0, 1.0) + (1.0 - alpha))
    rows = [np.concatenate(cells[i : i + 4], axis=1) for i in (0, 4)]
    codes = np.rint(255.0 * np.concatenate(rows, axis=0)).astype(np.uint8)
    Image.fromarray(codes).save(HERE / "materials.jpg", quality=93, subsampling=0)


def figures() -> None:
    """What `gn.figures` draws of a paint and a metal."""
    paint = gn.Lambertian([0.4, 0.05, 0.05]) + gn.Microfacet(gn.GGX(0.15), gn.Dielectric(1.5))
    steel = gn.Microfacet(gn.GGX(0.3), gn.Conductor(2.9, 3.1))
    both = {"paint": paint, "steel": steel}
    figure = Figure(figsize=(12.0, 6.6), layout="constrained")
    (a, b, c), (d, e, f) = figure.subplots(2, 3)
    gn.figures.polar(paint, axes=a)
    gn.figures.half_difference(paint, axes=b)
    gn.figures.half_difference(steel, axes=c)
    gn.figures.slices(both, [0.5], axes=[d, e])
    gn.figures.albedo(both, axes=f)
    figure.savefig(HERE / "figures.png", dpi=110)


if __name__ == "__main__":
    hero()
    figures()
    m = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    gn.figures.overview(m, gn.EnvironmentLight.studio(), HERE / "show.png", size=320, samples=128)
    paint = gn.OriginalPhong(0.25, 8.0)
    gn.figures.laws(paint, path=HERE / "check.png")
