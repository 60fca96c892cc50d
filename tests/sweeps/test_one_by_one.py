"""One by one as all at once: a call with many directions and channels gives what calls with one of each give.

Every public function and method that takes a material and directions is in this sweep by existing; how one is called
whose arguments the names do not tell, `CALLS` says. A failure ends with three lines of Python that repeat it.
"""

from __future__ import annotations

import inspect
import re
import types
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from itertools import product
from typing import Any, NamedTuple

import house
import numpy as np
import pytest
from materials import COMPILED

import gonio as gn

COUNT = 7
"""Directions at most."""

DIRECTIONS = re.compile(r"w|wi|wo|(theta|phi)(_.)?|incident|collected|directions?|views?")
"""Names of arguments that are directions or angles: a public function with one, and a material, is in the sweep."""

GIVEN = {
    "wi": "gn.direction(np.linspace(0.0, 1.4, 7), np.linspace(0.3, 5.0, 7))",
    "wo": "gn.direction(np.linspace(1.2, 0.1, 7), np.linspace(3.0, 9.0, 7))",
    "u": "np.random.default_rng(1).random((7, 2))",
    "theta": "np.linspace(0.0, 1.4, 7)",
    "theta_i": "np.linspace(0.0, 1.4, 7)",
    "theta_o": "np.linspace(1.2, 0.1, 7)",
    "theta_s": "np.linspace(0.0, 1.4, 7)",
    "theta_v": "np.linspace(1.2, 0.1, 7)",
    "to_theta_s": "np.linspace(0.9, 0.2, 7)",
    "phi": "np.linspace(0.3, 5.0, 7)",
    "phi_i": "np.linspace(0.3, 5.0, 7)",
    "phi_o": "np.linspace(3.0, 9.0, 7)",
    "diffuse_fraction": "np.linspace(0.0, 1.0, 7)",
}
"""What arguments of these names are given: one for each of seven directions."""

ALL, CONE = "gn.Hemisphere()", "gn.Cone([0.0, 0.6, 0.8], 0.4)"
CALLS: dict[str, tuple[dict[str, str], ...]] = {
    "reflectance": ({"incident": "wi"}, {"incident": "wi", "collected": CONE}, {}),
    "reflectance_factor": (
        {"incident": "wi", "collected": "wo"},
        {"collected": "wo"},
        {"collected": "wo", "sky": "gn.FunctionLight(lambda w: 1.0 + w[..., 0])"},
        {"collected": "wo", "sky": "gn.DistantLight([0.3, 0.0, 1.0], 2.0)"},
    ),
    "reflected_radiance": (
        {"lights": "gn.ConstantLight(1.0)"},
        {"lights": "gn.FunctionLight(lambda w: 1.0 + w[..., 0])"},
        {"lights": "[gn.DistantLight([0.3, 0.0, 1.0], 2.0), gn.RectangleLight([0, 0, 2], [1, 0, 0], [0, -1, 0])]"},
    ),
    "repair.through_aperture": ({"detector": "0.05"},),
}
"""Other arguments, as Python; a word of `GIVEN` stands for what is there. Several: each is tried."""

OF_ALL_CHANNELS = {
    "pdf": "what is drawn is drawn for all channels together",
    "sample": "what is drawn is drawn for all channels together",
    "reradiation": "goes from each channel to each",
}
OF_ALL_DIRECTIONS = {
    "fit_map": "one fit for all directions",
    "fit_map_chunks": "one fit for all directions",
    "gonioreflectometer": "a measurement of a surface by rays",
}

TOLERANCE = 1e-2
EXACT = 1e-12


class Call(NamedTuple):
    """A public function or method with one set of other arguments."""

    name: str
    owner: str
    arguments: dict[str, str]
    integral: bool

    def __str__(self) -> str:
        return "-".join(
            [
                self.name,
                *(re.sub(r"\W+", "_", x) for k, x in self.arguments.items() if k != "tolerance" and x not in GIVEN),
            ]
        )[:60]

    def text(self, at: str) -> str:
        """The call of m, as Python; `at`: what follows the names of what is given for each direction."""
        named = ", ".join(f"{k}={v + at if v in GIVEN else v}" for k, v in self.arguments.items())
        return f"{self.owner}.{self.name}({'m, ' if self.owner == 'gn' else ''}{named})"


def _public() -> Iterator[tuple[str, Any]]:
    for name in gn.__all__:
        thing = getattr(gn, name)
        if isinstance(thing, types.ModuleType):
            inner = {k: v for k, v in vars(thing).items() if not k.startswith("_") and inspect.isfunction(v)}
            yield from ((f"{name}.{k}", v) for k, v in inner.items() if v.__module__.startswith(thing.__name__))
        elif inspect.isfunction(thing):
            yield name, thing


def _methods() -> Iterator[tuple[str, Any]]:
    kinds = [kind for m in vars(house).values() if isinstance(m, gn.Reflectance) for kind in type(m).__mro__]
    for kind in dict.fromkeys(kinds):
        yield from ((k, v) for k, v in vars(kind).items() if not k.startswith("_") and inspect.isfunction(v))


def _found() -> dict[str, tuple[str, dict[str, inspect.Parameter]]]:
    """The functions and methods that take a material and directions, or integrate over these: owner and parameters.
    What is called by kernels takes a `Direction`, and figures and files have a `path`."""
    found = {}
    for owner, functions in (("gn", _public()), ("m", _methods())):
        for name, function in functions:
            parameters = dict(list(inspect.signature(function).parameters.items())[owner == "m" :])
            kinds = {str(p.annotation) for p in parameters.values()}
            takes = owner == "m" or any("Reflectance" in kind for kind in kinds)
            directed = "tolerance" in parameters or any(map(DIRECTIONS.fullmatch, parameters))
            if takes and directed and "Direction" not in kinds and "path" not in parameters:
                found.setdefault(name, (owner, parameters))
    return found


def _calls() -> list[Call]:
    calls = []
    for name, (owner, parameters) in _found().items():
        if name in OF_ALL_DIRECTIONS:
            continue
        tolerance = {"tolerance": str(TOLERANCE)} if "tolerance" in parameters else {}
        for more in CALLS.get(name, ({},)):
            given = {k: k for k in parameters if k in GIVEN}
            calls.append(Call(name, owner, given | more | tolerance, bool(tolerance)))
    return calls


SWEPT = _calls()
HOUSE = {
    name.lower(): m for name, m in vars(house).items() if isinstance(m, gn.Reflectance) and m is not house.METAL
}  # GOLD is METAL, with channels


def test_every_function_of_a_material_and_directions_is_in_the_sweep():
    found = _found()
    for name, (owner, parameters) in found.items():
        needed = {k for k, p in parameters.items() if p.default is p.empty and p.kind is p.POSITIONAL_OR_KEYWORD}
        known = {"m", *GIVEN, *(k for more in CALLS.get(name, ()) for k in more)}
        assert name in OF_ALL_DIRECTIONS or needed <= known, (
            f"{owner}.{name} takes a material and directions, and the sweep does not know what to give for "
            f"{sorted(needed - known)}: write it into GIVEN (one for each direction) or CALLS (the same for all), or, "
            f"if its result is one for all directions, the reason into OF_ALL_DIRECTIONS"
        )
    assert {*CALLS, *OF_ALL_CHANNELS, *OF_ALL_DIRECTIONS} <= set(found), "these are gone, or take no directions"


def _named(call: Call) -> dict[str, str]:
    return {v: GIVEN[v] for v in call.arguments.values() if v in GIVEN}


@cache
def _value(text: str) -> Any:
    return eval(text, {"gn": gn, "np": np})


def _numbers(result: Any) -> list[np.ndarray]:
    """The arrays of a result."""
    if isinstance(result, dict):
        return [x for value in result.values() for x in _numbers(value)]
    return [x for value in result for x in _numbers(value)] if isinstance(result, tuple) else [np.asarray(result)]


class _Refused(NamedTuple):
    kind: type


def _run(call: Call, m: gn.Reflectance, at: Any) -> list[np.ndarray] | _Refused:
    """What a call gives for some of the directions."""
    function: Callable = gn if call.owner == "gn" else m
    for part in call.name.split("."):
        function = getattr(function, part)
    values = {k: _value(GIVEN[v])[at] if v in GIVEN else _value(v) for k, v in call.arguments.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            return _numbers(function(*([m] if call.owner == "gn" else []), **values))
        except gn.Error as error:
            return _Refused(type(error))


def _channel(m: gn.Reflectance, c: int) -> gn.Reflectance:
    return m.each(lambda x: x[..., c : c + 1] if np.ndim(x) and np.shape(x)[-1] > 1 else x)


def one_by_one(call: Call, m: gn.Reflectance, places: Iterable[int]) -> list[np.ndarray] | _Refused:
    """The results for some of the directions, each by itself and each channel by itself."""
    places = places if _named(call) else [...]
    split = m.channels is not None and call.name not in OF_ALL_CHANNELS
    parts = [_channel(m, c) for c in range(m.channels)] if split else [m]
    rows = []
    for at in places:
        channels = [_run(call, part, at) for part in parts]
        if refused := next((x for x in channels if isinstance(x, _Refused)), None):
            return refused
        rows.append([np.concatenate(x) if split else x[0] for x in zip(*channels, strict=True)])
    return [np.stack(x) if _named(call) else x[0] for x in zip(*rows, strict=True)]


def hold(call: Call, m: gn.Reflectance, expected: list[np.ndarray] | _Refused, places: list[int], count: int) -> None:
    """Fails, with three lines that repeat it, where a call for the first directions does not give what is expected at
    those of the places that are among them."""
    at, number = (slice(count), sum(k < count for k in places)) if _named(call) else (..., 0)
    found = _run(call, m, at)
    if isinstance(found, _Refused) or isinstance(expected, _Refused):
        assert found == expected, f"{_lines(call, m, count, 0)}\none of the two is refused: {found}; {expected}"
        return
    largest = max(_largest(y) for y in expected)
    for x, y in zip(found, expected, strict=True):
        shape = (count, *y.shape[1:]) if number else y.shape
        assert x.shape == shape, f"{_lines(call, m, count, 0)}\nshape {x.shape}, expected {shape}"
        x, y = (1.0 * x[places[:number]], 1.0 * y[:number]) if number else (x, y)
        size = np.maximum(1.0, np.abs(y)) if call.integral else max(1e-300, _largest(y), 1e-4 * largest)
        off = np.where(np.isnan(x) | np.isnan(y), np.isnan(x) != np.isnan(y), np.abs(x - y) / size)
        if (off > (TOLERANCE if call.integral else EXACT)).any():
            worst = places[np.unravel_index(np.argmax(off), off.shape)[0]] if number else 0
            raise AssertionError(f"{_lines(call, m, count, worst)}\n{x}\nexpected\n{y}")


def _largest(x: np.ndarray) -> float:
    return float(np.nanmax(np.abs(x), initial=0.0))


def _lines(call: Call, m: gn.Reflectance, count: int, k: int) -> str:
    """Three lines of Python that print what a call gives for several directions, and for one of these."""
    made = "; ".join(f"{name} = {text}[:{count}]" for name, text in _named(call).items()) or "k = 0"
    one = (call.text(f"[{k}]"), f"{call.text('')}[{k}]") if _named(call) else (call.text(""),)
    m_c = "m.each(lambda x: x[..., :1] if np.ndim(x) else x)"
    lines = (
        f"import numpy as np, gonio as gn; m = gn.expression({repr(m)!r})\n{made}\nprint({', '.join(one)}, sep='\\n')"
    )
    return f"\n{lines}  # of the first channel: m = {m_c}"


def weighed(m: gn.Reflectance, channels: int) -> gn.Reflectance:
    return np.array([0.2, 0.6, 0.7])[-channels:] * m


def swept(call: Call, m: gn.Reflectance, channels: int, places: Iterable[int]) -> int:
    """Holds a call to its parts for 1, C and 7 directions; how many cells these are."""
    m, places = weighed(m, channels), sorted({0, *places, channels - 1, COUNT - 1})
    expected = one_by_one(call, m, places)
    counts = sorted({1, channels, COUNT}) if _named(call) else [COUNT]
    for count in counts:
        hold(call, m, expected, places, count)
    return len(counts)


@pytest.mark.parametrize("call", SWEPT, ids=str)
@pytest.mark.parametrize("m", HOUSE.values(), ids=HOUSE)
def test_one_by_one_of_house_materials(m, call):
    for channels in (1, 3) if m.channels is None else (3,):
        swept(call, m, channels, [])


@pytest.mark.full
@pytest.mark.parametrize("draw", COMPILED, ids=str)
def test_one_by_one_of_all_models(draw, capsys):
    cells = 0
    for call, channels in product(SWEPT, (1, 3)):
        cells += swept(call, draw.material(channels if draw.seed % 2 else None), channels, [])
    with capsys.disabled():
        print(f"\n{draw}: {cells} cells of {len(SWEPT)} calls", end=" ")
