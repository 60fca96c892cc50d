"""`gn.reconstruction.reconstruct` and its like: whole tables from few values, by a basis of the built-in materials or
of others."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Annotated, Any

from ..base.reflectance import Reflectance
from ..catalogue import builtin
from ..catalogue.typed import as_typed
from ..declared.arguments import Declared, Seed, checked
from ..errors import ParameterError, shown
from ..fitting.asked import ThetaMax
from ..fitting.samples import samples
from .basis import COMPONENTS, DEPARTURE, OFFSET, ReflectanceBasis, learnt
from .planning.asked import Floor, Noise
from .planning.directions import MOST, check_noise
from .planning.goniometer import Goniometer
from .planning.table_plan import TablePlan, planned_table
from .posterior import Reconstruction, reconstruction


@checked
def reflectance_basis(
    materials: Annotated[
        Any,
        Declared(
            "to learn from, four at least: reflectances, paths, names", usual="the 100 built-in fits of measurements"
        ),
    ]
    | None = None,
    components: Annotated[int, Declared("how many components, at most", 1, 80)] = COMPONENTS,
    *,
    resolution: Sequence[int] | None = None,
    offset: Annotated[float, Declared("values below it are alike", 1e-12, 1.0, "1/sr")] = OFFSET,
    departure: Annotated[
        float, Declared("standard deviation of ln f of real materials from all of the basis", 0.0, 10.0)
    ] = DEPARTURE,
) -> ReflectanceBasis:
    """What isotropic materials have in common: the mean and the principal components of ln(f + offset) of their f.

    ln(f + offset) = mean(theta_h, theta_d, phi_d) + sum over k of c_k q_k(theta_h, theta_d, phi_d) + e, c_k ~ N(0, 1).

    Every channel of every material counts as one. The variance of e is that of what the components of the others leave
    of each material, left out, and of `departure`.

    `materials`: four at least, each a reflectance, a path, or the name of a built-in one; by default the 100 built-in
    fits of measurements. Files are read one after another, and not kept.
    `components`: how many, at most. `resolution`: nodes of theta_h, theta_d, and phi_d from 0 to pi/2, (90, 32, 9) by
    default. `offset` [1/sr]: values below it are alike; negative ones count as 0.
    `departure`: standard deviation of ln f of real materials from all of the basis, and 0.3 times it that of what they
    have of each component beside those of the basis. The built-in materials are fits of measurements; measured files
    were 3 to 7 % from what they span, and further out in it than any of them. 0 for materials that are as these.

    Raises ParameterError for what transmits, fluoresces, is anisotropic, a mirror, or has maps.

    Units    f and offset: 1/sr.
    Error    of ln f between the nodes, of the built-in materials: 0.003 (root mean square), 0.25 at most; of albedos of
             their tables 0.03 at most, of the sharpest lobe. 40 components leave 0.0003 of a material left out.
    Source   Nielsen, Jensen & Ramamoorthi 2015, doi:10.1145/2816795.2818085, whose mapping has the cosines in it, which
             of these materials loses what is near the horizon; tables of half and difference angles: Matusik, Pfister,
             Brand & McMillan 2003.

    Example
    >>> basis = gn.reconstruction.reflectance_basis()
    >>> print(len(basis), len(basis.materials), basis.variances[:5].sum() > 0.99)
    40 100 True
    """
    if materials is None:
        usual = components == COMPONENTS and resolution is None and (offset, departure) == (OFFSET, DEPARTURE)
        return _usual() if usual else learnt(_builtin(), components, resolution, offset, departure)
    return learnt(_given(materials), components, resolution, offset, departure)


@checked
def reconstruct(
    data: Any,
    basis: ReflectanceBasis | None = None,
    *,
    noise: Noise = 0.01,
    floor: Floor = 0.0,
    theta_max: ThetaMax = 0.5 * math.pi,
) -> Reconstruction:
    """The whole isotropic BRDF from values at few pairs of directions, with its uncertainty.

    The values determine the coefficients of a basis, c, by linear regression of ln(f + f_0): with q the rows of the
    basis there, S the variances of the values and of what the basis leaves, and N(0, 1) known of each coefficient
    before,

    $$C = (1 + q^T S^{-1} q)^{-1}, \\quad c = C q^T S^{-1} (\\ln(f + f_0) - \\mu)$$

    With the same S for all values it is the ridge regression of Nielsen et al. Where chi-square,
    (ln(f + f_0) - mu)^T (S + q q^T)^-1 (ln(f + f_0) - mu), is more than the number of values, all variances are greater
    by their ratio, so that u widens. Where its chance is below 1 %, a variance is added to all values too, if that has
    the greater evidence, and values that are far off nevertheless count less (Student's distribution).

    `data`: a measurement, a path, (wi, wo, f) or (wi, wo, f, u), a dataset of xarray, a frame of pandas. Each channel
    is reconstructed on its own. `basis`: of `reflectance_basis`; by default of the built-in materials.
    `noise`, `floor`: relative and absolute [1/sr] standard uncertainty of values that come without.
    `theta_max`: rows beyond this polar angle are left out.

    Raises ParameterError for anisotropic data and where nothing is left; ShapeError for arrays that do not fit.

    Shapes   wi, wo: (N, 3); f, u: (N,) or (N, C).
    Units    f, u, floor: 1/sr; theta_max: rad.
    Error    of ln f, weighted by both cosines, from 10 planned directions and 1 % of noise: 0.018 (median) of built-in
             materials left out, 0.03 to 0.25 of measured files (benchmarks/reconstruction.txt). It is as good as the
             basis: a material unlike all of its own is told in `notes`, and has a larger u. Of 20 such the 95 %
             interval held 97 % of the values: 89 % at least, but of a film whose colours turn with the angle 74 %.
    Source   Nielsen, Jensen & Ramamoorthi 2015, doi:10.1145/2816795.2818085; Rasmussen & Williams 2006, "Gaussian
             Processes for Machine Learning", chapter 2 (linear regression).

    Example
    >>> m = gn.material("green-latex")
    >>> planned = gn.planning.plan_table(10)
    >>> found = gn.reconstruction.reconstruct((planned.wi, planned.wo, m.f(planned.wi, planned.wo)))
    >>> print(np.allclose(gn.albedo(found.reflectance, [0, 0, 1]), gn.albedo(m, [0, 0, 1]), rtol=0.05))
    True
    """
    check_noise(noise, floor)
    if isinstance(data, Reflectance) and not data.is_isotropic():
        raise ParameterError(
            f"{data!r:.80}: anisotropic; expected an isotropic material, whose f stays as both directions turn"
        )
    return reconstruction(samples(data, theta_max), basis or _usual(), noise, floor)


@checked
def plan_table(
    count: Annotated[int, Declared("how many pairs of directions", 1, MOST)],
    basis: ReflectanceBasis | None = None,
    *,
    goniometer: Goniometer | None = None,
    noise: Noise = 0.01,
    floor: Floor = 0.0,
    measured: Any = None,
    candidates: Any = None,
    starts: Annotated[int, Declared("random sets of pairs to begin from", 1, 1000)] = 2,
    seed: Seed = 0,
) -> TablePlan:
    """The `count` pairs of directions from which `reconstruct` makes the best table of an unknown isotropic material.

    What is least is the variance of ln f after the measurement, on average over all pairs of directions, weighted by
    both cosines (A-optimal). Pairs are chosen one by one, then each is exchanged for the best other one until none
    helps.

    `basis`: as for `reconstruct`. `goniometer`, `candidates`, `starts`, `seed`: as for `plan`.
    `noise`: relative standard uncertainty of a value; `floor`: absolute [1/sr].
    `measured`: what is known already: a `Reconstruction` by the same basis, or data as for `reconstruct`.

    Shapes   wi, wo of the plan: (count, 3).
    Units    floor: 1/sr.
    Error    the plan is a local optimum, of several starts; errors of reconstructions from it beside regular and random
             directions: benchmarks/reconstruction.txt.
    Source   Fedorov 1972, "Theory of Optimal Experiments"; of Nielsen, Jensen & Ramamoorthi 2015 the task, not the
             criterion, which is the condition number there.

    Example
    >>> planned = gn.planning.plan_table(8)
    >>> print(len(planned), planned.error < 0.1 * planned.before)
    8 True
    """
    check_noise(noise, floor)
    basis = basis or _usual()
    if measured is not None and not isinstance(measured, Reconstruction):
        measured = reconstruct(measured, basis, noise=noise, floor=floor)
    return planned_table(basis, count, goniometer, noise, floor, measured, candidates, starts, seed)


@cache
def _usual() -> ReflectanceBasis:
    return learnt(_builtin(), COMPONENTS, None, OFFSET, DEPARTURE)


def _builtin() -> Iterator[tuple[str, Reflectance]]:
    for entry in builtin.materials():
        if entry.kind == builtin.FIT:
            yield entry.name, builtin.material(entry.name)


def _given(materials: Any) -> Iterator[tuple[str, Reflectance]]:
    try:
        single = isinstance(materials, (str, bytes, os.PathLike, Reflectance, Mapping))
        items = None if single else iter(materials)
    except TypeError:  # a number; an array without axes
        items = None
    if items is None:
        raise ParameterError(
            f"materials={shown(materials)}: expected a list of reflectances, paths, or names of built-in materials"
        )
    for item in items:
        if not isinstance(item, (str, os.PathLike, Reflectance)):
            raise ParameterError(f"materials: got {shown(item)}; expected a reflectance, a path, or a name")
        m = item if isinstance(item, Reflectance) else as_typed(os.fspath(item))
        yield (f"{m!r:.200}" if isinstance(item, Reflectance) else os.fspath(item)), m
