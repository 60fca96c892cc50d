"""Tables of bidirectional reflectance factors, one row per pair and one column per wavelength (field spectrometers).

Lines of free text, then a line of column names, src_z src_a view_z view_a and wavelengths like 385.65nm, then rows of
numbers, separated by tabs or blanks: zenith and azimuth of source and viewer [degrees], reflectance factors pi f.
Source and viewer have azimuths of their own: 180 apart is forward scattering, as NIST's PTFE shows. Checked against a
real file (University of Arizona, Remote Sensing Group, Spectralon); no specification was seen.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..tables.gridded import Gridded
from . import _layout
from ._reading import channel_words, plain_text
from ._rows.direction_pairs import LEVEL, Pairs, material, upright
from ._rows.pairs_of_material import COARSE, CoarseResolution, pairs_of

NAME = "BRF table"
SUFFIXES = (".txt",)
SHARED_SUFFIX = True
DESCRIPTION = "reflectance factors by source and viewer, a column per wavelength"
ORACLE = "real file (UA Remote Sensing Group); NIST's PTFE for the azimuths"

LAYOUT = _layout.columns("src_z", "src_a", "view_z", "view_a")
NAMES = [*LAYOUT.axes]
_WAVELENGTH = re.compile(r"([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*(nm|um|µm|μm)?", re.IGNORECASE)


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: a line of column names that begins with the four angles'."""
    return bool(re.search(rb"(?im)(^|\r)[ \t]*src_z[\s,]+src_a[\s,]+view_z[\s,]+view_a[\s,]+[\d.]", head))


def read(path: Path) -> Gridded:
    """The table in a file. Raises FormatError, with the line, for anything else."""
    lines, text = plain_text.read(path), []
    expected = f"a line of column names, {' '.join(NAMES)} ..."
    line = lines.take(expected)
    while [word.lower() for word in plain_text.split(line)[:4]] != NAMES:
        text.append(line)
        line = lines.take(expected)
    words = plain_text.split(line)
    nm = [_wavelength(lines, word) for word in words[4:]]
    if not nm or not all(a < b for a, b in pairwise(nm)):
        raise lines.fault(" ".join(words[4:]), "rising wavelengths like 385.65nm after the four angles")
    rows = lines.rows(4 + len(nm), expected="numbers: four angles and a reflectance factor per wavelength")
    angles = upright(LAYOUT.pairs(rows[:, :4]), str(path), LEVEL)
    pairs = Pairs(angles, rows[:, 4:], "reflectance factor", channels=tuple(nm))
    return material(pairs, str(path), {"text": text})


def _wavelength(lines: plain_text.Lines, word: str) -> float:
    match = _WAVELENGTH.fullmatch(word)
    if not match:
        raise lines.fault(word, "a wavelength like 385.65nm")
    value = float(match[1])
    return value if (match[2] or "nm").lower() == "nm" else value * 1e3


def write(
    m: Reflectance, path: Path, wavelengths: channel_words.Wavelengths = None, resolution: CoarseResolution = None
) -> None:
    """Write reflectance factors at the pairs of a measurement, for others at those of a grid.

    Uncertainties are lost. Raises ParameterError without wavelengths, and for delta lobes and maps.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.dat", format="BRF table", wavelengths=[550.0])
    >>> print(gn.load("white.dat").channel_names)
    (550.0,)
    """
    pairs = pairs_of(m, resolution, ("reflectance factor",), nodes=COARSE, as_held=True)
    values = pairs.columns()
    nm = channel_words.wavelengths_of(m, wavelengths, values.shape[1])
    if not all(a < b for a, b in pairwise(nm)):
        raise ParameterError(f"wavelengths {nm}: expected rising ones [nm]")
    text = getattr(m, "about", {}).get("text")
    text = text if isinstance(text, list) and text else [f"BRF values of {m!r:.200}"]
    names = "\t".join([*NAMES, *map(channel_words.name_of, nm)])
    rows = np.concatenate([LAYOUT.columns(pairs.angles), values], axis=1)
    plain_text.write(path, (f"{line}\n" for line in (*text, names)), rows, "\t")
