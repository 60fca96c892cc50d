"""What `facts` says of a material, in words: rows of a name and a text, in which angles [degrees] end in "°"."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ..formula.text import labelled, percent
from ..tables.angle_systems import SYSTEMS
from ..tables.half_planes import in_words

Rows = Iterator[tuple[str, str]]

AGREEING = 0.005
"""Largest relative difference of a stated total from that of the values that counts as agreement."""


def notes(facts: dict[str, Any]) -> Rows:
    """What a file says of itself."""
    for name, value in facts["about"].items():
        if value not in ("", None):
            yield name.replace("_", " "), "; ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)


def contents(facts: dict[str, Any]) -> Rows:
    """What a file holds and lacks."""
    yield "quantity", facts["quantity"]
    if name := facts["parameterization"]:
        yield "grid", SYSTEMS[name].title if name in SYSTEMS else name
    yield from ((name, _nodes(axis)) for name, axis in facts["axes"].items())
    if facts["rows"]:
        yield "measured", f"{facts['rows']} pairs of directions, in no grid"
    if facts["half_planes"]:
        yield "", in_words(facts["half_planes"])
    yield "table", " x ".join(map(str, facts["shape"]))
    yield "missing", _share(facts["missing"], "the table")
    if facts["negative"] is not None:
        yield "negative", _share(facts["negative"], "the values")
    if spread := facts["uncertainty"]:
        low, median, high = (percent(spread[name]) for name in ("low", "median", "high"))
        yield "uncertainty", f"{low} to {high} of the value, {median} (median)"
        if spread["unknown"] > 0.0:
            yield "", f"unknown for {percent(spread['unknown'])} of the values"
    if facts["scale_uncertainty"]:
        yield "scale", f"uncertain by {percent(facts['scale_uncertainty'])}"
    yield from (("repaired", repair["summary"]) for repair in facts["repairs"])


def optics(facts: dict[str, Any]) -> Rows:
    """What is said of every material: channels, sides, delta lobes, fluorescence, the laws that it may break; where
    they were computed, albedos and symmetries."""
    yield "channels", channels(facts)
    if "places" in facts:
        yield "map", f"{' x '.join(map(str, facts['places']))} places"
    if "sides" in facts:
        yield "sides", "transmits" if facts["sides"] == "both" else "transmits alone"
    if "albedo" in facts:
        yield "albedo", _by_angle(facts, facts["albedo"]["values"])
    if "stated_totals" in facts:
        yield "stated total", _totals(**facts["stated_totals"])
    for assumed, u in facts.get("uncertainty_of_albedo", {}).items():
        whence = "by interpolation" if assumed == "interpolation" else f"of {assumed} errors"
        yield "u of albedo", f"{_by_angle(facts, u)}, {whence}"
    yield from ((name, _within(off)) for name, off in facts.get("symmetry", {}).items())
    if facts["has_delta"]:
        yield "mirror", "has a delta lobe: f is 0 pointwise, sampling and integrals are exact"
    if "fluorescence" in facts:
        yield "fluoresces", facts["fluorescence"]
    yield from labelled("may break", facts["breaks"])


def provenance(facts: dict[str, Any]) -> Rows:
    """The file that was read, by what, and what it was made from."""
    given = facts.get("provenance") or {}
    if "sha256" in given:
        yield "sha256", given["sha256"]
    if "gonio" in given:
        yield "read by", f"gonio {given['gonio']}"
    if "options" in given:
        yield "read with", ", ".join(f"{k}={v}" for k, v in given["options"].items())
    yield from _origins(given.get("converted_from"))


def _origins(origin: Any) -> Rows:
    """A row for the origin of a table, one for the origin of that, and so on."""
    if isinstance(origin, list):
        for of in origin:
            yield from _origins(of)
    if isinstance(origin, dict):
        digest = f", {origin.get('format')}, sha256 {origin['sha256']}" if "sha256" in origin else ""
        what = origin.get("file") or origin.get("material", "?")
        yield "made from", f"{what}{digest}, by {origin.get('converted_by', 'gonio')}"
        yield from _origins(origin.get("converted_from"))


def channels(facts: dict[str, Any]) -> str:
    """How many channels, and which."""
    names, count = facts["channel_names"], facts["channels"]
    if names is None:
        return "1: gray" if count == 1 else str(count)
    if isinstance(names[0], str):
        return f"{count}: linear {''.join(names)}" if names == list("RGB") else f"{count}: {', '.join(names)}"
    if count <= 4:
        return f"{count}: {', '.join(f'{x:g}' for x in names)} nm"
    return f"{count}: {names[0]:g} to {names[-1]:g} nm"


def _nodes(axis: dict[str, Any]) -> str:
    if axis["nodes"] == 1:
        return f"{axis['low']:.4g}° only"
    step = "uneven" if axis["step"] is None else f"every {axis['step']:.4g}°"
    return f"{axis['nodes']} nodes from {axis['low']:.4g}° to {axis['high']:.4g}°, {step}"


def _share(x: float, of: str) -> str:
    if x == 0.0:
        return "none"
    return f"{x:.2%} of {of}" if x >= 1e-4 else f"{x:.1e} of {of}"


def _within(off: dict[str, float] | None) -> str:
    if off is None:
        return "unknown: no data to compare"
    if off["high"] == 0.0:
        return "exactly"
    return f"to {percent(off['median'])} of f (median), {percent(off['high'])} (99th percentile)"


def _by_angle(facts: dict[str, Any], values: Iterable[Any]) -> str:
    """Values (angles...[, C]) at the angles of incidence [degrees] of the albedos."""
    spectra = map(np.atleast_1d, values)
    parts = [" ".join(f"{v:.3g}" for v in s) if len(s) <= 4 else f"{s.min():.3g} to {s.max():.3g}" for s in spectra]
    return ", ".join(f"{part} at {t:g}°" for t, part in zip(facts["albedo"]["theta_i"], parts, strict=True))


def _totals(theta_i: list[float], phi_i: list[float], stated: list, integral: list) -> str:
    """The agreement of the shares of light that a file states with the integrals of its values."""
    shares, rho = np.array(stated), np.array(integral)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.where(shares > 0.0, rho / shares - 1.0, 0.0)
    largest = np.abs(off).max()
    if largest <= AGREEING:
        return f"that of the values, to {percent(largest)}"
    k, channel = np.unravel_index(np.abs(off).argmax(), off.shape)
    at = f"{theta_i[k]:g}°" + (f", azimuth {phi_i[k]:g}°" if len({*phi_i}) > 1 else "")
    many = f"{(np.abs(off) > AGREEING).any(axis=1).sum()} of {len(shares)} directions of light"
    return (
        f"not that of the values: at {at} the file says {shares[k, channel]:.4g}, they reflect {rho[k, channel]:.4g} "
        f"({100.0 * off[k, channel]:+.2g} %); more than {percent(AGREEING)} apart at {many}"
    )
