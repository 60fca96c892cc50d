"""Synthetic RGL files: a formula without any symmetry beyond the file's, so that a swapped or flipped axis shows.

`r` is the reduction (how often the content repeats around the circle), 0 if isotropic.
"""

from __future__ import annotations

import numpy as np

WAVELENGTHS = (400.0, 470.0, 550.0, 620.0, 700.0)


PHI_NODES = {1: 17, 2: 9, 4: 5}


def D(m, r):
    return 1.0 + 0.5 * m[0] ** 2 + (r <= 2) * 0.3 * m[0] * m[1] + (r <= 1) * 0.2 * m[0]


def sigma(w, r):
    return 0.6 + 0.3 * w[2] ** 2 + (0.2 * w[0] ** 2 + (r <= 2) * 0.1 * w[0] * w[1] + (r <= 1) * 0.1 * w[1]) * (r > 0)


def S(w, m, c, r):
    even = 0.8 + 0.4 * w[0] * m[0] + 0.3 * w[1] * m[1] + 0.3 * w[2] ** 2 - 0.2 * m[0] ** 2
    return (1.0 + 0.3 * c) * (even + (r <= 2) * 0.3 * w[0] * m[1] + (r <= 1) * (0.1 * w[0] + 0.2 * m[1])) + 0.1 * c * m[
        2
    ]


def slopes(theta, phi):
    """The density of the warp is proportional to (1 + a x)(1 + b y), which the tables hold exactly."""
    return 0.5 + theta, 0.5 + 0.3 * np.cos(phi) + 0.2 * theta


def unit(theta, phi):
    return np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0.0 * phi


def unwarp(s, a):
    """x whose share (x + a x^2/2)/(1 + a/2) is s."""
    return 2.0 * s * (1.0 + a / 2.0) / (1.0 + np.sqrt(1.0 + 2.0 * a * s * (1.0 + a / 2.0)))


def synthetic(r=1, n_theta=9, n=24, channels=3, jacobian=1, n_ndf=48, description="synthetic"):
    """Fields of a valid file; `channels` = 3 makes rgb, 5 spectra."""
    phi_i = np.linspace(-np.pi, -np.pi + 2 * np.pi / r, PHI_NODES[r]) if r else np.zeros(1)
    theta_i = np.linspace(0.0, np.pi / 2, n_theta) ** 1.2 / (np.pi / 2) ** 0.2
    phi, theta = phi_i[:, None, None, None], theta_i[:, None, None]
    x, y = np.meshgrid(np.linspace(0, 1, n_ndf), np.linspace(0, 1, n_ndf + 5))
    node = unit(0.5 * np.pi * x * x, (2 * y - 1) * np.pi)
    a, b = slopes(theta, phi)
    vx, vy = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 1, 5))
    sx, sy = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    ux, uy = unwarp(sx, a), unwarp(sy, b)
    m = [v[:, :, None] for v in unit(0.5 * np.pi * ux * ux, (2 * uy - 1) * np.pi)]
    w = unit(theta[:, None], phi[:, None])
    spectra = S(w, m, np.arange(channels)[:, None, None], r)
    fields = {
        "description": np.frombuffer(description.encode(), np.uint8),
        "phi_i": phi_i,
        "theta_i": theta_i,
        "sigma": sigma(node, r),
        "ndf": D(node, r),
        "vndf": 7.0 * (1 + a * vx) * (1 + b * vy),
        "luminance": np.maximum(spectra.mean(2), 0.01),
        **({"rgb": spectra} if channels == 3 else {"wavelengths": np.array(WAVELENGTHS), "spectra": spectra}),
        "jacobian": np.array([jacobian], np.uint8),
        "valid": np.full(n, 255, np.uint8),
    }
    return {k: v if v.dtype == np.uint8 else v.astype(np.float32) for k, v in fields.items()}
