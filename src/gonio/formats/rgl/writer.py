"""Any reflectance as the fields of an RGL tensor file.

The format leaves free which D, sigma and density of half vectors a file has, as long as its values S fit them. Here
D is that of Dupuy and Jakob: the eigenvector of D(w) = c f(w, w) cos(theta) sigma(w), sigma(w) = int D(m) <w, m> dm,
so that S is nearly constant for facets that mirror. The density is uniform in theta_m up to where wo meets the
horizon, and the same for every azimuth: no node is wasted below it, and every row of S has its own azimuth. Nodes
at the horizon itself continue f cos(theta_o) below it, where it is negative.
Source: Dupuy & Jakob 2018, ACM TOG 37(6):274, sections 4 and 5; density and continuation are chosen here, by measured
error.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ...base.angles import angles, direction
from ...base.measured import Measured, tabular_shape
from ...base.provenance import ORIGIN, origin
from ...base.reflectance import Reflectance
from ...errors import ParameterError
from ...formula.table_warp import ONE, MarginalWarp, bilinear, tables
from ...numerics.filling import filled
from ...numerics.lattice import lattice
from ...pictures.colour import LUMINANCE, RELATIVE_XYZ, XYZ, rgb_of
from ...tables.axes import fits
from ...tables.nodes import own_nodes

RESOLUTION, THETA_I, PHI_I = 64, 25, 32
"""Rows and columns of half vectors, and counts of polar angles and azimuths of wi, where a caller does not say."""

OWN = 90
"""Most incidences of a measurement that are nodes of a file."""

APART = 0.02
"""Distance [rad] of default nodes from those of a measurement: what lies between these is interpolated better."""

RIGHT = 0.5 * math.pi
GRAZING = 1e-3  # cosine up to which f is asked for
RETRO_GRAZING = 0.1  # cosine up to which D follows f(w, w)
COLUMNS = 128  # of the density, over theta_m
LEAST_D, LEAST_LUMINANCE = 1e-6, 1e-3  # of the largest, of the mean
ROUNDS = 8  # of the iteration for D

PROVENANCE = "provenance"
"""Name of a field beside those of the format, which other readers pass over."""


class _Source(NamedTuple):
    """A reflectance as a file can hold it: RGB, or by wavelengths in increasing order."""

    m: Reflectance
    wavelengths: np.ndarray | None
    order: list[int]
    colours: np.ndarray | None = None

    def f(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """f (..., C), NaN where there is none."""
        shape = np.broadcast_shapes(wi.shape, wo.shape)
        wi, wo = (np.broadcast_to(w, shape).reshape(-1, 3) for w in (wi, wo))
        f = self.m.f(wi, wo).reshape(len(wi), -1)[:, self.order]
        f = (f if self.colours is None else f @ self.colours).reshape(*shape[:-1], -1)
        return np.where(np.isfinite(f), f, np.nan)

    def luminance(self, values: np.ndarray) -> np.ndarray:
        """One number of values (..., C), which samples are distributed by."""
        return values @ LUMINANCE if self.wavelengths is None else values.mean(axis=-1)


def _source(m: Reflectance) -> _Source:
    shape = tabular_shape(m)
    names = m.channel_names
    if names is not None and all(isinstance(x, (int, float)) for x in names):
        nm = np.asarray(names, dtype=np.float32)
        order = np.argsort(nm)
        if nm.min() <= 0.0 or (np.diff(nm[order]) <= 0.0).any():
            raise ParameterError(f"{m!r:.80}: wavelengths are {names!r:.80}, expected positive, different ones [nm]")
        return _Source(m, nm[order], order.tolist())
    if shape in ((), (1,)):
        return _Source(m, None, [0, 0, 0])
    if shape == (3,) and names in (None, ("R", "G", "B"), XYZ, RELATIVE_XYZ):
        return _Source(m, None, [0, 1, 2], rgb_of(names))
    rule = "expected one, R, G and B, or wavelengths [nm], or X, Y and Z, which become R, G and B"
    raise ParameterError(f"{m!r:.80}: has channels {names or shape[0]!r:.80}, {rule}")


def fields(
    m: Reflectance, resolution: int = RESOLUTION, theta_i: int | None = None, phi_i: int = PHI_I
) -> dict[str, np.ndarray]:
    """The fields of a file: S on resolution x resolution nodes for each of theta_i polar angles and phi_i azimuths of
    wi; by default the incidences of a measurement are among them. Raises ParameterError for materials that no such file
    holds.
    """
    source = _source(m)
    oriented = not m.is_isotropic()
    thetas = RIGHT * np.linspace(0.0, 1.0, theta_i or THETA_I) ** 0.7  # denser towards grazing, where more happens
    own = own_nodes(m).get("theta_i", np.zeros(0)) if theta_i is None else np.zeros(0)
    if 0 < len(own) <= OWN:
        others = thetas[np.abs(thetas[:, None] - own).min(axis=1) > APART]
        thetas = np.sort(np.concatenate([own, others]))
    thetas[-1] = min(thetas[-1], math.acos(GRAZING))
    fits(resolution**2 * len(thetas) * (phi_i if oriented else 1), f"{resolution=}, theta_i={len(thetas)}, {phi_i=}")
    phis = np.zeros(1)
    if oriented:
        parts = _reduction(source)
        phis = np.linspace(-math.pi, -math.pi + 2.0 * math.pi / parts, phi_i // parts + 1)
    thetas, phis = thetas.astype(np.float32), phis.astype(np.float32)
    ndf, sigma = _facets(source, oriented)
    vndf = np.stack([[_visible(t, p, resolution) for t in thetas.tolist()] for p in phis.tolist()])
    values, luminance = _values(source, thetas, phis, ndf, sigma, vndf)
    about = m.about if isinstance(m, Measured) else {}
    named = {"rgb": values} if source.wavelengths is None else {"wavelengths": source.wavelengths, "spectra": values}
    return {
        "description": _text(str(about.get("description") or f"{m!r:.200}")),
        "phi_i": phis,
        "theta_i": thetas,
        "sigma": sigma,
        "ndf": ndf,
        "vndf": vndf,
        "luminance": luminance,
        **named,
        "jacobian": np.ones(1, np.uint8),
        PROVENANCE: _text(json.dumps({ORIGIN: origin(m)})),
    }


def history(fields: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The source that `fields` noted in a file that gonio wrote; nothing of other files."""
    if PROVENANCE not in fields:
        return {}
    try:
        provenance = json.loads(fields[PROVENANCE].tobytes())
    except (ValueError, RecursionError):
        return {}
    source = provenance.get(ORIGIN) if isinstance(provenance, dict) else None
    return {ORIGIN: source} if isinstance(source, dict) else {}


def _text(text: str) -> np.ndarray:
    return np.frombuffer(text.encode("utf-8"), np.uint8)


def _reduction(source: _Source) -> int:
    """Into how many parts of the circle the material repeats: 4 with two planes of symmetry, 2 if turning by pi
    changes nothing, else 1."""
    u = lattice(512, 4)
    theta = np.arccos(1.0 - 0.95 * u[:, :2])
    pair = [direction(theta[:, k], 2.0 * math.pi * u[:, 2 + k]) for k in range(2)]
    f = source.f(*pair)
    same = [
        np.allclose(source.f(*(w * signs for w in pair)), f, rtol=1e-6, atol=1e-12, equal_nan=True)
        for signs in ([1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0])
    ]
    return 4 if all(same) else 2 if same[2] else 1


def _facets(source: _Source, oriented: bool) -> tuple[np.ndarray, np.ndarray]:
    """D and sigma, tables over azimuth and square root of the polar angle."""
    rows, columns = (129, COLUMNS) if oriented else (1, 256)
    coarse = (33, 33) if oriented else (1, COLUMNS)
    x = np.linspace(0.0, 1.0, columns)
    w = direction(np.minimum(RIGHT * x * x, math.acos(RETRO_GRAZING)), _azimuths(rows)[:, None])
    seen = np.maximum(filled(source.luminance(source.f(w, w))), 0.0) * w[..., 2]
    seen = np.maximum(seen, LEAST_D * seen.max() + 1e-30)
    area = _projection(coarse, rows, x)
    down, across = _hat(coarse[0], rows), _hat(coarse[1], columns)

    def sigma_of(D: np.ndarray) -> np.ndarray:
        return (area @ D[: max(rows - 1, 1)].astype(np.float32).reshape(-1)).reshape(coarse)

    D = seen
    for _ in range(ROUNDS):
        D = seen * (down @ sigma_of(D) @ across.T)
        D /= sigma_of(D)[0, 0]  # together facets cover the surface once
    D, sigma = np.maximum(D, LEAST_D * D.max()), np.maximum(sigma_of(D), 1e-6)
    if not oriented:
        D, sigma = np.repeat(D, 2, axis=0), np.repeat(sigma, 2, axis=0)
    return D.astype(np.float32), sigma.astype(np.float32)


def _projection(to: tuple[int, int], rows: int, x: np.ndarray) -> np.ndarray:
    """The matrix from D, at `rows` azimuths (without the last, the first again) and columns at x, to sigma at the nodes
    of a grid of shape `to`; one row stands for all azimuths."""
    around, theta = _azimuths(rows if rows > 1 else 65)[:-1], RIGHT * x * x
    steps = np.full(len(x), 1.0 / (len(x) - 1))
    steps[[0, -1]] *= 0.5
    solid_angle = np.sin(theta) * (2.0 * RIGHT * x) * steps * (2.0 * math.pi / len(around))
    # Single precision: this is the largest array here, and sigma is stored so.
    wm = direction(theta, around[:, None]).reshape(-1, 3).astype(np.float32)
    w = direction(RIGHT * np.linspace(0.0, 1.0, to[1]) ** 2, _azimuths(to[0])[:, None]).reshape(-1, 3)
    area = np.maximum(w.astype(np.float32) @ wm.T, 0.0).reshape(len(w), len(around), len(x))
    area *= solid_angle.astype(np.float32)
    return (area if rows > 1 else area.sum(axis=1)).reshape(len(w), -1)


def _azimuths(count: int) -> np.ndarray:
    return np.linspace(-math.pi, math.pi, count) if count > 1 else np.zeros(1)


def _hat(count: int, wanted: int) -> np.ndarray:
    """The matrix that interpolates `count` numbers at `wanted` places, all evenly spaced and with the same ends."""
    places = np.linspace(0.0, 1.0, wanted)
    return np.stack([np.interp(places, np.linspace(0.0, 1.0, count), row) for row in np.eye(count)], axis=-1)


def _visible(theta_i: float, phi_i: float, rows: int) -> np.ndarray:
    """The density of half vectors (rows, COLUMNS): uniform in theta_m up to the horizon of wo, which is reached where
    tan(2 theta_m) = -1/(tan(theta_i) cos(phi_m - phi_i)); 1 on average in every row."""
    phi = _azimuths(rows)[:, None] - phi_i
    x = np.linspace(0.0, 1.0, COLUMNS)
    end = np.sqrt(0.5 * np.arctan2(math.cos(theta_i), -math.sin(theta_i) * np.cos(phi)) / RIGHT)
    density = x * np.clip((end - x) * (COLUMNS - 1) + 1.0, 0.0, 1.0)
    mean = (density[:, 1:] + density[:, :-1]).mean(axis=1, keepdims=True) * 0.5
    return (density / mean).astype(np.float32)


def _reflected(source: _Source, wi: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """f cos(theta_o), continued below the horizon of wo to first order, and the solid angle of wo per area of the
    square at (x, y)."""
    wm = direction(RIGHT * x * x, (2.0 * y - 1.0) * math.pi)
    cos_d = wm @ wi
    wo = 2.0 * cos_d[..., None] * wm - wi
    phi_o, cos_o = angles(wo)[1], np.maximum(np.abs(wo[..., 2:]), GRAZING)
    value = source.f(wi, direction(np.arccos(cos_o[..., 0]), phi_o)) * cos_o
    below = wo[..., 2] < GRAZING
    end = source.f(wi, direction(math.acos(GRAZING), phi_o[below])) * GRAZING
    value[below] = 2.0 * end - value[below]
    return value, 8.0 * math.pi**2 * x * np.sin(RIGHT * x * x) * cos_d


def _values(
    source: _Source, thetas: np.ndarray, phis: np.ndarray, ndf: np.ndarray, sigma: np.ndarray, vndf: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """S (phi_i, theta_i, C, n, n), and the luminance that samples are drawn by (phi_i, theta_i, n, n)."""
    n = vndf.shape[2]
    cells, ends, conditional, marginal, _ = (t.reshape(-1) for t in tables(vndf))
    warp = MarginalWarp(cells, ends, conditional, marginal, (n, COLUMNS), len(phis) * len(thetas))
    # Not 1 itself: by rounding it may lie beyond the place where the density ends.
    sy, sx = np.meshgrid(*[np.linspace(0.0, 1.0 - 1e-10, n)] * 2, indexing="ij")
    flat_ndf, flat_sigma = (a.astype(float).reshape(-1) for a in (ndf, sigma))
    rows = []
    for k, (phi_i, theta_i) in enumerate((p, t) for p in phis.tolist() for t in thetas.tolist()):
        at = ((k, 1.0),)
        x, y = warp.sample(at, sx, sy)
        f, solid_angle = _reflected(source, direction(theta_i, phi_i), x, y)
        place = math.sqrt(theta_i / RIGHT), (phi_i + math.pi) / (2.0 * math.pi)
        D, area = bilinear(flat_ndf, ONE, ndf.shape, x, y), bilinear(flat_sigma, ONE, sigma.shape, *place)
        density = warp.eval(at, x, y)
        per_square = np.where(density > 0.0, solid_angle / np.where(density > 0.0, density, 1.0), 0.0)
        rows.append((f * (4.0 * area / D)[..., None], source.luminance(f) * per_square))
    values, luminance = (
        np.stack(part).reshape(len(phis), len(thetas), *part[0].shape) for part in zip(*rows, strict=True)
    )
    values = np.stack([filled(values[..., c]) for c in range(values.shape[-1])], axis=2)
    luminance = np.maximum(np.nan_to_num(luminance), 0.0)
    mean = luminance.mean(axis=(-2, -1), keepdims=True)
    luminance += np.where(mean > 0.0, LEAST_LUMINANCE * mean, 1.0)
    return values.astype(np.float32), luminance.astype(np.float32)
