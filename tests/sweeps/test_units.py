"""Nanometres and micrometres, radians and degrees: where both may be said the numbers are the same, and where one is
expected the other is refused, or a warning asks whether it is meant.

A function is in this sweep by the names of its arguments, a class by its fields, a format by its options. A failure
ends with Python that repeats it.
"""

from __future__ import annotations

import inspect
import re
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from directed import Refused, numbers
from face import classes, functions
from libraries import thinned
from xlsx_files import workbook

import gonio as gn
from gonio.declared import typed as typed_angles
from gonio.declared.arguments import arguments
from gonio.facts.public import function_of
from gonio.formats import formats
from gonio.formats._options import options
from gonio.formula.parametrised import Parametrised
from gonio.surfaces.height_field import UNITS
from gonio.tables import dataset_layout

WAVELENGTHS = re.compile(r"wavelengths?")
POLAR = re.compile(r"(to_)?theta(_\w+)?|half_angle")
"""Names of arguments that are wavelengths [nm] and polar angles [rad]."""

SPECTRUM = "gn.Spectrum([400.0, 700.0], [0.1, 0.8])"
OF_WAVELENGTHS = {
    "Dispersion.at": "gn.Dispersion(5, [1.5], [300.0, 800.0]).at(w)",
    "Dispersion.bands": "gn.Dispersion(5, [1.5], [300.0, 800.0]).bands(w)",
    "KCorrelation.from_harvey_shack": "gn.KCorrelation.from_harvey_shack(gn.HarveyShack(2.0, 0.1, -2.0), w[0])",
    "Reflectance.at": f"gn.Lambertian({SPECTRUM}).at(w).rho",
    "Spectrum": "gn.Spectrum(w, [0.1, 0.2, 0.3]).at(550.0)",
    "Spectrum.at": f"{SPECTRUM}.at(w)",
    "Spectrum.bands": f"{SPECTRUM}.bands(w)",
    "material": "gn.material('gold', wavelengths=w).f([0, 0, 1], [0, 0, 1])",
    "radiometry.convert_spectral": "gn.radiometry.convert_spectral(1.0, w, 'wavelength', 'frequency')",
    "radiometry.photon_flux": "gn.radiometry.photon_flux(1.0, w)",
    "radiometry.radiant_flux": "gn.radiometry.radiant_flux(1.0, w)",
    "spectra.refractive_index": "gn.spectra.refractive_index('gold', w)",
    "colour.to_colour": "gn.colour.to_colour([0.1, 0.2, 0.3], w)",
    "with_channels": "gn.Lambertian([0.1, 0.2, 0.3]).with_channels(w).wavelengths",
}
"""Functions, methods and constructors of wavelengths w [nm], as Python."""
M = "gn.Lambertian(0.5)"
SURFACE = "gn.surfaces.v_grooves(0.6)"
OF_ANGLES = {
    "remote_sensing.blue_sky_albedo": f"gn.remote_sensing.blue_sky_albedo({M}, x, 0.5)",
    "direction": "gn.direction(x, 0.3)",
    "figures.polar": f"gn.figures.polar({M}, x)",
    "figures.slices": f"gn.figures.slices({M}, x)",
    "fit": f"gn.fit({M}, gn.Lambertian(), starts=1, theta_max=x).model.rho",
    "fitting.fit_many": f"gn.fitting.fit_many([{M}], [gn.Lambertian()], starts=1, theta_max=x)",
    "fitting.fit_problem": f"gn.fitting.fit_problem({M}, gn.Lambertian(), theta_max=x).x0",
    "directions.from_half_difference": "gn.directions.from_half_difference(x, 0.0, x, 0.0)",
    "gonioreflectometer": f"gn.gonioreflectometer({SURFACE}, 0.5, x, 0.0, (6, 8), 1.0, rays=1024).stored",
    "radiometry.form_factors.point_to_sphere": "gn.radiometry.form_factors.point_to_sphere(0.1, 1.0, x)",
    "radiometry.form_factors.spherical_cavity": "gn.radiometry.form_factors.spherical_cavity(x)",
    "radiometry.projected_solid_angle_cone": "gn.radiometry.projected_solid_angle_cone(x)",
    "radiometry.projected_solid_angle_latlong_pixel": "gn.radiometry.projected_solid_angle_latlong_pixel(0.1, x, 0.1)",
    "radiometry.solid_angle_cap": "gn.radiometry.solid_angle_cap(0.1, x)",
    "radiometry.solid_angle_cone": "gn.radiometry.solid_angle_cone(x)",
    "radiometry.solid_angle_latlong_pixel": "gn.radiometry.solid_angle_latlong_pixel(0.1, x, 0.1)",
    "reconstruction.reconstruct": f"gn.reconstruction.reconstruct({M}, theta_max=x)",
    "remote_sensing.c_factor": f"gn.remote_sensing.c_factor({M}, 0.3, 0.2, 0.1, to_theta_s=x)",
    "remote_sensing.fit_kernels": "gn.remote_sensing.fit_kernels(x, [0.0, 0.2, 0.4, 0.6], 0.1, [0.1, 0.2, 0.3, 0.2])",
    "remote_sensing.brf": f"gn.remote_sensing.brf({M}, 0.3, x, 0.1)",
    "remote_sensing.nbar": f"gn.remote_sensing.nbar({M}, x)",
    "fitting.select_model": f"gn.fitting.select_model({M}, {{'a': gn.Lambertian(), 'b': gn.Minnaert()}}, theta_max=x)",
}
"""Functions of a polar angle x [rad], as Python."""
KERNELS = "gn.{}(x, 0.2, 0.1)"
"""The same of sun and view, and the azimuth between."""


def _named(names: re.Pattern) -> Iterator[str]:
    """Public functions, and methods of public classes, with an argument of such a name."""
    for name, function in functions().items():
        if any(map(names.fullmatch, inspect.signature(function).parameters)):
            yield name
    for name, kind in classes().items():
        for part, method in vars(kind).items():
            function = getattr(method, "__func__", method)
            if inspect.isfunction(function) and any(map(names.fullmatch, inspect.signature(function).parameters)):
                if not part.startswith("_"):
                    yield f"{name}.{part}"
                elif part == "__init__" and not any(map(names.fullmatch, getattr(kind, "fields", ()))):
                    yield name


def _fields() -> list[tuple[str, str]]:
    """Public classes with a field that is a wavelength, and its name."""
    kinds = [kind for kind in classes().values() if issubclass(kind, Parametrised)]
    return [(k.__name__, name) for k in kinds for name in k.fields if WAVELENGTHS.fullmatch(name)]


def outcome(call: str, **names: Any) -> list[np.ndarray] | Refused | str:
    """What comes of it: numbers, a refusal, or the words of a warning that asks whether that is meant."""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            found = numbers(eval(call, {"gn": gn, "np": np, **names}))
        except gn.Error as error:
            return Refused(type(error))
    asked = [str(w.message) for w in heard if w.category in (gn.errors.MeaningWarning, gn.errors.DirectionWarning)]
    return asked[0] if asked else found


def lines(call: str, **names: Any) -> str:
    return f"\nimport numpy as np, gonio as gn\n{'; '.join(f'{k} = {v!r}' for k, v in names.items())}\nprint({call})"


def test_every_function_of_wavelengths_is_in_the_sweep():
    found = {*_named(WAVELENGTHS)}
    assert found <= OF_WAVELENGTHS.keys(), "write how these are called into OF_WAVELENGTHS"


@pytest.mark.parametrize("call", OF_WAVELENGTHS.values(), ids=OF_WAVELENGTHS)
def test_wavelengths_in_micrometres(call):
    nm = [450.0, 550.0, 620.0]
    usual = outcome(call, w=nm)
    assert isinstance(usual, list), f"{lines(call, w=nm)}\n{usual}"
    um = [x / 1000.0 for x in nm]
    assert not isinstance(outcome(call, w=um), list), f"{lines(call, w=um)}\nmicrometres, and not a word of it"


@pytest.mark.parametrize("kind, field", _fields())
def test_wavelengths_of_materials_in_micrometres(kind, field):
    call = f"gn.{kind}({field}=w).{field}"
    assert isinstance(outcome(call, w=0.55), Refused), lines(call, w=0.55)


ANGLED = [name for name in _named(POLAR) if name in functions()]
SLOW = {"figures.polar", "figures.slices", "fitting.fit_many", "reconstruction.reconstruct", "fitting.select_model"}


def call_of(name: str) -> str:
    """How a function of polar angles is called; what is asked of a material alone says it by its signature."""
    if name in OF_ANGLES or not is_asked(name):
        return OF_ANGLES.get(name, KERNELS.format(name))
    return f"gn.{name}({M}, {next(filter(POLAR.fullmatch, arguments(functions()[name])))}=x)"


def is_asked(name: str) -> bool:
    """Whether a public function is asked of a material alone."""
    return function_of(name.rpartition(".")[2]) is functions()[name]


def test_every_function_of_polar_angles_is_in_the_sweep():
    kernels = {f"remote_sensing.{k}" for k in gn.remote_sensing.__all__}
    others = {name for name in ANGLED if name not in OF_ANGLES and not is_asked(name)}
    assert others <= kernels, "write how these are called into OF_ANGLES"


@pytest.mark.parametrize("name", thinned(ANGLED, {*ANGLED} - SLOW))
def test_polar_angles(name):
    call = call_of(name)
    assert isinstance(outcome(call, x=0.7), list), lines(call, x=0.7)


@pytest.mark.parametrize("name", ANGLED)
def test_polar_angles_in_degrees(name):
    call = call_of(name)
    assert not isinstance(outcome(call, x=40.0), list), f"{lines(call, x=40.0)}\ndegrees, and not a word of it"


TIMES = {"deg": 180.0 / np.pi, "rad": 1.0, "1/sr": 1.0, "1": np.pi, "%": 100.0 * np.pi}
"""What numbers of a table in rad and 1/sr are multiplied by."""
OF_NM = {"nm": lambda x: x, "um": lambda x: 1e-3 * x, "1/cm": lambda x: 1e7 / x, "eV": lambda x: 1239.8419843320026 / x}
"""What a wavelength in nm is in a unit; h c of the SI."""
OF_TABLES: dict[str, tuple[str, Callable[[list[list]], bytes]]] = {
    "CSV": (".csv", lambda rows: "\n".join(",".join(map(str, row)) for row in rows).encode()),
    "Excel": (".xlsx", lambda rows: workbook({"table": rows})),
    "reflectance spectrum": (".csv", lambda rows: "\n".join(",".join(map(str, row)) for row in rows).encode()),
}
"""Formats whose options say the units of tables: their suffix, and a file of rows."""


def _units() -> list[Any]:
    """A format, an option that says a unit, and a unit."""
    return [
        pytest.param(module.NAME, name, word, id=f"{module.NAME}-{word}")
        for module in formats()
        for name, option in options(module.read if hasattr(module, "read") else module.load).items()
        if name.endswith("_unit")
        for word in option.declared.words
    ]


@pytest.mark.parametrize("name, option, unit", _units())
def test_tables_in_any_unit(name, option, unit, tmp_path):
    units = {"angle_unit": "rad", "wavelength_unit": "nm", "value_unit": "1/sr"} | {option: unit}
    suffix, packed = OF_TABLES[name]
    (reader,) = (module.read for module in formats() if name == module.NAME)
    if "angle_unit" not in options(reader):
        units = {"wavelength_unit": "nm", "value_unit": "1"} | {option: unit}
    nm, f = OF_NM[units["wavelength_unit"]], TIMES[units["value_unit"]]
    if "angle_unit" not in units:
        rows = [["wavelength", "reflectance"], *([nm(x), f * 0.15] for x in (450, 550))]
        (tmp_path / "m").write_bytes(packed(rows))
        m = gn.load(tmp_path / "m", **units)
        np.testing.assert_allclose(m.channel_names, [450.0, 550.0], rtol=1e-9)
        np.testing.assert_allclose(m.f([0, 0, 1], [0, 0, 1]), 0.15, rtol=1e-9)
        return
    angle = TIMES[units["angle_unit"]]
    rows: list[list] = [["theta_i", "phi_i", "theta_o", "phi_o", "wavelength", "BRDF" if f == 1.0 else "BRF"]]
    places = [
        (i, 0.0, o, phi, x) for i in (0.2, 0.7) for o in (0.1, 0.5) for phi in (0.0, 1.0, 2.0) for x in (450, 550)
    ]
    rows += [[i * angle, 0.0, o * angle, phi * angle, nm(x), f * (0.1 + 0.1 * o)] for i, _, o, phi, x in places]
    path = tmp_path / f"m{suffix}"
    path.write_bytes(packed(rows))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of files whose units are said, all the same
        m = gn.load(path, **units)
    np.testing.assert_allclose(m.channel_names, [450.0, 550.0], rtol=1e-9)
    found = m.f(gn.direction(0.7, 0.0), gn.direction(0.5, [0.0, 1.0, 2.0]))
    np.testing.assert_allclose(found, 0.15, rtol=1e-9, err_msg=f"gn.load({path}, **{units})")


@pytest.mark.parametrize("unit", [*dataset_layout.RADIANS, *dataset_layout.NANOMETRES])
def test_datasets_in_any_unit(unit):
    axes = {"theta_i": [0.2, 0.7], "theta_o": [0.1, 0.5], "phi": [0.0, 1.0, 3.0]}
    here = gn.Gridded("angles", axes, np.linspace(0.1, 0.3, 24).reshape(2, 2, 3, 2), channels=[450.0, 550.0])
    ds = gn.tables.to_dataset(here)
    for name, x in ds.coords.items():
        kind = {"rad": dataset_layout.RADIANS, "nm": dataset_layout.NANOMETRES}.get(x.attrs.get("units"), {})
        if unit in kind:
            ds = ds.assign_coords({name: (x.dims, x.values / kind[unit], {"units": unit})})
    there = gn.tables.from_dataset(ds)
    np.testing.assert_allclose(there.wavelengths, [450.0, 550.0], rtol=1e-12)
    wi, wo = gn.direction(0.7, 0.0), gn.direction(0.5, [0.0, 1.0, 2.0])
    np.testing.assert_allclose(there.f(wi, wo), here.f(wi, wo), rtol=1e-9)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("height_unit", UNITS)
def test_surfaces_in_any_unit(unit, height_unit):
    um = np.random.default_rng(3).random((8, 8))
    there = gn.surfaces.from_map(um / UNITS[height_unit], 0.5 / UNITS[unit], unit, height_unit=height_unit)
    np.testing.assert_allclose(there.rms_slopes, gn.surfaces.from_map(um, 0.5).rms_slopes, rtol=1e-6)


@pytest.mark.parametrize("unit", typed_angles.UNITS)
def test_typed_angles_in_any_unit(unit):
    text = f"{40.0 / typed_angles.UNITS[unit]!r}{unit}"
    np.testing.assert_allclose(typed_angles.in_degrees(text), 40.0, rtol=1e-12)


def test_directions_in_degrees():
    angles = [0.0, 30.0, 70.0], [10.0, 200.0, 300.0]
    np.testing.assert_allclose(gn.direction(*angles, degrees=True), gn.direction(*map(np.radians, angles)), atol=1e-15)
