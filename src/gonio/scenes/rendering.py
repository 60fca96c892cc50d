"""A picture of a material on a lit shape, sampled by light and material together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..arguments import checked
from ..arrays import ops
from ..base.channel_names import places
from ..base.frames import Frame
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..compile.threads import share
from ..errors import MissingDataWarning, ParameterError, ShapeError, warn
from ..evaluate import batch
from ..formula.direction import Direction
from ..integrals.illumination import as_lights, check_channels, delta_radiance, estimate, without_holes
from ..lights.environment import EnvironmentLight
from ..numerics.lattice import lattice
from ..pictures.colour import LUMINANCE, rgb_of, transformed
from ..pictures.image import Image
from .shapes import SHAPES, Shape

TILE = 1 << 14  # samples of a tile, the part of a picture that a thread takes: few enough for a processor's cache
ORDERS = 16  # orders of a lattice's points that the pixels of a tile choose from
MARGIN = 1.06  # half width of the picture, where shapes reach to 1
VIEW = np.array([0.0, -1.0, 0.0])
"""Direction from the surface to the camera, in the world."""


@checked
def render(
    m: Reflectance,
    lights: Light | Iterable[Light] | None = None,
    shape: str = "sphere",
    size: int = 512,
    samples: int = 32,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    bands: Any = None,
) -> Image:
    """A square picture of a lit shape, in linear RGB (or gray), with coverage as alpha.

    `lights`: a light or several; by default `EnvironmentLight.studio()`, and its luminance, alike in all channels, for
    materials whose channels are no colours (bands of a satellite, say), of which the picture has as many channels.

    Each pixel averages `samples` points within it. Lights with extent are sampled by every lobe of the material and,
    where they can be, by themselves, combined by the balance heuristic; delta lights and delta lobes are exact. There
    is no shadowing and no interreflection: shapes are convex and alone. Spectral materials are turned into RGB.
    `bands`: the three channels that are shown as red, green and blue, or the one that is shown in gray, by name or
    wavelength [nm] (`m.channel_names`); without it, channels named red, green and blue are.

    `gn.threads()` threads share the tiles of the picture (`gn.threads(n)`, GONIO_THREADS, the affinity and a
    container's limit set how many); the same arguments and seed give the same picture on any number of them.
    `progress(done, total)` is called as the work goes on. Direct light: Szeliski 2.83 to 2.85; sampling: Veach & Guibas
    1995.

    Example
    >>> picture = gn.render(gn.material("gold"), gn.EnvironmentLight.studio(height=32), size=16, samples=4)
    >>> print(picture.pixels.shape, picture.alpha.shape)
    (16, 16, 3) (16, 16)
    """
    if maps := batch.full_shape(m, ()):
        places = [path for path, p in m.parameters.items() if np.ndim(p.value) > 1]
        rule = "a picture shows one material: one number, or one per channel"
        cure = f"for one place of the map m.replace({{{places[0]!r}: values[index]}})"
        raise ShapeError(f"render: {places[0]} is a map of shape {maps}, with channels last; {rule}; {cure}")
    lights = [light.in_numpy() for light in as_lights(default_light(m, bands) if lights is None else lights)]
    if shape not in SHAPES:
        raise ParameterError(f"shape={shape!r}: expected one of {', '.join(map(repr, SHAPES))}")
    for name, value, high in (("size", size, 16384), ("samples", samples, 1 << 20)):
        if not (isinstance(value, (int, np.integer)) and 1 <= value <= high):
            raise ParameterError(f"{name}={value!r}: expected a whole number from 1 to {high}")
    if not (isinstance(seed, (int, np.integer)) and seed >= 0):
        raise ParameterError(f"seed={seed!r}: expected a whole number from 0")
    colour_before, colour_after = _colour(m, lights, bands)
    per_tile = max(1, TILE // samples)
    starts = range(0, size * size, per_tile)
    tiles: dict[int, tuple[np.ndarray, np.ndarray, int]] = {}

    def work(start: int) -> None:
        stop = min(start + per_tile, size * size)
        tiles[start] = _tile(m, lights, colour_before, SHAPES[shape], size, samples, seed, start, stop)

    announced = 0

    def announce() -> None:
        nonlocal announced
        while progress is not None and announced < len(tiles):
            announced += 1
            progress(announced, len(starts))

    share(work, [(start,) for start in starts], announce)
    announce()
    channels = max(radiance.shape[-1] for radiance, _, _ in tiles.values())
    ordered = [tiles[start] for start in sorted(tiles)]
    colour = np.concatenate([np.broadcast_to(radiance, (len(radiance), channels)) for radiance, _, _ in ordered])
    alpha = np.concatenate([coverage for _, coverage, _ in ordered]).astype(np.float32)
    missing = sum(holes for _, _, holes in ordered)
    if missing:
        text = f"{missing} samples met directions without measured data, which count as black"
        warn(text, MissingDataWarning)
    if colour_after is not None:
        colour = transformed(colour, colour_after)
    names = tuple(map(str, m.channel_names)) if colour.shape[-1] > 3 and m.channel_names is not None else None
    return Image(colour.reshape(size, size, -1), alpha.reshape(size, size), names)


def is_rgb(m: Reflectance) -> bool:
    """Whether the channels of a material are linear RGB."""
    return m.channels == 3 and m.channel_names in (None, ("R", "G", "B"))


def shown_as(m: Reflectance, bands: Sequence[str | float] | None = None) -> np.ndarray | None:
    """The matrix (C, 3), or (C, 1), by which pictures show channels: bands, wavelengths, X, Y, Z. None: as they are."""
    chosen = _chosen(m, bands)
    return rgb_of(m.channel_names) if chosen is None else chosen


def is_coloured(m: Reflectance, bands: Sequence[str | float] | None = None) -> bool:
    """Whether a material is gray or RGB, or pictures show it so."""
    return (m.channels or 1) == 1 or is_rgb(m) or shown_as(m, bands) is not None


def default_light(m: Reflectance, bands: Sequence[str | float] | None = None) -> EnvironmentLight:
    """The light of pictures for which nobody asked for another: the studio, in gray where channels are no colours."""
    studio = EnvironmentLight.studio()
    is_gray = bands is not None or not is_coloured(m)
    return EnvironmentLight(transformed(studio.image.pixels, LUMINANCE[:, None])) if is_gray else studio


def _chosen(m: Reflectance, bands: Any) -> np.ndarray | None:
    """The matrix (C, 3), or (C, 1), that picks the bands of a picture out of the channels; None for all as they are."""
    if bands is None:
        words = [str(name).lower() for name in m.channel_names or ()]
        if not {"red", "green", "blue"} <= {*words}:
            return None
        return np.eye(len(words))[:, [words.index(word) for word in ("red", "green", "blue")]]
    if not isinstance(bands, (list, tuple)) or len(bands) not in (1, 3):
        raise ParameterError(f"bands={bands!r:.60}: expected three channels, for red, green and blue, or a list of one")
    return np.eye(m.channels or 1)[:, places(m, bands)]


def _colour(m: Reflectance, lights: list[Light], bands: Any) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Matrices (C, 3) that make RGB of a material of wavelengths, X, Y, Z or bands: of its reflectance, for lights of
    one channel or RGB, or of the radiance in the end, for lights with the same channels. None: nothing is to be done.
    """
    up = np.array([[0.0, 0.0, 1.0]])
    channels, to_rgb = m.channels or 1, shown_as(m, bands)
    counts = [(x.arrival(up).irradiance if x.is_delta else x.incident(up)).shape[-1] for x in lights]
    matrix = None if to_rgb is None or channels != len(to_rgb) else to_rgb.astype(np.float32)
    if matrix is not None and {*counts} <= {1, 3}:
        return matrix, None
    for light, lit in zip(lights, counts, strict=True):
        check_channels(channels, light, lit)
    return None, matrix


def _tile(
    m: Reflectance,
    lights: list[Light],
    colour: np.ndarray | None,
    shape: Shape,
    size: int,
    samples: int,
    seed: int,
    start: int,
    stop: int,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Radiance (pixels, C), coverage (pixels,) and the number of samples without data, for a run of pixels."""
    rng = np.random.default_rng([seed, start])
    count = stop - start
    points = lattice(samples).astype(np.float32)
    # A lattice per pixel and use, shifted at random: evenly spread within the pixel, independent between pixels. Each
    # use takes its points in an order of its own, for in one order they would fill a plane of the six dimensions only.
    shift = rng.random((3, count, 1, 2), dtype=np.float32)
    orders = rng.permuted(np.tile(np.arange(samples), (2 * ORDERS, 1)), axis=1)
    pick = rng.integers(ORDERS, size=(2, count))
    at = (points + shift[0]) % 1.0
    u = (points[orders[pick[0]]] + shift[1]) % 1.0
    v = (points[orders[ORDERS + pick[1]]] + shift[2]) % 1.0
    index = np.arange(start, stop)
    x = ((index % size)[:, None] + at[..., 0]) * (2.0 * MARGIN / size) - MARGIN
    y = MARGIN - ((index // size)[:, None] + at[..., 1]) * (2.0 * MARGIN / size)
    n, t, hit = shape(x, y)
    coverage = hit.mean(axis=-1)
    if not hit.any():
        return np.zeros((count, 1), np.float32), coverage, 0
    n, t, u, v = (a[hit].astype(np.float32) for a in (n, t, u, v))
    local = Frame(*(Direction(*np.moveaxis(axis, -1, 0)) for axis in (t, np.cross(n, t), n)))
    wo = local.to_local(ops.library(n), np.broadcast_to(VIEW.astype(np.float32), n.shape))
    total: Any = 0.0
    missing = 0
    for light in lights:
        if light.is_delta:
            part, holes = without_holes(delta_radiance(m, light, local, wo, n, colour))
        else:
            part, holes = estimate(m, light, local, wo, u, v, colour)
        total, missing = total + part, missing + holes
    radiance = np.zeros((*hit.shape, total.shape[-1]), np.float32)
    radiance[hit] = total
    radiance = radiance.sum(axis=1) / np.maximum(hit.sum(axis=1), 1)[:, None]
    return radiance.astype(np.float32), coverage, missing
