"""The pointwise laws of every model, in both precisions, at random parameters: on NumPy and PyTorch.

Other libraries are held to NumPy in each operation (`test_ops.py`, which says why that is enough) and here on the
materials of `PLUMBING`; on every model where `-m full` asks for it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from libraries import Torch, opened, switch_off, thinned
from materials import (
    COMPILED,
    MODELS,
    OBEDIENT,
    PLUMBING,
    Draw,
    at_bounds,
    at_corners,
    breaks,
    draws,
    pairs,
    rows_at_bounds,
)
from sweeps import both_ways, by_model, each_model, trying

import gonio as gn
from gonio.base.sums import Scaled, Sum
from gonio.evaluate import blocks
from gonio.formula import tree
from gonio.formula.direction import HORIZON
from gonio.laws import LAWS
from gonio.models._wrapper import Reframed

CHANNELS = (None, 3)
ALL, SOME, FEW = draws(), draws(2, every=3), draws(1, every=5)
each_of_models = pytest.mark.parametrize("model", MODELS, ids=lambda c: c.__name__)
HANDFUL = pytest.mark.parametrize(  # for what the interface does, not formulas
    "m",
    [
        *(pytest.param(PLUMBING[name], id=name) for name in ("number", "channels", "delta", "rotation")),
        *(pytest.param(d.material(*d.layouts), id=str(d), marks=pytest.mark.full) for d in FEW if d in OBEDIENT),
    ],
)
COUNT = len(pairs()[0])  # one batch shape everywhere: libraries that compile do so once per shape
FLOAT32, FLOAT64 = 2.0**-24, 2.0**-52  # roundings; the latter so that 1 + FLOAT64 is not 1
DTYPES = {"float32": FLOAT32, "float64": FLOAT64}
BOTH = tuple(DTYPES)
each_dtype = pytest.mark.parametrize("dtype", DTYPES)
each_plumbing = pytest.mark.parametrize("m", PLUMBING.values(), ids=PLUMBING)


def rounded(m: Any, dtype: str) -> Any:
    """The material with the parameters that it has in this precision, as float64."""
    return tree.each(m, lambda v: np.asarray(v, dtype).astype(float) if np.ndim(v) else float(np.asarray(v, dtype)))


@lru_cache(maxsize=256)  # the laws of one material come one after the other
def unavoidable(m: Any, dtype: str) -> np.ndarray:
    """How much f of the pairs, of this precision, changes when directions and parameters move by one rounding.

    A model of the form cos^n is allowed a rounding of the cosine, which it multiplies by n; a film, a rounding of its
    phase at either direction; one that turns directions, a rounding of their largest component in all three.
    """
    unit = DTYPES[dtype]
    wi, wo = (w.astype(dtype).astype(float) for w in pairs())
    rng = np.random.default_rng(0)
    moved = [(wi, wo), *((wi * (1 + unit * signs(rng, wi)), wo * (1 + unit * signs(rng, wo))) for _ in range(8))]
    if any(isinstance(lobe, Reframed) for _, lobe in m.lobes()):
        moved += [(wi + 0.5 * unit * signs(rng, wi), wo + 0.5 * unit * signs(rng, wo)) for _ in range(8)]
    kept = m.parameters
    rows = {path: np.repeat(np.array(p.value, ndmin=3), 1 + 2 * len(kept), axis=0) for path, p in kept.items()}
    for i, (path, p) in enumerate(kept.items()):
        for j, s in ((1, -unit), (2, unit)):
            rows[path][2 * i + j] = np.clip(np.multiply(p.value, 1 + s), p.low, p.high)
    with pytest.MonkeyPatch.context() as patch:
        switch_off(patch)  # of all at once: kernels of maps are others
        f, *others = m.f(*(np.stack(w) for w in zip(*moved, strict=True)))
        same, *changed = m.replace(rows).f(wi, wo).reshape(-1, *f.shape) if kept else [f]
    change = np.max(np.abs([*(g - f for g in others), *(g - same for g in changed)]), axis=0)
    exponent = max([float(np.max(p.value)) for path, p in kept.items() if path.endswith("n")], default=0.0)
    films = [x for _, lobe in m.lobes() for x in vars(lobe).values() if isinstance(x, gn.ThinFilm)]
    phases = [4.0 * np.pi * np.multiply(x.eta, x.thickness) / x.wavelength for x in films]
    return change + (1.0 + exponent + sum(phases)) * unit * np.abs(f)


def smallest(f: np.ndarray, unit: float) -> float:
    """Below this, values of a lobe of this height are made of numbers that libraries may flush to 0."""
    return (1e-34 if unit == FLOAT32 else 1e-300) * (1.0 + float(np.abs(f).max()))


def signs(rng: np.random.Generator, like: np.ndarray) -> np.ndarray:
    return rng.choice([-1.0, 1.0], like.shape)


def close(got: np.ndarray, want: np.ndarray, allowed: Any) -> None:
    """|got - want| <= allowed, with the worst place in the message."""
    assert got.shape == want.shape
    assert np.isfinite(got).all()
    excess = np.abs(got - want) / np.maximum(allowed, 1e-300)
    at = np.unravel_index(np.argmax(excess), excess.shape)
    assert excess[at] <= 1.0, f"at {at}: got {got[at]!r}, want {want[at]!r}, {excess[at]:.3g} times what is allowed"


# The laws: what holds of a material, in a precision. `TABLE`, below, says of which it is tried, and how.


def finite_and_not_negative(m: Any, dtype: str) -> None:
    wi, wo = (w.astype(dtype) for w in pairs())
    f, pdf = m.f(wi, wo), m.pdf(wi, wo)
    assert f.dtype == pdf.dtype == dtype
    assert np.isfinite(f).all()
    assert np.isfinite(pdf).all()
    assert f.min() >= 0.0 or "positivity" in breaks(m)
    assert pdf.min() >= 0.0


def reciprocal(m: Any, dtype: str) -> None:
    if "reciprocity" in breaks(m):
        return  # test_declared_laws_are_broken demands the breach
    wi, wo = (w.astype(dtype) for w in pairs())
    f = m.f(wi, wo)
    if dtype == "float64":
        allowed = 1e-12 * np.abs(f) + 16.0 * unavoidable(m, dtype)
    else:
        allowed = 20.0 * unavoidable(rounded(m, dtype), dtype) + smallest(f, FLOAT32)
    close(m.f(wo, wi), f, allowed)


def as_in_float64(m: Any, dtype: str) -> None:
    wi, wo = (w.astype(dtype) for w in pairs())
    m = rounded(m, dtype)
    f = m.f(wi.astype(float), wo.astype(float))
    close(m.f(wi, wo), f, 8.0 * unavoidable(m, dtype) + smallest(f, FLOAT32))


def rgb_is_three_materials(m: Any, dtype: str) -> None:
    wi, wo = pairs()
    f = m.f(wi, wo)
    if f.ndim == 1:
        return  # no parameter drew a channel axis
    for c in range(3):
        one = tree.each(m, lambda v, c=c: float(v[min(c, len(v) - 1)]) if np.ndim(v) else v)
        np.testing.assert_allclose(f[:, c], one.f(wi, wo), rtol=1e-11, atol=1e-15 * np.abs(f).max())


def isotropic_where_nothing_says_otherwise(m: Any, dtype: str) -> None:
    if any(tree.is_oriented(lobe) for _, lobe in m.lobes()):
        return
    wi, wo = pairs()
    turn = np.array([[np.cos(1.1), np.sin(1.1), 0.0], [-np.sin(1.1), np.cos(1.1), 0.0], [0.0, 0.0, 1.0]])
    turned = (wi @ turn, wo @ turn)
    f = m.f(wi, wo)
    close(m.f(*turned), f, 64.0 * unavoidable(m, dtype) + 1e-300)


def compiled_as_on_arrays(m: Any, dtype: str) -> None:
    """Kernels give what the formula gives on NumPy arrays, for every method."""
    compiled_f_and_pdf(m, dtype)
    if dtype == "float64":
        compiled_samples(m, dtype)


def compiled_f(m: Any, dtype: str) -> None:
    m = rounded(m, dtype)
    wi, wo = (w.astype(dtype) for w in pairs())
    compiled, arrays = both(lambda: m.f(wi, wo))
    close(compiled, arrays, 20.0 * unavoidable(m, dtype) + smallest(arrays, DTYPES[dtype]))


def compiled_pdf(m: Any, dtype: str) -> None:
    m = rounded(m, dtype)
    wi, wo = (w.astype(dtype) for w in pairs())
    compiled, arrays = both(lambda: m.pdf(wi, wo))
    np.testing.assert_allclose(compiled, arrays, rtol=2e4 * DTYPES[dtype], atol=1e-30)


def compiled_samples(m: Any, dtype: str) -> None:
    """In one kernel: directions, and f and pdf there."""
    compiled, arrays = both(lambda: m.sample(pairs()[1], uniform(COUNT)))
    np.testing.assert_allclose(compiled.wi, arrays.wi, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(compiled.weight, arrays.weight, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(compiled.pdf, arrays.pdf, rtol=1e-8, atol=1e-8)
    np.testing.assert_array_equal(compiled.delta, arrays.delta)


def both(call: Callable[[], Any]) -> tuple[Any, Any]:
    """What it gives by kernels, and on arrays."""
    with pytest.MonkeyPatch.context() as patch:
        compiled = call()
        switch_off(patch)
        return compiled, call()


def compiled_f_and_pdf(m: Any, dtype: str) -> None:
    compiled_f(m, dtype)
    compiled_pdf(m, dtype)


def the_same_in_blocks(m: Any, dtype: str) -> None:
    wi, wo = (np.tile(w, (5, 1, 1)) for w in pairs())
    u = np.random.default_rng(2).random((*wo.shape[:-1], 2))
    whole = (m.f(wi, wo), m.pdf(wi, wo), *m.sample(wo, u))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "BLOCK", 1024)
        assert wi[..., 0].size > 1024
        cut = (m.f(wi, wo), m.pdf(wi, wo), *m.sample(wo, u))
    for a, b in zip(whole, cut, strict=True):
        assert a.dtype == b.dtype
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-15)


def conserving(m: Any, dtype: str, theta: tuple[float, ...] = (0.0, 45.0, 75.0, 89.9)) -> None:
    """At these angles in degrees."""
    if "energy" in breaks(m):
        return
    terms = m.terms if isinstance(m, Sum) else [m]
    limit = sum(float(t.weight) if isinstance(t, Scaled) else 1.0 for t in terms)
    phi = 0.3 + np.arange(len(theta)) * 0.7
    a = gn.albedo(m, gn.direction(np.radians(theta), phi), tolerance=3e-4)
    assert np.isfinite(a).all()
    assert a.min() >= 0.0 or "positivity" in breaks(m)
    assert a.max() <= limit * (1.0 + 1e-3)


def conserving_at_more_angles(m: Any, dtype: str) -> None:
    conserving(m, dtype, (0.0, 20.0, 45.0, 60.0, 75.0, 85.0, 89.0, 89.9))


# Every library.


def check_values(library: Any, m: Any, dtype: str) -> None:
    """f and pdf on a library are those of NumPy in double precision."""
    unit = DTYPES[dtype]
    m = rounded(m, dtype)
    wi, wo = (w.astype(dtype) for w in pairs())
    wi64, wo64 = wi.astype(float), wo.astype(float)
    a, b = library.array(wi, dtype), library.array(wo, dtype)
    f, pdf = m.f(a, b), m.pdf(a, b)
    assert library.dtype(f) == library.dtype(pdf) == dtype
    want = m.f(wi64, wo64)
    close(library.numpy(f), want, 20.0 * unavoidable(m, dtype) + smallest(want, unit))
    np.testing.assert_allclose(library.numpy(pdf), m.pdf(wi64, wo64), rtol=2e4 * unit, atol=1e-30)


@pytest.mark.few_by_jax("float64", "number")
@each_plumbing
@each_dtype
def test_libraries_agree(library, m, dtype):
    check_values(library, m, dtype)


def torch_agrees(m: Any, dtype: str) -> None:
    check_values(opened(Torch), m, dtype)


def uniform(count: int) -> np.ndarray:
    """Random numbers (N, 2) for sampling, with the ends of the interval among them."""
    u = np.random.default_rng(3).random((count, 2))
    top = 1.0 - 2.0**-24
    u[5:10] = [[0.0, 0.0], [top, top], [0.5, 0.0], [0.0, 0.5], [top, 0.0]]
    return u


def check_samples(library: Any, m: Any) -> None:
    """Samples on a library are those of NumPy."""
    wo = pairs()[1]
    u = uniform(len(wo))
    want, got = m.sample(wo, u), m.sample(library.array(wo), library.array(u))
    wi, weight, pdf, delta = (library.numpy(x) for x in got)
    np.testing.assert_allclose(wi, want.wi, rtol=0.0, atol=1e-7)  # z = sqrt(1 - x^2 - y^2): half the digits
    np.testing.assert_allclose(weight, want.weight, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(pdf, want.pdf, rtol=1e-8, atol=1e-8)
    assert delta.dtype == bool
    assert (delta == want.delta).all()


@each_plumbing
def test_libraries_agree_on_samples(library, m):
    check_samples(library, m)


def torch_agrees_on_samples(m: Any, dtype: str) -> None:
    check_samples(opened(Torch), m)


@pytest.mark.full
@pytest.mark.parametrize("drawn", by_model(FEW).values(), ids=by_model(FEW))
def test_libraries_agree_on_every_model(library, drawn):
    for draw, channels in itertools.product(drawn, CHANNELS):
        m = draw.material(channels)
        with trying(draw=draw, channels=channels):
            for dtype in DTYPES:
                check_values(library, m, dtype)
            check_samples(library, m)


def below() -> np.ndarray:
    """Directions (N, 3) below the horizon or too close to it."""
    w = np.random.default_rng(4).normal(size=(COUNT, 3))
    w[:, 2] = -np.abs(w[:, 2])
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    w[:40] = along()[:40]
    w[3:40:4, 2] = -1e-6
    return w


def along() -> np.ndarray:
    """Directions (N, 3) too close to the horizon, from above and from below."""
    w = np.random.default_rng(4).normal(size=(COUNT, 3))
    w[:, :2] /= np.linalg.norm(w[:, :2], axis=1, keepdims=True)
    w[:, 2] = np.resize([0.0, -0.0, 0.5 * HORIZON, -0.5 * HORIZON], COUNT)
    return w


@pytest.mark.few_by_jax("float64")
@HANDFUL
@each_dtype
def test_nothing_below_the_horizon(library, m, dtype):
    """Where no light is: below the horizon of an opaque material, along the surface of one that transmits."""
    down, up = below() if m.sides == "front" else along(), pairs()[0]
    which = np.arange(COUNT)[:, None] % 3
    wi, wo = np.where(which == 0, up, down), np.where(which == 1, up, down)
    wi, wo, down = (library.array(w, dtype) for w in (wi, wo, down))
    np.testing.assert_array_equal(library.numpy(m.f(wi, wo)), 0.0)
    np.testing.assert_array_equal(library.numpy(m.pdf(wi, wo)), 0.0)
    s = m.sample(down, library.array(uniform(COUNT), dtype))
    np.testing.assert_array_equal(library.numpy(s.weight), 0.0)
    np.testing.assert_array_equal(library.numpy(s.pdf), 0.0)
    assert not library.numpy(s.delta).any()
    np.testing.assert_array_equal(library.numpy(m.delta_reflectance(down)), 0.0)


@pytest.mark.few_by_jax("float64")
@HANDFUL
@each_dtype
def test_nan_in_nan_out(library, m, dtype):
    i = np.arange(COUNT)
    good = np.where(i[:, None] % 2, pairs()[0], below())
    bad = good.copy()
    bad[i, i % 3] = np.resize([np.nan, np.nan, np.nan, np.nan, np.inf, -np.inf], COUNT)
    which = i[:, None] % 4
    wi, wo = np.where(which == 0, good, bad), np.where(which == 1, good, bad)
    wi, wo, bad = (library.array(w, dtype) for w in (wi, wo, bad))
    np.testing.assert_array_equal(library.numpy(m.f(wi, wo)), np.nan)
    np.testing.assert_array_equal(library.numpy(m.pdf(wi, wo)), np.nan)
    s = m.sample(bad, library.array(uniform(COUNT), dtype))
    np.testing.assert_array_equal(library.numpy(s.wi), np.nan)
    np.testing.assert_array_equal(library.numpy(s.weight), np.nan)
    np.testing.assert_array_equal(library.numpy(s.pdf), np.nan)
    np.testing.assert_array_equal(library.numpy(m.delta_reflectance(bad)), np.nan)


def test_nan_random_numbers_give_nan(library):
    u = uniform(COUNT)
    u[:3] = [[0.5, np.nan], [np.nan, 0.5], [np.nan, np.nan]]
    bad = np.arange(COUNT) < 3
    for m in (gn.Lambertian(0.5), gn.Microfacet(gn.GGX(0.3)), gn.IdealSpecular(), gn.ABC() + gn.Lambertian()):
        s = m.sample(library.array(pairs()[1]), library.array(u))
        assert (np.isnan(library.numpy(s.weight)) == bad).all()
        assert (np.isnan(library.numpy(s.pdf)) == bad).all()


# Gradients.


def torch_gradients(torch: Any, m: Any, dtype: str, wi: np.ndarray, wo: np.ndarray) -> dict[str, np.ndarray]:
    """Derivatives of sum f with respect to every parameter and to the directions."""
    kind = getattr(torch, dtype)
    leaves = {path: torch.tensor(p.value, dtype=kind, requires_grad=True) for path, p in m.parameters.items()}
    a, b = (torch.tensor(w, dtype=kind, requires_grad=True) for w in (wi, wo))
    total = m.replace(leaves).f(a, b).sum()
    found = torch.autograd.grad(total, [*leaves.values(), a, b], allow_unused=True)
    zero = {name: np.zeros(np.shape(x.detach())) for name, x in {**leaves, "wi": a, "wo": b}.items()}
    return {n: z if g is None else g.numpy() for (n, z), g in zip(zero.items(), found, strict=True)}


def jax_gradients(jax: Any, m: Any, dtype: str, wi: np.ndarray, wo: np.ndarray) -> dict[str, np.ndarray]:
    """The same by jax.grad."""

    def total(values: dict, a: Any, b: Any) -> Any:
        return m.replace(values).f(a, b).sum()

    values = {path: jax.numpy.asarray(p.value, dtype) for path, p in m.parameters.items()}
    found, a, b = jax.grad(total, (0, 1, 2))(values, jax.numpy.asarray(wi, dtype), jax.numpy.asarray(wo, dtype))
    return {n: np.asarray(g) for n, g in {**found, "wi": a, "wo": b}.items()}


def everywhere() -> tuple[np.ndarray, np.ndarray]:
    """The pairs, every fifth with one direction (or both) below the horizon, where derivatives have to be 0."""
    i = np.arange(COUNT)[:, None]
    wi, wo = pairs()
    return np.where(np.isin(i % 15, (0, 10)), below(), wi), np.where(np.isin(i % 15, (5, 10)), below(), wo)


def generic() -> tuple[np.ndarray, np.ndarray]:
    """Random pairs only: the exact ones lie on kinks, where derivatives are a matter of taste."""
    wi, wo = (np.resize(w[:96], (COUNT, 3)) for w in pairs())
    return wi, wo


def finite_gradients(m: Any, dtype: str) -> None:
    for name, g in torch_gradients(opened(Torch).module, m, dtype, *everywhere()).items():
        assert np.isfinite(g).all(), (name, m)
        if name in ("wi", "wo") and m.sides == "front":
            assert (g[::5] == 0.0).all()


@each_of_models
def test_gradients_are_finite_at_the_bounds(torch, model):
    """All bounds of a structure in one batch, of which each row is a material."""
    for m, dtype in itertools.product(rows_at_bounds(model), DTYPES):
        wi, wo = (w[None] for w in everywhere())
        for name, g in torch_gradients(torch, m, dtype, wi, wo).items():
            assert np.isfinite(g).all(), (name, m)


def check_jax_gradients(torch: Any, jax: Any, m: Any, dtype: str) -> None:
    """Derivatives by JAX are finite everywhere, in one precision; in the double one they are PyTorch's."""
    for name, g in jax_gradients(jax, m, dtype, *everywhere()).items():
        assert np.isfinite(g).all(), (name, m)
    wi, wo = generic()
    ours, theirs = (of(lib, m, "float64", wi, wo) for of, lib in ((jax_gradients, jax), (torch_gradients, torch)))
    for name, g in ours.items():
        assert np.isfinite(g).all(), (name, m)
        np.testing.assert_allclose(g, theirs[name], rtol=1e-9, atol=1e-11 * np.abs(g).max(), err_msg=name)


@pytest.mark.parametrize("name", thinned(PLUMBING, set(PLUMBING) - {"coat", "rotation"}))
def test_jax_gradients(torch, jax, name):
    check_jax_gradients(torch, jax, PLUMBING[name], "float32" if name == "delta" else "float64")


@pytest.mark.full
@pytest.mark.parametrize("draw", FEW, ids=str)
def test_jax_gradients_of_every_model(torch, jax, draw):
    # with channels for about half of the models
    check_jax_gradients(torch, jax, draw.material(CHANNELS[len(draw.model.__name__) % 2]), "float32")


def gradients_as_differences(m: Any, dtype: str) -> None:
    wi, wo = generic()
    found = torch_gradients(opened(Torch).module, m, "float64", wi, wo)
    for path, p in m.parameters.items():
        h = 1e-5 * p.value
        if not p.low <= p.value - h < p.value + h <= p.high:
            continue
        above, below = (m.replace({path: p.value + s}).f(wi, wo) for s in (h, -h))
        terms = (above - below) / (2.0 * h)
        expected = terms.sum()
        noise = np.abs(terms).sum() + np.abs(m.f(wi, wo)).sum() / abs(p.value)
        np.testing.assert_allclose(found[path], expected, rtol=0.0, atol=3e-5 * noise, err_msg=path)


# One table: law x material.


class Law(NamedTuple):
    """What holds: the cases of models that it is tried on, with so many channels (by default as each draw says)."""

    check: Callable[[Any, str], None]
    cases: list[Any]
    layouts: tuple[int | None, ...] = ()
    dtypes: tuple[str, ...] = ("float64",)


def of(some: list[Draw], compiled: Collection[Draw] = ()) -> list[Any]:
    """A case a model: on arrays some of its draws, and of some models kernels; `full` all others."""
    others, kernels = [d for d in ALL if d not in some], [d for d in ALL if d in compiled]
    return [
        *each_model(some, "uncompiled"),
        *each_model(others, "uncompiled", full=True),
        *each_model(kernels, "compiled"),
        *each_model([d for d in ALL if d not in compiled], "compiled", full=True),
    ]


FIRST = [d for d in COMPILED if d.seed == 0]
HELD = [d for d in FIRST if d in OBEDIENT]
COLOURED = HELD[::3]

TABLE = (
    Law(finite_and_not_negative, both_ways(ALL), dtypes=BOTH),
    Law(reciprocal, of(SOME, HELD), dtypes=BOTH),
    Law(as_in_float64, of(FEW), dtypes=("float32",)),  # kernels: by `compiled_f_and_pdf`
    Law(rgb_is_three_materials, of(FEW, COLOURED), (3,)),
    Law(isotropic_where_nothing_says_otherwise, of(SOME, HELD), (None,)),
    Law(conserving, each_model(FEW, "uncompiled"), (None,)),  # kernels of integrals: test_integrals.py has some
    Law(conserving_at_more_angles, each_model(ALL, "uncompiled", full=True), (None,)),
    Law(the_same_in_blocks, each_model(FIRST, "uncompiled")),
    Law(the_same_in_blocks, each_model(SOME, "uncompiled", full=True), CHANNELS),
    Law(compiled_samples, each_model(FIRST, "compiled")),
    Law(compiled_f_and_pdf, each_model(HELD, "compiled"), dtypes=BOTH),
    Law(compiled_as_on_arrays, each_model(SOME, "compiled", full=True), CHANNELS, BOTH),
    Law(torch_agrees, each_model(FEW, "uncompiled"), CHANNELS, BOTH),
    Law(torch_agrees_on_samples, each_model(FEW, "uncompiled"), CHANNELS),
    Law(finite_gradients, each_model(ALL, "uncompiled"), dtypes=BOTH),
    Law(gradients_as_differences, each_model(ALL, "uncompiled"), (None,)),
)


@pytest.mark.parametrize(
    ("law", "drawn", "evaluation"),
    sorted(
        (
            pytest.param(law, *case.values, id=f"{case.id}-{law.check.__name__}", marks=case.marks)
            for law in TABLE
            for case in law.cases
        ),
        key=lambda case: case.id,  # a process that has a model's kernels tries all laws on it
    ),
    indirect=["evaluation"],
)
def test_law(law, drawn, evaluation):
    for draw in drawn:
        for channels, dtype in itertools.product(law.layouts or draw.layouts, law.dtypes):
            with trying(draw=draw, channels=channels, dtype=dtype):
                law.check(draw.material(channels), dtype)


@pytest.mark.parametrize(
    ("model", "evaluation"),
    [
        *((model, "uncompiled") for model in MODELS),
        *thinned(((model, "compiled") for model in MODELS), [(draw.model, "compiled") for draw in COLOURED]),
    ],
    ids=lambda x: getattr(x, "__name__", x),
    indirect=["evaluation"],
)
def test_finite_and_not_negative_at_the_bounds(model, evaluation):
    """Compiled: of one structure; else all in one batch."""
    for m in at_bounds(model, 1) if evaluation == "compiled" else rows_at_bounds(model):
        for dtype in DTYPES:
            with trying(m=m, dtype=dtype):
                finite_and_not_negative(m, dtype)


# Declared breaches.


def test_only_laws_that_exist_are_declared():
    for model in MODELS:
        assert set(model.breaks) <= set(LAWS)
        assert all(len(reason) > 20 for reason in model.breaks.values())


DECLARED = [(model, law) for model in MODELS for law in model.breaks]


def extreme(model: type) -> Iterator[Any]:
    """Random materials of a model, each also with one parameter at a bound, and some with all of them there."""
    for m in [d.material() for d in draws(12) if d.model is model]:
        yield m
        for path, p in m.parameters.items():
            yield from (m.replace({path: bound}) for bound in (p.low, p.high))
    yield from at_corners(model, 48)


@pytest.mark.parametrize(("model", "law"), DECLARED, ids=lambda x: getattr(x, "__name__", x))
def test_declared_laws_are_broken(model, law):
    """Some parameters within the bounds break the law: what is declared is not an excuse."""
    wi, wo = pairs()
    up = gn.direction(np.radians([0.0, 60.0, 85.0, 89.99]), 0.0)
    for m in extreme(model):
        f = m.f(wi, wo)
        if law == "reciprocity":
            back = m.f(wo, wi)
            broken = (np.abs(f - back) > 0.1 * np.abs(f + back)).any()
        elif law == "positivity":
            broken = f.min() < 0.0
        elif law != "energy":
            broken = not gn.check(m, laws=[law]).passed
        else:
            broken = gn.albedo(m, up, tolerance=1e-3).max() > 1.003  # `conserving` allows 1.001
        if broken:
            return
    raise AssertionError(f"{model.__name__} obeys {law} at all parameters tried")
