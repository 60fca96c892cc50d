"""CSV tables of measurements: gonio's own, and laboratories' exports. `LAYOUT` describes both.

Checked against its own generator only, as it is defined here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..base.angles import angles
from ..base.reflectance import Reflectance
from ..errors import Error, FormatError, MeaningWarning, ParameterError, warn
from ..tables.angle_systems import ANGLES, AZIMUTHS, SYSTEMS, AngleSystem
from ..tables.axes import INSIDE
from ..tables.gridded import Gridded
from ..tables.rows import ROW_ANGLES
from ..tables.scattered import Scattered
from ._laboratory.layout import find
from ._laboratory.meanings import Meanings, Said, stated_incidence
from ._laboratory.names import QUANTITIES
from ._laboratory.names import meaning as meaning_of
from ._laboratory.sheets import DELIMITERS, NAMED, TextSheet
from ._laboratory.suspicions import suspicions
from ._laboratory.understanding import Understood, understand
from ._options import ABOVE_ZERO, Declared
from ._reading import channel_words, plain_text
from ._rows.direction_pairs import Pairs, Side, grid_of, gridded, half_circle, material
from ._rows.pairs_of_material import Resolution, of_nodes, pairs_of, table_of, with_others

NAME = "CSV"
SUFFIXES = (".csv",)
DESCRIPTION = "table of angles and values with named columns, gonio's own"
ORACLE = "own definition"

OPTIONS = (
    "angle_unit",
    "mirrored",
    "interpolation",
    "outside",
    "isotropic",
    "phi_i",
    *(f"period_{n}" for n in AZIMUTHS),
)

LAYOUT = """\
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
that decides.
`about["columns"]`, `about["text"]` and `about["understood"]` keep what was understood.
[Your own measurement](your-own-measurement.md) shows how.
"""

MOST = 2**16
"""Largest number of columns."""

MARK = "# gonio measurement"
"""The first line of a file of `write`."""

_VALUE = re.compile(r"(u_)?(f_cos_i|f_cos|f|brdf|dsf|brf)(?:_(.+))?", re.IGNORECASE)
_KEY = re.compile(r"#\s*(\w[^:]*):\s*(.*)")


class Table(NamedTuple):
    """The content of a file; `axes` are the names of the columns of angles [rad] in `pairs`."""

    path: str
    axes: tuple[str, ...]
    pairs: Pairs
    about: dict[str, Any]
    options: dict[str, str]


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
    str | None, Declared("unit of wavelengths whose names have none; nm unless all are below 100", words=("nm", "um"))
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
    return any(system.isotropic[0] in names for system in SYSTEMS.values()) and any(_VALUE.fullmatch(n) for n in names)


def read(
    path: Path,
    side: Side = "front",
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
) -> Gridded:
    """The table in a file.

    Rows of the other side, and of transmission, stay in `about["other_pairs"]` to be written again. Raises FormatError,
    with the line, for a damaged file, columns that do not fit each other, and what has two readings; ParameterError for
    columns that are not there.
    """
    said = Said(
        columns, skip, delimiter, decimal, angle_unit, wavelength_unit, quantity, value_unit, coverage, uncertainty,
        missing, forward,
    )  # fmt: skip
    if said == Said() and plain_text.text(path).startswith(MARK + "\n"):
        return _read_own(path, side)
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


def understood(path: Path, side: Side = "front", **said: Any) -> Understood:
    """The table in a file, column by column, with the options of `read`."""
    return understand(TextSheet(path), Said(**said))


def of_table(table: Understood, path: str, side: str) -> Gridded:
    """The measurement of a laboratory's table."""
    about: dict[str, Any] = {**table.layout.notes, **described(table)}
    about["angle_unit"] = "rad" if table.in_radians else "deg"
    m = _material(path, dict(table.angles), table.values, about, side, stated_incidence(table.layout.text))
    for text in suspicions(table):
        warn(f"{path}: {text}", MeaningWarning)
    return m


def described(table: Understood) -> dict[str, Any]:
    """What `about` says of a laboratory's table: its text, its columns if they have other names, what is missing."""
    names = {column.name for column in table.columns}
    about: dict[str, Any] = {}
    if table.layout.text or table.numbers.below:
        about["text"] = [*table.layout.text, *table.numbers.below]
    if not all(name.lower() in ANGLES or _VALUE.fullmatch(name) for name in names):
        about["columns"] = {
            column.name or "(said)": f"{column.meaning} [{column.unit}]" if column.unit else column.meaning
            for column in table.columns
        }
    if table.remarks:
        about["understood"] = list(table.remarks)
    return about


def _read_own(path: Path, side: str) -> Gridded:
    """The table in a file of `write`."""
    lines = plain_text.read(path)
    about: dict[str, Any] = {}
    while (line := lines.take("a line of column names")).startswith("#"):
        if match := _KEY.fullmatch(line):
            about[match[1].strip()] = match[2]
    separator = next((s for s in ";\t," if s in line), None)
    names = [name.strip().strip('"') for name in line.split(separator)]
    if len(names) > MOST:
        raise FormatError(f"{path}: {len(names)} columns, expected at most {MOST}; split the table by channels")
    lines.comment = "#"
    if separator is not None:
        lines.edit(lambda text: _filled(text, separator))
    table = lines.rows(len(names))
    if not len(table):
        raise lines.cut_short("rows of numbers")
    key: Any
    columns: dict[Any, np.ndarray]
    angles: dict[str, np.ndarray] = {}
    values: dict[tuple[str, bool, str], np.ndarray] = {}
    for k, name in enumerate(names):
        if name.lower() in (*ANGLES, "wavelength"):
            key, columns = name.lower(), angles
        elif match := _VALUE.fullmatch(name):
            key, columns = (QUANTITIES[match[2].lower()], bool(match[1]), match[3] or ""), values
        else:
            expected = f"{', '.join(ANGLES)}, wavelength, or {', '.join(QUANTITIES)}"
            raise FormatError(f"{path}: column {name!r}: expected {expected}")
        if key in columns:
            raise FormatError(f"{path}: column {name} twice, expected each once")
        columns[key] = table[:, k]
    return _material(str(path), angles, values, about, side)


def _filled(text: str, separator: str) -> str:
    """The text with nan in its empty cells."""
    if separator == ";":
        text = text.replace(",", ".")
    if f"{separator} " in text or " \n" in text:
        text = re.sub(rf"(?<! ) +(?=[{separator}\n])|(?<={separator}) +", "", text)
    for _ in range(2):
        text = text.replace(2 * separator, f"{separator}nan{separator}")
    text = text.replace(f"{separator}\n", f"{separator}nan\n").replace(f"\n{separator}", f"\nnan{separator}")
    return text + "nan" if text.endswith(separator) else text


def _measured(path: str, angles: dict[str, np.ndarray], columns: Mapping[tuple[str, bool, str], np.ndarray]) -> Pairs:
    """The rows, with the columns of angles as they are."""
    quantities = {quantity for quantity, _, _ in columns}
    names = [channel for _, uncertain, channel in columns if not uncertain]
    spreads = [channel for _, uncertain, channel in columns if uncertain]
    one_per_channel = bool(names) and (names == [""] or "" not in names)
    if len(quantities) != 1 or not one_per_channel or (spreads and sorted(spreads) != sorted(names)):
        raise FormatError(
            f"{path}: columns of values are {names} of {sorted(quantities)}, of uncertainties {spreads}; expected one "
            f"quantity, one column or one per channel, and uncertainties of none or of all"
        )
    (quantity,) = quantities
    values = np.stack([columns[quantity, False, name] for name in names], axis=1)
    spread = np.stack([columns[quantity, True, name] for name in names], axis=1) if spreads else None
    rows = np.stack([*angles.values()], axis=1)
    if names != [""]:
        return Pairs(rows, values, quantity, spread, channel_words.of_names(names))
    return Pairs(rows, values[:, 0], quantity, None if spread is None else spread[:, 0])


def _material(
    path: str,
    angles: dict[str, np.ndarray],
    values: Mapping[tuple[str, bool, str], np.ndarray],
    about: dict[str, Any],
    side: str,
    advice: str = "",
) -> Gridded:
    options = {key: about.pop(key) for key in OPTIONS if key in about}
    unit = options.get("angle_unit", "deg").lower()
    if unit not in ("deg", "degree", "degrees", "rad", "radian", "radians"):
        raise FormatError(f"{path}: angle_unit: {unit}, expected deg or rad")
    wavelength = angles.pop("wavelength", None)
    axes = next((axes for axes in _COLUMNS if set(angles) == set(axes)), None)
    if axes is None:
        expected = "; ".join(map(", ".join, _COLUMNS))
        raise FormatError(
            f"{path}: columns of angles are {', '.join(angles) or 'missing'}, expected {expected}{advice}"
        )
    pairs = _measured(path, {name: angles[name] for name in axes}, values)
    if wavelength is not None:
        pairs = _of_all_channels(path, pairs, wavelength)
    if unit.startswith("deg"):
        pairs = pairs._replace(angles=np.radians(pairs.angles))
    if not np.isfinite(pairs.angles).all():
        raise FormatError(f"{path}: an angle is no number")
    return _of_columns(Table(path, axes, pairs, about, options), _COLUMNS[axes], side)


IN_PLANE = ("theta_i", "theta_o")
_COLUMNS = {
    **{axes: system for system in reversed(SYSTEMS.values()) for axes in (system.isotropic, system.oriented)},
    IN_PLANE: SYSTEMS["angles"],
}
"""Columns of angles -> their system, the first of `SYSTEMS` if several have them."""


def _of_columns(table: Table, system: AngleSystem, side: str) -> Gridded:
    path, names, pairs, about, options = table
    columns = dict(zip(names, pairs.angles.T, strict=True))
    periods = {k.removeprefix("period_"): _radians(path, k, v) for k, v in options.items() if k.startswith("period_")}
    one_azimuth = "phi_i" in columns and np.ptp(columns["phi_i"]) == 0.0 and "mirrored" not in options
    rows_only = "isotropic" in options or names == IN_PLANE or one_azimuth
    axes_and_order = None if rows_only else grid_of(columns, pairs, path)
    if axes_and_order and all(_is_axis(n, x) for n, x in axes_and_order[0].items()):
        return _on_grid(table, system.name, *axes_and_order, periods)
    isotropic = len(columns) < 4 or one_azimuth
    if "isotropic" in options:
        isotropic = options["isotropic"].lower() == "true"
    if system.name == "angles":
        theta_i, theta_o, *phi = columns.values()
        phi_i, phi_o = phi if len(phi) == 2 else (0.0 * theta_i, phi[0] if phi else 0.0 * theta_i)
    else:
        wi, wo = system.pairs(*columns.values())
        (theta_i, phi_i), (theta_o, phi_o) = angles(wi), angles(wo)
        if isotropic:
            phi_i, phi_o = 0.0 * phi_i, phi_o - phi_i
    pairs = pairs._replace(angles=np.stack([theta_i, phi_i, theta_o, phi_o], axis=1))
    stated = isotropic if "isotropic" in options or isotropic else None
    return material(pairs, path, about, side, stated, options.get("outside", "hold"))


def _on_grid(
    table: Table, name: str, axes: dict[str, np.ndarray], order: np.ndarray, periods: dict[str, float]
) -> Gridded:
    """The grid; by default half a circle of phi is mirrored, and half a circle of phi_d means reciprocity."""
    path, _, pairs, about, options = table
    if "phi_i" in options and "phi" in axes:
        about = {**about, "phi_i": _radians(path, "phi_i", options["phi_i"])}
    if "phi_d" in axes and "phi_d" not in periods and half_circle(axes["phi_d"]):
        periods["phi_d"] = math.pi
    mirrored = len(axes) == 3 and "phi" in axes and half_circle(axes["phi"])
    if "mirrored" in options:
        mirrored = options["mirrored"].lower() == "true"
    more: dict[str, Any] = {k: options[k] for k in ("interpolation", "outside") if k in options}
    more |= {"mirrored": mirrored, "periods": periods or None, "path": path, "about": about}
    try:
        return gridded(name, axes, order, pairs, **more)
    except ParameterError as error:
        raise FormatError(f"{path}: {error}") from None


def _radians(path: str, key: str, degrees: str) -> float:
    try:
        return math.radians(float(degrees))
    except ValueError:
        raise FormatError(f"{path}: {key}: {degrees!r}, expected degrees") from None


def _is_axis(name: str, nodes: np.ndarray) -> bool:
    highest = ANGLES[name].highest
    if highest is None:
        return bool(np.ptp(nodes) <= 2.0 * math.pi + 1e-6)
    return bool(nodes[0] >= 0.0 and nodes[-1] <= highest + INSIDE)


def _of_all_channels(path: str, pairs: Pairs, wavelength: np.ndarray) -> Pairs:
    """Rows of one channel each as rows of all channels; nan where a pair has no value in a channel."""
    if pairs.channels is not None:
        raise FormatError(f"{path}: a column wavelength and channels {pairs.channels}, expected one of these")
    pairs = pairs.by_channel(wavelength, path)
    if not np.isfinite(wavelength).all() or len(np.unique(pairs.angles, axis=0)) < len(pairs.angles):
        raise FormatError(
            f"{path}: a wavelength is no number, or one of {len(pairs.angles)} pairs has several values at one "
            f"wavelength; expected each pair once at each wavelength"
        )
    return pairs


def write(m: Reflectance, path: Path, resolution: Resolution = None) -> None:
    """Write a measurement, grid or rows, as it is, with its options and uncertainty; for others, and where `resolution`
    is given, f at a grid of angles.

    Angles are degrees if these read back as the same numbers, else radians. Texts and numbers of `about` are kept, as
    texts. Raises ParameterError for delta lobes, maps, and channels whose names do not fit into those of columns.

    Example
    >>> gn.save(gn.tabulate(gn.Lambertian(0.5), "angles", resolution=(4, 4, 6)), "white.csv")
    >>> print(gn.load("white.csv").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    table = table_of(m, resolution)
    options = {"outside": table.outside}
    if isinstance(table, Scattered) or "other_pairs" in table.about:
        axes, pairs = [*ROW_ANGLES], with_others(pairs_of(table, quantities=[table.quantity]), table)
        options["isotropic"] = str(len(table.axes) == 3).lower()
    else:
        axes, pairs = [*table.axes], of_nodes(table)
        options |= _grid_options(table)
    angles = plain_text.degrees(pairs.angles)
    if not (np.radians(angles) == pairs.angles).all():
        options["angle_unit"], angles = "rad", pairs.angles
    names = _value_names(m, pairs)
    if pairs.uncertainty is not None:
        names += [f"u_{name}" for name in names]
    lines = [MARK, *(f"# {key}: {text}" for key, text in (_texts(table.about) | options).items())]
    lines.append(",".join([*axes, *names]))
    rows = np.concatenate([angles, *pairs.numbers()[1:]], axis=1)
    plain_text.write(path, (line + "\n" for line in lines), rows, ",")


def _grid_options(m: Gridded) -> dict[str, str]:
    options = {"interpolation": m.interpolation, "mirrored": str(m.is_mirrored).lower()}
    if isinstance(m.about.get("phi_i"), float):
        options["phi_i"] = plain_text.number(plain_text.degrees(np.array([m.about["phi_i"]]))[0])
    for name, period in m.periods.items():
        if name == "phi_d" or period != 2.0 * math.pi:
            options[f"period_{name}"] = plain_text.number(math.degrees(period))
    return options


def _texts(about: Mapping[str, Any]) -> dict[str, str]:
    """The entries of `about` that are lines `# key: value`."""
    texts = {k: str(v).strip() for k, v in about.items() if isinstance(v, (str, int, float)) and k not in OPTIONS}
    return {
        k: v for k, v in texts.items() if _KEY.fullmatch(f"# {k}: {v}") and ":" not in k and not re.search(r"[\r\n]", v)
    }


def _value_names(m: Reflectance, pairs: Pairs) -> list[str]:
    base = next(name for name, quantity in QUANTITIES.items() if quantity == pairs.quantity)
    if pairs.channels is None:
        return [base]
    names = [*map(channel_words.name_of, pairs.channels)]
    if any(n != n.strip() or not n or re.search(r'[,;"#\s]', n) for n in names) or len({*names}) < len(names):
        raise ParameterError(f"{m!r:.80}: has channels {names}, expected unique names without blanks, commas, quotes")
    if base == "f" and any(n.lower().startswith("cos") for n in names):
        base = "brdf"
    return [f"{base}_{n}" for n in names]
