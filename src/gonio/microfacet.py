"""Microfacet surfaces in pieces: what a distribution of normals is (D, Lambda, sampling), and the maskings (G).

Every model with facets is D F G / (4 cos cos) with these pieces. `alpha` is the slope scale of the surface. The
distributions are in distributions/, one file each.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from . import ops
from .errors import ParameterError
from .geometry import Direction, dot
from .parametrised import Parametrised

ALPHA_LOW, ALPHA_HIGH = 1e-3, 1.0


class Distribution(Parametrised):
    """Base of the distributions of facet normals, normalised to one: integral of D(wm) cos(theta_m) dwm = 1."""

    def D(self, wm: Direction) -> Any:
        """Area of facets per solid angle of their normals and per area of the surface [1/sr]."""
        raise NotImplementedError

    def Lambda(self, w: Direction) -> Any:
        """Smith's auxiliary function of this distribution: G1 = 1/(1 + Lambda)."""
        raise NotImplementedError

    has_lambda = True

    def warp_normal(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        """A facet normal for two uniform numbers; its density is `normal_density`."""
        raise NotImplementedError

    def normal_density(self, wo: Direction, wm: Direction) -> Any:
        """Density [1/sr] of `warp_normal`: of the normals visible from wo, D_v = G1 D (wo . wm)/cos(theta_o)."""
        return self.D(wm) * dot(wo, wm) / ((1.0 + self.Lambda(wo)) * wo.z)


def stretched(w: Direction, ax: Any, ay: Any) -> Direction:
    """w as seen by a surface of slope scale 1: slopes along x divided by ax, along y by ay."""
    return Direction(ax * w.x, ay * w.y, w.z)


# Maskings: the fraction of facets wm that is both lit from wi and seen from wo.


def height_correlated(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """Smith, heights correlated: G = 1/(1 + Lambda_i + Lambda_o). Source: Heitz 2014, JCGT 3(2), section 6."""
    return 1.0 / (1.0 + d.Lambda(wi) + d.Lambda(wo))


def separable(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """Smith, masking and shadowing independent: G = 1/((1 + Lambda_i)(1 + Lambda_o)). Source: Walter et al. 2007."""
    return 1.0 / ((1.0 + d.Lambda(wi)) * (1.0 + d.Lambda(wo)))


def v_groove(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """V-shaped grooves: G = min(1, 2 z_m z_o/(wo . wm), 2 z_m z_i/(wo . wm)).

    Source: Torrance & Sparrow 1967; in this form Blinn 1977, "Models of light reflection".
    """
    return ops.minimum(1.0, 2.0 * wm.z * ops.minimum(wi.z, wo.z) / dot(wo, wm))


MASKINGS: dict[str, Callable[..., Any]] = {f.__name__: f for f in (height_correlated, separable, v_groove)}


def check_masking(distribution: Distribution, masking: str) -> None:
    """Raises ParameterError where a distribution has no Smith function for the masking asked."""
    if masking != "v_groove" and not distribution.has_lambda:
        name = type(distribution).__name__
        raise ParameterError(
            f"{name} with masking={masking!r}: Smith's function of {name} has no closed form; use masking='v_groove'"
        )
