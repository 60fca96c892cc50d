"""Maskings, a function each, in a file of its name: the share of facets wm that is both lit from wi and seen from wo.

A masking takes (distribution, wi, wo, wm) and gives G in [0, 1]; models name it by a word. It is found by being here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...declared import discover

MASKINGS: dict[str, Callable[..., Any]] = discover.functions(__name__)
"""Name -> function."""
