"""Spectra by their names: of lights, of refractive indices; spectra of colours."""

from .catalogue.builtin import refractive_index as refractive_index
from .catalogue.colours import blackbody as blackbody
from .catalogue.colours import illuminant as illuminant
from .catalogue.colours import upsampled as upsampled
