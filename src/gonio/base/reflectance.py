"""The one interface: a reflectance gives f, pdf and sample, lists its parameters, and adds and scales.

What models write is in `_hooks.py`, and what everyone calls in `_calls.py`; of wavelengths are `channel_names.py`
and `_fluorescence.py`. All of it together is `Reflectance`; its products and sums are reflectances too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, ClassVar

import numpy as np

from ..arrays import ops
from ..arrays.labels import is_named
from ..declared.notebooks import repr_html, repr_png
from ..errors import ArrayTypeError, ParameterError, TooLargeError, shown
from ..evaluate import batch
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import param, part
from ..formula.mueller import Mueller
from ..formula.state import inferred, note
from ..formula.text import literal
from ..numerics.lattice import lattice
from . import reradiation
from ._calls import Calls
from ._fluorescence import Fluorescent
from .advice import instead
from .sides import choose, refuse_two_indices, sides_of


class Reflectance(Calls, Fluorescent):
    """Base of everything that reflects. See `f`, `pdf`, `sample`, `parameters`, `replace`, `+`, `*`.

    Example
    >>> m = 0.8 * gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    >>> wi, wo = gn.direction(0.5, 0.0), gn.direction(0.5, np.pi)
    >>> print(m.f(wi, wo).round(3), m.pdf(wi, wo).round(3))
    0.502 1.567
    """

    _repr_html_ = repr_html
    _repr_png_ = repr_png

    _noun: ClassVar[str] = "a reflectance"
    _reflects: ClassVar[str] = "{}"

    _known_elsewhere: ClassVar[dict[str, str]] = {
        **dict.fromkeys(("__call__", "eval", "evaluate", "brdf", "bsdf", "value"), "m.f(wi, wo)"),
        "plot": "gn.render(m, lights).save(path), or on the command line: gonio show",
        "show": "gn.render(m, lights).save(path), or on the command line: gonio show",
    }
    numbers_from: str = note("")
    """The source of the numbers of a built-in material."""

    def turned(self, back: Any) -> Reflectance:
        """This reflectance as seen from behind where `back` is 1, not 0 (or True or False), with both directions turned
        half a turn about the y axis: wo is then above the surface again.

        Whatever is lit and seen in front only gives 0 there; a lobe across the surface is its own reverse, unless it
        says otherwise (an index becomes its inverse).

        Example
        >>> print(gn.RoughDielectric(gn.GGX(0.2), 1.25).turned(True).index)
        0.8
        """
        return tree.unchecked(Scaled, weight=choose(back, 0.0, 1.0), of=self) if self.sides == "front" else self

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        """The terms of this sum: pairs (weight, model)."""
        yield 1.0, self

    @property
    def polarizes(self) -> bool:
        """Whether more than the first element of `mueller` can differ from 0.

        Example
        >>> print(gn.Lambertian(0.5).polarizes, gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5)).polarizes)
        False True
        """
        if self.sides == "both":
            return any(lobe.polarizes for back in (False, True) for _, lobe in self.turned(back).lobes())
        return type(self).polarized is not Reflectance.polarized

    def under(self, light: Any, seen: Any = None) -> Reflectance:
        """The ordinary material that looks the same under light of a spectrum E: f = sum_i F[o, i] E_i / E_o.

        It serves wherever a reflectance does, `gn.render` and `gn.albedo` among them. It may send back more light of a
        wavelength than arrives: the albedo is the radiance factor of colour measurement, which fluorescence carries
        above 1. `seen`: another spectrum in the place of E_o, under whose light the picture is to be computed; needed
        where E has no light of a wavelength at which the material shines.

        Shapes   light, seen: (C,), a number per wavelength of the material, or a `gn.Spectrum`.
        Units    irradiance of a band, in any unit; seen: the same.
        Raises   ParameterError for negative light, spectra that end too early, and where `seen` is 0.

        Example
        >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
        >>> print(gn.albedo(ink.under([1.0, 1.0]), [0, 0, 1]).round(3))
        [0.2 0.9]
        >>> print(gn.albedo(ink.under([5.0, 1.0]), [0, 0, 1]).round(3))
        [0.2 2.1]
        """
        seen_as: Reflectance = reradiation.under(self, light, seen)
        return seen_as

    def breaches(self) -> dict[str, str]:
        """Laws of `gonio.check` that this, or a reflectance it is made of, does not obey, each with the reason.

        Example
        >>> print(list((gn.Lambertian(0.5) + gn.OriginalPhong(0.2)).breaches()))
        ['reciprocity', 'energy']
        """
        of_parts = [part.breaches() for part in tree.components(self) if isinstance(part, Reflectance)]
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
        z = 1.0 if self.sides == "front" else 2.0
        theta_i, theta_o = np.arccos(1.0 - z * u[..., 0]), np.arccos(1.0 - z * u[..., 3])
        phi_i, phi_o = 2.0 * np.pi * u[..., 1], 2.0 * np.pi * u[..., 2]
        f, turned = (self.f_angles(theta_i, turn + phi_i, theta_o, turn + phi_o) for turn in (0.0, 1.1))
        return bool(np.allclose(f, turned, rtol=1e-6, atol=1e-9, equal_nan=True))

    @staticmethod
    def _instead(value: Any) -> str:
        """What to write where a reflectance is expected and this value was given."""
        return instead(value)

    def __add__(self, other: Reflectance) -> Sum:
        if not isinstance(other, Reflectance):
            return NotImplemented
        return sum_of([self, other])

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
            raise ArrayTypeError(f"a reflectance divided by {shown(number)}: {error}") from None

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
    of = part(Reflectance, None, "what is scaled", sides="any")

    @property
    def sides(self) -> str:
        return str(self.of.sides)

    @property
    def index(self) -> Any:
        return self.of.index

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

    def turned(self, back: Any) -> Reflectance:
        return self._changed({"of": self.of.turned(back)})

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        scaled: Mueller = self.of.polarized(wi, wo) * self.weight
        return scaled

    @property
    def polarizes(self) -> bool:
        return bool(self.of.polarizes)

    @property
    def glows_evenly(self) -> bool:
        return bool(self.of.glows_evenly)

    def reradiated(self, light: Any, wi: Direction, wo: Direction) -> Any:
        return self.weight * self.of.reradiated(light.of, wi, wo)

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for weight, lobe in self.of.lobes():
            yield self.weight * weight, lobe

    def diffuse(self) -> Any:
        albedo = self.of.diffuse()
        return None if albedo is None else self.weight * albedo

    def __repr__(self) -> str:
        inner = f"({self.of!r})" if isinstance(self.of, (Sum, Scaled)) else repr(self.of)
        product = f"{literal(self.weight)} * {inner}"
        return product if self._declared_wavelengths() is None else super().__repr__()


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

    def __init__(self, *terms: Reflectance, wavelengths: Any = None):
        if not terms or not all(isinstance(t, Reflectance) for t in terms):
            raise ParameterError(
                f"Sum({', '.join(map(shown, terms[:3]))}): expected at least one reflectance and nothing else"
            )
        fields = {str(i): part(Reflectance, None, f"term {i}", sides="any") for i in range(len(terms))}
        for name, field in fields.items():
            field.name = name
        self._set(dict(zip(fields, terms, strict=True)), fields=fields)
        names = {t.channel_names for t in terms} - {None}
        if len(names) > 1:
            several = " and ".join(sorted(f"{n!r:.60}" for n in names))
            raise ParameterError(f"Sum: terms have channels {several}; expected the same names or wavelengths")
        self._take({"wavelengths": wavelengths})
        self.validate()

    def validate(self) -> None:
        refuse_two_indices(self)

    @property
    def sides(self) -> str:
        return sides_of(self.terms)

    @property
    def index(self) -> Any:
        return next((term.index for term in self.terms if term.sides != "front"), 1.0)

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

    def turned(self, back: Any) -> Reflectance:
        return self._changed({name: self.__dict__[name].turned(back) for name in self.fields})

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        total = self.terms[0].polarized(wi, wo)
        for term in self.terms[1:]:
            total = total + term.polarized(wi, wo)
        return total

    @property
    def polarizes(self) -> bool:
        return any(term.polarizes for term in self.terms)

    @property
    def glows_evenly(self) -> bool:
        return all(term.glows_evenly for term in self.terms if term.fluoresces)

    def reradiated(self, light: Any, wi: Direction, wo: Direction) -> Any:
        total = 0.0
        for term, other in zip(self.terms, light.terms, strict=True):
            if term.fluoresces:
                total = total + term.reradiated(other, wi, wo)
        return total

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for term in self.terms:
            yield from term.lobes()

    def diffuse(self) -> Any:
        albedos = [albedo for term in self.terms if (albedo := term.diffuse()) is not None]
        return sum(albedos[1:], albedos[0]) if albedos else None

    def __repr__(self) -> str:
        terms = list(map(repr, self.terms))
        declared = self._declared_wavelengths()
        if len(terms) > 1 and declared is None and not any(isinstance(t, Sum) for t in self.terms):
            return " + ".join(terms)
        named = [] if declared is None else [f"wavelengths={literal(declared)}"]
        return f"Sum({', '.join(terms + named)})"

    def to_json(self) -> dict[str, Any]:
        return {"type": "Sum", "terms": [t.to_json() for t in self.terms], **self._names_in_json()}


def sum_of(materials: Iterable[Reflectance]) -> Sum:
    """Their sum, with the terms of sums in place of these."""
    flat = [m.terms if isinstance(m, Sum) and m._given("channel_names") is None else (m,) for m in materials]
    terms = [t for several in flat for t in several]
    return Sum(*terms)


def weighed(parts: Iterable[tuple[Any, Reflectance]]) -> Sum:
    """A sum of reflectances times weights, unchecked, as formulas and integrals need it; without weights of 0.0."""
    terms = [tree.unchecked(Scaled, weight=w, of=m) for w, m in parts if not (isinstance(w, float) and w == 0.0)]
    values = {str(i): term for i, term in enumerate(terms)}
    fields = {name: part(Reflectance, None, f"term {name}", sides="any") for name in values}
    for name, field in fields.items():
        field.name = name
    return Sum._made_of({"fields": fields, "_tied": {}, "_derived": {}, "_alike": {}}, values)


def lobes_on(m: Reflectance, sides: str, back: bool = False) -> Reflectance:
    """The lobes whose light comes from "front", the viewer's side, or from "across" the surface; `back`: of the
    reflectance as seen from behind. Itself where it has no others; a sum of nothing where it has none of these."""
    if m.sides == sides and not back:
        return m
    seen = [] if m.sides == "front" else m.turned(back).lobes()
    return weighed((weight, lobe) for weight, lobe in seen if lobe.sides == sides)


def lets_through(m: Reflectance) -> bool:
    """Whether light goes through a material."""
    seen = (m.turned(back).lobes() for back in (False, True) if m.sides != "front")
    return any(lobe.sides == "across" for lobes in seen for _, lobe in lobes)


def drawn_apart(m: Reflectance) -> Iterable[tuple[Any, Reflectance]]:
    """The parts that may be drawn from one by one, with their weights: the lobes; but the whole where these depend on
    the side that it is seen from."""
    return m.lobes() if m.sides == "front" else [(1.0, m)]
