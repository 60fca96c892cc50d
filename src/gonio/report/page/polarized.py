"""What a material does to the polarization of light."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...base.angles import direction
from ...base.reflectance import Reflectance
from ...figures._slices import one_number, plane, viewed_from

INCIDENCES = (15.0, 45.0, 60.0, 75.0)
"""Angles of incidence [degrees] at which it is shown."""

VIEWS = np.linspace(-89.5, 89.5, 359)
"""Viewing angles [degrees]."""


def polarization(m: Reflectance) -> dict[str, Any]:
    """The degree of linear polarization of the light that leaves, of unpolarised light that arrives, in the plane of
    incidence; Mueller matrices at the mirror directions over their first element; and those of delta lobes."""
    phi = plane(m)
    wi = direction(np.radians(INCIDENCES), phi)
    mirrors = direction(np.radians(INCIDENCES), phi + math.pi)
    seen = np.array([[*viewed_from(m, VIEWS), mirror] for mirror in mirrors])
    # pair by pair, as the laws ask: the kernel of a Mueller matrix takes long to compile
    pairs = np.repeat(wi, seen.shape[1], axis=0), seen.reshape(-1, 3)
    rows, matrices = [], []
    for theta, mirror_wo, M in zip(
        INCIDENCES, mirrors, _one(m, m.mueller(*pairs)).reshape(*seen.shape[:2], 4, 4), strict=True
    ):
        of_views, mirror = M[:-1], M[-1]
        with np.errstate(all="ignore"):
            degree = np.hypot(of_views[:, 1, 0], of_views[:, 2, 0]) / of_views[:, 0, 0]
        rows.append({"theta_i": theta, "views": VIEWS.tolist(), "degree": degree.tolist()})
        if mirror[0, 0] <= 0.0 and m.has_delta:
            mirror = _one(m, m.delta_mueller(mirror_wo))
        if mirror[0, 0] > 0.0:
            matrices.append(
                {"theta_i": theta, "first": float(mirror[0, 0]), "matrix": (mirror / mirror[0, 0]).tolist()}
            )
    known = any(np.isfinite(row["degree"]).any() for row in rows)
    return {"degree": rows if known else [], "mirror": matrices, "delta": not known}


def _one(m: Reflectance, M: np.ndarray) -> np.ndarray:
    """Mueller matrices of all channels as that of one number, as curves are."""
    if m.channels is None:
        return np.asarray(M, float)
    number, _ = one_number(m)
    return np.asarray(number(np.moveaxis(M, -3, -1)), float)
