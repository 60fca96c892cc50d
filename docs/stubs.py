"""The stubs of gonio and its namespaces, for type checkers and editors: `python3 dev.py docs` writes `pages`.

Constructors come from the declared parameters, functions from the modules that a `__getattr__` imports on use.
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

HEAD = '''"""The stub of gonio, for type checkers and editors. Made by `python3 dev.py docs`: do not edit."""

from collections.abc import Callable
from os import PathLike
from types import ModuleType
from typing import Any, Literal

from .base.light import Light
from .declared.contents import Contents
from .declared.version import __version__ as __version__
from .formula.classes import Array
from .formula.distribution import Distribution
from .formula.fresnel_term import Fresnel
from .pictures.image import Image
from .scenes.mesh import Mesh
'''


def pages() -> dict[Path, str]:
    """File -> text: the stub of gonio, and of each namespace whose names are imported when they are first used."""
    modules = [getattr(gn, name) for name in gn.NAMESPACES]
    return {stub_of(gn): text()} | {stub_of(module): listing(module) for module in modules}


def stub_of(module: ModuleType) -> Path:
    """The stub beside a module."""
    return Path(str(module.__file__)).with_suffix(".pyi")


def listing(module: ModuleType) -> str:
    """The stub of a namespace: its names, imported from where they are defined."""
    up = ".." if Path(str(module.__file__)).stem == "__init__" else "."
    homes = sorted((getattr(module, name).__module__.removeprefix("gonio."), name) for name in module.__all__)
    imports = "\n".join(f"from {up}{home} import {name} as {name}" for home, name in homes)
    return f'"""{docstring(module).partition(chr(10))[0]}"""\n\n{imports}\n'


def text() -> str:
    """The stub of gonio."""
    imports, definitions = [], []
    for name in gn.__all__:
        value = getattr(gn, name)
        if isinstance(value, Folder):
            definitions.append(f"def {name}() -> {value.contents.__annotations__['return']}: ...")
        elif isinstance(value, ModuleType):
            imports.append(f"from . import {name} as {name}")
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
