"""New files of WINDOW's XML, of any reflectance: the text around the numbers, and the numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple
from xml.sax.saxutils import escape

import numpy as np

from ...base.measured import tabular_shape
from ...base.reflectance import Reflectance
from ...errors import ParameterError
from ...pictures import colour
from ...pictures.colour import RELATIVE_XYZ, XYZ
from . import tree_nodes
from ._cell_tables import DIRECTIONS, VIEWED, Cellwise
from .klems import FULL, HALF, QUARTER, AngleBasis, Klems
from .means import averages, grids
from .tensor_tree import TensorTree
from .tree_nodes import CubeTree

BASES = {"full": FULL, "half": HALF, "quarter": QUARTER}
RESOLUTION = {3: 64, 4: 32}
FINEST = {3: 256, 4: 64}
"""Of trees, by dimensions: the resolution they are written with, and the largest."""
CELLS = [1 << k for k in range(1, 9)]
"""Resolutions of trees."""
VISIBLE = (450.0, 650.0)
"""Wavelengths [nm] that a spectrum reaches to, of which X, Y and Z are made."""
DETECTORS = {"Visible": "ASTM E308 1931 Y.dsp", "CIE-X": "ASTM E308 1931 X.dsp", "CIE-Z": "ASTM E308 1931 Z.dsp"}

_START = """<?xml version="1.0" encoding="UTF-8"?>
<WindowElement xmlns="http://windows.lbl.gov" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="http://windows.lbl.gov/BSDF-v1.4.xsd">
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
	<Material>
		<Name>{name}</Name>
		<Manufacturer>gonio</Manufacturer>
		<DeviceType>Other</DeviceType>
	</Material>
	<DataDefinition>
		<IncidentDataStructure>{structure}</IncidentDataStructure>
{bases}	</DataDefinition>
"""

_BASIS = """		<AngleBasis>
			<AngleBasisName>{name}</AngleBasisName>
{rings}		</AngleBasis>
"""

_RING = """			<AngleBasisBlock>
				<Theta>{theta!r}</Theta>
				<nPhis>{count}</nPhis>
				<ThetaBounds><LowerTheta>{low!r}</LowerTheta><UpperTheta>{high!r}</UpperTheta></ThetaBounds>
			</AngleBasisBlock>
"""

_BLOCK = """	<WavelengthData>
		<LayerNumber>System</LayerNumber>
		<Wavelength unit="{unit}">{band}</Wavelength>
{spectra}		<WavelengthDataBlock>
			<WavelengthDataDirection>{direction}</WavelengthDataDirection>
{over}			<ScatteringDataType>BTDF</ScatteringDataType>
			<ScatteringData>"""

_AFTER = """</ScatteringData>
		</WavelengthDataBlock>
	</WavelengthData>
"""

_END = """</Layer>
</Optical>
</WindowElement>
"""


def text(content: np.ndarray | CubeTree, structure: str) -> str:
    """The numbers of a block: the outgoing patches as rows, or with "Rows" as columns; or a tree."""
    if isinstance(content, CubeTree):
        return tree_nodes.text(content)
    rows = content.T if structure == "Rows" else content
    return "\n" + "\n".join(", ".join(map(repr, row)) + "," for row in rows.tolist()) + "\n"


Bands = list[tuple[tuple[str, str], np.ndarray]]
"""((name, unit or "" of an integral), weights (C,) of the channels in it)."""


Parts = Mapping[str, Any]
"""Reflectances by the quarters of a `Sheet`."""


def fit_together(parts: Parts) -> bool:
    """Whether the parts are measurements that one file can hold with their numbers as they are."""
    kinds = {(type(m), getattr(m, "dimensions", 0)) for m in parts.values()}
    bases = {basis for m in parts.values() if isinstance(m, Klems) for basis in (m.incident, m.outgoing)}
    same_side = all(isinstance(m, Cellwise) and m.side == VIEWED[quarter] for quarter, m in parts.items())
    return same_side and len(kinds) == 1 and len({basis.name for basis in bases}) == len(bases)


def of_cells(parts: Parts, name: str) -> list[bytes]:
    """A new file with the numbers of measurements as they are."""
    blocks: list[_QuarterBlock] = []
    bases: dict[AngleBasis, None] = {}
    for quarter, m in parts.items():
        if isinstance(m, Klems):
            values = m.values.reshape(*m.values.shape[:2], -1)
            patches = (m.incident, m.outgoing)
            bases |= dict.fromkeys(patches)
            blocks += [_QuarterBlock(quarter, band, values @ w, patches) for band, w in _bands(m, values.shape[2])]
        else:
            blocks += [_QuarterBlock(quarter, band, tree) for band, tree in zip(_tree_bands(m), m.trees, strict=True)]
    one = next(iter(parts.values()))
    structure = "Columns" if isinstance(one, Klems) else f"TensorTree{one.dimensions}"
    return _framed(blocks, structure, name, bases)


def matrix(parts: Parts, basis: str | AngleBasis, name: str) -> list[bytes]:
    """A new file of means over patches."""
    patches = BASES[basis] if isinstance(basis, str) else basis
    if patches.problem():
        raise ParameterError(f"basis={patches.name!r}: {patches.problem()}")
    blocks: list[_QuarterBlock] = []
    for quarter, m in parts.items():
        bands = _bands(m, *tabular_shape(m))
        values = _whole(m, averages(m, patches, VIEWED[quarter]))
        blocks += [_QuarterBlock(quarter, band, values @ weights, (patches, patches)) for band, weights in bands]
    return _framed(blocks, "Columns", name, {patches: None})


def tree(parts: Parts, dimensions: int, resolution: int | None, tolerance: float, name: str) -> list[bytes]:
    """A new file of means over the cells of trees."""
    resolution, finest = RESOLUTION[dimensions] if resolution is None else resolution, FINEST[dimensions]
    if resolution > finest:
        raise ParameterError(f"resolution={resolution}: expected at most {finest} for {dimensions} dimensions")
    blocks: list[_QuarterBlock] = []
    for quarter, m in parts.items():
        by_band = _grids(m, dimensions, resolution, VIEWED[quarter])
        blocks += [_QuarterBlock(quarter, band, tree_nodes.from_grid(x, tolerance)) for band, x in by_band.items()]
    return _framed(blocks, f"TensorTree{dimensions}", name)


def _grids(m: Reflectance, dimensions: int, resolution: int, side: str) -> dict[tuple[str, str], np.ndarray]:
    """Means over the cells of trees, by band: X, Y and Z as Y, u' and v'."""
    bands = _bands(m, *tabular_shape(m))
    if dimensions == 3 and not m.is_isotropic():
        raise ParameterError(f"{m!r:.80}: is anisotropic; write it with tree=4")
    values = _whole(m, grids(m, dimensions, resolution, side))
    by_band = {band: values @ weights for band, weights in bands}
    if ("CIE-X", "") in by_band:
        Y, X, Z = (by_band.pop((band, "")) for band in ("Visible", "CIE-X", "CIE-Z"))
        total = X + 15.0 * Y + 3.0 * Z
        lit = total > 0.0
        safe = np.where(lit, total, 1.0)
        u, v = np.where(lit, 4.0 * X / safe, 4.0 / 19.0), np.where(lit, 9.0 * Y / safe, 9.0 / 19.0)
        by_band = {("Visible", ""): Y, ("CIE-u", ""): u, ("CIE-v", ""): v, **by_band}
    return by_band


def _whole(m: Reflectance, values: np.ndarray) -> np.ndarray:
    """The values. Raises ParameterError where some are missing."""
    missing = np.isnan(values).any(axis=-1)
    if missing.any():
        got = f"no value at all in {missing.sum()} of {missing.size} pairs of patches or cells"
        raise ParameterError(f"{m!r:.80}: {got}, and the format has no mark for that; fill the gaps first")
    return values


def _bands(m: Reflectance, width: int = 1) -> Bands:
    """The bands that a material's channels are written as. Raises ParameterError for others than a file can hold."""
    names = m.channel_names
    if names is not None and not isinstance(names[0], str):
        by_wavelength = [((repr(float(n)), "Nanometer"), w) for n, w in zip(names, np.eye(width), strict=True)]
        if width < 3 or min(names) > VISIBLE[0] or max(names) < VISIBLE[1]:
            return by_wavelength
        return _xyz(colour.to_xyz(names) / colour.WHITE) + by_wavelength
    if width == 1:
        return [(("Visible", ""), np.ones(1))]
    if width == 3 and names in (None, ("R", "G", "B")):
        return _xyz((colour.XYZ_OF_RGB / colour.WHITE[:, None]).T)
    if names in (XYZ, RELATIVE_XYZ):
        return _xyz(np.diag(1.0 / colour.WHITE) if names == XYZ else np.eye(3))
    got = f"{width} channels named {names!r:.60}"
    raise ParameterError(f"{m!r:.80}: {got}; expected one, RGB, XYZ, or wavelengths: write one at a time")


def _xyz(weights: np.ndarray) -> Bands:
    """X, Y, Z in the order of files; weights (C, 3)."""
    return [(("Visible", ""), weights[:, 1]), (("CIE-X", ""), weights[:, 0]), (("CIE-Z", ""), weights[:, 2])]


def _tree_bands(m: TensorTree) -> list[tuple[str, str]]:
    """The bands of its trees: (name, unit)."""
    names = m.channel_names
    if names is None:
        return [("Visible", "")]
    if m.colour or names == RELATIVE_XYZ:
        return [(band, "") for band in (("Visible", "CIE-u", "CIE-v") if m.colour else ("CIE-X", "Visible", "CIE-Z"))]
    if any(isinstance(n, str) for n in names):
        got = f"trees of channels {names!r:.60}; expected one, {RELATIVE_XYZ}, or wavelengths"
        raise ParameterError(f"{m!r:.80}: {got}: write it with tree={m.dimensions}")
    return [(repr(float(n)), "Nanometer") for n in names]


class _QuarterBlock(NamedTuple):
    """Numbers of a quarter in a band, (name, unit or "" of an integral); of a matrix the patches of wi and wo."""

    quarter: str
    band: tuple[str, str]
    numbers: Any
    patches: tuple[AngleBasis, AngleBasis] | None = None


def _framed(blocks: list[_QuarterBlock], structure: str, name: str, bases: Iterable[AngleBasis] = ()) -> list[bytes]:
    """A new file of blocks, which defines these bases."""
    defined = "".join(map(_defined, bases))
    pieces = [_START.format(name=escape(name or "BRDF"), structure=structure, bases=defined)]
    for block in blocks:
        band, unit = block.band
        over = "\t\t\t<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>\n"
        if block.patches is not None:
            incident, outgoing = (escape(basis.name) for basis in block.patches)
            over = f"\t\t\t<ColumnAngleBasis>{incident}</ColumnAngleBasis>\n"
            over += f"\t\t\t<RowAngleBasis>{outgoing}</RowAngleBasis>\n"
        direction = DIRECTIONS[block.quarter]
        around = {"unit": unit or "Integral", "band": band, "spectra": _spectra(band), "direction": direction}
        pieces += [_BLOCK.format(**around, over=over), text(block.numbers, structure), _AFTER]
    return [piece.encode("utf-8") for piece in [*pieces, _END]]


def _spectra(band: str) -> str:
    if band not in DETECTORS:
        return ""
    detector = f"\t\t<DetectorSpectrum>{DETECTORS[band]}</DetectorSpectrum>\n"
    return "\t\t<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>\n" + detector


def _defined(basis: AngleBasis) -> str:
    rings = []
    for low, high, count in zip(basis.edges, basis.edges[1:], basis.counts, strict=False):
        theta = 0.0 if low == 0.0 and count == 1 else 0.5 * (low + high)
        rings.append(_RING.format(theta=theta, count=count, low=float(low), high=float(high)))
    return _BASIS.format(name=escape(basis.name), rings="".join(rings))
