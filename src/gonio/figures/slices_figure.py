"""f in the plane of incidence and across it, against the viewing angle."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ._curves import degrees_of, draw_cartesian, of_one, of_several, points_in_words
from ._drawing import materials_of, panels
from .polar_figure import INCIDENCE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLANES = (("in the plane of incidence", 0.0), ("across it", 0.5 * math.pi))
"""Planes of the views, and by how much [rad] they are turned from that of incidence."""

XLABEL = "viewing angle θₒ [°]"


@checked
def slices(
    materials: Mapping[str, Reflectance] | Sequence[Reflectance] | Reflectance,
    theta_i: Any = None,
    path: str | os.PathLike[str] | None = None,
    axes: Any = None,
) -> Figure:
    """Draw f against the viewing angle, in the plane of incidence and in the plane across it.

    Of one material two panels, with a curve for each angle of incidence. Of several, two panels for each angle of
    incidence, with a curve for each material. In the plane of incidence the light is on the left, at negative angles,
    and ticks mark the mirror directions; across it, views are at azimuths of 90 degrees from the light on the left, and
    of -90 degrees on the right. Points are measured values, with bars of two standard uncertainties.

    materials  one, a list, or label -> material
    theta_i    angles of incidence
    path       file to write: .png, .jpg, .pdf or .svg
    axes       of Matplotlib to draw into, one for each panel; by default a new figure

    Units      theta_i [rad]; the figure has degrees, and f [1/sr].
    Errors     ParameterError for other names of files, for maps, and for no material.

    Example
    >>> m = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
    >>> figure = gn.figures.slices(m, np.radians([0, 30, 60]), path="glossy.svg")
    >>> print(len(figure.axes))
    2
    """
    shown = materials_of(materials)
    thetas = degrees_of(theta_i)
    count = 2 * (len(thetas or INCIDENCE) if len(shown) > 1 else 1)
    columns = 2 if len(shown) == 1 else min(count // 2, 4)
    with panels(path, axes, count, (5.0 if columns < 3 else 4.2, 3.6), columns) as (figure, where):
        drawn = []
        for words, turn in PLANES:
            if len(shown) == 1:
                drawn.append((words, turn, of_one(next(iter(shown.values())), thetas, turn)))
            else:
                drawn += [(words, turn, panel) for panel in of_several(shown, thetas or INCIDENCE, turn)]
        if len(shown) > 1 and count // 2 > columns:  # rows of whole pairs
            drawn = [pair for k in range(count // 2) for pair in (drawn[k], drawn[k + count // 2])]
        for k, (each, (words, turn, panel)) in enumerate(zip(where, drawn, strict=True)):
            beside = [c.slice for _, _, other in drawn if other.title == panel.title for c in other.curves]
            has_bars = draw_cartesian(each, panel, k == 0, turn != 0.0, beside)
            points = points_in_words([c.slice for c in panel.curves], has_bars)
            each.set_title("; ".join(filter(None, (words, panel.title, points))), fontsize="medium")
            each.set_xlabel(f"{XLABEL}; ticks: mirror" if turn == 0.0 else XLABEL)
    return figure
