"""Conversion of file formats with a report of changes and losses: `gonio.convert`."""

from __future__ import annotations

import bisect
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.angles import lattice_pairs
from ..base.measured import Measured
from ..base.provenance import ORIGIN, in_words, size_of
from ..base.reflectance import Reflectance
from ..base.reradiation import exchanges
from ..declared.arguments import checked
from ..declared.notebooks import repr_html
from ..formats import FormatName, load, write, writer
from ..formats._options import options as options_of
from ..formats._sides import whole
from ..formula.text import labelled, percent
from ..integrals.photons import exchanged_in_words
from ..models._quarters import QUARTERS, quarters
from ..models.lambertian import Lambertian
from ..pictures.colour import RELATIVE_XYZ, XYZ, rgb_of
from ..polarization.states import dop
from ..tables.gridded import Gridded
from ..tables.nodes import channels_named
from .comparison import Channels, ResamplingError, pairs_for, resampling_error


@dataclass(frozen=True)
class Conversion:
    """A report of `convert`: the file, and its difference from the source.

    error      of the file, read again, against the source; None if they have no channel in common
    channels   names or wavelengths [nm] of the source and of the file; None for one without names
    lost       content of the source that the file lacks, name -> description
    gained     content of the file that the source lacks
    made       the file, read again

    Example
    >>> report = gn.convert(gn.Lambertian(0.5), "white.xml", format="WINDOW XML", basis="quarter")
    >>> print(report.format)
    WINDOW XML
    """

    _repr_html_ = repr_html

    material: str
    path: str
    format: str
    bytes: int
    error: ResamplingError | None
    channels: tuple[tuple | None, tuple | None]
    lost: dict[str, str]
    gained: dict[str, str]
    made: Reflectance

    def to_json(self) -> dict[str, Any]:
        """As JSON data, without `made`; angles in radians.

        Example
        >>> report = gn.convert(gn.Lambertian(0.5), "white.xml", format="WINDOW XML", basis="quarter")
        >>> print(report.to_json()["format"])
        WINDOW XML
        """
        report = {name: value for name, value in vars(self).items() if name != "made"}
        error = None if self.error is None else self.error._asdict()
        return {**report, "error": error, "channels": [None if c is None else list(c) for c in self.channels]}

    def rows(self) -> list[tuple[str, str]]:
        """The report as pairs of a word and a text.

        Example
        >>> report = gn.convert(gn.Lambertian(0.5), "white.xml", format="WINDOW XML", basis="quarter")
        >>> print(report.rows()[0][0])
        error
        """
        lost = labelled("lost", self.lost) or [("lost", "nothing else")]
        return [*_error_rows(self.error), *lost, *labelled("added", self.gained)]

    def __str__(self) -> str:
        head = f"{self.path}: {self.material:.80} as {self.format}"
        return "\n".join([head, *(f"{word:<7} {text}" for word, text in self.rows())])


def _error_rows(error: ResamplingError | None) -> list[tuple[str, str]]:
    if error is None:
        return [("error", "cannot be said: no channel of the source is in the file")]
    if math.isnan(error.mean):
        return [("error", "cannot be said: no pair of directions has data on both sides")]
    if error.largest == 0.0 and error.albedo == 0.0:
        return [("error", "none")]
    theta_i, theta_o, phi = map(degrees, error.at)
    mean, high, largest = map(_share, error[:3])
    return [
        ("error", f"{mean} f on average, {high} f at the 99th percentile,"),
        ("", f"{largest} f at most, at theta_i {theta_i}, theta_o {theta_o}, phi {phi}"),
        ("albedo", f"changed by {error.albedo:.2g} at most, at theta_i {degrees(error.albedo_at[0])}"),
    ]


def degrees(angle: float) -> str:
    """An angle [rad] in degrees, with a digit behind the point where it has one."""
    return f"{round(math.degrees(angle), 1):g}°"


def _share(x: float) -> str:
    """A share of f: in percent, or how many times f it is."""
    return f"{percent(x)} of" if x < 10.0 else f"{x:.2g} times"


@checked
def convert(m: Reflectance, path: str | os.PathLike, format: FormatName | None = None, **options: Any) -> Conversion:
    """Save a reflectance in a format, load it again, and report changes and losses; on both sides, of what has two.

    `format` and `options` as for `gonio.save`. The report is measured: `ResamplingError` says where. f is compared at
    32768 pairs of directions, at fewer of more than 64 channels (`pairs_for`). Raises what `save` raises; then nothing
    is written.

    Example
    >>> report = gn.convert(gn.Lambertian(0.5), "white.xml", format="WINDOW XML", basis="quarter")
    >>> print(report.format, gn.albedo(gn.load("white.xml"), [0, 0, 1]).round(3))
    WINDOW XML 0.5
    """
    path = Path(path)
    module = writer(path, format)
    write(m, path, module, options)
    made = load(path, **whole(m, options_of(module.read)))
    names = _names(m), _names(made)
    compared = _colours(*names) or _common(*names) or _in_order(*names)
    pairs = _quarters(m, made)
    lost, gained = map(_told_together, zip(*(_differences(*pair) for pair in pairs.values()), strict=True))
    if exchanges(m) and not exchanges(made):
        lost["re-radiation"] = exchanged_in_words(m)
    errors = [resampling_error(*pair, *compared) for pair in pairs.values()] if compared else []
    return Conversion(
        material=repr(m),
        path=str(path),
        format=module.NAME,
        bytes=size_of(path),
        error=_worst(errors) if errors else None,
        channels=names,
        lost=lost,
        gained=gained,
        made=made,
    )


def _quarters(m: Reflectance, made: Reflectance) -> dict[str, tuple[Reflectance, Reflectance]]:
    """What is compared: both, or their parts as in a `Sheet`, black where one has none."""
    before, after = quarters(m), quarters(made)
    black = Lambertian(0.0)
    return {q: (before.get(q, black), after.get(q, black)) for q in QUARTERS if q in before or q in after}


def _worst(errors: Sequence[ResamplingError]) -> ResamplingError:
    """The mean of the means, and the largest of the others."""
    measured = [error for error in errors if not math.isnan(error.mean)] or list(errors)
    largest, albedo = max(measured, key=lambda e: e.largest), max(measured, key=lambda e: e.albedo)
    return ResamplingError(
        float(np.mean([error.mean for error in measured])),
        max(error.high for error in measured),
        largest.largest,
        albedo.albedo,
        largest.at,
        albedo.albedo_at,
    )


def _told_together(texts: Sequence[dict[str, str]]) -> dict[str, str]:
    """What is said of several parts; the same words once."""
    names = dict.fromkeys(name for each in texts for name in each)
    return {name: "; ".join(dict.fromkeys(each[name] for each in texts if name in each)) for name in names}


def _names(m: Reflectance) -> tuple | None:
    """Names of the channels, or None of a single one; three without names are R, G and B."""
    count = m.channels or 1
    if m.channel_names is not None or count == 1:
        return m.channel_names
    return channels_named(count)


POLARIZED = 1 << 10
"""Pairs of directions at which polarization is looked for."""

COLOURS = {("R", "G", "B"), XYZ, RELATIVE_XYZ}


def _colours(before: tuple | None, after: tuple | None) -> tuple[Channels, Channels] | None:
    """Matrices that convert both to linear sRGB, if they are colours of different kinds; else None."""
    if before == after or not {before, after} <= COLOURS:
        return None
    first, second = (np.eye(3) if matrix is None else matrix.T for matrix in map(rgb_of, (before, after)))
    return first, second


def _common(before: tuple | None, after: tuple | None) -> tuple[Channels, Channels] | None:
    """Numbers of the channels to compare: of equal names, or a single one with all; None if there are none."""
    if before is None or after is None or 1 in (len(before), len(after)):
        return list(range(len(before or (0,)))), list(range(len(after or (0,))))
    pairs = [(i, k) for i, k in enumerate(_places(before, after)) if k is not None]
    return ([i for i, _ in pairs], [k for _, k in pairs]) if pairs else None


def _in_order(before: tuple | None, after: tuple | None) -> tuple[Channels, Channels] | None:
    """All channels, of files that keep no names: the first with the first, if there are as many; else None."""
    return (None, None) if len(before or ()) == len(after or ()) else None


def _places(names: Sequence, others: Sequence) -> list[int | None]:
    """The numbers of channels among others; wavelengths agree to the digits of single precision."""
    exact = {other: i for i, other in reversed([*enumerate(others)])}
    numbers = sorted((other, i) for other, i in exact.items() if isinstance(other, (int, float)))
    return [exact[name] if name in exact else _nearest(name, numbers) for name in names]


def _nearest(name: Any, numbers: list[tuple[float, int]]) -> int | None:
    if not isinstance(name, (int, float)):
        return None
    at = bisect.bisect(numbers, (name, 0))
    near = [i for other, i in numbers[max(at - 1, 0) : at + 1] if math.isclose(name, other, rel_tol=1e-6)]
    return near[0] if near else None


def _differences(m: Reflectance, made: Reflectance) -> tuple[dict[str, str], dict[str, str]]:
    """Content that the file lacks, and content that it adds."""
    lost: dict[str, str] = {}
    gained: dict[str, str] = {}
    if not isinstance(m, Measured) and isinstance(made, Measured):
        lost["formula"] = "became a table of " + " x ".join(map(str, made.valid.shape)) + " numbers"
    _channels(_names(m), _names(made), lost, gained)
    _holes(m, made, lost, gained)
    if getattr(m, "uncertainty", None) is not None and getattr(made, "uncertainty", None) is None:
        lost["uncertainty"] = "standard uncertainty of the values"
    if m.polarizes and not made.polarizes:
        lost["mueller"] = f"polarization: unpolarized light is up to {percent(_polarized(m))} polarized after it"
    if isinstance(m, Measured):
        about = made.about if isinstance(made, Measured) else {}
        missing = [name for name, value in m.about.items() if name not in about or str(about[name]) != str(value)]
        if missing:
            lost["metadata"] = ", ".join(missing)
        provenance = getattr(made, "provenance", {})
        same_bytes = "sha256" in m.provenance and provenance.get("sha256") == m.provenance["sha256"]
        if m.provenance and ORIGIN not in provenance and not same_bytes:
            lost["provenance"] = f"that it was {in_words(m.provenance)}"
    return lost, gained


def _channels(before: tuple | None, after: tuple | None, lost: dict[str, str], gained: dict[str, str]) -> None:
    if before is None and after is not None and len(after) > 1:
        gained["channels"] = f"one became {len(after)}, all the same"
        return
    if {before, after} <= COLOURS:
        return
    gone = [name for name, k in zip(before or (), _places(before or (), after or ()), strict=True) if k is None]
    if gone:
        shown = ", ".join(f"{x:g}" if isinstance(x, float) else str(x) for x in gone[:6])
        kept = "one without a name" if after is None else f"{len(after)}"
        lost["channels"] = f"{shown}{' ...' if len(gone) > 6 else ''}; the file has {kept}"


def _polarized(m: Reflectance) -> float:
    """The largest degree of polarization of unpolarized light that was reflected, at spread pairs of directions."""
    M = m.mueller(*lattice_pairs(min(POLARIZED, pairs_for(m)))).reshape(-1, 4, 4)
    return float(np.nanmax(dop(M[M[:, 0, 0] > 0.0][..., 0]), initial=0.0))


def _holes(m: Reflectance, made: Reflectance, lost: dict[str, str], gained: dict[str, str]) -> None:
    wi, wo = lattice_pairs(pairs_for(m, made), 1e-3)
    f, after = (x.f(wi, wo).reshape(len(wi), -1) for x in (m, made))
    before, after = np.isfinite(f).all(axis=-1), np.isfinite(after).all(axis=-1)
    if filled := float((~before & after).mean()):
        lost["holes"] = f"{percent(filled)} of all pairs of directions had no data and have values now"
    if (opened := before & ~after).any():
        text = f"{percent(float(opened.mean()))} of all pairs of directions had a value and have none now"
        lost["data"] = f"{text}{_why(m, f, opened, np.minimum(wi, wo)[:, 2])}"


def _why(m: Reflectance, f: np.ndarray, opened: np.ndarray, lowest: np.ndarray) -> str:
    """The cause of holes (n,) that a file has and its source f (n, C) has not, and the cure, as far as they are known.

    `lowest`: the smaller cosine of each pair.
    """
    below: np.ndarray = np.any(f < 0.0, axis=-1)
    if below.any() and (opened[below].mean() > 0.9 or below[opened].mean() > 0.5):
        share = percent(float((_values(m) < 0.0).mean()))
        return (
            f"; {share} of the values are negative, which the format cannot hold, and what is interpolated from one is "
            f"lost with it: convert gonio.repair.remove_negatives(m) in its place, which says what that changes"
        )
    if (highest := float(lowest[opened].max())) < math.cos(math.radians(75.0)):
        return (
            f", all with a direction more than {degrees(math.acos(highest))} from the normal: beyond the file's nodes"
        )
    return ""


def _values(m: Reflectance) -> np.ndarray:
    """The numbers of a measurement that are known; f at spread pairs of others."""
    values = m.stored if isinstance(m, Gridded) else m.f(*lattice_pairs(pairs_for(m)))
    return values[np.isfinite(values)]
