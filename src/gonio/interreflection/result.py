"""What `gn.scenes.radiosity` finds: light on patches, how well it balances, factors between parts, a picture, a
mesh."""

from __future__ import annotations

import os
from functools import cached_property
from typing import Any

import numpy as np

from ..declared.arguments import checked
from ..declared.notebooks import repr_html
from ..errors import ParameterError, shown
from ..files import replacing
from ..numerics.unique_rows import unique_rows
from ..pictures.colour import light_to_rgb, rgb_of, srgb_encode
from ..pictures.image import Image
from ..rays.triangles import Place
from .by_rays import ByRays
from .dense import Dense
from .patches import Patches

SEE_THROUGH = 8
"""Backs that a picture looks through."""


class Radiosity:
    """Light on patches, of `gn.scenes.radiosity`.

    `corners` (n, 3, 3) and `part` (n,): the patches, and the parts that they are of. `radiosity` (n, C): what
    leaves their fronts; `irradiance` (n, C): what arrives there.

    Units    W m-2, or per nm, as the exitance given.

    Example
    >>> floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
    >>> lamp = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]], [[0, 1, 2, 3]]
    >>> lit = gn.scenes.Mesh(lamp, gn.Lambertian(0.0), exitance=1.0)
    >>> scene = gn.Scene([gn.scenes.Mesh(floor, gn.Lambertian(0.5)), lit])
    >>> light = gn.scenes.radiosity(scene, patches=64)
    >>> print(light)
    Radiosity(64 patches of 2 parts, dense, balance 0.1201, escaped 0.8799, reciprocity 0.0e+00)
    """

    _repr_html_ = repr_html

    def __init__(
        self,
        patches: Patches,
        albedo: np.ndarray,
        energy: np.ndarray,
        exitance: np.ndarray,
        radiosity: np.ndarray,
        irradiance: np.ndarray,
        operator: ByRays | Dense,
        channel_names: tuple | None,
    ):
        if not isinstance(patches, Patches):
            raise ParameterError(f"Radiosity({shown(patches)}, ...): made by gn.scenes.radiosity(scene); call that")
        self._patches, self._operator, self._names = patches, operator, channel_names
        self.corners, self.part, self._energy = patches.corners, patches.part, energy
        self.albedo, self.exitance, self.radiosity, self.irradiance = albedo, exitance, radiosity, irradiance

    def __repr__(self) -> str:
        way = "dense" if isinstance(self._operator, Dense) else f"{self._operator.hits.shape[1]} rays each"
        balance, escaped = (", ".join(f"{b:.4f}" for b in shares[:3]) for shares in (self.balance, self.escaped))
        counts = f"{len(self.part)} patches of {self.part.max() + 1} parts"
        told = f"balance {balance}, escaped {escaped}, reciprocity {self.reciprocity:.1e}"
        return f"Radiosity({counts}, {way}, {told})"

    @cached_property
    def factors(self) -> np.ndarray:
        """Form factors between the parts: of what part I sends out, the share that arrives at part J, (P, P).

        Example
        >>> floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
        >>> lamp = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]], [[0, 1, 2, 3]]
        >>> lit = gn.scenes.Mesh(lamp, gn.Lambertian(0.0), exitance=1.0)
        >>> scene = gn.Scene([gn.scenes.Mesh(floor, gn.Lambertian(0.5)), lit])
        >>> print(gn.scenes.radiosity(scene, patches=64).factors.round(3))
        [[0.  0.2]
         [0.2 0. ]]
        """
        return self._exchange / self._part_areas[:, None]

    @cached_property
    def _part_areas(self) -> np.ndarray:
        return np.bincount(self.part, weights=self._patches.areas)

    @cached_property
    def _exchange(self) -> np.ndarray:
        parts = self.part.max() + 1
        columns = [self._operator((self.part[:, None] == at).astype(float)) for at in np.split(np.arange(parts), parts)]
        seen = np.concatenate(columns, axis=1) * self._patches.areas[:, None]
        return np.stack([np.bincount(self.part, weights=column, minlength=parts) for column in seen.T], axis=1)

    @cached_property
    def balance(self) -> np.ndarray:
        """What fronts and backs absorb, over what is emitted, (C,): in a closed scene 1, but for the rays; less where
        light leaves it, which `escaped` says. Where light changes its wavelength, of all channels together.

        Example
        >>> floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
        >>> lamp = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]], [[0, 1, 2, 3]]
        >>> lit = gn.scenes.Mesh(lamp, gn.Lambertian(0.0), exitance=1.0)
        >>> scene = gn.Scene([gn.scenes.Mesh(floor, gn.Lambertian(0.5)), lit])
        >>> light = gn.scenes.radiosity(scene, patches=64)
        >>> print(light.balance.round(3), (light.balance + light.escaped).round(6))
        [0.12] [1.]
        """
        area = self._patches.areas[:, None]
        on_backs = 1.0 - self._operator.rows - self._operator.escaping
        return self._of_emitted(area * ((1.0 - self._energy) * self.irradiance + on_backs[:, None] * self.radiosity))

    @cached_property
    def escaped(self) -> np.ndarray:
        """What leaves the scene, over what is emitted, (C,): in a closed scene 0.

        Example
        >>> floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
        >>> scene = gn.Scene(gn.scenes.Mesh(floor, gn.Lambertian(0.5), exitance=1.0))
        >>> print(gn.scenes.radiosity(scene, patches=16).escaped)
        [1.]
        """
        return self._escaped_from(np.ones(len(self.part), bool))

    def _escaped_from(self, chosen: np.ndarray) -> np.ndarray:
        """The same of some patches, (n,) of bool."""
        return self._of_emitted((self._patches.areas * self._operator.escaping * chosen)[:, None] * self.radiosity)

    def _of_emitted(self, power: np.ndarray) -> np.ndarray:
        """The sum over patches, over what is emitted, (C,)."""
        power, emitted = power.sum(axis=0), np.sum(self._patches.areas[:, None] * self.exitance, axis=0)
        if (self._energy != self.albedo).any():
            power, emitted = (np.full(len(x), x.sum()) for x in (power, emitted))
        return power / np.where(emitted > 0.0, emitted, 1.0)

    @cached_property
    def reciprocity(self) -> float:
        """The largest |A_I F_IJ − A_J F_JI| of two parts, over the area of the smaller: 0 but for the rays.

        Example
        >>> floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
        >>> scene = gn.Scene(gn.scenes.Mesh(floor, gn.Lambertian(0.5), exitance=1.0))
        >>> print(gn.scenes.radiosity(scene, patches=16).reciprocity)
        0.0
        """
        smaller = np.minimum(self._part_areas, self._part_areas[:, None])
        difference = np.abs(self._exchange - self._exchange.T) / smaller
        return float(np.where(difference < 1e-13, 0.0, difference).max())

    @cached_property
    def _smooth(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places (V, 3), their radiosity (V, C), and those of the patches' corners (n, 3): one for all patches of a
        part that meet there, in one plane."""
        corners = self.corners.reshape(-1, 3)
        key = np.concatenate(
            [
                np.round(Place.of(corners).local(corners) * 1e5),
                np.repeat(np.round(self._patches.normals * 64.0), 3, axis=0),
                np.repeat(self.part[:, None], 3, axis=0),
            ],
            axis=1,
        ).astype(np.int64)
        first, of, _ = unique_rows(key)
        weight = np.repeat(self._patches.areas, 3)
        values = np.repeat(self.radiosity, 3, axis=0)
        total = np.bincount(of, weights=weight)
        mean = np.stack([np.bincount(of, weights=weight * v) / total for v in values.T], axis=1)
        return corners[first], mean, of.reshape(-1, 3)

    def _rgb(self, values: np.ndarray) -> np.ndarray:
        """Linear RGB (or gray) of values (..., C)."""
        names = self._names
        if values.shape[-1] in (1, 3) and (names is None or rgb_of(names) is None):
            return values
        by_wavelength = names is not None and all(isinstance(name, (int, float, np.number)) for name in names)
        matrix = light_to_rgb(np.asarray(names, float)) if by_wavelength else rgb_of(names)
        if matrix is None:
            raise ParameterError(f"channels {names} have no colours; pictures show RGB, one channel or wavelengths")
        return values @ matrix

    @checked
    def image(
        self,
        eye: Any = None,
        at: Any = None,
        size: int = 512,
        field: float = 40.0,
        up: Any = (0.0, 0.0, 1.0),
        smooth: bool = True,
    ) -> Image:
        """A square picture from `eye` towards `at`, in linear RGB or gray, of radiance B/π; backs are looked through.

        By default all of the scene, from the side of negative y. `smooth`: radiosity interpolated between the corners
        of patches, which have the mean of those around them.

        Shapes   eye, at, up: (3,).
        Units    field: the whole angle of view, degrees; pixels: W m-2 sr-1, or per nm.

        Example
        >>> floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
        >>> scene = gn.Scene(gn.scenes.Mesh(floor, gn.Lambertian(0.5), exitance=np.pi))
        >>> light = gn.scenes.radiosity(scene, patches=16)
        >>> picture = light.image(eye=[0.5, 0.5, 2.0], at=[0.5, 0.5, 0.0], size=8, up=[0, 1, 0])
        >>> print(picture.pixels[4, 4], picture.alpha[0, 0])
        [1.] 0.0
        """
        if not (1 <= size <= 8192 and 0.1 <= field <= 170.0):
            raise ParameterError(f"size={size}, field={field}: expected 1 to 8192 pixels, 0.1 to 170 degrees")
        low, high = self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))
        middle = 0.5 * (low + high)
        tangent = np.tan(np.radians(0.5 * field))
        back = 0.55 * max(high[0] - low[0], high[2] - low[2], 0.1 * (high[1] - low[1])) / tangent
        default = np.array([middle[0], low[1] - back, middle[2]])
        origin, target, top = (
            _vector(name, given)
            for name, given in (
                ("eye", default if eye is None else eye),
                ("at", middle if at is None else at),
                ("up", up),
            )
        )
        forward = target - origin
        right = np.cross(forward, top)
        if not np.linalg.norm(right) > 1e-9 * np.linalg.norm(forward) * np.linalg.norm(top):
            raise ParameterError("the view is along `up`, or `eye` is at `at`: choose another `up`, such as (0, 1, 0)")
        forward, right = forward / np.linalg.norm(forward), right / np.linalg.norm(right)
        fine = (np.arange(2 * size) + 0.5) / size - 1.0
        x, y = np.meshgrid(fine, -fine)
        d = forward + tangent * (x[..., None] * right + y[..., None] * np.cross(right, forward))
        colour, seen = self._seen(np.broadcast_to(origin, d.shape).reshape(-1, 3), d.reshape(-1, 3), smooth)
        folded = (size, 2, size, 2)
        share = seen.reshape(folded).mean(axis=(1, 3))
        total = self._rgb(colour).reshape(*folded, -1).mean(axis=(1, 3))
        return Image((total / np.maximum(share, 0.25)[..., None]).astype(np.float32), share.astype(np.float32))

    def _seen(self, o: np.ndarray, d: np.ndarray, smooth: bool) -> tuple[np.ndarray, np.ndarray]:
        """Radiance (N, C) of the first fronts that rays meet, and whether they meet any (N,)."""
        colour, seen = np.zeros((len(o), self.radiosity.shape[1])), np.zeros(len(o), bool)
        o, rays = o.copy(), np.arange(len(o))
        _, values, of = self._smooth
        for _ in range(SEE_THROUGH):
            face, distance, u, v = self._patches.triangles.shoot(o[rays], d[rays])
            met = face >= 0
            rays, face, distance, u, v = rays[met], face[met], distance[met], u[met, None], v[met, None]
            front = np.einsum("ij,ij->i", d[rays], self._patches.normals[face]) < 0.0
            at, f = rays[front], face[front]
            a, b, c = np.moveaxis(values[of[f]], 1, 0)
            u, v = u[front], v[front]
            colour[at] = ((1.0 - u - v) * a + u * b + v * c if smooth else self.radiosity[f]) / np.pi
            seen[at] = True
            rays, distance = rays[~front], distance[~front]
            o[rays] += d[rays] * (distance * (1.0 + 1e-5))[:, None] + self._patches.lift * d[rays]
            if not len(rays):
                break
        return colour, seen

    @checked
    def save(self, path: str | os.PathLike[str], exposure: float = 0.0) -> None:
        """Write a mesh with colours at its corners, .ply: 2^exposure B/π in sRGB, cut at 1; for MeshLab or Blender.

        The radiosity itself is there too, as properties b0, b1 ... of each corner.

        Errors   ParameterError for another suffix; NotFoundError, WriteError.

        Example
        >>> floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
        >>> glowing = gn.Scene(gn.scenes.Mesh(floor, gn.Lambertian(0.5), exitance=1.0))
        >>> gn.scenes.radiosity(glowing, patches=16).save("floor.ply")
        """
        if not os.fspath(path).lower().endswith(".ply"):
            raise ParameterError(f"{path}: expected a name that ends in .ply")
        places, values, of = self._smooth
        rgb = np.broadcast_to(self._rgb(values), (len(values), 3)) / np.pi
        code = np.round(255.0 * srgb_encode(np.clip(2.0**exposure * rgb, 0.0, 1.0))).astype(np.uint8)
        bands = [f"b{k}" for k in range(values.shape[1])]
        head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(places)}"]
        head += [f"property double {name}" for name in ("x", "y", "z")]
        head += [f"property uchar {name}" for name in ("red", "green", "blue")]
        head += [f"property float {name}" for name in bands]
        head += [f"element face {len(of)}", "property list uchar int vertex_indices", "end_header"]
        corner = np.empty(len(places), [("x", "<f8", 3), ("rgb", "u1", 3), ("b", "<f4", len(bands))])
        corner["x"], corner["rgb"], corner["b"] = places, code, values
        face = np.empty(len(of), [("count", "u1"), ("of", "<i4", 3)])
        face["count"], face["of"] = 3, of
        with replacing(path) as temporary:
            temporary.write_bytes("\n".join([*head, ""]).encode() + corner.tobytes() + face.tobytes())


def _vector(name: str, given: Any) -> np.ndarray:
    vector = np.asarray(given, np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ParameterError(f"{name}={given!r:.60}: expected three finite numbers x, y, z")
    return vector
