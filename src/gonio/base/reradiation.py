"""Light that leaves at another wavelength than it arrived at: matrices of a material's channels, pair by pair.

Every pair of wavelengths is a channel to the engine: the material stands there twice, once with the numbers of the
wavelength that leaves and once with those of the one that arrives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

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
from .calls import reflectances

R = TypeVar("R", bound=Parametrised)


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


def reradiation(m: Any, wi: Any, wo: Any) -> Any:
    """The bispectral matrix F of light that leaves at wavelength o and arrived at i: L_o = sum_i F[o, i] E_i.

    E_i and L_o are irradiance and radiance of whole bands (on an even grid also their densities by wavelength). `f`
    is the part that keeps its wavelength, and stands on the diagonal; without fluorescence the rest is 0. Elements
    above the diagonal, where wavelengths ascend, take light from longer waves to shorter ones.

    Shapes   wi, wo: (..., 3), broadcast against each other; result (..., C, C), the wavelength that leaves first.
    Units    1/sr; 0 where a direction is below the horizon.
    Error    rounding. 41 wavelengths take 13 kB for each pair of directions, in double precision.
    Source   Donaldson 1954, Br. J. Appl. Phys. 5:210; with directions Hullin et al. 2010, ACM TOG 29(4):97.

    Example
    >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
    >>> F = ink.reradiation([0, 0, 1], [0, 0, 1])
    >>> print((np.pi * F @ [1.0, 0.0]).round(3))  # the radiance factor under violet light alone
    [0.2 0.3]
    """
    require_passed_on(m)
    return _matrix(m, wi, wo)


def _matrix(m: Any, wi: Any, wo: Any) -> Any:
    channels = m.channels
    if channels is None:
        raise ParameterError(
            f"reradiation of {m!r:.60}: it has no channel axis, and light is exchanged between wavelengths; expected "
            f"channels at wavelengths: m.at([400.0, 500.0, 600.0])"
        )
    require_wavelengths(m)
    if labelled.concern(m, (wi, wo)):
        return labelled.call(lambda plain, *w: [_matrix(plain, *w)], (PAIRS,), m, (wi, wo), (3, 3))[0]
    f = m.f(wi, wo)
    lib = ops.library(f)
    if not m.fluoresces:
        return lib.of_pairs(None, f, channels)
    if pairs not in m._derived:
        m._derived[pairs] = pairs(m, channels)
    between = batch.run(kernels.RERADIATION, m._derived[pairs], (wi, wo))[0]
    if lib.name == "numpy":
        between = between.reshape((*lib.shape(f), channels))
        np.einsum("...ii->...i", between)[...] += f
        return between
    return lib.of_pairs(between, f, channels)


def require_wavelengths(m: Any) -> None:
    """Raises ParameterError where formulas need the wavelengths of channels, and these are not known."""
    for path, field, value, _ in tree.walk(m):
        if isinstance(field, Wavelengths) and np.ndim(value) == 0 and m.channels > 1:
            raise ParameterError(
                f"{m!r:.60}: the wavelengths of its {m.channels} channels are not known ({path}), and the energy of "
                f"photons depends on them; expected m.with_channels(wavelengths) [nm], or m.at(wavelengths)"
            )


def under(m: Any, light: Any, seen: Any = None) -> Any:
    """The ordinary material that looks the same under light of a spectrum E: f = sum_i F[o, i] E_i / E_o.

    It serves wherever a reflectance does, `gn.render` and `gn.albedo` among them. It may send back more light of a
    wavelength than arrives: the albedo is the radiance factor of colour measurement, which fluorescence carries
    above 1. `seen`: another spectrum in the place of E_o, under whose light the picture is to be computed; needed
    where E has no light of a wavelength at which the material shines.

    Shapes   light, seen: (C,), a number per wavelength of the material, or a `gn.Spectrum`.
    Units    irradiance of a band, in any unit; seen: the same.
    Raises   ParameterError for negative light, spectra that end too early, and where `seen` is 0.

    Example
    >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
    >>> print(gn.albedo(ink.under([1.0, 1.0]), [0, 0, 1]).round(3))
    [0.2 0.9]
    >>> print(gn.albedo(ink.under([5.0, 1.0]), [0, 0, 1]).round(3))
    [0.2 2.1]
    """
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
    if seen is None and not m.fluoresces:
        return m
    return CLASSES["UnderLight"](m, E, for_light)


def require_passed_on(m: Any, channels: int | None = None) -> None:
    """Raises ParameterError where a part fluoresces, and the model around it does not say where that light goes, or
    the part does not fit this material's bands."""
    channels = channels or m.channels or 1
    m._require_bands(channels)
    for inner in reflectances(m).values() if m.fluoresces else ():
        if inner.fluoresces and type(m).reradiated is CLASSES["Reflectance"].reradiated:
            raise ParameterError(
                f"{type(m).__name__}: {inner!r:.60} in it fluoresces, and this model does not say where that "
                f"light goes; expected it in a sum, a product, Rotated or Coated, or a model with reradiated"
            )
        require_passed_on(inner, channels)


def require_bands(m: Any, channels: int) -> None:
    """Raises ParameterError where numbers of a model do not fit so many bands; overridden where they may not."""


def with_rounds(m: R, matrix: Callable[[str, Any], Any], prefix: str = "") -> R:
    """With `matrix(path, coat)` in each coat that sends light back to a dye, where it may excite again: what goes to
    and fro takes part in all wavelengths at once, and formulas know two."""
    changes: dict[str, Any] = {}
    for name, inner in reflectances(m).items():
        new = inner._with_rounds(matrix, f"{prefix}{name}.") if inner.fluoresces else inner
        if new is not inner:
            changes[name] = new
    return m._changed(changes) if changes else m


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
            irradiance = value.bands(nm) * widths
        except ParameterError as error:
            raise ParameterError(f"under: {name}: {error}") from None
    else:
        try:
            irradiance = np.array(ops.numbers(value), dtype=float)
        except (TypeError, ValueError, OverflowError):
            hint = f", such as gn.spectra.illuminant({value!r})" if isinstance(value, str) else ""
            raise ParameterError(f"under({name}={shown(value)}): {rule}{hint}") from None
    if irradiance.shape != (m.channels,):
        raise ParameterError(f"under({name}): got shape {irradiance.shape}; {rule}")
    if not np.isfinite(irradiance).all() or irradiance.min() < 0.0:
        raise ParameterError(f"under({name}={shown(value)}): negative, infinite or NaN; expected irradiances")
    return irradiance


def _where(m: Any, mask: np.ndarray) -> str:
    at = np.flatnonzero(mask)
    first = f"at {m.wavelengths[at[0]]:g} nm" if m.wavelengths is not None else f"in channel {at[0]}"
    return first if len(at) == 1 else f"{first} and {len(at) - 1} other wavelengths"
