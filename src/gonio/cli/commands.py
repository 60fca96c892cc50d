"""The command line, `gonio`. What takes time to import is imported by the commands that use it."""

from __future__ import annotations

import sys
import textwrap
import time
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..discover import docstring
from ..errors import visible
from ..scenes.shapes import SHAPES
from ..version import __version__
from .light_words import FORMS
from .terminal import Program, bar, echo, print_json, streams

if TYPE_CHECKING:
    from ..base.reflectance import Reflectance

_SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


@click.group(name="gonio", cls=Program, invoke_without_command=True, context_settings=_SETTINGS)
@click.version_option(__version__, message="gonio %(version)s")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """BRDFs, measured and modelled: list, inspect, check, show, light and convert them.

    MATERIAL is a file (`gonio formats` lists what can be read; - is standard input), the name of a built-in
    material (gold-metallic-paint), or an expression ("Lambertian(0.2) + 0.5 * Microfacet(GGX(0.1), Dielectric(1.5))").
    -p alpha=0.3 replaces a parameter of any of them.

    \b
    Examples:
      gonio materials paint                         built-in paints
      gonio render gold-metallic-paint -o gold.png  a lit sphere
      gonio check measured.binary                   does it obey the laws?
      gonio show gold -p alpha=0.3 -o gold.pdf      slices, albedo and a sphere

    Exit code: 0 good, 1 a law failed, 2 bad input or a failure of the machine, 70 a fault of gonio.
    """
    if ctx.invoked_subcommand is None:
        echo(ctx.get_help())


_material = click.argument("material")
_replace = click.option(
    "-p",
    "--parameter",
    "replaced",
    metavar="NAME=VALUE",
    multiple=True,
    help="Replace a parameter; may be repeated. `gonio info MATERIAL` lists them.",
)
_lights = click.option(
    "-l",
    "--light",
    "lights",
    metavar="LIGHT",
    multiple=True,
    default=("studio",),
    help="Where the light comes from, see above; may be repeated.  [default: studio]",
)
_json = click.option("--json", "as_json", is_flag=True, help="Print JSON.")
_samples = click.option("--samples", default=32, show_default=True, help="Samples per pixel.")


def _output(help_: str) -> Callable:
    return click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help=help_)


LIGHT_HELP = """

\b
LIGHT is one of
{lights}

Angles are in degrees, PHI from +x towards +y; the sphere has radius 1 and is at 0,0,0, z is up, the
camera looks along +y: distant:45,-90 comes from behind it. L, E and I are a number, or one per channel
(constant:1,0.9,0.8).
"""


def _aligned(meanings: Mapping[str, str]) -> str:
    """Names and what they mean, in two columns."""
    indent = " " * (max(map(len, meanings)) + 2)
    lines = [
        textwrap.wrap(text, 76, initial_indent=name.ljust(len(indent)), subsequent_indent=indent)
        for name, text in meanings.items()
    ]
    return "\n".join(chain.from_iterable(lines))


def _with_light_help(command: Callable) -> Callable:
    listed = _aligned({f"  {form}": meaning for form, meaning in FORMS.items()})
    command.__doc__ = docstring(command) + LIGHT_HELP.format(lights=listed)
    return command


def _get(material: str, replaced: Sequence[str]) -> Reflectance:
    from .arguments import resolve, with_parameters

    return with_parameters(resolve(material), replaced)


@cli.command(short_help="List the built-in materials.")
@click.argument("pattern", required=False)
@_json
def materials(pattern: str | None, as_json: bool) -> None:
    """List the built-in materials, those that match PATTERN (a word, or with * and ?)."""
    from .listing import matching, table

    entries = matching(pattern)
    if as_json:
        from dataclasses import asdict

        print_json([asdict(entry) for entry in entries])
        return
    rows = [(e.name, e.kind, e.description) for e in entries]
    echo(table(("name", "kind", "what it is"), rows))
    if sys.stdout.isatty():
        echo(f"\n{len(rows)} materials; gonio info NAME says more, gonio cite NAME where it is from.")


@cli.command(short_help="Say what MATERIAL is, and what a file holds.")
@_material
@_replace
@_json
def info(material: str, replaced: tuple[str, ...], as_json: bool) -> None:
    """Say what MATERIAL is: formula, parameters, channels, albedo; of a file also what it holds and lacks."""
    from ..report.facts import facts
    from .listing import facts_as_text

    found = facts(material, _get(material, replaced))
    if as_json:
        print_json(found)
    else:
        echo(facts_as_text(found))


@cli.command(short_help="Quote the albedo of MATERIAL, with its uncertainty.")
@_material
@_replace
@_json
@click.option("--theta", default="0,45,75", show_default=True, help="Polar angles of incidence [degrees].")
@click.option("--phi", default="0", show_default=True, help="Azimuths of incidence [degrees].")
@click.option(
    "--uncertainty",
    "assumed",
    type=click.Choice(["independent", "common", "channel"]),
    multiple=True,
    help="What the errors of the values are taken to be; may be repeated.  [default: independent, common]",
)
@click.option("--scale", type=float, metavar="U", help="Relative standard uncertainty of all values together.")
@click.option("-k", "factor", default=1.0, show_default=True, help="Coverage factor of what is printed.")
def albedo(
    material: str,
    replaced: tuple[str, ...],
    as_json: bool,
    theta: str,
    phi: str,
    assumed: tuple[str, ...],
    scale: float | None,
    factor: float,
) -> None:
    """Quote the albedo of MATERIAL: its directional-hemispherical reflectance, by angle of incidence and channel.

    Of a measurement that states the uncertainty of its values also the uncertainty that follows: little if their errors
    are independent, most if one error is common to all.
    """
    from .quotes import albedos, angles, as_text

    at = angles(theta, "theta", below=90.0), angles(phi, "phi")
    rows = albedos(_get(material, replaced), *at, assumed, scale)
    if as_json:
        print_json(rows)
    else:
        echo(as_text(rows, factor))


class _WithLaws(click.Command):
    """A command that lists the laws in its help, where LAWS stands; they are looked up when help is asked for."""

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the text above the options."""
        from ..laws import summaries

        self.help = (self.help or "").replace("LAWS", f"\b\n{_aligned(summaries())}")
        super().format_help_text(ctx, formatter)


@cli.command(cls=_WithLaws, short_help="Hold MATERIAL to the laws of physics.")
@click.argument("material", required=False)
@_replace
@_json
@click.option("--plot", type=click.Path(path_type=Path), help="Figure to write that explains: .png, .pdf or .svg.")
@click.option("--sampling", is_flag=True, help="Say also how well sampling does, by angle of view and lobe.")
@click.option("--all", "every", is_flag=True, help="Check every model instead, and print one table.")
@click.pass_context
def check(
    ctx: click.Context,
    material: str | None,
    replaced: tuple[str, ...],
    as_json: bool,
    plot: Path | None,
    sampling: bool,
    every: bool,
) -> None:
    """Hold MATERIAL to the laws.

    LAWS

    Exit code 1 if one of them does not hold; with --all, if one fails that
    the model does not declare to break.
    """
    if every == (material is not None):
        raise click.UsageError("expected one of MATERIAL and --all", ctx)
    if material is None:
        if replaced or plot or sampling:
            raise click.UsageError("--all takes no -p, --plot or --sampling", ctx)
        ctx.exit(_check_all(as_json))
    from dataclasses import replace

    from ..laws import check as check_laws

    if plot is not None:
        from ..files import target

        target(plot)
    m = _get(material, replaced)
    title = _title(material, replaced) if as_json else visible(_title(material, replaced))
    with bar("checking") as progress:
        report = replace(check_laws(m, progress=progress), material=title)
    rows = []
    if sampling:
        from ..integrals.efficiency import sampling_efficiency

        rows = sampling_efficiency(m)
    if plot is not None:
        from ..report.law_figures import draw

        draw(m, report, plot)
    if as_json:
        more = {"sampling": [row._asdict() for row in rows]} if sampling else {}
        print_json({"name": title, **report.to_json(), **more})
    else:
        echo(_coloured(str(report)))
        if sampling:
            from .listing import efficiency_table

            echo(f"\n{efficiency_table(rows)}")
    ctx.exit(0 if report.passed else 1)


def _check_all(as_json: bool) -> int:
    """Print the laws of every model; the exit code."""
    from ..laws import check_all, table
    from ..laws._overview import as_text

    with bar("checking all models") as progress:
        reports = check_all(progress)
    if as_json:
        print_json([{"name": name, **report.to_json()} for name, report in reports.items()])
    else:
        echo(as_text(table(reports), reports))
    return 0 if all(report.lawful for report in reports.values()) else 1


def _coloured(report: str) -> str:
    for word, colour in (("  pass  ", "green"), ("  FAIL  ", "red")):
        report = report.replace(f"\n{word}", "\n" + click.style(word, fg=colour, bold=True))
    return report


@cli.command(short_help="Render MATERIAL on a lit shape.")
@_material
@_output("Picture to write: .png, .exr or .hdr.")
@_lights
@_replace
@click.option("--shape", default="sphere", show_default=True, help=f"What to render: {', '.join(SHAPES)}.")
@click.option("--size", default=512, show_default=True, help="Width and height in pixels.")
@_samples
@click.option(
    "--seed",
    default=0,
    type=click.IntRange(min=0),
    show_default=True,
    help="Of the random numbers: the same seed, the same picture.",
)
@click.option("--exposure", default=0.0, show_default=True, help="Stops by which a .png is brightened.")
@_with_light_help
def render(
    material: str,
    output: Path,
    lights: tuple[str, ...],
    replaced: tuple[str, ...],
    shape: str,
    size: int,
    samples: int,
    seed: int,
    exposure: float,
) -> None:
    """Render MATERIAL on a lit shape.

    A .png is sRGB with a transparent background; .exr and .hdr hold linear radiance.
    """
    from ..pictures.image import check_target
    from ..scenes.rendering import render as render_image
    from .arguments import resolve_light

    start = time.perf_counter()
    check_target(output, exposure)
    m = _get(material, replaced)
    sources = [resolve_light(text) for text in lights]
    with bar("rendering") as progress:
        picture = render_image(m, sources, shape, size, samples, seed, progress=progress)
    picture.save(output, exposure)
    what = f"{_title(material, replaced)} under {', '.join(lights)}"
    echo(visible(f"{output}: {what}, {size} x {size}, {samples} samples per pixel, {_since(start)}"))


@cli.command(short_help="Draw MATERIAL in one figure.")
@_material
@_output("Figure to write: .png, .jpg, .pdf or .svg.")
@_lights
@_replace
@click.option("--size", default=256, show_default=True, help="Width and height of the sphere in pixels.")
@_samples
@_with_light_help
def show(
    material: str, output: Path, lights: tuple[str, ...], replaced: tuple[str, ...], size: int, samples: int
) -> None:
    """Draw MATERIAL in one figure: slices in the plane of incidence, albedo against angle, a lit sphere."""
    from ..files import target
    from ..report.figures import show as draw
    from .arguments import resolve_light

    start = time.perf_counter()
    target(output)
    m = _get(material, replaced)
    sources = [resolve_light(text) for text in lights]
    with bar("drawing") as progress:
        draw(
            m,
            output,
            sources,
            title=visible(_title(material, replaced)),
            size=size,
            samples=samples,
            progress=progress,
        )
    echo(visible(f"{output}: {_title(material, replaced)} under {', '.join(lights)}, {_since(start)}"))


@cli.command(short_help="Write a material to a file of another format.")
@click.argument("material", metavar="IN")
@click.argument("output", metavar="OUT", type=click.Path(path_type=Path))
@_replace
@click.option("--format", "format_", metavar="FORMAT", help="Format, where the suffix of OUT does not say which.")
@click.option("--resolution", metavar="N,N,..", help="Nodes along each axis, of formats that leave a choice.")
@click.option("--option", "options", metavar="NAME=VALUE", multiple=True, help="Option of the format; may be repeated.")
@_json
def convert(
    material: str,
    output: Path,
    replaced: tuple[str, ...],
    format_: str | None,
    resolution: str | None,
    options: tuple[str, ...],
    as_json: bool,
) -> None:
    """Write the material IN to the file OUT, and say what that changes and loses.

    IN is any MATERIAL. The format is that of OUT's suffix, or the one named; `gonio formats` lists them all. What is
    said is measured: the file is read again and compared with IN, at 32768 pairs of directions.

    \b
    Examples:
      gonio convert steel.binary steel.bsdf --format rgl
      gonio convert gold gold.bsdf --format rgl --resolution 128
    """
    from ..conversion.conversion import convert as convert_to
    from ..files import target
    from ..formats import writer
    from ..formats._reading.reader_options import parsed
    from .listing import conversion_as_text, size_in_words

    start = time.perf_counter()
    target(output)
    given = [*([] if resolution is None else [f"resolution={resolution}"]), *options]
    module = writer(output, format_)
    chosen = parsed(module, "write", given)
    found = convert_to(_get(material, replaced), output, module.NAME, **chosen)
    if as_json:
        print_json({**found.to_json(), "material": _title(material, replaced)})
        return
    size = size_in_words(found.bytes)
    echo(visible(f"{output}: {_title(material, replaced)} as {found.format}, {size}, {_since(start)}"))
    echo(conversion_as_text(found))


@cli.command("formats", short_help="List the file formats.")
@_json
def formats_(as_json: bool) -> None:
    """List the file formats: their suffixes, whether they are read and written, and what they were checked against.

    Files are recognised by their content. A suffix of several formats does not say which one to write: name it.
    """
    from ..report.format_table import format_table
    from .listing import formats_as_text

    rows = format_table()
    if as_json:
        print_json([row._asdict() for row in rows])
    else:
        echo(formats_as_text(rows))


@cli.command(short_help="Print BibTeX for the sources of MATERIAL.")
@_material
@_replace
def cite(material: str, replaced: tuple[str, ...]) -> None:
    """Print BibTeX for the sources of MATERIAL: of its model, of its pieces and of its numbers."""
    from ..catalogue.citations import cite as bibtex

    echo(bibtex(_get(material, replaced)))


def _title(material: str, replaced: Sequence[str]) -> str:
    return ", ".join([material, *replaced])


def _since(start: float) -> str:
    return f"{time.perf_counter() - start:.1f} s"


def main() -> None:
    """Run the command line."""
    streams()
    cli()


if __name__ == "__main__":
    main()
