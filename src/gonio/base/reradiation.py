"""Light that leaves at another wavelength than it arrived at: matrices of a material's channels, pair by pair.

Every pair of wavelengths is a channel to the engine: the material stands there twice, once with the numbers of the
wavelength that leaves and once with those of the one that arrives.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.kinds import PAIRS
from ..errors import FluorescenceWarning, ParameterError, warn
from ..evaluate import batch, labelled
from ..formula import bands, tree
from ..formula.direction import NORMAL
from ..formula.exchange import Exchange
from ..formula.fields import CLASSES, Field, Wavelengths, part
from ..formula.parametrised import Parametrised
from ..formula.spectrum import Spectrum
from ..formula.text import shown
from . import kernels


class _Pairs(Parametrised):
    """A material at the wavelengths that leave, and again at those that arrive, C of each for every one of the
    other."""

    leaves_at = part(Parametrised, None, "with the numbers of the wavelength that leaves")
    arrives_at = part(Parametrised, None, "with the numbers of the wavelength that arrives")


def exchanges(m: Any) -> bool:
    """Whether light is exchanged between the channels of a material: it fluoresces, and has several.

    Example
    >>> from gonio.base.reradiation import exchanges
    >>> dye = gn.FluorescentLambertian(gn.Spectrum([400.0, 700.0], [0.2, 0.8]))
    >>> print(exchanges(dye.at([450.0, 650.0])), exchanges(dye.at(550.0)))
    True False
    """
    return bool(m.fluoresces) and (m.channels or 1) > 1


def has_stand_in(m: Any) -> bool:
    """Whether light is exchanged, and an ordinary material may stand in under some light: `under` needs wavelengths,
    and one side."""
    return exchanges(m) and m.wavelengths is not None and m.sides == "front"


def pairs(m: Any, channels: int) -> _Pairs:
    """Both copies of a material, with a channel o C + i for each pair of channels."""
    m = m._with_rounds(lambda _, coat: coat.to_and_fro(channels))
    o, i = np.divmod(np.arange(channels * channels), channels)

    def at(own: np.ndarray) -> Any:
        def chosen(path: str, field: Field, value: Any) -> Any:
            if isinstance(field, Exchange):
                return _flat(field.between(matrices[path]))
            return value[..., own] if np.ndim(value) and np.shape(value)[-1] > 1 else value

        return tree.rebuilt(m, chosen)

    matrices = {
        path: owner.__dict__[field.name] for path, field, _, owner in tree.walk(m) if isinstance(field, Exchange)
    }
    return tree.unchecked(_Pairs, leaves_at=at(o), arrives_at=at(i))


def along_normal(m: Any, channels: int) -> Any:
    """Re-radiation along the normal [1/sr], (...) or (..., C C), in arrays of the material's own library."""
    both = pairs(m, channels)
    return both.leaves_at.reradiated(both.arrives_at, NORMAL, NORMAL)


def _flat(between: Any) -> Any:
    return between if np.ndim(between) == 0 else between.reshape(*between.shape[:-2], -1)


def matrix(m: Any, wi: Any, wo: Any) -> Any:
    """See `Reflectance.reradiation`."""
    channels = m.channels
    if channels is None:
        raise ParameterError(
            f"reradiation of {m!r:.60}: it has no channel axis, and light is exchanged between wavelengths; expected "
            f"channels at wavelengths: m.at([400.0, 500.0, 600.0])"
        )
    require_wavelengths(m)
    if labelled.concern(m, (wi, wo)):
        return labelled.call(lambda plain, *w: [matrix(plain, *w)], (PAIRS,), m, (wi, wo), (3, 3))[0]
    f = m.f(wi, wo)
    lib = ops.library(f)
    if not m.fluoresces:
        return lib.of_pairs(None, f, channels)
    found = batch.run(kernels.RERADIATION, m._pairs, (wi, wo))[0]
    if lib.name == "numpy":
        found = found.reshape((*lib.shape(f), channels))
        np.einsum("...ii->...i", found)[...] += f
        return found
    return lib.of_pairs(found, f, channels)


def require_wavelengths(m: Any) -> None:
    """Raises ParameterError where formulas need the wavelengths of channels, and these are not known."""
    for path, field, value, _ in tree.walk(m):
        if isinstance(field, Wavelengths) and np.ndim(value) == 0 and m.channels > 1:
            raise ParameterError(
                f"{m!r:.60}: the wavelengths of its {m.channels} channels are not known ({path}), and the energy of "
                f"photons depends on them; expected m.with_channels(wavelengths) [nm], or m.at(wavelengths)"
            )


def under(m: Any, light: Any, seen: Any) -> Any:
    """See `Reflectance.under`."""
    if m.channels is None:
        raise ParameterError(
            f"under: {m!r:.60} has no channel axis, and fluorescence exchanges light between wavelengths; expected "
            f"m.at(wavelengths)"
        )
    E = of_bands("light", light, m)
    for_light = E if seen is None else of_bands("seen", seen, m)
    if (for_light <= 0.0).any():
        dark = _where(m, for_light <= 0.0)
        raise ParameterError(
            f"under: no light {dark}, so that there is no factor by which more or less of it leaves; expected light at "
            f"all wavelengths, or seen=..., the light of the picture: m.under(E, seen=np.ones({len(E)}))"
        )
    return m if seen is None and not m.fluoresces else CLASSES["UnderLight"](m, E, for_light)


def warn_of_reradiation(m: Any, instead: str) -> None:
    """Says that a result has nothing of the light that leaves at another wavelength, since no light is known."""
    if exchanges(m):
        text = (
            f"{m!r:.60} fluoresces, and light that leaves at another wavelength than it arrived at is left out, for no "
            f"light is known; expected m.under(E) in its place, as it is under light of a spectrum E, or {instead}; "
            f"m.reradiation(wi, wo) has all of it"
        )
        warn(text, FluorescenceWarning)


def of_bands(name: str, value: Any, m: Any) -> np.ndarray:
    """A spectrum of light as the irradiance (C,) of the bands of a material."""
    rule = f"expected {m.channels} numbers, one for each wavelength of the material, or a gn.Spectrum"
    if isinstance(value, Spectrum):
        nm = m.wavelengths
        if nm is None:
            raise ParameterError(f"{name}: a spectrum, and a material without wavelengths; {rule}")
        try:
            widths = np.diff(bands.edges(nm), axis=-1)[:, 0]
            found = value.bands(nm) * widths
        except ParameterError as error:
            raise ParameterError(f"under: {name}: {error}") from None
    else:
        try:
            found = np.array(ops.numbers(value), dtype=float)
        except (TypeError, ValueError, OverflowError):
            hint = f", such as gn.spectra.illuminant({value!r})" if isinstance(value, str) else ""
            raise ParameterError(f"under({name}={shown(value)}): {rule}{hint}") from None
    if found.shape != (m.channels,):
        raise ParameterError(f"under({name}): got shape {found.shape}; {rule}")
    if not np.isfinite(found).all() or found.min() < 0.0:
        raise ParameterError(f"under({name}={shown(value)}): negative, infinite or NaN; expected irradiances")
    return found


def _where(m: Any, mask: np.ndarray) -> str:
    at = np.flatnonzero(mask)
    first = f"at {m.wavelengths[at[0]]:g} nm" if m.wavelengths is not None else f"in channel {at[0]}"
    return first if len(at) == 1 else f"{first} and {len(at) - 1} other wavelengths"
