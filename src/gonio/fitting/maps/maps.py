"""Fits of maps: the same model for every texel, each from its own observations, thousands of texels at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...base.reflectance import Reflectance
from ...base.sides import require_finite
from ...declared.arguments import checked
from ...declared.notebooks import repr_html
from ...errors import Error, ParameterError, ShapeError
from ...evaluate.squares import Squares, squares
from ...evaluate.tracing import Kernel
from ...formula.direction import HORIZON
from ...formula.text import listed
from ...numerics.lattice import lattice
from ..losses import LOSSES, of_starts
from ..residual import WIDTHS, costs, scores
from ..samples import real, suspected_lengths
from ..solver import Box, Solved, linear_step, minimize, solved
from ..unknowns import Unknowns, likely, unknowns
from .texel_data import TexelValues

VALUES_AT_ONCE = 1 << 19
"""Observations of a block of texels, so that its arrays stay in the caches of the processor."""

CANDIDATES = 12
"""Starts of each texel for one unknown that does not enter linearly, twice as many for two, up to 32."""

STEPS = 40
TOLERANCE = 1e-6
"""Ends of fits of texels: see `solver`. A cost that falls by less than 1e-6 moves a number by a part of its error."""

TOO_FEW, NOT_ENDED, AT_BOUND, UNDETERMINED = 1, 2, 4, 8
FLAGS = {
    TOO_FEW: "fewer values than unknowns: NaN",
    NOT_ENDED: "the solver stopped before an optimum",
    AT_BOUND: "a number is at its bound",
    UNDETERMINED: "the values do not determine all numbers",
}
"""Bit -> its meaning."""


@dataclass(frozen=True, eq=False)
class FitMap:
    """What `fit_map` found, for every texel (...).

    values    name -> (...) fitted numbers; NaN where there were too few values
    stderr    name -> (...) standard errors; 0 at a bound, inf where the values do not determine the number
    rms       (...) root mean square of the residuals of what was compared; of a likelihood in standard uncertainties
    used      (...) number of values
    flags     (...) sums of `FLAGS`: 1 too few values, 2 not ended, 4 a number at its bound, 8 not determined

    Example
    >>> wi, wo = gn.direction([0.1, 0.5, 0.9], 0.0), gn.direction([0.3, 0.2, 0.1], 1.0)
    >>> found = gn.fitting.fit_map((wi, wo, np.outer([0.1, 0.2], np.ones(3))), gn.Lambertian())
    >>> print(found.values["rho"].round(4), found.flags)
    [0.3142 0.6283] [0 0]
    """

    _repr_html_ = repr_html

    values: dict[str, np.ndarray]
    stderr: dict[str, np.ndarray]
    rms: np.ndarray
    used: np.ndarray
    flags: np.ndarray
    _unknowns: Unknowns = field(repr=False)

    @cached_property
    def model(self) -> Reflectance:
        """The model with maps: numbers (..., 1) or (..., C), missing where a texel has none.

        Example
        >>> wi, wo = gn.direction([0.1, 0.5, 0.9], 0.0), gn.direction([0.3, 0.2, 0.1], 1.0)
        >>> m = gn.fitting.fit_map((wi, wo, np.outer([0.1, 0.2], np.ones(3))), gn.Lambertian()).model
        >>> print(m.f([0, 0, 1], [0, 0, 1]).round(3).ravel())
        [0.1 0.2]
        """
        u, numbers = self._unknowns, list(self.values.values())
        maps, at = dict[str, Any](), 0
        for free, n in u.widths:
            stacked = np.stack(numbers[at : at + n], axis=-1)
            inside = np.clip(stacked, free.low, free.high)
            maps[free.path] = np.ma.masked_invalid(inside) if np.isnan(inside).any() else inside
            at += n
        fitted: Reflectance = u.model.replace(maps)
        return fitted

    def count(self) -> dict[str, int]:
        """How many texels each flag was raised for, by its meaning; those that were raised at all.

        Example
        >>> wi, wo = gn.direction([0.1, 0.5, 0.9], 0.0), gn.direction([0.3, 0.2, 0.1], 1.0)
        >>> print(gn.fitting.fit_map((wi, wo, [[0.1, 0.1, 0.1], [np.nan] * 3]), gn.Lambertian()).count())
        {'fewer values than unknowns: NaN': 1}
        """
        return counted(self.flags, FLAGS)

    def __str__(self) -> str:
        shape = " x ".join(map(str, self.rms.shape))
        lines = [f"{shape} texels of {type(self._unknowns.model).__name__}"]
        for name, x in self.values.items():
            finite = x[np.isfinite(x)]
            if finite.size:
                low, middle, high = np.quantile(finite, [0.05, 0.5, 0.95])
                lines.append(f"  {name}: {middle:.4g} in the median, 90 % from {low:.4g} to {high:.4g}")
        lines += [f"  {n} texels: {text}" for text, n in self.count().items()]
        return "\n".join(lines)


def counted(flags: np.ndarray, meanings: dict[int, str]) -> dict[str, int]:
    """How many texels each flag was raised for, by its meaning; those that were raised at all."""
    counts = {text: int(((flags & bit) > 0).sum()) for bit, text in meanings.items()}
    return {text: n for text, n in counts.items() if n}


@checked
def fit_map(
    data: Any,
    model: Reflectance,
    loss: str | None = None,
    *,
    mask: Any = None,
    by: Iterable[str] | None = None,
    per_channel: bool | Iterable[str] | None = None,
    coloured: bool | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> FitMap:
    """The numbers of a model for every texel of a map, each from its own observations.

    The loss and the treatment of parameters are those of `gn.fit`. Each texel starts from up to 32 places for the
    unknowns that do not enter linearly, with the others solved for exactly, and goes on from the best.

    `data`: (wi, wo, f) or (wi, wo, f, u), or what `gn.reconstruction.texel_data` makes. NaN in f, `mask` False, a
    masked array, and directions below the horizon are left out. u: standard uncertainties, a number or of the shape of
    f; needed by "likelihood". Standard errors of other losses follow from the scatter of each texel's values about its
    model. `coloured`: whether the last axis of f is that of channels; told by the number of observations where that is
    possible.

    Shapes   wi, wo: (N, 3) for all texels, or (..., N, 3); f: (..., N) or (..., N, C); results (...).
    Units    1/sr.
    Error    of an optimum: the next step would lower the cost by less than 1e-6 of it, which moves no number by more
             than a thousandth of its standard error times the root of the degrees of freedom. f is computed in single
             precision: 3e-6.
    Source   as `fit`.

    Example
    >>> wi = gn.direction([0.1, 0.5, 0.9, 1.2], [0.0, 1.0, 2.0, 3.0])
    >>> truth = gn.Lambertian(np.array([[0.2], [0.7]])[:, None])  # two texels
    >>> f = truth.f(wi, [0, 0, 1])[..., 0]
    >>> found = gn.fitting.fit_map((wi, gn.direction(0.4, 0.0)[None], f), gn.Lambertian())
    >>> print(found.values["rho"].round(4))
    [0.2 0.7]
    """
    values = TexelValues.of(data, coloured)
    loss = values.usual_loss if loss is None else loss
    if loss not in LOSSES:
        raise ParameterError(f"loss={loss!r:.60}: expected one of {listed([*LOSSES])}")
    require_finite(model)
    observations = _Observations.of(values, mask, loss)
    free = unknowns(model, observations.values.shape[2], by, per_channel)
    texels = len(observations.values)
    at_once = max(1, VALUES_AT_ONCE // max(observations.values[0].size, 1)) if texels else 1
    parts = []
    for start in range(0, texels, at_once):
        parts.append(_fitted(observations.part(slice(start, start + at_once)), free, loss))
        if progress is not None:
            progress(min(start + at_once, texels), texels)
    if not parts:
        raise ShapeError(f"f: got shape {np.shape(values.f)}; expected at least one texel")
    numbers, errors, rms, used, flags = (np.concatenate(x) for x in zip(*parts, strict=True))
    shape = observations.shape

    def named(x: np.ndarray) -> dict[str, np.ndarray]:
        return {name: x[:, k].reshape(shape) for k, name in enumerate(free.names)}

    return FitMap(named(numbers), named(errors), rms.reshape(shape), used.reshape(shape), flags.reshape(shape), free)


class _Observations:
    """Observations of T texels: directions (1 or T, N, 3), values and weights (T, N, C); the shape of the map."""

    def __init__(self, wi: np.ndarray, wo: np.ndarray, values: np.ndarray, weights: np.ndarray, shape: tuple[int, ...]):
        self.wi, self.wo, self.values, self.weights, self.shape = wi, wo, values, weights, shape

    @classmethod
    def of(cls, data: TexelValues, mask: Any, loss: str) -> _Observations:
        wi, wo, f = (real(name, x) for name, x in (("wi", data.wi), ("wo", data.wo), ("f", data.f)))
        for name, w in (("wi", wi), ("wo", wo)):
            if w.ndim < 2 or w.shape[-1] != 3:
                raise ShapeError(f"{name}: got shape {w.shape}; expected (N, 3) or (..., N, 3)")
            suspected_lengths(name, w)
        try:
            directions = np.broadcast_shapes(wi.shape, wo.shape)
        except ValueError:
            raise ShapeError(f"wi {wi.shape} and wo {wo.shape} do not broadcast against each other") from None
        count = directions[-2]
        coloured = _is_coloured(f.shape, count) if data.coloured is None else data.coloured
        f = f if coloured else f[..., None]
        if f.ndim < 2 or f.shape[-2] != count:
            rule = f"expected (..., {count}) or (..., {count}, C) for {count} observations"
            raise ShapeError(f"f: got shape {f.shape if coloured else f.shape[:-1]}; {rule}")
        shape = f.shape[:-2]
        try:
            if np.broadcast_shapes(directions[:-2], shape) != shape:
                raise ValueError
            wi, wo = (_for_texels(w, shape, count) for w in (wi, wo))
            weights = np.ones(f.shape) if mask is None else _mask(mask, f.shape, coloured)
            if loss == "likelihood" or data.u is not None:
                weights = weights / _spread(data.u, f.shape, coloured)
        except ValueError as error:
            if isinstance(error, Error):
                raise
            rule = f"expected directions, mask and uncertainties that broadcast with the texels {shape}"
            raise ShapeError(f"wi {wi.shape}, wo {wo.shape} beside f of {shape}: {rule}") from None
        up = ((wi[..., 2] > HORIZON) & (wo[..., 2] > HORIZON))[..., None]
        values = f.reshape(-1, *f.shape[-2:])
        weights = np.where(np.isfinite(values) & up, weights.reshape(values.shape), 0.0)
        return cls(wi, wo, np.where(weights > 0.0, values, 0.1), weights, shape)

    def part(self, texels: Any) -> _Observations:
        """Those of some texels."""
        wi, wo = (w if len(w) == 1 else w[texels] for w in (self.wi, self.wo))
        return _Observations(wi, wo, self.values[texels], self.weights[texels], ())

    def arrays(self, loss: str) -> list[np.ndarray]:
        """The inputs of the residual: directions (1 or T, 1, N, 3), what is compared and weights (T, C, N, 1)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            compared = LOSSES[loss].compared(self.values, np.maximum(self.wi[..., 2:], HORIZON))
        directions = [np.ascontiguousarray(w[:, None], np.float32) for w in (self.wi, self.wo)]
        planes = [np.ascontiguousarray(np.swapaxes(x, 1, 2), np.float32)[..., None] for x in (compared, self.weights)]
        return directions + planes


def _is_coloured(shape: tuple[int, ...], count: int) -> bool:
    """Whether the last axis of f is that of channels, where only one reading fits."""
    one, several = shape[-1:] == (count,), shape[-2:-1] == (count,)
    if one and several:
        raise ShapeError(
            f"f: got shape {shape}: the last axis may be that of observations or of channels; expected coloured=True "
            f"or coloured=False beside it"
        )
    return several


def _for_texels(w: np.ndarray, shape: tuple[int, ...], count: int) -> np.ndarray:
    """Directions (1, N, 3), or (T, N, 3)."""
    if math.prod(w.shape[:-2]) == 1:
        return np.broadcast_to(w.reshape(-1, 3), (count, 3))[None]
    return np.broadcast_to(w, (*shape, count, 3)).reshape(-1, count, 3)


def _mask(mask: Any, shape: tuple[int, ...], coloured: bool) -> np.ndarray:
    array = np.asarray(mask)
    if array.dtype != bool:
        raise ParameterError(f"mask: got {array.dtype}; expected True where a value is used, False elsewhere")
    array = array[..., None] if not coloured or array.ndim == len(shape) - 1 else array
    return np.broadcast_to(array, shape).astype(float)


def _spread(u: Any, shape: tuple[int, ...], coloured: bool) -> np.ndarray:
    if u is None:
        raise ParameterError("loss='likelihood': there is no u; expected standard uncertainties, or loss='plain'")
    array = real("u", u)
    array = array[..., None] if array.ndim and not coloured else array
    if not (array > 0.0).all():
        raise ParameterError("u: expected standard uncertainties above 0; leave values out by NaN in f")
    return np.broadcast_to(array, shape)


def _fitted(
    data: _Observations, free: Unknowns, loss: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Numbers and standard errors (T, n), rms, used values and flags (T,)."""
    inputs = data.arrays(loss)

    def summed(kernel: Kernel, x: np.ndarray, part: np.ndarray | None = None) -> Squares:
        several = inputs if part is None else [a if len(a) == 1 else a[part] for a in inputs]
        return free.gathered(squares(kernel, free.models(x), free.places, several, WIDTHS), x)

    def evaluate(x: np.ndarray, part: np.ndarray | None) -> Squares:
        return summed(costs(loss, "none"), x, part)

    box = Box(free.low, free.high, free.is_log, free.is_linear)
    first = of_starts(loss)
    at_start = inputs if first == loss else data.arrays(first)

    def evaluate_start(x: np.ndarray) -> Squares:
        return free.gathered(squares(costs(first, "none"), free.models(x), free.places, at_start, WIDTHS), x)

    minimum = minimize(evaluate, _starts(evaluate_start, free, box, len(data.values)), box, STEPS, TOLERANCE)
    slopes = None if loss == "likelihood" else summed(scores(loss, "none"), minimum.x).matrix
    return _summary(minimum, free, box, (data.weights > 0.0).sum(axis=(1, 2)), slopes)


def _starts(evaluate: Any, free: Unknowns, box: Box, texels: int) -> np.ndarray:
    """The best of a few starts of each texel, with the linear unknowns at their optimum."""
    curved = np.flatnonzero(~free.is_linear)
    x = np.tile(free.start, (texels, 1))
    x[:, free.is_linear] = np.clip(0.0, free.low, free.high)[free.is_linear]  # nothing cancels in the cost then
    candidates = x[:1, curved]
    if len(curved):
        bounds = np.array([likely(part) for part, n in free.widths for _ in range(n)])
        low, high = (np.where(free.is_log, np.log(np.where(free.is_log, b, 1.0)), b)[curved] for b in bounds.T)
        count = min(CANDIDATES << (len(curved) - 1), 32)
        alone = (np.arange(count)[:, None] + 0.5) / count
        spread = alone if len(curved) == 1 else lattice(count, len(curved))
        candidates = np.concatenate([candidates, low + spread * (high - low)])
    best, least = x.copy(), np.full(texels, np.inf)
    for candidate in candidates:
        x[:, curved] = candidate
        sums = evaluate(x)
        linear, d = linear_step(sums, x, box)
        cost = sums.cost + (
            2.0 * (sums.gradient[:, linear] * d).sum(axis=1)
            + np.einsum("bi,bij,bj->b", d, sums.matrix[:, linear[:, None], linear], d)
        )
        better = cost < least
        least = np.where(better, cost, least)
        moved = x.copy()
        moved[:, linear] += d
        best = np.where(better[:, None], moved, best)
    return best


def _summary(
    found: Solved, free: Unknowns, box: Box, used: np.ndarray, slopes: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """See `_fitted`; `slopes` (T, n, n): products of the slopes of the costs, or None for those of a likelihood."""
    x, (cost, gradient, matrix), count = found.x, found.squares, found.x.shape[1]
    bound = ((x <= box.low) & (gradient >= 0.0)) | ((x >= box.high) & (gradient <= 0.0))
    diagonal = np.einsum("bii->bi", matrix)
    lost = ~bound & ~(diagonal > 0.0)
    inverse = np.empty_like(matrix)
    for k in range(count):
        unit = np.zeros_like(x)
        unit[:, k] = 1.0
        inverse[:, k] = solved(matrix, unit, bound | lost, np.zeros(len(x)))
    variance = np.einsum("bii->bi", inverse)
    lost |= ~bound & (variance * diagonal > UNSURE)
    if slopes is not None:
        variance = np.einsum("bij,bjk,bki->bi", inverse, slopes, inverse, optimize=True)
        variance = variance * (used / np.maximum(used - count, 1))[:, None]
    errors = np.sqrt(np.maximum(variance, 0.0)) * free.slopes(x)
    few = used < count
    numbers = np.where(few[:, None], np.nan, free.numbers(x))
    errors = np.where(few[:, None], np.nan, np.where(bound, 0.0, np.where(lost, np.inf, errors)))
    rms = np.where(few, np.nan, np.sqrt(cost / np.maximum(used, 1)))
    flags = TOO_FEW * few + NOT_ENDED * (~found.ended & ~few)
    flags = flags + AT_BOUND * (bound.any(axis=1) & ~few) + UNDETERMINED * (lost.any(axis=1) & ~few)
    return numbers, errors, rms, used, flags.astype(np.uint8)


UNSURE = 1e10
"""Ratio of a number's variance to what it would be with the others known, from which it is not determined: what single
precision leaves of the smallest eigenvalue."""
