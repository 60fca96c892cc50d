"""Tables and facets from values, without a formula for f: bases of materials, retro-reflection."""

from ..fitting.maps.photometric_stereo import photometric_stereo as photometric_stereo
from ..fitting.maps.texel_data import texel_data as texel_data
from ..reconstruction.nearness import nearest as nearest
from ..reconstruction.reconstructing import reconstruct as reconstruct
from ..reconstruction.reconstructing import reflectance_basis as reflectance_basis
from ..reconstruction.retro import retro_facets as retro_facets
