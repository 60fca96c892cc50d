"""The hooks: what models write of a reflectance, components in, numbers out, and what holds where they do not.

A model writes `formula(wi, wo)`, and for importance sampling `warp(wo, u0, u1)` with its `density(wi, wo)`; all else
that it may write stands here too. `wi` points to the light, `wo` to the viewer, both away from the surface.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from ..formula import warp
from ..formula.direction import Direction, mirror
from ..formula.distribution import Spread
from ..formula.mueller import Mueller
from ..formula.parametrised import Parametrised

if TYPE_CHECKING:
    from ..numerics.quadrature import Integrals


class Hooks(Parametrised):
    """What models write. What `lobes` and `turned` are where they do not is in `reflectance.py`, with its products."""

    breaks: ClassVar[dict[str, str]] = {}
    """Laws of `gonio.check` that this model does not obey for all parameters, each with the reason."""

    @property
    def is_delta(self) -> bool:
        """Whether this is a delta lobe, a perfect mirror; a model that is one says `is_delta = True`.

        Example
        >>> print(gn.IdealSpecular(0.04).is_delta, gn.Lambertian(0.3).is_delta)
        True False
        """
        return False

    @property
    def seam(self) -> float:
        """Value of u0 at which `warp` jumps from one strategy to another, or 0; quadrature splits there.

        Example
        >>> print(gn.Lambertian(0.5).seam)
        0.0
        """
        return 0.0

    @property
    def slope_spread(self) -> Spread | None:
        """How the slopes of a smooth lobe's mirror facets spread; None for any other lobe.

        Quadrature over the hemisphere then runs in coordinates of half vectors: `integrals/half_vectors.py`.

        Example
        >>> print(gn.Microfacet(gn.GGX(0.1, 0.4)).slope_spread, gn.Lambertian(0.5).slope_spread)
        Spread(alpha_x=0.1, alpha_y=0.4, reach=inf) None
        """
        return None

    @property
    def sides(self) -> str:
        """Where light and viewer may be: "front", "across" or "both"; a class says `sides = "across"`.

        "front": both above the surface. "across": of a lobe, wo above and wi below it. "both": of a sum of such lobes,
        anywhere; its `formula` is not called, but that of its `lobes`.

        Example
        >>> glass = gn.RoughDielectric(gn.GGX(0.2), 1.5)
        >>> print(gn.Lambertian(0.5).sides, glass.sides, [lobe.sides for _, lobe in glass.lobes()])
        front both ['front', 'across']
        """
        return "front"

    @property
    def _lit_behind(self) -> str:  # type: ignore[override]  # of other values it is of the class
        if self.sides == "front":
            return ""
        return "it transmits light; expected a reflectance lit and seen in front only"

    @property
    def index(self) -> Any:
        """Refractive index behind the surface over that in front: 1 where both sides are of one medium.

        Example
        >>> print(gn.RoughDielectric(gn.GGX(0.2), 1.5).index, gn.ThinDielectric(1.5).index)
        1.5 1.0
        """
        return 1.0

    @property
    def kinks(self) -> list[float]:
        """Sines of the angles in front at which total reflection sets in: there f has kinks.

        Example
        >>> print(gn.SmoothDielectric(1.25).kinks, gn.SmoothDielectric(1.25).turned(True).kinks)
        [] [0.8]
        """
        return sorted({float(n) for n in np.ravel(self.index) if n < 1.0})

    @property
    def split(self) -> bool:
        """Whether this lobe and the next one, for light on the other side, share what is drawn, such as a facet that
        reflects or refracts.

        `warp` of both then starts from the same draw, `chance` says which of them it goes to, and `estimate` of this
        one is that of both.

        Example
        >>> print([lobe.split for _, lobe in gn.RoughDielectric(gn.GGX(0.2), 1.5).lobes()])
        [True, False]
        """
        return False

    @property
    def single_scatter(self) -> Any:
        """The reflectance of facets like these that absorb nothing, where light that they scatter twice is lost: what
        it lacks of 1 is lost. None where nothing is.

        Example
        >>> white = gn.Microfacet(gn.GGX(1.0), gn.material("gold").fresnel).single_scatter
        >>> print(gn.albedo(white, [0, 0, 1]).round(4), gn.KullaConty(0.5).single_scatter)  # 1 - log(2)
        0.3069 None
        """
        return None

    @abstractmethod
    def formula(self, wi: Direction, wo: Direction) -> Any:
        """f [1/sr] for directions above the horizon, without the cosine; of a lobe across the surface wi is below."""
        raise self._lacks("formula")

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        """A direction wi for two uniform numbers; its density is `density`."""
        wi = warp.cosine_hemisphere(u0, u1)
        return Direction(wi.x, wi.y, -wi.z) if self.sides == "across" else wi

    def density(self, wi: Direction, wo: Direction) -> Any:
        """Density per solid angle [1/sr] of `warp`."""
        return warp.cosine_hemisphere_density(-wi if self.sides == "across" else wi)

    def chance(self, wi: Direction, wo: Direction) -> Any:
        """The probability that what both lobes of a `split` share goes to this one, where it is drawn as this wi.

        Example
        >>> from gonio.authoring import NORMAL
        >>> (_, mirrors), _ = gn.RoughDielectric(gn.GGX(0.2), 1.5).lobes()
        >>> print(mirrors.chance(NORMAL, NORMAL).round(4))
        0.04
        """
        return 1.0 + 0.0 * wo.z

    def estimate(self, wo: Direction) -> Any:
        """Roughly the share of the light that is reflected: sums sample their lobes in this proportion."""
        return 1.0 + 0.0 * wo.z

    def mirror(self, wo: Direction) -> Any:
        """Reflectance of a delta lobe at the mirror direction.

        A model that becomes a mirror as its widths (parameters whose `sampled` is "max" or "min") go to their narrow
        bounds may write it too; `gonio.check` then tests this limit.
        """
        raise self._lacks("mirror")

    def mirrored(self, wo: Direction) -> Direction:
        """The direction wi that a delta lobe reflects into wo; of one across the surface that straight behind it.

        Example
        >>> from gonio.authoring import Direction
        >>> print(gn.IdealSpecular().mirrored(Direction(0.6, 0.0, 0.8)))
        Direction(x=-0.6, y=-0.0, z=0.8)
        """
        return -wo if self.sides == "across" else mirror(wo)

    @abstractmethod
    def lobes(self) -> Iterable[tuple[Any, Hooks]]:
        """The terms of this sum: pairs (weight, model)."""

    @abstractmethod
    def turned(self, back: Any) -> Hooks:
        """This as seen from behind where `back` is 1, not 0 (or True or False)."""

    def _collected(self, w: Any, incident: bool, goal: float, each: Callable[[Any, float], Integrals]) -> Any:
        """`Integrals` of f cos over the directions of light, or `incident` of the viewer, for fixed directions (n, 3)
        of the viewer, or of light, to an error `goal`, of a lobe that has them of few; None: it has not.

        `each`: those of directions (k, 3) to an error, each by itself.
        """
        return None

    def diffuse(self) -> Any:
        """Albedo of the Lambertian part of f, where there is one: f is never below this over pi."""
        return None

    @property
    def glows_evenly(self) -> bool:
        """Whether what is re-radiated is as that of a Lambertian surface, from and to all directions alike.

        Example
        >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
        >>> print(ink.glows_evenly, gn.Coated(ink).glows_evenly)
        True False
        """
        return False

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        """The Mueller matrix of f [1/sr], in the axes of `formula/mueller.py`, for directions above the horizon.

        Not written, what leaves is unpolarized: f diag(1, 0, 0, 0). A model that writes it says so by `polarizes`.
        """
        return Mueller.depolarizer(self.formula(wi, wo))

    def polarized_mirror(self, wo: Direction) -> Mueller:
        """The Mueller matrix of a delta lobe at the mirror direction; without it what is mirrored is unpolarized."""
        return Mueller.depolarizer(self.mirror(wo))

    def reradiated(self, light: Self, wi: Direction, wo: Direction) -> Any:
        """Fluorescence: the light of one wavelength that leaves as light of another, [1/sr] per band.

        `self` has the numbers of the wavelength that leaves, `light` is the same material with those of the one that
        arrives. A model that writes it says `fluoresces = True`.
        """
        return 0.0
