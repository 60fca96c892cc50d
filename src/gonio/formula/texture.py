"""Textures: images whose texels are the numbers of a parameter at places (u, v) on a surface."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Fixed, frozen, ops
from ..arrays.kinds import VALUE
from ..arrays.labels import is_lazy, is_named
from ..declared.notebooks import repr_html
from ..errors import AccessError, ArrayTypeError, MeaningWarning, ParameterError, ShapeError, TooLargeError, warn
from .text import shown

FILTERS = ("bilinear", "nearest")
WRAPS = ("repeat", "mirror", "clamp", "refuse")
COLOURS = ("linear", "srgb")
MOST = 1 << 27
"""The most pixels of a file that is read as a texture: 16384 x 8192."""


class Grid(NamedTuple):
    """How texels are looked up: their rows, columns and channels, and what happens between them and outside."""

    rows: int
    columns: int
    channels: int
    filter: str
    wrap: str

    def value(self, entry: Callable[[Any], Any], u: Any, v: Any) -> Any:
        """The value at a place; `entry`: the number of a texel, counted along the rows of `padded` -> its value."""
        row, down = self._before(v, self.rows)
        column, along = self._before(u, self.columns)
        # Rows are scaled as whole numbers: the products would not be exact in float32.
        width = self.columns + 1
        texel = row * width + column
        if self.filter == "nearest":
            return entry(texel) + (along + down)  # NaN where a place is
        a, b, c, d = entry(texel), entry(texel + 1), entry(texel + width), entry(texel + (width + 1))
        a, c = a + along * (b - a), c + along * (d - c)
        return a + down * (c - a)

    def _before(self, x: Any, count: int) -> tuple[Any, Any]:
        """The number of the texel before a place along an axis, and the share of the next one.

        NaN looks up texel 0, and its share is NaN.
        """
        if self.wrap == "repeat":
            x = x - ops.floor(x)
        elif self.wrap == "mirror":
            x = x - 2.0 * ops.floor(0.5 * x)
            x = ops.minimum(x, 2.0 - x)
        elif self.wrap == "clamp":
            x = ops.clip(x, 0.0, 1.0)
        else:
            x = ops.where((x < 0.0) | (x > 1.0), float("nan"), x)
        if self.filter == "nearest":
            return ops.to_index(ops.minimum(ops.floor(x * float(count)), count - 1.0)), x - x
        x = x * float(count) - 0.5
        if self.wrap != "repeat":
            x = ops.clip(x, 0.0, count - 1.0)
        before = ops.floor(x)
        share = x - before
        return ops.to_index(ops.where(before < 0.0, before + float(count), before)), share

    def padded(self, texels: Any, module: Any) -> Any:
        """The texels with a row and a column behind the last, which each texel finds beside and below it: the first
        one again, or the last."""
        edge = slice(0, 1) if self.wrap == "repeat" else slice(-1, None)
        tall = module.concatenate([texels, texels[edge]], 0)
        return module.concatenate([tall, tall[:, edge]], 1)


class Texture:
    """An image as a parameter: its number at a place (u, v) on the surface.

    Any number of a material may be one: `gn.Lambertian(gn.Texture("wood.png"))`. The material has no f until there is a
    place: `m.f(wi, wo, uv=uv)`, or `m.at(uv=uv)`, which is an ordinary material with the numbers at these places.

    (u, v) is (0, 0) at the upper left corner of the image and (1, 1) at the lower right one; the centre of the texel in
    row i and column j of H by W is ((j + 1/2)/W, (i + 1/2)/H).

    `image`: the path of a picture, a `gn.scenes.Image`, or an array; one of PyTorch or JAX is differentiated by its
    texels. `filter`: "bilinear", or "nearest" for the texel itself. `wrap`: what a place outside 0 to 1 stands for:
    "repeat" the image again and again, "mirror" every other one reversed, "clamp" the nearest edge, "refuse" an error.
    `colour`: "linear", the numbers are meant as they are, or "srgb", they are codes of sRGB, to be decoded. Where
    nobody says, .png and .jpg are what they say they are (sRGB, where they say nothing), and everything else is linear:
    for roughness and other data in a .png write colour="linear". Whole numbers are codes, of 8 or 16 bits by their
    type, and need it said. Of pictures with coverage `Image.colour` is taken, not multiplied by it.

    Shapes   image: (H, W, C) or (H, W); C is 1, or the number of the material's channels.
    Units    of the parameter; its bounds hold for every texel.
    Error    of straight lines between texels; of float32 places on wide images, W/2^24 of a texel's width.
    Raises   ParameterError for NaN, infinite texels and unknown words, ShapeError, ArrayTypeError (codes without
             colour=), and what `gn.scenes.load_image` raises: NotFoundError (no such file), FormatError (no picture).
    Source   definition; sRGB: IEC 61966-2-1:1999.

    Example
    >>> chequered = gn.Texture([[0.2, 0.8], [0.8, 0.2]], filter="nearest")
    >>> m = gn.Lambertian(chequered)
    >>> uv = np.array([[0.25, 0.25], [0.75, 0.25]])
    >>> print((np.pi * m.f([0, 0, 1], [0, 0, 1], uv=uv)).round(3).tolist())
    [[0.2], [0.8]]
    >>> print(gn.albedo(m.at(uv=uv), [0, 0, 1]).round(3).tolist())
    [[0.2], [0.8]]
    """

    _repr_html_ = repr_html

    texels: Any
    filter: str
    wrap: str
    path: str | None

    def __init__(self, image: Any, filter: str = "bilinear", wrap: str = "repeat", colour: str | None = None):
        for name, word, words in (("filter", filter, FILTERS), ("wrap", wrap, WRAPS), ("colour", colour, COLOURS)):
            if not (isinstance(word, str) and word in words) and not (name == "colour" and word is None):
                raise ParameterError(f"Texture({name}={shown(word)}): expected one of {', '.join(map(repr, words))}")
        path = os.fspath(image) if isinstance(image, (str, os.PathLike)) else None
        texels = _of_file(path, colour) if path is not None else _of_image(image, colour)
        if isinstance(texels, np.ndarray):
            _require_finite(texels, path)
        self.__setstate__({"texels": texels, "filter": filter, "wrap": wrap, "path": path})

    @property
    def channels(self) -> int:
        """How many numbers a texel has.

        Example
        >>> print(gn.Texture([[0.2, 0.8]]).channels)
        1
        """
        return int(self.texels.shape[2])

    @property
    def grid(self) -> Grid:
        """How it is looked up.

        Example
        >>> print(gn.Texture([[0.2, 0.8]]).grid)
        Grid(rows=1, columns=2, channels=1, filter='bilinear', wrap='repeat')
        """
        rows, columns, channels = map(int, self.texels.shape)
        return Grid(rows, columns, channels, self.filter, self.wrap)

    @property
    def is_fixed(self) -> bool:
        """Whether the texels are NumPy's, so that compiled code looks them up.

        Example
        >>> print(gn.Texture([[0.2, 0.8]]).is_fixed)
        True
        """
        return isinstance(self.texels, np.ndarray)

    def channel(self, number: int) -> Texture:
        """One channel of it, counted from 0, such as roughness in the green of a packed image.

        Example
        >>> print(gn.Texture([[[0.9, 0.2, 0.7]]]).channel(1).at([0.5, 0.5]))
        [0.2]
        """
        if not isinstance(number, (int, np.integer)) or not 0 <= number < self.channels:
            raise ParameterError(f"channel({shown(number)}): expected a whole number from 0 to {self.channels - 1}")
        return self.with_texels(self.texels[:, :, number : number + 1])

    def with_texels(self, texels: Any) -> Texture:
        """A texture of other texels (H, W, C), looked up as this one.

        Example
        >>> rough = gn.Texture([[0.2, 0.4]])
        >>> print(rough.with_texels(0.5 * rough.texels).at([0.25, 0.5]))
        [0.1]
        """
        new = Texture(texels, self.filter, self.wrap)
        object.__setattr__(new, "path", self.path)
        return new

    def at(self, uv: Any) -> Any:
        """The numbers (..., C) at places uv (..., 2), of the array library of these, or of the texels.

        Example
        >>> print(gn.Texture([[0.2, 0.8]]).at([[0.25, 0.5], [0.5, 0.5]]).round(3).tolist())
        [[0.2], [0.5]]
        """
        lib, uv = checked_places(uv, [self])
        batch = tuple(lib.shape(uv)[:-1])
        u, v = lib.split(uv, batch, False)
        if self.is_fixed:
            table = lib.fixed(self.table(), uv)
        elif lib is ops.library_of_type(type(self.texels)):
            table = self.grid.padded(self.texels, lib.module).reshape(-1)
        else:
            rule = f"texels of {type(self.texels).__name__} at places of {lib.name}; expected one library"
            raise ArrayTypeError(f"uv: {rule}, or texels of NumPy")
        with np.errstate(invalid="ignore"):  # of places that are infinite
            values = [self.grid.value(partial(self._entry, table, c), u, v) for c in range(self.channels)]
        if lib.channel_loop:
            return lib.assemble([VALUE], [[value] for value in values], uv, batch, True)[0]
        stacked = lib.module.stack([lib.module.broadcast_to(x, batch) for x in values], -1)
        # Rounding to single precision must not carry a number past the bounds that all texels are within.
        return np.clip(stacked, self.texels.min(), self.texels.max()) if lib.name == "numpy" else stacked

    def _entry(self, table: Any, channel: int, texel: Any) -> Any:
        return ops.take(table, texel * self.channels + channel)

    def table(self, merge: str | None = None) -> Fixed:
        """The texels as lookups have them: padded, see `Grid.padded`, and flat. `merge`: of each texel one number,
        the "mean", "max" or "min" of its channels, which sampling uses.

        Example
        >>> print(gn.Texture([[[0.1, 0.3]]]).table("max").numbers)
        [0.3 0.3 0.3 0.3]
        """
        tables: dict[str | None, Fixed] = self.__dict__["_tables"]
        if merge not in tables:
            texels = self.texels if merge is None else getattr(self.texels, merge)(axis=2, keepdims=True)
            tables[merge] = Fixed(self.grid.padded(texels, np).reshape(-1))
        return tables[merge]

    def outside(self, low: float, high: float) -> str:
        """The first texel out of bounds, in words; "" where all are within, or not to be read (PyTorch, JAX).

        Example
        >>> print(gn.Texture([[0.2, 1.5]]).outside(0.0, 1.0))
        1.5 in row 0, column 1 is out of bounds
        """
        if not self.is_fixed or (self.texels.min() >= low and self.texels.max() <= high):
            return ""
        return f"{_first(self.texels, (self.texels < low) | (self.texels > high))} is out of bounds"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Texture):
            return NotImplemented
        if (self.grid, self.is_fixed) != (other.grid, other.is_fixed):
            return False
        return self.texels is other.texels or bool((self.texels == other.texels).all())

    def __hash__(self) -> int:
        return hash(self.grid)

    def _without_place(self, other: Any) -> Any:
        """No number comes of a texture and a number, or another texture, while the place is unknown."""
        if not isinstance(other, (Texture, int, float, np.ndarray)):
            return NotImplemented
        raise ParameterError(f"{self!r:.80}: no number until there is a place; compute with texture.texels")

    __add__ = __radd__ = __sub__ = __rsub__ = _without_place
    __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __pow__ = _without_place

    def __repr__(self) -> str:
        rows, columns, channels, filter, wrap = self.grid
        origin = "" if self.path is None else f" of {self.path!r}"
        plural = "s" * (channels > 1)
        return f"Texture(<{columns} x {rows}, {channels} channel{plural}{origin}>, {filter!r}, {wrap!r})"

    def __setattr__(self, name: str, value: Any) -> None:
        raise AccessError("a Texture is a value and cannot be changed; make a new one")

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_tables"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        frozen(state["texels"])
        for name, value in {**state, "_tables": {}}.items():
            object.__setattr__(self, name, value)

    def to_json(self) -> dict[str, Any]:
        """The texture as JSON data, with its texels.

        Example
        >>> print(gn.Texture([[0.2, 0.8]]).to_json())
        {'type': 'Texture', 'image': [[[0.2], [0.8]]], 'filter': 'bilinear', 'wrap': 'repeat', 'colour': 'linear'}
        """
        image = ops.to_numpy(self.texels).tolist()
        return {"type": "Texture", "image": image, "filter": self.filter, "wrap": self.wrap, "colour": "linear"}

    __array_ufunc__ = None  # an array times this is not an array of objects


def checked_places(uv: Any, textures: list[Texture]) -> tuple[ops.Library, Any]:
    """The library of places, and the places as one of its arrays. Raises ShapeError and ArrayTypeError, ParameterError
    where they are outside 0 to 1 of a texture that refuses it."""
    if is_named(uv) or is_lazy(uv):
        raise ArrayTypeError(f"uv: got a {type(uv).__name__}; expected a plain array: uv.values, or uv.compute()")
    lib, (places,) = ops.as_arrays(uv, name="uv")
    shape = lib.shape(places)
    if not shape or shape[-1] != 2:
        raise ShapeError(f"uv: got shape {tuple(shape)}, expected (..., 2), the u and v of each place")
    if any(texture.wrap == "refuse" for texture in textures):
        numbers = lib.known(places)
        outside = None if numbers is None else numbers[(numbers < 0.0) | (numbers > 1.0)]
        if outside is not None and outside.size:
            rule = 'expected 0 to 1 of a texture with wrap="refuse"'
            raise ParameterError(f'uv: {outside[0]:g}; {rule}; wrap="repeat", "mirror" or "clamp" takes all')
    return lib, places


def _of_file(path: str, colour: str | None) -> np.ndarray:
    """The texels of a picture file."""
    from ..pictures.image import load_image

    image = load_image(path, MOST, linear=None if colour is None else colour == "linear")
    if image.alpha is not None and image.alpha.min() < 1.0:
        text = f"{path}: the picture has transparent pixels, and a texture leaves its coverage out"
        warn(f"{text}; scale the material by it: gn.Texture(gn.scenes.load_image(path).alpha) * m", MeaningWarning)
    return image.colour


def _of_image(image: Any, colour: str | None) -> Any:
    """The texels (H, W, C) of an array or a picture."""
    from ..pictures.colour import srgb_decode
    from ..pictures.image import Image

    texels = image.colour if isinstance(image, Image) else image
    lib = ops.library_of_type(type(texels))
    if lib is not None and lib.name in ("torch", "jax"):
        if colour == "srgb":
            raise ArrayTypeError(f'Texture(colour="srgb"): {lib.name} texels; expected linear ones, decoded before')
        if not ops.dtype_of(texels).startswith(("float", "bfloat")):
            raise ArrayTypeError(f"Texture: {lib.name} texels of {ops.dtype_of(texels)}; expected floats")
    else:
        texels = _numbers(texels, colour)
        if colour == "srgb":
            texels = srgb_decode(texels)
    shape = tuple(texels.shape)
    if len(shape) not in (2, 3) or 0 in shape:
        raise ShapeError(f"Texture: the image has shape {shape}, expected (H, W, C) or (H, W)")
    return texels if len(shape) == 3 else texels[:, :, None]


def _numbers(image: Any, colour: str | None) -> np.ndarray:
    """An array of floats of what was given; codes over their largest one."""
    if not isinstance(image, (list, tuple, np.ndarray)):
        rule = "expected the path of a picture, a gn.scenes.Image, or an array (H, W, C) of NumPy, PyTorch or JAX"
        raise ParameterError(f"Texture: got a {type(image).__name__}; {rule}")
    if np.ma.isMaskedArray(image) and np.ma.getmaskarray(image).any():
        raise ParameterError("Texture: some texels are masked; expected a number everywhere: image.filled(0.5)")
    try:
        array = np.array(ops.plain(image), order="C")
    except MemoryError:
        raise TooLargeError(f"Texture: there is no memory for an image of shape {np.shape(image)}") from None
    except (TypeError, ValueError, OverflowError) as error:
        raise ParameterError(f"Texture: the image is no (H, W, C) of numbers: {error}") from None
    if array.dtype in (np.uint8, np.uint16):
        if colour is None:
            rule = 'expected colour="srgb" for colours that are to be decoded, or colour="linear" for codes / '
            raise ArrayTypeError(f"Texture: texels are {array.dtype} codes; {rule}{np.iinfo(array.dtype).max}")
        return array.astype(np.float32) / np.float32(np.iinfo(array.dtype).max)
    if isinstance(image, (list, tuple)) and array.dtype.kind in "iu":
        array = array.astype(float)
    if array.dtype.kind != "f":
        rule = "expected floats, or codes as uint8 or uint16"
        raise ArrayTypeError(f"Texture: texels are {array.dtype}; {rule}")
    return array if array.dtype == np.float32 else array.astype(np.float64)


def _require_finite(texels: np.ndarray, path: str | None) -> None:
    bad = ~np.isfinite(texels)
    if bad.any():
        many = f"{bad.any(axis=2).sum()} of {bad.shape[0] * bad.shape[1]} texels"
        rule = "expected a number everywhere; fill them in, such as numpy.nan_to_num(image, nan=0.5)"
        raise ParameterError(f"{path or 'Texture'}: {many} are NaN or infinite, {_first(texels, bad)}; {rule}")


def _first(texels: np.ndarray, bad: np.ndarray) -> str:
    """The first of some texels, in words."""
    row, column, channel = map(int, np.unravel_index(int(bad.argmax()), bad.shape))
    of = f", channel {channel}" if texels.shape[2] > 1 else ""
    return f"{texels[row, column, channel]:g} in row {row}, column {column}{of}"
