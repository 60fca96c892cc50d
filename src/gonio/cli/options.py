"""Arguments of several commands: MATERIAL with -p, lights, a file to write; and words about them."""

from __future__ import annotations

import functools
import os
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from ..declared.arguments import Declared
from ..declared.discover import docstring
from ..declared.typed import is_number
from ..lights._words import DEFAULT, words
from .command import option
from .completion import lights, materials

if TYPE_CHECKING:
    from ..base.light import Light
    from ..base.reflectance import Reflectance

READING = "gonio.reading"
"""Where the context of a command holds the options that MATERIAL is read with."""


class TypedMaterial(NamedTuple):
    """MATERIAL and its -p, as typed."""

    text: str
    replaced: tuple[str, ...] = ()

    def read(self) -> Reflectance:
        """The material, with parameters replaced, by the options to read a file with."""
        from ..catalogue.typed import with_parameters
        from .arguments import resolve

        return with_parameters(resolve(self.text, click.get_current_context().meta.get(READING, ())), self.replaced)

    @property
    def title(self) -> str:
        """The text, a file by its name alone, and -p, in a line."""
        name = Path(self.text).name if os.path.exists(self.text) else self.text
        return ", ".join([name, *self.replaced])


class Lit(NamedTuple):
    """The lights of a picture, and the channels that it shows, as typed."""

    lights: tuple[str, ...]
    channels: str | None = None

    def read(self) -> dict[str, Any]:
        """`lights`, None for the default one, and `channels`, names or wavelengths [nm], of functions that draw."""
        channels = None if self.channels is None else [word.strip() for word in self.channels.split(",")]
        return {"lights": self.sources(), "channels": channels and [float(x) if is_number(x) else x for x in channels]}

    def sources(self) -> list[Light] | None:
        """The lights, or None for the default one."""
        from .arguments import resolve_light

        return [resolve_light(text) for text in self.lights] or None

    def __str__(self) -> str:
        return f"under {', '.join(self.lights) or DEFAULT}"


def together(name: str, fields_class: Callable, *decorators: Callable) -> Callable:
    """Parameters of a command, which gets them as one NamedTuple of this kind."""

    def decorate(command: Callable) -> Callable:
        @functools.wraps(command)
        def call(**values: Any) -> Any:
            one = fields_class(*(values.pop(field) for field in fields_class._fields))  # type: ignore[attr-defined]  # NamedTuples
            return command(**{name: one}, **values)

        for add in reversed(decorators):
            add(call)
        return call

    return decorate


def _note_reading(ctx: click.Context, param: click.Parameter, texts: tuple[str, ...]) -> None:
    ctx.meta[READING] = texts


reading_option = click.option(
    "-O",
    "--reading",
    metavar="NAME=VALUE",
    multiple=True,
    expose_value=False,
    callback=_note_reading,
    help="Option to read a file with, as skip=12; may be repeated. `gonio formats FORMAT` lists them.",
)
replace_option = click.option(
    "-p",
    "--parameter",
    "replaced",
    metavar="NAME=VALUE",
    multiple=True,
    help="Replace a parameter, by its name or path; may be repeated. `gonio info MATERIAL` lists them.",
)
material_argument = together(
    "material",
    TypedMaterial,
    click.argument("text", metavar="MATERIAL", shell_complete=materials),
    replace_option,
    reading_option,
)
"""MATERIAL, -p, and the options to read its file with."""

SHOWN = "channels shown as red, green and blue, by name or wavelength in nm: nir,red,green; one is shown in gray"

lights_option = click.option(
    "-l",
    "--light",
    "lights",
    metavar="LIGHT",
    shell_complete=lights,
    multiple=True,
    help=f"Where the light comes from, see above; may be repeated.  [default: {DEFAULT}, gray for bands]",
)
lit_options = together(
    "lit",
    Lit,
    lights_option,
    option("--channels", means=Declared(SHOWN), metavar="RED,GREEN,BLUE"),
)
exposure_option = option(
    "--exposure",
    kind=float,
    means=Declared("stops by which what is written is brightened, but for .exr and .hdr", -200.0, 200.0),
    default=0.0,
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")


def output_option(help_: str, required: bool = True) -> Callable:
    """The file to write."""
    return click.option(
        "-o", "--output", metavar="FILE", required=required, type=click.Path(path_type=Path), help=help_
    )


def with_light_help(command: Callable) -> Callable:
    """Add to a command's help the words for LIGHT that the lights declare."""
    start = max(len(word.usage) for word in words()) + 4
    entries = [(f"  {word.usage}".ljust(start), word.meaning) for word in words()]
    lines = [textwrap.fill(head + text, start + 50, subsequent_indent=" " * start) for head, text in entries]
    command.__doc__ = docstring(command) + LIGHT_HELP.replace("WORDS", "\n".join(lines))
    return command


LIGHT_HELP = """

\b
LIGHT is one of
WORDS

Angles are in degrees, PHI from +x towards +y; the sphere has radius 1 and is at 0,0,0, z is up, the
camera looks along +y: distant:45,-90 comes from behind it. L, E and I are a number, or one per channel
(constant:1,0.9,0.8).
"""


def since(start: float) -> str:
    """Seconds since a moment of `time.perf_counter`."""
    return f"{time.perf_counter() - start:.1f} s"
