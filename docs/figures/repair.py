"""Draw the figures of docs/repair.md: `python docs/figures/repair.py` writes them beside this file."""

from __future__ import annotations

import math

import numpy as np
from make import GREY, HALF, INK, LIGHT, VIEWER, save
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import gonio as gn

IN_PLANE = r"$\theta_o$ in the plane of incidence [°]"
MODEL = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))


def axes_of(figure: Figure, k: int, title: str, xlabel: str, ylabel: str) -> Axes:
    """One of two panels."""
    axes = figure.add_axes((0.075 + 0.505 * k, 0.155, 0.405, 0.72))
    axes.set_title(title, fontsize=11, loc="left", color=INK)
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    axes.grid(color="#e3e6ea", lw=0.7)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return axes


def table(m: gn.Reflectance, last: float) -> gn.Gridded:
    """f every 5 degrees up to the last, azimuths every 10."""
    theta, phi = np.radians(np.arange(0.0, last + 1.0, 5.0)), np.radians(np.arange(0.0, 360.0, 10.0))
    return gn.repair.resample(m, "angles", axes={"theta_i": theta, "theta_o": theta, "phi": phi})


def gaps() -> None:
    """A hole filled, and the horizon reached."""
    figure = Figure(figsize=(9.2, 3.7))
    axes = axes_of(figure, 0, "a hole, light at 45°", IN_PLANE, "$f$ [1/sr]")
    true = table(MODEL, 85.0)
    theta = np.degrees(true.axes["theta_o"])
    f = true.stored.copy()
    f[7:12, 8:13, 15:22] = np.nan
    holed = true.with_brdf(f, uncertainty=0.01 * f)
    for method, colour in (("neighbours", LIGHT), ("smooth", VIEWER)):
        m = gn.repair.fill_holes(holed, method)
        axes.plot(theta[7:14], m.stored[9, 7:14, 18], color=colour, lw=2.0, label=method)
        if method == "smooth":
            value, u = m.stored[9, 7:14, 18], m.uncertainty[9, 7:14, 18]
            axes.fill_between(theta[7:14], value - 2.0 * u, value + 2.0 * u, color=colour, alpha=0.15, lw=0.0)
    axes.plot(theta, true.stored[9, :, 18], "o", mfc="white", mec=GREY, ms=5, label="hidden")
    axes.plot(theta, holed.stored[9, :, 18], "o", color=INK, ms=5, label="measured")
    axes.set_xlim(0.0, 80.0)
    axes.set_ylim(0.08, 0.30)
    axes.legend(frameon=False, fontsize=10)

    axes = axes_of(figure, 1, "measured to 75°, light at 60°", IN_PLANE, "$f$ [1/sr]")
    cut = table(MODEL, 75.0)
    fine = np.radians(np.linspace(40.0, 89.0, 200))
    wi = gn.direction(np.radians(60.0), 0.0)
    for method, colour in (("hold", LIGHT), ("linear in cosine", HALF), ("model", VIEWER)):
        m = gn.repair.extrapolate_to_grazing(cut, method)
        theta = m.axes["theta_o"]
        axes.plot(np.degrees(theta[15:]), m.stored[12, 15:, 18], color=colour, lw=2.0, label=method)
    truth = MODEL.f(wi, gn.direction(fine, math.pi))
    axes.plot(np.degrees(fine), truth, color=GREY, lw=1.0, ls=(0, (4, 3)), label="truth")
    axes.plot(np.degrees(cut.axes["theta_o"]), cut.stored[12, :, 18], "o", color=INK, ms=5, label="measured")
    axes.set_xlim(40.0, 91.0)
    axes.set_ylim(0.0, None)
    axes.legend(frameon=False, fontsize=10)
    save(figure, "repair_gaps")


def aperture() -> None:
    """A lobe through an aperture and back; the horizon in the aperture."""
    figure = Figure(figsize=(9.2, 3.7))
    axes = axes_of(figure, 0, "detector of half-angle 5°, light at 30°", IN_PLANE, "$f$ [1/sr]")
    theta, phi = np.radians(np.arange(0.0, 60.1, 1.0)), np.radians(np.arange(0.0, 360.0, 5.0))
    grid = {"theta_i": np.radians([30.0]), "theta_o": theta, "phi": phi}
    lobe = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    narrow = gn.repair.resample(lobe, "angles", axes=grid)
    seen = gn.repair.aperture_averaged(narrow, np.radians(5.0))
    back = gn.repair.aperture_removed(seen, np.radians(5.0))
    forward = 36
    for m, colour, label, style in (
        (narrow, INK, "point-like detector", "-"),
        (seen, LIGHT, "seen", "-"),
        (back, VIEWER, "aperture removed, 10 steps", (0, (4, 2))),
    ):
        axes.plot(np.degrees(theta), m.stored[0, :, forward], color=colour, lw=2.0, ls=style, label=label)
    axes.set_xlim(5.0, 55.0)
    axes.set_ylim(0.0, 0.72)
    axes.legend(frameon=False, fontsize=10, loc="upper left")

    axes = axes_of(figure, 1, "white Lambertian surface, same detector", r"$\theta_o$ [°]", r"reading, $\pi f$")
    at = np.radians(np.linspace(78.0, 89.5, 300))
    for horizon, colour in (("visible", VIEWER), ("full", LIGHT)):
        f = gn.repair.through_aperture(
            gn.Lambertian(1.0), [0.0, 0.0, 1.0], gn.direction(at, 0.0), np.radians(5.0), horizon=horizon, rings=32
        )
        axes.plot(np.degrees(at), np.pi * f, color=colour, lw=2.0, label=f'horizon="{horizon}"')
    axes.set_xlim(78.0, 90.0)
    axes.set_ylim(0.8, 2.0)
    axes.legend(frameon=False, fontsize=10, loc="upper left")
    save(figure, "repair_aperture")


if __name__ == "__main__":
    gaps()
    aperture()
