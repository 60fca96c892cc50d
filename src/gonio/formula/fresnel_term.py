"""The interface of Fresnel terms: the reflectance of a mirror facet."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from .parametrised import Parametrised


class Fresnel(Parametrised):
    """Base of the Fresnel terms: the reflectance of a mirror facet."""

    @abstractmethod
    def F(self, cos_theta: Any) -> Any:
        """Reflectance [1] at the cosine of the angle between direction and facet normal."""
        raise NotImplementedError
