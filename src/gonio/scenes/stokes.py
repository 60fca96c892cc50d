"""Pictures of polarized light: the Stokes vector of every pixel, and what a polarizer before the camera makes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.kinds import with_channels
from ..base.frames import Frame
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..base.results import Sample
from ..base.sides import sign_of_light
from ..base.sums import drawn_apart
from ..declared.arguments import Seed, checked
from ..declared.notebooks import repr_html
from ..errors import ParameterError
from ..formula.direction import Direction, cross
from ..formula.mueller import turn_to
from ..integrals.illumination import check_channels
from ..integrals.places import SeenPoints
from ..pictures.colour import LUMINANCE, transformed
from ..pictures.image import Image
from ..polarization import analyser, dop
from ..polarization.axes import as_array
from ..polarization.filters import polarizer as filter_at
from .asked import Samples, Size
from .by_arrays import picture
from .left_out import tell
from .pixels import Pixels
from .rendering import colours_of, lights_of, refuse_fluorescence, refuse_shadows
from .stage import Stage

UP = Direction(0.0, 0.0, 1.0)
"""Polarizers are turned from the horizontal towards this, in the world."""


@dataclass(frozen=True)
class StokesPicture:
    """A picture of Stokes vectors: `pixels` (H, W, C, 4), one for each channel, and `alpha` (H, W), coverage.

    The axes are those of the picture: x to the right, y up.

    Example
    >>> sun = gn.DistantLight(gn.direction(0.9, 0.4), irradiance=3.0)
    >>> picture = gn.scenes.render_stokes(gn.Coated(gn.Lambertian(0.5)), sun, size=16, samples=4)
    >>> print(picture.pixels.shape, picture.dop().pixels.max() <= 1.0)
    (16, 16, 1, 4) True
    """

    _repr_html_ = repr_html

    pixels: np.ndarray
    alpha: np.ndarray

    @property
    def radiance(self) -> Image:
        """The picture that a camera without filters takes.

        Example
        >>> sun = gn.DistantLight(gn.direction(0.9, 0.4), irradiance=3.0)
        >>> print(gn.scenes.render_stokes(gn.Lambertian(0.5), sun, size=16, samples=4).radiance.pixels.shape)
        (16, 16, 1)
        """
        return Image(np.ascontiguousarray(self.pixels[..., 0]), self.alpha)

    @checked
    def through(self, psi: float) -> Image:
        """The picture behind an ideal polarizer whose axis is psi [rad] from the picture's x axis towards up.

        Example
        >>> sun = gn.DistantLight(gn.direction(0.9, 0.4), irradiance=3.0)
        >>> picture = gn.scenes.render_stokes(gn.Lambertian(0.5), sun, size=16, samples=4)
        >>> print(np.allclose(picture.through(0.3).pixels, 0.5 * picture.radiance.pixels))
        True
        """
        seen = np.maximum(self.pixels @ analyser(psi).astype(np.float32), 0.0)
        return Image(seen, self.alpha)

    @checked
    def dop(self, linear: bool = False) -> Image:
        """Degree of polarization of the pixels' luminance, in gray: 1 where light is all polarized, 0 where it is dark.

        Example
        >>> sun = gn.DistantLight(gn.direction(0.9, 0.4), irradiance=3.0)
        >>> print(gn.scenes.render_stokes(gn.Lambertian(0.5), sun, size=16, samples=4).dop().pixels.max())
        0.0
        """
        weights = LUMINANCE if self.pixels.shape[2] == 3 else np.full(self.pixels.shape[2], 1.0 / self.pixels.shape[2])
        degree = np.nan_to_num(dop(np.einsum("hwcs,c->hws", self.pixels, weights), linear))
        return Image(np.minimum(degree, 1.0).astype(np.float32)[..., None], self.alpha)


@checked
def render_stokes(
    m: Reflectance,
    lights: Light | Iterable[Light] | None = None,
    shape: str = "sphere",
    size: Size = 512,
    samples: Samples = 32,
    seed: Seed = 0,
    polarizer: float | None = None,
    progress: Callable[[int, int], None] | None = None,
    channels: Any = None,
) -> StokesPicture:
    """`render`, with the polarization of what is seen: a lit shape behind an analyser, or between two polarizers.

    Lights are unpolarized, or with `polarizer` behind an ideal polarizer: its axis is that angle [rad] from the
    horizontal towards up, as seen against the light, and it lets half of the light through. For light from straight
    above or below "up" is towards the camera. What a material transmits is seen through the front of the shape alone,
    as `render` has it, and so are the other arguments.

    Example
    >>> sun = gn.DistantLight([0.0, -1.0, 0.0], irradiance=3.0)
    >>> m = gn.IdealSpecular() + gn.Lambertian(0.2)
    >>> picture = gn.scenes.render_stokes(m, sun, size=16, samples=4, polarizer=0.0)
    >>> crossed, along = picture.through(np.pi / 2), picture.through(0.0)
    >>> print(np.allclose(crossed.pixels, along.pixels))  # what is matt leaves unpolarized
    True
    """
    if polarizer is not None and not np.isfinite(polarizer):
        raise ParameterError(
            f"render_stokes(polarizer={polarizer!r}): expected an angle [rad], or None for no polarizer"
        )
    stage = Stage.of(shape)
    refuse_shadows(stage, "render_stokes")
    refuse_fluorescence(m, "render_stokes")
    tell("render_stokes", stage, [m], shape)
    lights, by_power = lights_of(m, lights, channels)
    before, after = colours_of(m, lights, channels, by_power)
    arriving = None if polarizer is None else filter_at(polarizer)[:, 0].astype(np.float32)

    def gather(at: SeenPoints) -> tuple[np.ndarray, int]:
        seen = _CameraStokes(at, arriving, before)
        total: Any = 0.0
        missing = 0
        for light in lights:
            part, holes = seen.delta(m, light) if light.is_delta else seen.extended(m, light)
            total, missing = total + part, missing + holes
        return total.reshape(*total.shape[:-2], -1), missing

    pixels, alpha = picture(gather, m.channels or 1, Pixels.of(stage, size, seed), samples, progress)
    pixels = pixels.reshape(size, size, -1, 4)
    if after is not None:
        pixels = np.swapaxes(transformed(np.swapaxes(pixels, -1, -2), after), -1, -2)
    return StokesPicture(np.ascontiguousarray(pixels), alpha)


class _CameraStokes:
    """Stokes vectors (..., C, 4) that leave points for the camera, in its axes."""

    def __init__(self, at: SeenPoints, arriving: np.ndarray | None, colour: np.ndarray | None):
        self.at, self.arriving, self.colour = at, arriving, colour
        self.lib = ops.library(at.wo)
        right = at.local.local(Direction(1.0, 0.0, 0.0))
        self.to_camera = as_array(turn_to(Direction(*np.moveaxis(at.wo, -1, 0)), right, 1.0)).astype(np.float32)

    def delta(self, m: Reflectance, light: Light) -> tuple[np.ndarray, int]:
        """Of a delta light."""
        arrival = light.arrival(self.at.position)
        wi = np.broadcast_to(self.at.local.to_local(self.lib, arrival.w), self.at.wo.shape)
        M, holes = self._matrices(m.mueller(wi, self.at.wo))
        check_channels(M.shape[-3], light, arrival.irradiance.shape[-1])
        return self._left(M, arrival.w, wi, arrival.irradiance * np.abs(wi[..., 2:3])), holes

    def extended(self, m: Reflectance, light: Light) -> tuple[np.ndarray, int]:
        """Of a light with extent, sampled as `integrals.illumination.estimate` does."""
        at, missing = self.at, 0
        total: Any = 0.0
        if light.can_sample:
            w, light_pdf = light.sample(at.v, at.position)
            to_light = at.local.to_local(self.lib, w)
        for weight, lobe in drawn_apart(m):
            if lobe.is_delta:
                mirrored = lobe.sample(at.wo, np.zeros(2, at.wo.dtype)).wi
                M, holes = self._matrices(lobe.delta_mueller(at.wo, across=sign_of_light(lobe) < 0.0), weight)
                total = total + self._from(M, light, mirrored, np.ones_like(mirrored[..., :1]))
                missing += holes
                continue
            s = lobe.sample(at.wo, at.u)
            usable = (s.pdf > 0.0)[..., None]
            share = np.where(usable, np.abs(s.wi[..., 2:3]) / np.where(usable, s.pdf[..., None], 1.0), 0.0)
            if light.can_sample:
                other = light.pdf(at.local.to_world(self.lib, s.wi), at.position)
                share = share * (s.pdf / np.maximum(s.pdf + other, 1e-30))[..., None]
            M, holes = self._matrices(lobe.mueller(s.wi, at.wo), weight)
            if lobe.has_delta:
                M, share = self._with_delta(lobe, s, M, share)
            total, missing = total + self._from(M, light, s.wi, share), missing + holes
            if light.can_sample:
                both = (lobe.pdf(to_light, at.wo) + light_pdf)[..., None]
                seen = light_pdf[..., None] > 0.0
                share = np.where(seen, np.abs(to_light[..., 2:3]) / np.where(seen, both, 1.0), 0.0)
                M, holes = self._matrices(lobe.mueller(to_light, at.wo), weight)
                total, missing = total + self._from(M, light, to_light, share), missing + holes
        return total, missing

    def _with_delta(self, m: Reflectance, s: Sample, M: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Matrices and shares of samples of a whole material, where these are of delta lobes: as bright as the weight
        says, and as polarizing as all delta lobes of that side are together."""
        across = s.wi[..., 2, None, None, None] < 0.0
        reflects, passes = (self._matrices(m.delta_mueller(self.at.wo, across=x))[0] for x in (False, True))
        D = np.where(across, passes, reflects)
        weight = with_channels(s.weight, s.wi.ndim - 1)
        weight = weight if self.colour is None else transformed(weight, self.colour)
        first = D[..., :1, :1]
        D = D * np.where(first > 0.0, weight[..., None, None] / np.where(first > 0.0, first, 1.0), 0.0)
        delta = s.delta[..., None]
        return np.where(delta[..., None, None], D, M), np.where(delta, 1.0, share)

    def _from(self, M: np.ndarray, light: Light, wi: np.ndarray, share: np.ndarray) -> np.ndarray:
        w = self.at.local.to_world(self.lib, wi)
        return self._left(M, w, wi, light.incident(w, self.at.position) * share)

    def _left(self, M: np.ndarray, w: np.ndarray, wi: np.ndarray, light: np.ndarray) -> np.ndarray:
        """What leaves of light (..., C) that arrives from w in the world, wi in the local frame."""
        if self.arriving is None:
            S = M[..., 0]
        else:
            S = M @ _arriving(w, wi, self.at.local, self.arriving)[..., None, :, None]
            S = S[..., 0]
        return (self.to_camera[..., None, :, :] @ S[..., None])[..., 0] * light[..., None]

    def _matrices(self, M: np.ndarray, weight: Any = 1.0) -> tuple[np.ndarray, int]:
        """Weighted matrices (..., C, 4, 4) in the picture's channels, 0 where a measurement holds none, and the number
        of these places."""
        M = (M if M.ndim == self.at.wo.ndim + 2 else M[..., None, :, :]) * np.asarray(weight, M.dtype)[..., None, None]
        absent = np.isnan(M).any(axis=(-1, -2), keepdims=True)
        holes = int(absent.any(axis=-3).sum()) if absent.any() else 0
        M = np.where(absent, 0.0, M).astype(np.float32) if holes else M
        if self.colour is not None:
            M = np.moveaxis(transformed(np.moveaxis(M, -3, -1), self.colour), -1, -3)
        return M, holes


def _arriving(w: np.ndarray, wi: np.ndarray, local: Frame, state: np.ndarray) -> np.ndarray:
    """The Stokes vector of a light behind the polarizer, of radiance 1 before it, in the surface's axes of wi."""
    k = Direction(*(-np.moveaxis(np.broadcast_to(w, wi.shape), -1, 0)))
    x = cross(UP, k)  # horizontal: y = k x x points up
    above = x.x * x.x + x.y * x.y < 1e-12
    x = Direction(np.where(above, -k.z, x.x), np.where(above, 0.0, x.y), x.z)
    turn = as_array(turn_to(Direction(*np.moveaxis(wi, -1, 0)), local.local(x), -1.0))
    return (np.swapaxes(turn, -1, -2) @ state).astype(np.float32)
