"""Places of the source that can be broken: a sign, a factor, a bound, an axis, a key; what becomes of their lines.

Only code of functions: no text, no message, no type, no default.
"""

from __future__ import annotations

import ast
import copy
import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SEED, COUNT = 31, 60

SWAPPED = {
    "minimum": ("bound", "maximum"),
    "maximum": ("bound", "minimum"),
    "min": ("bound", "max"),
    "max": ("bound", "min"),
    "any": ("bound", "all"),
    "all": ("bound", "any"),
    "floor": ("bound", "ceil"),
    "ceil": ("bound", "floor"),
    "sin": ("function", "cos"),
    "cos": ("function", "sin"),
    "mean": ("function", "sum"),
    "x": ("axis", "y"),
    "y": ("axis", "x"),
    "z": ("axis", "x"),
    "wi": ("direction", "wo"),
    "wo": ("direction", "wi"),
    "float64": ("dtype", "float32"),
    "float32": ("dtype", "float64"),
}
"""Names that stand for each other, and the kind of fault that it is to take the other."""

DTYPES = {"f8": "f4", "f4": "f8", "<f4": ">f4", "<f8": ">f8", "<i4": ">i4", ">f4": "<f4", "u1": "i1", "<u4": ">u4"}
UNITS = {180.0, 360.0, 90.0, 1e-9, 1e9, 1e-6, 1e6, 1e-3, 1e3, 100.0}
OPERATORS: dict[type[Any], tuple[str, type[Any]]] = {
    ast.Add: ("sign", ast.Sub),
    ast.Sub: ("sign", ast.Add),
    ast.Mult: ("factor", ast.Div),
    ast.Div: ("factor", ast.Mult),
    ast.Lt: ("bound", ast.Gt),
    ast.Gt: ("bound", ast.Lt),
    ast.LtE: ("bound", ast.GtE),
    ast.GtE: ("bound", ast.LtE),
}
WITH_OR_WITHOUT = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
"""Comparisons with a whole number: what is equal to it belongs to the other side."""

SYMMETRIC = {"dot", "minimum", "maximum", "isinstance", "hasattr", "getattr", "zip", "min", "max", "cast", "hypot"}
SILENT = {"warn", "print", "echo", "cast", "TypeVar"}
"""Calls whose arguments are texts or types."""


@dataclass(frozen=True)
class Fault:
    """One place, broken: the lines of a file that hold it, and what they become."""

    path: str
    line: int
    function: str
    kind: str
    change: str
    old: str
    new: str

    def __str__(self) -> str:
        return f"{self.place} {self.kind}: {self.change}"

    @property
    def place(self) -> str:
        return f"{self.path}:{self.line}"

    @property
    def words(self) -> list[str]:
        """What tests of it may name: its function, its class, its module."""
        names = [name for name in self.function.split(".") if len(name) > 2 and name[:2] != "__"]
        stem = Path(self.path).stem
        return [*names, Path(self.path).parent.name if stem == "__init__" else stem]


def changed(node: ast.AST, **fields: Any) -> Any:
    new = copy.copy(node)
    for name, value in fields.items():
        setattr(new, name, value)
    return new


def faults(node: ast.AST, keys: list[str]) -> Iterator[tuple[str, Any]]:
    """Kinds of faults of an expression or a statement, and what it becomes."""
    match node:
        case ast.BinOp(left, op, ast.Constant(int(n))) if isinstance(op, ast.Add | ast.Sub) and n == 1:
            yield "node", left
        case ast.BinOp(left, ast.BitAnd(), _):
            yield "mask", left
        case ast.BinOp(left, op, _) if type(op) in OPERATORS and not isinstance(left, ast.Constant | ast.JoinedStr):
            kind, other = OPERATORS[type(op)]
            yield kind, changed(node, op=other())
        case ast.UnaryOp(ast.USub(), ast.Name() | ast.Attribute() | ast.Call()):
            yield "sign", node.operand
        case ast.UnaryOp(ast.Invert() | ast.Not(), operand):
            yield "mask", operand
        case ast.BoolOp(ast.And(), [_, *rest]):
            yield "mask", rest[0] if len(rest) == 1 else changed(node, values=rest)
        case ast.Compare(_, [op], [ast.Constant(int())]) if type(op) in WITH_OR_WITHOUT:
            yield "bound", changed(node, ops=[WITH_OR_WITHOUT[type(op)]()])
        case ast.Compare(_, [op], _) if type(op) in OPERATORS:
            kind, other = OPERATORS[type(op)]
            yield kind, changed(node, ops=[other()])
        case ast.Subscript(ast.Name(name) | ast.Attribute(_, name), ast.Tuple([ast.Name() as first, _])) if _kept(name):
            yield "cache", changed(node, slice=first)
        case ast.Subscript(_, ast.Constant(str(key))) if len(keys) > 1 and isinstance(node.ctx, ast.Load):
            yield "key", changed(node, slice=ast.Constant(keys[keys.index(key) - 1]))
        case ast.Subscript(_, ast.Slice(lower, ast.Constant(int(n)), step)) if n > 1:
            kind = "channel" if n == 3 else "node"
            yield kind, changed(node, slice=ast.Slice(lower, ast.Constant(n - 1), step))
        case ast.Subscript(_, ast.Slice(ast.Constant(int(n)), upper, step)):
            yield "node", changed(node, slice=ast.Slice(ast.Constant(n + 1), upper, step))
        case ast.Subscript(_, ast.Slice(None, None, ast.UnaryOp(ast.USub(), ast.Constant(1)))):
            yield "order", node.value
        case ast.Subscript(_, ast.Tuple([*most, ast.Constant(int(n))])):
            yield (
                "axis",
                changed(node, slice=changed(node.slice, elts=[*most, ast.Constant(n + 1 if n < 1 else n - 1)])),
            )
        case ast.Assign([ast.Name(name)], ast.Tuple([first, _, *rest])) if _kept(name):
            yield "cache", changed(node, value=changed(node.value, elts=[first, *rest]))
        case ast.Expr(ast.Call(ast.Attribute(_, "clear" | "move_to_end" | "discard" | "pop" | "popitem"))):
            yield "cache", ast.Pass()
        case ast.If(_, [ast.Raise()], []):
            yield "validation", changed(node, test=ast.Constant(False))
        case ast.Expr(ast.Call(ast.Name(name))) if re.match("_?(check|require|refuse|need|must|valid)", name):
            yield "validation", ast.Pass()
        case ast.IfExp():
            yield "branch", changed(node, body=node.orelse, orelse=node.body)
        case ast.Constant(str(word)) if word in DTYPES:
            yield "dtype", ast.Constant(DTYPES[word])
        case ast.Constant(float(x)) if x in UNITS:
            yield "unit", ast.Constant(1.0)
        case ast.Constant(float(x)) if x not in (0.0, 1.0) and abs(x) < 1e3:
            yield "factor", ast.Constant(2.0 * x if x != 2.0 else 1.0)
        case ast.Attribute(_, word) if word in SWAPPED and isinstance(node.ctx, ast.Load):
            kind, other = SWAPPED[word]
            yield kind, changed(node, attr=other)
        case ast.Name("wi" | "wo" | "min" | "max" | "any" | "all" as word) if isinstance(node.ctx, ast.Load):
            kind, other = SWAPPED[word]
            yield kind, changed(node, id=other)
        case ast.Call(ast.Name(word) | ast.Attribute(_, word), args, keywords):
            yield from _of_call(node, word, args, keywords)


def _of_call(node: ast.Call, word: str, args: list[Any], keywords: list[Any]) -> Iterator[tuple[str, Any]]:
    for k, keyword in enumerate(keywords):
        others = [keywords[:k], keywords[k + 1 :]]
        if keyword.arg == "axis":
            wrong = ast.Constant(0) if ast.unparse(keyword.value) != "0" else ast.Constant(-1)
            yield "axis", changed(node, keywords=[*others[0], ast.keyword("axis", wrong), *others[1]])
        if keyword.arg == "channels" and not isinstance(keyword.value, ast.Constant):
            yield (
                "channel",
                changed(node, keywords=[*others[0], ast.keyword("channels", ast.Constant(None)), *others[1]]),
            )
    if word == "where" and len(args) == 3:
        yield "mask", args[1]
    elif word in ("sqrt", "radians", "degrees", "sorted", "abs", "absolute", "clip") and args:
        yield {"radians": "unit", "degrees": "unit", "sorted": "order", "clip": "bound"}.get(word, "function"), args[0]
    elif word in ("get", "setdefault", "known") and args and isinstance(args[0], ast.Tuple) and len(args[0].elts) > 1:
        yield "cache", changed(node, args=[changed(args[0], elts=args[0].elts[:-1]), *args[1:]])
    elif word == "range" and len(args) == 1:
        yield "node", changed(node, args=[ast.BinOp(args[0], ast.Sub(), ast.Constant(1))])
    elif word not in SYMMETRIC and len(args) > 1 and all(isinstance(x, ast.Name | ast.Attribute) for x in args[:2]):
        names = [ast.unparse(x) for x in args[:2]]
        kind = "direction" if all(re.fullmatch(r"(\w+\.)?w[iom]?", x) for x in names) else "arguments"
        if names[0] != names[1]:
            yield kind, changed(node, args=[args[1], args[0], *args[2:]])


def _kept(name: str) -> bool:
    return bool(re.search("(^|_)(key|cache|kept|known|plans|stamp|state)", name.lower()))


def places(path: str, text: str) -> Iterator[Fault]:
    """Every fault that a file's functions can have."""
    lines = text.encode().split(b"\n")
    tree = ast.parse(text)
    keys = sorted(
        {
            n.slice.value
            for n in ast.walk(tree)
            if isinstance(n, ast.Subscript) and isinstance(n.slice, ast.Constant) and isinstance(n.slice.value, str)
        }
    )

    def visit(node: ast.AST, function: str, inside: bool) -> Iterator[Fault]:
        if isinstance(node, ast.Raise | ast.JoinedStr | ast.Assert | ast.arguments):
            return
        called = node.func if isinstance(node, ast.Call) else None
        if getattr(called, "attr", getattr(called, "id", "")) in SILENT:
            return
        if inside:
            for kind, new in faults(node, keys):
                yield fault(node, new, kind, function)
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "bases", "keywords") and not isinstance(
                node, ast.Call
            ):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.FunctionDef | ast.ClassDef):
                    yield from visit(child, f"{function}.{child.name}".lstrip("."), isinstance(child, ast.FunctionDef))
                elif isinstance(child, ast.AST):
                    yield from visit(child, function, inside)

    def fault(node: Any, new: Any, kind: str, function: str) -> Fault:
        whole, new = (node.test, new.test) if isinstance(node, ast.If) else (node, new)
        said = ast.unparse(new)
        atom = isinstance(new, ast.Name | ast.Attribute | ast.Call | ast.Constant | ast.Subscript | ast.stmt)
        first, last = whole.lineno - 1, whole.end_lineno
        old = b"\n".join(lines[first:last])
        after = lines[last - 1][whole.end_col_offset :]
        put = old[: whole.col_offset] + (said if atom else f"({said})").encode() + after
        return Fault(path, whole.lineno, function, kind, _change(ast.unparse(whole), said), old.decode(), put.decode())

    yield from visit(tree, "", False)


def _change(old: str, new: str) -> str:
    """Both texts; of long ones what stands around the first difference."""
    at = next((k for k, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), 0)
    start = max(0, at - 30) if max(len(old), len(new)) > 70 else 0
    return " -> ".join(" ".join(text[start : start + 70].split()) for text in (old, new))


def chosen(tree: Path, seed: int = SEED) -> list[Fault]:
    """Places of each room, one at least, more of large ones; the kinds of faults in turn."""
    found: dict[str, list[Fault]] = {}
    for file in sorted((tree / "src" / "gonio").rglob("*.py")):
        path = file.relative_to(tree).as_posix()
        found.setdefault(room(path), []).extend(places(path, file.read_text(encoding="utf-8")))
    draw, used, result = random.Random(seed), dict[str, int](), []
    rooms = sorted(name for name, all_ in found.items() if all_)
    rooms += draw.choices(rooms, [len(found[name]) ** 0.5 for name in rooms], k=COUNT - len(rooms))
    for name in sorted(rooms):
        kinds = {m.kind for m in found[name]} - {m.kind for m in result if room(m.path) == name}
        rarest = min(sorted(kinds), key=lambda kind: (used.get(kind, 0), draw.random()))
        used[rarest] = used.get(rarest, 0) + 1
        result.append(draw.choice([m for m in found[name] if m.kind == rarest]))
    return result


def room(path: str) -> str:
    """The folder of the package that a file is in."""
    parts = path.split("/")
    return parts[2] if len(parts) > 3 else ""
