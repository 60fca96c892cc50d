"""Whole tables from few values: the posterior of a basis of reflectances, by linear regression of ln f."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple

import numpy as np
from scipy.special import gammaincc, ndtri

from ..declared.arguments import Declared, Seed, checked
from ..declared.notebooks import repr_html
from ..errors import ParameterError, shown
from ..fitting.samples import Samples, names_of
from ..integrals.albedo import albedo
from ..tables.gridded import Gridded
from .basis import BasisRows, ReflectanceBasis

DISCREPANCIES = [0.0, *np.geomspace(0.005, 1.0, 9).tolist()]
"""Standard deviations of ln f that are tried for what a material has beside the basis."""

FAR = 0.01
"""Chance of as large a chi-square, below which values are far from the basis."""

SPREADS = 1e-9, 1e9
"""Least and largest relative uncertainty that a value is taken to have."""

FREEDOM = 2.0
"""Degrees of freedom of Student's distribution, where values are far from the basis."""

STEPS = 5
"""Rounds of its weights."""

ENOUGH = 2000
"""Values by which the discrepancy is chosen."""

UNSURE = 0.5
"""Standard deviation of ln f from which a value is called unsure."""


class Posterior(NamedTuple):
    """What values of one channel say of the coefficients of a basis.

    mean          (k,)
    covariance    (k, k), widened
    discrepancy   standard deviation of ln f that the values ask for beside the basis
    widening      the factor of all variances that the values ask for, 1 at least
    chi2          of the values, as the basis foretells them without either; `of`: their number
    rms           of what is left of ln f
    """

    mean: np.ndarray
    covariance: np.ndarray
    discrepancy: float
    widening: float
    chi2: float
    of: int
    rms: float


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """What `reconstruct` found: a table of f at all angles, and how sure it is. It prints as a report.

    reflectance    a `Gridded` of half and difference angles, with half of the 68 % interval of f as its uncertainty;
                   f is the median of the posterior
    coefficients   (k,) or (C, k) posterior mean of the coefficients of the basis; before the measurement 0 +- 1
    covariance     (k, k) or (C, k, k) of them
    discrepancy    a number or (C,): standard deviation of ln f that the values ask for beside the basis
    widening       a number or (C,): the factor of all variances that the values ask for, 1 at least: chi2 over its
                   expectation, discrepancy included
    chi2           a number or (C,): sum of squares of the values, each over its variance as the basis foretells it;
                   about `used` for a material like those of the basis
    used           how many values counted, values in one cell of the table as one: a number or (C,)
    rms            a number or (C,): root mean square of what the reconstruction leaves of ln f of the values
    log_u          (grid[, C]) standard deviation of ln(f + offset) at the nodes
    notes          what should be known: each a sentence

    Error    of a table 95 to 97 % was within two standard deviations of ln f, of materials left out of a basis without
             departure; of measured files 84 to 100 % (benchmarks/reconstruction.txt).

    Example
    >>> m = gn.material("blue-fabric")
    >>> planned = gn.planning.plan_table(10)
    >>> found = gn.reconstruction.reconstruct((planned.wi, planned.wo, m.f(planned.wi, planned.wo)))
    >>> print(found.coefficients.shape, found.reflectance.stored.shape)
    (3, 40) (90, 32, 9, 3)
    """

    _repr_html_ = repr_html

    reflectance: Gridded
    coefficients: np.ndarray
    covariance: np.ndarray
    discrepancy: Any
    widening: Any
    chi2: Any
    used: Any
    rms: Any
    log_u: np.ndarray
    notes: tuple[str, ...]
    source: str
    basis: ReflectanceBasis = field(repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.reflectance, Gridded) or not isinstance(self.basis, ReflectanceBasis):
            raise ParameterError(
                f"Reconstruction(reflectance={shown(self.reflectance)}): expected what "
                f"gn.reconstruction.reconstruct(data) makes; call that"
            )

    @property
    def stderr(self) -> np.ndarray:
        """Standard deviations of the coefficients, of their shape; 1 where nothing is known, if `widening` is 1.

        Example
        >>> found = gn.reconstruction.reconstruct((gn.direction([0.5], 0.0), gn.direction([0.5], 2.0), [0.05]))
        >>> print((found.stderr <= 1.0).all(), found.stderr.min() < 0.9)
        True True
        """
        return np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))

    @property
    def error(self) -> Any:
        """The error of ln f to be expected, a number or (C,): the root mean square over all pairs of directions,
        weighted by both cosines.

        Example
        >>> wi, wo = gn.direction([0.5, 0.5], 0.0), gn.direction([0.5, 0.3], [np.pi, 2.0])
        >>> both = gn.reconstruction.reconstruct((wi, wo, [0.2, 0.1]))
        >>> print(both.error < gn.reconstruction.reconstruct((wi[:1], wo[:1], [0.2])).error)
        True
        """
        squares = np.tensordot(self.basis.weights, self.log_u**2, 3)
        return float(np.sqrt(squares)) if squares.ndim == 0 else np.sqrt(squares)

    @checked
    def interval(
        self, probability: Annotated[float, Declared("probability of the interval", 1e-6, 1.0 - 1e-9)] = 0.95
    ) -> tuple[Gridded, Gridded]:
        """Two tables, between which f lies with this probability, node by node.

        Example
        >>> found = gn.reconstruction.reconstruct((gn.direction([0.5], 0.0), gn.direction([0.5], 2.0), [0.2]))
        >>> low, high = found.interval(0.95)
        >>> at = gn.direction(0.5, 0.0), gn.direction(0.5, 2.0)
        >>> print(low.f(*at) < 0.2 < high.f(*at))
        True
        """
        mean, k = self._logarithm(), float(ndtri(0.5 + 0.5 * probability))
        low, high = (
            self.basis.table(mean + sign * k * self._columns(self.log_u), None, self.reflectance.channel_names)
            for sign in (-1.0, 1.0)
        )
        return low, high

    @checked
    def draws(self, count: Annotated[int, Declared("how many tables", 1, 10_000)], seed: Seed = 0) -> Iterator[Gridded]:
        """Tables as they may be, drawn from the posterior: for the uncertainty of anything that follows from f.

        What the basis does not hold is drawn as one deviation for a whole table.

        Example
        >>> wi, wo = gn.planning.Goniometer(step_theta=np.radians(15), in_plane=True).pairs()
        >>> m = gn.material("blue-fabric")
        >>> found = gn.reconstruction.reconstruct((wi, wo, m.f(wi, wo)))
        >>> spread = np.std([gn.albedo(t, [0, 0, 1]) for t in found.draws(20)], axis=0)
        >>> print(np.all(spread < 0.1 * gn.albedo(found.reflectance, [0, 0, 1])))
        True
        """
        random = np.random.default_rng(seed)
        k = len(self.basis)
        roots = [_root(c) for c in self.covariance.reshape(-1, k, k)]
        mean, beside = (
            self._logarithm(),
            np.sqrt(self.basis.misfit[..., None] * np.atleast_1d(self.widening) + np.square(self.discrepancy)),
        )
        for _ in range(count):
            off = np.stack([root @ random.standard_normal(k) for root in roots], axis=-1)
            log_f = mean + self.basis.factors @ off + beside * random.standard_normal(len(roots))
            yield self.basis.table(log_f, None, self.reflectance.channel_names)

    def _columns(self, x: np.ndarray) -> np.ndarray:
        """Values (grid..., C) of those (grid[, C])."""
        return x if self.reflectance.channel_names is not None else x[..., None]

    def _logarithm(self) -> np.ndarray:
        """Posterior mean (grid..., C) of ln(f + offset)."""
        return _logarithm(self.basis, self.coefficients.reshape(-1, len(self.basis)))

    def to_json(self) -> dict[str, Any]:
        """The result as numbers, lists and words, without the table.

        Example
        >>> found = gn.reconstruction.reconstruct((gn.direction([0.5], 0.0), gn.direction([0.5], 2.0), [0.2]))
        >>> print(sorted(found.to_json())[:4])
        ['basis', 'chi2', 'coefficients', 'covariance']
        """
        numbers = ("coefficients", "covariance", "stderr", "discrepancy", "widening", "chi2", "used", "rms", "error")
        told = {name: np.asarray(getattr(self, name)).tolist() for name in numbers}
        return {"source": self.source, "basis": repr(self.basis), **told, "notes": list(self.notes)}

    def __str__(self) -> str:
        names = names_of(self.reflectance.channel_names)
        fields = ("used", "error", "rms", "discrepancy", "widening", "chi2")
        columns = [np.atleast_1d(getattr(self, name)) for name in fields]
        rows = [["", "values", "error of f", "rms of values", "beside the basis", "u widened", "chi2"]]
        for name, used, error, rms, beside, widening, chi2 in zip(names, *columns, strict=True):
            wider = f"{math.sqrt(widening):.3g} x"
            rows.append([name, f"{used}", f"{error:.1%}", f"{rms:.2%}", f"{beside:.1%}", wider, f"{chi2:.4g}"])
        widths = [max(len(row[c]) for row in rows) for c in range(len(rows[0]))]
        lines = [f"{self.reflectance!r:.200}", f"reconstructed from {self.source}", f"by {self.basis!r}", ""]
        for row in rows[: 1 + 12]:
            lines.append("  " + "  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)).rstrip())
        if len(rows) > 13:
            lines.append(f"  ... {len(rows) - 13} more")
        if self.notes:
            lines += ["", "note", *(f"  - {text}" for text in self.notes)]
        return "\n".join(lines)

    def __repr__(self) -> str:
        worst = float(np.max(self.error))
        return f"<Reconstruction of {self.source}: error of f {worst:.2g}, relative>"


def reconstruction(s: Samples, basis: ReflectanceBasis, noise: float, floor: float) -> Reconstruction:
    """The table that values say, of every channel by the same basis."""
    rows = basis.at(s.wi, s.wo)
    posteriors = []
    for c in range(s.f.shape[1]):
        f = np.maximum(s.f[:, c], 0.0)
        u = np.hypot(noise * f, floor) if s.u is None else s.u[:, c]
        usable = s.valid[:, c] & (u > 0.0)
        if not usable.any():
            name = names_of(s.channels)[c]
            raise ParameterError(
                f"{s.source}: no value{f' of channel {name}' if name else ''} has an uncertainty above 0; expected "
                f"values above 0, or a floor [1/sr] of the noise"
            )
        posteriors.append(posterior(basis, BasisRows(*(x[usable] for x in rows)), f[usable], u[usable]))
    means = np.stack([p.mean for p in posteriors])
    variance = np.stack([variance_of(basis, p.covariance, p.widening) for p in posteriors], axis=-1)
    log_u = np.sqrt(variance + np.array([p.discrepancy**2 for p in posteriors]))
    table = basis.table(_logarithm(basis, means), log_u, s.channels, made_of=f"{s.source}, reconstructed")
    discrepancy, widening, chi2, used, rms = (
        np.array([getattr(p, name) for p in posteriors]) for name in ("discrepancy", "widening", "chi2", "of", "rms")
    )
    covariance = np.stack([p.covariance for p in posteriors])
    if s.channels is None:
        means, covariance, log_u = means[0], covariance[0], log_u[..., 0]
        discrepancy, widening, chi2, used, rms = (x[0].item() for x in (discrepancy, widening, chi2, used, rms))
    notes = tuple(_notes(s, basis, posteriors, table, log_u.reshape(variance.shape), noise, floor))
    numbers = discrepancy, widening, chi2, used, rms
    return Reconstruction(table, means, covariance, *numbers, log_u, notes, s.source, basis)


def posterior(basis: ReflectanceBasis, rows: BasisRows, f: np.ndarray, u: np.ndarray) -> Posterior:
    """The posterior of the coefficients by values f (n,) of standard uncertainty u.

    Values nearest to the same node are averaged: what the basis does not hold is the same in all of them.
    """
    off = np.log(f + basis.offset) - rows.mean
    spread = np.clip(u / (f + basis.offset), *SPREADS)
    cells, which = np.unique(rows.cells, return_inverse=True)
    weight = 1.0 / spread**2
    total = np.bincount(which, weight)
    mean, misfit = (np.bincount(which, weight * x) / total for x in (off, rows.misfit))
    factors = np.stack([np.bincount(which, weight * x) / total for x in rows.factors.T], axis=-1)
    solution = _solved(mean, factors, 1.0 / total + misfit)
    chi2, discrepancy = solution.chi2, 0.0
    if _chance(chi2, len(cells)) < FAR:
        solution, discrepancy = _robust(mean, factors, 1.0 / total + misfit)
    remains = off - rows.factors @ solution.coefficients
    return Posterior(
        solution.coefficients,
        solution.widening * solution.covariance,
        discrepancy,
        solution.widening,
        chi2,
        len(cells),
        float(np.sqrt(np.mean(remains * remains))),
    )


class _Solved(NamedTuple):
    """What values of certain variances say: ln of the evidence, mean and covariance of the coefficients, chi-square."""

    evidence: float
    coefficients: np.ndarray
    covariance: np.ndarray
    chi2: float
    widening: float


def _solved(off: np.ndarray, factors: np.ndarray, variance: np.ndarray) -> _Solved:
    """By values of these variances; these, and those of the coefficients, are greater by `widening` where need be."""
    rows, whitened = factors / np.sqrt(variance)[:, None], off / np.sqrt(variance)
    left_vectors, sizes, axes = np.linalg.svd(rows, full_matrices=False)
    shares = sizes**2 / (1.0 + sizes**2)
    covariance = np.eye(factors.shape[1]) - (axes.T * shares) @ axes
    coefficients = axes.T @ (sizes / (1.0 + sizes**2) * (left_vectors.T @ whitened))
    left = whitened - rows @ coefficients
    chi2 = float(left @ left + coefficients @ coefficients)
    widening = max(1.0, chi2 / len(off))
    evidence = np.log(variance * widening).sum() + np.log1p(sizes**2).sum() + chi2 / widening
    return _Solved(-0.5 * float(evidence), coefficients, covariance, chi2, widening)


def _robust(off: np.ndarray, factors: np.ndarray, variance: np.ndarray) -> tuple[_Solved, float]:
    """The solution with the discrepancy of greatest evidence in the variances, none where widening them says as much;
    values that are still far off count less, as those of Student's distribution do. And the discrepancy, or a larger
    one where less than 95 % of the values were within two standard deviations."""
    share = np.ones(len(off))
    some = slice(None, None, max(1, len(off) // ENOUGH))
    for _ in range(STEPS):
        tried = [
            (_solved(off[some], factors[some], (variance + d * d)[some] / share[some]).evidence, d)
            for d in DISCREPANCIES
        ]
        discrepancy = max(tried)[1]
        solution = _solved(off, factors, (variance + discrepancy**2) / share)
        left = (off - factors @ solution.coefficients) ** 2 / solution.widening
        share = (FREEDOM + 1.0) / (FREEDOM + left / (variance + discrepancy**2))
    wide = float(np.quantile(left, 0.95)) / 4.0 - float(np.median(variance))
    return solution, math.sqrt(solution.widening * max(wide, discrepancy**2))


def _chance(chi2: float, count: int) -> float:
    """How often a material like those of the basis has as large a chi-square."""
    return float(gammaincc(0.5 * count, 0.5 * max(chi2, 0.0)))


def variance_of(basis: ReflectanceBasis, covariance: np.ndarray, widening: float) -> np.ndarray:
    """Variance (grid) of ln(f + offset) at the nodes, of this covariance of the coefficients."""
    spread = basis.factors @ _root(covariance)
    return np.asarray(np.einsum("...k,...k->...", spread, spread) + widening * basis.misfit)


def _root(covariance: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _logarithm(basis: ReflectanceBasis, coefficients: np.ndarray) -> np.ndarray:
    return np.asarray(basis.mean[..., None] + basis.factors @ coefficients.T)


def _notes(
    s: Samples,
    basis: ReflectanceBasis,
    posteriors: list[Posterior],
    table: Gridded,
    log_u: np.ndarray,
    noise: float,
    floor: float,
) -> Iterator[str]:
    """Sentences about a reconstruction."""
    for reason, count in s.left_out.items():
        yield f"{count} rows were left out: {reason}"
    if s.u is None:
        text = f"no uncertainties: {100.0 * noise:g} %" + (f" and {floor:g} /sr" if floor else "")
        yield f"{text} of each value was taken"
        if lost := int((s.valid & ~(np.hypot(noise * np.maximum(s.f, 0.0), floor) > 0.0)).sum()):
            yield f"{lost} values of 0 or less were left out; a floor of the noise makes them count"
    far = [p for p in posteriors if _chance(p.chi2, p.of) < FAR]
    if far:
        worst = max(far, key=lambda p: p.chi2 / p.of)
        beside = f", and a deviation of {worst.discrepancy:.1%} added" if worst.discrepancy else ""
        yield (
            f"the values are far from the materials of the basis: chi2 {worst.chi2:.3g} of {worst.of} values; "
            f"u was widened {math.sqrt(worst.widening):.2g} times{beside}; other materials in the basis, more values, "
            f"or a larger noise would help"
        )
    weights = basis.weights[..., None] / len(posteriors)
    if (share := float((weights * (log_u > UNSURE)).sum())) > 0.01:
        yield f"at {share:.0%} of all directions u is more than half of f; more values would help"
    reflected = float(np.max(albedo(table, [0.0, 0.0, 1.0], tolerance=1e-2)))
    if reflected > 1.05:
        yield (
            f"the table reflects {reflected:.2f} of the light at normal incidence, more than there is; are the values "
            f"reflectance factors (pi f)? values/pi would reflect about {reflected / math.pi:.2f}"
        )
