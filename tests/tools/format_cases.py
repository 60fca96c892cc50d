"""What the tests of several formats share: a file of a text, f at angles, materials to write, who claims a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import gonio as gn
from gonio.formats import formats
from gonio.tables.angle_systems import angle_system
from gonio.tables.gridded import Gridded
from gonio.tables.scattered import Scattered

MODEL = gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.3), [0.9, 0.5, 0.2])

GRAY = 0.5 * gn.Lambertian(0.4)

ANISOTROPIC = gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.2, 0.5), [0.9, 0.5, 0.2])


def file_of(tmp_path: Path, content: str | bytes, name: str = "file") -> Path:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def loaded(tmp_path: Path, content: str | bytes, module: Any = None, name: str = "file", **options: Any) -> Any:
    """What gonio reads, or what the reader of one format reads with options."""
    path = file_of(tmp_path, content, name)
    return gn.load(path) if module is None else module.read(path, **options)


def claimed(path: Path) -> list[str]:
    """Names of the formats that say the file is theirs."""
    data = path.read_bytes()
    return [m.NAME for m in formats() if m.matches(data[:4096], len(data))]


def f(m: Any, theta_i: float, phi_i: float, theta_o: float, phi_o: float) -> np.ndarray:
    """f at angles in radians."""
    return m.f_angles(*(np.float64(x) for x in (theta_i, phi_i, theta_o, phi_o)))


def at(m: Any, theta_i: float, phi_i: float, theta_o: float, phi_o: float) -> np.ndarray:
    """f at angles in degrees."""
    return f(m, *np.radians([theta_i, phi_i, theta_o, phi_o]))


def directions(n: int, seed: int, low: float = 0.0) -> np.ndarray:
    """Directions, cos(theta) uniform above `low`."""
    rng = np.random.default_rng(seed)
    z, phi = low + (1.0 - low) * rng.random(n), 2.0 * np.pi * rng.random(n)
    s = np.sqrt(1.0 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)


def random_pairs(count: int = 400, seed: int = 5) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    theta_i, theta_o = np.arccos(rng.uniform(0.05, 1.0, (2, count)))
    phi_i, phi_o = rng.uniform(0.0, 6.28, (2, count))
    return gn.direction(theta_i, phi_i), gn.direction(theta_o, phi_o)


def pairs_off_grazing(count: int = 500, seed: int = 1) -> list[np.ndarray]:
    """wi and wo (N, 3), all within 75 degrees of the normal."""
    rng = np.random.default_rng(seed)
    return [gn.direction(np.arccos(rng.uniform(0.25, 1.0, count)), rng.uniform(-np.pi, np.pi, count)) for _ in range(2)]


def grid(kind: str, counts: tuple[int, ...], channels: Any = None, mirrored: bool = False, **options: Any) -> Gridded:
    """A grid of random values, at angles with a decimal in degrees."""
    axes = {}
    for name, count in zip(angle_system(kind).axes(len(counts) == 4), counts, strict=True):
        high = 90.0 if name.startswith("theta") else 180.0 if name == "radial" or mirrored else 360.0
        whole = name.startswith("theta") or name == "radial" or mirrored
        axes[name] = np.radians(np.round(np.linspace(0.0, high, count, endpoint=whole), 1))
    shape = (*counts, *(() if channels is None else (len(channels),)))
    values = np.random.default_rng(len(shape)).normal(size=shape)
    return Gridded(kind, axes, values, channels=channels, mirrored=mirrored, **options)


def rows(isotropic: bool | None = None, channels: Any = (450.0, 550.5), **options: Any) -> Scattered:
    rng = np.random.default_rng(8)
    thetas, phis = rng.uniform(0.0, 1.5, (2, 40)), rng.uniform(0.0, 6.2, (2, 40))
    values = rng.normal(size=(40, 2))
    return Scattered(thetas[0], phis[0], thetas[1], phis[1], values, channels=channels, isotropic=isotropic, **options)
