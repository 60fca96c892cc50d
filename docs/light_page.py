"""The part of docs/light.md that tells of each light, made from the docstrings."""

from __future__ import annotations

from collections.abc import Iterator

from model_pages import markdown

import gonio as gn
from gonio.base.light import Light
from gonio.declared.discover import docstring
from gonio.facts.models import PARTS, arguments, sections, summary
from gonio.formula.fields import Channels
from gonio.formula.text import literal
from gonio.formula.world import Vector
from gonio.lights._words import words
from gonio.scenes.shapes import SHAPES


def text() -> str:
    """A table of all lights, and a section for each."""
    lines = ["| light | | directions | closed form of E |", "|---|---|---|---|"]
    lines += [f"| [`{name}`](#{name.lower()}) | {of_table(kind)} |" for name, kind in gn.lights().items()]
    for name, kind in gn.lights().items():
        lines += ["", f"### {name}", "", *section(kind)]
    lines += ["", "### Words of the command line", "", "| `--light` | |", "|---|---|"]
    lines += [f"| `{word.usage}` | {word.meaning} |" for word in words()]
    return "\n".join(lines) + "\n"


def shapes() -> str:
    """A line for each shape."""
    lines = [f"- `{name}`: {docstring(SHAPES[name]).partition(chr(10))[0].rstrip('.')}." for name in SHAPES]
    return "\n".join(map(markdown, lines)) + "\n"


def of_table(kind: type[Light]) -> str:
    """What the table says of a light."""
    is_closed = kind.is_delta or kind.irradiance_on is not Light.irradiance_on
    closed = "yes" if is_closed else "by integration"
    return f"{markdown(summary(kind))} | {'one' if kind.is_delta else 'many'} | {closed}"


def section(kind: type[Light]) -> Iterator[str]:
    """What there is to say of a light."""
    parts = sections(kind)
    yield markdown(parts[""])
    yield ""
    yield from fields(kind)
    yield ""
    yield from (f"- **{part}.** {markdown(parts[part])}" for part in PARTS if part in parts and part != "Example")
    imports = [">>> import numpy as np"] if "np." in parts["Example"] else []
    yield from ("", "```pycon", *imports, parts["Example"], "```")


def fields(kind: type[Light]) -> Iterator[str]:
    """Rows of a table: all that a light is made of."""
    yield "| | default | range | meaning |"
    yield "|---|---|---|---|"
    known = {name: rest for name, *rest in arguments(kind)}
    for name, field in kind.fields.items():
        if isinstance(field, Channels):
            continue
        default, values, meaning = known.get(name, (literal(field.default), field.range or field.accepts, field.doc))
        values = field.range if isinstance(field, Vector) else values
        yield f"| `{name}` | `{default}` | {markdown(values)} | {markdown(meaning)} |"
