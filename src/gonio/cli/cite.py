"""`gonio cite`: BibTeX for the sources of a material."""

from __future__ import annotations

import click

from .options import TypedMaterial, material_argument
from .terminal import echo


@click.command(short_help="Print BibTeX for the sources of MATERIAL.")
@material_argument
def cite(material: TypedMaterial) -> None:
    """Print BibTeX for the sources of MATERIAL: of its model, of its pieces and of its numbers."""
    from ..catalogue.citations import cite as bibtex

    echo(bibtex(material.read()))
