"""From every format to every other and back: what a file held is still there, to what the other's cells allow.

The material has none of the symmetries behind which an exchange of directions, a turn or a reflection could hide.
Bounds are derived. Along an axis with nodes h apart, f changes on average over places x in a cell by at most

    linear interpolation   1/6 |f(x + h) - 2 f(x) + f(x - h)|, or 1/2 of it for f that is made of steps
    means over cells       1/6 (|f(x + h) - f(x)| + |f(x) - f(x - h)|)

Of a curvature c interpolation changes f by c h^2/12, of a kink it has 1/12 of the difference as well, of one step in a
cell 1/6; many steps J are an error of J^2/12 at each node and between them, half of the difference. Means change a
slope s by s h/4, three quarters of the bound, and a step by all of it. What several axes do adds up, and what the way
there and the way back do.
"""

import json
import math
import warnings
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from click.testing import CliRunner
from libraries import thinned

import gonio as gn
from gonio.base.angles import angles, direction, lattice_pairs
from gonio.base.measured import Measured
from gonio.cli.commands import cli
from gonio.conversion import comparison
from gonio.errors import MissingDataWarning, ParameterError
from gonio.formula.direction import Direction
from gonio.formula.fields import param, part
from gonio.numerics.lattice import lattice
from gonio.pictures.colour import RELATIVE_XYZ, RGB_OF_XYZ, XYZ
from gonio.tables.angle_systems import angle_system

pytestmark = pytest.mark.usefixtures("one_probe")
DEGREE = math.pi / 180.0
NM = (500.0, 550.0, 600.0)


class _Lopsided(gn.Reflectance):
    """A material that is neither reciprocal nor mirror-symmetric, and isotropic unless `brushed`."""

    of = part(gn.Reflectance, None, "what is changed")
    lean = param(0.15, 0.0, 1.0, "how much wi and wo differ, and the two sides of the plane of incidence")
    brushed = param(0.0, 0.0, 1.0, "how much turning the sample changes")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        across = wi.x * wo.y - wi.y * wo.x
        turned = wi.x * wo.x - wi.y * wo.y + 0.5 * wi.x + 0.3 * wo.y
        return self.of.formula(wi, wo) * (1.0 + self.lean * (wo.z - wi.z + across) + self.brushed * turned)


class _Spectral(_Lopsided):
    """The same at three wavelengths."""

    channel_names = NM


def surface(rho: Any) -> gn.Reflectance:
    return gn.Lambertian(rho) + gn.Microfacet(gn.GGX(0.5), gn.Dielectric(1.5))


SOURCES = {
    "colour": _Lopsided(surface([0.1, 0.2, 0.4])),
    "spectrum": _Spectral(surface([0.1, 0.2, 0.4])),
    "gray": _Lopsided(surface(0.3)),
    "brushed": _Lopsided(surface(0.3), brushed=0.15),
}


class Cells(NamedTuple):
    """Where a file has its nodes: coordinates (n, k) of pairs and back, and how far the nodes at x are apart (n, k).

    means     None where values between nodes are interpolated; where they are means over cells, the axes of wi
    centred   whether LIT is at the centre of a cell of wi
    cosine    whether f cos(theta_o) is interpolated, not f
    """

    angles: Callable[[np.ndarray, np.ndarray], np.ndarray]
    pairs: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    steps: Callable[[np.ndarray], Any]
    means: tuple[int, ...] | None = None
    centred: bool = False
    cosine: bool = False

    def change(self, m: gn.Reflectance, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """How much f (n, C) changes on average where it is put on these nodes; NaN next to the horizon."""
        x = self.angles(wi, wo)
        steps = np.broadcast_to(self.steps(x), x.shape)
        share = 1.0 / 2.0 if is_of_steps(m) else 1.0 / 6.0
        f, total = self.held(m, wi, wo), 0.0
        for k in range(x.shape[1]):
            h = np.where(np.arange(x.shape[1]) == k, steps, 0.0)
            above, below = (self.held(m, *self.pairs(y)) for y in (x + h, x - h))
            if self.means is not None:
                total = total + (np.abs(above - f) + np.abs(f - below)) / 6.0
            else:
                total = total + share * np.abs(above - 2.0 * f + below)
        return total / wo[:, 2:] if self.cosine else total

    def held(self, m: gn.Reflectance, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """What the file holds at pairs."""
        return seen(m, wi, wo) * (wo[:, 2:] if self.cosine else 1.0)

    def change_of_albedo(self, m: gn.Reflectance) -> Any:
        """How much the albedo from LIT may change: the integral of `change`. Means over cells of wo keep it; over cells
        of wi they change it by its curvature at the centre of a cell, elsewhere by a slope over half a cell; a step is
        halved at most.
        """
        if self.means is None:
            wo = hemisphere(1 << 12)
            return math.pi * np.nanmean(self.change(m, np.broadcast_to(LIT, wo.shape), wo), axis=0)
        x = self.angles(LIT[None], np.array([[0.0, 0.0, 1.0]]))
        steps = np.broadcast_to(self.steps(x), x.shape)
        total = 0.0
        for k in self.means:
            h = np.where(np.arange(x.shape[1]) == k, steps, 0.0)
            here, above, below = (albedo(m, self.pairs(y)[0][0]) for y in (x, x + h, x - h))
            if self.centred and not is_of_steps(m):
                total = total + np.abs(above - 2.0 * here + below) / 6.0
            else:
                share = 1.0 / 2.0 if is_of_steps(m) else 1.0 / 4.0
                total = total + share * (np.abs(above - here) + np.abs(here - below))
        return total


def is_of_steps(m: Any) -> bool:
    """Whether a file holds one value for a cell."""
    return getattr(m, "format", "") == "WINDOW XML"


def hemisphere(count: int) -> np.ndarray:
    """Directions of which as many are in every part of the hemisphere as its projected solid angle says."""
    u = lattice(count, 2)
    return direction(np.arcsin(np.sqrt(u[:, 0])), 2.0 * math.pi * u[:, 1])


def albedo(m: gn.Reflectance, wi: np.ndarray) -> np.ndarray:
    """Albedo (C,); directions without data, which are next to the horizon, count as 0."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MissingDataWarning)  # as said above
        return in_rgb(m, np.atleast_1d(gn.albedo(m, wi, TOLERANCE)))


def seen(m: gn.Reflectance, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f (n, C), as linear sRGB where it is X, Y, Z; NaN below the horizon."""
    f = m.f(wi, wo).reshape(len(wi), -1)
    return in_rgb(m, np.where((np.minimum(wi[:, 2], wo[:, 2]) > 0.0)[:, None], f, np.nan))


def in_rgb(m: gn.Reflectance, values: np.ndarray) -> np.ndarray:
    """Values (..., C); X, Y, Z as linear sRGB, and those relative to a white surface's."""
    if m.channel_names not in (XYZ, RELATIVE_XYZ):
        return values
    white = np.linalg.inv(RGB_OF_XYZ).sum(axis=1) if m.channel_names == RELATIVE_XYZ else 1.0
    return values * white @ RGB_OF_XYZ.T


def cells_of(name: str, steps: Any, count: int) -> Cells:
    """Nodes on `count` of the axes of one of gonio's parameterizations; the others are kept."""
    kind = angle_system(name)

    def coordinates(wi, wo):
        return np.stack(kind.angles(Direction(*wi.T), Direction(*wo.T), True), -1)

    def widths(x):
        given = steps(x) if callable(steps) else np.array(steps)
        return np.where(np.arange(4) < count, given, 0.0)

    return Cells(coordinates, lambda x: kind.pairs(*x.T), widths)


def by_squares(steps: tuple, largest: float, count: int) -> Callable[[np.ndarray], np.ndarray]:
    """Steps of an axis that begins with squares of k/(count - 1), and those of the others."""

    def widths(x):
        first = 2.0 * np.sqrt(np.abs(x[:, 0]) * largest) / (count - 1) + largest / (count - 1) ** 2
        return np.stack([first, *(np.full(len(x), s) for s in steps)], -1)

    return widths


def patches(edges: tuple[float, ...], counts: tuple[int, ...], centred: bool) -> Cells:
    """Klems' patches: rings between polar angles [degrees], each cut into so many."""
    rings, widths = np.radians(edges), np.radians(np.diff(edges))

    def steps(x):
        at = np.searchsorted(rings, x[:, :2], side="right") - 1
        return np.concatenate([widths[at], 2.0 * math.pi / np.array(counts)[at]], axis=1)

    return cells_of("angles", steps, 4)._replace(means=(0, 2), centred=centred)


FULL = patches((0, 5, 15, 25, 35, 45, 55, 65, 75, 90), (1, 8, 16, 20, 24, 24, 24, 16, 12), centred=True)
QUARTER = patches((0, 9, 27, 45, 63, 90), (1, 8, 12, 12, 8), centred=False)


def tree_cells(side: int, oriented: bool) -> Cells:
    """Cells of tensor trees: squares on the disc of projected directions, of side 2/`side`, and 1.27 times that where
    Shirley and Chiu's map stretches most (the length of (1, pi/4)); of wi only its radius counts in three dimensions.
    """
    h = 2.0 / side * math.hypot(1.0, 0.25 * math.pi)

    def coordinates(wi, wo):
        if oriented:
            return np.concatenate([wi[:, :2], wo[:, :2]], axis=1)
        (theta, phi), (_, phi_o) = angles(wi), angles(wo)
        turned = direction(angles(wo)[0], phi_o - phi)
        return np.stack([np.sin(theta), turned[:, 0], turned[:, 1], phi], -1)

    def pairs(x):
        if oriented:
            return on_disc(x[:, :2]), on_disc(x[:, 2:])
        wo = on_disc(x[:, 1:3])
        theta, phi = angles(wo)
        wi = on_disc(np.stack([x[:, 0] * np.cos(x[:, 3]), x[:, 0] * np.sin(x[:, 3])], -1))
        return wi, np.where(wo[:, 2:] > 0.0, direction(theta, phi + x[:, 3]), wo)

    steps = [h] * 4 if oriented else [2.0 / side, h, h, 0.0]
    return Cells(coordinates, pairs, lambda x: steps, means=(0, 1) if oriented else (0,))


def on_disc(xy: np.ndarray) -> np.ndarray:
    """Directions with these x and y; below the horizon where there are none."""
    z2 = 1.0 - (xy**2).sum(-1)
    return np.concatenate([xy, np.where(z2 > 0.0, np.sqrt(np.abs(z2)), -1.0)[:, None]], -1)


def rgl_cells(resolution: int, theta_i: int, phi_i: int | None) -> Cells:
    """theta_i, denser towards grazing; half vectors over at most 90 degrees, and the circle from phi_i."""

    def coordinates(wi, wo):
        m = (wi + wo) / np.linalg.norm(wi + wo, axis=-1, keepdims=True)
        (theta, phi), (theta_m, phi_m) = angles(wi), angles(m)
        return np.stack([theta, theta_m, phi_m - phi, phi], -1)

    def pairs(x):
        wi, m = direction(x[:, 0], x[:, 3]), direction(x[:, 1], x[:, 2] + x[:, 3])
        return wi, 2.0 * (wi * m).sum(-1, keepdims=True) * m - wi

    def steps(x):
        place = (np.abs(x[:, 0]) / (0.5 * math.pi)) ** (1.0 / 0.7) * (theta_i - 1)
        low, high = (0.5 * math.pi * (p / (theta_i - 1)) ** 0.7 for p in (np.floor(place), np.floor(place) + 1.0))
        turn = 2.0 * math.pi / phi_i if phi_i else 0.0
        rest = (0.5 * math.pi / (resolution - 1), 2.0 * math.pi / (resolution - 1), turn)
        return np.stack([high - low, *(np.full(len(x), s) for s in rest)], -1)

    return Cells(coordinates, pairs, steps, cosine=True)


class Format(NamedTuple):
    """How the test writes a format: of isotropic materials, and of others.

    holds     kinds of channels
    colours   names that it gives to colours; None if it keeps theirs (as X, Y, Z of D65)
    keeps     whether the file says what it was made of
    """

    name: str
    suffix: str
    holds: tuple[str, ...]
    options: dict[str, Any]
    cells: Cells
    oriented: dict[str, Any] | None = None
    oriented_cells: Cells | None = None
    colours: tuple[str, ...] | None = None
    keeps: bool = False


EVERY = ("colour", "spectrum", "gray")
"""Kinds of channels; those of the material with a direction are gray."""
RIGHT = 0.5 * math.pi
CIRCLE = 2.0 * math.pi


def own_layout(name: str, suffix: str) -> Format:
    return Format(
        name,
        suffix,
        EVERY,
        {"resolution": (46, 31, 36)},
        cells_of("half_difference", by_squares((RIGHT / 30, CIRCLE / 36, 0.0), RIGHT, 46), 3),
        {"resolution": (16, 13, 18, 12)},
        cells_of("half_difference", by_squares((RIGHT / 12, CIRCLE / 18, CIRCLE / 12), RIGHT, 16), 4),
        keeps=True,
    )


def degrees(*steps: float) -> np.ndarray:
    return np.array(steps) * DEGREE


FORMATS = {
    "MERL": Format(
        "MERL",
        ".binary",
        ("colour", "gray"),
        {"phi_d": 360},
        cells_of("half_difference", by_squares((DEGREE, DEGREE, 0.0), RIGHT, 91), 3),
        colours=("R", "G", "B"),
    ),
    "RGL": Format(
        "RGL",
        ".bsdf",
        EVERY,
        {"resolution": 48, "theta_i": 19},
        rgl_cells(48, 19, None),
        {"resolution": 12, "theta_i": 7, "phi_i": 12},
        rgl_cells(12, 7, 12),
        colours=("R", "G", "B"),
        keeps=True,
    ),
    "Klems": Format(
        "WINDOW XML",
        ".xml",
        EVERY,
        {"basis": "full"},
        FULL,
        {"basis": "quarter"},
        QUARTER,
        colours=RELATIVE_XYZ,
    ),
    "tree": Format(
        "WINDOW XML",
        ".xml",
        EVERY,
        {"tree": 3, "resolution": 32},
        tree_cells(32, oriented=False),
        {"tree": 4, "resolution": 16},
        tree_cells(16, oriented=True),
        colours=RELATIVE_XYZ,
    ),
    "Zemax": Format(
        "Zemax",
        ".bsdf",
        ("colour", "gray"),
        {"step": 5.0},
        cells_of("specular", degrees(10.0, 5.0, 10.0, 0.0), 3),
        {"step": 10.0},
        cells_of("specular", degrees(20.0, 10.0, 20.0, 40.0), 4),
        colours=XYZ,
    ),
    "ASTM": Format(
        "ASTM",
        ".astm",
        EVERY,
        {"resolution": (18, 18, 36)},
        cells_of("relative", degrees(5.0, 5.0, 10.0, 0.0), 3),
        {"resolution": (9, 9, 18)},
        cells_of("angles", degrees(10.0, 10.0, 20.0, 20.0), 4),
    ),
    "BiRD": Format(
        "BiRD",
        ".brdf",
        ("spectrum", "gray"),
        {"resolution": (17, 17, 24)},
        cells_of("relative", degrees(5.0, 5.0, 15.0, 0.0), 3),
        {"resolution": (9, 9, 12, 12)},
        cells_of("angles", degrees(10.0, 10.0, 30.0, 30.0), 4),
    ),
    "netCDF": own_layout("netCDF", ".nc"),
    "Zarr": own_layout("Zarr", ".zip"),
}


# Files, and what they are held to.

REFUSED = {("Klems", "MERL"): "anisotropic.*symmetrize", ("MERL", "BiRD"): "expected a wavelength for each"}
"""Formats that cannot hold what another's files are, and what the error says."""
PAIRS = [(a, b) for a in FORMATS for b in FORMATS if a != b]
BY_COMMAND = set(zip(FORMATS, [*FORMATS][1:] + [*FORMATS][:1], strict=True))
"""Pairs that are converted on the command line, the ring that runs where `full` is left out: each format once from,
once to. The way back, of two of them by default, and the others, by `gn.convert`."""
COUNT = 1000
STEEP = 0.3
"""Cosine from which on directions are compared."""
TOLERANCE = 3e-4
"""Of albedos."""
LIT = direction(np.radians(30.0), 0.4)


class Held(NamedTuple):
    """A file that was made, and the report of that."""

    m: Any
    report: dict[str, Any]


def kind_of(a: str, b: str) -> str:
    """What both formats hold: colours, else a spectrum, else one channel."""
    return next(kind for kind in EVERY if kind in FORMATS[a].holds and kind in FORMATS[b].holds)


def converted(m: Any, to: str, path: Any, by_command: bool = False) -> Held:
    made = FORMATS[to]
    options = made.options if made.oriented is None or m.is_isotropic() else made.oriented
    if not by_command:
        found = gn.convert(m, path, made.name, **options)
        return Held(found.made, found.to_json())
    texts = [f"{k}={','.join(map(str, v)) if isinstance(v, tuple) else v}" for k, v in options.items()]
    words = [m.path, path, "--format", made.name, "--json", *(w for text in texts for w in ("--option", text))]
    result = CliRunner().invoke(cli, ["convert", *map(str, words)])
    if isinstance(result.exception, gn.Error):
        raise result.exception
    assert result.exit_code == 0, result.output
    return Held(gn.load(path), json.loads(result.stdout))


@pytest.fixture(scope="module", autouse=True)
def _quick_reports():
    """Reports compare few albedos, roughly: whether they are right is said in `test_conversion.py`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "ALONG", 3)
        patch.setattr(comparison, "TOLERANCES", (1e-2, 1e-2))
        yield


@pytest.fixture
def no_albedos(monkeypatch):
    """Reports compare none: files are held to their albedo here."""
    monkeypatch.setattr(comparison, "_albedo_change", lambda *_: (0.0, (0.0, 0.0)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("round_trips")


@pytest.fixture(scope="module")
def first(folder):
    """The file of a format that the material is written to, once for each kind of channels."""
    return cache(lambda a, kind: converted(SOURCES[kind], a, folder / f"{a}-{kind}{FORMATS[a].suffix}"))


WI, WO = lattice_pairs(COUNT, STEEP)


def change(m: Any, to: str) -> tuple[np.ndarray, Any]:
    """What writing a material in a format may change: f at the pairs, and the albedo."""
    cells = FORMATS[to].cells if m.is_isotropic() else FORMATS[to].oriented_cells
    return cells.change(m, WI, WO), cells.change_of_albedo(m)


def relative(before: Any, after: Any, allowed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """|f after - f before|/f before (COUNT, C), and what was allowed of it; 0 where that is not known."""
    true, found, allowed = np.broadcast_arrays(seen(before, WI, WO), seen(after, WI, WO), allowed)
    known = np.isfinite(allowed)
    assert np.isfinite(found).all() and known.mean() > 0.4
    return tuple(np.where(known, np.abs(x), 0.0) / true for x in (found - true, allowed))


def check_values(before: Any, after: Any, *changes: tuple[np.ndarray, Any]) -> None:
    """Each channel of a file, and its albedo, is that of another but for the changes that were allowed."""
    off, bound = relative(before, after, sum(f for f, _ in changes))
    assert (off.mean(axis=0) <= bound.mean(axis=0) + 1e-6).all(), (off.mean(axis=0), bound.mean(axis=0))
    rho = [albedo(m, LIT) for m in (before, after)]
    allowed = sum(of_albedo for _, of_albedo in changes) + 2.0 * TOLERANCE
    assert (np.abs(rho[1] - rho[0]) <= allowed).all(), (*rho, allowed)


def check_report(before: Any, to: str, kind: str, held: Held) -> None:
    """The report says what was changed and lost, and the file is what it is to be."""
    made, report, error = FORMATS[to], held.report, held.report["error"]
    known = XYZ if before.channel_names == RELATIVE_XYZ else before.channel_names
    colours = made.colours or known or ("R", "G", "B")
    names = NM if kind == "spectrum" else None if report["channels"][1] is None else colours
    assert held.m.provenance["format"] == made.name and report["format"] == made.name
    assert (held.m.channel_names or (("R", "G", "B") if to == "MERL" else None)) == names
    assert report["lost"].keys() <= {"formula", "data", "holes", "metadata", "provenance"}
    assert held.m.is_isotropic() == (before.is_isotropic() and to != "Klems")
    off, _ = relative(before, held.m, np.zeros(1))
    assert off.mean() <= 1.5 * error["mean"] + 1e-9 and off.max() <= 1.5 * error["largest"] + 1e-9
    assert 0.0 <= error["mean"] <= error["largest"] and error["high"] <= error["largest"]
    assert math.isfinite(error["albedo"])
    if isinstance(before, Measured):
        source = before.provenance["sha256"]
        if made.keeps:
            assert held.m.provenance["converted_from"]["sha256"] == source
        else:
            assert before.provenance["file"] in report["lost"]["provenance"]
            assert source[:12] in report["lost"]["provenance"]


def there_and_back(a: str, b: str, kind: str, first: Any, folder: Any, back_too: bool) -> None:
    start = first(a, kind).m
    there = converted(start, b, folder / f"there{FORMATS[b].suffix}", (a, b) in BY_COMMAND)
    check_report(start, b, kind, there)
    on_the_way = change(start, b)
    check_values(start, there.m, on_the_way)
    if (b, a) in REFUSED or not back_too:
        return
    back = converted(there.m, a, folder / f"back{FORMATS[a].suffix}")
    check_report(there.m, a, kind, back)
    on_the_way_back = change(there.m, a)
    check_values(there.m, back.m, on_the_way_back)
    check_values(start, back.m, on_the_way, on_the_way_back)
    if FORMATS[a].keeps and FORMATS[b].keeps:
        chain = back.m.provenance["converted_from"]["converted_from"]
        assert chain["sha256"] == start.provenance["sha256"]


WHOLE = pytest.mark.slow_because("whole tables are made for two formats, written and compared")


HELD = [(a, kind) for a in FORMATS for kind in FORMATS[a].holds]
SOME_HELD = {(a, kind_of(a, b)) for a, b in BY_COMMAND} | {("RGL", "spectrum"), ("Klems", "gray")}
"""What the ring begins with, and some other kinds."""


@pytest.mark.usefixtures("no_albedos")
@pytest.mark.parametrize(("a", "kind"), thinned(HELD, SOME_HELD))
def test_a_file_holds_the_material(a, kind, first):
    held, m = first(a, kind), SOURCES[kind]
    check_report(m, a, kind, held)
    check_values(m, held.m, change(m, a))


BOTH_WAYS = [(a, b) for a, b in PAIRS if (a, b) not in REFUSED]
ALSO_BACK = [("Zemax", "ASTM"), ("netCDF", "Zarr")]
"""Of the ring, what is converted back where `full` is left out."""


@pytest.mark.usefixtures("no_albedos")
@pytest.mark.parametrize(("a", "b"), [pair for pair in BOTH_WAYS if pair in BY_COMMAND and pair not in ALSO_BACK])
def test_there(a, b, first, folder):
    """The rest of the ring."""
    there_and_back(a, b, kind_of(a, b), first, folder, back_too=False)


@WHOLE
@pytest.mark.parametrize(("a", "b"), thinned(BOTH_WAYS, ALSO_BACK))
def test_there_and_back(a, b, first, folder):
    there_and_back(a, b, kind_of(a, b), first, folder, back_too=True)


ORIENTED = [a for a in FORMATS if FORMATS[a].oriented is not None]


ORIENTED_PAIRS = [*zip(ORIENTED, ORIENTED[1:] + ORIENTED[:1], strict=True)]


SOME_ORIENTED = [("tree", "Zemax"), ("ASTM", "BiRD")]


@pytest.mark.usefixtures("no_albedos")
@pytest.mark.parametrize(("a", "b"), SOME_ORIENTED)
def test_there_of_what_has_a_direction(a, b, first, folder):
    there_and_back(a, b, "brushed", first, folder, back_too=False)


@WHOLE
@pytest.mark.full
@pytest.mark.parametrize(("a", "b"), ORIENTED_PAIRS)
def test_there_and_back_of_what_has_a_direction(a, b, first, folder):
    there_and_back(a, b, "brushed", first, folder, back_too=True)


@pytest.mark.parametrize(("a", "b"), REFUSED)
def test_what_cannot_be_held_is_refused(a, b, first, folder):
    path = folder / f"refused{FORMATS[b].suffix}"
    with pytest.raises(ParameterError, match=REFUSED[a, b]):
        converted(first(a, "colour").m, b, path)
    assert not path.exists()
