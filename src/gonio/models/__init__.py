"""The models of reflectance, one file each: every public class in this folder's files is found and exported.

`gn.models()` lists them, and those of your own.
"""

from __future__ import annotations

import sys

from ..base.reflectance import Reflectance
from ..base.sums import Scaled, Sum
from ..base.under_light import UnderLight
from ..declared.contents import Contents, Folder
from ..formula.json_form import names


def contents() -> Contents[type[Reflectance]]:
    """Name -> class."""
    operators = (Scaled, Sum, UnderLight)
    return Contents({n: k for n, k in names().items() if issubclass(k, Reflectance) and k not in operators})


sys.modules[__name__].__class__ = Folder
