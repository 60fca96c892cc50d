"""`gn.reconstruction.retro_facets`: the distribution of facet normals that retro-reflection shows, by power
iteration."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..base.angles import direction
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..base.sides import require_finite
from ..declared.arguments import checked
from ..declared.notebooks import repr_html
from ..distributions.beckmann import Beckmann
from ..distributions.ggx import GGX
from ..distributions.tabulated_anisotropic_facets import TabulatedAnisotropicFacets
from ..distributions.tabulated_facets import TabulatedFacets
from ..errors import ParameterError, ShapeError
from ..fitting.samples import real
from ..formula import tree
from ..formula.direction import Direction
from ..formula.distribution import ALPHA_HIGH, ALPHA_LOW, Distribution
from ..formula.fresnel.schlick import Schlick
from ..models.lambertian import Lambertian
from ..models.microfacet import Microfacet
from ..numerics.filling import filled_in_layers
from ..numerics.projected_areas import area_harmonics, polar_nodes, projected_areas, rows_between

CELLS = 180
"""Polar angles, less one, equally spaced in sqrt(theta)."""

AZIMUTHS = 128
"""Azimuths of anisotropic data."""

STEPS = 200
CHANGE = 1e-10
"""Ends of the power iteration: steps, and the largest change of D, of its largest value."""

SAME = 1e-4
"""Largest change of f with azimuth, of its largest value, with which it is isotropic."""

HAZE = 0.05
"""Share of its largest value that D at 80 degrees may have before a diffuse part is suspected."""

MISSING = 0.5
"""Largest share of the pairs wo = wi that may hold no number."""

MASKINGS = ("height_correlated", "view")


@dataclass(frozen=True, eq=False)
class RetroFacets:
    """What `retro_facets` found.

    facets    `TabulatedFacets`, or `TabulatedAnisotropicFacets`
    F0        reflectance of a facet at normal incidence, a number or (C,)
    diffuse   albedo of the Lambertian part that was taken off, a number or (C,)
    steps     of the power iteration
    notes     sentences about what should be known

    Example
    >>> found = gn.reconstruction.retro_facets(gn.Microfacet(gn.GGX(0.3), gn.Schlick(0.05)))
    >>> print(found.F0.round(4), found.steps, found.notes)
    0.05 14 ()
    """

    _repr_html_ = repr_html

    facets: Distribution
    F0: Any
    diffuse: Any
    steps: int
    notes: tuple[str, ...]
    _slopes: tuple[float, float, float, float]

    @cached_property
    def model(self) -> Reflectance:
        """`Microfacet` of these facets, with Schlick's Fresnel term: retro-reflection knows normal incidence only. The
        diffuse part is added, where there is one.

        Example
        >>> paint = gn.Microfacet(gn.GGX(0.3), gn.Schlick(0.05))
        >>> m = gn.reconstruction.retro_facets(paint).model
        >>> print(m.f_angles(0.4, 0.0, 0.4, np.pi).round(3), paint.f_angles(0.4, 0.0, 0.4, np.pi).round(3))
        0.204 0.204
        """
        return self._with(self.facets)

    @cached_property
    def ggx(self) -> Reflectance:
        """The same with GGX: alpha is the mean of |slope| along each axis. A start for `gn.fit`.

        Example
        >>> print(gn.reconstruction.retro_facets(gn.Microfacet(gn.GGX(0.3, 0.5), 0.5)).ggx.distribution)
        GGX(alpha_x=0.3, alpha_y=0.4999)
        """
        return self._with(self._ggx())

    @cached_property
    def beckmann(self) -> Reflectance:
        """The same with Beckmann: alpha^2 is twice the mean square of the slope along each axis.

        Example
        >>> print(gn.reconstruction.retro_facets(gn.Microfacet(gn.Beckmann(0.3), 0.5)).beckmann.distribution)
        Beckmann(alpha_x=0.3)
        """
        return self._with(self._beckmann())

    def _with(self, facets: Distribution) -> Reflectance:
        m = Microfacet(facets, Schlick(np.minimum(self.F0, 1.0)))
        return Lambertian(self.diffuse) + m if np.any(self.diffuse) else m

    def _ggx(self) -> GGX:
        return GGX(*self._alphas(self._slopes[:2], 1.0))

    def _beckmann(self) -> Beckmann:
        return Beckmann(*self._alphas(self._slopes[2:], math.sqrt(2.0)))

    def _alphas(self, slopes: tuple[float, ...], scale: float) -> list[float]:
        alphas = [float(f"{min(max(scale * s, ALPHA_LOW), ALPHA_HIGH):.4g}") for s in slopes]
        return alphas if isinstance(self.facets, TabulatedAnisotropicFacets) else [alphas[0]]

    def __str__(self) -> str:
        F0 = " ".join(f"{x:.4g}" for x in np.atleast_1d(self.F0))
        lines = [f"{type(self.facets).__name__} of retro-reflection, F0 {F0}"]
        lines += [f"like {self._ggx()!r} by the mean slope, {self._beckmann()!r} by its square"]
        return "\n".join([*lines, *(f"  - {text}" for text in self.notes)])


@checked
def retro_facets(
    m: Reflectance, *, isotropic: bool | None = None, diffuse: Any = 0.0, masking: str = "height_correlated"
) -> RetroFacets:
    """The distribution of facet normals that explains what a surface sends back to the light.

    With wi = wo = w all light comes from facets whose normal is w: f(w, w) = F0 D(w) G(w, w)/(4 cos^2(theta)). G needs
    D itself, by the projected area of facets s(w) = integral of D(wm) max(w . wm, 0) dwm: G1 = cos(theta)/s, and height
    correlated G = 1/(2/G1 - 1). So D is an eigenvector, of the eigenvalue F0, of a linear operator without negative
    values, and power iteration finds it:

        D(w) <- 4 cos(theta) f(w, w) (2 s(w) - cos(theta) s_0)/F0,    s_0 = integral of D(wm) cos(theta_m) dwm = 1.

    It needs no start, and no other pairs of directions. F0 is that of the mean over channels in the iteration, then of
    each channel by least squares.

    `isotropic`: True takes the mean of f over the azimuth, False keeps what depends on it. Without it f tells: it is
    isotropic where it changes by at most 1e-4 of its largest value. `diffuse`: the albedo of a Lambertian part, a
    number or one for each channel, which is taken off first. `masking`: "height_correlated", that of `Microfacet`; or
    "view", G = G1, with which light and view see the same facets, as in the published method.

    Shapes   results: numbers, or (C,).
    Units    f: 1/sr; diffuse, F0: 1.
    Error    of GGX and Beckmann from their own retro-reflection, alpha 0.05 to 0.8: F0 relative 1.4e-3. Isotropic: D
             1.2e-3 of its largest value, alpha 1.2e-3; anisotropic: D 4e-3 and alpha 2e-3 (median), 8e-2 and 5e-2 at
             (0.05, 0.8), for which 128 azimuths are few.
    Source   Dupuy, Heitz, Iehl, Poulin & Ostromoukhov 2015, "Extracting Microfacet-based BRDF Parameters from Arbitrary
             Materials with Power Iterations", CGF 34(4). The height-correlated operator: derived here.

    Example
    >>> gold = gn.Microfacet(gn.Beckmann(0.2), gn.Schlick([1.0, 0.77, 0.34]))
    >>> found = gn.reconstruction.retro_facets(gold)
    >>> print(found.F0.round(3), found.beckmann.distribution)
    [1.   0.77 0.34] Beckmann(alpha_x=0.2001)
    """
    if masking not in MASKINGS:
        raise ParameterError(f"masking={masking!r:.60}: expected {MASKINGS[0]!r} or {MASKINGS[1]!r}")
    require_finite(m, "a reflectance of one side, whose f is finite")
    if maps := map_shape(m):
        raise ShapeError(f"{m!r:.80}: a map of shape {maps}, with channels last; expected one place of it, no map")
    theta = 0.5 * math.pi * np.square(np.arange(CELLS + 1) / CELLS)
    seen = np.minimum(theta, theta[-2])  # D at the horizon is that just before it
    f, lost = _retro(m, seen, AZIMUTHS if tree.is_oriented(m) else 1)
    if isotropic or (isotropic is None and np.ptp(f, axis=1).max() <= SAME * f.max()):
        f = f.mean(axis=1, keepdims=True)
    rho = _albedo(diffuse, f.shape[-1])
    f = f - rho / math.pi
    negative = float((f < 0.0).mean())
    f = np.maximum(f, 0.0)
    if not f.any():
        beside = negative > 0.0
        raise ParameterError(
            f"{m!r:.80}: nothing comes back to the light{' beside the diffuse part' if beside else ''}; expected f "
            f"above {'that part' if beside else '0'} for wo = wi"
        )
    D, shown, steps = _iterated(4.0 * np.cos(seen)[:, None] * f.mean(axis=-1), seen, masking)
    whole = D / (4.0 * np.cos(seen)[:, None] * shown)  # f of facets with F0 = 1
    weight = np.cos(seen) * np.sin(seen) * np.sqrt(seen)  # of solid angles as they are seen
    F0 = np.einsum("i,ij,ijc->c", weight, whole, f) / np.einsum("i,ij->", weight, whole * whole)
    facets: Distribution
    if f.shape[1] == 1:
        facets = TabulatedFacets(theta, D[:, 0])
    else:
        facets = TabulatedAnisotropicFacets(theta, _azimuths(f.shape[1]), D)
    notes = tuple(_notes(D, theta, F0, lost, negative, steps))
    each: Any = ... if m.channels is not None else 0
    return RetroFacets(facets, F0[each], np.broadcast_to(rho, F0.shape)[each], steps, notes, _slopes(facets))


def _azimuths(count: int) -> np.ndarray:
    return 2.0 * math.pi / count * np.arange(count)


def _retro(m: Reflectance, theta: np.ndarray, around: int) -> tuple[np.ndarray, float]:
    """f(w, w) (N, M, C), with gaps filled from beside them, and the share of gaps."""
    w = direction(theta[:, None], _azimuths(around))
    f = np.asarray(m.f(w, w), float).reshape(*w.shape[:2], -1)
    finite = np.isfinite(f)
    share = 1.0 - float(finite.mean())
    if share > MISSING:
        raise ParameterError(
            f"{m!r:.80}: no number for {share:.0%} of the pairs wo = wi; expected retro-reflection in the data"
        )
    return filled_in_layers(np.where(finite, f, math.nan), (False, True, False))[0], share


def _albedo(rho: Any, channels: int) -> np.ndarray:
    array = real("diffuse", rho)
    if array.shape not in ((), (1,), (channels,)):
        raise ShapeError(f"diffuse: got shape {array.shape}; expected a number, or one for each of {channels} channels")
    if not ((array >= 0.0) & (array <= 1.0)).all():
        raise ParameterError(f"diffuse={rho!r:.60}: expected the albedo of a Lambertian part, from 0 to 1")
    return array


def _iterated(factor: np.ndarray, theta: np.ndarray, masking: str) -> tuple[np.ndarray, np.ndarray, int]:
    """D (N, M), which is cos(theta)/G of it times `factor`, over F0; that cos(theta)/G; and the steps it took."""
    nodes, width = polar_nodes(CELLS)
    solid, z = (np.sin(nodes) * width)[:, None], np.cos(theta)[:, None]
    harmonics = np.stack([*area_harmonics(nodes, theta, factor.shape[1])])

    def normalized(D: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at_nodes = rows_between(D, nodes, CELLS) * solid
        total = 2.0 * math.pi * float(np.cos(nodes) @ at_nodes.mean(axis=1))
        area = np.maximum(projected_areas(at_nodes / total, harmonics), z)  # G1 <= 1, also of facets that lean
        return D / total, area if masking == "view" else 2.0 * area - z

    D, shown = normalized(np.ones(factor.shape))
    step, change = 0, math.inf
    while step < STEPS and change > CHANGE * D.max():
        before, step = D, step + 1
        D, shown = normalized(factor * shown)
        change = float(np.abs(D - before).max())
    return D, shown, step


def _slopes(facets: Distribution) -> tuple[float, float, float, float]:
    """Means over the surface of |slope| along x and y, and roots of the means of its square."""
    nodes, width = polar_nodes(CELLS)
    wm = np.moveaxis(direction(nodes[:, None], _azimuths(4 * AZIMUTHS)), -1, 0)
    weight = np.asarray(facets.D(Direction(*wm))) * (np.sin(nodes) * np.cos(nodes) * width)[:, None]
    weight = weight / weight.sum()
    x, y = (np.abs(wm[k]) / wm[2] for k in (0, 1))
    mean, square = ([float((weight * s**p).sum()) for s in (x, y)] for p in (1, 2))
    return mean[0], mean[1], math.sqrt(square[0]), math.sqrt(square[1])


def _notes(D: np.ndarray, theta: np.ndarray, F0: np.ndarray, lost: float, negative: float, steps: int) -> Iterator[str]:
    far = float(D[np.searchsorted(theta, math.radians(80.0))].mean() / D.max())
    if lost:
        yield f"{lost:.0%} of the pairs wo = wi hold no number; they were filled from those beside them"
    if negative:
        yield f"f is below 0, or below the diffuse part, for {negative:.0%} of the pairs wo = wi; D is 0 there"
    if far > HAZE:
        yield f"D at 80 degrees is {far:.0%} of its largest value: very rough facets, or a diffuse part: see `diffuse`"
    if (F0 > 1.0).any():
        yield f"F0 = {float(F0.max()):.3g} is above 1: f is not that of facets, or not in 1/sr"
    if steps == STEPS:
        yield f"the power iteration did not end within {STEPS} steps"
