"""CSV tables of measurements: gonio's own, and laboratories' exports. `GRAMMAR` describes both.

Checked against its own generator only, as it is defined here.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from ...declared.arguments import ABOVE_ZERO, Declared
from ...errors import Error, FormatError
from ...files.cells import DELIMITERS
from ...models.sheet import Sheet
from ...tables.angle_systems import SYSTEMS
from ...tables.gridded import Gridded
from .._laboratory.layout import find
from .._laboratory.meanings import Meanings, Said
from .._laboratory.names import QUANTITIES, WAVELENGTH_UNITS
from .._laboratory.names import meaning as meaning_of
from .._laboratory.sheets import NAMED, TextSheet
from .._laboratory.understanding import Understood, understand
from .._reading import plain_text
from .._sides import Side
from .reading import of_table as of_table
from .reading import read_own
from .words import MARK as MARK
from .words import VALUE
from .writing import write as write

NAME = "CSV"
SUFFIXES = (".csv",)
DESCRIPTION = "table of angles and values with named columns, gonio's own"
ORACLE = "own definition"
NO_LAYOUT = "columns in any order, by gonio's own names: see `GRAMMAR`"
TRANSMITS = True

GRAMMAR = """\
Lines `# key: value`, then a line of column names, then rows of numbers; separated by commas, semicolons (then a comma
may be the decimal point), tabs, bars or blanks. Columns, in any order and case:

| columns | |
| --- | --- |
| `theta_i`, `phi_i`, `theta_o`, `phi_o` | directions; `phi` = phi_o - phi_i in place of both azimuths, or neither |
| `theta_h`, `theta_d`, `phi_d`, `phi_h` | half and difference angles (`phi_d`: of wi); `phi_h` if anisotropic |
| `theta_i`, `theta_o`, `phi`, `phi_i` | polar angles, phi_o - phi_i, and phi_i |
| `theta_i`, `radial`, `azimuth`, `phi_i` | wo about the mirror direction: see [conventions](conventions.md#tables) |
| `f` or `brdf`; `f_cos` or `dsf`; `f_cos_i`; `brf` | f [1/sr]; f cos(theta_o); f cos(theta_i); pi f |
| `f_R`, `dsf_450nm`, ... | the same of several channels |
| `u_f`, `u_f_R`, ... | standard uncertainty of the values, in the same quantity |
| `wavelength` | [nm]: rows then hold one channel each |

Angles are degrees, or radians with `# angle_unit: rad`; a negative polar angle leans to the other side. Empty cells and
nan are missing values. Rows that are all nodes of a grid, each once, become a `gonio.Gridded`, others a
`gonio.Scattered`. Options of these are `# mirrored`, `# outside`, `# interpolation`, `# period_phi_d` (degrees; of any
azimuth), `# isotropic`, `# phi_i`; other keys are kept in `about`. A file that `gonio.save` wrote begins with
`# gonio measurement`.

A laboratory's export may have lines about the instrument above the names and text below the table, units in the
names, `theta_i (deg)`, or in a line below them, and other names: `AOI`, `theta_r`, `SZA`, `dphi`, `BRDF [1/sr]`,
`BRDF 550 nm`, `R [%]`, `lambda (um)`, `u`, `U(k=2)`, `std. dev.`; UTF-8, UTF-16, Latin-1. A unit in a name decides the
unit; cells such as `n/a` and `-` are missing values. What is unknown or has two readings is refused, with the option
that decides; so is a number that repeats exactly and stands decades apart from all others: `missing=32767`, or
`missing=''` where it was measured.
`about["columns"]`, `about["text"]` and `about["understood"]` keep what was understood.
[Your own measurement](your-own-measurement.md) shows how.
"""

Columns = Annotated[
    dict | Sequence[str] | None,
    Declared(
        "what columns mean: a name of gonio -> the name in the file, or a number for an angle that no column "
        "has, as in "
        '{"theta_i": "in (deg)", "phi": 180, "ignore": "Temp"}; or names for all columns in their order'
    ),
]
Skip = Annotated[int | None, Declared("lines above the line of column names", 0)]
Delimiter = Annotated[str | None, Declared("what is between cells", words=(*DELIMITERS, *NAMED))]
Decimal = Annotated[str | None, Declared("decimal sign; the other one then parts thousands", words=(".", ","))]
AngleUnit = Annotated[
    str | None,
    Declared("unit of angles whose names have none; degrees unless they look like radians", words=("deg", "rad")),
]
WavelengthUnit = Annotated[
    str | None,
    Declared("unit of wavelengths whose names have none; nm unless all are below 100", words=WAVELENGTH_UNITS),
]
Quantity = Annotated[
    str | None,
    Declared(
        "what the values are, in place of what their names say",
        words=[*dict.fromkeys((*QUANTITIES, *QUANTITIES.values()))],
    ),
]
ValueUnit = Annotated[str | None, Declared("unit of values whose names have none", words=("1/sr", "1", "%"))]
Coverage = Annotated[
    float | None, Declared("coverage factor k of the uncertainties, which are divided by it", ABOVE_ZERO, 10.0)
]
Spread = Annotated[
    str | None,
    Declared("whether uncertainties are shares of the values, or of their unit", words=("relative", "absolute")),
]
Missing = Annotated[
    float | str | None, Declared("a number or words, with commas between, in cells without a value: -999,sat")
]
Forward = Annotated[
    int | None,
    Declared(
        "azimuth phi of the mirror direction [degrees]: 180 as gonio counts, or 0; without azimuths 180 has "
        "theta_o of the other sign there, 0 of the same sign as theta_i",
        words=(0, 180),
    ),
]


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: a line above numbers names an angle and values, and no column
    that is unknown."""
    text = plain_text.start(head)
    if text.startswith(MARK + "\n"):
        return True
    try:
        text = head.decode("utf-8", "ignore").replace("\r\n", "\n").replace("\r", "\n")
        sheet = TextSheet(Path("head"), text if size <= len(head) else text.rpartition("\n")[0])
        layout = find(sheet)
    except Error:
        return _names_columns(text)
    return all(meaning_of(name).key for name in layout.names if name)


def _names_columns(text: str) -> bool:
    """Whether the first line that is no comment has names of gonio's own: a longer one than the head of the file."""
    lines = [line.strip() for line in text.split("\n")]
    first = next((line for line in lines if line and not line.startswith("#")), "")
    names = [name.strip('"').lower() for name in re.split(r"\s*[,;\t]\s*|\s+", first)]
    return any(system.isotropic[0] in names for system in SYSTEMS.values()) and any(VALUE.fullmatch(n) for n in names)


def read(
    path: Path,
    side: Side = None,
    columns: Columns = None,
    skip: Skip = None,
    delimiter: Delimiter = None,
    decimal: Decimal = None,
    angle_unit: AngleUnit = None,
    wavelength_unit: WavelengthUnit = None,
    quantity: Quantity = None,
    value_unit: ValueUnit = None,
    coverage: Coverage = None,
    uncertainty: Spread = None,
    missing: Missing = None,
    forward: Forward = None,
) -> Gridded | Sheet:
    """The table in a file.

    Rows of the other side, and of transmission, stay in `about["other_pairs"]` to be written again, unless they are
    read too, as a `Sheet`. Raises FormatError, with the line, for a damaged file, columns that do not fit each other,
    and what has two readings; ParameterError for columns that are not there.
    """
    said = Said(
        columns, skip, delimiter, decimal, angle_unit, wavelength_unit, quantity, value_unit, coverage, uncertainty,
        missing, forward,
    )  # fmt: skip
    if said == Said() and plain_text.text(path).startswith(MARK + "\n"):
        return read_own(path, side)
    return of_table(understand(TextSheet(path), said), str(path), side)


def readable(head: bytes) -> bool:
    """Whether a file that starts so is text, but no JSON or XML: it may be a table whose names are unknown."""
    return b"\0" not in head and not head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"{", b"[", b"<"))


def refusal(path: Path) -> str | None:
    """Why the names of a text file are no table's, with the option that helps; None for a table."""
    try:
        Meanings(TextSheet(path), Said())
    except FormatError as error:
        return str(error)
    return None


def understood(path: Path, side: Side = None, **said: Any) -> Understood:
    """The table in a file, column by column, with the options of `read`."""
    return understand(TextSheet(path), Said(**said))
