"""A picture of a material on a lit shape, sampled by light and material together."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Annotated, Any

import numpy as np

from ..arrays import ops
from ..base.light import Light
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..base.reradiation import exchanges, has_stand_in
from ..base.shown_channels import is_coloured, shown_as
from ..base.sides import is_lit
from ..base.under_light import glow
from ..declared.arguments import Declared, Seed, checked
from ..errors import ArrayTypeError, ParameterError, ShapeError
from ..evaluate.computation import composite
from ..formula import tree
from ..formula.direction import Direction, dot
from ..integrals.glows import channels_of, glows, widths
from ..integrals.illumination import as_lights, at_wavelengths, check_channels, has_spectra
from ..lights.environment import EnvironmentLight
from ..lights.sphere import SphereLight
from ..pictures.colour import LUMINANCE, daylight, light_to_rgb, transformed
from ..pictures.image import Image
from . import by_arrays
from ._bodies import Solid
from .asked import Backdrop, PixelTolerance, Samples, Size
from .camera import View
from .estimator import FRONTS
from .left_out import tell
from .passes import PixelSums, RenderCheckpoint, passes, warn_of_holes
from .pixels import Pixels
from .scene import Scene
from .shapes import SHAPES
from .stage import Stage
from .traced import PictureJob, Several

SAMPLES = 32
"""Samples of a pixel where nobody asks for more."""

MOST = 1 << 16
"""The most samples of a pixel that are taken to reach a standard error."""

PLACES = ("position", "centre")
"""What lights call their place."""

COARSE = 48
"""Rays of a side by which it is seen in advance whether fronts are in sight."""


@checked
def render(
    m: Reflectance | Scene,
    lights: Light | Iterable[Light] | None = None,
    shape: Annotated[Any, Declared("the file of a mesh, or one of " + ", ".join(SHAPES))] = "sphere",
    size: Size = 512,
    samples: Samples | None = None,
    seed: Seed = 0,
    progress: Callable[[int, int], None] | None = None,
    channels: Any = None,
    tolerance: PixelTolerance | None = None,
    checkpoint: Annotated[
        str | os.PathLike[str],
        Declared("file that keeps what is done: the same call goes on from there after it was ended"),
    ]
    | None = None,
    camera: View | None = None,
    ground: Reflectance | None = None,
    backdrop: Backdrop = False,
) -> Image:
    """A square picture of a lit shape, in linear RGB (or gray), with coverage as straight alpha: `pixels` are means
    over the covered part of a pixel (`premultiplied` is False), and before black the picture is `light`, their product
    with `alpha`, which other renderers write.

    `shape`: "sphere" or another shape by its name (`docs/light.md` shows them), the file of a mesh, a `gn.scenes.Mesh`,
    or a `gn.Scene` of several with materials of their own, which `gn.render(scene)` shows without another; or a surface
    of `gn.surfaces`, of which one period lies flat. Meshes
    shadow themselves and each other, from any light: shadows of lights with extent are soft. Their backs are black,
    unless a material is seen from behind too. `camera`: `gn.scenes.Camera` or `gn.scenes.OrthographicCamera`; by
    default it is far away, looks along +y, and sees the whole shape. `ground`: the material of a level plane under
    everything, which takes shadows; the default camera then looks down at it. `backdrop`: whether lights with extent
    are seen behind everything, such as an environment; alpha is 1 then. Meshes with their camera and lights may be
    anywhere, up to 1e7 of their sizes from the origin: they are moved to their own middle, in double precision.

    `lights`: a light or several; by default `EnvironmentLight.studio()`, and its luminance, alike in all channels, for
    materials whose channels are no colours (bands of a satellite, say), of which the picture has as many channels.

    Each pixel averages `samples` points within it. Lights with extent are sampled by the
    material and, where they can be, by themselves, combined by the balance heuristic; delta lights and delta lobes are
    exact. There is no interreflection: what is seen is lit by lights alone. Of what transmits one surface is seen, and
    bodies shadow as if it were opaque: a LeftOutWarning names the parts that this matters for. Spectral materials are
    turned into RGB, under lights without a spectrum as daylight (D65) shows them; where lights are spectra,
    `gn.ConstantLight(spectrum)`, the radiance is, whose colour is that of the light too. Wavelengths wholly outside the
    visible have no colour. What fluorescence sends out at another wavelength is seen too, of each light by its own
    spectrum; of lights without one by that of daylight, where channels are wavelengths. `channels`: the three channels
    that are shown as red, green and blue, or the one that is shown in gray, by name or wavelength [nm]
    (`m.channel_names`); without it, channels named red, green and blue are.

    Samples are taken in passes of 32. The picture's `error` is the standard error of each value, from the spread of
    the passes, so that there is one from 33 samples on; its `samples` are how many were taken. Passes fill what
    others leave: the true error is 1.3 times what the spread of two says (64 samples), 0.7 of it at 256, half at
    1024. `tolerance`: the picture is done when the root mean square of this error is below that share of the mean
    radiance of the shape, at the latest after `samples` (65536 where nobody says how many). `checkpoint`: a file
    that keeps the sums meanwhile; the same call goes on from there after it was interrupted, or killed, and gives
    the same picture to the last bit. With more samples it goes on from a picture that is done.

    `gn.engine.threads()` threads share the picture (`gn.engine.threads(n)`, GONIO_THREADS, the affinity and a
    container's limit set how many); the same arguments and seed give the same picture on any number of them.
    `progress(done, total)` is called as the work goes on. Direct light: Szeliski 2.83 to 2.85; sampling: Veach & Guibas
    1995.

    Example
    >>> picture = gn.render(gn.material("gold"), gn.EnvironmentLight.studio(height=32), size=16, samples=4)
    >>> print(picture.pixels.shape, picture.alpha.shape)
    (16, 16, 3) (16, 16)
    """
    wanted = most_samples(samples, tolerance)
    stage, materials = _staged(m, shape, camera, ground, backdrop)
    tell("render", stage, materials, m if isinstance(m, Scene) else shape)
    if not any(is_lit(x, -1.0) for x in materials):
        _check_fronts(stage)
    pixels = Pixels.of(stage, size, seed)
    lit = [(x, *lights_of(x, lights, channels)) for x in materials]
    several = [
        (x, sources, before, after, glows_of(x, sources, before, channels, by_power))
        for x, sources, by_power in lit
        for before, after in [colours_of(x, sources, channels, by_power)]
    ]
    m, sources, before, after, glowing = several[0]
    _refuse_lights_inside(stage, sources)
    if all(light.is_formula() for light in sources):
        job = _job(several, pixels)
        file = None if checkpoint is None else RenderCheckpoint(checkpoint, job.identity())
        sums = (PixelSums.zero if file is None else file.read)(len(pixels.places), job.channels)
        passes(sums, job.part, job.parts(), wanted, tolerance, progress, file)
        warn_of_holes(sums.holes)
        if not sums.seen.any():
            rule = "expected a shape within the picture; see its vertices, and camera= (eye, target, field_of_view)"
            raise ParameterError(f"render: nothing is in sight of the camera, {stage.camera!r:.200}; {rule}")
        errors, taken = sums.noise(), sums.samples
        colour, error = pixels.picture(sums.mean()), None if errors is None else pixels.picture(errors)
        alpha = pixels.picture(sums.seen[:, None] / taken)[..., 0]
    else:
        kinds = ", ".join(type(light).__name__ for light in sources if not light.is_formula())
        if tolerance is not None or checkpoint is not None:
            rule = "tolerance= and checkpoint= are for pictures that are computed as one formula"
            raise ParameterError(f"render: {rule}, and {kinds} is none; write the light with seen, or leave them out")
        refuse_shadows(stage, f"render, under {kinds}, which is a function of arrays")
        pairs = [(x, light) for x, lights in [(m, sources), *glowing] for light in lights]
        gather = by_arrays.reflected(pairs, before)
        colour, alpha = by_arrays.picture(gather, m.channels or 1, pixels, wanted, progress)
        colour = colour if after is None else transformed(colour, after)
        error, taken = None, wanted
    names = tuple(map(str, m.channel_names)) if colour.shape[-1] > 3 and m.channel_names is not None else None
    return Image(colour, alpha, names, error, taken)


def most_samples(samples: int | None, tolerance: float | None) -> int:
    """How many samples of a pixel are taken at most, where so many and such a standard error are asked for."""
    return samples if samples is not None else SAMPLES if tolerance is None else MOST


def _staged(
    m: Reflectance | Scene, shape: Any, camera: View | None, ground: Reflectance | None, backdrop: bool
) -> tuple[Stage, list[Reflectance]]:
    """What is seen, and the materials of its parts."""
    if isinstance(m, Scene):
        if shape != "sphere":
            raise ParameterError(f"render: a scene, and shape={shape!r:.60}; expected the scene alone, with its shapes")
        shape = m
    stage = Stage.of(shape, camera, ground, backdrop)
    if isinstance(m, Scene):
        materials = [x for x in stage.materials if x is not None]
        if len(materials) < len(stage.materials):
            rule = "expected one for each, or gn.render(m, shape=scene) with that of all others"
            raise ParameterError(f"render: a part of the scene has no material; {rule}")
        return stage, materials
    if None not in stage.materials:
        rule = "it has materials of its own; write gn.render(scene), or make meshes without material"
        raise ParameterError(f"render: {m!r:.60} is nowhere on shape={shape!r:.60}; {rule}")
    return stage, [m if x is None else x for x in stage.materials]


def _check_fronts(stage: Stage) -> None:
    """Raises ParameterError where all that is in sight are the backs of triangles, which are black."""
    if stage.hulls is None:
        return
    y, x = np.mgrid[:COARSE, :COARSE].astype(np.float32) + np.float32(0.5)
    hits = FRONTS(composite(**stage.values(COARSE)), place=np.stack([x, y], -1))
    if hits["met"].any() and not hits["front"].any():
        rule = "expected a camera outside it, and faces whose vertices are counterclockwise as seen from the front"
        raise ParameterError(
            f"render: the camera sees backs alone, as from inside the mesh, and they are black; {rule}"
        )


def _refuse_lights_inside(stage: Stage, lights: Sequence[Light]) -> None:
    """Raises ParameterError for lights at a place within a solid shape, out of which none gets."""
    if not isinstance(stage.bodies[0], Solid):
        return
    name = stage.bodies[0].shape
    for light in lights:
        at = next((getattr(light, place) for place in PLACES if place in light.fields), None)
        if at is None or (light.has_edges and not isinstance(light, SphereLight)):
            continue
        p = Direction(*np.asarray(at, np.float64))
        from_middle = math.sqrt(dot(p, p))
        inwards = SHAPES[name](p, p * (-1.0 / max(from_middle, 1e-9)))
        if from_middle < 1.0 and not (inwards.met and inwards.distance > 0.0):
            rule = f"expected a place outside the {name}, which is within 1 of the origin"
            raise ParameterError(f"render: {light!r:.120} is in the {name}, out of which no light gets; {rule}")


def _job(several: Sequence[tuple[Any, ...]], pixels: Pixels) -> PictureJob | Several:
    """The picture of one material, or of several. Raises ShapeError where channels do not fit each other."""
    if len(several) == 1:
        m, lights, before, after, glowing = several[0]
        return PictureJob.of(m, lights, pixels, before, after, glowing=glowing)
    jobs = tuple(PictureJob.of(m, lit, pixels, a, b, part, glow) for part, (m, lit, a, b, glow) in enumerate(several))
    counts = {job.channels for job in jobs}
    if len(counts - {1}) > 1:
        each = ", ".join(f"{m!r:.40} {job.channels}" for job, (m, *_) in zip(jobs, several, strict=True))
        raise ShapeError(
            f"render: materials of different channels, {each}; expected gray, RGB and wavelengths, or one number"
        )
    return Several(jobs, pixels, max(counts))


def refuse_shadows(stage: Stage, who: str) -> None:
    """Raises ParameterError for what is more than one convex shape."""
    if not stage.is_simple or stage.backdrop:
        raise ParameterError(
            f"{who}: expected one of the shapes {', '.join(map(repr, SHAPES))}, alone: without shadows"
        )


def lights_of(m: Reflectance, lights: Light | Iterable[Light] | None, channels: Any) -> tuple[list[Light], bool]:
    """The lights of a picture of a material, and whether some are spectra. Raises ShapeError for maps, ArrayTypeError
    for numbers of other array libraries."""
    for x in tree.leaves(m):
        lib = ops.library_of_type(type(x))
        if lib is not None and lib.name != "numpy":
            cure = f"write gonio.bridges.{lib.name}.render, or" if lib.name in ("torch", "jax") else "expected"
            raise ArrayTypeError(
                f"a picture's material has numbers of {lib.name}, whose derivatives are lost; {cure} NumPy's"
            )
    if maps := map_shape(m):
        place = next(path for path, _, x, _ in tree.numbers(m) if np.ndim(x) > 1)
        rule = "a picture shows one material: one number, or one per channel"
        cure = f"for one place of the map m.replace({{{place!r}: values[index]}}), or an option of the file's format"
        raise ShapeError(f"render: {place} is a map of shape {maps}, with channels last; {rule}; {cure}")
    sources = as_lights(default_light(m, channels) if lights is None else lights)
    return [light.in_numpy() for light in at_wavelengths(sources, m)], any(map(has_spectra, sources))


def default_light(m: Reflectance, channels: Sequence[str | float] | None = None) -> EnvironmentLight:
    """The light of pictures for which nobody asked for another: the studio, in gray where channels are no colours."""
    return _studio(channels is not None or not is_coloured(m))


@cache
def _studio(gray: bool) -> EnvironmentLight:
    studio = EnvironmentLight.studio()
    return EnvironmentLight(transformed(studio.image.pixels, LUMINANCE[:, None])) if gray else studio


def colours_of(
    m: Reflectance, lights: list[Light], channels: Any, by_power: bool
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Matrices (C, 3) that make RGB of a material of wavelengths, X, Y, Z or bands: of its reflectance, for lights of
    one channel or RGB, or of the radiance in the end, for lights with the same channels. None: nothing is to be done.
    `by_power`: whether the lights' numbers are the power at each wavelength, not daylight's share.
    """
    count, to_rgb = m.channels or 1, shown_as(m, channels)
    counts = [*map(channels_of, lights)]
    if by_power and channels is None and to_rgb is not None:
        to_rgb = light_to_rgb(m.wavelengths)
    matrix = None if to_rgb is None or count != len(to_rgb) else to_rgb.astype(np.float32)
    if matrix is not None and {*counts} <= {1, 3} and not by_power:
        return matrix, None
    for light, lit in zip(lights, counts, strict=True):
        check_channels(count, light, lit)
    return None, matrix


def glows_of(
    m: Reflectance, lights: list[Light], before: np.ndarray | None, channels: Any, by_power: bool
) -> list[tuple[Reflectance, list[Light]]]:
    """What a material re-radiates under the lights of a picture, each under some of them: see `glows`. `before`: the
    matrix that makes RGB of its reflectance, where the lights are taken for daylight."""
    if not exchanges(m):
        return []
    power = None
    if m.wavelengths is not None and (by_power or (channels is None and shown_as(m) is not None)):
        power = widths(m) if by_power else _daylight(m)
    if before is None:
        return glows(m, lights, power)
    E = np.ones(m.channels or 1) if power is None else power
    return [(glow(m, E, E), lights)]


def refuse_fluorescence(m: Reflectance, who: str) -> None:
    """Raises ParameterError for a material that re-radiates light, where a picture is of one reflectance."""
    if exchanges(m):
        rule = "which has none of the light that leaves at another wavelength; expected the material under a light"
        raise ParameterError(f"{who}: {m!r:.60} fluoresces, and this is made of its f, {rule}: m.under(E)")


def in_daylight(m: Reflectance) -> Reflectance:
    """A material that fluoresces as it is in daylight, where its wavelengths are known; others as they are."""
    return m.under(_daylight(m)) if has_stand_in(m) else m


def _daylight(m: Reflectance) -> np.ndarray:
    """The power of daylight in a material's bands (C,), and a little where it has none."""
    power: np.ndarray = widths(m) * np.maximum(daylight(m.wavelengths), 1e-6)
    return power
