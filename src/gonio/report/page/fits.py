"""How near models and built-in materials come to a material, and where they do not."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...base.measured import Measured
from ...base.reflectance import Reflectance
from ...catalogue import builtin
from ...catalogue.expressions import expression
from ...errors import Error, ParameterError
from ...evaluate.tracing import content
from ...figures._slices import bounded, f_in_plane, incidences, lit_range
from ...fitting.fitting import fit
from ...fitting.result import Fit
from ...reconstruction.nearness import nearest, require_reflecting
from . import curves
from .guarded import in_a_line

MODELS = (
    "Lambertian() + Microfacet(GGX(), Schlick())",
    "Lambertian() + ABC()",
    "OrenNayar() + Microfacet(Beckmann(), Schlick())",
)
"""Models that are fitted, as expressions: their numbers are one start."""

SIMPLER = 2
"""How many of them are fitted to formulas."""

NEAREST = 5
"""Built-in materials that are named."""

COMPARED = (15.0, 45.0, 75.0)
"""Angles of incidence [degrees] at which the best fit is drawn."""

EXACT = 1e-9
"""Root mean square of residuals, over that of the values, up to which a model is the material itself."""

CHANNELS = 16
"""The most channels that are fitted."""


def fits_of(m: Reflectance, name: str = "") -> dict[str, Any]:
    """The built-in materials that are most like this one, but for that of its name, and fits of models with their
    residuals, the best first."""
    report: dict[str, Any] = {
        "measured": isinstance(m, Measured),
        "nearest": [],
        "models": [],
        "exact": [],
        "reasons": [],
    }
    entry = builtin.find(name)
    try:
        require_reflecting(m)
    except ParameterError as error:
        report["reasons"].append(in_a_line(error))
        return report
    try:
        for match in nearest(m, count=NEAREST + 1):
            is_itself = entry is not None and match.name == entry.name and match.distance == 0.0
            if match.rank and not is_itself and len(report["nearest"]) < NEAREST:
                row = {"name": match.name, "distance": match.distance, "compared": match.compared, "what": match.what}
                report["nearest"].append(row)
    except Error as error:
        report["reasons"].append(in_a_line(error))
    if (m.channels or 1) > CHANNELS:
        report["reasons"].append(f"fits: {m.channels} channels; gonio fit does these, one by one")
        return report
    fits = []
    for text in MODELS if isinstance(m, Measured) else MODELS[:SIMPLER]:
        model = expression(text)
        if content(model).structure == content(m).structure:
            report["exact"].append(text)  # the formula of the material itself
            continue
        try:
            fits.append((text, fit(m, model)))
        except Error as error:
            if (reason := in_a_line(error)) not in report["reasons"]:
                report["reasons"].append(reason)
    fits.sort(key=lambda pair: pair[1].rms)
    report["exact"] += [text for text, of in fits if of.rms <= EXACT * _size(of)]
    fits = [(text, of) for text, of in fits if text not in report["exact"]]
    report["models"] = [_told(text, of) for text, of in fits]
    if fits:
        report["residuals"] = _residuals(m, fits[0][1])
    return report


def _size(of: Fit) -> float:
    """The root mean square of the values that were fitted, in the unit of the residuals: 1/sr, or their uncertainty."""
    s = of.problem.samples
    values = s.f[s.valid] / (s.u[s.valid] if of.loss == "likelihood" and s.u is not None else 1.0)
    return float(np.sqrt(np.mean(values**2)))


def _told(text: str, of: Fit) -> dict[str, Any]:
    return {
        "model": text,
        "found": of.title,
        "loss": of.loss,
        "rms": of.rms,
        "chi2_per_free": of.cost / max(of.free, 1) if of.loss == "likelihood" else None,
        "values": of.used,
        "parameters": [dict(zip(("name", "value", "remark"), row, strict=True)) for row in of.rows()],
        "by_incidence": [c._asdict() for c in of.by_incidence()],
        "notes": list(of.notes),
    }


def _residuals(m: Reflectance, of: Fit) -> list[dict[str, Any]]:
    """f of the material and of the best model in the plane of incidence."""
    known, within = incidences(m), bounded(m)
    thetas = (
        sorted({min(known, key=lambda t: abs(t - theta)) for theta in COMPARED})
        if isinstance(m, Measured)
        else COMPARED
    )
    rows = []
    for theta in thetas:
        views = curves.views_about(theta)
        f = f_in_plane(within, theta, views)
        model = f_in_plane(of.model, theta, views) if theta <= lit_range(m)[1] + 1.0 else np.full(len(views), np.nan)
        rows.append({"theta_i": theta, "views": views.tolist(), "f": f.tolist(), "model": model.tolist()})
    return rows
