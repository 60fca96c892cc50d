"""What becomes of light, drawn against its angle of incidence: reflected, transmitted and absorbed, together 1."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..integrals.fate import fate

COLOURS = {"reflected": "#c47a00", "transmitted": "#2f86c1", "absorbed": "#4a4a4a"}
STEPS = np.linspace(0.0, 89.5, 25)


def draw_fate(axes: Any, m: Reflectance) -> None:
    """Draw the three shares on axes of Matplotlib, one upon the other: light from in front up to 90°, then behind.

    Channels are averaged.
    """
    theta = np.concatenate([STEPS, 180.0 - STEPS[::-1]])
    shares = [np.asarray(x) for x in fate(m, direction(np.radians(theta), 0.3), tolerance=1e-3)]
    shares = [x if x.ndim == 1 else x.mean(axis=-1) for x in shares]
    edge, top = np.zeros(len(theta)), max(1.0, 1.05 * float((shares[0] + shares[1]).max()) - 0.05)
    for (name, colour), share in zip(COLOURS.items(), shares, strict=True):
        share = np.maximum(share, 0.0)
        axes.fill_between(theta, edge, edge + share, color=colour, lw=0, label=name, alpha=0.85)
        edge = edge + share
    axes.axvline(90.0, color="white", lw=2.0)
    for x, words in ((45.0, "light in front"), (135.0, "light behind")):
        axes.text(x, 1.015 * top, words, ha="center", va="bottom", fontsize=9)
    if top > 1.0:
        axes.axhline(1.0, color="#c8362f", lw=1.2)
    axes.set(xlim=(0, 180), xticks=np.arange(0, 181, 30), xlabel="angle of incidence θᵢ [°]")
    axes.set(ylim=(0.0, top), ylabel="share of the light")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, frameon=False)
