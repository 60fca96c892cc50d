"""Binary files of databases: each is claimed by one format, and files that are missing are said to be."""

from __future__ import annotations

from pathlib import Path

import pytest
from binary_files import curet_table, lambertian_table, layered, ngan, polarized
from format_cases import claimed, file_of

from gonio.errors import Error, NotFoundError
from gonio.formats import kaist, scatfun
from gonio.formats._reading import tensor_file

# All.


def test_no_other_format_claims_them(tmp_path):
    files = {
        "SCATFUN": layered({(0.5, -0.5): [1.0]}),
        "CSAIL": b"".join(a.tobytes() for a in ngan()),
        "CUReT": curet_table(lambertian_table()),
        "KAIST": tensor_file.serialize(polarized(counts=(2, 2, 3), wavelengths=(550,))),
    }
    for name, data in files.items():
        assert claimed(file_of(tmp_path, data)) == [name]


def test_missing_files():
    for module in (scatfun, kaist):
        with pytest.raises(NotFoundError):
            module.read(Path("/nowhere/at/all"))
    assert issubclass(NotFoundError, Error)
