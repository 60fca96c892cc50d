"""The table of `gn.fitting.fit_many` on disk: a run's rows go to a journal, and in the end the table takes its place.

Finished rows are added to a journal beside the output, `fits.parquet.unfinished`, a line for each material, which is on
the disk before the next job is counted as done. At the end the table takes its place in one step, and the journal goes.
A line that was cut off by a kill is left out, and its material fitted again. Rows of other materials and models stay in
the table, those of a journal too: what was fitted once is neither removed nor replaced.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from ..errors import FormatError, ParameterError, WriteError, needed
from ..files import replacing, target
from ..files._unfinished import held

FIRST = ("material", "model", "status", "error", "rms", "aic", "bic", "values", "unknowns", "converged", "seconds")
LAST = ("loss", "fitted", "notes", "key")
"""Columns before and after those of the numbers."""

FITTED, REFUSED, FAILED = "fitted", "refused", "failed"
"""Status of a row: a fit; data or a model that cannot be fitted; a machine or program that failed, tried again by the
next run."""

TEXTS = ("material", "model", "status", "error", *LAST)
NUMBERS = ("rms", "aic", "bic", "values", "unknowns", "converged", "seconds")
PLAIN = (int, float, bool, type(None))

Row = dict[str, Any]


@dataclass
class Journal:
    """Rows by their keys, those that others asked for, and the file that new ones are added to."""

    rows: dict[str, Row]
    others: list[Row]
    file: IO[bytes] | None = None

    def add(self, rows: Sequence[Row]) -> None:
        """Take the rows of a material, and keep on disk all but those that failed."""
        self.rows |= {row["key"]: row for row in rows}
        kept = [row for row in rows if row["status"] != FAILED]
        if self.file is None or not kept:
            return
        try:
            self.file.write(json.dumps(kept).encode() + b"\n")
            self.file.flush()
            os.fsync(self.file.fileno())
        except OSError as error:
            told = f"{self.file.name}: cannot be written: {error.strerror}"
            raise WriteError(f"{told}; make room: the same call goes on where this ended") from error

    def ended(self) -> None:
        """The table is in its place."""
        assert self.file is not None
        with suppress(FileNotFoundError):
            os.remove(self.file.name)


@contextmanager
def journal_of(output: Path | None, wanted: Mapping[str, tuple[str, str]]) -> Iterator[Journal]:
    """The journal of an output, or one without a file, with the rows of earlier runs; a second run waits for the first.

    `wanted`: material and model of each key. Raises FormatError for files that are not gonio's, ParameterError where a
    fit of one of these, by another key, would have to be replaced.
    """
    if output is None:
        yield Journal({}, [])
        return
    path = journal_path(output)
    with held(target(path)) as file:
        file.seek(0)
        text = file.read()
        whole = text.rfind(b"\n") + 1
        old = {row["key"]: row for row in (*_read(output), *_lines(text[:whole], path))}
        if whole < len(text):
            file.truncate(whole)
        others = [row for key, row in old.items() if key not in wanted]
        named = {*wanted.values()}
        same = [row for row in others if (row["material"], row["model"]) in named]
        if fitted := [row for row in same if row["status"] == FITTED]:
            first, more = fitted[0], f" and {len(fitted) - 1} more" * (len(fitted) > 1)
            raise ParameterError(
                f"{output}: holds a fit of {first['material']:.80} by {first['model']:.80}{more} to other data, by "
                f"another model of that name, with other options or by another version of gonio; nothing was changed; "
                f"choose another output"
            )
        rows = {key: row for key, row in old.items() if key in wanted}
        yield Journal(rows, [row for row in others if row not in same], file)


def _lines(text: bytes, path: Path) -> Iterator[Row]:
    """The rows of a journal."""
    for line in text.splitlines():
        try:
            rows = json.loads(line)
            kinds = {type(row[name]) for row in rows for name in TEXTS}
            pairs = [pair for row in rows for pair in row["numbers"].values()]
            numbers = [x for pair in pairs for x in pair] + [row.get(name) for row in rows for name in NUMBERS]
            if kinds - {str} or any(len(pair) != 2 for pair in pairs) or not {*map(type, numbers)} <= {*PLAIN}:
                raise ValueError
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            raise FormatError(f"{path}: is no journal of gonio; remove it, or choose another output") from None
        yield from rows


def journal_path(output: Path) -> Path:
    """The file beside an output that keeps rows until all are done."""
    return output.with_name(output.name + ".unfinished")


def output_file(output: str | os.PathLike[str]) -> Path:
    """The place of the table. Raises for suffixes of no kind, and where pyarrow is missing."""
    suffix = Path(output).suffix.lower()
    if suffix not in (".parquet", ".csv"):
        raise ParameterError(f"output={str(output)!r:.200}: got the suffix {suffix!r}; expected .parquet or .csv")
    if suffix == ".parquet":
        with needed(f"{output}: Parquet files need pyarrow", 'pip install "gonio[fit]", or write .csv'):
            import pyarrow.parquet  # noqa: F401  (whether it is there)
    return target(output)


def table_of(rows: Sequence[Row]) -> Any:
    """Rows as a pandas.DataFrame; each number and its standard error are two columns."""
    import pandas

    names = dict.fromkeys(name for row in rows for name in row["numbers"])
    flat = []
    for row in rows:
        cells = {name: row.get(name) for name in (*FIRST, *LAST)}
        for name, (value, error) in row["numbers"].items():
            cells |= {name: value, f"{name}.stderr": error}
        flat.append(cells)
    columns = [*FIRST, *(part for name in names for part in (name, f"{name}.stderr")), *LAST]
    table = pandas.DataFrame(flat, columns=columns)
    kinds: dict[str, Any] = dict.fromkeys(("values", "unknowns"), "Int64")
    numbers = [name for name in columns if name not in (*FIRST, *LAST)]
    kinds |= dict.fromkeys((*numbers, "rms", "aic", "bic", "seconds"), float)
    return table.astype(kinds | {"converged": "boolean"})


def write(table: Any, output: Path) -> None:
    """Put the table into its place in one step, as .csv or .parquet."""
    with replacing(output) as new:
        if output.suffix.lower() == ".csv":
            table.to_csv(new, index=False)
        else:
            table.to_parquet(new, index=False, engine="pyarrow")


def _read(output: Path) -> list[Row]:
    """The rows of a table that an earlier run wrote; those that failed are left out."""
    import pandas

    if not output.exists():
        return []
    try:
        if output.suffix.lower() == ".csv":
            table = pandas.read_csv(output, dtype=str, keep_default_na=False, na_values=[""])
        else:
            table = pandas.read_parquet(output, engine="pyarrow")
        columns = list(table.columns)
        if columns[: len(FIRST)] != list(FIRST) or columns[-len(LAST) :] != list(LAST):
            raise ValueError
    except (ValueError, OSError, KeyError):
        raise FormatError(
            f"{output}: is no table of fits by gonio; choose another output, or remove this file yourself"
        ) from None
    numbers = [name for name in columns if f"{name}.stderr" in columns]
    rows = []
    for cells in table.to_dict("records"):
        if cells["status"] == FAILED:
            continue
        row = {name: _cell(name, cells[name]) for name in (*FIRST, *LAST)}
        known = [name for name in numbers if not _is_missing(cells[f"{name}.stderr"])]
        row["numbers"] = {name: (float(cells[name]), float(cells[f"{name}.stderr"])) for name in known}
        rows.append(row)
    return rows


def _is_missing(value: Any) -> bool:
    import pandas

    return value is None or value is pandas.NA or value != value


def _cell(name: str, value: Any) -> Any:
    """A cell of a table as the journal has it."""
    if name in TEXTS:
        return "" if _is_missing(value) else str(value)
    if _is_missing(value):
        return None
    if name == "converged":
        return str(value) == "True"
    return int(value) if name in ("values", "unknowns") else float(value)
