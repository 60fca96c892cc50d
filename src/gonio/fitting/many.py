"""`gn.fitting.fit_many`: fits of many materials by several models, as a table; runs that were stopped go on where they
were."""

from __future__ import annotations

import math
import os
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from ..arrays import ops
from ..base.identity import File, identity
from ..base.reflectance import Reflectance
from ..declared.arguments import Seed, checked
from ..errors import Error, MissingDataWarning, NotFoundError, ParameterError, shown
from ..formula.text import listed
from .asked import LossName, PerChannel, RobustName, Scheduler, Starts, ThetaMax
from .cluster import workers
from .fit_table import FAILED, FITTED, REFUSED, Row, journal_of, journal_path, output_file, table_of, write


class _Job(NamedTuple):
    """A material, what tells that its file has changed, and what is fitted to it: name of the model -> (model, key of
    the row)."""

    name: str
    source: Any
    stamp: Any
    models: dict[str, tuple[Reflectance, str]]
    options: dict[str, Any]
    theta_max: float


@checked
def fit_many(
    data: Any,
    models: Any,
    loss: LossName | None = None,
    *,
    robust: RobustName = "none",
    per_channel: PerChannel | None = None,
    theta_max: ThetaMax = 0.5 * math.pi,
    starts: Starts | None = None,
    seed: Seed = 0,
    output: str | os.PathLike[str] | None = None,
    scheduler: Scheduler | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Any:
    """Fits of many materials by several models: a pandas.DataFrame, one row for each material and model.

    `data`: a folder; a list of paths, names of built-in materials, and reflectances; or a mapping from names to
    these. `models`: a reflectance or an expression, several of them, a mapping from names to them, or the name of a
    set of `select_model`. `loss` to `seed`: see `fit`.
    `output`: a file to write, .parquet or .csv. A run that was stopped goes on: rows that are there, of the same data,
    model, options and version of gonio, by their content, are not computed again. Rows of other materials and models
    stay there, behind those of this call. Raises ParameterError where a fit would have to be replaced. A second run
    into the same output waits for the first.
    `scheduler`: None for threads of this process; "processes", or "processes:4", for processes of this machine, which
    nobody else can reach; the address of a Dask scheduler, "tls://10.0.0.1:8786", whose workers see the same paths; a
    client of distributed; an executor. A scheduler runs code for whoever reaches it, and what it answers is code here:
    "tcp://..." trusts everybody in that network, TLS those who have the key.
    `progress`: called with the numbers of rows that are done and of all.

    Columns: material, model, status ("fitted"; "refused" with its `error`; "failed", which the next run tries again),
    rms, aic, bic, values, unknowns, converged, seconds, each number by its path and its standard error as
    "path.stderr", loss, the fitted model as an expression, notes. Rows are in the order of data and models.

    Shapes   a row for each material and model.
    Units    those of the parameters.
    Error    see `fit`. What computes does not change the numbers: every fit is one job on one worker.
    Source   as `fit`.

    Example
    >>> materials = {"dark": gn.Lambertian(0.1), "bright": gn.OrenNayar(0.8, 0.3)}
    >>> table = gn.fitting.fit_many(materials, {"matt": gn.Lambertian(), "rough": gn.OrenNayar()})
    >>> print(table[["material", "model", "rho"]].round(2).to_string(index=False))
    material model  rho
        dark  matt 0.10
        dark rough 0.10
      bright  matt 0.74
      bright rough 0.80
    """
    final = None if output is None else output_file(output)
    chosen = _models(models)
    options = {"loss": loss, "robust": robust, "per_channel": per_channel, "starts": starts, "seed": seed}
    named = _sources(data, final)
    jobs, order = _jobs(named, chosen, options, theta_max)
    with journal_of(final, order) as journal:
        total = len(order)
        rest = [job._replace(models=left) for job in jobs if (left := _left(job, journal.rows))]
        if progress is not None:
            progress(len(journal.rows), total)
        if rest:
            with workers(scheduler) as crew, _without_warnings():
                for number, rows, error in crew.results(_rows, rest):
                    if error is not None:
                        if not isinstance(error, Exception):
                            raise error
                        rows = [_row(rest[number], name, FAILED, _told(error)) for name in rest[number].models]
                    journal.add(rows)
                    if progress is not None:
                        progress(len(journal.rows), total)
        table = table_of([journal.rows[key] for key in order])
        if final is not None:
            write(table_of([*(journal.rows[key] for key in order), *journal.others]), final)
            journal.ended()
    return table


def fit_folder(
    folder: str | os.PathLike[str],
    models: Any,
    output: str | os.PathLike[str],
    scheduler: Any = None,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> tuple[Any, str]:
    """`fit_many` of a folder into a file, for the command line: the table, and what came of it in a sentence."""
    if not os.path.isdir(folder):
        raise NotFoundError(f"{folder}: is no folder; expected one of measurements")
    table = fit_many(folder, models, output=output, scheduler=scheduler, progress=progress, **options)
    counts = table["status"].value_counts()
    told = [f"{counts[word]} {word}" for word in (FITTED, REFUSED, FAILED) if word in counts]
    return table, f"{output}: {len(table)} rows, {', '.join(told)}"


# What is to be done.


def _models(models: Any) -> dict[str, Reflectance]:
    from ..catalogue.expressions import expression
    from .selection import SETS

    if isinstance(models, str) and models in SETS:
        return SETS[models]()
    if isinstance(models, (str, Reflectance)):
        models = [models]
    if not isinstance(models, Mapping):
        if not isinstance(models, Iterable) or ops.dtype_of(models):
            raise ParameterError(
                f"models={shown(models)}: expected a model, an expression, several of them, a mapping from names to "
                f"them, or one of {listed([*SETS])}"
            )
        models = _numbered((m if isinstance(m, str) else repr(m), m) for m in models)
    found = {str(name): expression(m, files=True) if isinstance(m, str) else m for name, m in models.items()}
    for name, m in found.items():
        if not isinstance(m, Reflectance):
            raise ParameterError(f"models: {name:.60} is {shown(m)}; expected a model, or an expression of one")
    if not found:
        raise ParameterError("models: got none; expected at least one")
    return found


def _sources(data: Any, output: Path | None) -> dict[str, Any]:
    """Names and sources: paths as `Path`, names of built-in materials as text, reflectances."""
    from ..catalogue.builtin import materials

    if isinstance(data, (str, os.PathLike)) and os.path.isdir(data) and not _is_material(Path(data)):
        own = () if output is None else (output.name, journal_path(output).name)
        paths = [p for p in sorted(Path(data).iterdir()) if p.name[0] != "." and p.name not in own]
        found: dict[str, Any] = {p.name: p for p in paths if p.is_file() or _is_material(p)}
        if not found:
            raise NotFoundError(f"{data}: the folder holds no files; expected measurements")
        return found
    if isinstance(data, (str, os.PathLike, Reflectance)):
        data = [data]
    if isinstance(data, Mapping):
        pairs = [(str(name), x) for name, x in data.items()]
    elif isinstance(data, Iterable) and not ops.dtype_of(data):
        pairs = [(_name(x), x) for x in data]
    else:
        raise ParameterError(
            f"data={shown(data)}: expected a folder, a list of paths or reflectances, or a mapping from names"
        )
    if not pairs:
        raise ParameterError("data: got none; expected at least one")
    built_in = {e.name for e in materials()}
    for name, x in pairs:
        if not isinstance(x, (str, os.PathLike, Reflectance)):
            raise ParameterError(f"data: {name:.60} is {shown(x)}; expected a path, a name or a reflectance")
    named = _numbered(pairs)
    for name, x in named.items():
        is_name = isinstance(x, str) and x in built_in and not os.path.exists(x)
        named[name] = x if is_name or isinstance(x, Reflectance) else Path(os.fsdecode(x))
    return named


def _numbered(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Things by their names, of which those that were there before get a number."""
    named: dict[str, Any] = {}
    for name, x in pairs:
        different, count = name, 2
        while different in named:
            different, count = f"{name} ({count})", count + 1
        named[different] = x
    return named


def _name(source: Any) -> str:
    return " ".join(f"{source!r:.80}".split()) if isinstance(source, Reflectance) else os.fsdecode(source)


def _is_material(path: Path) -> bool:
    """Whether a folder is a material itself, as a Zarr store is."""
    from ..formats import formats

    if not path.is_dir():
        return False
    return any(f.matches_folder(path) for f in formats() if hasattr(f, "matches_folder"))


def _jobs(
    named: Mapping[str, Any], models: Mapping[str, Reflectance], options: dict[str, Any], theta_max: float
) -> tuple[list[_Job], dict[str, tuple[str, str]]]:
    """The jobs, and material and model of the keys of all rows in order."""
    jobs: list[_Job] = []
    order: dict[str, tuple[str, str]] = {}
    how = {name: identity(m, options, theta_max) for name, m in models.items()}
    for name, source in named.items():
        stamp, content = _stamp(source), _content(source)
        keyed = {model: (m, identity(name, content, model, how[model])[:24]) for model, m in models.items()}
        order |= {key: (name, model) for model, (_, key) in keyed.items()}
        if isinstance(source, Path):
            source = Path(os.path.abspath(source))
        jobs.append(_Job(name, source, stamp, keyed, options, theta_max))
    return jobs, order


def _content(source: Any) -> str:
    """The identity of what is fitted; of a file that cannot be read "", which is told by its row."""
    if not isinstance(source, Path):
        return identity(source)
    try:
        return identity(File(source))
    except (OSError, ValueError):
        return ""


def _stamp(source: Any) -> Any:
    """Sizes and times of the files of a source: they tell changes while a run lasts, and nothing else."""
    if not isinstance(source, Path):
        return None
    try:
        files = sorted(source.rglob("*")) if source.is_dir() else [source]
        return [(status.st_size, status.st_mtime_ns) for status in map(os.stat, files)]
    except (OSError, ValueError):
        return None


def _left(job: _Job, rows: Mapping[str, Row]) -> dict[str, tuple[Reflectance, str]]:
    return {name: keyed for name, keyed in job.models.items() if keyed[1] not in rows}


# A job, in any process.


def _rows(job: _Job) -> list[Row]:
    """The rows of a job: every error is one."""
    from ..catalogue.builtin import material
    from ..formats import load
    from .fitting import fit
    from .samples import samples

    rows = []
    start = time.perf_counter()
    try:
        source = job.source
        if isinstance(source, (str, Path)):
            source = load(source) if isinstance(source, Path) else material(source)
        data = samples(source, job.theta_max)
        if _stamp(job.source) != job.stamp:
            raise OSError("changed after the run began; the next one fits it")
    except Exception as error:
        return [_row(job, name, _status(error), _told(error)) for name in job.models]
    reading = (time.perf_counter() - start) / len(job.models)
    for name, (m, _) in job.models.items():
        start = time.perf_counter()
        try:
            found = fit(data, m, **job.options)
            row = _row(job, name, FITTED, "")
            row |= {"rms": found.rms, "aic": found.aic, "bic": found.bic, "values": found.used, "loss": found.loss}
            row |= {"unknowns": len(found.names), "converged": found.converged, "fitted": repr(found.model)}
            told = [f"{n} rows left out: {reason}" for reason, n in data.left_out.items()]
            row |= {"notes": "; ".join([*told, *found.notes])}
            numbers = dict(zip(found.names, found.values.tolist(), strict=True))
            row["numbers"] = {k: (x, found.stderr[k]) for k, x in numbers.items()}
        except Exception as error:
            row = _row(job, name, _status(error), _told(error))
        row["seconds"] = reading + time.perf_counter() - start
        rows.append(row)
    return rows


def _row(job: _Job, model: str, status: str, error: str) -> Row:
    return {
        "material": job.name,
        "model": model,
        "status": status,
        "error": error,
        "seconds": 0.0,
        "loss": job.options["loss"] or "",
        "fitted": "",
        "notes": "",
        "numbers": {},
        "key": job.models[model][1],
    }


def _status(error: Exception) -> str:
    return FAILED if isinstance(error, (OSError, MemoryError)) or not isinstance(error, Error) else REFUSED


def _told(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, Error) else f"{type(error).__name__}: {text:.500}"


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Rows without data are told in the notes of each row."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)
        yield
