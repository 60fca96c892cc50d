"""Mitsuba's flags for the lobes of a material: what kind each is, and on which sides of the surface."""

from __future__ import annotations

from typing import Any

from ...base.reflectance import Reflectance
from ...models.lambertian import Lambertian


def _lobes(m: Reflectance, back: bool) -> list[Reflectance]:
    """The lobes that a viewer in front, or behind, sees."""
    seen = m if m.sides == "front" else m.turned(back)
    if m.sides == "front" and back:
        return []
    return [lobe for weight, lobe in seen.lobes() if not (isinstance(weight, float) and weight == 0.0)]


def is_straight(m: Reflectance) -> bool:
    """Whether what a delta lobe lets through goes straight on, so that Mitsuba may follow it as through empty space."""
    across = any(lobe.is_delta and lobe.sides == "across" for back in (False, True) for lobe in _lobes(m, back))
    return across and isinstance(m.index, float) and m.index == 1.0


def flags_of(mi: Any, m: Reflectance) -> list[int]:
    """The flags of each kind of lobe."""
    kinds: dict[int, int] = {}
    for back, side in ((False, mi.BSDFFlags.FrontSide), (True, mi.BSDFFlags.BackSide)):
        for lobe in _lobes(m, back):
            kind = _kind(mi, lobe, m)
            kinds[kind] = kinds.get(kind, 0) | int(side)
    common = int(mi.BSDFFlags.Anisotropic) if m.is_oriented() else 0
    return [kind | sides | common for kind, sides in kinds.items()]


def _kind(mi: Any, lobe: Reflectance, m: Reflectance) -> int:
    flags = mi.BSDFFlags
    if lobe.sides == "across":
        if lobe.is_delta:
            return int(flags.Null if is_straight(m) else flags.DeltaTransmission | flags.NonSymmetric)
        return int(flags.GlossyTransmission | flags.NonSymmetric)
    if lobe.is_delta:
        return int(flags.DeltaReflection)
    return int(flags.DiffuseReflection if isinstance(lobe, Lambertian) else flags.GlossyReflection)
