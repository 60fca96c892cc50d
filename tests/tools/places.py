"""Where the tests find the repository, the package, and files of real measurements."""

from pathlib import Path

import pytest

import gonio

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = Path(gonio.__file__).resolve().parent
REAL = ROOT.parent / "shared" / "data"
"""Files with licences of their own; tests that need them skip themselves where the folder is missing."""


def real(name: str) -> Path:
    """A real file; the test skips itself where it is not here."""
    if not (REAL / name).exists():
        pytest.skip(f"{name} is not in ../shared/data: real files are not part of the repository")
    return REAL / name
