"""ASAM OpenMATERIAL 3D: BRDF look-up tables of materials for simulated cameras, lidars and radars, as JSON (.xompt).

`metadata` names the material; `brdf` holds wavelengths [m], optionally receiverSolidAngles [sr], and lookupTable, rows
of wavelength [m], theta_i, theta_o, phi_o [rad] and f [1/sr]; null is no value. phi_o is counted from the incident
azimuth, "the incident ray": it is taken for that of the direction to the light, so that 0 is back-scatter and pi
forward; neither the standard nor its examples settle it. Checked against the published schema (1.1.0) and the layout
of its examples, and files written here.
"""

from __future__ import annotations

import uuid
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError
from ..tables.gridded import Gridded
from ._layout import FileAxis, Layout
from ._reading import channel_words, json_text
from ._rows.direction_pairs import LEVEL, Pairs, material, upright
from ._rows.pairs_of_material import COARSE, CoarseResolution, pairs_of

NAME = "OpenMATERIAL"
SUFFIXES = (".xompt",)
DESCRIPTION = "ASAM OpenMATERIAL 3D look-up table of an isotropic BRDF, JSON"
ORACLE = "published schema; own generator"

LAYOUT = Layout("angles", {name: FileAxis(name) for name in ("theta_i", "theta_o", "phi_o")}, unit="rad")
COLUMNS = 5
NM = 1e9


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: JSON with OpenMATERIAL's names."""
    text = head.lstrip()
    return text.startswith(b"{") and (b'"openMaterial3dVersion"' in text or b'"lookupTable"' in text)


def read(path: Path) -> Gridded:
    """The look-up table in a file. Raises FormatError where it holds none, or is damaged."""
    document, where = json_text.read(path), str(path)
    if "brdf" not in document:
        raise FormatError(f"{where}: holds {', '.join(map(repr, document))}, expected a 'brdf' with a lookupTable")
    brdf = json_text.member(document, "brdf", dict, where)
    where = f"{where}, brdf.lookupTable"
    table = json_text.member(brdf, "lookupTable", list, f"{path}, brdf")
    for at, row in enumerate(table):
        if not isinstance(row, list) or len(row) != COLUMNS:
            raise FormatError(f"{where}, row {at + 1}: {row!r:.60}, expected wavelength, theta_i, theta_o, phi_o and f")
    rows = json_text.numbers(table, where, hole=True)
    if not len(rows):
        raise FormatError(f"{where}: holds no rows, expected at least one")
    bad = ~np.isfinite(rows[:, :4]).all(axis=1) | (rows[:, 0] <= 0.0)
    if bad.any():
        at = int(np.argmax(bad))
        raise FormatError(f"{where}, row {at + 1}: {table[at]}, expected a wavelength in m and three angles in rad")
    angles = upright(LAYOUT.pairs(rows[:, 1:4]), where, LEVEL)
    angles, metres, wide = channel_words.by_channel(angles, rows[:, 0], {"f": rows[:, 4]}, where)
    about = {"metadata": document.get("metadata", {})}
    about |= {name: value for name, value in brdf.items() if name not in ("wavelengths", "lookupTable")}
    about["wavelengths"] = metres.tolist()
    nm = tuple(float(f"{x * NM:.12g}") for x in metres)  # 9.05e-07 m is 905 nm
    return material(Pairs(angles, wide["f"], channels=nm), str(path), about, isotropic=True)


def write(
    m: Reflectance,
    path: Path,
    metadata: Annotated[dict | None, Declared("added to the measurement's own: name, license, authors ...")] = None,
    wavelengths: channel_words.Wavelengths = None,
    resolution: CoarseResolution = None,
) -> None:
    """Write a row for every pair and wavelength that a measurement holds, else for those of a grid of angles.

    Uncertainties are lost. Raises ParameterError for anisotropic materials, negative values, no wavelengths, delta
    lobes and maps: the format has no place for them.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.xompt", wavelengths=[550.0])
    >>> print(gn.load("white.xompt").channel_names)
    (550.0,)
    """
    pairs = pairs_of(m, resolution, nodes=COARSE, as_held=True)
    if not m.is_isotropic():
        raise ParameterError(f"{m!r:.80}: is anisotropic, and OpenMATERIAL's tables hold isotropic materials only")
    f = pairs.columns()
    nm = channel_words.wavelengths_of(m, wavelengths, f.shape[1])
    if np.nanmin(f, initial=0.0) < 0.0 or np.isinf(f).any():
        raise ParameterError(
            f"{m!r:.80}: holds {np.nanmin(f):g}/sr, expected finite ones, not negative; repair them first"
        )
    about = getattr(m, "about", {})
    exact = {float(f"{x * NM:.12g}"): x for x in about.get("wavelengths", [])}
    metres = [exact.get(x, x / NM) for x in nm]
    theta_i, phi_i, theta_o, phi_o = pairs.angles.T
    phi = phi_o - phi_i
    phi = np.where((phi < 0.0) | (phi > 2.0 * np.pi), np.mod(phi, 2.0 * np.pi), phi)
    angles = LAYOUT.columns(np.stack([theta_i, phi_i, theta_o, phi], axis=1)).tolist()
    table = []
    for c in np.argsort(metres):
        for k in np.lexsort([phi, theta_o, theta_i]):
            value = float(f[k, c])
            table.append([metres[c], *angles[k], None if np.isnan(value) else value])
    brdf: dict[str, Any] = {"wavelengths": sorted(metres)}
    if "receiverSolidAngles" in about:
        brdf["receiverSolidAngles"] = about["receiverSolidAngles"]
    required = {
        "name": f"{m!r:.80}",
        "uuid": str(uuid.uuid4()),
        "materialVersion": "1.0.0",
        "openMaterial3dVersion": "1.1.0",
        "copyrights": ["unknown"],
        "license": "unknown",
        "authors": ["unknown"],
        "creationDate": datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ"),
        "sources": "measurement" if isinstance(m, Measured) else "model",
    }
    described = {**required, **about.get("metadata", {}), **(metadata or {})}
    json_text.write(path, {"metadata": described, "brdf": {**brdf, "lookupTable": table}})
