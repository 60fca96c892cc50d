"""sin, cos, tan, sine and cosine of turns, arccos and arctan2."""

from __future__ import annotations

import math

from ..lanes import FLOAT32, FLOAT64, IRValue, Lanes
from .arithmetic import LARGEST, above, below, polynomial, rounded, sign_bit

# pi/2 as a sum of numbers of the dtype, the leading one first.
HALF_PI = {
    FLOAT32: (1.5707963705062866, -4.371138828673793e-08, -1.7151245100058819e-15),
    FLOAT64: (1.5707963267948966, 6.123233995736765e-17, 1.082856673921914e-32),
}

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

# sin(2 pi a) / a in z = a² on |a| <= 1/4: 2.8e-8, 4.0e-17.
SIN_TURN = {
    FLOAT32: (6.2831855e00, -4.13417e01, 8.1603065e01, -7.6585915e01, 3.9756077e01),
    FLOAT64: (
        6.283185307179586, -41.341702240399755, 81.60524927607341, -76.7058597527985, 42.058693923785384,
        -15.09464162051767, 3.8199270506492726, -0.7177235819088835, 0.10085633767093591,
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


def _reduced(v: Lanes, x: IRValue) -> tuple[IRValue, IRValue]:
    """r = x - n pi/2 for the nearest integer n, and bits with n in the last places.

    pi/2 is a sum of three reals, whose first multiple subtracts exactly; far out, r stays at the edge of its range.
    """
    n, quadrant = rounded(v, x, 2 / math.pi)
    opposite = v.sub(v.real(0), n)
    r = x
    for part in HALF_PI[v.dtype]:  # products that are -0 where n is 0, so that -0 stays
        r = v.fma(opposite if part < 0 else n, v.real(-abs(part)), r)
    return above(v, below(v, r, 0.79), -0.79), quadrant


def _sin_cos(v: Lanes, x: IRValue) -> tuple[IRValue, IRValue, IRValue]:
    """The sine and cosine of the reduced x, and the quadrant's bits."""
    r, quadrant = _reduced(v, x)
    z = v.mul(r, r)
    # + 0 in the sum keeps sin(-0) = -0.
    sine = v.fma(r, v.fma(z, polynomial(v, z, SIN[v.dtype]), v.real(0)), r)
    cosine = v.fma(z, v.fma(z, polynomial(v, z, COS[v.dtype]), v.real(-0.5)), v.real(1))
    return sine, cosine, quadrant


def _bit(v: Lanes, bits: IRValue, n: int) -> IRValue:
    """Whether bit n is set."""
    return v.compare("ne", v.integer("and", bits, v.pattern(1 << n)), v.pattern(0))


def _signed(v: Lanes, x: IRValue, bits: IRValue) -> IRValue:
    """x, negated where bit 1 is set."""
    sign = v.integer("and", v.integer("shl", bits, v.pattern(30 if v.dtype == FLOAT32 else 62)), sign_bit(v))
    return v.from_bits(v.integer("xor", v.bits(x), sign))


def sin(v: Lanes, x: IRValue) -> IRValue:
    """±sin(r) or ±cos(r), |r| <= pi/4.

    At most 1.6 ulp in float32 for |x| <= 1e5, 1.5 in float64 for |x| <= 1e8; beyond, some number in [-1, 1].
    """
    sine, cosine, quadrant = _sin_cos(v, x)
    return _signed(v, v.select(_bit(v, quadrant, 0), cosine, sine), quadrant)


def cos(v: Lanes, x: IRValue) -> IRValue:
    """±cos(r) or ±sin(r), |r| <= pi/4.

    At most 1.6 ulp in float32 for |x| <= 1e5, 1.4 in float64 for |x| <= 1e8; beyond, some number in [-1, 1].
    """
    sine, cosine, quadrant = _sin_cos(v, x)
    return _signed(v, v.select(_bit(v, quadrant, 0), sine, cosine), v.integer("add", quadrant, v.pattern(1)))


def tan(v: Lanes, x: IRValue) -> IRValue:
    """tan(r) or its negative reciprocal, |r| <= pi/4.

    At most 3.0 ulp in float32 for |x| <= 1e5, 2.4 in float64 for |x| <= 1e8.
    """
    r, quadrant = _reduced(v, x)
    z = v.mul(r, r)
    t = v.fma(r, v.mul(z, polynomial(v, z, TAN[v.dtype])), r)
    odd = _bit(v, quadrant, 0)
    return v.div(v.select(odd, v.real(-1), t), v.select(odd, t, v.real(1)))


def _from_turns(v: Lanes, x: IRValue) -> tuple[IRValue, IRValue]:
    """x less the nearest integer, exactly, and its magnitude."""
    r = v.sub(x, v.call("roundeven", x))
    return r, v.absolute(r)


def _sine_of_turns(v: Lanes, a: IRValue) -> IRValue:
    """sin(2 pi a), |a| <= 1/4."""
    first, *rest = SIN_TURN[v.dtype]
    z = v.mul(a, a)
    return v.fma(a, v.real(first), v.mul(v.mul(a, z), polynomial(v, z, rest)))


def sin_turn(v: Lanes, x: IRValue) -> IRValue:
    """sin(2 pi x) = ±sin(2 pi a), a the distance from x to the nearest half or whole number: no rounding of x.

    At most 1.8 ulp in float32, 2.0 in float64, for all x.
    """
    r, magnitude = _from_turns(v, x)
    left = v.sub(v.real(0.5), magnitude)
    a = v.select(v.compare("lt", left, magnitude), left, magnitude)
    return v.copysign(_sine_of_turns(v, a), r)


def cos_turn(v: Lanes, x: IRValue) -> IRValue:
    """cos(2 pi x) = sin(2 pi a), a = 1/4 less the distance from x to the nearest whole number.

    At most 1.8 ulp in float32, 2.0 in float64, for all x.
    """
    return _sine_of_turns(v, v.sub(v.real(0.25), _from_turns(v, x)[1]))


def arccos(v: Lanes, x: IRValue) -> IRValue:
    """pi/2 - arcsin(x) for |x| < 1/2, else 2 arcsin(sqrt((1 - |x|) / 2)), from pi for negative x.

    At most 1.2 ulp in float32 and float64.
    """
    half_pi, half_pi_low = HALF_PI[v.dtype][:2]
    magnitude = v.absolute(x)
    outer = v.compare("ge", magnitude, v.real(0.5))
    z = v.select(outer, v.fma(magnitude, v.real(-0.5), v.real(0.5)), v.mul(x, x))
    s = v.copysign(v.select(outer, v.sqrt(z), magnitude), x)
    tail = v.mul(s, v.mul(z, polynomial(v, z, ARCSIN[v.dtype])))
    inner = v.sub(v.real(half_pi), v.add(s, v.sub(tail, v.real(half_pi_low))))
    twice = v.mul(v.add(s, tail), v.real(2))
    from_pi = v.add(v.real(2 * half_pi), v.add(twice, v.real(2 * half_pi_low)))
    return v.select(outer, v.select(v.compare("lt", x, v.real(0)), from_pi, twice), inner)


def arctan2(v: Lanes, y: IRValue, x: IRValue) -> IRValue:
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
    r = v.fma(t, v.mul(z, polynomial(v, z, ARCTAN[v.dtype])), t)
    left = v.compare("lt", v.bits(x), v.pattern(0))
    k = v.select(near, v.real(1), v.real(0))
    k = v.select(steep, v.sub(v.real(2), k), k)
    k = v.select(left, v.sub(v.real(4), k), k)
    flip = v.integer("xor", steep, left)
    r = v.select(flip, v.neg(r), r)
    r = v.fma(k, v.real(quarter_pi_low), r)
    return v.copysign(v.fma(k, v.real(quarter_pi), r), y)
