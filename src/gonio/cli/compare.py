"""`gonio compare`: two materials, or two pictures, and how they differ."""

from __future__ import annotations

import os
import time
from pathlib import Path

import click

from ..errors import visible
from ..pictures.image import SUFFIXES, read_image
from . import completion, options
from .render import NOISE
from .terminal import bar, echo


@click.command(short_help="Show how A and B differ on a lit sphere.")
@click.argument("a", shell_complete=completion.materials)
@click.argument("b", shell_complete=completion.materials)
@options.reading_option
@options.output_option("Figure to write: .png, .jpg, .pdf or .svg.")
@options.lights_option
@click.option("--size", default=256, show_default=True, help="Width and height of the spheres in pixels.")
@click.option("--samples", type=int, help="Samples per pixel; the most where there is --noise.  [default: 256]")
@click.option("--noise", type=float, metavar="SHARE", help=NOISE)
@options.bands_option
@click.option("--exposure", default=0.0, show_default=True, help="Stops by which the pictures are brightened.")
@options.with_light_help
def compare(
    a: str,
    b: str,
    output: Path,
    lights: tuple[str, ...],
    size: int,
    samples: int | None,
    noise: float | None,
    bands: str | None,
    exposure: float,
) -> None:
    """Show how A and B differ: side by side, and B - A with its scale and numbers.

    A and B are materials, rendered under the same light, or files of pictures: FILE, or FILE:LAYER of an .exr file.
    """
    from ..figures import difference as drawn
    from ..figures._drawing import check_target
    from ..pictures.difference import difference
    from ..scenes.rendering import render
    from .arguments import layer_of

    start = time.perf_counter()
    check_target(output)
    sources, chosen = options.read_lights(lights), options.bands_of(bands)
    samples = 256 if samples is None and noise is None else samples
    pictures, titles = [], []
    with bar("rendering") as progress:
        for seed, text in enumerate((a, b)):
            file, layer = layer_of(text)
            if os.path.isfile(file) and Path(file).suffix.lower() in SUFFIXES:
                pictures.append(read_image(file, layer=layer))
            else:
                m = options.read_material(text, ())
                pictures.append(
                    render(
                        m, sources, size=size, samples=samples, seed=seed, progress=progress, bands=chosen, noise=noise
                    )
                )
            titles.append(visible(options.title_of(text, ())))
    found = difference(*pictures)
    drawn(found, path=output, labels=titles, exposure=exposure)
    echo(visible(f"{output}: {found.told(*titles)}, {options.since(start)}"))
