"""Names and wavelengths of channels: checked, and looked up."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import NAMED, ops
from ..errors import MeaningWarning, NotFoundError, ParameterError, suggestion, warn
from ..formula.text import few, shown

if TYPE_CHECKING:
    from .reflectance import Reflectance

SHORTEST = 30.0
"""Wavelengths [nm] below which all of them are taken for micrometres: soft X-rays, otherwise."""
NEAREST = 25.0
"""How far [nm] the channel that is meant by a wavelength may be from it."""


def checked(names: Any, m: Reflectance) -> tuple[str | float, ...]:
    """The names, or wavelengths [nm], as a material keeps them. Raises ParameterError where they do not fit it."""
    if isinstance(names, (str, bytes, Mapping)) or not isinstance(names, Iterable) or getattr(names, "ndim", 1) != 1:
        rule = "expected a list, of a name or a wavelength [nm] for each channel"
        raise ParameterError(f"with_channels({shown(names)}): {rule}")
    lib = ops.library_of_type(type(names))
    given = list(names) if lib is None else (np.asarray(names) if lib is NAMED else lib.to_numpy(names)).tolist()
    given = [x.item() if isinstance(x, np.generic) else x for x in given]
    call = f"with_channels({shown(given)})"
    if m.channels is None:
        rule = "it has no channel axis: f is one number; give a parameter as a list, of a number for each channel"
        raise ParameterError(f"{call}: {m!r:.60}: {rule}")
    if len(given) != m.channels:
        raise ParameterError(f"{call}: got {len(given)}, expected {m.channels}, one for each channel")
    if all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in given):
        wavelengths = tuple(map(float, given))
        if not all(math.isfinite(x) and x > 0.0 for x in wavelengths):
            raise ParameterError(f"{call}: expected wavelengths above 0 [nm], or names")
        if max(wavelengths) < SHORTEST:
            warn(f"{call}: in micrometres? wavelengths are in nanometres: multiply by 1000", MeaningWarning)
        given = list(wavelengths)
    elif not all(isinstance(x, str) and x.isprintable() and x.strip() for x in given):
        raise ParameterError(f"{call}: expected names alone (words), or wavelengths alone (numbers) [nm]")
    if len(set(given)) < len(given):
        raise ParameterError(f"{call}: expected different names")
    return tuple(given)


def places(m: Reflectance, wanted: Sequence[Any]) -> list[int]:
    """The numbers of the channels of these names, or nearest to these wavelengths [nm], counted from 0.

    Channels without names are called by their numbers. Raises NotFoundError for one that the material has not.
    """
    names, count = m.channel_names, m.channels or 1
    known = tuple(range(count)) if names is None else names
    return [_place(known, word, names is not None) for word in wanted]


def _place(known: Sequence[Any], wanted: Any, named: bool) -> int:
    if isinstance(wanted, str) == isinstance(known[0], str) and wanted in known:
        return list(known).index(wanted)
    number = isinstance(wanted, (int, float, np.number)) and not isinstance(wanted, bool)
    if number and named and not isinstance(known[0], str):
        nearest = int(np.argmin(np.abs(np.asarray(known, float) - float(wanted))))
        if abs(known[nearest] - float(wanted)) <= NEAREST:
            return nearest
    what = "channels are" if named else "channels have no names (m.with_channels), and are called by their numbers"
    listed = few(map(str, known)) if isinstance(known[0], str) else f"{known[0]:g} to {known[-1]:g}"
    hint = suggestion(wanted, [x for x in known if isinstance(x, str)]) if isinstance(wanted, str) else ""
    raise NotFoundError(f"{shown(wanted)}: no such channel{hint}; {what} {listed}{' nm' if number and named else ''}")
