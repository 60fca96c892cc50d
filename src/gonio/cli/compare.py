"""`gonio compare`: two materials, or two pictures, and how they differ."""

from __future__ import annotations

import os
import time
from pathlib import Path

import click

from ..errors import visible
from ..facts.public import public
from ..pictures.image import SUFFIXES, load_image
from . import completion, options
from .command import TypedArguments, command
from .terminal import bar, echo

SAMPLES = 256
"""Samples of a pixel where neither they nor a tolerance are asked for."""


@command(
    "render", options={"checkpoint": ""}, usual={"size": 256}, short_help="Show how A and B differ on a lit sphere."
)
@click.argument("a", shell_complete=completion.materials)
@click.argument("b", shell_complete=completion.materials)
@options.reading_option
@options.output_option("Figure to write: .png, .jpg, .pdf or .svg.")
@options.lit_options
@options.exposure_option
@options.with_light_help
def compare(a: str, b: str, output: Path, lit: options.Lit, exposure: float, asked: TypedArguments) -> None:
    """Show how A and B differ: side by side, and B - A with its scale and numbers.

    A and B are materials, rendered under the same light, or files of pictures: FILE, or FILE:LAYER of an .exr file.
    """
    from ..figures._drawing import check_target
    from .arguments import layer_of

    start = time.perf_counter()
    check_target(output)
    chosen = {**lit.read(), **asked.of("render")}
    if not {"samples", "tolerance"} & {*chosen}:
        chosen["samples"] = SAMPLES
    seed = chosen.pop("seed", 0)
    pictures, titles = [], []
    with bar("rendering") as progress:
        for number, text in enumerate((a, b)):
            file, layer = layer_of(text)
            if os.path.isfile(file) and Path(file).suffix.lower() in SUFFIXES:
                pictures.append(load_image(file, layer=layer))
            else:
                m = options.TypedMaterial(text).read()
                pictures.append(public("render")(m, seed=seed + number, progress=progress, **chosen))
            titles.append(visible(options.TypedMaterial(text).title))
    difference = public("scenes.picture_difference")(*pictures)
    public("figures.difference")(difference, path=output, labels=titles, exposure=exposure)
    echo(visible(f"{output}: {difference.told(*titles)}, {options.since(start)}"))
