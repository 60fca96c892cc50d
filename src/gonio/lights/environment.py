"""Light from all sides, given by a picture of the whole sphere: an environment map."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Fixed, frozen, ops
from ..base.light import FAR, Light
from ..errors import MissingDataWarning, ParameterError, ShapeError, warn
from ..formula.direction import Direction
from ..formula.fields import Field, channels, option, param
from ._layouts import MITSUBA_TO_WORLD, from_mitsuba, from_mitsuba_turned, from_pbrt, to_mitsuba, to_pbrt
from ._panorama import MOST, Lookup, Panorama, pixel_count
from ._studio import studio_pixels
from ._words import DEFAULT, Word, towards

if TYPE_CHECKING:
    from ..pictures.image import Image


class _PictureField(Field):
    opens_files = True
    is_table = True
    accepts = "Array | Image | str | PathLike[str]"

    def check(self, owner: str, value: Any) -> Panorama:
        return Panorama.of(value)

    def traced(self, value: Panorama) -> Any:
        return value.pixels.shape


class EnvironmentLight(Light):
    r"""Light from infinitely far away on all sides: $L(\omega)$ = scale times an equirectangular picture.

    Row i, column j is the radiance at $\theta = \pi (i + 1/2)/H$, $\phi = -2\pi (j + 1/2)/W$ (z up, $\phi$ from +x
    towards +y): as photographed, for seen from inside $\phi$ falls to the right. Between these it is bilinear in
    $(\theta, \phi)$, across $\phi = 0$ too; in the last half pixel at the poles it does not depend on $\theta$.

    `sample` takes u[1] to the row and to $\cos\theta$ within it, and u[0] to the column and to $\phi$, both
    monotonically. The density is constant within a pixel, proportional to the mean plus the maximum over the pixel of
    the radiance (averaged over the channels), and so positive wherever there is light; uniform for a black map.

    Looks    `EnvironmentLight.studio()`: a sun, a window, a lamp, hills and tiles, and all of them in the metal.
    Shapes   image: a NumPy array (H, W, C) or (H, W), an `Image`, or the path of a picture (.exr, .hdr, ...), of
             which `Image.light` is taken; scale: a number or (C,). Pixels stay float32 or float64. Of a file with
             several layers, or whose codes are linear, give `gn.scenes.load_image(path, layer=, linear=)`.
    Units    image times scale: W m-2 sr-1; densities: sr-1.
    Error    rounding: in float32 a direction is found within 1.2e-7 H pixels (6e-5 pixels at 512 rows). As an
             approximation of the field that the pixels are samples of: at most (pi/H)^2/8 times the sum of its second
             derivatives by theta and phi.
    Source   PBRT-4 section 12.5, for infinite lights and their sampling; the layout: docs/conventions.md.

    Example
    >>> pixels = np.zeros((4, 8))
    >>> pixels[1, 2] = 1.0  # centre of that pixel: theta = 3 pi/8, phi = -5 pi/8
    >>> light = gn.EnvironmentLight(pixels)
    >>> print(light.incident(gn.direction(3 * np.pi / 8, -5 * np.pi / 8)).round(3))
    [1.]
    """

    image: Any = _PictureField(None, "equirectangular picture: an array, an Image or a path")
    scale = param(1.0, 0.0, 1e30, "factor on the pixels", unit="W m-2 sr-1")
    invalid = option("error", "zero", doc="negative, NaN and infinite pixels: an error, or 0")

    channel = channels("channel of the picture")

    can_sample: ClassVar[bool] = True
    MITSUBA_TO_WORLD: ClassVar[NDArray[np.float64]] = MITSUBA_TO_WORLD

    level: Any  # a table, of bound lights only

    def validate(self) -> None:
        image = self.image.checked(self.invalid == "zero")
        if image is not self.image:
            self._hold(image=image)
            self._kept.update(image.looked_up())
        shape, count = tuple(getattr(self.scale, "shape", ())), self.image.pixels.shape[-1]
        if len(shape) > 1 or (shape and count > 1 and shape[0] not in (1, count)):
            raise ShapeError(
                f"EnvironmentLight: scale has shape {shape}, expected a number or one per channel: {count}"
            )

        if count > 1:
            self._hold(channel=frozen(np.arange(count, dtype=float)))
        else:
            self._hold(channel=0.0)

    def to_json(self) -> dict[str, Any]:
        return {**super().to_json(), "image": self.image.path or self.image.pixels.tolist()}

    def _keep(self) -> dict[str, Fixed]:
        return {**super()._keep(), **self.image.looked_up()}

    @property
    def _lookup(self) -> Lookup:
        _, *tables = Lookup._fields
        return Lookup(self.image.pixels.shape, *(getattr(self, name) for name in tables))

    def seen(self, p: Direction, w: Direction) -> tuple[Any, Any]:
        return self.scale * self._lookup.radiance(w, self.channel), FAR

    def warp(self, p: Direction, u0: Any, u1: Any) -> Direction:
        return self._lookup.drawn(u0, u1)[0]

    def density(self, p: Direction, w: Direction) -> Any:
        return self._lookup.density(w)

    def drawn(self, p: Direction, u0: Any, u1: Any) -> tuple[Direction, Any]:
        return self._lookup.drawn(u0, u1)

    def strength(self, p: Direction) -> Any:
        return self.scale * ops.take(self.level, 0)

    @classmethod
    def studio(cls, sun: ArrayLike = (-0.8, -0.7, 0.8), height: int = 256) -> Self:
        """A made-up place to judge materials in, of (H, 2H, 3) pixels.

        A small warm sun for highlights, a window and a light strip for the shape of reflections, a sky with hills and a
        tiled floor for mirrors; the formulas are in `_studio.py`. `sun` is the direction to the sun, and everything but
        the floor turns with its azimuth: by default it is on the upper left, on the side of a camera that looks along
        +y.

        The irradiance is at most pi, on the plane that gets most, in red: a Lambertian surface stays below radiance 1.
        The brightest pixel has 550 times the mean radiance. Below 128 rows the sun is less than 4 pixels wide.

        Example
        >>> light = gn.EnvironmentLight.studio(height=32)
        >>> print(gn.render(gn.material("gold", alpha=0), light, size=16, samples=4).pixels.shape)
        (16, 16, 3)
        """
        axis = np.asarray(ops.plain(sun), dtype=float)
        if axis.shape != (3,) or not np.all(np.isfinite(axis)) or not axis.any():
            raise ParameterError(f"studio: sun={sun!r:.60}, expected a direction such as (1, 0, 1)")
        return cls(studio_pixels(axis / np.linalg.norm(axis), pixel_count("height", height)))

    @classmethod
    def from_mitsuba(cls, image: Any, height: int | None = None, *, to_world: Any = None, **options: Any) -> Self:
        """The light of a picture as Mitsuba 3's `envmap` shows it with this `to_world`, in Mitsuba's world.

        `to_world`: a rotation (4, 4), or a transform of Mitsuba; without it `MITSUBA_TO_WORLD`, z up. Pixels are
        interpolated where it turns by more than whole columns about the vertical.
        `height`: rows; without it, as many as the picture has. Mitsuba's rows reach from pole to pole, so that pixel
        centres lie between them and are interpolated; exact for pictures of `to_mitsuba` and the height that they came
        from. `options`: scale and invalid, as for the class.

        Example
        >>> light = gn.EnvironmentLight.studio(height=32)
        >>> again = gn.EnvironmentLight.from_mitsuba(light.to_mitsuba(), height=32)
        >>> w = gn.direction(0.4, 2.0)
        >>> print(np.allclose(again.incident(w), light.incident(w), rtol=1e-4))
        True
        """
        picture = Panorama.of(image)
        if to_world is not None:
            return cls(from_mitsuba_turned(picture, to_world, height), **options)
        return cls(from_mitsuba(picture, height), **options)

    def to_mitsuba(self) -> Image:
        """A picture (2H + 1, W, C) for Mitsuba 3's `envmap` with `to_world=light.MITSUBA_TO_WORLD`.

        Mitsuba's world is then this one, z up, and its radiance is this one in every direction but for its single
        precision (1.4e-5 of the contrast between pixels at 128 columns). It takes C = 1 and C = 3.

        Example
        >>> light = gn.EnvironmentLight.studio(height=32)
        >>> print(light.to_mitsuba().pixels.shape)
        (65, 64, 3)
        """
        return self._picture(to_mitsuba(self.image))

    @classmethod
    def from_pbrt(cls, image: Any, height: int | None = None, **options: Any) -> Self:
        """The light of a square picture in pbrt-v4's equal-area layout; pbrt's light axes become x, y, z.

        `height`: rows H of the (H, 2H, C) pixels, each the mean over its solid angle of what pbrt shows; without it,
        sqrt(pi)/2 times the rows of the square. `options`: scale and invalid, as for the class.

        Example
        >>> light = gn.EnvironmentLight.from_pbrt(np.full((64, 64, 3), 0.5), height=32)
        >>> print(light.incident(np.array([0.0, 0.6, 0.8])).round(3))
        [0.5 0.5 0.5]
        """
        return cls(from_pbrt(Panorama.of(image), height), **options)

    def to_pbrt(self, size: int | None = None) -> Image:
        """A square picture (N, N, C) for pbrt-v4's infinite light, in its equal-area layout.

        x, y, z become pbrt's light axes. pbrt's world is left-handed and would show gonio's in a mirror: begin the
        scene with `Scale -1 1 1`. `size`: N; without it, 2H/sqrt(pi), texels as large as pixels at the equator. A texel
        holds the mean over its solid angle: the flux of `studio()` is kept to 4e-4.

        Example
        >>> light = gn.EnvironmentLight.studio(height=32)
        >>> print(light.to_pbrt().pixels.shape)
        (36, 36, 3)
        """
        return self._picture(to_pbrt(self.image, type(self)(self.image).incident, size))

    def _picture(self, pixels: NDArray[Any]) -> Image:
        from ..pictures.image import Image

        return Image((pixels * np.asarray(self.scale)).astype(np.float32))


def photograph(path: str, layer: str | None = None) -> EnvironmentLight:
    """An environment map from a file, or from a layer of it. Resampled photographs often hold values a little below 0:
    these count as 0, with a warning; NaN and infinity are errors."""
    from ..pictures.image import load_image

    picture = Panorama.of(path if layer is None else load_image(path, MOST, layer=layer))
    least, most = picture.pixels.min(), picture.pixels.max()
    if not (-math.inf < least < 0.0 and most < math.inf):
        return EnvironmentLight(picture)
    negative = sum(int((row < 0.0).any(axis=-1).sum()) for row in picture.pixels)
    share = f"{negative} of {picture.pixels[..., 0].size} pixels are negative (down to {least:.3g})"
    warn(f"{path}: {share} and count as 0", MissingDataWarning)
    return EnvironmentLight(picture, invalid="zero")


def _studio(numbers: list[float]) -> EnvironmentLight:
    if len(numbers) not in (0, 2):
        raise ParameterError("expected studio, or studio:THETA,PHI of the sun in degrees")
    return EnvironmentLight.studio(towards(*numbers)) if numbers else EnvironmentLight.studio()


WORDS = [
    Word("FILE[:LAYER]", "equirectangular environment map, or a layer of its file", photograph),
    Word(f"{DEFAULT}[:THETA,PHI]", "made up: a sun (there), sky, window and floor", _studio, aliases=("sky",)),
]
