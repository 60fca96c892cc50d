"""Fits of many materials by many models, as a table that goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..arguments import checked
from ..base.reflectance import Reflectance
from ..errors import DependencyError, NotFoundError, ParameterError, shown
from ..files import replacing, target
from ..formats import load
from ..formula.text import listed
from .cluster import each
from .fitting import fit
from .selection import SETS

if TYPE_CHECKING:
    import pandas

SUFFIXES = (".parquet", ".csv")

PARTS = ".parts"
"""What is added to the name of the output, for the folder of the rows that are done."""


class _Job(NamedTuple):
    """A material, by its path or itself, and the models that are fitted to it."""

    key: str
    name: str
    source: Any
    models: dict[str, Reflectance]
    options: dict[str, Any]


@checked
def fit_many(
    sources: Any,
    models: Any,
    output: str | os.PathLike | None = None,
    loss: str | None = None,
    *,
    per_channel: Any = None,
    theta_max: float = math.pi / 2.0,
    scheduler: Any = None,
    progress: Callable[[int, int], None] | None = None,
) -> pandas.DataFrame:
    """Fits of every material by every model: a table with a row for each pair, by name.

    `sources`: a folder, whose files are read; a list of paths and reflectances; or a mapping from names to these.
    `models`: a model; a mapping from names to models; or the name of a set, as `select_model` has them.
    `output`: a .parquet or .csv file. Until all is done, the rows that are lie beside it, in a folder of its name and
    ".parts": a run that was killed goes on from there, and one that is repeated computes only what is new or changed.
    `scheduler`: None, for this process and its threads; "processes", a process on each core; the address of a scheduler
    of Dask; or a `distributed.Client`. Its workers read the files themselves.

    The columns are material, model, error, converged, values, rms, aic, bic, agreeing, seconds, notes, expression, key,
    and for each parameter its number and, with " u" behind the name, its standard error. What cannot be read or fitted
    is a row with its error. Other arguments are those of `fit`.

    Raises ParameterError and NotFoundError for sources, models and outputs that are none; DependencyError for .parquet
    without pyarrow, and for schedulers without distributed.

    Example
    >>> table = gn.fit_many({"dull": gn.Lambertian(0.2), "shiny": gn.ABC(50.0)}, gn.Lambertian())
    >>> print(table.set_index("material")["rho"].round(3)["dull"])
    0.2
    """
    chosen = _models(models)
    options = {"loss": loss, "per_channel": per_channel, "theta_max": theta_max}
    jobs = [_job(name, source, chosen, options) for name, source in _sources(sources)]
    path = None if output is None else _output(output)
    folder = None if path is None else Path(f"{path}{PARTS}")
    done = _known(path, folder)
    left = [job for job in jobs if job.key not in done]
    for number, (job, rows, error) in enumerate(each(_rows, left, scheduler), len(jobs) - len(left) + 1):
        if error is not None:
            rows = [_failed(job, model, f"the worker was lost: {error}") for model in job.models]
        done[job.key] = rows
        if folder is not None:
            _keep(folder, job.key, rows)
        if progress is not None:
            progress(number, len(jobs))
    rows = [row for job in jobs for row in done[job.key]]
    table = _table(rows)
    if path is not None and folder is not None:
        with replacing(path) as temporary:
            if path.suffix == ".parquet":
                table.to_parquet(temporary, index=False)
            else:
                table.to_csv(temporary, index=False)
        shutil.rmtree(folder, ignore_errors=True)
    return table


def _models(models: Any) -> dict[str, Reflectance]:
    if isinstance(models, str):
        if models not in SETS:
            raise ParameterError(f"models={models!r:.60}: expected one of {listed([*SETS])}, a model, or a mapping")
        return SETS[models]()
    if isinstance(models, Reflectance):
        return {type(models).__name__: models}
    if not isinstance(models, Mapping) or not models or not all(isinstance(m, Reflectance) for m in models.values()):
        raise ParameterError(
            f"models={shown(models)}: expected a model, a mapping from names to models, or a set's name"
        )
    return {str(name): m for name, m in models.items()}


def _sources(sources: Any) -> list[tuple[str, Any]]:
    """Names and sources: paths, or reflectances."""
    if isinstance(sources, Reflectance):
        raise ParameterError(f"sources={shown(sources)}: one material; expected several, or gn.fit(m, model)")
    if isinstance(sources, (str, os.PathLike)):
        folder = Path(sources)
        if not folder.is_dir():
            raise NotFoundError(f"{sources}: no such folder; expected a folder of measurements, or a list of files")
        files = sorted(x for x in folder.iterdir() if not x.name.startswith(".") and x.is_file())
        if not files:
            raise NotFoundError(f"{sources}: a folder without files; expected measurements")
        return [(x.name, str(x)) for x in files]
    if isinstance(sources, Mapping):
        named = [(str(name), x) for name, x in sources.items()]
    elif isinstance(sources, Iterable) and not hasattr(sources, "dtype"):
        named = [(Path(x).name if _is_path(x) else f"{x!r:.60}", x) for x in sources]
    else:
        named = []
    if not named or not all(isinstance(x, Reflectance) or _is_path(x) for _, x in named):
        raise ParameterError(
            f"sources={shown(sources)}: expected a folder, a list of paths and reflectances, or a mapping"
        )
    return [(name, x if isinstance(x, Reflectance) else os.fspath(x)) for name, x in named]


def _is_path(x: Any) -> bool:
    return isinstance(x, (str, os.PathLike))


def _job(name: str, source: Any, models: dict[str, Reflectance], options: dict[str, Any]) -> _Job:
    """The job, with a key that changes with the file, the models and the options."""
    content = f"{source!r}"
    if isinstance(source, str) and os.path.exists(source):
        status = os.stat(source)
        content += f"{status.st_size} {status.st_mtime_ns}"
    facts = f"{name}\n{content}\n{ {k: repr(m) for k, m in models.items()} }\n{options}"
    return _Job(hashlib.sha256(facts.encode()).hexdigest()[:20], name, source, models, options)


def _output(output: str | os.PathLike) -> Path:
    path = target(output)
    if path.suffix not in SUFFIXES:
        raise ParameterError(f"{output}: expected a name that ends in {listed(SUFFIXES)}")
    if path.suffix == ".parquet":
        try:
            import pyarrow  # noqa: F401
        except ImportError:
            raise DependencyError(f'{output}: pyarrow is missing; pip install "gonio[fit]", or write .csv') from None
    return path


def _rows(job: _Job) -> list[dict[str, Any]]:
    """A row for each model; what fails is a row with its error."""
    try:
        data = job.source if isinstance(job.source, Reflectance) else load(job.source)
    except Exception as error:  # whatever a file does, the others go on
        return [_failed(job, model, _told(error)) for model in job.models]
    return [_row(job, data, model) for model in job.models]


def _row(job: _Job, data: Reflectance, model: str) -> dict[str, Any]:
    start = time.perf_counter()
    try:
        found = fit(data, job.models[model], **job.options)
        row = {
            "error": "",
            "converged": found.converged,
            "values": found.used,
            "rms": found.rms,
            "aic": found.aic,
            "bic": found.bic,
            "agreeing": found.agreeing,
            "seconds": time.perf_counter() - start,
            "notes": "; ".join(found.notes),
            "expression": repr(found.model),
        }
        numbers = {name: float(x) for name, x in zip(found.names, found.values, strict=True)}
        errors = {f"{name} u": float(x) for name, x in found.stderr.items()}
    except Exception as error:
        return _failed(job, model, _told(error))
    paired = {key: x for name in numbers for key, x in ((name, numbers[name]), (f"{name} u", errors[f"{name} u"]))}
    return {"material": job.name, "model": model, **row, "key": job.key, **paired}


def _told(error: Exception) -> str:
    return str(error) if isinstance(error, ParameterError) else f"{type(error).__name__}: {error}"


def _failed(job: _Job, model: str, reason: str) -> dict[str, Any]:
    return {"material": job.name, "model": model, "error": reason, "converged": False, "key": job.key}


def _known(path: Path | None, folder: Path | None) -> dict[str, list[dict[str, Any]]]:
    """The rows of earlier runs, by the keys of their jobs: of the output, and of a run that did not end."""
    known: dict[str, list[dict[str, Any]]] = {}
    if path is not None and path.exists():
        import pandas

        try:
            table = pandas.read_parquet(path) if path.suffix == ".parquet" else pandas.read_csv(path)
            for key, rows in table.groupby("key", sort=False):
                known[str(key)] = [{k: x for k, x in row.items() if x == x} for row in rows.to_dict("records")]
        except Exception as error:
            rule = "expected the table of an earlier run, which goes on; choose another name, or remove it"
            raise ParameterError(f"{path}: {error}; {rule}") from None
    if folder is not None and folder.is_dir():
        for part in folder.glob("*.json"):
            known[part.stem] = json.loads(part.read_text(encoding="utf-8"))
    return known


def _keep(folder: Path, key: str, rows: list[dict[str, Any]]) -> None:
    """Write the rows of a job, whole or not at all."""
    folder.mkdir(exist_ok=True)
    with replacing(folder / f"{key}.json") as temporary:
        Path(temporary).write_text(json.dumps(rows), encoding="utf-8")


def _table(rows: list[dict[str, Any]]) -> pandas.DataFrame:
    import pandas

    first = ("material", "model", "error", "converged", "values", "rms", "aic", "bic", "agreeing", "seconds")
    names = dict.fromkeys([*first, "notes", "expression", "key", *(name for row in rows for name in row)])
    table = pandas.DataFrame(rows, columns=list(names))
    for name in ("error", "notes", "expression"):
        table[name] = table[name].fillna("").astype(str)
    table["converged"] = table["converged"].astype(bool)
    return table
