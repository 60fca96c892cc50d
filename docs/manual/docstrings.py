"""An extension of Sphinx: docstrings as gonio writes them, as reStructuredText, and signatures as they are written.

A docstring is prose with formulas, in which stars and underscores mean themselves, and parts that begin with a label,
"Units    1/sr". Lines that begin with "`name`: " say what an argument is, indented tables what attributes are.
"""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator, Mapping
from types import MappingProxyType, ModuleType
from typing import Annotated, Any, get_args, get_origin

from gonio.declared.arguments import Declared
from gonio.declared.namespace import places_of, value_at

LABEL = re.compile(r"^([A-Z][a-z]+)(?: {2,}(\S.*)|)$")
ARGUMENT = re.compile(r"^`[\w, *`]+`: ")
ROW = re.compile(r"^( +)(\S.*?)(?: {2,}(\S.*)|)$")
INLINE = re.compile(r"(`[^`]+`|\$\$.+?\$\$|\$[^$\n]+\$)", re.DOTALL)


def inline(text: str) -> str:
    """Prose as reStructuredText: names as links where they are public, formulas between dollars as such."""
    return "".join(_piece(piece) for piece in INLINE.split(text))


def _piece(piece: str) -> str:
    if piece[:1] == "`":
        text = piece.strip("`")
        place = text.removesuffix("()")
        place = place if place.startswith("gn.") else f"gn.{place}" if place[:1].isupper() else ""  # `lights` may be
        places = [p for p in places_of(place.rpartition(".")[2]) if is_explained(value_at(p))]  # an argument
        named = next((p for p in places if p == place or place == f"gn.{p.rpartition('.')[2]}"), None)
        return rf"\ :py:obj:`{text} <gonio.{named[3:]}>`\ " if named else rf"\ ``{text}``\ "
    if piece[:1] == "$" and len(piece) > 2:
        return rf"\ :math:`{' '.join(piece.strip('$').split())}`\ "
    return re.sub(r"([\\*_|<>])", r"\\\1", piece)


def is_explained(thing: Any) -> bool:
    """Whether the reference has an entry or a page for it."""
    return callable(thing) or isinstance(thing, ModuleType)


def parts(text: str) -> Iterator[tuple[str, list[str]]]:
    """The parts of a docstring: label, and lines; the first has the label ""."""
    label, lines = "", list[str]()
    for line in inspect.cleandoc(text).splitlines():
        if (head := LABEL.match(line)) and (head[2] or line in ("Example", "Parameters")):
            yield label, lines
            label, lines = head[1], [head[2]] if head[2] else []
        else:
            lines.append(line)
    yield label, lines


def blocks(lines: list[str]) -> Iterator[list[str]]:
    """Lines as paragraphs: cut at empty lines, before arguments, and where indentation begins or ends."""
    block = list[str]()
    for line in lines:
        begins = ARGUMENT.match(line) or (block and line[:1].isspace() != block[-1][:1].isspace())
        if block and (begins or not line.strip()):
            yield block
            block = []
        if line.strip():
            block.append(line)
    if block:
        yield block


def table(lines: list[str]) -> Iterator[str]:
    """An indented table, "name   what it is", as a definition list; other indented text as it is."""
    indent = min(len(line) - len(line.lstrip()) for line in lines)
    rows = list[tuple[str, str]]()
    for line in lines:
        if (row := ROW.match(line)) and len(row[1]) == indent and row[3]:
            rows.append((row[2], row[3]))
        elif rows and len(line) - len(line.lstrip()) > indent:
            rows[-1] = rows[-1][0], f"{rows[-1][1]} {line.strip()}"
        else:
            yield from ["::", "", *textwrap.indent(textwrap.dedent("\n".join(lines)), "   ").splitlines(), ""]
            return
    for name, meaning in rows:
        yield f"``{name}``"
        yield f"   {inline(meaning).strip()}"
    yield ""


def prose(lines: list[str]) -> Iterator[str]:
    """Paragraphs, lists of arguments and tables."""
    for block in blocks(lines):
        if block[0][:1] == " ":
            yield from table(block)
        elif ARGUMENT.match(block[0]):
            name, _, meaning = " ".join(block).partition(": ")
            names = ", ".join(f"``{word}``" for word in re.findall(r"[\w*]+", name))
            yield from [names, f"   {inline(meaning).strip()}", ""]
        else:
            yield from [line if k else line.lstrip() for k, line in enumerate(inline("\n".join(block)).splitlines())]
            yield ""


def as_rst(text: str) -> list[str]:
    """A docstring as lines of reStructuredText."""
    out, labelled = list[str](), list[str]()
    example, parameters = list[str](), list[str]()
    for label, lines in parts(text):
        if label == "Example":
            example = [
                ".. rubric:: Example",
                "",
                ".. code-block:: pycon",
                "",
                *textwrap.indent("\n".join(lines).strip(), "   ").splitlines(),
                "",
            ]
        elif label == "Parameters":
            parameters = [".. rubric:: Parameters", "", *table(lines)]
        elif label:
            labelled += [f":{label}: " + " ".join(inline(" ".join(lines)).split()), ""]
        else:
            out += prose(lines)
    return [*out, *parameters, *labelled, *example]


def on_docstring(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    lines[:] = as_rst("\n".join(lines))


class _Plain(ast.NodeTransformer):
    """`Annotated[int, Declared("how many", 1, 9)]` becomes `int`, and so does a name for it in the file."""

    def __init__(self, scope: Mapping[str, Any]):
        self.scope = scope

    def visit_Name(self, node: ast.Name) -> ast.expr:
        value = self.scope.get(node.id)
        if not any(isinstance(x, Declared) for x in getattr(value, "__metadata__", ())):
            return node
        text = re.sub(r"\b[a-z_]+(?:\.[a-z_]+)*\.", "", inspect.formatannotation(get_args(value)[0]))
        return ast.parse(text, mode="eval").body

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        self.generic_visit(node)
        is_annotated = isinstance(node.value, ast.Name) and node.value.id == "Annotated"
        return node.slice.elts[0] if is_annotated and isinstance(node.slice, ast.Tuple) else node


def written(annotation: Any, scope: Mapping[str, Any] = MappingProxyType({})) -> str:
    """An annotation as it stands in the file."""
    if get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    text = "np.ndarray" if text.startswith("numpy.ndarray") else text
    return ast.unparse(_Plain(scope).visit(ast.parse(text, mode="eval")))


def signature(thing: Any) -> tuple[str, str] | None:
    """Parameters and result of a callable as they are written; None where Python cannot tell."""
    try:
        found = inspect.signature(thing)
    except (TypeError, ValueError):
        return None
    words, keyword_only = [], False
    scope = getattr(inspect.unwrap(thing), "__globals__", {})
    parameters = list(found.parameters.values())
    if parameters and parameters[0].name in ("self", "cls"):
        del parameters[0]
    for p in parameters:
        if p.kind is p.KEYWORD_ONLY and not keyword_only:
            keyword_only = True
            words.append("*")
        star = {p.VAR_POSITIONAL: "*", p.VAR_KEYWORD: "**"}.get(p.kind, "")
        keyword_only = keyword_only or star == "*"
        word = star + p.name + ("" if p.annotation is p.empty else f": {written(p.annotation, scope)}")
        if p.default is not p.empty:
            default = "..." if p.default is ... else re.sub(r"<.*?>", "...", repr(p.default))
            word += f" = {default}" if ": " in word else f"={default}"
        words.append(word)
    returned = found.return_annotation
    result = "" if returned is found.empty or isinstance(thing, type) else written(returned)
    return f"({', '.join(words)})", result


def on_signature(app: Any, what: str, name: str, thing: Any, options: Any, given: Any, result: Any) -> Any:
    return signature(thing) if what in ("class", "function", "method", "exception") else None


def setup(app: Any) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", on_docstring)
    app.connect("autodoc-process-signature", on_signature)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
