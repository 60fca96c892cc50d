"""What tells one work from another: content, and nothing but content."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys

import numpy as np
import pytest

import gonio as gn
from gonio.authoring import Reflectance, param
from gonio.base import identity as module
from gonio.base.identity import File, identity

LONG = np.linspace(0.1, 0.2, 200)
AXES = {"theta_i": [0.0, 1.0], "theta_o": [0.0, 1.0], "phi": [0.0, np.pi]}


def nearly(array):
    """The same but for the last digit of one number."""
    other = np.array(array)
    other.reshape(-1)[-1] = np.nextafter(other.reshape(-1)[-1], 1.0)
    return other


def table(values=0.1, **options):
    return gn.Gridded("angles", AXES, np.broadcast_to(values, (2, 2, 2)), **options)


def counted(scale):
    return lambda w: scale * w[..., 2]


def doubled(scale):
    return lambda w: 2.0 * scale * w[..., 2]


class _Paint(Reflectance):
    """Paint of one albedo."""

    rho = param(0.5, 0.0, 1.0, "albedo")

    def formula(self, wi, wo):
        return self.rho / np.pi


ALIKE = [
    (gn.Lambertian(LONG), gn.Lambertian(nearly(LONG))),
    (gn.Lambertian(gn.Texture(LONG[:, None])), gn.Lambertian(gn.Texture(nearly(LONG)[:, None]))),
    (gn.Lambertian(0.5), gn.Lambertian([0.5])),
    (gn.Lambertian(gn.Spectrum([400.0, 700.0], [0.2, 0.8])), gn.Lambertian(gn.Spectrum([400.0, 701.0], [0.2, 0.8]))),
    (gn.Lambertian(0.5) + table(), gn.Lambertian(0.5) + table(nearly(np.full((2, 2, 2), 0.1)))),
    (table(uncertainty=np.full((2, 2, 2), 0.01)), table(uncertainty=np.full((2, 2, 2), 0.02))),
    (table(), table(quantity="brdf * cos(theta_o)")),
    (gn.GGX(0.2), gn.GGX(0.2, 0.2)),
    (gn.FunctionLight(counted(1.0)), gn.FunctionLight(counted(1.5))),
    (gn.FunctionLight(counted(1.0)), gn.FunctionLight(doubled(1.0))),
    (np.zeros(3), np.zeros(3, "f4")),
    (np.zeros((2, 3)), np.zeros((3, 2))),
    (["a", "b"], ["ab"]),
    ({"loss": None}, {"loss": "None"}),
    (np.ma.array([1.0, 2.0], mask=[0, 1]), np.ma.array([1.0, 2.0], mask=[0, 0])),
]


@pytest.mark.parametrize(("one", "other"), ALIKE, ids=[type(a).__name__ + str(k) for k, (a, _) in enumerate(ALIKE)])
def test_what_differs_is_told_apart(one, other):
    assert identity(one) != identity(other)
    assert identity(one) == identity(one)


def test_versions_are_told_apart(monkeypatch):
    before = identity(gn.Lambertian(0.5))
    monkeypatch.setattr(module, "__version__", "0.1.1")
    assert identity(gn.Lambertian(0.5)) != before


def test_the_same_numbers_are_the_same_work(tmp_path):
    m = table() + gn.Lambertian(LONG[:3])
    assert identity(m) == identity(pickle.loads(pickle.dumps(m)))
    paths = [tmp_path / name for name in ("a.nc", "b.nc")]
    for path in paths:
        gn.save(table(), path)
    first, second = map(gn.load, paths)
    assert identity(first) == identity(second) and first.path != second.path


def test_a_formula_of_a_user_counts_by_its_code():
    """In another process it is the same; with another formula, or another bound, another."""
    before = identity(_Paint(0.3))
    code = "import sys; sys.path[:0] = sys.argv[1:]; import test_identity as t; print(t.identity(t._Paint(0.3)))"
    folders = [os.path.dirname(__file__), *filter(None, sys.path)]
    done = subprocess.run([sys.executable, "-c", code, *folders], capture_output=True, text=True, check=True)
    assert _Paint.__module__ == "test_identity" and done.stdout.strip() == before
    scope = {**globals(), "__name__": _Paint.__module__}
    for old, new in (("self.rho /", "2.0 * self.rho /"), ("1.0, ", "0.9, ")):
        text = 'class _Paint(Reflectance):\n    "Paint."\n    rho = param(0.5, 0.0, 1.0, "albedo")\n\n'
        text += "    def formula(self, wi, wo):\n        return self.rho / np.pi\n"
        exec(text, scope)
        same = identity(scope["_Paint"](0.3))
        exec(text.replace(old, new), scope)
        assert identity(scope["_Paint"](0.3)) != same


def test_files_count_by_their_bytes(tmp_path):
    a, b = tmp_path / "a", tmp_path / "b"
    a.write_bytes(b"1")
    b.write_bytes(b"1")
    assert identity(File(a)) == identity(File(b))
    status = a.stat()
    a.write_bytes(b"2")
    os.utime(a, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert identity(File(a)) != identity(File(b))
    before = identity(File(tmp_path))
    b.rename(tmp_path / "c")
    assert identity(File(tmp_path)) != before
