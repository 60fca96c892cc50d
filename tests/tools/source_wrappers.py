"""What the tests write around a source text, in its own language: arguments from arrays, the call, the results."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from source_cases import Call, Case

from gonio.bridges.source import LANGUAGES
from gonio.compile.source.language import Language, NamedVector
from gonio.trace.graph import MASK, REAL

GIVEN = (3, 3)


class Wrapped(NamedTuple):
    """Statements that call a function, and where its results then are, number by number."""

    lines: list[str]
    results: list[str]


def vectors(call: Call) -> list[NamedVector]:
    """The results of a function."""
    return [NamedVector(name, width, MASK if name == "delta" else REAL) for name, width in call.widths.items()]


def wrapped(case: Case, call: Call, given: Callable[[int, int], str], parameter: Callable[[int], str]) -> Wrapped:
    """A call with the components of directions as `given(argument, component)` and parameters as `parameter(place)`."""
    language = LANGUAGES[case.source.language]
    lines, names = [], []
    for k, values in enumerate(call.arguments):
        v = NamedVector(f"given{k}", values.shape[1])
        lines.append(declared(language, v, [given(k, i) for i in range(v.width)]))
        names.append(v.name)
    place = 0
    for argument in case.source.arguments:
        v = NamedVector(f"of_{argument.name}", argument.width)
        lines.append(declared(language, v, [parameter(place + i) for i in range(v.width)]))
        names.append(v.name)
        place += argument.width
    results = vectors(call)
    called = f"{case.source.name}_{call.function}"
    if language.name == "wgsl":
        lines.append(f"let found = {called}({', '.join(names)});")
        found = [NamedVector("found" if len(results) == 1 else f"found.{v.name}", v.width, v.kind) for v in results]
        numbers = [language.component(v, i) for v in found for i in range(v.width)]
        masks = [v.kind == MASK for v in found for _ in range(v.width)]
        return Wrapped(lines, [f"select(0.0, 1.0, {x})" if m else x for x, m in zip(numbers, masks, strict=True)])
    found = [NamedVector(f"found_{v.name}", v.width, v.kind) for v in results]
    if len(results) == 1 and (language.type(results[0].width) or language.returns_arrays):
        lines.append(f"{language.type(results[0].width)} {found[0].name} = {called}({', '.join(names)});")
    else:
        for v in found:
            kind = language.type(v.width, v.kind)
            lines.append(f"{kind} {v.name};" if kind else f"float {v.name}[{v.width}];")
            names.append(f"&{v.name}" if language.name == "c" and v.width == 1 else v.name)
        lines.append(f"{called}({', '.join(names)});")
    numbers = [language.component(v, i) for v in found for i in range(v.width)]
    return Wrapped(lines, [f"float({x})" if language.name != "c" else x for x in numbers])


def declared(language: Language, v: NamedVector, values: Sequence[str]) -> str:
    """A new variable of some values."""
    if language.name == "wgsl":
        return f"let {v.name} = {language.built(v, values)};"
    kind = language.type(v.width)
    return (
        f"{kind} {v.name} = {language.built(v, values)};"
        if kind
        else f"float {v.name}[{v.width}] = {{{', '.join(values)}}};"
    )


def parameters(case: Case) -> np.ndarray:
    """The numbers of all parameters that are arguments, in a row."""
    return np.array([x for argument in case.source.arguments for x in argument.value], np.float32)


def body(text: str) -> str:
    """A text without its comments."""
    return re.sub(r"//[^\n]*", "", text)
