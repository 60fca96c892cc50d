"""Which sides a reflectance has is asked in base alone, and where formats say what they hold: all other rooms take an
answer from there that serves either kind."""

import ast
from pathlib import Path

import gonio

SOURCE = Path(gonio.__file__).parent
ASKS = ("base/", "formats/_sides.py")
"""Where sides are compared."""


def is_sides(node: ast.AST, aliases: set[str]) -> bool:
    """Whether a node is the sides of something, or a name for them."""
    if isinstance(node, ast.NamedExpr):
        return is_sides(node.value, aliases)
    return (isinstance(node, ast.Attribute) and node.attr == "sides") or (
        isinstance(node, ast.Name) and node.id in aliases
    )


def pairs(target: ast.AST, value: ast.AST) -> list[tuple[ast.AST, ast.AST]]:
    """Targets of an assignment, each with what it is assigned."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        return list(zip(target.elts, value.elts, strict=False))
    return [(target, value)]


def aliases_of(tree: ast.AST) -> set[str]:
    """Names that are assigned the sides of something, or another such name."""
    assigned = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            assigned += [pair for target in node.targets for pair in pairs(target, node.value)]
        elif isinstance(node, (ast.AnnAssign, ast.NamedExpr)) and node.value is not None:
            assigned.append((node.target, node.value))
    names = set[str]()
    while True:
        found = {t.id for t, value in assigned if isinstance(t, ast.Name) and is_sides(value, names)}
        if found <= names:
            return names
        names |= found


def questions(code: str) -> list[int]:
    """The lines that compare the sides of something, match them, or ask whether there are any."""
    tree = ast.parse(code)
    lines = []
    scopes = [n for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))]
    for scope in [tree, *scopes]:
        names = aliases_of(scope) if scope is not tree else set[str]()
        for node in ast.walk(scope):
            compared = isinstance(node, ast.Compare) and any(is_sides(x, names) for x in (node.left, *node.comparators))
            matched = isinstance(node, ast.Match) and is_sides(node.subject, names)
            called = isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
            asked = (
                called
                and node.func.id in ("hasattr", "getattr")
                and any(isinstance(x, ast.Constant) and x.value == "sides" for x in node.args)
            )
            if compared or matched or asked:
                lines.append(node.lineno)
    return sorted(set(lines))


def test_questions_are_recognized():
    asked = (
        'm.sides == "front"',
        '"front" != m.sides',
        'm.sides in ("front", "both")',
        "m.of.sides not in KNOWN",
        'hasattr(m, "sides")',
        'getattr(m, "sides", None)',
        'def f(m):\n    sides = m.sides\n    return 1 if sides == "front" else 2',
        'def f(m):\n    a, b = m.sides, 1\n    c = a\n    return c != "front"',
        'def f(m):\n    return (s := m.sides) == "front" or s == "across"',
        'def f(m):\n    match m.sides:\n        case "front":\n            return 1',
    )
    for code in asked:
        assert questions(code), code
    for code in (
        "m.sides",
        'sides == "front"',
        "shines(light.sides, up)",
        'hasattr(m, "index")',
        "lit_sides(m)[0] == 1",
    ):
        assert not questions(code), code


def test_nobody_asks_for_sides_but_base_and_formats():
    files = [path.relative_to(SOURCE) for path in sorted(SOURCE.rglob("*.py"))]
    assert len(files) > 500
    rooms = [path for path in files if not path.as_posix().startswith(ASKS)]
    asked = [f"{path}:{line}" for path in rooms for line in questions((SOURCE / path).read_text(encoding="utf-8"))]
    assert not asked, "compare the sides of a reflectance; take an answer from base/sides.py:\n" + "\n".join(asked)


def test_base_asks():
    assert any(questions(path.read_text(encoding="utf-8")) for path in (SOURCE / "base").glob("*.py"))
