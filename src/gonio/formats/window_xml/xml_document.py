"""WINDOW's XML: the text around its numbers, which is written again unchanged, and the meaning of the numbers."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree
from xml.parsers import expat

from ...errors import FormatError
from .._reading.plain_text import is_number, is_whole, marked
from .numbers import NumberText

CHUNK = 1 << 16  # bytes that are read at a time
LONGEST = 1 << 20
"""Bytes of a comment, of a tag with its attributes, or of whatever else expat takes as a whole.

It looks at such a thing from its start again with every chunk that does not end it (before 2.6), and keeps it all."""

MANY = 1_000_000  # elements of a file; that of 10 000 blocks has 100 000
DEEPEST = 64  # levels of tags; the schema needs ten
MOST = 100_000  # azimuths of a ring
BLOCKS = 10_000  # blocks of numbers in a file; a spectrum of 400 wavelengths, both ways from both sides, has 1600
STRUCTURES = ("Columns", "Rows", "TensorTree3", "TensorTree4")

_START_TAG = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""")
_DECLARED = re.compile(rb"""(<\?xml[^>]*encoding\s*=\s*["'])[^"']*""")


class BlockHeader(NamedTuple):
    """A `WavelengthDataBlock` without its numbers.

    wavelength  "Visible", "Solar", "CIE-X", or a number
    unit        of a number: "Nanometer"; else "Integral"
    direction   "Reflection Front", "Transmission Back", ...
    kind        "BTDF", of reflection too
    incident    name of the angle basis of the incident directions
    outgoing    and of the outgoing ones; trees have one for both
    """

    wavelength: str
    unit: str
    direction: str
    kind: str
    incident: str
    outgoing: str

    @property
    def label(self) -> str:
        return f"{self.wavelength} {self.direction}"


class BlockNumbers(NamedTuple):
    """The content of a `ScatteringData`: its bytes in the file, its line, and the numbers."""

    start: int
    end: int
    line: int
    numbers: NumberText


class Document(NamedTuple):
    """A file without its numbers.

    structure  "Columns", "Rows", "TensorTree3" or "TensorTree4"
    bases      angle bases as defined in the file: name, edges of theta [degree], numbers of azimuths
    blocks     meaning of the numbers of the first layer
    pieces     the bytes before, between and after these numbers: one more than blocks
    about      facts about the material
    """

    structure: str
    bases: tuple[tuple[str, tuple[float, ...], tuple[int, ...]], ...]
    blocks: tuple[BlockHeader, ...]
    pieces: tuple[bytes, ...]
    about: dict[str, Any]


class _Parser:
    """Elements by tag without prefix; the content of each `ScatteringData` is kept from the tree.

    Expat is used directly, because it refuses documents with a DTD as soon as one starts, and knows positions.
    """

    def __init__(self, path: Path):
        self.path = path
        self.tree = ElementTree.TreeBuilder()
        self.contents: dict[Any, BlockNumbers] = {}
        self.open: list[tuple[Any, BlockNumbers | None]] = []
        self.elements = 0
        self.bytes_before = self.lines_before = self.fed = 0
        parser = self.parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.buffer_size = 1 << 16
        parser.StartDoctypeDeclHandler = self._doctype
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self.tree.data

    def root(self, chunks: Iterable[bytes]) -> Any:
        started = False
        try:
            for chunk in chunks:
                if not started:  # byte order marks and empty lines come before
                    at = chunk.find(b"<")
                    started, at = at >= 0, at if at >= 0 else len(chunk)
                    self.bytes_before += at
                    self.lines_before += chunk.count(b"\n", 0, at)
                    chunk = chunk[at:]
                self.parser.Parse(chunk, False)
                self.fed += len(chunk)
                if self.fed - self.parser.CurrentByteIndex > LONGEST:
                    raise self._fault(f"a comment, a tag or the like of more than {LONGEST} bytes; take it out")
            self.parser.Parse(b"", True)
        except expat.ExpatError as error:
            line, says = error.lineno + self.lines_before, expat.ErrorString(error.code)
            raise FormatError(f"{self.path}, line {line}: not well-formed XML: {says}; fetch it again") from None
        except FormatError:
            raise
        except (LookupError, ValueError) as error:
            raise FormatError(f"{self.path}: text that cannot be decoded ({error}); save it as UTF-8") from None
        finally:
            del self.parser  # it and this hold each other, and the numbers
        return self.tree.close()

    def _doctype(self, *_: Any) -> None:
        raise self._fault("a document type declaration; BSDF files have none, and it is not read")

    def _fault(self, problem: str) -> FormatError:
        return FormatError(f"{self.path}, line {self._line()}: {problem}")

    def _line(self) -> int:
        return self.parser.CurrentLineNumber + self.lines_before

    def _at(self) -> int:
        return self.parser.CurrentByteIndex + self.bytes_before

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self.open) == DEEPEST:
            raise self._fault(f"tags nested more than {DEEPEST} deep; expected ten")
        self.elements += 1
        if self.elements > MANY:
            raise self._fault(f"more than {MANY} tags; split the file")
        tag = tag.rpartition(":")[2]
        content = None
        if tag == "ScatteringData":
            if len(self.contents) == BLOCKS:
                raise self._fault(f"more than {BLOCKS} blocks; split the file")
            opening = _START_TAG.match(self.parser.GetInputContext() or b"")
            start = self._at() + (opening.end() if opening else 0)
            content = BlockNumbers(start, start, self._line(), NumberText())
            self.parser.CharacterDataHandler = content.numbers.add
        self.open.append((self.tree.start(tag, attributes), content))

    def _end(self, tag: str) -> None:
        self.tree.end(tag.rpartition(":")[2])
        element, content = self.open.pop()
        if content is not None:
            self.contents[element] = content._replace(end=self._at())
            self.parser.CharacterDataHandler = self.tree.data


def parse(path: Path) -> tuple[Document, list[BlockNumbers]]:
    """The document in a file, and the contents of its blocks. Raises FormatError for damage and other kinds of file."""
    parser = _Parser(path)
    root = parser.root(_chunks(path))
    layer = root.find("Optical/Layer")
    if root.tag != "WindowElement" or layer is None:
        raise FormatError(f"{path}: starts with <{root.tag}>, expected <WindowElement> with <Optical> and <Layer>")
    word = _text(layer, "DataDefinition/IncidentDataStructure")
    structure = next((name for name in STRUCTURES if name.lower() == word.lower()), None)
    if structure is None:
        raise FormatError(f"{path}: IncidentDataStructure is {word!r:.60}, expected one of {', '.join(STRUCTURES)}")
    blocks, contents = [], []
    for wavelength in layer.findall("WavelengthData"):
        for element in wavelength.findall("WavelengthDataBlock"):
            block, data = _block(wavelength, element), element.find("ScatteringData")
            if data is None or len(data) or not parser.contents[data].numbers:
                label = f"{block.wavelength!r:.40} {block.direction!r:.40}"
                raise FormatError(f"{path}: the block {label} has no numbers in <ScatteringData>")
            contents.append(parser.contents[data])
            blocks.append(block)
    if not blocks:
        raise FormatError(f"{path}: no <WavelengthDataBlock> in the first <Layer>; expected numbers")
    bases = tuple(_basis(b, path) for b in layer.findall("DataDefinition/AngleBasis"))
    pieces = _around(_chunks(path), contents)
    return Document(structure, bases, tuple(blocks), pieces, _about(root, layer)), contents


def _chunks(path: Path) -> Iterator[bytes]:
    """The bytes of a file, those of UTF-16 and UTF-32 recoded as UTF-8: positions and lines are of these bytes."""
    with path.open("rb") as file:
        chunk = file.read(CHUNK)
        mark, encoding = marked(chunk)
        if encoding == "utf-8":
            while chunk:
                yield chunk
                chunk = file.read(CHUNK)
            return
        decoder = codecs.getincrementaldecoder(encoding)()
        try:
            yield _DECLARED.sub(rb"\1UTF-8", decoder.decode(chunk[len(mark) :]).encode(), count=1)
            while chunk := file.read(CHUNK):
                yield decoder.decode(chunk).encode()
            decoder.decode(b"", final=True)
        except UnicodeError as error:
            name = encoding[:6].upper()
            raise FormatError(f"{path}: {name} that cannot be decoded ({error}); fetch it again") from None


def _around(chunks: Iterable[bytes], contents: list[BlockNumbers]) -> tuple[bytes, ...]:
    """The bytes before, between and after the numbers."""
    lows = [0, *(content.end for content in contents)]
    highs = [*(content.start for content in contents), None]
    pieces = [bytearray() for _ in lows]
    at, k = 0, 0
    for chunk in chunks:
        while True:
            high = highs[k]
            pieces[k] += chunk[max(lows[k] - at, 0) : None if high is None else max(high - at, 0)]
            if high is None or high > at + len(chunk):
                break
            k += 1
        at += len(chunk)
    return tuple(map(bytes, pieces))


def _block(wavelength: Any, element: Any) -> BlockHeader:
    shared = _text(element, "AngleBasis")
    named = wavelength.find("Wavelength")
    return BlockHeader(
        _text(wavelength, "Wavelength"),
        "" if named is None else named.get("unit", ""),
        " ".join(_text(element, "WavelengthDataDirection").split()),
        _text(element, "ScatteringDataType"),
        _text(element, "ColumnAngleBasis") or shared,
        _text(element, "RowAngleBasis") or shared,
    )


def _basis(element: Any, path: Path) -> tuple[str, tuple[float, ...], tuple[int, ...]]:
    name = _text(element, "AngleBasisName")
    where = f"{path}: angle basis {name!r:.60}"
    edges, counts = [0.0], []
    for ring in element.findall("AngleBasisBlock"):
        low, high, count = (_text(ring, t) for t in ("ThetaBounds/LowerTheta", "ThetaBounds/UpperTheta", "nPhis"))
        low = low or repr(edges[-1])
        if not (is_number(low) and is_number(high) and is_whole(count) and int(count) <= MOST):
            got = f"theta {low!r:.20} to {high!r:.20} with nPhis {count!r:.20}"
            raise FormatError(f"{where}: {got}, expected numbers, nPhis whole and at most {MOST}")
        if not abs(float(low) - edges[-1]) <= 1e-6 * 90.0:
            raise FormatError(
                f"{where}: a ring starts at theta = {low} degrees, expected {edges[-1]:g}, the end of the last"
            )
        edges.append(float(high))
        counts.append(int(count))
    return name, tuple(edges), tuple(counts)


def _about(root: Any, layer: Any) -> dict[str, Any]:
    """Facts about the file and the material, by tag; a unit follows its number."""
    about = {}
    for element in [*root, *layer.iterfind("Material[1]/*")]:
        text = " ".join((element.text or "").split())
        if text and not len(element):
            about[element.tag] = " ".join([text, *element.attrib.values()])
    return about


def _text(element: Any, path: str) -> str:
    return (element.findtext(path) or "").strip()
