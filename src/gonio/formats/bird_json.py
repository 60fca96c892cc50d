"""BiRD's universal BRDF files (EMPIR 16NRM08, BiRD_view): metadata, and columns of angles and BRDF, as JSON.

`metadata` says what was measured and how; `data` holds objects with a unit and a list of values for each of theta_i,
phi_i, theta_r, phi_r [deg or rad], BRDF [1/sr], and optionally wavelength_i [nm or um], polarization_i, uBRDF. The
project's earlier files have `data.variables`, names and units, and `data.values`, rows; both are read. The schema does
not say whether uncertainties are standard ones: they are taken for such. Azimuths are those of the directions to the
lamp and to the detector, counted from one mark on the sample. Checked against the schema and the short example that the
project publishes, and against files written here.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..base.reflectance import Reflectance
from ..errors import FormatError, ParameterError
from ..tables.gridded import Gridded
from . import open_material
from ._options import Declared
from ._reading import channel_words, json_text, plain_text
from ._rows.direction_pairs import LEVEL, Pairs, material, upright
from ._rows.pairs_of_material import COARSE, CoarseResolution, pairs_of

NAME = "BiRD"
SUFFIXES = (".brdf", ".json")
SHARED_SUFFIX = True
DESCRIPTION = "EMPIR BiRD's universal BRDF file: rows with uncertainty, wavelength and polarisation, JSON"
ORACLE = "published schema and example; own generator"

SCHEMA = "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/brdf_json_schema_v1.0.json"
ANGLES = ("theta_i", "phi_i", "theta_r", "phi_r")
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
            "which rows are read: s, p, u, or a Stokes vector as the file has it; if not given, those of "
            "unpolarised light, else the mean of s and p, which is the same, else the only ones"
        ),
    ] = None,
) -> Gridded:
    """The measurement in a file.

    Raises FormatError where the file is damaged, ParameterError where it has no rows of this polarisation.
    """
    document = json_text.read(path)
    where = str(path)
    columns, other = _columns(json_text.member(document, "data", dict, where), where)
    states = columns.pop("polarization_i", None)
    angles = upright(np.stack([columns[name] for name in ANGLES], axis=1), f"{where}, data", LEVEL)
    columns |= dict(zip(ANGLES, angles.T, strict=True))
    about = {"metadata": document.get("metadata", {}), "data": other}
    rows = _of_polarization(columns, states, polarization, about, where)
    angles = np.stack([rows[name] for name in ANGLES], axis=1)
    values, u, channels = rows["BRDF"], rows.get("uBRDF"), None
    if "wavelength_i" in rows:
        held = {"f": values} if u is None else {"f": values, "u": u}
        angles, nm, wide = channel_words.by_channel(angles, rows["wavelength_i"], held, where)
        values, u, channels = wide["f"], wide.get("u"), tuple(nm.tolist())
    return material(Pairs(angles, values, uncertainty=u, channels=channels), where, about)


def _columns(data: dict[str, Any], where: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The columns that are known, in gonio's units, and everything else that `data` says."""
    if "variables" in data:
        data = _of_rows(data, where)
    missing = [name for name in (*ANGLES, "BRDF") if name not in data]
    if missing:
        raise FormatError(f"{where}: data has no {', '.join(missing)}; expected {', '.join((*ANGLES, 'BRDF'))}")
    found, other = {}, {name: value for name, value in data.items() if name not in COLUMNS}
    for name in COLUMNS:
        if name in data:
            column = json_text.member(data, name, dict, f"{where}, data")
            found[name] = _column(name, column, f"{where}, data.{name}")
            rest = {k: v for k, v in column.items() if k not in ("values", "unit", "uncertainty", "notation")}
            if name in ANGLES and "uncertainty" in column:
                rest["uncertainty"] = column["uncertainty"]
            if rest:
                other[name] = rest
    lengths = {name: len(column) for name, column in found.items()}
    if len(set(lengths.values())) > 1 or not lengths["BRDF"]:
        raise FormatError(f"{where}: columns have {lengths} values, expected the same number, at least one")
    _uncertainty(found, data, where)
    return found, other


def _of_rows(data: dict[str, Any], where: str) -> dict[str, Any]:
    """The columns of the earlier layout: `variables` names them, `values` holds rows."""
    variables = json_text.member(data, "variables", list, f"{where}, data")
    rows = json_text.member(data, "values", list, f"{where}, data")
    if not all(isinstance(v, dict) and isinstance(v.get("name"), str) for v in variables):
        raise FormatError(f"{where}: data.variables, expected objects with a name")
    for at, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != len(variables):
            raise FormatError(f"{where}: data.values, row {at + 1}: expected {len(variables)} values: {row!r:.60}")
    named = {v["name"]: {**v, "values": [row[k] for row in rows]} for k, v in enumerate(variables)}
    return {**named, **{k: v for k, v in data.items() if k not in ("variables", "values")}}


def _column(name: str, column: dict[str, Any], where: str) -> np.ndarray:
    values = json_text.member(column, "values", list, where)
    if name == "polarization_i":
        return np.array([_state(v, where) for v in values])
    kind = "angle" if name in ANGLES else name.rpartition("_")[0] if name.startswith("wave") else "brdf"
    unit, found = column.get("unit"), json_text.numbers(values, where)
    if found.ndim != 1:
        raise FormatError(f"{where}: expected a list of numbers, got lists in it")
    if name == "uBRDF" and unit == "%":
        return found  # of BRDF, below
    factor = UNITS.get(f"{kind} {unit}")
    if factor is None:
        known = [u.partition(" ")[2] for u in UNITS if u.startswith(kind)]
        raise FormatError(f"{where}: unit {unit!r}, expected one of {', '.join(known)}")
    return np.radians(found) if kind == "angle" and factor != 1.0 else found * factor


def _state(value: Any, where: str) -> str:
    """s, p, u, or the numbers of the Stokes vector."""
    if isinstance(value, str):
        return value.strip().lower()
    stokes = json_text.numbers(value, where)
    if stokes.shape != (4,):
        raise FormatError(f"{where}: {value!r:.40}, expected s, p, u, or a Stokes vector of four numbers")
    return STATES.get(tuple(stokes.tolist()), str(stokes.tolist()))


def _uncertainty(found: dict[str, np.ndarray], data: dict[str, Any], where: str) -> None:
    """uBRDF in 1/sr: the column of that name, or the one number for all values."""
    one = data["BRDF"].get("uncertainty")
    if "uBRDF" in found:
        if data["uBRDF"].get("unit") == "%":
            found["uBRDF"] = found["uBRDF"] * 0.01 * np.abs(found["BRDF"])
    elif one is not None:
        if not isinstance(one, dict):
            raise FormatError(f"{where}: data.BRDF.uncertainty is {one!r:.40}, expected an object with value and unit")
        value, unit = json_text.numbers(one.get("value"), f"{where}, data.BRDF.uncertainty"), one.get("unit")
        if value.shape != (1,) or (unit != "%" and f"brdf {unit}" not in UNITS):
            raise FormatError(f"{where}: data.BRDF.uncertainty is {one!r:.60}, expected a value in 1/sr, sr^-1 or %")
        found["uBRDF"] = value * (0.01 * np.abs(found["BRDF"]) if unit == "%" else np.ones_like(found["BRDF"]))


def _of_polarization(
    columns: dict[str, np.ndarray], states: np.ndarray | None, asked: str | None, about: dict[str, Any], where: str
) -> dict[str, np.ndarray]:
    """The rows of one state of polarisation, which `about` then names."""
    if states is None:
        if asked is not None:
            raise ParameterError(f"polarization={asked!r}: {where} does not say how its light was polarised")
        return columns
    there = sorted(set(states.tolist()))
    if asked is None:
        asked = there[0] if len(there) == 1 else "u" if "u" in there else "mean of s and p"
    about["polarization_i"] = asked
    if asked == "mean of s and p" and {"s", "p"} <= set(there):
        s, p = ({name: column[states == state] for name, column in columns.items()} for state in "sp")
        return _mean(s, p, where)
    if asked not in there:
        raise ParameterError(f"polarization={asked!r}: {where} holds {', '.join(there)}; give one of these")
    return {name: column[states == asked] for name, column in columns.items()}


def _mean(s: dict[str, np.ndarray], p: dict[str, np.ndarray], where: str) -> dict[str, np.ndarray]:
    """f of unpolarised light: the mean of rows for s and p that agree in everything else."""
    keys = [name for name in s if name not in ("BRDF", "uBRDF")]
    orders = [np.lexsort([rows[name] for name in reversed(keys)]) for rows in (s, p)]
    if len(orders[0]) != len(orders[1]) or not all(np.array_equal(s[n][orders[0]], p[n][orders[1]]) for n in keys):
        raise ParameterError(
            f"{where}: rows for s and p are of different pairs of directions; give polarization='s' or 'p'"
        )
    mean = dict(s)
    back = np.empty_like(orders[0])
    back[orders[0]] = orders[1]
    mean["BRDF"] = 0.5 * (s["BRDF"] + p["BRDF"][back])
    if "uBRDF" in s:
        mean["uBRDF"] = 0.5 * np.hypot(s["uBRDF"], p["uBRDF"][back])
    return mean


def write(
    m: Reflectance,
    path: Path,
    metadata: Annotated[
        dict | None,
        Declared("added to what the measurement knows; a valid file needs id, timestamp, provenance, sample ..."),
    ] = None,
    wavelengths: channel_words.Wavelengths = None,
    resolution: CoarseResolution = None,
) -> None:
    """Write a row for every pair (and wavelength) that a measurement holds, else for those of a grid of angles.

    Rows without a value are left out. Raises ParameterError for several channels without wavelengths, delta lobes and
    maps.
    """
    pairs = pairs_of(m, resolution, nodes=COARSE, as_held=True)
    f = pairs.columns()
    known = getattr(m, "about", {})
    angles = plain_text.degrees(pairs.angles)
    there = np.isfinite(f)
    at, channel = np.nonzero(there)
    # Another format's words may be called so too.
    more, said = (x if isinstance(x := known.get(name), dict) else {} for name in ("data", "metadata"))
    data: dict[str, Any] = {}
    if f.shape[1] > 1 or wavelengths is not None or m.channel_names:
        nm = np.array(channel_words.wavelengths_of(m, wavelengths, f.shape[1]))
        data["wavelength_i"] = {"unit": "nm", "values": nm[channel].tolist()}
    if known.get("polarization_i") in ("s", "p", "u"):
        data["polarization_i"] = {"notation": "sp", "values": [known["polarization_i"]] * len(at)}
    for name, column in zip(ANGLES, angles.T, strict=True):
        data[name] = {"unit": "deg", "values": column[at].tolist()}
    data["BRDF"] = {"unit": "sr^-1", "values": f[there].tolist()}
    if pairs.uncertainty is not None:
        data["uBRDF"] = {"unit": "sr^-1", "values": pairs.uncertainty.reshape(f.shape)[there].tolist()}
    merged = {name: {**value, **data.get(name, {})} if name in COLUMNS else value for name, value in more.items()}
    about = {"schema": SCHEMA, "type": "BRDF", **said, **(metadata or {})}
    json_text.write(path, {"metadata": about, "data": {**merged, **{k: v for k, v in data.items() if k not in merged}}})
