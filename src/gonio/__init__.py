"""gonio: how light leaves a surface, measured and modelled.

    import gonio as gn
    m = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    m.f(wi, wo)            # [1/sr], wi to the light, wo to the viewer, (..., 3)
    gn.check(m)            # reciprocity, energy, sampling ... with numbers
    gn.render(m, gn.ConstantLight(1.0)).save("sphere.png")

Conventions: docs/conventions.md. Every model, distribution of normals, light and file format is one file in models/,
distributions/, lights/, formats/.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from . import errors as errors
from .base.angles import angles as angles
from .base.angles import direction as direction
from .base.frames import from_half_difference as from_half_difference
from .base.frames import half_difference as half_difference
from .base.frames import normalize as normalize
from .base.frames import reflect as reflect
from .base.frames import refract as refract
from .base.frames import to_local as to_local
from .base.frames import to_world as to_world
from .base.reflectance import Reflectance as Reflectance
from .base.results import Sample as Sample
from .base.under_light import UnderLight as UnderLight
from .declared import discover, notebooks
from .declared.version import __version__ as __version__
from .errors import Error as Error
from .formula.dispersion import Dispersion as Dispersion
from .formula.fields import CLASSES
from .formula.spectrum import Spectrum as Spectrum
from .formula.texture import Texture as Texture

_ON_USE = {
    "load": "formats",
    "save": "formats",
    "material": "catalogue.builtin",
    "materials": "catalogue.builtin",
    "nearest": "reconstruction.nearest",
    "formats": "",
    "fresnel_terms": "formula.fresnel",
    "refractive_index": "catalogue.builtin",
    "illuminant": "catalogue.colours",
    "blackbody": "catalogue.colours",
    "to_colour": "catalogue.colours",
    "colour_difference": "catalogue.colours",
    "upsampled": "catalogue.colours",
    "albedo": "integrals.albedo",
    "transmittance": "integrals.transmittance",
    "absorptance": "integrals.absorptance",
    "fate": "integrals.fate",
    "normal_map": "models.normal_mapped",
    "Fate": "integrals.fate",
    "reflectance": "integrals.nine",
    "reflectance_factor": "integrals.nine",
    "black_sky_albedo": "integrals.albedo",
    "white_sky_albedo": "integrals.albedo",
    "blue_sky_albedo": "integrals.albedo",
    "photon_albedo": "integrals.photons",
    "Cone": "integrals.cones",
    "Hemisphere": "integrals.cones",
    "irradiance": "integrals.irradiance",
    "reflected_radiance": "integrals.illumination",
    "remote_sensing": "",
    "polarization": "",
    "check": "laws",
    "with_uncertainty": "uncertainty",
    "expression": "catalogue.expressions",
    "tabulate": "conversion.tabulated",
    "convert": "conversion.conversion",
    "Gridded": "tables.gridded",
    "Scattered": "tables.scattered",
    "to_dataset": "tables.dataset",
    "from_dataset": "tables.dataset",
    "fit": "fitting.fitting",
    "Fit": "fitting.result",
    "fit_many": "fitting.fit_many",
    "plan": "reconstruction.planning.directions",
    "Plan": "reconstruction.planning.plan",
    "Goniometer": "reconstruction.planning.goniometer",
    "reconstruct": "reconstruction.reconstruct",
    "Reconstruction": "reconstruction.posterior",
    "reflectance_basis": "reconstruction.reconstruct",
    "ReflectanceBasis": "reconstruction.reflectance_basis",
    "plan_table": "reconstruction.reconstruct",
    "TablePlan": "reconstruction.planning.table_plan",
    "fit_map": "fitting.maps.maps",
    "fit_map_chunks": "fitting.maps.map_chunks",
    "FitMap": "fitting.maps.maps",
    "fit_problem": "fitting.problem",
    "observations": "fitting.maps.observations",
    "Observations": "fitting.maps.observations",
    "photometric_stereo": "fitting.maps.photometric_stereo",
    "PhotometricStereo": "fitting.maps.photometric_stereo",
    "retro_facets": "reconstruction.retro_facets",
    "RetroFacets": "reconstruction.retro_facets",
    "select_model": "fitting.selection",
    "surfaces": "",
    "gonioreflectometer": "instrument.measure",
    "Camera": "scenes.camera",
    "Mesh": "scenes.mesh",
    "OrthographicCamera": "scenes.camera",
    "View": "scenes.camera",
    "Scene": "scenes.scene",
    "radiosity": "interreflection.solving",
    "Radiosity": "interreflection.result",
    "picture_jacobian": "scenes.jacobian",
    "render": "scenes.rendering",
    "render_stokes": "scenes.stokes",
    "difference": "pictures.difference",
    "Difference": "pictures.difference",
    "figures": "",
    "turntable": "scenes.turntable",
    "read_image": "pictures.image",
    "Image": "pictures.image",
    "radiometry": "",
    "roughness": "radiometry",
    "repair": "",
    "cite": "catalogue.citations",
    "write_report": "report.page",
    "kernel": "facts.compiled",
    "source": "bridges.source",
    "Source": "bridges.source",
    "threads": "compile.threads",
}
"""Public names whose modules are imported on first use -> module ("" where the name is the module)."""

_FOLDERS = ("distributions", "models", "lights")
"""Folders whose classes are public names; called, each lists them: `gn.models()`."""

for _folder in ("formula.fresnel", *_FOLDERS, "layers"):
    discover.modules(f"gonio.{_folder}")
globals().update(CLASSES)
notebooks.shown_by(lambda: import_module(".report.display", __name__))

_ALWAYS = (
    *("Error", "Reflectance", "Sample", "errors", "angles", "direction", "normalize", "to_local", "to_world"),
    *("reflect", "refract", "half_difference", "from_half_difference", "Spectrum", "Dispersion", "Texture"),
)
"""Public names that are here from the start, beside the classes that are discovered."""

__all__ = sorted({*_ALWAYS, *_FOLDERS, *CLASSES, *_ON_USE})


def __getattr__(name: str) -> Any:
    if name not in _ON_USE:
        raise AttributeError(f"module 'gonio' has no attribute {name!r}{errors.suggestion(name, __all__)}")
    home = _ON_USE[name]
    module = import_module(f".{home or name}", __name__)
    value = getattr(module, name) if home else module
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
