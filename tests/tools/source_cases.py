"""What source texts are compared with: materials, directions, and the values that gonio gives for them in float32."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

import gonio as gn
from gonio.bridges.source import ShaderSource
from gonio.facts.models import drawn, kinds

PAIRS = 192
LEVEL = 1e-3
"""Values below this share of the largest one are compared with that share of it."""


class Input(NamedTuple):
    """Directions and numbers for every function, (PAIRS, 3) and, to sample by, (PAIRS, 2)."""

    wi: np.ndarray
    wo: np.ndarray
    u: np.ndarray


class Call(NamedTuple):
    """A function of a text: its arguments, its results by name, how many numbers each is, and their values."""

    function: str
    arguments: tuple[np.ndarray, ...]
    widths: dict[str, int]
    expected: dict[str, np.ndarray]


class Case(NamedTuple):
    """A text with what its functions should give."""

    material: Any
    source: ShaderSource
    calls: list[Call]


def directions(m: Any, seed: int = 0) -> Input:
    """Directions all over, a few of them below the horizon or along the normal; half of wi about the mirrored wo."""
    rng = np.random.default_rng(seed)
    w = rng.normal(size=(2, PAIRS, 3))
    w[0, ::2] = w[1, ::2] * [-1, -1, 1] + 0.2 * w[0, ::2]
    below = rng.random((2, PAIRS)) < (0.3 if m.sides != "front" else 0.06)
    w[..., 2] = np.where(below, -1, 1) * (abs(w[..., 2]) + 0.05)
    w[0, 0] = w[1, 1] = [0, 0, 1]
    wi, wo = (w / np.linalg.norm(w, axis=-1, keepdims=True)).astype(np.float32)
    return Input(wi, wo, rng.random((PAIRS, 2)).astype(np.float32))


def case(
    m: Any, language: str, functions: Sequence[str], name: str, parameters: str = "constants", seed: int = 0
) -> Case:
    """The text of a material in a language, with what gonio gives for its functions."""
    source = gn.engine.shader_source(m, language, tuple(functions), name, parameters)
    names = {}
    if "jacobian" in functions:
        arguments = (
            source.arguments or gn.engine.shader_source(m, language, tuple(functions), name, "arguments").arguments
        )
        names = {a.path: a.name for a in arguments}
    at = directions(m, seed)
    return Case(m, source, [call(m, word, at, names) for word in functions])


def call(m: Any, function: str, at: Input, names: dict[str, str]) -> Call:
    """A function's results by gonio. `names`: path -> argument of the text."""
    wi, wo, u = at
    count = m.channels or 1
    given = (wo, u) if function == "sample" else (wi, wo)
    if function in ("f", "f_cos"):
        cosine = abs(wi[:, 2:]) if function == "f_cos" else 1.0
        results = {function: m.f(wi, wo).reshape(PAIRS, count) * cosine}
    elif function == "pdf":
        results = {"pdf": m.pdf(wi, wo)}
    elif function == "mueller":
        results = {"M": m.mueller(wi, wo)}
    elif function == "jacobian":
        jacobian = m.jacobian(wi, wo)
        results = {"f": jacobian.f} | {f"d_{names[path]}": jacobian.by[path] for path in names if path in jacobian.by}
    else:
        drawn = m.sample(wo, u)
        results = {"wi": drawn.wi, "weight": drawn.weight, "pdf": drawn.pdf, "delta": drawn.delta}
    expected = {name: np.asarray(value, np.float32).reshape(PAIRS, -1) for name, value in results.items()}
    return Call(function, given, {name: value.shape[1] for name, value in expected.items()}, expected)


def models() -> dict[str, Any]:
    """All models, as the manual draws them, by a name for their texts."""
    return {name.lower(): gn.expression(drawn(kind)) for name, kind in kinds()["Models"].items()}


def few() -> dict[str, Any]:
    """A dozen that between them have every kind of operation: loops, whole numbers, elementary functions, choices."""
    names = "coated coxmunk disneyprincipled eon hetorrance hapke kullacontydielectric microfacet normalmapped rossli"
    return {name: m for name, m in models().items() if name in (*names.split(), "roughcoated", "sgd", "turquin")}


def of_channels(count: int | None) -> Any:
    """A material of so many channels."""
    spread = (lambda a, b: 0.5 * (a + b)) if count is None else (lambda a, b: np.linspace(a, b, count).tolist())
    metal = gn.Conductor(spread(0.2, 0.4), spread(3.0, 2.0))
    return 0.5 * gn.Lambertian(spread(0.1, 0.6)) + 0.4 * gn.Microfacet(gn.Beckmann(0.3, 0.1), metal)


def limit(call: Call, result: str) -> float:
    """The error that is allowed. Inverting a distribution, its density, and slopes are differences of numbers near each
    other."""
    return 1e-4 if call.function == "sample" else 3e-5 if call.function in ("pdf", "jacobian") else 1e-5


def beyond(cases: Sequence[Case], found: Sequence[Sequence[np.ndarray]]) -> list[str]:
    """What is farther from gonio's values than is allowed, in words; nothing is skipped."""
    return [
        f"{case.source.name}_{call.function}: {name} {error:.1e}"
        for case, results in zip(cases, found, strict=True)
        for call, result in zip(case.calls, results, strict=True)
        for name, error in errors(call, result)
        if not error <= limit(call, name)
    ]


def split(call: Call, found: np.ndarray) -> dict[str, np.ndarray]:
    """The numbers of all results, side by side, by name."""
    ends = np.cumsum(list(call.widths.values()))
    return dict(zip(call.widths, np.split(found, ends[:-1], axis=1), strict=True))


def errors(call: Call, found: np.ndarray) -> Iterator[tuple[str, float]]:
    """By result, the largest error: of a sampled direction absolute; of a Mueller matrix relative to its first number;
    else relative to the value, or to `LEVEL` of the largest one. Weight and density belong to a direction that has an
    error itself, which counts for 1/cos at the horizon."""
    for name, value in split(call, found).items():
        expected = call.expected[name]
        top = np.max(abs(expected[np.isfinite(expected)]), initial=0.0)
        scale = abs(np.repeat(expected[:, ::16], 16, axis=1) if name == "M" else expected) + LEVEL * top + 1e-30
        if name == "wi":
            scale = np.ones(1)
        elif call.function == "sample":
            scale = scale / np.maximum(abs(call.expected["wi"][:, 2:]), 1e-3)
        difference = abs(value - expected) / scale
        yield name, float(np.max(np.where(value == expected, 0.0, difference)))
