"""Draw the figures of docs/transmission.md: python docs/figures/transmission.py"""

from __future__ import annotations

import numpy as np
from make import HERE, save
from matplotlib.figure import Figure
from PIL import Image

import gonio as gn
from gonio.pictures.colour import srgb_encode

LEAF = [0.05, 0.12, 0.02], [0.04, 0.18, 0.02]
SHOWN = {
    "a window: ThinDielectric(1.5, 0.3)": gn.ThinDielectric(1.5, 0.3),
    "ground glass: RoughDielectric(GGX(0.4), 1.5)": gn.RoughDielectric(gn.GGX(0.4), 1.5),
    "the same, nothing lost: KullaContyDielectric(0.4, 1.5)": gn.KullaContyDielectric(0.4, 1.5),
    "a blind: Sheet of four blocks": gn.Sheet(
        gn.Lambertian(0.5), gn.Lambertian(0.2), gn.Lambertian(0.1), gn.Microfacet(gn.GGX(0.5), 0.3)
    ),
}
PICTURED = (
    gn.SmoothDielectric(1.5),
    gn.RoughDielectric(gn.GGX(0.25), 1.5),
    gn.ThinDielectric(1.5, [0.9, 0.15, 0.5]),
    gn.TwoSided(gn.Lambertian(LEAF[0]), gn.Lambertian(LEAF[0])) + gn.DiffuseTransmission(LEAF[1]),
    gn.Lambertian([0.55, 0.06, 0.04]) + gn.Microfacet(gn.GGX(0.08), gn.Dielectric(1.5)),
)
SIZE, SAMPLES = 240, 256


def fates() -> None:
    """What becomes of light, by its angle, for four materials."""
    figure = Figure(figsize=(9.6, 6.4), layout="constrained")
    for axes, (title, m) in zip(figure.subplots(2, 2).ravel(), SHOWN.items(), strict=True):
        gn.figures.fate(m, axes=axes)
        axes.set_title(title, fontsize=10, pad=18)
        axes.get_legend().remove()
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    save(figure, "transmission_fates")


def spheres() -> None:
    """Spheres of glass, ground glass, a green pane, a leaf and paint, side by side on white."""
    light, cells = gn.EnvironmentLight.studio(), []
    for m in PICTURED:
        picture = gn.render(m, light, size=SIZE, samples=SAMPLES)
        assert picture.alpha is not None
        alpha = picture.alpha[..., None]
        cells.append(alpha * np.clip(srgb_encode(picture.pixels * 1.6), 0.0, 1.0) + (1.0 - alpha))
    codes = np.rint(255.0 * np.concatenate(cells, axis=1)).astype(np.uint8)
    Image.fromarray(codes).save(HERE / "transmission_spheres.jpg", quality=93, subsampling=0)


if __name__ == "__main__":
    fates()
    spheres()
