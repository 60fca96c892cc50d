"""Products with weights, and sums: reflectances that are made of others, term by term."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..errors import ParameterError, shown
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import param, part
from ..formula.mueller import Mueller
from ..formula.state import derived, inferred
from ..formula.text import literal
from .channel_names import declared_wavelengths, names_in_json
from .reflectance import Reflectance
from .sides import refuse_two_indices, sides_of


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

    def __mul__(self, weight: Any) -> Reflectance:
        """The product of both weights times `of`; nested where the product is no weight or of another shape."""
        nested = super().__mul__(weight)
        factors = [
            np.asarray(x) for x in (nested.__dict__["weight"], self.weight) if isinstance(x, (float, np.ndarray))
        ]
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
    def _glows_evenly(self) -> bool:
        return bool(self.of._glows_evenly)

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
        return product if declared_wavelengths(self) is None else super().__repr__()


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

    @classmethod
    def _joined(cls, materials: Iterable[Reflectance]) -> Sum:
        """The sum of materials, with the terms of sums in place of these."""
        flat = [m.terms if isinstance(m, Sum) and m._given("channel_names") is None else (m,) for m in materials]
        return cls(*(term for terms in flat for term in terms))

    def validate(self) -> None:
        refuse_two_indices(self)

    @derived
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
    def _glows_evenly(self) -> bool:
        return all(term._glows_evenly for term in self.terms if term.fluoresces)

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
        nm = declared_wavelengths(self)
        if len(terms) > 1 and nm is None and not any(isinstance(t, Sum) for t in self.terms):
            return " + ".join(terms)
        named = [] if nm is None else [f"wavelengths={literal(nm)}"]
        return f"Sum({', '.join(terms + named)})"

    def to_json(self) -> dict[str, Any]:
        return {"type": "Sum", "terms": [t.to_json() for t in self.terms], **names_in_json(self)}


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
