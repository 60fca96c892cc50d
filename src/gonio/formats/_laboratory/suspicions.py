"""Numbers of a laboratory's table that are likely not what they are taken for."""

from __future__ import annotations

import math

import numpy as np

from ...base.angles import direction
from .names import WAVELENGTH
from .understanding import Understood

NEAR = math.cos(math.radians(10.0))
"""Cosine of the largest angle to the mirror direction, or to the light, of what is near it."""


def suspicions(table: Understood) -> list[str]:
    """What looks wrong, each with the option that would mend it."""
    return [*_of_values(table), *_of_uncertainties(table), *_of_wavelengths(table), *_of_azimuths(table)]


def _of_values(table: Understood) -> list[str]:
    found = []
    for (quantity, uncertain, channel), column in table.values.items():
        numbers = column[np.isfinite(column)]
        if uncertain or not len(numbers):
            continue
        of = f" of channel {channel}" if channel else ""
        median = float(np.median(numbers))
        if quantity == "reflectance factor" and median > 2.0:
            found.append(f"reflectance factors{of} with a median of {median:.3g}: percent? say value_unit='%'")
        elif quantity != "reflectance factor" and 1.2 < math.pi * median <= 4.0 and numbers.max() < 8.0 * median:
            found.append(
                f"values{of} with a median of {median:.3g} 1/sr, as if a surface reflected {math.pi * median:.2g} of "
                f"the light: reflectance factors? say quantity='reflectance factor'"
            )
        elif quantity != "reflectance factor" and math.pi * median > 4.0 and numbers.max() < 8.0 * median:
            found.append(
                f"values{of} with a median of {median:.3g} 1/sr: percent? say quantity='reflectance factor', "
                f"value_unit='%'"
            )
        negative = float((numbers < 0.0).mean())
        if negative > 0.2:
            found.append(f"{negative:.0%} of the values{of} are negative: is a dark signal subtracted twice?")
    return found[:3]


def _of_uncertainties(table: Understood) -> list[str]:
    for (quantity, uncertain, channel), u in table.values.items():
        if not uncertain:
            continue
        values = np.abs(table.values[quantity, False, channel])
        known = np.isfinite(u) & np.isfinite(values) & (values > 0.0)
        if not known.any():
            continue
        share = float(np.median(u[known] / values[known]))
        if (u[known] < 0.0).any():
            return ["uncertainties below 0: differences?"]
        if share > 0.5:
            return [
                f"uncertainties of {share:.0%} of the value (median): percent of the value? say uncertainty='relative'"
            ]
    return []


def _of_wavelengths(table: Understood) -> list[str]:
    nm = table.angles.get(WAVELENGTH, np.empty(0))
    if len(nm) and (nm.min() < 100.0 or nm.max() > 1e5):
        return [f"wavelengths from {nm.min():g} to {nm.max():g} nm: another unit? say wavelength_unit='um'"]
    return []


def _of_azimuths(table: Understood) -> list[str]:
    """A peak on the side of the light, where azimuths may be counted from the mirror direction."""
    angles = {key: x if table.in_radians else np.radians(x) for key, x in table.angles.items() if key != WAVELENGTH}
    column = next((v for (_, uncertain, _), v in table.values.items() if not uncertain), None)
    if column is None or not {"theta_i", "theta_o"} <= {*angles} or "radial" in angles:
        return []
    theta_i, theta_o = angles["theta_i"], angles["theta_o"]
    phi_i = angles.get("phi_i", 0.0 * theta_i)
    phi_o = angles["phi_o"] if "phi_o" in angles else phi_i + angles.get("phi", 0.0 * theta_i)
    wi, wo = direction(theta_i, phi_i), direction(theta_o, phi_o)
    mirror = (np.stack([-wi[:, 0], -wi[:, 1], wi[:, 2]], axis=1) * wo).sum(axis=1) > NEAR
    back = (wi * wo).sum(axis=1) > NEAR
    oblique = np.isfinite(column) & (np.abs(theta_i) > math.radians(19.9))
    peak, level = column[oblique & back], column[oblique & ~back]
    if not len(peak) or not len(level):
        return []
    ahead = column[oblique & mirror]
    other = float(ahead.max()) if len(ahead) else float(np.median(level))
    if peak.max() > (2.0 if len(ahead) else 4.0) * other > 0.0:
        there = f"near the mirror direction {other:.3g}" if len(ahead) else "and none are near the mirror direction"
        return [
            f"values near the direction of the light reach {peak.max():.3g}, {there}: are azimuths counted from "
            f"the mirror direction? say forward=0"
        ]
    return []
