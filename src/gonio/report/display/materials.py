"""Materials, terms of formulas and lights: formula, picture, parameters with units and bounds; what a file holds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ...base.light import Light
from ...base.map_shape import map_shape
from ...base.measured import Measured
from ...base.reflectance import Reflectance
from ...declared.contents import summary
from ...facts import words
from ...facts.material import facts, settable
from ...formula.parametrised import Parametrised
from . import _sphere
from ._html import Cut, Raw, code, image, paragraph, sparkline, swatch, table, text
from ._things import html_of, numbers, png_of, short

ENDLESS = 1e30
"""The bound of what is not bounded."""


@html_of.register
def _value(thing: Parametrised) -> Cut:
    """A term of a formula: a distribution, a Fresnel term, a layer."""
    return Cut(type(thing).__name__, _summary(thing), parts=(code(repr(thing)), _parameters(settable(thing))))


@html_of.register
def _light(light: Light) -> Cut:
    parts = (code(repr(light)), _parameters(settable(light)))
    shown = getattr(light, "image", None)
    pixels = getattr(shown, "pixels", None)
    beside = ""
    if isinstance(pixels, np.ndarray) and pixels.ndim == 3 and pixels.shape[-1] in (1, 3):
        step = max(1, pixels.shape[1] // 240)
        beside = image(_sphere.png(pixels[::step, ::step], None), 240, "the environment")
    return Cut(type(light).__name__, _summary(light), beside, parts)


@html_of.register
def _material(m: Reflectance) -> Cut:
    about = facts(repr(m), m, computed=False)
    parts = (code(about["expression"]), paragraph(_in_words(about), quiet=True), _parameters(about))
    return Cut(type(m).__name__, _summary(m), _picture(m), parts)


@html_of.register
def _measured(m: Measured) -> Cut:
    about = facts(repr(m), m, computed=False)
    parts = (table(("", ""), _held(about)), paragraph(_in_words(about), quiet=True), _parameters(about))
    name = Path(m.path).name if m.path else type(m).__name__
    return Cut(name, f"{about['format']}, {about['quantity']}", _picture(m), parts)


@png_of.register
def _png(m: Reflectance) -> bytes | None:
    return _sphere.picture(m)


def _picture(m: Reflectance) -> str:
    """A sphere, where one can be made: what is said of a material does not depend on it."""
    with suppress(Exception):
        shape = map_shape(m)
        what = "the places of the map, seen along the normal" if shape else "a lit sphere"
        return image(_sphere.picture(m), _sphere.SIZE, what)
    return ""


def _summary(thing: Any) -> str:
    """The first words of the docstring of a class."""
    return summary(type(thing)).replace("`", "")[:160]


def _in_words(about: dict[str, Any]) -> str:
    """What is said of every material."""
    return "; ".join(f"{name} {text}".strip() for name, text in words.optics(about))


def _parameters(about: dict[str, Any]) -> str:
    """The parameters and options that can be set."""
    rows = []
    for path, p in about["parameters"].items():
        bounds = " … ".join("∞" if x >= ENDLESS else "-∞" if x <= -ENDLESS else f"{x:g}" for x in (p["low"], p["high"]))
        shown = _number(p["value"], "" if p["unit"] == "1" else f" {p['unit']}")
        rows.append((Raw(f"<code>{text(path)}</code>"), shown, bounds, p["doc"]))
    for path, o in about["options"].items():
        rows.append((Raw(f"<code>{text(path)}</code>"), o["value"], ", ".join(o["choices"]), o["doc"]))
    return table(("parameter", "value", "bounds", "meaning"), rows, "m.parameters")


def _number(value: Any, unit: str) -> str | Raw:
    """A number or several, with a colour or a curve beside them where that says more."""
    value = np.asarray(value) if isinstance(value, list) else value
    if np.ndim(value) == 0:
        return short(float(value) if isinstance(value, (int, float, np.floating)) else value) + unit
    if not isinstance(value, np.ndarray) or value.ndim > 1 or value.dtype.kind not in "fiu":
        return short(value) + unit
    if value.shape == (3,) and not unit and ((value >= 0.0) & (value <= 1.0)).all():
        return Raw(swatch(value.tolist()) + text(numbers(value)))
    if len(value) > 4:
        span = f"{np.nanmin(value):.3g} … {np.nanmax(value):.3g}{unit}, {len(value)} numbers"
        return Raw(sparkline(value.tolist()) + text(span))
    return numbers(value) + unit


def _held(about: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """What a file says of itself, holds and lacks."""
    if about["published_as"]:
        yield "recognized", f"the published file of {about['published_as']}"
    yield from ((name, short(text)) for name, text in words.notes(about))
    yield from ((name, text) for name, text in words.contents(about) if name != "quantity")
    if digest := about["provenance"].get("sha256"):
        yield "sha256", Raw(code(digest))
