"""`gonio import`: a laboratory's table, as it is understood, column by column; then written as another format."""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from ..errors import ParameterError, visible
from .options import READING, json_option, reading_option, since
from .tables import size_in_words
from .terminal import echo, print_json

if TYPE_CHECKING:
    from ..formats._laboratory.understanding import Column, Understood

NARROWEST = 60
"""Characters of a line of the table, however narrow the terminal is."""


@click.command("import", short_help="Show how a laboratory's table is understood, and convert it.")
@click.argument("file", type=click.Path(path_type=Path))
@reading_option
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="File to write, once the table is as it should be."
)
@click.option(
    "--format", "format_", metavar="FORMAT", help="Format, where the suffix of the output does not say which."
)
@json_option
@click.pass_context
def import_(ctx: click.Context, file: Path, output: Path | None, format_: str | None, as_json: bool) -> None:
    """Show how the table in FILE, CSV or .xlsx, is understood: column by column, and what looks wrong.

    Nothing is guessed: what has two readings is refused, with the -O option that decides. With -o the table is then
    written in another format, and changes are reported as by `gonio convert`.

    \b
    Examples:
      gonio import scan.csv
      gonio import scan.csv -O coverage=2 -O columns.theta_o="Detector (deg)" -o scan.nc
      gonio import scan.xlsx -O sheet=Data -O angle_unit=rad
    """
    import warnings

    from ..conversion.conversion import convert
    from ..errors import MeaningWarning
    from ..formats import load_as_typed, pipes, recognised, target, writer
    from ..formats._laboratory.suspicions import suspicions
    from ..formats._options import names_in, of_texts

    start = time.perf_counter()
    texts = ctx.meta.get(READING, ())
    if output is not None:
        target(writer(output, format_), output)
    path = pipes.named(file)
    if not path.is_file():
        raise ParameterError(f"{file}: no such file; expected a table, CSV or .xlsx")
    module = recognised(path, names_in(texts))
    if not hasattr(module, "understood"):
        raise ParameterError(
            f"{file}: a {module.NAME} file, which is read as it is: `gonio info {file}` describes it, `gonio convert` "
            f"writes it in another format"
        )
    table = module.understood(path, **of_texts(module, "read", texts))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MeaningWarning)  # they are in the table
        m = load_as_typed(path, texts)
    found = summary(table, m)
    wrong = suspicions(table)
    if as_json:
        columns = [column._asdict() for column in table.columns]
        print_json({"file": str(file), "format": module.NAME, "columns": columns, **found, "suspicious": wrong})
    else:
        size = size_in_words(path.stat().st_size)
        _print(
            f"{file}: {module.NAME}, {size}",
            table,
            {**found, **{f"suspicious {k + 1}": text for k, text in enumerate(wrong)}},
        )
    if output is None:
        if not as_json:
            echo("\nNothing is written: -o FILE writes it, -O NAME=VALUE changes how it is read.")
        return
    from .convert import conversion_as_text

    conversion = convert(m, output, writer(output, format_).NAME)
    echo(visible(f"\n{output}: {conversion.format}, {size_in_words(conversion.bytes)}, {since(start)}"), err=as_json)
    echo(conversion_as_text(conversion), err=as_json)


def summary(table: Understood, m: Any) -> dict[str, str]:
    """What a table holds, in words: rows, what was passed over, angles, the measurement."""
    layout = table.layout
    rows = len(table.lines)
    between = {";": "semicolons", ",": "commas", "\t": "tabs", "|": "bars"}.get(layout.delimiter, "blanks")
    comma = ", decimal commas" if table.decimal == "," else ""
    last = f"{table.lines[0]} to {table.lines[-1]}" if rows else ""
    header = f", names in line {layout.header}" if layout.header else ""
    found = {"rows": f"{rows} in lines {last}{header}, {between} between cells{comma}"}
    passed = [f"{len(layout.text)} lines above"] if layout.text else []
    passed += [f"{len(table.below)} below"] if table.below else []
    passed += [f"column names again in lines {', '.join(map(str, table.repeated[:8]))}"] if table.repeated else []
    if passed:
        found["passed over"] = ", ".join(passed) + "; their text is kept"
    missing = sum(column.missing for column in table.columns)
    found["missing"] = f"{missing} cells" if missing else "no cell"
    return (
        found
        | angles_in_words(table)
        | {"measurement": _measurement(m)}
        | ({"decided by": "; ".join(table.remarks)} if table.remarks else {})
    )


def angles_in_words(table: Understood) -> dict[str, str]:
    """Incidences and planes of a table with polar angles."""
    degrees = {k: np.degrees(x) if table.in_radians else x for k, x in table.angles.items()}
    if not {"theta_i", "theta_o"} <= {*degrees}:
        return {}
    theta_i, theta_o = degrees["theta_i"], degrees["theta_o"]
    turn = degrees.get("phi", degrees.get("phi_o", 0.0 * theta_i) - degrees.get("phi_i", 0.0 * theta_i))
    incidences = np.unique(np.round(np.abs(theta_i), 3))
    oblique = (np.abs(theta_i) > 1e-3) & (np.abs(theta_o) > 1e-3)
    planes = np.unique(np.round(np.mod(turn[oblique], 180.0), 3) % 180.0)
    words = {"incidences": f"{_listed(incidences)} ({len(incidences)})"}
    words["viewers"] = f"theta_o to {np.abs(theta_o).max():g}° from the normal"
    if len(planes) == 1 and planes[0] == 0.0:
        words["planes"] = "the plane of incidence alone: integrals over the hemisphere take the rest from it"
    elif len(planes):
        words["planes"] = f"{len(planes)}, turned from the plane of incidence by {_listed(planes)}"
    return words


def _listed(angles: np.ndarray) -> str:
    shown = [f"{x:g}°" for x in angles]
    return ", ".join(shown if len(shown) <= 8 else [*shown[:3], "...", shown[-1]])


def _measurement(m: Any) -> str:
    kind = (
        f"a grid of {' x '.join(map(str, m.stored.shape[: len(m.axes)]))} ({', '.join(m.axes)})"
        if not hasattr(m, "rows")
        else (f"{len(m.rows)} pairs of directions in no grid")
    )
    names = m.channel_names
    channels = (
        ""
        if names is None
        else f", {len(names)} channels"
        if len(names) > 4
        else f", channels {', '.join(f'{n:g} nm' if isinstance(n, float) else n for n in names)}"
    )
    spread = "with standard uncertainties" if m.uncertainty is not None else "no uncertainty"
    return f"{kind}{channels}, {spread}"


def _print(title: str, table: Understood, found: dict[str, str]) -> None:
    """Columns and facts, as tables of the terminal's width."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    width = max(shutil.get_terminal_size((100, 24)).columns, NARROWEST)
    console = Console(width=width, highlight=False)
    columns = Table(title=visible(title), title_justify="left", title_style="bold", header_style="bold")
    columns.add_column("column", overflow="fold", ratio=3)
    columns.add_column("meaning", overflow="fold", ratio=6)
    columns.add_column("unit", overflow="fold", ratio=2)
    columns.add_column("first values", overflow="fold", ratio=3)
    columns.add_column("range", overflow="fold", ratio=2)
    columns.add_column("missing", justify="right")
    for column in shown_columns(table.columns):
        columns.add_row(
            *(Text(visible(cell), "dim" if column.meaning == "left out" else "") for cell in _cells(column))
        )
    console.print(columns)
    facts = Table(box=None, show_header=False, pad_edge=False)
    facts.add_column(no_wrap=True, style="bold")
    facts.add_column(overflow="fold")
    for name, words in found.items():
        suspicious = name.startswith("suspicious")
        facts.add_row("suspicious" if suspicious else name, Text(visible(words), "red" if suspicious else ""))
    console.print(facts)


def shown_columns(columns: Sequence[Column]) -> list[Column]:
    """All columns, or the first and the last of many."""
    if len(columns) <= 24:
        return list(columns)
    left = columns[12].__class__("...", f"{len(columns) - 16} more columns", "")
    return [*columns[:12], left, *columns[-4:]]


def _cells(column: Column) -> tuple[str, ...]:
    low, high = (f"{x:.4g}" for x in (column.low, column.high))
    span = "" if math.isnan(column.low) else low if low == high else f"{low} to {high}"
    return (
        column.name or "(said)",
        column.meaning,
        column.unit,
        ", ".join(column.first),
        span,
        str(column.missing or ""),
    )
