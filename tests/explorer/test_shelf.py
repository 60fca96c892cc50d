"""What a page may name, and what it may not."""

import pytest

import gonio as gn
from gonio.errors import Error, ExpressionError, NotFoundError, ParameterError
from gonio.explorer.given import Given
from gonio.explorer.shelf import KEPT, Shelf


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "red.json"
    gn.save(gn.Lambertian([0.6, 0.1, 0.05]), path)
    return path


def test_names_and_expressions():
    shelf = Shelf()
    assert shelf.material("Gold", {}) == gn.material("gold")
    assert shelf.material("Lambertian(0.2)", {"rho": 0.3}) == gn.Lambertian(0.3)
    assert shelf.material('0.5 * material("gold")', {}) == 0.5 * gn.material("gold")


def test_materials_of_the_command_line(file):
    shelf = Shelf([Given(str(file)), Given("gold", (), ("alpha=0.3", "masking=separable"))])
    assert shelf.material(str(file), {}) == gn.Lambertian([0.6, 0.1, 0.05])
    name = "gold, alpha=0.3, masking=separable"
    assert shelf.material(name, {}) == gn.material("gold").replace(alpha=0.3, masking="separable")


def test_a_page_opens_no_file(file, monkeypatch):
    monkeypatch.chdir(file.parent)
    shelf = Shelf([], file.parent)
    for text in (str(file), "red.json", "./red.json", "upload:red.json", "upload:1/../red.json", "upload:../red.json"):
        with pytest.raises(NotFoundError):
            shelf.material(text, {})
    for text in (f"load({str(file)!r})", f"Lambertian(0.2) + load({str(file)!r})"):
        with pytest.raises(ExpressionError, match="may open none"):
            shelf.material(text, {})


def test_answers_do_not_say_which_files_there_are(file):
    there, missing = str(file), str(file.parent / "red.jsom")
    said = []
    for text in (there, missing):
        with pytest.raises(NotFoundError) as error:
            Shelf().material(text, {})
        said.append(str(error.value).replace(text, ""))
    assert said[0] == said[1]


def test_dropped_files(file):
    folder = file.parent / "1"
    folder.mkdir()
    file.rename(folder / "red.json")
    shelf = Shelf([], file.parent)
    assert shelf.material("upload:1/red.json", {}) == gn.Lambertian([0.6, 0.1, 0.05])
    for text in ("upload:1/blue.json", "upload:01/red.json", "upload:2/red.json", "upload:1/", "upload:1/red.json\n"):
        with pytest.raises(NotFoundError, match="no dropped file"):
            Shelf([], file.parent).material(text, {})


def test_words_stand_for_options_alone():
    shelf = Shelf()
    assert shelf.material("gold", {"masking": "separable"}).masking == "separable"
    for replaced in ({"alpha": "0.3"}, {"distribution": "Beckmann(0.3)"}, {"masking": 3.0}, {"distribution": 0.3}):
        with pytest.raises(ParameterError, match="expected"):
            shelf.material("gold", replaced)
    with pytest.raises(Error):
        shelf.material("gold", {"alpha": 7.0})
    with pytest.raises(NotFoundError):
        shelf.material("gold", {"nothing": 7.0})


def test_spectra_become_channels():
    m = Shelf().material("Lambertian(Spectrum([400, 700], [0.2, 0.8]))", {})
    assert m.channels == len(m.wavelengths) > 3


def test_few_materials_are_kept():
    shelf = Shelf()
    for k in range(3 * KEPT):
        shelf.material(f"Lambertian(0.{k})", {})
    assert len(shelf._kept) == KEPT
