"""Provenance: the notes of `load` on the file of a measurement, and those of writers on their materials."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..declared.version import __version__
from ..formula import tree
from .measured import Measured
from .reflectance import Reflectance

ORIGIN = "converted_from"
"""The name in `about` under which readers leave the `origin` that a writer kept."""

HASHED = 1 << 28
"""The SHA-256 of files of more bytes (256 MB) is not noted: it takes seconds."""


def of_file(path: Path, format: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The provenance of what is read from a file, or from a folder, which has no SHA-256."""
    provenance: dict[str, Any] = {"file": path.name}
    if path.is_file():
        provenance["bytes"] = path.stat().st_size
        if provenance["bytes"] <= HASHED:
            with path.open("rb") as file:
                provenance["sha256"] = hashlib.file_digest(file, "sha256").hexdigest()
    provenance |= {"format": format, "gonio": __version__}
    if options:
        plain = (type(None), bool, int, float, str)
        provenance["options"] = {n: value if isinstance(value, plain) else repr(value) for n, value in options.items()}
    return provenance


def noted(m: Measured, of_file: Mapping[str, Any]) -> Measured:
    """A measurement that was just read from a file, with the provenance `of_file`."""
    provenance, about = dict(of_file), dict(m.about)
    if ORIGIN in about:
        provenance[ORIGIN] = about.pop(ORIGIN)
    return tree.with_notes(m, provenance=provenance, about=about)


def origin(m: Reflectance) -> dict[str, Any]:
    """The provenance of a file that is written, as JSON data: that of the material, and the version that converts it.

    Writers keep it where their format has room for it.
    """
    provenance = dict(m.provenance) if isinstance(m, Measured) else {}
    if "file" not in provenance:
        provenance["material"] = f"{m!r:.1000}"
    return {**provenance, "converted_by": f"gonio {__version__}"}


def derived(*of: Reflectance) -> dict[str, Any]:
    """The provenance of a measurement that is made of others in memory: the files of these, under `ORIGIN`.

    One that was made in memory itself passes on its own origin.
    """
    provenances = [m.provenance for m in of if isinstance(m, Measured) and m.provenance]
    origins = [provenance if "file" in provenance else provenance[ORIGIN] for provenance in provenances]
    return {ORIGIN: origins[0] if len(of) == 1 else origins} if origins else {}


def in_words(provenance: Any) -> str:
    """The file that a provenance names, or the origin, for people."""
    if isinstance(provenance, list):
        return " and ".join(map(in_words, provenance))
    if not isinstance(provenance, Mapping):
        return f"{provenance!s:.80}"
    if "file" in provenance:
        digest = f", sha256 {provenance['sha256'][:12]}..." if "sha256" in provenance else ""
        return f"{provenance['file']}{digest}"
    if ORIGIN in provenance:
        return f"made of {in_words(provenance[ORIGIN])}"
    return str(provenance.get("material", "of unknown origin"))


def formats_read(provenance: Any) -> list[str]:
    """The formats of the first files that a provenance names: of the measurement, or of those it was made of."""
    if isinstance(provenance, list):
        return [name for origin in provenance for name in formats_read(origin)]
    if not isinstance(provenance, Mapping):
        return []
    return [str(provenance["format"])] if "format" in provenance else formats_read(provenance.get(ORIGIN))


def size_of(path: Path) -> int:
    """Bytes of a file, or of all files in a folder."""
    return sum(p.stat().st_size for p in path.rglob("*") if p.is_file()) if path.is_dir() else path.stat().st_size
