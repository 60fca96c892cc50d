"""What calls and hooks of a reflectance return together: samples, derivatives, hints for quadrature."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..declared.notebooks import repr_html
from ..formula.distribution import Spread


class Hints(NamedTuple):
    """What a lobe tells quadrature of itself.

    seam    the value of u0 at which `warp` jumps from one strategy to another, or 0: quadrature splits there
    kinks   sines of the angles in front at which f has kinks, beside that at which its `index` reflects all light
    spread  how the slopes of a smooth lobe's mirror facets spread: quadrature over the hemisphere then runs in
            coordinates of half vectors, see `integrals/half_vectors.py`; None for any other lobe

    Example
    >>> print(gn.Microfacet(gn.GGX(0.1, 0.4)).hints.spread, gn.Lambertian(0.5).hints.seam)
    Spread(alpha_x=0.1, alpha_y=0.4, reach=inf) 0.0
    """

    seam: float = 0.0
    kinks: tuple[float, ...] = ()
    spread: Spread | None = None


NO_HINTS = Hints()


class Sample(NamedTuple):
    """The result of `sample`: incident directions drawn for given `wo`.

    wi      (..., 3)     unit vectors; below the surface where light comes from behind
    weight  (...[, C])   f |cos(theta_i)| / pdf, with the total f and the pdf of the whole material; for a delta sample
                         its reflectance over the probability of choosing it; 0 for a sample below the horizon
    pdf     (...)        density per solid angle [1/sr]; 1 for a delta sample, 0 below the horizon
    delta   (...)        whether wi came from a delta lobe (a perfect mirror)

    Example
    >>> s = gn.Lambertian(0.5).sample([0, 0, 1], np.array([[0.0, 0.36], [0.5, 0.75]]))
    >>> print(s.wi.round(3))
    [[ 0.6    0.     0.8  ]
     [-0.866  0.     0.5  ]]
    >>> print(s.weight, s.delta)
    [0.5 0.5] [False False]
    """

    wi: Any
    weight: Any
    pdf: Any
    delta: Any

    def _repr_html_(self) -> str | None:
        return repr_html(self)


class Jacobian(NamedTuple):
    """The result of `jacobian`: f [1/sr], and its derivative by each parameter or direction asked for.

    Example
    >>> j = gn.Lambertian(0.5).jacobian([0, 0, 1], [0, 0, 1])
    >>> print(j.f.round(4), j.by["rho"].round(4))
    0.1592 0.3183
    """

    f: Any
    by: dict[str, Any]
