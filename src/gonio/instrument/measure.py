"""`gn.gonioreflectometer`: the reflectance of a surface that is known by its shape, with its uncertainty."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np

from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..base.sides import refuse_transmission
from ..declared.arguments import BELOW_HORIZON, Declared, Seed, checked
from ..errors import ParameterError, ToleranceWarning, shown, warn
from ..evaluate import batch
from ..formula import tree
from ..formula.state import note
from ..surfaces.height_field import HeightField
from ..tables.gridded import Gridded
from ..tables.nodes import channels_named
from .cells import Cells
from .march import tables
from .parts import tiles
from .report import Measurement
from .trace import points, trace

FEWEST = 8
"""Independent surfaces at least: of fewer the spread is not known."""

USUAL = tuple(math.radians(15.0 * k) for k in range(6))
"""Angles of incidence [rad] where none are given."""

Incidences = Annotated[
    Sequence[float],
    Declared("polar angles of incidence", 0.0, BELOW_HORIZON, "rad", rising=True),
]


class Simulated(Gridded):
    """A table that `gn.gonioreflectometer` measured on a surface in the computer: a `Gridded` with standard
    uncertainties, and how they came about.

    Each value is the mean over a cell of directions: rings as wide as the distance of the nodes, and sectors of them.

    Error    statistical, in `uncertainty`; that of the cells and of the interpolation between them comes on top.
    Source   Westin, Arvo & Torrance 1992, "Predicting reflectance functions from complex surfaces", SIGGRAPH.

    Example
    >>> rough = gn.surfaces.gaussian(0.3, size=64)
    >>> m = gn.gonioreflectometer(rough, theta_i=0.5, cells=(9, 12), rays=1 << 12, tolerance=1)
    >>> print(m.stored.shape, m.uncertainty.shape, m.converged)
    (1, 9, 7) (1, 9, 7) True
    """

    format = "table"
    bounces: np.ndarray = note()
    """Shares (theta_i, phi_i, bounces, channels) of the incident light that leave after one bounce, two, ..."""
    converged: bool = note(True)
    """Whether the error that was asked for is reached for all directions of incidence."""
    report: Measurement = note()


@checked
def gonioreflectometer(
    surface: HeightField,
    facet: float | Reflectance = 1.0,
    theta_i: Incidences = USUAL,
    phi_i: Annotated[
        Sequence[float],
        Declared(
            "azimuths of incidence on a surface that is not isotropic",
            *(0.0, 2.0 * math.pi, "rad"),
            rising=True,
            usual="every 30 degrees",
        ),
    ]
    | None = None,
    cells: Annotated[tuple[int, int], Declared("rings of polar angles, and sectors of azimuths, an even number", 1)] = (
        18,
        36,
    ),
    tolerance: Annotated[
        float, Declared("relative standard error of a cell, on average, to go on until", 1e-5, 1.0, "share")
    ] = 0.01,
    bounces: Annotated[int, Declared("how often light is followed", 1, 1000)] = 16,
    rays: Annotated[int, Declared("rays on each surface, from each direction", 1024, 1 << 24)] = 1 << 18,
    surfaces: Annotated[int, Declared("independent surfaces at most", FEWEST, 1_000_000)] = 256,
    seed: Seed = 0,
    progress: Callable[[int, int], None] | None = None,
) -> Simulated:
    """Measure the reflectance of a surface that is known by its shape, as a gonioreflectometer would.

    Parallel light falls on the surface. Its rays are followed from facet to facet until they leave, and are counted in
    cells of directions: f = (share of the light in the cell) / (integral of cos(theta_o) over the cell).

    facet      reflectance of the facets, which are mirrors; or any reflectance, in the frame of the facet: of light
               from in front, and reciprocal
    tolerance  mean standard uncertainty of the cells over mean f at which a direction of incidence is done
    bounces    what is inside after them is `report.unfinished`
    surfaces   where the error is not reached by then there is a ToleranceWarning
    progress   progress(done, total) is called after each surface

    The uncertainty is that of the mean of independent surfaces, by their spread: on one surface more rays do not help.
    A surface that is no random one is measured with rays at shifted places; a part of a larger one (`from_map`), by 16
    parts of it.

    Shapes   `stored`: (theta_i, theta_o, phi), of surfaces that are not isotropic (theta_i, theta_o, phi, phi_i), and
             channels of `facet`.
    Units    f: 1/sr.
    Error    standard uncertainty in `uncertainty`. Light once reflected by a Gaussian surface of mirrors, alpha = 0.4,
             against `Microfacet(Beckmann(0.4))`: docs/gonioreflectometer.md has what is left. Geometrical optics: no
             diffraction; facets must be much larger than the wavelength.
    Raises   ParameterError for facets that transmit or vary over the surface; DirectionError for angles in degrees.
    Source   Westin, Arvo & Torrance 1992, "Predicting reflectance functions from complex surfaces", SIGGRAPH.

    Example
    >>> grooves = gn.gonioreflectometer(gn.surfaces.v_grooves(0.6), theta_i=0.3, phi_i=0.0, rays=1 << 14)
    >>> print(grooves.report.reflected.round(6), (grooves.bounces[0, 0, 0] < 1.0).all())
    [[1.]] True
    """
    reflectance = _facet(facet)
    names, oriented = None, surface.turn > 0.0
    if isinstance(reflectance, Reflectance) and (width := batch.channels(reflectance)):
        names = reflectance.channel_names or channels_named(width)
    of_light = _angles("theta_i", theta_i, 0.5 * math.pi)
    around = _azimuths(surface, phi_i)
    grid = _cells(cells)
    samples = _Surfaces(surface, rays, seed)
    tally = _Tally(grid, not oriented, (len(of_light), len(around)), tolerance, rays)
    count = min(surfaces, samples.count)
    start = time.perf_counter()
    for k in range(count):
        todo = tally.unfinished()
        if not len(todo):
            break
        held, chosen, shift, rng = samples.drawn(k)
        for i, j in todo:
            traced = trace(held, reflectance, of_light[i], around[j], grid, bounces, chosen, shift, rng)
            tally.add((i, j), traced, of_light[i] < 1e-6)
        if progress is not None:
            progress(k + 1, count)
    seconds = time.perf_counter() - start
    f, u = tally.results()
    report = Measurement(
        *(of_light, around, tally.errors(), tolerance, tally.done.copy(), rays),
        *(tally.mean(tally.reflected), tally.mean(tally.unfinished_light), tally.mean(tally.lost), seconds),
        _notes(surface, samples, grid),
    )
    converged = bool((report.error <= tolerance).all())
    if not converged:
        worst = report.error.max()
        cure = (
            "a larger map" if surface.is_part else f"surfaces={surfaces} were not enough: allow more, or larger cells"
        )
        text = f"gonioreflectometer: the error is {worst:.2g}, expected {tolerance:g}; {cure}, or accept"
        text += f" tolerance={worst:.2g}"
        warn(text, ToleranceWarning)
    axes: dict[str, np.ndarray] = {"theta_i": of_light, "theta_o": grid.theta_o}
    if oriented:
        axes |= {"phi": grid.phi, "phi_i": around}
        f, u = (np.moveaxis(x, 1, 3) for x in (f, u))
    else:
        half = grid.sectors // 2 + 1
        axes |= {"phi": grid.phi[:half]}
        f, u = f[:, 0, :, :half], u[:, 0, :, :half]
    if names is None:
        f, u = f[..., 0], u[..., 0]
    table = Simulated(
        "relative" if oriented else "angles",
        axes,
        f,
        uncertainty=u,
        channels=names,
        mirrored=not oriented,
        periods={"phi_i": surface.turn} if oriented else None,
        about={
            "made_of": f"{surface.title}, facets {shown(facet)}",
            "bounces": bounces,
            "surfaces": int(report.surfaces.max()),
            "rays": rays,
            "error": float(report.error.max()),
        },
    )
    return tree.with_notes(table, bounces=tally.per_bounce(), converged=converged, report=report)


class _Surfaces:
    """The surfaces to measure, and the places of rays on each: independent ones, shifts, or parts."""

    def __init__(self, surface: HeightField, rays: int, seed: int):
        self.surface, self.points, self.seed = surface, points(rays), seed
        self.held = None if surface.is_random else tables(surface)
        self.count = 16 if surface.is_part else 1_000_000

    def drawn(self, k: int) -> tuple[dict[str, Any], np.ndarray, np.ndarray, np.random.Generator]:
        """The tables of surface k, the places, their shift, and random numbers."""
        rng = np.random.default_rng([self.seed, k])
        held = self.held or tables(self.surface.realization(int(rng.integers(1 << 31))))
        if self.surface.is_part:
            return held, tiles(self.points, k, self.surface.is_mirrored), np.zeros(2), rng
        return held, self.points, rng.random(2), rng

    @property
    def kind(self) -> str:
        """What the surfaces are that the error is from, in words."""
        if self.surface.is_part:
            return "16 parts of the surface: with larger features than these the error is more"
        return "independent surfaces" if self.surface.is_random else "the same surface with rays at shifted places"


class _Tally:
    """Sums over the surfaces, by direction of incidence."""

    def __init__(self, cells: Cells, mirrored: bool, directions: tuple[int, int], target: float, rays: int):
        self.cells, self.mirrored, self.target, self.rays = cells, mirrored, target, rays
        self.done = np.zeros(directions, int)
        self.sums: dict[tuple[int, int], list[Any]] = {}

    def add(self, at: tuple[int, int], found: Any, along_normal: bool) -> None:
        f = self.cells.f(found.cells, self.mirrored, along_normal)
        terms = [f, f * f, found.bounces, found.unfinished, found.lost]
        self.sums[at] = [a + b for a, b in zip(self.sums.get(at, [0.0] * len(terms)), terms, strict=True)]
        self.done[at] += 1

    def unfinished(self) -> list[tuple[int, int]]:
        """The directions whose error is not yet what it is to be."""
        places: list[Any] = list(np.ndindex(self.done.shape))
        return [at for at in places if self.done[at] < FEWEST or self._error(at) > self.target]

    def _spread(self, at: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
        """The mean f and its standard uncertainty; where no light came, that of one ray."""
        n, (f, square) = self.done[at], self.sums[at][:2]
        mean = f / n
        spread = np.sqrt(np.maximum(square / n - mean * mean, 0.0) / max(n - 1, 1))
        return mean, np.where(mean > 0.0, spread, 1.0 / (n * self.rays * self.cells.projected[..., None]))

    def _error(self, at: tuple[int, int]) -> float:
        f, u = self._spread(at)
        weight = self.cells.projected[..., None]
        whole = float((weight * f).sum())
        return float((weight * u).sum()) / whole if whole > 0.0 else 0.0

    def errors(self) -> np.ndarray:
        return np.array([[self._error((i, j)) for j in range(self.done.shape[1])] for i in range(self.done.shape[0])])

    def _stacked(self, of: Callable[[tuple[int, int]], np.ndarray]) -> np.ndarray:
        rows, columns = self.done.shape
        return np.stack([np.stack([of((i, j)) for j in range(columns)]) for i in range(rows)])

    def results(self) -> tuple[np.ndarray, np.ndarray]:
        """f and its standard uncertainty (theta_i, phi_i, theta_o, phi, C)."""
        return self._stacked(lambda at: self._spread(at)[0]), self._stacked(lambda at: self._spread(at)[1])

    def per_bounce(self) -> np.ndarray:
        """Shares (theta_i, phi_i, bounces, C)."""
        return self._stacked(lambda at: self.sums[at][2] / self.done[at])

    def mean(self, of: Callable[[tuple[int, int]], np.ndarray]) -> np.ndarray:
        """A share (theta_i, phi_i), mean over the channels."""
        return self._stacked(lambda at: np.mean(of(at)) / self.done[at])

    def reflected(self, at: tuple[int, int]) -> np.ndarray:
        whole: np.ndarray = self.sums[at][2].sum(0)
        return whole

    def unfinished_light(self, at: tuple[int, int]) -> np.ndarray:
        light: np.ndarray = self.sums[at][3]
        return light

    def lost(self, at: tuple[int, int]) -> np.ndarray:
        light: np.ndarray = self.sums[at][4]
        return light


def _facet(facet: float | Reflectance) -> float | Reflectance:
    if isinstance(facet, Reflectance):
        rule = "it transmits; expected facets that light does not go through"
        refuse_transmission(facet, f"facet={facet!r:.80}: {rule}")
        if map_shape(facet):
            raise ParameterError(f"facet={facet!r:.80}: it has maps; expected one reflectance for all facets")
        return facet
    if not 0.0 <= facet <= 1.0:
        raise ParameterError(f"facet={facet:g}: expected the reflectance of mirrors, 0 to 1, or any Reflectance")
    return facet


def _angles(name: str, given: Sequence[float], high: float) -> np.ndarray:
    angles = np.array(given)
    if angles[-1] >= high - 1e-4:
        below = f"{high:.5g} rad, {math.degrees(high):g} degrees"
        raise ParameterError(f"{name}={shown(given)}: expected angles below {below}")
    return angles


def _azimuths(surface: HeightField, phi_i: Any) -> np.ndarray:
    if surface.turn == 0.0:
        if phi_i is not None:
            raise ParameterError("phi_i: the surface is isotropic, and has one table for all; leave it out")
        return np.zeros(1)
    if phi_i is None:
        return math.radians(30.0) * np.arange(round(surface.turn / math.radians(30.0)))
    return _angles("phi_i", phi_i, surface.turn)


def _cells(cells: Sequence[int]) -> Cells:
    rings, sectors = cells
    if not (2 <= rings <= 900 and 2 <= sectors <= 3600 and sectors % 2 == 0):
        raise ParameterError(f"cells={(rings, sectors)}: expected 2 to 900 rings and 2 to 3600 sectors, an even number")
    return Cells(rings, sectors)


def _notes(surface: HeightField, surfaces: _Surfaces, cells: Cells) -> tuple[str, ...]:
    along, across = surface.rms_slopes
    unit = f" {surface.unit}" if surface.unit else ""
    scale = f"cells of {surface.cell[0]:.4g} x {surface.cell[1]:.4g}{unit}"
    return (
        f"error: by the spread of {surfaces.kind}",
        f"surface: {surface.title}; {scale}, rms slopes {along:.4g} and {across:.4g}",
        f"directions: means over {math.degrees(cells.width):.3g} x {360.0 / cells.sectors:.3g} degrees; "
        f"lobes narrower than that are smeared",
        "light: geometrical optics, valid where features are much larger than the wavelength",
    )
