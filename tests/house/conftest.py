"""Pages, examples and counts are looked at as users have them."""

import pytest


@pytest.fixture(scope="module", autouse=True)
def _as_users_have_it(optimized: None) -> None: ...
