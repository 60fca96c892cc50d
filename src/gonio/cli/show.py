"""`gonio show`: a material in one figure."""

from __future__ import annotations

import time
from pathlib import Path

import click

from ..errors import visible
from .options import (
    lights_option,
    material_argument,
    output_option,
    read_material,
    replace_option,
    samples_option,
    since,
    title_of,
    with_light_help,
)
from .terminal import bar, echo


@click.command(short_help="Draw MATERIAL in one figure.")
@material_argument
@output_option("Figure to write: .png, .jpg, .pdf or .svg.")
@lights_option
@replace_option
@click.option("--size", default=256, show_default=True, help="Width and height of the sphere in pixels.")
@samples_option
@with_light_help
def show(
    material: str, output: Path, lights: tuple[str, ...], replaced: tuple[str, ...], size: int, samples: int
) -> None:
    """Draw MATERIAL in one figure: slices in the plane of incidence, albedo against angle, a lit sphere."""
    from ..files import target
    from ..report.figures import show as draw
    from .arguments import resolve_light

    start = time.perf_counter()
    target(output)
    m = read_material(material, replaced)
    sources = [resolve_light(text) for text in lights]
    with bar("drawing") as progress:
        draw(
            m,
            output,
            sources,
            title=visible(title_of(material, replaced)),
            size=size,
            samples=samples,
            progress=progress,
        )
    echo(visible(f"{output}: {title_of(material, replaced)} under {', '.join(lights)}, {since(start)}"))
