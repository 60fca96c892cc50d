"""Minimal valid files, one per format (more where a format has kinds): what the fuzz campaign damages.

`SEEDS`: the format's NAME, and a word for its kind, -> a function that gives the bytes.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from text_files import SEEDS as TEXT

import gonio as gn


def saved(m: gn.Reflectance, suffix: str, **options: object) -> bytes:
    """What `gonio.save` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"seed{suffix}"
        gn.save(m, path, **options)
        return path.read_bytes()


def _merl() -> bytes:
    """A header and a few cells: the shortest valid file has 35 MB."""
    return np.array([90, 90, 180], "<i4").tobytes() + np.linspace(0.0, 1.0, 64).astype("<f8").tobytes()


def _rgl() -> bytes:
    from test_rgl import synthetic

    from gonio.measured import _tensor_file

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "seed.bsdf"
        _tensor_file.write(path, synthetic(n_theta=3, n=4, n_ndf=4))
        return path.read_bytes()


def _material() -> bytes:
    return saved(0.5 * gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5)), ".json")


SEEDS: dict[str, Callable[[], bytes]] = {
    "MERL": _merl,
    "RGL": _rgl,
    "gonio JSON": _material,
    **TEXT,
}
