"""erf, its inverse, and the integral of 1 - erf."""

from __future__ import annotations

import math

from ..lanes import FLOAT32, FLOAT64, IRValue, Lanes
from .arithmetic import below, polynomial
from .exponential import decomposed, logarithm

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

# ierfc(x)^(1/4) in x on 0 <= x <= 3.5, 5.75, where 2 x + ierfc(x) rounds to 2 x; error of that: 1.3e-7, 1.1e-16.
IERFC_END = {FLOAT32: 3.5, FLOAT64: 5.75}
IERFC = {
    FLOAT32: (
        0.866675, -0.38403505, -0.038594645, 0.024159685, 0.0075455774, -0.0013842394, -0.0012904403, 0.00043584048,
        -4.0214378e-05,
    ),
    FLOAT64: (
        0.8666749935615672, -0.3840353574554295, -0.038588107186673236, 0.024108436717013876, 0.007736707574316236,
        -0.0017695008672707292, -0.0008456280545321725, 0.00013999032402069636, 6.499791839551437e-05,
        -1.2993271640059339e-05, -3.0760149175569107e-06, 1.0351078209678142e-06, 7.018971542354198e-08,
        -1.279800400035705e-07, 6.181648446973592e-08, -2.1223123190505165e-08, 5.221148252735872e-09,
        -9.01098273752556e-10, 1.0704076465513845e-10, -8.399663405640247e-12, 3.9476033695654786e-13,
        -8.461939875395574e-15,
    ),
}  # fmt: skip


def erf(v: Lanes, x: IRValue) -> IRValue:
    """x + x P(x²) for |x| < 9/8, else ±(1 - Q(|x|)^4), to where it rounds to 1.

    At most 1.6 ulp in float32 and float64, for all x.
    """
    magnitude = below(v, v.absolute(x), ERF_END[v.dtype])
    near = v.fma(x, polynomial(v, v.mul(x, x), ERF_NEAR[v.dtype]), x)
    root = polynomial(v, v.sub(magnitude, v.real(ERF_CENTRE[v.dtype])), ERF_FAR[v.dtype])
    square = v.mul(root, root)
    far = v.fma(v.neg(square), square, v.real(1))
    return v.select(v.compare("lt", magnitude, v.real(1.125)), near, v.copysign(far, x))


def erfinv(v: Lanes, x: IRValue) -> IRValue:
    """x h(w), w = -ln(1 - x²): h a polynomial in w, in the tails in sqrt(w).

    At most 2.5 ulp in float32, 2.8 in float64.
    """
    centre, tail_centre = ERFINV_CENTRE[v.dtype], ERFINV_TAIL_CENTRE[v.dtype]
    w = v.neg(logarithm(v, *decomposed(v, v.fma(v.neg(x), x, v.real(1)), denormal=False)))
    near = v.fma(w, polynomial(v, v.sub(w, v.real(centre)), ERFINV_NEAR[v.dtype]), v.real(math.sqrt(math.pi) / 2))
    tail = polynomial(v, v.sub(v.sqrt(w), v.real(tail_centre)), ERFINV_TAIL[v.dtype])
    result = v.mul(x, v.select(v.compare("lt", w, v.real(2 * centre)), near, tail))
    magnitude = v.absolute(x)
    special = v.select(v.compare("gt", magnitude, v.real(1)), v.real(math.nan), v.mul(x, v.real(math.inf)))
    return v.select(v.compare("lt", magnitude, v.real(1)), result, special)


def ierfc(v: Lanes, x: IRValue) -> IRValue:
    """P(x)^4, 0 where it is lost in 2 x + ierfc(x), for x >= 0.

    At most 3.6 ulp of 2 x + ierfc(x) in float32, 2.8 in float64.
    """
    root = polynomial(v, x, IERFC[v.dtype])
    square = v.mul(root, root)
    return v.select(v.compare("ge", x, v.real(IERFC_END[v.dtype])), v.real(0), v.mul(square, square))
