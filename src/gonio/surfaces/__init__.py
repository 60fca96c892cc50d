"""Surfaces by their shape, as periodic height fields: for `gn.gonioreflectometer`.

Made by a formula or by chance (`gaussian`, `v_grooves`, `threads`, `brushed`, `spheres`), from a measured map
(`from_map`), or of any heights (`HeightField`).
"""

from types import ModuleType as _ModuleType

from .brushed import brushed as brushed
from .from_map import from_map as from_map
from .gaussian import gaussian as gaussian
from .height_field import HeightField as HeightField
from .spheres import spheres as spheres
from .threads import threads as threads
from .v_grooves import v_grooves as v_grooves

__all__ = [n for n, value in list(globals().items()) if n[0] != "_" and not isinstance(value, _ModuleType)]
