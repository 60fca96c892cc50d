"""The file formats as a table, made from their modules, for `gonio formats` and docs/formats.md."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any, NamedTuple

from ..base.reflectance import Reflectance
from ..declared.arguments import FunctionArgument
from ..formats import formats
from ..formats._options import options


class Format(NamedTuple):
    """A file format.

    layout         what is in a file, as Markdown; "" where no other text says it
    both_sides     whether files can hold transmission, and both sides of a material
    own_kind       whether only measurements read from the format can be written
    sampled        whether measurements of the format are sampled by their own values; None: that depends on the file
    read_options   by name; `write_options` are None of formats that are not written
    """

    name: str
    suffixes: tuple[str, ...]
    shared_suffix: bool
    written: bool
    own_kind: bool
    both_sides: bool
    sampled: bool | None
    description: str
    oracle: str
    layout: str
    read_options: dict[str, FunctionArgument]
    write_options: dict[str, FunctionArgument] | None

    @property
    def access(self) -> str:
        return "read, write its own" if self.own_kind else "read, write" if self.written else "read"

    def to_json(self) -> dict[str, Any]:
        """As JSON data."""
        row = self._asdict()
        for name in ("read_options", "write_options"):
            row[name] = row[name] and {option: value.to_json() for option, value in row[name].items()}
        return row


def format_table() -> list[Format]:
    """All formats, by name."""
    return sorted(map(_row, formats()), key=lambda row: row.name.lower())


def _row(module: ModuleType) -> Format:
    written = hasattr(module, "write")
    return Format(
        module.NAME,
        tuple(module.SUFFIXES),
        getattr(module, "SHARED_SUFFIX", False),
        written,
        written and module.write.__annotations__["m"] != "Reflectance",
        getattr(module, "TRANSMITS", False),
        _sampled(module),
        module.DESCRIPTION,
        module.ORACLE,
        getattr(module, "GRAMMAR", ""),
        options(module.read),
        options(module.write) if written else None,
    )


def _sampled(module: ModuleType) -> bool | None:
    """By the classes in the annotation of `read`; a `Sheet` is sampled as its parts are."""
    returned = module.read.__annotations__.get("return", "")
    names = returned.split("|") if isinstance(returned, str) else [returned.__name__]
    names = [name.strip() for name in names if name.strip().rpartition(".")[2] != "Sheet"]
    kinds = [getattr(module, name, Reflectance) for name in names]
    return None if Reflectance in kinds else all(cls.warp is not Reflectance.warp for cls in kinds)


def sampled_in_words(row: Format) -> str:
    """The entry of the column "sampled"."""
    return {True: "yes", False: "by cosine", None: "by content"}[row.sampled]


def as_page(rows: Sequence[Format]) -> str:
    """docs/formats.md."""
    table = []
    for row in rows:
        written = "its own kind" if row.own_kind else "yes" if row.written else "no"
        suffixes, sampled = " ".join(row.suffixes), sampled_in_words(row)
        both = "yes" if row.both_sides else "no"
        table.append((row.name, suffixes, "yes", written, sampled, both, row.description, row.oracle))
    header = ("format", "suffixes", "read", "written", "sampled", "both sides", "what it is", "checked against")
    sections = [
        f"### {row.name}\n\n{row.layout}{chr(10) if row.layout else ''}{_options(row)}\n"
        for row in rows
        if row.read_options or row.write_options
    ]
    return PAGE.format(formats=_table(header, table), options="\n".join(sections))


def _options(row: Format) -> str:
    cells = [
        (to, f"`{name}`", option.expected, f"`{option.usual}`" if option.usual else "", option.declared.doc)
        for to, options in (("read", row.read_options), ("write", row.write_options or {}))
        for name, option in options.items()
    ]
    return _table(("to", "option", "value", "default", "meaning"), cells)


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


PAGE = """# File formats

`gn.load(path)` recognizes a file by its content, whatever its name. `gn.save(m, path)` takes the format of the suffix,
or `format=` where several formats share a suffix. `gn.convert(m, path)` saves, reads the file again, and reports
changes and losses, and so does `gonio convert IN OUT`. `gonio info FILE` describes a file.

*Sampled*: whether directions are drawn by the file's own values, or by the cosine. *Checked against*: independent
evidence that the reader is right, beside files that gonio's tests write themselves. *Both sides*: whether files can
hold transmission, and reflection of both sides.

`python3 dev.py docs` makes this page from the modules in `src/gonio/formats`.

{formats}

## Both sides

A file that holds more than the reflection of one side is read as that reflection alone, unless `side="both"` asks for
all: `gn.load("shade.xml", side="both")` is a `gonio.Sheet` of up to four measurements, `front`, `back`, `forward` and
`backward`, each sampled and evaluated by its own values, black where the file holds nothing (of WINDOW XML that
transmits one way the other follows by reciprocity, as in Radiance). So a program that reads reflections gets the
numbers it always got. A file of transmission alone is a `Sheet` without being asked. What is not read is kept, and
written again with the reflection.

Where a format names the side, light on the front that leaves behind is `forward`, and directions are those of the file:
polar angles up to 180 degrees. Where it names none (Zemax, Speos, SSDD, Integra), the material is the same from both
sides, and so must be what is saved. `gn.save` writes any reflectance on both sides, models too, to the formats with a
"yes" above, as up to four tables; others refuse it, for half of a material would be lost.

## Options

Options to read are keyword arguments of `gn.load`, options to write are those of `gn.save` and `gn.convert`.
Every command takes options to read as `-O NAME=VALUE`, or `-O columns.theta_i=AOI` for one entry of an object;
`gonio convert` takes options to write as `--option NAME=VALUE`, and `resolution` as `--resolution N,N` too. A list is
`1,2,3`. `gonio formats NAME` lists them in a terminal. A value of another kind or out of bounds is a
ParameterError, before anything is read or written.

`resolution` is always a count of nodes, `step` an angle in degrees.

{options}"""
