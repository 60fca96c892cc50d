"""`gonio report`: one page about a material, or several, for people without gonio."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click

from ..errors import ParameterError, visible
from . import completion, options
from .command import TypedArguments, command
from .tables import size_in_words
from .terminal import bar, echo, print_json


@command("write_report", short_help="Write a page about MATERIALs that anybody can open.")
@click.argument("materials", nargs=-1, required=True, metavar="MATERIAL...", shell_complete=completion.materials)
@options.reading_option
@options.output_option("File to write: .html, .pdf or .json; without --json one is needed.", required=False)
@click.option("--pdf", is_flag=True, help="Print the page too, to a .pdf beside it, by Chromium, Chrome or Edge.")
@options.json_option
@options.lights_option
@options.replace_option
@options.with_light_help
@click.pass_context
def report(
    ctx: click.Context, materials: tuple[str, ...], output: Path | None, asked: TypedArguments, **settings: Any
) -> None:
    """Write a page about MATERIALs: formula, provenance, laws, slices, a lobe to turn, albedos with uncertainty, fits.

    The page is one file that needs neither gonio nor a network: it opens from a mail, on a phone, and prints. Several
    materials are compared side by side first. -p and -O are those of each MATERIAL; every --light lights a sphere of
    its own.

    \b
    Examples:
      gonio report gold-metallic-paint -o report.html
      gonio report measured.binary gold -o both.html --pdf
      gonio report gold -p alpha=0.3 --json
    """
    from ..facts.subject import Subject
    from ..report import page
    from .arguments import resolve_light

    start = time.perf_counter()
    if output is None and not settings["as_json"]:
        raise click.UsageError("nowhere to write to: expected -o report.html, or --json", ctx)
    if "-" in materials and len(materials) > 1:
        raise ParameterError("-: standard input beside other materials; expected files: write it to one first")
    suffix = ".json" if output is None else page.check_target(output)
    if settings["as_json"] and suffix != ".json":
        raise click.UsageError("--json is for numbers: expected -o report.json, or no -o", ctx)
    beside = None
    if settings["pdf"]:
        if output is None or suffix not in (".html", ".htm"):
            raise click.UsageError(
                "--pdf is for a page: expected -o report.html; -o report.pdf writes a PDF alone", ctx
            )
        beside = output.with_suffix(".pdf")
        page.check_target(beside)
    reading = ctx.meta.get(options.READING, ())
    typed = [options.TypedMaterial(text, settings["replaced"]) for text in materials]
    subjects = [Subject(one.title, one.read(), one.text, reading, one.replaced) for one in typed]
    captioned = [(text, [resolve_light(text)]) for text in settings["lights"]] or None
    if suffix == ".json":
        with bar("computing") as progress:
            content = page.data(subjects, progress=progress, **asked.of("write_report"))
        if output is None:
            print_json(content)
            return
        page.write_json(output, content)
    else:
        with bar("reporting") as progress:
            text = page.made(subjects, captioned, progress=progress, **asked.of("write_report"))
        assert output is not None
        page.write_page(output, text)
    if beside is not None:
        page.write_page(beside, text)
    for path in filter(None, (output, beside)):
        size = size_in_words(path.stat().st_size)
        count = f"{len(subjects)} material{'s' * (len(subjects) > 1)}"
        echo(visible(f"{path}: {count}, {size}, {options.since(start)}"))
