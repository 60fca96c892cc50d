"""Every format with a material of every kind: what comes back is what went out, or the report names what was lost.

A format is in this sweep by existing. By default a part of the pairs, chosen by their names; all with `full`. A failure
ends with Python that repeats it.
"""

from __future__ import annotations

import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kinds import KINDS, of_kind

import gonio as gn
from gonio.formats import formats
from gonio.formats._options import options

WRITERS = {module.NAME: module for module in formats() if hasattr(module, "write")}
SMALL = {"resolution": (6, 6, 4), "nodes": 8, "step": 15.0}
"""Options of formats whose tables are large unless they are asked for."""

HELD = {
    "channels": lambda m: (m.channels or 1) > 1,
    "uncertainty": lambda m: getattr(m, "uncertainty", None) is not None,
    "mueller": lambda m: m.polarizes,
    "re-radiation": lambda m: m.fluoresces,
    "delta lobe": lambda m: m.has_delta,
    "other side": lambda m: m.sides != "front",
    "holes": lambda m: bool(np.isnan(m.f(gn.direction(0.01, 0.0), gn.direction(0.01, 0.1))).any()),
}
"""What a material has, by the word that a report has for it."""


def written(name: str, kind: str, folder: Path) -> tuple[str, Any, Any]:
    """How a material is converted, as Python, the material, and the report; None where the format refuses it."""
    module, m = WRITERS[name], of_kind(kind)
    known = options(module.write)
    given = {k: v for k, v in SMALL.items() if k in known}
    suffix = module.SUFFIXES[0] if getattr(module, "SUFFIXES", ()) else ""
    more = "".join(f", {k}={v!r}" for k, v in given.items())
    text = f'gn.convert(m, folder / "m{suffix}", format={name!r}{more})'
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the report is tested
        try:
            report = gn.convert(m, folder / f"m{suffix}", format=name, **given)
        except gn.Error as error:
            assert "a fault of gonio" not in str(error), f"{error}; m = {KINDS[kind]}; {text}"
            report = None
    return f"m = {KINDS[kind]}\nprint({text})", m, report


def pairs() -> list[Any]:
    chosen = {(n, k) for n in WRITERS for k in KINDS if zlib.crc32(f"{n} {k}".encode()) % 8 == 0}
    return [
        pytest.param(n, k, id=f"{n}-{k}", marks=() if (n, k) in chosen else pytest.mark.full)
        for n in WRITERS
        for k in KINDS
    ]


@pytest.mark.parametrize(("name", "kind"), pairs())
def test_what_comes_back_is_what_went_out_or_is_named(name: str, kind: str, tmp_path: Path) -> None:
    text, m, report = written(name, kind, tmp_path)
    if report is None:
        return
    for word, holds in HELD.items():
        if holds(m) and not holds(report.made):
            told = " ".join([*report.lost, *report.lost.values()])
            assert word in told, f"{word} is lost and not named: {report.lost}\n{text}"
    assert report.error is None or np.isfinite(report.error.mean), f"the loss has no size\n{text}"
