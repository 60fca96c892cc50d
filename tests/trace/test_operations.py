"""All that gonio knows of an elementary function stands in three files: its row, its LLVM, a formula for languages."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import PACKAGE, ROOT

from gonio.arrays.ops import ELEMENTARY

KNOWING = ("arrays", "trace", "compile", "evaluate", "bridges/source", "bridges/mitsuba/walk.py")
"""What computes, rewrites or writes operations."""

BY_THEIR_ALGEBRA = {
    "sqrt": "passes see products of powers, whose exponents count halves; kernels estimate roots and their reciprocals",
    "minimum": "of whole numbers too; kernels choose what is NaN, and passes whether one side decides about the sign",
    "maximum": "as the minimum",
}
"""Elementary functions that several files reason about, and why. Those of `arrays/operations.py` are others:
sums, products, quotients, choices, comparisons, whole numbers, tables and loops are what graphs and languages are."""


def named(tree: ast.Module) -> Iterator[str]:
    """What a file speaks of by itself, in texts, definitions, variables and keywords. Attributes are of something else:
    `ops.exp(x)` is a formula that uses the function, `v.floor(x)` an instruction of LLVM."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant):
            yield str(node.value)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name.removeprefix("op_").strip("_")
        elif isinstance(node, ast.Name):
            yield node.id.strip("_")
        elif isinstance(node, ast.arg | ast.keyword):
            yield node.arg or ""
        elif isinstance(node, ast.alias):
            yield node.name


def test_a_function_is_known_to_three_files():
    paths = [
        path
        for room in KNOWING
        for path in ([PACKAGE / room] if room.endswith(".py") else (PACKAGE / room).rglob("*.py"))
    ]
    places: dict[str, list[str]] = {name: [] for name in ELEMENTARY}
    for path in paths:
        for name in places.keys() & set(named(ast.parse(path.read_text(encoding="utf-8")))):
            places[name].append(str(path.relative_to(PACKAGE)))
    assert all(str(Path("arrays", "ops.py")) in files for files in places.values())
    assert {name for name, files in places.items() if len(files) > 3} == BY_THEIR_ALGEBRA.keys(), places


ADDED = re.findall(
    r"^```python notest\n# src/gonio/(\S+)\n(.*?)^```$",
    (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"),
    re.M | re.S,
)
"""Files, and what CONTRIBUTING.md adds to each."""

TRIED = """
import numpy as np
import gonio as gn
from gonio.arrays import ops
from gonio.arrays.ops import ELEMENTARY
from gonio.compile.llvm import codegen
from gonio.formula.fields import param

class Cube(gn.Reflectance):
    rho = param(0.5, 0.0, 1.0, "a number")
    def formula(self, wi, wo):
        return ops.cbrt(self.rho * wi.x)

kernels, generate = [], codegen.generate
codegen.generate = lambda *a: kernels.append(generate(*a)) or kernels[-1]
m, wi, wo = Cube(0.4), np.array([[0.6, 0.0, 0.8], [-0.28, 0.0, 0.96]]), np.array([0.0, 0.0, 1.0])
x = 0.4 * wi[:, 0]
np.testing.assert_array_equal(ops.cbrt(x), np.cbrt(x))
np.testing.assert_allclose(ELEMENTARY["cbrt"].libraries["torch"](ops.LIBRARIES["numpy"], x), np.cbrt(x), rtol=1e-14)
np.testing.assert_allclose(m.f(wi, wo), np.cbrt(x), rtol=1e-14)
np.testing.assert_allclose(m.jacobian(wi, wo).by["rho"].squeeze(), np.cbrt(x) / 1.2, rtol=1e-13)
assert len(kernels) == 2
assert "cbrt(" in gn.engine.kernel(m).source
assert "cbrtf(" in gn.engine.shader_source(m, "c", ("f",)).text
text = gn.engine.shader_source(m, "glsl", ("f",)).text
assert text.count("_cbrt(") == 2 and "cbrtf" not in text  # its formula, and a call
print(ops.cbrt.__doc__)
"""


@pytest.mark.slow_because("gonio starts in a process of its own")
def test_a_function_is_added_in_three_files(tmp_path):
    """A made-up one: by NumPy, compiled, its derivative, as a formula is shown, in languages with it and without."""
    package = tmp_path / "gonio"
    package.mkdir()
    for path in PACKAGE.iterdir():
        if path.name in ("arrays", "compile"):
            shutil.copytree(path, package / path.name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            (package / path.name).symlink_to(path)
    assert [name.rpartition("/")[2] for name, _ in ADDED] == ["ops.py", "exponential.py", "elementary.py"]
    for name, piece in ADDED:
        text, end, rest = (package / name).read_text(encoding="utf-8").partition("\nFUNCTIONS")
        (package / name).write_text(f"{text}\n\n{piece}\n{end}{rest}", encoding="utf-8")
    settings = os.environ | {"PYTHONPATH": str(tmp_path), "GONIO_CACHE": "off", "GONIO_OPTIMIZE": "off"}
    done = subprocess.run([sys.executable, "-c", TRIED], capture_output=True, text=True, env=settings)
    assert (done.stdout, done.stderr) == ("Cube root.\n", "")
