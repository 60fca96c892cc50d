"""Calls of the public API with arguments of the wrong kind, found by introspection: the fuzz of misuse.

A target is a public function, a constructor, or a method or property of what these make. A call gives it usable
arguments, but for some that are of any kind. Only `gonio.Error`, and Python's own words about the number and the names
of arguments, may come out; and warnings of gonio's own classes.

All is drawn by names, never by places in a list: what else is public changes no call.
"""

from __future__ import annotations

import inspect
import io
import math
import re
import signal
import traceback
import types
import warnings
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from datetime import date
from fractions import Fraction
from functools import cache, cached_property
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import face
import numpy as np
import xarray

import gonio as gn
from gonio.base.light import Light
from gonio.formula.state import derived

LONGEST = 60
"""Seconds that a call may take."""

LEFT_OUT = dict.fromkeys(("points", "contains", "mirrored", "redrawn"), "called by integrals and Monte Carlo")
LEFT_OUT["unit"] = "of a vector of a light, which is not 0: lights see to that"
LEFT_OUT["ray"] = "written by cameras and called by kernels, on components"
LEFT_OUT["turned"] = "written by models and called by kernels, with numbers of any library"
"""Names that are not called, and the reason."""

FORMULAS = (
    "gonio.models.",
    "gonio.distributions.",
    "gonio.formula.fresnel",
    "gonio.formula.distribution",
    "gonio.formats.",
)
"""Modules whose methods are formulas, or parts of them: components in, numbers out, called by kernels."""

LIGHTS = (
    *("seen", "warp", "density", "drawn", "beam", "irradiance_on", "holds", "strength"),
    *("arrival", "incident", "sample", "pdf"),
)
"""What lights write, for integrals."""


INTEGRALS = {
    *(f"remote_sensing.{name}_sky_albedo" for name in ("black", "blue", "white")),
    *("albedo", "reflectance", "reflectance_factor"),
    *("reflected_radiance", "check", "with_uncertainty", "convert", "tables.tabulate", "render"),
    *("scenes.write_turntable", "write_report"),
    *(f"figures.{name}" for name in ("albedo", "fate", "laws", "overview", "portrait", "polar", "slices", "gallery")),
    *("figures.half_difference", "figures.difference", "figures.fit"),
}
"""Functions that take longer."""


class Target(NamedTuple):
    """Something public that can be called: `owner` is the class of which it is a method or a property."""

    name: str
    call: Callable[..., Any] | None
    owner: type | None
    parameters: tuple[inspect.Parameter, ...]


class Made(NamedTuple):
    """An argument: the text in reports, and the function that makes it."""

    text: str
    make: Callable[[], Any]


class Hang(BaseException):
    """A call took longer than `LONGEST`."""


def _of(**values: Any) -> dict[str, Any]:
    return values


@cache
def _made(places: tuple[str, ...]) -> dict[str, Any]:
    made, classes = {}, face.classes()
    for place in places:
        if place in classes and not issubclass(classes[place], Exception):
            with suppress(Exception):  # those that need arguments
                made[place] = classes[place]()
    return made


def public() -> dict[str, Any]:
    """An instance of every public class that can be made without arguments."""
    return _made(tuple(face.public()))


@cache
def held() -> dict[str, Any]:
    """What functions return, and materials of all kinds."""
    lambertian = gn.Lambertian([0.2, 0.5, 0.8])
    theta = np.radians([0.0, 30.0, 60.0])
    grid = gn.Gridded(
        "angles",
        {"theta_i": theta, "theta_o": theta, "phi": np.radians([0.0, 90.0, 180.0])},
        np.full((3, 3, 3), 0.2),
        uncertainty=np.full((3, 3, 3), 0.01),
    )
    return {
        "GGX(0.2)": gn.GGX(0.2),
        "rgb": lambertian,
        "map": gn.Lambertian(np.full((4, 1), 0.5)),
        "sum": 0.3 * lambertian + gn.Microfacet(gn.GGX(0.3), 0.9),
        "scaled": 0.5 * gn.Lambertian(0.5),
        "gold": gn.material("gold"),
        "grid": grid,
        "rows": gn.Scattered(0.1, 0.0, np.linspace(0.0, 1.2, 30), np.linspace(0.0, 3.0, 30), np.full(30, 0.3)),
        "image": gn.scenes.Image(np.full((4, 8, 3), 0.5, np.float32)),
        "cone": gn.Cone([0.0, 0.0, 1.0], 0.2),
        "sun": gn.DistantLight([0.0, 0.3, 1.0], [3.0, 2.0, 1.0]),
        "dataset": gn.tables.to_dataset(grid),
        "quoted": gn.with_uncertainty(gn.albedo, grid, [0.0, 0.0, 1.0], correlation="independent"),
        "report": gn.check(gn.Lambertian(0.5), laws=["positivity"]),
        "jacobian": gn.Lambertian(0.5).jacobian(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0])),
    }


def objects() -> dict[str, Any]:
    return public() | held()


def _is_formula(kind: type, name: str, attribute: Any) -> bool:
    """Whether a method is written by models and lights, and called by kernels and integrals."""
    if issubclass(kind, Light):
        return name in LIGHTS
    names = getattr(attribute, "__annotations__", {}).values()
    return inspect.isfunction(attribute) and (kind.__module__.startswith(FORMULAS) or "Direction" in names)


def _target(name: str, call: Any, owner: type | None = None) -> Target | None:
    if isinstance(call, type) and issubclass(call, (Exception, type)):
        return None
    try:
        parameters = tuple(inspect.signature(call).parameters.values())
    except (TypeError, ValueError):
        return None
    return Target(name, call, owner, parameters[1:] if owner is not None else parameters)


def _is_made_by_functions(place: str, thing: Any) -> bool:
    """Whether this is a class of results that takes whatever it is given: functions alone make these."""
    if not isinstance(thing, type):
        return False
    return issubclass(thing, tuple) or (place.startswith("results.") and not hasattr(thing, "__post_init__"))


def targets() -> tuple[Target, ...]:
    """Everything public, by introspection."""
    return _targets(tuple(face.public()))


@cache
def _targets(places: tuple[str, ...]) -> tuple[Target, ...]:
    found: dict[str, Target | None] = {}
    public = face.public()
    for place in places:
        thing = public[place]
        if isinstance(thing, types.ModuleType):
            found[place] = Target(place, thing.__call__, None, ())
        elif callable(thing) and not _is_made_by_functions(place, thing):
            found[place] = _target(place, thing)
    for thing in list(objects().values()):
        if not type(thing).__module__.startswith("gonio"):
            continue
        for kind in type(thing).__mro__:
            if not kind.__module__.startswith("gonio"):
                continue
            for name, attribute in vars(kind).items():
                operator = name in OPERATORS
                if name in LEFT_OUT or (name.startswith("_") and not operator):
                    continue
                if _is_formula(kind, name, attribute):
                    continue
                full = f"{kind.__name__}.{name}"
                if full in found:
                    continue
                if inspect.isfunction(attribute):
                    found[full] = _target(full, attribute, kind)
                elif isinstance(attribute, (property, cached_property, derived)):
                    found[full] = Target(full, None, kind, ())
    return tuple(t for t in found.values() if t is not None)


OPERATORS = ("__add__", "__radd__", "__mul__", "__rmul__", "__truediv__", "__eq__", "__repr__", "__call__")


def _generator() -> Iterator[int]:
    yield 1
    yield 2


def _recursive() -> list[Any]:
    inner: list[Any] = []
    inner.append(inner)
    return inner


class _Hostile:
    """An object of which nothing can be had."""

    def __array__(self, *args: Any, **kwargs: Any) -> Any:
        raise RuntimeError("no array")

    def __repr__(self) -> str:
        raise RuntimeError("no repr")


def _torch(numbers: Any, **options: Any) -> Any:
    """A tensor, or an array where PyTorch is missing."""
    try:
        import torch
    except ImportError:
        return np.array(numbers)
    return torch.tensor(numbers, dtype=torch.float64, **options)


def _jax(numbers: Any) -> Any:
    """An array of JAX, or of NumPy where that is missing."""
    try:
        import jax.numpy as jnp
    except ImportError:
        return np.array(numbers)
    return jnp.asarray(numbers)


@cache
def wrong() -> tuple[Made, ...]:
    """Arguments of any kind."""
    fixed = (
        *(
            None,
            True,
            False,
            0,
            1,
            -1,
            2,
            7,
            10**4,
            10**12,
            -(10**30),
            0.0,
            0.5,
            1.5,
            -0.5,
            1e-300,
            1e300,
            45.0,
        ),
        *(math.nan, math.inf, -math.inf, 1j, Fraction(1, 3), "", "x", "gold", "0.5", "GGX(0.2)", "a" * 3000, "\0", "é"),
        *(b"", b"abc", bytearray(b"x"), [], (), {}, set(), frozenset({1}), [[]], [1], [1, 2], [0.0, 0.0, 1.0]),
        *([1, "a"], ["a", "b"], [None], [[1, 2], [3]], [1j], (1, 2, 3), [0.5] * 100, {"a": 1}, {1: 2}, {"alpha": "x"}),
        *(object, int, gn.Lambertian, gn.GGX, gn.DistantLight, gn, math, len, ..., NotImplemented, range(3), slice(1)),
        *(date(2020, 1, 1), Path("nowhere.exr"), Path(), ValueError("x"), (), [()], [{}], [[[]]]),
    )
    made = [Made(f"{x!r:.40}", lambda x=x: x) for x in fixed]
    arrays = {
        "10**5000": 10**5000,  # Python refuses to write it
        "np.array(0.5)": np.array(0.5),
        "np.float32(0.5)": np.float32(0.5),
        "np.int8(3)": np.int8(3),
        "np.bool_(True)": np.bool_(True),
        "zeros(0)": np.zeros(0),
        "zeros(2)": np.zeros(2),
        "zeros(3)": np.zeros(3),
        "up": np.array([0.0, 0.0, 1.0]),
        "down": np.array([0.0, 0.0, -1.0]),
        "up float32": np.array([0.0, 0.0, 1.0], np.float32),
        "up float16": np.array([0.0, 0.0, 1.0], np.float16),
        "up longdouble": np.array([0.0, 0.0, 1.0], np.longdouble),
        "up int": np.array([0, 0, 1]),
        "up big endian": np.array([0.0, 0.0, 1.0], ">f8"),
        "(5, 3)": np.tile([0.0, 0.6, 0.8], (5, 1)),
        "(3, 5)": np.tile([0.0, 0.6, 0.8], (5, 1)).T,
        "(0, 3)": np.zeros((0, 3)),
        "(5, 0)": np.zeros((5, 0)),
        "(2, 1, 3)": np.tile([0.0, 0.6, 0.8], (2, 1, 1)),
        "(4, 2)": np.full((4, 2), 0.5),
        "31 channels": np.full(31, 0.5),
        "NaN direction": np.array([math.nan, 0.0, 1.0]),
        "inf direction": np.array([math.inf, 0.0, 1.0]),
        "complex": np.array([1j, 0.0, 1.0]),
        "bools": np.array([True, False, True]),
        "objects": np.array([None, 1, "a"], dtype=object),
        "numbers as objects": np.array([0, 0, 1], dtype=object),
        "words": np.array(["a", "b", "c"]),
        "bytes": np.array([b"a", b"b", b"c"]),
        "dates": np.array(["2020-01-01"] * 3, "datetime64[D]"),
        "durations": np.array([1, 2, 3], "timedelta64[s]"),
        "records": np.zeros(3, [("a", float), ("b", int)]),
        "masked": np.ma.masked_array([0.0, 0.5, 1.0], [False, True, False]),
        "all masked": np.ma.masked_array([0.0, 0.5, 1.0], True),
        "np.ma.masked": np.ma.masked,
        "matrix": np.array([[0.0, 0.0, 1.0]]).view(np.matrix),
        "read-only": np.broadcast_to(0.5, (3,)),
        "degrees": np.array([0.0, 30.0, 60.0]),
        "huge shape": np.broadcast_to(0.5, (10**6, 10**6, 3)),
    }
    made += [Made(text, lambda x=x: x) for text, x in arrays.items()]
    made += [
        Made("generator", _generator),
        Made("a list in itself", _recursive),
        Made("lambda", lambda: lambda *args, **named: 1.0),
        Made("lambda without arguments", lambda: lambda: 1.0),
        Made("hostile object", _Hostile),
        Made("object()", object),
        Made("BytesIO", lambda: io.BytesIO(b"x")),
        Made("Generator", lambda: np.random.default_rng(1)),
        Made("DataArray", lambda: xarray.DataArray([0.0, 0.0, 1.0], dims="x")),
        Made("Dataset", lambda: xarray.Dataset({"f": ("x", [1.0])})),
        Made("[m, m]", lambda: [objects()["rgb"]] * 2),
        Made("[light, 1]", lambda: [objects()["sun"], 1]),
    ]
    made += [
        Made("tensor", lambda: _torch([0.0, 0.0, 1.0])),
        Made("tensor with grad", lambda: _torch([0.0, 0.0, 1.0], requires_grad=True)),
        Made("tensor ()", lambda: _torch(0.5)),
        Made("tensor (2, 2)", lambda: _torch([[0.5, 0.5], [0.5, 0.5]])),
        Made("jax array", lambda: _jax([0.0, 0.0, 1.0])),
    ]
    made += [Made(f"<{name}>", lambda x=x: x) for name, x in held().items()]
    return tuple(made)


def usable(parameter: inspect.Parameter, random: Random, folder: Path) -> Any:
    """An argument of the right kind, by the parameter's annotation, default and name."""
    name, note = parameter.name, str(parameter.annotation)
    choices = _by_name(folder).get(name)
    if choices is not None:
        return random.choice(choices)
    if parameter.default is not inspect.Parameter.empty:
        return parameter.default
    for kind, names in (("Gridded", ("grid", "rows")), ("Reflectance", MATERIALS), ("Light", ("sun", "ConstantLight"))):
        if kind in note:
            return objects()[random.choice(names)]
    return 0.5


MATERIALS = ("Lambertian", "rgb", "sum", "scaled", "gold", "grid", "IdealSpecular", "map", "rows")


@cache
def _by_name(folder: Path) -> dict[str, list[Any]]:
    known = objects()
    up, tilted = np.array([0.0, 0.0, 1.0]), np.array([[0.6, 0.0, 0.8], [0.0, -0.6, 0.8]])
    materials = [known[name] for name in MATERIALS]
    lights = [known["sun"], known["ConstantLight"], [known["sun"], known["ConstantLight"]]]
    return _of(
        m=materials,
        wi=[up, tilted],
        wo=[up, tilted],
        w=[up, tilted],
        u=[np.array([0.3, 0.4])],
        out=[None],
        theta=[0.5, np.array([0.1, 0.5])],
        phi=[0.3],
        lights=lights,
        light=lights[:1],
        size=[4],
        samples=[4],
        tolerance=[1e-2],
        draws=[3],
        rings=[1],
        iterations=[2],
        resolution=[None, (4, 4, 4)],
        laws=[["positivity"], ["reciprocity"]],
        path=[folder / "made.csv", folder / "made.json", folder / "made.png", folder / "absent"],
        axes=[{"theta_i": [0.0, 0.5], "theta_o": [0.0, 0.5], "phi": [0.0, 3.0]}],
        values=[np.full((2, 2, 2), 0.3)],
        scans=[[known["grid"], known["grid"]]],
        ds=[known["dataset"]],
        name=["gold", "rgb"],
        substance=["gold"],
        wavelengths=[550.0, [450.0, 550.0]],
        text=["Lambertian(0.5)"],
        count=[None, 2],
        function=[gn.albedo],
        args=[known["grid"]],
        correlation=["independent"],
        kind=["reciprocity", "isotropy", "plane"],
        pixels=[np.full((2, 3, 3), 0.5, np.float32)],
        axis=[up],
        L=[lambda w: w[..., 2]],
        signature=[known["rgb"]],
        progress=[None, lambda done, total: None],
        method=["neighbours", "smooth", "f"],
    )


class Call(NamedTuple):
    """A target with arguments, as texts and values."""

    target: Target
    owner: Any
    positional: list[Any]
    named: dict[str, Any]
    text: str


def seeded(*names: object) -> Random:
    """Random numbers that are the same for the same names."""
    return Random(zlib.crc32(" ".join(map(str, names)).encode()))


def calls_of(target: Target, count: int, share: float, folder: Path) -> Iterator[Call]:
    """So many calls of a target, and calls of it with a share of all that is public: of that, or with it."""
    for number in range(count):
        yield call_of(target, seeded(target.name, number), folder)
    for name in public():
        random = seeded(target.name, name)
        if random.random() < share and (target.parameters or isinstance(public()[name], target.owner or ())):
            yield call_of(target, random, folder, name)


def _owners(target: Target) -> list[str]:
    """What a target may be called of, unless a public object is named."""
    chosen = [name for name, x in held().items() if isinstance(x, target.owner)]
    return chosen or [min(name for name, x in public().items() if isinstance(x, target.owner))]


def call_of(target: Target, random: Random, folder: Path, given: str = "") -> Call:
    """A call of a target: usable arguments, of which one or two, or all, are replaced by any. `given` is the name of a
    public object that is called, if it has the target, or else replaces an argument."""
    of_given = bool(given) and target.owner is not None and isinstance(public()[given], target.owner)
    positional, named, texts = [], {}, []
    parameters = [p for p in target.parameters if p.kind is not p.VAR_KEYWORD]
    replaced = set(random.sample(range(len(parameters)), min(len(parameters), random.choice((1, 1, 1, 2, 3)))))
    by_name = False
    for i, p in enumerate(parameters):
        if i not in replaced and p.default is not p.empty and p.name not in _by_name(folder) and random.random() < 0.7:
            by_name = True
            continue
        if i in replaced:
            text, make = random.choice(wrong())
            value = make()
            if given and not of_given and i == min(replaced):
                text, value = f"<{given}>", public()[given]
            if p.name == "size" and type(value) is int and value == 10**4:  # a picture that can be had, in minutes
                value, text = 4, "4"
        else:
            value = usable(p, random, folder)
            text = f"{shown(value):.40}"
        if p.kind is p.KEYWORD_ONLY or (by_name and p.kind is p.POSITIONAL_OR_KEYWORD):
            named[p.name] = value
            texts.append(f"{p.name}={text}")
        elif not by_name:
            positional.append(value)
            texts.append(text)
    if random.random() < 0.03:
        named["nothing_of_this_name"] = 1
        texts.append("nothing_of_this_name=1")
    elif positional and random.random() < 0.02:
        positional.pop()
        texts.append("(the last one left out)")
    owner = None
    if target.owner is not None:
        label = given if of_given else random.choice(_owners(target))
        owner = objects()[label]
        texts.insert(0, f"<{label}>")
    return Call(target, owner, positional, named, f"{target.name}({', '.join(texts)})")


def shown(value: Any) -> str:
    """A value in one line."""
    try:
        return " ".join(repr(value).split())
    except Exception:
        return f"a {type(value).__name__}"


BINDING = re.compile(
    r"missing \d+ required|takes (no|from|exactly|\d+)|unexpected keyword|multiple values for|got some positional-only"
)


@contextmanager
def limited(seconds: float = LONGEST) -> Iterator[None]:
    """Stops work after so many seconds."""

    def stop(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def outcome(call: Call) -> str:
    """What a call comes to: "" if it was carried out, "refused" by a gonio.Error, else what came out, and where."""
    threads = gn.engine.threads()
    with warnings.catch_warnings(record=True) as heard, redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        warnings.simplefilter("always")
        try:
            with limited():
                _carried_out(call)
        except gn.Error as error:
            if not str(error).strip():
                return f"{type(error).__name__} without words {_where(error)}"
            return "refused"
        except Hang:
            return f"no end within {LONGEST} s"
        except TypeError as error:
            if not (BINDING.search(str(error)) and _is_binding(error)):
                return _finding(error)
            return "refused"
        except Exception as error:
            return "" if "no repr" in str(error) else _finding(error)  # of a NamedTuple that holds the hostile object
        finally:
            gn.engine.threads(threads)
    foreign = [w for w in heard if not w.category.__module__.startswith("gonio") and w.category is not UserWarning]
    return f"{foreign[0].category.__name__}: {str(foreign[0].message)[:100]} {_line(foreign[0])}" if foreign else ""


def _carried_out(call: Call) -> None:
    target = call.target
    if target.call is None:
        result = getattr(call.owner, target.name.rpartition(".")[2])
    elif target.owner is None:
        result = target.call(*call.positional, **call.named)
    else:
        result = getattr(call.owner, target.name.rpartition(".")[2])(*call.positional, **call.named)
    repr(result)


def _frames(error: BaseException) -> list[traceback.FrameSummary]:
    return list(traceback.extract_tb(error.__traceback__))


def _is_binding(error: BaseException) -> bool:
    """Whether Python itself refused the call: nothing of the function was run."""
    last = _frames(error)[-1]
    return last.filename == __file__ or last.name in ("call", "carried_out")


def _finding(error: BaseException) -> str:
    last = _frames(error)[-1]
    if "lambda" in last.line if last.filename == __file__ else "progress(" in last.line:
        return ""  # the caller's own function failed
    return f"{type(error).__name__}: {str(error)[:100]!r} {_where(error)}"


def _where(error: BaseException) -> str:
    frames = [f for f in _frames(error) if "/gonio/" in f.filename]
    return f"at {frames[-1].filename.rpartition('/gonio/')[2]}:{frames[-1].lineno}" if frames else "at the call"


def _line(warning: warnings.WarningMessage) -> str:
    return f"at {Path(warning.filename).name}:{warning.lineno}"
