"""`gn.plan`: the directions in which to measure, so that the numbers of a model become as sure as n values can make them."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..arguments import Within, checked
from ..base.angles import angles, direction
from ..base.reflectance import Reflectance
from ..errors import ParameterError, ShapeError, TooLargeError, TraceError, shown
from ..files import replacing
from ..formula.text import listed
from .covariance import NOTHING, PART, correlations
from .problem import Problem
from .result import Fit
from .samples import Samples, names_of, real, samples, suspected_lengths
from .unknowns import Unknowns, unknowns

CRITERIA = {
    "D": "least determinant of the covariance",
    "A": "least sum of relative variances",
}
"""Criterion -> its meaning."""

MOST = 1_000_000
"""Pairs of directions that a goniometer may have to choose from."""

TRIED = 20_000
"""Values, in all channels and models, from which every start chooses; the best goes on with all."""

PASSES = 50
"""Times that each direction may be exchanged."""

LEAST = 1e-10
"""Eigenvalue of the scaled information, from below which an exchange looks at what it would become."""

GAIN = 1e-9
"""Relative gain from which an exchange is made."""

FAINT = 1e-3
"""Share of the largest value below which a planned one is told: relative noise may not hold there."""


@dataclass(frozen=True)
class Goniometer:
    """Limits of an instrument, from which pairs of directions are chosen: regular steps between them.

    theta_i, theta_o   least and largest polar angle of light and detector
    phi                least and largest azimuth of the detector from that of the light; pi is forwards, as in a mirror
    phi_i              least and largest azimuth of the light. Without it 0 for isotropic materials, for which it means
                       nothing, else 0 to pi
    step_theta         step of polar angles
    step_phi           step of azimuths
    in_plane           only the plane of incidence: phi of 0 and pi
    least_angle        least angle between light and detector, where the one hides the other

    Units    rad.

    Example
    >>> arm = gn.Goniometer(theta_o=(0.0, np.radians(60.0)), in_plane=True, least_angle=np.radians(10.0))
    >>> wi, wo = arm.pairs()
    >>> print(len(wi), np.degrees(gn.angles(wo)[0].max()).round(1))
    1293 60.0
    """

    theta_i: tuple[float, float] = (0.0, math.radians(75.0))
    theta_o: tuple[float, float] = (0.0, math.radians(75.0))
    phi: tuple[float, float] = (0.0, math.pi)
    phi_i: tuple[float, float] | None = None
    step_theta: float = math.radians(2.5)
    step_phi: float = math.radians(5.0)
    in_plane: bool = False
    least_angle: float = math.radians(5.0)

    def __post_init__(self) -> None:
        if not isinstance(self.in_plane, (bool, np.bool_)):
            raise ParameterError(f"Goniometer(in_plane={shown(self.in_plane)}): expected True or False")
        for name in ("theta_i", "theta_o"):
            object.__setattr__(self, name, _range(name, getattr(self, name), 0.0, 0.5 * math.pi))
        object.__setattr__(self, "phi", _range("phi", self.phi, -2.0 * math.pi, 2.0 * math.pi))
        if self.phi_i is not None:
            object.__setattr__(self, "phi_i", _range("phi_i", self.phi_i, -2.0 * math.pi, 2.0 * math.pi))
        for name in ("step_theta", "step_phi"):
            step = _number(name, getattr(self, name))
            if not 0.0 < step <= math.pi or step == round(step):
                raise _refused(name, step, "a step [rad] above 0, such as numpy.radians(5)")
            object.__setattr__(self, name, step)
        least = _number("least_angle", self.least_angle)
        if not 0.0 <= least < 0.25 * math.pi:
            raise _refused("least_angle", least, "an angle [rad] from 0 to pi/4")
        object.__setattr__(self, "least_angle", least)

    def pairs(self, isotropic: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """The pairs of directions wi, wo (N, 3) that it can set, each once.

        Raises ParameterError where there is none, TooLargeError where there are more than a million.

        Example
        >>> wi, wo = gn.Goniometer(step_theta=np.radians(25.0), step_phi=np.radians(90.0), least_angle=0.0).pairs()
        >>> print(len(wi), gn.Goniometer().pairs()[0].shape)
        40 (34072, 3)
        """
        theta_i, theta_o = (_steps(limits, self.step_theta) for limits in (self.theta_i, self.theta_o))
        phi = _steps(self.phi, self.step_phi)
        if self.in_plane:
            phi = np.array([x for x in (0.0, math.pi) if self.phi[0] - 1e-9 <= x <= self.phi[1] + 1e-9])
        phi_i = self._azimuths(isotropic)
        count = len(theta_i) * len(theta_o) * len(phi) * len(phi_i)
        if count > MOST:
            raise TooLargeError(f"{self._told()}: {count} pairs of directions; expected at most {MOST}: larger steps")
        a, b, c, d = (x.ravel() for x in np.meshgrid(theta_i, theta_o, phi, phi_i, indexing="ij"))
        wi, wo = direction(a, d), direction(b, c + d)
        apart = np.arctan2(np.linalg.norm(np.cross(wi, wo), axis=-1), (wi * wo).sum(axis=-1))
        kept = np.flatnonzero(apart >= self.least_angle - 1e-9)
        if not len(kept):
            raise ParameterError(
                f"{self._told()}: no pair of directions is left of {count}; expected wider ranges, or a smaller least_angle"
            )
        if isotropic:  # azimuths are turned together: what counts is the angle between
            key = np.stack([wi[kept, 2], wo[kept, 2], (wi * wo).sum(axis=-1)[kept]], axis=-1)
        else:
            key = np.concatenate([wi[kept], wo[kept]], axis=-1)
        kept = kept[np.sort(np.unique(key.round(9) + 0.0, axis=0, return_index=True)[1])]
        return wi[kept], wo[kept]

    def _azimuths(self, isotropic: bool) -> np.ndarray:
        if self.phi_i is None:
            return np.zeros(1) if isotropic else _steps((0.0, math.pi), self.step_phi)
        return _steps(self.phi_i, self.step_phi)

    def _told(self) -> str:
        parts = [
            f"{name} {math.degrees(x[0]):g} to {math.degrees(x[1]):g}"
            for name, x in (
                ("theta_i", self.theta_i),
                ("theta_o", self.theta_o),
                ("phi", self.phi),
                ("phi_i", self.phi_i),
            )
            if x is not None
        ]
        return f"goniometer, {', '.join(parts)} degrees{', in plane' if self.in_plane else ''}"


def _number(name: str, value: Any) -> float:
    try:
        number = float(value) if not isinstance(value, (str, bytes)) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise ParameterError(f"Goniometer({name}={shown(value)}): expected a number [rad]")
    return number


def _range(name: str, value: Any, low: float, high: float) -> tuple[float, float]:
    """A range of angles within bounds."""
    try:
        first, last = value
    except (TypeError, ValueError):
        raise ParameterError(
            f"Goniometer({name}={shown(value)}): expected two angles [rad], (least, largest)"
        ) from None
    limits = _number(name, first), _number(name, last)
    for x in limits:
        if not low - 1e-9 <= x <= high + 1e-9:
            raise _refused(name, x, f"angles [rad] from {low:.4g} to {high:.4g}")
    if limits[0] > limits[1]:
        raise ParameterError(f"Goniometer({name}={shown(value)}): expected the least angle first, then the largest")
    return limits


def _refused(name: str, x: float, expected: str) -> ParameterError:
    degrees = f"; in degrees? numpy.radians({x:g}) = {math.radians(x):.4g}" if x >= 1.0 else ""
    return ParameterError(f"Goniometer({name}={x:g}): expected {expected}{degrees}")


def _steps(limits: tuple[float, float], step: float) -> np.ndarray:
    low, high = limits
    return low + step * np.arange(math.floor((high - low) / step + 1e-6) + 1)


class _Information(NamedTuple):
    """What candidates tell of the n unknowns of one expected model, in units in which all of them together tell 1 of each.

    rows      (N, C, n) derivatives of each value over its uncertainty
    known     (n, n) information from before
    weights   (n,) of the variances in the criterion "A"
    size      (n,) unit of each unknown
    """

    rows: np.ndarray
    known: np.ndarray
    weights: np.ndarray
    size: np.ndarray

    @classmethod
    def of(cls, rows: np.ndarray, known: np.ndarray, values: np.ndarray) -> _Information:
        every = np.einsum("kci,kci->i", rows, rows) / len(rows) + np.diag(known)
        size = 1.0 / np.sqrt(np.where(every > 0.0, every, 1.0))
        with np.errstate(divide="ignore"):
            weights = (size / values) ** 2
        return cls(rows * size, known * size[:, None] * size, weights, size)

    def at(self, which: np.ndarray) -> _Information:
        return self._replace(rows=self.rows[which])

    def matrix(self, chosen: np.ndarray) -> np.ndarray:
        rows = self.rows[chosen].reshape(-1, len(self.size))
        return self.known + rows.T @ rows

    @property
    def mean(self) -> np.ndarray:
        """The information (n, n) of a direction on average."""
        rows = self.rows.reshape(-1, len(self.size))
        return rows.T @ rows / len(self.rows)


def _goodness(matrices: Sequence[np.ndarray], infos: Sequence[_Information], criterion: str) -> float:
    """What is largest for the best plan: ln det of the information, or less the sum of relative variances; the mean over
    models."""
    found = []
    for matrix, info in zip(matrices, infos, strict=True):
        values, vectors = np.linalg.eigh(matrix)
        values = np.maximum(values, LEAST)
        found.append(np.log(values).sum() if criterion == "D" else -(info.weights[:, None] * vectors**2 / values).sum())
    return float(np.mean(found))


def _gains(matrices: Sequence[np.ndarray], infos: Sequence[_Information], criterion: str) -> np.ndarray:
    """By how much each candidate (N,), added, would raise the goodness: updates of low rank, all candidates at once."""
    total = np.zeros(len(infos[0].rows))
    for matrix, info in zip(matrices, infos, strict=True):
        values, vectors = np.linalg.eigh(matrix)
        root = vectors / np.sqrt(np.maximum(values, LEAST))
        turned = info.rows @ root
        if turned.shape[1] == 1:
            turned = turned[:, 0]
            leverage = np.einsum("ki,ki->k", turned, turned)
            if criterion == "D":
                total += np.log1p(leverage)
            else:
                variance = (turned @ root.T) ** 2 @ info.weights
                total += variance / (1.0 + leverage)
            continue
        turns = np.swapaxes(turned, 1, 2)
        leverage = np.eye(turned.shape[1]) + turned @ turns
        if criterion == "D":
            total += np.linalg.slogdet(leverage)[1]
        else:
            effect = turned @ root.T * np.sqrt(info.weights)
            total += np.trace(np.linalg.solve(leverage, effect @ np.swapaxes(effect, 1, 2)), axis1=1, axis2=2)
    return total / len(infos)


def _start(
    infos: Sequence[_Information], count: int, criterion: str, repeats: bool, random: np.random.Generator | None
) -> np.ndarray:
    """Candidates (count,) chosen greedily, the first half of them by chance."""
    candidates = len(infos[0].rows)
    chosen: list[int] = []
    if random is not None:
        chosen = random.choice(candidates, max(count // 2, 1), replace=repeats).tolist()
    while len(chosen) < count:
        gains = _gains([info.matrix(np.array(chosen, int)) for info in infos], infos, criterion)
        if not repeats:
            gains[chosen] = -np.inf
        chosen.append(int(np.argmax(gains)))
    return np.array(chosen)


def _exchanged(
    infos: Sequence[_Information], chosen: np.ndarray, criterion: str, repeats: bool
) -> tuple[np.ndarray, float]:
    """Candidates after exchanges, one at a time for the best other one, until none helps; and the goodness."""
    chosen = chosen.copy()
    best = _goodness([info.matrix(chosen) for info in infos], infos, criterion)
    for _ in range(PASSES):
        before = best
        for k in range(len(chosen)):
            others = np.delete(chosen, k)
            gains = _gains([info.matrix(others) for info in infos], infos, criterion)
            if not repeats:
                gains[others] = -np.inf
            trial = chosen.copy()
            trial[k] = int(np.argmax(gains))
            if trial[k] == chosen[k]:
                continue
            found = _goodness([info.matrix(trial) for info in infos], infos, criterion)
            if found > best + GAIN * max(abs(best), 1.0):
                chosen, best = trial, found
        if best == before:
            break
    return chosen, best


def _best(
    infos: Sequence[_Information], count: int, criterion: str, repeats: bool, starts: int, seed: int
) -> np.ndarray:
    """The best choice of all starts."""
    random = np.random.default_rng(seed)
    candidates, channels = infos[0].rows.shape[:2]
    few = max(TRIED // (channels * len(infos)), 4 * count)
    part = np.arange(candidates)
    if few < candidates:
        part = np.sort(random.choice(candidates, few, replace=False))
    some = [info.at(part) for info in infos]
    ends = [
        _exchanged(some, _start(some, count, criterion, repeats, random if k else None), criterion, repeats)
        for k in range(starts)
    ]
    chosen = part[max(ends, key=lambda end: end[1])[0]]
    return chosen if few >= candidates else _exchanged(infos, chosen, criterion, repeats)[0]


@dataclass(frozen=True, eq=False)
class Plan:
    """What `plan` chose, and what is to be expected of it. It prints as a table.

    wi, wo       (n, 3) the pairs of directions, in the order of theta_i, phi_i, phi, theta_o
    f            (n,) or (n, C) the values to be expected [1/sr]
    names        of the unknowns: paths of parameters, "[2]" after those with a number for each channel
    values       (p,) their expected numbers; those of the first model where there are several
    covariance   (p, p) of the numbers after the measurement, with what was measured before
    criterion    "D" or "A"
    value        of the criterion: ln of the determinant of the covariance, or the sum of relative variances; the mean
                 over the models
    regular      how many pairs of a regular grid have the same criterion: all that the goniometer can set, each as
                 often
    in_plane     how many pairs of scans in the plane of incidence have it, of all polar angles; inf where they cannot
    before       standard errors by name of what was measured before; empty without
    notes        what should be known before measuring: each a sentence

    Error    of first order: standard errors that a fit by likelihood shows over many measurements are these within 5 %
             at 1 % noise (benchmarks/planning.txt), where the model is right.

    Example
    >>> planned = gn.plan(gn.Lambertian(0.5), 4)
    >>> print({name: round(s, 4) for name, s in planned.stderr.items()})  # 1 % of 0.5, over the root of 4
    {'rho': 0.0025}
    """

    wi: np.ndarray
    wo: np.ndarray
    f: np.ndarray
    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    criterion: str
    value: float
    regular: float
    in_plane: float
    before: dict[str, float]
    noise: float
    floor: float
    notes: tuple[str, ...]
    model: Reflectance = field(repr=False)

    def __len__(self) -> int:
        return len(self.wi)

    @property
    def angles(self) -> np.ndarray:
        """(n, 4) theta_i, phi_i, theta_o, phi_o [degrees], phi_o - phi_i from 0 to 360.

        Example
        >>> arm = gn.Goniometer(theta_i=(0.5, 0.5), theta_o=(0.5, 0.5), phi=(np.pi, np.pi))
        >>> print(gn.plan(gn.Lambertian(0.5), 1, goniometer=arm).angles.round(2))
        [[ 28.65   0.    28.65 180.  ]]
        """
        (theta_i, phi_i), (theta_o, phi_o) = (angles(w) for w in (self.wi, self.wo))
        phi_i = np.where(self.wi[:, 2] > 1.0 - 1e-15, 0.0, phi_i)
        phi = (phi_o - phi_i + 1e-12) % (2.0 * math.pi)
        phi = np.where(self.wo[:, 2] > 1.0 - 1e-15, 0.0, phi)
        return np.degrees(np.stack([theta_i, phi_i, theta_o, phi_i + phi], axis=-1)).round(9) + 0.0

    @property
    def stderr(self) -> dict[str, float]:
        """Expected standard errors by name."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlation(self) -> np.ndarray:
        """Expected correlation matrix (p, p)."""
        return correlations(self.covariance)

    @property
    def efficiency(self) -> float:
        """How many times as much a planned direction tells as one of a regular grid, all in all: `regular` over n."""
        return self.regular / len(self)

    def to_csv(self, path: str | os.PathLike | None = None) -> str:
        """The directions as a CSV table with empty columns of values; written to a file where there is a path.

        Angles are in degrees. With the columns filled, `gn.load` and `gn.fit` read it; a column u_f beside may hold
        standard uncertainties.

        Example
        >>> print(gn.plan(gn.Lambertian(0.5), 1).to_csv().splitlines()[-2])
        theta_i,phi_i,theta_o,phi_o,f
        """
        channels = self.model.channel_names
        if self.f.ndim == 1:
            columns = ["f"]
        else:
            columns = [f"f_{name}" for name in names_of(channels if channels is not None else range(self.f.shape[1]))]
        lines = [
            f"# planned for: {' '.join(repr(self.model).split()):.300}",
            f"# planned by: gonio, {CRITERIA[self.criterion]}, {self._noise()}",
            "# unit of f: 1/sr; angles in degrees; phi_o - phi_i = 180 is forwards",
            ",".join(["theta_i", "phi_i", "theta_o", "phi_o", *columns]),
        ]
        lines += [",".join([*(f"{x:.10g}" for x in row), *("" for _ in columns)]) for row in self.angles]
        text = "\n".join(lines) + "\n"
        if path is not None:
            with replacing(path) as new:
                new.write_text(text, encoding="utf-8")
        return text

    def save(self, path: str | os.PathLike) -> None:
        """Write the directions to a file: a CSV table, see `to_csv`, or all of `to_json` where its name ends in .json.

        Raises ParameterError for another suffix.

        Example
        >>> gn.plan(gn.Lambertian(0.5), 4).save("plan.csv")
        >>> open("plan.csv").read().count(",,")
        0
        """
        suffix = os.path.splitext(os.fspath(path))[1].lower()
        if suffix in (b".csv", ".csv"):
            self.to_csv(path)
        elif suffix in (b".json", ".json"):
            with replacing(path) as new:
                new.write_text(json.dumps(self.to_json(), indent=2) + "\n", encoding="utf-8")
        else:
            raise ParameterError(f"{shown(path)}: expected a name that ends in .csv or .json")

    def to_json(self) -> dict[str, Any]:
        """The result as numbers, lists and words, for files; infinite numbers as None.

        Example
        >>> print(sorted(gn.plan(gn.Lambertian(0.5), 4).to_json())[:4])
        ['before', 'correlation', 'covariance', 'criterion']
        """
        return {
            "model": repr(self.model),
            "directions": [
                dict(zip(("theta_i", "phi_i", "theta_o", "phi_o"), row, strict=True)) for row in self.angles.tolist()
            ],
            "f": self.f.tolist(),
            "parameters": {
                name: {"value": float(v), "stderr": s}
                for (name, s), v in zip(self.stderr.items(), self.values, strict=True)
            },
            "covariance": self.covariance.tolist(),
            "correlation": [[_finite(x) for x in row] for row in self.correlation.tolist()],
            "criterion": self.criterion,
            "value": self.value,
            "regular": _finite(self.regular),
            "in_plane": _finite(self.in_plane),
            "before": {name: _finite(s) for name, s in self.before.items()},
            "noise": self.noise,
            "floor": self.floor,
            "notes": list(self.notes),
        }

    def rows(self) -> list[list[str]]:
        """The directions as text: theta_i, phi_i, theta_o, phi_o - phi_i [degrees], f, and how often, each once.

        Example
        >>> print(gn.plan(gn.Lambertian(0.5), 4, repeats=True).rows()[0][-1])
        4
        """
        found, times = (
            np.unique(np.column_stack([self.angles, np.reshape(self.f, (len(self), -1))]), True, axis=0)[:2],
            0,
        )
        rows = []
        for k in np.sort(found[1]):
            a, f = self.angles[k], np.atleast_1d(self.f[k])
            times = int((self.angles == a).all(axis=1).sum())
            text = " ".join(f"{x:.4g}" for x in f[:4]) + (" ..." if len(f) > 4 else "")
            rows.append([f"{a[0]:g}", f"{a[1]:g}", f"{a[2]:g}", f"{a[3] - a[1]:g}", text, str(times)])
        return rows

    def _noise(self) -> str:
        floor = f" and {self.floor:g} /sr" if self.floor else ""
        return f"noise {100.0 * self.noise:g} %{floor}"

    def _summary(self) -> list[str]:
        """Sentences about what it is worth."""
        known = " beside what was measured" if self.before else ""
        lines = [
            f"{len(self)} pairs of directions{known}; {self.criterion}: {CRITERIA[self.criterion]}; {self._noise()}"
        ]
        told = []
        for number, what in (
            (self.regular, "of a regular grid of these angles"),
            (self.in_plane, "of scans in the plane"),
        ):
            told.append(f"{number:.0f} {what}" if number < 1e7 else f"no number {what}")
        lines.append(f"the same would take {told[0]}, or {told[1]} of incidence")
        return lines

    def _parameters(self) -> list[list[str]]:
        rows = []
        for (name, s), value in zip(self.stderr.items(), self.values, strict=True):
            share = f"{s / abs(value):.2%}" if value else ""
            was = [f"{self.before[name]:.2g}" if math.isfinite(self.before[name]) else "unknown"] if self.before else []
            rows.append([name, f"{value:.4g}", f"{s:.2g}", share, *was])
        return rows

    def __str__(self) -> str:
        head, *rest = self._summary()
        parts = [f"{self.model!r:.200}", head, ""]
        parts += _aligned([list(HEADER), *self.rows()])
        before = ["before"] if self.before else []
        parts += ["", *_aligned([["parameter", "expected", "std. error", "relative", *before], *self._parameters()])]
        parts += ["", *rest]
        if self.notes:
            parts += ["", "note", *(f"  - {text}" for text in self.notes)]
        return "\n".join(parts)

    def __repr__(self) -> str:
        told = ", ".join(f"{name} ± {s:.2g}" for name, s in [*self.stderr.items()][:8])
        return f"<Plan of {len(self)} pairs of directions: {told}{', ...' if len(self.names) > 8 else ''}>"

    def _repr_html_(self) -> str:
        """Tables for notebooks."""
        before = ["before"] if self.before else []
        tables = (
            [list(HEADER), *self.rows()],
            [["parameter", "expected", "standard error", "relative", *before], *self._parameters()],
        )
        text = f"<p><code>{escape(repr(self.model)[:300])}</code><br>{escape('. '.join(self._summary()))}</p>"
        for head, *rows in tables:
            cells = "".join("<tr>" + "".join(f"<td>{escape(x)}</td>" for x in row) + "</tr>" for row in rows)
            text += f"<table><tr>{''.join(f'<th>{escape(x)}</th>' for x in head)}</tr>{cells}</table>"
        return text + (f"<ul>{''.join(f'<li>{escape(x)}</li>' for x in self.notes)}</ul>" if self.notes else "")


HEADER = ("theta_i [°]", "phi_i [°]", "theta_o [°]", "phi_o - phi_i [°]", "expected f [1/sr]", "times")
"""Columns of `Plan.rows`."""


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[c]) for row in rows) for c in range(len(rows[0]))]
    return ["  " + "  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows]


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None


@checked
def plan(
    model: Reflectance | Sequence[Reflectance],
    n: Annotated[int, Within(1, 10_000)],
    criterion: str = "D",
    *,
    goniometer: Goniometer | None = None,
    noise: float = 0.01,
    floor: float = 0.0,
    by: Iterable[str] | None = None,
    per_channel: bool | Iterable[str] | None = None,
    repeats: bool = False,
    measured: Any = None,
    candidates: Any = None,
    starts: Annotated[int, Within(1, 10_000)] = 8,
    seed: Annotated[int, Within(0, 2**63)] = 0,
) -> Plan:
    """The n pairs of directions that a goniometer can set, of which f tells most about the numbers of a model.

    The information of a plan is J^T J, J the exact derivatives of f over its uncertainty u,
    u^2 = (noise f)^2 + floor^2, at the numbers of `model`, those to be expected; its inverse is the covariance of a fit.
    Pairs are chosen one by one, then each is exchanged for the best other one until none helps, from several starts.

    `model`: with several, of one structure, the criterion is the mean over all.
    `criterion`: "D", the least determinant of the covariance, which no unit or scale of a parameter enters; or "A", the
    least sum of squares of the relative standard errors.
    `goniometer`: the limits; without it polar angles to 75 degrees in steps of 2.5, azimuths in steps of 5, light and
    detector 5 degrees apart. `candidates`: (wi, wo) with (N, 3) each, in its place: the pairs to choose from.
    `noise`: relative standard uncertainty of a value. `floor`: absolute [1/sr].
    `by`, `per_channel`: what will be fitted, as for `gn.fit`.
    `repeats`: whether a pair may be taken more than once.
    `measured`: what is known already: a `Fit` of the same parameters, a measurement, (wi, wo, f) or (wi, wo, f, u);
    without u its uncertainty is that of `noise` and `floor`.
    `starts`: how many; `seed`: of the random ones.

    Shapes   wi, wo of the plan: (n, 3).
    Units    f and floor: 1/sr.
    Error    the plan is a local optimum: other starts and seeds change D by less than 1 % of a standard error, as a rule.
             Of the errors that it expects: see `Plan`.
    Source   Fedorov 1972, "Theory of Optimal Experiments"; Cook & Nachtsheim 1980, Technometrics 22, 315 (exchanges of
             one at a time); Atkinson, Donev & Tobias 2007, "Optimum Experimental Designs, with SAS".

    Example
    >>> paint = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.2), gn.Schlick(0.04))
    >>> planned = gn.plan(paint, 12)
    >>> print(len(planned), planned.names, planned.efficiency > 4.0)
    12 ('0.rho', '1.distribution.alpha_x', '1.fresnel.F0') True
    """
    models = [model] if isinstance(model, Reflectance) else list(model)
    if not models:
        raise ParameterError("model: got no models; expected one, or several of one structure")
    if criterion not in CRITERIA:
        raise ParameterError(f"criterion={criterion!r:.60}: expected one of {listed(CRITERIA)}")
    if not 0.0 <= noise < 1.0 or not 0.0 <= floor < math.inf or not noise + floor > 0.0:
        percent = f"; in percent? {noise:g} % is {noise / 100.0:g}" if 1.0 <= noise <= 100.0 else ""
        raise ParameterError(
            f"noise={noise:g}, floor={floor:g}: expected a relative noise from 0 to 1 and a floor [1/sr] from 0, one "
            f"of them above 0{percent}"
        )
    if isinstance(measured, Fit) and by is None and per_channel is None:
        fitted = measured.problem.unknowns
        by = [f.path for f in fitted.free]
        per_channel = [f.path for f in fitted.free if f.by_channel] or None
    every = [_unknowns(m, models[0], by, per_channel) for m in models]
    isotropic = all(m.is_isotropic() for m in models)
    wi, wo = _pairs(goniometer, candidates, isotropic)
    tellers = [_Teller(u, noise, floor) for u in every]
    expected = [teller.f(wi, wo) for teller in tellers]
    usable = np.all([_usable(f, noise, floor) for f in expected], axis=0)
    if not usable.any():
        raise ParameterError(
            f"{models[0]!r:.80}: f is 0 or no number at all {len(wi)} pairs of directions; expected a floor above 0, or "
            f"other limits of the goniometer"
        )
    wi, wo = wi[usable], wo[usable]
    known = [_known(measured, teller) for teller in tellers]
    infos = [
        _Information.of(teller.rows(wi, wo), before, teller.values)
        for teller, before in zip(tellers, known, strict=True)
    ]
    names = every[0].names
    _require_enough(infos, names, n, repeats, models, isotropic)
    if criterion == "A":
        for teller in tellers:
            for name, value in zip(names, teller.values, strict=True):
                if value == 0.0:
                    raise ParameterError(
                        f"criterion='A': {name} is 0, and has no relative error; expected another number, criterion='D', "
                        f"or `by` without it"
                    )
    chosen = _best(infos, n, criterion, repeats, starts, seed)
    chosen = chosen[_order(wi[chosen], wo[chosen])]
    matrices = [info.matrix(chosen) for info in infos]
    _require_determined(matrices, names, n)
    covariances = [
        np.linalg.inv(matrix) * info.size[:, None] * info.size for matrix, info in zip(matrices, infos, strict=True)
    ]
    if criterion == "D":
        value = float(np.mean([np.linalg.slogdet(c)[1] for c in covariances]))
    else:
        value = float(np.mean([(np.diag(c) / t.values**2).sum() for c, t in zip(covariances, tellers, strict=True)]))
    goodness = _goodness(matrices, infos, criterion)
    flat = np.abs(wi[:, 0] * wo[:, 1] - wi[:, 1] * wo[:, 0]) < 1e-9
    covariance = np.mean(covariances, axis=0)
    f = tellers[0].f(wi[chosen], wo[chosen])
    return Plan(
        wi[chosen],
        wo[chosen],
        f if models[0].channels is not None else f[:, 0],
        names,
        tellers[0].values,
        covariance,
        criterion,
        value,
        _equivalent(infos, goodness, criterion),
        _equivalent([info.at(flat) for info in infos], goodness, criterion) if flat.any() else math.inf,
        {} if measured is None else _errors_before(infos, names),
        noise,
        floor,
        tuple(_notes(every[0], f, usable, noise, floor, covariance)),
        models[0],
    )


def _unknowns(m: Reflectance, first: Reflectance, by: Any, per_channel: Any) -> Unknowns:
    if m.sides != "front" or m.has_delta:
        what = "a perfect mirror" if m.has_delta else "it transmits light"
        raise ParameterError(f"{m!r:.80}: {what}; expected a model whose f is finite, of one side")
    if m.channels != first.channels:
        raise ParameterError(
            f"model: {m!r:.80} has channels {m.channels}, the first model {first.channels}; expected one structure"
        )
    try:
        found = unknowns(m, m.channels or 1, by, per_channel)
        names = found.names if m is first else unknowns(first, m.channels or 1, by, per_channel).names
    except TraceError as error:
        raise ParameterError(f"{m!r:.80}: has no derivatives: {error}") from None
    if found.names != names:
        raise ParameterError(
            f"model: {m!r:.80} has the parameters {listed(found.names)}, the first model {listed(names)}; expected one "
            f"structure"
        )
    return found


def _pairs(goniometer: Goniometer | None, candidates: Any, isotropic: bool) -> tuple[np.ndarray, np.ndarray]:
    """The pairs of directions (N, 3) to choose from."""
    if candidates is None:
        return (goniometer or Goniometer()).pairs(isotropic)
    if goniometer is not None:
        raise ParameterError("candidates and goniometer: expected one of them; select those within the limits yourself")
    if not isinstance(candidates, (tuple, list)) or len(candidates) != 2:
        raise ParameterError(f"candidates={shown(candidates)}: expected (wi, wo) with directions (N, 3)")
    wi, wo = (real(name, w) for name, w in zip(("wi", "wo"), candidates, strict=True))
    if wi.ndim != 2 or wi.shape != wo.shape or wi.shape[1] != 3 or not len(wi):
        raise ShapeError(f"candidates: got shapes {wi.shape} and {wo.shape}; expected (N, 3) for both")
    for name, w in (("wi", wi), ("wo", wo)):
        suspected_lengths(f"candidates, {name}", w)
    up = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0)
    if not up.any():
        raise ParameterError(
            f"candidates: none of {len(wi)} pairs is above the surface; expected directions with z > 0"
        )
    return wi[up], wo[up]


class _Teller:
    """What values tell of the unknowns of a model: derivatives over uncertainties."""

    def __init__(self, unknowns: Unknowns, noise: float, floor: float):
        self.unknowns, self.noise, self.floor = unknowns, noise, floor
        self.values = unknowns.numbers(unknowns.start)

    def f(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """(N, C) expected values."""
        u = self.unknowns
        return np.array(np.broadcast_to(np.reshape(u.model.f(wi, wo), (len(wi), -1)), (len(wi), u.channels)))

    def rows(self, wi: np.ndarray, wo: np.ndarray, u: np.ndarray | None = None, valid: Any = True) -> np.ndarray:
        """(N, C, n) derivatives over the uncertainties u (N, C), or over those of the noise."""
        f = self.f(wi, wo)
        u = np.hypot(self.noise * f, self.floor) if u is None else u
        valid = np.broadcast_to(valid, f.shape) & (u > 0.0)
        data = Samples(wi, wo, f, np.where(valid, u, 1.0), valid, None, {}, "")
        jacobian = Problem(data, self.unknowns, "likelihood", "none", 1.0).jacobian(self.values)
        rows = np.moveaxis(jacobian.reshape(f.shape[1], len(wi), -1), 0, 1)
        return np.where(np.isfinite(rows), rows, 0.0)


def _usable(f: np.ndarray, noise: float, floor: float) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return (np.isfinite(f) & (np.hypot(noise * f, floor) > 0.0)).all(axis=1)


def _known(measured: Any, teller: _Teller) -> np.ndarray:
    """The information (n, n) of what was measured."""
    names = teller.unknowns.names
    if measured is None:
        return np.zeros((len(names), len(names)))
    if isinstance(measured, Fit):
        if measured.names != names:
            raise ParameterError(
                f"measured: a fit of {listed(measured.names)}; expected one of {listed(names)}: "
                f"gn.plan(fit.model, n, measured=fit)"
            )
        return _of_fit(measured)
    data = samples(measured)
    if data.f.shape[1] != teller.unknowns.channels:
        raise ShapeError(
            f"measured: {data.source} has {data.f.shape[1]} channels; expected {teller.unknowns.channels}, as the model"
        )
    rows = teller.rows(data.wi, data.wo, data.u, data.valid).reshape(-1, len(names))
    return rows.T @ rows


def _of_fit(fit: Fit) -> np.ndarray:
    """The information of a fit: the inverse of its covariance, without those parts that the data say nothing about.

    Of a likelihood A = J^T J; otherwise A S^-1 A (N - n)/N, the inverse of the covariance that `Fit` has. Numbers at
    their bounds are counted as if they were not.
    """
    problem = fit.problem
    u = problem.unknowns
    x = u.internal(fit.values)[None]
    slopes = u.slopes(x[0])
    found = problem.squares(x).matrix[0] / slopes[:, None] / slopes
    if problem.loss == "likelihood" and problem.robust == "none":
        return found
    scores = problem.score_squares(x)[0] / slopes[:, None] / slopes
    size = np.sqrt(np.where(np.diag(scores) > 0.0, np.diag(scores), 1.0))
    inverse = np.linalg.pinv(scores / size[:, None] / size, rcond=NOTHING, hermitian=True) / size[:, None] / size
    information: np.ndarray = found @ inverse @ found * (max(fit.free, 1) / fit.used)
    return 0.5 * (information + information.T)


def _unsure(matrix: np.ndarray, names: Sequence[str]) -> list[str]:
    """Names of the unknowns that an information matrix does not determine."""
    diagonal = np.diag(matrix)
    size = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(matrix / size[:, None] / size)
    lost = (np.abs(vectors[:, values <= NOTHING * max(values[-1], 1e-300)]) > PART).any(axis=1) | ~(diagonal > 0.0)
    return [name for name, out in zip(names, lost, strict=True) if out]


def _require_enough(
    infos: Sequence[_Information],
    names: Sequence[str],
    n: int,
    repeats: bool,
    models: Sequence[Reflectance],
    isotropic: bool,
) -> None:
    """Raises ParameterError where no plan can determine all unknowns, which are then said."""
    candidates, channels = infos[0].rows.shape[:2]
    for info, m in zip(infos, models, strict=True):
        if unsure := _unsure(info.known + info.mean, names):
            turned = "" if isotropic else "; a range of phi_i lets the sample be turned"
            raise ParameterError(
                f"{m!r:.80}: no choice of {candidates} pairs of directions determines {listed(unsure)}; expected `by` "
                f"without some of them, or wider limits of the goniometer{turned}"
            )
    rank = max(int(np.linalg.matrix_rank(info.known, tol=1e-12, hermitian=True)) for info in infos)
    if n * channels < len(names) - rank:
        least = math.ceil((len(names) - rank) / channels)
        raise ParameterError(
            f"n={n}: expected at least {least} pairs of directions for {len(names)} unknowns ({listed(names[:12])}); "
            f"more, or fix some by `by`"
        )
    if not repeats and n > candidates:
        raise ParameterError(
            f"n={n}: expected at most {candidates}, the pairs of directions there are; smaller steps, or repeats=True"
        )


def _require_determined(matrices: Sequence[np.ndarray], names: Sequence[str], n: int) -> None:
    for matrix in matrices:
        if unsure := _unsure(matrix, names):
            raise ParameterError(
                f"n={n}: so few pairs of directions do not determine {listed(unsure)}; expected more, or `by` without some"
            )


def _order(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """An order for the arms: theta_i, phi_i, phi, theta_o."""
    (theta_i, phi_i), (theta_o, phi_o) = (angles(w) for w in (wi, wo))
    keys = (theta_o, (phi_o - phi_i + 1e-9) % (2.0 * math.pi), phi_i, theta_i)
    return np.lexsort([key.round(9) for key in keys])


def _equivalent(infos: Sequence[_Information], goodness: float, criterion: str) -> float:
    """How many directions, taken alike from all candidates, have a goodness; inf where none have."""
    means = [info.mean for info in infos]
    if any(_unsure(info.known + mean, [""] * len(mean)) for info, mean in zip(infos, means, strict=True)):
        return math.inf
    low, high = -3.0, 12.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        matrices = [info.known + 10.0**middle * mean for info, mean in zip(infos, means, strict=True)]
        if _goodness(matrices, infos, criterion) < goodness:
            low = middle
        else:
            high = middle
    return 10.0**high


def _errors_before(infos: Sequence[_Information], names: Sequence[str]) -> dict[str, float]:
    """Standard errors of what was measured before; inf for what it does not determine."""
    known, size = infos[0].known, infos[0].size
    unsure = _unsure(known, names)
    variance = np.diag(np.linalg.pinv(known, rcond=NOTHING, hermitian=True)) * size**2
    return {
        name: math.inf if name in unsure else float(math.sqrt(max(v, 0.0)))
        for name, v in zip(names, variance, strict=True)
    }


def _notes(
    u: Unknowns, f: np.ndarray, usable: np.ndarray, noise: float, floor: float, covariance: np.ndarray
) -> Iterator[str]:
    """Sentences about a plan."""
    if out := int((~usable).sum()):
        yield f"{out} of {len(usable)} pairs of directions were left out: f is 0 or no number there"
    if not floor and f.min() < FAINT * f.max():
        yield (
            f"f falls to {f.min():.2g} /sr, {f.min() / f.max():.1g} of the largest; where noise does not fall with it, "
            f"give a floor"
        )
    spread = np.sqrt(np.diag(covariance))
    numbers, low, high = (u.numbers(x) for x in (u.start, u.low, u.high))
    for name, value, s, a, b in zip(u.names, numbers, spread, low, high, strict=True):
        if min(value - a, b - value) < 2.0 * s:
            yield (
                f"{name} = {value:.4g} is within two standard errors of a bound, {a if value - a < b - value else b:g}: a "
                f"fit will be surer than this, and not symmetric"
            )
        elif value and s > 0.5 * abs(value):
            yield f"{name} would be known to {s / abs(value):.0%} only: more directions, or a fixed number, would help"
    correlation = correlations(covariance)
    for i, j in zip(*np.triu_indices(len(u.names), 1), strict=True):
        if abs(correlation[i, j]) > 0.95:
            yield f"{u.names[i]} and {u.names[j]} will be hard to tell apart (correlation {correlation[i, j]:+.3f})"
