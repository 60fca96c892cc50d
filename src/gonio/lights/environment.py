"""Light from all sides, given by a picture of the whole sphere: an environment map."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import ops
from ..errors import ParameterError, ShapeError
from ..image import Image
from ..light import Light
from ..param import Field, option, param
from ._layouts import MITSUBA_TO_WORLD, from_mitsuba, from_pbrt, to_mitsuba, to_pbrt
from ._panorama import Panorama
from ._studio import studio_pixels


class _Picture(Field):
    def check(self, owner: str, value: Any) -> Panorama:
        return Panorama.of(value)


class EnvironmentLight(Light):
    r"""Light from infinitely far away on all sides, $L(\omega)$ = scale times an equirectangular picture.

    Row i, column j is the radiance at $\theta = \pi (i + 1/2)/H$, $\phi = 2\pi (j + 1/2)/W$ (z up, $\phi$ from +x
    towards +y); between these it is bilinear in $(\theta, \phi)$, across $\phi = 0$ too, and constant in $\theta$ for
    the last half pixel at the poles. Seen from inside, $\phi$ grows to the left: a photographed panorama is laid out
    the other way round. `from_mitsuba` reads it unmirrored; used as it is, its light comes from a mirrored place.

    `sample` maps u monotonically: u[1] to the row and $\cos\theta$ within it, u[0] to the column and $\phi$. Its
    density is constant within a pixel, proportional to the mean plus the maximum of the radiance there (mean of
    the channels), and positive wherever the radiance is. A black map is sampled uniformly.

    Shapes   image: a NumPy array (H, W, C) or (H, W), an `Image`, or the path of a picture (.exr, .hdr, ...); scale:
             a number or (C,). `radiance` (..., 3) -> (..., C), `sample` (..., 2) -> (..., 3) and (...), `pdf`
             (..., 3) -> (...): arrays of NumPy, PyTorch or JAX, float32 or float64, which is what they return.
    Units    image times scale: W m-2 sr-1; density: sr-1. Pixels are kept as float32, or float64 if given so.
    Error    as a picture: none but rounding. float32 directions move by at most @@ pixel at 512 rows. As a sample of a
             smooth field: (pi/H)^2/8 of its second derivative.
    Source   layout: docs/conventions.md; the light of an infinite area source: PBRT-4 section 12.5.
    """

    image: Any = _Picture(None, "equirectangular picture: an array, an Image or a path")
    scale = param(1.0, 0.0, 1e30, "factor on the pixels", unit="W m-2 sr-1")
    invalid = option("error", "zero", doc="negative, NaN and infinite pixels: an error, or 0")

    can_sample: ClassVar[bool] = True
    MITSUBA_TO_WORLD: ClassVar[NDArray[np.float64]] = MITSUBA_TO_WORLD

    def validate(self) -> None:
        self.__dict__["image"] = self.image.checked(self.invalid == "zero")
        shape, channels = tuple(getattr(self.scale, "shape", ())), self.image.pixels.shape[-1]
        if len(shape) > 1 or (shape and channels > 1 and shape[0] not in (1, channels)):
            raise ShapeError(
                f"EnvironmentLight: scale has shape {shape}, expected a number or one per channel ({channels},)"
            )

    def to_json(self) -> dict[str, Any]:
        return {**super().to_json(), "image": self.image.path or self.image.pixels.tolist()}

    def radiance(self, w: Any) -> Any:
        found = self.image.radiance(w)
        return found * ops.library(found).convert(self.scale, found)

    def sample(self, u: Any) -> tuple[Any, Any]:
        return self.image.sample(u)

    def pdf(self, w: Any) -> Any:
        return self.image.pdf(w)

    @classmethod
    def studio(cls, sun: ArrayLike = (-0.8, -0.7, 0.8), height: int = 256) -> Self:
        """A made-up place to judge materials in, (H, 2H, 3): what `gonio render` lights with by default.

        A small warm sun for highlights, a window and a light strip for the shape of reflections, a sky with hills
        and a tiled floor for mirrors; `_studio.py` has the formulas. Everything turns with the azimuth of `sun`, a
        direction; by default the sun is on the left, behind a camera that looks along +y.

        The largest irradiance on any plane is pi in the strongest channel, so that no Lambertian surface exceeds
        radiance 1. Brightest pixel over mean radiance: about @@. Below 128 rows the sun is smaller than 3 pixels.
        """
        axis = np.asarray(sun, dtype=float)
        if axis.shape != (3,) or not np.all(np.isfinite(axis)) or not axis.any():
            raise ParameterError(
                f"studio: sun={sun!r:.60}, expected a direction, three numbers such as (1, 0, 1)"
            )
        return cls(studio_pixels(axis / np.linalg.norm(axis), height))

    @classmethod
    def from_mitsuba(cls, image: Any, height: int | None = None, scale: Any = 1.0) -> Self:
        """The light of a picture that Mitsuba 3's `envmap` shows, as under `to_world=MITSUBA_TO_WORLD`.

        Also the way to read a photographed panorama, up in its upper rows, without mirroring the place: its left
        edge is then seen along +x, and what lies to the right of it along -y.

        `height`: rows; without it, as many as the picture has. Mitsuba's rows reach from pole to pole, so that pixel
        centres lie between them: what they hold is interpolated. Exact, with their height, for pictures of
        `to_mitsuba`.
        """
        return cls(from_mitsuba(Panorama.of(image), height), scale)

    def to_mitsuba(self) -> Image:
        """A picture (2H + 1, W, C) for Mitsuba 3's `envmap` with `to_world=EnvironmentLight.MITSUBA_TO_WORLD`.

        Mitsuba's world is then this one (z up), and so is its radiance, to rounding: @@ of the
        largest neighbour in its single precision. C is to be 1 or 3. Only at exactly -z does Mitsuba (up to 3.9) show the upper pole.
        """
        return self._picture(to_mitsuba(self.image))

    @classmethod
    def from_pbrt(cls, image: Any, height: int | None = None, scale: Any = 1.0) -> Self:
        """The light of a square picture in pbrt-v4's equal-area layout, (H, 2H, C); pbrt's light axes become x, y, z.

        `height`: H; without it, sqrt(pi)/2 times the rows of the square. Pixels are means over their solid angle.
        """
        return cls(from_pbrt(Panorama.of(image), height), scale)

    def to_pbrt(self, size: int | None = None) -> Image:
        """A square picture (N, N, C) for pbrt-v4's infinite light, in its equal-area layout.

        x, y, z become pbrt's light axes; its world is left-handed, so that it shows gonio's in a mirror unless the
        scene begins with `Scale -1 1 1`. `size`: N; without it, 2H/sqrt(pi), texels as large as pixels at the
        equator. A texel holds the mean over its solid angle: the total flux is kept to @@.
        """
        return self._picture(to_pbrt(self.image, size))

    def _picture(self, pixels: NDArray[Any]) -> Image:
        return Image((pixels * np.asarray(self.scale)).astype(np.float32))
