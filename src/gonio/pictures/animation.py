"""Moving pictures: animated .png and .gif files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..errors import ParameterError
from ..files import replacing
from .files._source import library
from .image import Image, shown_on_screen

SUFFIXES = (".png", ".gif")


def save_animation(frames: Sequence[Image], path: str | os.PathLike[str], seconds: float, exposure: float) -> None:
    """Write frames that are shown for so many seconds in all, again and again.

    .png is sRGB of 8 bits with coverage, as `Image.save` writes it; .gif has 256 colours a frame, on white.
    """
    pillow = library("PIL.Image", "pillow")
    gif = Path(path).suffix.lower() == ".gif"
    coded = [pillow.fromarray(_codes(frame, exposure, opaque=gif)) for frame in frames]
    options = {"optimize": True} if gif else {"disposal": 1, "blend": 0}
    with replacing(path) as temporary:
        coded[0].save(
            str(temporary),
            format="GIF" if gif else "PNG",
            save_all=True,
            append_images=coded[1:],
            duration=1000.0 * seconds / len(frames),
            loop=0,
            **options,
        )


def _codes(frame: Image, exposure: float, opaque: bool) -> np.ndarray:
    if frame.pixels.shape[-1] not in (1, 3):
        raise ParameterError(f"frames have {frame.pixels.shape[-1]} channels, expected 1 or 3; choose channels=")
    codes = shown_on_screen(frame, 2.0**exposure)
    if opaque:
        codes = codes[..., :3] * codes[..., 3:] + 1.0 - codes[..., 3:]
    return np.floor(255.0 * codes + 0.5).astype(np.uint8)
