"""The interface of Fresnel terms: the reflectance of a mirror facet."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from .parametrised import Parametrised


class Fresnel(Parametrised):
    """Base of the Fresnel terms: the reflectance of a mirror facet."""

    noun: ClassVar[str] = "a Fresnel term"
    reflects: ClassVar[str] = "gn.Microfacet(gn.GGX(0.1), {})"

    @abstractmethod
    def F(self, cos_theta: Any) -> Any:
        """Reflectance [1] at the cosine of the angle between direction and facet normal."""
        raise self.lacks("F")
