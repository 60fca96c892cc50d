"""A reflectance with another normal than the surface has, as normal maps ask for: without and with physics."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

import numpy as np

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..base.results import Hints
from ..declared.arguments import checked
from ..errors import MeaningWarning, ParameterError, ShapeError, warn
from ..formula import tree
from ..formula.direction import HORIZON, NORMAL, Direction, dot, frame, raised, select
from ..formula.fields import option, param, part
from ..formula.mueller import Mueller, horizontal, scaled_to, turn_to
from ..formula.texture import Texture
from ._wrapper import Reframed
from .lambertian import Lambertian

STEEPEST = 0.7  # of each component, so that the normal stays 8 degrees above the surface


class _Tilted(Reframed, oriented=True):
    """A surface with a normal of its own, and the frame of that."""

    of = part(Reflectance, Lambertian(0.5), "reflectance of the tilted surface")
    normal_x = param(0.0, -STEEPEST, STEEPEST, "x component of the tilted normal")
    normal_y = param(0.0, -STEEPEST, STEEPEST, "y component of the tilted normal")

    @property
    def normal(self) -> Direction:
        """The perturbed normal, a unit vector."""
        x, y = self.normal_x, self.normal_y
        return Direction(x, y, ops.sqrt(1.0 - x * x - y * y))

    def light_within(self, wi: Direction) -> Direction:
        n = self.normal
        t, b = frame(n)
        return Direction(dot(wi, t), dot(wi, b), dot(wi, n))

    def light_outside(self, wi: Direction) -> Direction:
        return self._upright(wi)

    def _upright(self, w: Direction) -> Direction:
        """A vector of the frame of n' in that of the surface."""
        n = self.normal
        t, b = frame(n)
        return t * w.x + b * w.y + n * w.z

    def _to_outside(self, M: Mueller, wi: Direction, wo: Direction, lit: Direction, seen: Direction) -> Mueller:
        """A Mueller matrix for the directions within, `lit` and `seen`, in the axes of the surface outside."""
        to_i, to_o = (
            turn_to(w, self._upright(horizontal(v)), side) for w, v, side in ((wi, lit, -1.0), (wo, seen, 1.0))
        )
        return to_o.transposed @ M @ to_i


class ShadingNormal(_Tilted):
    """Another reflectance, lit and seen as if the normal were n': f = of.f(wi', wo') max(wi . n', 0)/(wi . n).

    wi', wo' are in the frame of n', whose tangent is d_x turned as n is turned into n'. So f cos(theta_i) is that of
    the tilted surface, as renderers have it with bump and normal maps. 0 where a direction is below the horizon of n'.
    `NormalMapped` is the physical form.

    Looks    `ShadingNormal(Lambertian(0.5), 0.5)` is a facet that leans: lit as if turned by 30 degrees; arrays of
             normals make dents and grain.
    Shapes   normal_x, normal_y: numbers or (..., 1), a normal map.
    Units    f: 1/sr; normal_x, normal_y: components of the unit vector n' along d_x and d_y.
    Error    rounding.
    Source   Blinn 1978, "Simulation of wrinkled surfaces", which perturbs the normal; as a BRDF and its breaches:
             Veach 1997, "Robust Monte Carlo methods for light transport simulation", chapter 5.

    Example
    >>> leaning = gn.ShadingNormal(gn.Lambertian(0.5), 0.5, 0.0)
    >>> print(leaning.f_angles(0.6, [0.0, np.pi], 0.2, 0.0).round(4))
    [0.1923 0.0834]
    """

    breaks: ClassVar[dict[str, str]] = {
        "reciprocity": "wi . n'/wi . n has no counterpart for wo: exchanging light and viewer changes the value",
        "energy": "light at grazing incidence arrives on a larger area if the normal leans towards it: the albedo is "
        "that inside times up to wi . n'/wi . n, which has no bound",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        lit, wi_up = raised(self.light_within(wi))
        seen, wo_up = raised(self.viewer_within(wo))
        return ops.where(lit & seen, self.of.formula(wi_up, wo_up) * wi_up.z / wi.z, 0.0)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        lit, wi_up = raised(self.light_within(wi))
        seen, wo_up = raised(self.viewer_within(wo))
        M = self._to_outside(self.of.polarized(wi_up, wo_up), wi, wo, wi_up, wo_up)
        return M * ops.where(lit & seen, wi_up.z / wi.z, 0.0)

    def mirror(self, wo: Direction) -> Any:
        up, seen = raised(self.viewer_within(wo))
        leaves = self.mirrored(wo).z > HORIZON
        return ops.where(up & leaves, self.of.mirror(seen), 0.0)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        up, seen = raised(self.viewer_within(wo))
        wi = self.mirrored(wo)
        M = self._to_outside(self.of.polarized_mirror(seen), wi, wo, self.of.mirrored(seen), seen)
        return M * ops.where(up & (wi.z > HORIZON), 1.0, 0.0)


class NormalMapped(_Tilted, repeats=6):  # three ways, and as much for weights and frames
    """Another reflectance on facets of normal n', between upright mirrors that complete the surface; obeys the laws.

    Facets p of normal n' and area 1/n'_z, and mirrors t whose area vector a_t = -(n'_x, n'_y, 0)/n'_z makes the mean
    normal n. With P(w) = max(w . n', 0), T(w) = max(w . a_t, 0), A(w) = P(w)/n'_z + T(w), and w* mirrored by t,

    f = (P(wi) P(wo)/n'_z of.f(wi, wo) + P(wi) T(wo) of.f(wi, wo*) + T(wi) P(wo) of.f(wi*, wo)) / (A(wi) A(wo)).

    Light that meets a facet p twice is lost. Directions below the horizon of n' are lit and seen through the mirrors.

    Looks    `NormalMapped(Lambertian(0.5), 0.5)` is a facet that leans, with the light that upright mirrors beside it
             add: softer than `ShadingNormal`.
    Shapes   normal_x, normal_y: numbers or (..., 1), a normal map.
    Units    f: 1/sr; normal_x, normal_y: components of the unit vector n' along d_x and d_y.
    Error    rounding. White Lambertian facets return n'_z of the light at normal incidence: 94 % at a tilt of 20
             degrees, 77 % at 40; the rest meets them twice.
    Source   Schüssler, Heitz, Hanika & Dachsbacher 2017, "Microfacet-based normal mapping for robust Monte Carlo path
             tracing", ACM TOG 36(6):205: the variant with mirrors, written symmetrically; derived in
             tests/models/test_wrappers.py.

    Example
    >>> leaning = gn.NormalMapped(gn.Lambertian(0.5), 0.5, 0.0)
    >>> print(leaning.f_angles(0.6, [0.0, np.pi], 0.2, 0.0).round(4))
    [0.1378 0.1378]
    """

    def formula(self, wi: Direction, wo: Direction) -> Any:
        direct, mirrored = self._paths(self.of)
        return direct.formula(wi, wo) + mirrored.formula(wi, wo)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        direct, mirrored = self._paths(self.of)
        return direct.polarized(wi, wo) + Mueller.depolarizer(mirrored.formula(wi, wo))

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for weight, lobe in self.of.lobes():
            for path in self._paths(lobe):
                yield from ((weight, of) for of in (path.ways() if lobe.is_delta else [path]))

    def _paths(self, of: Reflectance) -> tuple[_Path, _Ways]:
        tilt = {"normal_x": self.normal_x, "normal_y": self.normal_y}
        return tree.unchecked(_Path, of=of, mirrors="none", **tilt), tree.unchecked(_Ways, of=of, **tilt)


class _Path(_Tilted):
    """Light that meets no upright mirror, or one on its way from the facet to the viewer, or from light to facet."""

    mirrors = option("none", "viewer", "light", doc="who sees the facet through a mirror")

    def ways(self) -> list[_Path]:
        """Its parts."""
        return [self]

    def _area(self, w: Direction) -> tuple[Any, Any, Any]:
        """P(w), T(w) and A(w) of the class above."""
        n = self.normal
        p, t = ops.maximum(dot(w, n), 0.0), ops.maximum(-(w.x * n.x + w.y * n.y) / n.z, 0.0)
        return p, t, p / n.z + t

    def _mirrored(self, w: Direction) -> Direction:
        n = self.normal
        s2 = n.x * n.x + n.y * n.y
        flat = s2 < 1e-20
        k = 2.0 * (w.x * n.x + w.y * n.y) / ops.where(flat, 1.0, s2)
        return Direction(w.x - k * n.x, w.y - k * n.y, w.z)

    def light_within(self, wi: Direction) -> Direction:
        return super().light_within(self._mirrored(wi) if self.mirrors == "light" else wi)

    def light_outside(self, wi: Direction) -> Direction:
        wi = super().light_outside(wi)
        return self._mirrored(wi) if self.mirrors == "light" else wi

    def viewer_within(self, wo: Direction) -> Direction:
        return super().light_within(self._mirrored(wo) if self.mirrors == "viewer" else wo)

    def _weight(self, wi: Direction, wo: Direction) -> Any:
        (p_i, t_i, a_i), (p_o, t_o, a_o) = self._area(wi), self._area(wo)
        both = {"none": p_i * p_o / self.normal.z, "viewer": p_i * t_o, "light": t_i * p_o}
        return both[self.mirrors] / (a_i * a_o)

    def formula(self, wi: Direction, wo: Direction) -> Any:
        lit, wi_up = raised(self.light_within(wi))
        seen, wo_up = raised(self.viewer_within(wo))
        return ops.where(lit & seen, self._weight(wi, wo) * self.of.formula(wi_up, wo_up), 0.0)

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        if self.mirrors != "none":
            return super().polarized(wi, wo)
        lit, wi_up = raised(self.light_within(wi))
        seen, wo_up = raised(self.viewer_within(wo))
        M = self._to_outside(self.of.polarized(wi_up, wo_up), wi, wo, wi_up, wo_up)
        return M * ops.where(lit & seen, self._weight(wi, wo), 0.0)

    def polarized_mirror(self, wo: Direction) -> Mueller:
        if self.mirrors != "none":
            return super().polarized_mirror(wo)
        _, seen = raised(self.viewer_within(wo))
        inside = self.of.mirrored(seen)
        M = self._to_outside(self.of.polarized_mirror(seen), self.light_outside(inside), wo, inside, seen)
        return scaled_to(M, self.mirror(wo))

    def estimate(self, wo: Direction) -> Any:
        p, t, a = self._area(wo)
        share = {"none": p / self.normal.z / a, "viewer": t / a, "light": 0.2 * p / a}[self.mirrors]
        return share * super().estimate(wo)

    def mirror(self, wo: Direction) -> Any:
        seen, wo_up = raised(self.viewer_within(wo))
        inside = self.of.mirrored(wo_up)
        wi = self.light_outside(inside)
        leaves = seen & (wi.z > HORIZON) & (inside.z > HORIZON)
        wi = select(leaves, wi, NORMAL)
        reflectance = self._weight(wi, wo) * wi.z / ops.where(leaves, inside.z, 1.0) * self.of.mirror(wo_up)
        return ops.where(leaves, reflectance, 0.0)


class _Ways(_Tilted):
    """Light that meets one upright mirror, on either way: together they are reciprocal. Sampled half and half."""

    hints = Hints(seam=0.5)

    def ways(self) -> list[_Path]:
        tilt = {"normal_x": self.normal_x, "normal_y": self.normal_y}
        return [tree.unchecked(_Path, of=self.of, mirrors=which, **tilt) for which in ("viewer", "light")]

    polarized, polarizes = Reflectance.polarized, False

    def formula(self, wi: Direction, wo: Direction) -> Any:
        viewer, light = self.ways()
        return viewer.formula(wi, wo) + light.formula(wi, wo)

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        viewer, light = self.ways()
        first = u0 < 0.5
        u0 = ops.clip(ops.where(first, 2.0 * u0, 2.0 * u0 - 1.0), 0.0, 1.0 - 6e-8)
        return select(first, viewer.warp(wo, u0, u1), light.warp(wo, u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        viewer, light = self.ways()
        return 0.5 * (viewer.density(wi, wo) + light.density(wi, wo))

    def estimate(self, wo: Direction) -> Any:
        viewer, light = self.ways()
        return viewer.estimate(wo) + light.estimate(wo)


@checked
def normal_map(
    image: Any, strength: float = 1.0, green: str = "up", filter: str = "bilinear", wrap: str = "repeat"
) -> tuple[Texture, Texture]:
    """The textures normal_x and normal_y of `NormalMapped` and `ShadingNormal`, of a normal map in tangent space.

    A code c from 0 to 1 stands for the component 2 c - 1: red of that along u, green of that upwards in the image
    (OpenGL; "down" for maps made for DirectX), blue of that out of the surface. Codes are taken as they are, also those
    of a .png, which are no colours. Vectors are made unit vectors. `strength` times the slope is what is meant: 0 is
    flat.

    Shapes   image: (H, W, 3), or what else `gn.Texture` takes.
    Raises   ParameterError for codes out of bounds, normals that point into the surface or lie flatter above it than
             `NormalMapped` takes (components up to 0.7; the message names a strength that does), ShapeError.
    Source   definition.

    Example
    >>> leaning = gn.normal_map(np.full((4, 4, 3), [0.75, 0.5, 0.933]))
    >>> m = gn.NormalMapped(gn.Lambertian(0.5), *leaning)
    >>> print(m.at(uv=[0.5, 0.5]).normal_x.round(3))
    [0.5]
    """
    if green not in ("up", "down"):
        raise ParameterError(f"normal_map(green={green!r}): expected 'up' (OpenGL) or 'down' (DirectX)")
    if not 0.0 <= strength < float("inf"):
        raise ParameterError(f"normal_map(strength={strength:g}): expected a number from 0")
    texture = Texture(image, filter, wrap, "linear")
    if not texture.is_fixed:
        kind = type(texture.texels).__module__.partition(".")[0]
        rule = "expected an array of NumPy; make textures of x and y for derivatives"
        raise ParameterError(f"normal_map: the image is of {kind}; {rule}")
    if texture.channels != 3:
        raise ShapeError(f"normal_map: the image has {texture.channels} channels, expected 3, red, green and blue")
    if outside := texture.outside(0.0, 1.0):
        rule = "expected codes from 0 to 1; of components from -1 to 1 they are (x + 1) / 2"
        raise ParameterError(f"normal_map: {outside}; {rule}")
    n = 2.0 * texture.texels.astype(float) - 1.0
    typical = float(np.median(np.linalg.norm(n, axis=2)))
    if not 0.9 <= typical <= 1.1:
        text = f"normal_map: vectors of length {typical:.2g}, not 1; is this a normal map, with codes as they are?"
        warn(text, MeaningWarning)
    if n[..., 2].min() <= 0.0:
        row, column = np.unravel_index(int(n[..., 2].argmin()), n.shape[:2])
        rule = "expected blue above 0.5 everywhere, a map in tangent space"
        raise ParameterError(f"normal_map: the normal in row {row}, column {column} points into the surface; {rule}")
    slopes = n[..., :2] / n[..., 2:] * [1.0, 1.0 if green == "up" else -1.0]
    n = strength * slopes
    n /= np.sqrt(1.0 + (n * n).sum(axis=2, keepdims=True))
    if np.abs(n).max() > STEEPEST:
        # strength |slope| / sqrt(1 + strength^2 |slopes|^2) is at most STEEPEST
        s2 = slopes * slopes - STEEPEST**2 * (slopes * slopes).sum(axis=2, keepdims=True)
        most = STEEPEST / np.sqrt(s2.max())
        rule = f"expected components up to {STEEPEST:g}; strength={np.floor(1000.0 * most) / 1000.0:g} makes them so"
        raise ParameterError(f"normal_map: a component of {np.abs(n).max():.3g}; {rule}")
    x, y = n[..., 0], n[..., 1]
    return Texture(x, filter, wrap), Texture(y, filter, wrap)
