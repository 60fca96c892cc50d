"""`gonio cite`: BibTeX for the sources of a material."""

from __future__ import annotations

import click

from .options import material_argument, read_material, replace_option
from .terminal import echo


@click.command(short_help="Print BibTeX for the sources of MATERIAL.")
@material_argument
@replace_option
def cite(material: str, replaced: tuple[str, ...]) -> None:
    """Print BibTeX for the sources of MATERIAL: of its model, of its pieces and of its numbers."""
    from ..catalogue.citations import cite as bibtex

    echo(bibtex(read_material(material, replaced)))
