"""Colours of spectra, and how far apart two colours are."""

from .catalogue.colours import colour_difference as colour_difference
from .catalogue.colours import to_colour as to_colour
