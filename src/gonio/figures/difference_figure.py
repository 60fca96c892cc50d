"""Two pictures, or two materials, and their difference."""

from __future__ import annotations

import math
import os
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ..errors import ParameterError
from ..pictures.difference import PictureDifference, picture_difference
from ..pictures.image import Image
from ._drawing import check_target, new_figure, of_one_place
from ._slices import units_of
from .gallery_figure import draw_picture, factor
from .half_difference_figure import colour_bar, draw_slices, half_difference_axes, nodes, slice_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPAN = 0.995
"""Share of the pixels that the scale of a figure holds."""

SIGNED = "RdBu_r"

WIDE = 110
"""Characters of a line below the pictures."""


@checked
def difference(
    a: Reflectance | Image | PictureDifference,
    b: Reflectance | Image | None = None,
    path: str | os.PathLike[str] | None = None,
    labels: Sequence[str] = ("a", "b"),
    exposure: float = 0.0,
) -> Figure:
    """Draw two pictures and b - a with its scale, above the numbers of `gn.scenes.picture_difference`; or two
    materials.

    Of RGB pictures the difference is shown as luminance; of others as the mean of the channels. Blue is where b is
    darker, red where it is brighter; the scale holds all but the largest 0.5 % of the pixels. Of materials, f is drawn
    by half and difference angle as in `gn.figures.half_difference`, and the difference over the mean of both.

    a, b       two pictures, two materials, or `a` alone: what `gn.scenes.picture_difference` found
    path       file to write: .png, .jpg, .pdf or .svg
    labels     their names
    exposure   stops by which the pictures are brightened

    Errors     ParameterError for other names of files; those of `gn.scenes.picture_difference`.

    Example
    >>> a, b = (gn.scenes.Image(np.full((4, 4, 3), level)) for level in (0.5, 0.55))
    >>> figure = gn.figures.difference(a, b, path="difference.png", labels=["before", "after"])
    >>> rough = gn.figures.difference(gn.material("gold", alpha=0.2), gn.material("gold", alpha=0.3))
    >>> print(rough.axes[2].get_title())
    b − a
    """
    check_target(path)
    if len(labels) != 2:
        raise ParameterError(f"labels={list(labels)!r:.80}: expected two, of a and of b")
    titles = (str(labels[0]), str(labels[1]))
    if isinstance(a, Reflectance) and isinstance(b, Reflectance):
        return _of_materials(a, b, path, titles)
    if isinstance(a, PictureDifference) and b is None:
        return _of_pictures(a, path, titles, exposure)
    if isinstance(a, Image) and isinstance(b, Image):
        return _of_pictures(picture_difference(a, b), path, titles, exposure)
    kinds = " and ".join(type(x).__name__ for x in (a, b))
    raise ParameterError(
        f"figures.difference: got {kinds}; expected two pictures, two materials, or one gn.results.PictureDifference"
    )


def _of_pictures(
    found: PictureDifference, path: str | os.PathLike[str] | None, titles: tuple[str, str], exposure: float
) -> Figure:
    one = found.of_one_number()
    known = np.abs(one[found.inside])
    limit = float(np.quantile(known[np.isfinite(known)], SPAN)) or 1e-6
    height, width = one.shape
    scale = factor(exposure)
    with new_figure(path, (12.0, 1.3 + 4.0 * min(height / width, 3.0))) as figure:
        axes = figure.subplots(1, 3)
        for where, picture, title in zip(axes[:2], (found.a, found.b), titles, strict=True):
            draw_picture(where, picture, scale, title)
        shown = np.where(found.inside, one, np.nan)
        drawn = axes[2].imshow(shown, cmap=SIGNED, vmin=-limit, vmax=limit, interpolation="nearest")
        axes[2].set_axis_off()
        axes[2].set_title(f"{titles[1]} − {titles[0]}"[:80], parse_math=False)
        figure.colorbar(drawn, ax=axes[2], shrink=0.8, extend="both", label=found.measure)
        told = textwrap.wrap(found.told(*titles), WIDE)
        figure.supxlabel("\n".join(told[:3]), fontsize=11, parse_math=False)
    return figure


def _of_materials(
    a: Reflectance, b: Reflectance, path: str | os.PathLike[str] | None, titles: tuple[str, str]
) -> Figure:
    of_one_place(dict(zip(titles, (a, b), strict=True)) if titles[0] != titles[1] else {titles[0]: a, "b": b})
    images = [slice_of(m, 0.5 * math.pi) for m in (a, b)]
    with np.errstate(invalid="ignore", divide="ignore"):
        off: Any = 100.0 * (images[1] - images[0]) / (0.5 * (np.abs(images[0]) + np.abs(images[1])))
    off = np.where(np.isfinite(images[0] + images[1]), np.nan_to_num(off), np.nan)
    known = np.abs(off[np.isfinite(off)])
    limit = max(float(np.quantile(known, SPAN)) if known.size else 0.0, 0.1)
    unit = units_of((a, b))
    with new_figure(path, (12.6, 3.9)) as figure:
        axes = figure.subplots(1, 3)
        drawn = draw_slices(axes[:2], images, titles)
        colour_bar(drawn, axes[:2], f"f [sr⁻¹]{', ' + unit if unit else ''}")
        apart = axes[2].pcolormesh(
            *nodes(), np.ma.masked_invalid(off), cmap=SIGNED, vmin=-limit, vmax=limit, rasterized=True
        )
        half_difference_axes(axes[2], f"{titles[1]} − {titles[0]}", False)
        colour_bar(apart, axes[2:], "difference / mean [%]")
    return figure
