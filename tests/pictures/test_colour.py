"""Colour has one place, `pictures/colour.py`: one matrix, one luminance, one transfer function."""

from __future__ import annotations

import re
import textwrap

import numpy as np
import pytest
from places import PACKAGE

import gonio as gn
from gonio.base.light import Light
from gonio.cli import albedo, arguments, check, commands, render, show
from gonio.declared.discover import docstring, modules
from gonio.errors import Error, NotFoundError, ParameterError
from gonio.facts import material as facts
from gonio.figures import _drawing
from gonio.lights import _words
from gonio.pictures import colour, image
from gonio.pictures.colour import (
    LUMINANCE,
    RELATIVE_XYZ,
    RGB_OF_XYZ,
    WHITE,
    XYZ,
    XYZ_OF_RGB,
    rgb_of,
    to_rgb,
    to_xyz,
    transformed,
)
from gonio.uncertainty import correlation


def test_the_matrix_is_that_of_the_primaries():
    """Primaries and white have the chromaticities of IEC 61966-2-1, and the published seven digits come out."""
    for vector, x, y in zip((*XYZ_OF_RGB.T, WHITE), colour.SRGB_XY[::2], colour.SRGB_XY[1::2], strict=True):
        np.testing.assert_allclose(vector[:2] / vector.sum(), (x, y), rtol=1e-14)
    published = [
        [0.4123908, 0.3575843, 0.1804808],
        [0.2126390, 0.7151687, 0.0721923],
        [0.0193308, 0.1191948, 0.9505322],
    ]
    np.testing.assert_allclose(XYZ_OF_RGB, published, atol=5.1e-8)
    assert WHITE[1] == pytest.approx(1.0, abs=1e-15)


def test_colours_come_back():
    """RGB to X, Y, Z and to colours relative to white, and back: rounding."""
    rgb = np.random.default_rng(0).random((100, 3))
    np.testing.assert_allclose(rgb @ XYZ_OF_RGB.T @ rgb_of(XYZ), rgb, atol=1e-14)
    np.testing.assert_allclose(rgb @ XYZ_OF_RGB.T / WHITE @ rgb_of(RELATIVE_XYZ), rgb, atol=1e-14)
    np.testing.assert_array_equal(LUMINANCE, XYZ_OF_RGB[1])
    np.testing.assert_allclose(XYZ_OF_RGB @ RGB_OF_XYZ, np.eye(3), atol=1e-15)


SPECTRA = {
    "noise": lambda nm: np.random.default_rng(2).random(len(nm)),
    "edge": lambda nm: np.clip((nm - 580.0) / 20.0, 0.0, 1.0),
    "wave": lambda nm: 0.5 + 0.4 * np.sin(nm / 60.0),
}


@pytest.mark.parametrize("spectrum", SPECTRA.values(), ids=SPECTRA)
@pytest.mark.parametrize("nm", [np.arange(360.0, 781.0), np.arange(400.0, 701.0, 20.0)], ids=["1 nm", "20 nm"])
def test_spectra_have_the_colours_of_colour_science(spectrum, nm):
    """Its sum over every nanometre, of the same straight lines, relative to white: 5e-5."""
    with np.printoptions():  # it changes how arrays are printed
        colour_science = pytest.importorskip("colour")
    every = np.arange(360.0, 781.0)
    observer, d65 = (
        kind[name].copy().align(colour_science.SpectralShape(360, 780, 1))
        for kind, name in (
            (colour_science.MSDS_CMFS, "CIE 1931 2 Degree Standard Observer"),
            (colour_science.SDS_ILLUMINANTS, "D65"),
        )
    )

    def summed(values):
        spectrum = colour_science.SpectralDistribution(values, every)
        return colour_science.sd_to_XYZ(spectrum, observer, d65, method="Integration") / 100.0

    expected = summed(np.interp(every, nm, spectrum(nm))) / summed(np.ones(421))
    np.testing.assert_allclose(spectrum(nm) @ to_xyz(nm) / WHITE, expected, atol=5e-5)


def test_spectra_are_integrated_exactly():
    """At any wavelengths in any order: finer tables of the same straight lines have the same colour."""
    rng = np.random.default_rng(3)
    nm = rng.permutation(rng.uniform(340.0, 800.0, 30))
    values = rng.random(30)
    between = np.concatenate([rng.uniform(nm.min(), nm.max(), 500), nm, [200.0, 5000.0]])
    order = np.argsort(nm)
    finer = np.interp(between, nm[order], values[order])
    np.testing.assert_allclose(values @ to_xyz(nm), finer @ to_xyz(between), rtol=1e-12)
    np.testing.assert_allclose(to_xyz(nm).sum(axis=0), WHITE, rtol=1e-13)
    np.testing.assert_allclose(to_rgb(nm).sum(axis=0), 1.0, rtol=1e-12)
    for outside in ([900.0, 1000.0], [1000.0, 900.0], [100.0, 200.0]):
        nearest = np.argmin(np.abs(np.array(outside) - 500.0))
        np.testing.assert_allclose(to_xyz(outside)[nearest], WHITE, rtol=1e-13)


def test_light_of_one_wavelength_is_on_the_horseshoe():
    """A narrow line has the chromaticity of the observer's table there: 555 nm, CIE 15:2004, x 0.3373, y 0.6588."""
    x, y, z = np.array([0.0, 1.0, 0.0]) @ to_xyz([554.9, 555.0, 555.1])
    assert (x / (x + y + z), y / (x + y + z)) == pytest.approx((0.3373, 0.6588), abs=1e-4)


@pytest.mark.parametrize("bad", [[500.0], [[400.0, 500.0]], [400.0, 400.0], [400.0, np.nan], [400.0, np.inf]])
def test_wavelengths_that_are_none(bad):
    with pytest.raises(Error, match="wavelengths"):
        to_rgb(bad)


@pytest.mark.parametrize("name, format_", [("a.bsdf", "Zemax"), ("a.xml", "WINDOW XML")])
def test_colours_survive_a_file(tmp_path, name, format_):
    """Written as X, Y, Z, read again, turned into RGB: what text files round, no more."""
    rgb = np.array([0.1, 0.5, 0.2])
    gn.save(gn.Lambertian(rgb), tmp_path / name, format=format_)
    m = gn.load(tmp_path / name)
    f = m.f_angles(0.3, 0.1, 0.4, 0.2)
    np.testing.assert_allclose(f @ rgb_of(m.channel_names) * np.pi, rgb, rtol=2e-6)


@pytest.mark.parametrize("shape", [(16384, 200), (3, 5, 31), (7, 3), (0, 31), (1, 400_000)])
def test_channels_are_transformed_as_by_a_product(shape):
    """In small products, whatever is left over."""
    rng = np.random.default_rng(1)
    values, matrix = rng.random(shape, dtype=np.float32), rng.random((shape[-1], 3), dtype=np.float32)
    result = transformed(values, matrix)
    assert result.dtype == np.float32 and result.shape == (*shape[:-1], 3)
    np.testing.assert_allclose(result, values.astype(float) @ matrix.astype(float), rtol=3e-5)


def test_no_other_module_says_what_srgb_is():
    """Its matrix, luminance and transfer function are written down nowhere else; disney_principled has a luminance of
    its own, as published."""
    told = re.compile(r"3\.240|0\.412[34]|0\.2126|0\.7151|0\.7152|0\.0722|1\.055\b|0\.04045|0\.0031308|0\.3127")
    texts = {p: p.read_text(encoding="utf-8") for p in PACKAGE.rglob("*.py") if p.name != "colour.py"}
    assert [str(p) for p, text in texts.items() if told.search(text)] == []


def test_the_words_of_lights_are_in_the_help_and_are_read():
    """As their files declare them: usage and meaning in the help of `render` and `show`, usages in errors."""
    words = _words.words()
    assert [word.name for word in words][:3] == ["FILE", "FILE.ies", _words.DEFAULT] and len(words) >= 5
    for command in (render.render, show.show):
        text = " ".join(docstring(command.callback).split())
        for word in words:
            assert f"{word.usage} {word.meaning}" in text
    with pytest.raises(NotFoundError) as error:
        arguments.resolve_light("lamp")
    assert all(word.usage in str(error.value) for word in words)
    for word in words[2:]:
        numbers = ",".join(["1"] * word.needs)
        assert isinstance(arguments.resolve_light(f"{word.name}:{numbers}" if numbers else word.name), Light)
        if word.needs:
            with pytest.raises(ParameterError, match=re.escape(f"expected {word.usage} {word.example}")):
                arguments.resolve_light(word.name)


def test_a_new_word_is_known_by_its_file_alone(monkeypatch):
    from gonio.lights import function

    declared = _words.Word("lamp:L", "a lamp of radiance L", lambda numbers: gn.ConstantLight(numbers[0]))
    monkeypatch.setattr(function, "WORDS", [declared], raising=False)
    assert arguments.resolve_light("lamp:3") == gn.ConstantLight(3.0)
    with pytest.raises(ParameterError, match="expected lamp:L"):
        arguments.resolve_light("lamp")


def test_every_file_of_a_command_is_a_command():
    """`commands.py` holds the commands' order, and all of them: put a new file's command there."""
    import click

    files = {
        value
        for module in modules("gonio.cli")
        for value in vars(module).values()
        if isinstance(value, click.Command)
        and value is not commands.cli
        and value.callback.__module__ == module.__name__
    }
    assert files == set(commands.cli.commands.values())


def test_help_names_the_pictures_that_can_be_written():
    """In `render.py`: edit the help of --output when a format of pictures comes or goes."""
    (output,) = (option for option in render.render.params if option.name == "output")
    assert set(re.findall(r"\.[a-z]+", output.help)) == set(image._WRITERS)
    assert set(image._WRITERS) <= set(image.SUFFIXES)


def test_help_names_the_figures_that_can_be_written():
    """In `show.py` and `check.py`: edit their help when `figures/_drawing.py` writes others."""
    for command, name in ((show.show, "output"), (check.check, "plot")):
        (option,) = (option for option in command.params if option.name == name)
        assert set(re.findall(r"\.[a-z]+", option.help)) | {".jpg"} == set(_drawing.SUFFIXES)


def test_the_command_line_offers_what_errors_may_be():
    """In `albedo.py`: edit its choices when `uncertainty/correlation.py` knows others."""
    (option,) = (option for option in albedo.albedo.asked if option.name == "uncertainty")
    assert option.type.declared.words == correlation.WORDS
    assert option.help.endswith(f"[default: {','.join(facts.ASSUMPTIONS)}]")


def test_formats_of_pictures_say_what_they_are():
    for module in modules("gonio.pictures.files"):
        assert module.STARTS and module.WRITTEN in module.SUFFIXES and docstring(module.read), module
        assert textwrap.shorten(docstring(module), 1000)
