"""Pictures as functions of numbers, for libraries that differentiate: which numbers, the picture, its derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..errors import ParameterError
from ..formula import tree
from ..formula.parametrised import Parametrised
from ..formula.texture import Texture
from ..integrals.illumination import as_lights
from ..scenes.jacobian import JacobianJob, derived
from ..scenes.rendering import colours_of, lights_of, render

T = TypeVar("T", bound=Parametrised)


class Pictures:
    """Pictures of a material under lights as a function of those of their numbers that are arrays of a library.

    `numbers`: these arrays, by paths such as "distribution.alpha_x" and "lights.0.scale". `is_array`: whether a number
    is an array of the library; `is_derived`: whether the library derives by it; `to_numpy`: NumPy's array of one.
    `settings`: what else `gn.render` makes a picture by.
    """

    def __init__(
        self,
        m: Reflectance,
        lights: Light | Iterable[Light] | None,
        is_array: Callable[[Any], bool],
        is_derived: Callable[[Any], bool],
        to_numpy: Callable[[Any], Any],
        settings: dict[str, Any],
    ):
        self.settings = settings
        self.numbers: dict[str, Any] = {}

        def plain(of: T, prefix: str) -> T:
            """The same with NumPy's numbers alone: 1 for those that vary."""
            changes: dict[str, Any] = {}
            for path, p in of.parameters.items():
                value = p.value
                if isinstance(value, Texture) and is_derived(value.texels):
                    rule = "a picture has no derivative by all of its texels; expected plain ones"
                    raise ParameterError(f"render: {prefix}{path} is a texture, and {rule}; m.f(wi, wo, uv=uv) has one")
                if isinstance(value, Texture) and is_array(value.texels):
                    changes[path] = value.with_texels(to_numpy(value.texels))
                elif is_array(value):
                    self.numbers[prefix + path] = value
                    changes[path] = _number(np.ones(tuple(value.shape)))
            return tree.with_values(of, changes) if changes else of

        self._m = plain(m, "")
        sources = None if lights is None else as_lights(lights)
        self._lights = sources and [plain(x, f"lights.{i}.") for i, x in enumerate(sources)]

    def at(self, values: Sequence[Any]) -> tuple[Reflectance, list[Light] | None]:
        """The material and its lights with these for `numbers`. Raises ParameterError outside their bounds."""
        by_path = {path: _number(value) for path, value in zip(self.numbers, values, strict=True)}
        m = self._m.replace({path: x for path, x in by_path.items() if not path.startswith("lights.")})
        if self._lights is None:
            return m, None
        lights = []
        for i, light in enumerate(self._lights):
            prefix = f"lights.{i}."
            lights.append(
                light.replace({k.removeprefix(prefix): x for k, x in by_path.items() if k.startswith(prefix)})
            )
        return m, lights

    @property
    def matrix(self) -> np.ndarray | None:
        """The matrix (M, C) that makes the picture's channels of the material's; None where these are the same."""
        lights, by_power = lights_of(self._m, self._lights, self.settings["channels"])
        before, after = colours_of(self._m, lights, self.settings["channels"], by_power)
        return after if before is None else before

    def picture(self, values: Sequence[Any]) -> np.ndarray:
        """The picture (H, W, C)."""
        m, lights = self.at(values)
        pixels: np.ndarray = render(m, lights, **self.settings).pixels
        return pixels

    def slopes(self, values: Sequence[Any] | None, by: Sequence[int]) -> JacobianJob:
        """The picture to be computed with its derivatives by some of `numbers`. None: of any values, to see what shape
        it has."""
        m, lights = (self._m, self._lights) if values is None else self.at(values)
        paths = [*self.numbers]
        return derived(m, lights, [paths[i] for i in by], who="render", **self.settings)


def _number(value: Any) -> Any:
    value = np.asarray(value, dtype=float)
    return value if value.ndim else float(value)
