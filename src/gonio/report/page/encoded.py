"""Pictures as text: data URIs, which need no file beside the page."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np

from ...pictures.colour import srgb_encode
from ...pictures.image import Image

RAMP = ("#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838")
"""Colours from low to high: cividis (Nuñez, Anderton & Renslow 2018), made for people who see fewer colours."""


def data_uri(codes: np.ndarray) -> str:
    """Codes (H, W, 3) or (H, W, 4), uint8, as a PNG in a data URI."""
    from PIL import Image as Pillow

    file = io.BytesIO()
    Pillow.fromarray(codes).save(file, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"


def photograph(image: Image) -> str:
    """A rendered picture with its coverage, as small as it looks the same; gray where channels are no colours."""
    from PIL import Image as Pillow
    from PIL import features

    pixels = image.colour
    rgb = pixels if pixels.shape[-1] == 3 else np.repeat(pixels.mean(axis=-1, keepdims=True), 3, axis=-1)
    codes = (np.clip(srgb_encode(np.nan_to_num(rgb)), 0.0, 1.0) * 255.0).round().astype(np.uint8)
    alpha = np.ones(codes.shape[:2]) if image.alpha is None else np.clip(image.alpha, 0.0, 1.0)
    codes = np.concatenate([codes, (alpha * 255.0).round().astype(np.uint8)[..., None]], axis=-1)
    if not features.check("webp"):
        return data_uri(codes)
    file = io.BytesIO()
    Pillow.fromarray(codes).save(file, "WEBP", quality=90, method=5)
    return f"data:image/webp;base64,{base64.b64encode(file.getvalue()).decode()}"


def heat_image(values: np.ndarray, low: float, high: float) -> str:
    """Numbers (rows from below) in colours on a logarithmic scale; transparent where they are NaN."""
    with np.errstate(all="ignore"):
        share = (
            np.log(np.maximum(values, low) / low) / np.log(max(high / max(low, 1e-300), 1.0 + 1e-9))
            if low > 0.0
            else values * 0.0
        )
    known = np.isfinite(values)
    at = np.clip(np.where(known, share, 0.0), 0.0, 1.0) * (len(RAMP) - 1)
    ramp: Any = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in RAMP], float)
    k = np.minimum(at.astype(int), len(RAMP) - 2)
    codes = ramp[k] + (ramp[k + 1] - ramp[k]) * (at - k)[..., None]
    codes = np.concatenate([codes, np.where(known, 255.0, 0.0)[..., None]], axis=-1)
    return data_uri(codes[::-1].round().astype(np.uint8))
