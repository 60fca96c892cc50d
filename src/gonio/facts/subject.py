"""What a report is about: a material, and the words by which it was asked for."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..catalogue import builtin
from ..formula.text import literal


class Subject(NamedTuple):
    """A material of a report.

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
        lines = ["import numpy as np", "", "import gonio as gn", "", f"m = {self._made()}", "print(gn.check(m))"]
        lines += [f"wi = gn.direction(np.radians([{degrees}]), {toward})", "print(gn.albedo(m, wi, tolerance=1e-4))"]
        lines += [f"wo = gn.direction(np.radians(45.0), {toward} + np.pi)  # the mirror direction of light from 45°"]
        lines += [f"print(m.f(gn.direction(np.radians(45.0), {toward}), wo))  # [1/sr]"]
        if with_fit:
            lines.append(f"print(gn.fit(m, gn.expression({with_fit!r})).report())")
        lines.append('gn.render(m).save("sphere.png")')
        return "\n".join(lines)

    def _made(self) -> str:
        if isinstance(self.m, Measured) and self.m.path:
            options = "".join(f", {k}={v}" for k, v in self._options().items())
            return f"gn.load({Path(self.text).as_posix()!r}{options}){self._replacing()}"
        entry = builtin.find(self.text)
        if entry is not None:
            return f"gn.material({entry.name!r}){self._replacing()}"
        return f"gn.expression({repr(self.m)!r})"

    def _options(self) -> dict[str, str]:
        """Options of reading as Python writes them."""
        options: dict[str, Any] = self.m.provenance.get("options", {}) if isinstance(self.m, Measured) else {}
        return {k: repr(v) for k, v in options.items()}

    def _replacing(self) -> str:
        """The call that makes the changes of -p."""
        names = [text.partition("=")[0].strip() for text in self.replaced]
        if not names:
            return ""
        from ..catalogue.expressions import read

        values = {}
        for name, text in zip(names, self.replaced, strict=True):
            value = read(text.partition("=")[2], words=True, files=True)
            values[name] = f"gn.expression({repr(value)!r})" if isinstance(value, Reflectance) else _written(value)
        return f".replace({{{', '.join(f'{name!r}: {value}' for name, value in values.items())}}})"


def _written(value: Any) -> str:
    """A parameter as Python code writes it: pieces by their class."""
    text = repr(value) if isinstance(value, str) else literal(value)
    return f"gn.{text}" if text[:1].isupper() else text
