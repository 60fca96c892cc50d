"""Columns of a spectrum of reflectance by their names: the wavelength, the reflectance, its uncertainty, and others."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from ...cells import DELIMITERS, split
from .names import BRACKET, IGNORE, LONGEST, UNCERTAIN, UNCERTAINTY, WAVELENGTH, meaning, unit_in, unit_of

REFLECTANCE, OTHER = "reflectance", "other"

_REFLECTANCES = frozenset(
    (
        "reflectance",
        "reflectances",
        "reflectivity",
        "reflection",
        "refl",
        "albedo",
        "rho",
        "reflectancefactor",
        "sci",
        "sce",
    )
)
_OTHERS = {
    word: what
    for what, words in {
        "a transmittance": "transmittance transmissivity transmission transmitted trans tau",
        "an absorbance": "absorbance absorptance absorptivity absorption absorbed",
        "an optical density": "density od",
        "an emissivity": "emissivity emittance emissive",
        "a radiance": "radiance",
        "an irradiance": "irradiance exitance",
        "an intensity, or a power": "intensity power flux spd energy illuminant lamp emission candela photons",
        "a signal": "counts signal voltage current dn raw",
        "a refractive index": "index indices ior eta refractive",
        "an extinction coefficient": "extinction kappa",
        "a colour-matching function": "xbar ybar zbar cmf matching observer",
        "a sensitivity": "sensitivity responsivity response efficiency efficacy",
        "relative to something": "relative normalized normalised ratio log derivative",
    }.items()
    for word in words.split()
}
_LETTERS = {"t": "a transmittance", "a": "an absorbance", "n": "a refractive index", "k": "an extinction coefficient"}
_LETTERS |= {"e": "an irradiance, or an emissivity", "l": "a radiance", "s": "an intensity, or a power"}
_LETTERS |= dict.fromkeys("xyz", "a colour-matching function")
_POWER = re.compile(r"\bu?m?w ?[/·*]? ?(?:m|cm|sr|nm)\b|\b[wW]/|/ ?nm\b|nm-1\b|\bwm-2", re.IGNORECASE)


class SpectrumColumn(NamedTuple):
    """What a column holds: `key` is WAVELENGTH, REFLECTANCE, UNCERTAINTY, IGNORE, OTHER (`what` names it), or ""."""

    key: str
    unit: str = ""
    coverage: float | None = None
    relative: bool | None = None
    what: str = ""


def column(name: str) -> SpectrumColumn:
    """The meaning of a column's name."""
    of = meaning(name)
    alone = unit_of(name)
    if of.key == WAVELENGTH or alone in ("nm", "um"):
        return SpectrumColumn(WAVELENGTH, of.unit or alone or "")
    unit = "%" if "%" in name or "percent" in name.lower() else of.unit or unit_in(name)
    words = words_of(name)
    if of.key == UNCERTAINTY or UNCERTAIN & {*words} or any(mark in name for mark in UNCERTAIN if not mark.isalnum()):
        return SpectrumColumn(UNCERTAINTY, unit, of.coverage, of.relative)
    if what := other(name) or (_LETTERS.get(words[0], "") if words else ""):
        return SpectrumColumn(OTHER, what=what)
    if is_reflectance(words):
        return SpectrumColumn(REFLECTANCE, unit)
    return SpectrumColumn(IGNORE if of.key == IGNORE else "")


def words_of(name: str) -> list[str]:
    """The words of a name, in small letters, without those in brackets."""
    return re.findall(r"[^\W\d_]+", BRACKET.sub(" ", name[: 4 * LONGEST].lower()))


def other(name: str) -> str:
    """The quantity that words name and that is no reflectance, in words, or ""."""
    words = words_of(name)
    found = next((_OTHERS[word] for word in words if word in _OTHERS), "")
    if not found and _POWER.search(name[: 4 * LONGEST]):
        return "an intensity, or a power"
    return found


def is_reflectance(words: Sequence[str]) -> bool:
    """Whether words name a reflectance."""
    return bool(_REFLECTANCES & {*words}) or list(words[:1]) == ["r"]


def names_in(line: str, count: int) -> list[str]:
    """The cells of a line, if they are so many and name a wavelength or a reflectance; else none."""
    if len(line) > LONGEST * count:
        return []
    for delimiter in DELIMITERS:
        cells = [cell.strip('"') for cell in (_words(line) if delimiter in ("  ", " ") else split(line, delimiter))]
        keys = {column(cell).key for cell in cells} if len(cells) == count else {*()}
        if WAVELENGTH in keys or (REFLECTANCE in keys and not delimiter.isspace()):
            return cells
    return []


def _words(line: str) -> list[str]:
    """Words with the brackets behind them: "wavelength (nm)" is one."""
    found: list[str] = []
    for word in line.split():
        if found and word[0] in "([{":
            found[-1] += f" {word}"
        else:
            found.append(word)
    return found
