"""BiRD's universal BRDF files (EMPIR 16NRM08, BiRD_view): metadata, and columns of angles and BRDF, as JSON.

`metadata` says what was measured and how; `data` holds objects with a unit and a list of values for each of theta_i,
phi_i, theta_r, phi_r [deg or rad], BRDF [1/sr], and optionally wavelength_i [nm or um], polarization_i, uBRDF. The
project's earlier files have `data.variables`, names and units, and `data.values`, rows; both are read. Uncertainties
are taken for standard ones, which the schema leaves open. Azimuths are those of the directions to the lamp and to the
detector, counted from one mark on the sample. Checked against the project's schema and its short example, and against
files written here.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError
from ..tables.gridded import Gridded
from . import _layout, open_material
from ._reading import channel_words, json_text
from ._rows.direction_pairs import LEVEL, Pairs, material, upright
from ._rows.pairs_of_material import COARSE, CoarseResolution, pairs_of

NAME = "BiRD"
SUFFIXES = (".brdf", ".json")
SHARED_SUFFIX = True
DESCRIPTION = "EMPIR BiRD's universal BRDF file: rows with uncertainty, wavelength and polarization, JSON"
ORACLE = "published schema and example; own generator"

SCHEMA = "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/brdf_json_schema_v1.0.json"
LAYOUT = _layout.columns("theta_i", "phi_i", "theta_r", "phi_r")
ANGLES = tuple(LAYOUT.axes)
COLUMNS = (*ANGLES, "BRDF", "uBRDF", "wavelength_i", "polarization_i")
UNITS = {
    **{f"angle {u}": np.pi / 180.0 for u in ("°", "deg", "degree", "degrees")},
    "angle rad": 1.0,
    **{f"brdf {u}": 1.0 for u in ("1/sr", "sr^-1", "sr-1", "sr⁻¹")},
    "wavelength nm": 1.0,
    **{f"wavelength {u}": 1e3 for u in ("μm", "µm", "um")},
}
STATES = {(1.0, 1.0, 0.0, 0.0): "s", (1.0, -1.0, 0.0, 0.0): "p", (1.0, 0.0, 0.0, 0.0): "u"}


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: JSON with BiRD's names, and not OpenMATERIAL's."""
    text = head.lstrip()
    if not text.startswith(b"{") or open_material.matches(head, size):
        return False
    return (b'"metadata"' in text and b"BRDF" in text) or (b'"theta_r"' in text and b'"theta_i"' in text)


def read(
    path: Path,
    polarization: Annotated[
        str | None,
        Declared(
            "rows to read: s, p, u, or a Stokes vector of the file; by default those of unpolarized light, else the "
            "mean of s and p, which is the same, else the only ones"
        ),
    ] = None,
) -> Gridded:
    """The measurement in a file.

    Raises FormatError where the file is damaged, ParameterError where it has no rows of this polarization.
    """
    document = json_text.read(path)
    where = str(path)
    columns, other = _columns(json_text.member(document, "data", dict, where), where)
    states = columns.pop("polarization_i", None)
    angles = upright(np.stack([columns[name] for name in ANGLES], axis=1), f"{where}, data", LEVEL)
    columns |= dict(zip(ANGLES, angles.T, strict=True))
    about = {"metadata": document.get("metadata", {}), "data": other}
    columns = _of_polarization(columns, states, polarization, about, where)
    angles = np.stack([columns[name] for name in ANGLES], axis=1)
    pairs = Pairs(angles, columns["BRDF"], uncertainty=columns.get("uBRDF"))
    if "wavelength_i" in columns:
        pairs = pairs.by_channel(columns["wavelength_i"], where)
    return material(pairs, where, about)


def _columns(data: dict[str, Any], where: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The columns of `COLUMNS` in gonio's units, and the other content of `data`."""
    if "variables" in data:
        data = _of_rows(data, where)
    if missing := [name for name in (*ANGLES, "BRDF") if name not in data]:
        raise FormatError(f"{where}: data has no {', '.join(missing)}; expected {', '.join((*ANGLES, 'BRDF'))}")
    columns, other = {}, {name: value for name, value in data.items() if name not in COLUMNS}
    for name in COLUMNS:
        if name in data:
            column = json_text.member(data, name, dict, f"{where}, data")
            columns[name] = _column(name, column, f"{where}, data.{name}")
            used = ("values", "unit", "notation") if name in ANGLES else ("values", "unit", "notation", "uncertainty")
            if rest := {k: v for k, v in column.items() if k not in used}:
                other[name] = rest
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1 or not lengths["BRDF"]:
        raise FormatError(f"{where}: columns have {lengths} values, expected the same number, at least one")
    if (uncertainty := _uncertainty(columns, data, where)) is not None:
        columns["uBRDF"] = uncertainty
    return columns, other


def _of_rows(data: dict[str, Any], where: str) -> dict[str, Any]:
    """The columns of the earlier layout: `variables` names them, `values` holds rows."""
    variables = json_text.member(data, "variables", list, f"{where}, data")
    rows = json_text.member(data, "values", list, f"{where}, data")
    if not all(isinstance(v, dict) and isinstance(v.get("name"), str) for v in variables):
        raise FormatError(f"{where}: data.variables, expected objects with a name")
    for at, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != len(variables):
            raise FormatError(f"{where}: data.values, row {at + 1}: expected {len(variables)} values: {row!r:.60}")
    columns = {v["name"]: {**v, "values": [row[k] for row in rows]} for k, v in enumerate(variables)}
    return columns | {k: v for k, v in data.items() if k not in ("variables", "values")}


def _column(name: str, column: dict[str, Any], where: str) -> np.ndarray:
    values = json_text.member(column, "values", list, where)
    if name == "polarization_i":
        return np.array([_state(v, where) for v in values])
    kind = "angle" if name in ANGLES else name.rpartition("_")[0] if name.startswith("wave") else "brdf"
    unit, numbers = column.get("unit"), json_text.numbers(values, where)
    if numbers.ndim != 1:
        raise FormatError(f"{where}: expected a list of numbers, got lists in it")
    if name == "uBRDF" and unit == "%":
        return numbers  # of BRDF, see `_uncertainty`
    factor = UNITS.get(f"{kind} {unit}")
    if factor is None:
        expected = ", ".join(u.partition(" ")[2] for u in UNITS if u.startswith(kind))
        raise FormatError(f"{where}: unit {unit!r}, expected one of {expected}")
    return np.radians(numbers) if kind == "angle" and factor != 1.0 else numbers * factor


def _state(value: Any, where: str) -> str:
    """s, p, u, or the numbers of the Stokes vector."""
    if isinstance(value, str):
        return value.strip().lower()
    stokes = json_text.numbers(value, where)
    if stokes.shape != (4,):
        raise FormatError(f"{where}: {value!r:.40}, expected s, p, u, or a Stokes vector of four numbers")
    return STATES.get(tuple(stokes.tolist()), str(stokes.tolist()))


def _uncertainty(columns: dict[str, np.ndarray], data: dict[str, Any], where: str) -> np.ndarray | None:
    """uBRDF in 1/sr: the column of that name, else the one number for all values, else None."""
    column, f = columns.get("uBRDF"), np.abs(columns["BRDF"])
    if column is not None:
        return column * 0.01 * f if data["uBRDF"].get("unit") == "%" else column
    where += ", data.BRDF.uncertainty"
    single = data["BRDF"].get("uncertainty")
    if single is None:
        return None
    if not isinstance(single, dict):
        raise FormatError(f"{where} is {single!r:.40}, expected an object with value and unit")
    value, unit = json_text.numbers(single.get("value"), where), single.get("unit")
    if value.shape != (1,) or (unit != "%" and f"brdf {unit}" not in UNITS):
        raise FormatError(f"{where} is {single!r:.60}, expected a value in 1/sr, sr^-1 or %")
    return value * (0.01 * f if unit == "%" else np.ones_like(f))


def _of_polarization(
    columns: dict[str, np.ndarray], states: np.ndarray | None, asked: str | None, about: dict[str, Any], where: str
) -> dict[str, np.ndarray]:
    """The rows of one state of polarization, which `about` then names."""
    if states is None:
        if asked is not None:
            raise ParameterError(f"polarization={asked!r}: {where} does not say how its light was polarized")
        return columns
    kinds = sorted(set(states.tolist()))
    if asked is None:
        asked = kinds[0] if len(kinds) == 1 else "u" if "u" in kinds else "mean of s and p"
    about["polarization_i"] = asked
    rows = {state: {name: column[states == state] for name, column in columns.items()} for state in kinds}
    if asked == "mean of s and p" and {"s", "p"} <= rows.keys():
        return _mean(rows["s"], rows["p"], where)
    if asked not in kinds:
        raise ParameterError(f"polarization={asked!r}: {where} holds {', '.join(kinds)}; give one of these")
    return rows[asked]


def _mean(s: dict[str, np.ndarray], p: dict[str, np.ndarray], where: str) -> dict[str, np.ndarray]:
    """f of unpolarized light: the mean of rows for s and p that agree in everything else."""
    keys = [name for name in s if name not in ("BRDF", "uBRDF")]
    order_s, order_p = (np.lexsort([rows[name] for name in reversed(keys)]) for rows in (s, p))
    if len(order_s) != len(order_p) or not all(np.array_equal(s[n][order_s], p[n][order_p]) for n in keys):
        raise ParameterError(f"{where}: rows for s and p have different directions; give polarization='s' or 'p'")
    partner = order_p[np.argsort(order_s)]
    mean = {**s, "BRDF": 0.5 * (s["BRDF"] + p["BRDF"][partner])}
    if "uBRDF" in s:
        mean["uBRDF"] = 0.5 * np.hypot(s["uBRDF"], p["uBRDF"][partner])
    return mean


def write(
    m: Reflectance,
    path: Path,
    metadata: Annotated[
        dict | None,
        Declared("added to that of the measurement; a valid file needs id, timestamp, provenance, sample ..."),
    ] = None,
    wavelengths: channel_words.Wavelengths = None,
    resolution: CoarseResolution = None,
) -> None:
    """Write a row for every pair (and wavelength) of a measurement, for others for those of a grid of angles.

    Rows without a value are left out. Raises ParameterError for several channels without wavelengths, delta lobes and
    maps.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.brdf", format="BiRD", resolution=(4, 4, 6))
    >>> print(gn.load("white.brdf").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    pairs = pairs_of(m, resolution, nodes=COARSE, as_held=True)
    f, about = pairs.columns(), getattr(m, "about", {})
    finite = np.isfinite(f)
    row, channel = np.nonzero(finite)
    # Entries of another format may have the same names.
    other, head = (x if isinstance(x := about.get(name), dict) else {} for name in ("data", "metadata"))
    data: dict[str, Any] = {}
    if f.shape[1] > 1 or wavelengths is not None or m.channel_names:
        nm = np.array(channel_words.wavelengths_of(m, wavelengths, f.shape[1]))
        data["wavelength_i"] = {"unit": "nm", "values": nm[channel].tolist()}
    if about.get("polarization_i") in ("s", "p", "u"):
        data["polarization_i"] = {"notation": "sp", "values": [about["polarization_i"]] * len(row)}
    for name, column in zip(ANGLES, LAYOUT.columns(pairs.angles).T, strict=True):
        data[name] = {"unit": LAYOUT.unit, "values": column[row].tolist()}
    data["BRDF"] = {"unit": "sr^-1", "values": f[finite].tolist()}
    if pairs.uncertainty is not None:
        data["uBRDF"] = {"unit": "sr^-1", "values": pairs.uncertainty.reshape(f.shape)[finite].tolist()}
    merged = {name: {**value, **data.get(name, {})} if name in COLUMNS else value for name, value in other.items()}
    head = {"schema": SCHEMA, "type": "BRDF", **head, **(metadata or {})}
    json_text.write(path, {"metadata": head, "data": {**other, **data, **merged}})
