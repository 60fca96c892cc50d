"""What a material is to its user: shapes and channels, parameters and values, and what bad input says."""

from __future__ import annotations

import copy
import inspect
import json
import math
import pickle
import re
from typing import Any

import numpy as np
import pytest
from materials import DISTRIBUTIONS, FRESNELS, MODELS, draws, most, on_sphere, public
from sweeps import each_draw, every

import gonio as gn
from gonio.base.light import Light
from gonio.base.sums import Scaled, Sum
from gonio.catalogue.expressions import expression, read
from gonio.declared import discover
from gonio.errors import ArrayTypeError, Error, FormatError, NotFoundError, ParameterError, ShapeError
from gonio.formula import tree
from gonio.formula.fields import CLASSES
from gonio.formula.json_form import from_json

WI, WO = on_sphere(0.4, 0.3), on_sphere(0.9, 2.5)
GREY = gn.Microfacet(gn.GGX(0.2, 0.4), gn.Dielectric(1.5))
RGB = gn.Lambertian([0.2, 0.4, 0.6]) + gn.Microfacet(gn.GGX(0.3), gn.Conductor([0.2, 0.9, 1.2], [3.9, 2.4, 2.3]))
PLAIN = gn.ModifiedPhong(0.4, 8.0)
COLOURED = gn.Lambertian([0.2, 0.4, 0.6]) + 0.5 * PLAIN  # of few operations: some libraries compile each for each shape


def grid(*shape: int, seed: int = 0) -> np.ndarray:
    """Directions (*shape, 3) above the horizon."""
    rng = np.random.default_rng(seed)
    return on_sphere(1.5 * rng.random(shape), 6.0 * rng.random(shape))


# What a class must say of itself.


LIGHTS = public(Light, discover.modules("gonio.lights"))


LABELS = ("Shapes", "Units", "Error", "Source")


@every(kind=[*MODELS, *DISTRIBUTIONS, *FRESNELS, *LIGHTS, Sum, Scaled])
def test_docstrings_have_their_labels(kind):
    text = inspect.cleandoc(kind.__doc__ or "")  # Python 3.13 cleans docstrings itself
    labels = ("Looks", *LABELS) if kind in MODELS else LABELS
    missing = [label for label in labels if f"\n{label} " not in text]
    assert not missing, f"{kind.__name__}: no {', '.join(missing)} in its docstring"
    assert all(f.doc for f in kind.fields.values())


@every(kind=MODELS)
def test_looks_are_values_to_try(kind):
    """What a docstring says to try can be made: expressions of the class itself, and values of its parameters."""
    looks = inspect.cleandoc(kind.__doc__ or "").partition("\nLooks ")[2].partition("\nShapes ")[0]
    tried = [word for word in re.findall(r"`(.*?)`", " ".join(looks.split())) if not word.isidentifier()]
    whole = [read(word) for word in tried if not re.match(r"\w+=", word)]
    assert any(isinstance(m, kind) for m in whole)
    for word in tried:
        if re.match(r"\w+=", word):
            assert isinstance(expression(f"{kind.__name__}({word})"), kind)


def test_everything_found_is_public():
    for kind in (*MODELS, *DISTRIBUTIONS, *FRESNELS, *LIGHTS):
        assert getattr(gn, kind.__name__) is kind
        assert kind.__name__ in gn.__all__
        assert CLASSES[kind.__name__] is kind
    assert set(gn.__all__) <= set(dir(gn))
    with pytest.raises(AttributeError, match="no attribute 'Lambertain'"):
        _ = gn.Lambertain


# Shapes.

SHAPES = [((3,), (3,)), ((1, 3), (1, 3)), ((7, 3), (7, 3)), ((3,), (7, 3)), ((4, 1, 3), (5, 3)), ((2, 4, 5, 3), (5, 3))]


def shaped(shape: tuple[int, ...], seed: int) -> np.ndarray:
    return grid(*shape[:-1], seed=seed)


@pytest.mark.few_by_jax("wi4")
@pytest.mark.parametrize(("of_wi", "of_wo"), SHAPES)
def test_shapes_of_f(library, of_wi, of_wo):
    if library.name == "drjit-array":
        pytest.skip("Array3f holds batches (N, 3) only")
    wi, wo = shaped(of_wi, 1), shaped(of_wo, 2)
    batch = np.broadcast_shapes(of_wi[:-1], of_wo[:-1])
    a, b = library.array(wi), library.array(wo)
    for m, channels in ((PLAIN, ()), (COLOURED, (3,)), (gn.Lambertian([0.5]), (1,)), (gn.Lambertian(0.5), ())):
        f = library.numpy(m.f(a, b))
        assert f.shape == (*batch, *channels)
        np.testing.assert_allclose(
            f, m.f(np.broadcast_to(wi, (*batch, 3)), np.broadcast_to(wo, (*batch, 3))), rtol=1e-9
        )
        assert library.numpy(m.pdf(a, b)).shape == batch


@pytest.mark.few_by_jax("shape2")
@pytest.mark.parametrize("shape", [(3,), (6, 3), (2, 3, 3)])
def test_shapes_of_samples(library, shape):
    if library.name == "drjit-array":
        pytest.skip("Array3f holds batches (N, 3) only")
    wo = shaped(shape, 3)
    u = np.random.default_rng(0).random((*shape[:-1], 2))
    for m, channels in ((PLAIN, ()), (COLOURED, (3,)), (gn.IdealSpecular([0.5]), (1,))):
        s = m.sample(library.array(wo), library.array(u))
        assert library.numpy(s.wi).shape == shape
        assert library.numpy(s.weight).shape == (*shape[:-1], *channels)
        assert library.numpy(s.pdf).shape == library.numpy(s.delta).shape == shape[:-1]
        assert library.numpy(m.delta_reflectance(library.array(wo))).shape == (*shape[:-1], *channels)


MAPS = [(4, 5, 1), (4, 5, 3), (5, 1), (5, 3), (4, 1, 1), (1, 5, 3), (3,), (1,)]


@pytest.mark.few_by_jax("(4, 5, 3)")
@pytest.mark.parametrize("shape", MAPS, ids=str)
def test_maps(library, shape):
    """A parameter's last axis is the channel axis, the others broadcast against the directions."""
    if library.name == "drjit-array":
        pytest.skip("Array3f holds batches (N, 3) only")
    rho = np.random.default_rng(1).random(shape)
    wi, wo = grid(4, 5, seed=1), grid(4, 5, seed=2)
    expected = np.broadcast_to(rho, (4, 5, shape[-1])) / math.pi
    a, b = library.array(wi), library.array(wo)
    own = library.array(rho)
    for values in (rho, own):
        m = gn.Lambertian(values)
        np.testing.assert_allclose(library.numpy(m.f(a, b)), expected, rtol=1e-12)
        weight = library.numpy(
            (gn.Lambertian(values) + gn.Lambertian(0.0)).sample(b, library.array(grid(4, 5)[..., :2] ** 2)).weight
        )
        assert weight.shape == expected.shape
        np.testing.assert_allclose(weight, expected * math.pi, rtol=1e-9)
    one = library.array(WI)
    assert library.numpy(gn.Lambertian(rho).f(one, one)).shape == shape
    alpha = np.random.default_rng(2).uniform(0.1, 0.9, shape)
    rough = gn.Microfacet(gn.GGX(alpha), 0.5).f(a, b)
    each = [gn.Microfacet(gn.GGX(float(x)), 0.5).f(wi, wo) for x in alpha.ravel()]
    picked = np.broadcast_to(np.arange(alpha.size).reshape(shape), (4, 5, shape[-1]))
    by_hand = np.stack(each)[picked, np.arange(4)[:, None, None], np.arange(5)[:, None]]
    np.testing.assert_allclose(library.numpy(rough), by_hand, rtol=1e-9)


def test_maps_are_isotropic_where_every_place_is():
    assert gn.Lambertian(np.full((4, 6, 1), 0.4)).is_isotropic()
    along = np.full((40, 60, 1), 0.2)
    along[7, 9] = 0.21
    assert not gn.Ward(alpha_x=along, alpha_y=0.2).is_isotropic()


def test_albedo_of_maps():
    alpha = np.random.default_rng(3).uniform(0.2, 0.9, (2, 3, 1))
    m = [0.2, 0.4] * gn.Microfacet(gn.GGX(alpha)) + gn.IdealSpecular([0.1, 0.3])
    w = grid(2, 3, seed=4)
    a = gn.albedo(m, w)
    assert a.shape == (2, 3, 2)
    for i, j in np.ndindex(2, 3):
        one = [0.2, 0.4] * gn.Microfacet(gn.GGX(float(alpha[i, j, 0]))) + gn.IdealSpecular([0.1, 0.3])
        np.testing.assert_allclose(a[i, j], gn.albedo(one, w[i, j]), atol=1e-6)
    np.testing.assert_allclose(gn.albedo(m, WI)[1, 2], gn.albedo(one, WI), atol=1e-6)


def test_albedo_of_integer_directions():
    """Directions may be written without decimal points."""
    m = gn.Microfacet(gn.GGX(0.5))
    expected = gn.albedo(m, [0.0, 0.0, 1.0])
    assert gn.albedo(m, np.array([0, 0, 1])) == expected
    assert gn.albedo(m, [0, 0, 1]) == expected
    assert m.f([0, 0, 1], np.array([0, 0, 1])) == m.f([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])


@pytest.mark.few_by_jax("(2, 0)")
@pytest.mark.parametrize("batch", [(0,), (2, 0), (0, 3)], ids=str)
def test_empty_batches(library, batch):
    if len(batch) > 1 and library.name == "drjit-array":
        pytest.skip("Array3f holds batches (N, 3) only")
    w, u = library.array(np.zeros((*batch, 3))), library.array(np.zeros((*batch, 2)))
    for m, channels in ((PLAIN, ()), (COLOURED, (3,))):
        assert library.numpy(m.f(w, w)).shape == (*batch, *channels)
        assert library.numpy(m.pdf(w, w)).shape == batch
        s = m.sample(w, u)
        assert library.numpy(s.wi).shape == (*batch, 3)
        assert library.numpy(s.weight).shape == (*batch, *channels)
        assert library.numpy(s.pdf).shape == batch


def test_albedo_of_no_directions():
    assert gn.albedo(RGB, np.zeros((0, 3))).shape == (0, 3)


def test_lists_and_layouts():
    """Lists are float64; views, transposes and read-only arrays are as good as any."""
    wi, wo = grid(6, seed=5), grid(6, seed=6)
    f = RGB.f(wi, wo)
    np.testing.assert_array_equal(RGB.f(wi.tolist(), wo.tolist()), f)
    np.testing.assert_array_equal(RGB.f(tuple(map(tuple, wi)), wo), f)
    big = np.zeros((12, 5))
    big[::2, 1:4] = wi
    strided = big[::2, 1:4]
    turned = np.asfortranarray(wo)
    locked = wi.copy()
    locked.flags.writeable = False
    np.testing.assert_array_equal(RGB.f(strided, turned), f)
    np.testing.assert_array_equal(RGB.f(locked, wo), f)
    np.testing.assert_array_equal(RGB.f(wi[::-1], wo[::-1])[::-1], f)
    s, t = RGB.sample(locked, [[0.3, 0.4]] * 6), RGB.sample(wi, np.full((6, 2), [0.3, 0.4]))
    for x, y in zip(s, t, strict=True):
        np.testing.assert_array_equal(x, y)


@pytest.mark.few_by_jax("float32")
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_lists_join_the_other_arrays(library, dtype):
    """Lists take the library and the dtype of the arrays beside them."""
    wi, wo = grid(4), grid(4, seed=1)
    theirs = library.array(wo, dtype)
    expected = library.numpy(COLOURED.f(library.array(wi, dtype), theirs))
    f = COLOURED.f(wi.tolist(), theirs)
    assert library.dtype(f) == dtype
    np.testing.assert_array_equal(library.numpy(f), expected)
    np.testing.assert_allclose(library.numpy(COLOURED.f(theirs, wi.tolist())), expected, rtol=1e-5)
    one = library.numpy(COLOURED.f(theirs, WI.tolist()))
    np.testing.assert_allclose(one, COLOURED.f(wo, WI), rtol=1e-5)
    u = [[0.3, 0.4]] * 4
    np.testing.assert_allclose(
        library.numpy(COLOURED.sample(theirs, u).weight), COLOURED.sample(wo, u).weight, rtol=1e-4
    )


def test_arrays_are_left_alone():
    wi, wo = grid(5), grid(5, seed=1)
    kept = wi.copy(), wo.copy()
    alpha = np.array([0.1, 0.2, 0.3])
    m = gn.Microfacet(gn.GGX(alpha))
    m.f(wi, wo), m.sample(wo, wi[:, :2] ** 2)
    np.testing.assert_array_equal(wi, kept[0])
    np.testing.assert_array_equal(wo, kept[1])
    alpha[:] = 0.9
    assert m == gn.Microfacet(gn.GGX([0.1, 0.2, 0.3]))
    with pytest.raises(ValueError, match="read-only"):
        m.distribution.alpha_x[0] = 0.5


def test_out():
    wi, wo = grid(6), grid(6, seed=1)
    out = np.empty((6, 3))
    assert RGB.f(wi, wo, out=out) is out
    np.testing.assert_array_equal(out, RGB.f(wi, wo))
    wide = np.empty((6, 6))
    RGB.f(wi, wo, out=wide[:, ::2])
    np.testing.assert_array_equal(wide[:, ::2], out)
    for wrong, error in (
        (np.empty((6,)), ShapeError),
        (np.empty((6, 3), "float32"), ShapeError),
        ([0.0], ArrayTypeError),
    ):
        with pytest.raises(error, match="out"):
            RGB.f(wi, wo, out=wrong)


def test_four_angles(library):
    angles = (0.4, 0.3, 0.9, 2.5)
    assert GREY.f_angles(*angles) == GREY.f(gn.direction(0.4, 0.3), gn.direction(0.9, 2.5))
    theta = np.linspace(0.0, 1.5, 5)
    expected = GREY.f_angles(theta, 0.3, 0.9, 2.5)
    assert expected.shape == (5,)
    f = GREY.f_angles(library.array(theta), *(library.array(np.full(5, x)) for x in angles[1:]))
    np.testing.assert_allclose(library.numpy(f), expected, rtol=1e-9)
    mixed = GREY.f_angles(library.array(theta), 0.3, library.array(np.full(5, 0.9)), 2.5)
    np.testing.assert_allclose(library.numpy(mixed), expected, rtol=1e-9)


def test_angles_and_directions(library):
    theta = np.array([0.0, 0.3, 1.2, math.pi / 2, 2.5, 0.7])
    phi = np.array([0.0, -3.0, 1.0, 0.0, 2.0, math.pi])
    w = gn.direction(library.array(theta), library.array(phi))
    np.testing.assert_allclose(library.numpy(w)[..., 2], np.cos(theta), rtol=1e-12, atol=1e-16)
    t, p = gn.angles(w)
    np.testing.assert_allclose(library.numpy(t), theta, atol=1e-12)
    np.testing.assert_allclose(library.numpy(p), phi, atol=1e-12)


def test_angles_at_the_poles_and_the_seam():
    """theta in [0, pi], phi in (-pi, pi], phi = 0 at the poles, whatever the signs of the zeros."""
    for x in (0.0, -0.0):
        for y in (0.0, -0.0):
            assert gn.angles([x, y, 1.0]) == (0.0, 0.0)
            assert gn.angles([x, y, -2.0]) == (math.pi, 0.0)
    assert gn.angles([-1.0, -0.0, 0.0]) == (math.pi / 2, math.pi)
    assert gn.angles(gn.direction(0.0, math.pi)) == (0.0, 0.0)
    np.testing.assert_array_equal(gn.direction([0, 0], [0, 1]), [[0.0, 0.0, 1.0]] * 2)
    np.testing.assert_allclose(gn.direction(0.5, [0.0, 1.0]), [gn.direction(0.5, 0.0), gn.direction(0.5, 1.0)])
    assert gn.direction(1, 0).dtype == float


# Bad directions.


def test_wrong_shapes():
    good = grid(4)
    for bad in (
        grid(5),
        grid(3, 2),
        np.zeros((4, 2)),
        np.zeros((4, 4)),
        np.zeros((3, 4)),
        np.zeros(0),
        np.float64(1.0),
    ):
        for call in (lambda b: GREY.f(good, b), lambda b: GREY.pdf(b, good)):
            with pytest.raises(ShapeError, match="shape"):
                call(bad)
    with pytest.raises(ShapeError, match=r"random numbers: got shape \(4, 4\), expected \(..., 2\)"):
        GREY.sample(good, np.full((4, 4), 0.5))
    with pytest.raises(ShapeError, match="channels"):
        (gn.Lambertian([0.1, 0.2]) + gn.Lambertian([0.1, 0.2, 0.3])).f(good, good)
    with pytest.raises(ShapeError, match="broadcast"):
        gn.Lambertian(np.full((5, 1), 0.5)).f(good, good)
    for bad in ([0.0, 1.0], np.zeros((2, 2))):
        with pytest.raises(ShapeError):
            gn.albedo(GREY, bad)


def test_wrong_types(library):
    good = grid(4)
    own = library.array(good)
    if not library.name.startswith("numpy"):
        for call in (lambda: GREY.f(good, own), lambda: GREY.f(own, good), lambda: GREY.sample(own, good[:, :2])):
            with pytest.raises(ArrayTypeError, match="different libraries"):
                call()
        with pytest.raises(ArrayTypeError, match="parameter"):
            gn.Lambertian(library.array(np.array([0.5, 0.5]))).f(good, good)
        if library.name not in ("torch", "jax"):
            with pytest.raises(ArrayTypeError):
                gn.albedo(GREY, own)
        with pytest.raises(ArrayTypeError, match="out="):
            GREY.f(own, own, out=np.empty(4))
    with pytest.raises(ArrayTypeError, match="float32 and float64"):
        GREY.f(library.array(good, "float32"), own)
    assert library.dtype(GREY.f(library.array(good, "float32"), library.array(good, "float32"))) == "float32"


def test_things_that_are_no_directions():
    for bad in (
        1.0,
        None,
        "up",
        ["a", "b", "c"],
        [[0.0, 1.0], [1.0]],
        {"z": 1.0},
        np.zeros(3, complex),
        np.zeros(3, bool),
    ):
        with pytest.raises(ArrayTypeError):
            GREY.f(bad, WO)
    with pytest.raises(ArrayTypeError):
        GREY.f(np.zeros(3, "float16"), np.zeros(3, "float16"))


# Parameters.


def test_parameters_by_path():
    m = 0.4 * gn.Microfacet(gn.GGX(0.1), gn.Schlick(0.3)) + gn.Lambertian([0.1, 0.2, 0.3])
    assert list(m.parameters) == ["0.weight", "0.of.distribution.alpha_x", "0.of.fresnel.F0", "1.rho"]
    p = m.parameters["0.of.distribution.alpha_x"]
    assert (p.value, p.low, p.high, p.unit) == (0.1, 1e-3, 1.0, "1")
    assert "slope" in p.doc
    n = m.replace({"0.of.distribution.alpha_x": 0.2, "1.rho": 0.5, "0.weight": [1.0, 2.0, 3.0]})
    assert n == [1.0, 2.0, 3.0] * gn.Microfacet(gn.GGX(0.2), gn.Schlick(0.3)) + gn.Lambertian(0.5)
    assert m.parameters["0.of.distribution.alpha_x"].value == 0.1
    assert m.replace({"0.of.fresnel": 0.9}).parameters["0.of.fresnel.reflectance"].value == 0.9
    assert m.replace({"1": gn.Phong()}).terms[1] == gn.Phong()
    assert m.replace() == m


@each_draw(draws())
def test_every_parameter_can_be_replaced(draw):
    for m in (draw.material(), draw.material(3)):
        values = {path: p.value for path, p in m.parameters.items()}
        fields = {path: field for path, field, _, _ in tree.walk(m)}
        assert m.replace(values) == m
        for path, p in m.parameters.items():
            assert np.all(np.asarray(p.value) >= p.low)
            assert np.all(np.asarray(p.value) <= p.high)
            assert p.doc
            high = most(fields[path], m.channels)
            other = m.replace({path: high})
            assert other.parameters[path].value == high
            assert list(other.parameters) == list(m.parameters)


def test_tied_parameters():
    assert gn.GGX(0.3).alpha_y == 0.3
    assert list(gn.GGX(0.3).parameters) == ["alpha_x"]
    assert list(gn.GGX(0.3, 0.3).parameters) == ["alpha_x", "alpha_y"]
    assert gn.GGX(0.3).replace(alpha_x=0.5).alpha_y == 0.5
    assert gn.GGX(0.3, 0.4).replace(alpha_x=0.5).alpha_y == 0.4
    assert gn.GGX(0.3, 0.4).replace(alpha=0.5) == gn.GGX(0.5)
    assert gn.GGX(0.3).replace(alpha_y=0.5) == gn.GGX(0.3, 0.5)
    assert gn.GGX(alpha=0.3) == gn.GGX(0.3) == gn.GGX(alpha_x=0.3)
    assert gn.GGX(0.3) != gn.GGX(0.3, 0.3)
    for wrong in ({"alpha": 0.1, "alpha_x": 0.2}, {"alpha_x": "alpha_y"}):
        with pytest.raises(ParameterError):
            gn.GGX(**wrong)
        with pytest.raises(ParameterError):
            gn.GGX(0.5).replace(**wrong)
    with pytest.raises(ParameterError):
        gn.Lambertian("rho")


def test_the_sum_of_a_list():
    a, b, c = gn.Lambertian(0.1), gn.Phong(), gn.Lambertian(0.3)
    assert sum([a, b, c]) == a + b + c
    assert sum([a]) is a
    for wrong in (1, 0.5, "0", None):
        with pytest.raises(TypeError):
            wrong + a


def test_names_reach_into_parts():
    """What a constructor calls alpha or eta, `replace` calls so, wherever it is the only one."""
    m = gn.Lambertian(0.1) + 0.5 * gn.Microfacet(gn.GGX(0.1, 0.2), gn.Dielectric(1.5))
    wanted = gn.Lambertian(0.1) + 0.5 * gn.Microfacet(gn.GGX(0.3), gn.Dielectric(1.4), "v_groove")
    assert m.replace(alpha=0.3, eta=1.4, masking="v_groove") == wanted
    assert m.replace({"1.of.distribution.alpha": 0.3, "fresnel.eta": 1.4, "1.masking": "v_groove"}) == wanted
    assert m.replace(distribution=gn.GGX(0.3), fresnel=gn.Dielectric(1.4), masking="v_groove") == wanted
    assert gn.material("gold").replace(alpha=0.3) == gn.material("gold", alpha=0.3)
    for both in ({"alpha_y": 0.2, "alpha": 0.3}, {"alpha": 0.3, "alpha_y": 0.2}):
        assert gn.GGX(0.1).replace(both) == gn.GGX(0.3, 0.2)
    coated = gn.Coated(gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.3)), eta=1.6)
    assert coated.replace(eta=1.7).eta == 1.7  # its own comes before those of its parts


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["alpha"], "Sum: alpha stands for several parameters; name one of 0.distribution.alpha, 1.distribution.alpha"),
        (["0.alpah"], "did you mean 'alpha'"),
        (["eat"], "did you mean 'eta'"),
        (["1.alpha", "1.alpha_x"], "given twice"),
        (["0.alpha", "0.distribution"], "given twice"),
        (["0.distribution", "0.alpha"], "given twice"),
        (["0.alpha", "0.distribution.alpha"], "given twice"),
        ([1], "expected a dictionary"),
    ],
)
def test_names_that_are_none(names, words):
    m = gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5)) + gn.Microfacet(gn.GGX(0.2), 0.5)
    values = {name: gn.GGX(0.3) if str(name).endswith("distribution") else 0.3 for name in names}
    with pytest.raises(gn.Error, match=words):
        m.replace(values)
    with pytest.raises(gn.errors.NotFoundError, match=r"write distribution=GGX\(alpha=...\)"):
        gn.Microfacet(alpha=0.3)


# Values.

VALUES = [
    0.4 * gn.Lambertian(0.5),
    0.4 * (0.5 * gn.Lambertian(0.5)),
    2.0 * (gn.Lambertian(0.2) + 0.5 * gn.Phong()),
    [1.0, 2.0, 3.0] * (gn.Lambertian([0.1]) + gn.IdealSpecular(gn.Conductor(0.2, 3.9))),
    Sum(gn.Lambertian(0.5)),
    Sum(gn.Lambertian(0.1) + gn.Lambertian(0.2), gn.Lambertian(0.3)),
    gn.Microfacet(gn.GGX(np.full((2, 3, 1), 0.3))),
    gn.ConstantLight([1.0, 2.0, 3.0]),
    gn.DistantLight((1.0, 2.0, 3.0), 4.0),
    gn.PointLight((1.0, 2.0, 3.0), [4.0, 5.0, 6.0]),
]


@each_draw(draws(2, every=4))
def test_random_materials_come_back(draw):
    for channels in draw.layouts:
        comes_back(draw.material(channels))


@pytest.mark.full
@each_draw(draws())
def test_all_random_materials_come_back(draw):
    for channels in draw.layouts:
        comes_back(draw.material(channels))


@every(m=VALUES)
def test_round_trips(m):
    comes_back(m)


def comes_back(m: Any) -> None:
    """`repr` is the expression that makes it; pickles, copies and JSON give equal values, which hash alike."""
    again = [
        eval(repr(m), dict(CLASSES)),
        pickle.loads(pickle.dumps(m)),
        copy.copy(m),
        copy.deepcopy(m),
        from_json(json.loads(json.dumps(m.to_json()))),
    ]
    for other in again:
        assert type(other) is type(m)
        assert other == m
        assert (other != m) is False
        assert hash(other) == hash(m)
        assert repr(other) == repr(m)
        assert list(other.parameters) == list(m.parameters)
        for array in (p.value for p in other.parameters.values() if isinstance(p.value, np.ndarray)):
            assert not array.flags.writeable


def test_different_values_differ():
    distinct = [gn.Lambertian(0.5), gn.Lambertian([0.5]), gn.Lambertian([0.5, 0.5]), gn.Lambertian(0.6), gn.Phong()]
    distinct += [gn.Microfacet(masking=k) for k in ("height_correlated", "separable", "v_groove")]
    distinct += [1.0 * gn.Phong(), Sum(gn.Phong()), gn.Phong() + gn.Phong(), gn.Lambertian(0.5) + gn.Phong()]
    distinct += [gn.Phong() + gn.Lambertian(0.5), "Lambertian", None]
    for i, a in enumerate(distinct):
        for j, b in enumerate(distinct):
            assert (a == b) == (i == j)
    assert len({m for m in distinct if isinstance(m, gn.Reflectance)}) == len(distinct) - 2


def test_values_of_other_libraries_compare(library):
    own = gn.Lambertian(library.array(np.array([0.1, 0.2, 0.3])))
    assert own == gn.Lambertian(library.array(np.array([0.1, 0.2, 0.3])))
    assert own != gn.Lambertian(library.array(np.array([0.1, 0.2, 0.4])))
    assert own != gn.Lambertian(0.1)
    assert own.to_json() == gn.Lambertian([0.1, 0.2, 0.3]).to_json()
    assert hash(own) == hash(gn.Lambertian(library.array(np.array([0.1, 0.2, 0.3]))))


def test_values_cannot_be_changed():
    m = gn.Lambertian(0.5)
    with pytest.raises(AttributeError, match=r"replace\(rho"):
        m.rho = 0.6
    with pytest.raises(AttributeError):
        del m.rho
    with pytest.raises(AttributeError):
        m.anything = 1
    assert m.rho == 0.5


def test_material_files(tmp_path):
    path = tmp_path / "m.json"
    gn.save(RGB, path)
    assert gn.load(path) == RGB
    before = path.read_bytes()
    with pytest.raises(Error):
        gn.save(RGB, tmp_path / "none" / "m.json")
    for text in (
        '{"type": "Lambertain"}',
        '{"type": "Lambertian", "rho": 2}',
        '{"type": "GGX"}',
        '{"type": "Lambertian"',
    ):
        path.write_text(text)
        with pytest.raises(FormatError, match=r"m\.json"):
            gn.load(path)
    path.write_bytes(before)
    assert gn.load(path) == RGB
    assert [p.name for p in tmp_path.iterdir()] == ["m.json"]


# Sums and weights.


def test_weights():
    m = gn.Phong(0.5, 3.0)
    f = m.f(WI, WO)
    for weighted in (0.4 * m, m * 0.4, np.float64(0.4) * m, m * np.float64(0.4), np.float32(0.5) * (0.8 * m), m / 2.5):
        assert isinstance(weighted, Scaled)
        assert weighted.f(WI, WO) == pytest.approx(0.4 * f)
    for weight in ([1.0, 2.0, 3.0], (1.0, 2.0, 3.0), np.array([1.0, 2.0, 3.0])):
        for weighted in (weight * m, m * weight):
            assert isinstance(weighted, Scaled)
            np.testing.assert_allclose(weighted.f(WI, WO), f * np.array([1.0, 2.0, 3.0]))
    for wrong in (-1.0, math.nan, "x"):
        with pytest.raises(ParameterError):
            m * wrong
    with pytest.raises(ArrayTypeError, match="times a reflectance"):
        m * m


def test_sums():
    a, b, c = gn.Lambertian(0.5), gn.Phong(), gn.Lambertian([0.1, 0.2, 0.3])
    assert (a + b) + c == a + (b + c) == Sum(a, b, c)
    assert (a + b + c).terms == (a, b, c)
    np.testing.assert_allclose((a + b + c).f(WI, WO), (a.f(WI, WO) + b.f(WI, WO)) + c.f(WI, WO))
    with pytest.raises(TypeError):
        a + 1.0
    for wrong in ((), (a, 1.0), ([a, b],)):
        with pytest.raises(ParameterError):
            Sum(*wrong)
    assert not (a + b).has_delta
    assert (a + 0.1 * (b + gn.IdealSpecular())).has_delta


# Bad parameters.


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: gn.GGX(0.0), "alpha_x"),
        (lambda: gn.GGX(-0.1), "alpha_x"),
        (lambda: gn.GGX(0.2, 0.0), "alpha_y"),
        (lambda: gn.Beckmann([0.1, 0.0]), "alpha_x"),
        (lambda: gn.TorranceSparrow(1.5), "alpha"),
        (lambda: gn.Lambertian(1.5), "rho"),
        (lambda: gn.Lambertian([0.5, 1.01, 0.5]), "1.01"),
        (lambda: gn.Lambertian(math.nan), "NaN"),
        (lambda: gn.Lambertian([0.1, math.nan]), "NaN"),
        (lambda: gn.Phong(n=math.inf), "infinite"),
        (lambda: gn.Lambertian([]), "no numbers"),
        (lambda: gn.Lambertian("red"), "not a number|a str"),
        (lambda: gn.Lambertian([[0.1], [0.2, 0.3]]), "not a number"),
        (lambda: gn.Lambertian(None), "NoneType"),
        (lambda: gn.Lambertian(1j), "complex"),
        (lambda: gn.Lambertian(0.1, 0.2), "got 2 values, expected at most 1"),
        (lambda: gn.Lambertian(0.5).replace(rho=1.5), "rho"),
        (lambda: gn.Microfacet(0.3), "expected a Distribution .*GGX"),
        (lambda: gn.Microfacet(gn.Dielectric(1.5)), "expected a Distribution"),
        (lambda: gn.Microfacet(fresnel=gn.GGX(0.3)), "expected a Fresnel"),
        (lambda: gn.Microfacet(fresnel="gold"), "expected a Fresnel"),
        (lambda: gn.Microfacet(fresnel=1.2), "reflectance"),
        (lambda: gn.IdealSpecular(1.2), "reflectance"),
        (lambda: gn.Microfacet(masking="smith"), "height_correlated"),
        (lambda: gn.Microfacet(masking=["separable"]), "height_correlated"),
        (lambda: gn.Microfacet(masking=np.array(["a", "b"])), "height_correlated"),
        (lambda: gn.Microfacet.replace(GREY, {"distribution.alpha_x": -1.0}), "alpha_x"),
        (lambda: Scaled(0.5), "expected a Reflectance"),
        (lambda: gn.ConstantLight(-1.0), "radiance"),
        (lambda: gn.ConstantLight([1.0, math.nan]), "NaN"),
        (lambda: gn.DistantLight((0.0, 0.0, 0.0)), "length 0"),
        (lambda: gn.DistantLight((0.0, math.nan, 1.0)), "finite"),
        (lambda: gn.DistantLight((0.0, 1.0)), "three"),
        (lambda: gn.PointLight("here"), "three numbers"),
        (lambda: gn.FunctionLight(1.0), "function"),
    ],
)  # fmt: skip
def test_bad_parameters(call, words):
    with pytest.raises(ParameterError, match=words) as caught:
        call()
    assert len(str(caught.value)) < 400
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: gn.Lambertian(albedo=0.5), "no parameter 'albedo'.*rho"),
        (lambda: gn.GGX(alpha_z=0.5), "did you mean 'alpha_"),
        (lambda: gn.Lambertian(0.5).replace(roh=0.5), "did you mean 'rho'"),
        (lambda: RGB.replace({"2.rho": 0.5}), "'2'|2.rho"),
        (lambda: RGB.replace({"0.rho.x": 0.5}), "rho.x"),
        (lambda: RGB.replace({"1.distribution.alpha_z": 0.5}), "alpha_"),
    ],
)
def test_unknown_names(call, words):
    with pytest.raises(NotFoundError, match=words):
        call()


def test_other_libraries_as_parameters(library):
    """A parameter may be an array of the directions' library, of any dtype: it takes that of the directions."""
    if library.name == "drjit-array":
        pytest.skip("Array3f as a parameter is a batch; the tensor is tested")
    w = grid(4)
    for own, other in (("float32", "float64"), ("float64", "float32")):
        for value in (np.array([0.25]), np.array([0.25, 0.5, 0.75])):
            m = gn.Lambertian(library.array(value, other))
            f = m.f(library.array(w, own), library.array(w, own))
            assert library.dtype(f) == own
            np.testing.assert_allclose(library.numpy(f), np.broadcast_to(value / math.pi, (4, len(value))), rtol=1e-6)


def test_jit(jax):
    """Formulas can be traced: f, sample and gradients inside jax.jit, NaN and the horizon included."""
    wi, wo = grid(6), grid(6, seed=1)
    wi[0, 0], wo[1] = np.nan, -wo[1]

    def traced(values: dict, a: Any, b: Any) -> Any:
        return RGB.replace(values).f(a, b)

    values = {path: jax.numpy.asarray(p.value) for path, p in RGB.parameters.items()}
    f = np.asarray(jax.jit(traced)(values, wi, wo))
    np.testing.assert_allclose(f, RGB.f(wi, wo), rtol=1e-12)
    assert np.isnan(f[0]).all()
    assert (f[1] == 0.0).all()
    s = jax.jit(lambda b, u: RGB.sample(b, u))(jax.numpy.asarray(wo), jax.numpy.asarray(wi[:, :2] ** 2))
    for x, y in zip(s, RGB.sample(wo, wi[:, :2] ** 2), strict=True):
        np.testing.assert_allclose(np.asarray(x), y, rtol=1e-9)
