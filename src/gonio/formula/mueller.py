"""Mueller matrices in formulas: what reflection does to polarized light, Stokes vectors (I, Q, U, V) in and out.

Axes of a Stokes vector, for light that moves along k (-wi, then wo): x = s, horizontal, along increasing azimuth, and
y = p = k x s. Q = I_s - I_p, U + iV = 2 E_s conj(E_p), time factor exp(-i omega t). At the pole the azimuth is 0.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..arrays import ops
from .complex import Complex, as_complex
from .direction import Direction
from .sparse import is_zero, minus, plus, times

Row = tuple[Any, Any, Any, Any]


class _Rows(NamedTuple):
    rows: tuple[Row, Row, Row, Row]


class Mueller(_Rows):
    """A 4 x 4 matrix of numbers of a formula: `M.rows[i][j]`; +, times a number (on its right), and M @ N.

    Elements that are written 0.0 cost nothing. `M * f` is f times M.

    Error    rounding.

    Example
    >>> from gonio.authoring import Mueller
    >>> print((Mueller.depolarizer(0.5) * 0.5).rows[0])
    (0.25, 0.0, 0.0, 0.0)
    """

    __slots__ = ()
    __array_ufunc__ = None  # array * matrix is computed by the matrix

    @staticmethod
    def depolarizer(f: Any) -> Mueller:
        """f diag(1, 0, 0, 0): what leaves is unpolarized.

        Example
        >>> from gonio.authoring import Mueller
        >>> print(Mueller.depolarizer(0.3).rows[0])
        (0.3, 0.0, 0.0, 0.0)
        """
        return Mueller(((f, 0.0, 0.0, 0.0), *[(0.0,) * 4] * 3))  # type: ignore[arg-type]  # 4 x 4, which mypy cannot count

    def __add__(self, other: Any) -> Mueller:
        if not isinstance(other, Mueller):
            raise TypeError(f"a Mueller matrix + {type(other).__name__}; expected a Mueller matrix on either side")
        pairs = zip(self.rows, other.rows, strict=True)
        return _matrix([[plus(a, b) for a, b in zip(*rows, strict=True)] for rows in pairs])

    def __mul__(self, factor: Any) -> Mueller:
        if isinstance(factor, tuple):
            raise TypeError(f"a Mueller matrix * {type(factor).__name__}; expected a number, or M @ N")
        return _matrix([[times(factor, a) for a in row] for row in self.rows])

    __rmul__ = __mul__

    def __matmul__(self, other: Mueller) -> Mueller:
        columns = list(zip(*other.rows, strict=True))
        return _matrix([[_sum(map(times, row, column)) for column in columns] for row in self.rows])

    def __eq__(self, other: object) -> Any:
        raise TypeError("Mueller matrices of a formula have no ==; compare their elements, M.rows[i][j]")

    __ne__ = __eq__

    def where(self, condition: Any) -> Mueller:
        """The matrix where the condition holds, else 0.

        Example
        >>> from gonio.authoring import Mueller
        >>> print(Mueller.depolarizer(0.3).where(np.array(False)).rows[0][0])
        0.0
        """
        return _matrix([[x if is_zero(x) else ops.where(condition, x, 0.0) for x in row] for row in self.rows])

    @property
    def transposed(self) -> Mueller:
        """Rows and columns exchanged.

        Example
        >>> from gonio.authoring import Mueller
        >>> print(Mueller(((1, 2, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))).transposed.rows[1])
        (2, 1, 0, 0)
        """
        return _matrix(list(zip(*self.rows, strict=True)))


def _matrix(rows: Any) -> Mueller:
    return Mueller(tuple(tuple(row) for row in rows))  # type: ignore[arg-type]  # 4 x 4, which mypy cannot count


def _sum(terms: Any) -> Any:
    total: Any = 0.0
    for term in terms:
        total = plus(total, term)
    return total


def of_amplitudes(s: Complex | Any, p: Complex | Any) -> Mueller:
    """The Mueller matrix of amplitudes E_s' = s E_s, E_p' = p E_p: of a mirror, a film, an interface.

    With s = r_s and p = r_p of Fresnel's formulas, r_p = -r_s at normal incidence.

    Source   Born & Wolf, Principles of Optics, 7th ed., section 10.9.3 (Stokes parameters). Derived here.

    Example
    >>> from gonio.authoring import of_amplitudes
    >>> M = of_amplitudes(-0.2, 0.2)
    >>> print(np.round(M.rows[0], 3), np.round(M.rows[2], 3))
    [0.04 0.   0.   0.  ] [ 0.    0.   -0.04  0.  ]
    """
    s, p = as_complex(s), as_complex(p)
    both = s * p.conjugate
    a, b = times(0.5, plus(s.norm, p.norm)), times(0.5, minus(s.norm, p.norm))
    c, d = both
    return Mueller(((a, b, 0.0, 0.0), (b, a, 0.0, 0.0), (0.0, 0.0, c, minus(0.0, d)), (0.0, 0.0, d, c)))


def turned_axes(c: Any, s: Any) -> Mueller:
    """Stokes vectors in axes turned by psi, from x towards y: c = cos 2 psi, s = sin 2 psi.

    Example
    >>> from gonio.formula.mueller import turned_axes
    >>> print(turned_axes(0.0, 1.0).rows[1])
    (0.0, 0.0, 1.0, 0.0)
    """
    return Mueller(((1.0, 0.0, 0.0, 0.0), (0.0, c, s, 0.0), (0.0, minus(0.0, s), c, 0.0), (0.0, 0.0, 0.0, 1.0)))


def facet_turns(wi: Direction, wo: Direction, across: bool = False) -> tuple[Mueller, Mueller]:
    """From the axes of the surface to those of the facet, for light along -wi and for light along wo.

    The facet's s is perpendicular to the plane of wi and wo. Where these are the same (to 1e-7) there is no such plane:
    s is then that of the surface. `across`: wi is behind the surface, and goes straight through where it is -wo.

    Error    rounding, also near the pole and near wi = wo.
    """
    d = wo + wi if across else wo - wi  # wi x wo is wi x d, and wo x d or its opposite
    same = d.x * d.x + d.y * d.y + d.z * d.z < 1e-14

    def turn(w: Direction, side: float) -> Mueller:
        # s ~ wi x wo = w x d. Its parts along x and y, both times sin(theta) |s|; at the pole w has the azimuth 0.
        hx, hy, height = _horizontal(w)
        along = w.z * (hx * d.x + hy * d.y) - height * d.z
        up = hx * d.y - hy * d.x
        size = along * along + up * up
        scale = 1.0 / ops.where(same, 1.0, size)
        c = ops.where(same, 1.0, (along * along - up * up) * scale)
        s = ops.where(same, 0.0, (2.0 * side) * (along * up) * scale)
        return turned_axes(c, s)

    return turn(wi, -1.0), turn(wo, 1.0)


def fixed_turns(wi: Direction, wo: Direction) -> tuple[Mueller, Mueller]:
    """From the axes of the surface to those that keep their direction at the normal, for light along -wi and wo."""

    def turn(w: Direction, side: float) -> Mueller:
        across = w.x * w.x + w.y * w.y
        pole = across < 1e-20
        scale = 1.0 / ops.where(pole, 1.0, across)
        c, s = (w.x * w.x - w.y * w.y) * scale, (2.0 * side) * (w.x * w.y) * scale
        return turned_axes(ops.where(pole, 1.0, c), ops.where(pole, 0.0, s))

    return turn(wi, 1.0), turn(wo, -1.0)


def turn_to(w: Direction, across: Direction, side: float) -> Mueller:
    """From the axes of the surface to those whose x is `across`, of any length, perpendicular to w, for light that
    leaves along w (side 1) or arrives from there (-1)."""
    hx, hy, height = _horizontal(w)
    along = hx * across.y - hy * across.x
    up = height * across.z - w.z * (hx * across.x + hy * across.y)
    size = along * along + up * up
    none = size < 1e-36
    scale = 1.0 / ops.where(none, 1.0, size)
    c = ops.where(none, 1.0, (along * along - up * up) * scale)
    return turned_axes(c, ops.where(none, 0.0, (2.0 * side) * (along * up) * scale))


def horizontal(w: Direction) -> Direction:
    """The x axis of light along w or from there, times the sine of its polar angle, but at the pole.

    Example
    >>> from gonio.authoring import Direction
    >>> from gonio.formula.mueller import horizontal
    >>> print(horizontal(Direction(0.0, 0.0, np.array(1.0))).y)
    1.0
    """
    hx, hy, _ = _horizontal(w)
    return Direction(-hy, hx, 0.0 * w.z)


def _horizontal(w: Direction) -> tuple[Any, Any, Any]:
    """w's components along the surface, (1, 0) at the pole, and their product with w's own."""
    across = w.x * w.x + w.y * w.y
    pole = across < 1e-20
    return ops.where(pole, 1.0, w.x), ops.where(pole, 0.0, w.y), ops.where(pole, 0.0, across)


def diattenuator(s: Any, p: Any) -> Mueller:
    """Mueller matrix of real amplitudes times s, p, both positive, divided by its first element.

    Example
    >>> from gonio.formula.mueller import diattenuator
    >>> print(diattenuator(1.0, 0.0).rows[0])
    (1.0, 1.0, 0.0, 0.0)
    """
    s2, p2 = s * s, p * p
    share = 1.0 / (s2 + p2)
    b, c = (s2 - p2) * share, 2.0 * s * p * share
    return Mueller(((1.0, b, 0.0, 0.0), (b, 1.0, 0.0, 0.0), (0.0, 0.0, c, 0.0), (0.0, 0.0, 0.0, c)))


def scaled_to(M: Mueller, f: Any) -> Mueller:
    """M times what makes its first element f; 0 where that is 0.

    Example
    >>> from gonio.formula.mueller import diattenuator, scaled_to
    >>> print(scaled_to(diattenuator(1.0, 0.0), np.array(0.3)).rows[0][1])
    0.3
    """
    none = M.rows[0][0] == 0.0
    scaled: Mueller = M * ops.where(none, 0.0, f / ops.where(none, 1.0, M.rows[0][0]))
    return scaled


def about_facet(M: Mueller, wi: Direction, wo: Direction, across: bool = False) -> Mueller:
    """A Mueller matrix in the axes of the facet, as one in the axes of the surface.

    M acts on light whose s is perpendicular to the plane of wi and wo, as that of a mirror facet does. `across`: wi is
    behind the surface.

    Error    rounding.

    Example
    >>> from gonio.authoring import Direction, about_facet, of_amplitudes
    >>> M = of_amplitudes(1.0, 0.0)  # lets pass what is horizontal for the facet
    >>> wi, wo = Direction(*gn.direction(0.6, 0.0)), Direction(*gn.direction(0.6, 1.0))
    >>> print(np.round(about_facet(M, wi, wo).rows[0], 3))
    [ 0.5   -0.331  0.375  0.   ]
    """
    to_i, to_o = facet_turns(wi, wo, across)
    return to_o.transposed @ M @ to_i
