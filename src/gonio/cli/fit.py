"""`gonio fit`: the numbers of a model that come nearest to a measurement, or the model that does."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path
from typing import Any

import click

from ..errors import FormatError, ParameterError, visible
from ..formula.text import listed
from . import options
from .options import since
from .terminal import bar, echo, print_json

MODEL = "Lambertian() + Microfacet(GGX(), Schlick())"


@click.command(short_help="Fit a model to MATERIAL, or choose between models.")
@options.material_argument
@click.option(
    "-m",
    "--model",
    "model",
    default=MODEL,
    show_default=True,
    help="Model, as an expression; its numbers are one start.",
)
@click.option(
    "--select",
    "chosen",
    is_flag=False,
    flag_value="lobes",
    metavar="SET",
    help="Choose between models instead: lobes, graphics, diffuse, kernels, scatter or all.",
)
@click.option(
    "--loss",
    help="What is compared: plain, cosine, log, cube_root, ratio or likelihood.  [default: likelihood where "
    "uncertainties are known, else cosine]",
)
@click.option("--robust", default="none", show_default=True, help="How outliers count: none, huber, soft_l1 or cauchy.")
@click.option("--by", help="Parameters to fit, with commas between; the others keep their numbers.  [default: all]")
@click.option(
    "--per-channel",
    help="Parameters with a number for each channel, with commas between; all or none.  [default: those in "
    "which f is linear]",
)
@options.theta_max_option("Leave out directions beyond this angle.")
@click.option("--starts", type=click.IntRange(1, 10_000), help="Number of starts.")
@click.option("--seed", default=0, type=click.IntRange(min=0), show_default=True, help="Of the starts.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="File to write the fitted model to, such as fit.json."
)
@click.option(
    "--scheduler",
    help="Of a folder or a map: processes, one on each core, or the address of a scheduler of Dask, tls://host:8786; "
    "tcp:// trusts everybody in its network.",
)
@click.option("--plot", type=click.Path(path_type=Path), help="Figure to write: .png, .jpg, .pdf or .svg.")
@options.json_option
def fit(
    material: str,
    model: str,
    chosen: str | None,
    loss: str | None,
    robust: str,
    by: str | None,
    per_channel: str | None,
    theta_max: float,
    starts: int | None,
    seed: int,
    output: Path | None,
    scheduler: str | None,
    plot: Path | None,
    as_json: bool,
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
    from ..fitting.fitting import fit as fit_model
    from ..fitting.selection import select_model
    from ..formats import save, target, writer

    start = time.perf_counter()
    shared: dict[str, Any] = {"per_channel": _channels(per_channel)}
    names = None if by is None else _names(by)
    if os.path.isdir(material) and output is None:
        raise ParameterError(f"{material}: a folder; expected -o fits.parquet, fits.csv, or of a map fits.zarr")
    if os.path.isdir(material) and output is not None and output.suffix == ".zarr":
        shared |= {"loss": loss or "plain", "by": names, "scheduler": scheduler}
        _fit_map(material, expression(model, files=True), output, **shared)
        return
    shared["theta_max"] = math.radians(theta_max)
    if os.path.isdir(material) and output is not None:
        more = {"loss": loss, "robust": robust, "starts": starts, "seed": seed}
        _fit_folder(material, chosen or [model], output, scheduler, **more, **shared)
        return
    if scheduler is not None:
        raise ParameterError(f"--scheduler: {material} is one material; expected a folder of them, or a map")
    if plot is not None:
        from ..figures._drawing import check_target

        check_target(plot)
    if output is not None:
        target(writer(output, None), output)
    data = options.read_material(material, ())
    shared["seed"] = seed
    if chosen is not None:
        with bar("fitting") as progress:
            selection = select_model(data, chosen, loss, progress=progress, **shared)
        found = selection.best.fit
        assert found is not None  # the best one has a fit
    else:
        found = fit_model(data, expression(model, files=True), loss, robust=robust, by=names, starts=starts, **shared)
    if output is not None:
        save(found.model, output)
    if plot is not None:
        from ..figures import fit as draw

        draw(found, plot)
    if as_json:
        print_json(found.to_json() if chosen is None else selection.to_json())
        return
    if chosen is not None:
        _say(f"{selection}\n")
    _say(found.report())
    written = [str(path) for path in (output, plot) if path is not None]
    echo(visible(f"{', '.join(written)}{': ' if written else ''}{since(start)}"))


def _fit_folder(folder: str, models: Any, output: Path, scheduler: str | None, **options: Any) -> None:
    from ..fitting.fit_many import fit_folder

    start = time.perf_counter()
    with bar("fitting") as progress:
        table, told = fit_folder(folder, models, output, scheduler, progress, **options)
    for _, row in table[table["error"] != ""].head(FAILED).iterrows():
        _say(f"{row['material']}, {row['model']}: {row['error']}")
    _say(f"{told}, {since(start)}")


FAILED = 10
"""Fits without a result that are told."""


def _fit_map(store: str, model: Any, output: Path, **options: Any) -> None:
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
        found = fit_map_chunks(
            data["wi"], data["wo"], data["f"], model, u=data.get("u"), output=output, progress=progress, **options
        )
    flagged = int((found["flags"] > 0).sum())
    _say(f"{output}: {found['flags'].size} texels, {flagged} of them flagged, {since(start)}")


def _say(text: str) -> None:
    for line in text.split("\n"):
        echo(visible(line))


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _channels(text: str | None) -> bool | list[str] | None:
    if text is None:
        return None
    return {"all": True, "none": False}.get(text.strip(), _names(text))
