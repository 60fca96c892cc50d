"""Make the pages of the models from their docstrings: python docs/models/make.py [--text] [NAME ...]

Each model, distribution of normals and Fresnel term has a page with formula, parameters, source and picture. Pictures
are made anew for the names given, or for all; --text leaves them as they are.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gonio as gn
from gonio import discover
from gonio.base.reflectance import Reflectance
from gonio.discover import docstring
from gonio.formula.distribution import Distribution
from gonio.formula.fields import CLASSES, Option, Param, Part
from gonio.formula.fresnel_term import Fresnel
from gonio.formula.parametrised import Parametrised, literal
from gonio.laws import check_all, table
from gonio.report.figures import portrait

HERE = Path(__file__).parent
KINDS = {
    "Models": (Reflectance, discover.modules("gonio.models")),
    "Distributions of facet normals": (Distribution, discover.modules("gonio.distributions")),
    "Fresnel terms": (Fresnel, discover.modules("gonio.formula.fresnel")),
}
PARTS = ("Looks", "Shapes", "Units", "Error", "Source")


def classes(kind: type, modules: list[Any]) -> list[type[Parametrised]]:
    """The public classes of a kind that modules define, in the order of their names."""
    own = {v for m in modules for v in vars(m).values() if isinstance(v, type) and v.__module__ == m.__name__}
    return sorted((v for v in own if issubclass(v, kind) and v is not kind and v.__name__[0] != "_"), key=by_name)


def by_name(kind: type) -> str:
    return kind.__name__


def sections(kind: type) -> dict[str, str]:
    """A docstring cut into its parts; what stands before them is under ""."""
    found, name = {"": ""}, ""
    for text in docstring(kind).splitlines():
        head = re.match(rf"({'|'.join(PARTS)}) +(.*)", text)
        if head:
            name, text = head[1], head[2]
        found[name] = found.get(name, "") + "\n" + (text if not name else text.strip())
    return {name: text.strip() for name, text in found.items()}


def markdown(text: str) -> str:
    """Text of a docstring as Markdown: formulas keep their stars and underscores."""
    cut = re.split(r"(`[^`]*`)", text)
    return "".join(part if part[:1] == "`" else re.sub(r"([*_<>|])", r"\\\1", part) for part in cut)


def first_line(kind: type) -> str:
    return sections(kind)[""].split("\n\n")[0].replace("\n", " ")


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
        elif isinstance(field, Option):
            words = ", ".join(f"`{c}`" for c in dict.fromkeys(field.choices))
            yield f"| `{name}` | `{field.default}` | {words} | {markdown(field.doc)} |"
        elif isinstance(field, Part):
            yield f"| `{name}` | `{literal(field.default)}` | a {field.kind.__name__} | {markdown(field.doc)} |"


def page(kind: type[Parametrised]) -> str:
    """The page of a class."""
    name, parts = kind.__name__, sections(kind)
    lines = [f"# {name}", "", f"![{name}: a sphere, and slices of f](pictures/{name}.jpg)", "", markdown(parts[""]), ""]
    if kind.fields:
        lines += [*parameters(kind), ""]
    lines += [f"- **{part}.** {markdown(parts[part])}" for part in PARTS if part in parts]
    for law, why in getattr(kind, "breaks", {}).items():
        lines.append(f"- **Breaks {law}.** {markdown(why)}")
    lines += ["", "```python", "import gonio as gn", "", f"m = {shown(kind)}", "```", ""]
    lines.append(f"`gonio cite {name}` prints the sources as BibTeX. [All models](README.md)")
    return "\n".join(lines) + "\n"


def shown(kind: type[Parametrised]) -> str:
    """The expression that the picture of a class shows."""
    if issubclass(kind, Distribution):
        return f"gn.Microfacet(gn.{kind.__name__}({'0.3' if 'alpha' in str(kind.fields) else ''}))"
    if issubclass(kind, Fresnel):
        return f"gn.Microfacet(gn.GGX(0.1), gn.{kind.__name__}())"
    return f"gn.{kind.__name__}()"


def index() -> str:
    """The page that lists all."""
    lines = ["# Models", "", "Made from the docstrings by `python docs/models/make.py`. [How to choose](choose.md), "]
    lines[-1] += "[what holds for which](laws.md)."
    for heading, (kind, modules) in KINDS.items():
        lines += ["", f"## {heading}", "", "| | | |", "|---|---|---|"]
        for own in classes(kind, modules):
            n = own.__name__
            picture = f'<img src="pictures/{n}.jpg" alt="{n}" width="220">'
            lines.append(f"| [`{n}`]({n}.md) | {picture} | {markdown(first_line(own))} |")
    return "\n".join(lines) + "\n"


def pages() -> dict[str, str]:
    """Every page that is made from docstrings, by file name."""
    every = [own for kind, modules in KINDS.values() for own in classes(kind, modules)]
    return {f"{own.__name__}.md": page(own) for own in every} | {"README.md": index()}


def lawful() -> str:
    """The page with the verdicts of `gonio check --all`, and the reasons of declared breaches."""
    reports = check_all()
    header, *rows = table(reports)
    lines = [
        "# What holds for which model",
        "",
        "`gonio check --all`, every model with its default parameters; what each ",
    ]
    lines[-1] += "law measures: [the laws](../check.md). Made by `python docs/models/make.py`."
    lines += ["", f"| {' | '.join(header)} |", "|---" * len(header) + "|"]
    for name, *verdicts in rows:
        cells = [f"**{v}**" if v not in ("pass", "–") else v for v in verdicts]
        lines.append(f"| [`{name}`]({name}.md) | {' | '.join(cells)} |")
    lines += ["", "“–”: does not apply. “breaks”: declared, with a reason:", ""]
    for name in reports:
        lines += [f"- `{name}`, {law}: {markdown(why)}" for law, why in CLASSES[name].breaks.items()]
    return "\n".join(lines) + "\n"


def main() -> None:
    names = [a for a in sys.argv[1:] if a[:2] != "--"]
    for name, text in pages().items():
        (HERE / name).write_text(text, encoding="utf-8")
    if "--text" in sys.argv:
        return
    if not names:
        (HERE / "laws.md").write_text(lawful(), encoding="utf-8")
    (HERE / "pictures").mkdir(exist_ok=True)
    for kind, modules in KINDS.values():
        for own in classes(kind, modules):
            if not names or own.__name__ in names:
                made = eval(shown(own), {"gn": gn})
                portrait(made, HERE / "pictures" / f"{own.__name__}.jpg", gn.EnvironmentLight.studio())


if __name__ == "__main__":
    main()
