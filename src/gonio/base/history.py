"""Records of the repairs of a measurement, which `gonio.repair` leaves with it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from ..errors import FormatError

ALBEDO_AT = (0.0, 45.0, 75.0)
"""Angles [degrees] of incidence of the albedos in a `Repair`."""


class Repair(NamedTuple):
    """The change that an operation of `gonio.repair` made to a measurement.

    operation      its name; `parameters`: its arguments
    cells, share   nodes (above the horizon) with another value than before, in some channel; share of all
    filled         how many of them had no value before
    largest, mean  of |change of f| [1/sr], of values that changed; 0 where there were none before
    albedo_before  black-sky albedo at `ALBEDO_AT`, mean of the channels, before and after; directions without data
    albedo_after   count as 0
    figures        further numbers, by name, which the operation's documentation explains

    Example
    >>> m = gn.repair.remove_negatives(gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18)))
    >>> print(m.repairs[0].operation, m.repairs[0].cells)
    remove_negatives 0
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
        """As JSON data, for `m.about["repairs"]` and files. NaN becomes None.

        Example
        >>> m = gn.repair.remove_negatives(gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18)))
        >>> print(m.repairs[0].to_json()["operation"])
        remove_negatives
        """
        figures = {name: None if value != value else value for name, value in self.figures.items()}
        albedos = {n: None if a is None else list(a) for n, a in self._asdict().items() if n.startswith("albedo")}
        return {**self._asdict(), **albedos, "figures": figures}

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> Repair:
        """The record that `to_json` wrote. Raises FormatError where it is none.

        Example
        >>> m = gn.repair.remove_negatives(gn.tables.tabulate(gn.Lambertian(0.5), resolution=(9, 9, 18)))
        >>> record = type(m.repairs[0]).from_json(m.repairs[0].to_json())
        >>> print(record == m.repairs[0])
        True
        """
        try:
            values = {name: record[name] for name in cls._fields}
            for name in ("albedo_before", "albedo_after"):
                values[name] = None if values[name] is None else tuple(map(float, values[name]))
            values["figures"] = {n: math.nan if v is None else v for n, v in values["figures"].items()}
            return cls(**values)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise FormatError(
                f"repairs: {record!r:.100} is no record of a repair ({error!r:.60}); expected {', '.join(cls._fields)}"
            ) from None

    def __str__(self) -> str:
        arguments = ", ".join(f"{k}={_short(v)}" for k, v in self.parameters.items())
        text = f"{self.operation}({arguments}): {self.cells} cells ({self.share:.2%})"
        if self.filled:
            text += f", {self.filled} of them filled"
        if self.largest:
            text += f"; f changed by {self.mean:.3g}/sr, at most {self.largest:.3g}/sr"
        before = "" if self.albedo_before is None else " ".join(f"{a:.4f}" for a in self.albedo_before) + " to "
        text += f"; albedo {before}{' '.join(f'{a:.4f}' for a in self.albedo_after)}"
        return text + "".join(f"; {name.replace('_', ' ')} {_short(value)}" for name, value in self.figures.items())


def _short(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return f"({', '.join(map(_short, value))})"
    return f"{value:.3g}" if isinstance(value, float) else f"{value!r:.60}"
