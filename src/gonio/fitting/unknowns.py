"""The unknowns of a fit: which numbers of a model are free, in which channels, within which bounds, on which scale."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..base import kernels
from ..base.reflectance import Reflectance
from ..errors import Error, NotFoundError, ParameterError, shown
from ..evaluate.squares import Squares
from ..evaluate.tracing import content, linear
from ..formula import tree
from ..formula.fields import Channels, Param
from ..formula.text import listed
from ..machine.caches import Cache

UNBOUNDED = 1e6
"""Bounds beyond this say nothing about the likely size of a number."""


class Free(NamedTuple):
    """A free parameter: its path, its place among the numbers of the model, its bounds, and how it is treated."""

    path: str
    place: int
    low: float
    high: float
    is_linear: bool
    by_channel: bool
    start: np.ndarray  # (C,) the numbers of the model

    @property
    def is_log(self) -> bool:
        """Whether the unknown is the logarithm: of positive numbers of which only the size is known."""
        return self.low > 0.0 and not self.is_linear


@dataclass(frozen=True)
class Unknowns:
    """The free parameters of a model, for data of `channels` channels.

    An unknown is a free parameter, or one of a channel; there are n of them. Arrays of them have the shape (B, n), for
    B fits at once, and hold the parameter itself, or its logarithm.
    """

    model: Reflectance
    free: tuple[Free, ...]
    channels: int
    kept: tuple[str, ...] = ()
    """Parameters that fits keep unless they are asked for."""

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The path of each unknown, with the number of its channel where there is one for each: "0.rho[2]"."""
        return tuple(f"{f.path}[{c}]" if n > 1 else f.path for f, n in self.widths for c in range(n))

    @cached_property
    def widths(self) -> list[tuple[Free, int]]:
        """The free parameters, each with the number of its unknowns."""
        return [(f, self.channels if f.by_channel else 1) for f in self.free]

    @cached_property
    def columns(self) -> np.ndarray:
        """(C, P) the number of the unknown that each channel has for each free parameter."""
        ends = np.cumsum([n for _, n in self.widths])
        starts = ends - [n for _, n in self.widths]
        at = [s + (np.arange(self.channels) if f.by_channel else 0) for s, f in zip(starts, self.free, strict=True)]
        return np.stack(np.broadcast_arrays(*at, np.arange(self.channels))[:-1], axis=1)

    def _each(self, values: Iterable[Any]) -> np.ndarray:
        """A number of every free parameter, for every unknown."""
        return np.concatenate([np.full(n, x) for x, (_, n) in zip(values, self.widths, strict=True)])

    @cached_property
    def is_log(self) -> np.ndarray:
        return self._each(f.is_log for f in self.free).astype(bool)

    @cached_property
    def is_linear(self) -> np.ndarray:
        return self._each(f.is_linear for f in self.free).astype(bool)

    @cached_property
    def low(self) -> np.ndarray:
        return self.internal(self._each(f.low for f in self.free))

    @cached_property
    def high(self) -> np.ndarray:
        return self.internal(self._each(f.high for f in self.free))

    @cached_property
    def start(self) -> np.ndarray:
        """(n,) the numbers of the model."""
        return self.internal(np.concatenate([f.start if n > 1 else f.start[:1] for f, n in self.widths]))

    def internal(self, values: np.ndarray) -> np.ndarray:
        """Unknowns for numbers (..., n) of parameters."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.is_log, np.log(values), values)

    def numbers(self, x: np.ndarray) -> np.ndarray:
        """Numbers of parameters (..., n) for unknowns."""
        return np.where(self.is_log, np.exp(np.where(self.is_log, x, 0.0)), x)

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """The derivative of each number by its unknown."""
        return np.where(self.is_log, self.numbers(x), 1.0)

    @property
    def places(self) -> tuple[int, ...]:
        """Where the free parameters are among the numbers of the model."""
        return tuple(f.place for f in self.free)

    def models(self, x: np.ndarray, axes: int = 2) -> Reflectance:
        """The models of unknowns (B, n), without a channel axis: numbers (B, C, ...), or (B, 1, ...), with so many axes
        of length 1 at the end."""
        numbers = self.numbers(x)
        values, at = dict[str, Any](), 0
        for f, n in self.widths:
            values[f.path] = numbers[:, at : at + n].reshape(len(x), n, *(1,) * axes)
            at += n
        return tree.with_values(self.plain(axes), values)

    def plain(self, axes: int = 2) -> Reflectance:
        """The model with its channel axis before those of the data."""
        return self._plain_models[axes]

    @cached_property
    def _plain_models(self) -> dict[int, Reflectance]:
        return {axes: _with_channels_first(self.model, axes) for axes in (2, 3)}

    def of_channel(self, c: int) -> Unknowns:
        """The unknowns of one channel."""

        def picked(path: str, field: Any, value: Any) -> Any:
            return float(value[c if len(value) > 1 else 0]) if np.ndim(value) else value

        free = tuple(f._replace(by_channel=False, start=f.start[c : c + 1]) for f in self.free)
        return Unknowns(tree.rebuilt(self.model, picked), free, 1, self.kept)

    def gathered(self, sums: Squares, x: np.ndarray) -> Squares:
        """Normal equations (B,) of the unknowns x (B, n), from those (B, C) of each channel's numbers."""
        fits, count = x.shape
        slopes = self.slopes(x)
        if self.channels == 1:
            at = self.columns[0]
            scale = slopes[:, at]
            matrix = sums.matrix[:, 0] * scale[:, :, None] * scale[:, None, :]
            return Squares(sums.cost[:, 0], sums.gradient[:, 0] * scale, matrix)
        gradient, matrix = np.zeros((fits, count)), np.zeros((fits, count, count))
        for c, at in enumerate(self.columns):
            scale = slopes[:, at]
            gradient[:, at] += sums.gradient[:, c] * scale
            matrix[:, at[:, None], at] += sums.matrix[:, c] * scale[:, :, None] * scale[:, None, :]
        return Squares(sums.cost.sum(axis=1), gradient, matrix)

    def fitted(self, numbers: np.ndarray) -> Reflectance:
        """The model with numbers (n,) of parameters."""
        values, at = dict[str, Any](), 0
        for f, n in self.widths:
            inside = np.clip(numbers[at : at + n], f.low, f.high)
            values[f.path] = inside if n > 1 or self._is_array(f) else float(inside[0])
            at += n
        fitted: Reflectance = self.model.replace(values)
        return fitted

    def _is_array(self, f: Free) -> bool:
        return f.by_channel and self.channels == 1 and np.ndim(self.model.parameters[f.path].value) > 0


def unknowns(
    model: Reflectance,
    channels: int,
    by: Iterable[str] | None = None,
    per_channel: bool | Iterable[str] | None = None,
) -> Unknowns:
    """The unknowns of a fit of `model` to data of so many channels.

    `by`: the names of the free parameters; without it all but those that are declared as kept. `per_channel`: the names
    of those that have a number for each channel, or True for all, or False. Without it they are those in which f is
    linear (albedos, weights), and those that the model has an array of.
    """
    parameters, paths = model.parameters, list(tree.leaf_paths(model))
    if not parameters:
        raise ParameterError(f"{model!r:.80}: it has no parameters; expected a model such as gn.Lambertian()")
    _refuse_tables(model)
    usual = (path for path, f, *_ in tree.numbers(model) if isinstance(f, Param) and not f.fitted)
    kept = tuple(usual) if by is None else ()
    chosen = [path for path in parameters if path not in kept] if by is None else _paths(model, by, "by")
    if not chosen:
        raise ParameterError("by: got no names; expected at least one parameter to be fitted")
    for path in chosen:
        value = parameters[path].value
        if not isinstance(value, (float, np.ndarray)):
            kind = type(value).__name__
            raise ParameterError(f"{path} is a {kind}; expected a number to be fitted, or `by` without this one")
        if np.ndim(value) > 1 or np.size(value) not in (1, channels):
            rule = f"expected one number, or {channels}, one for each channel of the data"
            raise ParameterError(f"{path}: the model has numbers of shape {np.shape(value)}; {rule}")
    plain = _with_channels_first(model, 2)
    every = [paths.index(path) for path in chosen]
    lines = _linear(plain, every, paths)
    if isinstance(per_channel, bool):
        several = set(chosen) if per_channel else set[str]()
    elif per_channel is None:
        several = {path for path in chosen if path in lines or np.size(parameters[path].value) > 1}
    else:
        several = set(_paths(model, per_channel, "per_channel"))
    made = []
    for path, place in zip(chosen, every, strict=True):
        p = parameters[path]
        start = np.broadcast_to(np.asarray(p.value, float).reshape(-1), channels).copy()
        by_channel = channels > 1 and path in several
        made.append(Free(path, place, p.low, p.high, path in lines, by_channel, start))
    return Unknowns(model, tuple(made), channels, kept)


def _linear(model: Reflectance, places: list[int], paths: list[str]) -> set[str]:
    """The paths of those parameters at these places in which f is linear."""
    known = _LINEAR.find(key := (content(model).structure, tuple(places)))
    if known is None:
        known = tuple(linear(kernels.value, (3, 3), model, places))
        _LINEAR.keep(key, known)
    return {paths[k] for k in known}


_LINEAR: Cache[Any, tuple[int, ...]] = Cache(lambda places: 0)
"""To find those of a structure, f is differentiated."""


def _with_channels_first(model: Reflectance, axes: int) -> Reflectance:
    """The model, unchecked, its arrays of channels (C,) as (1, C, 1, ...), with so many axes at the end."""

    def moved(path: str, field: Any, value: Any) -> Any:
        return np.reshape(value, (1, -1, *(1,) * axes)) if np.ndim(value) else value

    changed: Reflectance = tree.rebuilt(model, moved)
    return changed


def _refuse_tables(model: Reflectance) -> None:
    for _, field, value, _ in tree.numbers(model):
        if isinstance(field, Channels) and np.ndim(value):
            raise ParameterError(
                f"{model!r:.80}: a measurement with channels is a part of it; expected a model whose numbers are all "
                f"parameters, or a measurement of one channel"
            )


def _paths(model: Reflectance, names: Any, argument: str) -> list[str]:
    """The paths of parameters that names stand for, in the order of the model."""
    try:
        several = [names] if isinstance(names, str) else list(names)
    except TypeError:
        raise ParameterError(f"{argument}={shown(names)}: expected names of parameters") from None
    parameters, found = model.parameters, set()
    aliases = {
        path.removesuffix(f.name) + f.alias: path
        for path, f, _, _ in tree.numbers(model)
        if isinstance(f, Param) and f.alias
    }
    for name in several:
        expected = f"{argument}={shown(name)}: expected some of {listed([*parameters])}"
        try:
            path = tree.located(model, name) if isinstance(name, str) else name
        except Error as error:
            raise type(error)(f"{expected}: {str(error).partition(' Known:')[0]}") from None
        path = aliases.get(path, path)
        if path not in parameters:
            raise NotFoundError(f"{expected}: no parameter that can be fitted")
        found.add(path)
    return [path for path in parameters if path in found]


def likely(f: Free) -> tuple[float, float]:
    """Bounds between which starts are drawn: those of the parameter, where they say anything."""
    size = max(abs(float(np.mean(f.start))), 1e-3)
    low = f.low if f.low > -UNBOUNDED else -10.0 * size
    high = f.high if f.high < UNBOUNDED else 10.0 * size
    if f.is_log and f.high >= UNBOUNDED:
        high = min(f.high, 1e4 * size)
    return low, max(high, low)
