"""A measurement is a reflectance like any other: the base class of what file formats are read into."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import ParameterError
from .geometry import HORIZON
from .interface import Reflectance

if TYPE_CHECKING:
    import xarray


QUANTITIES: dict[str, Callable[[Any, Any], Any]] = {
    "brdf": lambda cos_i, cos_o: 1.0,
    "brdf * cos(theta_o)": lambda cos_i, cos_o: cos_o,
    "brdf * cos(theta_i)": lambda cos_i, cos_o: cos_i,
    "reflectance factor": lambda cos_i, cos_o: math.pi,
}
"""What tables hold: name -> what the BRDF is multiplied by, from the cosines of wi and wo.

brdf * cos(theta_o) is the scattered density DSF; the reflectance factor is relative to a white Lambertian surface."""


def quantity_named(name: str) -> str:
    """The name itself. Raises ParameterError for one that is not in `QUANTITIES`."""
    if name not in QUANTITIES:
        raise ParameterError(f"quantity={name!r}: expected one of {', '.join(map(repr, QUANTITIES))}")
    return name


def to_brdf(quantity: str, values: Any, cos_i: Any, cos_o: Any) -> np.ndarray:
    """f [1/sr] from values of a quantity at pairs with these cosines; NaN where it cannot tell f (a cosine of 0)."""
    factor = np.asarray(QUANTITIES[quantity_named(quantity)](cos_i, cos_o), dtype=float)
    return np.asarray(values, dtype=float) / np.where(factor > HORIZON, factor, np.nan)


def from_brdf(quantity: str, f: Any, cos_i: Any, cos_o: Any) -> np.ndarray:
    """Values of a quantity from f [1/sr] at pairs with these cosines."""
    return np.asarray(f, dtype=float) * QUANTITIES[quantity_named(quantity)](cos_i, cos_o)


class Measured(Reflectance):
    """Base of the measured reflectances. A subclass declares its tables as fields and writes `formula`.

    path      the file it was read from, or ""
    quantity  what the file held, in words ("brdf", "brdf * cos(theta_o)"); `f` is always the BRDF [1/sr]
    about     what the file says about itself, name -> value
    """

    path: str
    about: dict[str, Any]
    provenance: dict[str, Any]
    """Where it was read from: "file", "bytes", "sha256", "format", "gonio" (its version), "options" of the reader where
    there were any, and "converted_from", the same of what the file was made of, where it says so. Empty in memory."""
    quantity = "brdf"
    format = ""

    def __init__(self, path: str = "", about: dict[str, Any] | None = None, **fields: Any):
        self.__dict__.update(path=path, about=dict(about or {}), provenance={})
        super().__init__(**fields)

    @property
    def valid(self) -> np.ndarray:
        """True where the file holds a usable value; shape of the main table."""
        raise NotImplementedError

    @property
    def data(self) -> xarray.Dataset:
        """The file's content as it was stored, with named axes and CF units."""
        raise NotImplementedError

    @property
    def attributes(self) -> dict[str, str]:
        """What `data` says about the whole of itself, as text that any file can hold; `provenance` as JSON."""
        held = {"quantity": self.quantity, "source": self.path}
        return {**held, "provenance": json.dumps(self.provenance)} if self.provenance else held

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        mine, theirs = dict(self._key()), dict(other._key())
        return mine.keys() == theirs.keys() and all(_same(value, theirs[name]) for name, value in mine.items())

    __hash__ = Reflectance.__hash__

    def __repr__(self) -> str:
        return f"load({self.path!r})" if self.path else f"<{type(self).__name__} measurement in memory>"

    def to_json(self) -> dict[str, Any]:
        raise ParameterError(f"{self!r}: a measurement has no JSON form; save it in its own format with gonio.save")


def _same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    return bool(a == b)
