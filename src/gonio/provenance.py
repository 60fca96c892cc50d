"""Where a measurement is from: what `load` notes of a file, and what writers note of what they convert."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .interface import Reflectance
from .measurement import Measured

ORIGIN = "converted_from"
"""Under this name a reader leaves in `about` what a writer kept of `origin`."""


HASHED = 1 << 28
"""Up to so many bytes a file's SHA-256 is noted; larger ones are mapped, and reading them whole would take seconds."""


def noted(m: Measured, path: Path, format: str, options: Mapping[str, Any]) -> None:
    """Set the provenance of a measurement that was just read from a file, or from a folder, which has no SHA-256."""
    from . import __version__

    found: dict[str, Any] = {"file": path.name}
    if path.is_file():
        found["bytes"] = path.stat().st_size
        if found["bytes"] <= HASHED:
            with path.open("rb") as file:
                found["sha256"] = hashlib.file_digest(file, "sha256").hexdigest()
    found |= {"format": format, "gonio": __version__}
    if options:
        found["options"] = {name: value if _plain(value) else repr(value) for name, value in options.items()}
    if ORIGIN in m.about:
        found[ORIGIN] = m.about.pop(ORIGIN)
    m.__dict__["provenance"] = found


def origin(m: Reflectance) -> dict[str, Any]:
    """What a writer keeps, as JSON data where the format has room for it: what was converted, by which version."""
    from . import __version__

    if isinstance(m, Measured) and m.provenance:
        return {**m.provenance, "converted_by": f"gonio {__version__}"}
    return {"material": f"{m!r:.1000}", "converted_by": f"gonio {__version__}"}


def _plain(value: Any) -> bool:
    return value is None or isinstance(value, (bool, int, float, str))
