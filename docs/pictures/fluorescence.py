"""Draw the picture of docs/fluorescence.md: `python docs/pictures/fluorescence.py` writes it beside this file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import gonio as gn
from gonio.pictures.colour import srgb_encode

HERE = Path(__file__).resolve().parent
INK, GREY, VIOLET, WARM, BLUE = "#1a1a1a", "#7a7a7a", "#6a3fb5", "#c46a00", "#1c5fa8"
SIZE, SAMPLES = 220, 48

NM = np.arange(320.0, 741.0, 10.0)
COTTON = gn.Spectrum([300.0, 380.0, 420.0, 480.0, 580.0, 760.0], [0.3, 0.45, 0.62, 0.74, 0.84, 0.88])
PAPER = gn.Spectrum([300.0, 470.0, 520.0, 560.0, 760.0], [0.05, 0.1, 0.6, 0.88, 0.9])
INTO_BLUE = gn.Spectrum([395.0, 420.0, 442.0, 470.0, 510.0, 570.0], [0.0, 0.5, 1.0, 0.75, 0.25, 0.0])
INTO_GREEN = gn.Spectrum([470.0, 500.0, 520.0, 545.0, 580.0, 640.0], [0.0, 0.7, 1.0, 0.6, 0.2, 0.0])
WHITENER = gn.Spectrum([300.0, 340.0, 375.0, 400.0, 430.0, 760.0], [0.5, 0.85, 0.9, 0.5, 0.0, 0.0])
HIGHLIGHTER = gn.Spectrum([300.0, 400.0, 450.0, 480.0, 520.0, 760.0], [0.4, 0.6, 0.9, 0.8, 0.0, 0.0])

MATERIALS = {
    "cotton": gn.Lambertian(COTTON).at(NM),
    "whitened cotton": gn.FluorescentLambertian(COTTON, WHITENER, INTO_BLUE, 0.75).at(NM),
    "highlighter": gn.FluorescentLambertian(PAPER, HIGHLIGHTER, INTO_GREEN, 0.9).at(NM),
}
DAYLIGHT = gn.spectra.blackbody(6500.0).at(NM)
LAMPS = {
    "daylight": DAYLIGHT,
    "without ultraviolet": np.where(NM < 415.0, 0.0, DAYLIGHT),
    "ultraviolet alone": np.where(NM < 400.0, 3.0 * DAYLIGHT, 0.0),
}
COLOURS = dict(zip(LAMPS, (BLUE, WARM, VIOLET), strict=True))


def spheres(figure: Figure) -> None:
    """A row for each lamp, a column for each material."""
    studio = gn.EnvironmentLight.studio()
    for row, (lamp, E) in enumerate(LAMPS.items()):
        for column, (name, m) in enumerate(MATERIALS.items()):
            picture = gn.render(m.under(E, seen=DAYLIGHT), studio, size=SIZE, samples=SAMPLES)
            assert picture.alpha is not None
            alpha = picture.alpha[..., None]
            pixels = np.clip(srgb_encode(picture.pixels * 2.0**-0.1), 0.0, 1.0)
            axes = figure.add_axes((0.035 + 0.155 * column, 0.645 - 0.318 * row, 0.15, 0.3))
            axes.imshow(alpha * pixels + (1.0 - alpha), interpolation="lanczos")
            axes.set_axis_off()
            if row == 0:
                axes.set_title(name, fontsize=11, color=INK)
            if column == 0:
                figure.text(
                    0.018, 0.795 - 0.318 * row, lamp, rotation=90, ha="center", va="center", color=COLOURS[lamp]
                )


def panel(figure: Figure, bottom: float, title: str) -> Axes:
    axes = figure.add_axes((0.585, bottom, 0.39, 0.335))
    axes.set_title(title, fontsize=11, loc="left", color=INK)
    axes.tick_params(colors=INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return axes


def matrix(figure: Figure) -> None:
    """Donaldson's matrix of the highlighter."""
    axes = panel(figure, 0.605, "highlighter: light that leaves, by light that arrives")
    D = np.pi * MATERIALS["highlighter"].reradiation([0, 0, 1], [0, 0, 1])
    fluorescent = D - np.diag(MATERIALS["highlighter"].rho)
    ends = NM[0] - 5.0, NM[-1] + 5.0
    axes.imshow(
        fluorescent, origin="lower", extent=(*ends, *ends), aspect="auto", cmap="Greens", vmax=fluorescent.max()
    )
    axes.plot(NM, NM, color=GREY, lw=1.5, ls=":")
    axes.text(640.0, 610.0, "reflected", color=GREY, fontsize=10)
    axes.text(335.0, 585.0, "fluorescence", color="#2e7d32", fontsize=10)
    axes.set_xlabel("arrives [nm]", labelpad=1)
    axes.set_ylabel("leaves [nm]")


def factors(figure: Figure) -> None:
    """The radiance factor of the highlighter under two lamps."""
    axes = panel(figure, 0.1, "highlighter: light that leaves over that of white")
    m = MATERIALS["highlighter"]
    for name in ("daylight", "without ultraviolet"):
        axes.plot(NM, gn.albedo(m.under(LAMPS[name], seen=DAYLIGHT), [0, 0, 1]), color=COLOURS[name], lw=2, label=name)
    axes.plot(NM, m.rho, color=GREY, lw=1.5, ls=":", label="reflected alone")
    axes.axhline(1.0, color="#e3e6ea", lw=1.0, zorder=0)
    axes.set_xlim(380.0, 740.0)
    axes.set_ylim(0.0, None)
    axes.set_xlabel("wavelength [nm]", labelpad=1)
    axes.legend(frameon=False, fontsize=9.5, loc="upper right", labelcolor=INK)


if __name__ == "__main__":
    figure = Figure(figsize=(10.6, 5.4), facecolor="white")
    spheres(figure)
    matrix(figure)
    factors(figure)
    figure.savefig(HERE / "fluorescence.png", dpi=110)
