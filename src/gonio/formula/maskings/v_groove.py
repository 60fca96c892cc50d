"""Masking by V-shaped grooves."""

from __future__ import annotations

from typing import Any

from ...arrays import ops
from ..direction import Direction, half_and_cosine
from ..distribution import Distribution


def v_groove(d: Distribution, wi: Direction, wo: Direction, wm: Direction) -> Any:
    """V-shaped grooves: G = min(1, 2 z_m z_o/(wo . wm), 2 z_m z_i/(wo . wm)).

    Source: Torrance & Sparrow 1967; in this form Blinn 1977, "Models of light reflection".
    """
    _, cos_d = half_and_cosine(wi, wo)
    return ops.minimum(1.0, 2.0 * wm.z * ops.minimum(wi.z, wo.z) / cos_d)
