"""Light that pictures leave out is told at the call, by the names of the parts, once; and where none is, nothing is."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from click.testing import CliRunner

import gonio as gn
from gonio.cli.commands import cli
from gonio.errors import LeftOutWarning

EVEN = gn.ConstantLight(1.0)
GLASS, PANE = gn.SmoothDielectric(1.5), gn.ThinDielectric(1.5)
SQUARE = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], float), [[0, 1, 2, 3]]
BENT = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, -1, 1]], float), [[0, 1, 2], [0, 2, 3]]
SMALL = {"size": 8, "samples": 2}


def told(call):
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        call()
    assert all(w.category is LeftOutWarning and w.filename == __file__ for w in said)
    return [str(w.message) for w in said]


@pytest.mark.parametrize(
    "call",
    [
        lambda: gn.render(GLASS, EVEN, **SMALL),
        lambda: gn.scenes.render_stokes(GLASS, gn.DistantLight([0.0, -1.0, 0.0]), **SMALL),
        lambda: gn.scenes.picture_jacobian(gn.RoughDielectric(gn.GGX(0.2), 1.5), EVEN, "alpha_x", **SMALL),
        lambda: gn.scenes.write_turntable(GLASS, lights=EVEN, frames=2, **SMALL),
        pytest.param(
            lambda: gn.figures.gallery([GLASS], {"even": EVEN, "half": gn.ConstantLight(0.5)}, **SMALL),
            marks=pytest.mark.full,
        ),
    ],
)
def test_solid_glass_has_one_surface(call):
    (text,) = told(call)
    assert "light goes through one surface of" in text and "Dielectric(" in text and "lights nothing" not in text


def test_what_is_let_through_lights_no_other_part():
    scene = gn.Scene(
        [gn.scenes.Mesh(SQUARE, gn.Lambertian(0.5)), gn.scenes.Mesh(BENT, PANE), gn.scenes.Mesh(BENT, GLASS)]
    )
    (text,) = told(lambda: gn.render(scene, EVEN, **SMALL))
    through, shadows = text.split("; ")
    assert "SmoothDielectric(eta=1.5) (part 2)" in through and "(part 1)" not in through
    assert "(part 1)" in shadows and "(part 2)" in shadows and "(part 0)" not in text
    bent, above = gn.scenes.Mesh(BENT), {"ground": gn.Lambertian(0.5)}
    for call in (lambda: gn.render(PANE, EVEN, bent, **SMALL), lambda: gn.render(PANE, EVEN, **above, **SMALL)):
        (text,) = told(call)
        assert text.startswith("render: what ThinDielectric(") and "as if it were opaque" in text


@pytest.mark.parametrize(
    "m, shape",
    [
        (PANE, "sphere"),
        (PANE, gn.scenes.Mesh(SQUARE)),
        (gn.Lambertian(0.1) + gn.DiffuseTransmission(0.2), "plane"),
        (gn.TwoSided(gn.Lambertian(0.5), gn.Lambertian(0.2)), gn.scenes.Mesh(BENT)),
        (gn.Microfacet(gn.GGX(0.3)), gn.scenes.Mesh(BENT)),
    ],
)
def test_where_nothing_is_left_out_nothing_is_said(m, shape):
    assert told(lambda: gn.render(m, EVEN, shape, **SMALL)) == []


def test_the_command_line_says_it_once(tmp_path):
    arguments = ["render", "SmoothDielectric(1.5)", "-o", str(tmp_path / "glass.png"), "--size", "8", "--samples", "2"]
    run = CliRunner().invoke(cli, arguments)
    assert run.exit_code == 0, run.output
    assert run.output.count("gonio: warning: render: light goes through one surface") == 1
