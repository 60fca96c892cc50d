"""A material as the page needs it: what it is, its numbers with ranges for sliders, and its formula in GLSL."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..base.measured import Measured
from ..base.reflectance import Reflectance, Scaled, Sum
from ..catalogue import builtin
from ..errors import Error
from ..evaluate import batch
from ..facts.material import facts
from ..facts.models import sections, summary
from ..formula.fields import Option, Parameter
from ..formula.parametrised import Parametrised
from ..scenes.rendering import is_rgb, shown_as
from .shelf import Shelf

WIDE = 50.0
"""Width of the bounds of a parameter above which a slider shows the part around its value."""

DECADES = 100.0
"""Ratio of the ends of a slider from which it is logarithmic."""

INDICES = {"eta": (1.0, 4.0), "k": (0.0, 10.0)}
"""Ranges of refractive index and extinction, which bounds exceed by far."""

MAPS = "its parameters are maps: it is another material at each place; gonio show draws maps"

MATRICES = 16
"""The most channels for which the page gets Mueller matrices."""


def described(shelf: Shelf, text: str, replaced: Mapping[str, Any]) -> dict[str, Any]:
    """MATERIAL of the protocol; arrays stand in it as NumPy arrays."""
    m = shelf.material(text, replaced)
    path = shelf.upload(text)
    given = shelf.given.get(text)
    command = given.text if given else path.name if path else text
    about = facts(command, m, computed=False)
    is_map = bool(batch.full_shape(m, ()))
    return {
        "text": text,
        "title": _title(command, m, given.replaced if given else ()),
        "formula": "\n\n".join(f"{kind.__name__}: {formula}" for kind, formula in _formulas(m)),
        "source": _source(command, m),
        "description": "; ".join(filter(None, (_description(command, m), about.get("fluorescence")))),
        "class": type(m).__name__,
        "channels": m.channels,
        "channel_names": None if m.channel_names is None else list(m.channel_names),
        "measured": isinstance(m, Measured),
        "upload": path is not None,
        "sides": str(m.sides),
        "has_delta": bool(m.has_delta),
        "polarized": bool(m.polarizes),
        "isotropic": not is_map and bool(m.is_isotropic()),
        "rgb": rgb_matrix(m),
        **({"glsl": None, "why": MAPS} if is_map else _glsl(m)),
        "parameters": [] if is_map else list(_parameters(m)),
        "options": [
            {"path": path, "value": value, "choices": list(dict.fromkeys(field.choices)), "doc": field.doc}
            for path, field, value in m.settable()
            if isinstance(field, Option)
        ],
        "facts": about,
        "snippet": snippet(command, m, given.replaced if given else (), replaced),
        "command": shell_command(command, given.replaced if given else (), replaced),
    }


def _title(command: str, m: Reflectance, replaced: tuple[str, ...]) -> str:
    name = Path(command).name if isinstance(m, Measured) else command
    line = " ".join(", ".join([name, *replaced]).split())
    return line if len(line) <= 120 else f"{line[:117]}..."


def _kinds(m: Parametrised) -> Iterator[type[Parametrised]]:
    """The classes of a material and of its pieces, without sums and products."""
    if not isinstance(m, (Sum, Scaled)):
        yield type(m)
    for name in m.fields:
        if isinstance(part := getattr(m, name), Parametrised):
            yield from _kinds(part)


def _formulas(m: Reflectance) -> Iterator[tuple[type, str]]:
    """The classes of a material with what their docstrings say before the first label."""
    for kind in dict.fromkeys(_kinds(m)):
        if text := sections(kind).get("", ""):
            yield kind, text.replace("`", "")


def _source(text: str, m: Reflectance) -> str:
    entry = builtin.find(text)
    sources = [entry.source] if entry else [m.numbers_from] if m.numbers_from else []
    if not entry:
        sources += [" ".join(sections(kind).get("Source", "").split()) for kind in dict.fromkeys(_kinds(m))]
    return "; ".join(dict.fromkeys(x.rstrip(".") for x in sources if x))


def _description(text: str, m: Reflectance) -> str:
    entry = builtin.find(text)
    if entry is not None:
        return f"{entry.kind}: {entry.description}"
    if isinstance(m, Measured):
        return f"measurement, {m.provenance.get('format', m.format)} file"
    if isinstance(m, Sum):
        return "sum of " + ", ".join(type(term.of if isinstance(term, Scaled) else term).__name__ for term in m.terms)
    return summary(type(m.of if isinstance(m, Scaled) else m)).replace("`", "")


def rgb_matrix(m: Reflectance) -> list[list[float]]:
    """Matrix (C, 3) that turns channels into linear sRGB; gray for channels that are no colours."""
    count = m.channels or 1
    if count == 3 and is_rgb(m):
        matrix = np.eye(3)
    elif count == 1:
        matrix = np.ones((1, 3))
    else:
        shown = shown_as(m)
        matrix = np.full((count, 3), 1.0 / count) if shown is None else shown
    return [[float(x) for x in row] for row in matrix]


def _glsl(m: Reflectance) -> dict[str, Any]:
    """The formula in GLSL under "glsl"; None, and why, where there is none."""
    from ..bridges.source import source

    functions = ["f", "pdf", "sample"]
    if m.polarizes and (m.channels or 1) <= MATRICES:
        functions.append("mueller")
    why = ""
    for wanted in (functions, functions[:3], functions[:1]):
        try:
            found = source(m, "glsl", wanted, parameters="arguments")
        except Error as error:
            why = why or str(error)
            continue
        arguments = [
            {"name": a.name, "path": a.path, "width": a.width, "value": np.asarray(a.value).tolist()}
            for a in found.arguments
        ]
        tables = [{"name": t.name, "data": np.asarray(t.values, np.float32)} for t in found.tables]
        count = found.channels or 1
        kind = "float" if count == 1 else f"vec{count}" if count <= 4 else f"float[{count}]"
        glsl = {"name": found.name, "text": found.text, "functions": list(found.functions), "type": kind}
        return {"glsl": {**glsl, "arguments": arguments, "tables": tables}}
    return {"glsl": None, "why": why}


def _parameters(m: Reflectance) -> Iterator[dict[str, Any]]:
    for path, p in m.parameters.items():
        if np.ndim(p.value) > 1 or not isinstance(p.value, (int, float, np.ndarray)):
            continue
        low, high, scale = slider(path.rpartition(".")[2], p)
        numbers = np.asarray(p.value, dtype=float).tolist()
        about = {"path": path, "value": numbers, "low": low, "high": high, "scale": scale}
        yield {**about, "unit": p.unit, "doc": p.doc}


def slider(name: str, p: Parameter) -> tuple[float, float, str]:
    """Ends of a slider, within the bounds of a parameter and around its value, and "linear" or "log"."""
    values = np.asarray(p.value, dtype=float)
    least, most = float(values.min()), float(values.max())
    low, high = p.low, p.high
    if name in INDICES and p.unit == "1" and high - low > 4.0:
        low, high = max(low, INDICES[name][0]), min(high, INDICES[name][1])
    elif not high - low <= WIDE:
        reach = 10.0 ** math.ceil(math.log10(4.0 * max(abs(least), abs(most), 0.25)))
        low, high = max(low, -reach if least < 0.0 or p.low < -1e30 else 0.0), min(high, reach)
    low, high = min(low, least), max(high, most)
    is_log = low > 0.0 and high / low >= DECADES
    return low, high, "log" if is_log else "linear"


_CONSTRUCTOR = re.compile(r"""("[^"]*"|'[^']*')|(?<![\w.])(?:gn\.|gonio\.)?([A-Za-z_]\w*)(?=\s*\()""")


def snippet(text: str, m: Reflectance, assigned: tuple[str, ...], replaced: Mapping[str, Any]) -> str:
    """Python code that makes a material."""
    lines = ["import gonio as gn", ""]
    if isinstance(m, Measured):
        lines.append(f"m = gn.load({text!r})")
    elif builtin.find(text) is not None:
        lines.append(f"m = gn.material({text!r})")
    elif "(" not in text:
        lines.append(f"m = gn.load({text!r})")
    else:
        lines.append("m = " + _CONSTRUCTOR.sub(lambda found: found[1] or f"gn.{found[2]}", " ".join(text.split())))
    for name, _, value in (word.partition("=") for word in assigned):
        lines.append(f"m = m.replace({{{name.strip()!r}: {_as_python(value.strip())}}})")
    if replaced:
        lines.append(f"m = m.replace({dict(replaced)!r})")
    return "\n".join(lines) + "\n"


def _as_python(value: str) -> str:
    """A value of -p in Python: numbers as they are, several as a list, words in quotes, pieces by their classes."""
    if "(" in value:
        return _CONSTRUCTOR.sub(lambda found: found[1] or f"gn.{found[2]}", value)
    if re.fullmatch(r"[A-Za-z_]\w*", value):
        return repr(value)
    return f"[{value}]" if "," in value and not value.startswith("[") else value


def shell_command(text: str, assigned: tuple[str, ...], replaced: Mapping[str, Any]) -> str:
    """The command line that draws a material."""
    words = ["gonio", "show", text]
    for path, value in replaced.items():
        listed = ",".join(f"{x:g}" for x in value) if isinstance(value, list) else value
        words += ["-p", f"{path}={listed}"]
    for word in assigned:
        words += ["-p", word]
    return shlex.join([*words, "-o", "material.png"])
