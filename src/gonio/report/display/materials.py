"""Materials, terms of formulas and lights: formula, picture, parameters with units and bounds; what a file holds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ...base.light import Light
from ...base.measured import Measured
from ...base.reflectance import Reflectance
from ...contents import summary
from ...evaluate import batch
from ...formula.fields import Option, Param
from ...formula.parametrised import Parametrised
from ...tables.angle_systems import SYSTEMS
from . import _sphere
from ._html import Cut, Raw, code, image, paragraph, sparkline, swatch, table, text
from ._things import html_of, png_of, short

ENDLESS = 1e30
"""The bound of what is not bounded."""


@html_of.register
def _value(thing: Parametrised) -> Cut:
    """A term of a formula: a distribution, a Fresnel term, a layer."""
    return Cut(type(thing).__name__, _summary(thing), parts=(code(repr(thing)), _parameters(thing)))


@html_of.register
def _light(light: Light) -> Cut:
    parts = (code(repr(light)), _parameters(light))
    shown = getattr(light, "image", None)
    pixels = getattr(shown, "pixels", None)
    beside = ""
    if isinstance(pixels, np.ndarray) and pixels.ndim == 3 and pixels.shape[-1] in (1, 3):
        step = max(1, pixels.shape[1] // 240)
        beside = image(_sphere.png(pixels[::step, ::step], None), 240, "the environment")
    return Cut(type(light).__name__, _summary(light), beside, parts)


@html_of.register
def _material(m: Reflectance) -> Cut:
    parts = [code(repr(m)), paragraph(_in_words(m), quiet=True), _parameters(m)]
    return Cut(type(m).__name__, _summary(m), _picture(m), tuple(parts))


@html_of.register
def _measured(m: Measured) -> Cut:
    from ...facts.material import facts

    about = facts(repr(m), m, computed=False)
    rows = list(_contents(about, m))
    words = f"{about['format']}, {about['quantity']}"
    parts = (table(("", ""), rows), paragraph(_in_words(m), quiet=True), _parameters(m))
    return Cut(Path(m.path).name if m.path else type(m).__name__, words, _picture(m), parts)


@png_of.register
def _png(m: Reflectance) -> bytes | None:
    return _sphere.picture(m)


def _picture(m: Reflectance) -> str:
    """A sphere, where one can be made: what is said of a material does not depend on it."""
    with suppress(Exception):
        shape = batch.full_shape(m, ())
        what = "the places of the map, seen along the normal" if shape else "a lit sphere"
        return image(_sphere.picture(m), _sphere.SIZE, what)
    return ""


def _summary(thing: Any) -> str:
    """The first words of the docstring of a class."""
    return summary(type(thing)).replace("`", "")[:160]


def _in_words(m: Reflectance) -> str:
    """Channels, places of a map, sides and the delta lobe."""
    names, count = m.channel_names, m.channels or 1
    channels = "gray" if count == 1 else "red, green, blue" if count == 3 and names is None else f"{count} channels"
    if names is not None and count > 1:
        number = all(not isinstance(name, str) for name in names)
        listed = ", ".join(f"{x:g}" if number else str(x) for x in names) if count <= 4 else ""
        channels = f"{listed}{' nm' if number else ''}" if listed else f"{count} channels"
        if number and not listed:
            channels += f", {min(names):g} to {max(names):g} nm"
    parts = [channels]
    if shape := batch.full_shape(m, ()):
        parts.append(f"a map of {' x '.join(map(str, shape))} places")
    if m.sides != "front":
        parts.append("transmits" if m.sides == "both" else f"sides: {m.sides}")
    if m.has_delta:
        parts.append("has a delta lobe")
    if broken := m.breaches():
        parts.append(f"may break: {', '.join(broken)}")
    return "; ".join(parts)


def _parameters(thing: Parametrised) -> str:
    """The parameters and options that can be set."""
    rows = []
    for path, declared, value in thing.settable():
        if isinstance(declared, Param) and path in thing.parameters:
            p = thing.parameters[path]
            bounds = " … ".join("∞" if x >= ENDLESS else "-∞" if x <= -ENDLESS else f"{x:g}" for x in (p.low, p.high))
            shown = _number(value, "" if p.unit == "1" else f" {p.unit}")
            rows.append((Raw(f"<code>{text(path)}</code>"), shown, bounds, p.doc))
        elif isinstance(declared, Option):
            choices = ", ".join(map(str, dict.fromkeys(declared.choices)))
            rows.append((Raw(f"<code>{text(path)}</code>"), str(value), choices, declared.doc))
    return table(("parameter", "value", "bounds", "meaning"), rows, "m.parameters")


def _number(value: Any, unit: str) -> str | Raw:
    """A number or several, with a colour or a curve beside them where that says more."""
    if np.ndim(value) == 0:
        return short(float(value) if isinstance(value, (int, float, np.floating)) else value) + unit
    if not isinstance(value, np.ndarray) or value.ndim > 1 or value.dtype.kind not in "fiu":
        return short(value) + unit
    if value.shape == (3,) and not unit and ((value >= 0.0) & (value <= 1.0)).all():
        return Raw(swatch(value.tolist()) + text(", ".join(f"{x:.4g}" for x in value)))
    if len(value) > 4:
        span = f"{np.nanmin(value):.3g} … {np.nanmax(value):.3g}{unit}, {len(value)} numbers"
        return Raw(sparkline(value.tolist()) + text(span))
    return ", ".join(f"{x:.4g}" for x in value) + unit


def _contents(about: dict[str, Any], m: Measured) -> Iterator[tuple[str, Any]]:
    """What a file holds, and what it lacks."""
    from ...conversion.conversion import percent

    if about["published_as"]:
        yield "recognised", f"the published file of {about['published_as']}"
    for name, value in about["about"].items():
        if value not in ("", None):
            yield (
                name.replace("_", " "),
                short("; ".join(map(str, value)) if isinstance(value, (list, tuple)) else value),
            )
    if grid := about["parameterisation"]:
        yield "grid", SYSTEMS[grid].title if grid in SYSTEMS else grid
    for name, axis in about["axes"].items():
        if axis["nodes"] == 1:
            yield name, f"{axis['low']:.4g}° only"
        else:
            step = "uneven" if axis["step"] is None else f"every {axis['step']:.4g}°"
            yield name, f"{axis['nodes']} nodes, {axis['low']:.4g}° to {axis['high']:.4g}°, {step}"
    if about["rows"]:
        yield "rows", f"{about['rows']} pairs of directions, in no grid"
    yield "table", " x ".join(map(str, about["shape"]))
    yield "holes", f"{percent(about['missing'])} of the table" if about["missing"] else "none"
    if about["negative"]:
        yield "negative", f"{percent(about['negative'])} of the table"
    if spread := about["uncertainty"]:
        low, middle, high = (percent(spread[name]) for name in ("low", "median", "high"))
        yield "uncertainty", f"{low} to {high} of the value, {middle} (median)"
    for repair in about["repairs"]:
        yield "repaired", repair["summary"]
    if digest := (about["provenance"] or {}).get("sha256"):
        yield "sha256", Raw(code(digest))
