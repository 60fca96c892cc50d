"""Measured reflectances and their file formats, one file each: `load` recognizes a file by its content.

A format's module has NAME, SUFFIXES, DESCRIPTION, `matches(head, size)`, `read(path)` and, where it can be written,
`write(m, path)`. Their other parameters are options, declared in the signature (see `_options`). ORACLE says what the
format was checked against. A format that is read and written has LAYOUT, the axes of its tables, which one walker reads
and writes, or NO_LAYOUT, in a line why none fits (see `_layout`). GRAMMAR says what is in a file, as Markdown, where no
other text does. SHARED_SUFFIX = True: a suffix is another format's too, and saving needs `format`. A format
whose files are folders has `matches_folder(path)` and `target(path)` (see `files`). TRANSMITS = True: it can hold
transmission, or reflection of both sides (see `_sides`). FLUORESCES = True: it holds light that leaves at another
wavelength than it arrived at, which others lose. A module is found by being in this folder. A format whose
files can have any names of columns has `readable(head)`, whether a file may be one, and `refusal(path)`, why it is none
or None; its options choose it where no other format has them.

No file is claimed by two formats: a `matches` whose marks also occur in another format's files rejects those
(`material_json`, `xarray_netcdf`). A damaged or contrived file with the marks of several formats goes to the first
module by name (tests/formats/test_contract.py).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Collection, Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

from .. import files
from ..base import provenance
from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..base.reradiation import exchanges
from ..declared import discover
from ..declared.arguments import Declared, checked
from ..declared.contents import Contents, Folder
from ..errors import FluorescenceWarning, FormatError, NotFoundError, ParameterError, TooLargeError, warn
from ..formula import tree
from ..formula.state import freeze
from ..models.sheet import Sheet
from ..pictures.image import SUFFIXES as PICTURES
from . import _options, _sides, _suspected
from ._reading import pipes, plain_text, strangers

HEAD = 4096
"""Number of a file's first bytes that `matches` gets; text in UTF-16, or with a byte order mark, as plain UTF-8."""

DEMANDED = ("NAME", "SUFFIXES", "DESCRIPTION", "ORACLE", "matches", "read")


@cache
def formats() -> list[ModuleType]:
    """The modules of all file formats. Raises ParameterError where one lacks what every format needs."""
    modules = discover.modules(__name__)
    for module in modules:
        if missing := [name for name in DEMANDED if not hasattr(module, name)]:
            raise ParameterError(f"{module.__file__}: a format without {', '.join(missing)}; define them in the module")
    return modules


def contents() -> Contents[ModuleType]:
    """Name -> module, for `gn.formats()`."""
    return Contents({module.NAME: module for module in formats()})


sys.modules[__name__].__class__ = Folder


@checked
def load(path: str | os.PathLike, **options: Any) -> Reflectance:
    """The reflectance in a file, recognized by content and not by name.

    `options` are those of the format: `gonio formats NAME` lists them. A measurement knows its `provenance`. A pipe
    (`/dev/stdin` too) is read to its end, up to 4 GiB, into a temporary file.
    Raises NotFoundError for a missing file, a device, and a pipe that nobody writes to, FormatError for an unknown
    format and a damaged file, ParameterError for unknown options and values out of their bounds, TooLargeError for
    content that does not fit into memory.

    Example
    >>> gn.save(gn.Lambertian([0.6, 0.1, 0.05]), "red.json")
    >>> print(gn.load("red.json"))
    Lambertian(rho=[0.6, 0.1, 0.05])
    """
    return _loaded(path, options, lambda module: _options.checked(module, "read", options))


def load_as_typed(path: str | os.PathLike, texts: Sequence[str]) -> Reflectance:
    """The same with options typed as "name=value" on the command line."""
    return _loaded(path, _options.names_in(texts), lambda module: _options.of_texts(module, "read", texts))


def _loaded(
    path: str | os.PathLike, names: Collection[str], options_of: Callable[[ModuleType], dict[str, Any]]
) -> Reflectance:
    """What the format that has options of these names reads, with its options."""
    path = pipes.named(path)
    with pipes.readable(path) as source:
        module = recognized(source, names)
        options = options_of(module)
        try:
            m = module.read(source, **options)
        except TooLargeError:
            raise
        except MemoryError:
            raise TooLargeError(
                f"{path}: a {module.NAME} file that takes more memory than there is; split it up"
            ) from None
        facts = provenance.of_file(source, module.NAME, options) if isinstance(m, (Measured, Sheet)) else {}

        def known(part: Measured) -> Measured:
            part = provenance.noted(part, facts)
            part = part if source == path else tree.with_notes(part, path=str(path))
            freeze(vars(part))
            _suspected.warn_of(part, path, "missing" in options)
            return part

        return _sides.with_notes(m, known)


def recognized(path: Path, options: Collection[str] = ()) -> ModuleType:
    """The module whose format a file or a folder has; of text that the named `options` describe, one that has these."""
    return _of_folder(path) if path.is_dir() else _of_file(path, options)


def _of_file(path: Path, options: Collection[str]) -> ModuleType:
    """The module whose format a file's content is, or the one for text that has the `options`."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(4 * HEAD)  # as many characters in UTF-32
    except OSError as error:
        raise NotFoundError(f"{path}: cannot be read: {error.strerror}") from None
    head, size = plain_text.head(head, size, HEAD)
    claiming = next((module for module in formats() if module.matches(head, size)), None)
    if claiming is not None and {*options} <= {*_options.options(claiming.read)}:
        return claiming
    tables = [module for module in formats() if hasattr(module, "readable") and module.readable(head)]
    for module in tables:
        if options and {*options} <= {*_options.options(module.read)}:
            return module
    if claiming is not None:
        return claiming
    reason = strangers.described(head, size)
    for module in () if reason else tables:
        if (refusal := module.refusal(path)) is None:
            return module
        reason += f"read as {module.NAME}: {refusal.removeprefix(str(path)).lstrip(' :,')}; "
    reason = reason or f"starts with {head[:16]!r}, {size} bytes"
    names = "; ".join(f"{m.NAME} ({', '.join(m.SUFFIXES)})" for m in formats())
    raise FormatError(f"{path}: not a known format: {reason.removesuffix('; ')}; known formats: {names}")


def _of_folder(path: Path) -> ModuleType:
    for module in formats():
        if hasattr(module, "matches_folder") and module.matches_folder(path):
            return module
    raise FormatError(f"{path}: a folder of no known format, expected a file, or a folder that gonio.save wrote")


FormatName = Annotated[str, Declared("the format, where the suffix does not say which")]


@checked
def save(m: Reflectance, path: str | os.PathLike, format: FormatName | None = None, **options: Any) -> None:
    """Write a reflectance to a file; the format is that of the suffix, or the one named.

    `options` are those of the format: `gonio formats NAME` lists them. A failed or interrupted write leaves an existing
    file as it was. Raises ParameterError for a suffix of no format, or of several, without `format`, for unknown
    options and values out of their bounds, for a material that the format cannot hold, and for a `path` that may not be
    replaced; WriteError where the system refuses, as on a full disk. A FluorescenceWarning says how much light is lost
    where the material fluoresces and the format holds no matrix.

    Example
    >>> gn.save(gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1)), "paint.json")
    >>> print(gn.load("paint.json").terms[0])
    Lambertian(rho=0.2)
    """
    module = writer(path, format)
    write(m, path, module, options)
    if exchanges(m) and not getattr(module, "FLUORESCES", False):
        from ..integrals.photons import exchanged_in_words  # late: few materials fluoresce

        able = " or ".join(x.NAME for x in formats() if getattr(x, "FLUORESCES", False))
        text = f"{path}: {module.NAME} holds no light that leaves at another wavelength than it arrived at, and of"
        warn(f"{text} {m!r:.60} that is lost: {exchanged_in_words(m)}; expected {able}", FluorescenceWarning)


def write(m: Reflectance, path: str | os.PathLike, module: ModuleType, options: dict[str, Any]) -> None:
    """`save` in the format of a module, without a word about what it loses."""
    options = _options.checked(module, "write", options)
    _sides.refuse(m, module, formats())
    target(module, path)  # before any computation
    try:
        module.write(m, Path(path), **options)
    except TooLargeError:
        raise
    except MemoryError:
        raise TooLargeError(f"{path}: {module.NAME} takes more memory than there is; ask for fewer nodes") from None


def target(module: ModuleType, path: str | os.PathLike) -> Path:
    """The place of a format's file, or folder, of this name. Raises the errors of `files.target`."""
    return getattr(module, "target", files.target)(Path(path))


def writer(path: str | os.PathLike, format: str | None = None) -> ModuleType:
    """The module that writes the format of that name, or of the suffix of `path`, where only one has it.

    A name may be in any case, or be a suffix without its dot. Raises ParameterError where no format, or several, fit.
    """
    writers = [m for m in formats() if hasattr(m, "write")]
    word = None if format is None else str(format).lower().removeprefix(".")
    suffix = Path(path).suffix.lower() if word is None else f".{word}"
    fitting = [w for w in writers if suffix in w.SUFFIXES]
    choices = [w for w in writers if w.NAME.lower() == word]
    choices = choices or [w for w in fitting if not getattr(w, "SHARED_SUFFIX", False)]
    if len(choices) == 1:
        return choices[0]
    if format is not None:
        raise ParameterError(f"format={format!r}: expected one of {', '.join(repr(w.NAME) for w in writers)}")
    if suffix in PICTURES:
        raise ParameterError(f"{path}: {suffix} is a picture, no reflectance; write gn.render(m, lights).save(path)")
    names = ", ".join(f"{w.NAME!r} ({' '.join(w.SUFFIXES)})" for w in fitting or writers)
    fault = "is that of several formats" if len(fitting) > 1 else "does not say which format"
    raise ParameterError(f"{path}: the suffix {suffix!r} {fault}; give format= (on the command line --format) {names}")
