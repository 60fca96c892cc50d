"""Files of refractive indices, in the layout of refractiveindex.info.

The files are YAML, of which they use little: keys at the left, a list of blocks below DATA, and text after a bar. That
much is read here, line by line; anything else below DATA is refused, nothing is ever executed.

    DATA:
      - type: tabulated nk            also: tabulated n, tabulated k, formula 1 to 9
        data: |
            0.1879 1.28 1.188         wavelength [um], n, k
      - type: formula 1
        wavelength_range: 0.21 6.7
        coefficients: 0 0.6961663 0.0684043
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import FormatError, MeaningWarning, NotFoundError, ParameterError, held_by, warn
from ..formula.dispersion import FORMULAS, Dispersion
from ..formula.spectrum import Spectrum

LARGEST = 1 << 24
"""Bytes of a file of this kind, at most."""

SYNTAX = tuple("&*!{[%>")
"""What begins the rest of YAML, of which these files use none."""

SUFFIXES = (".yml", ".yaml")


class Spectra(NamedTuple):
    """The refractive index n and the extinction k of a substance, n + ik, as spectra.

    Example
    >>> gold = gn.spectra.refractive_index("gold")
    >>> print(gold.n.at(550.0).round(3), gn.Conductor(gold.n, gold.k).at([450.0, 650.0]).k.round(3))
    0.424 [1.916 3.602]
    """

    n: Spectrum
    k: Spectrum


def read(path: str | Path) -> Spectra:
    """n and k of a file of refractiveindex.info; k is 0 where the file has none.

    Raises NotFoundError where there is no such file, FormatError where it is none of this kind, or damaged.
    """
    try:
        with open(path, encoding="utf-8") as file:
            text = file.read(LARGEST + 1)
    except OSError as error:
        raise NotFoundError(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise FormatError(f"{path}: no text in UTF-8; expected a file of refractiveindex.info") from None
    if len(text) > LARGEST:
        raise FormatError(f"{path}: more than {LARGEST >> 20} MB; expected a file of refractiveindex.info")
    found: dict[str, Spectrum] = {}
    for number, block in _blocks(str(path), text.splitlines()):
        with held_by(f"{path}, line {number}"):
            spectra = _spectra(f"{path}, line {number}", block)
        for name, spectrum in spectra.items():
            if name in found:
                raise FormatError(f"{path}, line {number}: {name} once more; expected one block for it")
            found[name] = spectrum
    if "n" not in found:
        raise FormatError(f"{path}: no refractive index n; expected DATA with a block of n, of nk, or a formula")
    n = found["n"]
    ends = np.unique(n.wavelengths[[0, -1]])
    return Spectra(n, found.get("k", Spectrum._of_nanometres(ends, 0.0 * ends)))


def _blocks(where: str, lines: list[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """The blocks below DATA, each with the number of its first line: key -> text."""
    start = next((i for i, line in enumerate(lines) if line.rstrip() == "DATA:"), None)
    if start is None:
        raise FormatError(f"{where}: no line 'DATA:'; expected a file of refractiveindex.info")
    block: dict[str, str] = {}
    first, indent, text = 0, 0, None
    for number, line in enumerate(lines[start + 1 :], start + 2):
        word = line.strip()
        if not word or word.startswith("#"):
            continue
        depth = len(line) - len(line.lstrip(" "))
        if depth == 0 and not word.startswith("- "):
            break
        if text is not None and depth > indent:
            block[text] += word + "\n"
            continue
        text = None
        if word.startswith("- "):
            if block:
                yield first, block
            block, first, depth, word = {}, number, depth + 2, word[2:].strip()
        key, colon, value = (x.strip() for x in word.partition(":"))
        if not colon or not first or key in block or word[0] in SYNTAX or value[:1] in SYNTAX:
            raise FormatError(f"{where}, line {number}: {word!r:.60}; expected 'key: value', each key once in a block")
        block[key] = "" if value == "|" else value
        if value == "|":
            text, indent = key, depth
    if block:
        yield first, block


def _spectra(where: str, block: dict[str, str]) -> dict[str, Spectrum]:
    """What a block holds: "n", "k", or both."""
    kind, _, what = block.get("type", "").partition(" ")
    if kind == "formula" and what.isdigit() and int(what) in FORMULAS:
        reach = block.get("wavelength_range", block.get("range", ""))
        ends = [_nanometres(x) for x in _numbers(reach, "wavelength_range")]
        return {"n": Dispersion(int(what), _numbers(block.get("coefficients", ""), "coefficients"), ends)}
    if kind == "tabulated" and what in ("n", "k", "nk"):
        rows = [_numbers(line, "data") for line in block.get("data", "").splitlines()]
        if not rows or {len(row) for row in rows} != {1 + len(what)}:
            raise ParameterError(f"a table of {what}; expected rows of {1 + len(what)} numbers")
        um, first = np.unique(np.array([row[0] for row in rows]), return_index=True)
        nm = np.array([_nanometres(x) for x in um])
        columns = np.array(rows)[first, 1:].T
        if not (um[0] > 0.0 and np.isfinite(nm).all() and np.isfinite(columns).all()):
            raise ParameterError(
                f"a table of {what}; expected a wavelength above 0 [um] and finite numbers in each row"
            )
        if len(nm) < len(rows):
            warn(f"{where}: {len(rows) - len(nm)} wavelengths stand twice; the first of each is taken", MeaningWarning)
        return {name: Spectrum._of_nanometres(nm, x) for name, x in zip(what, columns, strict=True)}
    raise ParameterError(f"type: {block.get('type', '')!r:.60}; expected tabulated n, k or nk, or formula 1 to 9")


def _numbers(text: str, what: str) -> list[float]:
    try:
        return [float(x) for x in text.split()]
    except ValueError:
        raise ParameterError(f"{what}: {text!r:.60}; expected numbers") from None


def _nanometres(um: Any) -> float:
    """Without the digits that a product adds: 0.1879 um are 187.9 nm."""
    return float(f"{1000.0 * float(um):.12g}")
