"""Which colours pictures show the channels of a material in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ParameterError
from ..pictures.colour import rgb_of
from .channel_names import places

if TYPE_CHECKING:
    from .reflectance import Reflectance


def is_rgb(m: Reflectance) -> bool:
    """Whether the channels of a material are linear RGB."""
    return m.channels == 3 and m.channel_names in (None, ("R", "G", "B"))


def shown_as(m: Reflectance, channels: Sequence[str | float] | None = None) -> np.ndarray | None:
    """The matrix (C, 3), or (C, 1), by which pictures show channels: bands, wavelengths, X, Y, Z. None: as they are."""
    picked = chosen(m, channels)
    return rgb_of(m.channel_names) if picked is None else picked


def is_coloured(m: Reflectance, channels: Sequence[str | float] | None = None) -> bool:
    """Whether a material is gray or RGB, or pictures show it so."""
    return (m.channels or 1) == 1 or is_rgb(m) or shown_as(m, channels) is not None


def chosen(m: Reflectance, channels: Any) -> np.ndarray | None:
    """The matrix (C, 3), or (C, 1), that picks the bands of a picture out of the channels; None for all as they are."""
    if channels is None:
        words = [str(name).lower() for name in m.channel_names or ()]
        if not {"red", "green", "blue"} <= {*words}:
            return None
        return np.eye(len(words))[:, [words.index(word) for word in ("red", "green", "blue")]]
    if not isinstance(channels, (list, tuple)) or len(channels) not in (1, 3):
        raise ParameterError(
            f"channels={channels!r:.60}: expected three channels, for red, green and blue, or a list of one"
        )
    return np.eye(m.channels or 1)[:, places(m, channels)]
