"""Instructions on vectors of numbers and their addresses, as LLVM IR: parts of kernels and elementary functions."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from typing import NamedTuple

FLOAT32, FLOAT64 = "float32", "float64"


class IRValue(NamedTuple):
    """A value in LLVM IR: its type ("real", "index", "bits", "mask") and its name or constant."""

    kind: str
    name: str


class Lanes:
    """Writes instructions for `width` lanes of `dtype`, one line each, to `lines`.

    Kinds of values: "real" (float or double), "index" (i32), "bits" (an integer as wide as a real, for bit patterns and
    exponents) and "mask" (one bit). Products and sums may be contracted to fused multiply-adds; nothing else is
    rearranged, so NaN, infinities and signs of zero keep their meaning. `exact` forbids contraction too. `estimates`:
    whether the processor estimates reciprocal roots as AVX-512 does, to 14 bits. `register`: how many lanes it holds at
    most in one vector. `size`: bytes of a real.
    """

    def __init__(self, dtype: str, width: int, estimates: bool = False, register: int = 0):
        self.dtype, self.width, self.estimates = dtype, width, estimates
        real, bits, self.size = {FLOAT32: ("float", "i32", 4), FLOAT64: ("double", "i64", 8)}[dtype]
        self.scalar = {"real": real, "index": "i32", "bits": bits, "mask": "i1"}
        self.suffix = f"v{width}f{32 if dtype == FLOAT32 else 64}"
        self.types = {kind: f"<{width} x {scalar}>" for kind, scalar in self.scalar.items()}
        self.register = min(register or width, width)
        self.lines: list[str] = []
        self.declared: set[str] = set()
        self.exact = False
        self._count = 0

    def name(self) -> str:
        """A new name."""
        self._count += 1
        return f"%v{self._count}"

    def emit(self, kind: str, text: str) -> IRValue:
        """One instruction with a result of this kind."""
        name = self.name()
        self.lines.append(f"{name} = {text}")
        return IRValue(kind, name)

    def write(self, *lines: str) -> None:
        """Instructions that name their results."""
        self.lines += lines

    def intrinsic(self, name: str, result: str, *arguments: tuple[str, str]) -> str:
        """The call of an intrinsic function of LLVM, by the type of its result, and types and values of arguments."""
        self.declared.add(f"declare {result} @llvm.{name}({', '.join(type_name for type_name, _ in arguments)})")
        return f"call {result} @llvm.{name}({', '.join(f'{type_name} {value}' for type_name, value in arguments)})"

    def spread(self, name: str, scalar: str, value: str) -> str:
        """A value of a scalar type in all lanes, under a name."""
        lanes = f"<{self.width} x {scalar}>"
        self.write(f"{name}.some = insertelement {lanes} poison, {scalar} {value}, i64 0")
        self.write(f"{name} = shufflevector {lanes} {name}.some, {lanes} poison, <{self.width} x i32> zeroinitializer")
        return name

    def shuffle(self, a: IRValue, b: IRValue, width: int, picks: Iterable[int | str]) -> IRValue:
        """Lanes of two reals of `width` lanes, numbered one behind the other; "poison" for any."""
        vector, listed = f"<{width} x {self.scalar['real']}>", [f"i32 {i}" for i in picks]
        shape = f"<{len(listed)} x i32> <{', '.join(listed)}>"
        return self.emit("real", f"shufflevector {vector} {a.name}, {vector} {b.name}, {shape}")

    def joined(self, parts: Sequence[IRValue], width: int) -> IRValue:
        """Reals of `width` lanes, one behind the other."""
        while len(parts) > 1:
            pairs = zip(parts[::2], parts[1::2], strict=True)
            width, parts = 2 * width, [self.shuffle(a, b, width, range(2 * width)) for a, b in pairs]
        return parts[0]

    def blended(self, parts: Sequence[IRValue], which: Sequence[int]) -> IRValue:
        """Every lane from the part of this number."""
        w, blended = len(which), parts[0]
        for i in range(1, len(parts)):
            blended = self.shuffle(blended, parts[i], w, [w + lane if which[lane] == i else lane for lane in range(w)])
        return blended

    def merged(self, parts: Sequence[IRValue], places: Sequence[tuple[int, int]]) -> IRValue:
        """The vector whose lanes are at these places (part, lane), by one shuffle for every part but the first."""
        merged = parts[0]
        for i in range(1, len(parts)):
            picks: list[int | str] = []
            for lane, (part, at) in enumerate(places):
                if part < i:  # in its place since the first shuffle
                    picks.append(at if i == 1 else lane)
                else:
                    picks.append(self.width + at if part == i else "poison")
            merged = self.shuffle(merged, parts[i], self.width, picks)
        return merged

    # Addresses.

    def moved(self, name: str, base: str, steps: str, stride: str) -> str:
        """An address so many strides after another, under a name."""
        self.write(f"{name}.step = mul i64 {steps}, {stride}")
        self.write(f"{name} = getelementptr i8, ptr {base}, i64 {name}.step")
        return name

    def beyond(self, base: str, count: int) -> str:
        """The address so many bytes beyond another."""
        name = self.name()
        self.write(f"{name} = getelementptr i8, ptr {base}, i64 {count}")
        return name

    # Constants.

    def real(self, x: float) -> IRValue:
        """The number x in every lane, rounded to the dtype."""
        return IRValue("real", f"splat ({self.scalar['real']} {self.literal(x)})")

    def literal(self, x: float) -> str:
        """x as LLVM writes it: the bit pattern of a double, also for floats."""
        if self.dtype == FLOAT32:
            try:
                x = struct.unpack("<f", struct.pack("<f", x))[0]
            except OverflowError:
                x = float("inf") if x > 0 else float("-inf")
        return "0x" + struct.pack(">d", x).hex().upper()

    def index(self, n: int) -> IRValue:
        return IRValue("index", f"splat (i32 {n})")

    def pattern(self, n: int) -> IRValue:
        """The integer n as "bits"."""
        return IRValue("bits", f"splat ({self.scalar['bits']} {n})")

    def mask(self, truth: bool) -> IRValue:
        return IRValue("mask", f"splat (i1 {'true' if truth else 'false'})")

    # Arithmetic of reals.

    def _real(self, op: str, a: IRValue, b: IRValue) -> IRValue:
        flags = "" if self.exact or op == "fdiv" else "contract "
        return self.emit("real", f"{op} {flags}{self.types['real']} {a.name}, {b.name}")

    def add(self, a: IRValue, b: IRValue) -> IRValue:
        return self._real("fadd", a, b)

    def sub(self, a: IRValue, b: IRValue) -> IRValue:
        return self._real("fsub", a, b)

    def mul(self, a: IRValue, b: IRValue) -> IRValue:
        return self._real("fmul", a, b)

    def div(self, a: IRValue, b: IRValue) -> IRValue:
        return self._real("fdiv", a, b)

    def neg(self, a: IRValue) -> IRValue:
        return self.emit("real", f"fneg {self.types['real']} {a.name}")

    def call(self, function: str, *args: IRValue) -> IRValue:
        """An LLVM intrinsic from reals to a real: "sqrt", "floor", "fma" ..."""
        real = self.types["real"]
        return self.emit("real", self.intrinsic(f"{function}.{self.suffix}", real, *((real, a.name) for a in args)))

    def fma(self, a: IRValue, b: IRValue, c: IRValue) -> IRValue:
        """a b + c, rounded once."""
        return self.call("fma", a, b, c)

    def sqrt(self, a: IRValue, estimate: bool = False) -> IRValue:
        """The square root; within 1 ulp by an estimate, else rounded correctly."""
        if not (estimate and self.estimates) or self.exact:
            return self.call("sqrt", a)
        y = self._estimate(a)
        if self.dtype == FLOAT64:
            y = self._better_rsqrt(a, y)
        s = self.mul(a, y)
        s = self.fma(self.fma(self.neg(s), s, a), self.mul(y, self.real(0.5)), s)
        return self.select(self._zero_or_infinite(a), a, s)

    def rsqrt(self, a: IRValue, estimate: bool = False) -> IRValue:
        """1 / sqrt(a), within 2 ulp."""
        if not (estimate and self.estimates) or self.exact:
            return self.div(self.real(1.0), self.sqrt(a))
        rough = y = self._estimate(a)
        for _ in range(2 if self.dtype == FLOAT64 else 1):
            y = self._better_rsqrt(a, y)
        return self.select(self.is_nan(y), rough, y)

    def _better_rsqrt(self, a: IRValue, y: IRValue) -> IRValue:
        error = self.fma(self.neg(self.mul(a, y)), y, self.real(1.0))
        return self.fma(self.mul(y, self.real(0.5)), error, y)

    def _estimate(self, a: IRValue) -> IRValue:
        """1 / sqrt(a) to 14 bits, as many lanes at a time as the processor has."""
        once = 16 if self.dtype == FLOAT32 else 8
        if self.width % once:
            return self.div(self.real(1.0), self.call("sqrt", a))
        suffix, mask = ("ps", "i16") if self.dtype == FLOAT32 else ("pd", "i8")
        name, vector = f"x86.avx512.rsqrt14.{suffix}.512", f"<{once} x {self.scalar['real']}>"
        parts = []
        for start in range(0, self.width, once):
            part = self.shuffle(a, a, self.width, range(start, start + once))
            call = self.intrinsic(name, vector, (vector, part.name), (vector, "zeroinitializer"), (mask, "-1"))
            parts.append(self.emit("real", call))
        return self.joined(parts, once)

    def _zero_or_infinite(self, a: IRValue) -> IRValue:
        positive_infinity, zeros = 0x200, 0x60
        arguments = (self.types["real"], a.name), ("i32", str(positive_infinity | zeros))
        return self.emit("mask", self.intrinsic(f"is.fpclass.{self.suffix}", self.types["mask"], *arguments))

    def absolute(self, a: IRValue) -> IRValue:
        return self.call("fabs", a)

    def floor(self, a: IRValue) -> IRValue:
        return self.call("floor", a)

    def copysign(self, magnitude: IRValue, sign: IRValue) -> IRValue:
        return self.call("copysign", magnitude, sign)

    # Comparisons: false where a side is NaN, but "ne", which is true.

    def compare(self, how: str, a: IRValue, b: IRValue) -> IRValue:
        """`how`: "lt", "le", "gt", "ge", "eq" or "ne"."""
        if a.kind == "real":
            return self.emit("mask", f"fcmp {'u' if how == 'ne' else 'o'}{how} {self.types['real']} {a.name}, {b.name}")
        sign = "" if how in ("eq", "ne") else "s"
        return self.emit("mask", f"icmp {sign}{how} {self.types[a.kind]} {a.name}, {b.name}")

    def is_nan(self, a: IRValue) -> IRValue:
        return self.emit("mask", f"fcmp uno {self.types['real']} {a.name}, {a.name}")

    def select(self, condition: IRValue, a: IRValue, b: IRValue) -> IRValue:
        """a where the condition holds, else b."""
        vector = self.types[a.kind]
        return self.emit(a.kind, f"select {self.types['mask']} {condition.name}, {vector} {a.name}, {vector} {b.name}")

    # Integers.

    def integer(self, op: str, a: IRValue, b: IRValue) -> IRValue:
        """`op` of LLVM on two values of one kind: add, sub, mul, and, or, xor, shl, lshr, ashr."""
        return self.emit(a.kind, f"{op} {self.types[a.kind]} {a.name}, {b.name}")

    # Conversions.

    def bits(self, a: IRValue) -> IRValue:
        """The bit pattern of a real."""
        return self.emit("bits", f"bitcast {self.types['real']} {a.name} to {self.types['bits']}")

    def from_bits(self, a: IRValue) -> IRValue:
        """The real with this bit pattern."""
        return self.emit("real", f"bitcast {self.types['bits']} {a.name} to {self.types['real']}")

    def truncated(self, a: IRValue, kind: str) -> IRValue:
        """A real as "index" or "bits", towards zero; undefined beyond the range of that kind."""
        return self.emit(kind, f"fptosi {self.types['real']} {a.name} to {self.types[kind]}")

    def as_real(self, a: IRValue) -> IRValue:
        """An integer as a real."""
        return self.emit("real", f"sitofp {self.types[a.kind]} {a.name} to {self.types['real']}")
