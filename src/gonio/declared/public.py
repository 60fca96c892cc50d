"""Public functions that are asked of one material: by their signatures alone they are commands and forms."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

from .arguments import Argument, arguments
from .discover import docstring


class Form(NamedTuple):
    """A public function of a material, and those of its arguments that can be typed."""

    name: str
    function: Callable
    fields: dict[str, Argument]

    @property
    def summary(self) -> str:
        """The first sentence of its docstring."""
        return docstring(self.function).partition("\n\n")[0].replace("\n", " ").replace("`", "")

    def to_json(self) -> dict[str, Any]:
        fields = [
            {
                "name": name,
                "doc": a.declared.doc,
                "unit": "" if a.declared.unit == "direction" else a.declared.typed.unit,
                "expected": a.expected_typed,
                "default": a.usual,
                "words": a.words,
            }
            for name, a in self.fields.items()
        ]
        return {"name": self.name, "doc": self.summary, "fields": fields}


def form(name: str) -> Form | None:
    """The form of a public name; None of one that is no function of a material, or asks for what cannot be typed."""
    function = getattr(import_module("gonio"), name, None)
    if not inspect.isfunction(function):
        return None
    parameters = [*inspect.signature(function).parameters.values()]
    if not parameters or not str(parameters[0].annotation).startswith("Reflectance"):
        return None
    fields = {name: argument for name, argument in arguments(function).items() if argument.is_typed}
    asked = [p for p in parameters[1:] if p.default is p.empty and p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    return Form(name, function, fields) if {p.name for p in asked} <= {*fields} else None


def forms() -> list[Form]:
    """All of them, by name."""
    return [found for name in sorted(import_module("gonio").__all__) if (found := form(name)) is not None]
