"""Layers of a picture: which of many named channels are one picture, and in which order.

`albedo.R` is channel R of layer `albedo`; what has no dot belongs to the unnamed layer "". Wavelengths and numbers are
no layers: `T.380,0nm.550,0nm` is a channel of layer `T`, `450.0` one of the unnamed layer.

Source   "Technical Introduction to OpenEXR", on layers; Fichet et al. 2021, on wavelengths.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ...errors import suggestion
from ._source import Unsettled

ALL = "*"
"""The word for all channels, whatever they are."""

_COLOURS = (("r", "g", "b"), ("red", "green", "blue"))
_DECIMAL = re.compile(r"[+-]?\d*\.\d+(?![.\d])")
_WAVELENGTH = re.compile(r"(?<![\d,])\d[\d,]*([eE][+-]?\d+)?[A-Za-z]{0,2}(m|Hz)")
_LISTED = 12


class PictureLayer(NamedTuple):
    """Some channels of a part of a file, colours first.

    channels   by their full names
    coverage   the channel that is their coverage, or ""
    is_rgb     whether the channels are red, green and blue
    beside     channels of the same layer that are left out, since these are the colours
    """

    part: int
    name: str
    channels: tuple[str, ...]
    coverage: str = ""
    is_rgb: bool = False
    beside: tuple[str, ...] = ()

    def __str__(self) -> str:
        short_names = [
            x.rpartition(".")[2] if self.is_rgb else x for x in (*self.channels, self.coverage, *self.beside) if x
        ]
        return f"{self.name!r} ({', '.join(short_names[:5])}{', ...' if len(short_names) > 5 else ''})"


def chosen(parts: Sequence[tuple[str, Sequence[str]]], wanted: str | None) -> PictureLayer:
    """The layer that is asked for, of parts (name, channels); where none is, the only one. Raises Unsettled."""
    if wanted == ALL:
        return _whole(0, ALL, parts[0][1])
    layers = [
        layer._replace(name=".".join(filter(None, [name, layer.name])) if len(parts) > 1 else layer.name)
        for part, (name, channels) in enumerate(parts)
        for layer in _split(part, channels)
    ]
    matches = layers if wanted is None else _named(wanted, layers, parts)
    if len(matches) == 1:
        return matches[0]
    told = [str(x) for x in matches or layers]
    listed = f"{', '.join(told[:_LISTED])}{', ...' if len(told) > _LISTED else ''}"
    first = (matches or layers)[0].name
    example = f"gn.scenes.load_image(path, layer={first!r}) in place of the path, or FILE:{first} on the command line"
    if matches:
        raise Unsettled(f"{len(matches)} layers, {listed}: expected one of them: {example}")
    choices = [*(x.name for x in layers), *(x for _, channels in parts for x in channels)]
    raise Unsettled(f"layer={wanted!r:.60}: expected one of {listed}: {example}{suggestion(str(wanted), choices)}")


def _named(wanted: str, layers: list[PictureLayer], parts: Sequence[tuple[str, Sequence[str]]]) -> list[PictureLayer]:
    """The layers of this name; else those of other parts, the channel, or the layers below one of this name."""
    alone = [PictureLayer(part, x, (x,)) for part, (_, channels) in enumerate(parts) for x in channels if x == wanted]
    return (
        [x for x in layers if x.name == wanted]
        or [x for x in layers if wanted and x.name.endswith(f".{wanted}") and len(parts) > 1]
        or alone
        or [x for x in layers if wanted and x.name.startswith(f"{wanted}.")]
    )


def _split(part: int, channels: Sequence[str]) -> Iterator[PictureLayer]:
    """The layers of a part."""
    by_layer: dict[str, list[str]] = {}
    for channel in channels:
        by_layer.setdefault(_layer_of(channel), []).append(channel)
    shared = "A" if by_layer.get("") == ["A"] and len(by_layer) > 1 else ""  # what gonio writes beside names with dots
    for name in sorted(by_layer.keys() - {"" if shared else None}, key=natural):
        layer = _whole(part, name, by_layer[name])
        layer = layer._replace(coverage=layer.coverage or shared)
        colours, others = layer.channels[:3], layer.channels[3:]
        letters = others and {x.rpartition(".")[2].lower() for x in colours} == {*_COLOURS[0]}
        yield layer._replace(channels=colours, is_rgb=True, beside=others) if letters else layer


def _layer_of(channel: str) -> str:
    """The name of a channel's layer."""
    pieces = [""] if _DECIMAL.match(channel) else channel.split(".")
    if len(pieces) > 1 and _WAVELENGTH.fullmatch(pieces[-1]):
        while len(pieces) > 1 and _WAVELENGTH.fullmatch(pieces[-1]):
            pieces.pop()
    else:
        pieces.pop()
    return ".".join(pieces)


def _whole(part: int, name: str, channels: Sequence[str]) -> PictureLayer:
    """A layer of all these channels: red, green, blue, then the others by name; coverage apart."""
    last = {x.rpartition(".")[2] if _layer_of(x) == name else x: x for x in channels}
    lower = {word.lower(): x for word, x in sorted(last.items(), reverse=True)}
    rgb = next((tuple(lower[x] for x in colours) for colours in _COLOURS if {*colours} <= lower.keys()), ())
    coverage = last.get("A") or (rgb and (lower.get("a") or lower.get("alpha"))) or ""
    if len(channels) == 1:
        coverage = ""
    others = sorted((x for x in channels if x not in rgb and x != coverage), key=natural)
    return PictureLayer(part, name, (*rgb, *others), coverage, bool(rgb) and not others)


def natural(name: str) -> tuple[list[str | float], str]:
    """A key by which ch2 comes before ch10."""
    pieces = re.split(r"(^[0-9]*\.[0-9]+|[0-9]+)", name)
    return [float(x) if k % 2 else x for k, x in enumerate(pieces)], name
