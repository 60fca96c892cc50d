"""CSV tables of measurements: gonio's own, also what a spreadsheet exports with these column names.

Lines `# key: value`, then a line of column names, then rows of numbers; separated by commas, semicolons (then a comma
may be the decimal point), tabs or blanks. Columns, in any order and case:

    theta_i, phi_i, theta_o, phi_o    directions; phi = phi_o - phi_i in place of both azimuths, or neither
    theta_h, theta_d, phi_d, phi_h    half and difference angles (phi_d: of wi); phi_h of anisotropic materials only
    theta_i, radial, azimuth, phi_i   wo about the mirror direction, see `angle_systems`
    f or brdf; f_cos or dsf (f cos(theta_o)); f_cos_i (f cos(theta_i)); brf (pi f)
                                      values; with several channels one column each: f_R, f_450nm
    u_f, u_f_R, ...                   standard uncertainty of the values, in the same quantity
    wavelength                        [nm]: rows then hold one channel each

Angles are degrees, or what `# angle_unit: rad` says. Empty cells and nan are values that are not there. Rows that are
all nodes of a grid, each once, become a `Gridded`, others `Scattered`. Options of these are `# mirrored`, `# outside`,
`# interpolation`, `# period_phi_d` (degrees; of any azimuth), `# isotropic`, `# phi_i`; other keys are kept.
Checked against its own generator only, as it is defined here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..base.angles import angles
from ..base.reflectance import Reflectance
from ..errors import FormatError, ParameterError
from ..files import replacing
from ..tables.angle_systems import PARAMETERISATIONS
from ..tables.gridded import Gridded
from ..tables.scattered import Scattered
from ._reading import channel_words, plain_text
from ._rows import direction_pairs
from ._rows.pairs_of_material import pairs_of, table_of, with_others

NAME = "CSV"
SUFFIXES = (".csv",)
DESCRIPTION = "table of angles and values with named columns, gonio's own"
ORACLE = "own definition"

COLUMNS = {
    "f": "brdf",
    "brdf": "brdf",
    "f_cos": "brdf * cos(theta_o)",
    "dsf": "brdf * cos(theta_o)",
    "f_cos_i": "brdf * cos(theta_i)",
    "brf": "reflectance factor",
}
AZIMUTHS = ("phi", "phi_i", "phi_o", "phi_d", "phi_h", "azimuth")
NAMES = ("theta_i", "phi_i", "theta_o", "phi_o", "phi", "theta_h", "theta_d", "phi_d", "phi_h", "radial", "azimuth")
OPTIONS = (
    "angle_unit",
    "mirrored",
    "interpolation",
    "outside",
    "isotropic",
    "phi_i",
    *(f"period_{n}" for n in AZIMUTHS),
)

MOST = 2**16
"""Columns of a table."""

MARK = "# gonio measurement"
"""The first line of what `write` makes."""

_VALUE = re.compile(r"(u_)?(f_cos_i|f_cos|f|brdf|dsf|brf)(?:_(.+))?", re.IGNORECASE)
_KEY = re.compile(r"#\s*(\w[^:]*):\s*(.*)")


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: its first line that is no comment names such columns."""
    text = plain_text.start(head)
    if text.startswith(MARK + "\n"):
        return True
    lines = [line.strip() for line in text.split("\n")]
    first = next((line for line in lines if line and not line.startswith("#")), "")
    names = [name.strip('"').lower() for name in re.split(r"\s*[,;\t]\s*|\s+", first)]
    return {"theta_i", "theta_h"} & {*names} != set() and any(_VALUE.fullmatch(n) for n in names)


def read(path: Path, side: str = "front") -> Gridded:
    """The table in a file.

    `side`: "front", or "back" for reflection of light from below; other rows are kept to be written again, in
    `about["other_pairs"]`. Raises FormatError where the file is damaged or its columns do not fit, with the line.
    """
    lines = plain_text.read(path)
    about: dict[str, Any] = {}
    while (line := lines.take("a line of column names")).startswith("#"):
        if found := _KEY.fullmatch(line):
            about[found[1].strip()] = found[2]
    separator = next((s for s in ";\t," if s in line), None)
    names = [name.strip().strip('"') for name in line.split(separator)]
    if len(names) > MOST:
        raise FormatError(f"{path}: {len(names)} columns, expected at most {MOST}; split the table by channels")
    lines.comment = "#"
    table = _numbers(lines, separator, len(names))
    if not len(table):
        raise lines.cut_short("rows of numbers")
    given: dict[str, np.ndarray] = {}
    values: dict[tuple[str, bool, str], np.ndarray] = {}
    for k, name in enumerate(names):
        if name.lower() in (*NAMES, "wavelength"):
            if name.lower() in given:
                raise FormatError(f"{path}: column {name} twice, expected each once")
            given[name.lower()] = table[:, k]
        elif found := _VALUE.fullmatch(name):
            key = (COLUMNS[found[2].lower()], bool(found[1]), found[3] or "")
            if key in values:
                raise FormatError(f"{path}: column {name} twice, expected each once")
            values[key] = table[:, k]
        else:
            raise FormatError(
                f"{path}: column {name!r}: expected {', '.join(NAMES)}, wavelength, or {', '.join(COLUMNS)}"
            )
    return _material(str(path), given, _measured(str(path), values), about, side)


def _numbers(lines: plain_text.Lines, separator: str | None, columns: int) -> np.ndarray:
    """All rows that are left; empty cells are nan."""
    if separator is not None:
        lines.edit(lambda text: _filled(text, separator))
    return lines.rows(columns)


def _filled(text: str, separator: str) -> str:
    if separator == ";":
        text = text.replace(",", ".")
    if f"{separator} " in text or " \n" in text:
        text = re.sub(rf"(?<! ) +(?=[{separator}\n])|(?<={separator}) +", "", text)
    for _ in range(2):
        text = text.replace(2 * separator, f"{separator}nan{separator}")
    text = text.replace(f"{separator}\n", f"{separator}nan\n").replace(f"\n{separator}", f"\nnan{separator}")
    return text + "nan" if text.endswith(separator) else text


def _measured(path: str, columns: Mapping[tuple[str, bool, str], np.ndarray]) -> direction_pairs.Pairs:
    """The values and uncertainties, without angles yet."""
    quantities = {quantity for quantity, _, _ in columns}
    names = [channel for _, uncertain, channel in columns if not uncertain]
    spreads = [channel for _, uncertain, channel in columns if uncertain]
    if (
        len(quantities) != 1
        or not names
        or (spreads and sorted(spreads) != sorted(names))
        or ("" in names) > (len(names) == 1)
    ):
        raise FormatError(
            f"{path}: columns of values are {names} of {sorted(quantities)}, of uncertainties {spreads}; expected one "
            f"quantity, one column or one per channel, and uncertainties of none or of all"
        )
    (quantity,) = quantities
    channels = None if names == [""] else channel_words.of_names(names)
    held = [
        np.stack([columns[quantity, u, name] for name in names], axis=1) for u in (False, True)[: 2 if spreads else 1]
    ]
    if channels is None:
        held = [v[:, 0] for v in held]
    return direction_pairs.Pairs(np.empty((len(held[0]), 0)), held[0], quantity, held[1] if spreads else None, channels)


def _material(
    path: str, given: dict[str, np.ndarray], measured: direction_pairs.Pairs, about: dict[str, Any], side: str
) -> Gridded:
    options = {key: about.pop(key) for key in OPTIONS if key in about}
    unit = options.get("angle_unit", "deg").lower()
    if unit not in ("deg", "degree", "degrees", "rad", "radian", "radians"):
        raise FormatError(f"{path}: angle_unit: {unit}, expected deg or rad")
    if "wavelength" in given:
        given, measured = _by_wavelength(path, given, measured)
    if unit.startswith("deg"):
        given = {name: np.radians(x) for name, x in given.items()}
    if not np.isfinite(np.stack([*given.values()])).all():
        raise FormatError(f"{path}: an angle is no number")
    for name, (three, four) in _SYSTEMS.items():
        names = four if set(given) == set(four) else three
        if set(given) == set(names):
            return _of_columns(path, name, {n: given[n] for n in names}, measured, about, options, side)
    known = "; ".join(", ".join(n) for names in _SYSTEMS.values() for n in names)
    raise FormatError(f"{path}: columns of angles are {', '.join(given)}, expected one of: {known}")


_SYSTEMS = {
    "angles": (("theta_i", "theta_o", "phi"), ("theta_i", "theta_o", "phi_i", "phi_o")),
    "half_difference": (("theta_h", "theta_d", "phi_d"), ("theta_h", "theta_d", "phi_d", "phi_h")),
    "specular": (("theta_i", "radial", "azimuth"), ("theta_i", "radial", "azimuth", "phi_i")),
    "in plane": (("theta_i", "theta_o"), ("theta_i", "theta_o")),
}


def _of_columns(
    path: str,
    name: str,
    columns: dict[str, np.ndarray],
    measured: direction_pairs.Pairs,
    about: dict[str, Any],
    options: Mapping[str, str],
    side: str,
) -> Gridded:
    periods = {k.removeprefix("period_"): _turn(path, k, v) for k, v in options.items() if k.startswith("period_")}
    one_azimuth = "phi_i" in columns and np.ptp(columns["phi_i"]) == 0.0 and "mirrored" not in options
    rows_only = "isotropic" in options or name == "in plane" or one_azimuth
    found = None if rows_only else direction_pairs.grid_of(columns, measured, path)
    if found is not None and all(_is_axis(n, x) for n, x in found[0].items()):
        return _on_grid(path, name, found, measured, about, options, periods)
    isotropic = len(columns) < 4 or one_azimuth
    if "isotropic" in options:
        isotropic = options["isotropic"].lower() == "true"
    if name in ("angles", "in plane"):
        theta_i, theta_o, *phi = columns.values()
        phi_i, phi_o = phi if len(phi) == 2 else (0.0 * theta_i, phi[0] if phi else 0.0 * theta_i)
    else:
        wi, wo = PARAMETERISATIONS[name].pairs(*columns.values())
        (theta_i, phi_i), (theta_o, phi_o) = angles(wi), angles(wo)
        if isotropic:
            phi_i, phi_o = 0.0 * phi_i, phi_o - phi_i
    pairs = measured._replace(angles=np.stack([theta_i, phi_i, theta_o, phi_o], axis=1))
    known = isotropic if "isotropic" in options or isotropic else None
    return direction_pairs.material(pairs, path, about, side, known, options.get("outside", "hold"))


def _on_grid(
    path: str,
    name: str,
    found: tuple[dict[str, np.ndarray], np.ndarray],
    measured: direction_pairs.Pairs,
    about: dict[str, Any],
    options: Mapping[str, str],
    periods: dict[str, float],
) -> Gridded:
    """What is not said: half a circle of phi is mirrored, half a circle of phi_d is a reciprocal table's."""
    axes, order = found
    more: dict[str, Any] = {k: options[k] for k in ("interpolation", "outside") if k in options}
    if "phi_d" in axes and "phi_d" not in periods and direction_pairs.half_circle(axes["phi_d"]):
        periods["phi_d"] = math.pi
    mirrored = "phi" in axes and direction_pairs.half_circle(axes["phi"])
    if "mirrored" in options:
        mirrored = options["mirrored"].lower() == "true"
    more |= {"mirrored": mirrored, "periods": periods or None}
    if "phi_i" in options and "phi" in axes:
        about = {**about, "phi_i": _turn(path, "phi_i", options["phi_i"])}
    try:
        return direction_pairs.gridded(name, axes, order, measured, path=path, about=about, **more)
    except ParameterError as error:
        raise FormatError(f"{path}: {error}") from None


def _turn(path: str, key: str, text: str) -> float:
    """An angle [rad] of a text in degrees."""
    try:
        return math.radians(float(text))
    except ValueError:
        raise FormatError(f"{path}: {key}: {text!r}, expected degrees") from None


def _is_axis(name: str, nodes: np.ndarray) -> bool:
    if name.startswith(("phi", "azimuth")):
        return bool(np.ptp(nodes) <= 2.0 * math.pi + 1e-6)
    return bool(nodes[0] >= 0.0 and nodes[-1] <= (math.pi if name == "radial" else direction_pairs.LEVEL))


def _by_wavelength(
    path: str, given: dict[str, np.ndarray], measured: direction_pairs.Pairs
) -> tuple[dict[str, np.ndarray], direction_pairs.Pairs]:
    """Rows of one channel each as rows of all channels; nan where a pair has none of one."""
    if measured.channels is not None:
        raise FormatError(f"{path}: a column wavelength and channels {measured.channels}, expected one of these")
    names = [name for name in given if name != "wavelength"]
    held = np.stack([given[n] for n in names], axis=1)
    columns = {"values": measured.values}
    if measured.uncertainty is not None:
        columns["uncertainty"] = measured.uncertainty
    pairs, wavelengths, wide = channel_words.by_channel(held, given["wavelength"], columns, path)
    if not np.isfinite(wavelengths).all() or len(np.unique(pairs, axis=0)) < len(pairs):
        raise FormatError(
            f"{path}: a wavelength is no number, or one of {len(pairs)} pairs has several values at one wavelength; "
            f"expected each pair once at each wavelength"
        )
    made = measured._replace(values=wide["values"], uncertainty=wide.get("uncertainty"))
    return dict(zip(names, pairs.T, strict=True)), made._replace(channels=tuple(wavelengths.tolist()))


def write(m: Reflectance, path: Path, resolution: Sequence[int] | None = None) -> None:
    """Write a measurement, grid or rows, as it is held, with its options and uncertainty; of anything else, and of
    anything if `resolution` says so (numbers of theta_i, theta_o and azimuths), f at a grid of angles.

    Angles are degrees if these read back as the same numbers, else radians. Of `about` texts and numbers are kept, as
    texts. Raises ParameterError for delta lobes, maps, and channels whose names cannot be in a column's.
    """
    table = table_of(m, resolution)
    rows = isinstance(table, Scattered) or "other_pairs" in table.about
    names, pairs, said = _of_rows(table) if rows else _of_grid(table)
    degrees = plain_text.degrees(pairs.angles)
    if not (np.radians(degrees) == pairs.angles).all():
        said, degrees = {**said, "angle_unit": "rad"}, pairs.angles
    heads = _heads(m, pairs)
    held = [degrees, pairs.columns()]
    if pairs.uncertainty is not None:
        heads += [f"u_{head}" for head in heads]
        held.append(pairs.uncertainty.reshape(len(degrees), -1))
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write(MARK + "\n")
        file.writelines(f"# {key}: {value}\n" for key, value in (_kept(table.about) | said).items())
        file.write(",".join([*names, *heads]) + "\n")
        file.writelines(plain_text.join(np.concatenate(held, axis=1), ","))


def _of_rows(m: Gridded) -> tuple[list[str], direction_pairs.Pairs, dict[str, str]]:
    """Names of the columns of angles, the rows, and the options."""
    said = {"outside": m.outside, "isotropic": str(len(m.axes) == 3).lower()}
    return ["theta_i", "phi_i", "theta_o", "phi_o"], with_others(pairs_of(m, quantities=[m.quantity]), m), said


def _of_grid(m: Gridded) -> tuple[list[str], direction_pairs.Pairs, dict[str, str]]:
    """The same, with the angles of the grid itself."""
    nodes = np.stack([x.reshape(-1) for x in np.meshgrid(*m.axes.values(), indexing="ij")], axis=1)
    values = m.stored.reshape(len(nodes), *m.stored.shape[len(m.axes) :])
    spread = None if m.uncertainty is None else m.uncertainty.reshape(values.shape)
    said = {"outside": m.outside, "interpolation": m.interpolation, "mirrored": str(m.is_mirrored).lower()}
    if isinstance(m.about.get("phi_i"), float):
        said["phi_i"] = plain_text.number(plain_text.degrees(np.array([m.about["phi_i"]]))[0])
    for name, period in m.periods.items():
        if name == "phi_d" or period != 2.0 * math.pi:
            said[f"period_{name}"] = plain_text.number(math.degrees(period))
    return [*m.axes], direction_pairs.Pairs(nodes, values, m.quantity, spread, m.channel_names), said


def _kept(about: Mapping[str, Any]) -> dict[str, str]:
    known = {k: str(v).strip() for k, v in about.items() if isinstance(v, (str, int, float)) and k not in OPTIONS}
    return {
        k: v for k, v in known.items() if _KEY.fullmatch(f"# {k}: {v}") and ":" not in k and not re.search(r"[\r\n]", v)
    }


def _heads(m: Reflectance, pairs: direction_pairs.Pairs) -> list[str]:
    base = next(name for name, quantity in COLUMNS.items() if quantity == pairs.quantity)
    if pairs.channels is None:
        return [base]
    names = [*map(channel_words.name_of, pairs.channels)]
    if any(n != n.strip() or not n or re.search(r'[,;"#\s]', n) for n in names) or len({*names}) < len(names):
        raise ParameterError(
            f"{m!r:.80}: has channels {names}, expected different names without blanks, commas and quotes"
        )
    if base == "f" and any(n.lower().startswith("cos") for n in names):
        base = "brdf"
    return [f"{base}_{n}" for n in names]
