"""What can be said of materials, models and formats, as data: no markup, nothing printed."""

from __future__ import annotations

import math
from typing import Any


def finite(data: Any) -> Any:
    """Facts as JSON holds them: null for NaN and infinity, which JSON lacks; keys are text."""
    if isinstance(data, dict):
        return {str(k): finite(v) for k, v in data.items()}
    if isinstance(data, (list, tuple)):
        return [finite(v) for v in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
