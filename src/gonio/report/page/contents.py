"""What a report says of a material, as JSON data. Angles are in degrees, f in 1/sr."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...arrays.kinds import with_channels
from ...base.angles import direction
from ...base.map_shape import map_shape
from ...base.measured import Measured
from ...base.reflectance import Reflectance
from ...base.sides import hemispheres
from ...catalogue.citations import cite
from ...errors import ParameterError
from ...facts.material import facts, quoted, to_rgb
from ...facts.models import formulas
from ...facts.subject import Subject
from ...figures._slices import lit_range, one_number, plane, viewed_from
from ...integrals.albedo import albedo, white_sky_albedo
from ...integrals.fate import fate
from ...laws import check, summaries
from ...pictures.colour import RGB_OF_XYZ, WHITE, srgb_encode
from ...scenes.rendering import in_daylight
from ...tables.gridded import Gridded
from . import curves
from .fits import fits_of
from .guarded import Guarded

TABLE = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)
"""Angles of incidence [degrees] of the tables of albedos."""

CURVE = (5.0, 10.0, 20.0, 25.0, 35.0, 40.0, 50.0, 55.0, 65.0, 70.0, 80.0, 82.5, 87.0, 88.5)
"""Angles of incidence [degrees] between those of the table, of formulas."""

TOLERANCE = 1e-4
"""Tolerance of albedos of formulas."""

WHITE_SKY, MEASURED = 1e-3, 5e-3
"""Tolerances of white-sky albedos: of formulas, and of measurements, whose noise makes them slow to integrate."""

COLUMNS = 7
"""The most channels of a table."""

POLARIZED = (15.0, 45.0, 60.0, 75.0)
"""Angles of incidence [degrees] at which polarization is shown."""

VIEWS = np.linspace(-89.5, 89.5, 359)
"""Viewing angles [degrees] of polarization."""

OF_A_LAW = (
    *("name", "verdict", "passed", "value", "tolerance", "finding", "where", "why", "declared", "significance", "u"),
)
"""What is told of a verdict."""

Progress = Callable[[float], None]
"""Told the share that is done, from 0 to 1."""


def contents_of(subject: Subject, with_fits: bool = True, progress: Progress | None = None) -> dict[str, Any]:
    """What a report says of one material. Raises ParameterError for maps."""
    m = subject.m
    if shape := map_shape(m):
        places = " x ".join(map(str, shape))
        raise ParameterError(
            f"report of {subject.name!r:.60}: a map of {places} places, expected a material of one; "
            f"`gonio show` draws maps, and gn.check(m) holds every place to the laws"
        )
    tell = progress or (lambda share: None)
    sections = Guarded()
    about = facts(subject.text, m, computed=False)
    sections.add("albedo", lambda: albedos(m))
    sections.add("slices", lambda: curves.slices(m))
    slices = sections.parts["slices"]
    sections.parts["peaks"] = curves.peaks(slices["in_plane"]) if slices else []
    sections.add("half_difference", lambda: curves.half_difference(m))
    tell(0.1)
    sections.add("laws", lambda: _laws(m, lambda done, total: tell(0.1 + 0.5 * done / total)))
    sections.add("colour", lambda: colours(m))
    sections.add("delta", lambda: _deltas(m) if m.has_delta else None)
    sections.add("fate", lambda: _fates(m) if "sides" in about else None)
    sections.add("polarization", lambda: _polarization(m) if m.polarizes else None)
    tell(0.65)
    if with_fits:
        sections.add("fits", lambda: fits_of(m, subject.text))
    else:
        sections.parts["fits"], sections.left_out["fits"] = None, "left out on request (--no-fits)"
    tell(1.0)
    best = (
        sections.parts["fits"]["models"][0]["model"]
        if sections.parts["fits"] and sections.parts["fits"]["models"]
        else ""
    )
    table = sections.parts["albedo"]["table"]["theta_i"] if sections.parts["albedo"] else [0.0]
    return {
        "name": subject.name,
        "title": subject.title,
        "facts": about,
        "isotropic": bool(m.is_isotropic()),
        "unit": one_number(m)[1],
        "formulas": formulas(m),
        "citations": cite(m),
        **sections.parts,
        "left_out": sections.left_out,
        "notes": sections.notes,
        "reproduce": {
            "python": subject.python(table, math.degrees(plane(m)), best),
            "shell": subject.shell(best),
        },
    }


def channels_of(m: Reflectance) -> list[str]:
    """The names of the channels, wavelengths with their unit; of one channel "f"."""
    names = m.channel_names
    if names is None:
        count = m.channels or 1
        return ["R", "G", "B"] if count == 3 else ["all"] if count == 1 else [str(k + 1) for k in range(count)]
    return [name if isinstance(name, str) else f"{name:.6g} nm" for name in names]


def shown_channels(count: int) -> list[int]:
    """The channels that tables show: all where they are few, else some from the first to the last."""
    return list(range(count)) if count <= COLUMNS else np.linspace(0, count - 1, COLUMNS).round().astype(int).tolist()


def albedos(m: Reflectance) -> dict[str, Any]:
    """Directional-hemispherical reflectance by angle of incidence and channel, with uncertainties, and under a white
    sky; more angles for a curve where they cost little."""
    low, high = lit_range(m)
    theta = np.unique(np.clip(TABLE, low, high)) if isinstance(m, Gridded) else np.array(TABLE)
    wi = direction(np.radians(theta), plane(m))
    table: dict[str, Any] = {"theta_i": theta.tolist(), "channels": channels_of(m)}
    table["shown"] = shown_channels(len(table["channels"]))
    if isinstance(m, Gridded):
        table |= _measured_albedos(m, wi)
        curve = {"theta_i": table["theta_i"], "values": table["values"]}
    else:
        is_formula = not isinstance(m, Measured)
        every = np.unique([*TABLE, *(CURVE if is_formula else ())])
        tolerance = TOLERANCE if is_formula else 1e-3
        value, error = albedo(m, direction(np.radians(every), plane(m)), tolerance=tolerance, return_error=True)
        value, at = with_channels(value, 1), np.searchsorted(every, theta)
        table |= {"values": value[at].tolist(), "u": {"integration": np.asarray(error)[at].tolist()}}
        table |= {"assumed": "", "method": f"adaptive integration to {tolerance:g}"}
        curve = {"theta_i": every.tolist(), "values": value.tolist()}
    return {"table": table, "curve": curve, "white_sky": _white_sky(m), "low": low, "high": high}


def _components(m: Gridded, function: Callable[..., Any], *args: Any, axes: int) -> dict[str, Any]:
    """A result of a table (..., C), the components of its standard uncertainty, and all together."""
    value, components = quoted(function, m, *args)
    interpolation = with_channels(components.pop("interpolation"), axes)
    u = {f"{how} errors": with_channels(x, axes) for how, x in components.items()}
    noise = np.max(list(u.values()), axis=0) if u else 0.0
    return {
        "values": with_channels(value, axes).tolist(),
        "u": {name: x.tolist() for name, x in {**u, "interpolation": interpolation}.items()},
        "total": np.hypot(noise, interpolation).tolist(),
    }


def _measured_albedos(m: Gridded, wi: np.ndarray) -> dict[str, Any]:
    """Albedos of a table, and their standard uncertainties."""
    albedos = _components(m, albedo, wi, axes=1)
    by_noise = "the larger of both components by noise, and interpolation"
    albedos["assumed"] = by_noise if len(albedos["u"]) > 1 else "interpolation alone"
    return albedos | {"method": "uncertainties of the values, and of interpolation between them"}


def _white_sky(m: Reflectance) -> dict[str, Any]:
    """The albedo under a white sky (C,), with its uncertainty as that of the table."""
    if isinstance(m, Gridded):
        return _components(m, white_sky_albedo, axes=0)
    tolerance = MEASURED if isinstance(m, Measured) else WHITE_SKY
    white = with_channels(white_sky_albedo(m, tolerance=tolerance), 0)
    return {"values": white.tolist(), "u": {"integration": tolerance}}


def _laws(m: Reflectance, progress: Callable[[int, int], None]) -> dict[str, Any]:
    report, statements = check(m, progress=progress), summaries()
    laws = [{"statement": statements[x.name], **{key: getattr(x, key) for key in OF_A_LAW}} for x in report.laws]
    return {"passed": report.passed, "lawful": report.lawful, "laws": laws, "notes": list(report.notes)}


def colours(m: Reflectance) -> dict[str, Any] | None:
    """The colour of the albedo under daylight (D65), at a few angles and under a white sky, and the spectrum; None of
    channels that are no colours."""
    m, theta = in_daylight(m), np.unique(np.clip((0.0, 45.0, 75.0), *lit_range(m)))
    rho = with_channels(albedo(m, direction(np.radians(theta), plane(m)), tolerance=1e-3), 1)
    names = m.channel_names
    spectrum = None
    if names is not None and not isinstance(names[0], str):
        order = np.argsort(np.array(names, float))
        wavelengths = np.array(names, float)[order].tolist()
        spectrum = {"wavelengths": wavelengths, "theta_i": theta.tolist(), "values": rho[:, order].tolist()}
    matrix = to_rgb(m)
    if matrix is None:
        return {"patches": [], "spectrum": spectrum} if spectrum else None
    patches = []
    for angle, row in zip(theta.tolist(), rho @ matrix, strict=True):
        lab = lab_of(row)
        codes = (srgb_encode(np.clip(row, 0.0, 1.0)) * 255.0).round().astype(int)
        inside = bool((row > -1e-3).all() and (row < 1.001).all())
        patches.append({
            "theta_i": angle, "hex": "#" + "".join(f"{c:02x}" for c in codes), "rgb": row.tolist(), "lab": lab,
            "in_gamut": inside,
        })  # fmt: skip
    return {"patches": patches, "spectrum": spectrum}


def lab_of(rgb: np.ndarray) -> list[float]:
    """CIELAB of linear sRGB, white being D65. CIE 015:2018."""
    t = np.linalg.inv(RGB_OF_XYZ) @ rgb / WHITE
    f = np.where(t > (6.0 / 29.0) ** 3, np.cbrt(t), t * (29.0 / 6.0) ** 2 / 3.0 + 4.0 / 29.0)
    return [float(x) for x in (116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2]))]


def _deltas(m: Reflectance) -> dict[str, Any]:
    """The shares of delta lobes by angle of incidence: reflected and, where light passes, transmitted."""
    wo = direction(np.radians(TABLE), plane(m))
    shares = {
        name: with_channels(m.delta_reflectance(wo, across=z < 0.0), 1).tolist()
        for name, z in zip(("reflected", "transmitted"), hemispheres(m), strict=False)
    }
    return {"theta_i": list(TABLE), "channels": channels_of(m), **shares}


def _fates(m: Reflectance) -> dict[str, Any]:
    """The shares of light that are reflected, transmitted and absorbed, as one number and by channel."""
    theta = np.unique([*TABLE, *CURVE])
    number, _ = one_number(m)
    shares = fate(m, direction(np.radians(theta), plane(m)), tolerance=1e-3)._asdict()
    return {
        "theta_i": theta.tolist(),
        **{name: number(with_channels(x, 1)).tolist() for name, x in shares.items()},
        "by_channel": {name: with_channels(x, 1).tolist() for name, x in shares.items()},
    }


def _polarization(m: Reflectance) -> dict[str, Any]:
    """The degree of linear polarization of the light that leaves, of unpolarized light that arrives, in the plane of
    incidence; Mueller matrices at the mirror directions over their first element; and those of delta lobes."""
    phi = plane(m)
    wi = direction(np.radians(POLARIZED), phi)
    mirrors = direction(np.radians(POLARIZED), phi + math.pi)
    seen = np.array([[*viewed_from(phi, VIEWS), mirror] for mirror in mirrors])
    # pair by pair, as the laws ask: the kernel of a Mueller matrix takes long to compile
    pairs = np.repeat(wi, seen.shape[1], axis=0), seen.reshape(-1, 3)
    rows, matrices = [], []
    for theta, mirror_wo, M in zip(
        POLARIZED, mirrors, _as_one(m, m.mueller(*pairs)).reshape(*seen.shape[:2], 4, 4), strict=True
    ):
        of_views, mirror = M[:-1], M[-1]
        with np.errstate(all="ignore"):
            degree = np.hypot(of_views[:, 1, 0], of_views[:, 2, 0]) / of_views[:, 0, 0]
        rows.append({"theta_i": theta, "views": VIEWS.tolist(), "degree": degree.tolist()})
        if mirror[0, 0] <= 0.0 and m.has_delta:
            mirror = _as_one(m, m.delta_mueller(mirror_wo))
        if mirror[0, 0] > 0.0:
            matrices.append(
                {"theta_i": theta, "first": float(mirror[0, 0]), "matrix": (mirror / mirror[0, 0]).tolist()}
            )
    measured = any(np.isfinite(row["degree"]).any() for row in rows)
    return {"degree": rows if measured else [], "mirror": matrices, "delta": not measured}


def _as_one(m: Reflectance, M: np.ndarray) -> np.ndarray:
    """Mueller matrices of all channels as that of one number, as curves are."""
    if m.channels is None:
        return np.asarray(M, float)
    number, _ = one_number(m)
    return np.asarray(number(np.moveaxis(M, -3, -1)), float)


def summarized(several: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The numbers by which materials are compared: a row for each."""
    rows = []
    for one in several:
        laws, peaks = one["laws"], {p["theta_i"]: p for p in one["peaks"]}
        middle = min(peaks, key=lambda theta: abs(theta - 45.0), default=None)
        table = one["albedo"]["table"] if one["albedo"] else {"theta_i": [], "values": []}
        mean = {theta: float(np.mean(row)) for theta, row in zip(table["theta_i"], table["values"], strict=True)}
        nearest = [x for x in (one["fits"] or {}).get("nearest", []) if x["name"] != one["facts"]["material"]]
        rows.append({
            "name": one["name"],
            "title": one["title"],
            "channels": one["facts"]["channels"],
            "albedo": mean,
            "white_sky": float(np.mean(one["albedo"]["white_sky"]["values"])) if one["albedo"] else None,
            "peak": peaks[middle] if middle is not None else None,
            "laws_held": sum(law["passed"] for law in laws["laws"]) if laws else None,
            "laws": len(laws["laws"]) if laws else None,
            "lawful": bool(laws and laws["lawful"]),
            "failed": [law["name"] for law in laws["laws"] if not law["passed"]] if laws else [],
            "nearest": nearest[0]["name"] if nearest else None,
            "colour": one["colour"]["patches"][0]["hex"] if one["colour"] and one["colour"]["patches"] else None,
        })  # fmt: skip
    return rows
