"""Pictures in rows and columns: spheres of materials, under one light or several; or pictures that are there."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ..errors import ParameterError, said_once
from ..evaluate.tracing import at_most
from ..pictures.image import Image, shown_on_screen
from ..scenes.rendering import default_light, most_samples, render
from ._drawing import MOST, check_target, named, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CELL = 2.2
"""Width of a picture [inches]."""

WIDEST = 6
"""Pictures beside each other, where nobody says how many."""


@checked
def gallery(
    materials: Mapping[str, Reflectance | Image] | Sequence[Reflectance | Image] | Reflectance | Image,
    lights: Mapping[str, Any] | Sequence[Any] | Light | None = None,
    path: str | os.PathLike[str] | None = None,
    columns: int = 0,
    size: int = 192,
    samples: int | None = None,
    seed: int = 0,
    tolerance: float | None = None,
    exposure: float = 0.0,
    progress: Callable[[int, int], None] | None = None,
) -> Figure:
    """Draw a lit sphere of each material, or pictures that are there, all as bright as they are beside each other.

    materials  materials or pictures: one, a list, or label -> material or picture
    lights     of materials: one, a list, or label -> light or list of lights. Of several, each material has a row, and
               each light a column. By default the one of `gn.render`
    path       file to write: .png, .jpg, .pdf or .svg
    columns    pictures beside each other, where there is one light; by default up to six
    exposure   stops by which all are brightened

    The other arguments are those of `gn.render`. RGB pictures are shown as sRGB, gray and other ones as the mean of
    their channels.

    Errors     ParameterError for other names of files, for nothing to show, and for more than 400 pictures.

    Example
    >>> metals = {name: gn.material(name, alpha=0.2) for name in ("gold", "copper")}
    >>> lights = {"studio": gn.EnvironmentLight.studio(height=32), "sun": gn.SunLight([-1.0, -1.0, 1.0], 3.0)}
    >>> figure = gn.figures.gallery(metals, lights, path="metals.png", size=32, samples=4)
    >>> print(len(figure.axes))
    4
    """
    check_target(path)
    scale = factor(exposure)
    subjects = named(materials, (Reflectance, Image), "materials")
    given = {} if lights is None else named([lights] if isinstance(lights, Light) else lights, object, "lights")
    if columns < 0:
        raise ParameterError(f"columns={columns}: expected a whole number from 1, or 0 for up to {WIDEST}")
    count = len(subjects) * max(len(given), 1)
    if count > MOST:
        raise ParameterError(f"{len(subjects)} materials under {len(given)} lights; expected up to {MOST} pictures")
    options: dict[str, Any] = {"size": size, "samples": samples, "seed": seed, "tolerance": tolerance}
    pictures: list[Image] = []
    with said_once(), at_most(size * size * most_samples(samples, tolerance)):
        for subject in subjects.values():
            for light in given.values() if given else (None,):
                if isinstance(subject, Image):
                    pictures.append(subject)
                else:
                    pictures.append(
                        render(subject, default_light(subject, None) if light is None else light, **options)
                    )
                if progress is not None:
                    progress(len(pictures), count)
    if len(given) > 1:
        rows = [pictures[k : k + len(given)] for k in range(0, count, len(given))]
        titles = [list(given)] + [[""] * len(given)] * (len(rows) - 1)
        return _grid(path, rows, titles, list(subjects), scale)
    columns = columns or min(count, WIDEST)
    rows = [pictures[k : k + columns] for k in range(0, count, columns)]
    titles = [list(subjects)[k : k + columns] for k in range(0, count, columns)]
    return _grid(path, rows, titles, [""] * len(rows), scale)


def _grid(
    path: str | os.PathLike[str] | None,
    rows: list[list[Image]],
    titles: list[list[str]],
    beside: list[str],
    scale: float,
) -> Figure:
    count = max(map(len, rows))
    first = rows[0][0].pixels
    tall = CELL * min(first.shape[0] / first.shape[1], 3.0)
    size = (CELL * count + 0.3 * any(beside) + 0.1, sum(tall + 0.3 * any(line) for line in titles) + 0.1)
    with new_figure(path, size) as figure:
        grid = figure.subplots(len(rows), count, squeeze=False)
        for axes, row, line, name in zip(grid, rows, titles, beside, strict=True):
            for where in axes[len(row) :]:
                where.remove()
            for where, picture, title in zip(axes, row, line, strict=False):
                draw_picture(where, picture, scale, title)
            if name:
                words = {"rotation": 90, "ha": "right", "va": "center", "fontsize": 10, "parse_math": False}
                axes[0].text(-0.03, 0.5, name[:60], transform=axes[0].transAxes, **words)
    return figure


def factor(exposure: float) -> float:
    """That of so many stops."""
    if not abs(exposure) <= 200.0:
        raise ParameterError(f"exposure={exposure}: expected within 200 stops")
    return float(2.0**exposure)


def draw_picture(axes: Any, picture: Image, scale: float, title: str) -> None:
    """A picture times a factor, with its title."""
    axes.imshow(shown_on_screen(picture, scale), interpolation="antialiased")
    axes.set_axis_off()
    axes.set_title(title[:80], fontsize=10, parse_math=False)
