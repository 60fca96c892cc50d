"""`gonio import`: a laboratory's table, as it is understood, column by column; then written in another format."""

from __future__ import annotations

import math
import re
import time
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from ..errors import MeaningWarning, ParameterError, visible
from .command import TypedArguments, command
from .options import READING, json_option, output_option, reading_option, since
from .tables import size_in_words, table
from .terminal import echo, print_json

if TYPE_CHECKING:
    from ..base.reflectance import Reflectance
    from ..formats._laboratory.understanding import Column, Understood

SHOWN = 24
"""Most columns that are shown one by one."""

LONGEST = 40
"""Characters of a name, and of the first values of a column; JSON has all."""

_SUSPICIOUS = re.compile(r"^suspicious", re.MULTILINE)

DELIMITERS = {";": "semicolons", ",": "commas", "\t": "tabs", "|": "bars"}


@command("convert", name="import", short_help="Show how a laboratory's table is understood, and convert it.")
@click.argument("file", type=click.Path(path_type=Path))
@reading_option
@output_option("File to write, once the table is understood.", required=False)
@json_option
@click.pass_context
def import_(ctx: click.Context, file: Path, output: Path | None, as_json: bool, asked: TypedArguments) -> None:
    """Show how the table in FILE, CSV or .xlsx, is understood: column by column, and what looks wrong.

    Nothing is guessed: what has two readings is refused, with the -O option that decides. With -o the table is then
    written in another format, and changes are reported as by `gonio convert`.

    \b
    Examples:
      gonio import scan.csv
      gonio import scan.csv -O coverage=2 -O columns.theta_o=Detector -o scan.nc
      gonio import scan.xlsx -O sheet=Data -O angle_unit=rad
    """
    from ..formats import load_as_typed, recognized, target, writer
    from ..formats._laboratory.suspicions import suspicions
    from ..formats._options import names_in, of_texts

    start = time.perf_counter()
    texts = ctx.meta.get(READING, ())
    if output is not None:
        target(writer(output, **asked.of("convert")), output)
    if not file.is_file():
        raise ParameterError(f"{file}: no such file; expected a table, CSV or .xlsx")
    module = recognized(file, names_in(texts))
    if not hasattr(module, "understood"):
        about = getattr(load_as_typed(file, texts), "about", {})  # or says what has two readings
        read = f", read as {about['understood']}" if "understood" in about else ""
        raise ParameterError(
            f"{file}: a {module.NAME} file{read}, which needs no import: `gonio info` describes it, `gonio convert` "
            f"writes it in another format"
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MeaningWarning)  # `suspicions` says the same
        m = load_as_typed(file, texts)
    understood = module.understood(file, **of_texts(module, "read", texts))
    facts, wrong = summary(understood, m), suspicions(understood)
    if as_json:
        columns = [column._asdict() for column in understood.columns]
        print_json({"file": str(file), "format": module.NAME, "columns": columns, **facts, "suspicious": wrong})
    else:
        title = f"{file}: {module.NAME}, {size_in_words(file.stat().st_size)}"
        echo(as_text(title, understood, facts, wrong))
    if output is not None:
        _convert(m, output, asked, start, as_json)
    elif not as_json:
        echo("\nNothing is written: -o FILE writes it, -O NAME=VALUE changes how it is read.")


def _convert(m: Reflectance, output: Path, asked: TypedArguments, start: float, as_json: bool) -> None:
    from ..formats import writer
    from .convert import conversion_as_text

    conversion = asked.call("convert", m, output, format=writer(output, **asked.of("convert")).NAME)
    said = visible(f"{output}: {conversion.format}, {size_in_words(conversion.bytes)}, {since(start)}")
    echo(f"\n{said}\n{conversion_as_text(conversion)}", err=as_json)


def summary(table: Understood, m: Reflectance) -> dict[str, str]:
    """What a table holds, in words: rows, what was passed over, angles, the measurement."""
    layout, numbers = table.layout, table.numbers
    rows = f"{len(numbers.lines)} in lines {numbers.lines[0]} to {numbers.lines[-1]}"
    rows += f", names in line {layout.header}" if layout.header else ""
    rows += f", {DELIMITERS.get(layout.delimiter, 'blanks')} between cells" if layout.delimiter else ""
    facts = {"rows": rows + (", decimal commas" if numbers.decimal == "," else "")}
    passed = {
        "lines above": len(layout.text),
        "lines below": len(numbers.below),
        "repeated names": len(numbers.repeated),
    }
    if any(passed.values()):
        facts["passed over"] = ", ".join(f"{what}: {n}" for what, n in passed.items() if n) + " (kept as text)"
    missing = sum(column.missing for column in table.columns)
    facts["missing"] = f"{missing} cells" if missing else "no cell"
    facts |= angles_in_words(table)
    facts["measurement"] = _measurement(m)
    if table.remarks:
        facts["decided by"] = "; ".join(table.remarks)
    return facts


def angles_in_words(table: Understood) -> dict[str, str]:
    """Incidences and planes of a table with polar angles of both directions."""
    degrees = {key: np.degrees(x) if table.in_radians else x for key, x in table.angles.items()}
    if not {"theta_i", "theta_o"} <= {*degrees}:
        return {}
    theta_i, theta_o = np.abs(degrees["theta_i"]), np.abs(degrees["theta_o"])
    turn = degrees.get("phi", degrees.get("phi_o", 0.0) - degrees.get("phi_i", 0.0)) + 0.0 * theta_i
    incidences = np.unique(np.round(theta_i, 3))
    oblique = np.minimum(theta_i, theta_o) > 1e-3
    planes = np.unique(np.round(np.mod(turn[oblique], 180.0), 3) % 180.0)
    words = {"incidences": f"{_listed(incidences)} ({len(incidences)})"}
    words["viewers"] = f"theta_o to {theta_o.max():g}°"
    if planes.tolist() == [0.0]:
        words["planes"] = "the plane of incidence alone: integrals take the rest of the hemisphere from it"
    elif len(planes):
        words["planes"] = f"{len(planes)}, turned from the plane of incidence by {_listed(planes)}"
    return words


def _listed(angles: np.ndarray) -> str:
    shown = [f"{x:g}°" for x in angles]
    return ", ".join(shown if len(shown) <= 8 else [*shown[:3], "...", shown[-1]])


def _measurement(m: Any) -> str:
    grid = " x ".join(f"{len(nodes)} {name}" for name, nodes in m.axes.items())
    layout = f"{len(m.rows)} pairs of directions in no grid" if hasattr(m, "rows") else f"a grid of {grid}"
    names = [f"{name:g} nm" if isinstance(name, float) else str(name) for name in m.channel_names or ()]
    channels = f", channels {', '.join(names)}" if 0 < len(names) <= 4 else f", {len(names)} channels" if names else ""
    return f"{layout}{channels}, {'with standard uncertainties' if m.uncertainty is not None else 'no uncertainty'}"


def as_text(title: str, table_: Understood, facts: dict[str, str], wrong: Sequence[str]) -> str:
    """Columns, facts, and what looks wrong."""
    columns = table(("column", "unit", "first values", "range", "meaning"), map(_cells, shown(table_.columns)))
    below = table(("", ""), [*facts.items(), *(("suspicious", words) for words in wrong)]).removeprefix("\n")
    return f"{visible(title)}\n\n{columns}\n\n{_SUSPICIOUS.sub(click.style('suspicious', 'red'), below)}"


def shown(columns: Sequence[Column]) -> list[Column]:
    """All columns, or the first and the last of many."""
    if len(columns) <= SHOWN:
        return [*columns]
    return [*columns[:12], columns[0]._replace(name="...", meaning="and so on", unit="", first=()), *columns[-4:]]


def _cells(column: Column) -> tuple[str, ...]:
    low, high = (f"{x:.4g}" for x in (column.low, column.high))
    span = "" if not column.first or math.isnan(column.low) else low if low == high else f"{low} to {high}"
    missing = f"{', ' if span else ''}{column.missing} missing" if column.missing else ""
    return _cut(column.name or "(said)"), column.unit, _cut(", ".join(column.first)), span + missing, column.meaning


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"
