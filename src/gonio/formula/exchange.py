"""The field of a matrix between wavelengths: how much light of one leaves as light of another."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import frozen, ops
from ..errors import ParameterError
from . import bands
from .fields import Numbers
from .text import shown


class Exchange(Numbers):
    """A matrix (..., C, C) [o, i] of the wavelengths that leave and arrive, or one number for a single wavelength.

    `formula` has its diagonal, one number per channel; `reradiated` the element of its pair of wavelengths, and 0 for
    two that are the same, whose light `formula` counts.
    """

    accepts = "float | Array"
    range = "at least 0"

    def check(self, owner: str, value: Any) -> Any:
        call = f"{owner}({self.name}={shown(value)})"
        rule = f"expected a matrix (C, C), a row for each wavelength that leaves ({self.doc})"
        try:
            matrix = np.array(ops.numbers(value), dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise ParameterError(f"{call}: {rule}") from None
        if matrix.ndim == 1 or matrix.shape[-2:-1] != matrix.shape[-1:] or matrix.size == 0:
            raise ParameterError(f"{owner}({self.name}): got shape {matrix.shape}; {rule}")
        if not np.isfinite(matrix).all():
            raise ParameterError(f"{owner}({self.name}): NaN or infinite; {rule}")
        if matrix.min() < 0.0:
            share = (matrix < 0.0).mean()
            raise ParameterError(
                f"{owner}({self.name}): {share:.2g} of the numbers are negative, to {matrix.min():g}: no surface sends "
                f"back less light for more; expected numbers of 0 or more; noise of a measurement about 0: "
                f"numpy.maximum(matrix, 0.0)"
            )
        return frozen(matrix) if matrix.ndim else float(matrix)

    def kept(self, value: np.ndarray) -> Any:
        return frozen(np.diagonal(value, axis1=-2, axis2=-1).copy())

    @staticmethod
    def between(value: Any) -> Any:
        """The matrix with a diagonal of 0: what `reradiated` has of it."""
        if np.ndim(value) == 0:
            return 0.0
        others = np.array(value)
        np.einsum("...ii->...i", others)[...] = 0.0
        return others

    @staticmethod
    def at(name: str, value: Any, known: np.ndarray | None, wavelengths: Any) -> Any:
        """The matrix at other wavelengths. The light that leaves is shared out to the new bands, its sum kept; by the
        wavelength that arrives, and along the diagonal, numbers are interpolated."""
        if np.ndim(value) == 0:
            return value
        count = value.shape[-1]
        if known is None or len(known) != count:
            raise ParameterError(
                f"at: {name}: a matrix of {count} wavelengths that are not declared; write wavelengths=[...]"
            )
        if np.array_equal(known, wavelengths):
            return value
        new = np.atleast_1d(wavelengths)
        arrives = bands.interpolation(f"at: {name}", known, new)
        same = np.diagonal(value, axis1=-2, axis2=-1) @ arrives.T
        if np.ndim(wavelengths) == 0:
            return float(same[..., 0]) if value.ndim == 2 else same[..., None]
        found = bands.shared(known, new) @ Exchange.between(value) @ arrives.T
        # Light that left at another wavelength, and now leaves in the band that it arrived in, is part of f.
        np.einsum("...ii->...i", found)[...] += same
        return found


class Entire(Exchange):
    """A matrix of which `reradiated` has the diagonal too: light that comes back to the wavelength that it had."""

    between = staticmethod(lambda value: value)


def exchange(doc: str, default: Any = 0.5) -> Any:
    """A matrix (C, C) between wavelengths, for fluorescence: column i is what leaves of light that arrives at the
    wavelength i.

    Example
    >>> from gonio.authoring import Reflectance, exchange
    >>> class Ink(Reflectance):
    ...     "A fluorescent ink."
    ...     fluoresces = True
    ...     matrix = exchange("share of the light of one band that leaves in another")
    ...
    ...     def formula(self, wi, wo):
    ...         return self.matrix / np.pi
    ...
    ...     def reradiated(self, light, wi, wo):
    ...         return self.matrix / np.pi
    ...
    >>> ink = Ink([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
    >>> print((np.pi * ink.reradiation([0, 0, 1], [0, 0, 1])).round(3))
    [[0.2 0. ]
     [0.3 0.6]]
    """
    return Exchange(default, doc)
