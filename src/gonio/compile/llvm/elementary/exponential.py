"""exp, log and power."""

from __future__ import annotations

import math

from ..lanes import FLOAT32, FLOAT64, IRValue, Lanes
from .arithmetic import BIAS, LARGEST, MANTISSA, above, below, polynomial, rounded, scaled, sign_bit

# Numbers as sums of numbers of the dtype, the leading one first.
LN2 = {FLOAT32: (0.6931471228599548, 5.769998878690785e-08), FLOAT64: (0.6931471805599453, 2.3190468138462996e-17)}
TWO_OVER_LN2 = {
    FLOAT32: (2.885390043258667, 3.851926067000022e-08),
    FLOAT64: (2.8853900817779268, 4.0710547481862066e-17),
}
THIRD = {FLOAT32: (0.3333333432674408, -9.934107758624577e-09), FLOAT64: (0.3333333333333333, 1.850371707708594e-17)}

# (e^r - 1 - r) / r² on |r| <= ln(2) / 2: 3.5e-9, 9.2e-18.
EXP = {
    FLOAT32: (4.9999994e-01, 1.6666514e-01, 4.1668143e-02, 8.369355e-03, 1.3827835e-03),
    FLOAT64: (
        0.5000000000000011, 0.16666666666666075, 0.04166666666652069, 0.008333333333731933, 0.0013888888947056045,
        0.00019841268951575666, 2.4801488853889784e-05, 2.755811484025841e-06, 2.7631949296208605e-07,
        2.4823487338193303e-08,
    ),
}  # fmt: skip
EXP_RANGE = {FLOAT32: (-87.33654, 88.72283), FLOAT64: (-708.3964185322641, 709.782712893384)}

# (2^f - 1) / f on |f| <= 1/2: 5.4e-9, 2.0e-17.
EXP2 = {
    FLOAT32: (6.9314724e-01, 2.4022654e-01, 5.550277e-02, 9.617916e-03, 1.3414577e-03, 1.5444447e-04),
    FLOAT64: (
        0.6931471805599457, 0.240226506959101, 0.055504108664787846, 0.009618129107605587, 0.0013333558153973515,
        0.0001540353044394539, 1.5252726932621717e-05, 1.321544123355841e-06, 1.0180814330759954e-07,
        7.0728577287345505e-09, 4.055931415941728e-10,
    ),
}  # fmt: skip

# (ln(1 + f) - f + f²/2) / f³ on sqrt(1/2) <= 1 + f <= sqrt(2): 5.9e-9, 9.7e-18.
LOG = {
    FLOAT32: (
        3.333333e-01, -2.5000823e-01, 2.0001248e-01, -1.6623326e-01, 1.4201403e-01, -1.3160148e-01, 1.2763579e-01,
        -7.636835e-02,
    ),
    FLOAT64: (
        0.3333333333333314, -0.24999999999987982, 0.20000000000067042, -0.16666666669824812, 0.1428571428003384,
        -0.12499999691471352, 0.11111111151230761, -0.10000015209053653, 0.09090923804464815, -0.08332913337185326,
        0.07691532239257509, -0.07149445105025276, 0.06684564048758808, -0.061966006699656725, 0.056684943378439635,
        -0.05678329054514849, 0.06503501217155393, -0.05980171177668305, 0.026137095482266268,
    ),
}  # fmt: skip
# (artanh(s) / s - 1 - z/3) / z², z = s², on |s| <= tanh(ln(2) / 4): 1.0e-11, 2.0e-20.
ARTANH = {
    FLOAT32: (2.0000076e-01, 1.4273565e-01, 1.1709415e-01),
    FLOAT64: (
        0.20000000000001134, 0.14285714285047452, 0.11111111260417289, 0.09090892140475769, 0.07693380788545463,
        0.06628356422602541, 0.06598677421386906,
    ),
}  # fmt: skip


def exp(v: Lanes, x: IRValue) -> IRValue:
    """e^x = 2^n (1 + r + r² P(r)), |r| <= ln(2) / 2.

    At most 1.1 ulp in float32, 1.0 in float64, over all normal results; smaller ones are 0.
    """
    low, high = EXP_RANGE[v.dtype]
    n, exponent = rounded(v, x, 1 / math.log(2))
    r = v.fma(n, v.real(-LN2[v.dtype][0]), x)
    r = v.fma(n, v.real(-LN2[v.dtype][1]), r)
    q = polynomial(v, r, EXP[v.dtype])
    p = v.add(v.fma(v.mul(r, r), q, r), v.real(1))
    result = scaled(v, p, exponent)
    # Beyond the range, x times a huge number is infinite; and NaN stays NaN.
    result = v.select(v.compare("le", x, v.real(high)), result, v.mul(x, v.real(LARGEST[v.dtype])))
    return v.select(v.compare("lt", x, v.real(low)), v.real(0), result)


def decomposed(v: Lanes, x: IRValue, denormal: bool = True) -> tuple[IRValue, IRValue]:
    """The integer e, as a real, and f with x = 2^e (1 + f), sqrt(1/2) <= 1 + f < sqrt(2), for finite x > 0.

    `denormal`: also for numbers below the smallest normal one.
    """
    stored, bias = MANTISSA[v.dtype], BIAS[v.dtype]
    large = 2.0**stored
    offset = v.real(large + bias)
    if denormal:
        tiny = v.compare("lt", x, v.real(2.0 ** (1 - bias)))
        x = v.select(tiny, v.mul(x, v.real(4 * large)), x)
        offset = v.select(tiny, v.real(large + bias + stored + 2), offset)
    root = 0x3F3504F3 if v.dtype == FLOAT32 else 0x3FE6A09E667F3BCD
    bits = v.integer("add", v.bits(x), v.pattern((bias << stored) - root))
    # The biased exponent, written into the last places of a large number.
    e = v.integer("or", v.integer("lshr", bits, v.pattern(stored)), v.pattern((bias + stored) << stored))
    m = v.integer("add", v.integer("and", bits, v.pattern((1 << stored) - 1)), v.pattern(root))
    return v.sub(v.from_bits(e), offset), v.sub(v.from_bits(m), v.real(1))


def _extended(v: Lanes, e: IRValue, x: IRValue, unreal: IRValue) -> IRValue:
    """The exponent e of x >= 0, infinite for 0 and infinity, and NaN where the logarithm is not real or x is NaN."""
    e = v.select(unreal, v.real(math.nan), e)
    e = v.select(v.compare("lt", x, v.real(math.inf)), e, x)
    return v.select(v.compare("eq", x, v.real(0)), v.real(-math.inf), e)


def logarithm(v: Lanes, e: IRValue, f: IRValue) -> IRValue:
    """e ln 2 + ln(1 + f)."""
    square = v.mul(f, f)
    tail = v.mul(v.mul(square, f), polynomial(v, f, LOG[v.dtype]))
    tail = v.fma(e, v.real(LN2[v.dtype][1]), tail)
    tail = v.fma(square, v.real(-0.5), tail)
    return v.fma(e, v.real(LN2[v.dtype][0]), v.add(f, tail))


def log(v: Lanes, x: IRValue) -> IRValue:
    """ln x = e ln 2 + f - f²/2 + f³ P(f), x = 2^e (1 + f), 1 + f within a factor sqrt(2) of 1.

    At most 0.9 ulp in float32 and float64, for all x > 0.
    """
    e, f = decomposed(v, x)
    return logarithm(v, _extended(v, e, x, v.compare("lt", x, v.real(0))), f)


def _product(v: Lanes, a: IRValue, a_low: IRValue, b: IRValue, b_low: IRValue) -> tuple[IRValue, IRValue]:
    """(a + a_low) (b + b_low) as a sum of two reals."""
    p = v.mul(a, b)
    return p, v.fma(a, b_low, v.fma(a_low, b, v.fma(a, b, v.neg(p))))


def _sum(v: Lanes, a: IRValue, b: IRValue, low: IRValue) -> tuple[IRValue, IRValue]:
    """a + b + low as a sum of two reals, where |a| >= |b| or a = 0."""
    s = v.add(a, b)
    return s, v.add(v.add(v.sub(a, s), b), low)


def _log2(v: Lanes, e: IRValue, f: IRValue) -> tuple[IRValue, IRValue]:
    """e + log2(1 + f) as a sum of two reals: log2(1 + f) = 2/ln(2) (s + s z (1/3 + z R(z))), s = f/(2 + f), z = s²."""
    reciprocal = v.div(v.real(1), v.add(f, v.real(2)))
    s = v.mul(f, reciprocal)
    s_low = v.mul(v.fma(v.neg(s), f, v.fma(s, v.real(-2), f)), reciprocal)
    z = v.mul(s, s)
    z_low = v.fma(v.add(s, s), s_low, v.fma(s, s, v.neg(z)))
    third, third_low = (v.real(part) for part in THIRD[v.dtype])
    q, q_low = _sum(v, third, v.mul(z, polynomial(v, z, ARTANH[v.dtype])), third_low)
    u, u_low = _product(v, s, s_low, *_product(v, z, z_low, q, q_low))
    total, total_low = _sum(v, s, u, v.add(s_low, u_low))
    k, k_low = _product(v, total, total_low, *(v.real(part) for part in TWO_OVER_LN2[v.dtype]))
    return _sum(v, e, k, k_low)


def power(v: Lanes, x: IRValue, y: IRValue) -> IRValue:
    """x^y = 2^n (1 + r P(r)), n + r = y log2 |x|, |r| <= 1/2, the logarithm as a sum of two reals.

    At most 1.0 ulp in float32, 1.2 in float64, over all normal results; smaller ones are 0. Special values as in C99.
    """
    whole = v.compare("eq", v.floor(y), y)
    half = v.mul(y, v.real(0.5))
    odd = v.integer("and", whole, v.compare("ne", v.floor(half), half))
    magnitude = v.absolute(x)
    e, f = decomposed(v, magnitude)
    e = _extended(v, e, magnitude, v.integer("and", v.compare("lt", x, v.real(0)), v.compare("ne", v.floor(y), y)))
    exact, v.exact = v.exact, True
    logarithm, low = _log2(v, e, f)
    bounded = above(v, below(v, y, 2.0**80), -(2.0**80))  # so that 0 log2(1) stays 0
    t = v.mul(bounded, logarithm)
    n, exponent = rounded(v, t, 1)
    t_low = v.fma(bounded, low, v.fma(bounded, logarithm, v.neg(t)))
    r = v.add(v.sub(t, n), t_low)
    v.exact = exact
    result = scaled(v, v.fma(r, polynomial(v, r, EXP2[v.dtype]), v.real(1)), exponent)
    less, bias = v.compare("lt", r, v.real(0)), BIAS[v.dtype]
    high, least = (v.select(less, v.real(limit + 1), v.real(limit)) for limit in (1 + bias, 1 - bias))
    result = v.select(v.compare("ge", n, high), v.real(math.inf), result)
    result = v.select(v.compare("lt", n, least), v.real(0), result)
    sign = v.integer("and", v.bits(x), v.select(odd, sign_bit(v), v.pattern(0)))
    result = v.from_bits(v.integer("xor", v.bits(result), sign))
    one = v.integer("or", v.compare("eq", y, v.real(0)), v.compare("eq", x, v.real(1)))
    return v.select(one, v.real(1), result)
