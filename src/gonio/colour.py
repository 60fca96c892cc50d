"""Colours of spectra, and how far apart two colours are."""

from .declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "to_colour": "catalogue.colours",
        "colour_difference": "catalogue.colours",
    },
)
