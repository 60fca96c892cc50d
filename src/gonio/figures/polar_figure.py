"""f in the plane of incidence as polar slices."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ._curves import degrees_of, draw_polar, of_one, of_several
from ._drawing import materials_of, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INCIDENCE = (15.0, 45.0, 75.0)
"""Angles of incidence [degrees] at which materials are compared."""


@checked
def polar(
    materials: Mapping[str, Reflectance] | Sequence[Reflectance] | Reflectance,
    theta_i: Any = None,
    path: str | os.PathLike[str] | None = None,
    axes: Any = None,
) -> Figure:
    """Draw f in the plane of incidence as a half circle of viewing angles, with a logarithmic radius.

    Of one material a curve for each angle of incidence, by default those of 0 to 75 degrees, of a measurement those
    that were measured; points are measured values. Of several, a half circle for each angle of incidence, with a curve
    for each material. Light comes from the left; a tick on the circle marks it. f of several channels is drawn as
    luminance, or as their mean, as the title says. Curves end where the data end.

    materials  one, a list, or label -> material
    theta_i    angles of incidence
    path       file to write: .png, .jpg, .pdf or .svg
    axes       of Matplotlib to draw into, one for each half circle; by default a new figure

    Units      theta_i [rad]; the figure has degrees, and f [1/sr].
    Errors     ParameterError for other names of files, for maps, and for no material.

    Example
    >>> gold = {f"alpha = {a}": gn.material("gold", alpha=a) for a in (0.1, 0.3)}
    >>> figure = gn.figures.polar(gold, np.radians([30, 60]), path="gold.pdf")
    >>> print(len(figure.axes))
    2
    """
    shown = materials_of(materials)
    thetas = degrees_of(theta_i)
    many = len(shown) > 1
    count = len(thetas or INCIDENCE) if many else 1
    with panels(path, axes, count, (4.6, 3.4)) as (figure, hosts):
        if not many:
            panel = of_one(next(iter(shown.values())), thetas)
            words = f", {panel.unit}" if panel.unit else ""
            draw_polar(hosts[0], panel, f"f [sr⁻¹]{words}\nin the plane of incidence, light from the left", True)
            return figure
        for k, (host, panel) in enumerate(zip(hosts, of_several(shown, thetas or INCIDENCE), strict=True)):
            words = f", {panel.unit}" if panel.unit and not k else ""
            draw_polar(host, panel, f"f [sr⁻¹]{words}; {panel.title}", k == count // 2)
    return figure
