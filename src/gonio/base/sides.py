"""Sides: where light and viewer of a reflectance may be, and what that forbids."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..arrays import ops
from ..errors import REFUSALS, ParameterError, shown, suggestion
from ..formula.fields import CLASSES
from ..formula.text import listed
from .results import NO_HINTS, Hints

SIDES = ("front", "across", "both")


def sides_of(parts: Iterable[Any]) -> str:
    """The sides of a sum: those of its terms, where they all have the same, else "both"."""
    each = {part.sides for part in parts}
    return each.pop() if len(each) == 1 else "both"


def hemispheres(m: Any) -> tuple[float, ...]:
    """The signs of z where light and viewer may be: above the surface, and below it of what is not of one side."""
    return (1.0,) if m.sides == "front" else (1.0, -1.0)


def said_of_sides(m: Any) -> dict[str, str]:
    """A fact of a material that is lit or seen elsewhere than in front; none where that goes without saying."""
    return {} if m.sides == "front" else {"sides": str(m.sides)}


def refuse_transmission(m: Any, message: str) -> None:
    """Raises ParameterError with this message for what is not lit and seen in front alone."""
    if m.sides != "front":
        raise ParameterError(message)


def require_finite(m: Any, expected: str = "a model whose f is finite, of one side") -> None:
    """Raises ParameterError for a perfect mirror, and for what is not lit and seen in front alone."""
    if m.has_delta or m.sides != "front":
        what = "a perfect mirror" if m.has_delta else "it transmits light"
        raise ParameterError(f"{m!r:.80}: {what}; expected {expected}")


def is_lit(m: Any, z: Any) -> Any:
    """Whether light, or a viewer, so high above the surface can count; at -1 it does for what is not of one side."""
    return z > 0.0 if m.sides == "front" else z > -2.0


def lit_sides(m: Any) -> tuple[str, ...]:
    """The sides, "front" or "across", that light comes from, as a viewer above the surface sees it."""
    return ("front", "across") if m.sides == "both" else (m.sides,)


def sign_of_light(lobe: Any) -> float:
    """The sign of z for the light of a lobe, where the viewer is above the surface."""
    return -1.0 if lobe.sides == "across" else 1.0


def lit_behind(m: Any) -> str:
    """Why a material cannot be what is lit and seen in front only; nothing where it can."""
    return "" if m.sides == "front" else "it transmits light; expected a reflectance lit and seen in front only"


def refuse_hooks(cls: Any) -> None:
    """Raises ParameterError for a class whose sides or hints are not those that kernels and quadrature know."""
    place, sides, hints = f"class {cls.__name__}", vars(cls).get("sides"), vars(cls).get("hints", NO_HINTS)
    if isinstance(sides, str) and sides not in SIDES:
        raise ParameterError(f"{place}: sides = {sides!r}; expected {listed(SIDES)}{suggestion(sides, SIDES)}")
    if sides == "both" and cls.turned is CLASSES["Reflectance"].turned:
        rule = "a material of both sides writes turned(back), its lobes as they are seen from either side, and lobes()"
        raise ParameterError(f"{place}: sides = 'both'; {rule}")
    if not isinstance(hints, Hints) and not hasattr(hints, "__get__"):
        raise ParameterError(f"{place}: hints = {shown(hints)}; expected hints = Hints(seam=...)")


def choose(back: Any, behind: Any, before: Any) -> Any:
    """A number as seen from behind where `back` is 1, or True; else as seen from in front."""
    if isinstance(back, bool):
        return behind if back else before
    if isinstance(behind, float) and isinstance(before, float):
        return before + (behind - before) * back  # of the kind of the directions, as a choice of two floats is not
    return ops.where(back > 0.5, behind, before)


def shape_of(u: Any) -> tuple[int, ...]:
    """The shape of an array or of lists; () for what has none, which others refuse."""
    try:
        return tuple(np.shape(u))
    except REFUSALS:
        return ()


def _numbers(x: Any) -> np.ndarray | None:
    """Numbers that can be compared; None for those of other libraries, which may not be known yet."""
    return np.asarray(x, dtype=float) if isinstance(x, (int, float, np.ndarray)) else None


def refuse_two_indices(m: Any) -> None:
    """Raises ParameterError where terms of a sum have different refractive indices behind them."""
    if m.sides == "front":
        return
    indices = [term.index for term in m.terms if term.sides != "front"]
    comparable = [x for x in map(_numbers, indices) if x is not None]
    if any(x.shape != comparable[0].shape or not np.allclose(x, comparable[0], rtol=1e-12) for x in comparable[1:]):
        several = " and ".join(shown(x) for x in indices)
        raise ParameterError(
            f"Sum: terms have the refractive indices {several} behind over in front; expected one: both sides of a "
            f"surface have one medium each"
        )
