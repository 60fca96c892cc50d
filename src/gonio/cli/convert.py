"""`gonio convert`: a material written to a file of another format, with the changes that follow."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click

from ..declared.arguments import Declared
from ..errors import visible
from . import completion
from .command import TypedArguments, command, option
from .options import TypedMaterial, json_option, reading_option, replace_option, since, together
from .tables import size_in_words, table
from .terminal import echo, print_json


@command("convert", short_help="Write a material to a file of another format.")
@together(
    "material", TypedMaterial, click.argument("text", metavar="IN", shell_complete=completion.materials), replace_option
)
@click.argument("output", metavar="OUT", type=click.Path(path_type=Path))
@reading_option
@option("--resolution", means=Declared("nodes along each axis, of formats that leave a choice"), metavar="N,N,..")
@click.option("--option", "options", metavar="NAME=VALUE", multiple=True, help="Option of the format; may be repeated.")
@json_option
def convert(
    material: TypedMaterial,
    output: Path,
    resolution: str | None,
    options: tuple[str, ...],
    as_json: bool,
    asked: TypedArguments,
) -> None:
    """Write the material IN to the file OUT, and report changes and losses.

    IN is any MATERIAL. The format is that of OUT's suffix, or the one named; `gonio formats` lists them all.
    Changes are measured: the file is read again and compared with IN, at pairs of directions on and between the
    nodes of both, and in albedo.

    \b
    Examples:
      gonio convert steel.binary steel.bsdf --format rgl
      gonio convert gold gold.bsdf --format rgl --resolution 128
    """
    from ..formats import target, writer
    from ..formats._options import of_texts

    start = time.perf_counter()
    module = writer(output, **asked.of("convert"))
    target(module, output)
    texts = [*([] if resolution is None else [f"resolution={resolution}"]), *options]
    chosen = of_texts(module, "write", texts)
    conversion = asked.call("convert", material.read(), output, format=module.NAME, **chosen)
    if as_json:
        print_json({**conversion.to_json(), "material": material.title})
        return
    size = size_in_words(conversion.bytes)
    echo(visible(f"{output}: {material.title} as {conversion.format}, {size}, {since(start)}"))
    echo(conversion_as_text(conversion))


def conversion_as_text(conversion: Any) -> str:
    """Changes and losses of a conversion as a table."""
    return table(("", ""), conversion.rows()).removeprefix("\n")
