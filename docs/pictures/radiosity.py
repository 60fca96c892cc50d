"""A box with two blocks, lit by a lamp and by its own walls: `docs/pictures/radiosity.jpg`.

python docs/pictures/radiosity.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import gonio as gn
from gonio.pictures.colour import srgb_encode

WHITE, RED, GREEN = [0.73, 0.73, 0.73], [0.63, 0.06, 0.05], [0.14, 0.45, 0.09]


def quadrilaterals(*corners: list) -> tuple[np.ndarray, np.ndarray]:
    points = np.array(corners, float).reshape(-1, 3)
    return points, np.arange(len(points)).reshape(-1, 4)


def block(centre: list, side: float, height: float, turn: float) -> tuple[np.ndarray, np.ndarray]:
    """Top and sides of a block that stands on the floor."""
    a = turn + np.pi / 4 * np.array([5, 7, 1, 3])
    low = np.stack(
        [centre[0] + side / np.sqrt(2) * np.cos(a), centre[1] + side / np.sqrt(2) * np.sin(a), 0.0 * a], axis=1
    )
    high = low + np.array([0.0, 0.0, height])
    sides = [[low[k], low[(k + 1) % 4], high[(k + 1) % 4], high[k]] for k in range(4)]
    return quadrilaterals(high, *sides)


def box() -> gn.Scene:
    floor, ceiling = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]
    back, front = [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]], [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]]
    left, right = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]], [[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]]
    lamp = [[0.38, 0.38, 0.998], [0.38, 0.62, 0.998], [0.62, 0.62, 0.998], [0.62, 0.38, 0.998]]
    white = gn.Lambertian(WHITE)
    return gn.Scene(
        [
            gn.scenes.Mesh(quadrilaterals(floor, ceiling, back, front), white),
            gn.scenes.Mesh(quadrilaterals(left), gn.Lambertian(RED)),
            gn.scenes.Mesh(quadrilaterals(right), gn.Lambertian(GREEN)),
            gn.scenes.Mesh(block([0.34, 0.64], 0.3, 0.6, 0.3), white),
            gn.scenes.Mesh(block([0.68, 0.32], 0.3, 0.3, -0.3), white),
            gn.scenes.Mesh(quadrilaterals(lamp), gn.Lambertian(0.0), exitance=[20.0, 15.0, 8.0]),
        ]
    )


def main() -> None:
    from PIL import Image

    light = gn.scenes.radiosity(box(), patches=30_000)
    smooth = light.image(size=600)
    patches = gn.scenes.radiosity(box(), patches=3_000).image(size=600, smooth=False)
    shown = np.concatenate([p.pixels * p.alpha[..., None] for p in (smooth, patches)], axis=1)
    code = np.round(255.0 * srgb_encode(np.clip(2.0 * shown, 0.0, 1.0))).astype(np.uint8)
    Image.fromarray(code).save(Path(__file__).with_suffix(".jpg"), quality=90)


if __name__ == "__main__":
    main()
