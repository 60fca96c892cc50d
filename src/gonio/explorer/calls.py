"""What a page may ask the worker: a function for each call, of the shelf and the declared arguments of the request."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from ..base.angles import direction
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..declared.arguments import Declared, FunctionArgument, arguments
from ..declared.version import __version__
from ..errors import NotFoundError, ParameterError, suggestion
from ..facts.public import form, forms, public
from ..formula.bounds import CHANNELS, MAX_LENGTH

if TYPE_CHECKING:
    from .shelf import Shelf

THETA = (*range(0, 85, 5), 85.0, 88.0)
"""Angles of incidence [degrees] of albedos."""

STEP = 0.5
"""Step [degrees] of the views in "data"."""

Text = Annotated[str, Declared("a material of the page", longest=MAX_LENGTH)]
Word = Annotated[str, Declared("a name", longest=200)]
Number = Annotated[float, Declared("a number")]
Numbers = Annotated[Sequence[Number], Declared("a number for each channel", longest=CHANNELS)]
Replaced = Annotated[
    Mapping[Word, Number | Numbers | Word], Declared("values by the path of a parameter", longest=1000)
]
Given = Annotated[
    Mapping[Word, Annotated[str, Declared("as it is typed", longest=200)]], Declared("typed arguments", longest=50)
]
Azimuth = Annotated[float, Declared("azimuth of incidence", unit="degrees")]
Directions = Annotated[Sequence[tuple[float, float, float]], Declared("directions [x, y, z]", longest=1 << 14)]

BELOW_90 = math.nextafter(90.0, 0.0)

NOTHING: Mapping[str, Any] = {}


def names(shelf: Shelf) -> dict[str, Any]:
    """Everything that a page may name: the command line's materials, built-in ones, and models with an example."""
    from ..catalogue import builtin
    from ..facts.models import drawn, kinds, summary

    models = [
        {"name": name, "doc": summary(cls).replace("`", ""), "example": drawn(cls)}
        for name, cls in kinds()["Models"].items()
    ]
    return {
        "given": [{"text": name, "title": name} for name in shelf.given],
        "materials": [{"name": e.name, "kind": e.kind, "description": e.description} for e in builtin.materials()],
        "models": models,
        "version": __version__,
    }


def material(shelf: Shelf, text: Text, replaced: Replaced = NOTHING) -> dict[str, Any]:
    """MATERIAL of the protocol; those of the command line are described once."""
    if replaced or text not in shelf.given:
        return _described(shelf, text, replaced)
    with shelf.alone(f"describe {text}"):
        if text not in shelf.told:
            shelf.told[text] = _described(shelf, text, {})
    return shelf.told[text]


def check(shelf: Shelf, text: Text, replaced: Replaced = NOTHING) -> dict[str, Any]:
    """The verdicts of `gn.check`."""
    m = shelf.material(text, replaced)
    if map_shape(m):
        raise ParameterError(f"{text:.60}: its parameters are maps; expected one material")
    report = public("check")(m)
    rows = [
        {
            "law": law.name,
            "verdict": law.verdict,
            "measured": law.value,
            "tolerance": law.tolerance,
            "reason": "; ".join(x for x in (law.why, law.significance, law.declared) if x),
            "finding": law.finding,
            "place": law.place,
        }
        for law in report.laws
    ]
    return {"rows": rows, "ok": report.passed, "notes": list(report.notes)}


def fit(shelf: Shelf, text: Text, model: Text, replaced: Replaced = NOTHING) -> dict[str, Any]:
    """The fit of a model, `gn.fit`, and the fitted model as a material of its own."""
    from ..catalogue.expressions import expression

    fitted = public("fit")(shelf.material(text, replaced), expression(model))
    numbers = [
        {"name": name, "value": float(value), "u": u}
        for (name, u), value in zip(fitted.stderr.items(), fitted.values, strict=True)
    ]
    made = repr(fitted.model)
    return {
        "expression": made,
        "numbers": numbers,
        "rms": fitted.rms,
        "text": fitted.report(),
        "material": _described(shelf, made, {}),
    }


def albedo(shelf: Shelf, text: Text, replaced: Replaced = NOTHING) -> dict[str, Any]:
    """Albedo against the angle of incidence, and of tables that state uncertainties its own, of independent errors."""
    from ..facts.material import albedos

    values, u = albedos(shelf.material(text, replaced), direction(np.radians(THETA), 0.0))
    return {"theta": [float(t) for t in THETA], "values": values, "u": u}


def source(
    shelf: Shelf,
    text: Text,
    language: Word,
    replaced: Replaced = NOTHING,
    function: Annotated[Sequence[Word], Declared("functions of the material", longest=8)] = ("f",),
    parameters: Word = "constants",
) -> dict[str, Any]:
    """Source code of the material's functions, `gn.engine.shader_source`."""
    m = shelf.material(text, replaced)
    return {"text": public("engine.shader_source")(m, language, function, parameters=parameters).text}


def data(
    shelf: Shelf,
    text: Text,
    theta_i: Annotated[float, Declared("angle of incidence", 0.0, BELOW_90, "degrees")],
    replaced: Replaced = NOTHING,
    phi_i: Azimuth = 0.0,
) -> dict[str, Any]:
    """f in the plane of incidence, as CSV."""
    m = shelf.material(text, replaced)
    count = round(89.5 / STEP)
    views = STEP * np.arange(-count, count + 1)
    phi = math.radians(phi_i)
    wo = direction(np.radians(np.abs(views)), np.where(views < 0.0, phi, phi + math.pi))
    f = _with_channels(m, m.f(direction(math.radians(theta_i), phi), wo))
    lines = [
        f"# {' '.join(text.split())}" + "".join(f"; {path} = {value}" for path, value in replaced.items()),
        f"# f(wi, wo) [1/sr], without the cosine, in the plane of incidence; light from theta_i = {theta_i:g} degrees, "
        f"phi_i = {phi_i:g} degrees",
        "# theta_o [degrees] from the normal: below 0 on the side of the light, above 0 on that of the mirror",
        f"# gonio {__version__}",
        ",".join(["theta_o_deg", *_columns(m, f.shape[-1])]),
    ]
    lines += [",".join([f"{view:g}", *(f"{x:.9g}" for x in row)]) for view, row in zip(views, f, strict=True)]
    return {"csv": "\n".join(lines) + "\n"}


def _columns(m: Reflectance, count: int) -> list[str]:
    names = m.channel_names or (tuple("RGB") if count == 3 else ("",) if count == 1 else range(count))
    words = [name if isinstance(name, str) else f"{name:g}_nm" if m.channel_names else str(name) for name in names]
    return [f"f_{word}".rstrip("_").replace(",", "_").replace("\n", "_") for word in words]


def f(shelf: Shelf, text: Text, wi: Directions, wo: Directions, replaced: Replaced = NOTHING) -> dict[str, Any]:
    """f [1/sr] at pairs of directions."""
    if len(wi) != len(wo):
        raise ParameterError(f"f: {len(wi)} wi and {len(wo)} wo; expected as many of both")
    m = shelf.material(text, replaced)
    return {"values": _with_channels(m, m.f(np.array(wi), np.array(wo)))}


def functions(shelf: Shelf) -> dict[str, Any]:
    """The public functions that `ask` takes, with their arguments."""
    return {"functions": [one.to_json() for one in forms()]}


def ask(
    shelf: Shelf, text: Text, function: Word, given: Given = NOTHING, replaced: Replaced = NOTHING
) -> dict[str, Any]:
    """A public function of the material, `gn.function(m, ...)`, with arguments as they are typed."""
    declared = form(function)
    if declared is None:
        every = [f.name for f in forms()]
        close = suggestion(function, every)
        raise NotFoundError(f"{function}: no function of a material{close}; expected one of {', '.join(every)}")
    for name in given:
        if name not in declared.fields:
            close = suggestion(name, declared.fields)
            listed = ", ".join(declared.fields) or "none"
            raise ParameterError(f"{function}: no argument {name!r}{close}; expected {listed}")
    for name, field in declared.fields.items():
        if name not in given and field.default is Parameter.empty:
            raise ParameterError(f"{function}: {name}: expected {field.expected_typed}: {field.declared.doc}")
    values = {name: declared.fields[name].checked_text(typed, f"{name} {typed!r:.60}") for name, typed in given.items()}
    with np.printoptions(precision=6, suppress=True):
        return {"text": str(declared.function(shelf.material(text, replaced), **values))}


def _with_channels(m: Reflectance, f: Any) -> np.ndarray:
    return np.asarray(f) if m.channels else np.asarray(f)[:, None]


def _described(shelf: Shelf, text: str, replaced: Mapping[str, Any]) -> dict[str, Any]:
    from .describe import described  # late: the server, which knows what may be asked, describes nothing

    return described(shelf, text, replaced)


class PageCall(NamedTuple):
    """What a page may ask for: the function, and the seconds after which the worker is ended."""

    function: Callable[..., dict[str, Any]]
    seconds: float = 120.0

    @property
    def arguments(self) -> dict[str, FunctionArgument]:
        """The arguments of a request, by name."""
        return arguments(self.function)


CALLS: dict[str, PageCall] = {
    call.function.__name__: call
    for call in (
        *(
            PageCall(names, 60.0),
            PageCall(material),
            PageCall(check, 180.0),
            PageCall(fit, 600.0),
            PageCall(albedo, 180.0),
        ),
        *(PageCall(source), PageCall(data), PageCall(f), PageCall(functions), PageCall(ask, 180.0)),
    )
}
"""Name -> what a page may ask for."""
