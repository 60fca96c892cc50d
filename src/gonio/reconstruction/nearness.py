"""The materials that are most like a given one, ranked by a distance of their values of f."""

from __future__ import annotations

import fnmatch
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..arrays import ops
from ..base.angles import direction, lattice_pairs
from ..base.frames import from_half_difference, half_difference
from ..base.map_shape import map_shape
from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..base.shown_channels import is_rgb, shown_as
from ..base.sides import refuse_transmission
from ..base.textured import require_numbers
from ..catalogue import builtin
from ..catalogue.typed import as_typed, is_store
from ..declared.arguments import Declared, checked
from ..declared.contents import WIDTH
from ..declared.notebooks import repr_html
from ..errors import Error, NotFoundError, ParameterError, shown, visible
from ..formula import tree
from ..formula.spectrum import Spectrum
from ..numerics.lattice import lattice
from ..pictures.colour import LONGEST, LUMINANCE, SHORTEST, transformed

PAIRS = 1 << 14
"""Pairs of directions spread evenly, and as many dense about the mirror direction, less those near the horizon."""

GRAZING = math.cos(math.radians(80.0))
"""Least cosine of both directions: measurements are poor beyond (Ngan, Durand & Matusik 2005)."""

VALUES = 1 << 21
"""Values of f that are computed at once."""

FEWEST = 64
"""Pairs that two materials must have in common."""

MIRROR = 0.01
"""Slope scale of the lobe by which a mirror is compared."""

SPECTRUM = np.arange(SHORTEST, LONGEST + 1.0, 10.0)
"""Wavelengths [nm] of parameters that are spectra."""

LARGEST = 16.0
"""Largest |ln| of the factor of a free scale with the distance "log"."""


class Distance(NamedTuple):
    """What is compared: a function of f cos(theta_i), and a line about it."""

    compared: Callable[[np.ndarray], np.ndarray]
    doc: str


DISTANCES = {
    "log": Distance(lambda x: np.log1p(np.maximum(x, 0.0)), "ln(1 + f cos(theta_i)); Löw et al. 2012"),
    "cosine": Distance(lambda x: x, "f cos(theta_i) [1/sr]; Ngan, Durand & Matusik 2005"),
    "cube_root": Distance(np.cbrt, "(f cos(theta_i))^(1/3) [sr^(-1/3)]; Fores, Ferwerda & Gu 2012"),
}
"""Name -> distance: the root of the mean square of the difference of what is compared."""

SCALES = ("given", "free")

COLOUR, GRAY, OTHER = "RGB", "gray", "other"


@dataclass(frozen=True)
class Match:
    """A material, and how far it is from the one that was asked about.

    rank       1 is the nearest; 0 where nothing could be compared, which `reason` explains
    distance   root of the mean square, NaN where nothing could be compared
    factor     what the material was multiplied by: 1, or the best factor where the scale is free
    what       what it is: kind and description, the format of a file, an expression
    compared   "RGB", "gray", "luminance", or which channels
    left_out   pairs of directions without a value in one of both, of all `pairs`
    """

    _repr_html_ = repr_html

    name: str
    rank: int = 0
    distance: float = math.nan
    factor: float = math.nan
    what: str = ""
    compared: str = ""
    left_out: int = 0
    pairs: int = 0
    reason: str = ""
    _make: Callable[[], Reflectance] | None = field(default=None, repr=False, compare=False)

    @property
    def material(self) -> Reflectance:
        """The material itself, without the factor; a file is read again."""
        assert self._make is not None
        return self._make()

    @property
    def told(self) -> str:
        """What it is, and of a comparison that was not of RGB, or not of all pairs, how it was; or the reason."""
        if not self.rank:
            return self.reason
        by = [] if self.compared in ("", COLOUR, GRAY) else [f"by {self.compared}"]
        left = [f"{100.0 * self.left_out / self.pairs:.2g} % of the pairs left out"] if self.left_out else []
        return "; ".join([*by, *left, *([self.what] if self.what != self.name else [])])


class Matches(list[Match]):
    """Materials by their distance, the nearest first; they print with a line for each.

    Example
    >>> found = gn.reconstruction.nearest(gn.material("brass"))
    >>> print([match.name for match in found[:2]])
    ['brass', 'chrome-steel']
    """

    def __repr__(self) -> str:
        wide = max((len(match.name) for match in self), default=0)
        scaled = any(match.factor != 1.0 for match in self if match.rank)
        lines = []
        for match in self:
            factor = (f"x {match.factor:<9.4g}" if match.rank else " " * 11) if scaled else ""
            number = f"{match.rank:3}" if match.rank else "   "
            distance = f"{match.distance:<9.4f}" if match.rank else f"{'-':<9}"
            lines.append(visible(f"{number}  {match.name:<{wide}}  {distance}  {factor}{match.told}").rstrip())
        return "\n".join(line if len(line) <= WIDTH else line[: WIDTH - 4] + " ..." for line in lines)


@checked
def nearest(
    m: Reflectance,
    among: Annotated[
        Any,
        Declared(
            "what is compared: a file, a folder of files, a material, a kind (metal) or a pattern ('*paint*') of "
            "built-in ones",
            usual="all built-in materials",
        ),
    ]
    | None = None,
    distance: Annotated[
        str,
        Declared(
            "log, which holds down highlights; cosine, which they rule; cube_root, which sees dark parts too",
            words=(*DISTANCES,),
        ),
    ] = "log",
    scale: Annotated[
        str, Declared("given, as they are; or free, each multiplied by the factor that brings it nearest", words=SCALES)
    ] = "given",
    count: Annotated[int, Declared("how many are named", 1, 1_000_000)] = 10,
    progress: Callable[[int, int], None] | None = None,
) -> Matches:
    r"""The materials most like this one, the nearest first: by default of all built-in ones, `gn.materials()`.

    $$d = \sqrt{\langle (g(f \cos\theta_i) - g(f' \cos\theta_i))^2 \rangle}$$

    among      a material, its name, an expression, a file, a folder of files, a kind of built-in materials ("metal"),
               a pattern of their names ("*paint*"); a list of these, or name -> one of these
    distance   "log": g(x) = ln(1 + x), which holds down highlights; "cosine": x itself, which they rule;
               "cube_root": x^(1/3), which sees dark parts, too
    scale      "given", or "free": each is multiplied by the factor that brings it nearest, which its row tells
    count      how many are returned; after them come those that could not be compared, each with its reason

    The mean is over channels and fixed pairs of directions up to 80 degrees from the normal. Six tenths of the pairs
    are spread evenly over both hemispheres; the others evenly in half and difference angles and the root of theta_h,
    dense about the mirror direction as in the MERL database. Pairs without a value in one of both are left out and
    counted.

    Materials are compared as linear RGB, as pictures show them: wavelengths by daylight (D65), of bands those that are
    named red, green and blue. Where one is gray, luminance is compared. Channels that have no colour are compared one
    by one with the same channels, and by their mean with others. A mirror is compared as a lobe (GGX) of
    alpha = 0.01 with its reflectance. Nothing is turned about the normal.

    Units    distance: 1 of "log", 1/sr of "cosine", sr^(-1/3) of "cube_root". Built-in materials are 0.50, 3.6 and 0.42
             from each other, and 0.019, 0.056 and 0.039 from the nearest other one (medians).
    Error    of these distances, beside eight times as many pairs: 1 % (root mean square), at most 2.3 %.
    Source   log: Löw, Kronander, Ynnerman & Unger 2012, doi:10.1145/2077341.2077350; cosine: Ngan, Durand & Matusik
             2005, EGSR; cube_root: Fores, Ferwerda & Gu 2012, Color and Imaging Conference.

    Raises ParameterError for a material that transmits, fluoresces or has maps, for other words, and where none could
    be compared; NotFoundError for a name or a folder that is not there.

    Example
    >>> found = gn.reconstruction.nearest(gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.34)), count=3)
    >>> print([match.name for match in found], found[0].distance < 0.01)
    ['water', 'magnesium-fluoride', 'silica'] True
    >>> darker = gn.reconstruction.nearest(0.25 * gn.material("pink-felt"), scale="free", count=1)[0]
    >>> print(darker.name, round(darker.factor, 4))
    pink-felt 0.25
    """
    target = _seen(m)
    complete = int(np.isfinite(target.values).all(axis=1).sum())
    if complete < FEWEST:
        raise ParameterError(
            f"nearest: {shown(m)} has a value at {complete} of {len(target.values)} pairs of directions, expected "
            f"{FEWEST} at least; a table with outside='hold' keeps its outermost values"
        )
    if scale == "free" and not np.nanmax(target.values) > 0.0:
        raise ParameterError(
            "nearest(scale='free'): the material reflects nothing, which any factor 0 does; scale='given'"
        )
    candidates = list(_candidates(among))
    if not candidates:
        raise ParameterError(f"nearest(among={shown(among)}): nothing to compare with; expected one material at least")
    matches: list[Match] = []
    kept: dict[int, np.ndarray] = {}
    for done, candidate in enumerate(candidates, 1):
        matches.append(_match(target, candidate, DISTANCES[distance], scale == "free", kept))
        if progress is not None:
            progress(done, len(candidates))
    ranked = sorted((x for x in matches if not x.reason), key=lambda x: x.distance)[:count]
    failed = [x for x in matches if x.reason]
    if not ranked:
        first = failed[0]
        raise ParameterError(
            f"nearest: none of {len(failed)} could be compared; the first, {first.name}: {first.reason}"
        )
    return Matches([*(replace(x, rank=rank) for rank, x in enumerate(ranked, 1)), *failed])


# What is compared with.


class _Candidate(NamedTuple):
    name: str
    make: Callable[[], Reflectance]
    what: str = ""


def _candidates(among: Any) -> Iterator[_Candidate]:
    """All that `among` means."""
    if among is None:
        yield from map(_of_entry, builtin.materials())
    elif isinstance(among, Reflectance):
        yield _Candidate(_title(among), lambda: among, _text(among))
    elif isinstance(among, (str, os.PathLike)):
        yield from _of_word(os.fspath(among))
    elif isinstance(among, Mapping):
        for name, one in among.items():
            several = list(_candidates(one))
            yield from (x._replace(name=str(name) if len(several) == 1 else f"{name}, {x.name}") for x in several)
    elif isinstance(among, Iterable) and not ops.dtype_of(among):
        for one in among:
            yield from _candidates(one)
    else:
        raise ParameterError(
            f"nearest(among={shown(among)}): expected materials, their names, files or folders; a list of them, or "
            f"None for all built-in materials"
        )


def _of_entry(entry: builtin.Entry) -> _Candidate:
    return _Candidate(entry.name, lambda: builtin.material(entry.name), f"{entry.kind}, {entry.description}")


def _of_word(word: str) -> Iterator[_Candidate]:
    entries = builtin.materials()
    if os.path.isdir(word) and not is_store(word):
        files = sorted(x for x in Path(word).iterdir() if x.name[0] != "." and (x.is_file() or is_store(x)))
        if not files:
            raise NotFoundError(
                f"{word}: a folder without files, expected files of materials; `gonio formats` lists which"
            )
        yield from map(_of_file, files)
    elif os.path.exists(word):
        yield _of_file(Path(word))
    elif of_kind := [entry for entry in entries if entry.kind == word]:
        yield from map(_of_entry, of_kind)
    elif any(letter in word for letter in "*?["):
        pattern = word.lower()
        matching = [x for x in entries if any(fnmatch.fnmatch(n.lower(), pattern) for n in (x.name, *x.aliases))]
        if not matching:
            raise NotFoundError(f"no built-in material matches {shown(word)}; `gonio materials` lists all")
        yield from map(_of_entry, matching)
    elif (entry := builtin.find(word)) is not None:
        yield _of_entry(entry)
    else:
        m = as_typed(word)
        yield _Candidate(word, lambda: m, "expression")


def _of_file(path: Path) -> _Candidate:
    return _Candidate(path.name, lambda: as_typed(str(path)), "file")


def _title(m: Reflectance) -> str:
    if isinstance(m, Measured) and m.path:
        return Path(m.path).name
    text = repr(m)
    return text if len(text) <= 40 else f"{text[:36]} ..."


def _text(m: Reflectance) -> str:
    """What a material is, in a few words."""
    return f"file, {m.format}" if isinstance(m, Measured) and m.path else f"{' '.join(repr(m).split()):.200}"


# Values of a material at the pairs.


@cache
def _pairs() -> tuple[np.ndarray, np.ndarray]:
    """wi, wo (N, 3): the same for all materials."""
    u = lattice(PAIRS, 4)
    quarter = 0.5 * math.pi
    near = from_half_difference(
        quarter * u[:, 0] ** 2, 4.0 * quarter * u[:, 1], quarter * u[:, 2], 4.0 * quarter * u[:, 3]
    )
    high = np.minimum(near[0][:, 2], near[1][:, 2]) >= GRAZING
    spread = lattice_pairs(PAIRS, GRAZING)
    wi, wo = (np.concatenate([x, y[high]]) for x, y in zip(spread, near, strict=True))
    return wi, wo


@dataclass(frozen=True)
class _PairValues:
    """f cos(theta_i) (N, C) at the pairs, whether it is RGB, gray or other channels, and the names of these."""

    values: np.ndarray
    kind: str
    names: tuple[Any, ...] | None = None

    @cached_property
    def luminance(self) -> np.ndarray:
        """One number (N, 1): the luminance of a colour, the mean of other channels."""
        shares = LUMINANCE if self.kind == COLOUR else np.full(self.values.shape[1], 1.0 / self.values.shape[1])
        return transformed(self.values, shares[:, None])


def require_reflecting(m: Reflectance) -> None:
    """Raises ParameterError for what transmits: no surface to compare with others."""
    refuse_transmission(
        m, f"nearest: {shown(m)} transmits light; expected a surface that reflects alone: compare its reflecting part"
    )


def _seen(m: Reflectance) -> _PairValues:
    require_reflecting(m)
    if m.fluoresces:
        raise ParameterError(
            f"nearest: {shown(m)} fluoresces; expected f without: gn.reconstruction.nearest(m.under(light), ...)"
        )
    require_numbers(m, "nearest")
    if maps := map_shape(m):
        raise ParameterError(
            f"nearest: a map of shape {maps}; expected one material: m.replace, with numbers of a place"
        )
    if any(x is None or isinstance(x, Spectrum) for x in tree.leaves(m)):  # wavelengths are still to be said
        m = m.at(SPECTRUM)
    to_rgb = None if is_rgb(m) else shown_as(m)
    wi, wo = _pairs()
    rows = max(1, VALUES // (m.channels or 1))
    parts = [_lit(m, wi[k : k + rows], wo[k : k + rows], to_rgb) for k in range(0, len(wi), rows)]
    values = np.concatenate(parts)
    if values.shape[1] == 1:
        return _PairValues(values, GRAY)
    return (
        _PairValues(values, COLOUR) if is_rgb(m) or to_rgb is not None else _PairValues(values, OTHER, m.channel_names)
    )


def _lit(m: Reflectance, wi: np.ndarray, wo: np.ndarray, to_rgb: np.ndarray | None) -> np.ndarray:
    """f cos(theta_i) (n, C) at some pairs, turned into RGB by a matrix; NaN where f is none."""
    f = np.asarray(ops.numbers(m.f(wi, wo)), dtype=float).reshape(len(wi), -1)
    if m.has_delta:
        f = f + _mirrored(m, wi, wo)
    values = np.where(np.isfinite(f), f, math.nan) * wi[:, 2:]
    return values if to_rgb is None else transformed(values, to_rgb)


def _mirrored(m: Reflectance, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f (n, C) of the lobe by which delta lobes are compared: their reflectance times D/(4 cos cos), of GGX."""
    of = half_difference(wi, wo)
    reflectance = np.asarray(ops.numbers(m.delta_reflectance(direction(of.theta_d, of.phi_h))), dtype=float)
    cos_h = np.cos(of.theta_h)
    D = MIRROR**2 / (math.pi * (1.0 + cos_h**2 * (MIRROR**2 - 1.0)) ** 2)
    lobe: np.ndarray = reflectance.reshape(len(wi), -1) * (D / (4.0 * wi[:, 2] * wo[:, 2]))[:, None]
    return lobe


# Distances.


def _match(
    target: _PairValues, candidate: _Candidate, distance: Distance, free: bool, kept: dict[int, np.ndarray]
) -> Match:
    """`kept`: what is compared of `target`, by the address of its values."""
    try:
        other = candidate.make()
        what = _text(other) if candidate.what == "file" else candidate.what
        ours, theirs, compared = _comparable(target, _seen(other))
    except (Error, OSError) as error:
        reason = " ".join(str(error).split()).removeprefix("nearest: ")
        folder, _, rest = reason.partition(f"{candidate.name}: ")
        reason = rest if rest and os.path.exists(folder + candidate.name) else reason
        return Match(candidate.name, what=candidate.what, reason=reason, _make=candidate.make)
    finite = np.isfinite(ours).all(axis=1) & np.isfinite(theirs).all(axis=1)
    match = Match(
        candidate.name,
        what=what,
        compared=compared,
        left_out=int((~finite).sum()),
        pairs=len(finite),
        _make=candidate.make,
    )
    if finite.sum() < FEWEST:
        few = f"{finite.sum()} of {len(finite)} pairs of directions have a value in both, expected {FEWEST} at least"
        return replace(match, reason=few)
    if finite.all():
        if id(ours) not in kept:
            kept[id(ours)] = distance.compared(ours)
        least, factor = _apart(kept[id(ours)], theirs, distance, free)
    else:
        least, factor = _apart(distance.compared(ours[finite]), theirs[finite], distance, free)
    return replace(match, distance=least, factor=factor)


def _comparable(a: _PairValues, b: _PairValues) -> tuple[np.ndarray, np.ndarray, str]:
    """Values of both in the same channels, and in words which these are."""
    if OTHER not in (a.kind, b.kind):
        if a.kind == b.kind:
            return a.values, b.values, a.kind
        return a.luminance, b.luminance, "luminance"
    count = a.values.shape[1]
    if a.kind == b.kind and a.names == b.names and count == b.values.shape[1]:
        return a.values, b.values, f"{count} channels"
    words = {COLOUR: "luminance", GRAY: "gray"}
    of = [words.get(x.kind, f"mean of {x.values.shape[1]} channels") for x in (a, b)]
    return a.luminance, b.luminance, " and ".join(dict.fromkeys(of))


def _apart(compared: np.ndarray, theirs: np.ndarray, distance: Distance, free: bool) -> tuple[float, float]:
    """The distance from what is compared of a material, and the factor of `theirs`."""
    factor = _best_factor(theirs, distance, compared) if free else 1.0
    off = compared - distance.compared(factor * theirs if free else theirs)
    return float(np.sqrt(np.mean(off * off))), factor


def _best_factor(theirs: np.ndarray, distance: Distance, compared: np.ndarray) -> float:
    """The factor of `theirs` that makes the distance least: 1 where they are 0."""
    if not theirs.max() > 0.0:
        return 1.0
    if distance is not DISTANCES["log"]:
        x, y = distance.compared(theirs), compared
        share = max(float((x * y).sum() / (x * x).sum()), 0.0)
        return share if distance is DISTANCES["cosine"] else share**3
    x, y = np.maximum(theirs, 0.0).ravel(), compared.ravel()
    few, of_few = x[::16], y[::16]  # the sum of squares may have several minima
    tried = np.arange(-LARGEST, LARGEST + 0.1, 0.5)
    t = tried[np.argmin([np.sum((np.log1p(math.exp(t) * few) - of_few) ** 2) for t in tried])]
    low, high = t - 1.0, t + 1.0
    for _ in range(30):
        scaled = math.exp(t) * x
        slope = scaled / (1.0 + scaled)
        step = float(slope @ (y - np.log1p(scaled)) / max(slope @ slope, 1e-300))
        t, before = min(max(t + step, low), high), t
        if abs(t - before) < 1e-9:
            break
    return math.exp(t)
