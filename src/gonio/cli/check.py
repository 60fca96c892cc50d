"""`gonio check`: a material held to the laws of physics, or every model."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import ParameterError, visible
from . import completion
from .command import Command, TypedArguments, command
from .options import TypedMaterial, json_option, reading_option, replace_option, together
from .tables import paragraph, table
from .terminal import bar, echo, print_json

if TYPE_CHECKING:
    from ..integrals.efficiency import Efficiency


EFFICIENCY = (
    "scatter: standard deviation of a weight over the mean; effective: as many samples of equal weight would say as "
    "much; lost: below the horizon"
)


class _WithLaws(Command):
    """A command that lists the laws in its help, where LAWS stands; they are looked up when help is asked for."""

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the text above the options."""
        from ..laws import summaries

        laws = summaries()
        width = max(map(len, laws)) + 2
        lines = [textwrap.fill(f"{k:<{width}}{text}", 76, subsequent_indent=" " * width) for k, text in laws.items()]
        self.help = (self.help or "").replace("LAWS", "\n".join(["\b", *lines]))
        super().format_help_text(ctx, formatter)


@command("check", cls=_WithLaws, short_help="Hold MATERIAL to the laws of physics.")
@together(
    "material",
    TypedMaterial,
    click.argument("text", metavar="[MATERIAL]", required=False, shell_complete=completion.materials),
    replace_option,
)
@reading_option
@json_option
@click.option(
    "--plot", metavar="FILE", type=click.Path(path_type=Path), help="Figure to write that explains: .png, .pdf or .svg."
)
@click.option("--sampling", is_flag=True, help="Say also how well sampling does, by angle of view and lobe.")
@click.option("--all", "every", is_flag=True, help="Check every model instead, and print one table.")
@click.pass_context
def check(ctx: click.Context, material: TypedMaterial, as_json: bool, asked: TypedArguments, **settings: Any) -> None:
    """Hold MATERIAL to the laws.

    LAWS

    Exit code 1 if one of them does not hold, of a measurement by more than its
    uncertainties explain; with --all, if one fails that
    the model does not declare to break.
    """
    plot, sampling = settings["plot"], settings["sampling"]
    if settings["every"] == (material.text is not None):
        raise click.UsageError("expected one of MATERIAL and --all", ctx)
    if settings["every"]:
        if material.replaced or plot or sampling:
            raise click.UsageError("--all takes no -p, --plot or --sampling", ctx)
        asked.refuse_others("beside --all")
        ctx.exit(_check_all(as_json))
    from ..integrals.efficiency import sampling_efficiency
    from ..laws import MapReport
    from ..laws import check as check_laws

    if plot is not None:
        from ..figures._drawing import check_target

        check_target(plot)
    m = material.read()
    title = material.title if as_json else visible(material.title)
    with bar("checking") as progress:
        report = replace(check_laws(m, progress=progress, **asked.of("check")), material=title)
    if isinstance(report, MapReport) and (plot or sampling):
        raise ParameterError(f"{title}: its parameters are maps; expected one material for --plot and --sampling")
    rows = sampling_efficiency(m) if sampling else []
    if plot is not None:
        from ..figures import laws

        laws(m, report, plot)
    if as_json:
        more = {"sampling": [row._asdict() for row in rows]} if sampling else {}
        print_json({"name": title, **report.to_json(), **more})
    else:
        echo(_coloured(str(report)))
        if sampling:
            echo(f"\n{efficiency_table(rows)}")
    ctx.exit(0 if report.passed else 1)


def _check_all(as_json: bool) -> int:
    """Print the laws of every model; the exit code."""
    from ..laws import check_all
    from ..laws import table as table_of
    from ..laws._overview import as_text

    with bar("checking all models") as progress:
        reports = check_all(progress)
    if as_json:
        print_json([{"name": name, **report.to_json()} for name, report in reports.items()])
    else:
        echo(as_text(table_of(reports), reports))
    return 0 if all(report.lawful for report in reports.values()) else 1


def _coloured(report: str) -> str:
    for word, colour in (("  pass  ", "green"), ("  not significant  ", "green"), ("  FAIL  ", "red")):
        report = report.replace(f"\n{word}", "\n" + click.style(word, fg=colour, bold=True))
    return report


def efficiency_table(rows: Iterable[Efficiency]) -> str:
    """Rows of `sampling_efficiency`, aligned, and the meaning of the columns."""
    header = ("theta_o", "lobe", "chosen", "mean weight", "scatter", "effective", "lost")
    cells = [
        (f"{r.theta_o:g}", r.lobe, f"{r.chosen:.1%}", f"{r.mean:.4g}", f"{r.scatter:.3g}", f"{r.effective:.1%}",
         f"{r.lost:.2%}")
        for r in rows
    ]  # fmt: skip
    return f"{table(header, cells)}\n{paragraph(EFFICIENCY)}"
