"""Names of columns, as laboratories write them: `meaning("U(k=2) [1/sr]")`.

A unit in a name decides the unit. A name that has two readings keeps both: who reads the file must be told.
"""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from typing import NamedTuple

import numpy as np

OWN = "f_cos_i|f_cos|f|brdf|dsf|brf"
QUANTITIES = {
    "f": "brdf",
    "brdf": "brdf",
    "f_cos": "brdf * cos(theta_o)",
    "dsf": "brdf * cos(theta_o)",
    "f_cos_i": "brdf * cos(theta_i)",
    "brf": "reflectance factor",
}
"""Words of columns of values -> the quantity."""

LONGEST = 120
"""Characters of a name that may have a meaning, if it is none of gonio's own."""

VALUE, UNCERTAINTY, IGNORE, WAVELENGTH = "f", "u_f", "ignore", "wavelength"


class Meaning(NamedTuple):
    """What a name says of its column.

    key        an angle of `ANGLES`, VALUE, UNCERTAINTY, WAVELENGTH or IGNORE; "" for an unknown name
    readings   of an ambiguous name: option value or angle -> what it would mean
    quantity   of values, "" where the name does not say
    channel    of values: "R", "550nm", ""
    unit       "deg", "rad", "mrad", "nm", "um", "1/sr", "%", "1", or ""
    coverage   k of an uncertainty; 0 where it is expanded by a k that the name does not say, None where the name does
               not say whether it is
    relative   whether an uncertainty is a share of the value; None where the name does not say
    """

    key: str = ""
    readings: tuple[tuple[str, str], ...] = ()
    quantity: str = ""
    channel: str = ""
    unit: str = ""
    coverage: float | None = None
    relative: bool | None = None


_UNITS = {
    "deg": ("deg", "degree", "degrees", "°", "grad°"),
    "rad": ("rad", "radian", "radians"),
    "mrad": ("mrad",),
    "nm": ("nm", "nanometer", "nanometre", "nanometers", "nanometres"),
    "um": ("um", "μm", "micron", "microns", "micrometer", "micrometre", "micrometers", "micrometres"),
    "1/cm": ("1/cm", "cm-1", "cm^-1", "cm**-1", "/cm"),
    "eV": ("ev",),
    "1/sr": ("1/sr", "sr-1", "sr^-1", "sr**-1", "/sr", "persr", "srinv", "sr"),
    "%": ("%", "percent", "pct"),
    "1": ("1", "-", "--", "unitless", "dimensionless", "none", "a.u.", "au"),
}
UNITS = {word: unit for unit, words in _UNITS.items() for word in words}
"""Words for units -> the unit."""

_TRAILING = frozenset(word for word in UNITS if word.isalpha() and word not in ("sr", "none", "au")) | {"%", "°"}

WAVELENGTH_UNITS = ("nm", "um", "1/cm", "eV")
"""Units of wavelengths, or of what stands for them."""

_EV_NM = 1239.8419843320026
"""h c/e [eV nm], exact in the SI."""


def nanometres(numbers: np.ndarray, unit: str) -> np.ndarray:
    """Wavelengths [nm] of numbers in one of `WAVELENGTH_UNITS`."""
    if unit in ("1/cm", "eV"):
        with np.errstate(divide="ignore"):
            return (1e7 if unit == "1/cm" else _EV_NM) / numbers
    return np.round(numbers * 1000.0, 6) if unit == "um" else numbers


def _aliases(table: dict[str, str]) -> dict[str, str]:
    return {word: key for key, words in table.items() for word in words.split()}


_IN = "i in inc incident incidence incoming illumination light source sun solar"
_OUT = "o out outgoing r ref refl reflected reflection v view viewing viewer observer observation det sensor emission e"


def _of_side(side: str, kinds: str) -> str:
    """Joined names such as "thetain", "intheta", "thetaangleofin"."""
    pairs = [(word, kind) for word in side.split() for kind in kinds.split()]
    long = [f"{word}{kind}{end}" for word, kind in pairs for end in ("", "angle") if len(word) > 1]
    return " ".join([f"{kind}{word}" for word, kind in pairs] + long)


ANGLE_NAMES = _aliases(
    {
        "theta_i": "aoi sza incidence incidenceangle incidentangle angleofincidence incident illuminationangle thi ti "
        + _of_side(_IN, "theta polar zenith"),
        "theta_o": "vza viewangle viewingangle observationangle observerangle angleofreflection angleofobservation "
        "angleofview exitangle emissionangle emergenceangle tho " + _of_side(_OUT, "theta polar zenith"),
        "phi_i": "saa " + _of_side(_IN, "phi azimuth azi"),
        "phi_o": "vaa " + _of_side(_OUT, "phi azimuth azi"),
        "phi": "phi dphi deltaphi phirel relphi relativephi relativeazimuth relativeazimuthangle raa relaz relazimuth "
        "azimuthdifference deltaazimuth azimuthangle azi az",
        "theta_h": "thetah",
        "theta_d": "thetad",
        "phi_d": "phid",
        "phi_h": "phih",
        "radial": "radial",
        "azimuth": "azimuth",
        "wavelength": "wavelength wavelengths lambda wl wvl wavenumber wavenumbers photonenergy energy",
    }
)  # fmt: skip

_SIDES = (("theta_i", "direction of the light"), ("theta_o", "direction of the viewer"))
_SCATTERED = (("theta_i", "direction of the sun or the source"), ("theta_o", "direction of the scattered light"))
_TURNS = (("phi_i", "azimuth of the sun or the source"), ("phi_o", "azimuth of the scattered light"))
_FROM = (("theta_o", "angle from the normal"), ("radial", "angle from the mirror direction"))
AMBIGUOUS_ANGLES = {
    **dict.fromkeys(("thetas", "thetascatter", "thetascat", "thetascattered"), _SCATTERED),
    **dict.fromkeys(("phis", "phiscatter", "phiscat", "phiscattered"), _TURNS),
    **dict.fromkeys(("theta", "polar", "polarangle", "zenith", "zenithangle", "elevation"), _SIDES),
    **dict.fromkeys(
        (
            *("angle", "detectorangle", "detector", "scatterangle", "scatteringangle", "scatteredangle"),
            *("goniometerangle", "receiverangle", "receive", "receiver", "thetadetector", "arm", "armangle"),
        ),
        _FROM,
    ),
}

_QUANTITY_NAMES = _aliases(
    {
        "brdf": "f fr brdf bsdf brdfvalue brdfvalues meanbrdf brdfmean absolutebrdf brdfabs brdfavg",
        "brdf * cos(theta_o)": "dsf fcos fcosthetao fcosthetar fcosthetas brdfcos brdfcosthetao brdfcosthetar "
        "brdfcosthetas ccbsdf ccbrdf cosinecorrectedbsdf cosinecorrectedbrdf scatterdensity",
        "brdf * cos(theta_i)": "fcosi fcosthetai brdfcosi brdfcosthetai",
        "reflectance factor": "brf rf reflectancefactor bidirectionalreflectancefactor brfvalue brfmean brfvalues",
    }
)  # fmt: skip
_QUANTITY_READINGS = {
    "r": (("reflectance factor", "pi f"), ("brdf", "f in a red channel")),
    **dict.fromkeys(
        ("reflectance", "rho", "refl", "bidirectionalreflectance"),
        (("reflectance factor", "pi f"), ("brdf", "f")),
    ),
    **dict.fromkeys(
        ("radiancefactor", "beta", "radf", "i/f"),
        (("reflectance factor", "pi f, as CIE defines it"), ("brdf * cos(theta_i)", "pi f cos(theta_i), I/F, over pi")),
    ),
    **dict.fromkeys(("value", "values", "data", "result", "mean", "scatter", "y"), (("brdf", "f"), ("dsf", "f cos"))),
}
_HARMLESS = frozenset(
    (
        "no", "nr", "number", "num", "index", "idx", "id", "point", "pointno", "pointnumber", "row", "line",
        "time", "date", "datetime", "timestamp", "temperature", "temp", "humidity", "comment", "comments",
        "remark", "remarks", "note", "notes", "status", "operator", "sample", "samplename", "sampleid", "scan",
        "scanno", "run", "signal", "counts", "intensity", "voltage", "current", "photocurrent", "power", "dark",
        "darksignal", "darkcounts", "reference", "referencesignal", "gain", "integrationtime", "exposure",
        "elapsed", "elapsedtime", "file", "filename",
    )
)  # fmt: skip
_UNCERTAIN = {
    "standard": frozenset(["u", "std", "stdev", "stddev", "sd", "sigma", "deviation"]),
    "any": frozenset(["u95", "unc", "uncert", "uncertainty", "error", "err", "±", "+-", "+/-"]),
}
UNCERTAIN = frozenset().union(*_UNCERTAIN.values())
"""Words that mean an uncertainty, in small letters."""

_FILLING = frozenset(["of", "at", "for", "the", "value", "values", "k", "combined", "abs", "absolute", "measured"])
_CHANNELS = {"r": "R", "g": "G", "b": "B", "x": "X", "y": "Y", "z": "Z", "red": "R", "green": "G", "blue": "B"}

BRACKET = re.compile(r"[\[({]([^\[\](){}]*)[\])}]")
_NUMBER = re.compile(r"[-+]?[0-9.,]+(?:[eE][-+]?[0-9]+)?")
_OWN = re.compile(rf"(u_)?({OWN})(?:_([^\s\[\](){{}}/]+))?", re.IGNORECASE)
_COVERAGE = re.compile(r"(?<![a-z])k\s*=?\s*([0-9]+(?:[.,][0-9]+)?)(?![0-9a-z])", re.IGNORECASE)
_WAVELENGTH = re.compile(r"(?<![\w.,])([0-9]+(?:[.,][0-9]+)?)[\s_]*(nm|um|μm)(?![a-z])", re.IGNORECASE)
_BEHIND = re.compile(r"(?:(?<!\s)(?:\s*/\s*|\s*,\s*|\s+in\s+)|(?<![\s_])[\s_]+)([^\s/_,]+|1/sr)$", re.IGNORECASE)
_GREEK = str.maketrans(
    {
        "θ": " theta", "ϑ": " theta", "φ": " phi", "ϕ": " phi", "λ": " lambda", "ρ": " rho", "σ": " sigma",
        "β": " beta", "Δ": " delta", "−": "-", "–": "-",
    }
)  # fmt: skip


def unit_of(text: str) -> str | None:
    """The unit of a text such as "sr⁻¹" or "Degrees"; None for another text."""
    if len(text) > LONGEST:
        return None
    word = unicodedata.normalize("NFKC", text.replace("º", "°")).replace("−", "-").replace("(-1)", "-1")
    return UNITS.get("".join(word.split()).rstrip(".").lower())


def unit_in(name: str) -> str:
    """The unit in brackets in a name of any words, or ""."""
    return next((unit for word in BRACKET.findall(name) if (unit := unit_of(word))), "")


@lru_cache(maxsize=4096)
def meaning(name: str) -> Meaning:
    """The meaning of the name of a column."""
    if _NUMBER.fullmatch(name):
        return Meaning()
    if match := _OWN.fullmatch(name.strip()):
        found = _own(match)
        if found is not None:
            return found
    if len(name) > LONGEST:
        return Meaning()
    text = unicodedata.normalize("NFKC", name.replace("º", "°")).translate(_GREEK).replace("^(-1)", "^-1").strip()
    text, unit = _without_unit(text)
    coverage = None
    if match := _COVERAGE.search(text):
        coverage, text = float(match[1].replace(",", ".")), text[: match.start()] + " " + text[match.end() :]
    channel = ""
    if match := _WAVELENGTH.search(text.replace("_", " ")):
        channel = f"{_plain(match[1], 1000.0 if match[2].lower() != 'nm' else 1.0)}nm"
        text = text[: match.start()] + " " + text[match.end() :]
    tokens = [word for word in re.split(r"[^\w%±/+]+|_+", text) if word and word != "/"]
    found = _of_tokens(tokens, unit, coverage, channel)
    if not found.key and "".join(re.findall(r"[a-z]+", BRACKET.sub("", text).lower())) in _HARMLESS:
        return Meaning(IGNORE)
    return found


def _of_tokens(tokens: list[str], unit: str, coverage: float | None, channel: str) -> Meaning:
    lower = [token.lower() for token in tokens]
    joined = "".join(lower)
    if not channel and joined in ANGLE_NAMES:
        unit = unit or ("1/cm" if joined.startswith("wavenumber") else "")
        if joined.endswith("energy") and unit != "eV":
            return Meaning()
        return Meaning(ANGLE_NAMES[joined], unit=unit)
    if not channel and joined in AMBIGUOUS_ANGLES and unit not in ("1/sr", "%"):
        return Meaning("angle", AMBIGUOUS_ANGLES[joined], unit=unit)
    spread = _of_uncertainty(tokens, unit, coverage, channel)
    if spread is not None:
        return spread
    words = [word for word in lower if word not in _FILLING or len(lower) == 1]
    found = _of_value(words, channel) if words or channel else None
    if found is not None:
        return found._replace(unit=unit)
    return Meaning()


def _of_uncertainty(tokens: list[str], unit: str, coverage: float | None, channel: str) -> Meaning | None:
    lower = [token.lower() for token in tokens]
    marks = [k for k, word in enumerate(lower) if any(word in words for words in _UNCERTAIN.values())]
    if not marks:
        return None
    first = marks[0]
    rest = [w for k, w in enumerate(lower) if k not in marks]
    relative = True if {"rel", "relative", "ur"} & {*rest} else None
    expanded = "expanded" in rest or tokens[first] in ("U", "U95", "u95")
    standard = not expanded and ("standard" in rest or lower[first] in _UNCERTAIN["standard"])
    dropped = {"expanded", "standard", "rel", "relative", "dev", *_FILLING}
    of = _of_value([w for w in rest if w not in dropped], channel)
    if of is None or of.key != VALUE:
        return None
    known = coverage if coverage is not None else 0.0 if expanded else 1.0 if standard else None
    return Meaning(UNCERTAINTY, of.readings, of.quantity, of.channel, unit, known, relative)


def _of_value(words: list[str], channel: str) -> Meaning | None:
    """A column of values of these words; `channel` is a wavelength that was among them."""
    joined = "".join(words)
    if not words:
        return Meaning(VALUE, channel=channel)
    if joined in _QUANTITY_NAMES:
        return Meaning(VALUE, quantity=_QUANTITY_NAMES[joined], channel=channel)
    if joined in _QUANTITY_READINGS:
        return Meaning(VALUE, _QUANTITY_READINGS[joined], channel=channel)
    if channel:
        return None
    if joined in _CHANNELS:
        return Meaning(VALUE, channel=_CHANNELS[joined])
    if words[-1] in _CHANNELS and (of := _of_value(words[:-1], _CHANNELS[words[-1]])):
        return of
    return None


def _own(match: re.Match[str]) -> Meaning | None:
    """A name of gonio's own; None for one whose ending is an uncertainty, a unit or a part of the word."""
    prefix, word, channel = match.groups()
    end = (channel or "").lower()
    parts = {*re.split(r"_+", end)}
    if end in UNITS or parts & (_FILLING | {"cos", "rel", "mean", "avg", "u95"}) or _COVERAGE.search(end):
        return None
    if any(parts & words for words in _UNCERTAIN.values()):
        return None
    if match[0] in ("f_r", "U_f", "f_cos_r", "f_cos_o") or (match[0][:1] == "U" and prefix):
        return None
    key = UNCERTAINTY if prefix else VALUE
    return Meaning(key, (), QUANTITIES[word.lower()], channel or "", "", 1.0 if prefix else None)


def _without_unit(text: str) -> tuple[str, str]:
    """A name without its unit, and the unit."""
    unit = ""
    for inside in reversed([*BRACKET.finditer(text)]):
        of = unit_of(inside[1]) if inside[1].strip() else None
        if of is not None and not unit:
            unit, text = of, text[: inside.start()] + " " + text[inside.end() :]
    text = text.strip()
    if not unit and (match := _BEHIND.search(text)):
        word = match[1].lower()
        sure = "/" in match[0] or " in " in match[0]
        if word in UNITS and (sure or word in _TRAILING) and not _WAVELENGTH.search(text):
            unit, text = UNITS[word], text[: match.start()]
    if not unit and text.endswith(("°", "%")) and len(text) > 1:
        unit, text = UNITS[text[-1]], text[:-1]
    return text, unit


def _plain(number: str, factor: float) -> str:
    value = round(float(number.replace(",", ".")) * factor, 9)
    return f"{value:g}" if value < 1e6 else str(value)
