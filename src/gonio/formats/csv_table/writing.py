"""Writing a reflectance as a table of our own."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...base.reflectance import Reflectance
from ...errors import ParameterError
from ...formula import tree
from ...models._quarters import quarters
from ...tables.gridded import Gridded
from ...tables.rows import ROW_ANGLES
from ...tables.scattered import Scattered
from .._laboratory.layout import NOTE
from .._laboratory.names import QUANTITIES
from .._reading import channel_words, plain_text
from .._rows.direction_pairs import Pairs
from .._rows.pairs_of_material import Resolution, of_nodes, pairs_of, rows_of, table_of, with_others
from .._sides import about_of, is_part
from .words import MARK, OPTIONS


def write(m: Reflectance, path: Path, resolution: Resolution = None) -> None:
    """Write a measurement, grid or rows, as it is, with its options and uncertainty; for others, and where `resolution`
    is given, f at a grid of angles.

    Angles are degrees if these read back as the same numbers, else radians. Texts and numbers of `about` are kept, as
    texts. Raises ParameterError for delta lobes, maps, and channels whose names do not fit into those of columns.

    Example
    >>> gn.save(gn.tables.tabulate(gn.Lambertian(0.5), "angles", resolution=(4, 4, 6)), "white.csv")
    >>> print(gn.load("white.csv").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    if not is_part(m):
        _write_rows(path, m, rows_of(m, resolution, [*QUANTITIES.values()]), [*ROW_ANGLES], _shared_options(m))
        return
    table = table_of(m, resolution)
    options = {"outside": table.outside}
    if isinstance(table, Scattered) or "other_pairs" in table.about:
        axes, pairs = [*ROW_ANGLES], with_others(pairs_of(table, quantities=[table.quantity]), table)
        options["isotropic"] = str(len(table.axes) == 3).lower()
    else:
        axes, pairs = [*table.axes], of_nodes(table)
        options |= _grid_options(table)
    _write_rows(path, table, pairs, axes, options)


def _shared_options(m: Reflectance) -> dict[str, str]:
    """The options of rows that all parts of a reflectance on both sides have."""
    parts = quarters(m).values()
    outside = {part.outside for part in parts if isinstance(part, Gridded)}
    flat = {part.is_isotropic() if not isinstance(part, Gridded) else not tree.is_oriented(part) for part in parts}
    options = {"outside": outside.pop()} if len(outside) == 1 else {}
    return options | ({"isotropic": str(flat.pop()).lower()} if len(flat) == 1 else {})


def _write_rows(path: Path, m: Reflectance, pairs: Pairs, axes: list[str], options: dict[str, str]) -> None:
    angles = plain_text.degrees(pairs.angles)
    if not (np.radians(angles) == pairs.angles).all():
        options["angle_unit"], angles = "rad", pairs.angles
    names = _value_names(m, pairs)
    if pairs.uncertainty is not None:
        names += [f"u_{name}" for name in names]
    lines = [MARK, *(f"# {key}: {text}" for key, text in (_texts(about_of(m)) | options).items())]
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
        k: v for k, v in texts.items() if NOTE.fullmatch(f"# {k}: {v}") and ":" not in k and not re.search(r"[\r\n]", v)
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
