"""The tables that MERL's formulas look up, made of a file's numbers: cells with borders, and rings for sampling."""

from __future__ import annotations

import math

import numpy as np

from ...tables.angle_systems import SYSTEMS

SCALE = (1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0)
"""f = stored number * SCALE, for red, green, blue."""

N = 90
SHAPES = ((N, N, 180), (N, N, 360))

ROW = 128
"""Length of the three rows of the table of rings: by ring of theta_h the probability of all rings before it, then
1 - cos(theta_h) and the relative density at its inner edge. Ring 90 is the cosine hemisphere."""
ALBEDO = 3 * ROW - 1
"""Place in that table of the share of diffuse light that is reflected."""


def is_valid(numbers: np.ndarray) -> np.ndarray:
    """Whether numbers of a file, or f, are data."""
    return (numbers >= 0.0) & (numbers < np.inf)


def centres(phi_cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """theta_h, theta_d, phi_d [rad] of the centres of cells."""
    i = np.arange(N) + 0.5
    return np.radians(i * i / N), np.radians(i), np.radians(np.arange(phi_cells) + 0.5)


def bordered(raw: np.ndarray) -> np.ndarray:
    """f [1/sr] with the channels of a cell side by side, -1 where there is no data; flat, padded by one entry.

    Rows of phi_d begin with a copy of their last cell and end with one of their first: neighbours always lie together.
    """
    shape = (*raw.shape[1:3], raw.shape[3] + 2, len(SCALE))
    flat = np.empty(math.prod(shape) + 1)
    flat[-1] = -1.0
    cells = flat[:-1].reshape(shape)
    for c, scale in enumerate(SCALE):
        np.multiply(raw[c], scale, out=cells[..., 1:-1, c])
        cells[..., 1:-1, c][~is_valid(raw[c])] = -1.0
    cells[..., 0, :], cells[..., -1, :] = cells[..., -2, :], cells[..., 1, :]
    return flat


def rings(raw: np.ndarray) -> np.ndarray:
    """The table of rings that sampling looks up; flat.

    Half vectors of reflected diffuse light have the density  integral of f cos(theta_i) cos(theta_o) 4 cos(theta_d)
    dw_d. Nine tenths of the f of the dimmest ring are left to the cosine hemisphere, the rings draw the rest.
    """
    theta_h, theta_d, phi_d = centres(raw.shape[3])
    mean, room = np.zeros(N), np.zeros(N)
    for i in range(N):
        wi, wo = SYSTEMS["half_difference"].pairs(theta_h[i], theta_d[:, None], phi_d)
        cosines = np.maximum(wi[..., 2] * wo[..., 2], 0.0) * np.sin(2.0 * theta_d)[:, None]
        valid = is_valid(raw[:, i])
        f = np.where(valid, raw[:, i], 0.0) * np.array(SCALE)[:, None, None]
        mean[i] = (cosines * f).sum() / (cosines * valid).sum()  # NaN without data
        room[i] = cosines.mean() * 2.0 * math.pi**2
    mean += 1e-9  # black is sampled too
    # The dimmest up to 60 degrees: beyond, there is little data.
    least = np.nan_to_num(np.fmin.reduce(mean[:73]), nan=1e-9)
    mean = np.where(np.isnan(mean), least, mean)
    edges = 2.0 * np.sin(0.25 * math.pi * (np.arange(N + 1) / N) ** 2) ** 2
    solid_angle = 2.0 * math.pi * np.diff(edges)
    reflected = (mean * room * solid_angle).sum()
    share = np.clip(0.9 * least * (room * solid_angle).sum() / reflected, 0.1, 0.9)
    centre = np.maximum(mean - 0.9 * least, 0.0) * room + 1e-6 * reflected
    inner = np.concatenate([centre[:1], 0.5 * (centre[:-1] + centre[1:]), centre[-1:]])
    below = np.cumsum((inner[:-1] + inner[1:]) * solid_angle)
    table = np.full((3, ROW), [[2.0], [1.0], [1.0]])
    table[0, : N + 2] = [0.0, *below / below[-1] * (1.0 - share), 1.0]
    table[1, : N + 1], table[2, : N + 1] = edges, inner / inner.max()
    table[2, -1] = reflected / math.pi
    return table.reshape(-1)
