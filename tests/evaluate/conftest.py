"""Evaluation is tested as users have it."""

import pytest


@pytest.fixture(scope="module", autouse=True)
def _as_users_have_it(optimized: None) -> None: ...
