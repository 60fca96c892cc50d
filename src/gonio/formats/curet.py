"""CUReT's `.dat` tables: 61 samples at 205 pairs of directions, and the published fits to them.

Text, a row per sample: its number, then 205 values of f (`abrdf.dat`, the mean of red, green and blue; `rbrdf.dat`,
`gbrdf.dat`, `bbrdf.dat`); rho, sigma, kd of the Oren-Nayar model (`op.dat`, `opr.dat` ...); or 5 or 55 coefficients of
Koenderink's modes up to order 2 or 8 (`kp2.dat`, `kp8.dat` ...). The directions of the 205 measurements are those
published with the tables, in `data/curet_directions.txt`: the angles between light and viewer are multiples of 22.5
degrees, to 1e-4 degrees. Checked against that; no table and no fit was at hand, only descriptions.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated

import numpy as np

from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import FormatError, NotFoundError, ParameterError, held_by
from ..models.oren_nayar import OrenNayar
from ..tables.scattered import Scattered
from ._reading import plain_text
from .zernike import Zernike

NAME = "CUReT"
SUFFIXES = (".dat",)
SHARED_SUFFIX = True
DESCRIPTION = "BRDFs of 61 samples at 205 pairs of directions, and Oren-Nayar fits (Dana et al. 1999)"
ORACLE = "directions: their angles between light and viewer; tables: own generator only"

PAIRS = 205
FITS = {3: "Oren-Nayar", 5: "Koenderink, order 2", 55: "Koenderink, order 8"}
_NUMBER = re.compile(r"[-+]?[0-9.]+(e[-+]?[0-9]+)?", re.IGNORECASE)


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: rows of numbers of the right length, numbered from 1 on."""
    rows = [words for line in plain_text.start(head).split("\n") if (words := line.split())]
    whole = rows if len(head) >= size else rows[:-1]
    if not rows or not all(_NUMBER.fullmatch(word) for row in rows for word in row[:-1]):
        return False
    count = len(rows[0]) - 1
    numbered = all(len(row) == count + 1 and row[0] == str(i) for i, row in enumerate(whole, start=1))
    return count in (*FITS, PAIRS) and numbered


def read(
    path: Path,
    sample: Annotated[
        int | None, Declared("number of the sample, in the first column; needed where there are several", 1)
    ] = None,
    rgb: Annotated[
        bool, Declared("read the files of the other two colours too: rbrdf.dat, gbrdf.dat and bbrdf.dat together")
    ] = False,
    kd: Annotated[bool, Declared("multiply an Oren-Nayar fit by its kd, a use that no description confirms")] = True,
    modes: Annotated[
        Sequence[tuple[int, int, int]] | None,
        Declared("n, m, l of the columns of a Koenderink fit, whose order and normalization were not found", -8, 8),
    ] = None,
) -> Reflectance:
    """One sample: a table as `Scattered`, taken for isotropic, an Oren-Nayar fit as gn.OrenNayar, a Koenderink fit as
    `Zernike`.

    Raises FormatError, with the line, for a row unlike the first, NotFoundError for a sample that is not in the file.
    """
    path = Path(path)
    rows = np.stack([_row(p, sample) for p in (_of_colours(path) if rgb else [path])], axis=-1)
    about = {"sample": int(rows[0, 0])}
    values = rows[1:] if rgb else rows[1:, 0]
    if len(values) == PAIRS:
        theta_o, phi_o, theta_i, phi_i = directions().T
        names = ("R", "G", "B") if rgb else None
        return Scattered(
            theta_i, phi_i, theta_o, phi_o, values, channels=names, isotropic=True, path=str(path), about=about
        )
    if len(values) != 3:
        return _koenderink(values, modes, rgb, str(path))
    rho, sigma, factor = values
    with held_by(f"{path}, sample {about['sample']}"):
        fit = OrenNayar(rho, sigma)
        return factor * fit if kd else fit


def _row(path: Path, sample: int | None) -> np.ndarray:
    """The row of a sample: its number, then its values."""
    lines = plain_text.read(path)
    first = lines.peek()
    if first is None:
        raise FormatError(f"{path}: empty, expected rows of a sample's number and its values")
    count = len(plain_text.split(first)) - 1
    if count not in (*FITS, PAIRS):
        raise FormatError(f"{path}, line 1: {count} values, expected {PAIRS}, or {', '.join(map(str, FITS))} of fits")
    rows = lines.rows(count + 1, expected=f"numbers: that of a sample and {count} values")
    samples = rows[:, 0].tolist()
    if len(set(samples)) < len(samples):
        raise FormatError(f"{path}: numbers of samples occur twice, expected each once: {samples[:8]} ...")
    if sample is None and len(rows) == 1:
        return rows[0]
    if sample not in samples:
        raise NotFoundError(f"{path}: sample={sample}: expected one of {', '.join(f'{x:g}' for x in samples[:64])}")
    return rows[samples.index(sample)]


def _of_colours(path: Path) -> list[Path]:
    """The files of red, green and blue, of which this is one."""
    match = re.fullmatch(r"(?i)([rgb])(brdf)|(op|kp2|kp8)([rgb])", path.stem)
    if not match:
        raise ParameterError(f"{path}: rgb=True: expected a file named as rbrdf.dat, opr.dat, kp2r.dat or kp8r.dat")
    before, after = ("", match[2]) if match[1] else (match[3], "")
    return [path.with_name(before + colour + after + path.suffix) for colour in "rgb"]


def _koenderink(values: np.ndarray, modes: Sequence[tuple[int, int, int]] | None, rgb: bool, path: str) -> Reflectance:
    """The expansion in modes (n, m, l), in the order of the columns."""
    if modes is None or len(modes) != len(values) or rgb:
        raise FormatError(
            f"{path}: coefficients of {len(values)} Koenderink modes, whose order was not found: give modes=, "
            f"(n, m, l) of each column, for one colour; or read the table of BRDFs"
        )
    rows = [(1, 1, n, m, turn, turn, 0, value) for (n, m, turn), value in zip(modes, values, strict=True)]
    return Zernike(rows, path=path)


@cache
def directions() -> np.ndarray:
    """theta_o, phi_o, theta_i, phi_i (205, 4) [rad] of the measurements."""
    text = (resources.files("gonio") / "data" / "curet_directions.txt").read_text(encoding="utf-8")
    return np.array([line.split()[1:] for line in text.splitlines() if not line.startswith("#")], dtype=float)
