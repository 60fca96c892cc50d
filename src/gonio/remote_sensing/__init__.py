"""What remote sensing computes with kernels: the kernels themselves, nadir reflectance, BRDF correction, and fits.

Angles are those of satellites' products, in radians: theta_s of the sun and theta_v of the viewer, from the normal, 0
to pi/2, and phi between their azimuths, 0 where the viewer stands on the side of the sun (the hot spot), pi across.
They may be numbers, or arrays of any library, of xarray, pandas and Dask; all broadcast, by name where axes have names.
"""

from .correction import brf as brf
from .correction import c_factor as c_factor
from .correction import nbar as nbar
from .fitting import KernelFit as KernelFit
from .fitting import fit_kernels as fit_kernels
from .kernels import li_dense_r as li_dense_r
from .kernels import li_sparse_r as li_sparse_r
from .kernels import ross_thick as ross_thick
from .kernels import ross_thick_hotspot as ross_thick_hotspot
from .kernels import ross_thin as ross_thin
from .kernels import roujean_geometric as roujean_geometric
from .kernels import roujean_volumetric as roujean_volumetric
