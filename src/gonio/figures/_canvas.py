"""Figures that notebooks show, whether pyplot is there or not."""

from __future__ import annotations

import io

from matplotlib.figure import Figure


class Canvas(Figure):
    """A figure of Matplotlib that shows itself at the end of a cell."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, dpi=96, format="png")
        return stream.getvalue()
