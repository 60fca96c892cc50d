"""What becomes of light, drawn against its angle of incidence: reflected, transmitted and absorbed, together 1."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ..integrals.fate import fate as fate_of
from ._drawing import of_one_place, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {"reflected": "#e69f00", "transmitted": "#56b4e9", "absorbed": "#4a4a4a"}
STEPS = np.linspace(0.0, 89.5, 25)


@checked
def fate(m: Reflectance, path: str | os.PathLike[str] | None = None, axes: Any = None) -> Figure:
    """Draw what becomes of light, against its angle of incidence: reflected, transmitted and absorbed, together 1.

    Light comes from in front up to 90 degrees, then from behind; of materials that do not transmit, too. Channels are
    averaged.

    path       file to write: .png, .jpg, .pdf or .svg
    axes       of Matplotlib to draw into; by default a new figure

    Units      the figure has degrees; shares of the light.
    Error      shares to 1e-3, by `gn.fate`.
    Errors     ParameterError for other names of files, and for maps.

    Example
    >>> figure = gn.figures.fate(gn.ThinDielectric(1.5), path="pane.svg")
    >>> print([text.get_text() for text in figure.axes[0].get_legend().get_texts()])
    ['reflected', 'transmitted', 'absorbed']
    """
    of_one_place({repr(m): m})
    with panels(path, axes, 1, (5.4, 3.9)) as (figure, (where,)):
        draw_fate(where, m)
    return figure


def draw_fate(axes: Any, m: Reflectance) -> None:
    """Draw the three shares on axes of Matplotlib, one upon the other: light from in front up to 90°, then behind.

    Channels are averaged.
    """
    theta = np.concatenate([STEPS, 180.0 - STEPS[::-1]])
    shares = [np.asarray(x) for x in fate_of(m, direction(np.radians(theta), 0.3), tolerance=1e-3)]
    shares = [x if x.ndim == 1 else x.mean(axis=-1) for x in shares]
    edge, top = np.zeros(len(theta)), max(1.0, 1.05 * float((shares[0] + shares[1]).max()) - 0.05)
    for (name, colour), share in zip(COLOURS.items(), shares, strict=True):
        share = np.maximum(share, 0.0)
        axes.fill_between(theta, edge, edge + share, color=colour, lw=0, label=name, alpha=0.85)
        edge = edge + share
    axes.axvline(90.0, color="white", lw=2.0)
    for x, words in ((45.0, "light in front"), (135.0, "light behind")):
        axes.text(x, 1.015 * top, words, ha="center", va="bottom", fontsize="medium")
    if top > 1.0:
        axes.axhline(1.0, color="#d55e00", lw=1.2)
    axes.set(xlim=(0, 180), xticks=np.arange(0, 181, 30), xlabel="angle of incidence θᵢ [°]")
    axes.set(ylim=(0.0, top), ylabel="share of the light")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, frameon=False)
