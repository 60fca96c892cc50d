"""Files that hold no reflectance, by their first bytes: what each is, and what to do with it."""

from __future__ import annotations

from ...pictures.image import STARTS

ELSEWHERE = "gn.scenes.load_image reads it, gn.EnvironmentLight(path) takes one as a light"

INDICES = "a table of refractive indices; write gn.Conductor(*gn.spectra.refractive_index(path))"

_KINDS: dict[bytes, str] = {
    **{start: f"a picture ({kind}); {ELSEWHERE}" for start, kind in STARTS.items()},
    b"GIF8": "a picture (GIF); save it as PNG or OpenEXR for gn.scenes.load_image",
    b"II*\0": "a picture (TIFF); save it as OpenEXR for gn.scenes.load_image",
    b"MM\0*": "a picture (TIFF); save it as OpenEXR for gn.scenes.load_image",
    b"%PDF": "a PDF document; the measurement itself is in another file",
    b"\x1f\x8b": "compressed (gzip); unpack it first: gunzip",
    b"BZh": "compressed (bzip2); unpack it first: bunzip2",
    b"\xfd7zXZ": "compressed (xz); unpack it first: unxz",
    b"7z\xbc\xaf": "compressed (7z); unpack it first",
    b"Rar!": "compressed (RAR); unpack it first",
    b"PK\x03\x04": "a zip file; unpack it first and load the file in it",
    b"\x93NUMPY": "an array of NumPy; make a measurement of it with gn.Gridded or gn.Scattered: numpy.load(path)",
    b"MATLAB 5.0": "a file of MATLAB; make a measurement of it with gn.Gridded or gn.Scattered: scipy.io.loadmat(path)",
    b"\x89HDF\r\n": "an HDF5 file, without what any of the formats in HDF5 has",
    b"\x0e\x03\x13\x01": "an HDF4 file, without what any of the formats in HDF4 has",
    b"<!doctype html": "a web page; the download of the file failed: look at it in a browser",
    b"<html": "a web page; the download of the file failed: look at it in a browser",
    b"version https://git-lfs": "a pointer of Git LFS in the place of the file; fetch it: git lfs pull",
}
"""First bytes -> what a file is, and what to do."""


def described(head: bytes, size: int) -> str:
    """What a file of no known format is, in words: empty, a picture, a page ...; "" where that is not known."""
    if size == 0:
        return "the file is empty; copy or download it again"
    if b"\nDATA:" in head and b"- type: " in head:
        return f"this is {INDICES}"
    text = head.lstrip().lower()  # a page may begin in any case, after blanks
    for start, kind in _KINDS.items():
        if (text if start.startswith(b"<") else head).startswith(start):
            return f"this is {kind}"
    return ""
