"""Arguments of several commands: MATERIAL with -p, lights, a file to write; and words about them."""

from __future__ import annotations

import os
import textwrap
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..discover import docstring
from ..lights._words import DEFAULT, words

if TYPE_CHECKING:
    from ..base.light import Light
    from ..base.reflectance import Reflectance

material_argument = click.argument("material")
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
    multiple=True,
    help=f"Where the light comes from, see above; may be repeated.  [default: {DEFAULT}, gray for bands]",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")
samples_option = click.option("--samples", default=32, show_default=True, help="Samples per pixel.")


def output_option(help_: str) -> Callable:
    """The file to write."""
    return click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help=help_)


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
    from .arguments import resolve, with_parameters

    return with_parameters(resolve(material), replaced)


def read_lights(lights: Sequence[str]) -> list[Light] | None:
    """The lights, or None for the default one."""
    from .arguments import resolve_light

    return [resolve_light(text) for text in lights] or None


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
