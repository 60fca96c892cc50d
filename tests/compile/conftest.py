"""The compiler is tested as users have it: with kernels that are made to run fast."""

from collections.abc import Iterator

import pytest
from libraries import optimising


@pytest.fixture(scope="module", autouse=True)
def _optimised() -> Iterator[None]:
    with optimising():
        yield
