"""A server of the explorer in a process of its own; shader source is written as users have it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from explorer_server import Explorer


@pytest.fixture(scope="module", autouse=True)
def _as_users_have_it(optimized: None) -> None: ...


@pytest.fixture(scope="module")
def explorer() -> Iterator[Explorer]:
    with Explorer("gold") as explorer:
        yield explorer
