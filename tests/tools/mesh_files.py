"""Minimal files of meshes, of every kind that gonio reads: half of an octahedron, and a quadrilateral beside it."""

from __future__ import annotations

import struct

import numpy as np

VERTICES = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [3, 0, 0], [4, 0, 0], [4, 1, 0.0]])
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [5, 6, 7]])
FACES = [*TRIANGLES.tolist(), [3, 6, 5, 0]]
"""Polygons: the last one becomes 3 6 5 and 3 5 0."""

FANS = np.array([*TRIANGLES.tolist(), [3, 6, 5], [3, 5, 0]])


def _lines(*rows: str) -> bytes:
    return "".join(f"{row}\n" for row in rows).encode()


def _words(numbers: object) -> str:
    return " ".join(f"{x:g}" for x in np.ravel(numbers))


def ply(form: str, faces: list[list[int]] = FACES, uv: bool = False, counted: str = "uchar") -> bytes:
    """A .ply file in this form, with places on a texture at the vertices where asked."""
    names = [*"xyz", *("st" if uv else "")]
    rows = np.column_stack([VERTICES, VERTICES[:, :2]]) if uv else VERTICES
    head = _lines(
        "ply",
        f"format {form} 1.0",
        "comment TextureFile /etc/passwd",
        f"element vertex {len(rows)}",
        *(f"property float {name}" for name in names),
        f"element face {len(faces)}",
        f"property list {counted} int vertex_indices",
        "end_header",
    )
    if form == "ascii":
        return head + _lines(*map(_words, rows), *(_words([len(face), *face]) for face in faces))
    order = "<" if "little" in form else ">"
    count = {"uchar": "B", "int": "i"}[counted]
    body = b"".join(struct.pack(f"{order}{count}{len(face)}i", len(face), *face) for face in faces)
    return head + rows.astype(f"{order}f4").tobytes() + body


def obj() -> bytes:
    """A .obj file with places, normals, a material elsewhere, groups, and a face that counts backwards."""
    places = [f"vt {_words(v[:2])}" for v in VERTICES]
    faces = ["f " + " ".join(f"{k + 1}/{k + 1}/1" for k in face) for face in FACES[:-1]]
    backwards = "f " + " ".join(f"{k - len(VERTICES)}/{k - len(VERTICES)}/-1" for k in FACES[-1])
    corners = [f"v {_words(v)}" for v in VERTICES]
    return _lines("# a mesh", "mtllib /etc/passwd", *corners, *places, "vn 0 0 1", "g a", *faces, "usemtl b", backwards)


def off() -> bytes:
    """An .off file."""
    faces = [_words([len(face), *face]) for face in FACES]
    return _lines("OFF", f"{len(VERTICES)} {len(FACES)} 0", *map(_words, VERTICES), *faces)


def stl(is_text: bool) -> bytes:
    """An .stl file, of triangles alone."""
    corners = VERTICES[FANS]
    if is_text:
        facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet"
        facets = [facet.format("".join(f"vertex {_words(v)}\n" for v in triangle)) for triangle in corners]
        return _lines("solid a", *facets, "endsolid a")
    rows = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
    rows["corners"] = corners
    return b"\0" * 80 + struct.pack("<I", len(rows)) + rows.tobytes()


MESHES = {
    "text.ply": lambda: ply("ascii"),
    "text uv.ply": lambda: ply("ascii", uv=True),
    "little.ply": lambda: ply("binary_little_endian"),
    "big.ply": lambda: ply("binary_big_endian", uv=True, counted="int"),
    "triangles.ply": lambda: ply("binary_little_endian", FANS.tolist()),
    ".obj": obj,
    ".off": off,
    "text.stl": lambda: stl(is_text=True),
    "binary.stl": lambda: stl(is_text=False),
}
"""A kind of file by the end of its name -> its bytes."""
