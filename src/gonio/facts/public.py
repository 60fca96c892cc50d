"""Public functions that are asked of one material: by their signatures alone they are commands and forms."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

from ..declared.arguments import FunctionArgument, arguments, hints
from ..declared.discover import docstring


def public(name: str) -> Any:
    """What gonio calls so, imported when it is used: "render", or "figures.overview"."""
    module, _, last = name.rpartition(".")
    return getattr(import_module(f"..{module}", __package__), last)


class Form(NamedTuple):
    """A public function of a material, and those of its arguments that can be typed."""

    name: str
    function: Callable
    fields: dict[str, FunctionArgument]

    @property
    def summary(self) -> str:
        """The first sentence of its docstring."""
        return docstring(self.function).partition("\n\n")[0].replace("\n", " ").replace("`", "")

    def to_json(self) -> dict[str, Any]:
        fields = [
            {
                "name": name,
                "doc": a.declared.doc,
                "unit": a.declared.typed.unit,
                "expected": a.expected_typed,
                "default": a.usual,
                "words": a.words,
            }
            for name, a in self.fields.items()
        ]
        return {"name": self.name, "doc": self.summary, "fields": fields}


def function_of(name: str) -> Callable | None:
    """A public function that is asked of one material, with all else that it needs declared; None of other names."""
    function = _functions().get(name)
    if function is None:
        return None
    parameters = [*inspect.signature(function).parameters.values()]
    needed = {
        p.name for p in parameters[1:] if p.default is p.empty and p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)
    }
    is_asked = parameters and getattr(hints(function)[parameters[0].name], "__name__", "") == "Reflectance"
    return function if is_asked and needed <= {*arguments(function)} else None


def form(name: str) -> Form | None:
    """The form of such a function; None of one that needs what cannot be typed, or names a file."""
    function = function_of(name)
    if function is None:
        return None
    every = arguments(function)
    fields = {name: argument for name, argument in every.items() if argument.is_typed}
    needed = {name for name, argument in every.items() if argument.default is inspect.Parameter.empty}
    return Form(name, function, fields) if needed <= {*fields} else None


def forms() -> list[Form]:
    """All of them, by name."""
    return [found for name in sorted(_functions()) if (found := form(name)) is not None]


def asked_of_one() -> list[str]:
    """The names of all functions that `function_of` finds."""
    return [name for name in sorted(_functions()) if function_of(name)]


def _functions() -> dict[str, Callable]:
    """Public functions: gonio's, and those of its namespaces."""
    gonio = import_module("..", __package__)
    modules = [*(getattr(gonio, name) for name in gonio.NAMESPACES), gonio]
    values = ((name, getattr(module, name)) for module in modules for name in module.__all__)
    return {name: value for name, value in values if inspect.isfunction(value)}
