"""The two slabs of OpenPBR that lie on others: its coat, a varnish, and its fuzz, fibres or dust."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula import tree
from ..formula.direction import Direction, raised
from ..formula.fields import param, part
from ..formula.fresnel.schlick import Schlick
from ..formula.mueller import Mueller
from ..formula.warp import power_positive
from ._ggx_albedo import chebyshev2, entering
from ._wrapper import WrappedLobe, Wrapper
from .lambertian import Lambertian
from .microfacet import ggx_mirrors
from .sheen import CharlieSheen


class _Layer(Wrapper):
    """The layer's own light, and that of the base which the layer lets through."""

    wraps = "base"
    base: Any

    @abstractmethod
    def below(self) -> type[_BelowLayer]:
        """Class of the lobes of the base."""

    @abstractmethod
    def top(self) -> tuple[Any, Reflectance]:
        """Weight and reflectance of the layer."""

    @abstractmethod
    def passed(self, wi: Direction, wo: Direction) -> Any:
        """The factor of the base, the same when directions are exchanged."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        weight, top = self.top()
        return weight * top.formula(wi, wo) + self.passed(wi, wo) * self.base.formula(wi, wo)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        weight, top = self.top()
        return top.polarized(wi, wo) * weight + self.base.polarized(wi, wo) * self.passed(wi, wo)

    @property
    def polarizes(self) -> bool:
        return self.base.polarizes

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        yield self.top()
        values = {name: self.__dict__[name] for name in self.fields}
        for weight, lobe in self.base.lobes():
            yield weight, tree.unchecked(self.below(), **(values | {"base": lobe}))


class _BelowLayer(WrappedLobe, _Layer):
    """A lobe of the base as it is seen through the layer."""

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.passed(wi, wo) * self.base.formula(wi, wo)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        return self.base.polarized(wi, wo) * self.passed(wi, wo)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        _, wi = raised(self.mirrored(wo))
        return self.base.polarized_mirror(wo) * self.passed(wi, wo)

    def mirrored(self, wo: Direction) -> Direction:
        return self.base.mirrored(wo)

    def mirror(self, wo: Direction) -> Any:
        _, wi = raised(self.mirrored(wo))
        return self.passed(wi, wo) * self.base.mirror(wo)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        return self.base.warp(wo, u0, u1)

    def density(self, wi: Direction, wo: Direction) -> Any:
        return self.base.density(wi, wo)

    def estimate(self, wo: Direction) -> Any:
        return self.passed(wo, wo) * self.base.estimate(wo)


class OpenPBRCoat(_Layer):
    """OpenPBR's coat over any base: f = C f_coat + (1 - C max(E_i, E_o)) (1 - C + C T) f_base.

    C is the weight; f_coat = `Microfacet(GGX(alpha), Schlick(F0))`, alpha = roughness^2 (at least 0.001),
    F0 = ((ior - 1)/(ior + 1))^2, E(mu) its albedo; T = color^((1/mu_i' + 1/mu_o')/2), mu' the cosines of the
    directions refracted into the coat, is the share that passes it.
    The whole stack is `OpenPBRFuzz(OpenPBRCoat((1 - M) * OpenPBRGlossyDiffuse(...) + M * OpenPBRMetal(...)))`.
    The specification scales the base by 1 - C E_o, which is not reciprocal; the larger E is, and conserves energy over
    any base that does. Light is lost that comes in at a slant and is scattered to where E is smaller: over white
    Lambertian surfaces and smooth coats of index 1.6, 4.5 % at normal incidence, 3.5 % at 60 degrees and 0.1 % at 85;
    under rough ones (roughness = 1) 0.8 % and 0.3 %.
    Left out: the exact Fresnel term, in whose place is Schlick's, which rises to 1 at grazing also where ior = 1;
    anisotropy; light that the coat sends back to the base (the specification's darkening = 0; `Coated` follows it);
    and the coat's effect on the base's own roughness and index.

    Looks    `OpenPBRCoat(Lambertian([0.8, 0.1, 0.1]))` is lacquer with a sharp highlight; `coat_color=[1, 0.8, 0.4]` is
             amber varnish, `coat_roughness=0.5` is frosted.
    Shapes   all: numbers or (..., C).
    Units    f: 1/sr; all others: 1.
    Error    E, a fit: 7e-4; so is the albedo, which over a white base may exceed 1 by this.
    Source   Andersson et al. 2024, "OpenPBR Surface", specification 1.1, section on the coat, with its view-dependent
             absorption. The reciprocal form is derived here.

    Example
    >>> lacquer = gn.OpenPBRCoat(gn.Lambertian([0.8, 0.1, 0.1]), coat_color=[1.0, 0.8, 0.4], coat_roughness=0.3)
    >>> print(gn.albedo(lacquer, gn.direction(0.5, 0.0)).round(3))
    [0.784 0.125 0.087]
    """

    base = part(Reflectance, Lambertian(0.5), "reflectance under the coat")
    coat_weight = param(1.0, 0.0, 1.0, "share of the surface that is coated")
    coat_color = param(1.0, 0.0, 1.0, "share of light that passes the coat twice, straight through")
    coat_roughness = param(0.0, 0.0, 1.0, "alpha = roughness^2", sampled="max")
    coat_ior = param(1.6, 1.0, 3.0, "refractive index of the coat over that above it")

    @property
    def alpha(self) -> Any:
        """Slope scale of the coat.

        Example
        >>> print(gn.OpenPBRCoat(coat_roughness=0.5).alpha)
        0.25
        """
        return ops.maximum(self.coat_roughness * self.coat_roughness, 1e-3)

    @property
    def F0(self) -> Any:
        """Reflectance of the coat at normal incidence.

        Example
        >>> print(round(gn.OpenPBRCoat(coat_ior=1.6).F0, 4))
        0.0533
        """
        amplitude = (self.coat_ior - 1.0) / (self.coat_ior + 1.0)
        return amplitude * amplitude

    def below(self) -> type[_BelowCoat]:
        return _BelowCoat

    def top(self) -> tuple[Any, Reflectance]:
        return self.coat_weight, ggx_mirrors(self.alpha, tree.unchecked(Schlick, F0=self.F0))

    def path(self, w: Direction) -> Any:
        """1/cos(theta) of w refracted into the coat.

        Example
        >>> from gonio.authoring import Direction
        >>> print(round(float(gn.OpenPBRCoat(coat_ior=1.6).path(Direction(0.8, 0.0, 0.6))), 4))
        1.1547
        """
        return self.coat_ior / ops.sqrt((self.coat_ior - 1.0) * (self.coat_ior + 1.0) + w.z * w.z)

    def passed(self, wi: Direction, wo: Direction) -> Any:
        bare = 1.0 - self.coat_weight
        left = power_positive(self.coat_color, 0.5 * (self.path(wi) + self.path(wo)))
        least = ops.minimum(entering(wi.z, self.alpha, self.F0), entering(wo.z, self.alpha, self.F0))
        return (bare + self.coat_weight * least) * (bare + self.coat_weight * left)


class _BelowCoat(_BelowLayer, OpenPBRCoat):
    """A lobe under the coat."""


class OpenPBRFuzz(_Layer):
    """OpenPBR's fuzz over any base, with another sheen: f = W color f_sheen + (1 - W max(E_i, E_o)) f_base.

    W is the weight; f_sheen = `CharlieSheen(1, r)`, r = roughness (at least 0.1), and E(mu) is its albedo. The
    specification has here the volume of fibres of Zeltner, Burley & Chiang 2022, whose numbers are tables; and it
    scales the base by 1 - W E_o, which is not reciprocal. The larger E is, and conserves energy over any base that
    does; light is lost that comes in at a slant and is scattered to where E is smaller: over a white Lambertian
    surface 14 % at normal incidence and 4 % at 60 degrees (roughness 0.5; of 0.1, 8 % and 3.5 %).
    As in the specification the base is not tinted, as if all fibres were white.
    The whole stack is `OpenPBRFuzz(OpenPBRCoat((1 - M) * OpenPBRGlossyDiffuse(...) + M * OpenPBRMetal(...)))`.

    Looks    `OpenPBRFuzz(Lambertian([0.3, 0.05, 0.05]))` is red peach skin with a pale rim; `fuzz_roughness=0.1` keeps
             the fuzz to the very rim.
    Shapes   all: numbers or (..., C).
    Units    f: 1/sr; all others: 1.
    Error    E, a fit from above: 0 to 0.0065, and at 1 where the sheen's albedo is above that, more than
             89.9996 degrees from the normal (1.5 at most), where a white fuzz reflects too much.
    Source   Andersson et al. 2024, "OpenPBR Surface", specification 1.1, section on fuzz; the sheen: Estevez & Kulla
             2017. The reciprocal form and E are derived here.

    Example
    >>> peach = gn.OpenPBRFuzz(gn.Lambertian([0.3, 0.05, 0.05]), fuzz_roughness=0.3)
    >>> print(gn.albedo(peach, gn.direction([0.2, 1.3], 0.0)).round(3))
    [[0.294 0.085 0.085]
     [0.558 0.404 0.404]]
    """

    base = part(Reflectance, Lambertian(0.5), "reflectance under the fuzz")
    fuzz_weight = param(1.0, 0.0, 1.0, "share of the surface that is covered")
    fuzz_color = param(1.0, 0.0, 1.0, "reflectance of the fibres")
    fuzz_roughness = param(0.5, 0.0, 1.0, "how far from the horizon the normals of the fibres spread")

    @property
    def sheen(self) -> CharlieSheen:
        """The fibres, white.

        Example
        >>> print(gn.OpenPBRFuzz(fuzz_roughness=0.3).sheen.f_angles(0.0, 0.0, 1.4, 0.0).round(4))
        0.0461
        """
        return tree.unchecked(CharlieSheen, rho=1.0, r=ops.maximum(self.fuzz_roughness, 0.1))

    def below(self) -> type[_BelowFuzz]:
        return _BelowFuzz

    def top(self) -> tuple[Any, Reflectance]:
        return self.fuzz_weight * self.fuzz_color, self.sheen

    def passed(self, wi: Direction, wo: Direction) -> Any:
        most = ops.maximum(sheen_albedo(self.sheen, wi), sheen_albedo(self.sheen, wo))
        return 1.0 - self.fuzz_weight * most


class _BelowFuzz(_BelowLayer, OpenPBRFuzz):
    """A lobe under the fuzz."""


def sheen_albedo(m: CharlieSheen, w: Direction) -> Any:
    """The albedo E(mu) of `CharlieSheen(1, r)`, of a reflectance that may not exceed 1, from above.

    Error    0 to 0.0065, 0.003 on average.
    Source   linear programming on 1600 points, against `gonio.albedo`. What is fitted is E mu (1 + Lambda), smooth.
    """
    smooth = chebyshev2(_SHEEN, 1.2 * w.z / (w.z + 0.2), 0.1 / m.r)
    return ops.minimum(smooth / (w.z * (1.0 + m._lambda(w))), 1.0)


# Coefficients of T_j(1 - 0.2/r) T_i(1 - 2.4 mu/(mu + 0.2)), a row for each j.
_SHEEN = (
    (0.53396, 0.43739, -0.01653, 0.01394, 0.00695, 0.00086),
    (-0.11615, -0.27371, -0.02044, 0.00814, -0.01167, 0.00302),
    (-0.01150, -0.04794, 0.01826, -0.00501, 0.00305, 0.00012),
    (-0.00176, -0.01248, 0.00679, -0.00283, 0.00353, -0.00164),
    (-0.00041, -0.00261, 0.00159, -0.00067, 0.00137, -0.00081),
)
