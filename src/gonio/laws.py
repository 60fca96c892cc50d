"""Whether a reflectance obeys the laws: a verdict per law, with the number, the tolerance, the place and the reason."""

from __future__ import annotations

import math
import textwrap
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from .errors import MissingDataWarning
from .integrate import integrate
from .interface import Reflectance, angles, direction
from .quadrature import lattice

PAIRS = 1 << 17
SAMPLES = 1 << 16
INCIDENCE = np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 88.0, 89.5, 89.9])
VIEWS = np.radians([0.0, 30.0, 60.0, 80.0])


@dataclass(frozen=True)
class Law:
    """One verdict. `value` is compared with `tolerance` as `rule` says; `where` holds angles [degrees]."""

    name: str
    passed: bool
    value: float
    tolerance: float
    rule: str
    where: dict[str, float] = field(default_factory=dict)
    why: str = ""


@dataclass(frozen=True)
class Report:
    """What `check` found: `passed` if every law holds. Prints as a table."""

    material: str
    laws: tuple[Law, ...]
    notes: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether every law holds."""
        return all(law.passed for law in self.laws)

    def to_json(self) -> dict[str, Any]:
        """The report as JSON data."""
        return {**asdict(self), "passed": self.passed}

    def __str__(self) -> str:
        lines = [self.material]
        width = max(len(law.name) for law in self.laws)
        rules = [law.rule.format(value=_short(law.value), tolerance=_short(law.tolerance)) for law in self.laws]
        for law, rule in zip(self.laws, rules, strict=True):
            place = ", ".join(f"{k} {v:.4g}" for k, v in law.where.items())
            verdict = "pass" if law.passed else "FAIL"
            lines.append(f"  {verdict}  {law.name:<{width}}  {rule:<{max(map(len, rules))}}  {place}".rstrip())
            if law.why:
                indent = " " * (10 + width)
                lines += textwrap.wrap(law.why, 100, initial_indent=indent, subsequent_indent=indent)
        for note in self.notes:
            lines += textwrap.wrap(note, 100, initial_indent="  note  ", subsequent_indent=" " * 8)
        return "\n".join(lines)


def check(m: Reflectance, progress: Callable[[int, int], None] | None = None) -> Report:
    """Hold a reflectance to the laws: positivity, reciprocity, energy, pdf, sampling, furnace.

    positivity   f >= 0
    reciprocity  f(wi, wo) = f(wo, wi)
    energy       albedo <= 1 at every incidence, by quadrature
    pdf          the density of `sample` integrates to 1 over the hemisphere, with what falls below the horizon
    sampling     samples are distributed as `pdf` says, and weight = f cos(theta_i)/pdf
    furnace      in a uniform surround of radiance 1 nothing is brighter than 1, rendered through `sample`

    The same for models and measurements, on 131072 pairs of directions and 65536 samples, without random numbers:
    two runs give the same report. `progress(done, total)` is called after each law. A law that the model's class
    declares not to obey is marked with the class's reason.
    """
    laws, notes = [], []
    steps: list[Callable[[Reflectance], Law]] = [_positivity, _reciprocity, _energy, _pdf, _sampling, _furnace]
    missing = _missing(m)
    if missing > 0.0:
        notes.append(
            f"{missing:.2%} of the pairs of directions hold no data; they are left out, and count as 0 in integrals"
        )
    for i, step in enumerate(steps):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MissingDataWarning)
            law = step(m)
        laws.append(law)
        reason = next((lobe.breaks[law.name] for _, lobe in m.lobes() if law.name in lobe.breaks), "")
        if reason and law.passed and m.parameters:
            notes.append(f"{law.name} holds at these parameters, but not at all parameters: {reason}")
        if reason and not law.passed:
            laws[-1] = Law(**{**asdict(law), "why": f"{law.why}; {reason}"})
        if progress is not None:
            progress(i + 1, len(steps))
    return Report(repr(m), tuple(laws), tuple(notes))


def _short(x: float) -> str:
    return f"{x:.4g}"


def _degrees(wi: Any = None, wo: Any = None) -> dict[str, float]:
    found = {}
    for name, w in (("i", wi), ("o", wo)):
        if w is not None:
            theta, phi = angles(np.asarray(w, dtype=float))
            found[f"theta_{name}"], found[f"phi_{name}"] = math.degrees(float(theta)), math.degrees(float(phi))
    return found


def _pairs() -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions: most spread evenly over both hemispheres, the rest close to mirror pairs and to grazing."""
    n = PAIRS
    a, b = lattice(n, 4)[:, :2], lattice(n, 4)[:, 2:]
    theta_i, theta_o = np.arccos(1.0 - 0.9998 * a[:, 0]), np.arccos(1.0 - 0.9998 * b[:, 0])
    phi_i, phi_o = 2 * np.pi * a[:, 1], 2 * np.pi * b[:, 1]
    near = slice(0, n // 4)  # within a few degrees of the mirror pair, where glossy materials change fastest
    spread = 0.3 * b[near] ** 4 * np.where(a[near] > 0.5, 1.0, -1.0)
    theta_o[near] = np.clip(theta_i[near] + spread[:, 0], 0.0, np.radians(89.99))
    phi_o[near] = phi_i[near] + np.pi + spread[:, 1]
    return direction(theta_i, phi_i), direction(theta_o, phi_o)


def _values(m: Reflectance, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    f = m.f(wi, wo)
    return f if f.ndim == wi.ndim else f[..., None]


def _missing(m: Reflectance) -> float:
    return float(np.isnan(_values(m, *_pairs())).mean())


def _positivity(m: Reflectance) -> Law:
    wi, wo = _pairs()
    f = _values(m, wi, wo)
    worst = np.where(np.isnan(f), np.inf, f).min(axis=-1)
    at = int(worst.argmin())
    value = float(worst[at])
    share = float((f < 0.0).mean())
    why = f"{share:.2%} of the values are negative, the lowest is {value:.4g} sr-1" if value < 0.0 else ""
    return Law("positivity", value >= 0.0, value, 0.0, "min f = {value}", _degrees(wi[at], wo[at]) if why else {}, why)


def _reciprocity(m: Reflectance) -> Law:
    wi, wo = _pairs()
    there, back = _values(m, wi, wo), _values(m, wo, wi)
    scale = 0.5 * (np.abs(there) + np.abs(back)) + 1e-6 * np.nanmedian(np.abs(there)) + 1e-30
    error = np.nan_to_num(np.abs(there - back) / scale)
    worst = error.max(axis=-1)
    at = int(worst.argmax())
    value, tolerance = float(worst[at]), 1e-4
    why = ""
    if value > tolerance:
        c = int(error[at].argmax())
        median = float(np.median(error[error > 0.0])) if (error > 0.0).any() else 0.0
        why = (
            f"f(wi, wo) = {there[at, c]:.4g} but f(wo, wi) = {back[at, c]:.4g} sr-1; "
            f"of the pairs that differ, half do by more than {median:.2g}"
        )
    rule = "|f - f swapped|/mean = {value} <= {tolerance}"
    return Law("reciprocity", value <= tolerance, value, tolerance, rule, _degrees(wi[at], wo[at]) if why else {}, why)


def _albedos(m: Reflectance, incident: bool) -> tuple[np.ndarray, np.ndarray]:
    phi = np.array([0.3]) if m.is_isotropic() else np.radians([0.0, 45.0, 90.0, 200.0])
    w = direction(INCIDENCE[:, None], phi[None, :]).reshape(-1, 3)
    a = integrate(m, w, tolerance=5e-4, incident=incident)
    return w, a if a.ndim == 2 else a[:, None]


def _energy(m: Reflectance) -> Law:
    w, a = _albedos(m, incident=True)
    at, c = np.unravel_index(int(a.argmax()), a.shape)
    value, tolerance = float(a[at, c]), 1.0 + 1e-3
    why = ""
    if value > tolerance:
        where = f" in channel {_channel(m, int(c))}" if a.shape[-1] > 1 else ""
        why = f"{value:.4g} of the light that arrives there leaves again{where}"
    return Law(
        "energy", value <= tolerance, value, tolerance, "max albedo = {value} <= {tolerance}", _degrees(w[at]), why
    )


def _channel(m: Reflectance, c: int) -> str:
    names = m.channel_names
    if names is None:
        return str(c)
    return str(names[c]) if isinstance(names[c], str) else f"{names[c]:g} nm"


# The quarter circle is an edge, for there seen along the normal is the horizon, where densities may jump.
RING_EDGES = np.concatenate([[0.0], np.geomspace(1e-5, 0.5 * np.pi, 85), np.linspace(0.5, 1.0, 13)[1:] * np.pi])


def _mirror_axes(view: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mirror direction of `view` and two axes across it."""
    mirror = view * np.array([-1.0, -1.0, 1.0])
    t = np.array([mirror[2], 0.0, -mirror[0]]) if abs(mirror[0]) < 0.9 else np.array([-mirror[1], mirror[0], 0.0])
    t = t / np.linalg.norm(t)
    return mirror, t, np.cross(mirror, t)


def _rings(view: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions (K, 3), solid angles (K,) and bin numbers (K,) of a polar grid about the mirror direction of `view`.

    Radii are spaced logarithmically, so that lobes of any width are resolved; a bin is a part of a ring.
    """
    mirror, t, b = _mirror_axes(view)
    edges = RING_EDGES
    x, gauss = np.polynomial.legendre.leggauss(4)
    r = 0.5 * (edges[:-1, None] + edges[1:, None] + (edges[1:, None] - edges[:-1, None]) * x)
    dr = 0.5 * (edges[1:, None] - edges[:-1, None]) * gauss
    n = 192
    psi = (np.arange(n) + 0.5) * (2.0 * np.pi / n)
    r, dr = r.reshape(-1, 1), dr.reshape(-1, 1)
    w = (
        np.cos(r)[..., None] * mirror
        + (np.sin(r) * np.cos(psi))[..., None] * t
        + (np.sin(r) * np.sin(psi))[..., None] * b
    )
    ring = np.repeat(np.arange(len(edges) - 1), 4)[:, None]
    bins = (ring // 4) * 8 + (np.arange(n) * 8 // n)[None, :]
    solid = np.broadcast_to(np.sin(r) * dr * (2.0 * np.pi / n), bins.shape)
    return w.reshape(-1, 3), solid.reshape(-1), bins.reshape(-1)


def _bins_of(view: np.ndarray, w: np.ndarray) -> np.ndarray:
    """The bin number of `_rings` that each direction falls in."""
    mirror, t, b = _mirror_axes(view)
    across = np.stack([w @ t, w @ b], -1)
    r = np.arctan2(np.linalg.norm(across, axis=-1), w @ mirror)
    ring = np.clip(np.searchsorted(RING_EDGES, r, side="right") - 1, 0, len(RING_EDGES) - 2)
    psi = np.arctan2(across[:, 1], across[:, 0]) % (2.0 * np.pi)
    return (ring // 4) * 8 + np.minimum((psi * 8 / (2.0 * np.pi)).astype(int), 7)


def _pdf(m: Reflectance) -> Law:
    worst, at, parts = 0.0, None, ""
    for view in direction(VIEWS, 0.3):
        w, solid, _ = _rings(view)
        inside = float((m.pdf(w, view) * solid).sum())
        s = m.sample(np.broadcast_to(view, (SAMPLES, 3)), lattice(SAMPLES))
        delta, lost = float(s.delta.mean()), float((s.pdf == 0.0).mean())
        error = abs(inside + delta + lost - 1.0)
        if at is None or error > worst:
            worst, at = error, view
            parts = f"hemisphere {inside:.4f} + delta lobes {delta:.4f} + below the horizon {lost:.4f}, expected 1"
    tolerance = 5e-3
    passed = worst <= tolerance
    rule = "|total - 1| = {value} <= {tolerance}"
    return Law("pdf", passed, worst, tolerance, rule, {} if passed else _degrees(wo=at), "" if passed else parts)


def _sampling(m: Reflectance) -> Law:
    worst, at, why = 0.0, None, ""
    for view in direction(VIEWS, 0.3):
        w, solid, bins = _rings(view)
        expected = np.bincount(bins, m.pdf(w, view) * solid)
        wo = np.broadcast_to(view, (SAMPLES, 3))
        s = m.sample(wo, lattice(SAMPLES))
        used = (s.pdf > 0.0) & ~s.delta
        observed = np.bincount(_bins_of(view, s.wi[used]), minlength=len(expected)) / SAMPLES
        distance = 0.5 * float(np.abs(observed - expected).sum())
        reason = f"the distributions of `sample` and `pdf` differ by {distance:.3g} in total variation"
        f = _values(m, s.wi, wo)
        weight = s.weight if s.weight.ndim == 2 else s.weight[:, None]
        with np.errstate(all="ignore"):
            ideal = f * s.wi[:, 2:] / s.pdf[:, None]
            off = np.abs(weight - ideal) / (np.abs(ideal) + 1e-6)
        off = float(np.nanmax(np.where(used[:, None], off, 0.0), initial=0.0))
        if off > max(distance, 1e-3):
            distance, reason = off, f"weight differs from f cos(theta_i)/pdf by {off:.3g}, relative"
        if at is None or distance > worst:
            worst, at, why = distance, view, reason
    tolerance = 2e-2
    passed = worst <= tolerance
    rule = "distance = {value} <= {tolerance}"
    return Law("sampling", passed, worst, tolerance, rule, {} if passed else _degrees(wo=at), "" if passed else why)


def _furnace(m: Reflectance) -> Law:
    views = direction(INCIDENCE, 0.3)
    mean = []
    for view in views:
        weight = m.sample(np.broadcast_to(view, (SAMPLES, 3)), lattice(SAMPLES)).weight
        mean.append(np.nan_to_num(weight).mean(axis=0))
    value_at = np.stack([np.atleast_1d(x) for x in mean])
    at, c = np.unravel_index(int(value_at.argmax()), value_at.shape)
    value, tolerance = float(value_at[at, c]), 1.0 + 5e-3
    why = (
        f"a body of this material would outshine a surround of radiance 1: L = {value:.4g}" if value > tolerance else ""
    )
    return Law(
        "furnace", value <= tolerance, value, tolerance, "max L = {value} <= {tolerance}", _degrees(wo=views[at]), why
    )
