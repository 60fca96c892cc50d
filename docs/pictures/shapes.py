"""Shapes, meshes, cameras, the ground and the backdrop: `docs/pictures/shapes.jpg`.

python docs/pictures/shapes.py
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

import gonio as gn

SIZE, SAMPLES = 320, 256


def ring(radius: float, thick: float, centre: list[float], sides: int = 96) -> tuple[np.ndarray, np.ndarray]:
    """A torus about z."""
    a, b = np.meshgrid(*[np.arange(sides) * (2.0 * math.pi / sides)] * 2)
    r = radius + thick * np.cos(b)
    vertices = np.stack([r * np.cos(a), r * np.sin(a), thick * np.sin(b)], -1).reshape(-1, 3) + np.array(centre)
    i, j = np.mgrid[:sides, :sides]
    k, m = (i + 1) % sides, (j + 1) % sides
    return vertices, np.stack([i * sides + j, i * sides + m, k * sides + m, k * sides + j], -1).reshape(-1, 4)


def pictures() -> list[gn.scenes.Image]:
    """All of them, in rows of three."""
    studio, floor = gn.EnvironmentLight.studio(), gn.Lambertian(0.4)
    high = gn.scenes.Camera([2.0, -5.0, 2.6], [0.0, 0.0, -0.1], field_of_view=0.5)
    squares = np.indices((8, 24)).sum(axis=0) % 2
    checked = gn.Texture(np.where(squares[..., None] == 1, [0.5, 0.08, 0.05], [0.6, 0.55, 0.45]), filter="nearest")
    paint = gn.Lambertian([0.1, 0.25, 0.5]) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    gold, copper = gn.material("gold", alpha=0.25), gn.material("copper", alpha=0.15)
    rings = gn.Scene(
        [
            gn.scenes.Mesh(ring(0.8, 0.2, [0.0, 0.0, 0.2]), gold),
            gn.scenes.Mesh(ring(0.6, 0.17, [0.0, 0.0, 0.55]), paint),
            gn.scenes.Mesh(ring(0.4, 0.14, [0.0, 0.0, 0.85]), copper),
        ]
    )
    lamp = gn.RectangleLight([-1.2, -0.8, 2.0], [0.8, 0.0, 0.0], [0.0, -0.8, 0.0], radiance=14.0)
    rng = np.random.default_rng(3)
    k = 2.0 * math.pi * rng.integers(-5, 6, (60, 2))
    at = np.stack(np.meshgrid(*[np.arange(192) / 192.0] * 2), -1)
    waves = sum(np.cos(at @ w + p) / (5.0 + w @ w / 40.0) for w, p in zip(k, rng.uniform(0.0, 6.3, 60), strict=True))
    options = {"size": SIZE, "samples": SAMPLES}
    return [
        gn.render(gn.Lambertian(checked), studio, "cylinder", camera=high, ground=floor, **options),
        gn.render(gold, studio, gn.scenes.Mesh(ring(0.7, 0.3, [0, 0, 0])), ground=floor, **options),
        gn.render(
            rings,
            studio,
            camera=gn.scenes.Camera([-2.4, -3.6, 1.0], [0, 0, 0.45]),
            ground=floor,
            backdrop=True,
            **options,
        ),
        gn.render(paint, [lamp, gn.ConstantLight(0.15)], camera=high, ground=floor, **options),
        gn.render(copper, studio, gn.surfaces.HeightField(0.09 * waves, (1 / 192, 1 / 192)), **options),
        gn.render(gn.Microfacet(gn.GGX(0.35, 0.06), 0.9), studio, "disk", camera=high, ground=floor, **options),
    ]


def main() -> None:
    from PIL import Image

    from gonio.pictures.colour import srgb_encode

    shown = [p.pixels * p.alpha[..., None] + 1.0 - p.alpha[..., None] for p in pictures()]
    shown = [np.broadcast_to(x, (SIZE, SIZE, 3)) for x in shown]
    whole = np.concatenate([np.concatenate(shown[k : k + 3], axis=1) for k in (0, 3)])
    code = np.round(255.0 * srgb_encode(np.clip(whole, 0.0, 1.0))).astype(np.uint8)
    Image.fromarray(code).save(Path(__file__).with_suffix(".jpg"), quality=88)


if __name__ == "__main__":
    main()
