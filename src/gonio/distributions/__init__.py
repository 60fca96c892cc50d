"""Distributions of facet normals, one file each: every public class in this folder's files is found and exported.

`gn.distributions()` lists them, and those of your own.
"""

from __future__ import annotations

import sys

from ..declared.contents import Contents, Folder
from ..formula.distribution import Distribution
from ..formula.json_form import names


def contents() -> Contents[type[Distribution]]:
    """Name -> class."""
    return Contents({n: k for n, k in names().items() if issubclass(k, Distribution)})


sys.modules[__name__].__class__ = Folder
