"""`gonio source`: a material's formula as source text."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import ParameterError, visible
from . import completion, options
from .terminal import echo


@click.command(short_help="Print the formula of MATERIAL as source code.")
@options.material_argument
@options.replace_option
@click.option(
    "--language",
    default="glsl",
    show_default=True,
    shell_complete=completion.languages,
    help="c, cuda, glsl, hlsl, osl or wgsl.",
)
@click.option(
    "--function",
    "functions",
    default="f",
    show_default=True,
    metavar="NAME,..",
    help="What to write, with commas between: f, f_cos, pdf, sample, jacobian, mueller.",
)
@click.option("--name", default="", help="Begins all global names of the text.  [default: a word for the material]")
@click.option(
    "--parameters",
    default="constants",
    show_default=True,
    help="constants: numbers in the text; arguments: each parameter follows the directions.",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File to write; its large tables lie beside it.")
def source(
    material: str,
    replaced: tuple[str, ...],
    language: str,
    functions: str,
    name: str,
    parameters: str,
    output: Path | None,
) -> None:
    """Print the formula of MATERIAL as source code for a renderer: readable, with citations, nothing to link against.

    \b
    Examples:
      gonio source gold --language glsl
      gonio source "Microfacet(GGX(0.1))" --language c --function f,pdf -o a.c
      gonio source measured.bsdf --language osl -o measured.osl
    """
    from ..bridges.source import source as written
    from ..files import target

    if output is not None:
        target(output)
    words = [word.strip() for word in functions.split(",") if word.strip()]
    text = written(options.read_material(material, replaced), language.lower(), words, name, parameters)
    if output is not None:
        files = text.save(output)
        echo(visible(f"{', '.join(map(str, files))}: {', '.join(text.functions)}"))
        return
    if text.tables:
        names = ", ".join(table.name for table in text.tables)
        raise ParameterError(f"{material}: the text reads large tables ({names:.80}); write them too, with -o FILE")
    click.echo(text.text, nl=not text.text.endswith("\n"))
