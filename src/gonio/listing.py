"""What `gonio materials` and `gonio info` print: facts about materials, as data and as text."""

from __future__ import annotations

import fnmatch
import math
import os
import shutil
import sys
import textwrap
import warnings
from collections.abc import Iterable, Sequence
from typing import Any

import click
import numpy as np

from . import catalogue
from .arguments import settable
from .catalogue import Entry
from .efficiency import Efficiency
from .errors import MissingDataWarning, NotFoundError
from .gridded import Gridded
from .integrate import albedo
from .interface import Reflectance, direction
from .measurement import Measured
from .param import Option, Param, Table
from .parametrised import literal

INCIDENCE = (0.0, 45.0, 75.0)
"""Angles [degrees] at which `facts` gives the albedo."""


def matching(pattern: str | None) -> list[Entry]:
    """Built-in materials of which name, kind, description or alias holds the word, or matches its * and ?."""
    entries = catalogue.materials()
    if not pattern:
        return entries
    wanted = pattern.lower() if any(c in pattern for c in "*?[") else f"*{pattern.lower()}*"
    found = [
        e
        for e in entries
        if any(fnmatch.fnmatchcase(x.lower(), wanted) for x in (e.name, e.kind, e.description, *e.aliases))
    ]
    if not found:
        raise NotFoundError(f"no built-in material matches {pattern!r}{catalogue.hint(pattern)}")
    return found


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Aligned columns. On a terminal the last is wrapped to the width, below the others for want of room."""
    lines = [tuple(header), *rows]
    widths = [max(len(line[c]) for line in lines) for c in range(len(header) - 1)]
    start = sum(w + 2 for w in widths)
    below = _width() - start < 30
    if below:
        start = 4
    text = []
    for i, line in enumerate(lines):
        first = "".join(f"{cell:<{w}}  " for cell, w in zip(line, widths, strict=False))
        wrapped = textwrap.wrap(line[-1], _width() - start) or [""]
        if below:
            text.append(_heading(first.rstrip(), i == 0))
        else:
            text.append(_heading((first + wrapped.pop(0)).rstrip(), i == 0))
        text += [_heading(" " * start + more, i == 0) for more in wrapped]
    return "\n".join(text)


def efficiency_table(rows: Iterable[Efficiency]) -> str:
    """Rows of `sampling_efficiency`, aligned, with what the columns mean."""
    header = ("theta_o", "lobe", "chosen", "mean weight", "scatter", "effective", "lost")
    cells = [
        (f"{r.theta_o:g}", r.lobe, f"{r.chosen:.1%}", f"{r.mean:.4g}", f"{r.scatter:.3g}", f"{r.effective:.1%}",
         f"{r.lost:.2%}")
        for r in rows
    ]  # fmt: skip
    meaning = (
        "scatter: standard deviation of a weight over the mean; effective: as many samples of equal weight would say "
        "as much; lost: below the horizon"
    )
    return table(header, cells) + "\n" + "\n".join(textwrap.wrap(meaning, min(_width(), 100)))


def _heading(line: str, bold: bool) -> str:
    return click.style(line, bold=True) if bold and line else line


def _width() -> int:
    return shutil.get_terminal_size((100, 24)).columns if sys.stdout.isatty() else 10_000


def facts(text: str, m: Reflectance) -> dict[str, Any]:
    """What there is to know about the material that `text` named, as JSON data."""
    found: dict[str, Any] = {"material": text, "type": type(m).__name__}
    entry = None if isinstance(m, Measured) else catalogue.find(text)
    if entry is not None:
        found |= {"built_in": entry.kind, "description": entry.description, "source": entry.source}
    if isinstance(m, Measured):
        found |= _file_facts(m)
    else:
        found["expression"] = repr(m)
    up = np.array([0.0, 0.0, 1.0])
    shape = m.f(up, up).shape
    names = m.channel_names
    found["channels"] = shape[-1] if shape else 1
    found["channel_names"] = list(names) if names is not None else list("RGB") if shape[-1:] == (3,) else None
    found["has_delta"] = bool(m.has_delta)
    found["breaks"] = m.breaches()
    if len(shape) < 2:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MissingDataWarning)
            rho = albedo(m, direction(np.radians(INCIDENCE), 0.0), tolerance=1e-3)
        found["albedo"] = {"theta_i": list(INCIDENCE), "values": rho.tolist()}
    if isinstance(m, Gridded):
        found |= _uncertainty(m)
    parameters, options = {}, {}
    for path, declared, value in settable(m):
        if isinstance(declared, Param) and path in m.parameters:
            p = m.parameters[path]
            listed = value.tolist() if isinstance(value, np.ndarray) else value
            parameters[path] = {"value": listed, "low": p.low, "high": p.high, "unit": p.unit, "doc": p.doc}
            if declared.alias:
                parameters[path]["alias"] = path.removesuffix(declared.name) + declared.alias
        elif isinstance(declared, Option):
            options[path] = {
                "value": value,
                "choices": list(dict.fromkeys(declared.choices)),
                "doc": declared.doc,
            }
    return found | {"parameters": parameters, "options": options}


def _file_facts(m: Measured) -> dict[str, Any]:
    """What a file holds: of all numbers of its main table, those missing and those below 0."""
    valid = m.valid
    values = next(v for n, f in m.fields.items() if isinstance(f, Table) and (v := getattr(m, n)).shape == valid.shape)
    about = {k: v.tolist() if hasattr(v, "tolist") else v for k, v in m.about.items() if k != "repairs"}
    return {
        "path": m.path,
        "bytes": os.path.getsize(m.path) if os.path.exists(m.path) else None,
        "format": m.format,
        "quantity": m.quantity,
        "about": about,
        "published_as": getattr(m, "published", None),
        "shape": list(valid.shape),
        "missing": float(1.0 - valid.mean()),
        "negative": float((values[valid] < 0.0).mean()) if valid.any() else 0.0,
        "repairs": [{**r.to_json(), "summary": str(r)} for r in m.repairs],
    }


def _uncertainty(m: Gridded) -> dict[str, Any]:
    """What a table says about its uncertainty, and what follows for its albedo."""
    from .uncertainty import with_uncertainty
    from .uncertainty.table import has_uncertainty, stated

    if not has_uncertainty(m):
        return {}
    at = direction(np.radians(INCIDENCE), 0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)
        u = {c: with_uncertainty(albedo, m, at, correlation=c, tolerance=1e-3).u for c in ("independent", "common")}
    return {"uncertainty": {**stated(m), "of_albedo": {c: x.tolist() for c, x in u.items()}}}


def _uncertainty_rows(found: dict[str, Any]) -> list[tuple[str, str]]:
    said = found["uncertainty"]
    parts = []
    if "relative" in said:
        parts.append(f"{said['relative']:.2g} of the value (median)")
        if said["unknown"] > 0.0:
            parts.append(f"unknown for {said['unknown']:.2%} of the values")
    if said["scale"]:
        parts.append(f"{said['scale']:.2g} of scale")
    rows = [("standard u", ", ".join(parts))]
    for assumed, values in said["of_albedo"].items():
        at = ", ".join(f"{_spectrum(v)} at {t:g}°" for t, v in zip(INCIDENCE, values, strict=True))
        rows.append(("u of albedo", f"{at}, of {assumed} errors"))
    return rows


def facts_as_text(found: dict[str, Any]) -> str:
    """The same for people."""
    rows = [("name", found["material"])]
    if "built_in" in found:
        rows.append(("built in", f"{found['built_in']}: {found['description']}"))
    if "format" in found:
        rows.append(
            (
                "format",
                f"{found['format']}, {size_in_words(found['bytes'])}" if found["bytes"] else found["format"],
            )
        )
        rows.append(("quantity", found["quantity"]))
        if found["published_as"]:
            rows.append(("recognised", f"bit by bit the published file of {found['published_as']}"))
        rows += [(k.replace("_", " "), str(v)) for k, v in found["about"].items() if v not in ("", None)]
        rows.append(("table", " x ".join(map(str, found["shape"]))))
        rows.append(("missing", _share(found["missing"])))
        rows.append(("negative", _share(found["negative"])))
        rows += [("repaired", r["summary"]) for r in found["repairs"]]
    else:
        rows.append(("formula", found["expression"]))
    rows.append(("channels", _channels(found)))
    if "albedo" in found:
        values = found["albedo"]["values"]
        parts = [f"{_spectrum(v)} at {t:g}°" for t, v in zip(found["albedo"]["theta_i"], values, strict=True)]
        rows.append(("albedo", ", ".join(parts)))
    if "uncertainty" in found:
        rows += _uncertainty_rows(found)
    if found["has_delta"]:
        rows.append(("mirror", "has a delta lobe: f is 0 pointwise, sampling and integrals are exact"))
    rows += [("may break", f"{law}: {why}") for law, why in found["breaks"].items()]
    if "source" in found:
        rows.append(("source", found["source"]))
    text = table(("", ""), rows).removeprefix("\n")
    listed = [
        (path, _value(p["value"]), f"{_number(p['low'])} ... {_number(p['high'])}", _meaning(p))
        for path, p in found["parameters"].items()
    ]
    listed += [
        (path, o["value"], "a word", f"{o['doc']}: {', '.join(o['choices'])}") for path, o in found["options"].items()
    ]
    if listed:
        text += "\n\n" + table(("parameter", "value", "bounds", "meaning"), listed)
    return text


def _meaning(parameter: dict[str, Any]) -> str:
    unit = "" if parameter["unit"] == "1" else f" [{parameter['unit']}]"
    alias = parameter.get("alias", "").rpartition(".")[2]
    return parameter["doc"] + unit + (f"; {alias} sets it with what is tied to it" if alias else "")


def _share(x: float) -> str:
    if x == 0.0:
        return "none"
    return f"{x:.2%} of the table" if x >= 1e-4 else f"{x:.1e} of the table"


def size_in_words(n: int) -> str:
    """A number of bytes, to three digits."""
    for unit, size in (("MB", 1e6), ("kB", 1e3)):
        if n >= size:
            return f"{n / size:.3g} {unit}"
    return f"{n} bytes"


def _channels(found: dict[str, Any]) -> str:
    names, count = found["channel_names"], found["channels"]
    if names is None:
        return "1: gray" if count == 1 else str(count)
    if isinstance(names[0], str):
        return f"{count}: linear {''.join(names)}" if names == list("RGB") else f"{count}: {', '.join(names)}"
    if count <= 4:
        return f"{count}: {', '.join(f'{x:g}' for x in names)} nm"
    return f"{count}: {names[0]:g} to {names[-1]:g} nm"


def _spectrum(values: Any) -> str:
    values = np.atleast_1d(values)
    if len(values) <= 4:
        return " ".join(f"{v:.3g}" for v in values)
    return f"{np.min(values):.3g} to {np.max(values):.3g}"


def _number(x: float) -> str:
    return "inf" if math.isinf(x) else f"{x:g}"


def _value(value: Any) -> str:
    flat = np.ravel(value)
    if np.ndim(value) == 0:
        return f"{value:.6g}"
    if np.ndim(value) > 1:
        return f"{literal(np.asarray(value))[:30]} ..."
    shown = ", ".join(f"{v:.5g}" for v in flat[:3])
    return shown if len(flat) <= 3 else f"{shown}, ... ({len(flat)})"
