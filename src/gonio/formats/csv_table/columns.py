"""Columns of angles and of values as a measurement: a grid where rows are the nodes of one, else rows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ...base.angles import angles
from ...errors import FormatError, held_by
from ...numerics.unique_rows import unique_rows
from ...tables.angle_systems import ANGLES, SYSTEMS, AngleSystem
from ...tables.axes import INSIDE
from ...tables.gridded import Gridded
from .._reading import channel_words
from .._rows.direction_pairs import Pairs, grid_of, gridded, half_circle, material
from .words import OPTIONS


class _FileTable(NamedTuple):
    """The content of a file; `axes` are the names of the columns of angles [rad] in `pairs`."""

    path: str
    axes: tuple[str, ...]
    pairs: Pairs
    about: dict[str, Any]
    options: dict[str, str]


def _measured(path: str, angles: dict[str, np.ndarray], columns: Mapping[tuple[str, bool, str], np.ndarray]) -> Pairs:
    """The rows, with the columns of angles as they are."""
    quantities = {quantity for quantity, _, _ in columns}
    names = [channel for _, uncertain, channel in columns if not uncertain]
    spreads = [channel for _, uncertain, channel in columns if uncertain]
    one_per_channel = bool(names) and (names == [""] or "" not in names)
    if len(quantities) != 1 or not one_per_channel or (spreads and sorted(spreads) != sorted(names)):
        raise FormatError(
            f"{path}: columns of values are {names} of {sorted(quantities)}, of uncertainties {spreads}; expected one "
            f"quantity, one column or one per channel, and uncertainties of none or of all"
        )
    (quantity,) = quantities
    values = np.stack([columns[quantity, False, name] for name in names], axis=1)
    spread = np.stack([columns[quantity, True, name] for name in names], axis=1) if spreads else None
    rows = np.stack([*angles.values()], axis=1)
    if names != [""]:
        return Pairs(rows, values, quantity, spread, channel_words.of_names(names))
    return Pairs(rows, values[:, 0], quantity, None if spread is None else spread[:, 0])


def of_columns(
    path: str,
    angles: dict[str, np.ndarray],
    values: Mapping[tuple[str, bool, str], np.ndarray],
    about: dict[str, Any],
    side: str | None,
    advice: str = "",
) -> Any:
    options = {key: about.pop(key) for key in OPTIONS if key in about}
    unit = options.get("angle_unit", "deg").lower()
    if unit not in ("deg", "degree", "degrees", "rad", "radian", "radians"):
        raise FormatError(f"{path}: angle_unit: {unit}, expected deg or rad")
    wavelength = angles.pop("wavelength", None)
    axes = next((axes for axes in _COLUMNS if set(angles) == set(axes)), None)
    if axes is None:
        expected = "; ".join(map(", ".join, _COLUMNS))
        raise FormatError(
            f"{path}: columns of angles are {', '.join(angles) or 'missing'}, expected {expected}{advice}"
        )
    pairs = _measured(path, {name: angles[name] for name in axes}, values)
    if wavelength is not None:
        pairs = _of_all_channels(path, pairs, wavelength)
    if unit.startswith("deg"):
        pairs = pairs._replace(angles=np.radians(pairs.angles))
    if not np.isfinite(pairs.angles).all():
        raise FormatError(f"{path}: an angle is no number")
    return _of_angles(_FileTable(path, axes, pairs, about, options), _COLUMNS[axes], side)


IN_PLANE = ("theta_i", "theta_o")
_COLUMNS = {
    **{axes: system for system in reversed(SYSTEMS.values()) for axes in (system.isotropic, system.oriented)},
    IN_PLANE: SYSTEMS["angles"],
}
"""Columns of angles -> their system, the first of `SYSTEMS` if several have them."""


def _of_angles(table: _FileTable, system: AngleSystem, side: str | None) -> Any:
    path, names, pairs, about, options = table
    columns = dict(zip(names, pairs.angles.T, strict=True))
    periods = {k.removeprefix("period_"): _radians(path, k, v) for k, v in options.items() if k.startswith("period_")}
    one_azimuth = "phi_i" in columns and np.ptp(columns["phi_i"]) == 0.0 and "mirrored" not in options
    rows_only = "isotropic" in options or names == IN_PLANE or one_azimuth
    axes_and_order = None if rows_only else grid_of(columns, pairs, path)
    if axes_and_order and all(_is_axis(n, x) for n, x in axes_and_order[0].items()):
        return _on_grid(table, system.name, *axes_and_order, periods)
    isotropic = len(columns) < 4 or one_azimuth
    if "isotropic" in options:
        isotropic = options["isotropic"].lower() == "true"
    if system.name == "angles":
        theta_i, theta_o, *phi = columns.values()
        phi_i, phi_o = phi if len(phi) == 2 else (0.0 * theta_i, phi[0] if phi else 0.0 * theta_i)
    else:
        wi, wo = system.pairs(*columns.values())
        (theta_i, phi_i), (theta_o, phi_o) = angles(wi), angles(wo)
        if isotropic:
            phi_i, phi_o = 0.0 * phi_i, phi_o - phi_i
    pairs = pairs._replace(angles=np.stack([theta_i, phi_i, theta_o, phi_o], axis=1))
    stated = isotropic if "isotropic" in options or isotropic else None
    return material(pairs, path, about, side, stated, options.get("outside", "hold"))


def _on_grid(
    table: _FileTable, name: str, axes: dict[str, np.ndarray], order: np.ndarray, periods: dict[str, float]
) -> Gridded:
    """The grid; by default half a circle of phi is mirrored, and half a circle of phi_d means reciprocity."""
    path, _, pairs, about, options = table
    if "phi_i" in options and "phi" in axes:
        about = {**about, "phi_i": _radians(path, "phi_i", options["phi_i"])}
    if "phi_d" in axes and "phi_d" not in periods and half_circle(axes["phi_d"]):
        periods["phi_d"] = math.pi
    mirrored = len(axes) == 3 and "phi" in axes and half_circle(axes["phi"])
    if "mirrored" in options:
        mirrored = options["mirrored"].lower() == "true"
    more: dict[str, Any] = {k: options[k] for k in ("interpolation", "outside") if k in options}
    more |= {"mirrored": mirrored, "periods": periods or None, "path": path, "about": about}
    with held_by(path):
        return gridded(name, axes, order, pairs, **more)


def _radians(path: str, key: str, degrees: str) -> float:
    try:
        return math.radians(float(degrees))
    except ValueError:
        raise FormatError(f"{path}: {key}: {degrees!r}, expected degrees") from None


def _is_axis(name: str, nodes: np.ndarray) -> bool:
    highest = ANGLES[name].highest
    if highest is None:
        return bool(np.ptp(nodes) <= 2.0 * math.pi + 1e-6)
    return bool(nodes[0] >= 0.0 and nodes[-1] <= highest + INSIDE)


def _of_all_channels(path: str, pairs: Pairs, wavelength: np.ndarray) -> Pairs:
    """Rows of one channel each as rows of all channels; nan where a pair has no value in a channel."""
    if pairs.channels is not None:
        raise FormatError(f"{path}: a column wavelength and channels {pairs.channels}, expected one of these")
    pairs = pairs.by_channel(wavelength, path)
    if not np.isfinite(wavelength).all() or len(unique_rows(pairs.angles)[0]) < len(pairs.angles):
        raise FormatError(
            f"{path}: a wavelength is no number, or one of {len(pairs.angles)} pairs has several values at one "
            f"wavelength; expected each pair once at each wavelength"
        )
    return pairs
