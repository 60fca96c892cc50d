"""Arguments of several commands: MATERIAL with -p, lights, a file to write; and words about them."""

from __future__ import annotations

import math
import os
import textwrap
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..declared.discover import docstring
from ..errors import ParameterError
from ..lights._words import DEFAULT, words
from .angles import Angle
from .completion import lights, materials

if TYPE_CHECKING:
    from ..base.light import Light
    from ..base.reflectance import Reflectance

READING = "gonio.reading"
"""Where the context of a command holds the options that MATERIAL is read with."""


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


def material_argument(command: Callable) -> Callable:
    """MATERIAL, and the options to read its file with."""
    return click.argument("material", shell_complete=materials)(reading_option(command))


replace_option = click.option(
    "-p",
    "--parameter",
    "replaced",
    metavar="NAME=VALUE",
    multiple=True,
    help="Replace a parameter, by its name or path; may be repeated. `gonio info MATERIAL` lists them.",
)
lights_option = click.option(
    "-l",
    "--light",
    "lights",
    metavar="LIGHT",
    shell_complete=lights,
    multiple=True,
    help=f"Where the light comes from, see above; may be repeated.  [default: {DEFAULT}, gray for bands]",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")
samples_option = click.option("--samples", default=32, show_default=True, help="Samples per pixel.")

bands_option = click.option(
    "--bands",
    metavar="RED,GREEN,BLUE",
    help="Channels shown as red, green and blue, by name or wavelength in nm: nir,red,green; one is shown in gray.",
)


def output_option(help_: str) -> Callable:
    """The file to write."""
    return click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help=help_)


def theta_max_option(help_: str) -> Callable:
    """The largest polar angle of what is used."""
    return click.option("--theta-max", type=Angle(0.0, 90.0, True), default="90", show_default=True, help=help_)


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


def read_material(material: str, replaced: Sequence[str]) -> Reflectance:
    """The material, with parameters replaced."""
    from ..catalogue.typed import with_parameters
    from .arguments import resolve

    return with_parameters(resolve(material, click.get_current_context().meta.get(READING, ())), replaced)


def read_lights(lights: Sequence[str]) -> list[Light] | None:
    """The lights, or None for the default one."""
    from .arguments import resolve_light

    return [resolve_light(text) for text in lights] or None


def bands_of(text: str | None) -> list[str | float] | None:
    """The names, and wavelengths [nm], of --bands."""
    if text is None:
        return None
    from ..formats._reading import plain_text

    words = [word.strip() for word in text.split(",")]
    return [float(word) if plain_text.is_number(word) else word for word in words]


def place(text: str, option: str) -> list[float]:
    """The three coordinates of an option."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise ParameterError(f"{option} {text!r:.60}: expected three finite numbers, such as 1.5,-3,1.6")
    return numbers


def title_of(material: str, replaced: Sequence[str]) -> str:
    """MATERIAL, a file by its name alone, and its -p, in a line."""
    name = Path(material).name if os.path.exists(material) else material
    return ", ".join([name, *replaced])


def under(lights: Sequence[str]) -> str:
    """The lights, in words."""
    return f"under {', '.join(lights) or DEFAULT}"


def since(start: float) -> str:
    """Seconds since a moment of `time.perf_counter`."""
    return f"{time.perf_counter() - start:.1f} s"
