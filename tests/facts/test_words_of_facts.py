"""A fact is said once: `gonio info`, reports and notebooks print the same words."""

from __future__ import annotations

import re
from html import unescape

import numpy as np
import pytest

import gonio as gn
from gonio.cli.info import facts_as_text
from gonio.facts import words
from gonio.facts.material import facts
from gonio.report.page import about as about_page
from gonio.report.page.told import Told


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A grid with holes, values below zero and uncertainties."""
    path = tmp_path_factory.mktemp("facts") / "table.csv"
    rows = ["theta_i,phi_i,theta_o,phi_o,f,u"]
    for theta_i in (0.0, 30.0, 60.0):
        for theta_o in (0.0, 20.0, 40.0, 70.0):
            for phi in (0.0, 90.0, 180.0):
                f = -0.01 if (theta_i, theta_o) == (60.0, 40.0) else float("nan") if theta_i + phi == 0.0 else 0.2
                rows.append(f"{theta_i},0,{theta_o},{phi},{f},0.01")
    path.write_text("\n".join(rows))
    return path


def bare(html: str) -> str:
    return " ".join(unescape(re.sub("<[^>]*>", " ", re.sub("</?span[^>]*>", "", html))).split())


def said_of(m, about):
    """Place -> what stands there."""
    one = {"facts": about, "title": "", "isotropic": True, "formulas": []}
    return {
        "info": " ".join(facts_as_text(about).split()),
        "report": bare(about_page.what(Told(one, {}, "m0"))),
        "notebook": bare(m._repr_html_()),
    }


def test_what_a_file_holds_is_said_in_the_same_words(file):
    m = gn.load(file)
    about = facts(str(file), m, computed=False)
    rows = [text for name, text in words.contents(about) if name != "quantity"]
    assert "4 nodes from 0° to 70°, uneven" in rows and "3 nodes from 0° to 60°, every 30°" in rows
    assert any(text.endswith("% of the table") for text in rows)
    for text in [*rows, words.channels(about)]:
        for place, whole in said_of(m, about).items():
            assert text in whole, (place, text)


@pytest.mark.parametrize(
    "m",
    [gn.IdealSpecular(0.9), gn.ThinDielectric(1.5), gn.Phong(), gn.Donaldson([[0.2, 0.0], [0.3, 0.6]])],
    ids=lambda m: type(m).__name__,
)
def test_a_fact_is_one_row_that_every_place_shows(m, monkeypatch):
    about, optics = facts("", m, computed=False), words.optics
    monkeypatch.setattr(words, "optics", lambda facts: [*optics(facts), ("made up", "by this test")])
    assert len([*words.optics(about)]) > 2
    for name, text in words.optics(about):
        for place, whole in said_of(m, about).items():
            assert name in whole and " ".join(text.split()) in whole, (place, text)


@pytest.mark.parametrize(
    "m, expected",
    [
        (gn.Lambertian(0.5), "1: gray"),
        (gn.Lambertian([0.1, 0.2, 0.3]), "3: linear RGB"),
        (gn.Lambertian([0.1, 0.2]), "2"),
        (gn.Lambertian([0.1, 0.2], wavelengths=[450.0, 550.0]), "2: 450, 550 nm"),
        (gn.Lambertian(np.full(5, 0.2), wavelengths=np.linspace(400.0, 600.0, 5)), "5: 400 to 600 nm"),
    ],
)
def test_channels(m, expected):
    assert words.channels(facts("", m, computed=False)) == expected


def test_notes_of_a_file_are_text():
    about = {"about": {"made_by": "A", "parts": ["one", 2], "empty": "", "none": None, "kinds": {"a": 1}}}
    assert dict(words.notes(about)) == {"made by": "A", "parts": "one; 2", "kinds": "{'a': 1}"}


def test_origins_are_told_back_to_the_first():
    origin = {"material": "x", "converted_from": [{"file": "a.csv", "format": "CSV", "sha256": "12"}, {"file": "b"}]}
    told = list(words.provenance({"provenance": {"gonio": "1", "converted_from": origin}}))
    assert told == [
        ("read by", "gonio 1"),
        ("made from", "x, by gonio"),
        ("made from", "a.csv, CSV, sha256 12, by gonio"),
        ("made from", "b, by gonio"),
    ]


@pytest.mark.parametrize(
    "m, row",
    [
        (gn.Lambertian(np.full((2, 3, 1), 0.5)), ("map", "2 x 3 places")),
        (gn.ThinDielectric(1.5), ("sides", "transmits")),
        (gn.DiffuseTransmission(0.3), ("sides", "transmits alone")),
        (gn.IdealSpecular(0.9), ("mirror", "has a delta lobe: f is 0 pointwise, sampling and integrals are exact")),
    ],
)
def test_what_no_number_shows_is_said(m, row):
    assert row in words.optics(facts("", m, computed=False))


def test_what_is_as_usual_is_not_said():
    about = facts("", gn.Lambertian(0.5), computed=False)
    assert not {"sides", "places"} & {*about} and [*words.optics(about)] == [("channels", "1: gray")]
