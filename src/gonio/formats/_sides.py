"""Files that hold more than the reflection of one side: what of it is read, and the `Sheet` that it makes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import numpy as np

from ..arrays.kinds import with_channels
from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError
from ..models._quarters import QUARTERS, quarters, sheet_of
from ..models._reversed import Reversed
from ..models.sheet import Sheet
from ..numerics.lattice import lattice

SIDES = ("front", "back", "both")
Side = Annotated[
    str | None,
    Declared(
        "side of the sample that is lit and seen; both: all that the file holds, transmission too, as a Sheet; if not "
        "given the front, and all of a file without reflection",
        words=(*SIDES,),
    ),
]
SideOfReflection = Annotated[
    str | None,
    Declared(
        "front: the reflection; both: all that the file holds, transmission too, as a Sheet that is the same from both "
        "sides; if not given the reflection, if there",
        words=("front", "both"),
    ),
]

CALLED = {
    "front": "reflection of the front",
    "back": "reflection of the back",
    "forward": "transmission of light on the front",
    "backward": "transmission of light on the back",
}


def wanted(
    held: Collection[str], side: str | None, path: Path | str, usual: Collection[str] = ("front",)
) -> tuple[str, ...]:
    """The quarters to read of those that a file holds: a reflection, or all.

    Without a side that of `usual` which is there; all, where there is no reflection. Raises FormatError, with what is
    there and what to write, where the file has no reflection of this side.
    """
    there = tuple(name for name in QUARTERS if name in held)
    if side is None:
        side = next((name for name in usual if name in held), "front" if "back" in held else "both")
    if side == "both" and there:
        return there
    if side not in there:
        ways = [f"side={name!r}" for name in (*(s for s in ("front", "back") if s in there), *["both"][: len(there)])]
        listed = ", ".join(CALLED[name] for name in there) or "nothing else"
        advice = f"; read it with {' or '.join(ways)}" if ways else ""
        raise FormatError(f"{path}: holds no reflection of the {side}, but {listed}{advice}")
    return (side,)


def joined(parts: Mapping[str, Reflectance], side: str | None) -> Any:
    """The quarters that `wanted` named: a reflection alone, or a `Sheet`."""
    if len(parts) == 1 and side != "both" and (alone := {*parts} & {"front", "back"}):
        return parts[alone.pop()]
    return sheet_of(parts)


def is_part(m: Reflectance) -> bool:
    """Whether a reflectance is lit and seen in front only: one part, with no others beside it to be written."""
    return m.sides == "front"


def read_as(m: Reflectance) -> Iterator[tuple[Reflectance, tuple[str, ...]]]:
    """The parts of a reflectance, each with the quarters of a file that it may have been: alone, of either side."""
    for quarter, part in quarters(m).items():
        yield part, ("front", "back") if part is m else (quarter,)


def whole(m: Reflectance, options: Collection[str]) -> dict[str, str]:
    """Those of a reader's options with which it reads all parts of a reflectance."""
    return {} if is_part(m) else {name: "both" for name in ("side",) if name in options}


def same_from_both(m: Reflectance, format: str) -> dict[str, Reflectance]:
    """Reflection ("front") and transmission ("forward") of a reflectance, for formats that name no side.

    Raises ParameterError where one that is not in front only differs between the sides.
    """
    parts = quarters(m)
    if is_part(m):
        return parts
    for one, other in (("front", "back"), ("forward", "backward")):
        if (one in parts) != (other in parts) or (one in parts and not _alike(parts[one], parts[other])):
            raise ParameterError(
                f"{m!r:.80}: its {CALLED[one]} and {CALLED[other]} differ, and {format} names no side; expected "
                f"gn.Sheet(R, R, T, T), the same from both sides, or a format with sides"
            )
    return {name: parts[name] for name in ("front", "forward") if name in parts}


def _alike(a: Reflectance, b: Reflectance) -> bool:
    """Whether two reflectances are the same: by their fields, or f at 512 pairs of directions."""
    if a is b or (type(a) is type(b) and a == b):
        return True
    u = lattice(512, 4)
    theta, phi = np.arccos(1.0 - u[:, ::2]), 2.0 * np.pi * u[:, 1::2]
    angles = (theta[:, 0], phi[:, 0], theta[:, 1], phi[:, 1])
    f, g = np.broadcast_arrays(*(with_channels(m.f_angles(*angles), 1) for m in (a, b)))
    return bool(np.allclose(f, g, rtol=1e-9, atol=0.0, equal_nan=True))


def refuse(m: Reflectance, module: ModuleType, formats: Collection[ModuleType]) -> None:
    """Raises ParameterError for a reflectance on both sides, where a format holds what is reflected in front only."""
    if is_part(m) or getattr(module, "TRANSMITS", False):
        return
    both = [other for other in formats if getattr(other, "TRANSMITS", False) and hasattr(other, "write")]
    able = ", ".join(other.NAME for other in both if not hasattr(other, "same_from_both"))
    alike = ", ".join(other.NAME for other in both if hasattr(other, "same_from_both"))
    raise ParameterError(
        f"{m!r:.80}: has {_listed(m)}, and {module.NAME} holds reflection of one side only; expected a reflectance in "
        f"front, such as a part of a Sheet; formats that hold both sides: {able}; if both are the same: {alike}"
    )


def _listed(m: Reflectance) -> str:
    return " and ".join(CALLED[name] for name in quarters(m)) or "two sides"


def with_notes(m: Reflectance, change: Callable[[Any], Any]) -> Reflectance:
    """A measurement, or a `Sheet` of measurements, each of which is changed once."""
    if isinstance(m, Measured):
        return change(m)
    if not isinstance(m, Sheet):
        return m
    parts = [part for name in QUARTERS if isinstance(part := getattr(m, name), Measured)]
    changed: dict[int, Reflectance] = {id(part): change(part) for part in parts}
    if not changed:
        return m
    for name in QUARTERS:
        part = getattr(m, name)
        if isinstance(part, Reversed) and id(part.of) in changed:
            changed[id(part)] = Reversed(changed[id(part.of)])
    return Sheet(**{name: changed.get(id(part := getattr(m, name)), part) for name in QUARTERS})


def about_of(m: Reflectance) -> dict[str, Any]:
    """The notes of a file on itself, of a measurement or of the first measured part of a `Sheet`."""
    measured = [part for part in quarters(m).values() if isinstance(part, Measured)]
    return dict(measured[0].about) if measured else {}
