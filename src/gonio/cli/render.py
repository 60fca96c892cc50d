"""`gonio render`: a picture of a material on a lit shape."""

from __future__ import annotations

import time
from pathlib import Path

import click

from ..errors import ParameterError, visible
from ..scenes.shapes import SHAPES
from . import options
from .terminal import bar, echo

SEED = "Of the random numbers: the same seed, the same picture."


@click.command(short_help="Render MATERIAL on a lit shape.")
@options.material_argument
@options.output_option("Picture to write: .png, .exr or .hdr.")
@options.lights_option
@options.replace_option
@click.option("--shape", default="sphere", show_default=True, help=f"What to render: {', '.join(SHAPES)}.")
@click.option("--size", default=512, show_default=True, help="Width and height in pixels.")
@options.samples_option
@options.bands_option
@click.option("--seed", default=0, type=click.IntRange(min=0), show_default=True, help=SEED)
@click.option("--exposure", default=0.0, show_default=True, help="Stops by which a .png is brightened.")
@options.with_light_help
def render(
    material: str,
    output: Path,
    lights: tuple[str, ...],
    replaced: tuple[str, ...],
    shape: str,
    size: int,
    samples: int,
    bands: str | None,
    seed: int,
    exposure: float,
) -> None:
    """Render MATERIAL on a lit shape.

    A .png is sRGB with a transparent background; .exr and .hdr hold linear radiance.
    """
    from ..pictures.image import check_target
    from ..scenes.rendering import is_coloured
    from ..scenes.rendering import render as render_image

    start = time.perf_counter()
    check_target(output, exposure)
    m = options.read_material(material, replaced)
    sources, chosen = options.read_lights(lights), options.bands_of(bands)
    if output.suffix.lower() != ".exr" and not is_coloured(m, chosen):
        names = ", ".join(map(str, m.channel_names or range(m.channels or 1)))
        advice = f"choose three, --bands RED,GREEN,BLUE, or one of {names:.90}; or write .exr"
        raise ParameterError(f"{output}: a picture of {m.channels} channels, expected 1 or 3; {advice}")
    with bar("rendering") as progress:
        picture = render_image(m, sources, shape, size, samples, seed, progress, chosen)
    picture.save(output, exposure)
    what = f"{options.title_of(material, replaced)} {options.under(lights)}"
    echo(visible(f"{output}: {what}, {size} x {size}, {samples} samples per pixel, {options.since(start)}"))
