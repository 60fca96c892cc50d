"""What remote sensing computes with kernels: the kernels themselves, nadir reflectance, BRDF correction, and fits."""

from ..integrals.albedo import black_sky_albedo as black_sky_albedo
from ..integrals.albedo import blue_sky_albedo as blue_sky_albedo
from ..integrals.albedo import white_sky_albedo as white_sky_albedo
from ..remote_sensing.correction import brf as brf
from ..remote_sensing.correction import c_factor as c_factor
from ..remote_sensing.correction import nbar as nbar
from ..remote_sensing.fitting import fit_kernels as fit_kernels
from ..remote_sensing.kernels import li_dense_r as li_dense_r
from ..remote_sensing.kernels import li_sparse_r as li_sparse_r
from ..remote_sensing.kernels import ross_thick as ross_thick
from ..remote_sensing.kernels import ross_thick_hotspot as ross_thick_hotspot
from ..remote_sensing.kernels import ross_thin as ross_thin
from ..remote_sensing.kernels import roujean_geometric as roujean_geometric
from ..remote_sensing.kernels import roujean_volumetric as roujean_volumetric
