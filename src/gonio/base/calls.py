"""What everyone calls of a reflectance: arrays in, arrays out, computed by the kernels from what the model writes; and
what follows from its lobes and parts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ..arrays import ops
from ..arrays.labels import is_named
from ..errors import ArrayTypeError, NotFoundError, ParameterError, TooLargeError, shown
from ..evaluate import batch
from ..formula import tree
from ..formula.fields import CLASSES, Part
from ..formula.text import listed
from ..numerics.lattice import lattice
from . import channel_names, kernels, textured
from .angles import direction
from .results import Jacobian, Sample
from .sides import hemispheres, shape_of


def f(m: Any, wi: Any, wo: Any, out: Any = None, uv: Any = None) -> Any:
    """The BRDF f(wi, wo), radiance out over irradiance in; of what transmits the BSDF, anywhere on the sphere.

    `uv`: places on the surface, from (0, 0) at the upper left corner of a texture to (1, 1) at the lower right one,
    for a material with textures. They are looked up within the compiled formula.

    Shapes   wi, wo: (..., 3), uv: (..., 2), broadcast against each other; result (...), or (..., C) for C channels.
    Units    [1/sr], without the cosine. 0 where a direction is below the horizon (cosine <= 1e-6), or at it where
             light passes (|cosine| <= 1e-6), NaN where a direction is NaN. A delta lobe contributes 0.

    Example
    >>> m = gn.Lambertian([0.6, 0.1, 0.05])
    >>> print(m.f([0, 0, 1], [0.6, 0.0, 0.8]).round(4))
    [0.191  0.0318 0.0159]
    >>> print(m.f(gn.direction([0.1, 0.2, 0.3], 0.0), [0, 0, 1]).shape)
    (3, 3)
    """
    if uv is not None:
        return textured.value(m, wi, wo, uv, out)
    return batch.run(kernels.F, m, (wi, wo), out)[0]


def pdf(m: Any, wi: Any, wo: Any) -> Any:
    """Density [1/sr] with which `sample` draws wi for given wo, delta lobes left out; shape (...).

    Example
    >>> m = gn.Microfacet(gn.GGX(0.1))
    >>> print(m.pdf(gn.direction(0.5, 0.0), gn.direction([0.4, 0.5, 0.6], np.pi)).round(3))
    [5.551 9.061 6.19 ]
    """
    return batch.run(kernels.PDF, m, (wi, wo))[0]


def sample(m: Any, wo: Any, u: Any) -> Sample:
    """Incident directions for given wo (..., 3) and uniform numbers u (..., 2) or (..., 3) in [0, 1); a 1 is
    replaced by the largest float32 below it. A third number chooses the lobe; without it the first two do.

    wi is below the surface where light comes from behind; `weight` is f |cos(theta_i)| / pdf. Raises ParameterError
    for a delta lobe that refracts each channel to another side.

    Example
    >>> m = gn.Lambertian(0.5) + gn.IdealSpecular(0.04)
    >>> s = m.sample(gn.direction(0.5, 0.0), np.random.default_rng(1).random((10000, 2)))
    >>> print(s.wi.shape, s.weight.mean().round(2))  # the albedo
    (10000, 3) 0.54
    """
    if m.sides != "front":
        require_one_direction(m)
    numbers = 3 if shape_of(u)[-1:] == (3,) else 2
    return Sample(*batch.run(kernels.SAMPLE[numbers], m, (wo, u)))


def jacobian(m: Any, wi: Any, wo: Any, by: Iterable[str] | None = None) -> Jacobian:
    """f(wi, wo) and its exact derivatives, at the cost of a few evaluations.

    `by`: paths of `parameters`, and "wi" or "wo" for the components of a direction; all parameters if not given,
    but those of a coat in `m.under(E)`, which have no derivatives where what is under it fluoresces.
    The derivative by a parameter is that of each value by the number that it depends on: of channel c by the
    parameter's entry c, of a place on a map by the parameter there. Derivatives by a direction are those of the
    formula by x, y and z as three free numbers; for what happens along the sphere take the tangential part.

    Shapes   wi, wo: (..., 3) NumPy arrays; derivatives (...[, C]) by a parameter, (...[, C], 3) by a direction.
    Units    1/sr over the unit of the parameter. 0 below the horizon.
    Error    rounding: the formula's graph is differentiated, nothing is approximated.

    Example
    >>> m = gn.Microfacet(gn.GGX(0.2), 0.9)
    >>> j = m.jacobian(gn.direction(0.5, 0.0), gn.direction(0.5, np.pi), by=["distribution.alpha_x"])
    >>> print(j.f.round(4), j.by["distribution.alpha_x"].round(4))
    2.3111 -23.2474
    """
    names, leaves, inputs = variables(m, by)
    value, *slopes = batch.compute(kernels.F.derivatives(leaves, inputs), m, (wi, wo))
    return Jacobian(value, dict(zip(names, slopes, strict=True)))


def variables(m: Any, by: Iterable[str] | None) -> tuple[list[str], tuple[int, ...], tuple[int, ...]]:
    """What `jacobian` differentiates by: the names, and the places of parameters and of directions among them."""
    if by is None and (every := m._alike.get(variables)):
        names_and_places: tuple[list[str], tuple[int, ...], tuple[int, ...]] = every
        return names_and_places
    leaves = {path: i for i, path in enumerate(tree.leaf_paths(m)) if path}
    inputs = {"wi": 0, "wo": 1}
    expected = f"expected one of {listed([*leaves, *inputs])}"
    try:
        names = list(m.parameters if by is None else [by] if isinstance(by, str) else by)
    except TypeError:
        raise ParameterError(f"jacobian(by={shown(by)}): {expected}, or a list of them") from None
    for path in names:
        if not isinstance(path, str) or (path not in leaves and path not in inputs):
            raise NotFoundError(f"jacobian(by={shown(path)}): {expected}")
    if fixed := (*m._without_slopes(),):
        if by is not None and (moved := next((p for p in names if p.startswith(fixed)), "")):
            raise ParameterError(
                f"jacobian(by={moved!r}): changes what goes to and fro between a coat and what fluoresces under "
                f"it, and that has no derivatives; expected other numbers, or internal='lost' in the coat"
            )
        names = [path for path in names if not path.startswith(fixed)]
    paths, directions = ([p for p in names if p in places] for places in (leaves, inputs))
    names_and_places = [*paths, *directions], tuple(leaves[p] for p in paths), tuple(inputs[p] for p in directions)
    if by is None:
        m._alike[variables] = names_and_places
    return names_and_places


def without_slopes(m: Any, prefix: str = "") -> Iterator[str]:
    """How the paths of numbers begin by which nothing can be differentiated."""
    for name, part in reflectances(m).items():
        yield from part._without_slopes(f"{prefix}{name}.")


def f_angles(m: Any, theta_i: Any, phi_i: Any, theta_o: Any, phi_o: Any) -> Any:
    """f of polar angles and azimuths [rad]; the four broadcast against each other.

    Example
    >>> m = gn.Microfacet(gn.GGX(0.1))
    >>> print(m.f_angles(0.5, 0.0, [0.4, 0.5, 0.6], np.pi).round(3))
    [ 6.321 10.317  7.049]
    """
    return m.f(direction(theta_i, phi_i), direction(theta_o, phi_o))


def delta_reflectance(m: Any, wo: Any, across: bool = False) -> Any:
    """Reflectance (...[, C]) of all delta lobes together at the mirror direction of wo (..., 3); with `across` that
    of those which transmit: L_o(wo) over L_i, which for refraction is T (n_o/n_i)^2.

    Example
    >>> coated = gn.Lambertian(0.3) + gn.IdealSpecular(gn.Dielectric(1.5))
    >>> print(coated.delta_reflectance(gn.direction([0.0, 1.4], 0.0)).round(3))
    [0.04  0.395]
    >>> print(gn.SmoothDielectric(1.5).delta_reflectance([0, 0, 1], across=True).round(4))
    0.4267
    """
    task = kernels.DELTA_TRANSMISSION if _said(across) else kernels.DELTA_REFLECTANCE
    return batch.run(task, m, (wo,))[0]


def mueller(m: Any, wi: Any, wo: Any) -> Any:
    """The Mueller matrix of the BRDF: Stokes vector of radiance out over that of irradiance in; M[..., 0, 0] is f.

    Stokes vectors (I, Q, U, V) in the axes of the surface: for light that moves along k (-wi, then wo) x = s, along
    increasing azimuth, and y = p = k x s; at the pole the azimuth is 0. Q = I_s - I_p, U + iV = 2 E_s conj(E_p)
    with the time factor exp(-i omega t). Other axes: `gn.polarization`. Where a model says nothing about
    polarization what leaves is unpolarized (`polarizes` is False).

    Shapes   wi, wo: (..., 3), broadcast against each other; result (..., 4, 4), or (..., C, 4, 4) for C channels.
    Units    [1/sr], as f. 0 below the horizon, NaN where a direction is NaN; a delta lobe contributes 0.
    Error    rounding. Against Mitsuba 3.9.1: see docs/polarization.md.

    Example
    >>> glass = gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    >>> brewster = np.arctan(1.5)
    >>> M = glass.mueller(gn.direction(brewster, 0.0), gn.direction(brewster, np.pi))
    >>> print((M @ [1, 0, 0, 0]).round(3))  # unpolarized light in: all of what leaves is horizontal
    [1.892 1.892 0.    0.   ]
    """
    return batch.run(kernels.MUELLER, m, (wi, wo))[0]


def delta_mueller(m: Any, wo: Any, across: bool = False) -> Any:
    """The Mueller matrix (...[, C], 4, 4) of all delta lobes together at the mirror direction of wo (..., 3).

    `across`: of those whose light comes from the other side of the surface. Axes as those of `mueller`; the first
    element is `delta_reflectance`.

    Example
    >>> glass = gn.SmoothDielectric(1.5)
    >>> print(glass.delta_mueller([0, 0, 1]).diagonal().round(3))
    [ 0.04  0.04 -0.04 -0.04]
    >>> print(glass.delta_mueller([0, 0, 1], across=True).diagonal().round(3))
    [0.427 0.427 0.427 0.427]
    """
    task = kernels.DELTA_MUELLER_ACROSS if _said(across) else kernels.DELTA_MUELLER
    return batch.run(task, m, (wo,))[0]


def _said(across: Any) -> bool:
    """Whether light from the other side is meant. Raises ParameterError for anything but True and False."""
    if not isinstance(across, (bool, np.bool_)):
        raise ParameterError(f"across={shown(across)}: expected True, for light from the other side, or False")
    return bool(across)


def is_isotropic(m: Any) -> bool:
    """Whether turning both directions about the normal changes nothing: f(theta_i, theta_o, phi_o - phi_i).

    Tested at 512 pairs of directions, to 1e-6 relative (Szeliski 2.82); with maps, at 512 in all, and at least at
    16 for every place on them.

    Example
    >>> print(gn.Microfacet(gn.GGX(0.1)).is_isotropic(), gn.Microfacet(gn.GGX(0.1, 0.4)).is_isotropic())
    True False
    """
    maps = batch.full_shape(m, ())
    pairs = lattice(max(16, 512 // max(math.prod(maps), 1)), 4)
    return all(_is_same_turned(m, u) for u in (pairs if maps else [pairs]))


def _is_same_turned(m: Any, u: np.ndarray) -> bool:
    """Whether f at pairs of directions, from uniform numbers (..., 4), is the same after both are turned."""
    z = float(len(hemispheres(m)))
    theta_i, theta_o = np.arccos(1.0 - z * u[..., 0]), np.arccos(1.0 - z * u[..., 3])
    phi_i, phi_o = 2.0 * np.pi * u[..., 1], 2.0 * np.pi * u[..., 2]
    f, f_turned = (m.f_angles(theta_i, turn + phi_i, theta_o, turn + phi_o) for turn in (0.0, 1.1))
    return bool(np.allclose(f, f_turned, rtol=1e-6, atol=1e-9, equal_nan=True))


def has_delta(m: Any) -> bool:
    """Whether any lobe is a delta lobe.

    Example
    >>> print(gn.IdealSpecular(0.04).has_delta, (gn.Lambertian(0.3) + gn.IdealSpecular(0.04)).has_delta)
    True True
    """
    return any(lobe.is_delta for _, lobe in m.lobes())


def disperses(m: Any) -> bool:
    """Whether light of each channel leaves in another direction: a delta lobe refracts by an index for each.

    Example
    >>> from gonio.base.calls import disperses
    >>> print(disperses(gn.Lambertian([0.6, 0.1, 0.05])), disperses(gn.SmoothDielectric([1.51, 1.53])))
    False True
    """
    if disperses not in m._derived:
        bent = (lobe.index for _, lobe in m.lobes() if lobe.is_delta and lobe.sides == "across")
        m._derived[disperses] = any(map(channel_names.differ, bent))
    return bool(m._derived[disperses])


def reflectances(m: Any) -> dict[str, Any]:
    """The reflectances that a reflectance is made of, by the names of its fields."""
    parts = ((name, m.__dict__[name]) for name, field in m.fields.items() if isinstance(field, Part))
    return {name: part for name, part in parts if isinstance(part, CLASSES["Reflectance"])}


def breaches(m: Any) -> dict[str, str]:
    """Laws of `gonio.check` that this, or a reflectance it is made of, does not obey, each with the reason.

    Example
    >>> from gonio.base.calls import breaches
    >>> print(list(breaches(gn.Lambertian(0.5) + gn.OriginalPhong(0.2))))
    ['reciprocity', 'energy']
    """
    of_parts = [breaches(part) for part in reflectances(m).values()]
    return {law: reason for laws in (*of_parts, m.breaks) for law, reason in laws.items()}


def require_one_direction(m: Any) -> None:
    """Raises ParameterError where no direction serves all channels."""
    if disperses(m):
        raise ParameterError(
            f"sample: {m!r:.60} refracts each channel to another direction, and a sample has one for all; "
            f"take one wavelength: m.at(550.0), or one number for the index"
        )


def divided(m: Any, number: Any) -> Any:
    """A reflectance divided by a number or an array."""
    if ops.is_masked(number) or is_named(number):
        return m * (1.0 / number)
    try:
        with np.errstate(divide="ignore", over="ignore"):
            return m * (1.0 / ops.numbers(number))
    except MemoryError:
        raise TooLargeError("a reflectance divided by an array that does not fit into memory") from None
    except (TypeError, ValueError) as error:
        raise ArrayTypeError(f"a reflectance divided by {shown(number)}: {error}") from None
