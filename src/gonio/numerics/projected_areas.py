"""Projected areas of surfaces whose normals are given by a table of polar angles and azimuths."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np


def polar_nodes(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (N,) of an integral over polar angles up to pi/2, three in each cell of sqrt(angle)."""
    x, weight = np.polynomial.legendre.leggauss(3)
    inside = ((np.arange(cells)[:, None] + 0.5 * (x + 1.0)) / cells).ravel()
    return 0.5 * math.pi * inside * inside, np.tile(0.5 * weight, cells) * math.pi * inside / cells


def rows_between(values: np.ndarray, angles: np.ndarray, cells: int) -> np.ndarray:
    """Rows (cells + 1, M), equally spaced in sqrt(angle) up to pi/2, at other angles (K,): linear in between."""
    t = cells * np.sqrt(angles * (2.0 / math.pi))
    i = np.minimum(t.astype(int), cells - 1)
    v = (t - i)[:, None]
    found: np.ndarray = values[i] + v * (values[i + 1] - values[i])
    return found


def area_harmonics(theta: np.ndarray, theta_o: np.ndarray, count: int) -> Iterator[np.ndarray]:
    """Fourier coefficients of max(wo . wm, 0) over the azimuth psi between the two, of the orders 0 to count/2.

    It is max(A cos(psi) + B, 0), A = sin sin, B = cos cos of the two angles. Each is (K, N), for theta_o (K,) and
    theta (N,).
    """
    A, B = np.multiply.outer(np.sin(theta_o), np.sin(theta)), np.multiply.outer(np.cos(theta_o), np.cos(theta))
    edge = np.arccos(np.clip(-B / np.maximum(A, 1e-300), -1.0, 1.0))  # the azimuth at which facets turn away
    before, sine = np.zeros_like(edge), np.sin(edge)  # of (k - 1) edge and of k edge
    cosine = 2.0 * np.cos(edge)
    yield 2.0 * (A * sine + B * edge)
    after, part = np.empty_like(edge), np.empty_like(edge)  # in place: new arrays would take as long as the numbers
    for k in range(1, count // 2 + 1):
        np.multiply(cosine, sine, out=after)
        after -= before
        found = after / (k + 1)
        found += edge if k == 1 else np.divide(before, k - 1, out=part)
        found *= A
        np.multiply(2.0 / k, B, out=part)
        part *= sine
        found += part
        yield found
        before, sine, after = sine, after, before


def projected_areas(D: np.ndarray, harmonics: Iterable[np.ndarray]) -> np.ndarray:
    """The integral of D max(wo . wm, 0) over all wm (K, M), for wo at K polar angles and M azimuths from 0 on.

    `D` (N, M): at N nodes of an integral over polar angles, times their weights and sin(theta), and M equally spaced
    azimuths, linear between them; with M = 1 it is the same at all. `harmonics`: of `area_harmonics`.
    """
    count = D.shape[1]
    series = np.fft.rfft(D, axis=1) * np.square(np.sinc(np.arange(count // 2 + 1) / count))
    parts = np.stack([series.real.T, series.imag.T], axis=1)
    # einsum, since BLAS would share so little work out to all threads, which wait for each other.
    found = np.stack([np.einsum("kn,cn->kc", h, part) for h, part in zip(harmonics, parts, strict=True)], axis=1)
    areas: np.ndarray = np.fft.irfft(found[..., 0] + 1j * found[..., 1], n=count, axis=1)
    return areas
