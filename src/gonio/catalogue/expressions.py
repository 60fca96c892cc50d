"""Material expressions, parsed and never executed: `0.2 * Lambertian(0.5) + Microfacet(GGX(0.1), 0.9)`.

An expression consists of constructors of models and their pieces with positional and keyword arguments, numbers, lists
of numbers or of layers, words in quotes, `+`, `*`, parentheses, `material("name")` and, if the caller allows files,
`load("path")`; `gn.` before a name is ignored. Numbers may be computed with + - * / and `pi`.
"""

from __future__ import annotations

import ast
import difflib
import math
import operator
import os
import re
import warnings
from collections.abc import Callable
from typing import Any, NoReturn

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..base.sums import Scaled, Sum
from ..declared.arguments import checked
from ..errors import DependencyError, Error, ExpressionError
from ..formats import load
from ..formula import tree
from ..formula.bounds import MAX_DEPTH, MAX_LENGTH
from ..formula.json_form import SPECTRA, kind_of, names
from ..formula.parametrised import Parametrised
from ..formula.spectrum import Spectrum
from ..layers.layer import Layer
from .builtin import find, material

_ARITHMETIC: dict[type[ast.operator], tuple[str, Callable[[float, float], float]]] = {
    ast.Add: ("+", operator.add),
    ast.Sub: ("-", operator.sub),
    ast.Mult: ("*", operator.mul),
    ast.Div: ("/", operator.truediv),
}
_NUMBERS = {"pi": math.pi, "inf": math.inf, "nan": math.nan}
_FUNCTIONS: dict[str, Callable[..., Any]] = {"load": load, "material": material, **SPECTRA}


@checked
def expression(text: str, files: bool = False) -> Reflectance:
    """The reflectance that an expression describes: `expression(repr(m)) == m`, for a measurement with `files=True`.

    Nothing is executed: names stand for gonio's classes only. `files`: whether `load("path")` and paths of pictures may
    open files, as on the command line; not for texts of strangers, who would learn which files exist.
    Raises ExpressionError with the column, the text there and the expected text; ParameterError for a value out of its
    bounds; for a file NotFoundError or FormatError, which reveal nothing of its content.

    Example
    >>> m = gn.expression('Lambertian(0.2) + 0.5 * material("gold", alpha=0.3)')
    >>> print(m.terms[0], gn.expression(repr(m)) == m)
    Lambertian(rho=0.2) True
    """
    value = read(text, files=files)
    if not isinstance(value, Reflectance):
        noun = type(value).__name__ if isinstance(value, Parametrised) else describe(value)
        shown = repr(text if len(text) <= 60 else text[:57] + "...")
        advice = Reflectance._instead(value).replace("gn.", "") if isinstance(value, Parametrised) else ""
        expected = f"; {advice}" if advice else " such as Lambertian(0.5)"
        raise ExpressionError(f"{shown}: {noun}, expected a reflectance{expected}")
    return value


def read(text: str, words: bool = False, files: bool = False) -> Any:
    """The value an expression describes: a reflectance, a piece of one, a light, a number, a list or a word.

    `words`: whether a single name without quotes is a word: `height_correlated`. `files`: see `expression`.
    """
    return _ExpressionReader(text, words, files).read()


def describe(value: Any) -> str:
    """A value in words, for messages."""
    if isinstance(value, float):
        return f"the number {value:g}"
    if isinstance(value, str):
        return f"the word {value!r}"
    if isinstance(value, list):
        return "a list"
    return f"a {type(value).__name__}"


def _opened(make: Callable[..., Any], arguments: list[Any], named: dict[str, Any]) -> list[str]:
    """The paths of the files that a call opens."""
    if isinstance(make, type) and issubclass(make, Parametrised):
        return tree.files_among(make, arguments, named)
    first = [*arguments, *named.values()][:1] if make is load else []
    return [path for path in first if isinstance(path, str)]


def _added(terms: list[Any]) -> Any:
    return Sum._joined(terms) if len(terms) > 1 else terms[0]


class _ExpressionReader:
    def __init__(self, text: str, words: bool, files: bool):
        self.text, self.words, self.files = text.strip().replace("\n", " "), words, files

    def read(self) -> Any:
        if not self.text:
            raise ExpressionError("an empty expression; expected one such as Lambertian(0.5)")
        if len(self.text) > MAX_LENGTH:
            raise ExpressionError(
                f"an expression of {len(self.text)} characters; expected at most {MAX_LENGTH}; write "
                f"the material to a .json file instead"
            )
        self._check_nesting()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # Python's own, about the text
                body = ast.parse(self.text, mode="eval").body
        except SyntaxError as error:
            column = error.offset or 1
            self._fail(column, f"{error.msg}; expected an expression such as 0.5 * Lambertian(0.2) + Phong(0.1, 20)")
        except (ValueError, MemoryError, RecursionError) as error:
            self._fail(1, f"cannot be read ({error or type(error).__name__}); expected printable text and less nesting")
        return self._value(body, 0)

    def _check_nesting(self) -> None:
        depth = 0
        for column, character in enumerate(self.text, 1):
            depth += (character in "([{") - (character in ")]}")
            if depth > MAX_DEPTH:
                self._fail(column, f"brackets nested more than {MAX_DEPTH} deep")

    def _fail(self, where: int | ast.AST, what: str) -> NoReturn:
        """Raises the error; its first line is complete, two more show the place."""
        if isinstance(where, ast.AST):
            start = getattr(where, "col_offset", 0)  # in bytes
            where = len(self.text.encode()[:start].decode(errors="ignore")) + 1
        first = max(0, where - 60)
        shown = self.text[first : first + 100]
        caret = " " * (where - 1 - first) + "^"
        raise ExpressionError(f"expression, column {where}: {what}\n  {shown}\n  {caret}")

    def _value(self, node: ast.expr, depth: int) -> Any:
        if depth > MAX_DEPTH:
            self._fail(node, f"nested more than {MAX_DEPTH} deep; expected less nesting")
        if isinstance(node, ast.Constant):
            return self._constant(node)
        if isinstance(node, ast.BinOp):
            return self._operations(node, depth)
        if isinstance(node, ast.UnaryOp):
            return self._signed(node, depth)
        if isinstance(node, (ast.List, ast.Tuple)):
            return [self._element(item, depth + 1) for item in node.elts]
        if isinstance(node, ast.Call):
            return self._call(node, depth)
        name = self._name(node)
        if name is None:
            node_name = "".join(f" {c.lower()}" if c.isupper() else c for c in type(node).__name__)
            self._fail(node, f"a{node_name} is no part of an expression; expected numbers, names with (...), + and *")
        if name in _NUMBERS:
            return _NUMBERS[name]
        is_known = kind_of(name) is not None
        if self.words and depth == 0 and not is_known:
            return name
        if is_known or name in _FUNCTIONS:
            self._fail(node, f"{name} without arguments; write {name}(...)")
        return self._unknown(node, name)

    def _constant(self, node: ast.Constant) -> Any:
        value = node.value
        if isinstance(value, str):
            return value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self._fail(node, f"{value!r:.40} is neither a number nor a word in quotes")
        try:
            return float(value)
        except OverflowError:
            self._fail(node, "a number beyond the range of floating point")

    def _element(self, node: ast.expr, depth: int) -> Any:
        value = self._value(node, depth)
        if not isinstance(value, (float, list, Layer)):
            self._fail(node, f"{describe(value)} in a list; expected numbers, or layers of a Stack")
        return value

    def _signed(self, node: ast.UnaryOp, depth: int) -> float:
        value = self._value(node.operand, depth + 1)
        if not isinstance(node.op, (ast.USub, ast.UAdd)) or not isinstance(value, float):
            self._fail(node, f"a sign before {describe(value)}; expected it before a number")
        return -value if isinstance(node.op, ast.USub) else value

    def _operations(self, node: ast.BinOp, depth: int) -> Any:
        # A long sum is a deep tree to Python; walked down here, so that its length counts as no nesting.
        chain: list[ast.BinOp] = []
        first: ast.expr = node
        while isinstance(first, ast.BinOp):
            chain.append(first)
            first = first.left
        terms = [self._value(first, depth + 1)]  # added at the end: a sum for each plus would take all before it anew
        for step in reversed(chain):
            other = self._value(step.right, depth + 1)
            if isinstance(step.op, ast.Add) and isinstance(terms[-1], Reflectance) and isinstance(other, Reflectance):
                terms.append(other)
            else:
                terms = [self._combined(step, _added(terms), other)]
        return _added(terms)

    def _combined(self, node: ast.BinOp, a: Any, b: Any) -> Any:
        sign, compute = _ARITHMETIC.get(type(node.op), ("", operator.add))
        if isinstance(a, float) and isinstance(b, float) and sign:
            try:
                result = compute(a, b)
            except ZeroDivisionError:
                result = math.nan
            if not math.isfinite(result):
                self._fail(node, f"{a:g} {sign} {b:g} is no finite number")
            return result
        if sign == "*" and isinstance(b, Reflectance) and isinstance(a, (float, list, Spectrum)):
            return Scaled(a, b)
        if sign == "*" and isinstance(a, Reflectance) and isinstance(b, (float, list, Spectrum)):
            return Scaled(b, a)
        rule = "expected reflectance + reflectance, number * reflectance, or numbers with + - * /"
        symbol = sign or type(node.op).__name__
        return self._fail(node.right, f"{describe(a)} {symbol} {describe(b)}; {rule}")

    def _call(self, node: ast.Call, depth: int) -> Any:
        name = self._name(node.func)
        if name is None:
            self._fail(node, "a call of something that is no name; expected a model such as Lambertian(0.5)")
        make = _FUNCTIONS.get(name) or kind_of(name)
        if make is None:
            self._unknown(node, name)
        for item in node.args:
            if isinstance(item, ast.Starred):
                self._fail(item, "arguments are given one by one, without *")
        arguments = [self._value(item, depth + 1) for item in node.args]
        named = {}
        for keyword in node.keywords:
            if keyword.arg is None:
                self._fail(keyword.value, "arguments are given one by one, without **")
            named[keyword.arg] = self._value(keyword.value, depth + 1)
        opened = _opened(make, arguments, named)
        for path in opened:
            self._check_opening(node, name, path)
        try:
            return make(*arguments, **named)
        except DependencyError:
            raise
        except Error as error:
            if opened and os.path.exists(opened[0]):  # nothing of the content, for those who may not read the file
                what = "is of no known format, damaged, or lacks what was asked for; `gonio info` of it says more"
                raise type(error)(f"{name}(...): the file {opened[0]!r:.200} {what}") from None
            raise
        except (TypeError, ValueError) as error:
            self._fail(node, f"{name}(...): {error}")

    def _check_opening(self, node: ast.Call, name: str, path: str) -> None:
        if not self.files:
            what = "and this text may open none; if you trust it, give files=True, or load the file yourself"
            self._fail(node, f"{name}(...) opens the file {path!r:.200}, {what}")
        if os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path):
            self._fail(node, f"{name}(...): {path!r:.200} is a pipe or a device, expected a file")

    def _name(self, node: ast.expr) -> str | None:
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in ("gn", "gonio"):
            return node.attr
        return node.id if isinstance(node, ast.Name) else None

    def _material_at(self, node: ast.expr) -> str | None:
        """The longest name of a built-in material at a node: gold-metallic-paint, of which the node is gold."""
        column = len(self.text.encode()[: node.col_offset].decode(errors="ignore"))
        words = (m[0] for m in re.finditer(r"[\w-]+", self.text) if m.start() <= column < m.end())
        parts = next(words, "").split("-")
        candidates = ("-".join(parts[:count]) for count in range(len(parts), 0, -1))
        return next((name for name in candidates if find(name) is not None), None)

    def _unknown(self, node: ast.expr, name: str) -> NoReturn:
        classes = [n for n, cls in names().items() if not issubclass(cls, Light)]
        lower = {n.lower(): n for n in [*classes, *_FUNCTIONS]}
        start = len(self.text.encode()[: node.col_offset].decode(errors="ignore"))
        hyphened = re.match(r"[\w-]*", self.text[start:])  # to Python a difference: gold - metallic - paint
        if hyphened is not None and find(hyphened[0]) is not None:
            name = hyphened[0]
        close = difflib.get_close_matches(name.lower(), lower, n=1)
        built_in = self._material_at(node) or name
        if find(built_in) is not None:
            what = f'{built_in} is a built-in material; write material("{built_in}")'
        elif name == "array":
            what = "a long array cannot be written in an expression; write the material to a .json file"
        elif close:
            what = f"unknown name {name!r}; did you mean {lower[close[0]]}?"
        else:
            what = f"unknown name {name!r}; expected one of {', '.join(sorted(classes))}, material, load"
        self._fail(node, what)
