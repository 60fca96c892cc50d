"""`gonio nearest`: the materials that are most like one."""

from __future__ import annotations

import math
import textwrap
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import ParameterError, visible
from . import options
from .command import TypedArguments, command
from .tables import table
from .terminal import bar, echo, print_json

if TYPE_CHECKING:
    from ..base.reflectance import Reflectance

TITLE = 26
"""Characters of a name above a picture."""

REASON = 120
"""Characters of a reason in the table; JSON has all of it."""

WIDEST = 6
"""Pictures in a row."""

ABOVE = 0.45
"""Height of the two lines above a picture [inches]."""


@command(
    *("reconstruction.nearest", "render"),
    options={"among": "-a", "distance": "-d", "count": "-n", "checkpoint": ""},
    usual={"size": 192, "samples": 64},
    repeated=("among",),
    short_help="Rank the materials that are most like MATERIAL.",
)
@options.material_argument
@options.output_option("Picture of them on lit spheres to write: .png, .jpg, .pdf or .svg.", required=False)
@options.lights_option
@options.exposure_option
@options.json_option
@options.with_light_help
def nearest(material: options.TypedMaterial, output: Path | None, asked: TypedArguments, **settings: Any) -> None:
    """Rank the materials that are most like MATERIAL, the nearest first.

    The distance is the root of the mean square difference, over directions up to 80 degrees from the normal, half of
    them about the mirror direction, and over red, green and blue; where one of both is gray, of luminance.
    """
    start = time.perf_counter()
    how = asked.of("reconstruction.nearest")
    if output is not None:
        from ..figures._drawing import MOST, check_target

        check_target(output)
        if how.get("count", 0) >= MOST:
            raise ParameterError(
                f"--count {how['count']}: expected up to {MOST - 1} beside a picture; leave -o out for more"
            )
    m, lights = material.read(), options.Lit(settings["lights"]).sources()
    with bar("comparing") as progress:
        matches = asked.call("reconstruction.nearest", m, progress=progress)
    if settings["as_json"]:
        print_json([as_row(match) for match in matches])
    else:
        echo(as_text(matches))
    if output is not None:
        _draw((m, material.title), matches, output, settings["exposure"], partial(asked.call, "render", lights=lights))
        if not settings["as_json"]:
            echo(f"{output}: {material.title} and the nearest, {options.since(start)}")


def as_row(match: Any) -> dict[str, Any]:
    """The row of JSON."""
    names = ("rank", "name", "distance", "factor", "what", "compared", "left_out", "pairs", "reason")
    row = {name: getattr(match, name) for name in names}
    return {**row, "rank": match.rank or None, "reason": match.reason or None}


def as_text(matches: list[Any]) -> str:
    """The table for people; columns that would say the same of all are left out."""
    ranked = [match for match in matches if match.rank]
    scaled = any(match.factor != 1.0 for match in ranked)
    rows = []
    for match in matches:
        numbers = [f"{match.distance:.4f}", f"{match.factor:.4g}"] if match.rank else ["-", "-"]
        last = match.told if match.rank else textwrap.shorten(match.told, REASON, placeholder=" ...")
        rows.append([f"{match.rank or ''}", match.name, *numbers[: 1 + scaled], last])
    return table(["", "name", "distance", *(["factor"] if scaled else []), "what it is"], rows)


def _draw(
    subject: tuple[Reflectance, str], matches: list[Any], output: Path, exposure: float, render: Callable
) -> None:
    """Write the sheet: the material itself, and then the nearest, by the factors that brought them near."""
    from ..figures._drawing import new_figure
    from ..figures.gallery_figure import CELL, draw_picture, factor

    cells = [(subject[1], "itself", render(subject[0]))]
    ranked = [match for match in matches if match.rank]
    with bar("rendering") as progress:
        for match in ranked:
            times = "" if match.factor == 1.0 else f", times {match.factor:.3g}"
            scaled = match.material if match.factor == 1.0 else match.factor * match.material
            cells.append((f"{match.rank}  {match.name}", f"{match.distance:.4f}{times}", render(scaled)))
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
