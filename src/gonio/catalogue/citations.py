"""Citations: BibTeX for the sources of a material, of its pieces and of its numbers.

The "Source" part of a class's docstring names its papers ("Walter et al. 2007"), and so does the source of a built-in
material; `data/references.bib` has an entry for each under the same words (`cited = {...}`). A source without entry is
quoted as it is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from importlib import resources
from types import ModuleType
from typing import Any

from ..base.measured import Measured
from ..base.provenance import formats_read
from ..base.reflectance import Reflectance
from ..base.sums import Scaled, Sum
from ..declared.discover import docstring
from ..errors import NotFoundError, ParameterError, shown
from ..formats import formats
from ..formula.fields import CLASSES
from ..formula.parametrised import Parametrised
from . import builtin


def cite(m: Any) -> str:
    """BibTeX entries for all sources of a material, and for gonio, with comments that name the user of each source.

    `m` is a material, a piece of one such as a light or a distribution, the name of a built-in material, or the name of
    a class ("GGX"). Raises NotFoundError for an unknown name.

    Example
    >>> print(gn.cite("GGX").splitlines()[0])
    % GGX
    """
    uses: dict[str, list[str]] = {}  # entry or text -> names of its users
    for name, source in _named(m):
        entries = [entry for phrase, entry in _entries().items() if phrase in source]
        for entry in entries or [_without_entry(name, source)]:
            users = uses.setdefault(entry, [])
            if name not in users:
                users.append(name)
    parts = [f"% {', '.join(users)}\n{text}" for text, users in uses.items()]
    return "\n\n".join([*parts, _gonio()])


def _named(m: Any) -> Iterator[tuple[str, str]]:
    if isinstance(m, str):
        if m in CLASSES:
            yield m, _source(CLASSES[m])
            return
        entry = builtin.find(m)
        if entry is None:
            raise NotFoundError(f"no built-in material {m!r:.60} and no model of this name{builtin.hint(m)}")
        yield from _sources(builtin.material(m))
    elif isinstance(m, Parametrised):
        yield from _sources(m)
    else:
        raise ParameterError(f"cite({shown(m)}): expected a material, or the name of one")


def _sources(m: Parametrised) -> Iterator[tuple[str, str]]:
    """Names and sources of a material's numbers and of its classes, part by part."""
    if isinstance(m, Reflectance) and m._numbers_from:
        yield f"numbers of {type(m).__name__}", m._numbers_from
    if not isinstance(m, (Sum, Scaled)):
        yield type(m).__name__, next((s for kind in type(m).__mro__ if (s := _source(kind))), "")
    if isinstance(m, Measured) and m.provenance:
        for module in formats():
            if module.NAME in formats_read(m.provenance) and _source(module):
                yield f"{module.NAME} files", _source(module)
    for name in m.fields:
        value = getattr(m, name)
        if isinstance(value, Parametrised):
            yield from _sources(value)


def _source(kind: type | ModuleType) -> str:
    """The "Source" part of the docstring of a class, or of a file format's module, on one line."""
    label = re.search(r"^Source {2,}(.*?)(?=\n *\n|\n\S|\Z)", docstring(kind), re.MULTILINE | re.DOTALL)
    return " ".join(label[1].split()) if label else ""


def _without_entry(name: str, source: str) -> str:
    doi = re.search(r"doi: ?(10\.\d+/[^\s,;()]+)", source)
    if doi:
        return f"@misc{{{name.lower()},\n  note = {{{source}}},\n  doi = {{{doi[1].rstrip('.')}}}\n}}"
    return f"% {source or 'no source is given'}"


@cache
def _entries() -> dict[str, str]:
    """Phrase -> BibTeX entry."""
    text = (resources.files("gonio") / "data" / "references.bib").read_text(encoding="utf-8")
    entries = {}
    for entry in text.strip().split("\n\n"):
        match = re.search(r",\n  cited = \{(.*)\}", entry)
        if match:
            entries[match[1]] = entry.replace(match[0], "")
    return entries


def _gonio() -> str:
    from ..declared.version import __version__

    return (
        "% the software\n@software{gonio,\n  author = {{The gonio developers}},\n"
        f"  title = {{gonio: {{BRDFs}}, measured and modelled}},\n  version = {{{__version__}}}\n}}"
    )
