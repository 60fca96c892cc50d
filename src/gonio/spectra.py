"""Spectra by their names: of lights, of refractive indices; spectra of colours."""

from .declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "blackbody": "catalogue.colours",
        "illuminant": "catalogue.colours",
        "upsampled": "catalogue.colours",
        "refractive_index": "catalogue.builtin",
    },
)
