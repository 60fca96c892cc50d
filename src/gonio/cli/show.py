"""`gonio show`: a material in one figure."""

from __future__ import annotations

import time
from pathlib import Path

from ..errors import visible
from . import options
from .command import TypedArguments, command
from .terminal import bar, echo


@command("figures.overview", short_help="Draw MATERIAL in one figure.")
@options.material_argument
@options.output_option("Figure to write: .png, .jpg, .pdf or .svg.")
@options.lit_options
@options.with_light_help
def show(material: options.TypedMaterial, output: Path, lit: options.Lit, asked: TypedArguments) -> None:
    """Draw MATERIAL in one figure: slices in the plane of incidence, albedo, a lit sphere or a map.

    Curves of a measurement end where its data end; points are measured values, with bars of two uncertainties.
    """
    from ..figures import overview
    from ..figures._drawing import check_target

    start = time.perf_counter()
    check_target(output)
    title = visible(material.title)
    with bar("drawing") as progress:
        overview(
            material.read(),
            path=output,
            progress=progress,
            **lit.read(),
            **{"title": title, **asked.of("figures.overview")},
        )
    echo(visible(f"{output}: {title} {lit}, {options.since(start)}"))
