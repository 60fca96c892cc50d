"""The radiosity equation: what a patch sends out is what it emits and the share of what arrives that it reflects."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np

from ..base.reflectance import Reflectance
from ..base.reradiation import exchanges
from ..base.sums import lets_through
from ..base.under_light import glow
from ..declared.arguments import checked
from ..errors import LeftOutWarning, ParameterError, ShapeError, ToleranceWarning, TooLargeError, shown, warn
from ..formula.text import listed
from ..integrals.nine import kept_reflectance
from ..models.lambertian import Lambertian
from ..numerics.lattice import lattice
from ..scenes.scene import Scene
from .by_rays import ByRays
from .checkpoint import Begun, RadiosityCheckpoint
from .contacts import divided_at_contacts
from .dense import Dense
from .lamps import from_lamps
from .patches import Patches, enclosing, patches_of
from .residuals import gmres
from .result import Radiosity

DENSE = 5000
"""Patches up to which all pairs are taken: a matrix of 200 MB."""

SMALL = 200
"""Patches up to which "auto" takes all pairs."""

LAMPS, LAMP_AREA = 64, 0.1
"""Faces that emit, and their share of all area, up to which their light is followed apart."""

RESIDUAL = 1e-7
"""Of the linear equations, relative."""

ROUNDS = 2
"""Times that patches over which the light changes most are divided, on the way to their full number."""

BOUNCES, RAYS, SHADOW_RAYS = 3, 64, 32
"""In these rounds: bounces of the light, rays of a patch, and from a patch to a face of a lamp."""

LAST_SHADOW_RAYS = 256
"""From a patch to a face of a lamp, in the end: they decide how well the edges of shadows are known."""

LEAK = 1e-3
"""Share of the light that may get out of a closed surface unsaid."""

FIRST = 0.35
"""Share of the patches that are of like size, before the first round."""


class Surface(NamedTuple):
    """Albedo and exitance (n, C) of patches, the exitance that is no lamp's (n, C), the parts (n,) that they are of,
    and what parts re-radiate, by number: matrices (C, C), the wavelength that leaves first."""

    albedo: np.ndarray
    exitance: np.ndarray
    spread_out: np.ndarray
    part: np.ndarray
    sent: dict[int, np.ndarray]

    def reflected(self, arriving: np.ndarray) -> np.ndarray:
        """What leaves of light (n, C) that arrives."""
        leaving: np.ndarray = self.albedo * arriving
        for number, matrix in self.sent.items():
            here = self.part == number
            leaving[here] += arriving[here] @ matrix.T
        return leaving

    @property
    def energy(self) -> np.ndarray:
        """The share (n, C) of the energy that leaves, of light of each wavelength that arrives."""
        share = self.albedo.copy()
        for number, matrix in self.sent.items():
            share[self.part == number] += matrix.sum(axis=0)
        return share


@checked
def radiosity(
    scene: Scene,
    patches: int = 10_000,
    method: str = "auto",
    tolerance: float = 0.01,
    checkpoint: str | os.PathLike[str] | None = None,
    lights: Any = None,
) -> Radiosity:
    r"""Light between diffuse surfaces that light each other: B_i = M_i + ρ_i Σ_j F_ij B_j, for every patch i.

    Materials count as Lambertian with their white-sky albedo, which is exact for `gn.Lambertian`; of others, which
    shine or transmit light, a LeftOutWarning names the parts. Their channels (RGB, or wavelengths) are those of the
    result; of what fluoresces ρ is a matrix, which exchanges the light of whole bands: channels of `exitance` are then
    those. All faces are divided into `patches` triangles, most of them where the light changes most. Fronts reflect and
    emit; backs are black. Parts that emit are the only `lights`.

    `method`: "rays", form factors by rays, for any number of patches; "dense", those of all pairs in closed form, times
    what rays see, up to 5000 patches; "auto" takes the second up to 200. Light of lamps (faces that emit, up to 64,
    with at most a tenth of all area) is followed apart, by Lambert's formula and shadow rays. `tolerance`: of the light
    that is not, by rays, relative; the number of rays of a patch is 5.12 over it.
    `checkpoint`: a file for what has been found so far; where it exists, the same call goes on from it, and finds the
    same to the last bit.

    Shapes   result: `radiosity`, `irradiance` (n, C).
    Units    those of the exitance, W m-2, or per nm.
    Error    `balance + escaped` and `reciprocity` of the result say what the rays cost. In closed rooms of equal
             patches 1e-7; of a box with two blocks, 4000 patches, see docs/radiosity.md. Patches have one radiosity
             each. The same to 1e-4 up to 1e7 sizes of the scene from the origin, in any unit. A ToleranceWarning says
             what gets out of a closed surface, for want of digits.
    Raises   ParameterError where nothing emits, nothing absorbs, or an albedo is above 1; ShapeError for channels that
             do not match; TooLargeError for more than 5000 patches of "dense"; ParameterError for a checkpoint of
             another scene, FormatError for a file that is none.
    Source   Goral et al. 1984, SIGGRAPH, eq. of the radiosities; GMRES: Saad & Schultz 1986.

    Example
    >>> floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
    >>> ceiling = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]], [[0, 1, 2, 3]]
    >>> lit = gn.scenes.Mesh(ceiling, gn.Lambertian(0.8), exitance=1.0)
    >>> scene = gn.Scene([gn.scenes.Mesh(floor, gn.Lambertian(0.5)), lit])
    >>> light = gn.scenes.radiosity(scene, patches=200)
    >>> print(light.factors.round(2)[0, 1])  # parallel_rectangles(1, 1, 1)
    0.2
    """
    if patches < 1:
        raise ParameterError(f"patches={patches}: expected a whole number from 1")
    if method not in ("auto", "dense", "rays"):
        raise ParameterError(f"method={method!r:.40}: expected 'auto', 'dense' or 'rays'")
    if not 1e-5 <= tolerance <= 1.0:
        raise ParameterError(f"tolerance={tolerance}: expected a number from 1e-5 to 1")
    if lights is not None:
        rule = "it takes light from parts of the scene that send it out, and from nothing else"
        cure = "expected gn.scenes.Mesh(shape, material, exitance=1.0) in the place of the lamp"
        raise ParameterError(f"radiosity(lights={shown(lights)}): {rule}; {cure}")
    whole = patches_of(scene)
    divided = divided_at_contacts(whole)
    count = max(patches, len(divided))
    if method == "dense" and count > DENSE:
        raise TooLargeError(f"{count} patches by all pairs need more than 200 MB; ask for up to {DENSE}, or for rays")
    dense = method == "dense" or (method == "auto" and count <= SMALL)
    materials = _materials(scene)
    albedo, exitance = _of_parts(scene, materials)
    _tell_of_shine(materials)
    sent = {number: _sent(number, m) for number, m in enumerate(materials) if exchanges(m)}
    rays = int(np.clip(np.ceil(5.12 / tolerance), 16, 1 << 14))
    corners, is_lamp, strength = whole.corners, *_lamps(whole, exitance)

    def surface(of: Patches) -> Surface:
        spread = np.where(is_lamp[of.face, None], 0.0, exitance[of.part])
        return Surface(albedo[of.part], exitance[of.part], spread, of.part, sent)

    def light_on(of: Patches, shadow_rays: int) -> tuple[np.ndarray, np.ndarray]:
        return from_lamps(of, corners[is_lamp], strength, shadow_rays)

    def where_it_changes(divided: Patches) -> Patches:
        """Patches, as many as there are to be, small where the light changes most."""
        first = count if dense else max(len(divided), int(FIRST * count))
        divided = divided.divided(first)
        for step in range(ROUNDS if first < count else 0):
            direct, uneven = light_on(divided, SHADOW_RAYS)
            rough = ByRays(divided, min(rays, RAYS))
            on = surface(divided)
            reflected = source = on.spread_out + on.reflected(direct)
            for _ in range(BOUNCES):
                reflected = source + on.reflected(rough(reflected))
            uneven = divided.areas * (uneven + rough.spread(reflected.mean(axis=1)))
            more = (count - len(divided)) // (3 * (ROUNDS - step))
            worst = np.argsort(-uneven, kind="stable")[:more]
            last = len(divided)
            divided = divided.halved(worst)
            divided = divided.halved(np.concatenate([worst, np.arange(last, len(divided))]))
        return divided.divided(count)

    file = None
    if checkpoint is not None:
        file = RadiosityCheckpoint(checkpoint, whole, count, dense, rays, albedo, exitance, sent)
    begun = None if file is None else file.read()
    if begun is None:
        divided = where_it_changes(divided)
        begun = Begun(divided, light_on(divided, LAST_SHADOW_RAYS)[0], np.empty((0, 0)))
    divided, direct, rows = begun

    def keep(rows: np.ndarray) -> None:
        if file is not None:
            file.keep(Begun(divided, direct, rows), len(rows) == len(divided))

    operator: ByRays | Dense
    if dense:
        operator = Dense(divided, rows if len(rows) else None)
        keep(operator.factors)
    else:
        operator = ByRays(divided, rays, rows if len(rows) else None, keep)
    on = surface(divided)
    reflected, arriving = _solve(operator, on, direct)
    names = next((material.channel_names for material in materials if material.channels), None)
    light = Radiosity(
        divided.world,
        on.albedo,
        on.energy,
        on.exitance,
        on.exitance - on.spread_out + reflected,
        arriving,
        operator,
        names,
    )
    _warn_of_leaks(light, divided)
    return light


def _warn_of_leaks(light: Radiosity, patches: Patches) -> None:
    """Say how much light got through surfaces that are closed, for want of digits."""
    if light.escaped.max() <= LEAK:
        return
    through = light._escaped_from(enclosing(patches.faces)[patches.face]).max()
    if through > LEAK:
        rule = f"single precision does not tell its parts from each other, {2.0 * patches.faces.place.unit:.1g} across"
        cure = "expected a scene without parts that are far away, or that are much smaller than the whole"
        warn(f"radiosity: {through:.1%} of the light got out of a closed surface; {rule}; {cure}", ToleranceWarning)


def _materials(scene: Scene) -> list[Reflectance]:
    """The material of each part."""
    bare = [number for number, part in enumerate(scene.parts) if part.material is None]
    if bare:
        raise ParameterError(f"part {bare[0]} has no material, expected one of each: gn.scenes.Mesh(shape, material)")
    return [part.material for part in scene.parts if part.material is not None]


def _is_matt(m: Reflectance) -> bool:
    """Whether a material is as bright from all sides, however it is lit: tried at a few pairs of directions."""
    if all(isinstance(lobe, Lambertian) for _, lobe in m.lobes()):
        return True
    u = lattice(16, 4)
    f = m.f_angles(1.5 * u[:, 0], 6.0 * u[:, 1], 1.5 * u[:, 2], 6.0 * u[:, 3]).reshape(len(u), -1)
    return not m.has_delta and bool((np.ptp(f, axis=0) <= 1e-6 * f.max(axis=0)).all())


def _tell_of_shine(materials: list[Reflectance]) -> None:
    """Say which parts are not matt, as all count here."""
    through = [f"part {k}, {m!r:.60}" for k, m in enumerate(materials) if lets_through(m)]
    shiny = [f"part {k}, {m!r:.60}" for k, m in enumerate(materials) if not lets_through(m) and not _is_matt(m)]
    told = [f"{listed(shiny, 6)} counts as matt, with its white-sky albedo: as bright from all sides"] if shiny else []
    told += [f"{listed(through, 6)} counts as matt, and what it transmits as absorbed"] if through else []
    if told:
        warn(f"radiosity: {'; '.join(told)}", LeftOutWarning)


def _of_parts(scene: Scene, materials: list[Reflectance]) -> tuple[np.ndarray, np.ndarray]:
    """Albedo and exitance (P, C) of the parts."""
    albedos: list[Any] = [np.atleast_1d(kept_reflectance(material, 1e-4)) for material in materials]
    exitances: list[Any] = [np.atleast_1d(part.exitance) for part in scene.parts]
    channels = max(x.size for x in albedos + exitances)
    for number, x in enumerate(albedos + exitances):
        if x.ndim > 1 or x.size not in (1, channels):
            what = "albedo" if number < len(albedos) else "exitance"
            rule = f"expected one number, or one for each of {channels} channels"
            raise ShapeError(f"part {number % len(albedos)} has {what}s of shape {x.shape}, {rule}")
    albedo, exitance = (np.stack([np.broadcast_to(x, channels) for x in xs]) for xs in (albedos, exitances))
    if not exitance.any():
        raise ParameterError(
            "nothing in the scene emits, so all is dark; give a part an exitance: gn.scenes.Mesh(..., exitance=1)"
        )
    if albedo.max() > 1.0 + 1e-6 or albedo.min() < 0.0 or not np.isfinite(albedo).all():
        part = int(np.argmax(np.max(np.where(np.isfinite(albedo), np.abs(albedo - 0.5), np.inf), axis=1)))
        raise ParameterError(f"part {part} has an albedo of {albedo[part]}, expected 0 to 1: gn.check(material)")
    return np.minimum(albedo, 1.0), exitance


def _sent(number: int, m: Reflectance) -> np.ndarray:
    """What a part re-radiates of light of equal radiance from everywhere, (C, C), the wavelength that leaves first.

    Raises ParameterError where that is more energy than arrives.
    """
    matrix = np.stack([kept_reflectance(glow(m, one, 1.0), 1e-4) for one in np.eye(m.channels or 1)], axis=-1)
    most = float((matrix.sum(axis=0) + kept_reflectance(m, 1e-4)).max())
    if most > 1.0 + 1e-6:
        rule = "expected at most 1: gn.check(material)"
        raise ParameterError(f"part {number} sends back {most:.4g} of the energy of a wavelength, {rule}")
    return matrix


def _lamps(faces: Patches, exitance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which faces are lamps (F,), and what they send out (L, C)."""
    emits = exitance[faces.part].any(axis=1)
    few = emits.sum() <= LAMPS and faces.areas[emits].sum() <= LAMP_AREA * faces.areas.sum()
    is_lamp = emits & few
    return is_lamp, exitance[faces.part[is_lamp]]


def _solve(operator: ByRays | Dense, on: Surface, direct: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Radiosity but for lamps' exitance, and irradiance, (n, C): B = M + ρ (E + F B), E the light of lamps."""
    shape = on.albedo.shape
    source = (on.spread_out + on.reflected(direct)).reshape(-1)

    def apply(x: np.ndarray) -> np.ndarray:
        b = x.reshape(shape)
        return (b - on.reflected(operator(b))).reshape(-1)

    b = gmres(apply, source, source, RESIDUAL)
    if b is None:
        raise ParameterError("the light does not settle: a closed scene that absorbs nothing; lower an albedo below 1")
    b = b.reshape(shape)
    return b, direct + operator(b)
