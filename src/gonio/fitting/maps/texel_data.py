"""`gn.reconstruction.texel_data`: pixels of images under known lights as f at local directions, for a fit at every
texel."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...base.angles import check_unit
from ...base.frames import to_local
from ...base.light import Light
from ...declared.arguments import checked
from ...declared.notebooks import repr_html
from ...errors import ParameterError, ShapeError
from ...formula.direction import HORIZON
from ..samples import real
from .lit_images import LitImages


@dataclass(frozen=True, eq=False)
class TexelData:
    """What K images say about the texels (...) of a surface, of which normals and lights are known.

    wi     (..., K, 3) directions to the lights, local
    wo     (..., 1, 3) directions to the camera, local
    f      (..., K), or (..., K, C) with channels [1/sr]; NaN where a value does not count
    u      as f: standard uncertainties, or None

    Example
    >>> lamps = [gn.DistantLight(gn.direction(0.3, 0.0)), gn.DistantLight(gn.direction(1.8, 0.0))]
    >>> seen = gn.reconstruction.texel_data(np.full((2, 1, 1), 0.1), lamps, [0, 0, 1], normal=[0, 0, 1])
    >>> print(seen.f.round(3))  # one is below
    [[[0.105   nan]]]
    """

    _repr_html_ = repr_html

    wi: np.ndarray
    wo: np.ndarray
    f: np.ndarray
    u: np.ndarray | None
    _coloured: bool = field(repr=False)


class TexelValues(NamedTuple):
    """Values of a map at directions, with uncertainties or None; whether their last axis is that of channels."""

    wi: Any
    wo: Any
    f: Any
    u: Any = None
    coloured: bool | None = None

    @classmethod
    def of(cls, data: Any, coloured: bool | None = None) -> TexelValues:
        """Those that the caller of a fit gave: texel data, (wi, wo, f) or (wi, wo, f, u)."""
        if isinstance(data, TexelData):
            return cls(data.wi, data.wo, data.f, data.u, data._coloured)
        if not isinstance(data, tuple) or len(data) not in (3, 4):
            number = f" of {len(data)}" if isinstance(data, (tuple, list)) else ""
            raise ParameterError(
                f"data: got a {type(data).__name__}{number}; expected (wi, wo, f), (wi, wo, f, u) or what "
                f"gn.reconstruction.texel_data makes"
            )
        return cls(*data)._replace(coloured=coloured)

    @property
    def usual_loss(self) -> str:
        """The loss where none is asked for, as of `gn.fit`."""
        return "cosine" if self.u is None else "likelihood"


@checked
def texel_data(
    images: Any,
    lights: Light | Iterable[Light],
    wo: Any,
    *,
    normal: Any,
    tangent: Any = None,
    position: Any = None,
    mask: Any = None,
    saturation: float | None = None,
    shadow: float = 0.0,
    u: Any = None,
    coloured: bool | None = None,
) -> TexelData:
    """Pixels of K images under K known lights as f = L/(E cos theta_i) at local directions, ready for a fit.

    `wo`: to the camera, in the world; of a camera that is near gn.directions.normalize(camera.eye - position).
    `normal`: of a depth map or a mesh, or those that `photometric_stereo` found; texels where it is NaN are left out.
    `tangent`: d_x, for models that are anisotropic; without it the world's x axis turned with the normal.
    The others: as of `photometric_stereo`. Lights below the surface are left out.

    Shapes   images: (K, ...) or (K, ..., C); wo, normal, tangent, position: (3,) or (..., 3) in the world.
    Units    images: W m-2 sr-1, in the units of the lights; position: m; f and u of the result: 1/sr.
    Error    rounding. An error of the normal changes cos theta_i, the more the more grazing the light.
    Source   definition of f.

    Example
    >>> lamps = [gn.DistantLight(gn.direction(0.5, phi), irradiance=2.0) for phi in (0.0, 1.6, 3.2, 4.8)]
    >>> up, normal = [0.0, 0.0, 1.0], gn.direction([[0.1, 0.3]], [[1.0, 2.0]])  # an image of two pixels
    >>> paint = gn.Lambertian(0.4) + gn.Microfacet(gn.GGX(0.4), gn.Schlick(0.04))
    >>> images = [gn.reflected_radiance(paint, lamp, up, normal=normal) for lamp in lamps]
    >>> seen = gn.reconstruction.texel_data(images, lamps, up, normal=normal)
    >>> print(np.allclose(seen.f, paint.f(seen.wi, seen.wo)))
    True
    """
    data = LitImages.of(images, lights, position, mask, saturation, shadow, u, coloured, normal)
    normal, wo = (_vectors(name, x, data.shape) for name, x in (("normal", normal), ("wo", wo)))
    check_unit("wo", wo)
    known = ~(np.isnan(normal) | np.isnan(wo)).any(axis=-1)
    normal, wo = (np.where(known[:, None], w, [0.0, 0.0, 1.0])[:, None] for w in (normal, wo))
    if tangent is not None:
        tangent = np.where(known[:, None], _vectors("tangent", tangent, data.shape), [1.0, 0.0, 0.0])[:, None]
    block = data.block(slice(None))
    count = len(data), len(block.counts)
    with np.errstate(over="ignore", invalid="ignore"):
        wi = to_local(np.broadcast_to(np.moveaxis(block.w, 2, 0), (*count, 3)), normal, tangent)
        wo = to_local(wo, normal, tangent)
    cosines = wi[..., 2].T
    counts = block.counts & known & (cosines > HORIZON)
    scale = np.where(counts, block.E * cosines, np.nan)
    f = block.L / np.where(scale > 0.0, scale, np.nan)

    def by_texel(x: np.ndarray) -> np.ndarray:
        x = np.broadcast_to(x, f.shape).T
        return np.ascontiguousarray(x if data.coloured else x[..., 0]).reshape(
            *data.shape, *x.shape[1 : 2 + data.coloured]
        )

    with np.errstate(invalid="ignore"):
        spread = None if block.u is None else by_texel(np.where(np.isfinite(f), block.u / np.abs(scale), 1.0))
    wi, wo = wi.reshape(*data.shape, count[1], 3), wo.reshape(*data.shape, 1, 3)
    return TexelData(wi, wo, by_texel(f), spread, data.coloured)


def _vectors(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """World vectors (N, 3)."""
    found = real(name, values)
    if np.isinf(found).any():
        raise ParameterError(f"{name}: got infinite components; expected vectors in the world, NaN where none is known")
    try:
        return np.broadcast_to(found, (*shape, 3)).reshape(-1, 3)
    except ValueError:
        raise ShapeError(f"{name}: got shape {found.shape}; expected (3,) or {(*shape, 3)}, as the images") from None
