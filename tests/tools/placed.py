"""Public functions that take places, found by their signatures, and calls of them in a world that is moved.

How a function is called, `CALLS` says: what is at a place of the world goes through `at`, directions through `to`, and
the light through `lit`.
"""

from __future__ import annotations

import inspect
import re
import warnings
from typing import Any, NamedTuple

import numpy as np
from directed import Refused, numbers
from face import functions
from lit import MATERIALS, made

import gonio as gn

PLACES = re.compile(r"scene|shape|surface|position|camera")
"""Names of arguments that are, or hold, places: a public function with one is in the sweep."""

_FACES = "[[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]"
_CUBES = f"gn.Scene([gn.scenes.Mesh((at(x * cube + y), {_FACES})) for x, y in ((1.0, 0.0), (0.3, [0.8, -0.5, 0.8]))])"
_PICTURE = (
    f"shape={_CUBES}, size=8, samples=4, camera=gn.scenes.Camera(at([1.5, -4.0, 1.5]), target=at([0.0, 0.0, 0.0]))"
)
_ROOM = f"[gn.scenes.Mesh((at(cube), [f[::-1]]), gn.Lambertian(0.5), M) for M, f in enumerate({_FACES})]"
_ALL = "(lambda x: (x.radiosity, x.irradiance, x.balance, x.escaped))"
_HEIGHTS = "at(np.random.default_rng(1).random((16, 16, 1)) * [0.0, 0.0, 1.0])[..., 2]"
_SURFACE = f"gn.surfaces.HeightField({_HEIGHTS}, (size, size))"

CALLS = {
    "gonioreflectometer": f"gn.gonioreflectometer({_SURFACE}, 0.5, 0.3, 0.0, (6, 8), 1.0, rays=1024).stored",
    "irradiance": "gn.irradiance(lit(a), at(p), to(n))",
    "reconstruction.texel_data": "gn.reconstruction.texel_data("
    "[0.05 + 0.0 * p[:, 0]], lit(a), to(n), normal=to(n), position=at(p)).f",
    "reconstruction.photometric_stereo": "(lambda x: (x.albedo, x.normal @ R(-angle)))("
    "gn.reconstruction.photometric_stereo("
    "np.full((3, 5), 0.05), [lit(gn.TurnedLight(a, t)) for t in (0.0, 2.0, 4.0)], position=at(p)))",
    "scenes.picture_jacobian": f"gn.scenes.picture_jacobian(m, lit(a), '0.rho', {_PICTURE})[1]['0.rho'].pixels",
    "scenes.radiosity": f"{_ALL}(gn.scenes.radiosity(gn.Scene({_ROOM}), 36, 'rays', tolerance=0.05))",
    "scenes.radiosity by all pairs": f"{_ALL}(gn.scenes.radiosity(gn.Scene({_ROOM}), 12, 'dense', tolerance=0.05))",
    "reflected_radiance": "gn.reflected_radiance(m, lit(a), to(n), to([0.0, 0.0, 1.0]), to([0.6, 0.8, 0.0]), at(p))",
    "render": f"gn.render(m, lit(a), {_PICTURE}).pixels",
    "scenes.write_turntable": f"[x.pixels for x in gn.scenes.write_turntable(m, None, lit(a), 2, {_PICTURE})]",
}
"""Functions, and ways of them, as Python."""

LEFT_OUT = {"scenes.render_stokes": "its shapes are named, and stand at the origin"}

MOTIONS = {
    "shifted": "0.0, [1e7, -7e6, 3e6], 1.0",
    "turned": "0.7, [0.0, 0.0, 0.0], 1.0",
    "small": "0.0, [1e-4, -7e-5, 3e-5], 1e-9",
    "large": "0.0, [1e14, -7e13, 3e13], 1e9",
}
"""Angle, place and size of a world, as Python."""

ONLY = {
    "gonioreflectometer": ("shifted", "small", "large"),
    "scenes.radiosity": tuple(MOTIONS),
    "scenes.radiosity by all pairs": tuple(MOTIONS),
    "scenes.write_turntable": ("turned",),  # about the axis of the world through 0, 0, 0
}
"""How the world of a call may be moved, if not as others: lights have lengths in them, a surface its axes."""


def placed() -> set[str]:
    """The functions that take places."""
    return {name for name, f in functions().items() if any(map(PLACES.fullmatch, inspect.signature(f).parameters))}


class Placed(NamedTuple):
    """A call in the world as it is, and as it is moved."""

    call: str
    motion: str
    light: str = "ConstantLight"

    @property
    def start(self) -> str:
        places = "p = np.random.default_rng(2).uniform(-0.2, 0.2, (5, 3))"
        directions = "n = gn.direction(np.linspace(0.0, 1.0, 5), np.linspace(0.3, 5.0, 5))"
        cube = "cube = np.mgrid[:2, :2, :2].reshape(3, 8).T - 0.5"
        material = f"m = gn.expression({MATERIALS['paint']!r})"
        return f"import numpy as np, gonio as gn; {material}; {places}; {directions}; {cube}; a = {made()[self.light]}"

    @property
    def world(self) -> str:
        light = "(lambda y: y.moved(by) if any(by) else y)(gn.TurnedLight(x, angle))"
        if self.light == "FunctionLight":
            light = "gn.FunctionLight(lambda w: x.L(w @ R(-angle)))"
        turn = "[[np.cos(x), np.sin(x), 0.0], [-np.sin(x), np.cos(x), 0.0], [0.0, 0.0, 1.0]]"
        return (
            f"R = lambda x: np.array({turn}); world = lambda angle, by, size: {{'angle': angle, 'size': size, "
            f"'at': lambda x: size * (x @ R(angle)) + by, 'to': lambda x: x @ R(angle), 'lit': lambda x: {light}}}"
        )

    @property
    def worlds(self) -> str:
        return f"(world(0.0, [0.0, 0.0, 0.0], 1.0), world({MOTIONS[self.motion]}))"

    def lines(self) -> str:
        """Three lines of Python that print what the call gives in both."""
        printed = f"globals().update(x) or {CALLS[self.call]}"
        return f"\n{self.start}\n{self.world}\nprint(*({printed} for x in {self.worlds}), sep='\\n')"

    def results(self) -> list[list[np.ndarray] | Refused]:
        """What the call gives in both."""
        names: dict[str, Any] = {}
        exec(f"{self.start}\n{self.world}", names)
        found: list[list[np.ndarray] | Refused] = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # numbers are compared
            for world in eval(self.worlds, names):
                try:
                    found.append(numbers(eval(CALLS[self.call], names | world)))
                except gn.Error as error:
                    found.append(Refused(type(error)))
        return found
