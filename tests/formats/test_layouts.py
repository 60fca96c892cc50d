"""Layouts: which formats have one, that each is its own inverse, and a format that is added by one."""

from __future__ import annotations

from itertools import product
from types import ModuleType

import numpy as np
import pytest
from format_cases import grid

import gonio as gn
from gonio.errors import FormatError, ParameterError
from gonio.formats import formats
from gonio.formats._layout import CHANNEL, HALVED, FileAxis, Layout
from gonio.tables.angle_systems import ANGLES, SYSTEMS
from gonio.tables.rows import ROW_ANGLES


def layouts() -> dict[str, Layout]:
    """Format, and a word for its kind -> layout."""
    found = {}
    for module in formats():
        layout = getattr(module, "LAYOUT", {})
        several = {"": layout} if isinstance(layout, Layout) else layout
        found |= {f"{module.NAME} {word}".strip(): layout for word, layout in several.items()}
    return found


CONVENTIONS = {
    f"azimuths of sign {sign:g}, from {shift:g}{', around' * around}": Layout(
        "angles",
        {
            "in": FileAxis("theta_i"),
            "az": FileAxis("phi", shift, sign, around=around),
            "c": CHANNEL,
            "out": FileAxis("theta_o"),
        },
    )
    for sign, shift, around in product((1.0, -1.0), (0.0, 90.0, 180.0, -90.0), (False, True))
}
GRIDS = {name: x for name, x in layouts().items() if any(axis.name == "channel" for axis in x.axes.values())}
ROWS = {name: x for name, x in layouts().items() if name not in GRIDS}
GRIDS |= CONVENTIONS


def test_what_is_read_and_written_has_a_layout_or_says_why_not():
    for module in formats():
        layout, reason = hasattr(module, "LAYOUT"), getattr(module, "NO_LAYOUT", None)
        assert layout + (reason is not None) == hasattr(module, "write"), module.NAME
        assert reason is None or (10 < len(reason) < 100 and "\n" not in reason), module.NAME
    assert all(isinstance(layout, Layout) for layout in layouts().values())


@pytest.mark.parametrize("name", [*GRIDS, *ROWS])
def test_a_layout_is_whole(name):
    """Its words are known ones, and a file has each angle once."""
    layout = (GRIDS | ROWS)[name]
    assert layout.system in SYSTEMS
    for oriented in (False, True):
        named = [axis.name for axis in layout.of(oriented).values()]
        assert {*named} <= {*ANGLES, CHANNEL.name} and len({*named}) == len(named)
    known = [{*SYSTEMS[layout.system].axes(oriented)} for oriented in (False, True)]
    if name in ROWS:  # a grid says so by CHANNEL
        assert {*named} <= {*ROW_ANGLES} and layout.unit in ("deg", "rad")
    else:
        assert any(names <= {*named} for names in known) and layout.unit == "deg"


def nodes_of(axis: FileAxis, half: bool) -> np.ndarray:
    """Uneven nodes of gonio's axis [rad]."""
    if ANGLES[axis.name].highest is not None:
        return np.radians([0.0, 12.5, 40.0, 71.0])
    return np.radians([0.0, 30.5, 77.0, 180.0] if half else [10.0, 95.5, 200.0, 280.0])


@pytest.mark.parametrize("kind", ["isotropic", "mirrored", "turned"])
@pytest.mark.parametrize("name", GRIDS)
def test_what_a_layout_writes_it_reads(name, kind):
    layout, turned, half = GRIDS[name], kind == "turned", kind == "mirrored"
    names = [axis.name for axis in layout.of(turned).values()]
    grid = SYSTEMS[layout.system].axes(turned)
    if not {*grid} <= {*names}:
        with pytest.raises(ParameterError, match="tables have the angles"):  # of isotropic ones alone
            layout.grid(turned)
        return
    axes = {axis.name: nodes_of(axis, half and axis.name in HALVED) for axis in layout.grid(turned).values()}
    values = np.random.default_rng(5).random((4,) * len(axes) + (3,))
    angles, stored = layout.written(axes, values, half)
    assert stored.ndim == len(layout.axes)
    assert all(np.diff(x).min() > 0.0 for x in angles.values() if len(x) > 1), "rising, as files have them"
    back, again, mirrored = layout.read(angles, stored, half, turned)
    assert mirrored == half and list(back) == list(axes) == list(grid)
    at = []
    for name, x in back.items():  # azimuths may be full turns further on
        period = 2.0 * np.pi if ANGLES[name].highest is None else 10.0
        order = np.argsort(np.mod(x + 1e-9, period))
        np.testing.assert_allclose(np.mod(x[order] + 1e-9, period) - 1e-9, axes[name], atol=1e-12)
        at.append(order)
    np.testing.assert_array_equal(again[np.ix_(*at, range(3))], values)


@pytest.mark.parametrize("name", ROWS)
def test_columns_are_the_pairs_that_they_were(name):
    layout = ROWS[name]
    named = [axis.name for axis in layout.axes.values()]
    pairs = np.radians(np.random.default_rng(5).uniform(0.0, 90.0, (7, 4)).round(3))
    pairs[:, [k for k, angle in enumerate(ROW_ANGLES) if angle not in named]] = 0.0
    columns = layout.columns(pairs)
    assert columns.shape == (7, len(layout.axes))
    assert (columns.max() > 2.0) == (layout.unit == "deg")
    np.testing.assert_array_equal(layout.pairs(columns), pairs)


TINY = """
import math
from ..base.reflectance import Reflectance
from ..tables.gridded import Gridded
from ._layout import CHANNEL, FileAxis, Layout
from ._optical.angle_tables import GridRequest, Step, tabulated
from ._reading import plain_text

NAME, SUFFIXES, DESCRIPTION, ORACLE = "tiny", (".tiny",), "made up", "nothing"
LAYOUT = Layout("angles", {
    "turn": FileAxis("phi", 180.0, around=True, usual=lambda usual: usual.circle),
    "in": FileAxis("theta_i", usual=lambda usual: usual.theta_i),
    "channel": CHANNEL,
    "out": FileAxis("theta_o", usual=lambda usual: usual.theta_o),
})

def matches(head, size):
    return head.startswith(b"TINY")

def read(path) -> Gridded:
    lines = plain_text.read(path)
    lines.take("TINY")
    angles = {word: lines.floats(lines.take(word)) for word in LAYOUT.axes if word != "channel"}
    shape = (len(angles["turn"]), len(angles["in"]), 1, len(angles["out"]))
    rows = lines.rows(shape[3], math.prod(shape[:3]))
    axes, f, mirrored = LAYOUT.read(angles, rows.reshape(shape), angles["turn"][-1] <= 180.0)
    return Gridded(LAYOUT.system, axes, f[..., 0], mirrored=mirrored, path=str(path))

def write(m: Reflectance, path, step: Step = None) -> None:
    angles, values = LAYOUT.written(*tabulated(LAYOUT, m, GridRequest({}, step, None)))
    rows = [*angles.values(), *values.reshape(-1, values.shape[3])]
    plain_text.write(path, ["TINY\\n"], [list(row) for row in rows])
"""


@pytest.fixture
def tiny():
    module = ModuleType("gonio.formats.tiny")
    module.__package__ = "gonio.formats"
    exec(compile(TINY, "tiny.py", "exec"), vars(module))
    formats().append(module)
    yield module
    formats().remove(module)


def test_a_format_is_added_by_a_layout(tiny, tmp_path):
    m, path = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.4), 0.5), tmp_path / "a.tiny"
    gn.save(m, path, step=15.0)
    back = gn.load(path)
    assert path.read_text().splitlines()[1].startswith("0 30 60 ")
    wi, wo = back.directions()
    up = wo[..., 2] > 1e-6
    np.testing.assert_allclose(back.brdf()[up], m.f(wi[up], wo[up]), rtol=1e-12)
    gn.save(back, tmp_path / "b.tiny")
    assert (tmp_path / "b.tiny").read_bytes() == path.read_bytes()
    half = grid("angles", (2, 3, 4), mirrored=True)
    gn.save(half, path)
    assert gn.load(path).is_mirrored and gn.load(path).axes["phi"].tolist() == half.axes["phi"].tolist()
    np.testing.assert_array_equal(gn.load(path).stored, half.stored)
    with pytest.raises(ParameterError, match="anisotropic"):
        gn.save(gn.Microfacet(gn.GGX(0.1, 0.4)), path)


def test_without_its_module_the_format_is_unknown(tmp_path):
    (tmp_path / "a.tiny").write_text("TINY\n0\n0\n0\n1\n")
    with pytest.raises(FormatError, match="known format"):
        gn.load(tmp_path / "a.tiny")
