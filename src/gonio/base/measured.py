"""Measurements: the base class of the reflectances that file formats are read into."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from ..errors import ParameterError, shown
from ..evaluate import batch
from ..formula.fields import Table
from ..formula.state import Held, derived, immutable, note
from ..pictures.colour import RELATIVE_XYZ, WHITE, XYZ
from .history import Repair
from .reflectance import Reflectance

if TYPE_CHECKING:
    import xarray


def tabular_shape(m: Reflectance) -> tuple[int, ...]:
    """Shape of a value of f, () or (C,). Raises ParameterError for delta lobes and maps, which no table of f holds, and
    for what transmits, which needs several."""
    if m.sides != "front":
        rule = "it transmits light, and a table holds one side; tabulate each, and join them by gn.Sheet or gn.Across"
        raise ParameterError(f"{m!r:.80}: {rule}")
    if m.has_delta:
        raise ParameterError(f"{m!r:.80}: a table cannot hold a perfect mirror; take the material without it")
    shape = batch.full_shape(m, ()) + (() if m.channels is None else (m.channels,))
    if len(shape) > 1:
        rule = "expected one material, without maps; of maps gn.check and m.f(wi, wo) give arrays"
        raise ParameterError(f"{m!r:.80}: values have shape {shape}, {rule}")
    return shape


def tristimulus(names: tuple[Any, ...] | None, f: np.ndarray) -> tuple[tuple[Any, ...] | None, np.ndarray]:
    """Names of channels, and f (..., C), as tables hold them: `RELATIVE_XYZ` becomes `XYZ`, others stay."""
    return (XYZ, f * WHITE) if names == RELATIVE_XYZ else (names, f)


class Total(NamedTuple):
    """The share of light from a direction [rad] that is reflected to all sides, for each channel, as a file has it."""

    theta_i: float
    phi_i: float
    shares: tuple[float, ...]


class Measured(Reflectance, has_text=False):
    """Base of the measured reflectances. A subclass declares its tables as fields and writes `formula`.

    values    the numbers as stored; `valid`: where they are usable; `data`: with their axes, an xarray.Dataset
    path      the file it was read from, or ""
    quantity  the quantity in the file ("brdf", "brdf * cos(theta_o)"); `f` is always the BRDF [1/sr]
    about     the file's notes on itself, name -> value

    Example
    >>> m = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18))
    >>> print(m.quantity, m.valid.all())
    brdf True
    """

    _noun = "a measurement"

    @staticmethod
    def _instead(value: Any) -> str:
        table = "gn.tables.tabulate(m), or gn.repair.resample(m), makes a table of any reflectance"
        return table if isinstance(value, Reflectance) else Reflectance._instead(value)

    path: str = note("")
    about: dict[str, Any] = note(Held())
    provenance: dict[str, Any] = note(Held())
    """The file it was read from: "file", "bytes", "sha256" (of files up to 256 MB), "format", "gonio" (its version),
    "options" of the reader where there were any, and "converted_from", the provenance of the file's own source where
    the file has that. A measurement made of others in memory, by `with_brdf`, `gonio.tables.tabulate` or
    `gonio.repair`, has "converted_from" alone: a list where there were several. Empty where no file is known."""
    stated_totals: tuple[Total, ...] = note(())
    """Shares of light that the file states beside its values."""
    quantity: str = note("brdf")
    format = ""

    def __init__(self, path: str = "", about: dict[str, Any] | None = None, **fields: Any):
        if not isinstance(about, Mapping | None):
            rule = "expected what the file says beside its values, as a dict of names and texts or numbers"
            raise ParameterError(f"{type(self).__name__}(about={shown(about)}): {rule}")
        self._hold(path=path, about=immutable(deepcopy(dict(about or {}))))
        super().__init__(**fields)

    def rough_albedo(self) -> float:
        """The largest share of light that the numbers stand for, roughly, by their own nodes; NaN where it takes more.

        Example
        >>> print(round(gn.tables.tabulate(gn.Lambertian(0.5), "angles").rough_albedo(), 2))
        0.5
        """
        return math.nan

    @property
    def repairs(self) -> tuple[Repair, ...]:
        """The repairs of the measurement by `gonio.repair`, in order.

        Example
        >>> m = gn.repair.remove_negatives(gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18)))
        >>> print([r.operation for r in m.repairs])
        ['remove_negatives']
        """
        records = self.about.get("repairs", ())
        return tuple(map(Repair.from_json, records if isinstance(records, (list, tuple)) else [records]))

    @derived
    def values(self) -> np.ndarray:
        """The numbers as they are stored, of the quantity that `quantity` names: a NumPy array, read-only.

        The first table that a class declares; a class whose numbers stand elsewhere says so. `valid` is True where they
        are usable, `data` holds them with their axes, and `f` is made of them.

        Example
        >>> m = gn.tables.tabulate(gn.Lambertian(0.5), "angles", resolution=(2, 2, 3))
        >>> m.values.shape, round(float(m.values[0, 0, 0]), 4), m.quantity
        ((2, 2, 3), 0.1592, 'brdf')
        """
        tables = [getattr(self, name) for name, field in self.fields.items() if isinstance(field, Table)]
        if not tables:
            raise self._lacks("values")
        return np.asarray(tables[0])

    @property
    def valid(self) -> np.ndarray:
        """True where the file holds a usable value; shape of `values`.

        Example
        >>> m = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18))
        >>> print(m.valid.mean())
        1.0
        """
        raise self._lacks("valid")

    @property
    def data(self) -> xarray.Dataset:
        """The file's content as it was stored, with named axes and CF units; its tables, where a class says no more.

        Example
        >>> m = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18))
        >>> print(m.data["values"].attrs["units"])
        sr-1
        """
        import xarray

        tables = [(name, getattr(self, name), x.doc) for name, x in self.fields.items() if isinstance(x, Table)]
        variables = {
            name: ([f"{name}_{k}" for k in range(np.ndim(x))], x, {"long_name": doc}) for name, x, doc in tables
        }
        return xarray.Dataset(variables, attrs=self.attributes)

    def as_grid(self) -> Any:
        """The `Gridded` with the same values at the same nodes, where they lie on a grid; else None.

        Example
        >>> m = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18))
        >>> print(type(m.as_grid()).__name__)
        Tabulated
        """
        return None

    @property
    def attributes(self) -> dict[str, str]:
        """The attributes of `data`, as text that any file can hold; `provenance` as JSON.

        Example
        >>> m = gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18))
        >>> print(m.attributes["quantity"])
        brdf
        """
        attributes = {"quantity": self.quantity, "source": self.path}
        return attributes | ({"provenance": json.dumps(self.provenance)} if self.provenance else {})

    def _at(self, wavelengths: Any, known: np.ndarray | None) -> Self:
        if self.channels is None:
            return self
        if self.wavelengths is None:
            raise ParameterError(
                f"at: {self!r}: {self.channels} channels without wavelengths; of RGB gn.spectra.upsampled(m) makes "
                f"spectra"
            )
        return self._between(self.wavelengths, wavelengths)

    def _between(self, known: np.ndarray, wavelengths: Any) -> Self:
        """The measurement at wavelengths, between those that it has."""
        if np.array_equal(known, wavelengths):
            return self
        rule = "is not interpolated along wavelength"
        raise ParameterError(
            f"at: {self!r} of the format {self.format!r} {rule}; gn.tables.tabulate(m).at(wavelengths) is"
        )

    def __repr__(self) -> str:
        return f"load({self.path!r})" if self.path else f"<{type(self).__name__} measurement in memory>"

    def to_json(self) -> dict[str, Any]:
        raise ParameterError(f"{self!r}: a measurement has no JSON form; save it in its own format with gonio.save")
