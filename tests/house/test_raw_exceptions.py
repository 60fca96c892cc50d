"""Calls of the wrong kind, as they are typed, with the words they get in place of Python's and NumPy's exceptions."""

from __future__ import annotations

import copy
import pickle
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray

import gonio as gn
from gonio.errors import AccessError, UnwrittenError
from gonio.formula import tree

up = np.array([0.0, 0.0, 1.0])
angles = [0.0, 0.3, 0.6]
grid = gn.Gridded("angles", {"theta_i": angles, "theta_o": angles, "phi": [0.0, 1.5, 3.0]}, np.full((3, 3, 3), 0.2))
m = gn.Microfacet(gn.GGX(0.1))
SCOPE = {
    "gn": gn,
    "np": np,
    "up": up,
    "angles": angles,
    "grid": grid,
    "m": m,
    "Path": Path,
    "ds": xarray.Dataset(),
    "huge": np.broadcast_to(0.5, (10**6, 10**6, 3)),
    "matte": gn.Lambertian(0.5),
    "rgb": gn.Lambertian([0.2, 0.3, 0.4]),
    "spectrum": gn.Lambertian(np.full(31, 0.5)),
    "dye": gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0]),
    "sun": gn.DistantLight(),
    "hostile": type("Hostile", (), {"__array__": lambda self, *_: 1 / 0, "__repr__": lambda self: 1 / 0})(),
}

TABLE = [
    # something else in the place of a reflectance
    ("gn.check(gn.GGX(0.2))", "a distribution of facet normals; write gn.Microfacet(gn.GGX(alpha_x=0.2))"),
    ("gn.albedo(gn.GGX(0.2), up)", "expected a reflectance; this is a distribution"),
    (
        "gn.remote_sensing.white_sky_albedo(gn.Dielectric(1.5))",
        "write gn.Microfacet(gn.GGX(0.1), gn.Dielectric(eta=1.5))",
    ),
    ("gn.check(gn.Lambertian)", "this is a class, of which an instance is needed; write gn.Lambertian()"),
    ("gn.albedo(gn.GGX, up)", "write gn.Microfacet(gn.GGX())"),
    ("gn.albedo('gold', up)", "gn.material('gold') for a built-in material, or gn.load(path) for a file"),
    ("gn.render('brass.binary', sun)", "write gn.load('brass.binary')"),
    ("gn.render(Path('brass.binary'), sun)", "write gn.load('brass.binary')"),
    ("gn.tables.tabulate('Lambertian(0.5)')", "write gn.expression('Lambertian(0.5)')"),
    ("gn.albedo(None, up)", "albedo(m=None): expected a reflectance; write one, such as gn.Lambertian(0.5)"),
    ("gn.albedo(0.5, up)", "a number or an array of albedos: write gn.Lambertian(rho)"),
    ("gn.save(np.ones((9, 9)), 'x.csv')", "measured values: gn.Gridded or gn.Scattered"),
    ("gn.convert([matte, rgb], 'x.csv')", "one at a time, or their sum: write m1 + m2"),
    ("gn.albedo(ds, up)", "write gn.tables.from_dataset(ds)"),
    ("gn.tables.to_dataset(lambda wi, wo: 0.3)", "`formula` of a subclass of gn.Reflectance"),
    ("gn.render(sun, matte)", "this is a light; write gn.render(m, gn.DistantLight("),
    ("gn.engine.kernel(sun)", "with the reflectance first"),
    ("gn.reflectance(gn.Cone, up)", "this is the class Cone"),
    (
        "gn.repair.fill_holes(matte)",
        "expected a measurement; gn.tables.tabulate(m), or gn.repair.resample(m), makes a table",
    ),
    ("gn.repair.merge_scans(3)", "expected a list of which each is a measurement"),
    ("gn.with_uncertainty(matte, correlation='common')", "(function=Lambertian(rho=0.5)): expected a function"),
    ("gn.expression('GGX(0.2)')", "write Microfacet(GGX(alpha_x=0.2))"),
    ("gn.cite(3)", "expected a material, or the name of one"),
    # names that something does not have
    ("m.eval", "Microfacet has no attribute 'eval'; write m.f(wi, wo)"),
    ("m.evaluate(up, up)", "write m.f(wi, wo)"),
    ("m.brdf", "write m.f(wi, wo)"),
    ("m(up, up)", "Microfacet is no function; write m.f(wi, wo)"),
    ("m.albedo(up)", "write gn.albedo(m, wi)"),
    ("m.check()", "write gn.check(m)"),
    ("m.save('x.json')", "write gn.save(m, path)"),
    ("m.render()", "write gn.render(m)"),
    ("m.plot()", "on the command line: gonio show"),
    ("m.alpha", "write m.parameters['distribution.alpha_x'].value"),
    ("m.distributon", "did you mean 'distribution'?"),
    ("gn.GGX(0.2).f(up, up)", "write gn.Microfacet(distribution), which has f, pdf and sample"),
    ("gn.GGX(0.2)(up)", "GGX is no function; write gn.Microfacet(distribution)"),
    ("sun.radience", "DistantLight has no attribute 'radience'; did you mean 'irradiance'?"),
    ("sun(up)", "write gn.reflected_radiance(m, light, wo)"),
    ("setattr(m, 'fresnel', 1.0)", "cannot be changed; use m.replace(fresnel=...) for a new one"),
    ("m.replace([0.3])", "expected a dictionary such as"),
    ("m.jacobian(up, up, by=3)", "jacobian(by=3): expected one of distribution.alpha_x"),
    # directions and angles
    ("matte.sample(up, np.random.default_rng(1))", "got Generator, expected an array of float32 or float64; draw"),
    ("matte.f(up, None)", "directions: got NoneType"),
    ("matte.f(up, [[0, 0, 1], [0, 1]])", "rows of unequal length"),
    ("matte.f(up, [0, 0, 1j])", "complex128, which are no real numbers; take the real part or the modulus"),
    ("matte.f(up, hostile)", "directions: got Hostile"),
    ("matte.f_angles('a', 0, 0, 0)", "theta='a': a str is no number"),
    ("gn.angles(None)", "directions: got NoneType"),
    ("gn.angles([1, 2])", "got directions of shape (2,), expected (..., 3)"),
    ("gn.direction('a', 0)", "theta='a': a str is no number; expected an angle [rad]"),
    ("gn.direction(None, 0)", "a NoneType is no number"),
    ("gn.direction([0, 1], [0, 1, 2])", "theta, phi: shapes (2,), (3,) do not broadcast"),
    ("gn.direction(0, float('inf'))", "phi=inf: infinite"),
    ("gn.directions.normalize(None)", "w: got None, expected vectors (..., 3)"),
    ("gn.directions.reflect(up, None)", "wm: got None, expected vectors"),
    ("gn.Cone('a', 0.1)", "Cone(axis='a'): expected a direction of three finite numbers"),
    ("gn.Cone(up, None)", "Cone(half_angle=None): expected an angle"),
    ("gn.remote_sensing.black_sky_albedo(matte, 'noon')", "theta_s='noon'"),
    (
        "gn.remote_sensing.blue_sky_albedo(matte, 0.5, 'all')",
        "diffuse_fraction='all': expected the sky's share of light",
    ),
    # numbers and words
    ("gn.albedo(matte, up, 'fine')", "albedo(tolerance='fine'): expected a number"),
    ("gn.albedo(matte, up, 0.0)", "albedo(tolerance=0.0): expected a number from 1e-13 below 1"),
    ("gn.albedo(matte, up, return_error='yes')", "albedo(return_error='yes'): expected True or False"),
    ("gn.render(matte, sun, size=1e3)", "render(size=1000.0): expected a whole number"),
    ("gn.render(matte, sun, shape=3)", "render(shape=3): expected a word"),
    ("gn.render(matte, sun, size=4, progress=1)", "render(progress=1): expected a function"),
    ("gn.check(matte, laws=3)", "check(laws=3): expected words: only these"),
    ("gn.check(matte, laws='energie')", "no law 'energie'"),
    ("gn.engine.threads('x')", "expected a whole number"),
    ("gn.material(None)", "material(name=None): expected a word"),
    ("gn.spectra.refractive_index('gold', 'green')", "expected numbers [nm]"),
    ("gn.radiometry.roughness.alpha_from_perceptual('rough')", "roughness='rough'"),
    ("gn.radiometry.roughness.alphas_from_disney([0.1, 0.2], [0.1, 0.2, 0.3])", "shapes must broadcast"),
    ("gn.radiometry.solid_angle_cone(None)", "half_angle=None: a NoneType, which is no real number"),
    ("gn.radiometry.convert_spectral(1.0, 500.0, [1], 'wavelength')", "convert_spectral(source=[1]): expected one of"),
    ("gn.Lambertian(np.random.default_rng(1))", "a Generator; expected a number or an array"),
    ("gn.Lambertian(hostile)", "a Hostile; expected a number or an array"),
    ("matte / np.array(['a'])", "a reflectance divided by"),
    # tables, pictures and files
    ("gn.Gridded(3, {}, [])", "Gridded(parameterization=3): expected a word"),
    ("gn.Gridded('angles', 3, [])", "Gridded(axes=3): expected a dictionary"),
    ("gn.Scattered(angles, 0.0, [0.1, 0.2], 0.0, [1.0, 1.0, 1.0])", "expected 3 finite numbers"),
    ("gn.Scattered(0.1, 0.0, 0.1, 0.0, [1.0], channels=len)", "Scattered(channels=<built-in function len>): expected"),
    ("gn.tables.from_dataset(3)", "expected an xarray.Dataset, such as gn.tables.to_dataset(m) makes"),
    ("gn.tables.from_dataset(ds)", "has no attribute gonio_schema"),
    ("gn.scenes.Image(3)", "pixels are"),
    ("gn.scenes.Image(None)", "pixels"),
    ("gn.scenes.Image(np.ones((2, 2, 3)), channels=3)", "expected 3 different short names"),
    ("gn.scenes.load_image(None)", "load_image(path=None): expected a word or a path"),
    ("gn.load(3)", "load(path=3): expected a word or a path"),
    ("gn.load('gold')", "gold: no such file; for a built-in material gn.material('gold')"),
    ("gn.load('https://rgl.epfl.ch/brdf/x.bsdf')", "urlretrieve('https://rgl.epfl.ch/brdf/x.bsdf', 'x.bsdf')"),
    ("gn.load('Lambertian(0.5)')", "gn.expression('Lambertian(0.5)')"),
    ("gn.save(matte, 'x.png')", ".png is a picture, no reflectance; write gn.render(m, lights).save(path)"),
    ("gn.save(matte, 'x.json', time=1)", "time=1: no option to write gonio JSON files; expected none"),
    ("gn.expression('Coated(gold-metallic-paint)')", 'write material("gold-metallic-paint")'),
    # lights
    ("gn.render(matte, 3)", "render(lights=3): expected a light or a list of which each is a light"),
    ("gn.reflected_radiance(spectrum, gn.DistantLight(up, [1, 2, 3]), up)", "3 channels and the material has 31"),
    ("gn.reflected_radiance(spectrum, gn.ConstantLight([1, 2, 3]), up)", "ConstantLight has 3 channels"),
    ("gn.reflectance(spectrum, sky=gn.ConstantLight([1, 2, 3]))", "3 channels and the material has 31"),
    ("gn.reflectance_factor(dye, gn.Hemisphere(), up, gn.DistantLight(up, [1, 2, 3]))", "the material has 2"),
    ("gn.reflected_radiance(dye, gn.DistantLight(up, [1, 2, 3]), up)", "3 channels and the material has 2"),
    ("gn.render(spectrum, gn.DistantLight(up, [1, 2, 3]), size=4)", "a light of one channel such as gn.ConstantLight"),
    ("gn.render(gn.Lambertian(np.full((4, 1), 0.5)), sun)", "rho is a map of shape (4,), with channels last"),
    ("gn.directions.from_half_difference(10.0, 0.0, 20.0, 0.0)", "in degrees? numpy.radians(10)"),
    (
        "gn.fitting.select_model(matte, {'matt': matte, 'gray': 0.5 * matte}, theta_max=80.0)",
        "in degrees? numpy.radians(80)",
    ),
    ("gn.fitting.fit_many([matte], [matte], theta_max=80.0)", "theta_max=80.0"),
    ("gn.DistantLight('up')", "expected three numbers (direction to the light)"),
    ("gn.DistantLight(up * 0)", "a vector of length 0 is no direction"),
    # found by calling everything with anything
    ("gn.polarization.polarizer(np.inf)", "psi=inf: infinite; expected an angle"),
    ("gn.polarization.retarder(np.ones((2, 2)), np.ones(3))", "delay and psi: shapes (2, 2), (3,)"),
    ("gn.polarization.frames([np.inf, 0.0, 0.0])", "expected unit vectors"),
    ("gn.irradiance(sun, [0, 0, 0], [0, 0, 0])", "a normal of length 0 has no direction"),
    ("gn.PreethamSky(channel=10**12)", "no memory for it"),
    ("gn.PreethamSky(channel=10**39)", "no memory for it"),
    ("gn.Lambertian(wavelengths=huge)", "no memory for a copy of 3000000000000 numbers"),
    ("gn.Spectrum([400, 500], huge)", "no memory for a copy of 3000000000000 numbers"),
    ("matte.sample(up, ds)", "got Dataset; take x.values"),
    ("gn.scenes.Mesh('a' * 5000, matte)", "no such file"),
]


@pytest.mark.parametrize(("call", "words"), TABLE, ids=[call for call, _ in TABLE])
def test_misuse_gets_our_words(call, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(gn.Error, match=re.escape(words)):
        eval(call, dict(SCOPE))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.csv", b"", "the file is empty; copy or download it again; known formats"),
        ("photo.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "this is a picture (PNG); gn.scenes.load_image reads it"),
        ("page.bsdf", b"\n<!DOCTYPE HTML><title>404</title>", "this is a web page; the download of the file"),
        ("data.zip", b"PK\x03\x04" + bytes(40), "this is a zip file; unpack it first"),
        ("data.npy", b"\x93NUMPY\x01\0" + bytes(40), "this is an array of NumPy"),
        (
            "big.binary",
            b"version https://git-lfs.github.com/spec/v1\n",
            "a pointer of Git LFS in the place of the file",
        ),
    ],
)
def test_unknown_files_say_what_they_are_first(name, content, words, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(gn.errors.FormatError, match=re.escape(words)) as raised:
        gn.load(tmp_path / name)
    assert str(raised.value).index(words[:20]) < str(raised.value).index("known formats")


def test_attributes_are_python_s_own_in_all_else():
    assert not hasattr(m, "eval") and not hasattr(m, "dtype") and not hasattr(m, "__array__")
    assert isinstance(AccessError("x"), AttributeError)
    assert getattr(m, "albedo", None) is None
    assert copy.deepcopy(m) == pickle.loads(pickle.dumps(m)) == copy.copy(m) == m
    with pytest.raises(AttributeError) as raised:
        m._nothing  # noqa: B018  (protocols ask for such names: no words are made)
    assert not isinstance(raised.value, gn.Error)
    with pytest.raises(AttributeError, match="formulas do not see"):
        tree.bind(m, lambda x: x, lambda x: x)._numbers_from  # noqa: B018  (an error of an attribute that there is)
    assert callable(m)  # to say what to write


class _Unfinished(gn.Reflectance):
    pass


class _Forgetful(gn.Reflectance):
    def __init__(self) -> None:
        pass

    def formula(self, wi: Any, wo: Any) -> Any:
        return 1.0 / np.pi


class _Mirror(gn.Reflectance):
    is_delta = True

    def formula(self, wi: Any, wo: Any) -> Any:
        return 0.0 * wi.z


class _Sampled(gn.authoring.Light):
    can_sample = True

    def seen(self, p: Any, w: Any) -> Any:
        return 1.0 + 0.0 * w.x, 1e30


def test_models_without_a_method_say_what_to_write():
    with pytest.raises(gn.Error, match=r"without formula; write def formula\(self, wi, wo\) in the class: f \[1/sr\]"):
        _Unfinished()
    with pytest.raises(AccessError, match=r"_Forgetful is not made yet: its __init__ ends with super\(\).__init__"):
        _Forgetful().f(up, up)
    with pytest.raises(UnwrittenError, match=r"_Mirror has no mirror, which this needs; write def mirror\(self, wo\)"):
        _Mirror().sample(up, np.array([0.1, 0.2]))
    with pytest.raises(NotImplementedError, match=r"write def warp\(self, p, u0, u1\)"):
        gn.reflected_radiance(gn.Lambertian(), _Sampled(), up)


def test_arguments_are_converted_and_python_binds_them():
    assert gn.albedo(gn.Lambertian(0.5), up, np.array(1e-3)) == pytest.approx(0.5, abs=1e-3)
    assert gn.check(gn.Lambertian(), laws="energy").passed  # one word is a list of one
    with pytest.raises(TypeError, match=r"albedo\(\) missing 1 required positional argument: 'wi'"):
        gn.albedo(gn.Lambertian())
    with pytest.raises(TypeError, match="unexpected keyword argument 'tol'"):
        gn.albedo(gn.Lambertian(), up, tol=1e-3)
    assert gn.repair.remove_negatives(grid).f(up, up) == pytest.approx(grid.f(up, up))
    assert SimpleNamespace(f=gn.albedo).f.__doc__.startswith("Directional-hemispherical")
