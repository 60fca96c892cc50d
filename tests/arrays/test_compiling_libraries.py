"""torch.compile and jax.jit take what gonio evaluates whole, and give what it gives without them."""

from __future__ import annotations

import logging
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from binary_files import random_table
from libraries import thinned
from materials import MODELS, PLUMBING, Draw, Sum, draws, pairs
from rgl_files import synthetic

import gonio as gn
from gonio.evaluate import planning
from gonio.formats.merl import MERL
from gonio.formats.rgl import RGL
from gonio.formula import tree

SIXTH = [model for model in MODELS if zlib.crc32(model.__name__.encode()) % 6 == 0]  # whatever is added beside them
FEW = [Draw(model, 0) for model in dict.fromkeys([*SIXTH, gn.Microfacet, Sum])]  # a compilation takes seconds
SOME = pytest.mark.parametrize("draw", thinned(FEW, [Draw(gn.Microfacet, 0)]), ids=str)
each_plumbing = pytest.mark.parametrize("m", PLUMBING.values(), ids=PLUMBING)
each_dtype = pytest.mark.parametrize("dtype", ["float32", "float64"])
CONDUCTOR = gn.Microfacet(gn.GGX(0.3), gn.Conductor([0.2, 0.9, 1.1], [3.9, 2.5, 2.4]))
TWO_LOBES = gn.Lambertian([0.1, 0.2, 0.3]) + 0.5 * gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.5))


# What is compiled of which measurement: with f and pdf of all of them this would take a minute more.
MEASURED = {"merl": "f", "merl-nearest": "pdf", "rgl": "pdf", "rgl-anisotropic": "f"}
each_measured = pytest.mark.parametrize("measured", thinned(MEASURED, ("merl-nearest",)))
pytestmark = pytest.mark.slow_because("torch.compile and jax.jit take seconds for a formula")


def made(name: str) -> Any:
    """A measurement of which nothing is converted yet."""
    kind, _, how = name.partition("-")
    if kind == "merl":
        return MERL(random_table(180), how or "trilinear")
    return RGL(synthetic(2 if how else 0, channels=5 if how else 3))


@pytest.fixture(autouse=True)
def forget(request: pytest.FixtureRequest) -> Iterator[None]:
    """What Dynamo compiled is forgotten after each test, and pytest does not collect its notes, of which it is slow."""
    if "torch" not in request.fixturenames:
        yield
        return
    torch = request.getfixturevalue("torch")
    logging.getLogger("torch.__trace").disabled = True
    yield
    torch._dynamo.reset()


def compiled(torch: Any, function: Callable, backend: str = "eager") -> Callable:
    """The function in one graph."""
    return torch.compile(function, backend=backend, fullgraph=True)


def arrays(make: Callable, dtype: str, count: int | None = None) -> tuple[Any, Any, Any]:
    """wi, wo (N, 3) and u (N, 2)."""
    wi, wo = pairs()
    u = np.random.default_rng(5).random((len(wi), 2))
    return tuple(make(x[:count].astype(dtype)) for x in (wi, wo, u))


def same(got: Any, want: Any, rtol: float = 0.0) -> None:
    got, want = (x if isinstance(x, tuple) else (x,) for x in (got, want))
    for a, b in zip(got, want, strict=True):
        assert a.dtype == b.dtype
        assert a.shape == b.shape
        np.testing.assert_allclose(np.asarray(a), np.asarray(b), rtol=rtol, atol=rtol)


# PyTorch. Dynamo's own back end runs the graph as it was found: the same operations, so the same numbers.


@SOME
def test_torch_compiles_f_and_pdf(torch, draw):
    for name, channels, dtype in (("f", 3, "float32"), ("pdf", None, "float64")):
        wi, wo, _ = arrays(torch.from_numpy, dtype)
        function = getattr(draw.material(channels), name)
        same(compiled(torch, function)(wi, wo), function(wi, wo))


FACETS = gn.TabulatedFacets([0.0, 0.5, 1.5], [1.0, 0.5, 0.0])


@pytest.mark.parametrize("is_compiled", [True, False])
@pytest.mark.parametrize("m", [gn.ModifiedPhong(np.array([0.2, 0.3, 0.4]), 8.0), gn.Microfacet(FACETS)], ids=str)
def test_torch_compiles_what_numpy_has_computed(torch, m, is_compiled, monkeypatch):
    """What was made of arrays for NumPy, compiled or not, is nothing that Dynamo cannot look past."""
    monkeypatch.setattr(planning, "available", lambda: is_compiled)
    m = m.replace()
    wi, wo, _ = arrays(torch.from_numpy, "float32")
    m.f(wi.numpy(), wo.numpy())
    same(compiled(torch, m.f)(wi, wo), m.f(wi, wo))


@pytest.mark.full
@pytest.mark.parametrize("draw", [d for d in draws(1, every=9) if d.model is gn.Microfacet], ids=str)
def test_torch_compiles_all_kinds_of_facets(torch, draw):
    wi, wo, _ = arrays(torch.from_numpy, "float32")
    m = draw.material(3)
    same(compiled(torch, m.f)(wi, wo), m.f(wi, wo))


@pytest.mark.parametrize("m", [gn.Lambertian(0.5), gn.IdealSpecular([0.5, 0.9]), TWO_LOBES], ids=repr)
def test_torch_compiles_sampling(torch, m):
    _, wo, u = arrays(torch.from_numpy, "float32")
    same(tuple(compiled(torch, m.sample)(wo, u)), tuple(m.sample(wo, u)))


@each_measured
def test_torch_compiles_measurements(torch, measured):
    wi, wo, _ = arrays(torch.from_numpy, "float32")
    function = getattr(made(measured), MEASURED[measured])
    same(compiled(torch, function)(wi, wo), function(wi, wo))


def torch_values(torch: Any, m: Any) -> dict[str, Any]:
    """The numbers of a material as tensors to differentiate by."""
    return {path: torch.tensor(p.value, requires_grad=True, dtype=torch.float64) for path, p in m.parameters.items()}


SHINY = gn.Lambertian([0.1, 0.2]) + 0.5 * gn.Phong(0.3, 8.0)


@pytest.mark.parametrize("m", [pytest.param(SHINY, marks=pytest.mark.full), gn.Microfacet(gn.GGX(0.3))], ids=repr)
def test_torch_gradients(torch, m):
    wi, wo, _ = arrays(torch.from_numpy, "float64", 64)
    found = []
    for wrap in (lambda f: f, lambda f: compiled(torch, f, "aot_eager")):
        values = torch_values(torch, m)
        a, b = wi.clone().requires_grad_(), wo.clone().requires_grad_()
        f = wrap(lambda values, a, b: tree.with_values(m, values).f(a, b))(values, a, b)
        found.append((f.detach(), *torch.autograd.grad(f.sum(), [*values.values(), a, b])))
    same(found[1], found[0], rtol=1e-12)


def test_torch_compiles_modules(torch):
    from gonio.bridges.torch import Material

    wi, wo, _ = arrays(torch.from_numpy, "float32", 64)
    module = Material(TWO_LOBES, ["0.rho", "1.weight"])
    whole = compiled(torch, module, "aot_eager")
    whole(wi, wo).sum().backward()
    got = [p.grad.clone() for p in module.parameters()]
    module.zero_grad()
    module(wi, wo).sum().backward()
    for a, p in zip(got, module.parameters(), strict=True):
        np.testing.assert_allclose(a, p.grad, rtol=1e-5)
    with torch.no_grad():
        for p in module.parameters():
            p.mul_(0.5)
    same(whole(wi, wo).detach(), module(wi, wo).detach(), rtol=1e-6)


def counting(torch: Any) -> Any:
    from torch._dynamo.testing import CompileCounter

    return CompileCounter()


@pytest.mark.parametrize("make", [lambda: SHINY, pytest.param(lambda: MERL(random_table(180)), marks=pytest.mark.full)])
def test_torch_compiles_once_for_new_directions_and_for_other_batches(torch, make):
    counter = counting(torch)
    m = make()
    f = compiled(torch, m.f, counter)
    wi, wo, _ = arrays(torch.from_numpy, "float32")
    for a, b in ((wi, wo), (wo, wi), (-wi, wo)):
        same(f(a, b), m.f(a, b))
    assert counter.frame_count == 1
    for count in (100, 70, 33):
        same(f(wi[:count], wo[:count]), m.f(wi[:count], wo[:count]))
    assert counter.frame_count == 2  # the second time for any length


def test_torch_compiles_once_for_new_tensors_as_parameters(torch):
    counter = counting(torch)
    wi, wo, _ = arrays(torch.from_numpy, "float32")
    f = compiled(
        torch, lambda alpha, wi, wo: tree.with_values(CONDUCTOR, {"distribution.alpha_x": alpha}).f(wi, wo), counter
    )
    for alpha in (0.2, 0.4):
        same(f(torch.tensor(alpha), wi, wo), CONDUCTOR.replace({"distribution.alpha_x": alpha}).f(wi, wo), rtol=2e-6)
    assert counter.frame_count == 1


def test_torch_keeps_materials_apart(torch):
    wi, wo, _ = arrays(torch.from_numpy, "float32")
    f = compiled(torch, lambda m, wi, wo: m.f(wi, wo))
    for rho in ([0.1, 0.2, 0.3], [0.3, 0.2, 0.1], 0.1, 0.2, 0.3):
        m = gn.Lambertian(rho)
        same(f(m, wi, wo), m.f(wi, wo))


def test_torch_leaves_parameters_read_only(torch):
    wi, wo, _ = arrays(torch.from_numpy, "float32")
    m = gn.Lambertian([0.1, 0.2, 0.3])
    compiled(torch, m.f)(wi, wo)
    assert not m.rho.flags.writeable


def test_torch_keeps_nothing_that_gradients_cannot_use(torch):
    wi, wo, _ = arrays(torch.from_numpy, "float32")
    m = gn.Microfacet(gn.GGX([0.2, 0.3]))
    with torch.inference_mode():
        m.f(wi, wo)
    a = wi.clone().requires_grad_()
    m.f(a, wo).sum().backward()
    assert torch.isfinite(a.grad).all()


def check_torch_reads_no_values(torch: Any, m: Any, dtype: str) -> None:
    """Tensors without values: whatever would look at them, or copy them to the host, raises."""
    wi, wo, u = arrays(lambda x: torch.from_numpy(x).to("meta"), dtype)
    f = m.f(wi, wo)
    for x in (f, m.pdf(wi, wo), *m.sample(wo, u)):
        assert x.device.type == "meta"
        assert x.dtype in (getattr(torch, dtype), torch.bool)
    assert f.shape == m.f(*pairs()).shape


# No formula asks for a value: that it can be traced (`test_ops.py`) says as much. Between arrays and formulas:


@each_plumbing
@each_dtype
def test_torch_reads_no_values(torch, m, dtype):
    check_torch_reads_no_values(torch, m, dtype)


@pytest.mark.full
@pytest.mark.parametrize("draw", draws(1, every=9), ids=str)
@each_dtype
def test_torch_reads_no_values_of_any_model(torch, draw, dtype):
    for channels in (None, 3):
        check_torch_reads_no_values(torch, draw.material(channels), dtype)


@each_measured
def test_torch_reads_no_values_of_measurements(torch, measured):
    m = made(measured)
    wi, wo, u = arrays(lambda x: torch.from_numpy(x).to("meta"), "float32")
    for x in (m.f(wi, wo), m.pdf(wi, wo), *m.sample(wo, u)):
        assert x.device.type == "meta"


# JAX.


# The values are compared with NumPy's: outside of jit JAX compiles every operation by itself, which takes long.


@SOME
def test_jax_compiles(jax, draw):
    wi, wo, _ = arrays(jax.numpy.asarray, "float64")
    f = draw.material(3).f
    want = f(*pairs())
    np.testing.assert_allclose(jax.jit(f)(wi, wo), want, rtol=1e-9, atol=1e-9 * np.abs(want).max())


def check_jax_traces_without_values(jax: Any, m: Any, dtype: str) -> None:
    wi, wo, u = arrays(lambda x: jax.ShapeDtypeStruct(x.shape, x.dtype), dtype)
    f, pdf, sample = (jax.eval_shape(*call) for call in ((m.f, wi, wo), (m.pdf, wi, wo), (m.sample, wo, u)))
    assert f.dtype == pdf.dtype == sample.wi.dtype == sample.weight.dtype == dtype
    assert f.shape == m.f(*pairs()).shape


@each_plumbing
@each_dtype
def test_jax_traces_without_values(jax, m, dtype):
    check_jax_traces_without_values(jax, m, dtype)


@pytest.mark.full
@pytest.mark.parametrize("draw", draws(1, every=9), ids=str)
@each_dtype
def test_jax_traces_any_model_without_values(jax, draw, dtype):
    for channels in (None, 3):
        check_jax_traces_without_values(jax, draw.material(channels), dtype)


@each_measured
def test_jax_compiles_measurements(jax, measured):
    name = MEASURED[measured]
    wi, wo, _ = arrays(jax.numpy.asarray, "float64")
    m = made(measured)
    np.testing.assert_allclose(jax.jit(getattr(m, name))(wi, wo), getattr(m, name)(*pairs()), rtol=1e-7, atol=1e-9)


def test_jax_compiles_sampling(jax):
    _, wo, u = arrays(jax.numpy.asarray, "float64")
    want = TWO_LOBES.sample(*(np.asarray(x) for x in (wo, u)))
    for a, b in zip(jax.jit(TWO_LOBES.sample)(wo, u), want, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)


def test_jax_compiles_once_for_materials_of_one_structure(jax):
    import gonio.bridges.jax  # noqa: F401  (materials become pytrees)

    wi, wo, _ = arrays(jax.numpy.asarray, "float64", 64)
    traced = []

    @jax.jit
    def f(m, wi, wo):
        traced.append(m)
        return m.f(wi, wo)

    other = TWO_LOBES.replace({"0.rho": [0.3, 0.2, 0.1], "1.of.fresnel.eta": 1.7})
    for m in (TWO_LOBES, other, TWO_LOBES):
        np.testing.assert_allclose(f(m, wi, wo), m.f(*(np.asarray(w) for w in (wi, wo))), rtol=1e-9)
    assert len(traced) == 1


def test_jax_gradients_and_batches(jax):
    wi, wo, _ = arrays(jax.numpy.asarray, "float64", 64)

    def total(eta, wi):
        return tree.with_values(TWO_LOBES, {"1.of.fresnel.eta": eta}).f(wi, wo).sum()

    by_eta, by_wi = jax.jit(jax.grad(total, argnums=(0, 1)))(1.5, wi)
    assert by_wi.shape == wi.shape
    numbers = [np.asarray(w) for w in (wi, wo)]
    below, above = (TWO_LOBES.replace({"1.of.fresnel.eta": eta}).f(*numbers).sum() for eta in (1.5 - 1e-5, 1.5 + 1e-5))
    np.testing.assert_allclose(by_eta, (above - below) / 2e-5, rtol=1e-6)
    one_by_one = jax.jit(jax.vmap(TWO_LOBES.f))(wi, wo)
    np.testing.assert_allclose(one_by_one, TWO_LOBES.f(*numbers), rtol=1e-9)
    totals = jax.jit(jax.vmap(total, in_axes=(0, None)))(jax.numpy.array([1.3, 1.7]), wi)
    want = [TWO_LOBES.replace({"1.of.fresnel.eta": eta}).f(*numbers).sum() for eta in (1.3, 1.7)]
    np.testing.assert_allclose(totals, want, rtol=1e-9)
