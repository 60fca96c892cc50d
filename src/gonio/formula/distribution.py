"""The interface of distributions of facet normals: D, Lambda, sampling. Each is a file of distributions/.

Every model with facets is D F G / (4 cos cos): F of fresnel/, G of maskings/. `alpha` is the slope scale.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any, ClassVar, NamedTuple

from .direction import Direction, normalize, on_circle
from .parametrised import Parametrised

ALPHA_LOW, ALPHA_HIGH = 1e-3, 1.0


class Spread(NamedTuple):
    """How the slopes of facets spread: the scales along x and y, and the slope, in units of these, that none exceeds.

    "None": no more than 1 of 1e16, which no integral in double precision sees.

    Example
    >>> print(gn.GGX(0.1).slope_spread)
    Spread(alpha_x=0.1, alpha_y=0.1, reach=inf)
    """

    alpha_x: Any
    alpha_y: Any
    reach: float = math.inf


class Distribution(Parametrised):
    """Base of the distributions of facet normals, normalised to one: integral of D(wm) cos(theta_m) dwm = 1.

    Example
    >>> facets = gn.distributions()["GGX"](0.3)
    >>> print(facets, isinstance(facets, gn.GGX))
    GGX(alpha_x=0.3) True
    """

    noun: ClassVar[str] = "a distribution of facet normals"
    reflects: ClassVar[str] = "gn.Microfacet({})"
    known_elsewhere: ClassVar[dict[str, str]] = dict.fromkeys(
        ("__call__", "f", "pdf", "sample", "eval"), "gn.Microfacet(distribution), which has f, pdf and sample"
    )

    @property
    def slope_spread(self) -> Spread | None:
        """How slopes spread, where D and Lambda are smooth functions of them; None for other distributions.

        Example
        >>> print(gn.Beckmann(0.1, 0.4).slope_spread, gn.BlinnFacets(40.0).slope_spread)
        Spread(alpha_x=0.1, alpha_y=0.4, reach=7.0) None
        """
        return None

    @abstractmethod
    def D(self, wm: Direction) -> Any:
        """Area of facets per solid angle of their normals and per area of the surface [1/sr]."""
        raise self._lacks("D")

    def Lambda(self, w: Direction) -> Any:
        """Smith's auxiliary function of this distribution: G1 = 1/(1 + Lambda)."""
        raise self._lacks("Lambda")

    def projected_area(self, w: Direction) -> Any:
        """Area of the facets that face w, as w sees it, hidden ones included, per area of the surface: the integral of
        D max(w . wm, 0) over all wm. It is cos(theta)/G1 = (1 + Lambda) cos(theta)."""
        return (1.0 + self.Lambda(w)) * w.z

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        """A facet normal for two uniform numbers; its density is `normal_density`."""
        raise self._lacks("warp_normal")

    def normal_density(self, wo: Direction, wm: Direction, cos_d: Any) -> Any:
        """Density [1/sr] of `warp_normal`: of the normals visible from wo, D_v = G1 D cos_d/cos(theta_o).

        `cos_d`: wo . wm, as `half_and_cosine` has it.
        """
        return self.D(wm) * cos_d / self.projected_area(wo)


def stretched(w: Direction, ax: Any, ay: Any) -> Direction:
    """w as seen by a surface of slope scale 1: slopes along x divided by ax, along y by ay.

    Example
    >>> from gonio.authoring import Direction, stretched
    >>> print(stretched(Direction(0.5, 0.0, 0.75), 0.25, 0.25))
    Direction(x=0.125, y=0.0, z=0.75)
    """
    return Direction(ax * w.x, ay * w.y, w.z)


def from_slopes(r: Any, u: Any, ax: Any = 1.0, ay: Any = 1.0) -> Direction:
    """The normal of a facet whose slope is r, in units of ax and ay, in the direction 2 pi u.

    Example
    >>> from gonio.authoring import from_slopes
    >>> wm = from_slopes(1.0, 0.0, 0.3, 0.3)
    >>> print((wm.x / wm.z).round(4))
    0.3
    """
    return normalize(stretched(on_circle(r, u, 1.0 + 0.0 * r), ax, ay))
