"""A material as the page needs it: what it is, its numbers with ranges for sliders, and its formula in GLSL."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..errors import Error
from ..facts.material import facts, to_rgb
from ..facts.models import formulas
from ..facts.public import public
from ..facts.subject import Subject
from .given import Given
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
    given = shelf.given.get(text) or Given(path.name if path else text)
    subject = Subject(_title(given, m), m, *given)
    about, told = facts(subject.text, m, computed=False), formulas(m)
    is_map = "places" in about
    return {
        "text": text,
        "title": subject.name,
        "formula": "\n\n".join(f"{x['class']}: {x['formula'].replace('`', '')}" for x in told if x["formula"]),
        "source": _source(about, m, told),
        "description": "; ".join(filter(None, (subject.title, about.get("fluorescence")))),
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
        "parameters": [] if is_map else list(_parameters(about["parameters"])),
        "options": [{"path": path, **option} for path, option in about["options"].items()],
        "facts": about,
        "snippet": snippet(subject, replaced),
        "command": shell_command(subject, replaced),
    }


def _title(given: Given, m: Reflectance) -> str:
    name = Path(given.text).name if isinstance(m, Measured) else given.text
    line = " ".join(", ".join([name, *given.replaced]).split())
    return line if len(line) <= 120 else f"{line[:117]}..."


def _source(about: Mapping[str, Any], m: Reflectance, told: Sequence[Mapping[str, str]]) -> str:
    """Where the numbers and the formulas are from."""
    sources = [about["source"]] if "source" in about else [m._numbers_from, *(x["source"] for x in told)]
    return "; ".join(dict.fromkeys(x.rstrip(".") for x in sources if x))


def rgb_matrix(m: Reflectance) -> list[list[float]]:
    """Matrix (C, 3) that turns channels into linear sRGB; gray for channels that are no colours."""
    count, matrix = m.channels or 1, to_rgb(m)
    return [[float(x) for x in row] for row in (np.full((count, 3), 1.0 / count) if matrix is None else matrix)]


def _glsl(m: Reflectance) -> dict[str, Any]:
    """The formula in GLSL under "glsl"; None, and why, where there is none."""

    functions = ["f", "pdf", "sample"]
    if m.polarizes and (m.channels or 1) <= MATRICES:
        functions.append("mueller")
    why = ""
    for wanted in (functions, functions[:3], functions[:1]):
        try:
            source = public("engine.shader_source")(m, "glsl", wanted, parameters="arguments")
        except Error as error:
            why = why or str(error)
            continue
        arguments = [
            {"name": a.name, "path": a.path, "width": a.width, "value": np.asarray(a.value).tolist()}
            for a in source.arguments
        ]
        tables = [{"name": t.name, "data": np.asarray(t.values, np.float32)} for t in source.tables]
        count = source.channels or 1
        kind = "float" if count == 1 else f"vec{count}" if count <= 4 else f"float[{count}]"
        glsl = {"name": source.name, "text": source.text, "functions": list(source.functions), "type": kind}
        return {"glsl": {**glsl, "arguments": arguments, "tables": tables}}
    return {"glsl": None, "why": why}


def _parameters(about: Mapping[str, dict[str, Any]]) -> Iterator[dict[str, Any]]:
    for path, p in about.items():
        if np.ndim(p["value"]) <= 1 and isinstance(p["value"], (int, float, list)):
            low, high, scale = slider(path.rpartition(".")[2], p)
            numbers = np.asarray(p["value"], dtype=float).tolist()
            ends = {"path": path, "value": numbers, "low": low, "high": high, "scale": scale}
            yield {**ends, "unit": p["unit"], "doc": p["doc"]}


def slider(name: str, p: Mapping[str, Any]) -> tuple[float, float, str]:
    """Ends of a slider, within the bounds of a parameter and around its value, and "linear" or "log"."""
    values = np.asarray(p["value"], dtype=float)
    least, most = float(values.min()), float(values.max())
    low, high = p["low"], p["high"]
    if name in INDICES and p["unit"] == "1" and high - low > 4.0:
        low, high = max(low, INDICES[name][0]), min(high, INDICES[name][1])
    elif not high - low <= WIDE:
        reach = 10.0 ** math.ceil(math.log10(4.0 * max(abs(least), abs(most), 0.25)))
        low, high = max(low, -reach if least < 0.0 or p["low"] < -1e30 else 0.0), min(high, reach)
    low, high = min(low, least), max(high, most)
    is_log = low > 0.0 and high / low >= DECADES
    return low, high, "log" if is_log else "linear"


def snippet(subject: Subject, replaced: Mapping[str, Any]) -> str:
    """Python code that makes a material."""
    changed = f"m = m.replace({dict(replaced)!r})\n" if replaced else ""
    return f"import gonio as gn\n\nm = {subject.code}\n{changed}"


def shell_command(subject: Subject, replaced: Mapping[str, Any]) -> str:
    """The command line that draws a material."""
    listed = {k: ",".join(f"{x:g}" for x in v) if isinstance(v, list) else v for k, v in replaced.items()}
    words = [f"{path}={value}" for path, value in listed.items()]
    return f"gonio show {subject._replace(replaced=[*words, *subject.replaced]).words} -o material.png"
