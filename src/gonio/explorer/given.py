"""The materials of the command line. The server knows no more of materials: what they are, the worker says."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ..base.reflectance import Reflectance


class Given(NamedTuple):
    """A MATERIAL of the command line, its -O to read it with and its -p."""

    text: str
    reading: tuple[str, ...] = ()
    replaced: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The text by which the page asks for it."""
        return ", ".join([self.text, *self.replaced])

    def material(self) -> Reflectance:
        """The material, as it is typed."""
        from ..catalogue.typed import as_typed, with_parameters

        return with_parameters(as_typed(self.text, self.reading), self.replaced)
