"""Surfaces by their shape, as periodic height fields: for `gn.gonioreflectometer`.

Made by a formula or by chance (`gaussian`, `v_grooves`, `weave`, `brushed`, `spheres`), from a measured map
(`from_map`), or of any heights (`HeightField`).
"""

from ..declared.namespace import own_names
from .brushed import brushed as brushed
from .from_map import from_map as from_map
from .gaussian import gaussian as gaussian
from .height_field import HeightField as HeightField
from .spheres import spheres as spheres
from .v_grooves import v_grooves as v_grooves
from .weave import weave as weave

__all__, __dir__ = own_names(globals())
