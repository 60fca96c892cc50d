"""The BSDF that Mitsuba sees: it is made for the variant that is set, because its base class is that variant's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from ...arrays.kinds import SCALAR, VALUE
from ...base import kernels
from ...base.reflectance import Reflectance
from ...base.sums import lobes_on
from ...errors import ParameterError
from ...evaluate.tracing import Task, traced
from ...formula import tree
from ...models.lambertian import Lambertian
from .colours import Colours
from .numbers import MitsubaNumber, numbers, parameters, tables
from .walk import walk


def _both(m: Reflectance, mean: Reflectance, wi: Any, wo: Any) -> tuple[Any, ...]:
    return (*kernels.value(m, mean, wi, wo), *kernels.pdf(m, mean, wi, wo))


F, PDF = 0, 1
BOTH = Task(_both, (VALUE, SCALAR), (3, 3))
DRAWN = kernels.SAMPLE[3]


class Carried:
    """A material whose formulas are carried out with the numbers of a variant of Mitsuba."""

    def __init__(self, mi: Any, m: Reflectance):
        self.mi, self.m = mi, m
        self.colours = Colours(mi, m)
        self.numbers, self.tables = numbers(mi, m), tables(mi, m)
        for task in (BOTH, DRAWN):
            traced(task, m, self.colours.copies)  # raises what stands in the way now, not while Mitsuba renders

    def run(
        self,
        task: Task,
        wanted: Sequence[int],
        inputs: Sequence[Sequence[Any]],
        value: Callable[[MitsubaNumber, int], Any] | None = None,
    ) -> list[list[Any]]:
        """Some of the results of a task, each as a list of numbers; `value`: the numbers of the material."""
        mi, held = self.mi, self.numbers
        trace = traced(task, self.m, self.colours.copies)
        merged: dict[int, Any] = {}

        def load(array: int, component: int) -> Any:
            if array < trace.inputs:
                return inputs[array][component]
            k = array - trace.inputs
            if k < len(held):
                return value(held[k], component) if value else held[k].at(mi, component)
            k -= len(held)
            if k not in merged:
                merged[k] = held[k].merged(mi)
            return merged[k]

        results = walk(mi, trace.graph, [n for i in wanted for n in trace.results[i]], load, self.tables)
        ends = iter(results)
        return [[next(ends) for _ in trace.results[i]] for i in wanted]

    def coloured(
        self, task: Task, place: int, others: Sequence[int], inputs: Sequence[Sequence[Any]], wavelengths: Any
    ) -> tuple[Any, list[list[Any]]]:
        """A result that has channels as a colour, and others that have none."""
        if not self.colours.lanes:
            values, *rest = self.run(task, [place, *others], inputs)
            return self.colours.of(values, wavelengths), rest
        rest = self.run(task, others, inputs) if others else []
        colour = self.colours.along(
            self.numbers,
            wavelengths,
            lambda number: self.run(task, [place], inputs, lambda n, _: number(n))[0],
        )
        return colour, rest


def _is_straight(m: Reflectance) -> bool:
    """Whether what a delta lobe lets through goes straight on, so that Mitsuba may follow it as through empty space."""
    across = any(lobes_on(m, "across", back).has_delta for back in (False, True))
    return across and isinstance(m.index, float) and m.index == 1.0


def _flags_of(mi: Any, m: Reflectance) -> list[int]:
    """Mitsuba's flags for each kind of lobe of a material: what it is, and on which sides of the surface."""
    kinds: dict[int, int] = {}
    for back, side in ((False, mi.BSDFFlags.FrontSide), (True, mi.BSDFFlags.BackSide)):
        for lit_from in ("front", "across"):
            for _, lobe in lobes_on(m, lit_from, back).lobes():
                flag = _kind(mi, lobe, lit_from, m)
                kinds[flag] = kinds.get(flag, 0) | int(side)
    common = int(mi.BSDFFlags.Anisotropic) if tree.is_oriented(m) else 0
    return [flag | sides | common for flag, sides in kinds.items()]


def _kind(mi: Any, lobe: Reflectance, lit_from: str, m: Reflectance) -> int:
    flags = mi.BSDFFlags
    if lit_from == "across":
        if lobe.is_delta:
            return int(flags.Null if _is_straight(m) else flags.DeltaTransmission | flags.NonSymmetric)
        return int(flags.GlossyTransmission | flags.NonSymmetric)
    if lobe.is_delta:
        return int(flags.DeltaReflection)
    return int(flags.DiffuseReflection if isinstance(lobe, Lambertian) else flags.GlossyReflection)


@cache
def kind(variant: str) -> type:
    """The class of BSDFs for the variant that is set.

    Directions are drawn with densities that count as constants where parameters are differentiated: what depends on
    them is f alone, as it must be for pictures that are means of f/pdf.
    """
    import drjit as dr
    import mitsuba as mi

    class Gonio(mi.BSDF):  # type: ignore[misc,name-defined,unused-ignore]  # Mitsuba's classes are of a variant, known when it is set
        """A gonio reflectance."""

        def __init__(self, props: Any, m: Reflectance):
            super().__init__(props)
            self.carried = Carried(mi, m)
            self.m_components = _flags_of(mi, m)
            self.m_flags = 0
            for flags in self.m_components:
                self.m_flags |= flags
            kinds, straight = mi.BSDFFlags, _is_straight(m)
            self._kinds = [kinds.GlossyReflection, kinds.GlossyTransmission, kinds.DeltaReflection]
            self._kinds.append(kinds.Null if straight else kinds.DeltaTransmission)
            self._straight = straight
            self._relative = mi.Float(float(np.mean(m.index)))

        def traverse(self, callback: Any) -> None:
            put = getattr(callback, "put", None) or callback.put_parameter  # as Mitsuba 3.6 calls it
            for number in parameters(self.carried.numbers):
                put(number.name, number.value, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys: Sequence[str] = ()) -> None:
            dr.make_opaque(*(number.value for number in self.carried.numbers))

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self._f(ctx, si, wo, active, [])[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            _require_all(ctx)
            ((pdf,),) = self.carried.run(BOTH, [PDF], [_constant(wo), _constant(si.wi)])
            return dr.select(active, _there(pdf), 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            if ctx.mode == mi.TransportMode.Importance:
                return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)
            value, ((pdf,),) = self._f(ctx, si, wo, active, [PDF])
            return value, dr.select(active, dr.detach(_there(pdf)), 0.0)

        def _f(self, ctx: Any, si: Any, wo: Any, active: Any, others: Sequence[int]) -> tuple[Any, list[list[Any]]]:
            """f times the cosine, and other results. Mitsuba's wi is where a path comes from: the viewer's side for
            radiance, the light's for importance."""
            _require_all(ctx)
            wi, wo_ = (wo, si.wi) if ctx.mode == mi.TransportMode.Radiance else (si.wi, wo)
            colour, rest = self.carried.coloured(BOTH, F, others, [list(wi), list(wo_)], si.wavelengths)
            return dr.select(active, _there(colour) * dr.abs(wo.z), 0.0), rest

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            _require_all(ctx)
            u = [dr.detach(x) for x in (sample2.x, sample2.y, sample1)]
            weight, (wi, (pdf,), (delta,)) = self.carried.coloured(
                DRAWN, 1, [0, 2, 3], [_constant(si.wi), u], si.wavelengths
            )
            bs: Any = dr.zeros(mi.BSDFSample3f)
            bs.wo = dr.detach(mi.Vector3f(*wi))
            bs.pdf = dr.select(active, dr.detach(_there(pdf)), 0.0)
            valid = active & (bs.pdf > 0.0)
            across = bs.wo.z * si.wi.z < 0.0
            bs.eta = dr.select(across, self._index(si), 1.0)
            kinds = [mi.UInt32(int(flags)) for flags in self._kinds]
            smooth, sharp = dr.select(across, kinds[1], kinds[0]), dr.select(across, kinds[3], kinds[2])
            bs.sampled_type = dr.select(delta, sharp, smooth)
            bs.sampled_component = mi.UInt32(0)
            if ctx.mode == mi.TransportMode.Importance:
                reverse = self._f(ctx, si, bs.wo, valid, [])[0] / dr.select(valid, bs.pdf, 1.0)
                weight = dr.select(delta, weight * dr.square(bs.eta), reverse)
            elif dr.grad_enabled(si.wi):
                attached = self._f(ctx, si, bs.wo, valid, [])[0] / dr.select(valid, bs.pdf, 1.0)
                weight = dr.select(delta, weight, attached)
            return bs, dr.select(valid, _there(weight), 0.0)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            if not self._straight:
                return mi.Spectrum(0.0)
            colour, _ = self.carried.coloured(kernels.DELTA_TRANSMISSION, 0, [], [list(si.wi)], si.wavelengths)
            return dr.select(active, _there(colour), 0.0)

        def _index(self, si: Any) -> Any:
            """Refractive index on the other side of the surface over that of the side of si.wi."""
            return dr.select(si.wi.z >= 0.0, self._relative, dr.rcp(self._relative))

        def to_string(self) -> str:
            return f"Gonio[{self.carried.m!r:.200}]"

    def _constant(w: Any) -> list[Any]:
        return [dr.detach(x) for x in w]

    def _there(x: Any) -> Any:
        """The value, 0 where a measurement holds none."""
        return dr.select(dr.isnan(x), 0.0, x)

    def _require_all(ctx: Any) -> None:
        if ctx.component != 0xFFFFFFFF or ctx.type_mask & int(mi.BSDFFlags.All) != int(mi.BSDFFlags.All):
            raise ParameterError(
                "a gonio BSDF was asked for some of its lobes (BSDFContext.type_mask or component); expected all: the "
                "formula is one, and integrators that take lobes apart cannot use it"
            )

    return Gonio
