"""Dask, whose arrays are computed later, in chunks: `evaluate/labelled.py` runs whole calls on these."""

from __future__ import annotations

from ..interface import Library

LIBRARY = Library("dask.array", packages=("dask",))
