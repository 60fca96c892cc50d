"""House materials: what tests take that are about no model of their own.

A kernel belongs to the structure of a material, not to its numbers: tests that take these, with other numbers by
`replace` where they need them, share their kernels, and every other structure has to be compiled.
"""

from __future__ import annotations

import gonio as gn

_METAL = gn.Conductor(0.2, 3.9)
_GOLD = gn.Conductor([0.2, 0.9, 1.2], [3.9, 2.4, 2.3])

MATT = gn.Lambertian(0.5)
COLOURED = gn.Lambertian([0.2, 0.4, 0.6])
LOBE = gn.ModifiedPhong(0.5, 20.0)
MIRROR = gn.IdealSpecular(0.8)
WHITE_FACETS = gn.Microfacet(gn.GGX(0.3))
METAL = gn.Microfacet(gn.GGX(0.3), _METAL)
GOLD = gn.Microfacet(gn.GGX(0.3), _GOLD)
BRUSHED = gn.Microfacet(gn.GGX(0.1, 0.4), _METAL)
PLASTIC = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))
PAINT = gn.Lambertian([0.3, 0.1, 0.05]) + gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
VARNISHED = gn.Coated(gn.Lambertian([0.2, 0.4, 0.6]), 1.5)
GROUND_GLASS = gn.RoughDielectric(gn.GGX(0.3), 1.5)
LEAF = gn.Lambertian(0.1) + gn.DiffuseTransmission(0.2)
