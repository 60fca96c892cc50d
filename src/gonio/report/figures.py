"""Figures of a material: polar slices in the plane of incidence, albedo, a lit sphere; of a map, its places."""

from __future__ import annotations

import math
import os
import textwrap
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import direction
from ..base.light import Light
from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..errors import DependencyError, MissingDataWarning, ParameterError
from ..evaluate import batch
from ..files import replacing, target
from ..integrals.albedo import albedo
from ..pictures.colour import RELATIVE_XYZ, XYZ, rgb_of, srgb_encode
from ..scenes.rendering import is_coloured, is_rgb, render, shown_as
from ..tables.gridded import Gridded
from ._slices import VIEWS, Slice, lit_range, one_number, plane, slices_of, spans
from .fate_figure import draw_fate

INCIDENCE = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0, 88.0)
SUFFIXES = (".png", ".jpg", ".pdf", ".svg")
HELD = "Beyond the data the sphere and the albedo are those of the outermost values"


def show(
    m: Reflectance,
    path: str | Path,
    lights: Light | Iterable[Light] | None = None,
    title: str = "",
    size: int = 256,
    samples: int = 32,
    progress: Callable[[int, int], None] | None = None,
    bands: Sequence[str | float] | None = None,
) -> None:
    """Write the figure of a material to a .png, .jpg, .pdf or .svg file.

    Above: f [1/sr] in the plane of incidence as polar slices, one per angle of incidence, with a logarithmic radius,
    and a lit sphere, under the default light of `render` or under `lights`. Below: the same slices against the viewing
    angle, and albedo against the angle of incidence, or by channel where there are more than three. Ticks on the half
    circle mark the light, ticks on the axis the mirror directions. The plane of incidence is the x-z plane; of an
    oriented measurement that of the azimuth of the light that is nearest to it.

    Slices of a measurement are those of angles of incidence that were measured. Curves end where its data end; values
    measured in the plane are points, with bars of two standard uncertainties. Of a map, pi f of every place takes the
    place of the sphere, and the rest is that of the place in its middle.
    """
    with new_figure(path, (11.0, 8.6), title or _title(m)) as figure:
        grid = figure.add_gridspec(2, 2, width_ratios=[1.25, 1.0])
        beside = figure.add_subplot(grid[0, 1])
        if batch.full_shape(m, ()):
            m = _draw_map(beside, m, bands)
        else:
            picture = render(m, lights, size=size, samples=samples, progress=progress, bands=bands)
            _sphere(beside, m, picture, bands)
        slices = slices_of(m)
        _polar(figure.add_subplot(grid[0, 0]), m, slices)
        _cartesian(figure.add_subplot(grid[1, 0]), m, slices)
        _albedo(figure.add_subplot(grid[1, 1]), m)
        low, high = lit_range(m)
        if isinstance(m, Gridded) and m.outside == "hold" and (spans(slices) or high - low < 89.0):
            figure.supxlabel(HELD, fontsize=9, color="#555555")


def portrait(m: Reflectance, path: str | Path, lights: Light | Iterable[Light] | None = None) -> None:
    """Write a small figure: a lit sphere beside the polar slices of f in the plane of incidence; of a material that
    transmits beside what becomes of light."""
    with new_figure(path, (6.4, 2.9), "") as figure:
        grid = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.35])
        _sphere(figure.add_subplot(grid[0]), m, render(m, lights, size=256, samples=64))
        beside = figure.add_subplot(grid[1])
        if m.sides == "front":
            _polar(beside, m, slices_of(m))
        else:
            draw_fate(beside, m)
        for axes in figure.axes:
            axes.set_title("")


def _title(m: Reflectance) -> str:
    """The name of the file of a measurement; a material as an expression."""
    return Path(m.path).name if isinstance(m, Measured) and m.path else repr(m)


def check_target(path: str | Path) -> None:
    """Raise the errors of `new_figure` for this name, before anything is computed."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise ParameterError(f"{path}: expected a name that ends in {', '.join(SUFFIXES)}")
    target(path)
    _matplotlib()


@contextmanager
def new_figure(path: str | Path, size: tuple[float, float], title: str) -> Iterator[Any]:
    """A figure to draw in, which is written at the end of the context."""
    path = Path(path)
    check_target(path)
    matplotlib = _matplotlib()
    from matplotlib.figure import Figure

    with warnings.catch_warnings(), matplotlib.rc_context(STYLE):
        warnings.simplefilter("ignore", MissingDataWarning)
        figure = Figure(figsize=size, layout="constrained")
        yield figure
        if title:
            lines = textwrap.wrap(title, 120, max_lines=2, placeholder=" …")
            figure.suptitle("\n".join(lines), fontsize=12, parse_math=False)
        with replacing(path) as temporary:
            figure.savefig(temporary, dpi=120, format=path.suffix[1:].lower())


def _matplotlib() -> Any:
    """Matplotlib; its import fails where MPLBACKEND names an unknown backend, though none is used here."""
    backend = os.environ.pop("MPLBACKEND", None)
    try:
        import matplotlib
    except ImportError:
        raise DependencyError("figures need matplotlib; pip install matplotlib") from None
    finally:
        if backend is not None:
            os.environ["MPLBACKEND"] = backend
    if backend:
        with suppress(ValueError):
            matplotlib.rcParams["backend"] = backend  # for callers that show figures of their own
    return matplotlib


STYLE: Any = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.titlesize": 11,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "legend.loc": "best",
    "legend.fontsize": 9,
    "legend.title_fontsize": 9,
}
_SEQUENCE = ["#0b1f4b", "#234f9a", "#2f86c1", "#37b59d", "#8cc63f", "#e3a72f"]
RGB = ["#c8362f", "#2f8f46", "#2f5fc8"]
_NO_DATA: Any = {"facecolor": "#e9e9e9", "edgecolor": "#c4c4c4", "hatch": "///", "linewidth": 0.0, "zorder": 0}
_DENSE = 45
"""Measured values of a slice from which on their points are small."""


def _range(slices: list[Slice]) -> tuple[float, float]:
    """Lowest and highest value worth showing on a logarithmic axis; (0, 0) if there is none."""
    values = np.concatenate([np.concatenate([s.f, s.measured]) for s in slices])
    values = values[values > 0.0]
    if not values.size:
        return 0.0, 0.0
    high = float(values.max())
    return max(float(values.min()), high * 1e-5), high


def write(axes: Any, text: str = "f = 0 away from\nthe mirror direction", colour: str = "black") -> None:
    """Text in place of curves."""
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, color=colour)


def _nothing(slices: list[Slice]) -> str:
    """Why there is no curve."""
    known = any(np.isfinite(s.f).any() for s in slices)
    return "f = 0 away from\nthe mirror direction" if known else "no data in this plane"


def _colours(slices: list[Slice]) -> list[str]:
    return _SEQUENCE[: len(slices)]


def _polar(host: Any, m: Reflectance, slices: list[Slice]) -> None:
    low, high = _range(slices)
    host.set_axis_off()
    axes = host.inset_axes((0.07, -0.5, 0.86, 2.0), projection="polar")  # its box is a square, half of it empty
    axes.set(theta_zero_location="N", theta_direction=-1, thetamin=-90, thetamax=90)
    axes.set_thetagrids(np.arange(-90, 91, 30), [f"{abs(a)}°" for a in range(-90, 91, 30)])
    _, words = one_number(m)
    host.set_title(f"f [sr⁻¹]{', ' + words if words else ''}\nin the plane of incidence, light from the left")
    if high == 0.0:
        axes.set_rticks([])
        write(axes, _nothing(slices))
        return
    bottom, top = math.floor(math.log10(low) - 0.3), math.log10(high) + 0.15
    for start, stop in spans(slices):
        width, middle = math.radians(stop - start), math.radians(0.5 * (start + stop))
        axes.bar(middle, top - bottom, width, bottom, **_NO_DATA)
        if stop - start > 12.0:
            _label_gap(axes, middle, 0.5 * (bottom + top))
    for s, colour in zip(slices, _colours(slices), strict=True):
        axes.plot(np.radians(VIEWS), np.log10(np.maximum(s.f, 10.0**bottom)), color=colour, lw=1.6)
        seen = s.measured > 10.0**bottom
        if seen.any():
            axes.plot(np.radians(s.views[seen]), np.log10(s.measured[seen]), "o", color=colour, ms=_size(s))
        axes.plot([-math.radians(s.theta)] * 2, [top - 0.08 * (top - bottom), top], color=colour, lw=2.5)
    axes.set_rlim(bottom, top)
    decades = range(bottom + 1, math.floor(top) + 1)
    decades = decades[:: max(1, -(-len(decades) // 3))]  # more labels would touch in small figures
    radii: list[float] = list(decades)
    labels = [f"$10^{{{d}}}$" for d in decades]
    if not radii:  # all within one decade
        values = [x for x in (0.2, 0.5, 1.0, 2.0, 5.0) if bottom < math.log10(x) + bottom + 1.0 < top]
        radii = [math.log10(x) + bottom + 1.0 for x in values]
        labels = [f"{x * 10.0 ** (bottom + 1):g}" for x in values]
    axes.set_rgrids(radii, labels, angle=-90, fontsize=8)


def _size(s: Slice) -> float:
    """The size of the points of a slice."""
    return 3.2 if len(np.unique(s.views.round(1))) <= _DENSE else 1.4


def _label_gap(axes: Any, x: float, y: float, **more: Any) -> None:
    """The words "no data" in a shaded region."""
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    axes.text(x, y, "no data", ha="center", va="center", fontsize=8, color="#555555", bbox=box, **more)


def _cartesian(axes: Any, m: Reflectance, slices: list[Slice]) -> None:
    low, high = _range(slices)
    has_points = has_bars = False
    for s, colour in zip(slices, _colours(slices), strict=True):
        axes.plot(VIEWS, np.where(s.f > 0.0, s.f, np.nan), color=colour, lw=1.6, label=f"{s.theta:.3g}°")
        axes.axvline(s.theta, ymax=0.03, color=colour, lw=2.0)
        if s.views.size:
            has_points = True
            axes.plot(s.views, s.measured, "o", color=colour, ms=_size(s))
        if s.u is not None:
            has_bars = True
            axes.errorbar(s.views, s.measured, 2.0 * s.u, fmt="none", ecolor=colour, elinewidth=1.0, capsize=1.5)
    for start, stop in spans(slices):
        axes.axvspan(start, stop, **_NO_DATA)
        if stop - start > 4.0:
            _label_gap(axes, 0.5 * (start + stop), 0.5, rotation=90, transform=axes.get_xaxis_transform())
    if high == 0.0:
        write(axes, _nothing(slices))
        axes.set_yticks([])
    elif high / low < 3.0:
        axes.set_ylim(0.0, 1.25 * high)
    else:
        axes.set(yscale="log", ylim=(0.7 * low, 2.0 * high))
    axes.set(xlim=(-90, 90), xticks=np.arange(-90, 91, 30), xlabel="viewing angle θₒ [°]; ticks: mirror directions")
    _, words = one_number(m)
    points = "; points: measured" + (", bars: ±2u" if has_bars else "") if has_points else ""
    axes.set(ylabel=f"BRDF f [sr⁻¹]{', ' + words.partition(',')[0] if words else ''}", title=f"The same slices{points}")
    axes.legend(title="incidence θᵢ")


def _albedo(axes: Any, m: Reflectance) -> None:
    names, count = m.channel_names, m.channels or 1
    axes.set_title("Albedo: the fraction of light that leaves again")
    axes.axhline(1.0, color="#999999", lw=1.0, ls="--")
    by_angle = count == 1 or is_rgb(m) or names in (XYZ, RELATIVE_XYZ)
    rho = _albedo_by_angle(axes, m) if by_angle else _albedo_by_channel(axes, m)
    axes.set(ylim=(0.0, max(1.0, float(np.nanmax(rho, initial=0.0)) * 1.05)), ylabel="albedo")


def _albedo_by_angle(axes: Any, m: Reflectance) -> np.ndarray:
    """Draw the albedos of a gray or RGB material against the angle of incidence."""
    low, high = lit_range(m)
    theta = np.unique(np.clip(INCIDENCE, low, high))
    rho = with_channels(albedo(m, direction(np.radians(theta), plane(m)), tolerance=1e-3), 1)
    if (matrix := rgb_of(m.channel_names)) is not None:
        rho = rho @ matrix
    is_gray = rho.shape[1] == 1
    for curve, colour, label in zip(rho.T, ["#333333"] if is_gray else RGB, "RGB", strict=False):
        axes.plot(theta, curve, color=colour, lw=1.8, marker="o", ms=3.5, label=label, clip_on=False)
    for start, stop in ((0.0, low), (high, 90.0)):
        if stop - start > 1.0:
            axes.axvspan(start, stop, **_NO_DATA)
        if stop - start > 6.0:
            _label_gap(axes, 0.5 * (start + stop), 0.5, rotation=90, transform=axes.get_xaxis_transform())
    axes.set(xlim=(0, 90), xticks=np.arange(0, 91, 15), xlabel="angle of incidence θᵢ [°]")
    if not is_gray:
        axes.legend()
    return np.asarray(rho)


def _albedo_by_channel(axes: Any, m: Reflectance) -> np.ndarray:
    """Draw the albedos of channels that are no RGB, by wavelength or name, at up to three angles of incidence."""
    names, (low, high) = m.channel_names, lit_range(m)
    theta = np.unique(np.clip((0.0, 45.0, 75.0), low, high))
    rho = albedo(m, direction(np.radians(theta), plane(m)), tolerance=1e-3)
    has_wavelengths = names is not None and not isinstance(names[0], str)
    x = np.array(names, float) if has_wavelengths else np.arange(rho.shape[-1], dtype=float)
    order = np.argsort(x)
    for t, curve, colour in zip(theta, rho, _SEQUENCE[::2], strict=False):
        style = "-" if has_wavelengths and len(x) > 40 else "o-" if has_wavelengths else "o"
        axes.plot(x[order], curve[order], style, color=colour, lw=1.6, ms=3.5, label=f"{t:.3g}°")
    if has_wavelengths:
        axes.set(xlabel="wavelength [nm]", xlim=(x.min(), x.max()))
    elif names is not None and len(names) <= 16:
        axes.set_xticks(x, names, rotation=45, ha="right")
        axes.set_xlabel("channel")
    else:
        axes.set_xlabel("number of the channel")
    axes.legend(title="incidence θᵢ")
    return np.asarray(rho)


def _codes(linear: np.ndarray) -> np.ndarray:
    """Linear RGB (..., 3), or gray (..., 1), as sRGB (..., 3) from 0 to 1."""
    rgb = np.repeat(linear, 3, axis=-1) if linear.shape[-1] == 1 else linear
    return np.clip(srgb_encode(np.nan_to_num(rgb)), 0.0, 1.0)


def _sphere(axes: Any, m: Reflectance, picture: Any, bands: Sequence[str | float] | None = None) -> None:
    title = "Sphere, seen by a parallel camera"
    if is_coloured(m, bands):
        shown = _codes(picture.pixels)
        title += _of_bands(bands)
    else:
        shown = _codes(picture.pixels.mean(axis=-1, keepdims=True))
        title += f",\n{one_number(m)[1]}"
    alpha = picture.alpha if picture.alpha is not None else np.ones(shown.shape[:2])
    axes.imshow(np.concatenate([shown, alpha[..., None]], axis=-1), interpolation="lanczos")
    axes.set_axis_off()
    axes.set_title(title)


def _of_bands(bands: Sequence[str | float] | None) -> str:
    """The end of a title that says which bands a picture shows."""
    if bands is None:
        return ""
    return f",\n{', '.join(map(str, bands))} as {'red, green, blue' if len(bands) == 3 else 'gray'}"


def _draw_map(axes: Any, m: Reflectance, bands: Sequence[str | float] | None) -> Reflectance:
    """Draw pi f of every place of a map, seen along the normal; the material of the place in its middle."""
    shape = batch.full_shape(m, ())
    f = with_channels(m.f(direction(math.radians(45.0), math.pi), direction(0.0, 0.0)), len(shape))
    number, words = one_number(m)
    known = np.argwhere(np.isfinite(number(f)))
    if not len(known):
        raise ParameterError(f"{m!r:.80}: no place of the map has data; expected at least one")
    place = tuple(known[np.abs(known - 0.5 * (np.array(shape) - 1.0)).sum(axis=-1).argmin()].tolist())
    if is_coloured(m, bands) and f.shape[-1] > 1:
        matrix = shown_as(m, bands)
        shown = math.pi * (f if matrix is None else f @ matrix)
        axes.imshow(_codes(shown.reshape(-1, shape[-1], shown.shape[-1])), aspect="equal", interpolation="nearest")
    else:
        gray = math.pi * number(f).reshape(-1, shape[-1])
        picture = axes.imshow(gray, aspect="equal", cmap="viridis", interpolation="nearest")
        axes.figure.colorbar(picture, ax=axes, shrink=0.8, label=f"π f{', ' + words if words else ''}")
    y, x = divmod(int(np.ravel_multi_index(place, shape)), shape[-1])
    axes.plot(x, y, "+", color="#d62728", ms=12, mew=2.0)
    axes.set(xlabel="column", ylabel="row")
    axes.grid(False)
    where = ", ".join(map(str, place))
    axes.set_title(
        f"π f of every place: light at 45°, seen at 0°{_of_bands(bands)};\n+ the place ({where}) of the other panels"
    )

    def picked(value: Any) -> Any:
        if getattr(value, "ndim", 0) < 2:
            return value
        return np.broadcast_to(value, (*shape, value.shape[-1]))[place]

    return m.each(picked)
