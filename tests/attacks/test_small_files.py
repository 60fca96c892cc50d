"""Small files that announce much: pictures, and tables that are cut short while they are in use."""

from __future__ import annotations

import math
import os
import socket
import struct
import subprocess
import sys
import threading
import zlib
from pathlib import Path

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio import errors
from gonio.formats import csail, utia
from gonio.formats._reading import tensor_file
from gonio.lights import _panorama
from gonio.pictures.files import _source
from gonio.pictures.image import Image, load_image

WIDTH, HEIGHT = 4096, 2048

CHILD = """
import resource, sys, warnings
import numpy as np
import gonio as gn
from gonio.lights.environment import EnvironmentLight
warnings.simplefilter("ignore")  # memory is looked at

def memory(name):
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith(name))

"""


def child(code: str, *words: str, space: int | None = None, seconds: int = 300) -> subprocess.CompletedProcess[str]:
    """A fresh process that runs `code` after `CHILD`, with so many bytes of address space more than it starts with."""
    bound = ""
    if space is not None:
        bound = f"resource.setrlimit(resource.RLIMIT_AS, (memory('VmSize:') + {space},) * 2)\n"
    command = [sys.executable, "-c", CHILD + bound + code, *words]
    search = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.run(command, env=search, capture_output=True, text=True, timeout=seconds, check=False)


BYTES_A_PIXEL = """
import importlib
for name in ("OpenEXR", "PIL.Image", "PIL.PngImagePlugin", "PIL.JpegImagePlugin"):
    importlib.import_module(name)
EnvironmentLight(np.ones((4, 8, 3), np.float32)).sample(np.zeros((2, 2)))
before = memory("VmRSS:")
light = EnvironmentLight(sys.argv[1])
loaded = memory("VmHWM:") - before
u = np.random.default_rng(0).random((1000, 2))
w, _ = light.sample(u)
light.incident(w), light.pdf(w.astype(np.float32))
count = light.image.pixels[..., 0].size
print(count, loaded / count, (memory("VmHWM:") - before) / count)
"""


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width: int, height: int, depth: int = 8, colour: int = 2, rows: bytes | None = None) -> bytes:
    """A PNG of zeros; with `rows` of that instead."""
    channels = {0: 1, 2: 3, 6: 4}[colour]
    if rows is None:
        rows = bytes(1 + (width * channels * depth + 7) // 8) * height
    head = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b"")


def panorama(kind: str, path: Path) -> None:
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    plane = 1.0 + np.sin(x / 300.0) * np.cos(y / 200.0)
    if kind in ("half", "float", "rgba", "zeros"):
        openexr = pytest.importorskip("OpenEXR")
        dtype = np.float16 if kind == "half" else np.float32
        plane = np.ascontiguousarray((plane * (kind != "zeros")).astype(dtype))
        header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
        openexr.File(header, dict.fromkeys("RGBA" if kind == "rgba" else "RGB", plane)).write(str(path))
    elif kind == "hdr":
        codes = np.full((HEIGHT, WIDTH, 4), 128, np.uint8)
        codes[..., 0] = 100.0 * plane
        head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y {HEIGHT} +X {WIDTH}\n"
        path.write_bytes(head.encode() + codes.tobytes())
    else:
        path.write_bytes(png(WIDTH, HEIGHT, depth=16 if kind == "png of 16 bits" else 8))


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads the memory of a process in /proc")
@pytest.mark.parametrize("kind", thinned(["half", "float", "rgba", "zeros", "hdr", "png", "png of 16 bits"], ["rgba"]))
def test_an_environment_map_takes_less_than_30_bytes_a_pixel(tmp_path, kind):
    """... of any format, while it is loaded, and when it is sampled for the first time. (D14)"""
    path = tmp_path / "sky"
    panorama(kind, path)
    done = child(BYTES_A_PIXEL, str(path))
    assert done.returncode == 0, done.stderr
    count, loaded, used = map(float, done.stdout.split())
    assert count == WIDTH * HEIGHT
    assert 4.0 < loaded < 30.0
    assert used < 30.0


def test_a_picture_of_a_few_kilobytes_does_not_announce_gigabytes(tmp_path):
    """A 17 kB PNG of 12000 x 12000 is more than an environment map may have; nothing of it is decoded. (D14)"""
    path = tmp_path / "bomb.png"
    path.write_bytes(png(12000, 12000, depth=1, colour=0))
    assert path.stat().st_size < 90_000
    code = """
try:
    EnvironmentLight(sys.argv[1])
except gn.Error as error:
    print(type(error).__name__, error)
"""
    done = child(code, str(path), space=400_000_000)
    assert done.returncode == 0, done.stderr
    assert "the header says 12000 x 12000 pixels, expected 1 to 134217728 pixels" in done.stdout


@pytest.mark.parametrize("kind", thinned(["zeros", "png"], ["zeros"]))
def test_a_picture_without_the_memory_for_it_is_refused_in_our_words(tmp_path, kind):
    """... and not by a MemoryError, a RuntimeError of a library, or "damaged". (D14)"""
    path = tmp_path / "sky"
    panorama(kind, path)
    code = """
import importlib
for name in ("OpenEXR", "PIL.Image", "PIL.PngImagePlugin"):
    importlib.import_module(name)
held = np.ones(10)
resource.setrlimit(resource.RLIMIT_AS, (memory("VmSize:") + 60_000_000,) * 2)
try:
    gn.scenes.load_image(sys.argv[1])
except gn.Error as error:
    print(type(error).__name__, error)
"""
    done = child(code, str(path))
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("TooLargeError")
    assert "\n" not in done.stdout.strip()


def test_a_picture_that_announces_more_than_is_free_is_not_begun(tmp_path, monkeypatch):
    """What the header announces is held against the memory that is free. (D14)"""
    path = tmp_path / "a.png"
    path.write_bytes(png(300, 200))
    load_image(path)
    monkeypatch.setattr(_source, "available", lambda: 300 * 200 * 12.0)
    with pytest.raises(gn.errors.TooLargeError, match=r"300 x 200 pixels, which take up to .* GB are free"):
        load_image(path)


def test_the_caller_may_ask_for_fewer_pixels(tmp_path):
    """`most` bounds every format before anything is decoded. (D14)"""
    openexr = pytest.importorskip("OpenEXR")
    assert openexr is not None
    pixels = np.ones((20, 30, 3), np.float32)
    for name in ("a.exr", "a.hdr", "a.png"):
        Image(pixels).save(tmp_path / name)
        assert load_image(tmp_path / name, 600).pixels.shape == (20, 30, 3)
        with pytest.raises(errors.FormatError, match=r"30 x 20 pixels, expected 1 to 599"):
            load_image(tmp_path / name, 599)
    assert _panorama.MOST == 16384 * 8192


def test_many_channels_are_counted(tmp_path, monkeypatch):
    """An EXR's memory is that of all channels of all parts, and deep parts are refused from the header. (D14)"""
    openexr = pytest.importorskip("OpenEXR")
    plane = np.zeros((64, 64), np.float32)
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    openexr.File(header, {f"c{k:03d}": plane for k in range(200)}).write(str(tmp_path / "many.exr"))
    parts = [openexr.Part(dict(header), {"Y": plane}, f"p{k}") for k in range(200)]
    openexr.File(parts).write(str(tmp_path / "parts.exr"))
    assert load_image(tmp_path / "parts.exr", layer="p7").pixels.shape == (64, 64, 1)
    monkeypatch.setattr(_source, "available", lambda: 64 * 64 * 200.0)
    for name in ("many.exr", "parts.exr"):
        with pytest.raises(gn.errors.TooLargeError, match="64 x 64 pixels"):
            load_image(tmp_path / name)


@pytest.mark.parametrize("what", ["fifo", "device", "socket", "folder", "zero"])
def test_what_is_no_file_is_no_picture(tmp_path, what):
    """A FIFO, a device and the like are refused at once: they may never end. (D14)"""
    path = tmp_path / "picture.png"
    if what == "fifo":
        os.mkfifo(path)
    elif what == "device":
        path.symlink_to("/dev/null")
    elif what == "zero":
        path.symlink_to("/dev/zero")
    elif what == "socket":
        os.chdir(tmp_path)
        held = socket.socket(socket.AF_UNIX)
        held.bind("picture.png")
        held.close()
    else:
        path.mkdir()
    for read in (load_image, gn.EnvironmentLight):
        with pytest.raises(gn.Error, match=r"expected a (file|picture)|No such device") as caught:
            read(path)
        assert str(path) in str(caught.value)


def test_nothing_that_others_print_is_lost_while_pictures_are_read(tmp_path, capsys):
    """`sys.stdout` stays what it is, for the reading thread too; nor does the library's own warning come out. (D17)"""
    openexr = pytest.importorskip("OpenEXR")
    plane = np.random.default_rng(0).random((256, 256)).astype(np.float32)
    path, bad = tmp_path / "a.exr", tmp_path / "bad.exr"
    openexr.File({"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}, {"Y": plane}).write(str(path))
    data = bytearray(path.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 2000] = bytes(2000)
    bad.write_bytes(data)
    stop, changed, printed = threading.Event(), [], [0]
    stdout = sys.stdout

    def talk() -> None:
        while not stop.is_set():
            if sys.stdout is not stdout:
                changed.append(sys.stdout)
            print("said")
            printed[0] += 1

    thread = threading.Thread(target=talk)
    thread.start()
    try:
        for _ in range(15):
            load_image(path)
            with pytest.raises(errors.FormatError, match=r"cannot be decoded|Unable"):
                load_image(bad)
    finally:
        stop.set()
        thread.join()
    assert not changed
    out = capsys.readouterr().out
    assert out == "said\n" * printed[0]
    assert printed[0] > 30


# Files that change while they are in use.


def polarized(path: Path, counts=(40, 40, 60)) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    axes = [np.linspace(0.0, 0.5 * math.pi, n, dtype="f4")[None] for n in counts[:2]]
    axes.append(np.linspace(-math.pi, math.pi, counts[2], dtype="f4")[None])
    M = rng.random((*counts[::-1], 2, 4, 4), dtype=np.float32)
    M[-1] = M[0]
    fields = {
        **dict(zip(("theta_h", "theta_d", "phi_d"), axes, strict=True)),
        "wvls": np.array([450, 550], "u2"),
        "M": M,
    }
    tensor_file.write(path, fields)
    return fields


def large_table(kind: str, path: Path) -> None:
    if kind == "KAIST":
        polarized(path)
    elif kind == "CSAIL":  # beyond what was read into memory
        header = np.zeros(16, "<i4")
        header[[0, 1, 2, 3, 6, 9, 10]] = 24, 24, 60, 180, 1, 0, 3
        path.write_bytes(header.tobytes() + np.full(3 * 24 * 24 * 60 * 180, 0.25, "<f4").tobytes())


CUT = """
import os
m = gn.load(sys.argv[1])
os.truncate(sys.argv[1], 100)
w = np.random.default_rng(0).normal(size=(20000, 3))
w[:, 2] = abs(w[:, 2])
w /= np.linalg.norm(w, axis=1)[:, None]
print(np.isfinite(m.f(w, w[::-1])).mean(), m.valid.mean())
try:
    m.matrices
except AttributeError:
    print("no others")
except gn.Error as error:
    print(error)
"""


@pytest.mark.parametrize("kind", thinned(["KAIST", "CSAIL"], ["KAIST"]))
def test_a_file_that_is_cut_short_after_it_was_loaded_changes_nothing(tmp_path, kind):
    """f is what was loaded, and no signal ends the program; the rest of the file is asked for in vain. (D22)"""
    path = tmp_path / {"KAIST": "a.pbsdf", "CSAIL": "a.dat"}[kind]
    large_table(kind, path)
    done = child(CUT, str(path))
    assert done.returncode == 0, (done.returncode, done.stderr[-300:])
    numbers, rest = done.stdout.split("\n", 1)
    assert [float(x) for x in numbers.split()] == [1.0, 1.0]
    assert ("load it again" in rest) if kind == "KAIST" else ("no others" in rest)


def test_mueller_matrices_are_those_of_the_file_or_none(tmp_path):
    """They stay in the file, and are refused when that has changed or is gone. (D22)"""
    path = tmp_path / "a.pbsdf"
    fields = polarized(path, (5, 6, 7))
    m = gn.load(path)
    np.testing.assert_array_equal(m.matrices, fields["M"])
    copy = tmp_path / "copy.pbsdf"
    gn.save(m, copy)
    assert copy.read_bytes() == path.read_bytes()
    os.utime(path, ns=(1, 1))
    with pytest.raises(errors.FormatError, match=r"a\.pbsdf: has changed since it was loaded; load it again"):
        _ = m.matrices
    path.unlink()
    with pytest.raises(errors.NotFoundError, match=r"a\.pbsdf: cannot be read"):
        _ = m.matrices


@pytest.mark.parametrize("kind", ["UTIA", "CSAIL"])
def test_length_and_content_are_those_of_one_open_file(tmp_path, monkeypatch, kind):
    """A file that is cut short between the look at its length and the reading is that, not a ValueError. (D22)"""
    path = tmp_path / "table"
    module = {"UTIA": utia, "CSAIL": csail}[kind]
    if kind == "UTIA":
        path.write_bytes(bytes(8 * 3 * (6 * 48) ** 2))
    else:
        header = np.zeros(16, "<i4")
        header[[0, 1, 2, 3, 6, 9, 10]] = 4, 4, 6, 8, 1, 0, 3
        path.write_bytes(header.tobytes() + bytes(4 * 3 * 4 * 4 * 6 * 8))
    real = np.fromfile

    def cut(file, *args, **more):
        os.truncate(path, path.stat().st_size // 2)
        return real(file, *args, **more)

    monkeypatch.setattr(np, "fromfile", cut)
    with pytest.raises(errors.FormatError, match="cut short"):
        module.read(path)
