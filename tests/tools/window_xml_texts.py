"""WINDOW XML by hand, for its tests and as seeds. Values have no symmetry, so that a swapped or turned axis shows."""

from __future__ import annotations

import numpy as np

from gonio.formats.window_xml.klems import FULL, AngleBasis

TINY = AngleBasis("Tiny", (0.0, 30.0, 90.0), (1, 4))


def numbers_of(outgoing: int, incident: int, seed: int = 0) -> np.ndarray:
    o, i = np.meshgrid(np.arange(outgoing), np.arange(incident), indexing="ij")
    return 0.02 + 0.01 * ((37 * o + 11 * i + 5 * seed + (o * i) % 7) % 29)


def defined(basis: AngleBasis) -> str:
    rings = "".join(
        f"<AngleBasisBlock><Theta>0</Theta><nPhis>{n}</nPhis><ThetaBounds><LowerTheta>{low:g}</LowerTheta>"
        f"<UpperTheta>{high:g}</UpperTheta></ThetaBounds></AngleBasisBlock>\n"
        for low, high, n in zip(basis.edges, basis.edges[1:], basis.counts, strict=False)
    )
    return f"<AngleBasis><AngleBasisName>{basis.name}</AngleBasisName>\n{rings}</AngleBasis>\n"


def block(text: str, direction: str, band: str = "Visible", over: str = "", unit: str = "Integral") -> str:
    over = over or "<ColumnAngleBasis>Tiny</ColumnAngleBasis><RowAngleBasis>Tiny</RowAngleBasis>"
    return (
        f'<WavelengthData>\n<LayerNumber>System</LayerNumber><Wavelength unit="{unit}">{band}</Wavelength>\n'
        f"<WavelengthDataBlock>\n<WavelengthDataDirection>{direction}</WavelengthDataDirection>\n{over}\n"
        f"<ScatteringDataType>BTDF</ScatteringDataType>\n<ScatteringData>\n{text}\n</ScatteringData>\n"
        f"</WavelengthDataBlock>\n</WavelengthData>\n"
    )


def document(blocks: str, structure: str = "Columns", bases: str | None = None) -> str:
    bases = defined(TINY) if bases is None else bases
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<WindowElement xmlns="http://windows.lbl.gov">\n'
        f"<WindowElementType>System</WindowElementType><FileType>BSDF</FileType>\n<Optical><Layer>\n<Material>"
        f'<Name>Shade &amp; co</Name><Manufacturer>m</Manufacturer><Thickness unit="Millimeter">1</Thickness>'
        f"</Material>\n<DataDefinition><IncidentDataStructure>{structure}</IncidentDataStructure>\n{bases}"
        f"</DataDefinition>\n{blocks}</Layer></Optical></WindowElement>\n"
    )


def words(values: np.ndarray, separator: str = ", ") -> str:
    return separator.join(map(repr, values.ravel().tolist()))


def full(basis: AngleBasis = FULL, structure: str = "Columns") -> str:
    """Both sides, of a known basis that is not defined."""
    over = f"<ColumnAngleBasis>{basis.name}</ColumnAngleBasis><RowAngleBasis>{basis.name}</RowAngleBasis>"
    blocks = ""
    for seed, direction in enumerate(("Reflection Front", "Reflection Back", "Transmission Front")):
        values = numbers_of(basis.size, basis.size, seed)
        blocks += block(words(values.T if structure == "Rows" else values), direction, over=over)
    return document(blocks, structure, "")


def tiny(structure: str = "Columns") -> str:
    values = numbers_of(5, 5)
    return document(block(words(values.T if structure == "Rows" else values), "Reflection Front"), structure)


def grid_of(dimensions: int, k: int, seed: int = 0) -> np.ndarray:
    return numbers_of(2**k, 2 ** (k * (dimensions - 1)), seed).reshape((2**k,) * dimensions)


def tree_file(dimensions: int, text: str, direction: str = "Reflection Back") -> str:
    over = "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"
    return document(block(text, direction, over=over), f"TensorTree{dimensions}", "")


def tree3() -> str:
    """A tree of one deeper branch, grids of 1, 2 and 4 per side."""
    grid = "{ " + words(grid_of(3, 2), " ") + " }"
    inner = "{" + " ".join(f"{{ {0.1 + 0.01 * n!r} }}" for n in range(7)) + " { " + words(grid_of(3, 1), ",") + " } }"
    return tree_file(3, f"{{\n{{ 0.25 }} {{ 0.2 }} {grid} {{ 0.2 }}\t{inner}, {{0.2}}\r\n{{ 0.15 }}{{ 0.2, }}}}")


def tree4() -> str:
    return tree_file(4, "{ " + words(grid_of(4, 2), "\n") + " }", "Reflection Front")
