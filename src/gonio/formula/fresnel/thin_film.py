"""Fresnel reflectance of a transparent film on a substrate, with interference: soap, oil, oxides, coatings."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import MeaningWarning, shown, warn
from ..complex import Complex
from ..fields import param, wavelengths
from ..fresnel_term import Fresnel
from ._films import layered, phase


class ThinFilm(Fresnel):
    """Reflectance of a film in vacuum on a substrate: r = (r_1 + r_2 z)/(1 + r_1 r_2 z), F the mean of |r|^2.

    r_1 and r_2 are Fresnel's amplitudes of the film's two surfaces, z = exp(4 pi i n thickness cos(theta')/wavelength),
    theta' the angle within. It depends on the wavelength: `m.at(wavelengths)` binds it.

    Looks    `ThinFilm(1.33, 400.0, 1.0)` is a soap bubble, `ThinFilm(1.38, 100.0, 1.52)` anti-reflection coated glass,
             `ThinFilm(2.4, 50.0, 2.7, 3.3)` annealed titanium. Seen in RGB after `m.at(np.arange(380, 781, 5))`.
    Shapes   all: numbers or (..., C).
    Units    thickness: nm; indices: 1.
    Error    rounding: 2e-15 in float64; 2e-6 in float32 below 1 um, more for thicker films, whose phase loses digits.
    Source   Born & Wolf, Principles of Optics, 7th ed., section 1.6.4.

    Example
    >>> bubble = gn.ThinFilm(1.33, thickness=400.0, substrate=1.0).at([450.0, 550.0, 650.0])
    >>> print(bubble.F(1.0).round(4), bubble.F(0.5).round(4))
    [0.0648 0.0035 0.0646] [0.09   0.191  0.1123]
    """

    eta = param(1.33, 1.0, 5.0, "refractive index of the film")
    thickness = param(300.0, 0.0, 1e5, "thickness of the film", unit="nm")
    substrate = param(1.5, 0.01, 20.0, "real part of the substrate's refractive index")
    k = param(0.0, 0.0, 50.0, "imaginary part of the substrate's index (extinction)")
    wavelength = wavelengths()

    def validate(self) -> None:
        thickness = self.thickness
        if isinstance(thickness, (float, np.ndarray)) and (((d := np.asarray(thickness)) > 0.0) & (d < 1.0)).any():
            text = f"ThinFilm(thickness={shown(thickness)}): thinner than three atoms, below 1 nm; in micrometres?"
            warn(f"{text} multiply by 1000", MeaningWarning)

    def amplitudes(self, cos_theta: Any) -> tuple[Complex, Complex]:
        indices = Complex(self.eta), Complex(self.substrate, self.k)
        return layered(cos_theta, indices, [phase(self.thickness, self.wavelength)])

    def F(self, cos_theta: Any) -> Any:
        s, p = self.amplitudes(cos_theta)
        return 0.5 * (s.norm + p.norm)
