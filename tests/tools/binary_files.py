"""Small binary files of databases, or what is in them, made of random numbers: for their tests and as seeds."""

from __future__ import annotations

import math
import struct

import numpy as np

from gonio.formats import neural

NODES = np.array([-1.0, -0.75, -0.5, -0.2, 0.0, 0.0, 0.2, 0.5, 0.75, 1.0], "f4")


def layered(pairs, channels=1, nodes=NODES, metadata=b"{}", orders=None):
    """A file of {(mu_o, mu_i): coefficients (channels, orders)}."""
    n = len(nodes)
    places, series, at = np.zeros((n, n, 2), "<u4"), [], 0
    for (o, i), values in pairs.items():
        values = np.array(values, "<f4").reshape(channels, -1)
        row = np.flatnonzero(nodes == np.float32(o))[0]
        column = np.flatnonzero(nodes == np.float32(i))[0]
        places[row, column] = at, values.shape[1]
        series.append(values.reshape(-1))
        at += values.size
    orders = max((places[..., 1].max(), 1)) if orders is None else orders
    head = struct.pack("<7sB9I", b"SCATFUN", 1, 1, n, at, orders, channels, 1, len(metadata), 0, 0)
    head += struct.pack("<5f", 1.0, 0.0, 0.0, 0.0, 0.0)
    body = [nodes.astype("<f4"), np.zeros((n, n), "<f4"), places, np.concatenate(series)]
    return head + b"".join(a.tobytes() for a in body) + metadata


def random_layered(channels, seed=3):
    rng = np.random.default_rng(seed)
    pairs = {}
    for o in (0.2, 0.5, 0.75, 1.0, -0.5):
        for i in (-0.2, -0.5, -0.75, -1.0, 0.5):
            orders = int(rng.integers(1, 40))
            pairs[o, i] = rng.normal(size=(channels, orders)) / (1.0 + np.arange(orders))
    return layered(pairs, channels)


def polarized(seed=1, counts=(9, 8, 13), wavelengths=(450, 500, 550, 600, 650), holes=0.0):
    """Fields of a file, random matrices."""
    rng = np.random.default_rng(seed)
    axes = [np.linspace(0.0, np.pi / 2, n, dtype="f4") for n in counts[:2]]
    axes.append(np.linspace(-np.pi, np.pi, counts[2], dtype="f4"))
    M = rng.uniform(0.1, 1.0, (*counts[::-1], len(wavelengths), 4, 4)).astype("f4")
    M[-1] = M[0]  # phi_d = pi is phi_d = -pi
    M[rng.random(M.shape[:3]) < holes] = np.nan
    if holes:
        M[5:8, 2:5, 2:6] = np.nan
    names = ("theta_h", "theta_d", "phi_d")
    return {**{n: x[None] for n, x in zip(names, axes, strict=True)}, "wvls": np.array(wavelengths, "u2"), "M": M}


def halved(wi, wo):
    """theta_h, theta_d, phi_d of one pair by vectors: phi_d is the azimuth of wi about the half vector."""
    h = (wi + wo) / np.linalg.norm(wi + wo)
    b = np.cross([0.0, 0.0, 1.0], h)
    b = b / np.linalg.norm(b)
    t = np.cross(b, h)
    return math.acos(min(h[2], 1.0)), math.acos(min(wi @ h, 1.0)), math.atan2(b @ wi, t @ wi)


def header(counts, half=0, **other):
    found = np.zeros(16, "<i4")
    found[[0, 1, 2, 3, 6, 9, 10]] = *counts, 1, half, 3
    for at, value in other.items():
        found[int(at[1:])] = value
    return found


def ngan(counts=(5, 4, 8, 6), half=0, seed=1, holes=0.0):
    rng = np.random.default_rng(seed)
    raw = rng.uniform(0.1, 1.0, (3, *counts)).astype("<f4")
    raw[:, rng.random(counts) < holes] = -1.0
    if holes:
        raw[:, 1:3, 1:3, 2:5, 1:4] = -1.0
    return header(counts, half), raw


def curet_table(values, first=1):
    lines = [f"{k}  " + "  ".join(f"{x:.3f}" for x in row) + " \n" for k, row in enumerate(values, start=first)]
    return "".join(lines).encode()


def lambertian_table(samples=3):
    return np.array([[0.05 * (k + 1)] * 205 for k in range(samples)])


def random_network(seed=1):
    rng = np.random.default_rng(seed)
    return neural.Neural(
        [rng.normal(0.0, 0.4, s).astype("f4") for s in neural.SHAPES],
        [rng.normal(0.0, 0.2, s[1:]).astype("f4") for s in neural.SHAPES],
    )


def random_table(cells, seed=1):
    return np.random.default_rng(seed).random((3, 90, 90, cells)) * 1000.0 + 1.0
