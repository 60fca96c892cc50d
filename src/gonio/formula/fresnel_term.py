"""The interface of Fresnel terms: the reflectance of a mirror facet."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from .parametrised import Parametrised


class Fresnel(Parametrised):
    """Base of the Fresnel terms: the reflectance of a mirror facet.

    Example
    >>> print(gn.Dielectric(1.5).F(np.cos([0.0, 1.5])).round(3))
    [0.04 0.67]
    """

    noun: ClassVar[str] = "a Fresnel term"
    reflects: ClassVar[str] = "gn.Microfacet(gn.GGX(0.1), {})"

    @abstractmethod
    def F(self, cos_theta: Any) -> Any:
        """Reflectance [1] at the cosine of the angle between direction and facet normal."""
        raise self._lacks("F")
