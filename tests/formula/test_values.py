"""A value is a value: nothing changes one, what it holds is declared, and materials of one structure share a trace."""

from __future__ import annotations

import ast
import copy
import pickle

import numpy as np
import pytest
from libraries import thinned
from places import PACKAGE
from sweeps import every

import gonio as gn
from gonio import errors
from gonio.arrays import ops
from gonio.base.measured import Measured
from gonio.base.reflectance import Reflectance
from gonio.conversion import tabulated  # noqa: F401 - a class of it is among CLASSES
from gonio.evaluate import call, planning, tracing
from gonio.formula import tree
from gonio.formula.fields import CLASSES, param, table
from gonio.formula.json_form import from_json
from gonio.formula.parametrised import Parametrised
from gonio.formula.state import Held, HeldList, derived, note, state

compiled = pytest.mark.skipif(not planning.available(), reason="nothing can be compiled here")

HOME = {"formula/value.py", "formula/parametrised.py", "formula/axes.py", "formula/texture.py"}
CHANGES = {"update", "setdefault", "pop", "popitem", "clear", "__setitem__", "__delitem__"}


def test_nothing_but_values_themselves_writes_what_they_hold():
    def is_dict(node: ast.AST) -> bool:
        is_vars = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "vars"
        return is_vars or (isinstance(node, ast.Attribute) and node.attr == "__dict__")

    def writes(node: ast.AST) -> bool:
        if isinstance(node, ast.Subscript) and isinstance(node.ctx, (ast.Store, ast.Del)):
            return is_dict(node.value)
        if isinstance(node, ast.AugAssign):
            return is_dict(node.target)
        return isinstance(node, ast.Attribute) and node.attr in CHANGES and is_dict(node.value)

    for path in sorted(PACKAGE.rglob("*.py")):
        name, text = path.relative_to(PACKAGE).as_posix(), path.read_text(encoding="utf-8")
        named = "__dict__" in text or "vars(" in text
        lines = [n.lineno for n in ast.walk(ast.parse(text)) if writes(n)] if named else []
        assert bool(lines) <= (name in HOME), f"{name}, lines {lines}: declare a state() or note() and use _hold"


# What is declared beside fields.


class _Noted(Reflectance):
    rho = param(0.5, 0.0, 1.0, "albedo")
    folds = state(1)
    origin = note("nowhere")
    computed = 0

    def __init__(self, folds: object = 1, **fields: object):
        self._hold(folds=folds)
        super().__init__(**fields)

    @derived
    def doubled(self) -> float:
        type(self).computed += 1
        return 2.0 * self.rho

    def formula(self, wi, wo):
        return self.rho * self.folds + 0.0 * wi.z


class _Reads(_Noted):
    def formula(self, wi, wo):
        return super().formula(wi, wo) * len(self.origin)


UP = np.array([[0.0, 0.0, 1.0]])


def test_state_is_traced_and_notes_are_not():
    for folds in (1, 3):
        assert _Noted(folds).f(UP, UP) == 0.5 * folds
    m = _Noted(2)
    noted = tree.with_notes(m, origin="a file")
    assert (noted.origin, m.origin, noted.folds) == ("a file", "nowhere", 2)
    assert noted == m
    assert hash(noted) == hash(m)
    assert tracing.content(noted).structure == tracing.content(m).structure != tracing.content(_Noted(1)).structure
    again = noted.replace(rho=0.25)
    assert (again.origin, again.folds, again.f(UP, UP)[0]) == ("a file", 2, 0.5)


def test_formulas_see_no_notes():
    with pytest.raises(AttributeError, match="origin is a note"):
        _Reads().f(UP, UP)
    with pytest.raises(AttributeError, match="origin"):
        tree.with_notes(_Reads(), origin="a file").f(UP, UP)


def test_only_what_is_declared_is_held():
    with pytest.raises(AttributeError, match="declares no 'other'"):
        _Noted()._hold(other=1)
    with pytest.raises(AttributeError, match="no note 'folds'"):
        tree.with_notes(_Noted(), folds=2)
    with pytest.raises(TypeError, match="unhashable"):
        _Noted([1])
    m = _Noted()
    m.__dict__["slipped_in"] = 1.0
    assert "slipped_in" not in m.replace(rho=0.1).__dict__
    assert "slipped_in" not in tree.with_values(m, {"rho": 0.1}).__dict__


def test_what_is_derived_is_computed_once_and_anew_for_other_fields():
    m = _Noted(rho=0.2)
    _Noted.computed = 0
    assert (m.doubled, m.doubled, tree.with_notes(m, origin="x").doubled) == (0.4, 0.4, 0.4)
    assert _Noted.computed == 1
    assert m.replace(rho=0.3).doubled == 0.6
    assert tree.with_values(m, {"rho": 0.1}).doubled == 0.2
    other = pickle.loads(pickle.dumps(m))
    assert other == m
    assert not other._derived


def test_pickles_keep_state_and_notes():
    m = tree.with_notes(_Noted(3, rho=0.1), origin={"file": ["a", {"b": np.arange(3.0)}]})
    for other in (pickle.loads(pickle.dumps(m)), copy.deepcopy(m), copy.copy(m)):
        assert (other, other.folds, other.f(UP, UP)[0]) == (m, 3, m.f(UP, UP)[0])
        assert type(other.origin) is Held
        assert not other.origin["file"][1]["b"].flags.writeable


# Frozen notes.


def measurement(about: dict) -> gn.Gridded:
    nodes = np.linspace(0.0, 1.5, 4)
    return gn.Gridded("angles", {"theta_i": nodes, "theta_o": nodes, "phi": [0.0]}, np.ones((4, 4, 1)), about=about)


def test_about_cannot_be_changed():
    given = {"lamps": ["a", "b"], "deep": {"x": [1, {"y": 2}]}}
    m = measurement(given)
    given["lamps"].append("c")
    assert m.about == {"lamps": ["a", "b"], "deep": {"x": [1, {"y": 2}]}}
    for change in (
        lambda: m.about.update(a=1),
        lambda: m.about.pop("lamps"),
        lambda: m.about["deep"].clear(),
        lambda: m.about["deep"]["x"].append(1),
        lambda: m.about["deep"]["x"].__setitem__(0, 1),
        lambda: m.about["deep"]["x"][1].setdefault("z", 1),
        lambda: m.about["lamps"].sort(),
        lambda: m.provenance.update(a=1),
        lambda: m.about.__delitem__("lamps"),
        lambda: m.about["lamps"].__iadd__(["c"]),
    ):
        with pytest.raises(AttributeError, match="cannot be changed"):
            change()
    assert m.about["lamps"] == ["a", "b"]
    for other in (pickle.loads(pickle.dumps(m)), copy.deepcopy(m)):
        assert other.about == m.about
        assert (type(other.about), type(other.about["lamps"])) == (Held, HeldList)


def test_every_way_to_change_a_held_container_is_refused():
    for held, plain in ((Held, dict), (HeldList, list)):
        wrote = {n for n in dir(plain) if n not in dir(tuple) + dir(frozenset)} - {"__reversed__", "__ior__"}
        reads = {"get", "items", "keys", "values", "fromkeys", "copy", "__class_getitem__", "__or__", "__ror__"}
        assert {n for n in wrote - reads if getattr(held, n) is getattr(plain, n)} == set()


def test_provenance_leaves_about_alone(tmp_path):
    path = tmp_path / "a.csv"
    gn.save(measurement({"lamp": "a"}), path)
    m = gn.load(path)
    assert m.provenance["file"] == "a.csv"
    assert "converted_from" not in m.about
    assert isinstance(m.provenance, Held)


@compiled
def test_about_path_and_provenance_are_no_structure():
    m = measurement({"lamp": "a"})
    other = tree.with_notes(measurement({"lamp": "b"}), path="elsewhere", provenance={"file": "b"})
    assert tracing.content(m).structure == tracing.content(other).structure
    assert other == m


# One structure, one trace.


@compiled
def test_all_fits_share_one_trace():
    w = np.array([[0.0, 0.6, 0.8]])
    fits = [gn.material(entry.name) for entry in gn.materials() if entry.kind == "measured fit"]
    assert len(fits) == 100
    assert len({tracing.content(m).structure for m in fits}) == 1
    tracing._TRACES.clear()
    planning._PATTERNS.clear()
    values = [m.f(w, w) for m in fits]
    assert len(tracing._TRACES) == 1
    assert len({v.tobytes() for v in values}) == 100


@compiled
def test_tables_of_one_grid_share_a_trace_and_not_their_numbers():
    rng = np.random.default_rng(0)
    nodes = np.linspace(0.3, 1.5, 4)
    axes = {"theta_i": nodes, "theta_o": nodes, "phi": [0.0, 1.0, 2.0]}
    a, b = (gn.Gridded("angles", axes, rng.random((4, 4, 3))) for _ in range(2))
    assert tracing.content(a).structure == tracing.content(b).structure
    c = gn.Gridded("angles", {**axes, "phi": [0.0, 1.0, 2.5]}, a.stored)
    assert tracing.content(a).structure != tracing.content(c).structure
    for m in (a, b, c):
        wi, wo = m.directions()
        np.testing.assert_allclose(m.f(wi, wo), m.stored, rtol=1e-6)


WI = np.random.default_rng(3).normal(size=(7, 3))
WI[:, 2] = np.abs(WI[:, 2]) + 0.1
WI /= np.linalg.norm(WI, axis=1, keepdims=True)
WO = WI[::-1].copy()


def fresh(m: Reflectance, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f without any plan or trace of before."""
    tracing._TRACES.clear()
    planning._PATTERNS.clear()
    return copy.deepcopy(m).f(wi, wo)


@compiled
@pytest.mark.parametrize("dtype", thinned(["float32", "float64"], ["float64"]))
def test_plans_of_one_structure_compute_with_the_numbers_of_each(dtype):
    start = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9))
    maps = [np.linspace(0.1, 0.9, 21).reshape(7, 3), np.linspace(0.2, 0.5, 7).reshape(7, 1), [0.1, 0.5, 0.9]]
    turns = [
        *(start.replace({"distribution.alpha": a}) for a in (0.1, 0.2)),
        start.replace({"distribution.alpha_x": 0.2}),
        *(gn.Lambertian(x) for x in (*maps, 0.3, 0.4)),
        *(gn.Lambertian(np.asarray(x) * 0.5) for x in maps),
        gn.Lambertian(np.ma.masked_less(maps[0], 0.3)),
        gn.Lambertian([0.2]),
        gn.Lambertian([[0.2, 0.3, 0.4]]),
        gn.NormalMapped(gn.Lambertian(0.3), 0.1, 0.2),
        gn.NormalMapped(gn.Lambertian(0.4), 0.2, 0.1),
    ]
    wi, wo = WI.astype(dtype), WO.astype(dtype)
    found = [[m.f(wi, wo), m.pdf(wi, wo), m.sample(wo, wi[:, :2] % 1.0).wi] for m in turns for _ in range(2)]
    for m, values in zip([m for m in turns for _ in range(2)], found, strict=True):
        expected = [fresh(m, wi, wo), m.pdf(wi, wo), m.sample(wo, wi[:, :2] % 1.0).wi]
        for value, one in zip(values, expected, strict=True):
            np.testing.assert_array_equal(value, one)


@compiled
def test_what_no_plan_serves_is_refused_as_before():
    gn.Lambertian(np.full((7, 3), 0.5)).f(WI, WO)
    with pytest.raises(gn.Error, match="broadcast"):
        gn.Lambertian(np.full((6, 3), 0.5)).f(WI, WO)
    torch = pytest.importorskip("torch")
    gn.Lambertian(np.full(3, 0.5)).f(WI, WO)
    with pytest.raises(gn.Error, match="torch array"):
        gn.Lambertian(torch.full((3,), 0.5)).f(WI, WO)


@compiled
def test_first_f_after_replace_makes_no_trace_and_no_kernel_anew(monkeypatch):
    m = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9))
    m.f(WI, WO)
    m.jacobian(WI, WO)

    def never(*args: object) -> None:
        raise AssertionError("prepared anew")

    monkeypatch.setattr(planning, "new_plan", never)
    monkeypatch.setattr(call, "traced", never)
    other = m.replace({"distribution.alpha_x": 0.4})
    f, by = other.jacobian(WI, WO)
    np.testing.assert_allclose(other.f(WI, WO), f, rtol=1e-14)
    monkeypatch.undo()
    np.testing.assert_array_equal(fresh(other, WI, WO), other.f(WI, WO))
    slope = (other.replace({"distribution.alpha_x": 0.4 + 1e-6}).f(WI, WO) - f) / 1e-6
    np.testing.assert_allclose(by["distribution.alpha_x"], slope, rtol=1e-3, atol=1e-5)


STEPS = [
    {"distribution.alpha_x": 0.4},
    {"distribution.alpha_x": np.float32(0.25), "fresnel.k": 3},
    {"distribution.alpha_y": 0.1},
    {"distribution.alpha_x": 0.2},
    {"alpha": 0.3},
    {"fresnel.eta": [0.2, 0.9, 1.1]},
    {"fresnel.eta": np.array([0.3, 0.8, 1.0]), "distribution.alpha_x": 0.15},
    {"fresnel.k": np.full((1, 3), 2.0)},
    {"distribution.alpha_y": np.array([0.2, 0.3, 0.4])},
    {"distribution.alpha_y": "alpha_x"},
    {"fresnel": gn.Schlick(0.5)},
    {"fresnel.F0": 0.6},
    {"fresnel.F0": [0.5, 0.6]},
    {"fresnel.F0": [0.1, 0.2, 0.3, 0.4]},
    {"fresnel.F0": np.full((7, 4), 0.3)},
    {"fresnel.F0": [0.9]},
    {"distribution": gn.Beckmann(0.3, 0.2)},
    {"masking": "separable"},
    {"alpha": 0.2},
]


def remade(m: Reflectance) -> Reflectance:
    """The same material, by constructors alone."""
    again = from_json(m.to_json())
    assert again == m
    return again


def test_steps_of_a_fit_make_what_constructors_make():
    """f, derivatives and samples along a chain of `replace`, each step twice: the second by what the first has left."""
    m = gn.Microfacet(gn.GGX(0.3), gn.Conductor(0.2, 3.9))
    for step in STEPS:
        for _ in range(2):
            other = m.replace(step)
            again = remade(other)
            assert repr(other) == repr(again)
            assert dict(other._tied) == dict(again._tied)
            np.testing.assert_array_equal(other.f(WI, WO), again.f(WI, WO))
            np.testing.assert_array_equal(other.pdf(WI, WO), again.pdf(WI, WO))
            found, expected = other.jacobian(WI, WO), again.jacobian(WI, WO)
            np.testing.assert_array_equal(found.f, expected.f)
            assert list(found.by) == list(expected.by)
            for path, slope in expected.by.items():
                np.testing.assert_array_equal(found.by[path], slope)
        m = other


def test_steps_of_a_fit_in_parts_of_a_sum():
    start = 0.5 * gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.2), gn.Conductor([0.2, 0.9, 1.1], [3.9, 2.4, 2.2]))
    rng = np.random.default_rng(1)
    for _ in range(3):
        rho, weight, alpha, eta = rng.random(), rng.random(), rng.uniform(0.1, 0.9), rng.random(3) + 0.1
        m = start.replace({"0.of.rho": rho, "0.weight": weight, "1.distribution.alpha_x": alpha, "1.fresnel.eta": eta})
        again = weight * gn.Lambertian(rho) + gn.Microfacet(gn.GGX(alpha), gn.Conductor(eta, [3.9, 2.4, 2.2]))
        assert m == again
        np.testing.assert_array_equal(m.f(WI, WO), again.f(WI, WO))
        for path, slope in again.jacobian(WI, WO).by.items():
            np.testing.assert_array_equal(m.jacobian(WI, WO).by[path], slope)
        assert m.replace(rho=0.2).channels == 3
        eta[:] = 9.0
        assert m == again  # numbers given are the caller's to change
    with pytest.raises(errors.ParameterError, match="out of bounds"):
        start.replace({"0.of.rho": 1.5})
    with pytest.raises(errors.ParameterError, match="NaN or infinite"):
        start.replace({"1.fresnel.eta": np.array([0.2, np.nan, 1.0])})
    with pytest.raises(errors.ParameterError, match="given twice"):
        start.replace({"1.distribution.alpha": 0.2, "1.distribution.alpha_x": 0.3})


@compiled
def test_patterns_keep_no_tables():
    planning._PATTERNS.clear()
    measurement({}).f(WI, WO)
    (pattern,) = planning._PATTERNS.values()
    assert pattern.plan.plan.keeper is None


def test_digests_of_growing_graphs_stay():
    graph = tracing.Graph()
    x = graph.load(0, 0)
    y = graph.apply("mul", x, graph.constant(2.0))
    first = graph.digest([y], "a")
    z = graph.apply("sin", y)
    assert graph.digest([y], "a") == first
    assert len({first, graph.digest([y], "b"), graph.digest([z], "a"), graph.digest([y, z], "a")}) == 4


# Classes.


class _First(Parametrised):
    a = param(1.0, 0.0, 9.0, "a")
    shared = param(2.0, 0.0, 9.0, "shared")


class _Second(Parametrised):
    b = param(3.0, 0.0, 9.0, "b")
    shared = param(4.0, 0.0, 9.0, "shared")
    said = note("b")


class _Both(_First, _Second):
    c = param(5.0, 0.0, 9.0, "c")


def test_a_class_of_two_bases_has_the_fields_of_both():
    assert list(_Both.fields) == ["a", "shared", "b", "c"]
    m = _Both(b=1.0)
    assert [p.value for p in m.parameters.values()] == [1.0, 2.0, 1.0, 5.0]
    assert tree.with_notes(m, said="x").said == "x"


def test_what_a_subclass_overrides_is_no_field_of_it():
    class Fixed(_First):
        a = 7.0

    assert list(Fixed.fields) == ["shared"]
    assert (Fixed().a, Fixed().shared) == (7.0, 2.0)


def test_too_many_values_are_listed():
    with pytest.raises(errors.ParameterError, match="expected at most 3: distribution, fresnel, masking"):
        gn.Microfacet(1, 2, 3, 4)


@pytest.mark.parametrize("name", ["Reflectance", "Distribution", "Fresnel", "Light", "Measured"])
def test_abstract_bases_cannot_be_made(name):
    kind = Measured if name == "Measured" else CLASSES[name]
    with pytest.raises(errors.ParameterError, match="abstract base"):
        kind()
    with pytest.raises(errors.NotFoundError, match="no type"):
        from_json({"type": name})


def test_a_class_without_a_formula_is_abstract_and_its_subclass_is_not():
    class _Base(Reflectance):
        rho = param(0.5, 0.0, 1.0, "albedo")

    class _Kind(_Base):
        def formula(self, wi, wo):
            return self.rho + 0.0 * wi.z

    with pytest.raises(errors.ParameterError, match=r"_Base\(\): an abstract base, without formula"):
        _Base()
    assert _Kind().f(UP, UP) == 0.5


@every(name=sorted(CLASSES))
def test_json_makes_what_it_says_or_nothing(name):
    beside = {"path": "x", "channel_names": ["a"], "_numbers_from": "x", "fields": {}, "_tied": {}, "_is_bound": True}
    none = {} if name == "FilmStack" else {"terms": []}  # a stack of no films is a bare substrate
    for word, value in {**none, **beside, "self": 1, "": 1}.items():
        with pytest.raises(gn.Error):
            from_json({"type": name, word: value})
    if name != "Sum":
        with pytest.raises(gn.Error):
            from_json({"type": name, "terms": [{"type": "Lambertian"}]})


# The tree of parameters.


def test_one_walk_finds_everything():
    m = 0.5 * gn.Microfacet(gn.GGX(0.3), gn.Conductor([0.2, 0.9, 1.1], 3.9)) + gn.Lambertian(0.2)
    paths = [path for path, *_ in tree.walk(m)]
    assert paths[:6] == [
        "0",
        "0.weight",
        "0.of",
        "0.of.distribution",
        "0.of.distribution.alpha_x",
        "0.of.distribution.alpha_y",
    ]
    assert list(m.parameters) == [p for p in tree.leaf_paths(m) if p]
    assert "0.of.distribution.alpha_y" not in m.parameters  # tied to alpha_x
    assert [path for path, _, _ in tree.settable(m)] == paths
    assert list(tree.leaves(m)) == [p.value for p in m.parameters.values()]
    moved = tree.with_values(m, {"0.of.distribution.alpha_x": 0.1})
    assert moved.terms[0].of.distribution.alpha_y == 0.1
    assert moved.terms[1] is m.terms[1]
    assert tree.with_values(m, {}) is m


class _TableLike(Reflectance):
    values = table("numbers")
    size = state(0)

    def __init__(self, values: object):
        self._hold(size=len(values))
        super().__init__(values=values)

    def formula(self, wi, wo):
        return ops.take(self.values, ops.to_index(wi.z * (self.size - 1)))


@compiled
def test_a_plan_of_one_table_serves_another():
    a, b = _TableLike([1.0, 2.0, 3.0]), _TableLike([5.0, 6.0, 7.0])
    assert [m.f(UP, UP)[0] for m in (a, b, _TableLike([1.0, 9.0]))] == [3.0, 7.0, 9.0]


# Masks in formulas.

FORMULAS = {
    "mask * 2": lambda mask, k: mask * 2,
    "2 * mask": lambda mask, k: 2 * mask,
    "mask * 0.5": lambda mask, k: mask * 0.5,
    "mask * k": lambda mask, k: mask * k,
    "k * mask": lambda mask, k: k * mask,
    "mask + 1": lambda mask, k: mask + 1,
    "1 + mask": lambda mask, k: 1 + mask,
    "mask - 3": lambda mask, k: mask - 3,
    "3 - mask": lambda mask, k: 3 - mask,
    "mask / 2": lambda mask, k: mask / 2,
    "mask * int64": lambda mask, k: mask * np.int64(3),
    "float32 * mask": lambda mask, k: np.float32(3) * mask,
    "mask + mask": lambda mask, k: (mask + mask) * k,
    "mask * other": lambda mask, k: (mask * (k > 0.1)) * k,
    "mask & True": lambda mask, k: (mask & True) * k,
    "mask == 1": lambda mask, k: (mask == 1) * k,
    "where": lambda mask, k: ops.where(mask, True, False) * k,
}


@compiled
@pytest.mark.parametrize("text", FORMULAS)
def test_masks_count_as_numpy_has_it(text):
    class _Masked(Reflectance):
        k = param(0.3, 0.0, 1.0, "factor")

        def formula(self, wi, wo):
            return FORMULAS[text](wi.z > 0.5, self.k) + 0.0 * wi.x

    m, mask = _Masked(), WI[:, 2] > 0.5
    assert 0 < mask.sum() < len(mask)
    assert isinstance(tracing.traced(tracing.Task(kernel_of_f(), ("value",), (3, 3)), m, None), tracing.Trace)
    expected = FORMULAS[text](mask, 0.3) + 0.0 * WI[:, 0]
    for dtype in (np.float64, np.float32):
        np.testing.assert_array_equal(m.f(WI.astype(dtype), WO.astype(dtype)), expected.astype(dtype))
    slope = (FORMULAS[text](mask, 0.3 + 1e-6) - FORMULAS[text](mask, 0.3 - 1e-6)) / 2e-6 + 0.0 * WI[:, 0]
    np.testing.assert_allclose(m.jacobian(WI, WO, ["k"]).by["k"], slope, atol=1e-8)


def kernel_of_f():
    from gonio.base import kernels

    return kernels.value


@compiled
def test_what_numpy_has_not_is_not_traced():
    class _Negated(Reflectance):
        def formula(self, wi, wo):
            return -(wi.z > 0.5) + 0.0 * wi.x

    with pytest.raises(errors.TraceError, match="neg of masks"):
        tracing.traced(tracing.Task(kernel_of_f(), ("value",), (3, 3)), _Negated(), None)
