"""A material by its words: code and commands make it again."""

from __future__ import annotations

import numpy as np
import pytest
from places import ROOT

import gonio as gn
from gonio.facts.models import drawn, kinds
from gonio.facts.subject import Subject, as_python

PTFE = ROOT / "examples" / "ptfe_in_plane.csv"


def test_programs_of_every_kind_of_subject_make_its_material(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    wi, wo = gn.direction(0.5, np.pi), gn.direction(0.6, 0.0)
    made = gn.load(PTFE.relative_to(ROOT), decimal=",")
    subjects = [
        Subject.of("a", gn.Lambertian([0.1, 0.2, 0.3]) + 0.5 * gn.IdealSpecular(0.04)),
        Subject.of("gold", gn.material("gold")),
        Subject.of("gold", gn.material("brass")),
        Subject.of("b", made),
        Subject("c", gn.material("gold", alpha=0.3), "gold", (), ("alpha=0.3",)),
        Subject("d", made.replace(outside="zero"), str(made.path), ("decimal=,",), ("outside=zero",)),
        Subject("e", gn.material("gold").replace(fresnel=gn.Dielectric(1.4)), "gold", (), ("fresnel=Dielectric(1.4)",)),
    ]
    for subject in subjects:
        scope: dict = {}
        exec("\n".join(subject.python([0.0], 180.0).split("\n")[:5]), scope)
        assert np.array_equal(scope["m"].f(wi, wo), subject.m.f(wi, wo)), subject.name
        assert repr(scope["m"]) == repr(subject.m)
    assert subjects[5].shell()[1] == f"gonio info {made.path} -O decimal=, -p outside=zero"
    assert Subject("f", gn.Lambertian(0.5), "Lambertian(0.5)").shell()[1] == "gonio info 'Lambertian(0.5)'"


@pytest.mark.parametrize("heading", kinds())
def test_expressions_are_python_with_the_name_of_the_package(heading):
    for kind in kinds()[heading].values():
        m = gn.expression(drawn(kind))
        for text in (drawn(kind), repr(m)):
            assert eval(as_python(text), {"gn": gn}) == m, text


def test_words_in_quotes_are_no_constructors():
    assert as_python('Lambertian(0.1) +  material("gold (pure)")') == 'gn.Lambertian(0.1) + gn.material("gold (pure)")'
    assert as_python("gn.Lambertian(0.1)") == "gn.Lambertian(0.1)"


def test_names_of_numbers_are_no_python():
    assert eval(as_python("Lambertian(1 / pi)"), {"gn": gn}) == gn.Lambertian(1.0 / np.pi)
    assert as_python("OrenNayar(pi=0.3)") == "gn.OrenNayar(pi=0.3)"  # that is a parameter


def test_a_sum_is_changed_as_a_whole():
    text = "Lambertian(0.1) + Lambertian(0.2)"
    m = gn.expression(text).replace({"0.rho": 0.3})
    assert eval(Subject("", m, text, (), ("0.rho=0.3",)).code, {"gn": gn}) == m
