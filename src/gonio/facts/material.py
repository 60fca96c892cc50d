"""Facts about a material and its file, as JSON data."""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.angles import direction, lattice_pairs
from ..base.calls import breaches
from ..base.map_shape import map_shape
from ..base.measured import Measured
from ..base.provenance import size_of
from ..base.reflectance import Reflectance
from ..base.reradiation import exchanges
from ..base.shown_channels import is_rgb, shown_as
from ..base.sides import said_of_sides
from ..catalogue import builtin
from ..errors import MissingDataWarning, ToleranceWarning
from ..formula import tree
from ..formula.fields import Option, Param, Table
from ..formula.parametrised import Parametrised
from ..integrals.albedo import albedo, kept_albedo
from ..integrals.photons import exchanged_in_words
from ..tables.gridded import Gridded
from ..tables.half_planes import half_planes
from ..tables.scattered import Scattered

INCIDENCE = (0.0, 45.0, 75.0)
"""Angles [degrees] at which `facts` gives the albedo."""

ASSUMPTIONS = ("independent", "common")
"""Default correlations of errors: the two extremes."""

EXACT = 1e-6
"""Relative difference up to which a symmetry counts as exact."""


def facts(text: str, m: Reflectance, computed: bool = True) -> dict[str, Any]:
    """Facts about the material that `text` names, as JSON data; `computed`: also those that take integrals."""
    result: dict[str, Any] = {"material": text, "type": type(m).__name__}
    if isinstance(m, Measured):
        result |= _file_facts(m)
    else:
        if entry := builtin.find(text):
            result |= {"built_in": entry.kind, "description": entry.description, "source": entry.source}
        result["expression"] = repr(m)
    names = m.channel_names
    result["channels"] = m.channels or 1
    result["channel_names"] = list(names) if names is not None else list("RGB") if m.channels == 3 else None
    places = map_shape(m)
    if places:
        result["places"] = list(places)
    result |= said_of_sides(m)
    result["has_delta"] = bool(m.has_delta)
    result["breaks"] = breaches(m)
    if exchanges(m):
        result["fluorescence"] = _fluorescence(m, known=not result.keys() & {"places", "sides"})
    if computed and not places:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MissingDataWarning)  # the facts say what is missing
            result |= _computed_facts(m)
    return result | settable(m)


def _fluorescence(m: Reflectance, known: bool) -> str:
    """What f does not show of a material that fluoresces; `known`: how much that is."""
    kept = "f, and albedos without a light, are of the light that keeps its wavelength"
    return f"{kept}; at another: {exchanged_in_words(m)}" if known else kept


def _computed_facts(m: Reflectance) -> dict[str, Any]:
    """Albedos, and of measurements symmetries, stated totals, and uncertainties of the albedos."""
    at = direction(np.radians(INCIDENCE), 0.0)
    rho = kept_albedo(m, at, 1e-3)
    result: dict[str, Any] = {"albedo": {"theta_i": list(INCIDENCE), "values": rho.tolist()}}
    if isinstance(m, Measured):
        result["symmetry"] = _symmetry(m)
        if m.stated_totals:
            result["stated_totals"] = _totals(m, m.stated_totals)
    if isinstance(m, Gridded):
        _, components = quoted(albedo, m, at)
        result["uncertainty_of_albedo"] = {how: u.tolist() for how, u in components.items()}
    return result


def albedos(m: Reflectance, wi: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Albedos (N, C) of light from directions (N, 3), and of a table that states uncertainties theirs, of independent
    errors."""
    from ..uncertainty import with_uncertainty  # late: SciPy takes 0.4 s, and formulas need none
    from ..uncertainty.table import has_uncertainty

    if not (isinstance(m, Gridded) and has_uncertainty(m)):
        return with_channels(albedo(m, wi, tolerance=1e-3), 1), None
    with_errors = with_uncertainty(albedo, m, wi, correlation="independent", tolerance=1e-3)
    return with_channels(with_errors.value, 1), with_channels(np.asarray(with_errors.u), 1)


def quoted(function: Callable[..., Any], m: Gridded, *args: Any) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """A result of a table, and the components of its standard uncertainty: by noise under each assumption, and by
    interpolation."""
    from ..uncertainty import with_uncertainty
    from ..uncertainty.table import has_uncertainty

    u = {}
    for how in ASSUMPTIONS if has_uncertainty(m) else (None,):
        with_error = with_uncertainty(function, m, *args, correlation=how, tolerance=1e-3)
        if how:
            u[how] = np.asarray(with_error.u_noise)
    return np.asarray(with_error.value), {**u, "interpolation": np.asarray(with_error.u_interpolation)}


def _totals(m: Reflectance, totals: Sequence[Any]) -> dict[str, Any]:
    """Reflectances by direction [degrees] and channel as the file states them, and as integrals of f."""
    at = np.transpose([[total.theta_i, total.phi_i] for total in totals])
    shares = np.array([total.shares for total in totals])
    tolerance = max(1e-3 * shares[shares > 0.0].min(initial=1.0), 1e-6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToleranceWarning)  # what files state has fewer digits
        rho = albedo(m, direction(*at), tolerance=tolerance).reshape(shares.shape)
    theta_i, phi_i = np.degrees(at).round(9).tolist()
    return {"theta_i": theta_i, "phi_i": phi_i, "stated": shares.tolist(), "integral": rho.tolist()}


def settable(m: Parametrised) -> dict[str, Any]:
    """The parameters and the options of a material, or of a term of a formula, by path."""
    parameters, options = {}, {}
    for path, declared, value in tree.settable(m):
        if isinstance(declared, Param) and path in m.parameters:
            p = m.parameters[path]
            listed = value.tolist() if isinstance(value, np.ndarray) else value
            parameters[path] = {"value": listed, "low": p.low, "high": p.high, "unit": p.unit, "doc": p.doc}
            if declared.alias:
                parameters[path]["alias"] = path.removesuffix(declared.name) + declared.alias
        elif isinstance(declared, Option):
            choices = list(dict.fromkeys(declared.choices))
            options[path] = {"value": value, "choices": choices, "doc": declared.doc}
    return {"parameters": parameters, "options": options}


def to_rgb(m: Reflectance) -> np.ndarray | None:
    """Matrix (C, 3) that turns channels into linear sRGB; None for channels that are no colours."""
    if (m.channels or 1) == 1:
        return np.ones((1, 3)) if m.channel_names is None or isinstance(m.channel_names[0], str) else None
    return np.eye(3) if is_rgb(m) else shown_as(m)


def _file_facts(m: Measured) -> dict[str, Any]:
    """Contents of a file; `missing` and `negative` are shares of its main table, None if its numbers are no f."""
    from ..uncertainty.table import SCALE, scale_uncertainty

    valid = m.valid
    tables = {name: getattr(m, name) for name, field in m.fields.items() if isinstance(field, Table)}
    tables = {name: table for name, table in tables.items() if table.shape == valid.shape}
    values = tables.get("values", next(iter(tables.values()), None))
    usable = None if values is None else values[valid]
    return {
        "path": m.path,
        "bytes": size_of(Path(m.path)) if os.path.exists(m.path) else None,
        "format": m.provenance.get("format", m.format),
        "quantity": m.quantity,
        "parameterization": getattr(m, "parameterization", None),
        "axes": {name: _axis(nodes) for name, nodes in getattr(m, "axes", {}).items()},
        "rows": len(m.rows) if isinstance(m, Scattered) else None,
        "half_planes": half_planes(m).tolist() if isinstance(m, Gridded) else [],
        "about": {name: _plain(value) for name, value in m.about.items() if name not in ("repairs", SCALE)},
        "published_as": getattr(m, "published", None),
        "shape": list(valid.shape),
        "missing": float(1.0 - valid.mean()),
        "negative": None if usable is None else float((usable < 0.0).mean()) if usable.size else 0.0,
        "uncertainty": None if values is None else _uncertainty(m, values),
        "scale_uncertainty": scale_uncertainty(m) if isinstance(m, Gridded) else 0.0,
        "repairs": [{**r.to_json(), "summary": str(r)} for r in m.repairs],
        "provenance": m.provenance,
    }


def _axis(nodes: np.ndarray) -> dict[str, Any]:
    """Number of nodes, range [degrees] and steps of an axis."""
    degrees = np.degrees(np.asarray(nodes, dtype=float))
    steps = np.diff(degrees)
    step = float(steps.mean()) if len(steps) and np.ptp(steps) <= 1e-4 * steps.mean() else None
    return {"nodes": len(degrees), "low": float(degrees[0]), "high": float(degrees[-1]), "step": step}


def _uncertainty(m: Measured, values: np.ndarray) -> dict[str, float] | None:
    """Median and range of the standard uncertainties relative to their values; None of measurements without any."""
    u = getattr(m, "uncertainty", None)
    if u is None or np.shape(u) != values.shape:
        return None
    usable = np.isfinite(values) & np.isfinite(u) & (values != 0.0)
    if not usable.any():
        return None
    relative = np.abs(np.asarray(u)[usable] / values[usable])
    unknown = (np.isfinite(values) & ~np.isfinite(u)).mean()
    shares = {"median": np.median(relative), "low": relative.min(), "high": relative.max(), "unknown": unknown}
    return {name: float(x) for name, x in shares.items()}


def _symmetry(m: Reflectance) -> dict[str, Any]:
    """Relative changes of f, median and 99th percentile, when the sample is turned, when both directions are mirrored
    at the x-z plane, and when they are exchanged; 0 for rounding."""
    wi, wo = lattice_pairs(4096)
    f = m.f(wi, wo)
    c, s = math.cos(1.1), math.sin(1.1)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    mirror = np.array([1.0, -1.0, 1.0])
    pairs = {"isotropic": (wi @ turn, wo @ turn), "plane-symmetric": (wi * mirror, wo * mirror), "reciprocal": (wo, wi)}
    return {name: _change(f, m.f(*pair)) for name, pair in pairs.items()}


def _change(a: np.ndarray, b: np.ndarray) -> dict[str, float] | None:
    both = np.isfinite(a) & np.isfinite(b)
    if not both.any():
        return None
    a, b = a[both], b[both]
    size = 0.5 * (np.abs(a) + np.abs(b))
    off = np.abs(a - b) / np.maximum(size, 1e-3 * size.mean() + 1e-30)
    change = {"median": float(np.median(off)), "high": float(np.quantile(off, 0.99))}
    return {name: 0.0 if value <= EXACT else value for name, value in change.items()}


def _plain(value: Any) -> Any:
    """Metadata as JSON data."""
    if hasattr(value, "tolist"):
        return value.tolist()
    try:
        json.dumps(value)
    except (TypeError, ValueError):
        return str(value)
    return value
