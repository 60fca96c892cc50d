"""Light that pictures leave out: they follow it to the first surface, and no further."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..base.reflectance import Reflectance
from ..base.sums import lets_through
from ..errors import LeftOutWarning, warn
from ..formula.text import listed
from .scene import Scene
from .stage import Stage

FLAT = 1e-6
"""Height of a sheet over its width, up to which no part of it is behind another."""


def tell(who: str, stage: Stage, materials: Sequence[Reflectance], shown: Any) -> None:
    """Say which parts let light through that is not followed, and what becomes of it; `shown`: the scene, if it is one.

    A pane that is thin and alone leaves nothing out: light goes through it and comes from behind.
    """
    parts = shown.parts if isinstance(shown, Scene) else ()
    through = [m for m in materials if lets_through(m)]

    def named(m: Reflectance) -> str:
        numbers = [str(k) for k, part in enumerate(parts) if part.material is m]
        return f"{m!r:.60}" + (f" (part {', '.join(numbers)})" if numbers else "")

    solid = [named(m) for m in through if not _is_thin(m)]
    told = []
    if solid:
        inside = "what is behind it counts as one medium without end, whose light keeps the factor 1/n^2"
        told.append(f"light goes through one surface of {listed(solid)}, and none leaves by a second: {inside}")
    if through and not (stage.is_simple or _is_flat(stage)):
        every = listed([named(m) for m in through])
        told.append(f"what {every} lets through lights nothing: parts throw shadows as if it were opaque")
    if told:
        warn(f"{who}: {'; '.join(told)}", LeftOutWarning)


def _is_thin(m: Reflectance) -> bool:
    """Whether there is one medium on both sides of a material."""
    return isinstance(m.index, (float, np.ndarray)) and bool(np.all(m.index == 1.0))


def _is_flat(stage: Stage) -> bool:
    """Whether all that is seen is one flat sheet."""
    if stage.hulls is None or len(stage.bodies) > 1:
        return False
    points = (stage.hulls.reshape(-1, 3) - stage.middle) / stage.size
    return bool(np.linalg.svd(points, compute_uv=False)[-1] <= FLAT * len(points) ** 0.5)
