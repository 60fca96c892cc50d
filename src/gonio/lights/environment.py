"""Light from everywhere, as a picture of the whole sphere: an environment map."""

from __future__ import annotations

from typing import Any, ClassVar

from .. import ops
from ..light import Light
from ..param import Field, option, param
from ._panorama import Panorama


class _Picture(Field):
    def check(self, owner, value):
        return Panorama.of(value)


class EnvironmentLight(Light):
    image = _Picture(None, "equirectangular picture")
    scale = param(1.0, 0.0, 1e30, "factor on the pixels")
    invalid = option("error", "zero", doc="what to do")
    can_sample: ClassVar[bool] = True

    def validate(self):
        self.__dict__["image"] = self.image.checked(self.invalid == "zero")

    def radiance(self, w: Any) -> Any:
        return self.image.radiance(w) * ops.library(w).convert(self.scale, w)

    def sample(self, u):
        return self.image.sample(u)

    def pdf(self, w):
        return self.image.pdf(w)
