"""Which format says that a file is its own: at most one, of every minimal file and of the real ones."""

from __future__ import annotations

import pytest
from places import REAL
from seeds import SEEDS

import gonio as gn
from gonio.errors import FormatError
from gonio.formats import HEAD, formats

READ_BY = {"MCD43A1": "netCDF"}
"""Seeds that another format reads: MCD43A1 in netCDF-4 is told from gonio's own layout by names deep in the file."""
ELSEWHERE = {".exr", ".fit", ".npz", ".tsv", ".yml"}
"""Real files that are no measured reflectances: maps, parameters, refractive indices, lists."""


def claims(head: bytes, size: int) -> list[str]:
    return [m.NAME for m in formats() if m.matches(head[:HEAD], size)]


@pytest.mark.parametrize("name", SEEDS)
def test_one_format_claims_a_seed(name):
    data = SEEDS[name]()
    (claim,) = claims(data, len(data))
    assert READ_BY.get(name) == claim or name.startswith(claim)


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
