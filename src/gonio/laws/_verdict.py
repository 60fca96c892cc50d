"""The verdict of a law, with its number, tolerance, place and reason; and the report of all laws."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

from ..declared.notebooks import repr_html


@dataclass(frozen=True)
class Law:
    """One verdict. `value` is compared with `tolerance` as `rule` says; `where` holds angles [degrees].

    `why` describes a failure, `declared` is the reason that the material's class gives for it. `u` is the standard
    uncertainty of `value` for a measured table (NaN: unknown), of the components `u_noise` (None: no uncertainties of
    values are stated) and `u_interpolation`. Where uncertainties decide, `significant` says how: a breach that they may
    explain is False, and does not fail; `significance` gives the reason.
    """

    _repr_html_ = repr_html

    name: str
    passed: bool
    value: float
    tolerance: float
    rule: str
    where: dict[str, float] = field(default_factory=dict)
    why: str = ""
    declared: str = ""
    u: float | None = None
    u_noise: float | None = None
    u_interpolation: float | None = None
    significance: str = ""
    significant: bool | None = None

    @property
    def verdict(self) -> str:
        """ "pass", "not significant" of a measurement whose errors may explain the breach, "breaks" where the law fails
        as the class declares, "FAIL" where it fails otherwise."""
        if self.passed:
            return "not significant" if self.significant is False else "pass"
        return "breaks" if self.declared else "FAIL"

    @property
    def finding(self) -> str:
        """The rule with its numbers."""
        spread = ""
        if self.u is not None:
            total, *parts = ("unknown" if x is None or math.isnan(x) else f"{x:.2g}" for x in self._uncertainties)
            of = "by interpolation alone" if self.u_noise is None else "noise {}, interpolation {}".format(*parts)
            spread = f" ± {total} ({of})"
        return self.rule.format(value=f"{self.value:.4g}{spread}", tolerance=f"{self.tolerance:.4g}")

    @property
    def _uncertainties(self) -> tuple[float | None, ...]:
        return self.u, self.u_noise, self.u_interpolation

    @property
    def place(self) -> str:
        """`where` in words."""
        return ", ".join(f"{name} {angle:.4g}" for name, angle in self.where.items())


Findings = Iterator[Law | str]
"""Verdicts and notes of a law."""


def at_most(
    name: str, value: float, tolerance: float, rule: str, where: dict[str, float], why: str, placed: bool = False
) -> Law:
    """The verdict of a law whose value may not exceed its tolerance.

    `where` and `why` are those of a failure; with `placed` a verdict that passes has its place too.
    """
    passed = value <= tolerance
    return Law(name, passed, value, tolerance, rule, {} if passed and not placed else where, "" if passed else why)


@dataclass(frozen=True)
class Report:
    """The verdicts of `check`: `passed` if every law holds. Prints as a table.

    Example
    >>> report = gn.check(gn.Lambertian(0.5), laws=["energy"])
    >>> print(report.passed, report.laws[0].value <= report.laws[0].tolerance)
    True True
    """

    _repr_html_ = repr_html

    material: str
    laws: tuple[Law, ...]
    notes: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether every law holds, as far as the uncertainties of a measurement tell.

        Example
        >>> print(gn.check(gn.Lambertian(0.5), laws=["energy"]).passed)
        True
        """
        return all(law.passed for law in self.laws)

    @property
    def lawful(self) -> bool:
        """Whether every law holds, or fails as the class declares.

        Example
        >>> report = gn.check(gn.OriginalPhong(0.2), laws=["reciprocity"])
        >>> print(report.passed, report.lawful)
        False True
        """
        return not any(law.verdict == "FAIL" for law in self.laws)

    @property
    def verdicts(self) -> dict[str, str]:
        """Law -> "pass", "not significant", "breaks" or "FAIL"; laws that do not apply are left out.

        Example
        >>> print(gn.check(gn.OriginalPhong(0.2), laws=["reciprocity"]).verdicts)
        {'reciprocity': 'breaks'}
        """
        return {law.name: law.verdict for law in self.laws}

    def __getitem__(self, name: str) -> Law:
        return next(law for law in self.laws if law.name == name)

    def to_json(self) -> dict[str, Any]:
        """The report as JSON data.

        Example
        >>> print(gn.check(gn.Lambertian(0.5), laws=["energy"]).to_json()["passed"])
        True
        """
        laws = [{**asdict(law), "verdict": law.verdict} for law in self.laws]
        return {**asdict(self), "laws": laws, "passed": self.passed, "lawful": self.lawful}

    def __str__(self) -> str:
        lines = [self.material]
        width = max((len(law.name) for law in self.laws), default=0)
        room = max((len(law.finding) for law in self.laws), default=0)
        words = [law.verdict if law.passed else "FAIL" for law in self.laws]
        column = max(map(len, words), default=0)
        indent = " " * (6 + column + width)
        first: dict[str, str] = {}  # reason -> the first law that it is declared for
        for word, law in zip(words, self.laws, strict=True):
            lines.append(f"  {word:<{column}}  {law.name:<{width}}  {law.finding:<{room}}  {law.place}".rstrip())
            reason = f"as for {first[law.declared]}" if law.declared in first else law.declared
            first.setdefault(law.declared, law.name)
            declared = f"declared: {reason}" if law.declared else ""
            for text in (law.why, law.significance, declared):
                lines += textwrap.wrap(text, 100, initial_indent=indent, subsequent_indent=indent)
        for note in self.notes:
            lines += textwrap.wrap(note, 100, initial_indent="  note  ", subsequent_indent=" " * 8)
        return "\n".join(lines)
