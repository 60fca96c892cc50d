"""CuPy, which is as NumPy."""

from __future__ import annotations

from ..interface import Library

LIBRARY = Library("cupy")
