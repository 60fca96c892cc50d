"""Columns of a spectrum of reflectance: what their names mean, and what is asked where they do not say enough."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FormatError, ParameterError
from ...files.cells import DELIMITERS, split
from .names import BRACKET, IGNORE, LONGEST, UNCERTAIN, UNCERTAINTY, WAVELENGTH, meaning, unit_in, unit_of

REFLECTANCE, OTHER = "reflectance", "other"

WORDS = {"wavelength": WAVELENGTH, "reflectance": REFLECTANCE, "u": UNCERTAINTY, "ignore": IGNORE}
"""What a column may be said to be."""

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


class Stated(NamedTuple):
    """What is said of uncertainties: the unit of reflectances, the coverage factor, "relative" or "absolute"."""

    share: str
    coverage: float | None
    spread: str | None


class SpectrumColumns:
    """The columns of a file, and the questions about them."""

    def __init__(self, path: Path, line: int, names: list[str], count: int):
        self.path, self.names, self.count, self.taken = path, names, count, False
        self.where = f"{path}, line {line}" if line else str(path)

    def told(self, columns: Sequence[str]) -> list[SpectrumColumn]:
        """As the caller says, with the units of the names."""
        found = [
            (column(name) if name else SpectrumColumn(""))._replace(key=WORDS[word], what="")
            for word, name in zip(columns, self.names or [""] * len(columns), strict=False)
        ]
        keys = [c.key for c in found]
        once = keys.count(WAVELENGTH) == keys.count(REFLECTANCE) == 1 and keys.count(UNCERTAINTY) <= 1
        if len(columns) != self.count or not once:
            rule = f"expected a word for each of the {self.count} columns, wavelength and reflectance once"
            raise ParameterError(f"columns={','.join(columns)}: {rule}, as in wavelength,reflectance,ignore")
        return found

    def by_name(self, quantity: str | None) -> list[SpectrumColumn]:
        """As the names say; `quantity`: values are a reflectance."""
        found = [column(name) for name in self.names]
        if quantity is not None and REFLECTANCE not in [c.key for c in found]:
            found = [c._replace(key=REFLECTANCE) if c.key in (OTHER, "", IGNORE) else c for c in found]
        keys = [c.key for c in found]
        if keys.count(WAVELENGTH) != 1:
            raise self.fault(f"{self.listed}: {keys.count(WAVELENGTH)} of them are wavelengths, expected one")
        values = [name for name, key in zip(self.names, keys, strict=True) if key == REFLECTANCE]
        for name, c in zip(self.names, found, strict=True):
            if c.key == OTHER and not values:
                raise self.no_reflectance(f"column {name!r:.60}", c.what)
            if c.key in (OTHER, ""):
                what = f"is {c.what}" if c.what else "is not known"
                says = "say what it is, or leave it out"
                raise self.fault(
                    f"column {name!r:.60} {what}; {says}", f"quantity='{REFLECTANCE}'" if not values else ""
                )
        if len(values) != 1:
            several = (
                f"{' and '.join(map(repr, values))} are reflectances: which is meant" if values else "no reflectance"
            )
            raise self.fault(f"{several if values else self.listed + ': ' + several}")
        if keys.count(UNCERTAINTY) > 1:
            raise self.fault(f"{self.listed}: two uncertainties, expected one")
        return found

    def unnamed(self, above: Sequence[tuple[int, str, bool]], quantity: str | None) -> list[SpectrumColumn]:
        """Of a file in which nothing names the columns: wavelength and reflectance, unless its words say otherwise.

        above   lines above the numbers with their number, and whether they are comments
        """
        reflects = quantity is not None or any(is_reflectance(words_of(line)) for _, line, _ in above)
        for number, line, is_comment in above:
            if (of := other(line)) and not reflects:
                raise self.no_reflectance(f"line {number}, {line!r:.60},", of)
            if not is_comment and words_of(line) and not reflects:
                raise self.fault(f"line {number}, {line!r:.60}, does not say what the columns are")
        if self.count == 3:
            raise self.fault("three columns and no names: the third may be an uncertainty, or another reflectance")
        self.taken = not reflects
        return [SpectrumColumn(WAVELENGTH), SpectrumColumn(REFLECTANCE)]

    @property
    def listed(self) -> str:
        return f"columns {', '.join([f'{name!r:.40}' for name in self.names])}"

    def fault(self, text: str, more: str = "") -> FormatError:
        """The error with the option that decides."""
        third = ",u" if self.count == 3 else ""
        ways = [f"columns=wavelength,reflectance{third}", *(["columns=wavelength,reflectance,ignore"] if third else [])]
        return FormatError(f"{self.where}: {text}; say {' or '.join([*ways, *([more] if more else [])])}")

    def no_reflectance(self, name: str, what: str) -> FormatError:
        return FormatError(
            f"{self.where}: {name} is {what}, no reflectance of a surface; gn.Spectrum(wavelengths, values) holds it, "
            f"as lights, refractive indices and weights take it; if it is a reflectance all the same say "
            f"quantity='{REFLECTANCE}', or columns=wavelength,reflectance{',ignore' if self.count == 3 else ''}"
        )

    def standard(self, u: np.ndarray, rho: np.ndarray, c: SpectrumColumn, said: Stated) -> tuple[np.ndarray, str]:
        """Standard uncertainties of reflectances, and words for how they are stated."""
        share, coverage, spread = said
        if c.coverage and c.coverage != 1.0 and coverage not in (None, c.coverage):
            raise ParameterError(f"coverage={coverage:g}: {self.where} says k = {c.coverage:g}; leave the option out")
        if c.coverage == 0.0 and coverage is None:
            raise FormatError(f"{self.where}: an expanded uncertainty, and by which factor k? say coverage=2 for k = 2")
        k = c.coverage if c.coverage not in (None, 0.0, 1.0) else coverage or 1.0
        relative = {"relative": True, "absolute": False}.get(spread or "", c.relative)
        if relative is None and c.unit == share == "%":
            raise FormatError(
                f"{self.where}: an uncertainty in percent, of the value or as the values? say "
                f"uncertainty='relative' or uncertainty='absolute'"
            )
        relative = c.unit == "%" if relative is None else relative
        words = f"uncertainty{', relative' if relative else ''}{f', divided by k = {k:g}' if k != 1.0 else ''}"
        scale = (0.01 if "%" in (c.unit, "" if relative else share) else 1.0) / k
        return u * scale * (np.abs(rho) if relative else 1.0), words
