"""The radiometric quantities by name, symbol, unit and definition."""

from types import MappingProxyType
from typing import NamedTuple


class Quantity(NamedTuple):
    """One row of `QUANTITIES`; the unit is a CF string, as in the attributes of a data set.

    Example
    >>> q = gn.radiometry.QUANTITIES["radiance"]
    >>> print(q.symbol, q.unit)
    L W m-2 sr-1
    """

    name: str
    symbol: str
    unit: str
    definition: str
    source: str


_ISO, _NBS, _ASTM = "ISO 80000-7", "Nicodemus et al. 1977, NBS Monograph 160", "ASTM E2387"
_GORAL = "Goral et al. 1984, doi:10.1145/964965.808601"
_ROWS = (
    Quantity("radiant_energy", "Q", "J", "energy carried by light", _ISO),
    Quantity("flux", "Φ", "W", "power carried by light, dQ/dt", _ISO),
    Quantity("photon_flux", "Φ_p", "s-1", "photons per time, Φ λ/(h c) at one wavelength", _ISO),
    Quantity("intensity", "I", "W sr-1", "flux leaving a small source per solid angle, dΦ/dω", _ISO),
    Quantity("irradiance", "E", "W m-2", "flux arriving per area, ∫ L_i cosθ_i dω_i", _ISO),
    Quantity("exitance", "M", "W m-2", "flux emitted per area, ∫ L_e cosθ_e dω_e", _ISO),
    Quantity("radiosity", "B", "W m-2", "flux leaving per area, for any reason, ∫ L_o cosθ_o dω_o", _GORAL),
    Quantity("radiant_exposure", "H", "J m-2", "energy arriving per area, ∫ E dt", _ISO),
    Quantity("radiance", "L", "W m-2 sr-1", "flux per projected area and solid angle, d²Φ/(dA cosθ dω)", _ISO),
    Quantity("basic_radiance", "L/n²", "W m-2 sr-1", "radiance over index², constant along a ray", _NBS),
    Quantity("spectral_radiance", "L_λ", "W m-2 sr-1 nm-1", "radiance per wavelength, dL/dλ", _ISO),
    Quantity("spectral_irradiance", "E_λ", "W m-2 nm-1", "irradiance per wavelength, dE/dλ", _ISO),
    Quantity("solid_angle", "ω", "sr", "area on the unit sphere, dω = dA cosθ/r²", _ISO),
    Quantity("projected_solid_angle", "Ω", "sr", "∫ cosθ dω, π for a hemisphere", _NBS),
    Quantity("etendue", "G", "m2 sr", "n² ∫∫ dA cosθ dω of a beam, which carries the flux G L/n²", _ISO),
    Quantity("brdf", "f", "sr-1", "radiance out per irradiance in, dL_o/(L_i cosθ_i dω_i)", _NBS),
    Quantity("brdf_cos_theta_i", "f cosθ_i", "sr-1", "BRDF times the cosine at the light", _NBS),
    Quantity("dsf", "f cosθ_o", "sr-1", "flux out per solid angle and flux in, (1/Φ_i) dΦ_o/dω_o", _ASTM),
    Quantity("reflectance_factor", "R", "1", "flux out over that of the ideal Lambertian, π f", _NBS),
    Quantity("directional_hemispherical_reflectance", "ρ(ω_i; 2π)", "1", "albedo, ∫ f cosθ_o dω_o", _NBS),
    Quantity("hemispherical_directional_reflectance_factor", "R(2π; ω_o)", "1", "∫ f cosθ_i dω_i", _NBS),
    Quantity("bihemispherical_reflectance", "ρ(2π; 2π)", "1", "∫∫ f cosθ_i cosθ_o dω_i dω_o/π", _NBS),
)
QUANTITIES = MappingProxyType({quantity.name: quantity for quantity in _ROWS})
"""The quantities by name: `for q in QUANTITIES.values(): print(q)`."""
