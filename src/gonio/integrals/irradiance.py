"""Irradiance of a surface under lights: in closed form where there is one."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from ..arrays import ops
from ..base.frames import vectors
from ..base.light import Light
from ..declared.arguments import checked
from ..errors import DirectionError
from ..models.lambertian import Lambertian
from .illumination import as_lights, have_channels, reflected_radiance


@checked
def irradiance(
    lights: Light | Iterable[Light],
    position: Any = (0.0, 0.0, 0.0),
    normal: Any = (0.0, 0.0, 1.0),
    samples: int = 4096,
    tolerance: float = 1e-4,
) -> Any:
    r"""Irradiance of a surface: $E = \int L(\omega) \max(\cos\theta, 0) \, d\omega$, without occlusion.

    In closed form for delta lights, rectangles, polygons, disks, spheres, the sun's disk and constant light, at any
    height of the horizon; else pi times the radiance that white paint reflects.

    Shapes   position, normal: (..., 3), normals of any length; result (..., C), or (...) where no light has channels.
             NumPy, PyTorch or JAX arrays, differentiable in these.
    Units    W m-2; position: m.
    Errors   ParameterError for positions in or on a light.
    Error    closed forms: rounding, in float32 1e-6 of L times the angle that a light fills. Others: see
             `reflected_radiance`.
    Source   Lambert 1760 for polygons, see `gonio.formula.projected`.

    Example
    >>> panel = gn.RectangleLight([0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, -2.0, 0.0])
    >>> print(gn.irradiance([panel, gn.PointLight([0.0, 0.0, 2.0], 8.0)]).round(4))  # pi 0.5541 + 2
    3.7408
    """
    listed = as_lights(lights)
    like = next((x for light in listed if (x := light.like()) is not None), None)
    if like is not None and not ops.dtype_of(position):
        position = ops.library(like).vectors(position, like)
    lib, (position, normal) = vectors(position=position, normal=normal)
    known = lib.known(normal)
    if known is not None and not known.any(-1).all():
        raise DirectionError("irradiance: a normal of length 0 has no direction; expected (..., 3) of any other length")
    normal = normal / ops.sqrt((normal * normal).sum(-1))[..., None]
    parts = []
    for light in listed:
        light.check_position(position)
        E = light.irradiance_at(position, normal)
        if E is None:
            position, normal = lib.broadcast(position, normal)
            L = reflected_radiance(_WHITE, light, normal, normal, None, position, samples, tolerance)
            E = math.pi * (L if L.ndim == position.ndim else L[..., None])
        parts.append(E)
    total = sum(parts[1:], parts[0])
    return total if have_channels(listed) or total.shape[-1] > 1 else total[..., 0][()]


_WHITE = Lambertian(1.0)
