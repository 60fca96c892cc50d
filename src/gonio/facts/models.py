"""Facts about models, distributions, Fresnel terms and the pieces of a material, from their docstrings."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from ..base.reflectance import Reflectance
from ..base.sums import Scaled, Sum
from ..declared import discover
from ..formula.distribution import Distribution
from ..formula.fields import Field, Option, Param, Part, Wavelengths
from ..formula.fresnel_term import Fresnel
from ..formula.parametrised import Parametrised
from ..formula.text import literal

KINDS = {
    "Models": (Reflectance, "gonio.models"),
    "Distributions of facet normals": (Distribution, "gonio.distributions"),
    "Fresnel terms": (Fresnel, "gonio.formula.fresnel"),
}
SHOWN = list(range(400, 701, 25))
"""Wavelengths [nm] at which formulas that know theirs are shown."""

PARTS = ("Looks", "Shapes", "Units", "Error", "Source", "Example")
"""The labels of docstrings."""


def kinds() -> dict[str, dict[str, type[Parametrised]]]:
    """Heading -> name -> class."""
    return {heading: discover.classes(package, kind) for heading, (kind, package) in KINDS.items()}


def sections(kind: type) -> dict[str, str]:
    """A docstring cut into its parts; the text before them is under ""."""
    return discover.labelled(discover.docstring(kind), PARTS)


def summary(kind: type) -> str:
    """The first paragraph of a docstring, in one line."""
    return " ".join(sections(kind)[""].split("\n\n")[0].split())


def example(kind: type[Parametrised]) -> str:
    """The first value that `Looks` says to try, as an expression; the defaults where it names none."""
    looks = " ".join(sections(kind).get("Looks", "").split())
    tried = (text for text in re.findall(r"`(.*?)`", looks) if re.match(rf"{kind.__name__}[.(]", text))
    return next(tried, f"{kind.__name__}()")


def drawn(kind: type[Parametrised]) -> str:
    """The expression that the picture of a class shows: its example, on a metal surface where it is a piece of one,
    under light of all wavelengths alike where it fluoresces."""
    if issubclass(kind, Distribution):
        return f"Microfacet({example(kind)})"
    if issubclass(kind, Fresnel):
        at = f", wavelengths={SHOWN}" if any(isinstance(f, Wavelengths) for f in kind.fields.values()) else ""
        return f"Microfacet(GGX(0.1), {example(kind)}{at})"
    if getattr(kind, "fluoresces", None) is True:
        return f"UnderLight({example(kind)}, 1, 1)"
    return example(kind)


def arguments(kind: type[Parametrised]) -> Iterator[tuple[str, str, str, str]]:
    """Name, default, range and meaning of every parameter, option and part of a class."""
    for name, field in kind.fields.items():
        if (words := _argument(field)) is not None:
            yield (name, *words)


def _argument(field: Field) -> tuple[str, str, str] | None:
    if isinstance(field, Param):
        unit = "" if field.unit == "1" else f" [{field.unit}]"
        alias = f"; {field.alias} sets all" if field.alias else ""
        default = f"as {field.default}" if isinstance(field.default, str) else f"{field.default:g}"
        return default, f"{field.low:g} to {field.high:g}", f"{field.doc}{unit}{alias}"
    if isinstance(field, Option):
        return field.default, ", ".join(field.choices), field.doc
    if isinstance(field, Part):
        default = "" if field.default is None else literal(field.default)
        return default, f"a {field.kind.__name__}", field.doc
    return None


def model_facts(name: str, heading: str, kind: type[Parametrised]) -> dict[str, Any]:
    """Facts about a class, as JSON data."""
    parts = sections(kind)
    return {
        "name": name,
        "kind": heading,
        "summary": summary(kind),
        "formula": parts[""],
        **{label.lower(): parts[label] for label in PARTS if label in parts and label != "Example"},
        "may_break": dict(getattr(kind, "breaks", {})),
        "parameters": [dict(zip(("name", "default", "range", "meaning"), row, strict=True)) for row in arguments(kind)],
        "example": drawn(kind),
        "page": f"docs/models/{name}.md",
    }


def every_model() -> list[dict[str, Any]]:
    """Facts about all classes, by heading and name."""
    return [model_facts(name, heading, kind) for heading, of in kinds().items() for name, kind in of.items()]


def formulas(m: Reflectance) -> list[dict[str, str]]:
    """What the docstrings of a material's classes say of each: formula, range of errors, source."""
    formulas_of_part = []
    for kind in dict.fromkeys(_pieces(m)):
        parts = sections(kind)
        told = {name.lower(): " ".join(parts.get(name, "").split()) for name in ("Units", "Error", "Source")}
        formulas_of_part.append({"class": kind.__name__, "formula": parts.get("", "").strip(), **told})
    return formulas_of_part


def _pieces(m: Parametrised) -> Iterator[type[Parametrised]]:
    """The classes of a material and of its pieces, without sums and products."""
    if not isinstance(m, (Sum, Scaled)):
        yield type(m)
    for name in m.fields:
        if isinstance(part := getattr(m, name), Parametrised):
            yield from _pieces(part)
