"""Public functions that take lights, found by their signatures, calls of them, and a light of each class.

How a function is called, `CALLS` and `RATIOS` say; how a light is made that needs arguments, `MADE`.
"""

from __future__ import annotations

import inspect
import re
import warnings
from typing import Any, NamedTuple

import house
import numpy as np
from directed import Refused, numbers
from face import functions

import gonio as gn

LIGHTS = re.compile(r"lights?|sky")
"""Names of arguments that are lights: a public function with one is in the sweep."""

CALLS = {
    "irradiance": "gn.irradiance(lights, normal=n)",
    "scenes.picture_jacobian": "[x.pixels for x in "
    "gn.scenes.picture_jacobian(m, lights, '0.rho', size=6, samples=4)[1].values()]",
    "reflected_radiance": "gn.reflected_radiance(m, lights, n)",
    "render": "gn.render(m, lights, size=6, samples=4).pixels",
    "scenes.render_stokes": "gn.scenes.render_stokes(m, lights, size=6, samples=4).pixels",
    "scenes.write_turntable": "[x.pixels for x in "
    "gn.scenes.write_turntable(m, None, lights, frames=2, size=4, samples=4)]",
}
"""Functions whose results go with the light, as Python."""

_IMAGES = "k * np.full((3, 5), 0.05), [gn.TurnedLight(lights[0], angle) for angle in (0.0, 2.0, 4.0)]"
RATIOS = {
    "reconstruction.texel_data": f"gn.reconstruction.texel_data({_IMAGES}, n[2], normal=n, position=0.0 * n).f",
    "reconstruction.photometric_stereo": f"gn.reconstruction.photometric_stereo({_IMAGES}, position=0.0 * n).albedo",
    "reflectance": "gn.reflectance(m, sky=lights, tolerance=1e-2)",
    "reflectance_factor": "gn.reflectance_factor(m, collected=n, sky=lights, tolerance=1e-2)",
}
"""Functions whose results stay under k times the light; images are k times as bright."""

LEFT_OUT = {
    "figures.gallery": "a drawing of what `render` gives",
    "figures.overview": "a drawing of what `render` gives",
    "figures.portrait": "a drawing of what `render` gives",
    "scenes.radiosity": "what emits in a scene is its light, and there is no other",
    "write_report": "a page",
}

MADE = {
    "DistantLight": "gn.DistantLight([0.3, -0.6, 1.0])",
    "EnvironmentLight": "gn.EnvironmentLight.studio(height=8)",
    "FunctionLight": "gn.FunctionLight(lambda w: 1.0 + w[..., 2])",
    "TurnedLight": "gn.TurnedLight(gn.PointLight(), 0.3)",
}
"""Lights that need arguments, as Python; any other one needs none."""

MORE = {r"W( .*)?|kcd m-2": 1.0, r"lm W-1": -1.0}
"""Units of the number that says how bright a light is, and the power of it that the radiance goes with."""

MATERIALS = {
    "paint": repr(house.PAINT),
    "ink": "Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])",
}


def lit() -> set[str]:
    """The functions that take lights."""
    return {name for name, f in functions().items() if any(map(LIGHTS.fullmatch, inspect.signature(f).parameters))}


def made() -> dict[str, str]:
    """A light of each class, as Python; outside of what it lights."""
    texts = {name: MADE.get(name, f"gn.{name}()") for name in gn.lights()}
    return {k: x if k == "FunctionLight" else f"{x}.moved([0.3, -1.5, 2.0])" for k, x in texts.items()}


def twice(name: str) -> str:
    """The light a of a class, twice as bright, as Python."""
    if name == "FunctionLight":
        return "gn.FunctionLight(lambda w: 2.0 * a.L(w))"
    numbers = eval(made()[name], {"gn": gn}).parameters
    bright = {n: p.value * 2.0**q for n, p in numbers.items() for u, q in MORE.items() if re.fullmatch(u, p.unit)}
    assert len(bright) == 1, f"{name}: which number says how bright it is? Expected one in a unit of {list(MORE)}"
    return f"a.replace({bright})"


class Lit(NamedTuple):
    """A call under several sets of lights, as Python."""

    m: str
    lamps: str
    call: str
    sets: str

    @property
    def start(self) -> str:
        return (
            f"import numpy as np, gonio as gn; m = gn.expression({self.m!r}); "
            f"n = gn.direction(np.linspace(0.0, 1.0, 5), np.linspace(0.3, 5.0, 5))"
        )

    def lines(self) -> str:
        """Three lines of Python that print what the call gives."""
        return f"\n{self.start}\n{self.lamps}\nprint(*({self.call} for lights, k in {self.sets}), sep='\\n')"

    def results(self) -> list[list[np.ndarray] | Refused]:
        """What the call gives under each."""
        names: dict[str, Any] = {}
        exec(f"{self.start}\n{self.lamps}", names)
        found: list[list[np.ndarray] | Refused] = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # numbers are compared
            for lights, k in eval(self.sets, names):
                try:
                    found.append(numbers(eval(self.call, {**names, "lights": lights, "k": k})))
                except gn.Error as error:
                    found.append(Refused(type(error)))
        return found
