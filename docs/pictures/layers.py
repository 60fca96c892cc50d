"""Make the picture of docs/layers.md: python docs/pictures/layers.py [SIZE]"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

import gonio as gn
from gonio.pictures.colour import srgb_encode

HERE = Path(__file__).parent
SIZE, SAMPLES, EXPOSURE = int((sys.argv[1:] or ["300"])[0]), 128, 0.4

METAL = gn.Microfacet(gn.GGX(0.25), gn.Conductor([1.4, 1.0, 0.65], [7.6, 6.6, 5.4]))
WOOD = gn.Lambertian([0.45, 0.26, 0.13])
RED = gn.Medium(0.6, albedo=[0.97, 0.35, 0.12], g=0.3)
AMBER = gn.Medium([0.1, 0.3, 0.8], albedo=0.0)

SPHERES = [
    METAL,
    gn.Stack([RED], METAL),
    gn.Stack([gn.Interface(1.5), RED], METAL),
    gn.Stack([gn.RoughInterface(1.5, 0.3), RED], METAL),
    WOOD,
    gn.Stack([gn.Interface(1.5)], WOOD),
    gn.Stack([gn.Interface(1.5), AMBER], WOOD),
    gn.Stack([gn.RoughInterface(1.5, 0.3), AMBER], WOOD),
]

if __name__ == "__main__":
    light = gn.EnvironmentLight.studio()
    cells = []
    for m in SPHERES:
        picture = gn.render(m, light, size=SIZE, samples=SAMPLES)
        assert picture.alpha is not None
        alpha = picture.alpha[..., None]
        cells.append(alpha * np.clip(srgb_encode(picture.pixels * 2.0**EXPOSURE), 0.0, 1.0) + (1.0 - alpha))
    rows = [np.concatenate(cells[i : i + 4], axis=1) for i in (0, 4)]
    codes = np.rint(255.0 * np.concatenate(rows, axis=0)).astype(np.uint8)
    Image.fromarray(codes).save(HERE / "layers.jpg", quality=93, subsampling=0)
