"""The figure that explains the verdicts of `check`: the measurement of each law, and its tolerance."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..base.sides import is_lit, said_of_sides
from ..declared.arguments import checked
from ..errors import ParameterError, TraceError
from ..integrals.efficiency import VIEWS, sampling_efficiency
from ..laws import LAWS, MapReport, cavity, check, derivatives, energy, furnace, grazing, isotropy, limit, reciprocity
from ..laws._probes import INCIDENCE, SAMPLES, difference, is_measured, values
from ..laws._rings import around, distance
from ..laws._verdict import Report
from ..numerics.lattice import lattice
from ._drawing import RGB, SEQUENCE, check_target, new_figure, write
from .fate_figure import draw_fate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GOOD, BAD, DECLARED, INK, GREY = "#00795a", "#d55e00", "#a97400", "#1f3f77", "#8a8a8a"
COLOURS = {"pass": GOOD, "not significant": GOOD, "FAIL": BAD, "breaks": DECLARED}
LINES = [SEQUENCE[k] for k in (0, 2, 4, 5, 3)]


@checked
def laws(m: Reflectance, report: Report | None = None, path: str | os.PathLike[str] | None = None) -> Figure:
    """Draw how a material holds to the laws of `gn.check`: the verdicts, and a panel for each measurement.

    report     the verdicts, where they are known already; by default those of `gn.check(m)`
    path       file to write: .png, .jpg, .pdf or .svg

    Errors     ParameterError for other names of files, and for maps.

    Example
    >>> figure = gn.figures.laws(gn.Lambertian(0.5), path="laws.svg")
    >>> print(figure.axes[0].get_title())
    all laws hold
    """
    check_target(path)
    measured = check(m) if report is None else report
    if isinstance(measured, MapReport):
        raise ParameterError(f"{m!r:.60}: its parameters are maps; expected one material")
    with np.errstate(all="ignore"), new_figure(path, (14.0, 10.8), measured.material) as figure:
        _draw(figure, m, measured)
    return figure


def _draw(figure: Any, m: Reflectance, report: Report) -> None:
    figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)
    grid = figure.add_gridspec(3, 3)
    _verdicts(figure.add_subplot(grid[0, 0]), report)
    _reciprocity(figure, figure.add_subplot(grid[0, 1]), m)
    _isotropy(figure.add_subplot(grid[0, 2], projection="polar"), m)
    _energy(figure.add_subplot(grid[1, 0]), m)
    _cavity(figure.add_subplot(grid[1, 1]), m)
    _density(figure.add_subplot(grid[1, 2]), m)
    _grazing(figure.add_subplot(grid[2, 0]), m)
    _derivatives(figure.add_subplot(grid[2, 1]), m)
    last = figure.add_subplot(grid[2, 2])
    _limit(last, m) if limit.lobes(m) else _efficiency(last, m)


SHORTER = {
    "|jacobian - difference|": "error",
    "distance from a mirror": "distance",
    "not significant": "n.s.",
    "largest excess of eigenvalues below 0 and of polarization above 1": "largest excess",
}
"""Words of findings and verdicts that are too long for their panel."""


def _verdicts(axes: Any, report: Report) -> None:
    axes.set_axis_off()
    broken = [law for law in report.laws if not law.passed]
    axes.set_title("all laws hold" if not broken else f"{len(broken)} of {len(report.laws)} laws broken")
    step = 1.0 / len(LAWS)
    for i, law in enumerate(report.laws):
        y = 1.0 - (i + 0.5) * step
        finding = law.finding
        for words, fewer in SHORTER.items():
            finding = finding.replace(words, fewer)
        outside = {"va": "center", "in_layout": False}
        axes.text(-0.08, y, SHORTER.get(law.verdict, law.verdict), color=COLOURS[law.verdict], weight="bold", **outside)
        axes.text(0.1, y, law.name, **outside)
        axes.text(0.36, y, finding, fontsize=8.5, color="#444444", **outside)


def _reciprocity(figure: Any, axes: Any, m: Reflectance) -> None:
    from matplotlib.colors import LogNorm

    edges = np.linspace(0.0, 90.0, 61)
    middle = 0.5 * (edges[1:] + edges[:-1])
    theta = np.radians(middle)
    phi = np.radians(np.arange(0.0, 360.0, 30.0)) + 0.3
    wi = direction(theta[:, None, None], np.full((1, 1, 1), 0.3))
    wo = direction(theta[None, :, None], phi[None, None, :])
    wi, wo = (np.ascontiguousarray(np.broadcast_to(w, (60, 60, 12, 3))) for w in (wi, wo))
    error = difference(values(m, wi, wo), values(m, wo, wi)).max(axis=(-2, -1))
    shown = axes.pcolormesh(edges, edges, np.maximum(error, 1e-16).T, norm=LogNorm(1e-16, 2.0), cmap="viridis")
    if error.max() > reciprocity.TOLERANCE:
        axes.contour(middle, middle, error.T, [reciprocity.TOLERANCE], colors=BAD, linewidths=1.2)
    beside = axes.inset_axes((1.05, 0.0, 0.06, 1.0))
    beside.set_in_layout(False)
    bar = figure.colorbar(shown, cax=beside, ticks=[1e-16, 1e-12, 1e-8, 1e-4, 1.0])
    bar.ax.axhline(reciprocity.TOLERANCE, color=BAD, lw=2.0)
    ticks = np.arange(0, 91, 30)
    axes.grid(False)
    axes.set(aspect="equal", xticks=ticks, yticks=ticks, xlabel="θᵢ [°]", ylabel="θₒ [°]")
    axes.set_title("reciprocity: |f − f swapped| / mean; red: tolerance")


PLACES = ((30.0, 30.0, 180.0), (60.0, 60.0, 180.0), (60.0, 45.0, 120.0))
"""theta_i, theta_o and phi_o - phi_i [degrees] of the pairs that are turned."""


def _isotropy(axes: Any, m: Reflectance) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    top = 1.0
    for (ti, to, dphi), colour, width in zip(PLACES, (INK, "#1e9c89", "#e69f00"), (4.5, 2.6, 1.2), strict=True):
        wi, wo = direction(np.radians(ti), 0.0 * turn), direction(np.radians(to), 0.0 * turn + np.radians(dphi))
        # The pair stands still and the surface turns: one and the same pair, turned by -t.
        pairs = [np.stack([isotropy.turned(w[k], -t) for k, t in enumerate(turn)]) for w in (wi, wo)]
        f = values(m, *pairs).mean(axis=-1)
        mean = float(np.nanmean(np.abs(f))) if np.isfinite(f).any() else 0.0
        if mean > 0.0:
            axes.plot(turn, f / mean, color=colour, lw=width, label=f"{ti:.0f}°, {to:.0f}°, {dphi:.0f}°")
            top = max(top, float(np.nanmax(f / mean)))
    axes.set_rlim(0.0, 1.15 * top)
    axes.set_rlabel_position(112)
    axes.set_thetagrids(np.arange(0, 360, 45), fontsize=8)
    axes.set_rticks([1.0] if top < 1.5 else [1.0, top], [""] if top < 1.5 else ["", f"{top:.2g}×"], fontsize=8)
    if axes.lines:
        small = {"fontsize": 8, "title_fontsize": 8, "loc": "lower right", "bbox_to_anchor": (0.0, -0.17)}
        axes.legend(title="θᵢ, θₒ, φₒ − φᵢ", **small).set_in_layout(False)
    else:
        write(axes, colour=GREY)
    axes.set_title("isotropy: f as the surface turns, over its mean")


def _energy(axes: Any, m: Reflectance) -> None:
    if said_of_sides(m):
        draw_fate(axes, m)
        axes.set_title("energy: what becomes of light", pad=18.0)
        return
    degrees = np.degrees(INCIDENCE)
    _, a = energy.albedos(m)
    _, L = furnace.radiance(m)
    a, L = (np.nan_to_num(x, nan=np.inf, posinf=np.inf) for x in (a, L))
    a, L = (x.reshape(len(degrees), -1, x.shape[-1]).max(axis=1) for x in (a, L))
    low, largest = float(min(a.min(), L.min())), float(max(a.max(), L.max()))
    top = min(max(1.12, 1.1 * largest), 3.0)
    axes.axhspan(1.0, top, color=BAD, alpha=0.08, lw=0)
    axes.axhline(1.0, color=BAD, lw=1.2)
    colours = RGB if a.shape[-1] == 3 else [INK] * a.shape[-1]
    for c, colour in enumerate(colours):
        labels = (None, None) if c else ("albedo, by quadrature", "radiance, by sampling")
        axes.plot(degrees, a[:, c], color=colour, lw=1.8, label=labels[0])
        axes.plot(degrees, L[:, c], "o", color=colour, ms=5, mfc="none", label=labels[1])
    words = f"more than arrives, up to {largest:.3g}" if largest > top else "more than arrives"
    axes.text(1.5, 0.985 * top, words, color=BAD, fontsize=9, va="top")
    axes.set(xlim=(0, 90.5), xticks=np.arange(0, 91, 15), xlabel="θ of the light (albedo), of the view (radiance) [°]")
    axes.set(ylim=(min(0.0, 1.1 * low), top), title="energy and furnace: a surround of radiance 1")
    axes.legend()


def _cavity(axes: Any, m: Reflectance) -> None:
    if is_lit(m, -1.0):
        axes.set_axis_off()
        axes.text(0.5, 0.5, "cavity: left out,\nlight leaves through the plates", ha="center", va="center", color=GREY)
        return
    mean = np.nan_to_num(cavity.radiance(m)[0].max(axis=-1), posinf=1e9)
    mean = np.concatenate([np.ones_like(mean[:1]), mean])
    bounce = np.arange(len(mean))
    axes.axhspan(1.0, 1e9, color=BAD, alpha=0.08, lw=0)
    axes.axhline(1.0, color=BAD, lw=1.2)
    axes.fill_between(bounce, mean.min(axis=1), mean.max(axis=1), color=INK, alpha=0.18, lw=0, label="all directions")
    axes.plot(bounce, mean.mean(axis=1), color=INK, lw=1.8, marker="o", ms=4, label="mean")
    low, high = float(mean.min()), float(mean.max())
    if low > 0.0 and (low < 0.2 or high > 5.0):
        axes.set(yscale="log", ylim=(0.6 * low, max(2.0, 1.2 * high)))
    else:
        axes.set_ylim(0.0, max(1.12, 1.1 * high))
    axes.set(xlim=(0, len(mean) - 1), xlabel="bounces", ylabel="radiance")
    axes.set_title("cavity: radiance 1 between two plates, by bounces")
    steady = cavity.steady(m).max()
    words = f"plates that emit 1 settle at {steady:.4g}" if np.isfinite(steady) else "plates that emit never settle"
    axes.legend(loc="lower left", title=words)


def _density(axes: Any, m: Reflectance) -> None:
    edges = np.geomspace(1e-3, 180.0, 85)
    low = 0.0
    for theta, colour in ((30.0, "#0072b2"), (75.0, "#d55e00")):
        view = direction(np.radians(theta), 0.3)
        r = np.geomspace(1e-3, 180.0, 400)[:, None]
        psi = np.linspace(0.0, 2.0 * np.pi, 193)[None, 1:]
        pdf = m.pdf(around(view, np.radians(r), psi), view).mean(axis=1)
        expected = pdf * 2.0 * np.pi * np.sin(np.radians(r[:, 0])) * np.radians(r[:, 0]) * np.log(10.0)
        s = m.sample(np.broadcast_to(view, (SAMPLES, 3)), lattice(SAMPLES))
        used = (s.pdf > 0.0) & ~s.delta
        observed = np.histogram(np.degrees(distance(view, s.wi[used])[0]), edges)[0] / SAMPLES
        width = np.diff(np.log10(edges))
        axes.stairs(observed / width, edges, color=colour, fill=True, alpha=0.35, label=f"samples, θₒ = {theta:.0f}°")
        axes.plot(r[:, 0], expected, color=colour, lw=1.6, label="density")
        seen = r[expected > 1e-3 * max(float(expected.max()), 1e-30), 0]
        low = min(low or 180.0, float(seen[0])) if len(seen) else low
    axes.set(xscale="log", xlim=(low or 1e-3, 180.0), ylim=(0.0, None))
    axes.set(xlabel="distance from the mirror direction [°]", ylabel="share per decade")
    if low:
        axes.legend(loc="upper left")
    else:
        write(axes, "a delta lobe:\nno density", GREY)
    axes.set_title("pdf and sampling: histogram and density")


def _grazing(axes: Any, m: Reflectance) -> None:
    away = np.degrees(np.pi / 2 - np.arccos(grazing.COSINES))
    f = np.abs(grazing.along(m, grazing.ways()[0], grazing.COSINES[:, None])).max(axis=-1)
    top = float(f[np.isfinite(f)].max(initial=0.0))
    for k, theta in enumerate(np.degrees(grazing.OTHERS)):
        mine = f[:, k * len(grazing.AZIMUTHS) : (k + 1) * len(grazing.AZIMUTHS)]
        with np.errstate(invalid="ignore"):
            shown = np.where((mine > 1e-12 * top) & np.isfinite(mine), mine, np.nan)
        axes.plot(away, shown, color=LINES[k], lw=1.2)[0].set_label(f"{theta:.0f}°")
    axes.set(xscale="log", xlim=(10.0, away.min()), xlabel="light above the horizon [°]", ylabel="f cosθᵢ [1/sr]")
    if top > 0.0:
        axes.set_yscale("log")
        axes.legend(title="θₒ")
    else:
        write(axes, colour=GREY)
    axes.set_title("grazing: five azimuths each; level or falling is right")


def _derivatives(axes: Any, m: Reflectance) -> None:
    axes.set_title("derivatives: jacobian against differences")
    try:
        slopes = [] if is_measured(m) else list(derivatives.slopes(m))
    except TraceError:
        slopes = []
    if not slopes:
        axes.set_axis_off()
        write(axes, "not tested: a table,\nor a formula that cannot be traced", GREY)
        return
    errors: dict[str, list[np.ndarray]] = {}
    for s in slopes:
        errors.setdefault(s.name.partition(".")[0] if s.name[:2] in ("wi", "wo") else s.name, []).append(s.error)
    for i, parts in enumerate(errors.values()):
        e = np.sort(np.maximum(np.concatenate([p.ravel() for p in parts]), 1e-16))
        e = np.where(np.isfinite(e), e, 1e2)
        half, most, worst = e[len(e) // 2], e[int(0.99 * (len(e) - 1))], e[-1]
        colour = BAD if worst > derivatives.TOLERANCE else INK
        axes.plot([half, worst], [i, i], color=colour, lw=1.2, alpha=0.5)
        axes.plot([half, most], [i, i], color=colour, lw=5, alpha=0.35, solid_capstyle="butt")
        axes.plot(worst, i, "o", color=colour, ms=6)
    axes.axvspan(derivatives.TOLERANCE, 1e3, color=BAD, alpha=0.08, lw=0)
    axes.axvline(derivatives.TOLERANCE, color=BAD, lw=1.2)
    axes.set(xscale="log", xlim=(0.5e-16, 1e2), xticks=10.0 ** np.arange(-15, 1, 3))
    axes.set_yticks(range(len(errors)), [name.rpartition(".")[2] for name in errors])
    axes.set_ylim(len(errors) - 0.4, -0.6)
    axes.set_xlabel("relative error: from the median (bar: 99 %) to the largest")


def _limit(axes: Any, m: Reflectance) -> None:
    n = limit.narrowing(limit.lobes(m)[0])
    step = np.arange(len(n.outside))
    for v, theta in enumerate(np.degrees(limit.VIEWS)):
        axes.plot(step, n.albedo[:, v], color=LINES[v], lw=1.8, label=f"albedo, θₒ = {theta:.0f}°")
        axes.plot(step, n.outside[:, v], color=LINES[v], lw=1.4, ls=":", label="outside 6°" if v == 0 else None)
        axes.plot(step[-1], n.mirror[-1, v], "D", color=LINES[v], ms=7, mfc="none", label="mirror" if v == 0 else None)
    ends = [(path.rpartition(".")[2], float(np.max(value)), end) for path, value, end in limit.narrow_ends(n.lobe)]
    axes.set_xticks(step, ["as given", *[""] * (len(step) - 2), "narrow"])
    axes.set_xlabel(", ".join(f"{name}: {value:g} → {end:g}" for name, value, end in ends))
    axes.set_ylim(0.0, max(1.02, 1.05 * float(n.albedo.max())))
    axes.legend(fontsize=8)
    axes.set_title("limit: light outside 6° of the mirror, albedo")


def _efficiency(axes: Any, m: Reflectance) -> None:
    rows = sampling_efficiency(m)
    names = list(dict.fromkeys(row.lobe for row in rows))
    for name, colour in zip(names, [INK, *LINES[1:], *LINES], strict=False):
        mine, whole = [row for row in rows if row.lobe == name], name == "all"
        style = {"color": colour, "lw": 2.2 if whole else 1.2, "marker": "o", "ms": 4}
        axes.plot(VIEWS, [r.effective for r in mine], **style, label="effective" if whole else name)
        if whole:
            axes.plot(VIEWS, [r.lost for r in mine], color=BAD, lw=1.4, ls=":", label="lost")
    axes.set(xlim=(0, 90), xticks=np.arange(0, 91, 15), xlabel="θₒ [°]")
    axes.set(ylim=(0.0, 1.05), ylabel="share of the samples", title="how well sampling does")
    axes.legend()
