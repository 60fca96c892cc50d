"""The door of model authors: all that models, lights, distributions, Fresnel terms and file formats are written with.

    from gonio.authoring import Direction, Reflectance, dot, ops, param

    class HenyeyGreenstein(Reflectance):
        \"""Light that is scattered once in a deep layer: f = w p(wi . wo) / (cos(theta_i) + cos(theta_o)).\"""

        w = param(0.5, 0.0, 1.0, "single-scattering albedo")
        g = param(0.3, -0.9, 0.9, "mean cosine of the scattering angle")

        def formula(self, wi: Direction, wo: Direction):
            d = 1.0 + self.g * (self.g + 2.0 * dot(wi, wo))
            return self.w * (1.0 - self.g**2) / (12.566 * d * ops.sqrt(d) * (wi.z + wo.z))

It works at once: in expressions, JSON, `gn.check`, pictures. For a type checker to know its constructor too, decorate
the class with `typed` and annotate its parameters: `w: Number = param(...)`.
"""

from __future__ import annotations

from typing import Any, Protocol, TypeVar, dataclass_transform

from .arrays import ops as ops
from .base.light import FAR as FAR
from .base.light import Light as Light
from .base.measured import Measured as Measured
from .base.reflectance import Reflectance as Reflectance
from .base.results import Hints as Hints
from .errors import FormatError as FormatError
from .errors import ParameterError as ParameterError
from .errors import ShapeError as ShapeError
from .formula import tree as tree
from .formula.classes import Array as Array
from .formula.complex import Complex as Complex
from .formula.direction import HORIZON as HORIZON
from .formula.direction import NORMAL as NORMAL
from .formula.direction import Direction as Direction
from .formula.direction import azimuth as azimuth
from .formula.direction import cross as cross
from .formula.direction import dot as dot
from .formula.direction import frame as frame
from .formula.direction import half_and_cosine as half_and_cosine
from .formula.direction import half_vector as half_vector
from .formula.direction import mirror as mirror
from .formula.direction import normalize as normalize
from .formula.direction import polar_angle as polar_angle
from .formula.direction import reflect as reflect
from .formula.direction import select as select
from .formula.distribution import ALPHA_HIGH as ALPHA_HIGH
from .formula.distribution import ALPHA_LOW as ALPHA_LOW
from .formula.distribution import Distribution as Distribution
from .formula.distribution import from_slopes as from_slopes
from .formula.distribution import stretched as stretched
from .formula.exchange import exchange as exchange
from .formula.fields import channels as channels
from .formula.fields import option as option
from .formula.fields import param as param
from .formula.fields import part as part
from .formula.fields import table as table
from .formula.fields import wavelengths as wavelengths
from .formula.fresnel import as_fresnel as as_fresnel
from .formula.fresnel_term import Fresnel as Fresnel
from .formula.maskings import MASKINGS as MASKINGS
from .formula.mueller import Mueller as Mueller
from .formula.mueller import about_facet as about_facet
from .formula.mueller import of_amplitudes as of_amplitudes
from .formula.special import expm1_over as expm1_over
from .formula.special import log1p as log1p
from .formula.special import log1p_over as log1p_over
from .formula.warp import around as around
from .formula.warp import cosine_hemisphere as cosine_hemisphere
from .formula.warp import cosine_hemisphere_density as cosine_hemisphere_density
from .formula.warp import power_cosine as power_cosine
from .formula.warp import power_cosine_density as power_cosine_density
from .formula.warp import power_positive as power_positive
from .formula.warp import uniform_sphere as uniform_sphere
from .formula.world import vector as vector


class Number(Protocol):
    """The annotation of a parameter in a class that is `typed`: given as a number or an array, anything in formulas.

    Example
    >>> from gonio.authoring import Number, Reflectance, param, typed
    >>> @typed
    ... class Paint(Reflectance):
    ...     "Paint of one albedo."
    ...     rho: Number = param(0.5, 0.0, 1.0, "albedo")
    ...
    ...     def formula(self, wi, wo):
    ...         return self.rho / np.pi
    ...
    >>> print(gn.albedo(Paint(0.3), [0, 0, 1]).round(3))
    0.3
    """

    def __get__(self, instance: object, owner: type) -> Any: ...

    def __set__(self, instance: object, value: float | Array) -> None: ...


_T = TypeVar("_T")


@dataclass_transform()
def typed(kind: type[_T]) -> type[_T]:
    """Tell type checkers that the constructor takes the annotated parameters; returns the class as it is.

    Example
    >>> from gonio.authoring import Number, Reflectance, param, typed
    >>> @typed
    ... class Paint(Reflectance):
    ...     "Paint of one albedo."
    ...     rho: Number = param(0.5, 0.0, 1.0, "albedo")
    ...
    ...     def formula(self, wi, wo):
    ...         return self.rho / np.pi
    ...
    >>> print(Paint(rho=0.3).rho)
    0.3
    """
    return kind


_TYPING = {"annotations", "Any", "Protocol", "TypeVar", "dataclass_transform"}
__all__ = sorted(name for name in globals() if name[0] != "_" and name not in _TYPING)  # all imports and definitions
