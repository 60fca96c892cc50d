"""Luminous intensities of luminaires by angle, as files hold them: IES LM-63 and EULUMDAT."""

from __future__ import annotations

import math
import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import frozen
from ..errors import FormatError, NotFoundError, ParameterError
from ..formula.text import shown

MOST = 1 << 24
"""Bytes of a file, at most."""

ANGLES = 10_000
"""Angles of either kind, at most."""

SHAPES = {1: "C", 2: "B", 3: "A"}
"""Numbers of LM-63 -> type of photometry."""

_TILT = re.compile(r"^[ \t]*TILT[ \t]*=(.*)$", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True, eq=False)
class Photometry:
    """Intensities of a luminaire.

    kind          "C": the first angle from its nadir, 0 to 180 degrees, the second around it; "A", "B": vertical and
                  horizontal angles from where it aims, -90 to 90 degrees, turned about a vertical ("A") or a
                  horizontal ("B") axis
    first, second angles [degrees], increasing; of "C" the second ones from 0 to 360, or one for all
    candela       (second, first), cd
    tilt          angles [degrees] from upright, and factors at these
    flux          of all lamps [lm], below 0 where the file says that intensities are absolute
    path          the file
    """

    kind: str
    first: np.ndarray
    second: np.ndarray
    candela: np.ndarray
    tilt: tuple[np.ndarray, np.ndarray]
    flux: float
    path: str | None = None

    def __post_init__(self) -> None:
        for array in (self.first, self.second, self.candela, *self.tilt):
            frozen(array)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Photometry):
            return NotImplemented
        mine, theirs = ((x.first, x.second, x.candela, *x.tilt) for x in (self, other))
        return self.kind == other.kind and all(map(np.array_equal, mine, theirs))

    def __hash__(self) -> int:
        return hash((self.kind, self.candela.shape))

    def __repr__(self) -> str:
        origin = "" if self.path is None else f", {self.path!r}"
        return f"<{len(self.second)} x {len(self.first)} intensities, type {self.kind}{origin}>"

    @classmethod
    def of(cls, value: Any) -> Photometry:
        """Intensities of a file's path, or as they are."""
        if isinstance(value, Photometry):
            return value
        if not isinstance(value, (str, os.PathLike)):
            raise ParameterError(f"file={shown(value)}: expected the path of an .ies or .ldt file")
        return read(os.fspath(value))


def read(path: str) -> Photometry:
    """The intensities of an IES or EULUMDAT file, recognized by what it begins with.

    Raises NotFoundError for a missing file, FormatError for one that contradicts itself.
    """
    text = _text(path)
    if text.lstrip()[:3].upper() == "IES" or _TILT.search(text):
        return ies(text, path)
    return ldt(text, path)


def _text(path: str) -> str:
    try:
        regular = stat.S_ISREG(os.stat(path).st_mode)
        if regular:
            with open(path, "rb") as file:
                data = file.read(MOST + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise NotFoundError(f"{path}: {reason}; check the name and its permissions") from None
    if not regular:
        raise FormatError(f"{path}: is a folder, a device or the like; expected an .ies or .ldt file")
    if len(data) > MOST:
        raise FormatError(f"{path}: more than {MOST} bytes, expected a table of intensities")
    return data.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")


class _Numbers:
    """The numbers of a text, taken one after another."""

    def __init__(self, words: list[str], path: str):
        self.words, self.at, self.path = words, 0, path

    def take(self, count: int, what: str) -> np.ndarray:
        """The next numbers."""
        words = self.words[self.at : self.at + count]
        if len(words) < count:
            raise FormatError(f"{self.path}: {len(words)} numbers are left for {what}, expected {count}; it is cut off")
        try:
            numbers = np.array([float(word.replace(",", ".")) for word in words])
        except ValueError as error:
            raise FormatError(f"{self.path}: {what}: {str(error)[:80]}; expected {count} numbers") from None
        if not np.isfinite(numbers).all():
            raise FormatError(f"{self.path}: {what}: NaN or infinite; expected {count} numbers")
        self.at += count
        return numbers

    def whole(self, what: str, low: int, high: int) -> int:
        """The next number, which must be a whole one."""
        number = float(self.take(1, what)[0])
        if number != math.floor(number) or not low <= number <= high:
            raise FormatError(f"{self.path}: {what} is {number:g}, expected a whole number from {low} to {high}")
        return int(number)

    def finish(self, what: str) -> None:
        """Raises FormatError where numbers are left."""
        if self.at < len(self.words):
            extra = len(self.words) - self.at
            raise FormatError(f"{self.path}: {extra} more numbers than {what} says; expected {self.at}")


def ies(text: str, path: str) -> Photometry:
    """LM-63 of 1986 to 2019, with its TILT.

    Source: IES LM-63-02, "Standard file format for the electronic transfer of photometric data".
    """
    found = _TILT.search(text)
    if found is None:
        raise FormatError(f"{path}: no line TILT=..., expected one in an IES file")
    numbers = _Numbers(re.split(r"[\s,]+", text[found.end() :].strip()), path)
    tilt = _tilt(found[1].strip(), numbers, path)
    lamps, lumens, factor = numbers.take(3, "number of lamps, lumens and factor").tolist()
    n_first, n_second = (numbers.whole(f"number of {k} angles", 1, ANGLES) for k in ("vertical", "horizontal"))
    kind = SHAPES[numbers.whole("photometric type", 1, 3)]
    numbers.whole("units", 1, 2)
    numbers.take(3, "dimensions")
    ballast, _, _ = numbers.take(3, "ballast factor, reserve and watts").tolist()
    first, second = numbers.take(n_first, "vertical angles"), numbers.take(n_second, "horizontal angles")
    candela = numbers.take(n_first * n_second, "intensities").reshape(n_second, n_first) * (factor * ballast)
    numbers.finish("the count of angles")
    flux = lamps * lumens if lumens >= 0.0 else -1.0
    return _checked(kind, first, *_around(kind, second, candela, path), tilt, flux, path)


def _tilt(word: str, numbers: _Numbers, path: str) -> tuple[np.ndarray, np.ndarray]:
    """Angles and factors of the TILT line, of what follows it, or of the file that it names."""
    if word.upper() == "NONE":
        return np.zeros(1), np.ones(1)
    if word.upper() != "INCLUDE":
        beside = Path(path).parent / word
        if "/" in word or "\\" in word or not os.path.isfile(beside):
            raise NotFoundError(f"{path}: TILT={word[:80]}: expected NONE, INCLUDE, or a file of that name beside it")
        numbers = _Numbers(re.split(r"[\s,]+", _text(str(beside)).strip()), str(beside))
    numbers.whole("geometry of lamp and luminaire", 1, 3)
    count = numbers.whole("number of tilt angles", 1, ANGLES)
    angles, factors = numbers.take(count, "tilt angles"), numbers.take(count, "tilt factors")
    _increasing("tilt angles", angles, path)
    if (factors < 0.0).any():
        raise FormatError(f"{path}: tilt factors are negative; expected factors from 0 up")
    return angles, factors


def _increasing(what: str, angles: np.ndarray, path: str) -> None:
    if (np.diff(angles) <= 0.0).any():
        raise FormatError(f"{path}: {what} do not increase; expected increasing degrees")


def _around(kind: str, second: np.ndarray, candela: np.ndarray, path: str) -> tuple[np.ndarray, np.ndarray]:
    """Second angles and intensities without symmetry: what a file leaves out is mirrored."""
    _increasing("horizontal angles", second, path)
    first, last = float(second[0]), float(second[-1])
    if kind != "C":
        if first == 0.0 and len(second) > 1:  # the same to either side
            return np.concatenate([-second[:0:-1], second]), np.concatenate([candela[:0:-1], candela])
        return second, candela
    if len(second) == 1:
        return np.zeros(1), candela
    if (first, last) == (90.0, 270.0):  # the same on either side of the plane through 90 and 270
        quarter = second <= 180.0
        ahead = 180.0 - second[quarter][::-1], candela[quarter][::-1]  # 0 to 90
        behind = 540.0 - second[~quarter][::-1], candela[~quarter][::-1]  # 270 to below 360
        second = np.concatenate([ahead[0], second[1:], behind[0][1:], [360.0]])
        return second, np.concatenate([ahead[1], candela[1:], behind[1][1:], ahead[1][:1]])
    if first != 0.0 or last not in (90.0, 180.0, 360.0):
        if first == 0.0 and 180.0 < last < 360.0:  # all around, without the last plane, which is the first
            return np.append(second, 360.0), np.concatenate([candela, candela[:1]])
        expected = "0 to 0, 90, 180 or 360, or 90 to 270 degrees"
        raise FormatError(f"{path}: horizontal angles run from {first:g} to {last:g}; expected {expected}")
    while second[-1] < 360.0:
        second = np.concatenate([second, 2.0 * second[-1] - second[-2::-1]])
        candela = np.concatenate([candela, candela[-2::-1]])
    return second, candela


def _checked(
    kind: str,
    first: np.ndarray,
    second: np.ndarray,
    candela: np.ndarray,
    tilt: tuple[np.ndarray, np.ndarray],
    flux: float,
    path: str,
) -> Photometry:
    _increasing("vertical angles", first, path)
    low, high = (0.0, 180.0) if kind == "C" else (-90.0, 90.0)
    if first[0] < low or first[-1] > high:
        rule = f"expected {low:g} to {high:g} for type {kind}"
        raise FormatError(f"{path}: vertical angles run from {first[0]:g} to {first[-1]:g}; {rule}")
    if (candela < 0.0).any():
        raise FormatError(f"{path}: an intensity is {candela.min():g}; expected candela from 0 up")
    if not np.isfinite(candela).all():
        raise FormatError(f"{path}: intensities times their factors are infinite; expected candela")
    return Photometry(kind, first, second, candela, tilt, flux, path)


def ldt(text: str, path: str) -> Photometry:
    """EULUMDAT, symmetries 0 to 4; of several sets of lamps the first.

    Source: Stockmar 1990, EULUMDAT; the order of its lines as in the manuals of Dialux.
    """
    lines = text.split("\n")
    if len(lines) < 42:
        expected = "an IES file with TILT=, or at least 42 lines of EULUMDAT"
        raise FormatError(f"{path}: {len(lines)} lines; expected {expected}")

    def number(line: int, what: str) -> float:
        return float(_Numbers([lines[line - 1].strip()], path).take(1, f"line {line}, {what}")[0])

    def whole(line: int, what: str, low: int, high: int) -> int:
        return _Numbers([lines[line - 1].strip()], path).whole(f"line {line}, {what}", low, high)

    symmetry = whole(3, "symmetry", 0, 4)
    planes, heights = whole(4, "number of C planes", 1, ANGLES), whole(6, "number of angles in a plane", 1, ANGLES)
    factor, sets = number(24, "conversion factor of intensities"), whole(26, "number of sets of lamps", 1, 20)
    if len(lines) < 36 + 6 * sets:
        raise FormatError(f"{path}: {len(lines)} lines, expected at least {36 + 6 * sets} for {sets} sets of lamps")
    flux = number(29, "flux of the lamps [lm]")
    if not flux > 0.0:
        raise FormatError(f"{path}: line 29, flux of the lamps, is {flux:g}; expected lumens above 0")
    start = 26 + 6 * sets + 10
    words = [word for line in lines[start:] for word in line.split()]
    numbers = _Numbers(words, path)
    second, first = numbers.take(planes, "C planes"), numbers.take(heights, "angles in a plane")
    multiple = {2: 2, 3: 4, 4: 4}.get(symmetry, 1)
    if planes % multiple:
        raise FormatError(f"{path}: {planes} C planes, expected a multiple of {multiple} with symmetry {symmetry}")
    begin, count = {0: (0, planes), 1: (0, 1), 2: (0, planes // 2 + 1), 3: (3 * planes // 4, planes // 2 + 1)}.get(
        symmetry, (0, planes // 4 + 1)
    )
    candela = numbers.take(count * heights, "intensities").reshape(count, heights) * (factor * flux / 1000.0)
    numbers.finish("the count of angles")
    if symmetry == 1:
        second, candela = np.zeros(1), candela
    elif symmetry == 0:
        _increasing("C planes", second, path)
        if second[0] != 0.0 or second[-1] > 360.0:
            raise FormatError(f"{path}: C planes run from {second[0]:g} to {second[-1]:g}; expected 0 to below 360")
        if planes > 1 and second[-1] < 360.0:
            second, candela = np.append(second, 360.0), np.concatenate([candela, candela[:1]])
    elif symmetry == 3:  # from 270 by 0 to 90, as 90 to 270 read from the other side
        half = np.mod(second[np.arange(begin, begin + count) % planes], 360.0)
        turned = np.where(half >= 180.0, half - 360.0, half)  # -90 to 90
        second, candela = _about_90(turned, candela, path)
    else:
        second, candela = _around("C", second[:count], candela, path)
    return _checked("C", first, second, candela, (np.zeros(1), np.ones(1)), flux, path)


def _about_90(angles: np.ndarray, candela: np.ndarray, path: str) -> tuple[np.ndarray, np.ndarray]:
    """All around, of planes from -90 to 90 degrees."""
    _increasing("C planes from 270 to 90 degrees", angles, path)
    if (angles[0], angles[-1]) != (-90.0, 90.0) or 0.0 not in angles:
        rule = "expected -90, 0 and 90 among them"
        raise FormatError(f"{path}: C planes run from {angles[0]:g} to {angles[-1]:g} degrees; {rule}")
    every = np.concatenate([angles, 180.0 - angles[-2::-1]])  # -90 to 270
    values = np.concatenate([candela, candela[-2::-1]])
    zero = int(np.flatnonzero(every == 0.0)[0])
    after, before = slice(zero, len(every)), slice(1, zero + 1)
    return np.concatenate([every[after], every[before] + 360.0]), np.concatenate([values[after], values[before]])
