"""`gonio shader-source`: a material's formula as source text."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import ParameterError, visible
from . import options
from .command import TypedArguments, command
from .terminal import echo


@command("engine.shader_source", short_help="Print the formula of MATERIAL as source code.")
@options.material_argument
@options.output_option("File to write; its large tables lie beside it.", required=False)
def shader_source(material: options.TypedMaterial, output: Path | None, asked: TypedArguments) -> None:
    """Print the formula of MATERIAL as source code for a renderer: readable, with citations, nothing to link against.

    \b
    Examples:
      gonio shader-source gold --language glsl
      gonio shader-source "Phong(0.1, 20)" --language c --function f,pdf -o a.c
      gonio shader-source measured.bsdf --language osl -o measured.osl
    """
    from ..files import target

    if output is not None:
        target(output)
    text = asked.call("engine.shader_source", material.read())
    if output is not None:
        files = text.save(output)
        echo(visible(f"{', '.join(map(str, files))}: {', '.join(text.functions)}"))
        return
    if text.tables:
        names = ", ".join(table.name for table in text.tables)
        raise ParameterError(
            f"{material.text}: the text reads large tables ({names:.80}); write them too, with -o FILE"
        )
    click.echo(text.text, nl=not text.text.endswith("\n"))
