"""Two pictures compared: their signed difference, and its numbers."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..declared.arguments import checked
from ..declared.notebooks import repr_html
from ..errors import ParameterError, ShapeError
from .colour import LUMINANCE
from .image import Image

RGB = ("R", "G", "B")


class PictureDifference(NamedTuple):
    """The difference of two pictures, b - a: see `difference`.

    `pixels` (H, W, C), signed, of pictures over black; `inside` (H, W): pixels that something is seen in, in either.
    The numbers are of these: `brighter` is the luminance of b over that of a, less 1 (of pictures that are not RGB: the
    mean of the channels); `bias` (C,) the same of each channel; `rms` the root mean square over all channels, over the
    mean of a; `largest` the largest absolute difference, over the same mean, and `place` its row and column; `sigmas`
    the root mean square of differences in units of their standard error, about 1 where there is nothing but noise, or
    None where a picture does not know its own.

    Example
    >>> a, b = (gn.scenes.Image(np.full((4, 4, 3), level)) for level in (0.5, 0.55))
    >>> print(gn.scenes.picture_difference(a, b))
    b is 10.0 % brighter than a; rms 10.0 %, largest 10.0 % of the mean (row 0, column 0)
    """

    a: Image
    b: Image
    pixels: NDArray[np.float32]
    inside: NDArray[np.bool_]
    brighter: float
    bias: NDArray[np.float64]
    rms: float
    largest: float
    place: tuple[int, int]
    sigmas: float | None

    def __repr__(self) -> str:
        return self.told()

    def told(self, a: str = "a", b: str = "b") -> str:
        """The numbers in a line, of pictures of these names.

        Example
        >>> a, b = (gn.scenes.Image(np.full((4, 4, 3), level)) for level in (0.5, 0.55))
        >>> print(gn.scenes.picture_difference(a, b).told("before", "after")[:27])
        after is 10.0 % brighter th
        """
        word = "brighter" if self.brighter >= 0.0 else "darker"
        each = ""
        if np.ptp(self.bias) > 5e-4:
            names = self.channels if self.channels else [""] * len(self.bias)
            listed = ", ".join(f"{name} {100.0 * x:+.1f}".strip() for name, x in zip(names, self.bias, strict=True))
            each = f" by {self.measure}" + (f" ({listed} %)" if len(self.bias) < 9 else "")
        noise = "" if self.sigmas is None else f"; {self.sigmas:.2f} standard errors"
        where = "row {}, column {}".format(*self.place)
        sizes = f"rms {100.0 * self.rms:.1f} %, largest {100.0 * self.largest:.1f} % of the mean ({where})"
        return f"{b} is {100.0 * abs(self.brighter):.1f} % {word} than {a}{each}; {sizes}{noise}"

    @property
    def channels(self) -> tuple[str, ...] | None:
        """The names of the channels, if they are known: R, G and B of three without names.

        Example
        >>> a, b = (gn.scenes.Image(np.full((4, 4, 3), level)) for level in (0.5, 0.55))
        >>> print(gn.scenes.picture_difference(a, b).channels)
        ('R', 'G', 'B')
        """
        count = len(self.bias)
        names = next((x.channels for x in (self.a, self.b) if x.channels and len(x.channels) == count), None)
        return names or (RGB if count == 3 else None)

    @property
    def measure(self) -> str:
        """What `brighter` compares: "luminance", or "the mean of the channels".

        Example
        >>> a, b = (gn.scenes.Image(np.full((4, 4, 3), level)) for level in (0.5, 0.55))
        >>> print(gn.scenes.picture_difference(a, b).measure)
        luminance
        """
        return "luminance" if self.channels == RGB else "the mean of the channels"

    def of_one_number(self) -> NDArray[np.float32]:
        """The difference (H, W) of what `brighter` compares.

        Example
        >>> a, b = (gn.scenes.Image(np.full((4, 4, 3), level)) for level in (0.5, 0.55))
        >>> print(gn.scenes.picture_difference(a, b).of_one_number()[0, 0].round(3))
        0.05
        """
        return (self.pixels @ _weights(self.channels, len(self.bias))).astype(np.float32)

    def _repr_html_(self) -> str | None:
        return repr_html(self)


@checked
def picture_difference(a: Image, b: Image) -> PictureDifference:
    """The signed difference b - a of two pictures, with its numbers.

    Pictures with coverage count as over black, and the numbers are of pixels that one of them covers. A picture of one
    channel stands for gray.

    Shapes   pictures of one size, with as many channels, or one.
    Units    `pixels` as the pictures; `bias`, `rms` and `largest` are shares of the mean of a.
    Errors   ShapeError; ParameterError for a picture a that is black, or holds NaN.

    `gn.figures.difference` draws it.

    Example
    >>> m, sky = gn.Lambertian([0.8, 0.4, 0.2]), gn.ConstantLight(1.0)
    >>> a, b = (gn.render(each, sky, size=32) for each in (m, m.replace(rho=[0.8, 0.44, 0.2])))
    >>> found = gn.scenes.picture_difference(a, b)
    >>> print(found.bias.round(3), round(found.rms, 2))
    [0.  0.1 0. ] 0.05
    """
    one, other = (picture.light.astype(float) for picture in (a, b))
    if one.shape[:2] != other.shape[:2]:
        raise ShapeError(f"pictures are {one.shape[:2]} and {other.shape[:2]}, expected one size (rows, columns)")
    if one.shape[2] != other.shape[2] and 1 not in (one.shape[2], other.shape[2]):
        raise ShapeError(f"pictures have {one.shape[2]} and {other.shape[2]} channels, expected as many, or one")
    pixels = (other - one).astype(np.float32)
    inside = _covered(a) | _covered(b)
    if not inside.any():
        raise ParameterError("both pictures are transparent throughout; expected something to compare")
    if not np.isfinite(pixels[inside]).all():
        raise ParameterError("a picture holds NaN or infinity; expected numbers: np.nan_to_num(picture.pixels)")
    if a.channels and b.channels and len(a.channels) == len(b.channels) and a.channels != b.channels:
        names = f"{', '.join(a.channels):.80}, and {', '.join(b.channels):.80}"
        raise ParameterError(f"channels are {names}; expected the same of both: Image(b.pixels[..., order], b.alpha)")
    means = [x[inside].mean(axis=0) for x in (one, other)]
    level = float(means[0].mean())
    if not (means[0] > 0.0).all():
        raise ParameterError("the first picture is black in a channel; expected one to compare with: exchange the two")
    size = np.abs(pixels).max(axis=-1)
    row, column = divmod(int(np.argmax(np.where(inside, size, -1.0))), size.shape[1])
    rms = math.sqrt(float(np.square(pixels[inside]).mean())) / level
    largest = float(size[row, column]) / level
    bias = means[1] / means[0] - 1.0
    found = PictureDifference(
        a, b, pixels, inside, 0.0, bias, rms, largest, (row, column), _sigmas(a, b, pixels, inside)
    )
    weights = _weights(found.channels, len(bias)) * means[0]
    return found._replace(brighter=float(weights @ bias / weights.sum()))


def _weights(channels: tuple[str, ...] | None, count: int) -> NDArray[np.float64]:
    """What channels count in the number by which pictures are brighter."""
    return LUMINANCE if channels == RGB else np.full(count, 1.0 / count)


def _covered(picture: Image) -> NDArray[np.bool_]:
    """Where something is seen: of a flame it is light alone."""
    if picture.alpha is None:
        return np.ones(picture.pixels.shape[:2], bool)
    covered: NDArray[np.bool_] = (picture.alpha > 0.0) | (picture.light != 0.0).any(axis=-1)
    return covered


def _sigmas(a: Image, b: Image, pixels: Any, inside: Any) -> float | None:
    if a.error is None or b.error is None:
        return None
    noises = (Image(x.error, x.alpha, premultiplied=x.premultiplied) for x in (a, b) if x.error is not None)
    variance = sum((np.square(noise.light.astype(float)) for noise in noises), 0.0)
    noisy = inside[..., None] & (variance > 0.0)
    if not noisy.any():
        return None
    return math.sqrt(float(np.mean(np.square(pixels[noisy]) / np.broadcast_to(variance, pixels.shape)[noisy])))
