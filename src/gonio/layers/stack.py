"""Layers upon a base, or upon nothing, as one reflectance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import takewhile
from typing import Any, Self

import numpy as np

from ..arrays import Fixed
from ..base.calls import variables
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..base.results import Jacobian
from ..base.sides import choose
from ..base.sums import weighed
from ..errors import ParameterError, shown
from ..evaluate import batch
from ..formula import tree
from ..formula.direction import Direction
from ..formula.fields import Param, part
from ..formula.mueller import Mueller
from ..formula.state import derived
from ..formula.table_warp import tables_when_needed
from ..tables.drawing import KINDS, lobe_tables
from . import polarized
from .layer import AnyLayer, Interface, Layer, Medium, RoughInterface
from .layered import _Layered
from .lobes import _Mirrors, _Once, _PassedOnce, _Reflected, _Refracted, _Seen, _Straight, mirroring
from .table_lobes import _Rest, _Table, _Through, turned_over


class Stack(_Layered):
    """Layers, the first on top, upon a base or upon nothing: light goes to and fro between them any number of times.

    Closed forms are the delta lobes, what the first interface reflects at once, and what is scattered once or reflected
    by the base behind smooth interfaces and media. The rest is computed when it is first needed: matrices of the layers
    over cosines, one for each order of the Fourier series in azimuth, are added, and f is looked up in splines through
    the result. f is reciprocal; light is lost where a layer or the base absorbs it, and nowhere else.
    The base is lit and seen inside the last medium. Upon nothing the layers are lit and seen from both sides, and what
    goes through them is transmitted: f/n_o^2 is reciprocal, n_o the index where light leaves; `index` is the product of
    the interfaces'. `tolerance`: what nodes, orders and terms are chosen by.

    `f` counts light as unpolarized at each interface. `mueller` is as bright, and has what smooth interfaces do to s
    and p: to light on its way to a rough interface, to the base or to the particle that scatters it once, and back;
    delta lobes with all their bounces. Other light is unpolarized before it leaves through the interfaces on top.

    Looks    `Stack([Interface(1.5), Medium(2, [0.99, 0.6, 0.3])], Microfacet(GGX(0.3)))` is red lacquer on metal.
    Shapes   parameters: numbers or (C,).
    Units    f: 1/sr.
    Error    of f of media beside DISORT, depth 0.003 to 50, cosines above 0.03: 5e-4, for g < -0.5 1.5e-3; of albedos
             of white stacks: 1e-4, at depth 0.003 4e-4; closed forms are integrated at few polar angles, once, and the
             others lie between them within the tolerance. Behind rough interfaces f is good to 1e-4 (median), 4e-3 near
             peaks of narrow lobes. docs/layers.md has more, and what it costs in time and memory.
    Source   Jakob, d'Eon, Jakob & Marschner 2014, "A comprehensive framework for rendering layered materials", ACM TOG
             33(4):118; van de Hulst 1980, Multiple Light Scattering, for adding and doubling.

    Example
    >>> paint = gn.Stack([gn.Interface(1.5), gn.Medium(5.0, albedo=[0.99, 0.9, 0.5])], gn.Lambertian(0.1))
    >>> print(gn.albedo(paint, gn.direction(0.5, 0.0)).round(3))
    [0.527 0.263 0.087]
    >>> milk = gn.Stack([gn.Interface(1.5), gn.Medium(2.0, 1.0), gn.Interface(1 / 1.5)])
    >>> print(gn.albedo(milk, [0, 0, 1]).round(3), gn.transmittance(milk, [0, 0, 1]).round(3))
    0.489 0.511
    """

    def __init__(self, layers: Sequence[Layer], base: Reflectance | None = None, *, tolerance: float = 1e-3):
        several: list[Any] = list(layers) if isinstance(layers, (list, tuple)) else [layers]
        for number, layer in enumerate(several):
            if not isinstance(layer, AnyLayer):
                rule = "expected layers, Interface, RoughInterface or Medium, from the top down"
                raise ParameterError(
                    f"Stack: layer {number} is {shown(layer)}; {rule}, and what is below them as base="
                )
        if not (isinstance(base, Reflectance) or base is None):
            raise ParameterError(f"Stack(base={shown(base)}): expected a reflectance, or None for nothing")
        if not (isinstance(tolerance, (int, float)) and 1e-6 <= tolerance <= 0.1):
            raise ParameterError(f"Stack(tolerance={shown(tolerance)}): expected a number from 1e-6 to 0.1")
        values: dict[str, Any] = {str(i): layer for i, layer in enumerate(several)}
        fields = {name: part(Layer, None, f"layer {name}, from the top") for name in values}
        if base is not None:
            values["base"], fields["base"] = base, part(Reflectance, None, "what lies under the layers")
        widths = {np.shape(x)[-1] for value in values.values() for x in tree.leaves(value) if np.ndim(x)}
        for name, field in fields.items():
            field.name = name
        fields["channel"], values["channel"] = self.fields["channel"], max(widths) if widths else 0.0
        self._hold(tolerance=float(tolerance))
        self._set(values, fields=fields)
        self.validate()
        self._hold(bends=any(self._kinks(behind) for behind in {False, self.base is None}))

    def validate(self) -> None:
        for path, field, value, _ in tree.walk(self):
            if isinstance(field, Param) and not isinstance(value, (float, np.ndarray)):
                rule = "layers are computed by NumPy; give numbers, and take derivatives from m.jacobian"
                raise ParameterError(f"Stack: {path} is a {type(value).__name__}; {rule}")
        batch.channels(self)  # raises ShapeError where layers have different numbers of them
        if map_shape(self):
            raise ParameterError("Stack: a parameter is a map; expected numbers, or one for each channel")
        if self.base is not None and not self.base.is_isotropic():
            raise ParameterError(
                f"Stack(base={self.base!r:.60}): is anisotropic; expected a base that looks the same turned"
            )

    @property
    def nodes(self) -> int:
        """The number of cosines, from the normal to the horizon, that the layers' matrices are over.

        Example
        >>> print(gn.Stack([gn.RoughInterface(1.5, 0.1)], gn.Lambertian(0.5)).nodes)
        57
        """
        return self._response(0).nodes

    @property
    def orders(self) -> int:
        """The number of orders of the Fourier series in azimuth, most of all channels.

        Example
        >>> print(gn.Stack([gn.Interface(1.5)], gn.Lambertian(0.5)).orders)
        1
        """
        return max(self._response(c).orders for c in range(self.channels or 1))

    def turned(self, back: Any) -> Reflectance:
        if self.base is not None:
            return super().turned(back)
        if isinstance(back, bool):
            return weighed((self._over if back else self).lobes())
        here = [(choose(back, 0.0, 1.0), lobe) for _, lobe in self._closed()]
        there = [(choose(back, 1.0, 0.0), lobe) for _, lobe in self._over._closed()]
        return weighed([*here, *there, *self._tabulated(turned_over(self.behind, back))])

    @derived
    def _over(self) -> Stack:
        """Seen from the other side."""
        return self._as(Stack, behind=not self.behind)

    def _remade(self, changes: dict[str, Any]) -> Self:
        layers = [changes.get(str(i), layer) for i, layer in enumerate(self.layers)]
        new = type(self)(layers, changes.get("base", self.base), tolerance=self.tolerance)
        names = self._given("channel_names")
        return new if names is None else tree.with_notes(new, channel_names=names)

    def _key(self) -> tuple[Any, ...]:
        return (*((n, v) for n, v in super()._key() if n != "channel"), ("tolerance", self.tolerance))

    def __repr__(self) -> str:
        base = "" if self.base is None else f", {self.base!r}"
        tolerance = "" if self.tolerance == Stack.tolerance else f", tolerance={self.tolerance!r}"
        return f"Stack({list(self.layers)!r}{base}{tolerance})"

    def to_json(self) -> dict[str, Any]:
        names, base = self._given("channel_names"), self.base
        data: dict[str, Any] = {"type": "Stack", "layers": [layer.to_json() for layer in self.layers]}
        data |= {} if base is None else {"base": base.to_json()}
        return data | {"tolerance": self.tolerance} | ({} if names is None else {"channel_names": list(names)})

    def jacobian(self, wi: Any, wo: Any, by: Iterable[str] | None = None) -> Jacobian:
        names = variables(self, by)[0]
        paths = tuple(name for name in names if name not in ("wi", "wo"))
        return Reflectance.jacobian(self._with_slopes(paths), wi, wo, names)

    def _with_slopes(self, paths: tuple[str, ...]) -> Stack:
        by_paths = self._derived.setdefault(Stack._with_slopes, {})
        if paths not in by_paths:
            bare = self._as(Stack, paths=paths)
            by_paths[paths] = bare._as(Stack, _kept=bare._keep())
        sloped: Stack = by_paths[paths]
        return sloped

    def _keep(self) -> dict[str, Fixed]:
        kept = super()._keep()

        def drawn() -> np.ndarray:
            ways = (self.behind,) if self.base is not None else (False, True)
            rests = [self._as(_Rest, _kept=kept, behind=behind) for behind in ways]
            return np.concatenate([lobe_tables(rest, False) for rest in rests], axis=1)

        return kept | tables_when_needed(KINDS, drawn)

    # Lobes.

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        return self._lobes

    @derived
    def _lobes(self) -> tuple[tuple[Any, Reflectance], ...]:
        """Lobes that remain: they keep their integrals, and plans of kernels."""
        return *self._closed(), *self._tabulated(self.behind)

    def _closed(self) -> Iterable[tuple[Any, Reflectance]]:
        """The lobes in closed form."""
        layers, base = self._seen(), self.base
        rough = [layer for layer in layers if isinstance(layer, RoughInterface)]
        over = [*takewhile(lambda layer: not isinstance(layer, RoughInterface), layers)]
        if any(isinstance(layer, Interface) for layer in over) or (not rough and base is not None and base.has_delta):
            yield 1.0, self._as(_Mirrors)
        if rough:
            yield 1.0, self._as(_Reflected) if over else mirroring(rough[0])
        if any(isinstance(layer, Medium) for layer in over):
            yield 1.0, self._as(_Once)
        if not rough and base is not None:
            for weight, lobe in base.lobes():
                if not lobe.is_delta:
                    yield weight, self._as(_Seen, base=lobe)
        if base is None:
            if not rough:
                yield 1.0, self._as(_Straight)
                if any(isinstance(layer, Medium) for layer in layers):
                    yield 1.0, self._as(_PassedOnce)
            if len(rough) == 1:
                yield 1.0, self._as(_Refracted)

    def _tabulated(self, behind: Any) -> Iterable[tuple[Any, Reflectance]]:
        """The lobes of all other light, seen from behind or not: a symbol serves both sides with one look-up."""
        if self.base is not None:
            yield 1.0, self._as(_Rest)
        elif any(not isinstance(layer, Interface) for layer in self.layers):
            yield 1.0, self._as(_Rest, behind=behind)
            yield 1.0, self._as(_Through, behind=behind)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        if self.base is None:
            raise self._lacks("formula")
        total: Any = 0.0
        for weight, lobe in self.lobes():
            if not lobe.is_delta:
                total = total + weight * lobe.formula(wi, wo)
        return total

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        if self.base is None:
            raise self._lacks("polarized")
        closed, rest = [], Mueller.depolarizer(0.0 * wi.z)
        for weight, lobe in self.lobes():
            if isinstance(lobe, _Table):
                rest = rest + lobe.polarized(wi, wo) * weight
            elif not lobe.is_delta:
                closed.append(lobe.polarized(wi, wo) * weight)
        return polarized.together(closed, rest)

    @property
    def polarizes(self) -> bool:
        """Whether there is an interface, or a base that polarizes; over nothing light goes straight through, as it was.

        Example
        >>> print(gn.Stack([gn.Medium(1.0)], gn.Lambertian(0.5)).polarizes, gn.Stack([gn.Medium(1.0)]).polarizes)
        False True
        """
        return self.base is None or self.base.polarizes or any(not isinstance(layer, Medium) for layer in self.layers)
