"""A measurement is a reflectance like any other: the base class of what file formats are read into."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .errors import FormatError, ParameterError
from .geometry import HORIZON
from .interface import Reflectance
from .parametrised import freeze
from .spectrum import RELATIVE_XYZ, WHITE, XYZ

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


def tabular_shape(m: Reflectance) -> tuple[int, ...]:
    """Shape of a value of f, () or (C,). Raises ParameterError for what no table of f holds: a delta lobe, maps."""
    if m.has_delta:
        raise ParameterError(f"{m!r:.80}: a table cannot hold a perfect mirror; take the material without it")
    shape = m.f([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]).shape
    if len(shape) > 1:
        raise ParameterError(f"{m!r:.80}: values have shape {shape}, expected one material, without maps")
    return shape


def tristimulus(names: tuple | None, f: np.ndarray) -> tuple[tuple | None, np.ndarray]:
    """Names of channels, and f (..., C), as tables hold them: `RELATIVE_XYZ` becomes `XYZ`, others stay."""
    return (XYZ, f * WHITE) if names == RELATIVE_XYZ else (names, f)


ALBEDO_AT = (0.0, 45.0, 75.0)
"""Angles [degrees] of incidence of the albedos in a `Repair`."""


class Repair(NamedTuple):
    """What an operation of `gonio.repair` did to a measurement.

    operation      its name, and `parameters`, what it was asked for
    cells, share   nodes (above the horizon) with another value than before, in some channel; share of all
    filled         how many of them had none
    largest, mean  of |change of f| [1/sr], of values that changed; 0 where there were none before
    albedo_before  black-sky albedo at `ALBEDO_AT`, mean of the channels, before and after; directions without data
    albedo_after   count as 0
    figures        what else was measured, name -> number; the operation's documentation says what
    """

    operation: str
    parameters: dict[str, Any]
    cells: int
    share: float
    filled: int
    largest: float
    mean: float
    albedo_before: tuple[float, ...] | None
    albedo_after: tuple[float, ...]
    figures: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """As JSON data: what `m.about["repairs"]` holds, and files keep. NaN becomes None."""
        figures = {name: None if value != value else value for name, value in self.figures.items()}
        albedos = {n: None if a is None else list(a) for n, a in self._asdict().items() if n.startswith("albedo")}
        return {**self._asdict(), **albedos, "figures": figures}

    @classmethod
    def from_json(cls, held: Mapping[str, Any]) -> Repair:
        """The record that `to_json` wrote. Raises FormatError where it is none."""
        try:
            given = {name: held[name] for name in cls._fields}
            for name in ("albedo_before", "albedo_after"):
                given[name] = None if given[name] is None else tuple(map(float, given[name]))
            given["figures"] = {n: math.nan if v is None else v for n, v in given["figures"].items()}
            return cls(**given)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise FormatError(
                f"repairs: {held!r:.100} is no record of a repair ({error!r:.60}); expected {', '.join(cls._fields)}"
            ) from None

    def __str__(self) -> str:
        given = ", ".join(f"{k}={_short(v)}" for k, v in self.parameters.items())
        text = f"{self.operation}({given}): {self.cells} cells ({self.share:.2%})"
        if self.filled:
            text += f", {self.filled} of them filled"
        if self.largest:
            text += f"; f changed by {self.mean:.3g}/sr, at most {self.largest:.3g}/sr"
        before = "" if self.albedo_before is None else " ".join(f"{a:.4f}" for a in self.albedo_before) + " to "
        text += f"; albedo {before}{' '.join(f'{a:.4f}' for a in self.albedo_after)}"
        return text + "".join(f"; {name.replace('_', ' ')} {_short(value)}" for name, value in self.figures.items())


class Measured(Reflectance):
    """Base of the measured reflectances. A subclass declares its tables as fields and writes `formula`.

    path      the file it was read from, or ""
    quantity  what the file held, in words ("brdf", "brdf * cos(theta_o)"); `f` is always the BRDF [1/sr]
    about     what the file says about itself, name -> value
    """

    path: str
    about: dict[str, Any]
    provenance: dict[str, Any]
    """Where it was read from: "file", "bytes", "sha256" (of files up to 256 MB), "format", "gonio" (its version),
    "options" of the reader where there were any, and "converted_from", the same of what the file was made of, where it
    says so. Of what was made of it in memory, by `with_brdf`, `gonio.tabulate` or `gonio.repair`, "converted_from"
    alone: a list where it was made of several. Empty where no file is known."""
    quantity = "brdf"
    format = ""
    has_text = False

    def __init__(self, path: str = "", about: dict[str, Any] | None = None, **fields: Any):
        self.__dict__.update(path=path, about=freeze(deepcopy(dict(about or {}))), provenance={})
        super().__init__(**fields)

    @property
    def repairs(self) -> tuple[Repair, ...]:
        """What was done to the measurement by `gonio.repair`, in order."""
        held = self.about.get("repairs", ())
        return tuple(map(Repair.from_json, held if isinstance(held, (list, tuple)) else [held]))

    @property
    def valid(self) -> np.ndarray:
        """True where the file holds a usable value; shape of the main table."""
        raise NotImplementedError

    @property
    def data(self) -> xarray.Dataset:
        """The file's content as it was stored, with named axes and CF units."""
        raise NotImplementedError

    def as_grid(self) -> Any:
        """The `Gridded` with the same values at the same nodes, where they lie on a grid; else None."""
        return None

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


def _short(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return f"({', '.join(map(_short, value))})"
    return f"{value:.3g}" if isinstance(value, float) else f"{value!r:.60}"


def _same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    return bool(a == b)
