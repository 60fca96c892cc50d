"""Coefficients of surface scattering modes (Zernike expansion), as NIST publishes them for sintered PTFE.

Rows of eight numbers, separated by commas or blanks: i, j, n, m, k, l, p and the coefficient of the mode (n, m, k, l)
of Mueller element (i, j), i <= j, times the wavelength [um] to the power p. Lines that begin with "%", "#" or ";" are
passed over. The order of the columns and the formulas are those of SCATMECH's ZernikeExpansion_BRDF_Model,
whose lambda^3 is lambda^2 by mistake; here it is not. (A README of the data calls the third and fourth column m, n.)
Checked against NIST's file for PTFE at 532 nm and the measurements that it was fitted to.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from ..arrays import ops
from ..base.measured import Measured
from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError
from ..formula.direction import Direction
from ..formula.fields import channels, table
from ..formula.mueller import Mueller, fixed_turns
from ..formula.sparse import times
from ..formula.state import note, state
from ._reading import plain_text
from ._reading.channel_words import LONGEST, SHORTEST
from ._rows.direction_pairs import repeated

if TYPE_CHECKING:
    import xarray

NAME = "Zernike"
SUFFIXES = (".csv",)
SHARED_SUFFIX = True
DESCRIPTION = "coefficients of surface scattering modes with Mueller matrix (Germer 2017, SCATMECH)"
ORACLE = "real file (NIST PTFE): a least-squares fit to NIST's measurements gives the file's coefficients"
NO_LAYOUT = "coefficients, no table; written as it was read, number by number: see `COLUMNS`"

COLUMNS = ("i", "j", "n", "m", "k", "l", "p", "coefficient")
COMMENTS = ("%", "#", ";")
HIGHEST = 24  # highest radial order; the polynomials lose digits beyond, 8 of them at 24
LAMBDA = 532.0
"""Wavelength [nm] at which coefficients that depend on it are taken if none is asked for; SCATMECH's default."""


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: first the numbers i, j, n, m, k, l, p, coefficient."""
    lines = plain_text.start(head).split("\n")
    rows = [plain_text.split(line) for line in lines if line.strip() and not line.strip().startswith(COMMENTS)]
    if not rows or len(rows[0]) != len(COLUMNS):
        return False
    if not all(map(plain_text.is_number, rows[0])):
        return False
    *orders, _ = map(float, rows[0])
    return all(abs(x) < 100.0 and x == int(x) for x in orders) and 1 <= orders[0] <= orders[1] <= 4


def read(
    path: Path,
    wavelengths: Annotated[
        Sequence[float] | None,
        Declared("a channel for each; if not given 532 nm where coefficients depend on it", SHORTEST, LONGEST, "nm"),
    ] = None,
) -> Zernike:
    """The expansion in a file. Raises FormatError with the line where a row is no mode."""
    lines = plain_text.read(path, COMMENTS)
    rows = lines.rows(len(COLUMNS), expected="numbers i, j, n, m, k, l, p, coefficient")
    return Zernike(rows, wavelengths, path=str(path))


def write(m: Zernike, path: Path) -> None:
    """Write the coefficients as they were read, number by number."""
    if not isinstance(m, Zernike):
        raise ParameterError(f"{m!r:.80}: expected a Zernike expansion; save others in a format for tables")
    plain_text.write(path, plain_text.join(m.rows, ", "))


class Zernike(Measured):
    """Expansion of f in modes of Lambert's equal-area discs of both directions, reciprocal by construction.

    With rho = sqrt(2) sin(theta/2), R the radial Zernike polynomials and N^2 = (n+1)(m+1)/(1, 2 or 4),

        f = sum a N/(2 pi) (R_n^l(rho_i) R_m^l(rho_o) + R_m^l(rho_i) R_n^l(rho_o)) cos(l (phi_o - phi_i)).

    N's divisor is 4 if n = 0, or n = m and l = 0; 2 if n = m, or l = 0; else 1. The other elements of the Mueller
    matrix are f times expansions that may turn with the sample; the file's axes are "xyxy" of
    `gn.polarization.to_frames`, those of `mueller` the surface's.

    Shapes   rows: (modes, 8). f: (...) without `wavelengths`, else (..., C).
    Units    f: 1/sr; wavelengths: nm (the file's powers are of um).
    Error    of the formula: rounding, up to 1e-8 at order 24. Of the expansion, for PTFE at 532 nm beside the 1824
             measurements that it was fitted to (largest angle 81.9 degrees): 0.0030/sr or 0.93 % root mean square,
             0.53 % median, 5.9 % largest; elements of the normalized Mueller matrix 0.006 to 0.011 root mean square.
    Source   Germer 2017, "Full four-dimensional and reciprocal Mueller matrix bidirectional reflectance distribution
             function of sintered polytetrafluoroethylene", Appl. Opt. 56(33):9333; Koenderink & van Doorn 1998,
             J. Opt. Soc. Am. A 15(11):2903. The formulas are those of SCATMECH's source; the papers' text was not seen.
    """

    format = NAME
    quantity = "coefficients of surface scattering modes"
    breaks: ClassVar[dict[str, str]] = {
        "positivity": "a sum of signed modes, fitted where there were measurements",
        "energy": "coefficients are kept as published, and nothing bounds them",
        "realizability": "each element of the matrix was fitted by itself: near grazing, beyond the measurements, 0.3 "
        "% of the matrices of PTFE have an eigenvalue below 0, by up to 4 % of the largest",
    }

    coefficients = table("of the modes of element (1, 1), by mode and channel")
    polarizing = table("of the modes of the other elements, over f, by mode and channel")
    channel = channels("number of the wavelength")

    rows: np.ndarray = note()
    """As in the file."""
    modes: tuple[tuple[int, int, int], ...] = state()
    """n, m, l of the modes of element (1, 1)."""
    others: tuple[tuple[int, ...], ...] = state()
    """i and j, from 0, and n, m, k, l of the modes of the other elements."""
    wavelengths: tuple[float, ...] = state()

    def __init__(
        self, rows: Any, wavelengths: Sequence[float] | None = None, path: str = "", about: dict[str, Any] | None = None
    ):
        rows = _checked(np.array(ops.numbers(rows), np.float64), path or "Zernike(rows)")
        if wavelengths is None and rows[:, 6].any():
            wavelengths = (LAMBDA,)
        nm = np.atleast_1d(np.array(LAMBDA if wavelengths is None else wavelengths, np.float64))
        if nm.ndim != 1 or not len(nm) or not (np.isfinite(nm).all() and (nm > 0.0).all()):
            raise ParameterError(f"wavelengths={wavelengths!r:.60}: expected positive numbers [nm]")
        first = rows[(rows[:, 0] == 1.0) & (rows[:, 1] == 1.0)]
        if not len(first):
            raise FormatError(f"{path or 'Zernike(rows)'}: holds no mode of element (1, 1), which is f")
        rows.flags.writeable = False
        names = tuple(nm.tolist())
        self._hold(
            rows=rows,
            wavelengths=names,
            channel_names=None if wavelengths is None else names,
            modes=tuple((int(n), int(m), int(turn)) for n, m, turn in first[:, [2, 3, 5]]),
        )
        rest = rows[(rows[:, 0] != 1.0) | (rows[:, 1] != 1.0)]
        self._hold(others=tuple((int(i) - 1, int(j) - 1, *map(int, orders)) for i, j, *orders in rest[:, :6]))
        norms = np.reshape([_mueller_norm(*mode) for mode in self.others], (-1, 1))
        polarizing = rest[:, 7:] * (1e-3 * nm) ** rest[:, 6:7] * norms
        values = first[:, 7:] * (1e-3 * nm) ** first[:, 6:7] * [[_norm(*mode)] for mode in self.modes]
        super().__init__(
            path, about, coefficients=values, polarizing=polarizing, channel=0.0 if wavelengths is None else len(nm)
        )

    @property
    def values(self) -> np.ndarray:
        """The coefficients of all modes, as in the file."""
        return self.rows[:, 7]

    @property
    def valid(self) -> np.ndarray:
        """True: every coefficient is a number."""
        return np.ones(len(self.rows), bool)

    @property
    def data(self) -> xarray.Dataset:
        """Variables i, j, n, m, k, l, p and coefficient, by mode."""
        import xarray

        columns = {name: ("mode", self.rows[:, c]) for c, name in enumerate(COLUMNS)}
        return xarray.Dataset(columns, attrs={"quantity": self.quantity, "source": self.path})

    def formula(self, wi: Direction, wo: Direction) -> Any:
        (xi, yi, ui), (xo, yo, uo) = _disc(wi), _disc(wo)
        along, across = xi * xo + yi * yo, xi * yo - yi * xo  # rho_i rho_o (cos, sin) of phi_o - phi_i
        orders = sorted({(n, turn) for n, m, turn in self.modes} | {(m, turn) for _, m, turn in self.modes})
        at_i = {key: _radial(*key, ui) for key in orders}
        at_o = {key: _radial(*key, uo) for key in orders}
        channel, count = ops.to_index(self.channel), len(self.wavelengths)
        turned: dict[int, tuple[Any, Any]] = {0: (1.0, 0.0)}  # rho_i^l rho_o^l (cos, sin) of l (phi_o - phi_i)
        for turn in range(1, max(turn for *_, turn in self.modes) + 1):
            c, s = turned[turn - 1]
            turned[turn] = (c * along - s * across, c * across + s * along)
        total = 0.0 * wi.z
        for t, (n, m, turn) in enumerate(self.modes):
            mode = at_i[n, turn] * at_o[m, turn] + at_i[m, turn] * at_o[n, turn]
            total = total + ops.take(self.coefficients, channel + t * count) * (mode * turned[turn][0])
        return total

    @property
    def polarizes(self) -> bool:
        return bool(self.others)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        """The file's Stokes vectors are in SCATMECH's basis "xyxy"; elements are over f, the first one's expansion."""
        at_i, at_o = _Modes(wi), _Modes(wo)
        channel, count = ops.to_index(self.channel), len(self.wavelengths)
        f = self.formula(wi, wo)
        over_f: list[list[Any]] = [[0.0] * 4 for _ in range(4)]
        for t, (i, j, n, m, k, turn) in enumerate(self.others):
            value = ops.take(self.polarizing, channel + t * count)
            there, back = at_i(n, k) * at_o(m, turn), at_o(n, k) * at_i(m, turn)
            if i == j:
                over_f[i][j] = over_f[i][j] + value * (there + back)
            else:
                # Below the diagonal these change sign as both directions are exchanged.
                sign = -1.0 if (j, i) in ((2, 0), (2, 1), (3, 2)) else 1.0
                over_f[i][j], over_f[j][i] = over_f[i][j] + value * there, over_f[j][i] + value * (sign * back)
        rows = [[f if i == j == 0 else times(f, over_f[i][j]) for j in range(4)] for i in range(4)]
        turn_i, turn_o = fixed_turns(wi, wo)
        return turn_o.transposed @ Mueller(tuple(map(tuple, rows))) @ turn_i  # type: ignore[arg-type]  # 4 x 4, which `map` does not say


class _Modes:
    """R_n^|k|(rho) times cos(k phi), or -sin(k phi) for k < 0, or sqrt(1/2) for k = 0, at one direction."""

    def __init__(self, w: Direction):
        self.x, self.y, self.u = _disc(w)
        self.turned: list[tuple[Any, Any]] = [(math.sqrt(0.5), 0.0), (self.x, self.y)]  # rho^k (cos, sin) of k phi
        self.known: dict[tuple[int, int], Any] = {}

    def __call__(self, n: int, k: int) -> Any:
        while len(self.turned) <= abs(k):
            c, s = self.turned[-1]
            self.turned.append((c * self.x - s * self.y, c * self.y + s * self.x))
        if (n, k) not in self.known:
            self.known[n, k] = _radial(n, abs(k), self.u) * self.turned[abs(k)][k < 0]
        return self.known[n, k]


def _checked(rows: np.ndarray, where: str) -> np.ndarray:
    if rows.ndim != 2 or rows.shape[1] != len(COLUMNS):
        raise ParameterError(f"{where}: shape {rows.shape}, expected (modes, {len(COLUMNS)})")
    i, j, n, m, k, turn, p, _ = rows.T
    whole = (np.isfinite(rows).all(axis=1)) & (rows[:, :7] == np.rint(rows[:, :7])).all(axis=1)
    rules = (
        (whole, "whole numbers i, j, n, m, k, l, p and a finite coefficient"),
        ((i >= 1) & (i <= j) & (j <= 4), "1 <= i <= j <= 4"),
        ((n >= 0) & (n <= HIGHEST) & (m >= 0) & (m <= HIGHEST), f"orders n and m from 0 to {HIGHEST}"),
        ((abs(k) <= n) & ((n - k) % 2 == 0), "|k| <= n, both even or both odd"),
        ((abs(turn) <= m) & ((m - turn) % 2 == 0), "|l| <= m, both even or both odd"),
        ((i > 1) | (j > 1) | ((k == turn) & (turn >= 0)), "k = l >= 0 for element (1, 1)"),
        ((p >= 0) & (p <= 9), "a power p of the wavelength from 0 to 9"),
    )
    for good, rule in rules:
        if not good.all():
            at = int(np.argmin(good))
            raise FormatError(f"{where}: mode {at + 1} is {rows[at].tolist()}, expected {rule}")
    if twice := repeated(rows[:, :7])[0]:
        first, again = twice
        got = f"rows {first + 1} and {again + 1} are of one mode, {rows[first, :7].tolist()}"
        raise FormatError(f"{where}: {got}; expected each once: remove one of them, or add the coefficients up")
    return rows


def _norm(n: int, m: int, turn: int) -> float:
    divisor = 4 if n == 0 or (n == m and turn == 0) else 2 if n == m or turn == 0 else 1
    return math.sqrt((n + 1) * (m + 1) / divisor) / (2.0 * math.pi)


def _mueller_norm(i: int, j: int, n: int, m: int, k: int, turn: int) -> float:
    twice = 1 if i != j else 4 if (n, k) == (m, turn) else 2
    return math.sqrt((n + 1) * (m + 1) / twice) / math.pi


def _disc(w: Direction) -> tuple[Any, Any, Any]:
    """Lambert's equal-area projection, rho (cos(phi), sin(phi)), and rho^2 = 1 - cos(theta)."""
    scale = 1.0 / ops.sqrt(1.0 + w.z)
    x, y = w.x * scale, w.y * scale
    return x, y, x * x + y * y


def _radial(n: int, turn: int, u: Any) -> Any:
    """R_n^turn(rho)/rho^turn, a polynomial in u = rho^2."""
    total: Any = 0.0
    last = (n - turn) // 2
    for s in range(last + 1):
        total = total * u + float((-1) ** s * math.comb(n - s, s) * math.comb(n - 2 * s, last - s))
    return total
