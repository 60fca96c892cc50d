"""Wavelength, frequency and photons: densities by each of them, and flux as photons per second."""

from ..declared.arrays import Array
from ..declared.arrays import formula as _formula
from .kinds import _Density, _Real, _Wavelength

SPEED_OF_LIGHT = 299_792_458.0  # m s-1, exact in the SI
PLANCK = 6.626_070_15e-34  # J s, exact in the SI


@_formula
def convert_spectral(value: _Real, wavelength: _Wavelength, source: _Density, target: _Density) -> Array:
    """Convert a density (of radiance, flux, ...) between per "wavelength", "frequency" and "wavenumber".

    L_ν = L_λ λ²/c and L_σ = L_λ λ², because the energy L_λ dλ = L_ν dν = L_σ dσ of an interval stays.

    Shapes broadcast. Units nm⁻¹, Hz⁻¹, (cm⁻¹)⁻¹; the wavelength in nm. Error rounding.
    Source The chain rule; the speed of light is exact in the SI.

    Example
    >>> print(gn.radiometry.convert_spectral(1.0, 500.0, "wavelength", "wavenumber").round(6))
    0.025
    """
    area = wavelength * wavelength
    nm_per = {"wavelength": 1.0, "frequency": area * (1e-9 / SPEED_OF_LIGHT), "wavenumber": area * 1e-7}
    return value / nm_per[source] * nm_per[target]


@_formula
def photon_flux(flux: _Real, wavelength: _Wavelength) -> Array:
    """Photons per second in a monochromatic flux: Φ_p = Φ λ/(h c).

    Shapes broadcast. Units W, nm -> s⁻¹ (an irradiance gives s⁻¹ m⁻²). Error rounding.
    Source Planck's E = h c/λ; h and c are exact in the SI.

    Example
    >>> print(f"{gn.radiometry.photon_flux(flux=1e-3, wavelength=532.0):.4e}")
    2.6782e+15
    """
    return flux * wavelength / (1e9 * PLANCK * SPEED_OF_LIGHT)


@_formula
def radiant_flux(photon_flux: _Real, wavelength: _Wavelength) -> Array:
    """Flux of so many photons per second of one wavelength: Φ = Φ_p h c/λ.

    Shapes broadcast. Units s⁻¹, nm -> W. Error rounding.
    Source Planck's E = h c/λ; h and c are exact in the SI.

    Example
    >>> print(f"{gn.radiometry.radiant_flux(photon_flux=1e15, wavelength=532.0):.4e}")
    3.7339e-04
    """
    return photon_flux / wavelength * (1e9 * PLANCK * SPEED_OF_LIGHT)
