"""Extrapolation to grazing: f at directions that an instrument did not reach."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import angles, direction
from ..base.measured import Measured
from ..declared.arguments import checked
from ..distributions.ggx import GGX
from ..errors import ParameterError, expect_one_of
from ..formula.fresnel.schlick import Schlick
from ..models.microfacet import Microfacet
from ..tables.gridded import Gridded
from ._cells import GridCells, evaluated, like, relative, spread, variances

METHODS = ("hold", "linear in cosine", "model")
STEP = math.radians(5.0)
"""Distance of the two angles of a straight line in the cosine, and the largest distance of new nodes."""
WITHIN = 1e-6
"""Angles up to this [rad] beyond reach count as within reach."""
LEAST = 0.01
"""Cosine of the directions at which the model is evaluated for those nearer to the horizon."""

FITTED = 20_000
"""Largest number of cells that the model is fitted to; of more, evenly picked ones."""


class _Reach(NamedTuple):
    """The largest measured polar angles [rad] of wi and wo."""

    theta_i: float
    theta_o: float


@checked
def extrapolate_to_grazing(m: Measured, method: str, reach: float | tuple[float, float] | None = None) -> Gridded:
    """The measurement with f beyond the largest measured polar angles, up to the horizon.

    method   "hold": f at the largest measured polar angles, at the same azimuths
             "linear in cosine": the straight line in cos(theta) through f there and 5 degrees before
             "model": a Lambertian and a GGX lobe with Schlick's Fresnel term, fitted to all measured cells and scaled
             to be continuous: f(wi, wo) = model(wi, wo) f(held)/model(held), at the directions of "hold"
    reach    the largest measured polar angles [rad], one number or (theta_i, theta_o): every cell beyond is replaced.
             If not given, the largest angles with a value

    Tables of "angles" that end before get nodes up to 90 degrees, with the step of their last ones, 5 degrees at most.
    Cells within reach keep their value, bit by bit; holes among them stay holes.

    The method is rehearsed: with a reach 5 degrees smaller, predictions for the cells between are compared with the
    measurement. `figures`: "rehearsal", the root mean square of the relative difference (NaN if no such cells exist);
    "negative", the number of cells that became negative; for "model" its "alpha", "f0", and "fit", the root mean square
    of its relative difference from the measured cells. The standard uncertainty of an extrapolated cell is that of the
    cells it was made from and, in quadrature, rehearsal * |f| * (angle beyond reach)/5 degrees.

    Error    0.3 Lambertian + GGX(0.3), glass, measured to 75 degrees: at 80 and 85 degrees hold 0.063 rms, relative,
             linear in cosine 0.051, model 0.019; rehearsals 0.029, 0.008, 0.011: f rises ever faster, and the rehearsal
             is too good. Of a material that is such a lobe, the model finds alpha to 1e-4.

    Example
    >>> theta, phi = np.radians(np.arange(0.0, 76.0, 5.0)), np.radians(np.arange(0.0, 360.0, 10.0))
    >>> axes = {"theta_i": theta, "theta_o": theta, "phi": phi}
    >>> m = gn.repair.resample(gn.Lambertian(0.5), "angles", axes=axes)  # to 75 degrees
    >>> m = gn.repair.extrapolate_to_grazing(m, "hold")
    >>> print(gn.albedo(m, [0, 0, 1]).round(4))
    0.4999
    """
    expect_one_of(METHODS, "method", method)
    cells = GridCells(m)
    end = _reach(cells, reach)
    figures: dict[str, float] = {}
    extend: Callable[..., Any] = partial(_linear if method == "linear in cosine" else _hold, cells.m)
    if method == "model":
        lobe, figures = _fitted_lobe(cells, _excess(cells.wi, cells.wo, end) <= WITHIN)
        extend = partial(_by_model, cells.m, lobe)
    rehearsal = _rehearsal(cells, extend, end)
    new = GridCells(_with_nodes(cells.m))
    beyond = (np.minimum(new.wi[..., 2], new.wo[..., 2]) > -1e-9) & (_excess(new.wi, new.wo, end) > WITHIN)
    f, u = new.f.copy(), None if new.u is None else new.u.copy()
    f[beyond], variance = extend(new.wi[beyond], new.wo[beyond], end)
    if u is not None and variance is not None:
        guess = rehearsal * np.abs(f[beyond]) * (_excess(new.wi[beyond], new.wo[beyond], end) / STEP)[:, None]
        u[beyond] = np.hypot(np.sqrt(variance), guess)
    figures |= {"rehearsal": rehearsal, "negative": int((f[beyond] < 0.0).any(axis=-1).sum())}
    parameters = {"method": method, "reach": list(end)}
    return new.repaired("extrapolate_to_grazing", parameters, f, u, figures, before=m)


def _reach(cells: GridCells, reach: float | tuple[float, float] | None) -> _Reach:
    has_value = cells.up & ~np.isnan(cells.f).all(axis=-1)
    if not has_value.any():
        raise ParameterError("extrapolate_to_grazing: the measurement has no value in any cell; expected some")
    if reach is None:
        return _Reach(*(float(angles(w[has_value])[0].max()) for w in (cells.wi, cells.wo)))
    end = _Reach(*np.broadcast_to(np.asarray(reach, dtype=float), 2).tolist())
    if not all(0.0 < theta < 0.5 * math.pi for theta in end):
        raise ParameterError(f"reach={reach!r}: expected polar angles between 0 and pi/2 rad; are these degrees?")
    return end


def _excess(wi: np.ndarray, wo: np.ndarray, end: _Reach) -> np.ndarray:
    """Angle [rad] of pairs beyond reach, the larger one of wi and wo; negative within reach."""
    return np.maximum(angles(wi)[0] - end.theta_i, angles(wo)[0] - end.theta_o)


def _clamped(w: np.ndarray, theta: float) -> np.ndarray:
    """Directions with polar angles of at most theta."""
    polar, phi = angles(w)
    return direction(np.minimum(polar, theta), phi)


def _hold(m: Gridded, wi: np.ndarray, wo: np.ndarray, end: _Reach) -> tuple[np.ndarray, np.ndarray | None]:
    pair = _clamped(wi, end.theta_i), _clamped(wo, end.theta_o)
    return evaluated(m, *pair), None if m.uncertainty is None else evaluated(variances(m), *pair)


def _linear(m: Gridded, wi: np.ndarray, wo: np.ndarray, end: _Reach) -> tuple[np.ndarray, np.ndarray | None]:
    total: Any = 0.0
    variance: Any = None if m.uncertainty is None else 0.0
    for a, v in _line(wi, end.theta_i):
        for b, w in _line(wo, end.theta_o):
            weight = (v * w)[:, None]
            total = total + np.where(weight == 0.0, 0.0, weight * evaluated(m, a, b))
            if variance is not None:
                variance = variance + np.where(weight == 0.0, 0.0, weight**2 * evaluated(variances(m), a, b))
    return total, variance


def _line(w: np.ndarray, theta: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Two directions within reach, with weights that make the straight line in the cosine through them."""
    polar, phi = angles(w)
    last, before = math.cos(theta), math.cos(max(theta - STEP, 0.5 * theta))
    t = np.where(polar > theta, (np.cos(polar) - last) / (last - before), 0.0)
    inner = direction(np.where(polar > theta, math.acos(before), polar), phi)
    return [(_clamped(w, theta), 1.0 + t), (inner, -t)]


def _by_model(m: Gridded, lobe: Any, wi: np.ndarray, wo: np.ndarray, end: _Reach) -> Any:
    high = math.acos(LEAST)
    pair = _clamped(wi, end.theta_i), _clamped(wo, end.theta_o)
    ratio = lobe(_clamped(wi, high), _clamped(wo, high)) / np.maximum(lobe(*pair), 1e-30)
    f, variance = _hold(m, wi, wo, end)
    return f * ratio, None if variance is None else variance * ratio**2


def _rehearsal(cells: GridCells, extend: Any, end: _Reach) -> float:
    """Root mean square of the relative error at cells up to `STEP` within reach, predicted from those before."""
    short = _Reach(*(max(theta - STEP, 0.5 * theta) for theta in end))
    test = cells.up & (_excess(cells.wi, cells.wo, end) <= WITHIN) & (_excess(cells.wi, cells.wo, short) > WITHIN)
    if not test.any():
        return math.nan
    off = relative(extend(cells.wi[test], cells.wo[test], short)[0], cells.f[test], cells.f)
    return spread(off)[0] if np.isfinite(off).any() else math.nan


def _with_nodes(m: Gridded) -> Gridded:
    """The measurement with empty nodes up to the horizon, where its axes are polar angles that end before."""
    if "theta_o" not in m.axes:
        return m
    axes = dict(m.axes)
    arrays = [with_channels(a, len(axes)) for a in (m.stored, m.uncertainty) if a is not None]
    for k, name in enumerate(("theta_i", "theta_o")):
        nodes = axes[name]
        step = min(float(nodes[-1] - nodes[-2]), STEP) if len(nodes) > 1 else STEP
        more = math.ceil((0.5 * math.pi - nodes[-1]) / step - 1e-6) if nodes[-1] < 0.5 * math.pi - 1e-6 else 0
        axes[name] = np.append(nodes, np.linspace(nodes[-1], 0.5 * math.pi, more + 1)[1:])
        widths = [(0, more if axis == k else 0) for axis in range(len(axes) + 1)]
        arrays = [np.pad(a, widths, constant_values=np.nan) for a in arrays]
    return like(m, axes, arrays[0], arrays[1] if len(arrays) > 1 else None)


def _fitted_lobe(cells: GridCells, use: np.ndarray) -> tuple[Callable, dict[str, float]]:
    """kd/pi + ks D F G/(4 cos cos) fitted to the cells to use: a function (wi, wo) -> (..., C), and figures.

    Each channel has its own kd, ks >= 0; alpha and f0 are common. The fit minimizes differences relative to |f|, or to
    a tenth of a channel's mean |f| where that is larger.
    """
    from scipy.optimize import least_squares, nnls

    use = use & cells.up & np.isfinite(cells.f).all(axis=-1)
    if use.sum() < 4:
        raise ParameterError(f"method='model': only {int(use.sum())} cells to fit to; expected at least 4")
    wi, wo, f = cells.wi[use], cells.wo[use], cells.f[use]
    few = np.unique(np.linspace(0, len(f) - 1, FITTED).astype(int))
    wi, wo, f = wi[few], wo[few], f[few]
    weight = 1.0 / np.maximum(np.abs(f), 0.1 * np.abs(f).mean(axis=0) + 1e-30)

    def parts(x: np.ndarray, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        lobe = Microfacet(GGX(float(np.exp(x[0]))), Schlick(float(x[1])))
        glossy = evaluated(lobe, wi, wo)[..., 0]
        return np.stack([np.full(glossy.shape, 1.0 / np.pi), glossy], axis=-1)

    def amounts(columns: np.ndarray) -> np.ndarray:
        return np.stack([nnls(columns * w[:, None], v * w)[0] for w, v in zip(weight.T, f.T, strict=True)], axis=-1)

    def residual(x: np.ndarray) -> np.ndarray:
        columns = parts(x, wi, wo)
        return ((columns @ amounts(columns) - f) * weight).ravel()

    starts = [np.array([np.log(alpha), 0.1]) for alpha in (0.05, 0.2, 0.6)]
    best = min(starts, key=lambda x: float(np.sum(residual(x) ** 2)))
    fit = least_squares(residual, best, bounds=([np.log(0.005), 0.0], [0.0, 1.0]), x_scale=[1.0, 0.3])
    k = amounts(parts(fit.x, wi, wo))
    figures = {"alpha": np.exp(fit.x[0]), "f0": fit.x[1], "fit": np.sqrt(np.mean(fit.fun**2))}
    return lambda wi, wo: parts(fit.x, wi, wo) @ k, {name: float(x) for name, x in figures.items()}
