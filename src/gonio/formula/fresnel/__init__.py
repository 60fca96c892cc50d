"""Fresnel reflectance of a smooth interface, exact for dielectrics and conductors, unpolarized.

A Fresnel term is a small value with `F(cos_theta)`; wherever one is expected a plain number means `Constant`.
"""

from __future__ import annotations

from typing import Any

from ...arrays import ops
from ...declared.contents import Contents
from ..classes import Array
from ..fresnel_term import Fresnel
from ..json_form import names
from .constant import Constant


def as_fresnel(value: Fresnel | float | Array) -> Any:
    """A number (or array of numbers) as a `Constant` reflectance; other values as they are.

    Example
    >>> from gonio.authoring import as_fresnel
    >>> print(as_fresnel(0.5), as_fresnel(gn.Schlick(0.04)))
    Constant(reflectance=0.5) Schlick(F0=0.04)
    """
    is_number = isinstance(value, (int, float, list, tuple)) or ops.library_of_type(type(value)) is not None
    return Constant(value) if is_number else value


def fresnel_terms() -> Contents[type[Fresnel]]:
    """Every Fresnel term, your own included: name -> class.

    Example
    >>> print("Schlick" in gn.fresnel_terms())
    True
    >>> print(gn.fresnel_terms()["Dielectric"](1.5))
    Dielectric(eta=1.5)
    """
    return Contents({n: k for n, k in names().items() if issubclass(k, Fresnel)})
