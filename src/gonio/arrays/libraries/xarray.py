"""xarray and pandas, whose arrays have names for their axes: `evaluate/labelled.py` takes them off and puts them back.

What takes no such arrays refuses them: see `library`.
"""

from __future__ import annotations

from ..interface import Library

LIBRARY = Library("xarray", packages=("xarray", "pandas"))
