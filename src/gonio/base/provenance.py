"""Where a measurement is from: what `load` notes of a file, and what writers note of what they convert."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..version import __version__
from .measured import Measured
from .reflectance import Reflectance

ORIGIN = "converted_from"
"""Under this name a reader leaves in `about` what a writer kept of `origin`."""


HASHED = 1 << 28
"""Up to so many bytes (256 MB) a file's SHA-256 is noted: of larger ones that takes seconds."""


def noted(m: Measured, path: Path, format: str, options: Mapping[str, Any]) -> Measured:
    """A measurement that was just read from a file, or from a folder, which has no SHA-256, with its provenance."""
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
        found[ORIGIN] = m.about[ORIGIN]
    return m.with_notes(provenance=found, about={name: x for name, x in m.about.items() if name != ORIGIN})


def origin(m: Reflectance) -> dict[str, Any]:
    """What a writer keeps, as JSON data where the format has room for it: what was converted, by which version."""
    known = dict(m.provenance) if isinstance(m, Measured) else {}
    if "file" not in known:
        known["material"] = f"{m!r:.1000}"
    return {**known, "converted_by": f"gonio {__version__}"}


def derived(*of: Reflectance) -> dict[str, Any]:
    """The provenance of what is made in memory of measurements: where these were read from, under `ORIGIN`.

    One that was made in memory itself passes on its own.
    """
    found = [
        m.provenance if "file" in m.provenance else m.provenance[ORIGIN]
        for m in of
        if isinstance(m, Measured) and m.provenance
    ]
    return {ORIGIN: found[0] if len(of) == 1 else found} if found else {}


def in_words(held: Any) -> str:
    """The file of a provenance, or what it was made of, for people."""
    if isinstance(held, list):
        return " and ".join(map(in_words, held))
    if not isinstance(held, Mapping):
        return f"{held!s:.80}"
    if "file" in held:
        return f"{held['file']}, sha256 {held['sha256'][:12]}..." if "sha256" in held else str(held["file"])
    return f"made of {in_words(held[ORIGIN])}" if ORIGIN in held else str(held.get("material", "of unknown origin"))


def formats_read(held: Any) -> list[str]:
    """The formats of the files that a provenance names first: of the measurement, or of those it was made of."""
    if isinstance(held, list):
        return [name for of in held for name in formats_read(of)]
    if not isinstance(held, Mapping):
        return []
    return [str(held["format"])] if "format" in held else formats_read(held.get(ORIGIN))


def _plain(value: Any) -> bool:
    return value is None or isinstance(value, (bool, int, float, str))
