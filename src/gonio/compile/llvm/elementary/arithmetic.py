"""The parts of all families: polynomials, rounding to integers, and the dtypes' bits."""

from __future__ import annotations

from collections.abc import Sequence

from ..lanes import FLOAT32, FLOAT64, IRValue, Lanes

MANTISSA = {FLOAT32: 23, FLOAT64: 52}  # stored bits
BIAS = {FLOAT32: 127, FLOAT64: 1023}
LARGEST = {FLOAT32: (2 - 2.0**-23) * 2.0**127, FLOAT64: (2 - 2.0**-52) * 2.0**1023}


def polynomial(v: Lanes, x: IRValue, coefficients: Sequence[float]) -> IRValue:
    """Σ c_k x^k: Horner's rule; where long, inside c_0 + x (...) the even and the odd powers apart: shorter chains."""
    first, *rest = (v.real(c) for c in coefficients)
    return v.fma(_powers(v, x, rest), x, first)


def _powers(v: Lanes, x: IRValue, coefficients: Sequence[IRValue]) -> IRValue:
    if len(coefficients) > 4:
        square = v.mul(x, x)
        return v.fma(_powers(v, square, coefficients[1::2]), x, _powers(v, square, coefficients[::2]))
    result = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        result = v.fma(result, x, c)
    return result


def below(v: Lanes, x: IRValue, bound: float) -> IRValue:
    """min(x, bound); NaN stays."""
    limit = v.real(bound)
    return v.select(v.compare("lt", limit, x), limit, x)


def above(v: Lanes, x: IRValue, bound: float) -> IRValue:
    """max(x, bound); NaN stays."""
    limit = v.real(bound)
    return v.select(v.compare("gt", limit, x), limit, x)


def sign_bit(v: Lanes) -> IRValue:
    """The pattern of -0."""
    return v.pattern(-(1 << (31 if v.dtype == FLOAT32 else 63)))


def rounded(v: Lanes, x: IRValue, scale: float) -> tuple[IRValue, IRValue]:
    """The integer nearest to scale x, as a real, and a bit pattern whose low bits are that integer's.

    By adding a number so large that its last place is the unit; an integer beyond that number becomes a multiple of a
    power of two.
    """
    large = 1.5 * 2.0 ** MANTISSA[v.dtype]
    shifted = v.fma(x, v.real(scale), v.real(large))
    return v.sub(shifted, v.real(large)), v.bits(shifted)


def scaled(v: Lanes, x: IRValue, exponent: IRValue) -> IRValue:
    """x 2^exponent by adding to the exponent's bits: for normal results."""
    shift = v.pattern(MANTISSA[v.dtype])
    return v.from_bits(v.integer("add", v.bits(x), v.integer("shl", exponent, shift)))
