"""What all figures share: the file to write, the style, colours, names of what is drawn, legends."""

from __future__ import annotations

import math
import os
import textwrap
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.map_shape import map_shape
from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..errors import MissingDataWarning, ParameterError, needed
from ..files import replacing, target

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".jpg", ".pdf", ".svg")

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Of things side by side: those of Okabe and Ito, which people tell apart whatever colours they see."""

DASHES = ("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5)))
"""Of lines side by side, so that they are told apart in gray, too."""

SEQUENCE = ("#440154", "#433e85", "#2d708e", "#1e9c89", "#52c569", "#c2b81f")
"""Of things in an order, from dark to light."""

RGB = ("#d55e00", "#009e73", "#0072b2")
"""Of red, green and blue."""

NO_DATA: Any = {"facecolor": "#e9e9e9", "edgecolor": "#c4c4c4", "hatch": "///", "linewidth": 0.0, "zorder": 0}

GRAY = "#555555"
"""Of remarks."""

MOST = 400
"""The most panels of a figure."""

STYLE: Any = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.titlesize": 11,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "legend.loc": "best",
    "legend.fontsize": 9,
    "legend.title_fontsize": 9,
    "pdf.fonttype": 42,  # letters stay letters, as journals ask
}

GUEST: Any = {
    "axes.titlesize": "medium",
    "legend.frameon": False,
    "legend.loc": "best",
    "legend.fontsize": "small",
    "legend.title_fontsize": "small",
    "pdf.fonttype": 42,
}
"""In figures of a caller, whose letters are as large as the caller has them."""


def check_target(path: str | os.PathLike[str] | None) -> None:
    """Raise the errors of writing a figure under this name, before anything is computed."""
    if path is not None:
        if Path(path).suffix.lower() not in SUFFIXES:
            raise ParameterError(f"{path}: expected a name that ends in {', '.join(SUFFIXES)}")
        target(path)
    _matplotlib()


@contextmanager
def new_figure(path: str | os.PathLike[str] | None, size: tuple[float, float], title: str = "") -> Iterator[Figure]:
    """A figure to draw in, which is written at the end of the context if there is a path."""
    check_target(path)
    with _styled():
        from ._canvas import Canvas

        figure = Canvas(figsize=size, layout="constrained")
        yield figure
        if title:
            lines = textwrap.wrap(title, 120, max_lines=2, placeholder=" …")
            figure.suptitle("\n".join(lines), fontsize=12, parse_math=False)
        _write(figure, path)


@contextmanager
def panels(
    path: str | os.PathLike[str] | None,
    axes: Any,
    count: int,
    size: tuple[float, float],
    columns: int = 0,
) -> Iterator[tuple[Figure, list[Any]]]:
    """A figure and its axes, one for each of `count` panels of this size: new ones, or those that a caller has."""
    if count > MOST:
        raise ParameterError(f"a figure of {count} panels; expected up to {MOST}: draw fewer materials or angles")
    if axes is None:
        columns = columns or min(count, 4 if count != 5 else 3)
        rows = math.ceil(count / columns)
        with new_figure(path, (size[0] * columns, size[1] * rows)) as figure:
            grid = list(figure.subplots(rows, columns, squeeze=False).flat)
            for empty in grid[count:]:
                empty.set_axis_off()
            yield figure, grid[:count]
        return
    check_target(path)
    given = _axes_of(axes, count)
    host = given[0].figure
    with _styled(GUEST):
        yield host, given
        _write(getattr(host, "figure", host), path)


def _axes_of(axes: Any, count: int) -> list[Any]:
    """The axes of Matplotlib that a caller gave: one, or a sequence or an array of them."""
    flat = list(np.ravel(np.asarray(axes, dtype=object))) if isinstance(axes, (list, tuple, np.ndarray)) else [axes]
    if len(flat) != count or not all(hasattr(a, "plot") and hasattr(a, "figure") for a in flat):
        kinds = ", ".join(sorted({type(a).__name__ for a in flat}))
        raise ParameterError(f"axes: got {len(flat)} ({kinds}), expected {count}, one of Matplotlib for each panel")
    return flat


@contextmanager
def _styled(style: Any = STYLE) -> Iterator[None]:
    with warnings.catch_warnings(), _matplotlib().rc_context(style):
        warnings.simplefilter("ignore", MissingDataWarning)  # a figure shows where there is no data
        yield


def _write(figure: Any, path: str | os.PathLike[str] | None) -> None:
    if path is None:
        return
    # Matplotlib's PDF writer leaves a file open that it cannot write, if it is told the name
    with replacing(Path(path)) as temporary, temporary.open("wb") as file:
        figure.savefig(file, dpi=120, format=Path(path).suffix[1:].lower())


def _matplotlib() -> Any:
    """Matplotlib; its import fails where MPLBACKEND names an unknown backend, though none is used here."""
    backend = os.environ.pop("MPLBACKEND", None)
    try:
        with needed("figures need Matplotlib", "pip install matplotlib"):
            import matplotlib
    finally:
        if backend is not None:
            os.environ["MPLBACKEND"] = backend
    if backend:
        with suppress(ValueError):
            matplotlib.rcParams["backend"] = backend  # for callers that show figures of their own
    return matplotlib


def name_of(m: Reflectance) -> str:
    """The name of the file of a measurement; a material as an expression."""
    return Path(m.path).name if isinstance(m, Measured) and m.path else repr(m)


def named(given: Any, kinds: type | tuple[type, ...], what: str) -> dict[str, Any]:
    """Name -> thing, of one thing, a list, or a dictionary; things without a name are named by what they are."""
    if kinds is not object and isinstance(given, kinds):
        given = [given]
    if isinstance(given, Mapping):
        found = {str(name): thing for name, thing in given.items()}
    else:
        listed = list(given)
        texts = [_text(thing, k) for k, thing in enumerate(listed)]
        twice = {text for text in texts if texts.count(text) > 1}
        found = {f"{t} ({k + 1})" if t in twice else t: x for k, (t, x) in enumerate(zip(texts, listed, strict=True))}
    wrong = next((x for x in found.values() if not isinstance(x, kinds)), None)
    if not found or wrong is not None:
        got = "none" if wrong is None else f"{wrong!r:.60}"
        words = " or ".join(kind.__name__ for kind in (kinds if isinstance(kinds, tuple) else (kinds,)))
        raise ParameterError(f"{what}: got {got}, expected at least one {words}, in a list or by name")
    return found


def _text(thing: Any, number: int) -> str:
    if isinstance(thing, (list, tuple)):
        return " + ".join(_text(each, number) for each in thing)
    text = name_of(thing) if isinstance(thing, Reflectance) else repr(thing)
    return text if len(text) < 40 else type(thing).__name__


def materials_of(given: Any) -> dict[str, Reflectance]:
    """Name -> material, of one, a list, or a dictionary of those that a caller gave; each of one place."""
    found: dict[str, Reflectance] = named(given, Reflectance, "materials")
    of_one_place(found)
    return found


def of_one_place(materials: Mapping[str, Reflectance]) -> None:
    """Raise ParameterError for maps, of which these figures would draw one place."""
    for name, m in materials.items():
        if shape := map_shape(m):
            rule = f"a map of {' x '.join(map(str, shape))} places, expected a material of one"
            raise ParameterError(f"{name!r:.60}: {rule}; gn.figures.overview(m) draws all places")


def legend(axes: Any, handles: Sequence[Any], labels: Sequence[str], **more: Any) -> None:
    """A legend of labels that are taken as they are written: no mathematics, no name left out."""
    drawn = axes.legend(handles, [f"{k}" for k in range(len(handles))], **more)
    for text, label in zip(drawn.get_texts(), labels, strict=True):
        text.set_parse_math(False)
        text.set_text(label if len(label) <= 46 else f"{label[:45]}…")


def write(axes: Any, text: str = "f = 0 away from\nthe mirror direction", colour: str = "black") -> None:
    """Text in place of curves."""
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, color=colour)


def label_gap(axes: Any, x: float, y: float, **more: Any) -> None:
    """The words "no data"."""
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    axes.text(x, y, "no data", ha="center", va="center", fontsize="small", color=GRAY, bbox=box, **more)
