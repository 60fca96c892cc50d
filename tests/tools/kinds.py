"""A material of each kind, as Python: what gonio's functions and formats must each deal with, or refuse."""

from __future__ import annotations

from typing import Any

import numpy as np

import gonio as gn

KINDS = {
    "one channel": "gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))",
    "RGB": "gn.Lambertian([0.2, 0.4, 0.6]) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))",
    "weight per channel": "gn.Lambertian(0.3) + [1.0, 0.7, 0.3] * gn.Microfacet(gn.GGX(0.3), 0.9)",
    "41 channels": "gn.Lambertian(np.linspace(0.1, 0.9, 41))",
    "spectrum": "gn.Lambertian(gn.Spectrum([400.0, 700.0], [0.1, 0.8])).at(np.linspace(400.0, 700.0, 41))",
    "map": "gn.Lambertian(np.linspace(0.1, 0.9, 4).reshape(2, 2))",
    "texture": "gn.Lambertian(gn.Texture(np.linspace(0.1, 0.9, 48).reshape(4, 4, 3)))",
    "fluorescent": "gn.Donaldson([[0.2, 0.0, 0.0], [0.45, 0.6, 0.0], [0.1, 0.15, 0.7]], wavelengths=[450, 550, 620])",
    "polarizing": "gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9))",
    "transmitting": "gn.RoughDielectric(gn.GGX(0.3), 1.5)",
    "delta": "gn.IdealSpecular(0.8)",
    "delta across": "gn.ThinDielectric(1.5)",
    "layered": "gn.Stack([gn.Interface(1.5), gn.Medium(1.0, [0.9, 0.5, 0.2], 0.5)], gn.Lambertian(0.5))",
    "measured with holes": (
        "gn.Gridded('angles', {'theta_i': np.radians([0, 30, 60]), 'theta_o': np.radians([0, 30, 60, 80]), "
        "'phi': np.radians([0, 90, 180])}, np.where(np.eye(12).reshape(3, 4, 12)[..., :3] > 0.0, np.nan, 0.2))"
    ),
    "rows": "gn.Scattered(0.1, 0.0, np.linspace(0.0, 1.2, 30), np.linspace(0.0, 3.0, 30), np.full(30, 0.3))",
}
"""Materials of all kinds, as Python."""


def of_kind(kind: str) -> Any:
    """The material."""
    return eval(KINDS[kind], {"gn": gn, "np": np})
