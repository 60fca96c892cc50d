"""Fresnel reflectance of many films on a substrate: mirrors, filters, structural colours."""

from __future__ import annotations

from typing import Any, ClassVar

from ...errors import ParameterError, shown
from ..complex import Complex
from ..fields import param, part, wavelengths
from ..fresnel_term import Fresnel
from ..parametrised import Parametrised
from ..text import literal
from ._films import layered, phase

MOST = 64
"""Films of a stack, at most."""


class Film(Parametrised):
    """One film of a `FilmStack`.

    Shapes   numbers or (..., C).
    Units    thickness: nm; indices: 1.
    Source   definition.

    Example
    >>> print(gn.Film(2.35, thickness=58.0))
    Film(eta=2.35, thickness=58.0, k=0.0)
    """

    _noun: ClassVar[str] = "a film"
    _reflects: ClassVar[str] = "gn.Microfacet(gn.GGX(0.1), gn.FilmStack({}))"

    eta = param(1.33, 0.01, 20.0, "real part of the refractive index")
    thickness = param(300.0, 0.0, 1e5, "thickness", unit="nm")
    k = param(0.0, 0.0, 50.0, "imaginary part of the refractive index (extinction)")


class FilmStack(Fresnel):
    """Reflectance of films in vacuum on a substrate, the first on top; F the mean of |r_s|^2 and |r_p|^2.

    From the substrate upwards, film by film: r = (r_1 + R z)/(1 + r_1 R z), with R that of all below, r_1 Fresnel's
    amplitude of the film's surface, z = exp(4 pi i n thickness cos(theta')/wavelength). It depends on the wavelength:
    `m.at(wavelengths)` binds it. The films' parameters are `0.eta`, `0.thickness`, `0.k`, `1.eta` ...

    Looks    chitin and air by turns, `FilmStack(Film(1.56, 90), Film(1, 80), Film(1.56, 90), Film(1, 80), eta=1.56)`,
             are the blue of a morpho; eight pairs of quarter waves, 58.5 nm of index 2.35 on 99.6 nm of 1.38, a mirror
             for green light.
    Shapes   all: numbers or (..., C). At most 64 films.
    Units    thickness: nm; indices: 1.
    Error    rounding: 1e-14 in float64, 1e-5 in float32, for ten quarter waves.
    Source   Born & Wolf, Principles of Optics, 7th ed., sections 1.6.2 to 1.6.5.

    Example
    >>> mirror = gn.FilmStack(*8 * [gn.Film(2.35, 58.5), gn.Film(1.38, 99.6)], eta=1.52)
    >>> print(mirror.at([450.0, 550.0, 650.0]).F(1.0).round(3))
    [0.411 0.999 0.982]
    """

    eta = param(1.5, 0.01, 20.0, "real part of the substrate's refractive index")
    k = param(0.0, 0.0, 50.0, "imaginary part of the substrate's index (extinction)")
    wavelength = wavelengths()

    def __init__(self, *films: Film, eta: Any = 1.5, k: Any = 0.0, wavelength: Any = None):
        if len(films) > MOST or not all(isinstance(film, Film) for film in films):
            given = next((film for film in films if not isinstance(film, Film)), f"{len(films)} films")
            raise ParameterError(f"FilmStack({shown(given)}): expected at most {MOST} films, gn.Film(eta, thickness)")
        parts = {str(i): part(Film, None, f"film {i}") for i in range(len(films))}
        for name, field in parts.items():
            field.name = name
        values = dict(zip(parts, films, strict=True)) | {"eta": eta, "k": k, "wavelength": wavelength}
        self._set(values, fields=parts | type(self).fields)

    @property
    def films(self) -> tuple[Film, ...]:
        """The films, from the top.

        Example
        >>> print(gn.FilmStack(gn.Film(1.33, 300.0)).films)
        (Film(eta=1.33, thickness=300.0, k=0.0),)
        """
        return tuple(self.__dict__[name] for name in self.fields if name.isdigit())

    def amplitudes(self, cos_theta: Any) -> tuple[Complex, Complex]:
        indices = [Complex(film.eta, film.k) for film in self.films]
        phases = [phase(film.thickness, self.wavelength) for film in self.films]
        return layered(cos_theta, [*indices, Complex(self.eta, self.k)], phases)

    def F(self, cos_theta: Any) -> Any:
        s, p = self.amplitudes(cos_theta)
        return 0.5 * (s.norm + p.norm)

    def __repr__(self) -> str:
        written = [f"{n}={literal(x)}" for n, x in self._written().items() if not n.isdigit()]
        return f"FilmStack({', '.join([*map(repr, self.films), *written])})"

    def to_json(self) -> dict[str, Any]:
        others = {name: x for name, x in super().to_json().items() if not name.isdigit()}
        return others | {"terms": [film.to_json() for film in self.films]}
