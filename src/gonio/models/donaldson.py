"""Donaldson's matrix: a fluorescent surface as a bispectrometer measures it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..base.reflectance import Reflectance
from ..formula.direction import Direction
from ..formula.exchange import exchange
from ..formula.fields import part
from .lambertian import Lambertian


class Donaldson(Reflectance):
    """A matrix D of radiance factors, as measured: F[o, i] = D[o, i] g(wi, wo), for light of wavelength i that leaves
    at o.

    The diagonal of D is the reflectance, which is f; the rest is fluorescence, which `reradiation` has. g says where
    the light goes: 1/pi for a diffuse surface, or any other reflectance, of which the light of each pair of wavelengths
    gets the same share. A surface that reflects otherwise than it fluoresces is a sum: the matrix without its diagonal,
    and an ordinary reflectance.

    Looks    `Donaldson([[0.1, 0, 0], [0.5, 0.8, 0], [0.2, 0.1, 0.7]], wavelengths=[450, 550, 650])` is yellow
             highlighter ink: under white light more green light leaves than arrives.
    Shapes   matrix: (C, C), or (..., C, C) for a map; a row for each wavelength that leaves, a column for each that
             arrives.
    Units    D: 1, light of whole bands: D is per band, not per nanometre. f: 1/sr.
    Error    rounding; between the wavelengths measured (`m.at`) straight lines along those that arrive, and the same
             sum along those that leave.
    Source   Donaldson 1954, "Spectrophotometry of fluorescent pigments", Br. J. Appl. Phys. 5:210.

    Example
    >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
    >>> print((np.pi * ink.reradiation([0, 0, 1], [0.6, 0, 0.8])).round(3))
    [[0.2 0. ]
     [0.3 0.6]]
    >>> sun = gn.DistantLight([0, 0, 1], irradiance=[4.0, 1.0])
    >>> print((np.pi * gn.reflected_radiance(ink, sun, [0, 0, 1])).round(3))
    [0.8 1.8]
    """

    fluoresces = True

    matrix = exchange("share of the light of one band that leaves in another")
    shape = part(Reflectance, Lambertian(1.0), "where the light goes: a reflectance of albedo 1")

    @property
    def _glows_evenly(self) -> bool:
        return isinstance(self.shape, Lambertian)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.matrix * self.shape.formula(wi, wo)

    def reradiated(self, light: Any, wi: Direction, wo: Direction) -> Any:
        return self.matrix * self.shape.formula(wi, wo)

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for weight, lobe in self.shape.lobes():
            yield self._reflected() * weight, lobe

    def diffuse(self) -> Any:
        albedo = self.shape.diffuse()
        return None if albedo is None else self._reflected() * albedo

    def _reflected(self) -> Any:
        """The diagonal: what formulas have for the matrix."""
        return self._numbers_of("matrix", self.fields["matrix"])
