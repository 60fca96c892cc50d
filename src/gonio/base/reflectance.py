"""The contract of a reflectance, whole: what a model writes, components in and numbers out, and what everyone calls.

A model writes `formula(wi, wo)`, and for importance sampling `warp(wo, u0, u1)` with its `density(wi, wo)`; all else
that it may write stands here too, with what holds where it does not; what it writes with is in `gonio.authoring`. `wi`
points to the light, `wo` to the viewer, both away from the surface. What everyone calls follows from that by one set of
kernels: see `kernels.py`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self

from ..declared.notebooks import repr_html, repr_png
from ..errors import ArrayTypeError
from ..formula import tree, warp
from ..formula.direction import Direction, mirror
from ..formula.fields import CLASSES
from ..formula.mueller import Mueller
from ..formula.parametrised import Parametrised
from ..formula.state import attribute, inferred, known, note
from . import calls, reradiation
from . import channel_names as names
from .advice import instead
from .results import NO_HINTS, Hints
from .sides import choose, lit_behind, refuse_hooks

if TYPE_CHECKING:
    from ..numerics.quadrature import Integrals


class Reflectance(Parametrised):
    """Base of everything that reflects. See `f`, `pdf`, `sample`, `parameters`, `replace`, `+`, `*`.

    Example
    >>> m = 0.8 * gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    >>> wi, wo = gn.direction(0.5, 0.0), gn.direction(0.5, np.pi)
    >>> print(m.f(wi, wo).round(3), m.pdf(wi, wo).round(3))
    0.502 1.567
    """

    def __init_subclass__(cls, **words: Any) -> None:
        refuse_hooks(cls)
        super().__init_subclass__(**words)

    # What models write: f and its samples.
    @abstractmethod
    def formula(self, wi: Direction, wo: Direction) -> Any:
        """f [1/sr], without the cosine, for directions above the horizon (of a lobe across wi below); 0 of a mirror."""
        raise self._lacks("formula")

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        """A direction wi for two uniform numbers; its density is `density`."""
        wi = warp.cosine_hemisphere(u0, u1)
        return Direction(wi.x, wi.y, -wi.z) if self.sides == "across" else wi

    def density(self, wi: Direction, wo: Direction) -> Any:
        """Density per solid angle [1/sr] of `warp`."""
        return warp.cosine_hemisphere_density(-wi if self.sides == "across" else wi)

    def estimate(self, wo: Direction) -> Any:
        """Roughly the share of light that is reflected: sums sample their lobes in this proportion."""
        return 1.0 + 0.0 * wo.z

    def diffuse(self) -> Any:
        """Albedo of the Lambertian part of f, where there is one: f is never below this over pi."""
        return None

    breaks: ClassVar[dict[str, str]] = {}
    """Laws of `gonio.check` that this model does not obey for all parameters, each with the reason."""

    @property
    def hints(self) -> Hints:
        """What quadrature should know: where `warp` jumps, kinks of f, and how the slopes of a smooth lobe spread.

        Example
        >>> print(gn.Microfacet(gn.GGX(0.1)).hints.spread)
        Spread(alpha_x=0.1, alpha_y=0.1, reach=inf)
        """
        return NO_HINTS

    # Mirrors.
    @property
    def is_delta(self) -> bool:
        """Whether this is a delta lobe, a perfect mirror; a model that is one says `is_delta = True`.

        Example
        >>> print(gn.IdealSpecular(0.04).is_delta, gn.Lambertian(0.3).is_delta)
        True False
        """
        return False

    def mirror(self, wo: Direction) -> Any:
        """Reflectance of a delta lobe at the mirror direction.

        A model that becomes a mirror as its widths (parameters whose `sampled` is "max" or "min") go to their narrow
        bounds may write it: `gonio.check` tests this limit."""
        raise self._lacks("mirror")

    def mirrored(self, wo: Direction) -> Direction:
        """The direction wi that a delta lobe reflects into wo; of one across the surface that straight behind it."""
        return -wo if self.sides == "across" else mirror(wo)

    # Sums, and both sides of a surface.
    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        """The terms of this sum: pairs (weight, model)."""
        yield 1.0, self

    @property
    def sides(self) -> str:
        """Where light and viewer may be: "front", "across" or "both"; a class says `sides = "across"`.

        "front": both above the surface. "across": of a lobe, wo above and wi below it. "both": of a sum of such lobes,
        anywhere; it writes `lobes` and `turned`, and its `formula` is not called, but theirs."""
        return "front"

    @property
    def index(self) -> Any:
        """Refractive index behind the surface over that in front: 1 where both sides are of one medium."""
        return 1.0

    def turned(self, back: Any) -> Reflectance:
        """This as seen from behind where `back` is 1, not 0 (or True or False), with both directions turned half a turn
        about the y axis: wo is then above the surface again. Whatever is lit and seen in front only gives 0 there; a
        lobe across the surface is its own reverse, unless it says otherwise (an index becomes its inverse)."""
        if self.sides != "front":
            return self
        front: Reflectance = tree.unchecked(CLASSES["Scaled"], weight=choose(back, 0.0, 1.0), of=self)
        return front

    # Polarization and fluorescence.
    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        """The Mueller matrix of f [1/sr], in the axes of `formula/mueller.py`; without it light leaves unpolarized."""
        return Mueller.depolarizer(self.formula(wi, wo))

    def polarized_mirror(self, wo: Direction) -> Mueller:
        """The Mueller matrix of a delta lobe at the mirror direction; without it what is mirrored is unpolarized."""
        return Mueller.depolarizer(self.mirror(wo))

    @property
    def polarizes(self) -> bool:
        """Whether more than the first element of `mueller` can differ from 0."""
        if self.sides == "both":
            return any(lobe.polarizes for back in (False, True) for _, lobe in self.turned(back).lobes())
        return type(self).polarized is not Reflectance.polarized

    @property
    def fluoresces(self) -> bool:
        """Whether light may leave at another wavelength than it arrived at; a model that does this says `True`.

        Example
        >>> print(gn.Lambertian(0.5).fluoresces, gn.Donaldson([[0.2, 0.0], [0.3, 0.6]]).fluoresces)
        False True
        """
        return any(part.fluoresces for part in calls.reflectances(self).values())

    def reradiated(self, light: Self, wi: Direction, wo: Direction) -> Any:
        """Fluorescence: the light of one wavelength that leaves as light of another, [1/sr] per band. `self` has the
        numbers of the wavelength that leaves, `light` is the same material with those of the one that arrives."""
        return 0.0

    # What few models write, for the one room that asks.
    @property
    def _split(self) -> bool:
        """Whether this lobe and the next, for light on the other side, share a draw; `estimate` is that of both."""
        return False

    def _chance(self, wi: Direction, wo: Direction) -> Any:
        """The probability that what both lobes of a split share goes to this one, where it is drawn as this wi."""
        return 1.0 + 0.0 * wo.z

    @property
    def _single_scatter(self) -> Any:
        """Facets like these that absorb nothing: they lack of 1 what is scattered twice; None where nothing is lost."""
        return None

    @property
    def _glows_evenly(self) -> bool:
        """Whether what is re-radiated is as that of a Lambertian surface, from and to all directions alike."""
        return False

    _lit_behind, _without_slopes = property(lit_behind), calls.without_slopes
    _with_rounds, _require_bands = reradiation.with_rounds, reradiation.require_bands

    def _collected(self, w: Any, incident: bool, goal: float, each: Callable[[Any, float], Integrals]) -> Any:
        """`Integrals` of f cos for fixed directions w (n, 3) of the viewer, or `incident` of light, to an error `goal`,
        of a lobe that has them of few (None: it has not); `each`: those of directions (k, 3), one by one."""
        return None

    # What everyone calls: arrays in, arrays out.
    f = calls.f  # (wi, wo, out=None, uv=None): the BRDF, of what transmits the BSDF [1/sr], without the cosine
    f_angles = calls.f_angles  # (theta_i, phi_i, theta_o, phi_o): the same for angles [rad]
    pdf = calls.pdf  # (wi, wo): the density [1/sr] with which `sample` draws wi
    sample = calls.sample  # (wo, u): directions wi drawn by numbers u, with weights f |cos(theta_i)| / pdf
    jacobian = calls.jacobian  # (wi, wo, by=None): f, and its exact derivatives by parameters and directions
    mueller = calls.mueller  # (wi, wo): the Mueller matrix of the BRDF [1/sr]
    delta_reflectance = calls.delta_reflectance  # (wo, across=False): of all delta lobes at the mirror direction
    delta_mueller = calls.delta_mueller  # (wo, across=False): their Mueller matrix
    has_delta = attribute(calls.has_delta)  # whether any lobe is a delta lobe
    is_isotropic = calls.is_isotropic  # (): whether turning both directions about the normal changes nothing
    under = reradiation.under  # (light, seen=None): the material that looks the same under light of a spectrum
    reradiation = reradiation.reradiation  # (wi, wo): the matrix of light that leaves at one and arrived at another

    # Its channels: `channel_names.py`.
    channels = attribute(names.channels)  # how many there are; None where f has no channel axis
    channel_names = inferred(names.known_to_formula)  # names, or wavelengths [nm]; None: as the parameters imply
    wavelengths = known(names.wavelengths)  # [nm], (C,); None where channels have names in words, or none
    with_channels = names.with_channels  # (names): a copy whose channels have these names, or wavelengths
    at = names.at  # (wavelengths=None, uv=None): a copy with the numbers at wavelengths [nm], or at places
    _declares: ClassVar[Mapping[str, str]] = MappingProxyType({"wavelengths": "float | Array | None"})
    _declared, _at, _replaced = names.of_constructor, names.interpolated, names.replaced
    _name_channels, _key, _written, to_json = names.take_names, names.key, names.written, names.to_json

    # Sums, and products with weights: `sums.py`.
    def __add__(self, other: Reflectance) -> Reflectance:
        if not isinstance(other, Reflectance):
            return NotImplemented
        both: Reflectance = CLASSES["Sum"]._joined([self, other])
        return both

    def __radd__(self, other: Any) -> Reflectance:  # `sum` begins with 0
        return self if isinstance(other, int) and other == 0 else NotImplemented

    def __mul__(self, weight: Any) -> Reflectance:
        if isinstance(weight, Reflectance):
            raise ArrayTypeError("a reflectance times a reflectance; expected a number or an array of weights")
        scaled: Reflectance = CLASSES["Scaled"](weight, self)
        return scaled

    __rmul__ = __mul__

    def __truediv__(self, number: Any) -> Reflectance:
        quotient: Reflectance = calls.divided(self, number)
        return quotient

    __array_ufunc__ = None  # np.float64(0.4) * m is ours to compute
    __pandas_priority__ = 5000  # and so is Series * m, whose own is 3000

    _repr_html_, _repr_png_ = repr_html, repr_png
    _numbers_from: str = note("")  # the source of the numbers of a built-in material
    _noun: ClassVar[str] = "a reflectance"
    _reflects: ClassVar[str] = "{}"
    _instead = staticmethod(instead)
    _known_elsewhere: ClassVar[dict[str, str]] = {
        **dict.fromkeys(("__call__", "eval", "evaluate", "brdf", "bsdf", "value"), "m.f(wi, wo)"),
        **dict.fromkeys(("plot", "show"), "gn.render(m, lights).save(path), or on the command line: gonio show"),
    }
