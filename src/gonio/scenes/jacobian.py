"""Derivatives of pictures by numbers of the material and of the lights, in the same pass as the picture."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..base.textured import textures
from ..declared.arguments import Seed, checked
from ..errors import ParameterError
from ..formula import tree
from ..formula.text import listed
from ..pictures.image import Image
from .asked import Samples, Size
from .camera import View
from .left_out import tell
from .passes import Found, PixelSums, passes, warn_of_holes
from .pixels import Pixels
from .rendering import colours_of, lights_of, refuse_fluorescence
from .stage import Stage
from .traced import PictureJob


@checked
def picture_jacobian(
    m: Reflectance,
    lights: Light | Iterable[Light] | None = None,
    by: str | Sequence[str] = ("alpha",),
    shape: Any = "sphere",
    size: Size = 512,
    samples: Samples = 32,
    seed: Seed = 0,
    progress: Callable[[int, int], None] | None = None,
    channels: Any = None,
    camera: View | None = None,
) -> tuple[Image, dict[str, Image]]:
    """The picture of `render`, and its derivatives: pictures of how each value changes with a number.

    `by`: names or paths of numbers of the material, as `replace` takes them; of lights "lights.0.scale", numbered from
    0 in their order. By a number for each channel the derivative is that of each channel by its own number; where
    channels are wavelengths that become RGB, of the colour as all of these numbers rise together. What sampling decides
    is a constant, so that each sample of a derivative is one of the integrand's derivative. Other arguments are those
    of `render`; all meshes of a scene have the one material.

    Raises   ParameterError for lights that are functions, for RGB lights on wavelengths, and for the places and sizes
             of lights with edges, of which the light alone can be derived by.

    Example
    >>> sky = gn.ConstantLight(1.0)
    >>> picture, slopes = gn.scenes.picture_jacobian(gn.Lambertian(0.5), sky, by=["rho", "lights.0.radiance"], size=16)
    >>> print(picture.pixels[8, 8].round(3), slopes["rho"].pixels[8, 8].round(3))
    [0.5] [1.]
    """
    names = [by] if isinstance(by, str) else list(by)
    tell("picture_jacobian", Stage.of(shape, camera), [m], shape)
    job, paths, _ = derived(m, lights, names, shape, size, samples, seed, channels, camera, "picture_jacobian")
    count = 1 + len(paths)

    def work(at: slice, start: int, stop: int) -> Found:
        several, met, holes = job.slopes(paths, at, start, stop)
        return np.concatenate([job.coloured({"light": x}) for x in several], axis=-1), met, holes

    sums, pixels = PixelSums.zero(len(job.pixels.places), count * job.channels), job.pixels
    passes(sums, work, job.parts(), samples, None, progress, None)
    warn_of_holes(sums.holes)
    alpha = pixels.picture(sums.seen[:, None] / sums.samples)[..., 0]
    noise = sums.noise()
    labels = tuple(map(str, m.channel_names)) if job.channels > 3 and m.channel_names is not None else None
    images = []
    for k in range(count):
        columns = slice(k * job.channels, (k + 1) * job.channels)
        error = None if noise is None else pixels.picture(noise[:, columns])
        images.append(Image(pixels.picture(sums.mean()[:, columns]), alpha, labels, error, sums.samples))
    return images[0], dict(zip(names, images[1:], strict=True))


class JacobianJob(NamedTuple):
    """A picture to be computed, the paths of numbers in its scene that it is derived by, and samples of a pixel."""

    job: PictureJob
    paths: list[str]
    samples: int

    def computed(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """The picture (H, W, C), and its derivatives (H, W, M) in the channels of the material, before `job.matrix`
        makes colours of them: by a number for each channel that of each channel by its own."""
        job, channels = self.job, self.job.own

        def work(at: slice, start: int, stop: int) -> Found:
            several, met, holes = job.slopes(self.paths, at, start, stop)
            return np.concatenate([x.reshape(len(met), channels) for x in several], axis=-1), met, holes

        sums = PixelSums.zero(len(job.pixels.places), (1 + len(self.paths)) * channels)
        passes(sums, work, job.parts(), self.samples, None, None, None)
        warn_of_holes(sums.holes)
        light, *several = np.split(sums.mean(), 1 + len(self.paths), axis=-1)
        return job.pixels.picture(job.coloured({"light": light})), [job.pixels.picture(x) for x in several]


def derived(
    m: Reflectance,
    lights: Light | Iterable[Light] | None,
    by: Sequence[str],
    shape: Any,
    size: int,
    samples: int,
    seed: int,
    channels: Any,
    camera: View | None,
    who: str,
) -> JacobianJob:
    """The picture to be computed, with its derivatives. Raises what `picture_jacobian` does, in the name of `who`."""
    stage = Stage.of(shape, camera)
    if len(stage.materials) > 1 or stage.materials[0] is not None:
        rule = "expected meshes without any, which all have that of the picture"
        raise ParameterError(f"{who}: the scene has materials of its own; {rule}")
    refuse_fluorescence(m, who)
    lights, by_power = lights_of(m, lights, channels)
    before, after = colours_of(m, lights, channels, by_power)
    for light in lights:
        if not light.is_formula():
            rule = "expected lights with seen, which are formulas"
            raise ParameterError(f"{who}: {type(light).__name__} is a function of arrays; {rule}")
    job = PictureJob.of(m, lights, Pixels.of(stage, size, seed), before, after)
    if job.colours > 1:
        rule = "expected lights of one channel, or spectra"
        raise ParameterError(f"{who}: RGB lights on a material of {job.own} wavelengths; {rule}")
    return JacobianJob(job, [_path(job.scene, name, textures(m), who) for name in by], samples)


def _path(scene: Any, name: str, textured: Container[str], who: str) -> str:
    """The path of a number in the scene. Raises ParameterError for one that moves the edges of a light."""
    path: str = tree.located(scene, name if name.startswith("lights.") else f"material.{name}")
    for place, field, _, _ in tree.walk(scene):
        alias = getattr(field, "alias", None)
        if alias and path == place.removesuffix(field.name) + alias:
            path = place
    if path not in {x for x in tree.leaf_paths(scene) if x}:
        raise ParameterError(f"{who}(by={name}): no number; expected some of {listed([*scene.parameters])}")
    if path.removeprefix("material.") in textured:
        rule = "a picture has no derivative by all of its texels; expected a number"
        raise ParameterError(f"{who}(by={name}): a texture, and {rule}; m.f on PyTorch or JAX has one")
    if path.startswith("lights."):
        light = scene.lights.parts[int(path.split(".")[1])]
        if light.has_edges and not scene.parameters[path].unit.startswith("W"):
            rule = "its edges move with that; expected a number of how bright it is"
            raise ParameterError(f"{who}(by={name}): {type(light).__name__} has edges, and {rule}")
    return path
