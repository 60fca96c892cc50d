"""Names and wavelengths of channels: checked, and looked up."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..arrays import NAMED, frozen, ops
from ..declared.numbers import NANOMETRES
from ..errors import MeaningWarning, NotFoundError, ParameterError, suggestion, warn
from ..formula.fields import Param, Wavelengths
from ..formula.spectrum import Spectrum, as_wavelengths
from ..formula.text import few, shown

if TYPE_CHECKING:
    from ._channels import Channelled

R = TypeVar("R", bound="Channelled")

NEAREST = 25.0
"""How far [nm] the channel that is meant by a wavelength may be from it."""


def checked(names: Any, m: Channelled, call: str = "") -> tuple[str | float, ...]:
    """The names, or wavelengths [nm], as a material keeps them. Raises ParameterError where they do not fit it."""
    if isinstance(names, (str, bytes, Mapping)) or not isinstance(names, Iterable) or getattr(names, "ndim", 1) != 1:
        rule = "expected a list, of a name or a wavelength [nm] for each channel"
        raise ParameterError(f"with_channels({shown(names)}): {rule}")
    lib = ops.library_of_type(type(names))
    given = list(names) if lib is None else (np.asarray(names) if lib is NAMED else lib.to_numpy(names)).tolist()
    given = [x.item() if isinstance(x, np.generic) else x for x in given]
    call = call or f"with_channels({shown(given)})"
    if m.channels is None:
        rule = "it has no channel axis: f is one number; give a parameter as a list, of a number for each channel"
        raise ParameterError(f"{call}: {m!r:.60}: {rule}")
    if len(given) != m.channels:
        raise ParameterError(f"{call}: got {len(given)}, expected {m.channels}, one for each channel")
    if all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in given):
        wavelengths = tuple(map(float, given))
        if not all(math.isfinite(x) and x > 0.0 for x in wavelengths):
            raise ParameterError(f"{call}: expected wavelengths above 0 [nm], or names")
        if max(wavelengths) < NANOMETRES:
            warn(f"{call}: in micrometres? wavelengths are in nanometres: multiply by 1000", MeaningWarning)
        given = list(wavelengths)
    elif not all(isinstance(x, str) and x.isprintable() and x.strip() for x in given):
        raise ParameterError(f"{call}: expected names alone (words), or wavelengths alone (numbers) [nm]")
    if len(set(given)) < len(given):
        raise ParameterError(f"{call}: expected different names")
    return tuple(given)


def in_nanometres(names: tuple[Any, ...] | None) -> np.ndarray | None:
    """The wavelengths [nm] among names of channels, (C,); None for names in words, or none."""
    if names is None or isinstance(names[0], str):
        return None
    wavelengths: np.ndarray = frozen(np.array(names, dtype=float))
    return wavelengths


def differ(value: Any) -> bool:
    """Whether a number has several channels that are not the same; of other libraries' arrays, whether it may have."""
    if getattr(value, "ndim", 0) == 0 or value.shape[-1] == 1:
        return False
    return not isinstance(value, np.ndarray) or bool((value != value[..., :1]).any())


def known_to_formula(m: Channelled) -> tuple[float, ...] | None:
    """The wavelengths of channels that formulas of a material know, by a field `wavelength = wavelengths()`."""
    found = [x for _, field, x, _ in m.walk() if isinstance(field, Wavelengths) and np.ndim(x)]
    return tuple(map(float, found[0])) if found else None


def _told(m: R, wavelengths: Any, which: Callable[[Wavelengths], bool] = lambda field: True) -> R:
    """The material, whose formulas know these wavelengths where they ask for any."""
    paths = [path for path, field, _, _ in m.walk() if isinstance(field, Wavelengths) and which(field)]
    return m._with_paths([(path, path, wavelengths) for path in paths]) if paths else m


def named(m: R, names: Any) -> R:
    """The material with these names of channels, or wavelengths."""
    found = checked(names, m)
    asking = [field for _, field, _, _ in m.walk() if isinstance(field, Wavelengths)]
    if isinstance(found[0], str) or not asking:
        return m.with_notes(channel_names=found)
    wavelengths = as_wavelengths(f"with_channels({shown(names)})", found)
    if known_to_formula(m) is not None:
        return _told(m, wavelengths)
    # Formulas whose f does without the wavelength have a default, which is that of no channel.
    return _told(m, wavelengths, lambda field: field.default is not None).with_notes(channel_names=found)


def with_wavelengths(m: R, value: Any) -> R:
    """The material whose constructor was given `wavelengths`."""
    call = f"{type(m).__name__}(wavelengths={shown(value)})"
    wavelengths = as_wavelengths(call, value)
    if any(isinstance(x, Spectrum) for x in m.leaves()):
        return m.at(wavelengths)
    new = _told(m, wavelengths)
    if np.ndim(wavelengths) == 0:
        if new.channels is not None:
            raise ParameterError(f"{call}: expected {new.channels} wavelengths, one for each channel")
        return new
    found = checked(wavelengths, new, call)
    return new if known_to_formula(new) else declared(new, np.array(found))


def declared(m: R, wavelengths: Any) -> R:
    """The material with these wavelengths for names of its channels; without names for one wavelength."""
    return m.with_notes(channel_names=tuple(map(float, wavelengths)) if np.ndim(wavelengths) else None)


def with_axis(m: R, wavelengths: Any) -> R:
    """A material at wavelengths, with a channel for each, also where it has the same numbers at all of them."""
    if np.ndim(wavelengths) == 0:
        return m
    count = len(wavelengths)
    if m.channels in (None, 1) and (m.channels or 0) != count:
        for path, field, value, _ in m.walk():
            if isinstance(field, Param) and path in m.parameters and isinstance(value, (float, np.ndarray)):
                wide = np.asarray(value)[..., None] if np.ndim(value) == 0 else np.asarray(value)
                m = m._with_paths([(path, path, np.repeat(wide, count, axis=-1))])
                break
    return m if m.channels is None or m.channel_names is not None else declared(m, wavelengths)


def places(m: Channelled, wanted: Sequence[Any]) -> list[int]:
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
