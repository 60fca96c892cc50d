"""WINDOW's XML without its numbers: what stands around them, and what they are; nothing in it is lost on writing."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from ..errors import FormatError
from ._text import is_number, is_whole

DEEPEST = 64
"""Levels of tags; the schema needs ten."""

MOST = 100_000
"""Azimuths of a ring."""

_START_TAG = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""")
_DECLARED = re.compile(rb"""(<\?xml[^>]*encoding\s*=\s*["'])[^"']*""")


class Block(NamedTuple):
    """What a `WavelengthDataBlock` says of its numbers.

    wavelength  "Visible", "Solar", "CIE-X", or a number
    unit        of a number: "Nanometer"; else "Integral"
    direction   "Reflection Front", "Transmission Back", ...
    kind        "BTDF", of reflection too
    incident    name of the angle basis of the incident directions
    outgoing    and of the outgoing ones; trees have one for both
    line        where the numbers start in the file
    text        the numbers, as text
    """

    wavelength: str
    unit: str
    direction: str
    kind: str
    incident: str
    outgoing: str
    line: int
    text: str

    @property
    def label(self) -> str:
        return f"{self.wavelength} {self.direction}"


class Document(NamedTuple):
    """A file without its numbers.

    structure  "Columns", "Rows", "TensorTree3" or "TensorTree4"
    bases      angle bases as defined in the file: name, edges of theta [degree], numbers of azimuths
    blocks     what the numbers of the first layer are
    pieces     the bytes before, between and after these numbers: one more than blocks
    about      what the file says of the material
    """

    structure: str
    bases: tuple[tuple[str, tuple[float, ...], tuple[int, ...]], ...]
    blocks: tuple[Block, ...]
    pieces: tuple[bytes, ...]
    about: dict[str, Any]


class _Parser:
    """Elements by tag without prefix, and where the content of each `ScatteringData` lies in the bytes.

    Expat is used directly, because it refuses documents with a DTD as soon as one starts, and knows positions.
    """

    def __init__(self, data: bytes, path: Path, first_line: int):
        self.data, self.path, self.first_line = data, path, first_line
        self.tree = ElementTree.TreeBuilder()
        self.spans: dict[Any, tuple[int, int, int]] = {}
        self.open: list[tuple[Any, int, int]] = []
        parser = self.parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.buffer_size = 1 << 16
        parser.StartDoctypeDeclHandler = self._doctype
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self.tree.data

    def root(self) -> Any:
        try:
            self.parser.Parse(self.data, True)
        except expat.ExpatError as error:
            line, says = error.lineno + self.first_line, expat.ErrorString(error.code)
            raise FormatError(f"{self.path}, line {line}: not well-formed XML: {says}; fetch it again") from None
        except (LookupError, ValueError) as error:
            raise FormatError(f"{self.path}: text that cannot be decoded ({error}); save it as UTF-8") from None
        return self.tree.close()

    def _doctype(self, *_: Any) -> None:
        raise FormatError(
            f"{self.path}, line {self._line()}: a document type declaration; BSDF files have none, and it is not read"
        )

    def _line(self) -> int:
        return self.parser.CurrentLineNumber + self.first_line

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self.open) == DEEPEST:
            raise FormatError(f"{self.path}, line {self._line()}: tags nested more than {DEEPEST} deep; expected ten")
        tag = tag.rpartition(":")[2]
        at, line = self.parser.CurrentByteIndex, self._line()
        self.open.append((self.tree.start(tag, attributes), at, line))

    def _end(self, tag: str) -> None:
        tag = tag.rpartition(":")[2]
        self.tree.end(tag)
        element, at, line = self.open.pop()
        if tag == "ScatteringData":
            opening = _START_TAG.match(self.data, at)
            end = self.parser.CurrentByteIndex
            self.spans[element] = (opening.end() if opening else end, end, line)


def parse(path: Path) -> Document:
    """The document in a file. Raises FormatError where it is damaged, or not of this kind."""
    data = _as_utf8(path.read_bytes(), path)
    before = max(data.find(b"<"), 0)  # byte order marks, empty lines
    parser = _Parser(data[before:], path, data[:before].count(b"\n"))
    root = parser.root()
    layer = root.find("Optical/Layer")
    if root.tag != "WindowElement" or layer is None:
        raise FormatError(
            f"{path}: starts with <{root.tag}>, expected <WindowElement> with <Optical> and <Layer> in it"
        )
    structure = _text(layer, "DataDefinition/IncidentDataStructure")
    known = {name.lower(): name for name in ("Columns", "Rows", "TensorTree3", "TensorTree4")}
    if structure.lower() not in known:
        listed = ", ".join(known.values())
        raise FormatError(f"{path}: IncidentDataStructure is {structure!r:.60}, expected one of {listed}")
    blocks, spans = [], []
    for wavelength in layer.findall("WavelengthData"):
        for element in wavelength.findall("WavelengthDataBlock"):
            numbers = element.find("ScatteringData")
            if numbers is None or not (numbers.text or "").strip() or len(numbers):
                raise FormatError(
                    f"{path}: the block {_text(wavelength, 'Wavelength')!r:.40} "
                    f"{_text(element, 'WavelengthDataDirection')!r:.40} has no numbers in <ScatteringData>"
                )
            start, end, line = parser.spans[numbers]
            spans.append((start + before, end + before))
            blocks.append(_block(wavelength, element, line, numbers.text))
    if not blocks:
        raise FormatError(f"{path}: no <WavelengthDataBlock> in the first <Layer>; expected numbers")
    ends = [0, *(end for _, end in spans)]
    starts = [*(start for start, _ in spans), len(data)]
    pieces = tuple(data[a:b] for a, b in zip(ends, starts, strict=True))
    bases = tuple(_basis(b, path) for b in layer.findall("DataDefinition/AngleBasis"))
    return Document(known[structure.lower()], bases, tuple(blocks), pieces, _about(root, layer))


def _as_utf8(data: bytes, path: Path) -> bytes:
    """The bytes, those of UTF-16 recoded: positions and digits are those of bytes from here on."""
    if data[:2] not in (b"\xff\xfe", b"\xfe\xff"):
        return data
    try:
        return _DECLARED.sub(rb"\1UTF-8", data.decode("utf-16").encode(), count=1)
    except UnicodeDecodeError as error:
        raise FormatError(f"{path}: UTF-16 that cannot be decoded ({error}); fetch it again") from None


def _block(wavelength: Any, element: Any, line: int, text: str) -> Block:
    shared = _text(element, "AngleBasis")
    named = wavelength.find("Wavelength")
    return Block(
        _text(wavelength, "Wavelength"),
        "" if named is None else named.get("unit", ""),
        " ".join(_text(element, "WavelengthDataDirection").split()),
        _text(element, "ScatteringDataType"),
        _text(element, "ColumnAngleBasis") or shared,
        _text(element, "RowAngleBasis") or shared,
        line,
        text,
    )


def _basis(element: Any, path: Path) -> tuple[str, tuple[float, ...], tuple[int, ...]]:
    name = _text(element, "AngleBasisName")
    edges, counts = [0.0], []
    for ring in element.findall("AngleBasisBlock"):
        low, high, count = (_text(ring, t) for t in ("ThetaBounds/LowerTheta", "ThetaBounds/UpperTheta", "nPhis"))
        low = low or repr(edges[-1])
        if not (is_number(low) and is_number(high) and is_whole(count) and int(count) <= MOST):
            raise FormatError(
                f"{path}: angle basis {name!r:.60}: theta {low!r:.20} to {high!r:.20} with nPhis {count!r:.20}, "
                f"expected numbers, nPhis whole and at most {MOST}"
            )
        if not abs(float(low) - edges[-1]) <= 1e-6 * 90.0:
            raise FormatError(
                f"{path}: angle basis {name!r:.60}: a ring starts at theta = {low} degrees, expected {edges[-1]:g}, "
                f"where the ring before it ends"
            )
        edges.append(float(high))
        counts.append(int(count))
    return name, tuple(edges), tuple(counts)


def _about(root: Any, layer: Any) -> dict[str, Any]:
    """What the file says of itself and of the material, by tag; a unit follows its number."""
    found = {}
    for element in [*root, *(layer.find("Material") or [])]:
        text = " ".join((element.text or "").split())
        if text and not len(element):
            found[element.tag] = " ".join([text, *element.attrib.values()])
    return found


def _text(element: Any, path: str) -> str:
    return (element.findtext(path) or "").strip()


def numbers(text: str, where: str) -> np.ndarray:
    """The numbers of a text, separated by white space or commas. FormatError for anything else."""
    words = text.replace(",", " ").split()
    try:
        if "_" in text or not text.isascii():
            raise ValueError
        return np.fromiter(map(float, words), float, len(words))
    except ValueError:
        wrong = next((w for w in words if not is_number(w)), "")
        raise FormatError(f"{where}: {wrong!r:.40} among the numbers; expected numbers only") from None
