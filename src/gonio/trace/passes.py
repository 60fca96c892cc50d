"""The passes over a graph before it is compiled: each gives an equal graph that takes fewer operations.

GONIO_PASSES=off leaves formulas as they were written, to find out whether a pass is to blame for a number.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence

from ..errors import ParameterError
from .choices import fewer_choices
from .fractions import fewer_operations
from .graph import Graph


def wanted() -> bool:
    """Whether graphs are rewritten. Raises ParameterError for another GONIO_PASSES than off."""
    asked = os.environ.get("GONIO_PASSES", "")
    if asked not in ("", "off"):
        raise ParameterError(f"GONIO_PASSES={asked!r}: expected off, which compiles formulas as written; or unset it")
    return not asked


def rewritten(graph: Graph, outputs: Sequence[int], dtype: str, fixed: Collection[int] = ()) -> tuple[Graph, list[int]]:
    """The graph after all passes, and its outputs.

    `fixed`: the numbers of arrays whose entries are the same along the inner axis.
    """
    if not wanted():
        return graph, list(outputs)
    return fewer_operations(*fewer_choices(graph, outputs), dtype, fixed)
