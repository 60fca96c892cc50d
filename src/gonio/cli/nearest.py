"""`gonio nearest`: the materials that are most like one."""

from __future__ import annotations

import math
import textwrap
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import ParameterError, visible
from . import options
from .tables import table
from .terminal import bar, echo, print_json

if TYPE_CHECKING:
    from ..base.light import Light
    from ..base.reflectance import Reflectance
    from ..pictures.image import Image
    from ..reconstruction.nearest import Match

TITLE = 26
"""Characters of a name above a picture."""

REASON = 120
"""Characters of a reason in the table; JSON has all of it."""

WIDEST = 6
"""Pictures in a row."""

ABOVE = 0.45
"""Height of the two lines above a picture [inches]."""


@click.command(short_help="Rank the materials that are most like MATERIAL.")
@options.material_argument
@options.replace_option
@click.option(
    "-a",
    "--among",
    metavar="MATERIALS",
    multiple=True,
    help="What to compare with: a file, a folder of files, a MATERIAL, a kind (metal) or a pattern ('*paint*') of the "
    "built-in ones; may be repeated.  [default: all built-in materials]",
)
@click.option(
    "-d",
    "--distance",
    type=click.Choice(["log", "cosine", "cube_root"]),
    default="log",
    show_default=True,
    help="Difference of what: ln(1 + f cos), f cos (highlights count most), or its cube root (dark parts count too).",
)
@click.option(
    "--scale",
    type=click.Choice(["given", "free"]),
    default="given",
    show_default=True,
    help="With free, each is multiplied by the factor that brings it nearest.",
)
@click.option("-n", "--count", type=click.IntRange(1), default=10, show_default=True, help="How many to list.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Picture of them on lit spheres to write: .png, .jpg, .pdf or .svg.",
)
@options.lights_option
@click.option("--size", default=192, show_default=True, help="Width and height of the spheres in pixels.")
@click.option("--samples", default=64, show_default=True, help="Samples per pixel.")
@click.option("--exposure", default=0.0, show_default=True, help="Stops by which the spheres are brightened.")
@options.json_option
@options.with_light_help
def nearest(
    material: str,
    replaced: tuple[str, ...],
    among: tuple[str, ...],
    distance: str,
    scale: str,
    count: int,
    output: Path | None,
    lights: tuple[str, ...],
    size: int,
    samples: int,
    exposure: float,
    as_json: bool,
) -> None:
    """Rank the materials that are most like MATERIAL, the nearest first.

    The distance is the root of the mean square difference, over directions up to 80 degrees from the normal, half of
    them about the mirror direction, and over red, green and blue; where one of both is gray, of luminance.
    """
    from ..reconstruction.nearest import nearest as found_near

    start = time.perf_counter()
    if output is not None:
        from ..figures._drawing import MOST, check_target

        check_target(output)
        if count >= MOST:
            raise ParameterError(f"--count {count}: expected up to {MOST - 1} beside a picture; leave -o out for more")
    m, sources = options.read_material(material, replaced), options.read_lights(lights)
    with bar("comparing") as progress:
        found = found_near(m, list(among) or None, distance, scale, count, progress)
    if as_json:
        print_json([as_row(match) for match in found])
    else:
        echo(as_text(found))
    if output is not None:
        _draw(m, options.title_of(material, replaced), found, output, sources, size, samples, exposure)
        if not as_json:
            echo(f"{output}: {options.title_of(material, replaced)} and the nearest, {options.since(start)}")


def as_row(match: Match) -> dict[str, Any]:
    """The row of JSON."""
    names = ("rank", "name", "distance", "factor", "what", "compared", "left_out", "pairs", "reason")
    row = {name: getattr(match, name) for name in names}
    return {**row, "rank": match.rank or None, "reason": match.reason or None}


def as_text(found: list[Match]) -> str:
    """The table for people; columns that would say the same of all are left out."""
    ranked = [match for match in found if match.rank]
    scaled = any(match.factor != 1.0 for match in ranked)
    rows = []
    for match in found:
        numbers = [f"{match.distance:.4f}", f"{match.factor:.4g}"] if match.rank else ["-", "-"]
        last = match.told if match.rank else textwrap.shorten(match.told, REASON, placeholder=" ...")
        rows.append([f"{match.rank or ''}", match.name, *numbers[: 1 + scaled], last])
    return table(["", "name", "distance", *(["factor"] if scaled else []), "what it is"], rows)


def _draw(
    m: Reflectance,
    name: str,
    found: list[Match],
    output: Path,
    lights: list[Light] | None,
    size: int,
    samples: int,
    exposure: float,
) -> None:
    """Write the sheet: the material itself, and then the nearest, by the factors that brought them near."""
    from ..figures._drawing import new_figure
    from ..figures.gallery_figure import CELL, draw_picture, factor
    from ..scenes.rendering import render

    cells: list[tuple[str, str, Image]] = [(name, "itself", render(m, lights, size=size, samples=samples))]
    ranked = [match for match in found if match.rank]
    with bar("rendering") as progress:
        for match in ranked:
            times = "" if match.factor == 1.0 else f", times {match.factor:.3g}"
            drawn = match.material if match.factor == 1.0 else match.factor * match.material
            picture = render(drawn, lights, size=size, samples=samples)
            cells.append((f"{match.rank}  {match.name}", f"{match.distance:.4f}{times}", picture))
            if progress is not None:
                progress(match.rank, len(ranked))
    count = len(cells)
    columns = count if count <= WIDEST else min(range(WIDEST, WIDEST - 3, -1), key=lambda c: -count % c)
    rows = math.ceil(count / columns)
    with new_figure(output, (CELL * columns + 0.1, (CELL + ABOVE) * rows + 0.1), "") as figure:
        grid = list(figure.subplots(rows, columns, squeeze=False).flat)
        for axes in grid:
            axes.set_axis_off()
        for axes, (title, below, picture) in zip(grid, cells, strict=False):
            draw_picture(axes, picture, factor(exposure), f"{_cut(visible(title))}\n")
            axes.text(0.5, 1.02, below, fontsize=9, color="#555555", transform=axes.transAxes, ha="center")


def _cut(text: str) -> str:
    """A long name without its middle."""
    half = (TITLE - 1) // 2
    return text if len(text) <= TITLE else f"{text[:half]}…{text[-half:]}"
