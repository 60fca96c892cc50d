"""`values` and `data` of every measurement: what the file holds, as NumPy and as xarray."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from format_cases import grid, rows
from seeds import SEEDS

import gonio as gn
from gonio.base.measured import Measured
from gonio.formats.merl import MERL
from gonio.formula.fields import table

IN_MEMORY: dict[str, Callable[[], Measured]] = {
    "grid": lambda: grid("angles", (3, 4, 5)),
    "rows": lambda: rows(),
    "tabulated": lambda: gn.tabulate(gn.Lambertian([0.1, 0.2, 0.3]), resolution=(4, 4, 4)),
}
TOO_LARGE = ("MERL",)  # formats whose seeds are the beginning of a file


def check(m: gn.Reflectance) -> None:
    """`values` are NumPy's, read-only and of the shape of `valid`; a variable of `data` has no other numbers."""
    assert isinstance(m, Measured)
    assert type(m.values) is np.ndarray and not m.values.flags.writeable
    assert m.values.dtype.kind in "iuf" and m.values.shape == m.valid.shape
    numbers = [x.values[~np.isnan(x.values)] for x in m.data.data_vars.values() if x.dtype.kind in "iuf"]
    assert any(x.size and np.isin(x, m.values).all() for x in numbers)
    assert m.data.attrs["quantity"] == m.quantity


@pytest.mark.filterwarnings("ignore::gonio.errors.MeaningWarning")  # numbers made up for reading alone
@pytest.mark.parametrize("name", [name for name in SEEDS if name not in TOO_LARGE])
def test_values_of_every_format(tmp_path: Path, name: str) -> None:
    path = tmp_path / "file"
    path.write_bytes(SEEDS[name]())
    m = gn.load(path)
    if m.has_text:  # a formula with parameters, which holds no measurement
        assert not isinstance(m, Measured)
    else:
        check(m)


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
