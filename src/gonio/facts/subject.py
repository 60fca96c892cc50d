"""A material and the words by which it was asked for: what it is in a line, and the code and commands that make it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..base.sums import Scaled, Sum
from ..catalogue import builtin
from ..catalogue.expressions import read
from ..declared.namespace import places_of
from ..formula.json_form import names
from ..formula.text import literal
from .models import summary


class Subject(NamedTuple):
    """A material by its words.

    text      MATERIAL of the command line; where there was none, that which would say the same
    reading   its -O
    replaced  its -p
    """

    name: str
    m: Reflectance
    text: str = ""
    reading: Sequence[str] = ()
    replaced: Sequence[str] = ()

    @classmethod
    def of(cls, name: str, m: Reflectance) -> Subject:
        """The subject of a material that Python code made."""
        if isinstance(m, Measured) and m.path:
            return cls(name, m, str(m.path), [f"{k}={v}" for k, v in m.provenance.get("options", {}).items()])
        entry = builtin.find(name)
        if entry is not None and builtin.material(entry.name) == m:
            return cls(name, m, entry.name)
        return cls(name, m, repr(m))

    @property
    def title(self) -> str:
        """What the material is, in a line."""
        m = self.m
        if (entry := builtin.find(self.text)) is not None:
            return f"{entry.kind}: {entry.description}"
        if isinstance(m, Measured):
            published = getattr(m, "published", None)
            return f"measurement, {m.provenance.get('format', m.format)} file" + (f" of {published}" * bool(published))
        if isinstance(m, Sum):
            return "sum of " + ", ".join(type(t.of if isinstance(t, Scaled) else t).__name__ for t in m.terms)
        return summary(type(m.of if isinstance(m, Scaled) else m)).replace("`", "")

    @property
    def words(self) -> str:
        """MATERIAL with its options, as a shell reads them."""
        options = [f"-O {shlex.quote(x)}" for x in self.reading] + [f"-p {shlex.quote(x)}" for x in self.replaced]
        return " ".join([shlex.quote(self.text), *options])

    def shell(self, with_fit: str = "") -> list[str]:
        """Commands that give what the report says: (line, meaning)."""
        words = self.words
        lines = [f"gonio report {words} -o report.html", f"gonio info {words}", f"gonio check {words}"]
        lines += [f"gonio albedo {words}", f"gonio show {words} -o figure.pdf", f"gonio render {words} -o sphere.png"]
        if with_fit and not self.replaced:  # `gonio fit` has no -p
            lines.append(f"gonio fit {words} -m {shlex.quote(with_fit)}")
        return lines

    def python(self, theta_i: Sequence[float], azimuth: float, with_fit: str = "") -> str:
        """A program that gives the report's numbers."""
        degrees = ", ".join(f"{theta:g}" for theta in theta_i)
        toward = f"np.radians({azimuth:g})"
        lines = ["import numpy as np", "", "import gonio as gn", "", f"m = {self.code}", "print(gn.check(m))"]
        lines += [f"wi = gn.direction(np.radians([{degrees}]), {toward})", "print(gn.albedo(m, wi, tolerance=1e-4))"]
        lines += [f"wo = gn.direction(np.radians(45.0), {toward} + np.pi)  # the mirror direction of light from 45°"]
        lines += [f"print(m.f(gn.direction(np.radians(45.0), {toward}), wo))  # [1/sr]"]
        if with_fit:
            lines.append(f"print(gn.fit(m, gn.expression({with_fit!r})).report())")
        lines.append('gn.render(m).save("sphere.png")')
        return "\n".join(lines)

    @property
    def code(self) -> str:
        """Python code that makes the material."""
        if isinstance(self.m, Measured) and self.m.path:
            options = "".join(f", {k}={v!r}" for k, v in self.m.provenance.get("options", {}).items())
            made = f"gn.load({Path(self.text).as_posix()!r}{options})"
        elif (entry := builtin.find(self.text)) is not None:
            made = f"gn.material({entry.name!r})"
        elif "(" in self.text:
            made = as_python(self.text)
        else:
            made = f"gn.{self.text}()" if self.text in names() else f"gn.load({self.text!r})"
        if not self.replaced:
            return made
        changes = (text.partition("=") for text in self.replaced)
        values = ", ".join(f"{name.strip()!r}: {_value(text)}" for name, _, text in changes)
        return f"{f'({made})' if ' ' in made else made}.replace({{{values}}})"


_CONSTRUCTOR = re.compile(r"""("[^"]*"|'[^']*')|(?<![\w.])(?:gn\.|gonio\.)?([A-Za-z_]\w*)(?=\s*\()""")
_NUMBER = re.compile(r"\b(pi|inf|nan)\b(?!\s*=)")


def as_python(text: str) -> str:
    """A material expression as Python code: its constructors by `gn.`, where all are there, and it names no numbers."""
    line = " ".join(text.split())
    named = {found[2] for found in _CONSTRUCTOR.finditer(line) if found[2]}
    if _NUMBER.search(line) or any(next(places_of(name), "") != f"gn.{name}" for name in named):
        return f"gn.expression({line!r})"
    return _CONSTRUCTOR.sub(lambda found: found[1] or f"gn.{found[2]}", line)


def _value(text: str) -> str:
    """A value of -p as Python code."""
    value = read(text, words=True, files=True)
    return repr(value) if isinstance(value, str) else as_python(literal(value))
