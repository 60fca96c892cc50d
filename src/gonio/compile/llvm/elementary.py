"""Elementary functions on vectors of reals, composed of arithmetic, selections and bit operations only.

No function branches, reads tables or calls a library. Each is written once for both dtypes, which differ in the
coefficients of their polynomials. Errors in the docstrings are the largest ones measured, in units in the last place
(ulp). NaN passes through; `exp` and `power` flush results below the smallest normal number to zero.

Coefficients were fitted by Remez exchange in 50 digits and rounded to the dtype; the comment at each set gives the
interval and the largest relative error of the function composed with the rounded ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from .lanes import FLOAT32, FLOAT64, Lanes, Value

MANTISSA = {FLOAT32: 23, FLOAT64: 52}  # stored bits
BIAS = {FLOAT32: 127, FLOAT64: 1023}
LARGEST = {FLOAT32: (2 - 2.0**-23) * 2.0**127, FLOAT64: (2 - 2.0**-52) * 2.0**1023}

# Numbers as sums of numbers of the dtype, the leading one first.
LN2 = {FLOAT32: (0.6931471228599548, 5.769998878690785e-08), FLOAT64: (0.6931471805599453, 2.3190468138462996e-17)}
HALF_PI = {
    FLOAT32: (1.5707963705062866, -4.371138828673793e-08, -1.7151245100058819e-15),
    FLOAT64: (1.5707963267948966, 6.123233995736765e-17, 1.082856673921914e-32),
}
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

# (sin(r) / r - 1) / z and (cos(r) - 1 + z/2) / z², z = r², on |r| <= 0.79: 4.3e-9, 4.1e-18 and 1.3e-10, 7.6e-20.
SIN = {
    FLOAT32: (-1.6666654e-01, 8.332105e-03, -1.9507593e-04),
    FLOAT64: (
        -0.16666666666666627, 0.008333333333321128, -0.0001984126982877086, 2.7557313329397994e-06,
        -2.505070091581337e-08, 1.5893455103604048e-10,
    ),
}  # fmt: skip
COS = {
    FLOAT32: (4.1666646e-02, -1.3887304e-03, 2.4431205e-05),
    FLOAT64: (
        0.04166666666666659, -0.0013888888888872167, 2.4801587288275152e-05, -2.755731400749202e-07,
        2.0875676860443064e-09, -1.1357265601236982e-11,
    ),
}  # fmt: skip

# (tan(r) / r - 1) / z, z = r², on the same interval: 2.0e-8, 1.8e-17.
TAN = {
    FLOAT32: (3.333314e-01, 1.3339227e-01, 5.337534e-02, 2.4559867e-02, 2.9098033e-03, 9.510845e-03),
    FLOAT64: (
        0.33333333333332665, 0.13333333333429973, 0.05396825391937599, 0.02186948978287181, 0.008863216726853938,
        0.003592310968142479, 0.0014546255581702051, 0.0005956196842212749, 0.00022074897718656135,
        0.0001398756354642636, -3.109693595057767e-05, 9.377230109055442e-05, -4.720379756739987e-05,
        2.1421821528804234e-05,
    ),
}  # fmt: skip

# (arcsin(s) / s - 1) / z, z = s², on 0 <= z <= 1/4: 4.9e-9, 1.5e-17.
ARCSIN = {
    FLOAT32: (1.6666752e-01, 7.495308e-02, 4.546956e-02, 2.41819e-02, 4.2164292e-02),
    FLOAT64: (
        0.16666666666665403, 0.07500000000338534, 0.04464285682699169, 0.030381959195226904, 0.02237175658786192,
        0.017359727669390916, 0.013885001951036419, 0.01217078677130241, 0.006521000426373714, 0.01954775906861764,
        -0.01625543344745329, 0.03193402260481492,
    ),
}  # fmt: skip
# (arctan(t) / t - 1) / z, z = t², on |t| <= 1/2: 6.7e-10, 1.1e-18.
ARCTAN = {
    FLOAT32: (-3.3333328e-01, 1.9999553e-01, -1.4272511e-01, 1.09383754e-01, -7.9539895e-02, 3.8063135e-02),
    FLOAT64: (
        -0.33333333333333315, 0.19999999999993764, -0.14285714284998138, 0.11111111070039692, -0.09090907705348925,
        0.07692277640324639, -0.06666224991470414, 0.058778156005798804, -0.05230046014926439, 0.04589533877402805,
        -0.03712011126101908, 0.023656198385076196, -0.00836605330420749,
    ),
}  # fmt: skip

# erf(x) / x - 1 in x² on |x| <= 5/4: 4.9e-9, 1.7e-17.
ERF_NEAR = {
    FLOAT32: (
        1.2837917e-01, -3.761263e-01, 1.12836584e-01, -2.6859501e-02, 5.2075135e-03, -8.3244947e-04, 1.0320195e-04,
        -7.4331924e-06,
    ),
    FLOAT64: (
        0.1283791670955126, -0.37612638903184004, 0.112837916709636, -0.0268661706462571, 0.005223977633206959,
        -0.0008548327340811886, 0.00012055341234502532, -1.4925791840110929e-05, 1.6463725032894347e-06,
        -1.637767754052117e-07, 1.4857319437124418e-08, -1.2353594287999823e-09, 8.960318137505614e-11,
        -4.258334426750072e-12,
    ),
}  # fmt: skip
# erfc(x)^(1/4) in x - centre for 9/8 <= x <= 3.95, 5.95, where erf(x) rounds to 1; error of erf: 1.4e-8, 7.7e-18.
ERF_CENTRE = {FLOAT32: 2.53125, FLOAT64: 3.53125}
ERF_END = {FLOAT32: 3.93, FLOAT64: 5.93}
ERF_FAR = {
    FLOAT32: (
        1.3618429e-01, -1.8424608e-01, 9.244143e-02, -1.31043065e-02, -6.0720276e-03, 2.7570683e-03, 5.5913857e-05,
        -1.7894617e-04,
    ),
    FLOAT64: (
        0.027733566374635196, -0.05079774906094418, 0.03981520857337022, -0.016155532403981786, 0.0026385552543088625,
        0.0005558491961866362, -0.00036470412404942046, 5.231789820590802e-05, 1.0664540006788897e-05,
        -4.925380952414643e-06, 3.506998839967836e-07, 1.6229988515966425e-07, -3.809678528612069e-08,
        -9.431396222765058e-10, 1.4256359324297828e-09, -1.4742404154675014e-10, -2.6868990705503846e-11,
        9.265315606710236e-12, 4.766829255848103e-13, -2.8929294126635826e-13, -2.891674780180489e-14,
    ),
}  # fmt: skip

# h = erfinv(x) / x as a function of w = -ln(1 - x²): (h - sqrt(pi) / 2) / w in w - centre on 0 <= w <= 2 centre, where
# the error of h is 3.9e-8, 6.0e-17.
ERFINV_CENTRE = {FLOAT32: 2.5, FLOAT64: 3.125}
ERFINV_NEAR = {
    FLOAT32: (
        2.4607296e-01, 2.2686462e-04, -1.7616812e-03, 2.0371376e-04, 5.836658e-06, -4.3983887e-06, 3.782825e-07,
        5.171274e-08, -1.1713192e-08,
    ),
    FLOAT64: (
        0.24557684391371032, -0.001733971676198983, -0.0013759037424735058, 0.0002032643866615513,
        -5.2896571626676294e-06, -2.7497171925842908e-06, 4.4295936052481457e-07, -6.233775892658839e-09,
        -7.307712452314842e-09, 1.0224180415028797e-09, 9.21525920640699e-12, -2.0275271644715798e-11,
        2.3357200231504707e-12, 9.45124681334096e-14, -5.626898413339527e-14, 5.167666403982273e-15,
        4.629627893487449e-16, -1.5694696250441505e-16, 8.122047445507944e-18, 2.0808529127597512e-18,
        -2.783272624799953e-19, -1.0102329145962525e-20, 2.507952629093035e-21,
    ),
}  # fmt: skip
# h in sqrt(w) - centre from there to the last number before 1: 9.4e-8, 7.6e-17.
ERFINV_TAIL_CENTRE = {FLOAT32: 3.15625, FLOAT64: 4.28125}
ERFINV_TAIL = {
    FLOAT32: (
        2.989693e+00, 1.004142e+00, 6.5773744e-03, -4.817646e-03, 3.3830788e-03, -2.432345e-03, 1.2813038e-03,
        -1.2069469e-04, -1.6542077e-04,
    ),
    FLOAT64: (
        4.123785922523308, 1.0100210686921771, 0.0006569837793637466, -0.0005819879527004608, 0.00020242258532081258,
        -6.049805959475655e-05, 1.9900241683141852e-05, -8.853438088796788e-06, 4.967073367020392e-06,
        -2.7724923798366836e-06, 1.3192667771120822e-06, -4.786240525102278e-07, 1.01192677291535e-07,
        1.3726599236643243e-08, -2.4200178721799194e-08, 1.190928552935454e-08, -3.107802134404809e-09,
        2.8942122467803232e-11, 3.598214518152643e-10, -1.6041126750406043e-10, 3.405205706667642e-11,
        -1.3791913074064763e-12, -2.817759951721504e-12, 1.7040619406871205e-12, -3.5897669205602126e-13,
        -4.8826936035294585e-14, 3.140611514266068e-14, -3.4308737007777772e-15,
    ),
}  # fmt: skip


def _fma(v: Lanes, a: Value, b: Value, c: Value) -> Value:
    """a b + c, rounded once: the one place that asks for a fused multiply-add."""
    return v.fma(a, b, c)


def _polynomial(v: Lanes, x: Value, coefficients: Sequence[float]) -> Value:
    """Σ c_k x^k: Horner's rule; where long, inside c_0 + x (...) the even and the odd powers apart: shorter chains."""
    first, *rest = (v.real(c) for c in coefficients)
    return _fma(v, _powers(v, x, rest), x, first)


def _powers(v: Lanes, x: Value, coefficients: Sequence[Value]) -> Value:
    if len(coefficients) > 4:
        square = v.mul(x, x)
        return _fma(v, _powers(v, square, coefficients[1::2]), x, _powers(v, square, coefficients[::2]))
    result = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        result = _fma(v, result, x, c)
    return result


def _below(v: Lanes, x: Value, bound: float) -> Value:
    """min(x, bound); NaN stays."""
    limit = v.real(bound)
    return v.select(v.compare("lt", limit, x), limit, x)


def _above(v: Lanes, x: Value, bound: float) -> Value:
    """max(x, bound); NaN stays."""
    limit = v.real(bound)
    return v.select(v.compare("gt", limit, x), limit, x)


def _sign_bit(v: Lanes) -> Value:
    return v.pattern(-(1 << (31 if v.dtype == FLOAT32 else 63)))


def _rounded(v: Lanes, x: Value, scale: float) -> tuple[Value, Value]:
    """The integer nearest to scale x, as a real, and a bit pattern whose low bits are that integer's.

    By adding a number so large that the unit is its last place; where the integer exceeds it, a multiple of a power of
    two is found instead.
    """
    large = 1.5 * 2.0 ** MANTISSA[v.dtype]
    shifted = _fma(v, x, v.real(scale), v.real(large))
    return v.sub(shifted, v.real(large)), v.bits(shifted)


def _scaled(v: Lanes, x: Value, exponent: Value) -> Value:
    """x 2^exponent by adding to the exponent's bits: for normal results."""
    shift = v.pattern(MANTISSA[v.dtype])
    return v.from_bits(v.integer("add", v.bits(x), v.integer("shl", exponent, shift)))


def exp(v: Lanes, x: Value) -> Value:
    """e^x = 2^n (1 + r + r² P(r)), |r| <= ln(2) / 2.

    At most 1.1 ulp in float32, 1.0 in float64, over all normal results; smaller ones are 0.
    """
    low, high = EXP_RANGE[v.dtype]
    n, exponent = _rounded(v, x, 1 / math.log(2))
    r = _fma(v, n, v.real(-LN2[v.dtype][0]), x)
    r = _fma(v, n, v.real(-LN2[v.dtype][1]), r)
    q = _polynomial(v, r, EXP[v.dtype])
    p = v.add(_fma(v, v.mul(r, r), q, r), v.real(1))
    result = _scaled(v, p, exponent)
    # Beyond the range, x times a huge number is infinite; and NaN stays NaN.
    result = v.select(v.compare("le", x, v.real(high)), result, v.mul(x, v.real(LARGEST[v.dtype])))
    return v.select(v.compare("lt", x, v.real(low)), v.real(0), result)


def _decomposed(v: Lanes, x: Value, denormal: bool = True) -> tuple[Value, Value]:
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


def _extended(v: Lanes, e: Value, x: Value, unreal: Value) -> Value:
    """The exponent e of x >= 0, infinite for 0 and infinity, and NaN where the logarithm is not real or x is NaN."""
    e = v.select(unreal, v.real(math.nan), e)
    e = v.select(v.compare("lt", x, v.real(math.inf)), e, x)
    return v.select(v.compare("eq", x, v.real(0)), v.real(-math.inf), e)


def _log(v: Lanes, e: Value, f: Value) -> Value:
    """e ln 2 + ln(1 + f)."""
    square = v.mul(f, f)
    tail = v.mul(v.mul(square, f), _polynomial(v, f, LOG[v.dtype]))
    tail = _fma(v, e, v.real(LN2[v.dtype][1]), tail)
    tail = _fma(v, square, v.real(-0.5), tail)
    return _fma(v, e, v.real(LN2[v.dtype][0]), v.add(f, tail))


def log(v: Lanes, x: Value) -> Value:
    """ln x = e ln 2 + f - f²/2 + f³ P(f), x = 2^e (1 + f), 1 + f within a factor sqrt(2) of 1.

    At most 0.9 ulp in float32 and float64, for all x > 0.
    """
    e, f = _decomposed(v, x)
    return _log(v, _extended(v, e, x, v.compare("lt", x, v.real(0))), f)


def _product(v: Lanes, a: Value, a_low: Value, b: Value, b_low: Value) -> tuple[Value, Value]:
    """(a + a_low) (b + b_low) as a sum of two reals."""
    p = v.mul(a, b)
    return p, _fma(v, a, b_low, _fma(v, a_low, b, _fma(v, a, b, v.neg(p))))


def _sum(v: Lanes, a: Value, b: Value, low: Value) -> tuple[Value, Value]:
    """a + b + low as a sum of two reals, where |a| >= |b| or a = 0."""
    s = v.add(a, b)
    return s, v.add(v.add(v.sub(a, s), b), low)


def _log2(v: Lanes, e: Value, f: Value) -> tuple[Value, Value]:
    """e + log2(1 + f) as a sum of two reals: log2(1 + f) = 2/ln(2) (s + s z (1/3 + z R(z))), s = f/(2 + f), z = s²."""
    reciprocal = v.div(v.real(1), v.add(f, v.real(2)))
    s = v.mul(f, reciprocal)
    s_low = v.mul(_fma(v, v.neg(s), f, _fma(v, s, v.real(-2), f)), reciprocal)
    z = v.mul(s, s)
    z_low = _fma(v, v.add(s, s), s_low, _fma(v, s, s, v.neg(z)))
    third, third_low = (v.real(part) for part in THIRD[v.dtype])
    q, q_low = _sum(v, third, v.mul(z, _polynomial(v, z, ARTANH[v.dtype])), third_low)
    u, u_low = _product(v, s, s_low, *_product(v, z, z_low, q, q_low))
    total, total_low = _sum(v, s, u, v.add(s_low, u_low))
    k, k_low = _product(v, total, total_low, *(v.real(part) for part in TWO_OVER_LN2[v.dtype]))
    return _sum(v, e, k, k_low)


def power(v: Lanes, x: Value, y: Value) -> Value:
    """x^y = 2^n (1 + r P(r)), n + r = y log2 |x|, |r| <= 1/2, the logarithm as a sum of two reals.

    At most 1.0 ulp in float32, 1.2 in float64, over all normal results; smaller ones are 0. Special values as in C99.
    """
    whole = v.compare("eq", v.floor(y), y)
    half = v.mul(y, v.real(0.5))
    odd = v.integer("and", whole, v.compare("ne", v.floor(half), half))
    magnitude = v.absolute(x)
    e, f = _decomposed(v, magnitude)
    e = _extended(v, e, magnitude, v.integer("and", v.compare("lt", x, v.real(0)), v.compare("ne", v.floor(y), y)))
    exact, v.exact = v.exact, True
    logarithm, low = _log2(v, e, f)
    bounded = _above(v, _below(v, y, 2.0**80), -(2.0**80))  # so that 0 log2(1) stays 0
    t = v.mul(bounded, logarithm)
    n, exponent = _rounded(v, t, 1)
    t_low = _fma(v, bounded, low, _fma(v, bounded, logarithm, v.neg(t)))
    r = v.add(v.sub(t, n), t_low)
    v.exact = exact
    result = _scaled(v, _fma(v, r, _polynomial(v, r, EXP2[v.dtype]), v.real(1)), exponent)
    less, bias = v.compare("lt", r, v.real(0)), BIAS[v.dtype]
    high, least = (v.select(less, v.real(limit + 1), v.real(limit)) for limit in (1 + bias, 1 - bias))
    result = v.select(v.compare("ge", n, high), v.real(math.inf), result)
    result = v.select(v.compare("lt", n, least), v.real(0), result)
    sign = v.integer("and", v.bits(x), v.select(odd, _sign_bit(v), v.pattern(0)))
    result = v.from_bits(v.integer("xor", v.bits(result), sign))
    one = v.integer("or", v.compare("eq", y, v.real(0)), v.compare("eq", x, v.real(1)))
    return v.select(one, v.real(1), result)


def _reduced(v: Lanes, x: Value) -> tuple[Value, Value]:
    """r = x - n pi/2 for the nearest integer n, and bits with n in the last places.

    pi/2 is a sum of three reals, whose first multiple subtracts exactly; far out, r is held at the edge of its range.
    """
    n, quadrant = _rounded(v, x, 2 / math.pi)
    opposite = v.sub(v.real(0), n)
    r = x
    for part in HALF_PI[v.dtype]:  # products that are -0 where n is 0, so that -0 stays
        r = _fma(v, opposite if part < 0 else n, v.real(-abs(part)), r)
    return _above(v, _below(v, r, 0.79), -0.79), quadrant


def _sin_cos(v: Lanes, x: Value) -> tuple[Value, Value, Value]:
    """The sine and cosine of the reduced x, and the quadrant's bits."""
    r, quadrant = _reduced(v, x)
    z = v.mul(r, r)
    # + 0 in the sum keeps sin(-0) = -0.
    sine = _fma(v, r, _fma(v, z, _polynomial(v, z, SIN[v.dtype]), v.real(0)), r)
    cosine = _fma(v, z, _fma(v, z, _polynomial(v, z, COS[v.dtype]), v.real(-0.5)), v.real(1))
    return sine, cosine, quadrant


def _bit(v: Lanes, bits: Value, n: int) -> Value:
    """Whether bit n is set."""
    return v.compare("ne", v.integer("and", bits, v.pattern(1 << n)), v.pattern(0))


def _signed(v: Lanes, x: Value, bits: Value) -> Value:
    """x, negated where bit 1 is set."""
    sign = v.integer("and", v.integer("shl", bits, v.pattern(30 if v.dtype == FLOAT32 else 62)), _sign_bit(v))
    return v.from_bits(v.integer("xor", v.bits(x), sign))


def sin(v: Lanes, x: Value) -> Value:
    """±sin(r) or ±cos(r), |r| <= pi/4.

    At most 1.6 ulp in float32 for |x| <= 1e5, 1.5 in float64 for |x| <= 1e8; beyond, some number in [-1, 1].
    """
    sine, cosine, quadrant = _sin_cos(v, x)
    return _signed(v, v.select(_bit(v, quadrant, 0), cosine, sine), quadrant)


def cos(v: Lanes, x: Value) -> Value:
    """±cos(r) or ±sin(r), |r| <= pi/4.

    At most 1.6 ulp in float32 for |x| <= 1e5, 1.4 in float64 for |x| <= 1e8; beyond, some number in [-1, 1].
    """
    sine, cosine, quadrant = _sin_cos(v, x)
    return _signed(v, v.select(_bit(v, quadrant, 0), sine, cosine), v.integer("add", quadrant, v.pattern(1)))


def tan(v: Lanes, x: Value) -> Value:
    """tan(r) or its negative reciprocal, |r| <= pi/4.

    At most 3.0 ulp in float32 for |x| <= 1e5, 2.4 in float64 for |x| <= 1e8.
    """
    r, quadrant = _reduced(v, x)
    z = v.mul(r, r)
    t = _fma(v, r, v.mul(z, _polynomial(v, z, TAN[v.dtype])), r)
    odd = _bit(v, quadrant, 0)
    return v.div(v.select(odd, v.real(-1), t), v.select(odd, t, v.real(1)))


def arccos(v: Lanes, x: Value) -> Value:
    """pi/2 - arcsin(x) for |x| < 1/2, else 2 arcsin(sqrt((1 - |x|) / 2)), from pi for negative x.

    At most 1.2 ulp in float32 and float64.
    """
    half_pi, half_pi_low = HALF_PI[v.dtype][:2]
    magnitude = v.absolute(x)
    outer = v.compare("ge", magnitude, v.real(0.5))
    z = v.select(outer, _fma(v, magnitude, v.real(-0.5), v.real(0.5)), v.mul(x, x))
    s = v.copysign(v.select(outer, v.sqrt(z), magnitude), x)
    tail = v.mul(s, v.mul(z, _polynomial(v, z, ARCSIN[v.dtype])))
    inner = v.sub(v.real(half_pi), v.add(s, v.sub(tail, v.real(half_pi_low))))
    twice = v.mul(v.add(s, tail), v.real(2))
    from_pi = v.add(v.real(2 * half_pi), v.add(twice, v.real(2 * half_pi_low)))
    return v.select(outer, v.select(v.compare("lt", x, v.real(0)), from_pi, twice), inner)


def arctan2(v: Lanes, y: Value, x: Value) -> Value:
    """k pi/4 ± arctan(t), t = b/a or (b - a) / (b + a), |t| <= 1/2, a >= b of |x|, |y|.

    At most 1.8 ulp in float32, 1.5 in float64, for all x and y. Special values as in C99.
    """
    quarter_pi, quarter_pi_low = (0.5 * part for part in HALF_PI[v.dtype][:2])
    ax, ay = v.absolute(x), v.absolute(y)
    steep = v.compare("gt", ay, ax)
    a, b = v.select(steep, ay, ax), v.select(steep, ax, ay)
    # Sums of huge numbers overflow: halve both, but leave small ones their last place.
    huge = v.compare("gt", a, v.real(LARGEST[v.dtype] / 4))
    a, b = (v.select(huge, v.mul(side, v.real(0.25)), side) for side in (a, b))
    infinite = v.integer("and", *(v.compare("eq", side, v.real(math.inf)) for side in (a, b)))
    a, b = v.select(infinite, v.real(1), a), v.select(infinite, v.real(1), b)
    near = v.compare("gt", b, v.mul(a, v.real(0.5)))
    numerator = v.select(near, v.sub(b, a), b)
    denominator = v.select(near, v.add(b, a), a)
    denominator = v.select(v.compare("eq", denominator, v.real(0)), v.real(1), denominator)
    t = v.div(numerator, denominator)
    z = v.mul(t, t)
    r = _fma(v, t, v.mul(z, _polynomial(v, z, ARCTAN[v.dtype])), t)
    left = v.compare("lt", v.bits(x), v.pattern(0))
    k = v.select(near, v.real(1), v.real(0))
    k = v.select(steep, v.sub(v.real(2), k), k)
    k = v.select(left, v.sub(v.real(4), k), k)
    flip = v.integer("xor", steep, left)
    r = v.select(flip, v.neg(r), r)
    r = _fma(v, k, v.real(quarter_pi_low), r)
    return v.copysign(_fma(v, k, v.real(quarter_pi), r), y)


def erf(v: Lanes, x: Value) -> Value:
    """x + x P(x²) for |x| < 9/8, else ±(1 - Q(|x|)^4), to where it rounds to 1.

    At most 1.6 ulp in float32 and float64, for all x.
    """
    magnitude = _below(v, v.absolute(x), ERF_END[v.dtype])
    near = _fma(v, x, _polynomial(v, v.mul(x, x), ERF_NEAR[v.dtype]), x)
    root = _polynomial(v, v.sub(magnitude, v.real(ERF_CENTRE[v.dtype])), ERF_FAR[v.dtype])
    square = v.mul(root, root)
    far = _fma(v, v.neg(square), square, v.real(1))
    return v.select(v.compare("lt", magnitude, v.real(1.125)), near, v.copysign(far, x))


def erfinv(v: Lanes, x: Value) -> Value:
    """x h(w), w = -ln(1 - x²): h a polynomial in w, in the tails in sqrt(w).

    At most 2.5 ulp in float32, 2.8 in float64.
    """
    centre, tail_centre = ERFINV_CENTRE[v.dtype], ERFINV_TAIL_CENTRE[v.dtype]
    w = v.neg(_log(v, *_decomposed(v, _fma(v, v.neg(x), x, v.real(1)), denormal=False)))
    near = _fma(v, w, _polynomial(v, v.sub(w, v.real(centre)), ERFINV_NEAR[v.dtype]), v.real(math.sqrt(math.pi) / 2))
    tail = _polynomial(v, v.sub(v.sqrt(w), v.real(tail_centre)), ERFINV_TAIL[v.dtype])
    result = v.mul(x, v.select(v.compare("lt", w, v.real(2 * centre)), near, tail))
    magnitude = v.absolute(x)
    special = v.select(v.compare("gt", magnitude, v.real(1)), v.real(math.nan), v.mul(x, v.real(math.inf)))
    return v.select(v.compare("lt", magnitude, v.real(1)), result, special)


FUNCTIONS: dict[str, Callable[..., Value]] = {
    "exp": exp,
    "log": log,
    "power": power,
    "sin": sin,
    "cos": cos,
    "tan": tan,
    "arccos": arccos,
    "arctan2": arctan2,
    "erf": erf,
    "erfinv": erfinv,
}
