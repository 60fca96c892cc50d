"""Every light in `docs/pictures/lights.jpg`, and others beside it: python docs/pictures/lights.py

Each as the `Looks` of its docstring says: a matt sphere, one of rough metal, and the floor from above, lit, or, under
light that is the same everywhere, the sky from below. The picture's comment holds what it shows.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import gonio as gn
from gonio.base.light import Light
from gonio.facts.models import example
from gonio.pictures.colour import srgb_encode

PICTURE = Path(__file__).with_suffix(".jpg")
SIZE, GAP, TEXT, COLUMNS, SAMPLES = 128, 6, 26, 2, 512
WIDTH, HEIGHT = 3 * SIZE + 5 * GAP, SIZE + TEXT + GAP
MATT, METAL = gn.Lambertian(0.8), gn.Microfacet(gn.GGX(0.07), 0.95)
EXTENT = 3.0
"""Half the width [m] of the floor that is shown, 1 m below the middle of the sphere."""


def examples() -> dict[str, str]:
    """Name of each light -> the expression that is shown."""
    return {name: example(kind) for name, kind in gn.lights().items()}


def place(k: int) -> tuple[slice, slice]:
    """Rows and columns of the spheres of the light number k."""
    left, top = k % COLUMNS * WIDTH + GAP, k // COLUMNS * HEIGHT + TEXT
    return slice(top, top + SIZE), slice(left, left + 2 * SIZE + GAP)


def lit(light: Light) -> list[np.ndarray]:
    """The three pictures (SIZE, SIZE, 3), linear, on white."""
    return [*(_sphere(m, light) for m in (MATT, METAL)), _rgb(_around(light))]


def _sphere(m: gn.Reflectance, light: Light) -> np.ndarray:
    picture = gn.render(m, light, size=SIZE, samples=SAMPLES)
    assert picture.alpha is not None
    alpha = picture.alpha[..., None]
    return _rgb(alpha * np.clip(picture.pixels, 0.0, 1.0) + (1.0 - alpha))


def _around(light: Light) -> np.ndarray:
    """White paint on the floor, from above, x to the right; or the sky, on its back, where it lights all alike."""
    at = (np.arange(SIZE) + 0.5) / (0.5 * SIZE) - 1.0
    x, y = np.meshgrid(at, -at)
    ends = gn.irradiance(light, [[0.0, 0.0, -1.0], [EXTENT, EXTENT, -1.0]])
    if light.is_delta or not np.allclose(ends[0], ends[1], rtol=1e-6):
        floor = np.stack([EXTENT * x, EXTENT * y, -1.0 + 0.0 * x], axis=-1)
        return np.asarray(gn.irradiance(light, floor)) / np.pi
    r = np.hypot(x, y)
    sky = light.incident(gn.direction(0.5 * np.pi * np.minimum(r, 1.0), np.arctan2(y, x)))
    return np.where(r[..., None] < 1.0, np.clip(sky, 0.0, 1.0), 1.0)


def _rgb(values: Any) -> np.ndarray:
    values = values if np.ndim(values) > 2 else np.asarray(values)[..., None]
    return np.broadcast_to(np.clip(values, 0.0, 1.0), (SIZE, SIZE, 3))


def main() -> None:
    shown = examples()
    count = -(-len(shown) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * WIDTH, count * HEIGHT), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(15)
    for k, (name, text) in enumerate(shown.items()):
        rows, columns = place(k)
        pen.text((columns.start, rows.start - TEXT + 5), name, "black", font)
        for i, values in enumerate(lit(eval(text, vars(gn) | {"np": np}))):
            code = np.rint(255.0 * srgb_encode(values)).astype(np.uint8)
            sheet.paste(Image.fromarray(code), (columns.start + i * (SIZE + GAP), rows.start))
    sheet.save(PICTURE, quality=78, comment=json.dumps(shown))


def compare() -> None:
    smooth, rough = (gn.render(gn.material("gold", alpha=a), size=192, samples=512) for a in (0.2, 0.3))
    gn.scenes.picture_difference(smooth, rough).save(
        PICTURE.with_name("difference.jpg"), ["alpha = 0.2", "alpha = 0.3"]
    )


if __name__ == "__main__":
    main()
    compare()
