"""What remote sensing computes with kernels: the kernels themselves, nadir reflectance, BRDF correction, and fits.

Angles are those of satellites' products, in radians: theta_s of the sun and theta_v of the viewer, from the normal, 0
to pi/2, and phi between their azimuths, 0 where the viewer stands on the side of the sun (the hot spot), pi across.
They may be numbers, or arrays of any library, of xarray, pandas and Dask; all broadcast, by name where axes have names.
"""

from ..declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        **dict.fromkeys(("black_sky_albedo", "blue_sky_albedo", "white_sky_albedo"), "integrals.albedo"),
        **dict.fromkeys(("brf", "c_factor", "nbar"), "remote_sensing.correction"),
        "fit_kernels": "remote_sensing.fitting",
        **dict.fromkeys(("li_dense_r", "li_sparse_r", "ross_thick", "ross_thick_hotspot"), "remote_sensing.kernels"),
        **dict.fromkeys(("ross_thin", "roujean_geometric", "roujean_volumetric"), "remote_sensing.kernels"),
    },
)
