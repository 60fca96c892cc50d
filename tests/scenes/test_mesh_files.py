"""Meshes in files: what each kind holds, what is refused, and that nothing else is opened, unpacked or believed."""

import io
import os
import struct
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from mesh_files import FANS, MESHES, VERTICES, off, ply

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.scenes import mesh_file


@pytest.mark.parametrize("name", MESHES)
def test_every_kind_holds_the_same_triangles(name, tmp_path):
    path = tmp_path / f"a{name}"
    path.write_bytes(MESHES[name]())
    found = mesh_file.read(path)
    np.testing.assert_array_equal(found.vertices[found.faces], VERTICES[FANS])
    is_placed = name in ("text uv.ply", "big.ply", ".obj")
    assert (found.uv is not None) == is_placed
    if is_placed:
        np.testing.assert_array_equal(found.uv[found.faces], VERTICES[FANS][..., :2])


@pytest.mark.parametrize("name", ["text.ply", "little.ply", ".off", "binary.stl", "text.stl"])
def test_trimesh_reads_the_same(name, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / f"a{name}"
    ball = trimesh.creation.icosphere(1)
    options = {"text.ply": {"encoding": "ascii"}, "text.stl": {"file_type": "stl_ascii"}}.get(name, {})
    ball.export(path, **options)
    theirs, ours = trimesh.load(path, process=False), mesh_file.read(path)
    np.testing.assert_allclose(ours.vertices[ours.faces], theirs.vertices[theirs.faces], rtol=1e-7, atol=1e-9)


def test_corners_may_have_places_of_their_own(tmp_path):
    """Of a .ply file whose faces have a list "texcoord": a vertex with two places becomes two."""
    rows = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "3 0 1 2 6 0 0 1 0 1 1", "3 0 2 3 6 0.5 0 1 1 0 1"]
    head = ["ply", "format ascii 1.0", "element vertex 4", *(f"property float {x}" for x in "xyz"), "element face 2"]
    head += ["property list uchar int vertex_index", "property list uchar float texcoord", "end_header"]
    (tmp_path / "a.ply").write_text("\n".join([*head, *rows, ""]))
    mesh = gn.scenes.Mesh(tmp_path / "a.ply")
    assert len(mesh.triangles.vertices) == 5
    np.testing.assert_allclose(mesh.uv[mesh.triangles.faces][:, :, 0], [[0, 1, 1], [0.5, 1, 0]])
    np.testing.assert_allclose(mesh.uv[mesh.triangles.faces][:, :, 1], [[1, 1, 0], [1, 0, 0]])  # from above


def zipped(content: bytes, name: str = "a.ply") -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(name, content)
    return packed.getvalue()


@pytest.mark.parametrize(
    "suffix", [".zip", ".tar.gz", ".glb", ".gltf", ".3mf", ".dae", ".ply", ".obj", ".stl", ".off", ""]
)
def test_archives_are_no_meshes(suffix, tmp_path):
    """Whatever they are called."""
    path = tmp_path / f"a{suffix}"
    path.write_bytes(zipped(ply("ascii")))
    for call in (gn.scenes.Mesh, lambda path: gn.render(gn.Lambertian(0.5), shape=path)):
        with pytest.raises((FormatError, ParameterError), match="expected"):
            call(path)


def test_what_a_mesh_names_is_not_opened(tmp_path):
    """Materials and pictures are pipes that nobody writes to: who opens one waits for ever."""
    for name in ("a.mtl", "a.png"):
        os.mkfifo(tmp_path / name)
    (tmp_path / "a.obj").write_bytes(MESHES[".obj"]().replace(b"/etc/passwd", b"a.mtl"))
    (tmp_path / "a.ply").write_bytes(ply("ascii", uv=True).replace(b"/etc/passwd", b"a.png"))
    code = "import sys, gonio as gn; print([len(gn.scenes.Mesh(x).triangles.faces) for x in sys.argv[1:]])"
    words = [sys.executable, "-c", code, "a.obj", "a.ply"]
    assert subprocess.run(words, cwd=tmp_path, capture_output=True, timeout=60).stdout == b"[7, 7]\n"


HUGE = 2_000_000_000
BINARY = ply("binary_little_endian")


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.ply", BINARY.replace(b"vertex 8", b"vertex %d" % HUGE), "cannot hold"),
        ("a.ply", BINARY.replace(b"face 6", b"face %d" % HUGE), "cannot hold"),
        ("a.ply", BINARY.replace(b"face 6", b"face -6"), "from 0"),
        ("a.ply", BINARY.replace(b"list uchar", b"list float"), "whole numbers"),
        ("a.ply", BINARY[:-4], "cut short"),
        ("a.ply", ply("ascii").replace(b"vertex 8", b"vertex %d" % HUGE), "cannot hold"),
        ("a.ply", ply("ascii")[:-8], "cut short"),
        ("a.ply", ply("ascii").replace(b"4 3 6 5 0", b"999999999999 3 6 5 0"), "a list of"),
        ("a.ply", ply("ascii").replace(b"x\n", b"q\n"), "expected x, y and z"),
        ("a.ply", b"ply\n" + b"comment\n" * 100_000, "expected a header"),
        ("a.off", off().replace(b"8 6 0", b"%d 6 0" % HUGE), "cannot hold"),
        ("a.off", off().replace(b"4 3 6 5 0", b"9 3 6 5 0"), "a face of 9"),
        ("a.off", off()[:-10], "cut short"),
        ("a.stl", b"\0" * 80 + struct.pack("<I", HUGE) + b"\0" * 100, "announces"),
        ("a.stl", MESHES["binary.stl"]()[:-10], "announces"),
        ("a.stl", MESHES["text.stl"]()[:-15], "cut short"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "name vertices"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "name vertices"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf" + b" 1 2 3" * 100_000, "expected at most 2"),
        ("a.obj", b"v 0 0\nf 1 1 1", "2 numbers"),
        ("a.obj", b"v 0 0 0 " + b"1" * (1 << 22) + b"\nf 1 1 1", "a line of"),
        ("a.obj", b"v 0 0 0\n", "holds no faces"),
    ],
)
def test_what_is_damaged_is_told(name, content, says, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises((FormatError, ParameterError), match=says):
        gn.scenes.Mesh(tmp_path / name)


def test_nothing_that_a_file_holds_takes_more_than_thirty_times_its_size(tmp_path):
    """Of the densest triangles that there can be, a grid of binary .ply; and of empty rows."""
    n = 400
    k = np.arange(n * n).reshape(n, n)
    faces = np.stack([k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]], axis=-1).reshape(-1, 4)
    rows = np.zeros(len(faces), [("n", "u1"), ("i", "<i4", 4)])
    rows["n"], rows["i"] = 4, faces
    xyz = np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.zeros((n, n))], axis=-1).astype("<i2")
    head = BINARY[: BINARY.index(b"end_header") + 11].replace(b"float", b"short")
    head = head.replace(b"vertex 8", b"vertex %d" % n**2).replace(b"face 6", b"face %d" % len(faces))
    (tmp_path / "grid.ply").write_bytes(head + xyz.tobytes() + rows.tobytes())
    empty = b"ply\nformat ascii 1.0\nelement vertex 400000\nproperty float x\nend_header\n" + b"0\n" * 400_000
    (tmp_path / "empty.ply").write_bytes(empty)
    (tmp_path / "solids.stl").write_bytes(b"solid a\nendsolid\n" * 50_000 + b"solid a\nvertex 0 0 0\nendsolid")
    code = """
import os, re, sys
import gonio as gn

def most():
    return int(re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1])

gn.scenes.Mesh(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
for path in sys.argv[1:]:
    if pid := os.fork():
        os.waitpid(pid, 0)
        continue
    before = most()
    try:
        gn.scenes.Mesh(path)
    except gn.Error:
        pass
    print(1024 * (most() - before), flush=True)
    os._exit(0)
"""
    paths = sorted(tmp_path.iterdir())
    words = [sys.executable, "-W", "ignore::DeprecationWarning", "-c", code, *paths]  # of a fork beside threads
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=60)
    for path, taken in zip(paths, done.stdout.split(), strict=True):
        assert int(taken) <= 30 * path.stat().st_size + (64 << 20), path.name
