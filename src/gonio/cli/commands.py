"""The command line, `gonio`: a file a command. Commands import slow modules when they run."""

from __future__ import annotations

import click

from ..declared.version import __version__
from . import (
    albedo,
    check,
    cite,
    compare,
    completion,
    convert,
    fit,
    formats,
    import_,
    info,
    materials,
    measure,
    models,
    nearest,
    plan,
    reconstruct,
    render,
    report,
    shader_source,
    show,
    view,
)
from .group import CommandGroup, streams
from .terminal import echo

_SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


FIRST = """gonio: BRDFs, measured and modelled.

  gonio report gold -o gold.html   all about a material, on one page
  gonio view gold                  explore it in the browser
  gonio fit FILE                   which model comes nearest to a measurement?

gonio --help for all; gonio COMMAND --help for one of them."""
"""What is said to those who do not say what they want: the three most useful commands."""


@click.group(name="gonio", cls=CommandGroup, invoke_without_command=True, context_settings=_SETTINGS)
@click.version_option(__version__, message="gonio %(version)s")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """BRDFs, measured and modelled: list, inspect, check, show, light and convert them.

    MATERIAL is a file (`gonio formats` lists what can be read; - is standard input), the name of a built-in
    material (gold-metallic-paint), or an expression ("Lambertian(0.2) + 0.5 * Microfacet(GGX(0.1), Dielectric(1.5))").
    -p alpha=0.3 replaces a parameter of any of them. Angles are in degrees, or have their unit: 8, 8deg, 0.14rad;
    shares are in %.

    \b
    Examples:
      gonio materials paint                     built-in paints
      gonio models GGX                          what a model is, its parameters
      gonio render gold -o gold.png             a lit sphere
      gonio check measured.binary               does it obey the laws?
      gonio show gold -p alpha=0.3 -o gold.pdf  slices, albedo and a sphere
      gonio fit measured.binary                 which numbers of a model fit

    Functions of Python that ask for no more than a material and numbers are commands too: gonio white-sky-albedo gold.

    Exit code: 0 good, 1 a law failed, 2 bad input or a failure of the machine, 70 a fault of gonio.
    """
    if ctx.invoked_subcommand is None:
        echo(FIRST)


for command in (
    *(materials.materials, models.models, info.info, albedo.albedo, check.check),
    *(render.render, show.show, shader_source.shader_source, report.report, view.view, compare.compare),
    *(nearest.nearest, fit.fit, plan.plan, reconstruct.reconstruct),
    *(import_.import_, convert.convert, measure.measure, formats.formats_, cite.cite),
    completion.completion,
):  # in the order of the help
    cli.add_command(command)


def main() -> None:
    """Run the command line."""
    streams()
    cli()


if __name__ == "__main__":
    main()
