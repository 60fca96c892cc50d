"""Draw the figures of the manual: `python docs/figures/make.py` writes every .svg beside this file.

The same numbers give the same bytes (with one version of matplotlib): no dates, no random identifiers. Every
figure has a white ground of its own, so that it reads on a dark page too.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import gonio as gn
from gonio.formula.direction import Direction

HERE = Path(__file__).resolve().parent
INK, GREY, LIGHT, VIEWER, HALF = "#1a1a1a", "#7a7a7a", "#c46a00", "#1c5fa8", "#2e7d32"
CAMERA = np.radians((-62.0, 24.0))  # azimuth and elevation from which the drawings in space are seen

matplotlib.rcParams.update(
    {
        "svg.hashsalt": "gonio",
        "svg.fonttype": "path",
        "font.family": "DejaVu Sans",
        "font.size": 11,
        "mathtext.fontset": "dejavusans",
        "figure.facecolor": "white",
        "savefig.facecolor": "white",
        "axes.edgecolor": GREY,
        "axes.linewidth": 0.8,
        "xtick.color": INK,
        "ytick.color": INK,
    }
)


def save(figure: Figure, name: str) -> None:
    """Write one figure, without a date."""
    figure.savefig(HERE / f"{name}.svg", metadata={"Date": None, "Creator": None})


# Drawings in space: points (..., 3) become points of the page by a parallel projection.


def page(points: Any) -> np.ndarray:
    """Points (..., 3) as (..., 2) on the page, seen from CAMERA."""
    p = np.asarray(points, dtype=float)
    azimuth, elevation = CAMERA
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.array([-np.cos(azimuth) * np.sin(elevation), -np.sin(azimuth) * np.sin(elevation), np.cos(elevation)])
    return np.stack([p @ right, p @ up], -1)


def curve(axes: Axes, points: Any, **style: Any) -> None:
    """A line through points in space."""
    xy = page(points)
    axes.plot(xy[:, 0], xy[:, 1], **style)


def text(axes: Axes, at: Any, label: str, shift: tuple[float, float] = (0.0, 0.0), **style: Any) -> None:
    """A label at a point of the page or in space, moved by `shift`."""
    xy = page(at) if len(at) == 3 else np.asarray(at)
    style = {"ha": "center", "va": "center", "color": INK, **style}
    axes.text(xy[0] + shift[0], xy[1] + shift[1], label, **style)


def arrow(axes: Axes, tip: Any, colour: str, width: float = 2.2, start: Any = (0.0, 0.0, 0.0)) -> None:
    """An arrow between two points of the page or in space."""
    end, begin = (page(x) if len(x) == 3 else np.asarray(x) for x in (tip, start[: len(tip)]))
    style = {"arrowstyle": "-|>,head_length=0.55,head_width=0.24", "color": colour, "lw": width}
    style |= {"shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 12, "joinstyle": "miter"}
    axes.annotate("", xy=end, xytext=begin, arrowprops=style)


def between(a: Any, b: Any, radius: float) -> np.ndarray:
    """An arc of a great circle from a to b, both unit vectors, at a distance from the origin."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    t = np.linspace(0.0, 1.0, 60)[:, None] * np.arccos(a @ b)
    across = b - (a @ b) * a
    return radius * (np.cos(t) * a + np.sin(t) * across / np.linalg.norm(across))


def bare(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    """A drawing without axes, in equal units."""
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(x)
    axes.set_ylim(y)


def local_frame() -> None:
    """The local frame with its angles, and the half vector."""
    figure = Figure(figsize=(8.8, 3.7))
    _frame_in_space(figure.add_axes((0.0, 0.0, 0.57, 1.0)))
    _half_vector(figure.add_axes((0.575, 0.0, 0.425, 1.0)))
    save(figure, "local_frame")


def _frame_in_space(axes: Axes) -> None:
    theta_i, phi_i, theta_o, phi_o = np.radians((50.0, 205.0, 42.0, 48.0))
    wi, wo = gn.direction(theta_i, phi_i), gn.direction(theta_o, phi_o)
    z = np.array([0.0, 0.0, 1.0])
    ring = np.linspace(0.0, 2.0 * np.pi, 200)
    disc = page(gn.direction(np.pi / 2, ring))
    axes.fill(disc[:, 0], disc[:, 1], color="#eef1f4", zorder=0)
    axes.plot(disc[:, 0], disc[:, 1], color="#b9c1c9", lw=0.8, zorder=0)
    for tip, label, shift in (
        ((1.32, 0.0, 0.0), r"$x = d_x$", (0.16, -0.05)),
        ((0.0, 1.32, 0.0), r"$y = d_y$", (0.20, 0.02)),
        ((0.0, 0.0, 1.22), "$z = n$", (0.16, 0.02)),
    ):
        arrow(axes, tip, INK, 1.3)
        text(axes, tip, label, shift)
    for w, phi, colour, name, where in (
        (wi, phi_i, LIGHT, "i", "to the light"),
        (wo, phi_o, VIEWER, "o", "to the viewer"),
    ):
        foot = np.array([w[0], w[1], 0.0])
        curve(axes, [w, foot, (0.0, 0.0, 0.0)], color=colour, lw=1.0, ls=(0, (4, 3)))
        arrow(axes, w, colour)
        side = -1.0 if name == "i" else 1.0
        text(axes, w, rf"$\mathbf{{w}}_{name}$", (0.06 * side, 0.13), color=colour, fontsize=14)
        text(axes, w, where, (0.06 * side, 0.27), color=colour, fontsize=10)
        arc = between(z, w, 0.42)
        curve(axes, arc, color=colour, lw=1.4)
        text(axes, arc[30] * 1.28, rf"$\theta_{name}$", color=colour)
        radius = 0.30 if name == "o" else 0.52
        turn = np.linspace(0.0, phi, 80)
        path = radius * gn.direction(np.pi / 2, turn)
        curve(axes, path, color=colour, lw=1.4)
        arrow(axes, path[-1], colour, 1.4, start=path[-4])
        at = path[40] * 1.42 if name == "o" else path[9] * 1.22
        text(axes, at, rf"$\phi_{name}$", color=colour)
    text(axes, (-0.55, -0.22), "surface", color=GREY, fontsize=10)
    bare(axes, (-1.22, 1.62), (-0.50, 1.40))


def _half_vector(axes: Axes) -> None:
    """A section: here the normal, both directions and the half vector lie in one plane."""

    def at(degrees: float) -> np.ndarray:
        a = np.radians(degrees)
        return np.array([np.sin(a), np.cos(a)])

    light, viewer = -74.0, 18.0
    middle = 0.5 * (light + viewer)
    axes.fill_between([-1.15, 1.15], -0.10, 0.0, color="#eef1f4")
    axes.plot([-1.15, 1.15], [0.0, 0.0], color="#b9c1c9", lw=1.0)
    arrow(axes, at(0.0) * 1.08, INK, 1.3)
    text(axes, at(0.0) * 1.08, "$n$", (0.0, 0.09))
    arrow(axes, at(-light), GREY, 1.2)
    text(axes, at(-light), r"mirror of $\mathbf{w}_i$", (-0.12, 0.11), color=GREY, fontsize=10)
    for angle, colour, label in (
        (light, LIGHT, r"$\mathbf{w}_i$"),
        (viewer, VIEWER, r"$\mathbf{w}_o$"),
        (middle, HALF, r"$\mathbf{w}_m$"),
    ):
        arrow(axes, at(angle), colour)
        text(axes, at(angle) * 1.13, label, color=colour, fontsize=14)

    def arc(a: float, b: float, radius: float, colour: str, label: str, label_at: float) -> None:
        points = np.stack([radius * at(t) for t in np.linspace(a, b, 50)])
        axes.plot(points[:, 0], points[:, 1], color=colour, lw=1.4)
        text(axes, at(label_at) * (radius + 0.10), label, color=colour)

    arc(light, middle, 0.62, HALF, r"$\theta_d$", 0.5 * (light + middle))
    arc(middle, viewer, 0.62, HALF, r"$\theta_d$", 0.5 * viewer)
    arc(middle, 0.0, 0.44, INK, r"$\theta_m$", 0.55 * middle)
    text(
        axes,
        (0.0, -0.26),
        r"$\mathbf{w}_m = (\mathbf{w}_i + \mathbf{w}_o)\,/\,|\mathbf{w}_i + \mathbf{w}_o|$",
    )
    bare(axes, (-1.22, 1.32), (-0.42, 1.30))


def quantities() -> None:
    """f beside f cos(theta_o), for a matte and a glossy surface."""
    figure = Figure(figsize=(8.8, 3.35))
    view = np.radians(np.linspace(-89.9, 89.9, 721))
    wo = gn.direction(np.abs(view), np.where(view < 0.0, np.pi, 0.0))
    panels = (
        ("Lambertian(0.8)", gn.Lambertian(0.8), (0.0, 0.1, 0.2)),
        ("Microfacet(GGX(0.3)), light at 60°", gn.Microfacet(gn.GGX(0.3)), (0.0, 1.0, 2.0)),
    )
    for i, (title, m, ticks) in enumerate(panels):
        axes = figure.add_axes((0.05 + 0.5 * i, -0.14, 0.40, 1.22), projection="polar")
        f = m.f(gn.direction(np.radians(60.0), np.pi), wo)
        axes.plot(view, f, color=INK, lw=2.2, label="$f$: what gonio returns")
        axes.plot(view, f * np.cos(view), color=VIEWER, lw=2.0, ls=(0, (5, 2)), label=r"$f\,\cos\theta_o$: DSF")
        top = 1.22 * float(f.max())
        axes.set_theta_zero_location("N")
        axes.set_theta_direction(-1)
        axes.set_thetalim(-np.pi / 2, np.pi / 2)
        axes.set_rlim(0.0, top)
        axes.set_thetagrids(np.arange(-90, 91, 30), [f"{abs(a)}°" for a in range(-90, 91, 30)], fontsize=9)
        axes.set_rgrids(ticks[1:], [f"{t:g}" for t in ticks[1:]], angle=-90)
        axes.tick_params(axis="y", labelsize=9, labelcolor=GREY)
        axes.grid(color="#d5d9dd", lw=0.7)
        axes.spines["polar"].set_color("#d5d9dd")
        start = np.radians(-60.0)
        if i:
            axes.annotate(
                "",
                xy=(start, 0.62 * top),
                xytext=(start, top),
                arrowprops={"arrowstyle": "-|>", "color": LIGHT, "lw": 2.0},
            )
            axes.text(start, 0.5 * top, "light", color=LIGHT, ha="center", va="center", fontsize=10)
        figure.text(0.25 + 0.5 * i, 0.94, f"{title}: values in sr$^{{-1}}$", ha="center", va="center")
        axes.legend(
            loc="center",
            bbox_to_anchor=(0.25 + 0.5 * i, 0.04),
            bbox_transform=figure.transFigure,
            ncols=2,
            fontsize=10,
            frameon=False,
        )
    save(figure, "quantities")


def environment_map() -> None:
    """Where a pixel of an environment map lies, and the world it surrounds."""
    figure = Figure(figsize=(8.8, 3.8))
    _picture(figure.add_axes((0.085, 0.13, 0.52, 0.70)))
    _world(figure.add_axes((0.64, 0.0, 0.36, 1.0)))
    save(figure, "environment_map")


def _picture(axes: Axes) -> None:
    rows, columns = 4, 8
    for i in range(rows + 1):
        axes.plot([0, columns], [i, i], color="#b9c1c9", lw=0.8)
    for j in range(columns + 1):
        axes.plot([j, j], [0, rows], color="#b9c1c9", lw=0.8)
    j, i = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
    axes.plot(j.ravel(), i.ravel(), ".", color=GREY, ms=4)
    for place, label in (((0, 2), "+x"), ((2, 2), "−y"), ((4, 2), "−x"), ((6, 2), "+y"), ((8, 2), "+x")):
        axes.plot(*place, "o", color=VIEWER, ms=6, clip_on=False, zorder=5)
        box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none"}
        axes.annotate(
            label,
            place,
            (0, -13),
            textcoords="offset points",
            ha="center",
            va="center",
            color=VIEWER,
            bbox=box,
        )
    for row, label in ((0.0, "+z: the whole upper edge"), (4.0, "−z: the whole lower edge")):
        axes.plot([0, columns], [row, row], color=LIGHT, lw=2.5, clip_on=False)
        axes.annotate(
            label,
            (4, row),
            (0, -11 if row == 0.0 else 11),
            textcoords="offset points",
            ha="center",
            va="center",
            color=LIGHT,
            fontsize=10,
            bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none"},
        )
    axes.set_xlim(0, columns)
    axes.set_ylim(rows, 0)
    axes.set_aspect("equal")
    axes.set_xticks([0, 2, 4, 6, 8], ["0", "−π/2", "−π", "−3π/2", "−2π"])
    axes.set_yticks([0, 2, 4], ["0", "π/2", "π"])
    axes.xaxis.set_label_position("top")
    axes.xaxis.tick_top()
    axes.set_xlabel(r"$\phi$: 0 at the left edge", labelpad=8)
    axes.set_ylabel(r"$\theta$: 0 at the top", labelpad=4)
    for side in axes.spines.values():
        side.set_visible(False)
    axes.tick_params(axis="x", length=0)
    axes.tick_params(axis="y", length=0, pad=10)
    axes.text(
        4,
        4.42,
        "dots: pixel centres, where the samples are",
        ha="center",
        va="center",
        fontsize=10,
        color=GREY,
    )


def _world(axes: Axes) -> None:
    ring = np.linspace(0.0, 2.0 * np.pi, 200)
    disc = page(gn.direction(np.pi / 2, ring))
    circle = np.stack([np.cos(ring), np.sin(ring)], -1)
    axes.fill(circle[:, 0], circle[:, 1], color="#f6f7f9")
    axes.plot(circle[:, 0], circle[:, 1], color="#b9c1c9", lw=0.9)
    axes.plot(disc[:, 0], disc[:, 1], color="#b9c1c9", lw=0.9)
    for tip, label, shift in (
        ((1.45, 0.0, 0.0), "x", (0.08, -0.04)),
        ((0.0, 1.75, 0.0), "y", (0.10, 0.04)),
        ((0.0, 0.0, 1.35), "z: up", (0.24, 0.0)),
    ):
        arrow(axes, tip, INK, 1.3)
        text(axes, tip, label, shift)
    w = gn.direction(np.radians(34.0), np.radians(62.0))
    curve(axes, [w, (w[0], w[1], 0.0), (0.0, 0.0, 0.0)], color=LIGHT, lw=1.0, ls=(0, (4, 3)))
    arrow(axes, w, LIGHT)
    text(axes, w, "w", (0.11, 0.06), color=LIGHT, fontsize=13)
    arc = between((0.0, 0.0, 1.0), w, 0.45)
    curve(axes, arc, color=LIGHT, lw=1.4)
    text(axes, arc[30] * 1.28, r"$\theta$", color=LIGHT)
    turn = 0.36 * gn.direction(np.pi / 2, np.radians(np.linspace(0.0, 62.0, 60)))
    curve(axes, turn, color=LIGHT, lw=1.4)
    arrow(axes, turn[-1], LIGHT, 1.4, start=turn[-5])
    text(axes, turn[28] * 1.45, r"$\phi$", color=LIGHT)
    eye = np.array([0.0, -2.35, 0.0])
    arrow(axes, (0.0, -1.25, 0.0), VIEWER, 1.6, start=eye)
    text(axes, eye, "the camera of gn.render looks along +y", (0.82, -0.36), color=VIEWER, fontsize=10)
    bare(axes, (-1.35, 1.6), (-1.35, 1.5))


def microfacets() -> None:
    """What alpha does to the distribution of normals, and what the masking does to the albedo."""
    figure = Figure(figsize=(8.8, 3.7))
    left, right = figure.add_axes((0.085, 0.15, 0.39, 0.75)), figure.add_axes((0.58, 0.15, 0.39, 0.75))
    degrees = np.linspace(0.0, 75.0, 301)
    normal = gn.direction(np.radians(degrees), 0.0)
    wm = Direction(normal[:, 0], normal[:, 1], normal[:, 2])
    for distribution, colour, style, label in (
        (gn.GGX(0.3), INK, "-", "GGX(0.3)"),
        (gn.Beckmann(0.3), VIEWER, (0, (5, 2)), "Beckmann(0.3)"),
        (gn.GaussianFacets(0.3), LIGHT, (0, (1.5, 1.5)), "GaussianFacets(0.3)"),
        (gn.GGX(0.6), GREY, "-", "GGX(0.6)"),
    ):
        left.semilogy(degrees, distribution.D(wm), color=colour, ls=style, lw=2.0, label=label)
    left.set_ylim(3e-4, 60.0)
    left.set_xlim(0, 75)
    left.set_xlabel(r"$\theta_m$ of the facet [°]")
    left.set_ylabel("$D$ [sr$^{-1}$]")
    left.set_title("Distribution of normals", fontsize=11)
    left.legend(frameon=False, fontsize=10, loc="upper right")
    theta = np.array([0.0, 10, 20, 30, 40, 50, 60, 65, 70, 75, 80, 83, 85, 87, 88, 89])
    for masking, colour, style in (
        ("height_correlated", INK, "-"),
        ("separable", VIEWER, (0, (5, 2))),
        ("v_groove", LIGHT, (0, (1.5, 1.5))),
    ):
        m = gn.Microfacet(gn.GGX(1.0), 1.0, masking)
        right.plot(
            theta,
            gn.albedo(m, gn.direction(np.radians(theta), 0.0)),
            color=colour,
            ls=style,
            lw=2.0,
            label=masking,
        )
    right.set_ylim(0.0, 1.05)
    right.set_xlim(0, 90)
    right.set_xticks(range(0, 91, 15))
    right.set_xlabel(r"$\theta_i$ [°]")
    right.set_ylabel("albedo")
    right.set_title("Masking: GGX(1.0), perfect mirrors", fontsize=11)
    right.legend(frameon=False, fontsize=10, loc="upper left")
    for axes in (left, right):
        axes.grid(color="#e3e6e9", lw=0.7)
        axes.spines[["top", "right"]].set_visible(False)
    save(figure, "microfacets")


def own_measurement() -> None:
    """The scan of docs/your-own-measurement.md, and the model that it was made from."""
    m = gn.load(HERE.parents[1] / "examples" / "ptfe_in_plane.csv")
    model = gn.Lambertian(0.955) + 0.5 * gn.Microfacet(gn.GGX(0.45), gn.Dielectric(1.35))
    theta_i, phi_i, theta_o, phi_o = m.rows.T
    side = np.where(np.cos(phi_o - phi_i) < 0.0, 1.0, -1.0)
    figure = Figure(figsize=(7.2, 3.4), layout="constrained")
    axes = figure.subplots()
    for angle, colour in ((0, HALF), (30, VIEWER), (60, LIGHT)):
        at = np.isclose(np.degrees(theta_i), angle)
        x = np.degrees(side * theta_o)[at]
        axes.errorbar(x, m.stored[at], 2.0 * m.uncertainty[at], fmt=".", color=colour, label=f"{angle}°")
        axes.plot(x, model.f_angles(*m.rows[at].T), color=GREY, lw=0.8)
    axes.set_xlabel("angle of the detector [°], mirror side on the right")
    axes.set_ylabel("f [1/sr]")
    axes.legend(title="incidence", frameon=False)
    axes.grid(color="#e3e6e9", lw=0.7)
    axes.spines[["top", "right"]].set_visible(False)
    save(figure, "own_measurement")


FIGURES = (local_frame, quantities, environment_map, microfacets, own_measurement)

if __name__ == "__main__":
    for draw in FIGURES:
        draw()
