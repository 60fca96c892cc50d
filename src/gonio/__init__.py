"""gonio: how light leaves a surface, measured and modelled.

    import gonio as gn
    m = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    m.f(wi, wo)            # [1/sr], wi to the light, wo to the viewer, (..., 3)
    gn.check(m)            # reciprocity, energy, sampling ... with numbers
    gn.render(m, gn.ConstantLight(1.0)).save("sphere.png")

Conventions: docs/conventions.md. Every model, distribution of normals, light and file format is one file in models/,
distributions/, lights/, measured/.
"""

from __future__ import annotations

import difflib
from importlib import import_module
from typing import Any

from . import discover
from . import errors as errors
from .errors import Error as Error
from .interface import Reflectance as Reflectance
from .interface import Sample as Sample
from .interface import angles as angles
from .interface import direction as direction
from .param import CLASSES

__version__ = "0.1.0"

_ON_USE = {
    "load": "measured",
    "save": "measured",
    "material": "catalogue",
    "materials": "catalogue",
    "refractive_index": "catalogue",
    "albedo": "integrate",
    "reflectance": "nicodemus",
    "reflectance_factor": "nicodemus",
    "black_sky_albedo": "nicodemus",
    "white_sky_albedo": "nicodemus",
    "blue_sky_albedo": "nicodemus",
    "Cone": "cones",
    "Hemisphere": "cones",
    "reflected_radiance": "illumination",
    "check": "laws",
    "with_uncertainty": "uncertainty",
    "expression": "expressions",
    "tabulate": "tabulated",
    "convert": "conversion",
    "Gridded": "gridded",
    "Scattered": "scattered",
    "to_dataset": "dataset",
    "from_dataset": "dataset",
    "render": "rendering",
    "read_image": "image",
    "Image": "image",
    "radiometry": "",
    "roughness": "",
    "repair": "",
    "cite": "citations",
    "kernel": "kernels",
    "threads": "compile.threads",
}
"""Public names whose modules are imported when first used -> module ("" for a module itself)."""

discover.modules("gonio.distributions")
discover.modules("gonio.models")
discover.modules("gonio.lights")
globals().update(CLASSES)

__all__ = sorted(  # models and lights are found, not listed
    {"Error", "Reflectance", "Sample", "angles", "direction", "errors", *CLASSES, *_ON_USE}
)


def __getattr__(name: str) -> Any:
    if name not in _ON_USE:
        close = difflib.get_close_matches(name, __all__, n=1)
        hint = f"; did you mean {close[0]!r}?" if close else ""
        raise AttributeError(f"module 'gonio' has no attribute {name!r}{hint}")
    home = _ON_USE[name]
    module = import_module(f".{home or name}", __name__)
    value = getattr(module, name) if home else module
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
