"""Meshes in files: .ply, .obj, .stl and .off. Nothing that a file names is opened: materials, pictures, other files.

What a file announces is held against its bytes before room is made for it. Polygons become fans of triangles.
"""

from __future__ import annotations

import os
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import FormatError, NotFoundError, ParameterError
from ..rays.triangles import most_faces

MOST_BYTES = 2**31
"""The largest file that is read."""

CHUNK = 2**20
"""Bytes that are split into lines at a time."""

LONGEST = 2**22
"""Bytes of a line."""

HEADER = 2**16
"""Bytes in which the header of a .ply file ends."""

SCALARS = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
"""Types of .ply files."""

PLACES = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"))
"""Names under which .ply files have places on a texture."""

STL_HEAD, STL_FACE = 84, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])


class _MeshArrays(NamedTuple):
    """Vertices (V, 3), faces (F, 3), and places (V, 2) on a texture, v from below, if there are any."""

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None


def read(path: str | os.PathLike[str]) -> _MeshArrays:
    """The mesh in a file. Raises NotFoundError; FormatError for what is damaged, cut short, too large or of another
    kind; ParameterError where there are no faces."""
    if not os.path.isfile(path):
        raise NotFoundError(f"{path}: no such file; expected a mesh")
    suffix = Path(path).suffix.lower()
    if suffix not in _READERS:
        raise FormatError(
            f"{path}: {suffix or 'no suffix'}; expected {', '.join(_READERS)}: unpack or convert it first"
        )
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size > MOST_BYTES:
            raise FormatError(
                f"{path}: {size} bytes, expected at most {MOST_BYTES}; divide the mesh into several files"
            )
        content = file.read(size)
    try:
        mesh = _READERS[suffix](content)
    except (ValueError, LookupError, OverflowError) as error:
        raise FormatError(f"{path}: no {suffix} file that can be read: {error!s:.160}; fetch it again") from None
    if not len(mesh.faces):
        raise ParameterError(f"{path}: holds no faces, expected a mesh: a cloud of points has no surface")
    return mesh


def _lines(content: bytes, start: int = 0) -> Iterator[list[bytes]]:
    """The words of each line, without comments and blank lines."""
    while start < len(content):
        end = content.find(b"\n", start + CHUNK)
        end = len(content) if end < 0 else end
        for line in content[start:end].splitlines():
            if len(line) > LONGEST:
                raise ValueError(f"a line of {len(line)} bytes, expected at most {LONGEST}")
            if words := line.partition(b"#")[0].split():
                yield words
        start = end + 1


def _triangles(counts: np.ndarray, vertices: int, is_split: bool = False) -> np.ndarray:
    """Corners (T, 3) of the triangles into which polygons of so many corners are divided, all corners in a row.

    `is_split`: whether the vertices will become more, each with one place on a texture and one normal.
    """
    if (counts < 3).any():
        raise ValueError(f"a face of {counts.min()} corners, expected 3 or more")
    total = int(counts.sum() - 2 * len(counts))
    if not is_split and total > most_faces(vertices):
        raise ValueError(f"{total} triangles of {vertices} vertices, expected at most {most_faces(vertices)}")
    if total == len(counts):
        return np.arange(3 * total).reshape(-1, 3)
    fans = counts - 2
    first = np.repeat(np.cumsum(counts) - counts, fans)
    steps = np.arange(total) - np.repeat(np.cumsum(fans) - fans, fans)
    return np.stack([first, first + steps + 1, first + steps + 2], axis=1)


def _split(
    vertices: np.ndarray, faces: np.ndarray, places: np.ndarray, uv: np.ndarray, more: np.ndarray
) -> _MeshArrays:
    """A vertex for each vertex, place on a texture and number `more` that meet in a corner; all of these (F, 3)."""
    keys = (faces.reshape(-1) * len(uv) + places.reshape(-1)) * (int(more.max()) + 1) + more.reshape(-1)
    _, first, back = np.unique(keys, return_index=True, return_inverse=True)
    at, on = faces.reshape(-1)[first], places.reshape(-1)[first]
    return _MeshArrays(vertices[at], back.reshape(-1, 3), uv[on])


def _within(indices: np.ndarray, count: int, what: str) -> np.ndarray:
    if len(indices) and not 0 <= indices.min() <= indices.max() < count:
        raise ValueError(f"corners name {what} {indices.min()} to {indices.max()}, of which there are {count}")
    return indices


# Wavefront .obj


def _obj(content: bytes) -> _MeshArrays:
    vertices, uv, counts = array("d"), array("d"), array("q")
    corners = array("q"), array("q"), array("q")
    lengths = [0, 0, 0]
    for key, *words in _lines(content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")):
        if key == b"v":
            vertices.extend(_floats(words, 3))
            lengths[0] += 1
        elif key == b"vt":
            uv.extend(_floats([*words, b"0"], 2))
            lengths[1] += 1
        elif key == b"vn":
            lengths[2] += 1
        elif key == b"f":
            counts.append(len(words))
            for word in words:
                for k, number in enumerate(word.split(b"/")):
                    index = int(number or b"0")  # from 1, or backwards from the one before as -1
                    corners[k].append(index - 1 if index >= 0 else index + lengths[k])
    pairs = np.frombuffer(vertices).reshape(-1, 3) if vertices else np.empty((0, 3))
    v, vt, vn = (np.frombuffer(each, np.int64) if each else np.empty(0, np.int64) for each in corners)
    is_placed, is_lit = (len(each) == len(v) > 0 and each.min() >= 0 for each in (vt, vn))
    at = _triangles(np.array(counts, np.int64), len(pairs), is_placed or is_lit)
    faces = _within(v, len(pairs), "vertices")[at]
    if not (is_placed or is_lit):
        return _MeshArrays(pairs, faces, None)
    places = _within(vt, lengths[1], "places")[at] if is_placed else np.zeros_like(faces)
    lit = _within(vn, lengths[2], "normals")[at] if is_lit else np.zeros_like(faces)
    mesh = _split(pairs, faces, places, np.frombuffer(uv).reshape(-1, 2) if is_placed else np.zeros((1, 2)), lit)
    return mesh if is_placed else mesh._replace(uv=None)


def _floats(words: Sequence[bytes], count: int) -> list[float]:
    """The first numbers of a line."""
    if len(words) < count:
        raise ValueError(f"a line of {len(words)} numbers, expected {count}")
    return [float(word) for word in words[:count]]


# .off


def _off(content: bytes) -> _MeshArrays:
    lines = _lines(content)
    key, *head = next(lines, [b""])
    if key not in (b"OFF", b"COFF", b"NOFF", b"CNOFF", b"STOFF") or head[:1] == [b"BINARY"]:
        raise ValueError(f"starts with {key!r:.20}, expected OFF, and text")
    count, faces = (int(word) for word in (head or next(lines, []))[:2])
    if min(count, faces) < 0 or count + faces > len(content):
        raise ValueError(f"{count} vertices and {faces} faces, which {len(content)} bytes cannot hold")
    vertices, corners, counts = array("d"), array("q"), array("q")
    for _ in range(count):
        vertices.extend(_floats(next(lines, []), 3))
    for _ in range(faces):
        n, *words = next(lines, [b"cut short"])
        counts.append(int(n))
        if not 0 <= counts[-1] <= len(words):
            raise ValueError(f"a face of {counts[-1]} corners in a line of {len(words)}")
        corners.extend(int(word) for word in words[: counts[-1]])
    at = _triangles(np.array(counts, np.int64), count)
    return _MeshArrays(
        np.array(vertices).reshape(-1, 3), _within(np.array(corners, np.int64), count, "vertices")[at], None
    )


# .stl


def _stl(content: bytes) -> _MeshArrays:
    count = int.from_bytes(content[STL_HEAD - 4 : STL_HEAD], "little")
    if len(content) == STL_HEAD + count * STL_FACE.itemsize:
        corners = np.frombuffer(content, STL_FACE, count, STL_HEAD)["corners"].reshape(-1, 3)
    elif not content[:80].lstrip().lower().startswith(b"solid"):
        expected = f"expected {STL_HEAD + count * STL_FACE.itemsize} for the {count} faces that it announces, or text"
        raise ValueError(f"{len(content)} bytes, {expected}")
    else:
        numbers, key = array("d"), b""
        for key, *words in _lines(content):
            if key.lower() == b"vertex":
                numbers.extend(_floats(words, 3))
        if key.lower() != b"endsolid" or len(numbers) % 9:
            raise ValueError(f"is cut short: {len(numbers) // 3} corners, and no endsolid after them")
        corners = np.array(numbers).reshape(-1, 3)
    return _MeshArrays(corners, np.arange(len(corners)).reshape(-1, 3), None)


# Stanford .ply


class _Property(NamedTuple):
    """A number, or with `counted` a list of them; sizes in units of the data: bytes, or words."""

    name: str
    kind: np.dtype
    size: int
    counted: np.dtype | None = None
    head: int = 0


class _Values(NamedTuple):
    """The numbers of a property in a row, and how many each row has."""

    flat: np.ndarray
    counts: np.ndarray


def _ply(content: bytes) -> _MeshArrays:
    lines, data = _ply_header(content)
    form, elements = _ply_elements(lines)
    if form == "ascii":
        numbers = array("d")
        for words in _lines(data):
            numbers.extend(map(float, words))
        units = np.array(numbers)
    else:
        units = np.frombuffer(data, np.uint8)
    by_element: dict[str, dict[str, _Values]] = {}
    at = 0
    for name, count, properties in elements:
        by_element[name], at = _ply_rows(units, at, name, count, properties)
    return _ply_mesh(by_element)


def _ply_header(content: bytes) -> tuple[list[list[str]], bytes]:
    """The words of the lines of the header, and what follows it."""
    mark = content.find(b"end_header", 0, HEADER)
    end = content.find(b"\n", mark, HEADER)
    if not content.startswith(b"ply") or mark < 0 or end < 0:
        raise ValueError(f"expected a header, ply to end_header, in its first {HEADER} bytes")
    return [line.decode("latin-1").split() for line in content[:mark].splitlines()], content[end + 1 :]


def _ply_elements(lines: list[list[str]]) -> tuple[str, list[tuple[str, int, list[_Property]]]]:
    """The form of the data; the name, count and properties of each element."""
    form = ""
    elements: list[tuple[str, int, list[_Property]]] = []
    for words in lines:
        match words:
            case ["format", ("ascii" | "binary_little_endian" | "binary_big_endian") as form, *_]:
                pass
            case ["element", name, count]:
                if int(count) < 0 or name in {each[0] for each in elements}:
                    raise ValueError(f"element {name:.40} {count:.40}, expected one of a count from 0")
                elements.append((name, int(count), []))
            case ["property", "list", counted, kind, name] if elements:
                (head, length), (of, size) = _ply_kind(counted, form), _ply_kind(kind, form)
                if head.kind == "f":
                    raise ValueError(f"a list counted by {counted}, expected whole numbers")
                elements[-1][2].append(_Property(name, of, size, head, length))
            case ["property", kind, name] if elements:
                elements[-1][2].append(_Property(name, *_ply_kind(kind, form)))
            case ["property" | "element" | "format", *_]:
                raise ValueError(f"{' '.join(words):.60}: expected what PLY files have")
    if not form:
        raise ValueError("no format, expected ascii, binary_little_endian or binary_big_endian")
    return form, elements


def _ply_kind(word: str, form: str) -> tuple[np.dtype, int]:
    if word not in SCALARS:
        raise ValueError(f"a property of type {word:.40}, expected one of {', '.join(SCALARS)}")
    if form == "ascii":
        return np.dtype("f8" if SCALARS[word][0] == "f" else "i8"), 1
    dtype = np.dtype(SCALARS[word]).newbyteorder(">" if form == "binary_big_endian" else "<")
    return dtype, dtype.itemsize


def _ply_rows(
    data: np.ndarray, at: int, name: str, count: int, properties: list[_Property]
) -> tuple[dict[str, _Values], int]:
    """The numbers of an element that begins there, by property, and where it ends."""
    least = sum(p.head or p.size for p in properties)
    if count * max(least, 1) > len(data) - at or len({p.name for p in properties}) < len(properties):
        raise ValueError(f"{count} of {name:.40} announced, which {len(data) - at} bytes or words cannot hold")
    if not count:
        return {}, at
    lengths, width = _ply_row(data, at, properties)
    if count * width <= len(data) - at:
        rows = data[at : at + count * width].reshape(count, width)
        by_property, place = {}, 0
        for p, n in zip(properties, lengths, strict=True):
            if p.counted is not None and (_as(rows[:, place : place + p.head], p.counted) != n).any():
                break
            place += p.head + n * p.size
            by_property[p.name] = _Values(_as(rows[:, place - n * p.size : place], p.kind), np.full(count, n))
        else:
            return by_property, at + count * width
    return _ply_mixed(data, at, name, count, properties)


def _ply_mixed(
    data: np.ndarray, at: int, name: str, count: int, properties: list[_Property]
) -> tuple[dict[str, _Values], int]:
    """The same of rows of different lengths."""
    counts = [array("q") for _ in properties]
    edges = [np.zeros(len(data) + 1, np.int8) for _ in properties]
    for _ in range(count):
        lengths, _width = _ply_row(data, at, properties)
        for p, n, each, edge in zip(properties, lengths, counts, edges, strict=True):
            at += p.head
            edge[min(at, len(data))] += 1
            at += n * p.size
            if at > len(data):
                raise ValueError(f"is cut short within {count} of {name:.40}")
            edge[at] -= 1
            each.append(n)
    return {
        p.name: _Values(_as(data[np.cumsum(edge[:-1], dtype=np.int8).view(bool)], p.kind), np.array(each))
        for p, each, edge in zip(properties, counts, edges, strict=True)
    }, at


def _ply_row(data: np.ndarray, at: int, properties: list[_Property]) -> tuple[list[int], int]:
    """How many numbers each property has in the row that begins there, and the length of the row."""
    lengths, start = [], at
    for p in properties:
        n = 1
        if p.counted is not None:
            if at + p.head > len(data):
                raise ValueError("is cut short")
            n = int(_as(data[at : at + p.head], p.counted)[0])
            if not 0 <= n <= len(data):
                raise ValueError(f"a list of {n} in {len(data)} bytes or words")
        at += p.head + n * p.size
        lengths.append(n)
    return lengths, at - start


def _as(units: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """Numbers in a row, of bytes or of words."""
    if units.dtype == np.uint8:
        return np.ascontiguousarray(units).reshape(-1).view(dtype)
    return units.reshape(-1).astype(dtype)


def _ply_mesh(elements: dict[str, dict[str, _Values]]) -> _MeshArrays:
    vertex, face = elements.get("vertex", {}), elements.get("face", {})
    if vertex and not {*"xyz"} <= vertex.keys():
        raise ValueError(f"vertices of {', '.join(vertex):.60}, expected x, y and z")
    vertices = np.stack([vertex[name].flat.astype(float) for name in "xyz"], axis=1) if vertex else np.empty((0, 3))
    names = [name for name in ("vertex_indices", "vertex_index") if name in face]
    if not names:
        return _MeshArrays(vertices, np.empty((0, 3), np.int64), None)
    corners = face[names[0]]
    places = face.get("texcoord")
    is_split = places is not None and np.array_equal(places.counts, 2 * corners.counts)
    at = _triangles(corners.counts, len(vertices), is_split)
    faces = _within(corners.flat, len(vertices), "vertices")[at].astype(np.int64)
    if is_split and places is not None:
        uv = np.ascontiguousarray(places.flat, float).view(complex)
        different, back = np.unique(uv, return_inverse=True)
        return _split(vertices, faces, back.reshape(-1)[at], different.view(float).reshape(-1, 2), np.zeros_like(faces))
    for u, v in PLACES:
        if u in vertex and v in vertex:
            return _MeshArrays(vertices, faces, np.stack([vertex[u].flat, vertex[v].flat], axis=1).astype(float))
    return _MeshArrays(vertices, faces, None)


_READERS: dict[str, Any] = {".ply": _ply, ".obj": _obj, ".stl": _stl, ".off": _off}
