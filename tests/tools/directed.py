"""Public functions and methods that take a material and directions, found by their signatures, and calls of them.

How one is called whose arguments the names do not tell, `CALLS` says.
"""

from __future__ import annotations

import inspect
import re
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, NamedTuple

import face
import house
import numpy as np

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
    "gonioreflectometer": "a measurement of a surface by rays",
    "render": "a picture",
}

TOLERANCE = 1e-2
"""Of integrals."""


class Call(NamedTuple):
    """A public function or method with one set of other arguments."""

    name: str
    owner: str
    arguments: dict[str, str]
    integral: bool

    @property
    def others(self) -> list[str]:
        """What is given but directions and the tolerance."""
        return [x for k, x in self.arguments.items() if k != "tolerance" and x not in GIVEN]

    def __str__(self) -> str:
        return "-".join([self.name, *(re.sub(r"\W+", "_", x) for x in self.others)])[:60]

    def text(self, at: str) -> str:
        """The call of m, as Python; `at`: what follows the names of what is given for each direction."""
        named = ", ".join(f"{k}={v + at if v in GIVEN else v}" for k, v in self.arguments.items())
        return f"{self.owner}.{self.name}({'m, ' if self.owner == 'gn' else ''}{named})"


def _methods() -> Iterator[tuple[str, Any]]:
    kinds = [kind for m in vars(house).values() if isinstance(m, gn.Reflectance) for kind in type(m).__mro__]
    for kind in dict.fromkeys(kinds):
        yield from ((k, v) for k, v in vars(kind).items() if not k.startswith("_") and inspect.isfunction(v))


def directed() -> dict[str, tuple[str, dict[str, inspect.Parameter]]]:
    """The functions and methods that take a material and directions, or integrate over these: owner and parameters.
    What is called by kernels takes a `Direction`, and figures and files have a `path`."""
    found = {}
    for owner, functions in (("gn", face.functions().items()), ("m", _methods())):
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
    for name, (owner, parameters) in directed().items():
        if name in OF_ALL_DIRECTIONS:
            continue
        tolerance = {"tolerance": str(TOLERANCE)} if "tolerance" in parameters else {}
        for more in CALLS.get(name, ({},)):
            given = {k: k for k in parameters if k in GIVEN}
            calls.append(Call(name, owner, given | more | tolerance, bool(tolerance)))
    return calls


SWEPT = _calls()


def named(call: Call) -> dict[str, str]:
    """What is given for each direction, as Python."""
    return {v: GIVEN[v] for v in call.arguments.values() if v in GIVEN}


@cache
def value(text: str) -> Any:
    return eval(text, {"gn": gn, "np": np})


def numbers(result: Any, known: Callable[[Any], np.ndarray] = np.asarray) -> list[np.ndarray]:
    """The arrays of a result; `known`: how one becomes NumPy's."""
    if isinstance(result, dict):
        result = tuple(result.values())
    return [x for value in result for x in numbers(value, known)] if isinstance(result, tuple) else [known(result)]


class Refused(NamedTuple):
    """Instead of a result: the error that a call ended with."""

    kind: type


def run(
    call: Call,
    m: gn.Reflectance,
    at: Any,
    changed: Callable[[np.ndarray], Any] | None = None,
    known: Callable[[Any], np.ndarray] = np.asarray,
) -> list[np.ndarray] | Refused:
    """What a call gives for some of the directions; `changed`: these, as something else; `known`: results, as NumPy's
    arrays."""
    change = changed or (lambda x: x)
    function: Callable = gn if call.owner == "gn" else m
    for part in call.name.split("."):
        function = getattr(function, part)
    values = {k: change(value(GIVEN[v])[at]) if v in GIVEN else value(v) for k, v in call.arguments.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # numbers are compared
        try:
            return numbers(function(*([m] if call.owner == "gn" else []), **values), known)
        except gn.Error as error:
            return Refused(type(error))


def lines(call: Call, m: gn.Reflectance, count: int, k: int) -> str:
    """Three lines of Python that print what a call gives for several directions, and for one of these."""
    made = "; ".join(f"{name} = {text}[:{count}]" for name, text in named(call).items()) or "k = 0"
    one = (call.text(f"[{k}]"), f"{call.text('')}[{k}]") if named(call) else (call.text(""),)
    m_c = "tree.each(m, lambda x: x[..., :1] if np.ndim(x) else x)"
    lines = (
        f"import numpy as np, gonio as gn; m = gn.expression({repr(m)!r})\n{made}\nprint({', '.join(one)}, sep='\\n')"
    )
    return f"\n{lines}  # of the first channel: from gonio.formula import tree; m = {m_c}"
