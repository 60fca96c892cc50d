"""`gonio view`: the explorer in the browser, or as one file."""

from __future__ import annotations

import contextlib
from pathlib import Path

import click

from ..declared.arguments import Declared
from ..errors import ParameterError, visible
from . import completion, options
from .command import option
from .tables import size_in_words
from .terminal import bar, echo

SIZE = 5_000_000
"""Bytes of an exported page from which its size is called large."""


@click.command(short_help="Explore materials in the browser.")
@click.argument("materials", nargs=-1, metavar="[MATERIAL]...", shell_complete=completion.materials)
@options.reading_option
@options.replace_option
@option("--port", kind=int, means=Declared("port to serve at", 1024, 65535, usual="a free one"))
@click.option("--no-browser", is_flag=True, help="Print the address, and open no browser.")
@click.option(
    "--export", "page", metavar="FILE", type=click.Path(path_type=Path), help="Write the page to this file instead."
)
@click.pass_context
def view(
    ctx: click.Context,
    materials: tuple[str, ...],
    replaced: tuple[str, ...],
    port: int | None,
    no_browser: bool,
    page: Path | None,
) -> None:
    """Explore materials in the browser: lobes, slices, lit shapes, albedo, laws and fits, side by side.

    The page is served to this machine alone, until Ctrl-C; files are dropped onto it. -p and -O are those of each
    MATERIAL. --export writes one .html file that needs neither gonio nor a network.

    \b
    Examples:
      gonio view gold measured.binary
      gonio view "Lambertian(0.2) + Microfacet(GGX(0.1))"
      gonio view gold -p alpha=0.3 --export gold.html
    """
    from ..explorer.given import Given

    reading = ctx.meta.get(options.READING, ())
    if "-" in materials:
        raise ParameterError("-: standard input cannot be read twice; expected a file: write it to one first")
    given = [Given(text, reading, replaced) for text in materials]
    if page is not None:
        _export(page, given)
        return
    from ..explorer.serving import serve

    with contextlib.suppress(KeyboardInterrupt):
        serve(given, port or 0, _tell, not no_browser)
    echo("stopped")


def _tell(address: str) -> None:
    echo(f"{address}\nOnly this machine can reach it, by this address alone. Ctrl-C stops it.")


def _export(page: Path, given: list) -> None:
    from ..explorer.export import export

    if not given:
        raise ParameterError("--export: no MATERIAL; expected at least one, such as gold")
    with bar("computing") as progress:
        size = export(page, given, progress)
    large = "; large, by the tables of its materials" if size > SIZE else ""
    echo(visible(f"{page}: {len(given)} material{'s' * (len(given) > 1)}, {size_in_words(size)}{large}"))
