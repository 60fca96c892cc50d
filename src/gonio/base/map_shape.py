"""Whether a material is a map: of which shape its parameters vary over places."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..evaluate import batch

if TYPE_CHECKING:
    from ..formula.parametrised import Parametrised


def map_shape(m: Parametrised) -> tuple[int, ...]:
    """The shape of a material's maps; () for one material."""
    return batch.full_shape(m, ())
