"""Albedo against the angle of incidence, or by channel."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import direction
from ..base.reflectance import Reflectance
from ..base.shown_channels import is_rgb
from ..declared.arguments import checked
from ..integrals.albedo import albedo as albedo_of
from ..pictures.colour import RELATIVE_XYZ, XYZ, rgb_of
from ._curves import line
from ._drawing import DASHES, NO_DATA, RGB, SEQUENCE, label_gap, legend, materials_of, panels
from ._slices import lit_range, one_number, plane, units_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INCIDENCE = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0, 88.0)


@checked
def albedo(
    materials: Mapping[str, Reflectance] | Sequence[Reflectance] | Reflectance,
    path: str | os.PathLike[str] | None = None,
    axes: Any = None,
) -> Figure:
    """Draw the directional-hemispherical reflectance against the angle of incidence.

    Of one gray or RGB material a curve for each channel; of one with other channels the albedo by channel or
    wavelength, at three angles of incidence; of several materials a curve for each, as luminance or mean. Gray is where
    a measurement was not lit.

    materials  one, a list, or label -> material
    path       file to write: .png, .jpg, .pdf or .svg
    axes       of Matplotlib to draw into; by default a new figure

    Units      the figure has degrees; albedo is a share.
    Error      albedos to 1e-3, by `gn.albedo`.
    Errors     ParameterError for other names of files, for maps, and for no material.

    Example
    >>> metals = {name: gn.material(name, alpha=0.3) for name in ("gold", "silver")}
    >>> figure = gn.figures.albedo(metals, path="metals.pdf")
    >>> print(figure.axes[0].get_ylabel())
    albedo (luminance)
    """
    shown = materials_of(materials)
    with panels(path, axes, 1, (5.4, 4.0)) as (figure, (where,)):
        if len(shown) == 1:
            draw_albedo(where, *shown.values())
        else:
            _draw_several(where, shown)
    return figure


def draw_albedo(axes: Any, m: Reflectance) -> None:
    """Draw the albedos of a material of one place."""
    names, count = m.channel_names, m.channels or 1
    axes.axhline(1.0, color="#999999", lw=1.0, ls="--")
    by_angle = count == 1 or is_rgb(m) or names in (XYZ, RELATIVE_XYZ)
    rho = _by_angle(axes, m) if by_angle else _by_channel(axes, m)
    axes.set(ylim=(0.0, max(1.02, float(np.nanmax(rho, initial=0.0)) * 1.05)), ylabel="albedo")


def _draw_several(axes: Any, materials: Mapping[str, Reflectance]) -> None:
    axes.axhline(1.0, color="#999999", lw=1.0, ls="--")
    handles, top = [], 1.0
    for k, m in enumerate(materials.values()):
        theta, rho = _albedos(m)
        number, _ = one_number(m)
        curve = number(rho)
        colour, dash = line(k)
        handles += axes.plot(theta, curve, color=colour, ls=dash, lw=1.8)
        top = max(top, float(np.nanmax(curve, initial=0.0)))
    unit = units_of(materials.values())
    axes.set(ylim=(0.0, max(1.02, 1.05 * top)), ylabel=f"albedo ({unit})" if unit else "albedo")
    _angle_axis(axes)
    legend(axes, handles, list(materials))


def _albedos(m: Reflectance) -> tuple[np.ndarray, np.ndarray]:
    """Angles of incidence [degrees] of which there are data, and the albedos (angles, C)."""
    low, high = lit_range(m)
    theta = np.unique(np.clip(INCIDENCE, low, high))
    return theta, with_channels(albedo_of(m, direction(np.radians(theta), plane(m)), tolerance=1e-3), 1)


def _by_angle(axes: Any, m: Reflectance) -> np.ndarray:
    """Draw the albedos of a gray or RGB material against the angle of incidence."""
    theta, rho = _albedos(m)
    if (matrix := rgb_of(m.channel_names)) is not None:
        rho = rho @ matrix
    is_gray = rho.shape[1] == 1
    handles = []
    for curve, colour, dash in zip(rho.T, ["#333333"] if is_gray else RGB, DASHES, strict=False):
        handles += axes.plot(theta, curve, color=colour, ls=dash, lw=1.8, marker="o", ms=3.5, clip_on=False)
    low, high = lit_range(m)
    for start, stop in ((0.0, low), (high, 90.0)):
        if stop - start > 1.0:
            axes.axvspan(start, stop, **NO_DATA)
        if stop - start > 6.0:
            label_gap(axes, 0.5 * (start + stop), 0.5, rotation=90, transform=axes.get_xaxis_transform())
    _angle_axis(axes)
    if not is_gray:
        legend(axes, handles, ["red", "green", "blue"])
    return np.asarray(rho)


def _angle_axis(axes: Any) -> None:
    axes.set(xlim=(0, 90), xticks=np.arange(0, 91, 15), xlabel="angle of incidence θᵢ [°]")


def _by_channel(axes: Any, m: Reflectance) -> np.ndarray:
    """Draw the albedos of channels that are no RGB, by wavelength or name, at up to three angles of incidence."""
    names, (low, high) = m.channel_names, lit_range(m)
    theta = np.unique(np.clip((0.0, 45.0, 75.0), low, high))
    rho = albedo_of(m, direction(np.radians(theta), plane(m)), tolerance=1e-3)
    has_wavelengths = names is not None and not isinstance(names[0], str)
    x = np.array(names, float) if has_wavelengths else np.arange(rho.shape[-1], dtype=float)
    order = np.argsort(x)
    for t, curve, colour in zip(theta, rho, SEQUENCE[::2], strict=False):
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
