"""Complex numbers in formulas: amplitudes of light, and indices n + ik of what absorbs it."""

from __future__ import annotations

from typing import Any, NamedTuple, NoReturn

from ..arrays import ops
from .sparse import is_zero, like, minus, plus, times


class _Parts(NamedTuple):
    re: Any
    im: Any = 0.0


class Complex(_Parts):
    """re + i im, whose parts are numbers of a formula: symbols while it is traced, arrays of any library.

    +, -, *, / are those of numbers, also with a real number on either side (a Dr.Jit array must stand on the right); a
    part that is written 0.0 costs nothing. Time factor exp(-i omega t): a wave is exp(+i k x), absorption makes k > 0.

    Shapes   parts that broadcast.
    Error    rounding, of |z| between 1e-18 and 1e18.

    Example
    >>> from gonio.authoring import Complex
    >>> gold, c = Complex(0.2, 3.9), 1.0
    >>> r = (c - gold) / (c + gold)
    >>> print(round(r.norm, 4), (1.0 - gold * gold).sqrt().re.round(3))
    0.952 4.026
    """

    __slots__ = ()
    __array_ufunc__ = None  # array * complex is computed by the complex number

    def __add__(self, other: Any) -> Complex:
        other = as_complex(other)
        return Complex(plus(self.re, other.re), plus(self.im, other.im))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Complex:
        other = as_complex(other)
        return Complex(minus(self.re, other.re), minus(self.im, other.im))

    def __rsub__(self, other: Any) -> Complex:
        return as_complex(other) - self

    def __neg__(self) -> Complex:
        return Complex(minus(0.0, self.re), minus(0.0, self.im))

    def __mul__(self, other: Any) -> Complex:
        a, b = self, as_complex(other)
        return Complex(
            minus(times(a.re, b.re), times(a.im, b.im)),
            plus(times(a.re, b.im), times(a.im, b.re)),
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Complex:
        other = as_complex(other)
        real = is_zero(other.im)
        quotient: Complex = self * (1.0 / other.re) if real else self * other.conjugate * (1.0 / other.norm)
        return quotient

    def __rtruediv__(self, other: Any) -> Complex:
        return as_complex(other) / self

    def __eq__(self, other: object) -> NoReturn:
        raise TypeError("complex numbers of a formula have no ==; compare their parts, z.re and z.im")

    __ne__ = __eq__

    def __bool__(self) -> NoReturn:
        raise TypeError("a complex number of a formula is neither true nor false; compare its parts, z.re and z.im")

    @property
    def conjugate(self) -> Complex:
        """re - i im.

        Example
        >>> from gonio.authoring import Complex
        >>> print(Complex(1.0, 2.0).conjugate)
        Complex(re=1.0, im=-2.0)
        """
        return Complex(self.re, minus(0.0, self.im))

    @property
    def norm(self) -> Any:
        """|z|^2, a real number.

        Example
        >>> from gonio.authoring import Complex
        >>> print(Complex(3.0, 4.0).norm)
        25.0
        """
        return plus(times(self.re, self.re), times(self.im, self.im))

    def sqrt(self) -> Complex:
        """The root in the right half plane, of a negative real number on the positive imaginary axis.

        Neither part cancels; derivatives are finite at 0, where the root of 1e-36 stands in.

        Example
        >>> from gonio.authoring import Complex
        >>> print(Complex(-4.0).sqrt().im, Complex(-3.0, 4.0).sqrt().re)
        2.0 1.0
        """
        if is_zero(self.im):
            positive = self.re > 0.0
            root = ops.sqrt(ops.where(positive, self.re, -self.re) + 1e-36)
            return Complex(ops.where(positive, root, 0.0), ops.where(positive, 0.0, root))
        x, y = like(self.re, self.im), like(self.im, self.re)
        modulus = ops.sqrt(x * x + y * y + 1e-36)
        # The larger part comes from a sum, the other from 2 re im = the imaginary part.
        larger = ops.sqrt(0.5 * (modulus + ops.absolute(x)))
        other = 0.5 * y / larger
        right, up = x >= 0.0, y >= 0.0
        return Complex(
            ops.where(right, larger, ops.absolute(other)), ops.where(right, other, ops.where(up, larger, -larger))
        )

    def exp(self) -> Complex:
        """e^re (cos im + i sin im).

        Example
        >>> from gonio.authoring import Complex
        >>> print(Complex(0.0, np.pi / 2).exp().im)
        1.0
        """
        size = 1.0 if is_zero(self.re) else ops.exp(self.re)
        if is_zero(self.im):
            return Complex(size)
        return Complex(times(size, ops.cos(self.im)), times(size, ops.sin(self.im)))


def as_complex(x: Any) -> Complex:
    """A real number as a complex one; a complex one as it is.

    Example
    >>> from gonio.formula.complex import as_complex
    >>> print(as_complex(1.5))
    Complex(re=1.5, im=0.0)
    """
    if isinstance(x, Complex):
        return x
    if isinstance(x, complex):
        return Complex(x.real, x.imag)
    if isinstance(x, tuple):
        raise TypeError(f"a complex number and a {type(x).__name__}; expected a number on either side")
    return Complex(x)
