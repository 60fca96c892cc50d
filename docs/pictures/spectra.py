"""Make the picture of docs/spectra.md: python docs/pictures/spectra.py"""

from pathlib import Path

import numpy as np
from PIL import Image

import gonio as gn
from gonio.pictures.colour import srgb_encode

HERE = Path(__file__).parent
SIZE, SAMPLES, EXPOSURE = 300, 128, 0.4
NM = np.arange(380.0, 781.0, 5.0)
THREE = (630.0, 532.0, 465.0)

SUBSTANCES = [
    gn.Conductor(*gn.spectra.refractive_index("gold")),
    gn.Conductor(*gn.spectra.refractive_index("copper")),
    gn.ThinFilm(1.33, thickness=500.0, substrate=1.0),
    gn.FilmStack(*5 * [gn.Film(1.56, 90.0), gn.Film(1.0, 80.0)], eta=1.56),
]


def sphere(m: gn.Reflectance, exposure: float) -> np.ndarray:
    """A lit sphere on white, as sRGB."""
    picture = gn.render(m, gn.EnvironmentLight.studio(), size=SIZE, samples=SAMPLES)
    assert picture.alpha is not None
    alpha = picture.alpha[..., None]
    return alpha * np.clip(srgb_encode(picture.pixels * 2.0**exposure), 0.0, 1.0) + (1.0 - alpha)


def main() -> None:
    """By 81 wavelengths above, by three below."""
    rows = []
    for nm in (NM, THREE):
        cells = []
        for fresnel in SUBSTANCES:
            m = gn.Microfacet(gn.GGX(0.1), fresnel).at(nm)
            exposure = EXPOSURE + (2.0 if isinstance(fresnel, gn.ThinFilm) else 0.0)
            cells.append(sphere(m if nm is NM else m.with_channels(None), exposure))
        rows.append(np.concatenate(cells, axis=1))
    codes = np.rint(255.0 * np.concatenate(rows, axis=0)).astype(np.uint8)
    Image.fromarray(codes).save(HERE / "spectra.jpg", quality=93, subsampling=0)


if __name__ == "__main__":
    main()
