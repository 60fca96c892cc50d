"""Any incident radiance, as a function of direction."""

from __future__ import annotations

from typing import Any

from ..arrays import ops
from ..base.light import ORIGIN, Light
from ..errors import ParameterError, ShapeError
from ..formula.fields import Field
from ..formula.text import shown


class _Callable(Field):
    accepts = "Callable[[Any], Any]"

    def check(self, owner: str, value: Any) -> Any:
        if not callable(value):
            raise ParameterError(
                f"{owner}({self.name}={shown(value)}): expected a function L(w) of directions (..., 3)"
            )
        return value


class FunctionLight(Light):
    """Incident radiance given as a function: L(w) of world directions (..., 3), which may depend on anything.

    It is a function of arrays, no formula on components: the same at every position, and integrated by quadrature.

    Looks    `FunctionLight(lambda w: 0.8 * (w[..., 2] > 0.0) * (1.0 + np.sin(8.0 * np.arctan2(w[..., 1], w[...,
             0]))))`: eight stripes down the sky.
    Shapes   L: (..., 3) -> (...), or (..., C) with a channel axis.
    Units    L: W m-2 sr-1.
    Error    that of the integral that uses it; L should be smooth, or use an EnvironmentLight.
    Source   the general L_i of the reflection integral, Szeliski 2.83 (docs/equations.md).

    Example
    >>> sky = gn.FunctionLight(lambda w: 1.0 + w[..., 2])
    >>> up = [0, 0, 1]
    >>> print(gn.reflected_radiance(gn.Lambertian(0.5), sky, up, normal=up).round(3))
    0.833
    """

    L: Any = _Callable(None, "radiance of world directions")

    def incident(self, w: Any, position: Any = ORIGIN) -> Any:
        value = ops.library(w).convert(ops.plain(self.L(w)), w)
        if value.shape == w.shape[:-1]:
            return value[..., None]
        if value.ndim == w.ndim and value.shape[:-1] == w.shape[:-1]:
            return value
        raise ShapeError(
            f"FunctionLight: L returned shape {tuple(value.shape)} for directions {tuple(w.shape)}; expected "
            f"{tuple(w.shape[:-1])} or that with a channel axis"
        )
