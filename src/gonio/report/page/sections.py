"""The sections of a report about one material, as HTML, from its contents."""

from __future__ import annotations

from collections.abc import Callable

from .about import About
from .judged import Judged
from .shown import Shown


class Sections(About, Shown, Judged):
    """The sections of one material."""

    def html(self, level: int) -> str:
        """All of them, behind a heading of this level, and what leads to them."""
        parts = [(name, title, inner) for name, title, make in self.order() if (inner := make())]
        links = "".join(f'<a href="#{self.key}-{name}">{title}</a>' for name, title, _ in parts)
        body = "".join(
            f'<section id="{self.key}-{name}"><h3>{title}</h3>{inner}</section>' for name, title, inner in parts
        )
        head = f'{self.head(level)}<nav aria-label="parts">{links}</nav>'
        return f'<article class="material" id="{self.key}">{head}{body}</article>'

    def order(self) -> list[tuple[str, str, Callable[[], str]]]:
        """Name, title and maker of each section."""
        return [
            ("what", "What it is", self.what),
            ("lobe", "Lobe", self.lobe),
            ("slices", "Slices", self.slices),
            ("albedo", "Albedo", self.albedo),
            ("light", "In the light", self.light),
            ("laws", "Laws", self.laws),
            ("fits", "Fits", self.fits),
            ("colour", "Spectrum and colour" if (self.one["colour"] or {}).get("spectrum") else "Colour", self.colour),
            ("transmission", "What becomes of light", self.transmission),
            ("polarization", "Polarization", self.polarization),
            ("provenance", "Provenance and citation", self.provenance),
            ("reproduce", "Do it yourself", self.reproduce),
        ]
