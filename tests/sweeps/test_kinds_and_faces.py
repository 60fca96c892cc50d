"""Every face of gonio for every kind of material: a result, or a `gonio.Error` that says what to do.

A face is a public function that takes a material and no directions, or what notebooks show; it is in this sweep by
existing, and `CALLS` says how it is called where its name alone does not do. By default a part of the pairs, chosen by
their names, with each face and each kind in it; all with `full`. A failure ends with Python that repeats it.
"""

from __future__ import annotations

import inspect
import re
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from face import functions
from kinds import KINDS, of_kind

import gonio as gn

TRIANGLE = "([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])"

CALLS = {
    "check": 'gn.check(m, laws=["positivity", "energy", "sampling"])',
    "convert": 'gn.convert(m, folder / "m.nc", resolution=(6, 6, 4))',
    "figures.difference": "gn.figures.difference(m, 0.5 * m)",
    "figures.gallery": "gn.figures.gallery(m, size=8, samples=1)",
    "figures.laws": 'gn.figures.laws(m, gn.check(m, laws=["energy"]))',
    "figures.overview": "gn.figures.overview(m, size=8, samples=1)",
    "fit": "gn.fit(m, gn.Lambertian(), starts=1)",
    "fitting.fit_many": "gn.fitting.fit_many([m], [gn.Lambertian()], starts=1)",
    "fitting.fit_map": "gn.fitting.fit_map((wi, wo, m.f(wi, wo)), gn.Lambertian())",
    "fitting.fit_map_chunks": "gn.fitting.fit_map_chunks((wi, wo, m.f(wi, wo)), gn.Lambertian())",
    "fitting.fit_problem": "gn.fitting.fit_problem(m, gn.Lambertian())",
    "formats.save": 'gn.save(m, folder / "m.csv")',
    "reconstruction.nearest": 'gn.reconstruction.nearest(m, {"matt": gn.Lambertian(0.3), "white": gn.Lambertian(0.9)})',
    "scenes.picture_jacobian": "gn.scenes.picture_jacobian(m, by=list(m.parameters)[:1], size=8, samples=1)",
    "planning.plan": "gn.planning.plan(m, 2, starts=1, by=list(m.parameters)[:1], per_channel=False)",
    "reconstruction.reconstruct": "gn.reconstruction.reconstruct(m)",
    "reconstruction.reflectance_basis": "gn.reconstruction.reflectance_basis("
    "[m, gn.Lambertian(0.5)], 1, resolution=(6, 6, 4))",
    "render": "gn.render(m, size=8, samples=1)",
    "scenes.render_stokes": "gn.scenes.render_stokes(m, size=8, samples=1)",
    "repair.resample": 'gn.repair.resample(m, "directions.half_difference", resolution=(6, 6, 4))',
    "reconstruction.retro_facets": "gn.reconstruction.retro_facets(m)",
    "save": 'gn.save(m, folder / "m.json")',
    "fitting.select_model": "gn.fitting.select_model(m, {'matt': gn.Lambertian(), 'minnaert': gn.Minnaert()})",
    "tables.tabulate": "gn.tables.tabulate(m, resolution=(6, 6, 4))",
    "tables.to_dataset": "gn.tables.to_dataset(m, resolution=(6, 6, 4))",
    "scenes.write_turntable": "gn.scenes.write_turntable(m, frames=2, size=8, samples=1)",
    "write_report": 'gn.write_report(m, folder / "m.html", fits=False)',
    "repair.extrapolate_to_grazing": 'gn.repair.extrapolate_to_grazing(m, "hold")',
    "repair.subtract_signature": "gn.repair.subtract_signature(m, gn.Lambertian(0.01))",
    "repair.symmetrize": 'gn.repair.symmetrize(m, "reciprocal")',
    "notebooks": "[m._repr_html_(), m._repr_png_()]",
    "scenes.radiosity": f"gn.scenes.radiosity(gn.Scene(gn.scenes.Mesh({TRIANGLE}, m, exitance=1.0)))",
    "at": "m.at([450.0, 550.0, 620.0])",
    "under": "m.under(np.ones(m.channels or 1))",
    "json": 'gn.load(gn.save(m, folder / "m.json") or folder / "m.json")',
}
"""How a face is called, as Python; any other one with the material alone."""

WI, WO = gn.direction([0.1, 0.4, 0.7], 0.0), gn.direction([0.5, 0.2, 0.3], 2.0)

DIRECTIONS = re.compile(r"w|wi|wo|(theta|phi)(_.)?|incident|collected|directions?|views?")
FIRST = re.compile(r"m|materials?|data")
MORE = ("notebooks", "scenes.radiosity", "at", "under", "json")
NOT_OF_MATERIALS = {
    "radiometry.roughness.alpha_from_beckmann_m": "its m is Beckmann's number",
    "formats.write": "`save`, for those who have a format's module",
}


def faces() -> list[str]:
    """Public functions whose first argument is a material, and of which no other one is a direction."""
    found = []
    for name, function in functions().items():
        first, *others = [*inspect.signature(function).parameters.values(), None]
        takes = first is not None and (
            FIRST.fullmatch(first.name) or re.search("Reflectance|Measured", str(first.annotation))
        )
        directed = any(DIRECTIONS.fullmatch(p.name) for p in others if p is not None and p.default is p.empty)
        if takes and not directed and name not in NOT_OF_MATERIALS:
            found.append(name)
    return [*found, *MORE]


def pairs() -> list[Any]:
    marks = pytest.mark.full
    found = []
    for face in faces():
        for kind in KINDS:
            some = zlib.crc32(f"{face} {kind}".encode()) % 8 == 0
            found.append(pytest.param(face, kind, id=f"{face}-{kind}", marks=() if some else marks))
    return found


@pytest.mark.parametrize(("face", "kind"), pairs())
def test_a_result_or_an_error_that_says_what_to_do(face: str, kind: str, tmp_path: Path) -> None:
    call = CALLS.get(face, f"gn.{face}(m)")
    m = of_kind(kind)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a result with a warning is one
            eval(call, {"gn": gn, "np": np, "m": m, "folder": tmp_path, "wi": WI, "wo": WO})
    except Exception as error:
        if isinstance(error, gn.Error) and "a fault of gonio" not in str(error):
            assert len(str(error)) > 20, f"{error}: says too little"
            return
        raise AssertionError(
            f"{type(error).__name__}: {error}\n\nimport numpy as np, gonio as gn; from pathlib import Path; "
            f'folder = Path(".")\nm = {KINDS[kind]}\n{call}'
        ) from error
