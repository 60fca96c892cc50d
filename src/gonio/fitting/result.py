"""What a fit found: the model, how sure its numbers are, how well it agrees with the data, and where it does not."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from statistics import NormalDist
from typing import Annotated, Any

import numpy as np

from ..base.reflectance import Reflectance
from ..declared.arguments import Declared, checked
from ..declared.notebooks import repr_html
from ..errors import ParameterError, shown
from ..formula.text import listed
from .agreement import Incidence, Row, by_incidence, worst
from .covariance import correlations, spread_of
from .losses import LOSSES, ROBUST
from .problem import Problem
from .solver import Solved
from .suspicions import suspicions

ALIKE = 0.95
"""Correlation from which two numbers are hard to tell apart."""

SHOWN = 4
"""Pairs of such numbers that are told."""

LONG_NUMBER = re.compile(r"(?<!\d)\d+\.\d{4,}(?:e[-+]?\d+)?")
DEFAULT = ", masking='height_correlated'"
"""What titles leave out: digits, and the option that microfacets usually have."""


@dataclass(frozen=True, eq=False)
class Fit:
    """What `fit` found. It prints as a report, in a notebook as tables.

    model        the model with the fitted numbers
    names        of the unknowns: paths of parameters, "[2]" after those with a number for each channel
    values       (n,) the fitted numbers
    covariance   (n, n) of these; 0 for numbers at a bound, inf on the diagonal for those that the data do not determine
    cost         the sum of the costs of residuals
    used         the number of values that were fitted
    converged    whether it ended at an optimum, not by the number of steps
    steps        of the solver, with all data
    agreeing     the share of starts, on a part of the data, that ended at the best optimum
    condition    square root of the ratio of the largest to the least eigenvalue of the scaled normal matrix: 1 for
                 numbers that do not disturb each other
    freedom      (n,) degrees of freedom of the variances: values less unknowns, and fewer where a few values carry a
                 number and do not tell what their noise is

    Error    standard errors are those of first order. Of 1000 synthetic measurements with 0.1 % to 10 % noise 94.8 to
             96.3 % of the 95 % intervals hold the truth where the uncertainties are known; without them 94.4 to 97.1 %
             with "cosine", "log" and "ratio", but 89 % of an albedo with "ratio" at 10 %, of which ln f makes a bias
             of half its square; 91.8 to 97.8 % on two scenes by which the noise model was not chosen, 400 trials each
             (benchmarks/fits_amd.txt). They follow from the scatter of the data about the model: where the model is
             wrong, errors are larger than they say.
    Source   JCGM 100:2008; Huber 1967; White 1980; MacKinnon & White 1985; Satterthwaite 1946; Raftery 1995; AIC:
             Akaike 1974; BIC: Schwarz 1978.

    Example
    >>> theta = np.linspace(0.1, 1.2, 12)
    >>> wi, wo = gn.direction(theta, 0.0), gn.direction(theta[::-1], 2.0)
    >>> noise = 1.0 + 0.01 * np.random.default_rng(1).standard_normal(12)
    >>> found = gn.fit((wi, wo, gn.Lambertian(0.5).f(wi, wo) * noise), gn.Lambertian())
    >>> print(found.title, round(found.stderr["rho"], 4))
    Lambertian(rho=0.5011) 0.0011
    """

    _repr_html_ = repr_html

    model: Reflectance
    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    cost: float
    used: int
    converged: bool
    steps: int
    agreeing: float
    condition: float
    freedom: np.ndarray = field(repr=False)
    at_bound: np.ndarray = field(repr=False)
    problem: Problem = field(repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.problem, Problem):
            raise ParameterError(
                f"Fit(problem={shown(self.problem)}): expected a problem; gn.fit(data, model) makes fits"
            )

    @classmethod
    def of(cls, problem: Problem, solved: Solved, agreeing: float) -> Fit:
        """The result of a problem that was solved for one set of unknowns.

        Example
        >>> from gonio.fitting.solver import minimize
        >>> wi, wo = gn.direction(0.5, [0.0, 1.0]), gn.direction(0.3, [0.0, 2.0])
        >>> problem = gn.fitting.fit_problem((wi, wo, [0.1, 0.1]), gn.Lambertian(0.4), loss="plain")
        >>> solved = minimize(problem.squares, np.array([[0.4]]), problem.box)
        >>> print(gn.results.Fit.of(problem, solved, 1.0).values.round(4))
        [0.3142]
        """
        u, x, sums = problem.unknowns, solved.x[0], solved.squares
        spread = spread_of(problem, x, sums.gradient[0], sums.matrix[0])
        numbers = u.numbers(x)
        return cls(
            u.fitted(numbers),
            u.names,
            numbers,
            spread.covariance,
            float(sums.cost[0]) * problem.scale**2,
            problem.samples.count,
            bool(solved.ended[0]),
            int(solved.steps[0]),
            agreeing,
            spread.condition,
            spread.freedom,
            spread.at_bound,
            problem,
        )

    @property
    def loss(self) -> str:
        """What was compared.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> found = gn.fit(data, gn.Lambertian(), loss="plain")
        >>> print(found.loss)
        plain
        """
        return self.problem.loss

    @property
    def free(self) -> int:
        """Degrees of freedom: values less unknowns.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> found = gn.fit(data, gn.Lambertian(), loss="plain")
        >>> print(found.free)
        2
        """
        return self.used - len(self.names)

    @property
    def stderr(self) -> dict[str, float]:
        """Standard errors by name; 0 at a bound, inf where the data do not determine the number.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> found = gn.fit(data, gn.Lambertian(), loss="plain")
        >>> print(round(found.stderr["rho"], 3))  # the standard deviation of pi f over the root of 3
        0.018
        """
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation matrix (n, n); NaN for numbers at a bound or not determined.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> found = gn.fit(data, gn.Lambertian(), loss="plain")
        >>> print(found.correlation)
        [[1.]]
        """
        return correlations(self.covariance)

    @checked
    def interval(
        self, p: Annotated[float, Declared("probability of the intervals", 0.0, 1.0)] = 0.95
    ) -> dict[str, tuple[float, float]]:
        """Intervals that hold the truth with probability p, by name: value -+ t s, t of Student's distribution with
        `freedom`; of a likelihood of the normal distribution.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> low, high = gn.fit(data, gn.Lambertian(), loss="plain").interval()["rho"]
        >>> print(low < 0.11 * np.pi < high)
        True
        """
        if self.loss == "likelihood":
            t = np.full(len(self.names), NormalDist().inv_cdf(0.5 + 0.5 * p))
        else:
            from scipy.special import stdtrit  # what scipy.stats takes, whose import is half a second

            t = stdtrit(self.freedom, 0.5 + 0.5 * p)
        return {
            name: (float(value - k * s), float(value + k * s))
            for (name, s), value, k in zip(self.stderr.items(), self.values, t, strict=True)
        }

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, in units of what is compared; of a likelihood in standard errors.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> found = gn.fit(data, gn.Lambertian(), loss="plain")
        >>> print(round(found.rms, 4))
        0.0082
        """
        return math.sqrt(self.cost / self.used)

    @property
    def aic(self) -> float:
        """Akaike's information criterion, less what all models have in common.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> found = gn.fit(data, gn.Lambertian(), loss="plain")
        >>> print(round(found.aic, 1))
        -26.8
        """
        return self._deviance + 2.0 * len(self.names)

    @property
    def bic(self) -> float:
        """The Bayesian information criterion, less what all models have in common.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> found = gn.fit(data, gn.Lambertian(), loss="plain")
        >>> print(round(found.bic, 1))
        -27.7
        """
        return self._deviance + math.log(self.used) * len(self.names)

    @property
    def _deviance(self) -> float:
        if self.loss == "likelihood":
            return self.cost
        return self.used * math.log(max(self.cost, 1e-300) / self.used)

    @cached_property
    def _compared(self) -> tuple[np.ndarray, np.ndarray]:
        """f of the model (N, C), and residuals (N, C), weighted, NaN where there is no number."""
        s = self.problem.samples
        f = np.reshape(self.model.f(s.wi, s.wo), (len(s), -1))
        f = np.broadcast_to(f, s.f.shape)
        r = self.problem.least_squares().residuals(self.values).reshape(s.f.shape[::-1]).T
        return f, np.where(s.valid, r, np.nan)

    def by_incidence(self) -> list[Incidence]:
        """Agreement by angle of incidence, in classes of 15 degrees that hold data.

        Example
        >>> wi, wo = gn.direction([0.2, 0.9], 0.0), gn.direction([0.3, 0.8], 1.0)
        >>> for c in gn.fit((wi, wo, [0.10, 0.12]), gn.Lambertian(), loss="plain").by_incidence():
        ...     print(c.low, c.high, c.values, round(c.rms, 2))
        0.0 15.0 1 0.1
        45.0 60.0 1 0.08
        """
        return by_incidence(self.problem.samples, self._compared[0])

    def worst(self, count: int = 5) -> list[Row]:
        """The rows with the largest residuals.

        Example
        >>> wi, wo = gn.direction([0.2, 0.9, 0.4], 0.0), gn.direction([0.3, 0.8, 0.4], 1.0)
        >>> (row,) = gn.fit((wi, wo, [0.10, 0.10, 0.2]), gn.Lambertian(), loss="plain").worst(1)
        >>> print(row.data, round(row.model, 3))
        0.2 0.133
        """
        return worst(self.problem.samples, *self._compared, count)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What should be known before the numbers are used: each a sentence.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.1, 0.1, 0.1]
        >>> print(*gn.fit(data, gn.Lambertian()).notes)
        all values are 0.1: they hold no more than an albedo
        """
        return tuple(self._remarks())

    def _remarks(self) -> Iterator[str]:
        if not self.converged:
            yield "the solver stopped before an optimum: more data, or fewer unknowns, would help"
        if kept := self.problem.unknowns.kept:
            yield f"kept as they are, as is usual for this model: {listed(kept)}; `by` asks for them"
        for name, _, remark in self.rows():
            if remark:
                yield f"{name} is {remark}"
        for a, b, r in self.alike[:SHOWN]:
            yield f"the data hardly tell {a} and {b} apart (correlation {r:+.3f}): only their combination is sure"
        if self.agreeing < 0.2 and self.problem.unknowns.is_linear.sum() < len(self.names):
            share = f"{self.agreeing:.0%} of the starts ended here"
            yield f"{share}: other optima are about; more starts may find a better one"
        if self.loss == "likelihood" and self.free > 0:
            ratio = self.cost / self.free
            high = 1.0 + 5.0 * math.sqrt(2.0 / self.free)
            if ratio > max(high, 1.2):
                yield (
                    f"chi2/free is {ratio:.3g}: the uncertainties are too small, or the model is wrong; times "
                    f"{math.sqrt(ratio):.3g} the standard errors would allow for that"
                )
            elif ratio < 0.3 and self.free > 10:
                yield f"chi2/free is {ratio:.2g}: the uncertainties are larger than the scatter of the data"
        s = self.problem.samples
        values = s.f[s.valid]
        if np.ptp(values) <= 1e-9 * np.abs(values).max(initial=0.0):
            yield f"all values are {values.flat[0]:g}: they hold no more than an albedo"
        elif len(s) >= 16 and len(self.names) > 0:
            yield from suspicions(self.problem, self.model, self.values)

    @property
    def alike(self) -> list[tuple[str, str, float]]:
        """Pairs of unknowns that the data hardly tell apart, with their correlation, the strongest first.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> found = gn.fit(data, gn.Lambertian(), loss="plain")
        >>> print(found.alike)
        []
        """
        found = []
        correlation = self.correlation
        for i, j in zip(*np.triu_indices(len(self.names), 1), strict=True):
            if abs(correlation[i, j]) > ALIKE:
                found.append((self.names[i], self.names[j], float(correlation[i, j])))
        return sorted(found, key=lambda pair: -abs(pair[2]))

    def rows(self) -> list[tuple[str, str, str]]:
        """Name, value with standard error, and what there is to say, of each unknown.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> print(gn.fit(data, gn.Lambertian(), loss="plain").rows())
        [('rho', '0.346 ± 0.018', '')]
        """
        found = []
        low, _ = self.problem.bounds
        for k, (name, s) in enumerate(self.stderr.items()):
            value, remark = float(self.values[k]), ""
            if self.at_bound[k]:
                side = "least" if value <= low[k] * (1 + 1e-9) else "largest"
                text, remark = f"{value:.6g}", f"at its bound, the {side} value allowed"
            elif not math.isfinite(s):
                text, remark = f"{value:.6g}", "not determined by the data"
            else:
                text = _with_error(value, s)
            found.append((name, text, remark))
        return found

    @property
    def title(self) -> str:
        """The model as an expression, its numbers with four digits.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> print(gn.fit(data, gn.Lambertian(), loss="plain").title)
        Lambertian(rho=0.3456)
        """
        return LONG_NUMBER.sub(lambda found: f"{float(found[0]):.4g}", repr(self.model)).replace(DEFAULT, "")

    def report(self) -> str:
        """The report as text.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> print(gn.fit(data, gn.Lambertian(), loss="plain").report().splitlines()[0])
        Lambertian(rho=0.3456)
        """
        s = self.problem.samples
        lines = [self.title, f"fitted to {s.source}"]
        told = [f"{n} rows left out: {reason}" for reason, n in s.left_out.items()]
        lines.append(f"{self.used} values, {len(self.names)} unknowns; " + self._agreement())
        lines += [f"  {text}" for text in told]
        rows = self.rows()
        width = max(len(row[0]) for row in rows)
        lines += ["", *(f"  {name:<{width}}  {value}  {remark}".rstrip() for name, value, remark in rows), ""]
        lines.append("by angle of incidence   values   rms     mean difference, of the data's rms")
        lines += [f"  {incidence}" for incidence in self.by_incidence()]
        lines.append("largest residuals")
        lines += [f"  {row}" for row in self.worst()]
        if self.notes:
            lines += ["", "note", *(f"  - {text}" for text in self.notes)]
        return "\n".join(lines)

    def _agreement(self) -> str:
        compared = LOSSES[self.loss].doc.partition(";")[0]
        size = "chi2/free" if self.loss == "likelihood" else "rms"
        number = self.cost / max(self.free, 1) if self.loss == "likelihood" else self.rms
        robust = "" if self.problem.robust == "none" else f", {self.problem.robust} ({ROBUST[self.problem.robust].doc})"
        return f"{size} {number:.4g} of {compared}{robust}; AIC {self.aic:.6g}, BIC {self.bic:.6g}"

    def to_json(self) -> dict[str, Any]:
        """The result as numbers, lists and words, for files.

        Example
        >>> data = gn.direction(0.5, np.zeros(3)), gn.direction([0.1, 0.3, 0.5], 0.0), [0.10, 0.11, 0.12]
        >>> print(sorted(gn.fit(data, gn.Lambertian()).to_json())[:4])
        ['agreeing', 'aic', 'bic', 'condition']
        """
        numbers = {
            name: getattr(self, name) for name in ("cost", "rms", "used", "free", "aic", "bic", "agreeing", "steps")
        }
        return {
            "model": repr(self.model),
            "parameters": {
                name: {"value": float(v), "stderr": s if math.isfinite(s) else None, "at_bound": bool(b)}
                for (name, s), v, b in zip(self.stderr.items(), self.values, self.at_bound, strict=True)
            },
            "covariance": [[x if math.isfinite(x) else None for x in row] for row in self.covariance.tolist()],
            **numbers,
            "condition": self.condition if math.isfinite(self.condition) else None,
            "converged": self.converged,
            "loss": self.loss,
            "robust": self.problem.robust,
            "data": self.problem.samples.source,
            "left_out": dict(self.problem.samples.left_out),
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        return self.report()

    def __repr__(self) -> str:
        told = ", ".join(f"{name}={value}" for name, value, _ in self.rows()[:8])
        return f"<Fit of {type(self.model).__name__}: {told}{', ...' if len(self.names) > 8 else ''}>"


def _with_error(value: float, s: float) -> str:
    """A value with two digits of its standard error."""
    if s == 0.0 or s < 1e-12 * abs(value):
        return f"{value:.6g} ± {s:.1g}"
    digits = 1 - math.floor(math.log10(s))
    if -3 <= digits <= 8 and abs(value) < 1e7:
        return f"{value:.{max(digits, 0)}f} ± {s:.{max(digits, 0)}f}"
    return f"{value:.{max(2, 1 + math.floor(math.log10(max(abs(value), s) / s)))}e} ± {s:.1e}"
