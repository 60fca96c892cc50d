"""What `gn.engine.shader_source` gives: the text, the parameters and tables that a program brings to it, and how they
are saved."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...declared.notebooks import repr_html
from ...files import replacing


@dataclass(frozen=True)
class Argument:
    """A parameter of a source text: its name there, its path in the material, how many numbers it has, and these.

    Example
    >>> print(gn.engine.shader_source(gn.Lambertian(0.5), parameters="arguments").arguments[0].path)
    rho
    """

    name: str
    path: str
    width: int
    value: tuple[float, ...]


@dataclass(frozen=True)
class SourceTable:
    """A table that a source text reads and does not hold: its name there, and its numbers as float32, in one row.

    Example
    >>> print(len(gn.engine.shader_source(gn.Lambertian(0.5)).tables))
    0
    """

    name: str
    values: np.ndarray


@dataclass(frozen=True)
class ShaderSource:
    """Source text of a material's formula; prints as the text.

    text       what to compile
    language   "glsl", for instance
    name       the prefix of all global names in it
    channels   of the material; None where it has no channel axis
    functions  the names of the functions for callers, in order
    arguments  the parameters that follow the directions as arguments; none where they are constants in the text
    tables     the tables that the program brings, in the order of their bindings

    Example
    >>> source = gn.engine.shader_source(gn.Lambertian(0.5), "glsl", name="paper")
    >>> print(source.functions, source.language)
    ('paper_f',) glsl
    """

    _repr_html_ = repr_html

    text: str
    language: str
    name: str
    channels: int | None
    functions: tuple[str, ...]
    arguments: tuple[Argument, ...]
    tables: tuple[SourceTable, ...]

    def __str__(self) -> str:
        return self.text

    def save(self, path: str | Path) -> list[Path]:
        """Write the text, and each table beside it: as a picture .exr for OSL, else as float32, little-endian, `.f32`.

        The files that were written. Raises ParameterError for a name that cannot be written.

        Example
        >>> import pathlib, tempfile
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> print([path.name for path in gn.engine.shader_source(gn.Lambertian(0.5), "c").save(folder / "paper.c")])
        ['paper.c']
        """
        path = Path(path)
        written = []
        for table in self.tables:
            beside = path.with_name(table.name + (".exr" if self.language == "osl" else ".f32"))
            with replacing(beside) as temporary:
                if self.language == "osl":
                    _write_picture(temporary, table.values)
                else:
                    temporary.write_bytes(table.values.astype("<f4").tobytes())
            written.append(beside)
        with replacing(path) as temporary:
            temporary.write_text(self.text, encoding="utf-8")
        return [path, *written]


def _write_picture(path: Path, values: np.ndarray) -> None:
    from ...compile.source.languages.osl import WIDTH
    from ...pictures.image import Image

    rows = -(-len(values) // WIDTH)
    padded = np.zeros(rows * WIDTH, np.float32)
    padded[: len(values)] = values
    picture = path.with_suffix(".exr")
    Image(padded.reshape(rows, WIDTH, 1)).save(picture)
    if picture != path:
        picture.replace(path)
