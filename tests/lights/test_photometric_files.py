"""IES and EULUMDAT files: symmetries, types, TILT, and what contradicts itself."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clock import seconds

import gonio as gn
from gonio.errors import Error, FormatError, NotFoundError, ParameterError
from gonio.lights._photometry import read


def ies(first: Any, second: Any, candela: Any, kind: int = 1, tilt: str = "NONE", factor: float = 1.0) -> str:
    first, second = np.atleast_1d(first), np.atleast_1d(second)
    head = f"IESNA:LM-63-2002\n[TEST] ours\n[MANUFAC] TILTED = no\nTILT={tilt}\n"
    counts = f"1 1000 {factor} {len(first)} {len(second)} {kind} 2 0.1 0.2 0.0\n1.0 1 50\n"
    return head + counts + "\n".join(" ".join(f"{x:g}" for x in np.ravel(a)) for a in (first, second, candela)) + "\n"


def ldt(symmetry: int, planes: int, heights: int, candela: Any, flux: float = 2000.0) -> str:
    angles = np.arange(planes) * 360.0 / planes
    lines = ["ours", "1", f"{symmetry}", f"{planes}", f"{360 / planes:g}", f"{heights}", f"{180 / (heights - 1):g}"]
    lines += ["report", "lamp", "1", "lamp.ldt", "today", *["0"] * 11, "1,0", "0", "1"]
    lines += ["1", "LED", f"{flux:g}", "840", "80", "20", *["0"] * 10]
    numbers = [*angles, *np.linspace(0.0, 180.0, heights), *np.ravel(candela)]
    return "\r\n".join([*lines, *(f"{x:g}".replace(".", ",") for x in numbers)]) + "\r\n"


def lamp(tmp_path: Path, text: str, name: str = "lamp.ies", **options: Any) -> gn.GoniometricLight:
    path = tmp_path / name
    path.write_text(text, encoding="latin-1", newline="")
    return gn.GoniometricLight(str(path), position=[0.0, 0.0, 0.0], **options)


def candela(light: gn.GoniometricLight, gamma: float, C: float) -> float:
    """Intensity at angles in degrees, of a luminaire that hangs upright: irradiance at distance 1."""
    s, c = math.sin(math.radians(gamma)), math.cos(math.radians(gamma))
    at = np.array([s * math.cos(math.radians(C)), s * math.sin(math.radians(C)), -c])
    return float(light.arrival(at).irradiance[0])


def pattern(gamma: Any, C: Any) -> Any:
    """An intensity that no symmetry leaves as it is."""
    return 100.0 + gamma + 0.5 * C


def test_every_plane_is_where_its_angle_says(tmp_path):
    gamma, C = np.array([0.0, 30.0, 60.0, 180.0]), np.array([0.0, 50.0, 200.0, 360.0])
    values = pattern(gamma, C[:, None])
    values[-1] = values[0]
    light = lamp(tmp_path, ies(gamma, C, values, factor=2.0))
    for i, c in enumerate(C[:-1]):
        for j, g in enumerate(gamma[1:-1], 1):
            assert candela(light, g, c) == pytest.approx(2.0 * values[i, j], rel=1e-12)
    assert candela(light, 45.0, 25.0) == pytest.approx(2.0 * pattern(45.0, 25.0), rel=1e-12)
    assert candela(light, 30.0, 280.0) == pytest.approx(values[2, 1] + values[0, 1], rel=1e-12)


@pytest.mark.parametrize(
    ("C", "mirrored"),
    [
        ([0.0], lambda c: 0.0),
        ([0.0, 30.0, 90.0], lambda c: min(c % 180.0, 180.0 - c % 180.0)),
        ([0.0, 30.0, 100.0, 180.0], lambda c: min(c, 360.0 - c)),
        ([90.0, 120.0, 180.0, 200.0, 270.0], lambda c: 180.0 - c if c < 90.0 else 540.0 - c if c > 270.0 else c),
        ([0.0, 90.0, 180.0, 270.0], lambda c: c),
    ],
)
def test_symmetric_planes_are_mirrored(tmp_path, C, mirrored):
    gamma = np.array([0.0, 60.0, 120.0])
    light = lamp(tmp_path, ies(gamma, C, pattern(gamma, np.array(C)[:, None])))
    for c in (0.0, 10.0, 60.0, 110.0, 185.0, 255.0, 269.0):
        assert candela(light, 40.0, c) == pytest.approx(pattern(40.0, mirrored(c)), rel=1e-12)
    assert candela(light, 130.0, 10.0) == 0.0  # beyond the last angle


@pytest.mark.parametrize("symmetry", range(5))
def test_eulumdat_symmetries(tmp_path, symmetry):
    planes, heights = 8, 5
    gamma, angles = np.linspace(0.0, 180.0, heights), np.arange(planes) * 45.0
    stored = {0: angles, 1: angles[:1], 2: angles[:5], 3: angles[[6, 7, 0, 1, 2]], 4: angles[:3]}[symmetry]
    light = lamp(tmp_path, ldt(symmetry, planes, heights, pattern(gamma, stored[:, None])), "lamp.ldt")
    mirrored = {
        0: lambda c: c,
        1: lambda c: 0.0,
        2: lambda c: min(c, 360.0 - c),
        3: lambda c: c if c <= 90.0 or c >= 270.0 else (180.0 - c) % 360.0,
        4: lambda c: min(c % 180.0, 180.0 - c % 180.0),
    }[symmetry]
    for c in angles:
        assert candela(light, 70.0, c) == pytest.approx(2.0 * pattern(70.0, mirrored(c)), rel=1e-9)


def test_types_a_and_b(tmp_path):
    """Aimed at +y, up is +z: the same point by both pairs of angles."""
    vertical, horizontal = np.array([-20.0, 0.0, 40.0]), np.array([-30.0, 0.0, 60.0])
    values = 100.0 + vertical + 0.5 * horizontal[:, None]
    options = {"axis": [0.0, 1.0, 0.0], "forward": [0.0, 0.0, 1.0]}
    v, h = math.radians(20.0), math.radians(30.0)
    side = np.cross([0.0, 0.0, 1.0], [0.0, 1.0, 0.0])
    ahead, up = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    at = {
        3: math.cos(v) * (math.cos(h) * ahead + math.sin(h) * side) + math.sin(v) * up,
        2: math.cos(h) * (math.cos(v) * ahead + math.sin(v) * up) + math.sin(h) * side,
    }
    for kind, place in at.items():
        light = lamp(tmp_path, ies(vertical, horizontal, values, kind), **options)
        assert light.arrival(place).irradiance[0] == pytest.approx(135.0, rel=1e-12)
        assert light.arrival(-place).irradiance[0] == 0.0
    half = lamp(tmp_path, ies(vertical, [0.0, 60.0], values[1:], 2), **options)
    other = math.cos(h) * (math.cos(v) * ahead + math.sin(v) * up) - math.sin(h) * side
    assert half.arrival(other).irradiance[0] == pytest.approx(135.0, rel=1e-12)


def test_tilt_and_efficacy(tmp_path):
    gamma = [0.0, 90.0]
    text = ies(gamma, [0.0], [[100.0, 100.0]], tilt="INCLUDE\n1\n3\n0 45 90\n1.0 0.8 0.5")
    light = lamp(tmp_path, text)
    assert candela(light, 10.0, 0.0) == pytest.approx(100.0)
    tilted = light.replace(axis=[1.0, 0.0, -1.0])
    assert tilted.arrival([1.0, 0.0, -1.0]).irradiance[0] == pytest.approx(0.8 * 100.0 / 2.0)
    watts = light.replace(efficacy=[100.0, 200.0])
    np.testing.assert_allclose(watts.arrival([0.0, 0.0, -1.0]).irradiance, [1.0, 0.5])
    (tmp_path / "lamp.tlt").write_text("1 2 0 90 1.0 0.6")
    beside = lamp(tmp_path, ies(gamma, [0.0], [[100.0, 100.0]], tilt="lamp.tlt"))
    assert beside.replace(axis=[1.0, 0.0, 0.0], forward=[0.0, 0.0, 1.0]).arrival([1.0, 0.0, 0.0]).irradiance[
        0
    ] == pytest.approx(60.0)


def test_one_candela_to_all_sides_is_a_point_light():
    light, point = gn.GoniometricLight(position=[0.0, 1.0, 2.0]), gn.PointLight([0.0, 1.0, 2.0], 1.0)
    assert gn.irradiance(light) == pytest.approx(gn.irradiance(point), rel=1e-12)


def test_radiance_sees_the_same_light(tmp_path):
    """Its ies2rad and rtrace, which give irradiance of white light of 179 lm/W."""
    folder = Path(pytest.importorskip("pyradiance").__file__).parent
    C = np.array([0.0, 90.0, 180.0, 270.0, 360.0])
    values = 100.0 + C[:, None] + np.array([0.0, 100.0, -50.0])
    values[-1] = values[0]
    light = lamp(tmp_path, ies([0.0, 45.0, 90.0], C, values, factor=0.7), efficacy=179.0)
    places = [[1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [-1.0, 0.0, -1.5], [0.5, -1.0, -1.0]]
    seen = {"cwd": tmp_path, "env": {"RAYPATH": f"{folder / 'lib'}:."}, "capture_output": True, "check": True}
    subprocess.run([folder / "bin" / "ies2rad", "-dm", "lamp.ies"], **seen)
    scene = subprocess.run([folder / "bin" / "oconv", "lamp.rad"], **seen).stdout
    (tmp_path / "lamp.oct").write_bytes(scene)
    rays = "\n".join(" ".join(f"{x}" for x in (*at, -at[0], -at[1], -at[2])) for at in places)
    command = [folder / "bin" / "rtrace", "-h", "-I", "-ab", "0", "lamp.oct"]
    found = subprocess.run(command, input=rays.encode(), **seen).stdout.split()
    expected = gn.irradiance(light, np.array(places), -np.array(places))
    np.testing.assert_allclose(np.array(found, float)[::3], expected, rtol=2e-2)  # its lamp is 10 cm wide


@pytest.mark.parametrize("C", [[0.0], [0.0, 45.0, 90.0], [0.0, 60.0, 120.0, 180.0], [0.0, 50.0, 200.0, 360.0]])
def test_photompy_reads_the_same_intensities(tmp_path, C):
    """Version 0.3.1, at and between the angles of IES files. It mirrors rightly planes at equal steps alone, and takes
    the symmetries of EULUMDAT for others."""
    photompy = pytest.importorskip("photompy")
    rng = np.random.default_rng(1)
    values = rng.uniform(10.0, 90.0, (len(C), 4)).round(2)
    values[-1] = values[0] if C[-1] == 360.0 else values[-1]
    text = ies([0.0, 30.0, 60.0, 180.0], C, values, factor=2.0)
    light, other = lamp(tmp_path, text), photompy.IESFile.read(text.encode()).photometry.expanded()
    for gamma, c in zip(rng.uniform(0.0, 180.0, 40), rng.uniform(0.0, 360.0, 40), strict=True):
        assert candela(light, gamma, c) == pytest.approx(float(other.get_intensity(gamma, c)), rel=1e-9)


GOOD = ies([0.0, 90.0], [0.0, 90.0], [[1.0, 2.0], [3.0, 4.0]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD.replace("TILT=NONE", "TILT"), "lines; expected an IES file|no line TILT"),
        (
            GOOD.replace("1 1000 1.0 2 2", "1 1000 1.0 3 2"),
            "numbers are left for intensities, expected 6; it is cut off",
        ),
        (GOOD.replace("1 1000 1.0 2 2", "1 1000 1.0 2 1"), "more numbers than the count of angles says"),
        (
            GOOD.replace("1 1000 1.0 2 2", "1 1000 1.0 2.5 2"),
            "number of vertical angles is 2.5, expected a whole number",
        ),
        (GOOD.replace("1 1000 1.0 2 2", "1 1000 1.0 2 99999999"), "number of horizontal angles is 1e"),
        (GOOD.replace("0 90\n0 90", "90 0\n0 90"), "vertical angles do not increase"),
        (GOOD.replace("0 90\n0 90", "0 90\n0 80"), "horizontal angles run from 0 to 80; expected"),
        (GOOD.replace("0 90\n0 90", "0 190\n0 90"), "vertical angles run from 0 to 190; expected 0 to 180"),
        (GOOD.replace("1 2 3 4", "1 -2 3 4"), "an intensity is -2"),
        (GOOD.replace("1 2 3 4", "1 nan 3 4"), "NaN or infinite"),
        (GOOD.replace("1 2 3 4", "1 two 3 4"), "could not convert"),
        (GOOD.replace("TILT=NONE", "TILT=../lamp.tlt"), "expected NONE, INCLUDE, or a file of that name beside it"),
        (GOOD.replace("2 2 1 2", "2 2 7 2"), "photometric type is 7, expected a whole number from 1 to 3"),
        ("nothing", "1 lines; expected an IES file with TILT=, or at least 42 lines of EULUMDAT"),
        (ldt(2, 8, 5, np.ones((4, 5))), "are left for intensities, expected 25"),
        (ldt(2, 8, 5, np.ones((6, 5))), "5 more numbers than the count of angles says"),
        (ldt(4, 6, 5, np.ones((2, 5))), "6 C planes, expected a multiple of 4 with symmetry 4"),
        (ldt(7, 8, 5, np.ones((8, 5))), "symmetry is 7"),
        (ldt(0, 8, 5, np.ones((8, 5)), flux=0.0), "flux of the lamps, is 0"),
    ],
)
def test_files_that_contradict_themselves_are_refused(tmp_path, text, message):
    with pytest.raises((FormatError, NotFoundError), match=message):
        lamp(tmp_path, text)


def test_missing_files_and_other_arguments_are_refused(tmp_path):
    with pytest.raises(NotFoundError, match="No such file"):
        gn.GoniometricLight(str(tmp_path / "none.ies"))
    with pytest.raises(FormatError, match="is a folder"):
        gn.GoniometricLight(str(tmp_path))
    with pytest.raises(ParameterError, match=r"expected the path of an \.ies or \.ldt file"):
        gn.GoniometricLight(3.0)
    with pytest.raises(ParameterError, match="it is along the axis"):
        gn.GoniometricLight(axis=[1.0, 0.0, 0.0])


def test_broken_files_are_read_or_refused(tmp_path):
    """Bytes that are changed, cut out or doubled: a light, or an error of ours that names the file."""
    random, path = np.random.default_rng(11), tmp_path / "broken"
    good = [GOOD, ies([0, 90], [0], [[1, 2]], tilt="INCLUDE\n1\n2\n0 90\n1 0.5"), ldt(3, 8, 5, np.ones((5, 5)))]
    refused = 0
    for trial in range(600):
        data = bytearray(good[trial % 3].encode())
        for _ in range(random.integers(1, 4)):
            at, kind = int(random.integers(len(data))), random.integers(4)
            if kind == 0:
                data[at] = int(random.integers(256))
            elif kind == 1:
                del data[at : at + int(random.integers(1, 40))]
            elif kind == 2:
                data[at:at] = data[at : at + int(random.integers(1, 40))]
            else:
                data[at:at] = random.choice([b"1e999", b"-", b"9" * 30, b" nan ", b"\n", b"1e8", b"0"])
            data = data or bytearray(b"x")
        path.write_bytes(data)
        try:
            assert np.isfinite(read(str(path)).candela).all()
        except Error as error:
            refused += 1
            assert str(path) in str(error)
    assert 100 < refused < 590


@pytest.mark.parametrize("run", ["\n", " ", "\t", "1", "1\n", "\n ", "TILT", "TILT ", "TILT=\n", "IES\n", "1,", "x\n"])
def test_time_grows_with_the_length_of_a_file(tmp_path, run):
    """99 000 line ends took 107 s."""
    path = tmp_path / "long.ies"
    path.write_text("x" + run * (100_000 // len(run)) + "x", encoding="ascii")

    def refused():
        with pytest.raises((FormatError, NotFoundError)) as said:
            read(str(path))
        assert len(str(said.value)) < 500

    assert seconds(refused) < 0.5
