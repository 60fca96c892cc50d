"""What figures draw: slices that end where the data end, what was measured, names of one number of many channels."""

from __future__ import annotations

import numpy as np
import pytest
from house import PLASTIC

import gonio as gn
from gonio.errors import ParameterError
from gonio.figures import _drawing, half_difference_figure
from gonio.figures._slices import USUAL, VIEWS, incidences, lit_range, one_number, plane, slices_of, spans
from gonio.formula import tree


def scan(phi: float = 0.0) -> gn.Scattered:
    """Measured in the plane of incidence, at 15 to 60 degrees, up to views of 70 degrees."""
    theta_i, view = np.meshgrid(np.radians([15.0, 30.0, 45.0, 60.0]), np.radians(np.arange(-70.0, 71.0, 10.0)))
    rows = [x.ravel() for x in (theta_i, phi + 0.0 * view, np.abs(view), np.where(view < 0.0, phi, phi + np.pi))]
    f = PLASTIC.f_angles(*rows)
    return gn.Scattered(*rows, f, uncertainty=0.02 * f)


def grid(**options: object) -> gn.Gridded:
    """On a grid of all azimuths, up to 60 and 65 degrees."""
    nodes = {"theta_i": (0.0, 61.0, 10.0), "theta_o": (0.0, 66.0, 5.0), "phi": (0.0, 360.0, 15.0)}
    axes = {name: np.radians(np.arange(*steps)) for name, steps in nodes.items()}
    theta_i, theta_o, phi = np.meshgrid(*axes.values(), indexing="ij")
    return gn.Gridded("angles", axes, PLASTIC.f_angles(theta_i, 0.0, theta_o, phi), **options)


@pytest.mark.parametrize("phi", [0.0, 1.0])
def test_slices_of_a_scan_are_what_was_measured(phi):
    m = scan(phi)
    slices = slices_of(m)
    assert [s.theta for s in slices] == [15.0, 30.0, 45.0, 60.0] == incidences(m)
    assert lit_range(m) == (15.0, 60.0)
    for s in slices:
        np.testing.assert_allclose(np.sort(s.views), np.arange(-70.0, 71.0, 10.0), atol=1e-6)
        seen = gn.direction(np.radians(np.abs(s.views)), np.where(s.views < 0.0, np.pi, 0.0))
        true = PLASTIC.f(gn.direction(np.radians(s.theta), np.pi), seen)
        np.testing.assert_allclose(s.measured, true, rtol=1e-12)  # forward of the light is to the right
        np.testing.assert_allclose(s.u, 0.02 * true, rtol=1e-12)
        assert np.isnan(s.f[np.abs(VIEWS) > 70.5]).all() and np.isfinite(s.f[np.abs(VIEWS) < 69.5]).all()
    assert spans(slices) == [(-90.0, pytest.approx(-70.0, abs=0.2)), (pytest.approx(70.0, abs=0.2), 90.0)]


def test_slices_of_a_grid_end_with_its_nodes():
    for outside in ("hold", "missing"):
        slices = slices_of(grid(outside=outside))
        assert [round(s.theta, 9) for s in slices] == [0.0, 10.0, 30.0, 40.0, 60.0]  # next to the usual ones
        for s in slices:
            assert np.isnan(s.f[np.abs(VIEWS) > 65.1]).all() and np.isfinite(s.f[np.abs(VIEWS) < 64.9]).all()
            assert len(np.unique(s.views.round(6))) == 27 and s.u is None
            np.testing.assert_allclose(np.interp(s.views, VIEWS, s.f), s.measured, rtol=2e-3)
    assert slices_of(PLASTIC)[0].views.size == 0 and spans(slices_of(PLASTIC)) == []
    assert incidences(PLASTIC) == list(USUAL) and lit_range(PLASTIC) == (0.0, 90.0)


def test_slices_across_the_plane_of_incidence():
    """Against f itself, at azimuths of 90 degrees; the measured rows of a grid are those at these azimuths."""
    along, across = slices_of(PLASTIC, [45.0])[0], slices_of(PLASTIC, [45.0], 0.5 * np.pi)[0]
    wi = gn.direction(np.radians(45.0), np.pi)
    for s, turn in ((along, 0.0), (across, 0.5 * np.pi)):
        wo = gn.direction(np.radians(VIEWS), turn)  # negative: towards the light, turned
        np.testing.assert_allclose(s.f, PLASTIC.f(wi, wo), rtol=1e-9)
    assert across.f.max() < 0.5 * along.f.max()
    (of_grid,) = slices_of(grid(), [40.0], 0.5 * np.pi)
    assert len(np.unique(of_grid.views.round(6))) == 27
    np.testing.assert_allclose(np.interp(of_grid.views, VIEWS, of_grid.f), of_grid.measured, rtol=2e-3)
    assert slices_of(grid(), [35.0])[0].views.size == 0  # no node is near


def test_the_plane_of_an_oriented_measurement_is_one_that_was_lit():
    rows = [np.concatenate(x) for x in zip(scan(0.4).rows.T, scan(2.9).rows.T, strict=True)]
    m = gn.Scattered(*rows, np.ones(len(rows[0])), isotropic=False)
    assert plane(m) == pytest.approx(2.9)
    assert all(len(s.views) == 15 for s in slices_of(m))
    axes = {"theta_i": [0.0, 0.8], "theta_o": [0.0, 0.8], "phi_i": [0.0, 1.0, 2.8, 4.5], "phi_o": [0.0, 3.0]}
    assert plane(gn.Gridded("angles", axes, np.ones((2, 2, 4, 2)))) == 2.8
    assert plane(PLASTIC) == plane(scan(0.4)) == np.pi


@pytest.mark.parametrize(
    ("names", "count", "words", "weights"),
    [
        (None, 1, "", [1.0]),
        (None, 3, "luminance", [0.2126, 0.7152, 0.0722]),
        (("R", "G", "B"), 3, "luminance", [0.2126, 0.7152, 0.0722]),
        (("X", "Y", "Z"), 3, "luminance Y", [0.0, 1.0, 0.0]),
        (("Band1", "Band2", "nir"), 3, "mean of 3 channels", [1 / 3] * 3),
        ((450.0, 550.0, 650.0), 3, "mean of 3 wavelengths, 450 to 650 nm", [1 / 3] * 3),
        (None, 4, "mean of 4 channels", [0.25] * 4),
    ],
)
def test_one_number_of_many_channels_has_a_name(names, count, words, weights):
    m = tree.with_notes(gn.Lambertian(np.linspace(0.1, 0.5, count)), channel_names=names)
    number, got = one_number(m)
    assert got == words
    np.testing.assert_allclose([number(row) for row in np.eye(count)], weights, atol=5e-5)


MAP = gn.Lambertian(np.linspace(0.1, 0.9, 6).reshape(2, 3, 1))


@pytest.mark.usefixtures("unlaid")
@pytest.mark.parametrize("m", [scan(), MAP, gn.Lambertian(np.linspace(0.1, 0.5, 7))], ids=["scan", "map", "7 channels"])
def test_figures_say_what_they_draw(m, tmp_path, monkeypatch):
    """No light is needed; the title is no path; what is no data says so."""
    said = []
    monkeypatch.setattr("matplotlib.text.Text.set_text", _recording(said))
    named = tree.with_notes(m, path="/a/long/path/sample.csv") if hasattr(m, "path") else m
    written = {"path": tmp_path / "a.svg"} if hasattr(m, "path") else {}  # one is enough: writing takes a second
    gn.figures.overview(named, **written, size=16, samples=1)
    text = "\n".join(said)
    assert "[sr⁻¹]" in text and "/a/long" not in text
    if hasattr(m, "path"):
        assert {"sample.csv", "no data", "incidence θᵢ"} <= set(said) and "bars: ±2u" in text and "outermost" in text
    elif m is MAP:
        assert "+ the place (0, 1) of the other panels" in text and "sphere" not in text.lower()
    else:
        assert "mean of 7 channels" in text and "number of the channel" in said


def _recording(said: list[str]):
    from matplotlib.text import Text

    original = Text.set_text

    def set_text(self, s):
        said.append(str(s))
        original(self, s)

    return set_text


# What is drawn, read back from the axes.


def lines(axes) -> list[tuple[np.ndarray, np.ndarray]]:
    """The curves of axes, without ticks and limits."""
    return [line.get_data() for line in axes.lines if len(line.get_xdata()) > 8]


TWO = {"a$b": gn.Lambertian(0.3), "_": PLASTIC}
"""Labels as they are typed, that Matplotlib would take for mathematics, or leave out."""


def labels(axes) -> list[str]:
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_polar_slices_hold_f():
    (host,) = gn.figures.polar(PLASTIC, np.radians([0.0, 60.0])).axes
    (axes,) = host.child_axes
    for (theta, radius), incidence in zip(lines(axes), (0.0, 60.0), strict=True):
        wi = gn.direction(np.radians(incidence), np.pi)
        np.testing.assert_allclose(10.0**radius, PLASTIC.f(wi, gn.direction(theta, 0.0)), rtol=1e-6)
    assert labels(host) == ["0°", "60°"]
    hosts = gn.figures.polar(TWO).axes
    assert len(hosts) == 3 and labels(hosts[1]) == list(TWO)
    assert [len(lines(h.child_axes[0])) for h in hosts] == [2, 2, 2]


def test_slices_share_their_scale():
    one = gn.figures.slices(PLASTIC).axes
    assert len(one) == 2 and one[0].get_ylim() == one[1].get_ylim() and one[0].get_yscale() == "log"
    assert "[sr⁻¹]" in one[0].get_ylabel() and "[°]" in one[0].get_xlabel()
    several = gn.figures.slices(TWO, np.radians([30.0, 60.0])).axes
    assert len(several) == 4 and labels(several[0]) == list(TWO)
    (views, f), _ = lines(several[1])  # the second column is that of 60 degrees
    np.testing.assert_allclose(f, 0.3 / np.pi)
    assert views.min() < -89.0
    assert len({line.get_color() for line in several[0].lines if len(line.get_xdata()) > 8}) == 2


def test_half_difference_slices_hold_f_and_leave_out_what_is_unknown():
    axes, _, bar = gn.figures.half_difference([PLASTIC, grid()]).axes
    image = axes.collections[0].get_array().filled(np.nan)
    assert image.shape == half_difference_figure.CELLS[::-1] and bar.get_ylabel() == "f [sr⁻¹]"
    edges = half_difference_figure.nodes()
    theta_h, theta_d = (np.radians(0.5 * (e[1:] + e[:-1])) for e in edges)
    wi, wo = gn.directions.from_half_difference(theta_h[20], 0.0, theta_d[50], 0.5 * np.pi)
    np.testing.assert_allclose(image[50, 20], PLASTIC.f(wi, wo), rtol=1e-9)
    of_grid = half_difference_figure.slice_of(grid(), 0.5 * np.pi)
    assert np.isnan(of_grid[-1]).all() and np.isfinite(of_grid[0, 0])  # beyond 65 degrees there are no data
    below = half_difference_figure.slice_of(PLASTIC, 0.0)
    assert np.isnan(below[-1, -1])  # below the horizon


def test_albedos_are_those_of_gonio():
    rgb = gn.Lambertian([0.2, 0.5, 0.8]) + 0.1 * gn.OrenNayar(0.5, 0.4)
    (axes,) = gn.figures.albedo(rgb).axes
    assert labels(axes) == ["red", "green", "blue"]
    for channel, (theta, curve) in enumerate(lines(axes)):
        rho = gn.albedo(rgb, gn.direction(np.radians(theta), 0.0), tolerance=1e-4)
        np.testing.assert_allclose(curve, rho[:, channel], atol=2e-3)
    (both,) = gn.figures.albedo({"white": gn.Lambertian(1.0), "colour": rgb}).axes
    assert both.get_ylabel() == "albedo (luminance)" and labels(both) == ["white", "colour"]
    np.testing.assert_allclose(lines(both)[0][1], 1.0, atol=2e-3)


SKY = gn.ConstantLight(1.0)


def test_a_gallery_shows_what_is_rendered(tmp_path):
    m = gn.Lambertian([0.3, 0.5, 0.6])
    lights = {"x": SKY, "y": [SKY, SKY]}
    cells = gn.figures.gallery([m, m], lights, tmp_path / "c.png", size=16, samples=4).axes
    assert [axes.get_title() for axes in cells] == ["x", "y", "", ""]
    assert [axes.texts[0].get_text()[-4:] for axes in cells[::2]] == [" (1)", " (2)"]
    pictures = [gn.render(m, light, size=16, samples=4) for light in (SKY, [SKY, SKY])]
    for axes, picture in zip(cells, pictures, strict=False):
        shown = np.asarray(axes.images[0].get_array())
        inside = picture.alpha == 1.0
        linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)[..., :3]
        np.testing.assert_allclose(linear[inside], np.minimum(picture.pixels, 1.0)[inside], atol=1e-4)
    alone = gn.figures.gallery({"p": pictures[0], "q": pictures[1], "r": m}, columns=2, size=16, samples=4).axes
    assert [axes.get_title() for axes in alone] == ["p", "q", "r"]
    assert (tmp_path / "c.png").stat().st_size > 1000


@pytest.mark.usefixtures("unlaid")
def test_differences_are_signed(tmp_path):
    image = pytest.importorskip("PIL.Image")
    one, two = (gn.render(gn.Lambertian(rho), SKY, size=24, samples=4) for rho in (0.3, 0.6))
    gn.figures.difference(one, two, path=tmp_path / "d.png", labels=["one", "two"])
    with image.open(tmp_path / "d.png") as figure:
        codes = np.asarray(figure.convert("RGB"), dtype=float)
    left, right = np.split(codes, [codes.shape[1] * 5 // 9], axis=1)
    assert np.ptp(left, axis=-1).max() < 8.0  # gray spheres
    assert (right[..., 0] - right[..., 2]).max() > 80.0  # brighter is red
    again = gn.figures.difference(gn.scenes.picture_difference(one, two))
    np.testing.assert_array_equal(
        again.axes[2].images[0].get_array().filled(0.0),
        gn.figures.difference(one, two).axes[2].images[0].get_array().filled(0.0),
    )
    drawn = again.axes[2].images[0]
    red, _, blue, _ = drawn.to_rgba(drawn.get_array())[12, 12]
    assert red > blue  # of the difference itself, beside its scale
    high = gn.figures.difference(*(gn.scenes.Image(picture.pixels[:, 8:14]) for picture in (one, two)))
    assert high.get_figheight() > 2.0 * again.get_figheight()
    of_models = gn.figures.difference(gn.Lambertian(0.3), gn.Lambertian(0.6)).axes[2].collections[0].get_array()
    np.testing.assert_allclose(of_models, 100.0 * 0.3 / 0.45)


def test_a_fit_is_drawn_beside_its_data():
    found = gn.fit(gn.tables.tabulate(gn.Lambertian(0.3), resolution=(9, 9, 18)), gn.Lambertian())
    figure = gn.figures.fit(found)
    assert [axes.get_title() for axes in figure.axes[2:5]] == ["data", "model", "difference"]
    np.testing.assert_allclose(lines(figure.axes[0])[-1][1], 0.3 / np.pi, rtol=1e-6)


def test_laws_are_drawn_with_their_verdicts():
    report = gn.check(gn.OriginalPhong(0.25, 8.0))
    axes = gn.figures.laws(gn.OriginalPhong(0.25, 8.0), report).axes[0]
    assert axes.get_title() == "2 of 11 laws broken" if len(report.laws) == 11 else "broken" in axes.get_title()
    assert {law.name for law in report.laws} <= {text.get_text() for text in axes.texts}


FIGURES = {
    "polar": lambda **more: gn.figures.polar(TWO, [0.5], **more),
    "slices": lambda **more: gn.figures.slices(TWO, [0.5], **more),
    "half_difference": lambda **more: gn.figures.half_difference(TWO, **more),
    "albedo": lambda **more: gn.figures.albedo(TWO, **more),
    "fate": lambda **more: gn.figures.fate(gn.ThinDielectric(), **more),
}


@pytest.mark.parametrize("name", FIGURES)
def test_figures_are_drawn_into_axes_and_written(name, tmp_path):
    from matplotlib.figure import Figure

    own = Figure()
    count = 2 if name in ("slices", "half_difference") else 1
    axes = [own.add_subplot(1, count + 1, k + 1) for k in range(count)]
    got = FIGURES[name](axes=axes, path=tmp_path / "a.svg")
    assert got is own and "<svg" in (tmp_path / "a.svg").read_text(encoding="utf-8")
    with pytest.raises(ParameterError, match=r"expected \d, one of Matplotlib for each panel"):
        FIGURES[name](axes=[*axes, *axes])
    with pytest.raises(ParameterError, match=r"ends in \.png"):
        FIGURES[name](path=tmp_path / "a.tif")
    assert [path.name for path in tmp_path.iterdir()] == ["a.svg"]


def test_a_polar_figure_takes_polar_axes(tmp_path):
    from matplotlib.figure import Figure

    axes = Figure().add_subplot(projection="polar")
    gn.figures.polar(PLASTIC, axes=axes, path=tmp_path / "a.pdf")
    assert len(lines(axes)) == len(USUAL) and not axes.child_axes
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")


def test_notebooks_show_figures():
    assert gn.figures.fate(gn.ThinDielectric())._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: gn.figures.polar([]), "at least one Reflectance"),
        (lambda: gn.figures.polar({"m": 3}), "expected a dictionary|expected"),
        (lambda: gn.figures.polar(MAP), "a map of 2 x 3 places"),
        (lambda: gn.figures.albedo({"x": MAP}), "overview"),
        (lambda: gn.figures.slices(PLASTIC, [30.0, 60.0]), "in degrees"),
        (lambda: gn.figures.slices(PLASTIC, []), "0 angles"),
        (lambda: gn.figures.portrait(MAP), "a map"),
        (lambda: gn.figures.gallery([]), "at least one"),
        (lambda: gn.figures.gallery([PLASTIC] * 401), "400 pictures"),
        (lambda: gn.figures.gallery([PLASTIC], []), "lights"),
        (lambda: gn.figures.gallery([PLASTIC], columns=-1), "columns=-1"),
        (lambda: gn.figures.gallery([PLASTIC], exposure=1e4), "200 stops"),
        (lambda: gn.figures.difference(PLASTIC), "got Expression|two materials"),
        (lambda: gn.figures.difference(PLASTIC, PLASTIC, labels=["a"]), "expected two"),
    ],
)
def test_bad_input_is_refused_in_words(call, words):
    with pytest.raises(gn.Error, match=words):
        call()


def test_colours_are_apart_for_everybody():
    """Distances in OKLab of the colours as people see them who lack one kind of cones (Vienot 1999)."""
    for colours, least in ((_drawing.COLOURS, 0.05), (_drawing.SEQUENCE, 0.05), (_drawing.RGB, 0.05)):
        rgb = np.array([[int(c[k : k + 2], 16) / 255.0 for k in (1, 3, 5)] for c in colours])
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        for seen in (np.eye(3), PROTAN, DEUTAN):
            lab = _oklab(np.clip(linear @ seen.T, 0.0, 1.0))
            apart = np.linalg.norm(lab[:, None] - lab[None], axis=-1) + np.eye(len(lab))
            assert apart.min() > least, (colours, apart.min())


PROTAN = np.array([[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]])
DEUTAN = np.array([[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]])


def _oklab(linear: np.ndarray) -> np.ndarray:
    lms = linear @ np.array(
        [[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566],
         [0.0883024619, 0.2817188376, 0.6299787005]]
    ).T  # fmt: skip
    return np.cbrt(lms) @ np.array(
        [[0.2104542553, 0.7936177850, -0.0040720468], [1.9779984951, -2.4285922050, 0.4505937099],
         [0.0259040371, 0.7827717662, -0.8086757660]]
    ).T  # fmt: skip
