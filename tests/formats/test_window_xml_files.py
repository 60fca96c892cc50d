"""WINDOW XML files: round trips, which blocks are read, writing any reflectance, and damaged files."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from format_cases import MODEL, file_of
from places import real
from test_window_xml import BRUSHED, directions, over_the_disc
from window_xml_texts import (
    TINY,
    block,
    defined,
    document,
    full,
    grid_of,
    numbers_of,
    tiny,
    tree3,
    tree4,
    tree_file,
    words,
)

import gonio as gn
from gonio.errors import Error, FormatError, ParameterError
from gonio.formats import formats, load, save, window_xml
from gonio.formats.window_xml import tree_nodes, xml_document
from gonio.formats.window_xml.klems import FULL, QUARTER, AngleBasis, Klems
from gonio.formats.window_xml.numbers import NumberText
from gonio.formats.window_xml.tensor_tree import TensorTree
from gonio.pictures.colour import RELATIVE_XYZ, WHITE, XYZ

REAL_FILES = ("2011-SA1.XML", "t3.xml")


def same(a, b) -> bool:
    return a == b and a.document == b.document and a.about == b.about


# Round trips.


@pytest.mark.parametrize("text", [full(), full(structure="Rows"), tiny("Rows"), tree3(), tree4()])
def test_what_was_read_is_written(text, tmp_path):
    text = text.replace("0.05,", "-0.012345678901234567,").replace("0.1,", "nan,").replace("0.2,", "1e-320,")
    m = load(file_of(tmp_path, text))
    path = tmp_path / "b.xml"
    save(m, path, "WINDOW XML")
    again = load(path)
    assert same(m, again)
    for old, new in zip(m.chosen[1], again.chosen[1], strict=True):  # the other blocks
        assert old is None or np.array_equal(old, new, equal_nan=True)
    outside = [piece.decode() for piece in m.document.pieces]
    left = path.read_text(encoding="utf-8")
    for piece in outside:  # byte by byte, in order
        assert piece in left
        left = left.partition(piece)[2]
    save(again, tmp_path / "c.xml", "WINDOW XML")
    assert (tmp_path / "c.xml").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("name", REAL_FILES)
def test_real_files_are_written_as_they_were(name, tmp_path):
    path = real(f"window_xml/{name}")
    m = load(path)
    save(m, tmp_path / "a.xml", "WINDOW XML")
    again = load(tmp_path / "a.xml")
    assert m == again
    assert m.document == again.document
    assert {**m.about} == again.about
    if isinstance(m, Klems):
        assert m.hemispherical_totals().max() == pytest.approx(0.641, abs=5e-4)  # checkBSDF: 64.1 %, and 71.0 %
        back = window_xml.read(path, side="back")
        assert back.hemispherical_totals().max() == pytest.approx(0.710, abs=5e-4)
        assert m.about["Manufacturer"] == "Nysan"
        assert len(m.document.blocks) == 8
        solar = window_xml.read(path, wavelength="solar")
        assert not np.array_equal(solar.values, m.values)
    else:
        assert (m.side, m.dimensions) == ("back", 3)


def test_changed_values_are_written_into_the_file_they_came_from(tmp_path):
    m = load(file_of(tmp_path, full()))
    save(m.replace(values=m.values + 0.5), tmp_path / "b.xml", "WINDOW XML")
    changed, back = load(tmp_path / "b.xml"), window_xml.read(tmp_path / "b.xml", side="back")
    assert np.array_equal(changed.values, m.values + 0.5)
    assert np.array_equal(back.values, numbers_of(145, 145, 1))


@pytest.mark.parametrize(
    "change", ["crlf", "cr", "utf-16", "bom", "blank lines", "prefix", "comment", "cdata", "latin"]
)
def test_variants_of_the_same_file(change, tmp_path):
    text = tiny()
    expected = load(file_of(tmp_path, text)).values
    text = text.replace(", ", "\t") if change in ("cr", "bom") else text
    data = {
        "crlf": lambda: text.replace("\n", "\r\n").encode(),
        "cr": lambda: text.replace("\n", "\r").encode(),
        "utf-16": lambda: text.replace("UTF-8", "UTF-16").encode("utf-16"),
        "bom": lambda: b"\xef\xbb\xbf" + text.encode(),
        "blank lines": lambda: ("\n \n" + text).encode(),
        "prefix": lambda: (
            text.replace("</", "</b:")
            .replace("<", "<b:")
            .replace("<b:/b:", "</b:")
            .replace("<b:?", "<?")
            .replace("xmlns=", "xmlns:b=")
            .encode()
        ),
        "comment": lambda: text.replace("<ScatteringData>", "<ScatteringData a='>'><!-- 1 2 -->").encode(),
        "cdata": lambda: (
            text.replace("<ScatteringData>", "<ScatteringData><![CDATA[")
            .replace("</ScatteringData>", "]]></ScatteringData>")
            .encode()
        ),
        "latin": lambda: text.replace("UTF-8", "ISO-8859-1").replace("Shade", "Für").encode("latin-1"),
    }[change]()
    path = tmp_path / "b.xml"
    path.write_bytes(data)
    m = load(path)
    assert np.array_equal(m.values, expected)
    assert m.about["Name"] == ("Für & co" if change == "latin" else "Shade & co")
    save(m, path, "WINDOW XML")
    assert same(load(path), m)


@pytest.mark.parametrize("bytes_at_once", [1, 2, 7, 333])
def test_files_are_read_in_parts(bytes_at_once, tmp_path, monkeypatch):
    commented = tiny().replace("</ScatteringData>", "<!-- 1 -->\n<![CDATA[]]></ScatteringData >")
    for k, text in enumerate((tiny(), tree3(), "\n \n" + tiny().replace("Shade", "Für"), commented)):
        for encoding in ("utf-8", "utf-16") if bytes_at_once > 100 else ("utf-8",):
            path = tmp_path / f"{k}{encoding}.xml"
            path.write_bytes(text.encode(encoding))
            whole = load(path)
            with monkeypatch.context() as patched:
                patched.setattr(xml_document, "CHUNK", bytes_at_once)
                in_parts = load(path)
            assert same(in_parts, whole)
            save(in_parts, tmp_path / "again.xml", "WINDOW XML")
            assert same(load(tmp_path / "again.xml"), whole)


@pytest.mark.parametrize("characters", [1, 2, 5, 11])
def test_numbers_and_braces_come_in_parts(characters):
    text = " {{1.25,-3e-5\t7 }\n{ nan 2\r\n} }{4}5"
    whole, parts = NumberText(), NumberText()
    whole.add(text)
    for start in range(0, len(text), characters):
        parts.add(text[start : start + characters])
    assert np.array_equal(whole.array(""), [1.25, -3e-5, 7, np.nan, 2, 4, 5], equal_nan=True)
    assert np.array_equal(parts.array(""), whole.array(""), equal_nan=True)
    opens, before = parts.braces()
    assert (opens == [True, True, False, True, False, False, True, False]).all()
    assert before.tolist() == [0, 0, 3, 3, 5, 5, 5, 6]
    assert np.array_equal(before, whole.braces()[1])


def test_blocks_without_end_are_refused(tmp_path):
    path = file_of(tmp_path, tiny().replace("<Material>", "<ScatteringData/>" * 10_001 + "<Material>"))
    with pytest.raises(FormatError, match="more than 10000 blocks"):
        load(path)


def test_lines_are_counted_from_the_start_of_the_file(tmp_path):
    path = file_of(tmp_path, "\n" * 200_000 + tiny().replace("</Layer>", "</layer>"))
    line = 1 + path.read_text().split("</layer>")[0].count("\n")
    with pytest.raises(FormatError, match=rf"line {line}: not well-formed XML"):
        window_xml.read(path)


def test_words_without_end_are_refused(tmp_path):
    path = file_of(tmp_path, tiny().replace("<ScatteringData>", "<ScatteringData>" + "1" * 200_000))
    with pytest.raises(FormatError, match=r"'1{30,40} among the numbers"):
        load(path)


def test_copies_and_views(tmp_path):
    for text in (full(), tree3()):
        m = load(file_of(tmp_path, text))
        copy = pickle.loads(pickle.dumps(m))
        wi, wo = directions(1, 20), directions(2, 20)
        assert copy == m
        assert np.array_equal(copy.f(wi, wo), m.f(wi, wo))
        save(copy, tmp_path / "b.xml", "WINDOW XML")
        assert load(tmp_path / "b.xml") == m
        assert m.data.attrs["quantity"] == "brdf"
        assert m.valid.all()
    held = load(file_of(tmp_path, full())).data
    assert held["values"].dims == ("outgoing", "incident")
    assert float(held["omega_incident"].sum()) == pytest.approx(math.pi)


# Which blocks are read.

BANDS = {
    "Visible": (0, "Integral"),
    "CIE-X": (1, "Integral"),
    "CIE-Z": (2, "Integral"),
    "Solar": (3, "Integral"),
    "650": (4, "Nanometer"),
    "450.5": (5, "Nanometer"),
}


def of_bands(*names: str, direction: str = "Reflection Front") -> str:
    blocks = [block(words(numbers_of(5, 5, BANDS[n][0])), direction, n, unit=BANDS[n][1]) for n in names]
    return "".join(blocks)


@pytest.mark.parametrize(
    ("names", "options", "seeds", "channels"),
    [
        (("Solar", "Visible"), {}, [0], None),
        (("Solar", "Visible"), {"wavelength": "SOLAR"}, [3], None),
        (("CIE-X", "Visible"), {}, [0], None),
        (("CIE-Z", "Visible", "CIE-X", "Solar"), {}, [1, 0, 2], RELATIVE_XYZ),
        (("650", "450.5"), {}, [5, 4], (450.5, 650.0)),
        (("650", "Visible", "450.5"), {}, [0], None),
        (("650", "Visible", "450.5"), {"wavelength": "spectral"}, [5, 4], (450.5, 650.0)),
        (("650", "Visible", "450.5"), {"wavelength": "650"}, [4], None),
        (("Solar",), {}, [3], None),
    ],
)
def test_bands(names, options, seeds, channels, tmp_path):
    m = window_xml.read(file_of(tmp_path, document(of_bands(*names))), **options)
    assert m.channel_names == channels
    expected = np.stack([numbers_of(5, 5, seed) for seed in seeds], axis=2)
    assert np.array_equal(m.values, expected if channels else expected[..., 0])
    assert m.f([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]).shape == ((len(seeds),) if channels else ())
    save(m, tmp_path / "b.xml", "WINDOW XML")
    assert window_xml.read(tmp_path / "b.xml", **options) == m


def test_sides(tmp_path):
    back = file_of(tmp_path, document(of_bands("Visible", direction="reflection  back")))
    assert load(back).side == "back"
    with pytest.raises(FormatError, match="no reflection of the front, but reflection of the back"):
        window_xml.read(back, side="front")
    with pytest.raises(ParameterError, match="expected one of 'front', 'back', 'both'"):
        load(back, side="left")
    with pytest.raises(FormatError, match="no band 'Solar' of the reflection of the back; expected one of 'Visible'"):
        window_xml.read(back, wavelength="Solar")
    for direction in ("Transmission", "Absorption Front", ""):
        with pytest.raises(FormatError, match="neither reflection nor transmission; its blocks: Visible"):
            load(file_of(tmp_path, document(of_bands("Visible", direction=direction))))


# Any reflectance, written.


def test_a_lambertian_is_exact(tmp_path):
    path = tmp_path / "a.xml"
    for options in ({}, {"basis": "half"}, {"basis": TINY}, {"tree": 3}, {"tree": 4, "resolution": 4}):
        save(gn.Lambertian(0.3), path, "WINDOW XML", **options)
        m = load(path)
        kept = m.values if isinstance(m, Klems) else m.values[m.first == 0]
        np.testing.assert_allclose(kept[kept != 0.0], 0.3 / math.pi, rtol=1e-12)
        assert "basis" not in options or m.incident.size in (77, 5)
    assert (tmp_path / "a.xml").stat().st_size < 2000  # one leaf


@pytest.mark.parametrize(("alpha", "error"), [(0.3, (2e-5, 5e-4)), (0.05, (3e-5, 6e-2))])
def test_means_over_patches_keep_the_albedo(alpha, error, tmp_path):
    model = gn.Microfacet(gn.GGX(alpha), 0.9)
    save(model, tmp_path / "a.xml", "WINDOW XML")
    totals = load(tmp_path / "a.xml").hemispherical_totals()
    node, weight = np.polynomial.legendre.leggauss(8)
    ends = np.cumsum([0, *FULL.counts])
    for ring, (low, high) in enumerate(zip(FULL.sines, FULL.sines[1:], strict=False)):
        theta = np.arcsin(np.sqrt(low + (high - low) * 0.5 * (node + 1.0)))
        mean = (0.5 * weight * gn.albedo(model, gn.direction(theta, 0.0), 1e-6)).sum()
        np.testing.assert_allclose(totals[ends[ring] : ends[ring + 1]], mean, atol=error[ring == 8])


@pytest.mark.parametrize(("side", "options"), [("front", {}), ("back", {"tree": 4, "resolution": 16})])
def test_means_are_of_the_material_as_it_lies(side, options, tmp_path):
    """Its brushing direction is neither x nor y, so that every wrong turn and mirror image shows."""
    model = gn.Rotated(BRUSHED, 0.4)
    save(model, tmp_path / "a.xml", "WINDOW XML", side=side, **options)
    m = load(tmp_path / "a.xml")
    assert m.side == side
    wi, wo = directions(3, 3000), directions(4, 3000)
    true = model.f(wi, wo)
    steep = (wi[:, 2] > 0.4) & (wo[:, 2] > 0.4)
    off = np.median(np.abs(m.f(wi, wo) / true - 1.0)[steep])
    assert off < 0.1
    for x, y in ((1.0, -1.0), (-1.0, 1.0)):
        mirrored = m.f(wi * [x, y, 1.0], wo * [x, y, 1.0])
        assert np.median(np.abs(mirrored / true - 1.0)[steep]) > 2.0 * off


def test_trees_are_pruned_and_keep_their_totals(tmp_path):
    sizes, wi = [], gn.direction(0.5, 0.3)
    model = gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.2), 0.5)
    for tolerance in (0.0, 0.02, 0.2):
        save(model, tmp_path / "a.xml", "WINDOW XML", tree=3, tolerance=tolerance)
        m = load(tmp_path / "a.xml")
        sizes.append(len(m.values))
        total = m.f(wi, over_the_disc(128)).mean() * math.pi
        assert total == pytest.approx(gn.albedo(model, wi), abs=2e-3 if tolerance < 0.1 else 2e-2)
    assert sizes[0] > sizes[1] > 3 * sizes[2]


def test_colour_and_spectra(tmp_path):
    path, wi, wo = tmp_path / "a.xml", gn.direction(0.5, 0.2), gn.direction(0.4, 1.3)
    flat = gn.Lambertian([0.3, 0.3, 0.3])
    for options in ({"basis": "quarter"}, {"tree": 3, "resolution": 4}):
        save(flat, path, "WINDOW XML", **options)
        assert load(path).channel_names == RELATIVE_XYZ
        np.testing.assert_allclose(load(path).f(wi, wo), 0.3 / math.pi, rtol=1e-12)
        save(gn.Lambertian([0.5, 0.0, 0.0]), path, "WINDOW XML", **options)
        X, Y, Z = load(path).f(wi, wo) * math.pi
        assert pytest.approx(0.2126 * 0.5, abs=1e-4) == Y  # IEC 61966-2-1
        assert X > 2 * Y > 4 * Z
    spectral = gn.Lambertian(np.linspace(0.1, 0.7, 7)).replace()
    spectral.__dict__["channel_names"] = tuple(np.linspace(400.0, 700.0, 7))
    for options in ({"basis": "quarter"}, {"tree": 3, "resolution": 4}):
        save(spectral, path, "WINDOW XML", **options)
        m = window_xml.read(path, wavelength="spectral")
        assert m.channel_names == spectral.channel_names
        np.testing.assert_allclose(m.f(wi, wo), spectral.f(wi, wo), rtol=1e-12)
        X, Y, Z = load(path).f(wi, wo) * math.pi
        assert X > Y > Z
    infrared = gn.Lambertian([0.1, 0.2]).replace()
    infrared.__dict__["channel_names"] = (1550.0, 4000.0)
    save(infrared, path, "WINDOW XML", basis="quarter")
    assert load(path).channel_names == (1550.0, 4000.0)
    with pytest.raises(ParameterError, match="expected one, RGB, XYZ, or wavelengths"):
        save(gn.Lambertian([0.1, 0.2]), path, "WINDOW XML")


def test_colours_of_two_whites(tmp_path):
    """X, Y, Z of D65 become relative to a white surface; trees of them are not written as they are."""
    values = np.random.default_rng(1).random((5, 5, 3))
    for white, names in ((WHITE, XYZ), (1.0, RELATIVE_XYZ)):
        save(Klems(values * white, TINY, channel_names=names), tmp_path / "a.xml", "WINDOW XML")
        np.testing.assert_allclose(load(tmp_path / "a.xml").values, values, rtol=1e-14)
    trees = TensorTree([tree_nodes.from_grid(grid_of(3, 2), 0.0)] * 3, channel_names=XYZ)
    with pytest.raises(ParameterError, match=r"trees of channels .* write it with tree=3"):
        save(trees, tmp_path / "b.xml", "WINDOW XML")
    save(trees, tmp_path / "b.xml", "WINDOW XML", tree=3, resolution=4)


@pytest.mark.filterwarnings("ignore:.*times the light")  # random numbers, no light
def test_measurements_in_memory_are_written_as_they_are(tmp_path):
    path = tmp_path / "a.xml"
    other = AngleBasis("Four", (0.0, 90.0), (4,))
    values = np.arange(20.0).reshape(4, 5)
    for m in (
        Klems(values, TINY, other, side="back"),
        Klems(np.stack([values, values + 1, values + 2], axis=2), TINY, other, channel_names=RELATIVE_XYZ),
        TensorTree([tree_nodes.from_grid(grid_of(3, 2), 0.0)]),
        TensorTree([tree_nodes.from_grid(grid_of(4, 2, k), 0.3) for k in range(2)], "back", "", (500.0, 600.0)),
        TensorTree([tree_nodes.from_grid(grid_of(3, 2, k), 0.0) for k in range(3)], colour="uv"),
    ):
        save(m, path, "WINDOW XML", name="a < b")
        again = load(path)
        assert again == m
        assert (again.side, again.channel_names, again.about["Name"]) == (m.side, m.channel_names, "a < b")
        if isinstance(m, Klems):
            assert (again.incident, again.outgoing) == (TINY, other)


@pytest.mark.parametrize(
    ("model", "options", "says"),
    [
        (MODEL + gn.IdealSpecular(0.1), {}, "cannot hold a perfect mirror"),
        (MODEL, {"basis": "third"}, "expected one of 'full', 'half', 'quarter', or an AngleBasis"),
        (MODEL, {"basis": AngleBasis("a", (0.0, 80.0), (4,))}, "expected them to increase from 0 to 90"),
        (MODEL, {"basis": "full", "tree": 3}, "expected one of them"),
        (MODEL, {"tree": 2}, "tree=2: expected 3 or 4"),
        (MODEL, {"tree": 3, "resolution": 48}, "expected one of 2, 4, 8, 16, 32, 64, 128, 256"),
        (MODEL, {"tree": 3, "tolerance": -1.0}, "expected a number from 0 below 1"),
        (MODEL, {"side": "top"}, "expected 'front' or 'back'"),
        (MODEL, {"name": "a\0b"}, "expected a word"),
        (BRUSHED, {"tree": 3}, "is anisotropic; write it with tree=4"),
        (gn.Lambertian(np.full((2, 2, 1), 0.3)), {}, "without maps"),
        (Klems(np.full((5, 5), np.nan), TINY), {"basis": "quarter"}, "no value at all in 1681 of 1681 pairs"),
    ],
)
def test_what_cannot_be_written_is_refused(model, options, says, tmp_path):
    with pytest.raises(ParameterError, match=says):
        save(model, tmp_path / "a.xml", "WINDOW XML", **options)
    assert not list(tmp_path.iterdir())


def test_the_suffix_says_the_format(tmp_path):
    save(MODEL, tmp_path / "a.xml")
    assert isinstance(load(tmp_path / "a.xml"), Klems)


def test_what_does_not_fit_together_is_refused():
    for make, says in (
        (lambda: Klems(np.zeros((5, 4)), TINY), "expected .5, 5."),
        (lambda: Klems(np.zeros((5, 5)), TINY, side="up"), "'front' or 'back'"),
        (lambda: Klems(np.zeros((5, 5, 2)), TINY, channel_names=("X",)), "one per channel"),
        (lambda: TensorTree([]), "one or more trees"),
        (
            lambda: TensorTree([tree_nodes.from_grid(grid_of(3, 1), 0.0), tree_nodes.from_grid(grid_of(4, 1), 0.0)]),
            "all of 3",
        ),
        (lambda: TensorTree([tree_nodes.from_grid(grid_of(3, 1), 0.0)]).replace(values=np.zeros(3)), "got shape"),
    ):
        with pytest.raises(ParameterError, match=says):
            make()


# Damaged files.

DAMAGED = {
    "too few numbers": (tiny().replace("0.02, ", "", 1), "24 numbers, expected 25: 5 patches of 'Tiny'"),
    "too many": (tiny().replace("0.02, ", "0.02, 0.02, ", 1), "26 numbers, expected 25"),
    "a word": (tiny().replace("0.02, ", "O.02, ", 1), "line 18.*'O.02' among the numbers"),
    "underscores": (tiny().replace("0.02, ", "0.0_2, ", 1), "among the numbers"),
    "other digits": (tiny().replace("0.02, ", "٣, ", 1), "among the numbers"),
    "no numbers": (document(block("", "Reflection Front")), "has no numbers"),
    "no blocks": (document(""), "no <WindowDataBlock>|no <WavelengthDataBlock>"),
    "no structure": (tiny().replace("Columns", ""), "IncidentDataStructure is ''"),
    "unknown structure": (tiny().replace("Columns", "Diagonals"), "expected one of Columns, Rows"),
    "unknown basis": (tiny().replace("Tiny</Row", "Other</Row"), "'Other' is neither defined in the file nor known"),
    "two definitions": (
        document(block("1", "Reflection Front"), bases=defined(TINY) + defined(TINY._replace(counts=(1, 5)))),
        "defined twice, differently",
    ),
    "rings with a gap": (tiny().replace("<LowerTheta>30", "<LowerTheta>40"), "a ring starts at theta = 40 degrees"),
    "rings that end early": (tiny().replace("<UpperTheta>90", "<UpperTheta>80"), "increase from 0 to 90"),
    "no azimuths": (tiny().replace("<nPhis>4", "<nPhis>0"), "increase from 0 to 90|azimuths"),
    "huge azimuths": (tiny().replace("<nPhis>4", "<nPhis>99999999999"), "with nPhis '99999999999', expected numbers"),
    "azimuths in other digits": (tiny().replace("<nPhis>4", "<nPhis>٤"), "with nPhis '٤', expected numbers"),
    "infinite edges": (tiny().replace("<UpperTheta>90", "<UpperTheta>inf"), "increase from 0 to 90"),
    "twice": (document(of_bands("Visible") * 2), "a second block of Visible Reflection Front"),
    "cut short": (tiny()[:900], "not well-formed XML"),
    "a DTD": (
        tiny().replace("<WindowElement ", "<!DOCTYPE a>\n<WindowElement "),
        "line 2: a document type declaration",
    ),
    "entities": (
        tiny().replace("<WindowElement ", '<!DOCTYPE a [<!ENTITY b "c"><!ENTITY d "&b;&b;">]>\n<WindowElement '),
        "document type declaration",
    ),
    "nested": (tiny().replace("<Material>", "<Material>" + "<a>" * 5000), "nested more than 64 deep"),
    "another root": ("<a><WindowElement/></a>", "starts with <a>, expected <WindowElement>"),
    "another encoding": (tiny().replace("UTF-8", "no-such"), "not well-formed|decoded"),
    "tree: open": (tree_file(3, "{ { 1 } "), "braces that do not close one tree"),
    "tree: two": (tree_file(3, "{ 1 } { 2 }"), "braces that do not close one tree"),
    "tree: none": (tree_file(3, "1 2 3"), "braces that do not close one tree"),
    "tree: seven": (tree_file(3, "{" + "{ 1 }" * 7 + "}"), "7 trees in a pair of braces, expected 8"),
    "tree: seven and nine": (
        tree_file(3, "{" + "{ 1 }" * 6 + "{" + "{ 1 }" * 7 + "}{" + "{ 1 }" * 9 + "}}"),
        "7 trees in a pair of braces",
    ),
    "tree: three values": (tree_file(3, "{ 1 2 3 }"), "3 values in a grid, expected one of 1, 8"),
    "tree: empty": (tree_file(3, "{ }"), "0 values in a grid"),
    "tree: numbers before": (tree_file(3, "1 {" + "{ 1 }" * 8 + "}"), "numbers beside braces"),
    "braces in a matrix": (tiny().replace("<ScatteringData>", "<ScatteringData>{"), "braces among the numbers"),
    "tree: numbers beside": (tree_file(3, "{" + "{ 1 }" * 8 + " 5 }"), "numbers beside braces"),
    "tree: a word": (tree_file(3, "{ one }"), "'one' among the numbers"),
    "tree: deep": (tree_file(3, "{" * 5000 + "1" + "}" * 5000), "levels deep|1 trees in a pair"),
    "tree: basis": (tree_file(3, "{ 1 }").replace("Shirley-Chiu", "Klems Full"), "expected 'LBNL/Shirley-Chiu'"),
}


@pytest.mark.parametrize("what", DAMAGED)
def test_damage_is_named(what, tmp_path):
    text, says = DAMAGED[what]
    path = file_of(tmp_path, text)
    with pytest.raises(FormatError, match=says) as caught:
        window_xml.read(path)
    assert str(path) in str(caught.value)


def test_files_cut_anywhere(tmp_path):
    path = tmp_path / "a.xml"
    for text in (tiny(), tree3()):
        for end in range(0, len(text) - 20, 97):
            path.write_text(text[:end], encoding="utf-8")
            with pytest.raises(Error):
                load(path)


def test_syntax_variants_of_which_most_numbers_are_missing():
    for name in ("CommaSeparated", "CommaSeparated-SingleColumnScattering", "TabSeparated"):
        with pytest.raises(FormatError, match="4 numbers, expected 21025: 145 patches of 'LBNL/Klems Full'"):
            load(real(f"window_xml/2011-SA1-Small-{name}.XML"))


def test_other_formats_are_left_alone():
    head = full()[:4096].encode()
    claimed = [m.NAME for m in formats() if m.matches(head, 10**6)]
    assert claimed == ["WINDOW XML"]
    assert window_xml.matches(full()[:2000].encode("utf-16"), 10**6)
    assert not window_xml.matches(b"<?xml version='1.0'?><bsdf/>", 100)


def test_a_line_of_separators_is_no_row_of_numbers(tmp_path):
    assert load(file_of(tmp_path, ",\n" + full())).incident == FULL
    with pytest.raises(FormatError, match="not a known format"):
        load(file_of(tmp_path, ","))


def test_a_known_basis_need_not_be_defined(tmp_path):
    assert load(file_of(tmp_path, full())).incident == FULL
    assert (
        load(file_of(tmp_path, full(QUARTER).replace("LBNL/Klems Quarter", "lbnl/klems quarter"))).incident == QUARTER
    )
