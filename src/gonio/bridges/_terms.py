"""What exports to other programs share: a material as weighted terms, numbers as text, and refusals."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.reflectance import Reflectance
from ..base.sums import Scaled, Sum
from ..base.textured import require_numbers
from ..errors import ParameterError


def terms(m: Reflectance, weight: Any = 1.0) -> list[tuple[Any, Reflectance]]:
    """The terms of a sum, of sums in it too, each with its weight."""
    if isinstance(m, Sum):
        return [pair for term in m.terms for pair in terms(term, weight)]
    if isinstance(m, Scaled):
        return terms(m.of, np.asarray(m.weight) * weight)
    return [(weight, m)]


def texts(value: Any) -> list[str]:
    """The numbers of a value, in float32, which these programs compute with."""
    return [np.format_float_positional(np.float32(x), trim="-") for x in np.atleast_1d(np.asarray(value, dtype=float))]


def number(m: Reflectance, what: str, value: Any) -> float:
    """A value that has no channels. Raises ParameterError for one that has."""
    if np.size(value) > 1:
        raise ParameterError(
            f"{m!r:.60}: {what} has {np.size(value)} channels; expected one number, as the program has"
        )
    return float(np.asarray(value).reshape(-1)[0])


def most(value: Any) -> float:
    """The largest number of a value."""
    return float(np.max(value))


def refusal(m: Reflectance, program: str, holds: str, instead: str) -> ParameterError:
    """The error for a material that a program does not hold exactly."""
    return ParameterError(f"{m!r:.90}: {program} holds no material of equal f; expected {holds}; {instead}")


def require_plain(m: Reflectance, program: str) -> None:
    """Raises ParameterError for maps and textures, for what fluoresces, and for channels that are neither RGB nor
    wavelengths."""
    require_numbers(m, program)
    if m.fluoresces:
        rule = "and light keeps its wavelength there; expected an ordinary material: m.under(light)"
        raise ParameterError(f"{m!r:.60}: fluoresces, {rule}, for {program}")
    for path, p in m.parameters.items():
        if np.ndim(p.value) > 1:
            raise ParameterError(f"{m!r:.60}: {path} is a map; expected a number or one per channel for {program}")
    if m.channels not in (None, 1, 3) and m.wavelengths is None:
        raise ParameterError(f"{m!r:.60}: {m.channels} channels; expected RGB, or wavelengths: m.with_channels(...)")
