"""`gn.reconstruction.photometric_stereo`: normals and albedos of every texel, from images under known lights."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.light import Light
from ...declared.arguments import checked
from ...declared.notebooks import repr_html
from ...errors import ParameterError
from ...formula.text import listed
from ..losses import ROBUST, SCALES
from .lit_images import LitImages, LitTexels
from .maps import counted
from .normal_equations import PAIRS, NormalEquations, cofactors, solved, times

AT_ONCE = 1 << 13
"""Texels of a block, so that its arrays stay in the caches of the processor."""

STEPS = 12
"""Times that lights are looked for that a normal faces away from. After half of them none comes back: it ends."""

ROUNDS = 12
"""Times that values are weighed anew by their residuals, in robust fits."""

UNSURE = 1e-8
"""Part of the trace of the normal equations up to which what they say of the normal counts as nothing: lights within
0.006 degrees of a plane through the texel."""

STEP = 1e-4
"""Relative step by which slopes of weights are found."""

TOO_FEW, NOT_ENDED, ABOVE_ONE, UNDETERMINED = 1, 2, 4, 8
FLAGS = {
    TOO_FEW: "fewer than three values: NaN",
    NOT_ENDED: "the set of lights that a texel faces was not found",
    ABOVE_ONE: "an albedo above 1: other lights, or not Lambertian",
    UNDETERMINED: "the lights do not determine the normal: NaN",
}
"""Bit -> its meaning."""


@dataclass(frozen=True, eq=False)
class PhotometricStereo:
    """What `photometric_stereo` found, for every texel (...).

    normal          (..., 3) unit normals in the world; NaN where there are none
    albedo          (...), or (..., C) with channels
    normal_stderr   (...) root mean square angle [rad] between this normal and that of exact values
    albedo_stderr   as albedo: standard errors
    rms             (...) root mean square of residuals, in the unit of the images; with `u` in standard uncertainties
    used            (...) number of images that count
    flags           (...) sums of `FLAGS`: 1 too few values, 2 not ended, 4 an albedo above 1, 8 not determined

    Standard errors are inf where no value is to spare and no `u` is given.

    Example
    >>> lamps = [gn.DistantLight(gn.direction(0.5, phi), irradiance=2.0) for phi in (0.0, 2.0, 4.0)]
    >>> dark = np.zeros((3, 1, 1))
    >>> print(gn.reconstruction.photometric_stereo(dark, lamps).count())
    {'fewer than three values: NaN': 1}
    """

    _repr_html_ = repr_html

    normal: np.ndarray
    albedo: np.ndarray
    normal_stderr: np.ndarray
    albedo_stderr: np.ndarray
    rms: np.ndarray
    used: np.ndarray
    flags: np.ndarray

    def count(self) -> dict[str, int]:
        """How many texels each flag was raised for, by its meaning; those that were raised at all.

        Example
        >>> lamps = [gn.DistantLight(gn.direction(theta, 1.0)) for theta in (0.1, 0.5, 0.9)]
        >>> print(gn.reconstruction.photometric_stereo(np.full((3, 4, 4), 0.2), lamps).count())  # lamps in one plane
        {'the lights do not determine the normal: NaN': 16}
        """
        return counted(self.flags, FLAGS)

    def __str__(self) -> str:
        shape = " x ".join(map(str, self.rms.shape))
        lines = [f"{shape or 'one'} texels of photometric stereo"]
        degrees = np.degrees(self.normal_stderr)
        for name, x, unit in (("albedo", self.albedo, ""), ("standard error of the normal", degrees, " degrees")):
            finite = x[np.isfinite(x)]
            if finite.size:
                low, middle, high = np.quantile(finite, [0.05, 0.5, 0.95])
                lines.append(f"  {name}: {middle:.4g}{unit} in the median, 90 % from {low:.4g} to {high:.4g}")
        lines += [f"  {n} texels: {text}" for text, n in self.count().items()]
        return "\n".join(lines)


@checked
def photometric_stereo(
    images: Any,
    lights: Light | Iterable[Light],
    *,
    position: Any = None,
    mask: Any = None,
    saturation: float | None = None,
    shadow: float = 0.0,
    robust: str = "none",
    u: Any = None,
    coloured: bool | None = None,
) -> PhotometricStereo:
    """Normals and albedos of every texel, from K images by one camera under K known lights.

    The surface is Lambertian: L_k = rho E_k(p) max(n . w_k(p), 0)/pi, E of a plane that faces the light (of a point
    source I/r^2), w the direction to it. b = rho n/pi enters linearly: least squares of at least three values, at each
    texel. Values of lights that the normal found faces away from are left out, and the others solved again until
    none changes. Channels share the normal, which is that of their joint least squares.

    `images`: linear radiance, (K, H, W) or (K, H, W, C), or K pictures `gn.scenes.Image`, of which `light` is taken.
    Texels of coverage 0 are left out; those covered in part, as at silhouettes, get their albedo times coverage.
    `gn.scenes.load_image(path, linear=True)` reads codes that are linear as they are. NaN is left out.
    `coloured`: whether the last axis is that of channels; told where four axes, or pictures, tell it.
    `lights`: K small sources: `DistantLight`, `PointLight`, `SpotLight`.
    `position`: where each texel is, for lights that are near. Start from a plane.
    `mask`: True where texels (H, W), or values of each image (K, H, W), are used.
    `saturation`: values from here on are left out, in all channels as soon as one is. `shadow`: values up to here are
    left out, if all channels are; above the noise where things throw shadows on each other.
    `robust`: "none"; or "huber", "soft_l1", "cauchy", with which outliers such as highlights and shadows count less.
    `u`: standard uncertainty of values, a number or of the shape of images. Standard errors without it follow from the
    scatter of each texel's values about its model.

    Shapes   normal: (..., 3), albedo (...) or (..., C), for images (K, ...) or (K, ..., C).
    Units    images: W m-2 sr-1, in the units of the lights; position: m; normal_stderr: rad; albedo: 1.
    Error    rounding, of exact values. The mean of squared error over squared standard error of normals is 1.00 with
             `u`, and without it that of Student's t: 1.02 of 32 RGB images, 1.12 of 8, 1.40 of 4. It is no better than
             the model: GGX of 0.2 on a Lambertian part moves normals by 2.4 degrees on average, with "cauchy" by 1.2 to
             1.5; the wider a lobe, the less an outlier it is. Shadows of 5 % of 8 values, 3.2 degrees without `shadow`.
    Source   Woodham 1980, "Photometric method for determining surface orientation from multiple images", Optical
             Engineering 19(1):139. "Distant" and "nearby point source", slides B (docs/equations.md).

    Example
    >>> lamps = [gn.DistantLight(gn.direction(0.5, phi), irradiance=2.0) for phi in (0.0, 1.6, 3.2, 4.8)]
    >>> normal = gn.direction([[0.1, 0.3]], [[1.0, 2.0]])  # an image of two pixels
    >>> images = [gn.reflected_radiance(gn.Lambertian(0.4), lamp, [0, 0, 1], normal=normal) for lamp in lamps]
    >>> stereo = gn.reconstruction.photometric_stereo(images, lamps)
    >>> print(stereo.albedo, np.allclose(stereo.normal, normal))
    [[0.4 0.4]] True
    """
    if robust not in ROBUST:
        raise ParameterError(f"robust={robust!r:.60}: expected one of {listed([*ROBUST])}")
    data = LitImages.of(images, lights, position, mask, saturation, shadow, u, coloured)
    with np.errstate(all="ignore"):
        parts = [_Texels(data.block(slice(at, at + AT_ONCE))).solve(robust) for at in range(0, len(data), AT_ONCE)]
    normal, albedo, angle, spread, rms, used, flags = (np.concatenate(x, axis=-1) for x in zip(*parts, strict=True))
    shape = data.shape

    def by_channel(x: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(x.T).reshape(*shape, len(x)) if data.coloured else x[0].reshape(shape)

    return PhotometricStereo(
        np.ascontiguousarray(normal.T).reshape(*shape, 3),
        by_channel(albedo),
        angle.reshape(shape),
        by_channel(spread),
        rms.reshape(shape),
        used.reshape(shape),
        flags.reshape(shape),
    )


class _Texels:
    """T texels: what they show, and weights of it; normals n (3, T) and f = rho/pi (C, T), NaN where there are none."""

    def __init__(self, block: LitTexels):
        self.block, self.uses = block, block.counts.copy()
        self.precision = None if block.u is None else 1.0 / np.square(block.u)
        self.trust: np.ndarray | None = None  # weights (K, T) of robust fits
        self.share = np.ones(block.counts.shape[1])  # sum of weights over that of the slopes of what residuals count
        channels, _, count = block.L.shape
        self.n, self.f = np.full((3, count), np.nan), np.full((channels, count), np.nan)
        self.ended = np.ones(count, bool)
        self.sums = self._sums(slice(None))
        self._step(slice(None))

    def solve(self, robust: str) -> tuple[np.ndarray, ...]:
        """Normals (3, T), albedos (C, T), standard errors (T,) and (C, T), rms, used images and flags (T,)."""
        self._face(STEPS)
        if robust != "none":
            for _ in range(ROUNDS):
                self._weigh(robust)
                self._update(slice(None))
                self._face(2)
        return self._summary()

    def _sums(self, texels: Any) -> NormalEquations:
        L, w, E = (x if x.shape[-1] == 1 else x[..., texels] for x in (self.block.L, self.block.w, self.block.E))
        weights = self.uses[None, :, texels].astype(float)
        if self.trust is not None:
            weights *= self.trust[:, texels]
        if self.precision is not None:
            p = self.precision
            weights = weights * (p if p.shape[-1] == 1 else p[..., texels])
        G, WL = E[:, :, None] * w, weights * L
        pairs = np.stack([G[:, :, i] * G[:, :, j] for i, j in PAIRS], axis=2)
        squares = np.einsum("ckt,ckt->ct", WL, L)
        if G.shape[-1] == 1:
            return NormalEquations(
                np.swapaxes(pairs[..., 0], 1, 2) @ weights, np.swapaxes(G[..., 0], 1, 2) @ WL, squares
            )
        A = np.stack([(weights * pairs[:, :, k]).sum(axis=1) for k in range(6)], axis=1)
        return NormalEquations(A, np.stack([(WL * G[:, :, k]).sum(axis=1) for k in range(3)], axis=1), squares)

    def _update(self, texels: Any) -> None:
        for kept, new in zip(self.sums, self._sums(texels), strict=True):
            kept[..., texels] = new
        self._step(texels)

    def _step(self, texels: Any) -> None:
        self.n[:, texels], self.f[:, texels], self.ended[texels] = solved(self.sums.at(texels))

    def _cosines(self) -> np.ndarray:
        """n . w (K, T)."""
        w = self.block.w
        cosines: np.ndarray = w[..., 0] @ self.n if w.shape[-1] == 1 else np.einsum("kct,ct->kt", w, self.n)
        return cosines

    def _face(self, steps: int) -> None:
        """Leave out the lights that normals face away from, until none changes."""
        for step in range(steps):
            faced = self.block.counts & (self._cosines() > 0.0)
            if step >= steps // 2:
                faced &= self.uses
            changed = (faced != self.uses).any(axis=0)
            texels = np.flatnonzero(changed & (faced.sum(axis=0) >= 3))
            if not len(texels):
                break
            self.uses[:, texels] = faced[:, texels]
            self._update(texels)
        self.ended &= ~changed

    def _residuals(self) -> np.ndarray:
        """(C, K, T), in standard uncertainties where these are known; 0 for what is not used."""
        r = np.where(self.uses, self.block.L - self.f[:, None] * self.block.E * self._cosines(), 0.0)
        return r if self.block.u is None else r / self.block.u

    def _weigh(self, robust: str) -> None:
        """Weights (K, T) by the residuals of all channels, and what standard errors need.

        The scale is by the median; that of the mean of C squares is (1 - 2/(9 C))^3 (Wilson & Hilferty 1931).
        """
        z = np.square(self._residuals()).mean(axis=0)
        used, channels = self.uses.sum(axis=0), len(self.f)
        ordered = np.sort(np.where(self.uses, z, np.inf), axis=0)
        middle = np.take_along_axis(ordered, np.minimum(used // 2, len(z) - 1)[None], axis=0)[0]
        scale2 = SCALES[robust] ** 2 * middle / (1.0 - 2.0 / (9.0 * channels)) ** 3
        z = np.minimum(z / np.where(scale2 > 0.0, scale2, 1e-300), 1e30)
        weight = ROBUST[robust].weight
        w = self.trust = np.where(self.uses, weight(z), 0.0)
        slope = np.where(self.uses, w + (2.0 / channels) * (weight((1.0 + STEP) * z) - w) / STEP, 0.0)
        self.share = w.sum(axis=0) / np.maximum(slope.sum(axis=0), 0.1 * w.sum(axis=0))

    def _summary(self) -> tuple[np.ndarray, ...]:
        A, q, squares = self.sums
        n, f = self.n, self.f
        An = times(A, n)
        nAn = (An * n).sum(axis=1)
        across = [A[:, k] - An[:, i] * An[:, j] / nAn for k, (i, j) in enumerate(PAIRS)]
        H = np.stack([(f * f * x).sum(axis=0) for x in across])
        trace, minors = H[:3].sum(axis=0), cofactors(H)[:3].sum(axis=0)
        used = self.uses.sum(axis=0)
        costs = np.maximum((squares - f * (q * n).sum(axis=1)).sum(axis=0), 0.0)
        values, free = len(q) * used, len(q) * (used - 1) - 2
        variance = 1.0 if self.block.u is not None else np.where(free > 0, costs / np.maximum(free, 1), np.inf)
        if self.trust is not None:
            values = len(q) * self.trust.sum(axis=0)
            scatter = np.square(self.trust * self._residuals()).sum(axis=(0, 1)) / np.maximum(free, 1)
            variance = np.where(free > 0, scatter * self.share**2 * used / self.trust.sum(axis=0), np.inf)
        angle = np.sqrt(variance * trace / minors)
        bend = -An / nAn[:, None]  # derivatives of ln f by n
        products = np.stack([(bend * bend).sum(axis=1), (bend * n).sum(axis=1)])
        part = (trace * (products[0] - products[1] ** 2) - (times(H[None], bend) * bend).sum(axis=1)) / minors
        spread = math.pi * np.sqrt(variance * (1.0 / nAn + f * f * part))
        rms = np.sqrt(costs / np.maximum(values, 1e-9))
        lost = np.isnan(n[0]) | ~(minors > UNSURE * trace * (f * f * A[:, :3].sum(axis=1)).sum(axis=0))
        few = used < 3
        none = few | lost
        albedo = math.pi * f
        above = (albedo > 1.0 + 1e-6).any(axis=0) & ~none
        flags = TOO_FEW * few + NOT_ENDED * (~self.ended & ~none) + ABOVE_ONE * above + UNDETERMINED * (lost & ~few)
        n, albedo, angle, spread, rms = (np.where(none, np.nan, x) for x in (n, albedo, angle, spread, rms))
        return n, albedo, angle, spread, rms, used, flags.astype(np.uint8)
