"""The fields of an RGL tensor file: whether they fit together, and as a labelled dataset."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import FormatError
from .._reading.tensor_file import expect

if TYPE_CHECKING:
    import xarray


def check(fields: Mapping[str, np.ndarray], where: str) -> tuple[str, int]:
    """Which field holds S, and the reduction; FormatError where a field is missing or does not fit."""
    phi, theta = (expect(fields, where, name, (None,)) for name in ("phi_i", "theta_i"))
    ends = {"phi_i": (phi, -2.0 * math.pi, 2.0 * math.pi), "theta_i": (theta, 0.0, 0.5 * math.pi)}
    for name, (nodes, low, high) in ends.items():
        if not (np.isfinite(nodes).all() and (np.diff(nodes) > 0.0).all()):
            raise FormatError(f"{where}: {name} is {_short(nodes)}, expected finite, increasing numbers")
        if nodes[0] < low - 0.01 or nodes[-1] > high + 0.01:
            raise FormatError(
                f"{where}: {name} runs from {nodes[0]:g} to {nodes[-1]:g} rad, expected {low:g} to {high:g}"
            )
    reduction = 1
    if len(phi) > 2:
        span = float(phi[-1]) - float(phi[0])
        reduction = round(2.0 * math.pi / max(span, 0.1))
        if reduction not in (1, 2, 4) or abs(float(phi[0]) + math.pi) > 0.5:
            got = f"phi_i covers {math.degrees(phi[0]):.1f} to {math.degrees(phi[-1]):.1f} degrees"
            raise FormatError(f"{where}: {got}, expected -180 to 180, 0 or -90: all, half or a quarter of the circle")
    at = (len(phi), len(theta))
    main = "spectra" if "spectra" in fields else "rgb"
    if main not in fields:
        raise FormatError(f"{where}: holds neither spectra nor rgb; its fields: {', '.join(map(repr, fields)):.200}")
    n_channels = 3 if main == "rgb" else len(expect(fields, where, "wavelengths", (None,)))
    lum = expect(fields, where, "luminance", (*at, None, None))
    expect(fields, where, main, (*at, n_channels, *lum.shape[2:]))
    vndf = expect(fields, where, "vndf", (*at, None, None))
    sigma = expect(fields, where, "sigma", (None, None))
    expect(fields, where, "ndf", (None, None))
    expect(fields, where, "description", (np.size(fields.get("description", 0)),), "uint8")  # may be empty
    expect(fields, where, "jacobian", (1,), "uint8")
    for name in ("ndf", "sigma", "vndf", "luminance"):
        if min(fields[name].shape[-2:]) < 2:
            raise FormatError(f"{where}: {name} has shape {fields[name].shape}, expected at least 2 rows and columns")
    if main == "spectra":
        nm = fields["wavelengths"]
        if not (np.isfinite(nm).all() and (nm > 0.0).all() and (np.diff(nm) > 0.0).all()):
            raise FormatError(f"{where}: wavelengths is {_short(nm)}, expected positive, increasing numbers [nm]")
    if not (np.isfinite(sigma).all() and (sigma > 0.0).all()):
        raise FormatError(f"{where}: sigma holds {np.min(sigma):g}, expected positive, finite areas")
    lit = np.isfinite(vndf).all() and (vndf >= 0.0).all()
    if not lit or not (vndf.sum(axis=(2, 3), dtype=float) > 0.0).all():
        got = f"vndf holds numbers from {np.min(vndf):g} to {np.max(vndf):g}"
        raise FormatError(f"{where}: {got}, expected finite ones, none negative, for each wi some positive")
    return main, reduction


def _short(a: np.ndarray) -> str:
    return np.array2string(a, threshold=6, edgeitems=3, precision=4)


def dataset(m: Any) -> xarray.Dataset:
    """The file's fields as they were stored; angles of the grids' nodes as coordinates."""
    import xarray

    lit, third = ("phi_i", "theta_i"), "wavelength" if m.main == "spectra" else "channel"
    axes = {
        "phi_i": (("phi_i",), "rad", "azimuth of the incident direction"),
        "theta_i": (("theta_i",), "rad", "polar angle of the incident direction"),
        "wavelengths": (("wavelength",), "nm", "wavelength"),
        "ndf": (("phi_ndf", "theta_ndf"), "sr-1", "distribution of the half vectors"),
        "sigma": (("phi_sigma", "theta_sigma"), "1", "projected area of the facets"),
        "vndf": ((*lit, "phi_m", "theta_m"), "1", "visible half vectors, per area of the grid"),
        "luminance": ((*lit, "s_y", "s_x"), "1", "luminance of the values"),
        m.main: ((*lit, third, "s_y", "s_x"), "1" if m.divided else "sr-1", m.quantity),
        "description": (("character",), "1", "description, UTF-8"),
        "jacobian": (("flag",), "1", "1: values are divided by ndf / (4 sigma)"),
        "valid": (("valid_byte",), "1", "bit mask of the measured samples, as stored"),
    }
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {}
    for name, a in m.stored.items():
        if name in axes and len(axes[name][0]) == a.ndim and (name != "wavelengths" or third == "wavelength"):
            dims, units, long_name = axes[name]
            variables[name] = (dims, a, {"units": units, "long_name": long_name})
        else:
            variables[f"field_{name}"] = (tuple(f"field_{name}_{k}" for k in range(a.ndim)), a, {})
    for name in ("ndf", "sigma", "vndf"):
        (phi, theta), (rows, columns) = axes[name][0][-2:], m.stored[name].shape[-2:]
        coordinates[phi] = (phi, np.linspace(-math.pi, math.pi, rows), {"units": "rad"})
        coordinates[theta] = (theta, 0.5 * math.pi * np.linspace(0.0, 1.0, columns) ** 2, {"units": "rad"})
    unit = {"units": "nm"} if third == "wavelength" else {}
    coordinates[third] = (third, list(m.channel_names), unit)
    return xarray.Dataset(variables, coordinates, {**m.attributes, "description": m.about["description"]})
