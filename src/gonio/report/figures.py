"""Figures of a material: polar slices in the plane of incidence, albedo against angle, a lit sphere."""

from __future__ import annotations

import math
import os
import textwrap
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import direction
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..errors import DependencyError, MissingDataWarning, ParameterError
from ..files import replacing, target
from ..integrals.albedo import albedo
from ..pictures.colour import LUMINANCE, RELATIVE_XYZ, XYZ, rgb_of, srgb_encode
from ..scenes.rendering import render

SLICES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
INCIDENCE = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0, 88.0)
SUFFIXES = (".png", ".jpg", ".pdf", ".svg")


def show(
    m: Reflectance,
    path: str | Path,
    lights: Light | Iterable[Light],
    title: str = "",
    size: int = 256,
    samples: int = 32,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write the figure of a material to a .png, .jpg, .pdf or .svg file.

    Above: f [1/sr] in the plane of incidence as polar slices, one per angle of incidence, with a logarithmic radius,
    and a lit sphere. Below: the same slices against the viewing angle, and albedo against the angle of incidence, per
    channel. Ticks on the half circle mark the light, ticks on the axis the mirror directions. The plane of incidence is
    the x-z plane.
    """
    with new_figure(path, (11.0, 8.6), title or repr(m)) as figure:
        grid = figure.add_gridspec(2, 2, width_ratios=[1.25, 1.0])
        slices = _slice_values(m)
        _polar(figure.add_subplot(grid[0, 0], projection="polar"), slices)
        picture = render(m, lights, size=size, samples=samples, progress=progress)
        _sphere(figure.add_subplot(grid[0, 1]), picture)
        _cartesian(figure.add_subplot(grid[1, 0]), slices)
        _albedo(figure.add_subplot(grid[1, 1]), m)


def portrait(m: Reflectance, path: str | Path, lights: Light | Iterable[Light]) -> None:
    """Write a small figure: a lit sphere beside the polar slices of f in the plane of incidence."""
    with new_figure(path, (6.4, 2.9), "") as figure:
        grid = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.35])
        _sphere(figure.add_subplot(grid[0]), render(m, lights, size=256, samples=64))
        _polar(figure.add_subplot(grid[1], projection="polar"), _slice_values(m))
        for axes in figure.axes:
            axes.set_title("")


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


def _brightness(m: Reflectance, f: np.ndarray, ndim: int) -> np.ndarray:
    """f without its channels: their luminance if they are colours, else their mean."""
    if f.ndim == ndim:
        return f
    names = m.channel_names
    if names in (XYZ, RELATIVE_XYZ):
        return f[..., 1]
    if f.shape[-1] == 3 and (names is None or isinstance(names[0], str)):
        return f @ LUMINANCE
    return f.mean(axis=-1)


VIEWS = np.linspace(-89.5, 89.5, 1433)


def _slice_values(m: Reflectance) -> list[np.ndarray]:
    """f at the viewing angles VIEWS, for each incidence of SLICES; NaN where it is not positive."""
    wo = direction(np.radians(np.abs(VIEWS)), np.where(VIEWS < 0.0, np.pi, 0.0))
    curves = []
    for theta in SLICES:
        f = _brightness(m, m.f(direction(np.radians(theta), np.pi), wo), 1)  # light from the left
        curves.append(np.where(f > 0.0, f, np.nan))
    return curves


def _range(slices: list[np.ndarray]) -> tuple[float, float]:
    """Lowest and highest value worth showing on a logarithmic axis; (0, 0) if there is none."""
    values = np.concatenate(slices)
    if not np.isfinite(values).any():
        return 0.0, 0.0
    high = float(np.nanmax(values))
    return max(float(np.nanmin(values)), high * 1e-5), high


def write(axes: Any, text: str = "f = 0 away from\nthe mirror direction", colour: str = "black") -> None:
    """Text in place of curves."""
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, color=colour)


def _polar(axes: Any, slices: list[np.ndarray]) -> None:
    low, high = _range(slices)
    axes.set(theta_zero_location="N", theta_direction=-1, thetamin=-90, thetamax=90)
    axes.set_thetagrids(np.arange(-90, 91, 30), [f"{abs(a)}°" for a in range(-90, 91, 30)])
    axes.set_title("Polar slices of f [1/sr] in the plane of incidence, light from the left")
    if high == 0.0:
        axes.set_rticks([])
        write(axes)
        return
    bottom, top = math.floor(math.log10(low) - 0.3), math.log10(high) + 0.15
    for theta, f, colour in zip(SLICES, slices, _SEQUENCE, strict=True):
        radius = np.log10(np.maximum(np.where(np.isnan(f), 10.0**bottom, f), 10.0**bottom))
        axes.plot(np.radians(VIEWS), radius, color=colour, lw=1.6)
        axes.plot([-math.radians(theta)] * 2, [top - 0.08 * (top - bottom), top], color=colour, lw=2.5)
    axes.set_rlim(bottom, top)
    decades = range(bottom + 1, math.floor(top) + 1)
    decades = decades[:: max(1, -(-len(decades) // 3))]  # more labels would touch in small figures
    axes.set_rgrids(list(decades), [f"$10^{{{d}}}$" for d in decades], angle=-90, fontsize=8)


def _cartesian(axes: Any, slices: list[np.ndarray]) -> None:
    low, high = _range(slices)
    for theta, f, colour in zip(SLICES, slices, _SEQUENCE, strict=True):
        axes.plot(VIEWS, f, color=colour, lw=1.6, label=f"{theta:g}°")
        axes.axvline(theta, ymax=0.03, color=colour, lw=2.0)
    if high == 0.0:
        write(axes)
    elif high / low < 3.0:
        axes.set_ylim(0.0, 1.25 * high)
    else:
        axes.set(yscale="log", ylim=(0.7 * low, 2.0 * high))
    axes.set(xlim=(-90, 90), xticks=np.arange(-90, 91, 30), xlabel="viewing angle θₒ [°]; ticks: mirror directions")
    axes.set(ylabel="BRDF f [1/sr], without cosine", title="The same slices")
    axes.legend(title="incidence θᵢ")


def _albedo(axes: Any, m: Reflectance) -> None:
    rho = albedo(m, direction(np.radians(INCIDENCE), 0.0), tolerance=1e-3)
    rho = with_channels(rho, 1)
    names = m.channel_names
    matrix = rgb_of(names) if rho.shape[1] > 3 or names in (XYZ, RELATIVE_XYZ) else None
    if matrix is not None:
        rho = rho @ matrix
    elif rho.shape[1] > 3:
        rho = rho.mean(axis=1, keepdims=True)
    curves = zip("RGB", RGB, rho.T, strict=True) if rho.shape[1] == 3 else [(None, "#333333", rho[:, 0])]
    for label, colour, curve in curves:
        axes.plot(INCIDENCE, curve, color=colour, lw=1.8, marker="o", ms=3.5, label=label)
    axes.axhline(1.0, color="#999999", lw=1.0, ls="--")
    axes.set(xlim=(0, 90), xticks=np.arange(0, 91, 15), xlabel="angle of incidence θᵢ [°]")
    axes.set(ylim=(0.0, max(1.0, float(rho.max()) * 1.05)), ylabel="albedo")
    axes.set_title("Albedo: the fraction of light that leaves again")
    if rho.shape[1] == 3:
        axes.legend()


def _sphere(axes: Any, picture: Any) -> None:
    pixels = picture.pixels
    rgb = np.repeat(pixels, 3, axis=-1) if pixels.shape[-1] == 1 else pixels[..., :3]
    shown = np.clip(srgb_encode(np.nan_to_num(rgb)), 0.0, 1.0)
    alpha = picture.alpha if picture.alpha is not None else np.ones(rgb.shape[:2])
    axes.imshow(np.concatenate([shown, alpha[..., None]], axis=-1), interpolation="lanczos")
    axes.set_axis_off()
    axes.set_title("Sphere, seen by a parallel camera")
