"""New files of WINDOW's XML, of any reflectance."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...base.measured import tabular_shape
from ...base.reflectance import Reflectance
from ...errors import ParameterError
from ...pictures import colour
from ...pictures.colour import RELATIVE_XYZ, XYZ
from . import tree_nodes
from .frame import around
from .klems import FULL, HALF, QUARTER, AngleBasis, Klems
from .means import averages, grids
from .tensor_tree import TensorTree
from .tree_nodes import Tree

BASES = {"full": FULL, "half": HALF, "quarter": QUARTER}
RESOLUTION = {3: 64, 4: 32}
FINEST = {3: 256, 4: 64}
"""Of trees, by dimensions: the resolution they are written with, and the largest."""
CELLS = [1 << k for k in range(1, 9)]
"""Resolutions of trees."""


VISIBLE = (450.0, 650.0)
"""Wavelengths [nm] that a spectrum reaches to, of which X, Y and Z are made."""


def text(content: np.ndarray | Tree, structure: str) -> str:
    """The numbers of a block: the outgoing patches as rows, or with "Rows" as columns; or a tree."""
    if isinstance(content, Tree):
        return tree_nodes.text(content)
    rows = content.T if structure == "Rows" else content
    return "\n" + "\n".join(", ".join(map(repr, row)) + "," for row in rows.tolist()) + "\n"


def own(m: Klems | TensorTree, name: str) -> list[bytes]:
    """A new file with the numbers of a measurement as they are."""
    if isinstance(m, Klems):
        values = m.values.reshape(*m.values.shape[:2], -1)
        bands = _bands(m, values.shape[2])
        content: list[Any] = [(band, values @ weights) for band, weights in bands]
        return _framed(content, "Columns", m.side, name, m.incident, m.outgoing)
    return _framed(list(zip(_tree_bands(m), m.trees, strict=True)), f"TensorTree{m.dimensions}", m.side, name)


def _tree_bands(m: TensorTree) -> list[tuple[str, str]]:
    """The bands of its trees: (name, unit)."""
    names = m.channel_names
    if m.colour:
        return [("Visible", ""), ("CIE-u", ""), ("CIE-v", "")]
    if names is None:
        return [("Visible", "")]
    if names == RELATIVE_XYZ:
        return [("CIE-X", ""), ("Visible", ""), ("CIE-Z", "")]
    if any(isinstance(n, str) for n in names):
        raise ParameterError(
            f"{m!r:.80}: trees of channels {names!r:.60}; expected one, {RELATIVE_XYZ}, or wavelengths: write it with "
            f"tree={m.dimensions}"
        )
    return [(repr(float(n)), "Nanometer") for n in names]


def _framed(
    content: list[Any], structure: str, side: str, name: str, incident: Any = None, outgoing: Any = None
) -> list[bytes]:
    """A new file of bands: ((name, unit), numbers)."""
    frame = around(
        [band for band, _ in content], structure, f"Reflection {side.capitalize()}", name, incident, outgoing
    )
    pieces = [frame[0]]
    for (_, held), after in zip(content, frame[1:], strict=True):
        pieces += [text(held, structure), after]
    return [p.encode("utf-8") for p in pieces]


Bands = list[tuple[tuple[str, str], np.ndarray]]
"""((name, unit), weights (C,) of the channels in it)."""


def _bands(m: Reflectance, width: int) -> Bands:
    """The bands that a material's channels are written as."""
    names = m.channel_names
    if names is not None and not isinstance(names[0], str):
        by_wavelength = [((repr(float(n)), "Nanometer"), w) for n, w in zip(names, np.eye(width), strict=True)]
        if width < 3 or min(names) > VISIBLE[0] or max(names) < VISIBLE[1]:
            return by_wavelength
        matching = colour.colour_matching(names) * np.gradient(np.asarray(names, float))[:, None]
        return _xyz(matching / matching.sum(axis=0)) + by_wavelength
    if width == 1:
        return [(("Visible", ""), np.ones(1))]
    if width == 3 and names in (None, ("R", "G", "B")):
        return _xyz((colour.XYZ_OF_RGB / colour.WHITE[:, None]).T)
    if names in (XYZ, RELATIVE_XYZ):
        return _xyz(np.diag(1.0 / colour.WHITE) if names == XYZ else np.eye(3))
    raise ParameterError(
        f"{m!r:.80}: {width} channels named {names!r:.60}; expected one, RGB, XYZ, or wavelengths: write one at a time"
    )


def _bands_of(m: Reflectance, side: str) -> Bands:
    """The bands of a material that means are made of; ParameterError for one that a file cannot hold."""
    shape = tabular_shape(m)
    return _bands(m, shape[0] if shape else 1)


def _xyz(weights: np.ndarray) -> Bands:
    """X, Y, Z in the order of files; weights (C, 3)."""
    return [(("Visible", ""), weights[:, 1]), (("CIE-X", ""), weights[:, 0]), (("CIE-Z", ""), weights[:, 2])]


def _basis_named(basis: str | AngleBasis) -> AngleBasis:
    if isinstance(basis, AngleBasis):
        if basis.problem():
            raise ParameterError(f"basis={basis.name!r}: {basis.problem()}")
        return basis
    return BASES[basis]


def matrix(m: Reflectance, basis: str | AngleBasis, side: str, name: str) -> list[bytes]:
    """A new file of means over patches."""
    basis, bands = _basis_named(basis), _bands_of(m, side)
    values = averages(m, basis, side)
    _refuse_holes(m, values)
    return _framed([(band, values @ weights) for band, weights in bands], "Columns", side, name, basis, basis)


def tree(
    m: Reflectance, dimensions: int, resolution: int | None, tolerance: float, side: str, name: str
) -> list[bytes]:
    """A new file of means over the cells of trees."""
    resolution, finest = RESOLUTION[dimensions] if resolution is None else resolution, FINEST[dimensions]
    if resolution > finest:
        raise ParameterError(f"resolution={resolution}: expected at most {finest} for {dimensions} dimensions")
    bands = _bands_of(m, side)
    if dimensions == 3 and not m.is_isotropic():
        raise ParameterError(f"{m!r:.80}: is anisotropic; write it with tree=4")
    values = grids(m, dimensions, resolution, side)
    _refuse_holes(m, values)
    made = {band: values @ weights for band, weights in bands}
    if ("CIE-X", "") in made:
        Y, X, Z = (made.pop((band, "")) for band in ("Visible", "CIE-X", "CIE-Z"))
        total = X + 15.0 * Y + 3.0 * Z
        lit = total > 0.0
        safe = np.where(lit, total, 1.0)
        u, v = np.where(lit, 4.0 * X / safe, 4.0 / 19.0), np.where(lit, 9.0 * Y / safe, 9.0 / 19.0)
        made = {("Visible", ""): Y, ("CIE-u", ""): u, ("CIE-v", ""): v, **made}
    content = [(band, tree_nodes.from_grid(grid, tolerance)) for band, grid in made.items()]
    return _framed(content, f"TensorTree{dimensions}", side, name)


def _refuse_holes(m: Reflectance, values: np.ndarray) -> None:
    missing = np.isnan(values).any(axis=-1)
    if missing.any():
        raise ParameterError(
            f"{m!r:.80}: no value at all in {missing.sum()} of {missing.size} pairs of patches or cells, and the "
            f"format has no mark for that; fill the gaps first"
        )
