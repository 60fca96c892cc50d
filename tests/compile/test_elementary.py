"""Elementary functions of the compiled engine: errors against mpmath, and special values against NumPy."""

import ctypes
import itertools
from functools import cache

import numpy as np
import pytest

from gonio.arrays import ops
from gonio.compile.llvm.elementary import FUNCTIONS
from gonio.compile.llvm.lanes import IRValue, Lanes
from gonio.compile.source import elementary as written

llvm = pytest.importorskip("llvmlite.binding")
mp = pytest.importorskip("mpmath")


BITS = {"float32": np.int32, "float64": np.int64}
BOUND = {"tan": 3, "erfinv": 4, "ierfc": 4}  # ulp; else 2
TRUE = {"power": mp.power, "arccos": mp.acos, "arctan2": mp.atan2} | {
    name: getattr(mp, name) for name in ("exp", "log", "sin", "cos", "tan", "erf")
}
TRUE |= {"sin_turn": lambda x: mp.sinpi(2 * x), "cos_turn": lambda x: mp.cospi(2 * x)}
TRUE["ierfc"] = lambda x: mp.exp(-x * x) / mp.sqrt(mp.pi) - x * mp.erfc(x)
NUMPY = {name: getattr(np, name) for name in FUNCTIONS if hasattr(np, name)}

both = pytest.mark.parametrize("dtype", ["float32", "float64"])


@pytest.fixture
def rng():
    return np.random.default_rng(20)


@cache
def compiled(name, dtype, width):
    """The function on arrays: a loop over vectors."""
    inputs = len(ops.ELEMENTARY[name].arguments)
    v = Lanes(dtype, width)
    vector, real = v.types["real"], v.scalar["real"]
    result = FUNCTIONS[name](v, *(IRValue("real", f"%x{k}") for k in range(inputs)))
    loads = "\n".join(
        f"%p{k} = getelementptr {real}, ptr %in{k}, i64 %i\n%x{k} = load {vector}, ptr %p{k}, align 4"
        for k in range(inputs)
    )
    body, declarations = "\n".join(v.lines), "\n".join(sorted(v.declared))
    text = f"""{declarations}
define void @kernel(i64 %n, ptr %out, {", ".join(f"ptr %in{k}" for k in range(inputs))}) {{
entry:
br label %loop
loop:
%i = phi i64 [ 0, %entry ], [ %next, %loop ]
{loads}
{body}
%q = getelementptr {real}, ptr %out, i64 %i
store {vector} {result.name}, ptr %q, align 4
%next = add i64 %i, {width}
%more = icmp ult i64 %next, %n
br i1 %more, label %loop, label %end
end:
ret void
}}"""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features()
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=features.flatten(), opt=3
    )
    module = llvm.parse_assembly(text)
    module.verify()
    engine = llvm.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    kernel = ctypes.CFUNCTYPE(None, ctypes.c_int64, *[ctypes.c_void_p] * (inputs + 1))(
        engine.get_function_address("kernel")
    )

    def function(*arrays):
        arrays = [np.asarray(a, dtype) for a in arrays]
        n = arrays[0].size
        padded = [np.concatenate([a, np.ones(-n % width, dtype)]) for a in arrays]
        out = np.empty(padded[0].size, dtype)
        kernel(out.size, out.ctypes.data, *(a.ctypes.data for a in padded))
        return out[:n]

    function.engine = engine
    return function


def evaluate(name, dtype, *arrays):
    return compiled(name, dtype, 16 if dtype == "float32" else 8)(*arrays)


def between(rng, dtype, low, high, n):
    """Positive numbers, uniform in their bit patterns: all orders of magnitude alike."""
    first, last = (int(np.array(x, dtype).view(BITS[dtype])) for x in (low, high))
    return rng.integers(first, last, n, endpoint=True).astype(BITS[dtype]).view(dtype)


def arguments(name, dtype, rng, n=600):
    """Random arguments over the domain and at its difficult places."""
    info = np.finfo(dtype)
    single = dtype == "float32"
    sign = rng.choice([-1, 1], n)
    if name == "exp":
        low, high = (-87.3, 88.7) if single else (-708.3, 709.7)
        return [np.r_[rng.uniform(low, high, 2 * n), sign * between(rng, dtype, 1e-30, high * 0.98, n)]]
    if name == "log":
        near = 1 + sign * between(rng, dtype, info.eps, 0.5, n)
        return [np.r_[between(rng, dtype, info.smallest_subnormal, info.max, 2 * n), near]]
    if name == "power":
        near = 1 + sign * between(rng, dtype, info.eps, 0.5, n)
        base = np.r_[rng.uniform(0, 1, n), between(rng, dtype, info.smallest_subnormal, info.max, n), near].astype(
            dtype
        )
        base = base[(base != 1) & (base > 0)]
        reach = rng.uniform(-125, 127, base.size) if single else rng.uniform(-1021, 1023, base.size)
        exponent = (reach / np.log2(base.astype(float))).astype(dtype)
        thousands = rng.uniform(0.98, 1, n)
        return [np.r_[base, thousands], np.r_[exponent, rng.uniform(0, 4000, n)]]
    if name in ("sin", "cos", "tan"):
        reach = 1e5 if single else 1e8
        quarters = np.round(rng.uniform(-reach, reach, n) * 0.63) * (np.pi / 2)  # near zeros and poles
        return [np.r_[rng.uniform(-reach, reach, n), quarters, sign * between(rng, dtype, 1e-30, reach, n)]]
    if name in ("sin_turn", "cos_turn"):
        near = np.round(rng.uniform(-20, 20, n)) / 4 + sign * between(rng, dtype, 1e-30, 0.1, n)
        return [np.r_[rng.uniform(0, 1, n), near, rng.uniform(-1e3, 1e3, n), sign * between(rng, dtype, 1e-30, 1, n)]]
    if name == "arccos":
        near = 1 - between(rng, dtype, info.eps, 0.5, n)
        return [np.r_[rng.uniform(-1, 1, n), sign * near, sign * between(rng, dtype, 1e-30, 1, n)]]
    if name == "arctan2":
        x = between(rng, dtype, 1e-15, 1e15, n)
        ratio = between(rng, dtype, 1e-20, 1e20, n)
        extremes = [sign * between(rng, dtype, info.smallest_subnormal, info.max, n) for _ in range(2)]
        unit = rng.uniform(-1, 1, (2, n))
        return [np.r_[unit[0], sign * x * ratio, extremes[0]], np.r_[unit[1], np.flip(sign) * x, extremes[1]]]
    if name == "erf":
        tiny = sign * between(rng, dtype, info.smallest_subnormal, 7, n)
        return [np.r_[rng.uniform(-6, 6, n), rng.uniform(-1.3, 1.3, n), tiny]]
    if name == "ierfc":
        tiny = between(rng, dtype, info.smallest_subnormal, 30, n)
        return [np.r_[rng.uniform(0, 8, n), rng.uniform(0, 0.5, n), tiny]]
    near = 1 - between(rng, dtype, info.eps, 0.5, n)
    return [np.r_[rng.uniform(-1, 1, n), sign * near, sign * between(rng, dtype, info.tiny, 1 - info.eps, n)]]


def error(name, dtype, value, *at):
    """Of a value, in ulp."""
    value, at = mp.mpf(float(value)), [mp.mpf(float(x)) for x in at]
    if name == "erfinv":  # by one step of Newton's method from the value itself
        slope = 2 / mp.sqrt(mp.pi) * mp.exp(-(value**2))
        excess = mp.erf(value) - at[0] if abs(value) < 1 else (1 - abs(at[0])) - mp.erfc(abs(value))
        true, difference = value, excess / slope
    else:
        true = TRUE[name](*at)
        difference = value - true
    if name == "ierfc":  # in ulp of what 1 + Lambda needs
        true = true + 2 * at[0]
    info = np.finfo(dtype)
    exponent = max(int(mp.frexp(abs(true))[1]) - 1, info.minexp)
    return float(abs(difference) / mp.mpf(2) ** (exponent - info.nmant))


def errors(name, dtype, arrays):
    arrays = [np.asarray(a, dtype) for a in arrays]
    values = evaluate(name, dtype, *arrays)
    with mp.workprec(160 if dtype == "float64" else 90):
        return np.array([error(name, dtype, *row) for row in zip(values, *arrays, strict=True)])


@both
@pytest.mark.parametrize("name", FUNCTIONS)
def test_errors(name, dtype, rng):
    arrays = arguments(name, dtype, rng)
    found = errors(name, dtype, arrays)
    worst = int(np.argmax(found))
    assert found[worst] <= BOUND.get(name, 2), [float(np.asarray(a, dtype)[worst]) for a in arrays]


@both
def test_powers_at_large_exponents(dtype, rng):
    """The exponent of a narrow lobe: an error in the logarithm counts as often as the exponent is large."""
    arrays = [1 - between(rng, dtype, 1e-5, 8e-3, 500), rng.choice([100.0, 1000.0, 10000.0], 500)]
    assert errors("power", dtype, arrays).max() <= 2


SPECIAL = [0.0, 1.0, 0.5, 2.0, 3.0, 1e30, np.inf]
SPECIAL = np.array([s * x for x in SPECIAL for s in (1, -1)] + [np.nan])


@both
@pytest.mark.parametrize("name", FUNCTIONS)
def test_special_values(name, dtype):
    """Infinities, zeros with their signs, NaN and what lies outside the domain, as in NumPy."""
    info = np.finfo(dtype)
    special = np.append(SPECIAL, [info.max, info.tiny, info.smallest_subnormal, -info.smallest_subnormal]).astype(dtype)
    if name in ("sin", "cos", "tan"):
        special = special[(abs(special) < 1e5) | ~np.isfinite(special)]
    if name == "erf":
        arrays, expected = [[0.0, -0.0, np.inf, -np.inf, 30, -30, np.nan]], [0.0, -0.0, 1, -1, 1, -1, np.nan]
    elif name in ("sin_turn", "cos_turn"):
        arrays = [[0.0, 0.25, 0.5, -0.25, -0.75, 1.0, 1e30, np.inf, -np.inf, np.nan]]
        expected = {
            "sin_turn": [0.0, 1.0, 0.0, -1.0, 1.0, 0.0, 0.0, *[np.nan] * 3],
            "cos_turn": [1.0, 0.0, -1.0, 0.0, 0.0, 1.0, 1.0, *[np.nan] * 3],
        }[name]
    elif name == "erfinv":
        arrays = [[0.0, -0.0, 1, -1, 1.5, -np.inf, np.inf, np.nan]]
        expected = [0.0, -0.0, np.inf, -np.inf, *[np.nan] * 4]
    elif name == "ierfc":
        arrays, expected = [[0.0, -0.0, 12.0, 1e30, np.inf, np.nan]], [np.pi**-0.5, np.pi**-0.5, 0.0, 0.0, 0.0, np.nan]
    else:
        arrays = (
            [special]
            if len(ops.ELEMENTARY[name].arguments) == 1
            else np.array(list(itertools.product(special, special))).T
        )
        with np.errstate(all="ignore"):
            expected = NUMPY[name](*(np.asarray(a, dtype) for a in arrays))
    expected = np.asarray(expected, dtype)
    values = evaluate(name, dtype, *arrays)
    if name in ("exp", "power"):  # flushed below the smallest normal number
        expected = np.where(abs(expected) < info.tiny, np.copysign(0, expected), expected)
    np.testing.assert_allclose(values, expected, rtol=6 * info.eps, atol=0)
    known = ~np.isnan(expected)
    np.testing.assert_array_equal(np.signbit(values)[known], np.signbit(expected)[known])


@both
def test_limits_of_the_exponential(dtype):
    """The last finite value, the first infinite one, the first flushed to zero; as powers too."""
    info = np.finfo(dtype)
    ends = np.array([np.log(info.max), np.log(info.tiny)])
    x = np.concatenate([end + np.arange(-3, 4) * np.spacing(end.astype(dtype)) for end in ends.astype(dtype)])
    with mp.workprec(200):
        true = [mp.exp(mp.mpf(float(t))) for t in x]
    above = np.array([t > float(info.max) for t in true])
    below = np.array([t < float(info.tiny) for t in true])
    values = evaluate("exp", dtype, x)
    np.testing.assert_array_equal(np.isinf(values), above)
    np.testing.assert_array_equal(values == 0, below)
    two = np.full(6, 2.0)
    t = np.array([info.maxexp, info.maxexp - 1, info.minexp, info.minexp - 1, 1e9, -1e9])
    np.testing.assert_array_equal(evaluate("power", dtype, two, t), [np.inf, 2.0 ** t[1], info.tiny, 0, np.inf, 0])
    edge = np.array([np.nextafter(info.maxexp, 0, dtype=dtype), np.nextafter(info.maxexp, 2e4, dtype=dtype)])
    np.testing.assert_array_equal(np.isinf(evaluate("power", dtype, two[:2], edge)), [False, True])


@both
@pytest.mark.parametrize("name", ["sin", "cos"])
def test_far_beyond_the_reduction(name, dtype, rng):
    x = between(rng, dtype, 1e8, np.finfo(dtype).max, 2000)
    assert (abs(evaluate(name, dtype, x)) <= 1).all()


@both
@pytest.mark.parametrize("name", FUNCTIONS)
def test_any_width(name, dtype, rng):
    """Vectors of other widths give the same numbers."""
    arrays = arguments(name, dtype, rng, 20)
    values = evaluate(name, dtype, *arrays)
    for width in (2, 4, 32):
        np.testing.assert_array_equal(compiled(name, dtype, width)(*arrays), values)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        *((name, -20.0, 20.0) for name in ("sin", "cos", "sin_turn", "cos_turn")),
        *(("tan", -1.5, 1.5), ("arccos", -1.0, 1.0), ("erf", -4.0, 4.0), ("ierfc", 0.0, 4.0)),
        ("log", 0.7, 1.4),  # farther from 1 it is the language's own
    ],
)
def test_formulas_written_for_other_languages(name, low, high):
    x = np.linspace(low, high, 201, dtype=np.float32)
    true = [float(TRUE[name](mp.mpf(float(v)))) for v in x]
    np.testing.assert_allclose(written.FUNCTIONS[name](x), true, rtol=2e-6, atol=4e-7)


def test_every_function_has_a_cost_and_something_that_computes_it() -> None:
    """But "sqrt", which has code of its own, and the smaller and larger of two."""
    for name, row in ops.ELEMENTARY.items():
        assert row.cost is not None or row.llvm or name in ("minimum", "maximum")
        assert (name in FUNCTIONS) != bool(row.llvm or name in ("sqrt", "minimum", "maximum"))
        assert name in written.FUNCTIONS or {"c", "shading"} <= row.languages.keys()
    assert {*FUNCTIONS, *written.FUNCTIONS} <= ops.ELEMENTARY.keys()
