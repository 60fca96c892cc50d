"""The interface of Fresnel terms: the reflectance of a mirror facet."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from .mueller import Mueller, of_amplitudes
from .parametrised import Parametrised


class Fresnel(Parametrised):
    """Base of the Fresnel terms: the reflectance of a mirror facet.

    Example
    >>> print(gn.Dielectric(1.5).F(np.cos([0.0, 1.5])).round(3))
    [0.04 0.67]
    """

    _noun: ClassVar[str] = "a Fresnel term"
    _reflects: ClassVar[str] = "gn.Microfacet(gn.GGX(0.1), {})"

    @abstractmethod
    def F(self, cos_theta: Any) -> Any:
        """Reflectance [1] at the cosine of the angle between direction and facet normal."""
        raise self._lacks("F")

    def amplitudes(self, cos_theta: Any) -> tuple[Any, Any] | None:
        """(r_s, r_p), reflected over arriving fields, with r_p = -r_s at normal incidence; None where only F is known.

        F is the mean of their squares. They are numbers or `Complex`.

        Example
        >>> r_s, r_p = gn.Dielectric(1.5).amplitudes(1.0)
        >>> print(r_s.re.round(3), r_p.re.round(3), gn.Schlick(0.04).amplitudes(1.0))
        -0.2 0.2 None
        """
        return None

    def polarized(self, cos_theta: Any) -> Mueller | None:
        """The Mueller matrix of a facet, in its own axes: that of `amplitudes`, None where these are not known.

        Example
        >>> M = gn.Dielectric(1.5).polarized(np.cos(np.arctan(1.5)))
        >>> print(np.round(M.rows[0], 3))  # at Brewster's angle all of the light is horizontal
        [0.074 0.074 0.    0.   ]
        """
        found = self.amplitudes(cos_theta)
        return None if found is None else of_amplitudes(*found)

    @property
    def polarizes(self) -> bool:
        """Whether `amplitudes` are known.

        Example
        >>> print(gn.Dielectric(1.5).polarizes, gn.Schlick(0.04).polarizes)
        True False
        """
        return type(self).amplitudes is not Fresnel.amplitudes
