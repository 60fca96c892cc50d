"""Pictures in rows and columns: side by side, and contact sheets of materials and lights."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import checked
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..pictures.colour import srgb_encode
from ..pictures.image import Image
from ..scenes.rendering import default_light, render
from .figures import check_target, new_figure

CELL = 2.2
"""Width of a picture [inches]."""

MOST = 400
"""The most pictures of a sheet."""


@checked
def side_by_side(
    pictures: Mapping[str, Image] | Sequence[Image], path: str | Path, columns: int = 0, exposure: float = 0.0
) -> None:
    """Write pictures into one figure, .png, .jpg, .pdf or .svg, all as bright as they are beside each other.

    `pictures`: title -> picture, or a list of them; `columns` of the figure, by default all in one row, up to six.
    `exposure`: stops by which all are brightened. RGB pictures are shown as sRGB, gray and other ones as the mean of
    their channels.

    Example
    >>> pictures = {f"alpha = {a}": gn.render(gn.material("gold", alpha=a), size=32) for a in (0.05, 0.3)}
    >>> gn.side_by_side(pictures, "gold.png")
    """
    named = _named(pictures, Image, "pictures")
    columns = columns or min(len(named), 6)
    if columns < 1:
        raise ParameterError(f"columns={columns}: expected a whole number from 1")
    texts, shown = list(named), list(named.values())
    rows = [shown[k : k + columns] for k in range(0, len(shown), columns)]
    titles = [texts[k : k + columns] for k in range(0, len(shown), columns)]
    _figure(path, rows, titles, [""] * len(rows), exposure)


@checked
def contact_sheet(
    materials: Mapping[str, Reflectance] | Sequence[Reflectance],
    path: str | Path,
    lights: Mapping[str, Any] | Sequence[Any] | Light | None = None,
    size: int = 192,
    samples: int | None = None,
    seed: int = 0,
    noise: float | None = None,
    exposure: float = 0.0,
    progress: Callable[[int, int], None] | None = None,
) -> dict[tuple[str, str], Image]:
    """Render each material under each light, and write the pictures into one figure: a row for each material, a column
    for each light. Returned are the pictures, by the names of material and light.

    `materials`: name -> material, or a list, which name themselves. `lights`: name -> light or list of lights, or a
    list; by default the one of `render`. The other arguments are those of `render`, and `exposure`, in stops.

    Example
    >>> metals = {name: gn.material(name, alpha=0.2) for name in ("gold", "copper")}
    >>> lights = {"studio": gn.EnvironmentLight.studio(height=32), "sun": gn.SunLight([-1.0, -1.0, 1.0], 3.0)}
    >>> pictures = gn.contact_sheet(metals, "metals.png", lights, size=32, samples=4)
    >>> print(len(pictures), pictures["gold", "sun"])
    4 Image(32 x 32, 3 channels, alpha)
    """
    check_target(path)
    rows = _named(materials, Reflectance, "materials")
    given = _named([lights] if isinstance(lights, Light) else lights, object, "lights") if lights is not None else {}
    if len(rows) * max(len(given), 1) > MOST:
        raise ParameterError(f"{len(rows)} materials under {len(given)} lights; expected up to {MOST} pictures")
    found: dict[tuple[str, str], Image] = {}
    for row, m in rows.items():
        for column, light in (given or {"": default_light(m, None)}).items():
            found[row, column] = render(m, light, size=size, samples=samples, seed=seed, noise=noise)
            if progress is not None:
                progress(len(found), len(rows) * max(len(given), 1))
    columns = list(given or {"": None})
    pictures = [[found[row, column] for column in columns] for row in rows]
    titles = [columns] + [[""] * len(columns)] * (len(rows) - 1)
    _figure(path, pictures, titles, list(rows), exposure)
    return found


def _named(given: Any, kind: type, what: str) -> dict[str, Any]:
    """Name -> thing; things of a list are named by what they are."""
    if isinstance(given, Mapping):
        named = {str(name): thing for name, thing in given.items()}
    else:
        listed = list(given)
        texts = [_text(thing, k) for k, thing in enumerate(listed)]
        twice = {text for text in texts if texts.count(text) > 1}
        named = {f"{t} ({k + 1})" if t in twice else t: x for k, (t, x) in enumerate(zip(texts, listed, strict=True))}
    wrong = next((x for x in named.values() if not isinstance(x, kind)), None)
    if not named or wrong is not None:
        got = "none" if wrong is None else f"{wrong!r:.60}"
        raise ParameterError(f"{what}: got {got}, expected at least one {kind.__name__}, in a list or by name")
    return named


def _text(thing: Any, number: int) -> str:
    if isinstance(thing, Image):
        return str(number + 1)
    if isinstance(thing, (list, tuple)):
        return " + ".join(_text(each, number) for each in thing)
    text = repr(thing)
    return text if len(text) < 40 else type(thing).__name__


def _figure(
    path: str | Path, rows: list[list[Image]], titles: list[list[str]], beside: list[str], exposure: float
) -> None:
    count = max(map(len, rows))
    first = rows[0][0].pixels
    tall = CELL * min(first.shape[0] / first.shape[1], 3.0)
    size = (CELL * count + 0.3 * any(beside) + 0.1, sum(tall + 0.3 * any(line) for line in titles) + 0.1)
    scale = factor(exposure)
    with new_figure(path, size, "") as figure:
        grid = figure.subplots(len(rows), count, squeeze=False)
        for axes, row, line, name in zip(grid, rows, titles, beside, strict=True):
            for where in axes:
                where.set_axis_off()
            for where, picture, title in zip(axes, row, line, strict=False):
                draw_picture(where, picture, scale, title)
            if name:
                words = {"rotation": 90, "ha": "right", "va": "center", "fontsize": 10, "parse_math": False}
                axes[0].text(-0.03, 0.5, name[:60], transform=axes[0].transAxes, **words)


def factor(exposure: float) -> float:
    """That of so many stops."""
    if not abs(exposure) <= 200.0:
        raise ParameterError(f"exposure={exposure}: expected within 200 stops")
    return float(2.0**exposure)


def draw_picture(axes: Any, picture: Image, scale: float, title: str) -> None:
    """A picture times a factor, with its title."""
    pixels = picture.pixels if picture.pixels.shape[-1] == 3 else picture.pixels.mean(axis=-1, keepdims=True)
    codes = srgb_encode(np.clip(np.nan_to_num(pixels.astype(float)) * scale, 0.0, 1.0))
    alpha = np.ones(codes.shape[:2]) if picture.alpha is None else np.clip(picture.alpha, 0.0, 1.0)
    rgb = np.broadcast_to(codes, (*codes.shape[:2], 3))
    axes.imshow(np.concatenate([rgb, alpha[..., None]], axis=-1), interpolation="antialiased")
    axes.set_axis_off()
    axes.set_title(title[:80], fontsize=10, parse_math=False)
