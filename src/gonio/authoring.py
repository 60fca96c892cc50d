"""The door of model authors: what a model, light, distribution, Fresnel term or file format is written with.

    from gonio.authoring import Direction, Reflectance, dot, ops, param

    class HanrahanKrueger(Reflectance):
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

from .arrays import ops
from .base.light import Arrival, Light, channel_vector
from .base.measured import Measured
from .base.reflectance import Reflectance
from .errors import FormatError, ParameterError, ShapeError
from .formula.direction import (
    HORIZON,
    NORMAL,
    Direction,
    azimuth,
    cross,
    dot,
    frame,
    half_and_cosine,
    half_vector,
    mirror,
    normalize,
    polar_angle,
    reflect,
    select,
)
from .formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution, from_slopes, stretched
from .formula.fields import channels, option, param, part, table, vector
from .formula.fresnel import as_fresnel
from .formula.fresnel_term import Fresnel
from .formula.maskings import MASKINGS
from .formula.signature import Array
from .formula.special import expm1_over, log1p, log1p_over
from .formula.warp import (
    around,
    cosine_hemisphere,
    cosine_hemisphere_density,
    power_cosine,
    power_cosine_density,
    power_positive,
)

__all__ = [
    "ALPHA_HIGH",
    "ALPHA_LOW",
    "HORIZON",
    "MASKINGS",
    "NORMAL",
    "Array",
    "Arrival",
    "Direction",
    "Distribution",
    "FormatError",
    "Fresnel",
    "Light",
    "Measured",
    "Number",
    "ParameterError",
    "Reflectance",
    "ShapeError",
    "around",
    "as_fresnel",
    "azimuth",
    "channel_vector",
    "channels",
    "cosine_hemisphere",
    "cosine_hemisphere_density",
    "cross",
    "dot",
    "expm1_over",
    "frame",
    "from_slopes",
    "half_and_cosine",
    "half_vector",
    "log1p",
    "log1p_over",
    "mirror",
    "normalize",
    "ops",
    "option",
    "param",
    "part",
    "polar_angle",
    "power_cosine",
    "power_cosine_density",
    "power_positive",
    "reflect",
    "select",
    "stretched",
    "table",
    "typed",
    "vector",
]  # fmt: skip


class Number(Protocol):
    """The annotation of a parameter in a class that is `typed`: given as a number or an array, anything in formulas."""

    def __get__(self, instance: object, owner: type) -> Any: ...

    def __set__(self, instance: object, value: float | Array) -> None: ...


T = TypeVar("T")


@dataclass_transform()
def typed(kind: type[T]) -> type[T]:
    """Tell type checkers that the constructor takes the annotated parameters; returns the class as it is."""
    return kind
