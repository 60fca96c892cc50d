"""`gonio show`: a material in one figure."""

from __future__ import annotations

import time
from pathlib import Path

import click

from ..errors import visible
from . import options
from .terminal import bar, echo


@click.command(short_help="Draw MATERIAL in one figure.")
@options.material_argument
@options.output_option("Figure to write: .png, .jpg, .pdf or .svg.")
@options.lights_option
@options.replace_option
@click.option("--size", default=256, show_default=True, help="Width and height of the sphere in pixels.")
@options.samples_option
@options.bands_option
@options.with_light_help
def show(
    material: str,
    output: Path,
    lights: tuple[str, ...],
    replaced: tuple[str, ...],
    size: int,
    samples: int,
    bands: str | None,
) -> None:
    """Draw MATERIAL in one figure: slices in the plane of incidence, albedo, a lit sphere or a map.

    Curves of a measurement end where its data end; points are measured values, with bars of two uncertainties.
    """
    from ..figures import overview
    from ..figures._drawing import check_target

    start = time.perf_counter()
    check_target(output)
    m = options.read_material(material, replaced)
    sources = options.read_lights(lights)
    chosen = options.bands_of(bands)
    title = visible(options.title_of(material, replaced))
    with bar("drawing") as progress:
        overview(m, sources, output, title, size=size, samples=samples, progress=progress, bands=chosen)
    echo(visible(f"{output}: {title} {options.under(lights)}, {options.since(start)}"))
