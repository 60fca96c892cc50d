"""Lights, one file each: every public class in this folder's files is found and exported.

`gn.lights()` lists them, and those of your own.
"""

from __future__ import annotations

import sys

from ..base.light import Light
from ..declared.contents import Contents, Folder
from ..formula.json_form import names


def contents() -> Contents[type[Light]]:
    """Name -> class."""
    return Contents({n: k for n, k in names().items() if issubclass(k, Light)})


sys.modules[__name__].__class__ = Folder
