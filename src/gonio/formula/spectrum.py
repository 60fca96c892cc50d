"""Spectra: numbers by wavelength, between which straight lines are drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import frozen, ops
from ..declared.notebooks import repr_html
from ..declared.numbers import NANOMETRES
from ..errors import AccessError, ParameterError, TooLargeError
from .text import literal, shown
from .texture import Texture


def as_wavelengths(call: str, value: Any, x_rays: bool = False) -> Any:
    """A wavelength [nm], or an array (C,) of them, as values keep them. Raises ParameterError for anything else.

    `x_rays`: whether wavelengths below 50 nm may stand beside longer ones.
    """
    rule = "expected a wavelength above 0 [nm], or a list of one for each channel"
    try:
        array = np.array(ops.numbers(value), dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{call}: {rule}") from None
    except MemoryError:
        raise TooLargeError(f"{call}: no memory for a copy of {np.size(value)} numbers; {rule}") from None
    if array.ndim > 1 or array.size == 0 or not np.isfinite(array).all() or array.min() <= 0.0:
        raise ParameterError(f"{call}: {rule}")
    if array.max() < NANOMETRES:
        raise ParameterError(f"{call}: in micrometres? expected nanometres; multiply by 1000")
    if array.min() < NANOMETRES and not x_rays:
        raise ParameterError(f"{call}: {array.min():g} beside {array.max():g}: expected nanometres, all of them")
    if len(np.unique(array)) < array.size:
        raise ParameterError(f"{call}: expected different wavelengths")
    return float(array) if array.ndim == 0 else frozen(array)


def interpolated(name: str, value: Any, known: np.ndarray | None, wavelengths: Any) -> Any:
    """A parameter's value at wavelengths: that of a spectrum, or between the known wavelengths of its channels."""
    try:
        if isinstance(value, Spectrum):
            return value.at(wavelengths)
        if isinstance(value, Texture):
            return value if value.channels == 1 else value.with_texels(_several(value.texels, known, wavelengths))
        count = np.shape(value)[-1] if np.ndim(value) else 1
        if count == 1:
            return value[..., 0] if np.ndim(value) == 1 and np.ndim(wavelengths) == 0 else value
        return _several(value, known, wavelengths)
    except ParameterError as error:
        raise ParameterError(f"at: {name}: {error}") from None


def _several(value: Any, known: np.ndarray | None, wavelengths: Any) -> Any:
    """Numbers (..., C) of several channels at wavelengths."""
    if known is None or len(known) != value.shape[-1]:
        rule = "channels without wavelengths; expected a gn.Spectrum; of RGB gn.spectra.upsampled(m) makes one"
        raise ParameterError(f"has {value.shape[-1]} {rule}")
    if not isinstance(value, np.ndarray):
        raise ParameterError(f"is a {type(value).__name__}; expected a NumPy array")
    return between(value, known, wavelengths)


def between(values: np.ndarray, known: np.ndarray, wavelengths: Any) -> Any:
    """Values (..., C) at known wavelengths, as values (...[, K]) at others, by straight lines between neighbours.

    A missing value, NaN, is missing between it and its neighbours, not at these. Raises ParameterError outside.
    """
    nm = np.asarray(wavelengths, dtype=float)
    require_within(nm, known.min(), known.max())
    order = np.argsort(known)
    x = known[order]
    low = np.clip(np.searchsorted(x, nm, side="right") - 1, 0, max(len(x) - 2, 0))
    high = np.minimum(low + 1, len(x) - 1)
    share = np.where(high > low, (nm - x[low]) / np.where(high > low, x[high] - x[low], 1.0), 0.0)
    a, b = values[..., order[low]], values[..., order[high]]
    made = np.where(share == 0.0, a, np.where(share == 1.0, b, (1.0 - share) * a + share * b)).astype(values.dtype)
    return made[()]


def require_within(nm: np.ndarray, low: float, high: float) -> None:
    """Raises ParameterError for wavelengths beyond those of a spectrum."""
    outside = nm[~((nm >= low) & (nm <= high))]
    if outside.size:
        micrometres = "; in micrometres? multiply by 1000" if low <= 1000.0 * outside[0] <= high else ""
        raise ParameterError(
            f"a spectrum of {low:g} to {high:g} nm at {outside[0]:g} nm: nothing is extrapolated{micrometres}; "
            f"take wavelengths that all spectra hold"
        )


class Spectrum:
    """Numbers by wavelength, with straight lines between them; nothing is extrapolated.

    A parameter may be one: `gn.Lambertian(spectrum)` has no f until `m.at(wavelengths)` says where it is wanted. The
    parameter's bounds hold there.

    Shapes   wavelengths, values: (N,), N > 1; in any order.
    Units    wavelengths: nm; values: of the parameter.
    Error    of straight lines between the wavelengths given.
    Source   definition.

    Example
    >>> green = gn.Spectrum([400.0, 550.0, 700.0], [0.1, 0.6, 0.2])
    >>> print(green.at(475.0).round(3), green.at([400.0, 700.0]))
    0.35 [0.1 0.2]
    >>> m = gn.Lambertian(green).at([450.0, 550.0, 650.0])
    >>> print(gn.albedo(m, [0, 0, 1]).round(3), m.wavelengths)
    [0.267 0.6   0.333] [450. 550. 650.]
    """

    _repr_html_ = repr_html

    wavelengths: np.ndarray
    values: np.ndarray

    def __init__(self, wavelengths: Any, values: Any):
        nm = as_wavelengths(f"Spectrum(wavelengths={shown(wavelengths)})", wavelengths, x_rays=True)
        try:
            numbers = np.array(ops.numbers(values), dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise ParameterError(f"Spectrum(values={shown(values)}): expected a number for each wavelength") from None
        except MemoryError:
            got = f"no memory for a copy of {np.size(values)} numbers"
            raise TooLargeError(f"Spectrum(values={shown(values)}): {got}; expected one for each wavelength") from None
        if np.ndim(nm) == 0 or len(nm) < 2 or numbers.shape != nm.shape:
            got = f"got shapes {np.shape(nm)} and {numbers.shape}"
            raise ParameterError(f"Spectrum: {got}; expected (N,) wavelengths and (N,) values, N > 1")
        if not np.isfinite(numbers).all():
            raise ParameterError(f"Spectrum(values={shown(values)}): NaN or infinite; leave such wavelengths out")
        order = np.argsort(nm)
        self.__setstate__({"wavelengths": nm[order], "values": numbers[order]})

    @classmethod
    def _of_nanometres(cls, wavelengths: Any, values: Any) -> Spectrum:
        """A spectrum of rising wavelengths whose unit a file says: X rays are not asked about, and one may be alone."""
        new = object.__new__(cls)
        new.__setstate__({"wavelengths": np.array(wavelengths), "values": np.array(values)})
        return new

    def at(self, wavelengths: Any) -> Any:
        """The values at wavelengths [nm], of their shape. Raises ParameterError outside the spectrum.

        Example
        >>> print(gn.Spectrum([400.0, 700.0], [0.0, 0.3]).at([500.0, 600.0]).round(3))
        [0.1 0.2]
        """
        return between(self.values, self.wavelengths, np.asarray(ops.numbers(wavelengths), dtype=float))

    def bands(self, wavelengths: Any) -> np.ndarray:
        """The means over bands about wavelengths [nm], (C,): for radiance, whose sum over all bands is kept.

        Bands meet halfway between two wavelengths; the outer ones reach as far out as in, or to the spectrum's end.

        Example
        >>> lamp = gn.Spectrum([400.0, 540.0, 550.0, 560.0, 700.0], [0.0, 0.0, 1.0, 0.0, 0.0])
        >>> print(lamp.at([450.0, 530.0, 610.0]), lamp.bands([450.0, 530.0, 610.0]).round(3))
        [0. 0. 0.] [0.    0.125 0.   ]
        """
        nm = as_wavelengths(f"bands({shown(wavelengths)})", wavelengths)
        if np.ndim(nm) == 0 or len(nm) < 2:
            raise ParameterError(
                f"bands({shown(wavelengths)}): expected at least two wavelengths, which bands lie about"
            )
        require_within(nm, self.wavelengths[0], self.wavelengths[-1])
        order = np.argsort(nm)
        middle = nm[order]
        inner = 0.5 * (middle[1:] + middle[:-1])
        ends = np.concatenate([[2.0 * middle[0] - inner[0]], inner, [2.0 * middle[-1] - inner[-1]]])
        ends = np.clip(ends, self.wavelengths[0], self.wavelengths[-1])
        places = np.union1d(ends, self.wavelengths)
        values = np.interp(places, self.wavelengths, self.values)
        areas = 0.5 * (values[1:] + values[:-1]) * np.diff(places)
        integral = np.interp(ends, places, np.concatenate([[0.0], np.cumsum(areas)]))
        means = np.empty(len(nm))
        means[order] = np.diff(integral) / np.diff(ends)
        return means

    def _key(self) -> tuple[Any, ...]:
        """What makes two of a class the same."""
        return self.wavelengths.tobytes(), self.values.tobytes()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Spectrum):
            return NotImplemented
        return type(self) is type(other) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _without_wavelength(self, other: Any) -> Any:
        """No number comes of a spectrum and a number, or another spectrum, while the wavelength is unknown."""
        if not isinstance(other, (Spectrum, int, float, np.ndarray)):
            return NotImplemented
        raise ParameterError(
            f"{self!r:.60}: no number until there is a wavelength; write spectrum.at(550.0), or .at([...]) of what it "
            f"is a part of"
        )

    __add__ = __radd__ = __sub__ = __rsub__ = _without_wavelength
    __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __pow__ = _without_wavelength

    def __repr__(self) -> str:
        return f"Spectrum({literal(self.wavelengths)}, {literal(self.values)})"

    def __setattr__(self, name: str, value: Any) -> None:
        raise AccessError("a Spectrum is a value and cannot be changed; make a new one")

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, numbers in state.items():
            object.__setattr__(self, name, frozen(numbers))

    def to_json(self) -> dict[str, Any]:
        """The spectrum as JSON data.

        Example
        >>> print(gn.Spectrum([400, 700], [0.0, 0.3]).to_json())
        {'type': 'Spectrum', 'wavelengths': [400.0, 700.0], 'values': [0.0, 0.3]}
        """
        return {"type": "Spectrum", "wavelengths": self.wavelengths.tolist(), "values": self.values.tolist()}

    __array_ufunc__ = None  # an array times this is not an array of objects
