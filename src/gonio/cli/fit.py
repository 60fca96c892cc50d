"""`gonio fit`: the numbers of a model that come nearest to a measurement, or the model that does."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import click

from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError
from ..formula.text import listed
from . import completion, options
from .command import TypedArguments, command, option
from .options import since
from .terminal import bar, print_json, say

MODEL = "Lambertian() + Microfacet(GGX(), Schlick())"


@command(
    *("fit", "fitting.select_model", "fitting.fit_many", "fitting.fit_map_chunks"),
    short_help="Fit a model to MATERIAL, or choose between models.",
)
@click.argument("material", shell_complete=completion.materials)
@options.reading_option
@click.option(
    *("-m", "--model", "model"),
    default=MODEL,
    show_default=True,
    help="Model, as an expression; its numbers are one start.",
)
@option(
    *("--select", "models"),
    means=Declared("choose between models instead: lobes, graphics, diffuse, kernels, scatter or all"),
    is_flag=False,
    flag_value="lobes",
    metavar="SET",
)
@options.output_option("File to write the fitted model to, such as fit.json.", required=False)
@click.option(
    "--plot", metavar="FILE", type=click.Path(path_type=Path), help="Figure to write: .png, .jpg, .pdf or .svg."
)
@options.json_option
def fit(
    material: str, model: str, models: str | None, output: Path | None, asked: TypedArguments, **settings: Any
) -> None:
    """Fit a model to MATERIAL: its numbers with standard errors, how well it agrees, and where it does not.

    Of a folder of measurements every file is fitted, to a table: -o fits.parquet or fits.csv. A Zarr store with f,
    wi and wo is a map, of which every texel is fitted: -o fits.zarr. Either goes on where an earlier run stopped.

    \b
    Examples:
      gonio fit paint.binary
      gonio fit paint.csv -m "OrenNayar() + Microfacet(Beckmann())" -o fit.json
      gonio fit paint.binary --select graphics --plot paint.png
      gonio fit DIR -o fits.parquet --scheduler processes
    """
    from ..catalogue.expressions import expression
    from ..formats import save, target, writer

    start = time.perf_counter()
    if os.path.isdir(material):
        if output is None:
            raise ParameterError(f"{material}: a folder; expected -o fits.parquet, fits.csv, or of a map fits.zarr")
        if output.suffix == ".zarr":
            asked.refuse_others("of a map", "fitting.fit_map_chunks")
            _fit_map(material, expression(model, files=True), output, asked.of("fitting.fit_map_chunks"))
        else:
            asked.refuse_others("of a folder", "fitting.fit_many")
            _fit_folder(material, models or [model], output, asked.of("fitting.fit_many"))
        return
    if models is None:
        asked.refuse_others("of one material", "fit")
    else:
        asked.refuse_others("beside --select", "fitting.select_model")
    plot: Path | None = settings["plot"]
    if plot is not None:
        from ..figures._drawing import check_target

        check_target(plot)
    if output is not None:
        target(writer(output, None), output)
    data = options.TypedMaterial(material).read()
    if models is not None:
        with bar("fitting") as progress:
            selection = asked.call("fitting.select_model", data, models, progress=progress)
        result = selection.best.fit
        assert result is not None  # the best one has a fit
    else:
        result = asked.call("fit", data, expression(model, files=True))
    if output is not None:
        save(result.model, output)
    if plot is not None:
        from ..figures import fit as draw

        draw(result, plot)
    if settings["as_json"]:
        print_json(result.to_json() if models is None else selection.to_json())
        return
    if models is not None:
        say(f"{selection}\n")
    say(result.report())
    written = [str(path) for path in (output, plot) if path is not None]
    say(f"{', '.join(written)}{': ' if written else ''}{since(start)}")


def _fit_folder(folder: str, models: Any, output: Path, how: dict[str, Any]) -> None:
    from ..fitting.many import fit_folder

    start = time.perf_counter()
    with bar("fitting") as progress:
        table, told = fit_folder(folder, models, output, progress=progress, **how)
    for _, row in table[table["error"] != ""].head(FAILED).iterrows():
        say(f"{row['material']}, {row['model']}: {row['error']}")
    say(f"{told}, {since(start)}")


FAILED = 10
"""Fits without a result that are told."""


def _fit_map(store: str, model: Any, output: Path, how: dict[str, Any]) -> None:
    import xarray

    from ..fitting.maps.map_chunks import fit_map_chunks

    start = time.perf_counter()
    try:
        data = xarray.open_zarr(store, consolidated=False)
    except (OSError, ValueError) as error:
        raise FormatError(f"{store}: no store of Zarr: {error}") from None
    missing = [name for name in ("f", "wi", "wo") if name not in data]
    if missing:
        raise FormatError(f"{store}: holds no {listed(missing)}; expected f, wi and wo with an axis observation")
    with bar("fitting") as progress:
        values = data["wi"], data["wo"], data["f"], data.get("u")
        maps = fit_map_chunks(values, model, output=output, progress=progress, **how)
    flagged = int((maps["flags"] > 0).sum())
    say(f"{output}: {maps['flags'].size} texels, {flagged} of them flagged, {since(start)}")
