"""Channels of a reflectance: how many there are, and their names and wavelengths, declared, checked and looked up."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from ..arrays import NAMED, frozen, ops
from ..arrays.labels import Labels
from ..declared.numbers import NANOMETRES
from ..errors import MeaningWarning, NotFoundError, ParameterError, suggestion, warn
from ..evaluate import batch
from ..formula import tree
from ..formula.fields import Param, Wavelengths
from ..formula.parametrised import Parametrised
from ..formula.spectrum import Spectrum, as_wavelengths
from ..formula.text import few, shown
from . import textured

R = TypeVar("R", bound=Parametrised)

NEAREST = 25.0
"""How far [nm] the channel that is meant by a wavelength may be from it."""


# What everyone calls.


def channels(m: Any) -> int | None:
    """The number of channels of f, which the parameters decide; None where f has no channel axis.

    Example
    >>> print(gn.Lambertian(0.5).channels, gn.Lambertian([0.6, 0.1, 0.05]).channels)
    None 3
    """
    return batch.channels(m)


def wavelengths(m: Any) -> np.ndarray | None:
    """The wavelengths [nm] of the channels, (C,); None for channels in RGB, with names in words, or none.

    They are declared by the constructor (`wavelengths=`), by `at`, or by `with_channels`; equality, `repr`, JSON
    and pickles have them.

    Example
    >>> field = gn.Lambertian([0.05, 0.3], wavelengths=[645.0, 858.5])
    >>> print(field.wavelengths, gn.Lambertian([0.6, 0.1, 0.05]).wavelengths)
    [645.  858.5] None
    >>> field == gn.Lambertian([0.05, 0.3], wavelengths=[650.0, 858.5])
    False
    """
    return in_nanometres(m.channel_names)


def with_channels(m: R, names: Iterable[str | float] | None) -> R:
    """A copy whose channels have these names, or wavelengths; `None` takes them away.

    Sums, products, coats and `replace` keep them, as long as the number of channels stays the same; JSON files too.
    Numbers that look like micrometres are announced by a MeaningWarning.

    Shapes   names: one for each channel.
    Units    wavelengths: nm.

    Example
    >>> field = gn.RossLi(f_iso=[0.05, 0.3], f_vol=[0.02, 0.16], f_geo=[0.01, 0.03]).with_channels(["red", "nir"])
    >>> (field + gn.Lambertian(0.01)).channel_names
    ('red', 'nir')
    """
    renamed: R = named(m, names)
    return renamed


def at(m: R, wavelengths: Any = None, uv: Any = None) -> R:
    """A copy with the numbers at wavelengths [nm], which are its channels from then on: see `Parametrised.at`.

    `uv`: or at places (..., 2) on the surface, where parameters are textures: each is then an array (..., C).

    Example
    >>> paint = gn.Lambertian(gn.Spectrum([400.0, 700.0], [0.2, 0.8])).at([450.0, 650.0])
    >>> print(paint.wavelengths, gn.albedo(paint, [0, 0, 1]).round(3))
    [450. 650.] [0.3 0.7]
    >>> print(gn.Lambertian(gn.Texture([[0.2, 0.8]])).at(uv=[0.5, 0.5]))
    Lambertian(rho=[0.5])
    """
    if uv is not None:
        placed: R = textured.at(m, uv)
        return placed if wavelengths is None else at(placed, wavelengths)
    there: R = with_axis(Parametrised.at(m, wavelengths), wavelengths)
    return there


# Methods of any value that take the names of a reflectance's channels into account.


def of_constructor(m: Any, **arguments: Any) -> Any:
    """See `Parametrised._declared`."""
    return with_wavelengths(m, arguments["wavelengths"])


def interpolated(m: Any, wavelengths: Any, known: np.ndarray | None) -> Any:
    """See `Parametrised._at`."""
    nm = m.wavelengths
    new = Parametrised._at(m, wavelengths, known if nm is None else nm)
    return new if declared_wavelengths(m) is None else declared(new, wavelengths)


def key(m: Any) -> tuple[Any, ...]:
    """See `Value._key`."""
    return (*Parametrised._key(m), ("wavelengths", declared_wavelengths(m)))


def written(m: Any) -> dict[str, Any]:
    """See `Value._written`."""
    nm = declared_wavelengths(m)
    return Parametrised._written(m) | ({} if nm is None else {"wavelengths": nm})


def to_json(m: Any) -> dict[str, Any]:
    return Parametrised.to_json(m) | names_in_json(m)


def take_names(m: Any, whole: Labels) -> None:
    """See `Parametrised._name_channels`."""
    names = whole.channel_names
    if names is not None and m.channel_names is None and m.channels == len(names):
        m._hold(channel_names=checked(names, m))


def replaced(m: Any, grouped: dict[str, Any]) -> Any:
    """See `Parametrised._replaced`."""
    new = Parametrised._replaced(m, grouped)
    names = m._given("channel_names")
    if names is not None and m.channels == len(names) != new.channels:
        return tree.with_notes(new, channel_names=None)
    return new


def declared_wavelengths(m: Any) -> np.ndarray | None:
    """The wavelengths that a material was given itself, beside those of its parts and of its formula."""
    return in_nanometres(m._given("channel_names"))


def names_in_json(m: Any) -> dict[str, Any]:
    """The names of channels, or wavelengths, as JSON data."""
    names, nm = m._given("channel_names"), declared_wavelengths(m)
    if nm is not None:
        return {"wavelengths": nm.tolist()}
    return {} if names is None else {"channel_names": list(names)}


# Names and wavelengths, checked and looked up.


def checked(names: Any, m: Any, call: str = "") -> tuple[str | float, ...]:
    """The names, or wavelengths [nm], as a material keeps them. Raises ParameterError where they do not fit it."""
    if isinstance(names, (str, bytes, Mapping)) or not isinstance(names, Iterable) or getattr(names, "ndim", 1) != 1:
        rule = "expected a list, of a name or a wavelength [nm] for each channel"
        raise ParameterError(f"with_channels({shown(names)}): {rule}")
    lib = ops.library_of_type(type(names))
    kept = list(names) if lib is None else (np.asarray(names) if lib is NAMED else lib.to_numpy(names)).tolist()
    kept = [x.item() if isinstance(x, np.generic) else x for x in kept]
    call = call or f"with_channels({shown(kept)})"
    if m.channels is None:
        rule = "it has no channel axis: f is one number; give a parameter as a list, of a number for each channel"
        raise ParameterError(f"{call}: {m!r:.60}: {rule}")
    if len(kept) != m.channels:
        raise ParameterError(f"{call}: got {len(kept)}, expected {m.channels}, one for each channel")
    if all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in kept):
        wavelengths = tuple(map(float, kept))
        if not all(math.isfinite(x) and x > 0.0 for x in wavelengths):
            raise ParameterError(f"{call}: expected wavelengths above 0 [nm], or names")
        if max(wavelengths) < NANOMETRES:
            warn(f"{call}: in micrometres? wavelengths are in nanometres: multiply by 1000", MeaningWarning)
        kept = list(wavelengths)
    elif not all(isinstance(x, str) and x.isprintable() and x.strip() for x in kept):
        raise ParameterError(f"{call}: expected names alone (words), or wavelengths alone (numbers) [nm]")
    if len(set(kept)) < len(kept):
        raise ParameterError(f"{call}: expected different names")
    return tuple(kept)


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


def known_to_formula(m: Any) -> tuple[Any, ...] | None:
    """Names of the channels, or wavelengths [nm]; None: as the parameters imply (three: linear sRGB).

    Where none were given, the wavelengths that formulas know, by a field `wavelength = wavelengths()`.
    """
    asked_for = [x for _, field, x, _ in tree.walk(m) if isinstance(field, Wavelengths) and np.ndim(x)]
    return tuple(map(float, asked_for[0])) if asked_for else None


def _told(m: Any, wavelengths: Any, which: Callable[[Wavelengths], bool] = lambda field: True) -> Any:
    """The material, whose formulas know these wavelengths where they ask for any."""
    paths = [path for path, field, _, _ in tree.walk(m) if isinstance(field, Wavelengths) and which(field)]
    return m._with_paths([(path, path, wavelengths) for path in paths]) if paths else m


def named(m: Any, names: Any) -> Any:
    """The material with these names of channels, or wavelengths; without any for None."""
    if names is None:
        return tree.with_notes(m, channel_names=None)
    renamed = checked(names, m)
    asking = [field for _, field, _, _ in tree.walk(m) if isinstance(field, Wavelengths)]
    if isinstance(renamed[0], str) or not asking:
        return tree.with_notes(m, channel_names=renamed)
    wavelengths = as_wavelengths(f"with_channels({shown(names)})", renamed)
    if known_to_formula(m) is not None:
        return _told(m, wavelengths)
    # Formulas whose f does without the wavelength have a default, which is that of no channel.
    return tree.with_notes(_told(m, wavelengths, lambda field: field.default is not None), channel_names=renamed)


def with_wavelengths(m: Any, value: Any) -> Any:
    """The material whose constructor was given `wavelengths`."""
    call = f"{type(m).__name__}(wavelengths={shown(value)})"
    wavelengths = as_wavelengths(call, value)
    if any(isinstance(x, Spectrum) for x in tree.leaves(m)):
        return m.at(wavelengths)
    new = _told(m, wavelengths)
    if np.ndim(wavelengths) == 0:
        if new.channels is not None:
            raise ParameterError(f"{call}: expected {new.channels} wavelengths, one for each channel")
        return new
    nm = checked(wavelengths, new, call)
    return new if known_to_formula(new) else declared(new, np.array(nm))


def declared(m: Any, wavelengths: Any) -> Any:
    """The material with these wavelengths for names of its channels; without names for one wavelength."""
    return tree.with_notes(m, channel_names=tuple(map(float, wavelengths)) if np.ndim(wavelengths) else None)


def with_axis(m: Any, wavelengths: Any) -> Any:
    """A material at wavelengths, with a channel for each, also where it has the same numbers at all of them."""
    if np.ndim(wavelengths) == 0:
        return m
    count = len(wavelengths)
    if m.channels in (None, 1) and (m.channels or 0) != count:
        for path, field, value, _ in tree.walk(m):
            if isinstance(field, Param) and path in m.parameters and isinstance(value, (float, np.ndarray)):
                wide = np.asarray(value)[..., None] if np.ndim(value) == 0 else np.asarray(value)
                m = m._with_paths([(path, path, np.repeat(wide, count, axis=-1))])
                break
    return m if m.channels is None or m.channel_names is not None else declared(m, wavelengths)


def places(m: Any, wanted: Sequence[Any]) -> list[int]:
    """The numbers of the channels of these names, or nearest to these wavelengths [nm], counted from 0.

    Channels without names are called by their numbers. Raises NotFoundError for one that the material has not.
    """
    names, count = m.channel_names, m.channels or 1
    called = tuple(range(count)) if names is None else names
    return [_place(called, word, names is not None) for word in wanted]


def _place(known: Sequence[Any], wanted: Any, named: bool) -> int:
    if isinstance(wanted, str) == isinstance(known[0], str) and wanted in known:
        return list(known).index(wanted)
    number = isinstance(wanted, (int, float, np.number)) and not isinstance(wanted, bool)
    if number and named and not isinstance(known[0], str):
        nearest = int(np.argmin(np.abs(np.asarray(known, float) - float(wanted))))
        if abs(known[nearest] - float(wanted)) <= NEAREST:
            return nearest
    what = "expected one of the channels" if named else "channels have no names; expected one of their numbers,"
    listed = few(map(str, known)) if isinstance(known[0], str) else f"{known[0]:g} to {known[-1]:g}"
    hint = suggestion(wanted, [x for x in known if isinstance(x, str)]) if isinstance(wanted, str) else ""
    raise NotFoundError(f"{shown(wanted)}: no such channel{hint}; {what} {listed}{' nm' if number and named else ''}")


def channel(m: Any, c: int) -> str:
    """Name of a channel: its wavelength, its word or its number."""
    names = m.channel_names
    if names is None:
        return str(c)
    return str(names[c]) if isinstance(names[c], str) else f"{names[c]:g} nm"
