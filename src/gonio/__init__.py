"""gonio: how light leaves a surface, measured and modelled.

    import gonio as gn
    m = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    m.f(wi, wo)            # [1/sr], wi to the light, wo to the viewer, (..., 3)
    gn.check(m)            # reciprocity, energy, sampling ... with numbers
    gn.render(m, gn.ConstantLight(1.0)).save("sphere.png")

What stands in expressions is flat: models, distributions, Fresnel terms, lights; and the verbs of every day. The others
are in namespaces: `gn.fitting.fit_map`. Bases are in `gonio.authoring`. Conventions: docs/conventions.md. Every model,
distribution of normals, light and file format is one file in models/, distributions/, lights/, formats/.
"""

from __future__ import annotations

from importlib import import_module

from . import errors as errors
from .base.angles import angles as angles
from .base.angles import direction as direction
from .base.light import Light as _Light
from .base.reflectance import Reflectance as Reflectance
from .declared import discover, notebooks
from .declared.namespace import on_use
from .declared.version import __version__ as __version__
from .errors import Error as Error
from .formula.dispersion import Dispersion as Dispersion
from .formula.distribution import Distribution as _Distribution
from .formula.fresnel_term import Fresnel as _Fresnel
from .formula.spectrum import Spectrum as Spectrum
from .formula.texture import Texture as Texture
from .layers.layer import Layer as _Layer

_CLASSES = {
    name: kind
    for folder, base in (
        *(("models", Reflectance), ("distributions", _Distribution), ("formula.fresnel", _Fresnel), ("lights", _Light)),
        *(("layers", Reflectance), ("layers", _Layer)),
    )
    for name, kind in discover.classes(f"gonio.{folder}", base).items()
}
"""The classes of folders: a new one is public by its file."""
globals().update(_CLASSES)

NAMESPACES = (
    *("colour", "directions", "engine", "fitting", "planning", "reconstruction", "remote_sensing", "results"),
    *("scenes", "spectra", "tables"),
)
"""Modules of names from several rooms: to import one costs nothing."""

ROOMS = ("distributions", "figures", "formats", "lights", "models", "polarization", "radiometry", "repair", "surfaces")
"""Rooms that are public as they are."""

_ON_USE = {
    "Cone": "integrals.cones",
    "Film": "formula.fresnel.film_stack",
    "Gridded": "tables.gridded",
    "Hemisphere": "integrals.cones",
    "Scattered": "tables.scattered",
    "Scene": "scenes.scene",
    "UnderLight": "base.under_light",
    "absorptance": "integrals.absorptance",
    "albedo": "integrals.albedo",
    "check": "laws",
    "cite": "catalogue.citations",
    "convert": "conversion.conversion",
    "expression": "catalogue.expressions",
    "fate": "integrals.fate",
    "fit": "fitting.fitting",
    "fresnel_terms": "formula.fresnel",
    "gonioreflectometer": "instrument.measure",
    "irradiance": "integrals.irradiance",
    "load": "formats",
    "material": "catalogue.builtin",
    "materials": "catalogue.builtin",
    "normal_map": "models.normal_mapped",
    "photon_albedo": "integrals.photons",
    "reflectance": "integrals.nine",
    "reflectance_factor": "integrals.nine",
    "reflected_radiance": "integrals.illumination",
    "render": "scenes.rendering",
    "save": "formats",
    "transmittance": "integrals.transmittance",
    "with_uncertainty": "uncertainty",
    "write_report": "report.page",
}
"""Other public names -> the modules that define them, imported on first use; "" where the name is a module's."""
_ON_USE |= dict.fromkeys((*NAMESPACES, *ROOMS), "")

_ALWAYS = ("Dispersion", "Error", "Reflectance", "Spectrum", "Texture", "angles", "direction", "errors")
__all__ = sorted({*_ALWAYS, *_CLASSES, *_ON_USE})
__getattr__, *_ = on_use(__name__, _ON_USE)
notebooks.shown_by(lambda: import_module(".report.display", __name__))


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
