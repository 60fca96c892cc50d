"""The XML of LBNL's WINDOW and of Radiance: matrices over Klems' patches, and tensor trees.

A file holds blocks of numbers, for bands (Visible, Solar, CIE-X, a wavelength) and directions: reflection and
transmission, of light on the front and on the back in WINDOW's words. A reflection is read alone, unless side="both"
asks for a `Sheet` of all; what is not read is kept, and written again. A file that transmits one way is taken to
transmit the same the other way, by reciprocity, as Radiance does.
The schema was not seen; the layout is that of Radiance's readers (bsdf_m.c, bsdf_t.c), whose program agrees on f, on
both sides and across, and on hemispherical totals, of real files and of those written here.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from ...base.reflectance import Reflectance
from ...declared.arguments import BELOW_ONE, Declared
from ...errors import FormatError, ParameterError
from ...files import replacing
from ...formula import tree
from ...formula.fields import Ours
from ...models._quarters import quarters
from ...models._reversed import Reversed
from ...models.sheet import Sheet
from ...pictures.colour import RELATIVE_XYZ
from .. import _sides
from .._reading.plain_text import is_number
from . import new, tree_nodes
from ._cell_tables import DIRECTIONS, MIRRORED, VIEWED
from .klems import KNOWN, AngleBasis, Klems
from .tensor_tree import TensorTree
from .tree_nodes import CubeTree
from .xml_document import BlockHeader, BlockNumbers, Document, parse

NAME = "WINDOW XML"
SUFFIXES = (".xml",)
DESCRIPTION = "BSDF of WINDOW and Radiance: Klems matrices and tensor trees"
ORACLE = "Radiance (pyradiance 1.3.1), reading and writing"
NO_LAYOUT = "means over cells: `KNOWN` has their edges for both ways"

TRANSMITS = True

KINDS = ("", "btdf", "brdf", "bsdf")
"""Kinds of data that are f; WINDOW writes BTDF of reflection too."""


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these; of UTF-16 every other byte is 0."""
    return re.search(rb"<(\w+:)?WindowElement\b", head.replace(b"\0", b"")) is not None


def read(
    path: Path,
    side: Annotated[
        str | None,
        Declared(
            "side in WINDOW's words (Radiance's are exchanged) that is lit and seen; both: a Sheet of all reflection "
            "and transmission; if not given the front, else the back, else the transmission",
            words=_sides.SIDES,
        ),
    ] = None,
    wavelength: Annotated[
        str | None,
        Declared(
            "a band of the file (Visible, Solar, 550), or spectral for all wavelengths; if not given X, Y "
            "and Z if there, else Visible, else the spectrum, else the first band"
        ),
    ] = None,
) -> Klems | TensorTree | Sheet:
    """The reflectance in a file: a `Klems` or a `TensorTree`, or a `Sheet` of these.

    Raises FormatError where the file is damaged, has no reflection, or not that.
    """
    document, contents = parse(Path(path))
    trees = document.structure.startswith("TensorTree")
    bases: list[tuple[AngleBasis, AngleBasis]] = []
    tables: list[Any] = []
    lines = [content.line for content in contents]
    for block in document.blocks:
        content = contents.pop(0)  # its memory is needed
        where = f"{path}, line {content.line} ({block.label:.60})"
        if trees:
            tables.append(_tree_of(document, block, content, where))
        else:
            incident, outgoing, values = _matrix_of(document, block, content, where)
            bases.append((incident, outgoing))
            tables.append(values)
    bands = _bands(document.blocks, lines, path)
    wanted = _sides.wanted(bands, side, path, ("front", "back"))
    choices = {quarter: _choice(document.blocks, bands[quarter], quarter, wavelength, path) for quarter in wanted}
    _agree(choices, path)
    used = {i for choice in choices.values() for i in choice.blocks}
    others = tuple(None if i in used else table for i, table in enumerate(tables))
    about = {**document.about, "structure": document.structure, "blocks": [b.label for b in document.blocks]}
    parts: dict[str, Reflectance] = {}
    for quarter, choice in choices.items():
        facts = {**about, "side": VIEWED[quarter], "bands": [document.blocks[i].wavelength for i in choice.blocks]}
        band_tables = [tables[i] for i in choice.blocks]
        for i in choice.blocks:
            tables[i] = None  # as both would take the memory twice
        m: Klems | TensorTree
        if trees:
            m = TensorTree(band_tables, VIEWED[quarter], choice.colour, choice.names, path=str(path), about=facts)
        else:
            if len({bases[i] for i in choice.blocks}) > 1:
                listed = ", ".join(facts["bands"])
                raise FormatError(f"{path}: the bands {listed} have different angle bases; name one")
            values = _stacked(band_tables) if choice.names else band_tables[0]
            named: dict[str, Any] = {"side": VIEWED[quarter], "channel_names": choice.names}
            m = Klems(Ours(values), *bases[choice.blocks[0]], path=str(path), about=facts, **named)
        parts[quarter] = tree.with_notes(m, document=document, chosen=(choice.blocks, others), quarter=quarter)
    for one, other in (("forward", "backward"), ("backward", "forward")):
        if one in parts and other not in parts:
            parts[other] = Reversed(parts[one])
    return _sides.joined(parts, side)


def _stacked(matrices: list[np.ndarray]) -> np.ndarray:
    """Matrices as channels, the last axis; the list is emptied on the way, as both would take the memory twice."""
    values = np.empty((*matrices[0].shape, len(matrices)))
    for k in reversed(range(len(matrices))):
        values[..., k] = matrices.pop()
    return values


class _ChosenBlocks(NamedTuple):
    """Numbers of the blocks that are read, names of their channels if several, and "uv" where they are Y, u', v'."""

    blocks: tuple[int, ...]
    names: tuple[str | float, ...] | None
    colour: str = ""


def _bands(blocks: tuple[BlockHeader, ...], lines: list[int], path: Path) -> dict[str, dict[str, int]]:
    """By quarter of a `Sheet` the bands in lower case, and the numbers of their blocks."""
    by_quarter: dict[str, dict[str, int]] = {}
    named = {direction.lower(): quarter for quarter, direction in DIRECTIONS.items()}
    for i, b in enumerate(blocks):
        quarter = named.get(b.direction.lower())
        if quarter is not None and b.kind.lower() in KINDS:
            bands = by_quarter.setdefault(quarter, {})
            if b.wavelength.lower() in bands:
                raise FormatError(f"{path}, line {lines[i]}: a second block of {b.label}; expected one")
            bands[b.wavelength.lower()] = i
    if not by_quarter:
        listed = ", ".join(b.label for b in blocks)
        raise FormatError(f"{path}: holds neither reflection nor transmission; its blocks: {listed:.300}")
    return by_quarter


def _choice(
    blocks: tuple[BlockHeader, ...], bands: dict[str, int], quarter: str, wavelength: str | None, path: Path
) -> _ChosenBlocks:
    spectral = {n: i for name, i in bands.items() if (n := _nanometres(name, blocks[i].unit)) is not None}
    ordered = tuple(sorted(spectral))
    spectrum = _ChosenBlocks(tuple(spectral[n] for n in ordered), ordered)
    if wavelength == "spectral" and spectral:
        return spectrum
    if wavelength is not None:
        if wavelength.lower() not in bands:
            listed = ", ".join(repr(blocks[i].wavelength) for i in bands.values())
            raise FormatError(
                f"{path}: no band {wavelength!r} of the {_sides.CALLED[quarter]}; expected one of {listed:.300}"
            )
        return _ChosenBlocks((bands[wavelength.lower()],), None)
    y = next((name for name in ("visible", "cie-y") if name in bands), None)
    for others, colour in ((("cie-x", "cie-z"), ""), (("cie-u", "cie-v"), "uv")):
        if y and all(name in bands for name in others):
            order = (y, *others) if colour else (others[0], y, others[1])
            return _ChosenBlocks(tuple(bands[name] for name in order), RELATIVE_XYZ, colour)
    if y is None and spectral:
        return spectrum
    return _ChosenBlocks((bands[y] if y else next(iter(bands.values())),), None)


def _agree(choices: dict[str, _ChosenBlocks], path: Path) -> None:
    """Raises FormatError where quarters would be read with different channels."""
    if len({choice.names for choice in choices.values()}) > 1:
        each = "; ".join(f"{_sides.CALLED[q]}: {c.names or 'one band'}" for q, c in choices.items())
        raise FormatError(f"{path}: has different bands for {each:.300}; name one that all have: wavelength='Visible'")


def _nanometres(name: str, unit: str) -> float | None:
    """The wavelength that a band is named after [nm], or None."""
    if not is_number(name):
        return None
    return float(name) * (1000.0 if unit.lower().startswith("micro") else 1.0)


def _matrix_of(
    document: Document, block: BlockHeader, content: BlockNumbers, where: str
) -> tuple[AngleBasis, AngleBasis, np.ndarray]:
    """Incident and outgoing basis of a block, and its numbers by outgoing and incident patch."""
    values = content.numbers.array(where)
    if len(content.numbers.braces()[0]):
        raise FormatError(f"{where}: braces among the numbers of a matrix; expected numbers only")
    pairs = [
        (a, b)
        for a in _bases(document, block.incident, where)
        for b in _bases(document, block.outgoing, where)
        if block.incident.lower() != block.outgoing.lower() or a == b
    ]
    fitting = [(a, b) for a, b in pairs if a.size * b.size == len(values)]
    if not fitting:
        a, b = pairs[0]
        patches = f"{b.size} patches of {b.name!r:.40} for each of {a.size} of {a.name!r:.40}"
        raise FormatError(f"{where}: {len(values)} numbers, expected {a.size * b.size}: {patches}; fetch it again")
    a, b = fitting[0]
    if document.structure == "Rows":
        return a, b, np.ascontiguousarray(values.reshape(a.size, b.size).T)
    return a, b, values.reshape(b.size, a.size)


def _bases(document: Document, name: str, where: str) -> list[AngleBasis]:
    """The bases of this name: the file's own definition, else the known ones."""
    defined = {AngleBasis(*basis) for basis in document.bases if basis[0].lower() == name.lower() and basis[2]}
    if not name and len(document.bases) == 1:
        defined = {AngleBasis(*document.bases[0])}
    bases = list(defined) or [basis for basis in KNOWN if basis.name.lower() == name.lower()]
    if len(defined) > 1:
        problem = "is defined twice, differently; expected one definition"
    elif not bases:
        problem = "is neither defined in the file nor known; define it"
    elif flaw := bases[0].problem():
        problem = f"has {flaw}"
    else:
        return bases
    raise FormatError(f"{where}: the angle basis {name!r:.60} {problem}")


def _tree_of(document: Document, block: BlockHeader, content: BlockNumbers, where: str) -> CubeTree:
    if block.incident.lower() not in ("", "lbnl/shirley-chiu"):
        raise FormatError(f"{where}: a tree over the angle basis {block.incident!r:.60}, expected 'LBNL/Shirley-Chiu'")
    return tree_nodes.parse(content.numbers, int(document.structure[-1]), where)


def write(
    m: Reflectance,
    path: Path,
    basis: Annotated[
        str | AngleBasis | None,
        Declared("patches of 145, 77 or 41 directions, over which means are taken", words=new.BASES, usual="full"),
    ] = None,
    tree: Annotated[
        int | None, Declared("dimensions of a tensor tree in place of a matrix: 3 if isotropic, else 4", words=(3, 4))
    ] = None,
    resolution: Annotated[
        int | None, Declared("cells per side of a tree; if not given 64 of 3, 32 of 4 dimensions", words=new.CELLS)
    ] = None,
    tolerance: Annotated[
        float, Declared("cells of a tree whose values differ by at most this share become one", 0.0, BELOW_ONE)
    ] = 0.0,
    side: Annotated[str, Declared("side in WINDOW's words, which Radiance exchanges", words=(*MIRRORED,))] = "front",
    name: Annotated[str, Declared("name of the material in the file")] = "",
) -> None:
    """Write a reflectance as a matrix, or as a tree; one read from such a file, unchanged if neither is named. What has
    two sides gets up to four blocks a band: reflection and transmission of light on the front and on the back.

    One channel is written as Visible; RGB as CIE-X, Visible (Y) and CIE-Z (trees: Visible, CIE-u, CIE-v), in which a
    flat reflectance of 1 is 1, as in Radiance; wavelengths as these, and each on its own.
    Means over patches keep the albedo of GGX(0.05) to 2e-5, but 4e-2 beyond 75 degrees (2e-3 of GGX(0.1)), and blur
    what is narrower than the patches. Trees of 64 cells keep it to 1e-3, but 4e-3 beyond 70 degrees.
    Raises ParameterError for a delta lobe, for maps and other channels, and where f has no value in a patch or cell.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.xml", format="WINDOW XML", basis="quarter")
    >>> m = gn.load("white.xml")
    >>> print(m.values.shape, gn.albedo(m, [0, 0, 1]).round(3))
    (41, 41) 0.5
    """
    if tree is None and (resolution is not None or tolerance):
        raise ParameterError(f"{resolution=!r:.60}, {tolerance=!r:.60}: are of trees; give tree=3 or tree=4 with them")
    if basis is not None and tree is not None:
        raise ParameterError(f"basis={basis!r:.40} and tree={tree!r}: expected one of them")
    parts = quarters(m)
    if parts.get("front") is m:
        parts = {side: m}
    elif side != "front":
        raise ParameterError(f"side={side!r}: {m!r:.80} has both sides; turn it over yourself, or leave side out")
    if tree is not None:
        pieces = new.tree(parts, tree, resolution, tolerance, name)
    elif basis is None and (same := _as_it_was(m)):
        pieces = same
    elif basis is None and isinstance(m, (Klems, TensorTree)):
        pieces = new.of_cells({m.side: m}, name)
    elif basis is None and new.fit_together(parts):
        pieces = new.of_cells(parts, name)
    else:
        pieces = new.matrix(parts, basis or "full", name)
    with replacing(path) as temporary:
        temporary.write_bytes(b"".join(pieces))


def _as_it_was(m: Reflectance) -> list[bytes] | None:
    """The file that a material was read from, with the present numbers; None where it was not all of that."""
    cells: list[Klems | TensorTree] = []
    parts = [*_sides.read_as(m)]
    for part, places in parts:
        if isinstance(part, Reversed) and any(part.of is other for other, _ in parts):
            continue  # it follows from the other when the file is read
        if not isinstance(part, (Klems, TensorTree)) or part.document is None or part.quarter not in places:
            return None
        cells.append(part)
    document = cells[0].document if cells else None
    if not cells or any(part.document is not document for part in cells):
        return None
    assert document is not None
    tables = list(cells[0].chosen[1])
    for part in cells:
        chosen = np.moveaxis(np.atleast_3d(part.values), -1, 0) if isinstance(part, Klems) else part.trees
        for i, table in zip(part.chosen[0], chosen, strict=True):
            tables[i] = table
    if any(table is None for table in tables):
        return None
    pieces = [document.pieces[0]]
    for table, after in zip(tables, document.pieces[1:], strict=True):
        pieces += [new.text(table, document.structure).encode("ascii"), after]
    return pieces
