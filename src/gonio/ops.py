"""Elementary functions for any array library: the only module (with ``bridges``) that knows which libraries exist.

A formula calls ``ops.sqrt(x)``; the table ``LIBRARIES`` says which library `x` belongs to and what that library
calls the function. Adding a library is one entry there. Python numbers count as NumPy's.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import numpy as np

from .errors import ArrayTypeError, ShapeError

Array = Any  # an array of any library, or a number


class Library:
    """An array library in the manner of NumPy: what its functions are called, and how vectors become components."""

    # Libraries whose arrays hold one component each (Dr.Jit) evaluate a formula once per channel instead of
    # broadcasting over a channel axis.
    channel_loop = False

    def __init__(self, namespace: str, **names: str):
        self.namespace = namespace
        self._names = names
        self._functions: dict[str, Callable] = {}

    @property
    def name(self) -> str:
        return self.namespace.partition(".")[0]

    @property
    def module(self) -> ModuleType:
        if self.namespace not in sys.modules:
            __import__(self.namespace)
        return sys.modules[self.namespace]

    def function(self, name: str) -> Callable:
        """What this library has for the ops function `name`."""
        found = self._functions.get(name)
        if found is None:
            found = getattr(self, "op_" + name, None)
            if found is None:
                found = getattr(self.module, self._names.get(name, name))
            self._functions[name] = found
        return found

    def dtype(self, x: Array) -> str:
        return str(x.dtype).rpartition(".")[2]

    def shape(self, x: Array) -> tuple[int, ...]:
        """Shape with the vector (or channel) axis last."""
        return tuple(x.shape)

    def convert(
        self, value: Array, like: Array, channel: int | None = None, shape: tuple[int, ...] | None = None
    ) -> Array:
        """A parameter with the dtype and device of `like`; where `channel_loop`, one channel of it over the batch."""
        return self.module.asarray(value, dtype=like.dtype)

    def to_numpy(self, x: Array) -> np.ndarray:
        """The values of an array, without their derivatives."""
        return np.asarray(x)

    def table(self, value: np.ndarray, like: Array, cache: dict) -> Array:
        """A lookup table, ready for `take`; `cache`, shared by all libraries, keeps what was converted."""
        key = (self.name, like.dtype)
        if key not in cache:
            cache[key] = self.convert(value, like)
        return cache[key]

    def mean_channels(self, value: Array) -> Array:
        """A parameter, as it was given, averaged over its channels: what sampling uses."""
        return value.mean(-1, keepdims=True) if getattr(value, "ndim", 0) else value

    def split(self, w: Array, shape: tuple[int, ...], channels: bool) -> tuple[Array, ...]:
        """Components of `w`; with `channels` each keeps a last axis of length 1. `shape`: the whole batch's."""
        if channels:
            return tuple(w[..., i : i + 1] for i in range(w.shape[-1]))
        return tuple(w[..., i] for i in range(w.shape[-1]))

    def assemble(
        self, kinds: Sequence[str], runs: list, like: Array, shape: tuple[int, ...], channels: bool
    ) -> list[Array]:
        """Undo `split` for what a kernel returned, once per run (a channel, where `channel_loop`).

        A result is a "value" (has the channel axis), a "scalar" (has not) or a "vector" (three components).
        """
        out = []
        for kind, result in zip(kinds, runs[0], strict=True):
            if kind == "vector":
                stacked = self.stack(result)
                out.append(stacked[..., 0, :] if channels else stacked)
            else:
                out.append(result[..., 0] if channels and kind == "scalar" else result)
        return out

    def broadcast(self, *arrays: Array) -> Sequence[Array]:
        """The arrays, broadcast against each other."""
        return self.module.broadcast_arrays(*arrays)

    def stack(self, components: Sequence[Array]) -> Array:
        """Components along a new last axis."""
        return self.module.stack(self.broadcast(*components), -1)

    def op_take(self, table: Array, index: Array) -> Array:
        return table[index]

    def op_stop_gradient(self, x: Array) -> Array:
        return x


class NumPy(Library):
    def table(self, value: np.ndarray, like: Array, cache: dict) -> Array:
        key = like.dtype
        if key not in cache:
            cache[key] = np.ascontiguousarray(value, dtype=like.dtype)
        return cache[key]

    def op_take(self, table: Array, index: Array) -> Array:
        return np.take(table, index)

    def op_erf(self, x: Array) -> Array:
        from scipy.special import erf

        return erf(x)

    def op_erfinv(self, x: Array) -> Array:
        from scipy.special import erfinv

        return erfinv(x)

    def op_to_index(self, x: Array) -> Array:
        # NaN has no index: it looks up entry 0, and the NaN of the direction is restored by the caller.
        return np.nan_to_num(x, nan=0.0, posinf=0.0, neginf=0.0).astype(np.intp)


class Torch(Library):
    def convert(
        self, value: Array, like: Array, channel: int | None = None, shape: tuple[int, ...] | None = None
    ) -> Array:
        if isinstance(value, np.ndarray) and not value.flags.writeable:
            value = value.copy()
        return self.module.as_tensor(value, dtype=like.dtype, device=like.device)

    def table(self, value: np.ndarray, like: Array, cache: dict) -> Array:
        key = (like.dtype, like.device)
        if key not in cache:
            cache[key] = self.convert(value, like)
        return cache[key]

    def to_numpy(self, x: Array) -> np.ndarray:
        return x.detach().cpu().numpy()

    def broadcast(self, *arrays: Array) -> Sequence[Array]:
        return self.module.broadcast_tensors(*arrays)

    def _pair(self, a: Array, b: Array) -> tuple[Array, Array]:
        like = a if isinstance(a, self.module.Tensor) else b
        return self.convert(a, like), self.convert(b, like)

    def op_maximum(self, a: Array, b: Array) -> Array:
        return self.module.maximum(*self._pair(a, b))

    def op_minimum(self, a: Array, b: Array) -> Array:
        return self.module.minimum(*self._pair(a, b))

    def op_arctan2(self, y: Array, x: Array) -> Array:
        return self.module.arctan2(*self._pair(y, x))

    def op_power(self, x: Array, y: Array) -> Array:
        return self.module.pow(x, y)

    def op_to_index(self, x: Array) -> Array:
        return self.module.nan_to_num(x, 0.0, 0.0, 0.0).long()

    def op_stop_gradient(self, x: Array) -> Array:
        return x.detach()


class Jax(Library):
    def table(self, value: np.ndarray, like: Array, cache: dict) -> Array:
        from jax import ensure_compile_time_eval

        with ensure_compile_time_eval():  # inside jit or grad too what is kept is an array, not a tracer
            return super().table(value, like, cache)

    def op_erf(self, x: Array) -> Array:
        from jax.scipy.special import erf

        return erf(x)

    def op_erfinv(self, x: Array) -> Array:
        from jax.scipy.special import erfinv

        return erfinv(x)

    def op_to_index(self, x: Array) -> Array:
        return self.module.nan_to_num(x, nan=0.0, posinf=0.0, neginf=0.0).astype("int32")

    def op_stop_gradient(self, x: Array) -> Array:
        from jax.lax import stop_gradient

        return stop_gradient(x)


class DrJit(Library):
    """Dr.Jit: `Array3f` and the like, whose components are `Float`, and `TensorXf` of shape (..., 3)."""

    channel_loop = True

    def _float(self, like: Array) -> Any:
        """The type of one component of `like`."""
        return self.module.array_t(like) if self.module.is_tensor_v(like) else self.module.value_t(like)

    def dtype(self, x: Array) -> str:
        return self.module.type_v(x).name.lower()

    def shape(self, x: Array) -> tuple[int, ...]:
        if self.module.is_tensor_v(x):
            return tuple(x.shape)
        if self.module.depth_v(x) == 1 and self.module.is_jit_v(x):
            return ()  # a Float: one value per lane, no channels
        width = self.module.width(x[0]) if self.module.depth_v(x) > 1 else 1
        return (len(x),) if width == 1 else (width, len(x))

    def _lanes(self, values: np.ndarray, like: Array) -> Array:
        kind = self._float(like)
        if kind is float or values.size == 1:
            return kind(float(values.reshape(-1)[0]))
        return kind(np.ascontiguousarray(values, dtype=self.dtype(like)).reshape(-1))

    def convert(
        self, value: Array, like: Array, channel: int | None = None, shape: tuple[int, ...] | None = None
    ) -> Array:
        if isinstance(value, (int, float)):
            return self._float(like)(value)
        if isinstance(value, np.ndarray):
            if value.ndim:
                value = value[..., min(channel or 0, value.shape[-1] - 1)]
            if value.size > 1 and shape is not None:
                value = np.broadcast_to(value, shape)
            return self._lanes(value, like)
        if self.module.is_tensor_v(value):
            n = value.shape[-1]
            count, spread = len(value.array) // n, self._spread(tuple(value.shape[:-1]), shape, like)
            return self._component(value, n, min(channel or 0, n - 1), count, like, spread)
        if self.module.depth_v(value) > 1 or not self.module.is_jit_v(value):
            value = value[min(channel or 0, len(value) - 1)]
        return self._float(like)(value)

    def table(self, value: np.ndarray, like: Array, cache: dict) -> Array:
        kind = self._float(like)
        key = kind
        if key not in cache:
            flat = np.ascontiguousarray(value, dtype=self.dtype(like))
            cache[key] = flat if kind is float else kind(flat)
        return cache[key]

    def mean_channels(self, value: Array) -> Array:
        if isinstance(value, (int, float, np.ndarray)):
            return super().mean_channels(value)
        if self.shape(value) == ():
            return value
        n = self.shape(value)[-1]
        total = self.convert(value, value, 0)
        for c in range(1, n):
            total = total + self.convert(value, value, c)
        total = total / n
        return type(value)(total, (*value.shape[:-1], 1)) if self.module.is_tensor_v(value) else total

    def _component(self, w: Array, n: int, i: int, count: int, like: Array, spread: Array = None) -> Array:
        kind = self._float(like)
        if spread is None:
            spread = self.module.arange(self.module.uint32_array_t(kind), count)
        return kind(self.module.gather(self._float(w), w.array, spread * n + i))

    def split(self, w: Array, shape: tuple[int, ...], channels: bool) -> tuple[Array, ...]:
        if not self.module.is_tensor_v(w):
            return tuple(w[i] for i in range(len(w)))
        n = w.shape[-1]
        count, spread = len(w.array) // n, self._spread(tuple(w.shape[:-1]), shape, w)
        return tuple(self._component(w, n, i, count, w, spread) for i in range(n))

    def _spread(self, batch: tuple[int, ...], shape: tuple[int, ...] | None, like: Array) -> Array:
        """Which lane of a `batch` each lane of `shape` reads; None where they are the same, or only one."""
        count = int(np.prod(batch, dtype=int))
        if shape is None or batch == shape or count == 1:
            return None
        lanes = np.broadcast_to(np.arange(count, dtype=np.uint32).reshape(batch), shape)
        return self.module.uint32_array_t(self._float(like))(np.ascontiguousarray(lanes).reshape(-1))

    def assemble(
        self, kinds: Sequence[str], runs: list, like: Array, shape: tuple[int, ...], channels: bool
    ) -> list[Array]:
        out = []
        for i, kind in enumerate(kinds):
            if kind == "value" and channels:
                out.append(self._gathered([run[i] for run in runs], like, (*shape, len(runs))))
            elif kind == "vector":
                out.append(self._gathered(runs[0][i], like, (*shape, len(runs[0][i]))))
            elif self.module.is_tensor_v(like):
                out.append(self._gathered([runs[0][i]], like, shape))
            else:
                out.append(runs[0][i])
        return out

    def _gathered(self, components: Sequence[Array], like: Array, shape: tuple[int, ...]) -> Array:
        """One array of the kind of `like` from its components."""
        dr, n = self.module, len(components)
        if dr.is_tensor_v(like):
            masks = dr.is_mask_v(components[0])
            tensor = dr.mask_t(like) if masks else type(like)
            count = int(np.prod(shape, dtype=int)) // n
            flat = dr.zeros(dr.array_t(tensor), count * n)
            lanes = dr.arange(dr.uint32_array_t(self._float(like)), count)
            for i, component in enumerate(components):
                dr.scatter(flat, component, lanes * n + i)
            return tensor(flat, shape)
        if n == len(like):
            return type(like)(*components)
        name = "ArrayXf" if self.dtype(like) == "float32" else "ArrayXf64"
        return getattr(sys.modules[type(like).__module__], name)(*components)

    def empty(self, kind: str, like: Array, shape: tuple[int, ...], channels: int | None) -> Array:
        """A result of `assemble` for a batch without elements: Dr.Jit cannot compute with those."""
        width = {"value": (channels,) if channels else (), "scalar": (), "vector": (3,)}[kind]
        if self.module.is_tensor_v(like):
            return self.module.zeros(type(like), (*shape, *width))
        return self.module.zeros(type(like) if width else self._float(like), 0)

    def stack(self, components: Sequence[Array]) -> Array:
        like = next(c for c in components if library_of_type(type(c)) is self)
        if self.module.is_tensor_v(like):
            parts = [c + self.module.zeros(type(like), 1) if not self.module.is_tensor_v(c) else c for c in components]
            shape = tuple(np.broadcast_shapes(*(tuple(c.shape) for c in parts)))
            flat = [(c + self.module.zeros(type(like), shape)).array for c in parts]
            return self._gathered(flat, like, (*shape, len(flat)))
        suffix = "f" if self.dtype(like) == "float32" else "f64"
        return getattr(sys.modules[type(like).__module__], f"Array{len(components)}{suffix}")(*components)

    def op_where(self, condition: Array, a: Array, b: Array) -> Array:
        return self.module.select(condition, a, b)

    def op_erfinv(self, x: Array) -> Array:
        dr = self.module  # whose own is of single precision, which a Newton step amends, and NaN at -1 and 1
        inside = dr.abs(x) < 1.0
        y = dr.erfinv(dr.select(inside, x, 0.0))
        y = y - (dr.erf(y) - x) * dr.exp(y * y) * (0.5 * math.sqrt(math.pi))
        return dr.select(inside, y, x * float("inf"))

    def op_take(self, table: Array, index: Array) -> Array:
        if isinstance(table, np.ndarray):
            return float(table[int(index)])
        return self.module.gather(type(table), table, index)

    def op_to_index(self, x: Array) -> Array:
        x = self.module.select(self.module.isfinite(x), x, 0)
        return self.module.uint32_array_t(type(x))(x)

    def op_stop_gradient(self, x: Array) -> Array:
        return self.module.detach(x)


LIBRARIES: dict[str, Library] = {
    "numpy": NumPy("numpy", absolute="abs"),
    "torch": Torch("torch", absolute="abs"),
    "jax": Jax("jax.numpy", absolute="abs"),
    "cupy": Library("cupy", absolute="abs"),
    "drjit": DrJit(
        "drjit", absolute="abs", arccos="acos", arctan2="atan2"
    ),
}
"""Library name -> how to use it. A module name that is not a key belongs to the library named in `_ALIASES`."""

_ALIASES = {"jaxlib": "jax", "mitsuba": "drjit"}
_BY_TYPE: dict[type, Library | None] = {int: None, float: None, bool: None}


def library_of_type(kind: type) -> Library | None:
    """The library that arrays of this type belong to; None for numbers and for what is no array."""
    if kind not in _BY_TYPE:
        found = None
        for base in kind.__mro__:
            root = base.__module__.partition(".")[0]
            found = found or LIBRARIES.get(_ALIASES.get(root, root))
        _BY_TYPE[kind] = found
    return _BY_TYPE[kind]


def library(*arrays: Array) -> Library:
    """The one library that `arrays` belong to; numbers belong to any. Raises ArrayTypeError if they are mixed."""
    found: Library | None = None
    for x in arrays:
        own = library_of_type(type(x))
        if own is None or own is found:
            continue
        if found is not None:
            raise ArrayTypeError(
                f"arrays of different libraries in one call: {found.name} and {own.name}; "
                f"expected one library; convert one side first"
            )
        found = own
    return found or LIBRARIES["numpy"]


def _call(name: str, *args: Array) -> Array:
    for x in args:
        own = library_of_type(type(x))
        if own is not None:
            return own.function(name)(*args)
    return LIBRARIES["numpy"].function(name)(*args)


def _elementary(name: str, doc: str) -> Callable[..., Array]:
    def function(*args: Array) -> Array:
        return _call(name, *args)

    function.__name__ = function.__qualname__ = name
    function.__doc__ = doc
    return function


sqrt = _elementary("sqrt", "Square root.")
exp = _elementary("exp", "Exponential.")
log = _elementary("log", "Natural logarithm.")
sin = _elementary("sin", "Sine.")
cos = _elementary("cos", "Cosine.")
tan = _elementary("tan", "Tangent.")
arccos = _elementary("arccos", "Inverse cosine, in [0, pi].")
arctan2 = _elementary("arctan2", "arctan2(y, x): the angle of (x, y), in (-pi, pi].")
erf = _elementary("erf", "Error function.")
erfinv = _elementary("erfinv", "Inverse of the error function.")
absolute = _elementary("absolute", "Magnitude.")
floor = _elementary("floor", "Largest integer not above, as a floating-point number.")
power = _elementary("power", "power(x, y): x to the y.")
minimum = _elementary("minimum", "The smaller of two.")
maximum = _elementary("maximum", "The larger of two.")
where = _elementary("where", "where(condition, a, b): a where the condition holds, else b.")
take = _elementary("take", "take(table, index): gather from a flat table.")
to_index = _elementary("to_index", "Whole number for `take`; NaN and infinity become 0.")
stop_gradient = _elementary("stop_gradient", "The value, as a constant for differentiation.")


def clip(x: Array, low: Array, high: Array) -> Array:
    """x limited to [low, high]."""
    return minimum(maximum(x, low), high)


def square(x: Array) -> Array:
    """x times itself."""
    return x * x


def as_arrays(*arrays: Array, name: str = "directions") -> tuple[Library, list[Array]]:
    """The arrays of one call with their library: lists join the others, dtypes must agree and be floating point."""
    like = next((x for x in arrays if library_of_type(type(x)) is not None), np.zeros(0))
    try:
        lists = [np.asarray(x, dtype=float) if isinstance(x, (list, tuple)) else None for x in arrays]
        own = library(like)
        arrays = tuple(x if a is None else own.convert(a, like) for x, a in zip(arrays, lists, strict=True))
    except (TypeError, ValueError):
        raise ArrayTypeError(f"{name}: got a list that is no array of numbers; expected rows of equal length") from None
    lib = library(*arrays)
    out = []
    for x in arrays:
        if library_of_type(type(x)) is None:
            raise ArrayTypeError(f"{name}: got {type(x).__name__}, expected an array of float32 or float64")
        if isinstance(lib, NumPy) and lib.dtype(x).startswith(("int", "uint")):
            x = np.asarray(x, dtype=float)
        out.append(x)
    dtypes = sorted({lib.dtype(x) for x in out})
    if len(dtypes) > 1 or dtypes[0] not in ("float32", "float64"):
        raise ArrayTypeError(
            f"{name}: got dtype {' and '.join(dtypes)}, expected one of float32, float64 for all; convert first"
        )
    return lib, out


def to_numpy(x: Array) -> np.ndarray:
    """The values of an array of any library, without their derivatives."""
    return library(x).to_numpy(x)


def broadcast_shape(shapes: Sequence[tuple[int, ...]], what: str) -> tuple[int, ...]:
    """The shape that all broadcast to, or a ShapeError that names them."""
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        listed = ", ".join(str(s) for s in shapes)
        raise ShapeError(f"{what}: shapes {listed} do not broadcast against each other") from None
