"""Bispectral OpenEXR pictures: for each pixel the light that leaves at one wavelength and arrived at another.

Channels have names as "An OpenEXR layout for spectral images" gives them: `T.550,000000nm` is what is reflected at
550 nm, `T.380,000000nm.550,000000nm` what leaves at 550 nm of light that arrived at 380 nm. Wavelengths are written
with a decimal comma and a unit: metres or hertz, with a prefix. Pairs without a channel exchange no light. The numbers
are per band and not per nanometre: in the one published picture the columns add up to 0.95 at most as they are, and to
4 and more as densities. They are taken for radiance factors of diffuse surfaces. Other channels (R, G, B for viewers)
are passed over.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError
from ..files import replacing
from ..formula.exchange import Exchange
from ..models.donaldson import Donaldson
from ..models.lambertian import Lambertian
from ..pictures.files._source import library
from ..pictures.image import load_image

NAME = "bispectral EXR"
SUFFIXES = (".exr",)
SHARED_SUFFIX = True
FLUORESCES = True
DESCRIPTION = "fluorescent pictures: Donaldson's matrix of each pixel (Fichet et al. 2021)"
ORACLE = "one real file (colour-science)"
NO_LAYOUT = "pixels of matrices by wavelength, no angles"

START = b"v/1\x01"
PREFIXES = {"Y": 24, "Z": 21, "E": 18, "P": 15, "T": 12, "G": 9, "M": 6, "k": 3, "h": 2, "da": 1, "": 0}
PREFIXES |= {"d": -1, "c": -2, "m": -3, "u": -6, "n": -9, "p": -12, "f": -15, "a": -18, "z": -21, "y": -24}
LIGHT = 299792458.0
"""Speed of light [m/s]."""

LAYER = "T"
"""Of the channels that are read; R, G, B for viewers stand beside it."""

_WAVELENGTH = r"(\d*,?\d*(?:[eE][+-]?\d+)?)(da|[YZEPTGMkhdcmunpfazy]?)(m|Hz)"
_CHANNEL = re.compile(rf"T\.{_WAVELENGTH}(?:\.{_WAVELENGTH})?")
_PAIR = re.compile(rf"T\.{_WAVELENGTH}\.{_WAVELENGTH}\0".encode())


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: an OpenEXR picture with a channel for two wavelengths."""
    return head.startswith(START) and _PAIR.search(head) is not None


def read(
    path: Path,
    pixel: Annotated[
        tuple[int, int] | None, Declared("row and column of the one pixel, from 0 at the top left", 0)
    ] = None,
    mean: Annotated[bool, Declared("the mean over all pixels, in the place of a map")] = False,
    negative: Annotated[
        str, Declared("numbers below 0, which a measurement may have by noise", words=("refuse", "zero"))
    ] = "refuse",
) -> Donaldson:
    """The matrices of all pixels, as a map (H, W, C, C); of one pixel, of `pixel` or with `mean` a matrix (C, C).

    Raises FormatError for damage, for numbers below 0, and without channels of two wavelengths.

    Example
    >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
    >>> gn.save(ink, "ink.exr", format="bispectral EXR")
    >>> print(gn.load("ink.exr").matrix.round(3))
    [[0.2 0. ]
     [0.3 0.6]]
    """
    picture = load_image(path, layer=LAYER)
    names = picture.channels or ()
    places = {k: found for k, name in enumerate(names) if (found := _wavelengths(name)) is not None}
    if not any(i != o for i, o in places.values()):
        raise FormatError(f"{path}: no channel such as T.400,0nm.550,0nm; expected one for each pair of wavelengths")
    pixels = picture.colour
    if pixel is not None:
        if pixel[0] >= pixels.shape[0] or pixel[1] >= pixels.shape[1]:
            raise ParameterError(
                f"{path}: pixel={pixel}: the picture has {pixels.shape[0]} rows, {pixels.shape[1]} columns"
            )
        pixels = pixels[pixel]
    elif mean:
        pixels = pixels.mean(axis=(0, 1), dtype=float)
    elif pixels.shape[:2] == (1, 1):
        pixels = pixels[0, 0]
    nm = np.unique([x for pair in places.values() for x in pair])
    at = {x: k for k, x in enumerate(nm)}
    matrix = np.zeros((*pixels.shape[:-1], len(nm), len(nm)))
    for k, (i, o) in places.items():
        matrix[..., at[o], at[i]] = pixels[..., k]
    if not np.isfinite(matrix).all():
        raise FormatError(f"{path}: NaN or infinite numbers; expected the light of each pair of wavelengths")
    below = (matrix < 0.0).mean()
    if below > 0.0 and negative == "refuse":
        raise FormatError(
            f"{path}: {below:.2g} of the numbers are negative, to {matrix.min():g}: no surface sends back less light "
            f"for more; negative='zero' reads them as 0, for noise"
        )
    return Donaldson(np.maximum(matrix, 0.0), wavelengths=nm)


def _wavelengths(name: str) -> tuple[float, float] | None:
    """The wavelengths [nm] that arrive and leave in a channel; None for one of another kind."""
    found = _CHANNEL.fullmatch(name)
    if found is None:
        return None
    first, second = (_nanometres(*found.groups()[k : k + 3]) for k in (0, 3))
    if first is None or (second is None and found[4] is not None):
        return None
    return first, first if second is None else second


def _nanometres(number: str | None, prefix: str, unit: str) -> float | None:
    try:
        value = float((number or "").replace(",", ".")) * 10.0 ** PREFIXES[prefix or ""]
    except ValueError:
        return None
    if not 0.0 < value < float("inf"):
        return None
    return round(1e9 * (value if unit == "m" else LIGHT / value), 6)


def write(m: Donaldson, path: Path) -> None:
    """Write the matrix, or the map (H, W, C, C) of matrices, as float32; pairs without light have no channel.

    Raises ParameterError for anything but a diffuse `Donaldson` whose wavelengths are known.
    """
    if not isinstance(m, Donaldson) or m.shape != Lambertian(1.0):
        raise ParameterError(
            f"{m!r:.80}: expected a diffuse gn.Donaldson; other materials have no place in this format"
        )
    matrix, nm = np.atleast_2d(m.matrix), m.wavelengths
    if nm is None or matrix.ndim not in (2, 4):
        what = "its wavelengths are not known" if nm is None else f"a map of shape {matrix.shape[:-2]}"
        raise ParameterError(f"{m!r:.80}: {what}; expected wavelengths, and one matrix or a map (H, W)")
    whole = matrix.reshape(*(1, 1, 1, 1)[: 4 - matrix.ndim], *matrix.shape)
    planes = {}
    exchanged = Exchange.between(whole).any(axis=(0, 1))
    exchanged[1, 0] |= not exchanged.any()  # what marks the file
    for i, arrives in enumerate(nm):
        planes[f"T.{_written(arrives)}"] = _plane(whole, i, i)
        for o in np.flatnonzero(exchanged[:, i]).tolist():
            planes[f"T.{_written(arrives)}.{_written(nm[o])}"] = _plane(whole, o, i)
    openexr = library("OpenEXR", "OpenEXR")
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage, "spectralLayoutVersion": "1.0"}
    with replacing(path) as temporary:
        openexr.File(header, planes).write(str(temporary))


def _plane(whole: np.ndarray, o: int, i: int) -> Any:
    return np.ascontiguousarray(whole[:, :, o, i], np.float32)


def _written(nm: float) -> str:
    return f"{nm:.6f}nm".replace(".", ",")
