"""Make the pictures of docs/polarization.md: python docs/pictures/polarization.py"""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import gonio as gn
from gonio.pictures.colour import srgb_encode

HERE = Path(__file__).parent
SIZE, SAMPLES = 260, 128

VARNISHED = gn.RoughCoated(gn.Lambertian([0.55, 0.07, 0.04]), alpha=0.12)
GOLD = gn.Microfacet(gn.GGX(0.25), gn.material("gold").fresnel)
LAMP = gn.DistantLight(gn.directions.normalize([0.35, -1.0, 0.45]), irradiance=2.2)

POLARIZING = {
    "black glass": gn.Microfacet(gn.GGX(0.05), gn.Dielectric(1.5)),
    "varnish": gn.RoughCoated(gn.Lambertian([0.4, 0.12, 0.08]), alpha=0.2),
    "gold": GOLD,
    "grass": gn.Lambertian([0.03, 0.06, 0.02]) + gn.Maignan(6.0, 0.7),
}
ROWS = ("as they look", "horizontal analyser", "degree of polarization")
LEFT, TOP, RIGHT = 44, 34, 76
INK, GROUND = (40, 40, 40), (0.20, 0.28, 0.34)
FONT = ImageFont.load_default(20)


def codes(picture: gn.scenes.Image, exposure: float = 0.0, ground: tuple[float, ...] = (1.0, 1.0, 1.0)) -> np.ndarray:
    """A picture on a ground, white or another, as sRGB."""
    pixels = np.broadcast_to(picture.pixels, (*picture.pixels.shape[:2], 3))
    alpha = picture.alpha[..., None]
    return alpha * np.clip(srgb_encode(pixels * 2.0**exposure), 0.0, 1.0) + (1.0 - alpha) * np.array(ground)


def linear(picture: gn.scenes.Image) -> np.ndarray:
    """A picture of numbers from 0 to 1, black to white, on a ground of its own: white is 1 and no paper."""
    alpha = picture.alpha[..., None]
    return alpha * picture.pixels + (1.0 - alpha) * np.array(GROUND)


def save(rows: list[list[np.ndarray]], name: str) -> None:
    whole = np.concatenate([np.concatenate(row, axis=1) for row in rows], axis=0)
    Image.fromarray(np.rint(255.0 * whole).astype(np.uint8)).save(HERE / name, quality=93, subsampling=0)


def crossed() -> None:
    """Varnish and gold: without filters, between parallel polarizers, between crossed ones."""
    rows = []
    for m, exposure in ((VARNISHED, 0.0), (GOLD, 0.3)):
        how = {"size": SIZE, "samples": SAMPLES}
        plain = gn.scenes.render_stokes(m, LAMP, **how).radiance
        lit = gn.scenes.render_stokes(m, LAMP, polarizer=0.0, **how)
        filtered = [lit.through(psi) for psi in (0.0, np.pi / 2)]
        rows.append([codes(plain, exposure), *(codes(picture, exposure + 1.0) for picture in filtered)])
    save(rows, "crossed_polarizers.jpg")


def degrees() -> None:
    """Glass, varnish, gold and grass under an even sky: as they look, behind a horizontal analyser, and the degree."""
    sky, rows = gn.ConstantLight(1.0), [[], [], []]
    for m, exposure in zip(POLARIZING.values(), (1.0, 0.5, -0.4, 2.0), strict=True):
        picture = gn.scenes.render_stokes(m, sky, size=SIZE, samples=SAMPLES)
        rows[0].append(codes(picture.radiance, exposure))
        rows[1].append(codes(picture.through(0.0), exposure + 1.0))
        rows[2].append(linear(picture.dop()))
    whole = np.concatenate([np.concatenate(row, axis=1) for row in rows], axis=0)
    height, width = whole.shape[:2]
    page = Image.new("RGB", (LEFT + width + RIGHT, TOP + height), "white")
    page.paste(Image.fromarray(np.rint(255.0 * whole).astype(np.uint8)), (LEFT, TOP))
    draw = ImageDraw.Draw(page)
    for column, name in enumerate(POLARIZING):
        draw.text((LEFT + (column + 0.5) * SIZE, TOP / 2), name, INK, FONT, anchor="mm")
    for row, name in enumerate(ROWS):
        label = Image.new("RGB", (SIZE, LEFT), "white")
        ImageDraw.Draw(label).text((SIZE / 2, LEFT / 2), name, INK, FONT, anchor="mm")
        page.paste(label.rotate(90, expand=True), (0, TOP + row * SIZE))
    x, top, bottom = LEFT + width + 14, TOP + 2 * SIZE + 14, TOP + 3 * SIZE - 14
    for y in range(top, bottom):
        gray = round(255 * (bottom - 1 - y) / (bottom - 1 - top))
        draw.line((x, y, x + 18, y), (gray, gray, gray))
    draw.rectangle((x, top, x + 18, bottom), outline=INK)
    for degree in (0.0, 0.5, 1.0):
        draw.text((x + 26, bottom - degree * (bottom - top)), f"{degree:g}", INK, FONT, anchor="lm")
    page.save(HERE / "degree_of_polarization.jpg", quality=93, subsampling=0)


if __name__ == "__main__":
    crossed()
    degrees()
