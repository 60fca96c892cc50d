"""Short texts that would never end: every one is read in time that grows with its length, or refused at once."""

import copy
import json
import pickle
import resource
import subprocess
import sys

import numpy as np
import pytest
from counting import counted
from libraries import switch_off
from sweeps import every

import gonio as gn
from gonio.base.sums import Scaled, Sum
from gonio.catalogue.typed import with_parameters
from gonio.errors import ExpressionError, FormatError, NotFoundError, ParameterError
from gonio.evaluate import whole
from gonio.formula.bounds import CHANNELS, COMPILED, EVALUATIONS, NESTED
from gonio.formula.fields import CLASSES
from gonio.formula.json_form import from_json, names

UP = np.array([0.0, 0.0, 1.0])
WI, WO = gn.direction(0.7, 0.3), gn.direction(0.4, 2.5)
WRAPPERS = dict.fromkeys(("Rotated", "ShadingNormal", "NormalMapped", "Scaled"), "of")
WRAPPERS |= {"Coated": "base", "Sum": "terms"}


def of_json(text, tmp_path):
    path = tmp_path / "m.json"
    path.write_text(text)
    return gn.load(path)


def nested(name, depth):
    field = WRAPPERS[name]
    opened, closed = ("[", "]") if field == "terms" else ("", "")
    return f'{{"type": "{name}", "{field}": {opened}' * depth + '{"type": "Lambertian"}' + f"{closed}}}" * depth


def bounded(code, seconds=60, megabytes=3000):
    """Run code in a process of its own that may take so much processor time and memory; what it prints."""

    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))

    command = [sys.executable, "-c", code]
    done = subprocess.run(command, preexec_fn=limit, capture_output=True, text=True, timeout=10 * seconds)
    assert done.returncode == 0, done.stderr[-500:]
    return done.stdout


@pytest.mark.parametrize("depth", [6, 8, 12])
def test_normal_maps_of_normal_maps_are_refused_when_they_are_made(depth):
    """Their cost is multiplied at every level: 120 characters took minutes. (D15)"""
    text = "NormalMapped(" * depth + "Lambertian()" + ")" * depth
    with pytest.raises(ParameterError, match=f"expected at most {EVALUATIONS}"):
        gn.expression(text)


def test_normal_maps_of_normal_maps_end_where_they_are_allowed():
    """What passes the bound is evaluated in seconds. (D15)"""
    code = """
import gonio as gn
m = gn.Lambertian()
for _ in range(4): m = gn.NormalMapped(m, 0.1, 0.05)
w = gn.direction(0.7, 0.3)
print(m.f(w, w) > 0.0)
"""
    assert bounded(code) == "True\n"


@pytest.mark.parametrize("name", WRAPPERS)
@pytest.mark.parametrize("depth", [NESTED, 30, 200, 450, 5000, 100_000])
def test_what_is_nested_too_deep_in_json_is_refused(name, depth, tmp_path):
    """One gonio error, at every depth: no RecursionError, no minutes. (D15)"""
    with pytest.raises(FormatError, match=r"deep|at most"):
        of_json(nested(name, depth), tmp_path)


@pytest.mark.parametrize("name", [n for n in WRAPPERS if n != "NormalMapped"])
def test_what_is_nested_as_deep_as_may_be_is_a_value_like_any_other(name, tmp_path):
    """repr, ==, hash, copies, pickles, JSON and f of the deepest material that is allowed. (D15)"""
    m = of_json(nested(name, NESTED - 1), tmp_path)
    assert copy.deepcopy(m) == pickle.loads(pickle.dumps(m)) == from_json(m.to_json()) == m
    assert hash(m) == hash(copy.copy(m))
    assert len(repr(m)) < 10_000
    assert m.f(WI, WO) >= 0.0


@pytest.mark.parametrize("make", [gn.Rotated, Sum, gn.Coated, gn.ShadingNormal, lambda m: Scaled(0.9, m)])
def test_python_nests_no_deeper_than_texts(make):
    """The constructor refuses, not a RecursionError later. (D15)"""
    m = gn.Lambertian()
    with pytest.raises(ParameterError, match=f"nested {NESTED + 1} deep, expected at most {NESTED}"):
        for _ in range(NESTED):
            m = make(m)


def test_factors_become_one():
    """m = m * 0.9 in a loop of 1000 is one factor. (D15)"""
    m = n = gn.Lambertian(0.5)
    for _ in range(1000):
        m, n = m * 0.999, [0.999, 1.0, 0.998] * n
    assert m.of == n.of == gn.Lambertian(0.5)
    assert np.isclose(m.weight, 0.999**1000)
    assert np.allclose(n.weight, np.array([0.999, 1.0, 0.998]) ** 1000)
    assert gn.expression(repr(m)) == m


def test_factors_whose_product_is_no_weight_stay_two():
    """Nothing overflows or vanishes because factors are folded. (D15)"""
    large, small = 1e9 * (1e9 * gn.Lambertian(1e-9)), 1e-200 * (1e-200 * gn.Lambertian())
    assert (large.weight, large.of.weight, small.weight, small.of.weight) == (1e9, 1e9, 1e-200, 1e-200)
    assert (0.0 * (2.0 * gn.Lambertian())).weight == 0.0
    maps = np.full((2, 2, 1), 0.5) * ([0.1, 0.2, 0.3] * gn.Lambertian())
    assert maps.weight.shape == (2, 2, 1)


def test_a_sum_of_too_many_terms_is_refused(tmp_path):
    """20 000 terms, 0.9 MB, did not end. (D15)"""
    terms = ", ".join(['{"type": "Phong"}'] * 20_000)
    with pytest.raises(FormatError, match=f"a sum of 20001 terms, expected at most {EVALUATIONS}"):
        of_json(f'{{"type": "Sum", "terms": [{terms}, {{"type": "Lambertian"}}]}}', tmp_path)


def test_sharing_parts_hides_no_size():
    """A sum of twice itself, 40 times, would be 1e12 terms in 40 objects. (D15)"""
    m = gn.Lambertian(0.1)
    with pytest.raises(ParameterError, match="expected at most"):
        for _ in range(40):
            m = m + m


def test_large_sums_are_sampled():
    """1000 lobes took 100 s to compile; too large for that, they run on NumPy, to the same numbers. (D15)"""
    code = """
import numpy as np, gonio as gn
m = sum([gn.Phong(1e-3, 20.0)] * 999, gn.Phong(1e-3, 20.0))
w = gn.direction(0.7, 0.3)
s = m.sample(w, [0.3, 0.6])
one = gn.Phong(1.0, 20.0)
print(np.isclose(s.weight * s.pdf, one.f(s.wi, w) * s.wi[2]), np.isclose(s.pdf, one.pdf(s.wi, w), rtol=1e-6))
"""
    assert bounded(code, seconds=30) == "True True\n"


def test_large_formulas_are_not_compiled(monkeypatch):
    """Compiling takes the square of the size: beyond `COMPILED` operations nothing is handed to the compiler. (D15)"""

    def compiled(graph, results, *_, adds=False):
        nodes = [n for r in results for n in r.nodes]
        assert len(graph.reachable(nodes)) <= COMPILED
        raise gn.errors.TraceError("not here")

    monkeypatch.setattr(whole, "prepare", compiled)
    m = Sum(*[gn.Phong(1e-3, float(k)) for k in range(2, 800)])
    assert m.sample(WO, [0.3, 0.6]).pdf >= 0.0
    assert np.isclose(m.jacobian(WI, WO, by=["0.rho_s"]).f, m.f(WI, WO))


def test_a_spectrum_of_a_million_channels_is_refused(tmp_path):
    """Whatever asks for its albedo would never end. (D15)"""
    numbers = ", ".join(["0.5"] * (CHANNELS + 1))
    with pytest.raises(FormatError, match=f"{CHANNELS + 1} channels, expected at most {CHANNELS}"):
        of_json(f'{{"type": "Lambertian", "rho": [{numbers}]}}', tmp_path)
    assert gn.Lambertian(np.full(100_000, 0.5)).f(UP, UP).shape == (100_000,)  # arrays from Python may be


@pytest.mark.parametrize("depth", [90, 101, 900, 50_000])
def test_what_measurements_in_json_say_of_themselves_is_no_deeper_than_can_be_kept(depth, tmp_path):
    """Metadata nested 900 deep were read, and could not be copied, pickled or saved. (D15)"""
    columns = {name: {"unit": "deg", "values": [0, 10]} for name in ("theta_i", "phi_i", "theta_r", "phi_r")}
    data = json.dumps({**columns, "BRDF": {"unit": "sr^-1", "values": [1, 2]}})
    text = f'{{"data": {data}, "metadata": {{"a": ' + "[" * depth + "]" * depth + "}}"
    if depth > 100:
        with pytest.raises(FormatError, match="nested more than 100 deep"):
            of_json(text, tmp_path)
    else:
        m = of_json(text, tmp_path)
        assert copy.deepcopy(m) == pickle.loads(pickle.dumps(m)) == m
        gn.save(m, tmp_path / "again.brdf", format="BiRD")


@every(name=sorted(set(CLASSES) - set(names())))
def test_bases_and_measurements_are_no_types_of_a_text(name, tmp_path):
    """{"type": "Reflectance"} is an unknown type, not a NotImplementedError later. (D15)"""
    with pytest.raises(FormatError, match="no type"):
        of_json(f'{{"type": "{name}"}}', tmp_path)
    with pytest.raises(ExpressionError, match="unknown name"):
        gn.expression(f"{name}()")


@pytest.mark.parametrize("name", sorted(names()))
def test_every_type_of_a_text_can_be_evaluated_or_says_what_it_lacks(name, monkeypatch):
    """Every name that texts may use is a concrete class. (D15)"""
    try:
        made = from_json({"type": name})
    except (ParameterError, NotFoundError):
        return
    switch_off(monkeypatch)
    if isinstance(made, gn.Reflectance):
        assert np.all(made.f(WI, WO) >= 0.0)
        assert repr(made)


@pytest.mark.parametrize(
    "text",
    [
        '{"type": "Lambertian", "rho": 0.1, "rho": 0.9}',
        '{"type": "Lambertian", "rho": %s}' % ("9" * 5000),
        '{"type": "Lambertian", "rho": %s}' % ("9" * 400),
        '{"type": "Lambertian", "rho": 1e999}',
        '{"type": "Lambertian", "rho": NaN}',
        '{"type": "Lambertian", "rho": ' + "[" * 500 + "1" + "]" * 500 + "}",
        '{"type": "Lambertian", "rho": ' + "[" * 100_000 + "]" * 100_000 + "}",
        '{"type": "Lambertian", "rho": [[{}]]}',
        '{"type": "Lambertian", "self": 1}',
        '{"type": "%s"}' % ("x" * 1_000_000),
        '{"type": "Lambertian", "%s": 1}' % ("x" * 1_000_000),
        '{"type": ["Sum"]}',
        '{"type": null}',
        '{"type": "Sum", "terms": 3}',
        '{"type": "Sum", "terms": "ab"}',
        '{"type": "Lambertian", "terms": [1, 2]}',
        '{"type": "FunctionLight", "L": %s}' % ("9" * 400),
        '{"type": "TabulatedFacets", "theta": [%s]}' % ("9" * 400),
        '{"type": "EnvironmentLight", "image": [[%s]]}' % ("9" * 400),
    ],
    ids=lambda text: text[:50],
)
def test_odd_json_ends_in_one_short_error(text, tmp_path):
    """Members given twice, giant numbers, deep lists, long names: one error, whose length is bounded. (D15)"""
    with pytest.raises(FormatError) as caught:
        of_json(text, tmp_path)
    assert len(str(caught.value)) < 1500


def test_an_integer_of_5000_digits_has_no_repr():
    """The error that would quote it is gonio's. (D15)"""
    for make in (gn.Lambertian, gn.Rotated, lambda x: gn.DistantLight(x), lambda x: from_json({"type": x})):
        with pytest.raises(gn.Error):
            make(10**5000)


def test_a_long_chain_of_factors_in_an_expression_is_refused():
    """Nothing in brackets, 5000 deep all the same. (D15)"""
    with pytest.raises(ParameterError, match="deep"):
        gn.expression("Lambertian()" + "*2" * 500)
    with pytest.raises(ParameterError, match="deep"):
        with_parameters(gn.Rotated(), ["of=" + "Rotated(" * 20 + "Lambertian()" + ")" * 20])


def test_repr_and_channel_names_of_nested_sums_take_each_term_once():
    """Both asked every term twice, which doubles at every level. (D15)"""
    counted = []

    class Counted(gn.Lambertian):
        @property
        def channel_names(self):
            counted.append("names")
            return ("R", "G")

        def __repr__(self):
            counted.append("repr")
            return "Counted()"

    m = Counted()
    try:
        for _ in range(NESTED - 1):
            m = Sum(m)
        counted.clear()
        assert m.channel_names == ("R", "G")
        assert repr(m).count("Sum(") == NESTED - 1
    finally:
        CLASSES.pop("Counted")
    assert counted == ["names", "repr"]


def test_reading_takes_time_in_proportion_to_the_text():
    """Ten times the terms take at most ten times the calls to read. (D15)"""

    def calls(count):
        data = {"type": "Sum", "terms": [{"type": "Lambertian", "rho": 0.0001 * k} for k in range(count)]}
        return counted(lambda: from_json(data)).calls

    calls(1)
    assert 300 < calls(3000) <= 10 * calls(300)
