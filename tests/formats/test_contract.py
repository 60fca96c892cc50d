"""One contract: what holds of a file of every format, and of the measurement that is read from it.

Damaged files are those of `test_fuzz.py`, options of `test_options.py`, written files of `test_round_trips.py`.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from format_cases import grid, rows
from frozen import assert_frozen, used
from fuzzing import outcome
from places import REAL
from seeds import SEEDS

import gonio as gn
from gonio.base.measured import Measured
from gonio.errors import FormatError
from gonio.formats import HEAD, formats
from gonio.formats.merl import MERL
from gonio.formula.fields import table

READ_BY = {"MCD43A1": "netCDF"}
"""Seeds that another format reads: MCD43A1 in netCDF-4 is told from gonio's own layout by names deep in the file."""
ELSEWHERE = {".exr", ".fit", ".npz", ".tsv", ".yml"}
"""Real files that are no measured reflectances: maps, parameters, refractive indices, lists."""


def claims(head: bytes, size: int) -> list[str]:
    return [m.NAME for m in formats() if m.matches(head[:HEAD], size)]


def test_modules_say_what_every_format_needs() -> None:
    """Texts, and suffixes with their dots; `write` says which reflectances fit."""
    for module in formats():
        assert module.NAME and module.DESCRIPTION and module.ORACLE
        assert type(module.SUFFIXES) is tuple and all(suffix.startswith(".") for suffix in module.SUFFIXES), module
        assert not hasattr(module, "write") or "m" in module.write.__annotations__, module


IN_MEMORY: dict[str, Callable[[], Measured]] = {
    "grid": lambda: grid("angles", (3, 4, 5)),
    "rows": lambda: rows(),
    "tabulated": lambda: gn.tables.tabulate(gn.Lambertian([0.1, 0.2, 0.3]), resolution=(4, 4, 4)),
}


def check(m: gn.Reflectance) -> None:
    """`values` are NumPy's, read-only and of the shape of `valid`; a variable of `data` has no other numbers."""
    assert isinstance(m, Measured)
    assert type(m.values) is np.ndarray and not m.values.flags.writeable
    assert m.values.dtype.kind in "iuf" and m.values.shape == m.valid.shape
    numbers = [x.values for x in m.data.data_vars.values() if x.dtype.kind in "iuf"]
    assert any(np.shares_memory(x, m.values) or _are_among(x[~np.isnan(x)], m.values) for x in numbers)
    assert m.data.attrs["quantity"] == m.quantity


def _are_among(numbers: np.ndarray, values: np.ndarray) -> bool:
    return numbers.size > 0 and bool(np.isin(numbers, values).all())


@pytest.mark.filterwarnings("ignore::gonio.errors.MeaningWarning")  # numbers made up for reading alone
@pytest.mark.usefixtures("uncompiled", "one_probe")  # compiling takes longer than all else, and makes no tables
@pytest.mark.parametrize("name", SEEDS)
def test_a_file_of_every_format(tmp_path: Path, name: str) -> None:
    """One format claims it; it can be read and evaluated in bounded memory, and nobody can write to what was read."""
    content = SEEDS[name]()
    (claim,) = claims(content, len(content))
    assert READ_BY.get(name) == claim or name.startswith(claim)
    (tmp_path / "file").write_bytes(content)
    if name == "MERL":  # whose seed is the beginning of one
        with (tmp_path / "file").open("wb") as file:
            file.write(content[:12])
            np.full(3 * 90 * 90 * 180, 0.5).tofile(file)
    else:
        assert outcome(content, tmp_path / "seed", evaluate=True) == "read"
    m = gn.load(tmp_path / "file")
    if m._has_text:  # a formula with parameters, which holds no measurement
        assert not isinstance(m, Measured)
    else:
        check(m)
    assert_frozen(used(m))
    if name != "MERL":
        assert_frozen(pickle.loads(pickle.dumps(m)))


@pytest.mark.parametrize("make", IN_MEMORY.values(), ids=IN_MEMORY)
def test_values_in_memory(make: Callable[[], Measured]) -> None:
    check(make())


def test_values_of_a_large_table_are_no_copy() -> None:
    m = MERL(np.linspace(0.0, 1.0, 3 * 90 * 90 * 180).reshape(3, 90, 90, 180))
    check(m)
    assert m.values is m.raw and np.shares_memory(m.values, m.data["raw"].values)


def test_a_class_that_says_nothing_has_its_first_table() -> None:
    class _Plain(Measured):
        rho = table("albedo, by wavelength")
        wavelengths = table("wavelengths [nm]")

        @property
        def valid(self):
            return np.isfinite(self.rho)

        def formula(self, wi, wo):
            return 0.0 * wi.z

    m = _Plain(rho=[0.1, 0.2], wavelengths=[400.0, 500.0])
    check(m)
    assert m.values is m.rho and m.data["wavelengths"].values.tolist() == [400.0, 500.0]


# Claims.


def test_one_format_claims_a_real_file():
    files = [path for path in sorted(REAL.rglob("*")) if path.is_file()]
    if not files:
        pytest.skip("no ../shared/data: real files are not part of the repository")
    for path in files:
        with path.open("rb") as file:
            found = claims(file.read(HEAD), path.stat().st_size)
        expected = 0 if path.suffix in ELSEWHERE or path.stem == "README" else 1
        expected = 1 if path.stem == "BiSpectral" else expected
        assert len(found) == expected, f"{path}: {found}"


@pytest.mark.parametrize(
    ("head", "name"),
    [
        (b'{"type": "Lambertian", "rho": 0.5}', "gonio JSON"),
        (b'{"rho": 0.5, "type": "Lambertian"}', "gonio JSON"),
        (b'{"metadata": {"type": "BRDF"}, "data": {}}', "BiRD"),
        (b'{"type": "mine", "data": {"theta_i": {}, "theta_r": {}}}', "BiRD"),
        (b'{"metadata": {"type": "BRDF", "openMaterial3dVersion": "1.1.0"}, "brdf": {}}', "OpenMATERIAL"),
        (b'{"metadata": {"name": "BRDF"}, "brdf": {"type": "table", "lookupTable": []}}', "OpenMATERIAL"),
        (b"\x89HDF\r\n\x1a\n" + bytes(99), "netCDF"),
        (b"\x89HDF\r\n\x1a\n" + b"keras".center(99, b"\0"), "Neural-BRDF"),
        (b"CDF\x01" + bytes(40), "netCDF"),
        (b"\x0e\x03\x13\x01" + bytes(40), "MCD43A1"),
    ],
)
def test_marks_in_files_of_two_formats(head, name):
    assert claims(head, len(head)) == [name]


def test_of_several_claims_the_first_by_name_counts(tmp_path):
    data = b"VERSION 0.2\nDATA_TYPE brdf\n#DIM 3 1\n"
    assert claims(data, len(data)) == ["ALTA", "SSDD"]
    (tmp_path / "file").write_bytes(data)
    with pytest.raises(FormatError, match="#DIM"):
        gn.load(tmp_path / "file")
