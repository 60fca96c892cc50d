"""The pages of the models: one for each model, distribution of normals and Fresnel term, made from its docstring."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import gonio as gn
from gonio.facts.models import PARTS, drawn, kinds, sections, summary
from gonio.figures import portrait
from gonio.formula.exchange import Exchange
from gonio.formula.fields import Option, Param, Part
from gonio.formula.parametrised import Parametrised
from gonio.formula.text import literal
from gonio.laws import LAWS, check


def markdown(text: str) -> str:
    """Text of a docstring as Markdown: formulas keep their stars and underscores."""
    cut = re.split(r"(`[^`]*`|\$\$.*?\$\$|\$[^$]*\$)", text, flags=re.DOTALL)
    return "".join(part if part[:1] in ("`", "$") else re.sub(r"([*_<>|])", r"\\\1", part) for part in cut)


def parameters(kind: type[Parametrised]) -> Iterator[str]:
    """Rows of a table: every parameter, option and part of a class."""
    yield "| parameter | default | range | meaning |"
    yield "|---|---|---|---|"
    for name, field in kind.fields.items():
        if isinstance(field, Param):
            unit = "" if field.unit == "1" else f" [{field.unit}]"
            alias = f"; `{field.alias}` sets all" if field.alias else ""
            default = f"as `{field.default}`" if isinstance(field.default, str) else f"{field.default:g}"
            yield f"| `{name}` | {default} | {field.low:g} to {field.high:g} | {markdown(field.doc)}{unit}{alias} |"
        elif isinstance(field, Exchange):
            yield f"| `{name}` | {field.default:g} | {field.range} | {markdown(field.doc)} |"
        elif isinstance(field, Option):
            words = ", ".join(f"`{c}`" for c in field.choices)
            yield f"| `{name}` | `{field.default}` | {words} | {markdown(field.doc)} |"
        elif isinstance(field, Part):
            yield f"| `{name}` | `{literal(field.default)}` | a {field.kind.__name__} | {markdown(field.doc)} |"


def page(kind: type[Parametrised]) -> str:
    """The page of a class."""
    name, parts = kind.__name__, sections(kind)
    lines = [f"# {name}", "", f"![{name}: a sphere, and slices of f](pictures/{name}.jpg)", "", markdown(parts[""]), ""]
    if kind.fields:
        lines += [*parameters(kind), ""]
    lines += [f"- **{part}.** {markdown(parts[part])}" for part in PARTS if part in parts and part != "Example"]
    for law, why in getattr(kind, "breaks", {}).items():
        lines.append(f"- **Breaks {law}.** {markdown(why)}")
    lines += ["", "```python", "import gonio as gn", "", f"m = {shown(kind)}", "```", ""]
    if example := parts.get("Example"):
        imports = [">>> import numpy as np"] if "np." in example else []
        lines += ["```pycon", *imports, example, "```", ""]
    lines.append(f"`gonio cite {name}` prints the sources as BibTeX. [All models](README.md)")
    return "\n".join(lines) + "\n"


def shown(kind: type[Parametrised]) -> str:
    """The code that the picture of a class shows."""
    return re.sub(r"\b(?=[A-Z]\w*\()", "gn.", drawn(kind))


def index() -> str:
    """The page that lists all."""
    links = "[How to choose](choose.md), [what holds for which](laws.md)."
    lines = ["# Models", "", f"Made from the docstrings by `python3 dev.py docs`. {links}"]
    for heading, classes in kinds().items():
        lines += ["", f"## {heading}", "", "| | | |", "|---|---|---|"]
        for name, kind in classes.items():
            picture = f'<img src="pictures/{name}.jpg" alt="{name}" width="220">'
            lines.append(f"| [`{name}`]({name}.md) | {picture} | {markdown(summary(kind))} |")
    return "\n".join(lines) + "\n"


def pages() -> dict[str, str]:
    """Every page that is made from docstrings, by file name."""
    every = {f"{name}.md": page(kind) for classes in kinds().values() for name, kind in classes.items()}
    return every | {"README.md": index()}


def verdicts(text: str) -> dict[str, dict[str, str]]:
    """The page of verdicts, read: model -> law -> verdict."""
    rows = [[cell.strip(" *`") for cell in line.split("|")[1:-1]] for line in text.splitlines() if line[:2] == "| "]
    if not rows:
        return {}
    (_, *laws), *models = rows
    return {re.sub(r"\[`(\w+)`\].*", r"\1", name): dict(zip(laws, cells, strict=True)) for name, *cells in models}


def lawful(present: str) -> str:
    """The page with the verdicts of `gonio check --all`, and the reasons of declared breaches.

    `present`: the page as it is, whose verdicts are taken over; only missing ones are made.
    """
    models, before = kinds()["Models"], verdicts(present)
    lines = [
        "# What holds for which model",
        "",
        "`gonio check --all`: every model with its default parameters; [what each law measures](../check.md). Made by",
        "`python3 dev.py docs --laws`.",
        "",
        f"| model | {' | '.join(LAWS)} |",
        "|---" * (len(LAWS) + 1) + "|",
    ]
    for name, kind in models.items():
        of_model = before.get(name, {})
        if missing := [law for law in LAWS if law not in of_model]:
            of_model = of_model | dict.fromkeys(missing, "–") | check(kind(), laws=missing).verdicts
        cells = [of_model[law] if of_model[law] in ("pass", "–") else f"**{of_model[law]}**" for law in LAWS]
        lines.append(f"| [`{name}`]({name}.md) | {' | '.join(cells)} |")
    lines += ["", "“–”: does not apply. “breaks”: declared, with a reason:", ""]
    for name, kind in models.items():
        lines += [f"- `{name}`, {law}: {markdown(why)}" for law, why in kind.breaks.items()]
    return "\n".join(lines) + "\n"


def draw(folder: Path, named: Sequence[str], anew: bool) -> None:
    """Make the pictures of the classes that are named, or of all: those that are missing, or `anew`."""
    folder.mkdir(exist_ok=True)
    for classes in kinds().values():
        for name, kind in classes.items():
            picture = folder / f"{name}.jpg"
            if (name in named or not named) and (anew or not picture.exists()):
                portrait(eval(shown(kind), {"gn": gn}), gn.EnvironmentLight.studio(), picture)
                print(f"drawn: {picture.name}")
