"""Materials whose parameters are textures, at places (u, v) on the surface.

`mapped` takes the textures out of a material, and makes one value of it and of them for kernels, in which `placed` puts
the numbers at a place back in: the lookups are part of the compiled formula. `at` does so outside, with arrays.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

from ..arrays import ops
from ..arrays.kinds import VALUE
from ..errors import ArrayTypeError, ParameterError, shown
from ..evaluate import batch
from ..evaluate.computation import composite
from ..evaluate.tracing import Task
from ..formula import tree
from ..formula.fields import channels, table
from ..formula.parametrised import Parametrised
from ..formula.state import state
from ..formula.texture import Grid, Texture, checked_places
from . import kernels

M = TypeVar("M", bound=Parametrised)


class _Lookup(Parametrised, has_text=False):
    """A texture as kernels have it: the path of the parameter that it is, its texels, and, where these have several
    channels, the numbers of all channels together, which sampling uses."""

    _noun = "a texture in a kernel"
    texels = table("numbers of the texels")
    together = table("numbers of all channels of the texels")
    number = channels("number of the channel")
    path: str = state("")
    grid: Grid = state(None)

    def __init__(self, path: str, texture: Texture, merge: str):
        self._hold(path=path, grid=texture.grid)
        self._set({"number": texture.channels})
        self._kept["texels"] = texture.table()
        if texture.channels > 1:
            self._kept["together"] = texture.table(merge)

    def value(self, u: Any, v: Any, merged: bool) -> Any:
        """The number of a channel at a place, or that of all channels."""
        count = self.grid.channels
        if count == 1 or merged:
            table = self.texels if count == 1 else self.together
            return self.grid.value(lambda texel: ops.take(table, texel), u, v)
        channel = ops.to_index(self.number)
        return self.grid.value(lambda texel: ops.take(self.texels, texel * count + channel), u, v)


def textures(m: Parametrised) -> dict[str, Texture]:
    """The parameters that are textures, by their paths."""
    return {path: value for path, _, value, _ in tree.numbers(m) if isinstance(value, Texture)}


def require_numbers(m: Parametrised, call: str) -> None:
    """Raises ParameterError for a material with textures, where a call takes none."""
    for path in textures(m):
        raise ParameterError(f"{call}: {path} is a texture; expected numbers, those of a place: m.at(uv=[0.5, 0.5])")


def mapped(m: Parametrised) -> dict[str, Any]:
    """The parts of a composite for kernels that call `placed`: `material`, and its `maps`, if it has textures."""
    parts: dict[str, Any] | None = m._derived.get(mapped)
    if parts is None:
        if m._labels is not None and textures(m):
            rule = "expected plain arrays: x.values"
            raise ArrayTypeError(f"{type(m).__name__}: a texture beside parameters whose axes have names; {rule}")
        maps = [
            _Lookup(path, value, getattr(field, "sampled", "mean"))
            for path, field, value, _ in tree.numbers(m)
            if isinstance(value, Texture)
        ]
        plain = tree.rebuilt(
            m, lambda _, __, value: float(value.texels.flat[0]) if isinstance(value, Texture) else value
        )
        parts = m._derived[mapped] = {"material": plain} | ({"maps": maps} if maps else {})
    return parts


def placed(scene: Any, u: Any, v: Any, merged: bool = False) -> Any:
    """The material of a composite, in a kernel, with the numbers at a place; `merged`: those of all channels."""
    if "maps" not in scene.fields:
        return scene.material
    return tree.with_values(scene.material, {x.path: x.value(u, v, merged) for x in scene.maps.parts})


def _value(scene: Any, mean: Any, wi: Any, wo: Any, uv: Any) -> tuple[Any, ...]:
    u, v = uv
    (f,) = kernels.value(placed(scene, u, v), placed(mean, u, v, merged=True), wi, wo)
    return (f + ((u - u) + (v - v)),)  # NaN where a place is


_PLACED = Task(_value, (VALUE,), (3, 3, 2))


def value(m: Parametrised, wi: Any, wo: Any, uv: Any, out: np.ndarray | None) -> Any:
    """f at places, see `Calls.f`."""
    by_path = textures(m)
    checked_places(uv, [*by_path.values()])
    if not all(texture.is_fixed for texture in by_path.values()):
        return batch.run(kernels.F, at(m, uv), (wi, wo), out)[0]
    whole = m._derived.get(value)
    if whole is None:
        whole = m._derived[value] = composite(**mapped(m))
    return batch.run(_PLACED, whole, (wi, wo, uv), out)[0]


def at(m: M, uv: Any) -> M:
    """The material with the numbers at places, see `Reflectance.at`."""
    by_path = textures(m)
    lib, places = checked_places(uv, [*by_path.values()])
    numbers = lib.known(places)
    if numbers is not None and not np.isfinite(numbers).all():
        raise ParameterError(f"at(uv={shown(uv)}): NaN or infinite; expected numbers u and v of each place")
    return m._with_paths([(path, path, texture.at(uv)) for path, texture in by_path.items()])
