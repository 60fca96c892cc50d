"""Images under known lights, one for each: what a caller gave, checked, and which values of it count."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...base.light import FAR, Light
from ...declared.notebooks import repr_html
from ...declared.numbers import numbers
from ...errors import ArrayTypeError, ParameterError, ShapeError, shown
from ...integrals.illumination import as_lights
from ...pictures.image import Image
from ..samples import real


@dataclass(frozen=True, eq=False)
class LitImages:
    """K images of N texels under K lights.

    values     (K, N, C) radiance [W m-2 sr-1], of any float type
    u          standard uncertainties that broadcast with the values, or None
    lights     K delta lights
    position   (N, 3) places of the texels [m], or None, under light from far away
    inside     (N,) or (K, N) where values count, or None
    saturation, shadow   values from and up to which do not
    shape      of the map; coloured: whether it has a channel axis
    """

    _repr_html_ = repr_html

    values: np.ndarray
    u: np.ndarray | None
    lights: Sequence[Light]
    position: np.ndarray | None
    inside: np.ndarray | None
    saturation: float
    shadow: float
    shape: tuple[int, ...]
    coloured: bool

    @classmethod
    def of(
        cls,
        images: Any,
        lights: Any,
        position: Any,
        mask: Any,
        saturation: float | None,
        shadow: float,
        u: Any,
        coloured: bool | None,
        normal: Any = None,
    ) -> LitImages:
        """Raises Error for images, lights and places that do not fit together."""
        lights = _lights(lights)
        values, coverage, coloured = _values(images, coloured, _told(mask, position, normal))
        if len(values) != len(lights):
            last = "; of images (H, W, K) np.moveaxis(images, -1, 0)" if values.shape[-1] == len(lights) else ""
            raise ShapeError(
                f"images: got {len(values)} along the first axis, of shape {values.shape}; expected {len(lights)}, "
                f"one for each light{last}"
            )
        shape = values.shape[1:-1] if coloured else values.shape[1:]
        channels = values.shape[-1] if coloured else 1
        if not values.size:
            raise ShapeError(f"images: got shape {values.shape}; expected at least one texel")
        if mask is None and coverage is not None:
            mask = coverage > 0.0
        if saturation is not None and not saturation > max(shadow, 0.0):
            raise ParameterError(
                f"saturation={saturation:g}, shadow={shadow:g}: expected a saturation above both 0 and it"
            )
        for light in lights:
            if (count := light.arrival(np.zeros((1, 3)) + 1e-3 * math.pi).irradiance.shape[-1]) not in (1, channels):
                several = f"1 or {channels}, as the images" if coloured else "1: the images have no channel axis"
                raise ShapeError(f"lights: {type(light).__name__} has {count} channels; expected {several}")
        texels = math.prod(shape)
        return cls(
            values.reshape(len(values), texels, channels),
            None if u is None else _spread(u, values.shape, coloured),
            lights,
            _positions(position, shape, lights),
            None if mask is None else _inside(mask, len(values), shape),
            math.inf if saturation is None else saturation,
            shadow,
            shape,
            coloured,
        )

    def __len__(self) -> int:
        return self.values.shape[1]

    def block(self, texels: slice) -> LitTexels:
        """Some texels, with what the lights send there."""
        L = np.ascontiguousarray(np.moveaxis(self.values[:, texels], 2, 0), dtype=float)
        with np.errstate(invalid="ignore"):
            counts = (L.max(axis=0) > self.shadow) & (L.max(axis=0) < self.saturation)  # NaN does not
        if self.inside is not None:
            counts &= self.inside[..., texels]
        u = self.u if self.u is None or self.u.shape[1] == 1 else self.u[:, texels]
        w, E = self._far if self.position is None else self._arrivals(self.position[texels])
        if self.position is not None and not np.isfinite(E).all():
            reached = np.isfinite(E).all(axis=0)
            counts &= reached
            w, E = np.where(reached[:, None], w, 0.0), np.where(reached, E, 0.0)
        return LitTexels(np.where(counts, L, 0.0), None if u is None else np.moveaxis(u, 2, 0), counts, w, E)

    @cached_property
    def _far(self) -> tuple[np.ndarray, np.ndarray]:
        """What lights send to all texels, from far away."""
        return self._arrivals(np.zeros((1, 3)))

    def _arrivals(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `LitTexels`, for places (T, 3)."""
        arrivals = [light.arrival(places) for light in self.lights]
        width = max(x.irradiance.shape[-1] for x in arrivals)
        E = np.stack([np.broadcast_to(x.irradiance, (len(places), width)).T for x in arrivals], axis=1)
        return np.stack([np.broadcast_to(x.w, places.shape).T for x in arrivals]), E


@dataclass(frozen=True, eq=False)
class LitTexels:
    """Values L (C, K, T), 0 where they do not count; u that broadcasts with them, or None; which count (K, T);
    directions to the lights w (K, 3, T or 1); irradiances E (C or 1, K, T or 1) of planes that face them."""

    L: np.ndarray
    u: np.ndarray | None
    counts: np.ndarray
    w: np.ndarray
    E: np.ndarray


def _lights(lights: Any) -> list[Light]:
    listed = [light.in_numpy() for light in as_lights(lights)]
    for light in listed:
        if not light.is_delta:
            rule = "its light comes from many directions; expected small sources: DistantLight, PointLight"
            raise ParameterError(f"lights: {light!r:.80}: {rule}")
        if light.has_spectra:
            raise ParameterError(
                f"lights: {light!r:.80} has a spectrum; expected one number for each channel of the images"
            )
    return listed


def _told(mask: Any, *vectors: Any) -> list[tuple[int, ...]]:
    """Shapes that the map may have, by arrays with its axes."""
    shapes = [shape if isinstance(shape := getattr(x, "shape", ()), tuple) else () for x in (mask, *vectors)]
    return [tuple(shapes[0]), *(tuple(shape[:-1]) for shape in shapes[1:])]


def _values(
    images: Any, coloured: bool | None, told: Sequence[tuple[int, ...]]
) -> tuple[np.ndarray, np.ndarray | None, bool]:
    """The values (K, ...) or (K, ..., C), the coverage (K, H, W) of pictures, and whether there is a channel axis."""
    several = list(images) if isinstance(images, (list, tuple)) else []
    if isinstance(images, Image):
        raise ShapeError("images: got one image; expected a list of them, one for each light")
    if any(isinstance(x, Image) for x in several):
        return _of_pictures(several, coloured)
    values = _floats(images)
    if coloured is None:
        by_shape = values.ndim == 3 and values.shape[1:-1] in told
        if values.ndim == 3 and values.shape[-1] == 3 and not by_shape and values.shape[1:] not in told:
            raise ShapeError(
                f"images: got shape {values.shape}: the last axis may be that of pixels or of channels; expected "
                f"coloured=True or coloured=False beside it"
            )
        coloured = values.ndim > 3 or by_shape
    if values.ndim < 2 + coloured:
        raise ShapeError(f"images: got shape {values.shape}; expected (K, H, W) or (K, H, W, C), K images")
    return values, None, coloured


def _of_pictures(images: list[Any], coloured: bool | None) -> tuple[np.ndarray, np.ndarray | None, bool]:
    if not all(isinstance(x, Image) for x in images):
        raise ArrayTypeError(
            "images: got pictures and other things; expected gn.scenes.Image each, or one array (K, H, W)"
        )
    shapes = {x.pixels.shape for x in images}
    if len(shapes) > 1:
        raise ShapeError(f"images: got shapes {shown(sorted(shapes))}; expected images of one shape")
    pixels = np.stack([x.light for x in images])
    covered = [np.ones(pixels.shape[1:3]) if x.alpha is None else x.alpha for x in images]
    several = pixels.shape[-1] > 1 if coloured is None else coloured
    if not several and pixels.shape[-1] > 1:
        raise ShapeError(f"images: got {pixels.shape[-1]} channels; expected coloured=True, or images of one channel")
    coverage = None if all(x.alpha is None for x in images) else np.stack(covered)
    return pixels if several else pixels[..., 0], coverage, several


def _floats(images: Any) -> np.ndarray:
    try:
        values = numbers(images)
    except ValueError as error:
        raise ParameterError(
            f"images: {error}; expected linear radiance (K, H, W), or pictures gn.scenes.Image"
        ) from None
    if values.dtype.kind in "ub" or (values.dtype.kind == "i" and values.dtype.itemsize < 8):
        raise ArrayTypeError(
            f"images: got {values.dtype}, codes of a file; expected linear radiance: gn.scenes.load_image(path), or "
            f"images / 65535 of linear values of a raw file"
        )
    return values if values.dtype in (np.float32, np.float64) else values.astype(float)


def _positions(position: Any, shape: tuple[int, ...], lights: Sequence[Light]) -> np.ndarray | None:
    near = next((x for x in lights if x.arrival(np.full((1, 3), 1e-3)).distance[0] < FAR), None)
    if position is None:
        if near is not None:
            raise ParameterError(
                f"position: got none, and {type(near).__name__} is near; expected where each texel is, {(*shape, 3)} "
                f"[m]; of a flat thing a plane"
            )
        return None
    places = np.ascontiguousarray(real("position", position))
    try:
        places = np.broadcast_to(places, (*shape, 3)).reshape(-1, 3)
    except ValueError:
        raise ShapeError(f"position: got shape {places.shape}; expected {(*shape, 3)}, as the images") from None
    if np.isinf(places).any():
        raise ParameterError("position: got infinite places; expected metres, NaN where nothing is known")
    for light in lights:
        light.check_position(places)
    return None if near is None else places


def _inside(mask: Any, count: int, shape: tuple[int, ...]) -> np.ndarray:
    """Where values count: (N,) or (K, N)."""
    try:
        array = numbers(mask)
    except ValueError as error:
        raise ParameterError(f"mask: {error}; expected True where a value is used, False elsewhere") from None
    if array.dtype != bool:
        raise ParameterError(f"mask: got {array.dtype}; expected True where a value is used, False elsewhere")
    if array.shape == shape:
        return array.reshape(-1)
    if array.shape == (count, *shape):
        return array.reshape(count, -1)
    raise ShapeError(f"mask: got shape {array.shape}; expected {shape}, or {(count, *shape)} for each image")


def _spread(u: Any, shape: tuple[int, ...], coloured: bool) -> np.ndarray:
    """Standard uncertainties (K, N, C), or (1, 1, 1)."""
    array = real("u", u)
    if not (array > 0.0).all() or np.isinf(array).any():
        raise ParameterError("u: expected standard uncertainties above 0, in the unit of the images")
    if array.size == 1:
        return array.reshape(1, 1, 1)
    try:
        array = np.broadcast_to(array, shape)
    except ValueError:
        raise ShapeError(
            f"u: got shape {array.shape}; expected a number, or the shape of the images, {shape}"
        ) from None
    array = array if coloured else array[..., None]
    return array.reshape(shape[0], -1, array.shape[-1])
