"""Complex numbers of formulas: Python's own are the truth, in every array library and while a formula is traced."""

from __future__ import annotations

import cmath
import operator

import numpy as np
import pytest

from gonio.formula.complex import Complex, as_complex
from gonio.formula.direction import NORMAL
from gonio.trace.graph import Graph
from gonio.trace.symbol import Symbol

LIBRARIES = ["numpy", "torch", "jax", "drjit"]
POINTS = [1.0 + 2.0j, -3.0 + 0.5j, 0.2 - 3.9j, -1.0 - 1e-3j, 1e-4 + 1e4j, -5.0 + 0.0j, 2.0 + 0.0j, 0.3 - 2.0j]
BINARY = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}


def of_library(name: str, values: list[float]):
    if name == "numpy":
        return np.array(values)
    if name == "torch":
        torch = pytest.importorskip("torch")
        return torch.tensor(values, dtype=torch.float64)
    if name == "jax":
        jax = pytest.importorskip("jax")
        jax.config.update("jax_enable_x64", True)
        return jax.numpy.array(values)
    return pytest.importorskip("drjit.llvm").Float64(values)


def numbers(z: Complex) -> np.ndarray:
    assert type(z) is Complex
    return np.asarray(z.re) + 1j * np.asarray(z.im)


@pytest.mark.parametrize("name", LIBRARIES)
@pytest.mark.parametrize("op", BINARY.values(), ids=BINARY)
def test_operators_are_those_of_complex_numbers(op, name):
    a, b = np.array(POINTS), np.roll(POINTS, 3)
    za, zb = (Complex(of_library(name, x.real.tolist()), of_library(name, x.imag.tolist())) for x in (a, b))
    assert np.allclose(numbers(op(za, zb)), op(a, b), rtol=1e-14)
    assert np.allclose(numbers(op(za, Complex(zb.re))), op(a, b.real), rtol=1e-14)
    assert np.allclose(numbers(op(za, 1.5 - 2j)), op(a, 1.5 - 2j), rtol=1e-14)
    assert np.allclose(numbers(op(2.5, zb)), op(2.5, b), rtol=1e-14)
    if name != "drjit":  # whose arrays raise an error of their own where the other operand is none of theirs
        assert np.allclose(numbers(op(za.re, zb)), op(a.real, b), rtol=1e-14)


@pytest.mark.parametrize("name", LIBRARIES)
def test_functions_are_those_of_cmath(name):
    points = np.array(POINTS)
    z = Complex(of_library(name, points.real.tolist()), of_library(name, points.imag.tolist()))
    assert np.allclose(numbers(z.sqrt()), [cmath.sqrt(p) for p in POINTS], rtol=2e-15)
    assert np.allclose(numbers((z * 0.5).exp()), [cmath.exp(0.5 * p) for p in POINTS], rtol=1e-14)
    assert np.allclose(np.asarray(z.norm), np.abs(points) ** 2, rtol=1e-15)
    assert np.array_equal(numbers(z.conjugate), points.conj())
    real = Complex(of_library(name, points.real.tolist()))
    assert np.allclose(numbers(real.sqrt()), [cmath.sqrt(p.real) for p in POINTS], rtol=2e-15)


def test_a_part_that_is_written_zero_costs_nothing():
    graph = Graph()
    x, y = (Symbol(graph, graph.load(k, 0)) for k in (0, 1))
    before = len(graph.operations)
    product = Complex(x) * Complex(0.0, y)
    assert len(graph.operations) == before + 1
    assert product.re == 0.0
    assert product.im.node == (x * y).node
    assert (Complex(x) + Complex(0.0, y)).re is x
    assert (x * Complex(y)).re.node == (x * y).node  # a symbol on the left leaves the product to the complex number
    assert Complex(x, y).conjugate.conjugate.re is x


def test_parts_of_a_number_and_an_array_mix():
    im = np.array([4.0, 0.0])
    assert np.allclose(numbers(Complex(-3.0, im).sqrt()), np.sqrt(-3.0 + 1j * im))
    assert np.allclose(numbers(Complex(im, -4.0).sqrt()), np.sqrt(im - 4.0j))


@pytest.mark.parametrize("at", [(0.0, 0.0), (0.0, 0.0, "real"), (1.0, 0.0), (-1.0, 0.0)])
def test_derivatives_of_the_root_are_finite(at):
    torch = pytest.importorskip("torch")
    re, im = (torch.tensor(x, dtype=torch.float64, requires_grad=True) for x in at[:2])
    root = (Complex(re) if len(at) > 2 else Complex(re, im)).sqrt()
    (root.re + root.im).backward()
    assert torch.isfinite(re.grad)
    assert len(at) > 2 or torch.isfinite(im.grad)


@pytest.mark.parametrize("wrong", [operator.add, operator.mul, operator.truediv, operator.eq, operator.ne])
def test_what_complex_numbers_have_not_is_refused(wrong):
    with pytest.raises(TypeError):
        wrong(Complex(1.0, 2.0), NORMAL)
    with pytest.raises(TypeError):
        bool(Complex(1.0, 2.0))


def test_real_and_pythons_complex_numbers_are_taken():
    assert tuple(as_complex(2.0)) == (2.0, 0.0)
    assert tuple(as_complex(1 - 2j)) == (1.0, -2.0)
    z = Complex(1.0, 2.0)
    assert as_complex(z) is z
