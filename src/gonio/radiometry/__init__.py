"""Radiometric quantities, the relations between them, and exact solid angles.

Plain functions of numbers or NumPy arrays that broadcast; float32 arrays give float32. SI units, angles in
radians, wavelengths in vacuum in nanometres. Directions, vertices and edges are `(..., 3)` as seen from the
observer, the origin; `w` and `normal` are unit vectors (the caller's duty). NaN in gives NaN out; other
values out of range raise. "Error rounding" is a relative error below 1e-15 in float64.
"""

from ..declared.namespace import own_names
from . import form_factors as form_factors
from . import roughness as roughness
from .quantities import QUANTITIES as QUANTITIES
from .quantities import Quantity as Quantity
from .relations import basic_radiance as basic_radiance
from .relations import brdf as brdf
from .relations import convert_reflectance as convert_reflectance
from .relations import etendue as etendue
from .relations import exitance as exitance
from .relations import flux as flux
from .relations import intensity as intensity
from .relations import irradiance as irradiance
from .relations import lambertian_albedo as lambertian_albedo
from .relations import lambertian_exitance as lambertian_exitance
from .relations import point_irradiance as point_irradiance
from .relations import radiance as radiance
from .relations import radiosity as radiosity
from .relations import radiosity_balance as radiosity_balance
from .relations import solid_angle as solid_angle
from .relations import uniform_irradiance as uniform_irradiance
from .solid_angles import latlong_pixels as latlong_pixels
from .solid_angles import projected_solid_angle_cone as projected_solid_angle_cone
from .solid_angles import projected_solid_angle_latlong_pixel as projected_solid_angle_latlong_pixel
from .solid_angles import projected_solid_angle_polygon as projected_solid_angle_polygon
from .solid_angles import solid_angle_cap as solid_angle_cap
from .solid_angles import solid_angle_cone as solid_angle_cone
from .solid_angles import solid_angle_latlong_pixel as solid_angle_latlong_pixel
from .solid_angles import solid_angle_rectangle as solid_angle_rectangle
from .solid_angles import solid_angle_sphere as solid_angle_sphere
from .solid_angles import solid_angle_triangle as solid_angle_triangle
from .spectral import PLANCK as PLANCK
from .spectral import SPEED_OF_LIGHT as SPEED_OF_LIGHT
from .spectral import convert_spectral as convert_spectral
from .spectral import photon_flux as photon_flux
from .spectral import radiant_flux as radiant_flux

__all__, __dir__ = own_names(globals(), "PLANCK", "QUANTITIES", "SPEED_OF_LIGHT", "form_factors", "roughness")
