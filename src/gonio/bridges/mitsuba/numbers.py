"""The numbers of a material as Mitsuba holds them: parameters that `mi.traverse` finds, and lookup tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Fixed
from ...base.reflectance import Reflectance
from ...errors import ParameterError
from ...evaluate.tracing import content
from ...formula import tree
from ...formula.fields import Channels, Field, Param, Wavelengths


class MitsubaNumber(NamedTuple):
    """A number of the formula: its name in Mitsuba ("" for one that is no parameter), its declaration, its value: a
    Float, a Color3f of three channels, or a Float of all of them."""

    name: str
    field: Field
    value: Any
    channels: int

    def at(self, mi: Any, channel: int) -> Any:
        """The value of a channel; one number serves all of them."""
        if self.channels == 1:
            return self.value
        if self.channels == 3:
            return self.value[min(channel, 2)]
        import drjit as dr

        return dr.gather(mi.Float, self.value, mi.UInt32(min(channel, self.channels - 1)))

    def between(self, mi: Any, channel: Any, share: Any) -> Any:
        """The value `share` of the way from a channel to the next one, both chosen for each ray."""
        if self.channels == 1:
            return self.value
        if isinstance(self.field, Channels):
            return mi.Float(channel)
        import drjit as dr

        flat = dr.ravel(self.value) if self.channels == 3 else self.value
        low, high = (dr.gather(mi.Float, flat, c) for c in (channel, channel + 1))
        return low + (high - low) * share

    def merged(self, mi: Any) -> Any:
        """One value for all channels, by which directions are drawn: a constant for differentiation."""
        import drjit as dr

        if self.channels == 1:
            return dr.detach(self.value)
        way = getattr(self.field, "sampled", "mean")
        if self.channels == 3:
            r, g, b = dr.detach(self.value)
            if way == "mean":
                return (r + g + b) * (1.0 / 3.0)
            pick = getattr(dr, f"{way}imum")
            return pick(pick(r, g), b)
        return getattr(dr, way)(dr.detach(self.value))


def numbers(mi: Any, m: Reflectance) -> list[MitsubaNumber]:
    """The numbers of a material, in the order of its traces.

    Raises ParameterError for maps, and where two parameters would have one name.
    """
    import drjit as dr

    listed: list[MitsubaNumber] = []
    for (path, field, _, owner), leaf in zip(tree.numbers(m), content(m).leaves, strict=True):
        array = np.asarray(leaf.numbers if isinstance(leaf, Fixed) else leaf, dtype=float)
        if array.ndim > 1:
            raise ParameterError(
                f"mitsuba.bsdf: {type(owner).__name__}.{field.name} is a map of shape {array.shape}; expected a number "
                f"or one per channel: Mitsuba's own `blendbsdf` takes a texture as the weight of two materials"
            )
        name = path.replace(".", "_") if isinstance(field, Param) else ""
        if name and name in {other.name for other in listed}:
            raise ParameterError(f"mitsuba.bsdf: two parameters would be called {name!r} in Mitsuba")
        flat = array.reshape(-1)
        value = mi.Color3f(*flat.tolist()) if flat.size == 3 else mi.Float(flat.tolist())
        dr.make_opaque(value)
        listed.append(MitsubaNumber(name, field, value, flat.size))
    return listed


def tables(mi: Any, m: Reflectance) -> list[Any]:
    """The lookup tables of a material, in the order of its traces."""
    import drjit as dr

    flat = [table.once(_flat, mi.Float) for table in content(m).tables]
    dr.make_opaque(*flat)  # a table of one entry would become a constant, which nothing can be looked up in
    return flat


def _flat(table: np.ndarray, array_type: type) -> Any:
    return array_type(np.ascontiguousarray(table, np.float32).reshape(-1))


def parameters(held: list[MitsubaNumber]) -> Iterator[MitsubaNumber]:
    """Those that optimization may move."""
    return (number for number in held if number.name and not isinstance(number.field, (Channels, Wavelengths)))
