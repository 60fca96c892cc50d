"""The stub src/gonio/__init__.pyi, for type checkers and editors: `text` makes it, `python3 dev.py docs` writes it.

Constructors come from the declared parameters, functions from the modules that `gonio.__getattr__` imports on use.
"""

import inspect
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import gonio as gn
from gonio.declared.contents import Folder
from gonio.declared.discover import docstring, labelled
from gonio.formula.classes import parameter_lines, signature, takes_fields
from gonio.formula.fields import Option
from gonio.formula.parametrised import Parametrised

PAGE = Path(gn.__file__).with_suffix(".pyi")
HEAD = '''"""The stub of gonio, for type checkers and editors. Made by `python3 dev.py docs`: do not edit."""

from collections.abc import Callable
from os import PathLike
from types import ModuleType
from typing import Any, Literal

from .declared.contents import Contents
from .formula.classes import Array
from .declared.version import __version__ as __version__
'''


def text() -> str:
    """The stub."""
    imports, definitions = [], []
    for name in gn.__all__:
        value = getattr(gn, name)
        if isinstance(value, Folder):
            definitions.append(f"def {name}() -> {value.contents.__annotations__['return']}: ...")
        elif isinstance(value, ModuleType):
            imports.append(f"from .{gn._ON_USE.get(name, '')} import {name} as {name}")
        elif isinstance(value, type) and issubclass(value, Parametrised) and takes_fields(value) and value.fields:
            imports.append(f"from {home(name)} import {name} as _{name}")
            definitions.append("\n".join(class_lines(name, value)))
        else:
            imports.append(f"from {home(name)} import {name} as {name}")
    return "\n".join([HEAD + "\n".join(sorted(imports)), *definitions]) + "\n"


def home(name: str) -> str:
    """The module of a public name, relative to the package."""
    return f".{gn._ON_USE[name]}" if name in gn._ON_USE else getattr(gn, name).__module__.removeprefix("gonio")


def class_lines(name: str, kind: type[Parametrised]) -> Iterator[str]:
    """A class with a typed constructor, which inherits all else from the one in the package."""
    summary = textwrap.wrap(" ".join(docstring(kind).partition("\n\n")[0].split()), 112)
    example = labelled(docstring(kind), ["Example"]).get("Example", "").splitlines()
    lines = [*summary, "", "Parameters", *(f"    {row}" for row in parameter_lines(kind))]
    lines += ["", "Example", *example] if example else []
    yield f"\nclass {name}(_{name}):"
    yield textwrap.indent('r"""' + "\n".join(lines) + '\n"""', "    ").replace("    \n", "\n")
    yield "    def __init__(\n        self,"
    parameters = list(signature(kind).parameters.values())
    by_keyword = next((p for p in parameters if p.kind is p.KEYWORD_ONLY), None)
    for parameter in parameters:
        if parameter is by_keyword:
            yield "        *,"
        yield f"        {parameter.name}: {parameter.annotation}{default(kind, parameter)},"
    yield "    ) -> None: ..."


def default(kind: type[Parametrised], parameter: inspect.Parameter) -> str:
    """The default where it is a number or a word; `...` for other values, such as parts."""
    if parameter.default is parameter.empty:
        return ""
    plain = isinstance(parameter.default, float) or isinstance(kind.fields.get(parameter.name), Option)
    return f" = {parameter.default!r}" if plain else " = ..."
