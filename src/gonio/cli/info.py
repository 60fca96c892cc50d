"""`gonio info`: a material, and the contents of a file."""

from __future__ import annotations

from typing import Any

import click
import numpy as np

from ..formula.text import literal
from .options import Material, json_option, material_argument
from .tables import size_in_words, table
from .terminal import echo, print_json

AGREEING = 0.005
"""Largest relative difference of a stated total from that of the values that counts as agreement."""


@click.command(short_help="Say what MATERIAL is, and what a file holds.")
@material_argument
@json_option
def info(material: Material, as_json: bool) -> None:
    """Say what MATERIAL is: formula, parameters, channels, albedo; of a file also what it holds and lacks."""
    from ..report.facts import facts

    about = facts(material.text, material.read())
    if as_json:
        print_json(about)
    else:
        echo(facts_as_text(about))


def facts_as_text(facts: dict[str, Any]) -> str:
    """Facts about a material (see `report.facts`) as a table."""
    from ..conversion.conversion import labelled

    rows = [("name", facts["material"])]
    if "built_in" in facts:
        rows.append(("built in", f"{facts['built_in']}: {facts['description']}"))
    rows += _file_rows(facts) if "format" in facts else [("formula", facts["expression"])]
    rows.append(("channels", _channels(facts)))
    if "albedo" in facts:
        rows.append(("albedo", _by_angle(facts["albedo"]["theta_i"], facts["albedo"]["values"])))
    if "stated_totals" in facts:
        rows.append(("stated total", _totals(**facts["stated_totals"])))
    for assumed, u in facts.get("uncertainty_of_albedo", {}).items():
        whence = "by interpolation" if assumed == "interpolation" else f"of {assumed} errors"
        rows.append(("u of albedo", f"{_by_angle(facts['albedo']['theta_i'], u)}, {whence}"))
    rows += [(name, _within(off)) for name, off in facts.get("symmetry", {}).items()]
    if facts["has_delta"]:
        rows.append(("mirror", "has a delta lobe: f is 0 pointwise, sampling and integrals are exact"))
    if "fluorescence" in facts:
        rows.append(("fluoresces", facts["fluorescence"]))
    rows += labelled("may break", facts["breaks"])
    if "source" in facts:
        rows.append(("source", facts["source"]))
    rows += _provenance_rows(facts.get("provenance") or {})
    text = table(("", ""), rows).removeprefix("\n")
    listed = [
        (path, _value(p["value"]), f"{p['low']:g} ... {p['high']:g}", _meaning(p))
        for path, p in facts["parameters"].items()
    ]
    listed += [
        (path, o["value"], "a word", f"{o['doc']}: {', '.join(o['choices'])}") for path, o in facts["options"].items()
    ]
    if listed:
        text += "\n\n" + table(("parameter", "value", "bounds", "meaning"), listed)
    return text


def _totals(theta_i: list[float], phi_i: list[float], stated: list, integral: list) -> str:
    """The agreement of the shares of light that a file states with the integrals of its values."""
    from ..conversion.conversion import percent

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


def _file_rows(facts: dict[str, Any]) -> list[tuple[str, str]]:
    """Rows about a file and its contents."""
    from ..conversion.conversion import percent
    from ..tables.angle_systems import SYSTEMS
    from ..tables.half_planes import in_words

    size = f", {size_in_words(facts['bytes'])}" if facts["bytes"] else ""
    rows = [("format", facts["format"] + size)]
    if facts["published_as"]:
        rows.append(("recognised", f"bit by bit the published file of {facts['published_as']}"))
    rows += [(k.replace("_", " "), _short(v)) for k, v in facts["about"].items() if v not in ("", None)]
    rows.append(("quantity", facts["quantity"]))
    if name := facts["parameterisation"]:
        rows.append(("grid", SYSTEMS[name].title if name in SYSTEMS else name))
    rows += [(f"  {name}", _nodes(axis)) for name, axis in facts["axes"].items()]
    if facts["rows"]:
        rows.append(("measured", f"{facts['rows']} pairs of directions, in no grid"))
    if facts["half_planes"]:
        rows.append(("", in_words(facts["half_planes"])))
    rows.append(("table", " x ".join(map(str, facts["shape"]))))
    rows.append(("missing", _share(facts["missing"])))
    if facts["negative"] is not None:
        rows.append(("negative", _share(facts["negative"])))
    spread = facts["uncertainty"]
    if spread:
        low, median, high = (percent(spread[name]) for name in ("low", "median", "high"))
        rows.append(("uncertainty", f"{low} to {high} of the value, {median} (median)"))
        if spread["unknown"] > 0.0:
            rows.append(("", f"unknown for {percent(spread['unknown'])} of the values"))
    if facts["scale_uncertainty"]:
        rows.append(("scale", f"uncertain by {percent(facts['scale_uncertainty'])}"))
    rows += [("repaired", r["summary"]) for r in facts["repairs"]]
    return rows


def _nodes(axis: dict[str, Any]) -> str:
    if axis["nodes"] == 1:
        return f"{axis['low']:.4g}° only"
    step = "uneven" if axis["step"] is None else f"every {axis['step']:.4g}°"
    return f"{axis['nodes']} nodes from {axis['low']:.4g}° to {axis['high']:.4g}°, {step}"


def _within(off: dict[str, float] | None) -> str:
    if off is None:
        return "unknown: no data to compare"
    if off["high"] == 0.0:
        return "exactly"
    from ..conversion.conversion import percent

    return f"to {percent(off['median'])} of f (median), {percent(off['high'])} (99th percentile)"


def _provenance_rows(provenance: dict[str, Any]) -> list[tuple[str, str]]:
    rows = [("sha256", provenance["sha256"])] if "sha256" in provenance else []
    if "gonio" in provenance:
        rows.append(("read by", f"gonio {provenance['gonio']}"))
    if "options" in provenance:
        rows.append(("read with", ", ".join(f"{k}={v}" for k, v in provenance["options"].items())))
    return rows + _origins(provenance.get("converted_from"))


def _origins(origin: Any) -> list[tuple[str, str]]:
    """A row for the origin of a table, one for the origin of that, and so on."""
    if isinstance(origin, list):
        return [row for of in origin for row in _origins(of)]
    if not isinstance(origin, dict):
        return []
    what = origin.get("file") or origin.get("material", "?")
    digest = f", {origin.get('format')}, sha256 {origin['sha256']}" if "sha256" in origin else ""
    row = ("made from", f"{what}{digest}, by {origin.get('converted_by', 'gonio')}")
    return [row, *_origins(origin.get("converted_from"))]


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 300 else f"{text[:300]} ..."


def _meaning(parameter: dict[str, Any]) -> str:
    unit = "" if parameter["unit"] == "1" else f" [{parameter['unit']}]"
    alias = parameter.get("alias", "").rpartition(".")[2]
    return parameter["doc"] + unit + (f"; {alias} sets it with what is tied to it" if alias else "")


def _share(x: float) -> str:
    if x == 0.0:
        return "none"
    return f"{x:.2%} of the table" if x >= 1e-4 else f"{x:.1e} of the table"


def _channels(facts: dict[str, Any]) -> str:
    names, count = facts["channel_names"], facts["channels"]
    if names is None:
        return "1: gray" if count == 1 else str(count)
    if isinstance(names[0], str):
        return f"{count}: linear {''.join(names)}" if names == list("RGB") else f"{count}: {', '.join(names)}"
    if count <= 4:
        return f"{count}: {', '.join(f'{x:g}' for x in names)} nm"
    return f"{count}: {names[0]:g} to {names[-1]:g} nm"


def _by_angle(theta: list[float], values: Any) -> str:
    """Values (angles...[, C]) at angles of incidence [degrees]."""
    spectra = map(np.atleast_1d, values)
    parts = [" ".join(f"{v:.3g}" for v in s) if len(s) <= 4 else f"{s.min():.3g} to {s.max():.3g}" for s in spectra]
    return ", ".join(f"{part} at {t:g}°" for t, part in zip(theta, parts, strict=True))


def _value(value: Any) -> str:
    if np.ndim(value) == 0:
        return f"{value:.6g}"
    if np.ndim(value) > 1:
        return f"{literal(np.asarray(value))[:30]} ..."
    first = ", ".join(f"{v:.5g}" for v in value[:3])
    return first if len(value) <= 3 else f"{first}, ... ({len(value)})"
