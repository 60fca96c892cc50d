"""One signature and one docstring make a public function a form of the explorer; without them it is gone."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
import pytest

import gonio as gn
from gonio.base.reflectance import Reflectance
from gonio.declared.arguments import Declared, checked
from gonio.errors import NotFoundError, ParameterError
from gonio.explorer.calls import ask, functions
from gonio.explorer.shelf import Shelf
from gonio.facts.public import form, forms


@checked
def mirrored(
    m: Reflectance,
    theta: Annotated[float, Declared("angle of the light", 0.0, 0.5 * math.pi, "rad")],
    share: Annotated[float, Declared("what counts", 0.0, 1.0, "share")] = 1.0,
    side: Annotated[str, Declared("of the plane", words=("left", "right"))] = "left",
) -> float:
    """f in the mirror direction.

    Units    1/sr.
    """
    wi = gn.direction(theta, 0.0)
    return share * float(m.f(wi, wi * [-1.0, -1.0, 1.0])) * (1.0 if side == "left" else -1.0)


@pytest.fixture
def added(monkeypatch):
    monkeypatch.setattr(gn, "mirrored", mirrored, raising=False)
    monkeypatch.setattr(gn, "__all__", [*gn.__all__, "mirrored"])


def test_a_function_that_is_added_is_a_form_and_answers(added):
    found = next(one for one in functions(Shelf())["functions"] if one["name"] == "mirrored")
    assert found["doc"] == "f in the mirror direction."
    assert [(field["name"], field["expected"], field["default"]) for field in found["fields"]] == [
        ("theta", "a number from 0 to 90 degrees", ""),
        ("share", "a number from 0 to 100%", "100"),
        ("side", "'left' or 'right'", "left"),
    ]
    given = {"theta": "30", "share": "50", "side": "RIGHT"}
    assert float(ask(Shelf(), "Lambertian(0.5)", "mirrored", given)["text"]) == pytest.approx(-0.25 / math.pi)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"theta": "95"}, "theta '95': expected a number from 0 to 90 degrees: angle of the light"),
        ({"theta": "0.1rad", "share": "200"}, "share '200': expected a number from 0 to 100%"),
        ({"theta": "1", "side": "up"}, "side 'up': expected 'left' or 'right'"),
        ({"theta": "1", "gloss": "1"}, "no argument 'gloss'; expected theta, share, side"),
        ({}, "theta: expected a number from 0 to 90 degrees"),
    ],
)
def test_what_is_typed_wrongly_is_told_in_the_units_of_the_form(added, given, words):
    with pytest.raises(ParameterError, match=words):
        ask(Shelf(), "Lambertian(0.5)", "mirrored", given)


def test_a_function_that_is_not_there_has_no_form():
    assert form("mirrored") is None
    with pytest.raises(NotFoundError, match="no function of a material; expected one of absorptance, albedo"):
        ask(Shelf(), "Lambertian(0.5)", "mirrored", {})


def test_no_form_opens_or_writes_a_file():
    for found in forms():
        assert not {"path", "among", "output", "checkpoint"} & {*found.fields}, found.name
    assert {"white_sky_albedo", "albedo", "fate", "nearest"} <= {found.name for found in forms()}


def test_directions_are_typed_as_angles():
    found = ask(Shelf(), "Lambertian([0.2, 0.4])", "albedo", {"wi": "45,0"})
    assert np.allclose(np.array(found["text"].strip("[]").split(), float), [0.2, 0.4])
