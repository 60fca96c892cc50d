"""The one interface: a reflectance gives f, pdf and sample, lists its parameters, and adds and scales.

A model writes `formula(wi, wo)`, and for importance sampling `warp(wo, u0, u1)` with its `density(wi, wo)`; everything
else here follows from these. `wi` points to the light, `wo` to the viewer, both away from the surface.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np

from ..arrays import ops
from ..arrays.kinds import SCALAR, VALUE, VECTOR
from ..arrays.labels import Labels, is_named
from ..errors import ArrayTypeError, NotFoundError, ParameterError, TooLargeError, shown
from ..evaluate import batch
from ..formula import warp
from ..formula.direction import Direction, mirror
from ..formula.distribution import Spread
from ..formula.fields import param, part
from ..formula.parametrised import Parametrised
from ..formula.state import inferred, note
from ..formula.text import listed, literal
from ..numerics.lattice import lattice
from . import channel_names, kernels
from .advice import instead
from .angles import direction


class Sample(NamedTuple):
    """The result of `sample`: incident directions drawn for given `wo`.

    wi      (..., 3)     unit vectors
    weight  (...[, C])   f cos(theta_i) / pdf, with the total f and the pdf of the whole material; for a delta sample
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


class Jacobian(NamedTuple):
    """The result of `jacobian`: f [1/sr], and its derivative by each parameter or direction asked for.

    Example
    >>> j = gn.Lambertian(0.5).jacobian([0, 0, 1], [0, 0, 1])
    >>> print(j.f.round(4), j.by["rho"].round(4))
    0.1592 0.3183
    """

    f: Any
    by: dict[str, Any]


class Reflectance(Parametrised):
    """Base of everything that reflects. See `f`, `pdf`, `sample`, `parameters`, `replace`, `+`, `*`.

    Example
    >>> m = 0.8 * gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    >>> wi, wo = gn.direction(0.5, 0.0), gn.direction(0.5, np.pi)
    >>> print(m.f(wi, wo).round(3), m.pdf(wi, wo).round(3))
    0.502 1.567
    """

    noun: ClassVar[str] = "a reflectance"
    reflects: ClassVar[str] = "{}"

    breaks: ClassVar[dict[str, str]] = {}
    """Laws of `gonio.check` that this model does not obey for all parameters, each with the reason."""
    known_elsewhere: ClassVar[dict[str, str]] = {
        **dict.fromkeys(("__call__", "eval", "evaluate", "brdf", "bsdf", "value"), "m.f(wi, wo)"),
        "plot": "gn.render(m, lights).save(path), or on the command line: gonio show",
        "show": "gn.render(m, lights).save(path), or on the command line: gonio show",
    }
    numbers_from: str = note("")
    """The source of the numbers of a built-in material."""

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

    if TYPE_CHECKING:

        @property
        def channel_names(self) -> tuple[Any, ...] | None:
            """Names of the channels, or wavelengths [nm]; None: as the parameters imply (three: linear sRGB)."""

    else:
        channel_names = note(None)

    def with_channels(self, names: Iterable[str | float] | None) -> Self:
        """A copy whose channels have these names, or wavelengths; `None` takes them away.

        Sums, products, coats and `replace` keep them, as long as the number of channels stays the same; JSON files too.
        Numbers that look like micrometres are announced by a MeaningWarning.

        Shapes   names: one for each channel.
        Units    wavelengths: nm.

        Example
        >>> field = gn.RossLi(f_iso=[0.05, 0.3], f_vol=[0.02, 0.16], f_geo=[0.01, 0.03]).with_channels(["red", "nir"])
        >>> (field + gn.Lambertian(0.01)).channel_names
        ('red', 'nir')
        """
        if names is None:
            return self.with_notes(channel_names=None)
        return self.with_notes(channel_names=channel_names.checked(names, self))

    def _name_channels(self, whole: Labels) -> None:
        names = whole.channel_names
        if names is not None and self.channel_names is None and self.channels == len(names):
            self._hold(channel_names=channel_names.checked(names, self))

    def _replaced(self, grouped: dict[str, Any]) -> Self:
        new = super()._replaced(grouped)
        names = self._given("channel_names")
        if names is not None and self.channels == len(names) != new.channels:
            return new.with_notes(channel_names=None)
        return new

    def to_json(self) -> dict[str, Any]:
        names = self._given("channel_names")
        return super().to_json() | ({} if names is None else {"channel_names": list(names)})

    @property
    def channels(self) -> int | None:
        """The number of channels of f, which the parameters decide; None where f has no channel axis.

        Example
        >>> print(gn.Lambertian(0.5).channels, gn.Lambertian([0.6, 0.1, 0.05]).channels)
        None 3
        """
        return batch.channels(self)

    # Written by models: components in, numbers out.

    @abstractmethod
    def formula(self, wi: Direction, wo: Direction) -> Any:
        """f [1/sr] for directions above the horizon, without the cosine."""
        raise self._lacks("formula")

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        """A direction wi for two uniform numbers; its density is `density`."""
        return warp.cosine_hemisphere(u0, u1)

    def density(self, wi: Direction, wo: Direction) -> Any:
        """Density per solid angle [1/sr] of `warp`."""
        return warp.cosine_hemisphere_density(wi)

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
        """The direction wi that a delta lobe reflects into wo.

        Example
        >>> from gonio.authoring import Direction
        >>> print(gn.IdealSpecular().mirrored(Direction(0.6, 0.0, 0.8)))
        Direction(x=-0.6, y=-0.0, z=0.8)
        """
        return mirror(wo)

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        """The terms of this sum: pairs (weight, model)."""
        yield 1.0, self

    def diffuse(self) -> Any:
        """Albedo of the Lambertian part of f, where there is one: f is never below this over pi."""
        return None

    # Used by everyone: arrays in, arrays out.

    def f(self, wi: Any, wo: Any, out: Any = None) -> Any:
        """The BRDF f(wi, wo), radiance out over irradiance in.

        Shapes   wi, wo: (..., 3), broadcast against each other; result (...), or (..., C) for C channels.
        Units    [1/sr], without the cosine. 0 where a direction is below the horizon (cosine <= 1e-6), NaN where a
                 direction is NaN. A delta lobe contributes 0.

        Example
        >>> m = gn.Lambertian([0.6, 0.1, 0.05])
        >>> print(m.f([0, 0, 1], [0.6, 0.0, 0.8]).round(4))
        [0.191  0.0318 0.0159]
        >>> print(m.f(gn.direction([0.1, 0.2, 0.3], 0.0), [0, 0, 1]).shape)
        (3, 3)
        """
        return batch.run(kernels.value, (VALUE,), self, (wi, wo), (3, 3), out)[0]

    def pdf(self, wi: Any, wo: Any) -> Any:
        """Density [1/sr] with which `sample` draws wi for given wo, delta lobes left out; shape (...).

        Example
        >>> m = gn.Microfacet(gn.GGX(0.1))
        >>> print(m.pdf(gn.direction(0.5, 0.0), gn.direction([0.4, 0.5, 0.6], np.pi)).round(3))
        [5.551 9.061 6.19 ]
        """
        return batch.run(kernels.pdf, (SCALAR,), self, (wi, wo), (3, 3))[0]

    def sample(self, wo: Any, u: Any) -> Sample:
        """Incident directions for given wo (..., 3) and uniform numbers u (..., 2) in [0, 1); a 1 is replaced by the
        largest float32 below it.

        Example
        >>> m = gn.Lambertian(0.5) + gn.IdealSpecular(0.04)
        >>> s = m.sample(gn.direction(0.5, 0.0), np.random.default_rng(1).random((10000, 2)))
        >>> print(s.wi.shape, s.weight.mean().round(2))  # the albedo
        (10000, 3) 0.54
        """
        return Sample(*batch.run(kernels.sample, (VECTOR, VALUE, SCALAR, SCALAR), self, (wo, u), (3, 2)))

    def jacobian(self, wi: Any, wo: Any, by: Iterable[str] | None = None) -> Jacobian:
        """f(wi, wo) and its exact derivatives, at the cost of a few evaluations.

        `by`: paths of `parameters`, and "wi" or "wo" for the components of a direction; all parameters if not given.
        The derivative by a parameter is that of each value by the number that it depends on: of channel c by the
        parameter's entry c, of a place on a map by the parameter there. Derivatives by a direction are those of the
        formula by x, y and z as three free numbers; for what happens along the sphere take the tangential part.

        Shapes   wi, wo: (..., 3) NumPy arrays; derivatives (...[, C]) by a parameter, (...[, C], 3) by a direction.
        Units    1/sr over the unit of the parameter. 0 below the horizon.
        Error    rounding: the formula's graph is differentiated, nothing is approximated.

        Example
        >>> m = gn.Microfacet(gn.GGX(0.2), 0.9)
        >>> j = m.jacobian(gn.direction(0.5, 0.0), gn.direction(0.5, np.pi), by=["distribution.alpha_x"])
        >>> print(j.f.round(4), j.by["distribution.alpha_x"].round(4))
        2.3111 -23.2474
        """
        names, leaves, inputs = self._variables(by)
        value, *slopes = batch.jacobian(kernels.value, self, (wi, wo), (3, 3), leaves, inputs)
        return Jacobian(value, dict(zip(names, slopes, strict=True)))

    def _variables(self, by: Iterable[str] | None) -> tuple[list[str], tuple[int, ...], tuple[int, ...]]:
        """What `jacobian` differentiates by: the names, and the places of parameters and of directions among them."""
        if by is None and (every := self.alike.get(Reflectance._variables)):
            known: tuple[list[str], tuple[int, ...], tuple[int, ...]] = every
            return known
        leaves = {path: i for i, path in enumerate(self.leaf_paths()) if path}
        inputs = {"wi": 0, "wo": 1}
        expected = f"expected one of {listed([*leaves, *inputs])}"
        try:
            variables = list(self.parameters if by is None else [by] if isinstance(by, str) else by)
        except TypeError:
            raise ParameterError(f"jacobian(by={shown(by)}): {expected}, or a list of them") from None
        for path in variables:
            if not isinstance(path, str) or (path not in leaves and path not in inputs):
                raise NotFoundError(f"jacobian(by={shown(path)}): {expected}")
        paths, directions = ([p for p in variables if p in places] for places in (leaves, inputs))
        found = [*paths, *directions], tuple(leaves[p] for p in paths), tuple(inputs[p] for p in directions)
        if by is None:
            self.alike[Reflectance._variables] = found
        return found

    def f_angles(self, theta_i: Any, phi_i: Any, theta_o: Any, phi_o: Any) -> Any:
        """f of polar angles and azimuths [rad]; the four broadcast against each other.

        Example
        >>> m = gn.Microfacet(gn.GGX(0.1))
        >>> print(m.f_angles(0.5, 0.0, [0.4, 0.5, 0.6], np.pi).round(3))
        [ 6.321 10.317  7.049]
        """
        return self.f(direction(theta_i, phi_i), direction(theta_o, phi_o))

    def delta_reflectance(self, wo: Any) -> Any:
        """Reflectance (...[, C]) of all delta lobes together at the mirror direction of wo (..., 3).

        Example
        >>> coated = gn.Lambertian(0.3) + gn.IdealSpecular(gn.Dielectric(1.5))
        >>> print(coated.delta_reflectance(gn.direction([0.0, 1.4], 0.0)).round(3))
        [0.04  0.395]
        """
        return batch.run(kernels.delta_reflectance, (VALUE,), self, (wo,), (3,))[0]

    def breaches(self) -> dict[str, str]:
        """Laws of `gonio.check` that this, or a reflectance it is made of, does not obey, each with the reason.

        Example
        >>> print(list((gn.Lambertian(0.5) + gn.OriginalPhong(0.2)).breaches()))
        ['reciprocity', 'energy']
        """
        of_parts = [part.breaches() for part in self._components() if isinstance(part, Reflectance)]
        return {law: reason for breaches in (*of_parts, self.breaks) for law, reason in breaches.items()}

    @property
    def has_delta(self) -> bool:
        """Whether any lobe is a delta lobe.

        Example
        >>> print(gn.IdealSpecular(0.04).has_delta, (gn.Lambertian(0.3) + gn.IdealSpecular(0.04)).has_delta)
        True True
        """
        return any(lobe.is_delta for _, lobe in self.lobes())

    def is_isotropic(self) -> bool:
        """Whether turning both directions about the normal changes nothing: f(theta_i, theta_o, phi_o - phi_i).

        Tested at 512 pairs of directions, to 1e-6 relative (Szeliski 2.82); with maps, at 512 in all, and at least at
        16 for every place on them.

        Example
        >>> print(gn.Microfacet(gn.GGX(0.1)).is_isotropic(), gn.Microfacet(gn.GGX(0.1, 0.4)).is_isotropic())
        True False
        """
        maps = batch.full_shape(self, ())
        pairs = lattice(max(16, 512 // max(math.prod(maps), 1)), 4)
        return all(map(self._is_same_turned, pairs if maps else [pairs]))

    def _is_same_turned(self, u: np.ndarray) -> bool:
        """Whether f at pairs of directions, from uniform numbers (..., 4), is the same after both are turned."""
        theta_i, theta_o = np.arccos(1.0 - u[..., 0]), np.arccos(1.0 - u[..., 3])
        phi_i, phi_o = 2.0 * np.pi * u[..., 1], 2.0 * np.pi * u[..., 2]
        f, turned = (self.f_angles(theta_i, turn + phi_i, theta_o, turn + phi_o) for turn in (0.0, 1.1))
        return bool(np.allclose(f, turned, rtol=1e-6, atol=1e-9, equal_nan=True))

    @staticmethod
    def instead(value: Any) -> str:
        """What to write where a reflectance is expected and this value was given."""
        return instead(value)

    def __add__(self, other: Reflectance) -> Sum:
        if not isinstance(other, Reflectance):
            return NotImplemented
        flat = [m.terms if isinstance(m, Sum) and m._given("channel_names") is None else (m,) for m in (self, other)]
        terms = [t for several in flat for t in several]
        return Sum(*terms)

    def __radd__(self, other: Any) -> Reflectance:
        """`sum` begins with 0."""
        return self if isinstance(other, int) and other == 0 else NotImplemented

    def __mul__(self, weight: Any) -> Scaled:
        if isinstance(weight, Reflectance):
            raise ArrayTypeError("a reflectance times a reflectance; expected a number or an array of weights")
        return Scaled(weight, self)

    __rmul__ = __mul__

    def __truediv__(self, number: Any) -> Scaled:
        if ops.is_masked(number) or is_named(number):
            scaled: Scaled = self * (1.0 / number)
            return scaled
        try:
            with np.errstate(divide="ignore", over="ignore"):
                return self * (1.0 / ops.numbers(number))
        except MemoryError:
            raise TooLargeError("a reflectance divided by an array that does not fit into memory") from None
        except (TypeError, ValueError) as error:
            raise ArrayTypeError(f"a reflectance divided by {number!r:.60}: {error}") from None

    __array_ufunc__ = None  # np.float64(0.4) * m is ours to compute
    __pandas_priority__ = 5000  # and so is Series * m, whose own is 3000


class Scaled(Reflectance):
    """A reflectance times a weight: f = weight * of.f.

    Shapes   weight: a number, or an array whose last axis is the channel axis.
    Units    weight: 1.
    Error    none of its own.
    Source   linearity of the reflection integral, Szeliski 2.83 (docs/equations.md).

    Example
    >>> m = 0.5 * gn.Lambertian(0.8)
    >>> print(m, gn.albedo(m, [0, 0, 1]).round(4))
    0.5 * Lambertian(rho=0.8) 0.4
    """

    weight = param(1.0, 0.0, 1e9, "factor")
    of = part(Reflectance, None, "what is scaled")

    @inferred
    def channel_names(self) -> tuple[Any, ...] | None:
        """Those of what is scaled."""
        names: tuple[Any, ...] | None = self.of.channel_names
        return names

    def __mul__(self, weight: Any) -> Scaled:
        """The product of both weights times `of`; nested where the product is no weight or of another shape."""
        nested = super().__mul__(weight)
        factors = [np.asarray(x) for x in (nested.weight, self.weight) if isinstance(x, (float, np.ndarray))]
        if len(factors) < 2 or len({x.shape for x in factors} - {()}) > 1:
            return nested
        if self._given("channel_names") is not None or nested._labels is not None:
            return nested
        product = factors[0] * factors[1]
        lossless = (product > 1e-300) & (product <= 1e9) | (factors[0] == 0.0) | (factors[1] == 0.0)
        return Scaled(product, self.of) if lossless.all() else nested

    __rmul__ = __mul__

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.weight * self.of.formula(wi, wo)

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for weight, lobe in self.of.lobes():
            yield self.weight * weight, lobe

    def diffuse(self) -> Any:
        albedo = self.of.diffuse()
        return None if albedo is None else self.weight * albedo

    def __repr__(self) -> str:
        inner = f"({self.of!r})" if isinstance(self.of, (Sum, Scaled)) else repr(self.of)
        return f"{literal(self.weight)} * {inner}"


class Sum(Reflectance):
    """Sum of reflectances: f = f_0 + f_1 + ...; the terms are numbered from 0 in parameter paths.

    Shapes   the terms' channels broadcast: one channel beside C gives C.
    Units    [1/sr].
    Error    rounding of the sum.
    Source   "diffuse + specular", lecture 4, eq. 4.7, corrected (docs/equations.md).

    Example
    >>> m = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    >>> print(m.replace({"0.rho": 0.3}).terms[0])
    Lambertian(rho=0.3)
    """

    def __init__(self, *terms: Reflectance):
        if not terms or not all(isinstance(t, Reflectance) for t in terms):
            raise ParameterError(f"Sum{terms!r:.60}: expected at least one reflectance and nothing else")
        fields = {str(i): part(Reflectance, None, f"term {i}") for i in range(len(terms))}
        for name, field in fields.items():
            field.name = name
        self._set(dict(zip(fields, terms, strict=True)), fields=fields)
        names = {t.channel_names for t in terms} - {None}
        if len(names) > 1:
            several = " and ".join(sorted(f"{n!r:.60}" for n in names))
            raise ParameterError(f"Sum: terms have channels {several}; expected the same names or wavelengths")

    @inferred
    def channel_names(self) -> tuple[Any, ...] | None:
        """The channel names of the terms that have any.

        Example
        >>> m = gn.material("gold", wavelengths=[450, 650]) + gn.Lambertian(0.1)
        >>> print(m.channel_names)
        (450.0, 650.0)
        """
        return next((names for t in self.terms if (names := t.channel_names) is not None), None)

    @property
    def terms(self) -> tuple[Reflectance, ...]:
        """The reflectances that are added.

        Example
        >>> m = gn.Lambertian(0.2) + gn.IdealSpecular(0.04)
        >>> print(m.terms)
        (Lambertian(rho=0.2), IdealSpecular(reflectance=Constant(reflectance=0.04)))
        """
        return tuple(self.__dict__[i] for i in self.fields)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        total = self.terms[0].formula(wi, wo)
        for term in self.terms[1:]:
            total = total + term.formula(wi, wo)
        return total

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for term in self.terms:
            yield from term.lobes()

    def diffuse(self) -> Any:
        albedos = [albedo for term in self.terms if (albedo := term.diffuse()) is not None]
        return sum(albedos[1:], albedos[0]) if albedos else None

    def __repr__(self) -> str:
        terms = list(map(repr, self.terms))
        plain = len(terms) > 1 and not any(isinstance(t, Sum) for t in self.terms)
        return " + ".join(terms) if plain else f"Sum({', '.join(terms)})"

    def to_json(self) -> dict[str, Any]:
        names = self._given("channel_names")
        named = {} if names is None else {"channel_names": list(names)}
        return {"type": "Sum", "terms": [t.to_json() for t in self.terms], **named}
