"""Pairs of directions that were planned: as angles, as rows of text, as files. What plans share."""

from __future__ import annotations

import json
import math
import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.angles import angles
from ...errors import ParameterError, shown
from ...files import replacing


class Planned(ABC):
    """Pairs of directions wi, wo (n, 3), in the order in which arms are best set."""

    wi: np.ndarray
    wo: np.ndarray

    def __len__(self) -> int:
        return len(self.wi)

    @property
    def angles(self) -> np.ndarray:
        """(n, 4) theta_i, phi_i, theta_o, phi_o [degrees], phi_o - phi_i from 0 to 360.

        Example
        >>> arm = gn.planning.Goniometer(theta_i=(0.5, 0.5), theta_o=(0.5, 0.5), phi=(np.pi, np.pi))
        >>> print(gn.planning.plan(gn.Lambertian(0.5), 1, goniometer=arm).angles.round(2))
        [[ 28.65   0.    28.65 180.  ]]
        """
        (theta_i, phi_i), (theta_o, phi_o) = (angles(w) for w in (self.wi, self.wo))
        phi_i = np.where(self.wi[:, 2] > 1.0 - 1e-15, 0.0, phi_i)
        phi = (phi_o - phi_i + 1e-12) % (2.0 * math.pi)
        phi = np.where(self.wo[:, 2] > 1.0 - 1e-15, 0.0, phi)
        return np.degrees(np.stack([theta_i, phi_i, theta_o, phi_i + phi], axis=-1)).round(9) + 0.0

    @abstractmethod
    def to_csv(self, path: str | os.PathLike | None = None) -> str:
        """The directions as a CSV table with empty columns of values; written to a file where there is a path.

        Example
        >>> print(gn.planning.plan(gn.Lambertian(0.5), 1).to_csv().splitlines()[-2])
        theta_i,phi_i,theta_o,phi_o,f
        """

    @abstractmethod
    def to_json(self) -> dict[str, Any]:
        """The result as numbers, lists and words, for files.

        Example
        >>> print(len(gn.planning.plan(gn.Lambertian(0.5), 4).to_json()["directions"]))
        4
        """

    def save(self, path: str | os.PathLike) -> None:
        """Write the directions to a file: a CSV table, see `to_csv`, or all of `to_json` where its name ends in .json.

        Raises ParameterError for another suffix.

        Example
        >>> gn.planning.plan(gn.Lambertian(0.5), 4).save("plan.csv")
        """
        suffix = os.path.splitext(os.fspath(path))[1].lower()
        if suffix in (b".csv", ".csv"):
            self.to_csv(path)
        elif suffix in (b".json", ".json"):
            with replacing(path) as new:
                new.write_text(json.dumps(self.to_json(), indent=2) + "\n", encoding="utf-8")
        else:
            raise ParameterError(f"{shown(path)}: expected a name that ends in .csv or .json")

    def _rows_of_angles(self) -> list[dict[str, float]]:
        return [dict(zip(("theta_i", "phi_i", "theta_o", "phi_o"), row, strict=True)) for row in self.angles.tolist()]


def csv_of(angles: np.ndarray, columns: Sequence[str], made_for: str, by: str, path: str | os.PathLike | None) -> str:
    """A CSV table of angles with empty columns of values, after two lines of comment; written to a path, if any."""
    lines = [
        made_for,
        by,
        "# unit of f: 1/sr; angles in degrees; phi_o - phi_i = 180 is forwards",
        ",".join(["theta_i", "phi_i", "theta_o", "phi_o", *columns]),
    ]
    lines += [",".join([*(f"{x:.10g}" for x in row), *("" for _ in columns)]) for row in angles]
    text = "\n".join(lines) + "\n"
    if path is not None:
        with replacing(path) as new:
            new.write_text(text, encoding="utf-8")
    return text


def noise_told(noise: float, floor: float) -> str:
    """The noise of values, in words."""
    return f"noise {100.0 * noise:g} %" + (f" and {floor:g} /sr" if floor else "")


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of rows whose columns stand below each other."""
    widths = [max(len(row[c]) for row in rows) for c in range(len(rows[0]))]
    return ["  " + "  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows]
