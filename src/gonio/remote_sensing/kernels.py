"""Kernels of land surfaces' BRDF, by the angles of sun and viewer; the formulas are those of `models/`."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any

import numpy as np

from ..arrays import ops
from ..arrays.kinds import SCALAR
from ..base.angles import check_angle, numbers_of
from ..declared.arguments import Declared, checked
from ..errors import DirectionError
from ..evaluate.labelled import takes_labels
from ..formula.direction import Direction
from ..models import ross_li, roujean

Height = Annotated[float, Declared("height of the crowns' centres over their vertical half axis", 0.1, 10.0)]
Breadth = Annotated[float, Declared("vertical over horizontal half axis of the crowns", 0.1, 10.0)]
kernel = takes_labels(angles=("theta_s", "theta_v", "phi"), kinds=(SCALAR,))


def check_angles(**angles: Any) -> tuple[Any, ...]:
    """Angles by name, `phi` or polar angles, as arrays of one library that broadcast.

    Raises DirectionError for what are no such angles, or look like degrees.
    """
    checked = {name: numbers_of(name, angle) for name, angle in angles.items()}
    lib = ops.library(*checked.values())
    shapes = [() if isinstance(x, (int, float)) else lib.shape(x) for x in checked.values()]
    ops.broadcast_shape(shapes, ", ".join(checked))
    for name, angle in checked.items():
        if name != "phi":
            check_angle(name, angle, 0.0, 0.5 * math.pi)
            continue
        values = angle if isinstance(angle, (int, float)) else lib.known(angle)
        if values is not None and (out := np.abs(values) > 2.0 * math.pi + 1e-6).any():
            got = float(np.asarray(values)[out].flat[0])
            rule = "expected -2 pi to 2 pi [rad], the azimuth from the sun to the viewer; in degrees?"
            raise DirectionError(f"phi: {got:g}: {rule} numpy.radians({got:g}) = {math.radians(got):.4g}")
    return tuple(checked.values())


def _of(formula: Callable[..., Any], theta_s: Any, theta_v: Any, phi: Any, *more: Any) -> Any:
    """A kernel of directions, at these angles."""
    theta_s, theta_v, phi = check_angles(theta_s=theta_s, theta_v=theta_v, phi=phi)
    across = ops.sin(theta_v)
    wi = Direction(ops.sin(theta_s), 0.0 * theta_s, ops.cos(theta_s))
    return formula(wi, Direction(across * ops.cos(phi), across * ops.sin(phi), ops.cos(theta_v)), *more)


@kernel
@checked
def ross_thick(theta_s: Any, theta_v: Any, phi: Any) -> Any:
    """Ross-Thick, a dense layer of leaves: MODIS' volumetric kernel.

    K = ((pi/2 - xi) cos(xi) + sin(xi)) / (cos(theta_s) + cos(theta_v)) - pi/4, with xi the phase angle.

    Shapes   angles: numbers or arrays that broadcast, of any library; the result has their shape.
    Units    rad; K: 1.
    Error    rounding; K grows without bound towards theta = pi/2.
    Source   Ross 1981, as in Wanner, Li & Strahler 1995, J. Geophys. Res. 100(D10):21077; see `RossLi`.

    Example
    >>> round(float(gn.remote_sensing.ross_thick(0.5, 0.3, 0.0)), 6)
    0.05596
    """
    return _of(ross_li.ross_thick, theta_s, theta_v, phi)


@kernel
@checked
def ross_thin(theta_s: Any, theta_v: Any, phi: Any) -> Any:
    """Ross-Thin, few leaves.

    K = ((pi/2 - xi) cos(xi) + sin(xi)) / (cos(theta_s) cos(theta_v)) - pi/2, with xi the phase angle.

    Shapes   angles: numbers or arrays that broadcast, of any library; the result has their shape.
    Units    rad; K: 1.
    Error    rounding; K grows without bound towards theta = pi/2.
    Source   Wanner, Li & Strahler 1995, J. Geophys. Res. 100(D10):21077; see `RossLi`.

    Example
    >>> round(float(gn.remote_sensing.ross_thin(0.5, 0.3, 0.0)), 6)
    0.268619
    """
    return _of(ross_li.ross_thin, theta_s, theta_v, phi)


@kernel
@checked
def ross_thick_hotspot(theta_s: Any, theta_v: Any, phi: Any) -> Any:
    """Ross-Thick with the hot spot of leaves' shadows; 4/(3 pi) times as large, as in the paper.

    K = 4/(3 pi) (K_ross_thick + pi/4) (1 + 1/(1 + xi/xi_0)) - 1/3, xi_0 = 1.5 degrees.

    Shapes   angles: numbers or arrays that broadcast, of any library; the result has their shape.
    Units    rad; K: 1.
    Error    rounding; K grows without bound towards theta = pi/2.
    Source   Maignan, Bréon & Lacaze 2004, Remote Sens. Environ. 90:210; see `RossLi`.

    Example
    >>> round(float(gn.remote_sensing.ross_thick_hotspot(0.5, 0.3, 0.0)), 6)
    0.065082
    """
    return _of(ross_li.ross_thick_hotspot, theta_s, theta_v, phi)


@kernel
@checked
def li_sparse_r(theta_s: Any, theta_v: Any, phi: Any, h_b: Height = 2.0, b_r: Breadth = 1.0) -> Any:
    """Li-Sparse in its reciprocal form, crowns and their shadows: MODIS' geometric kernel.

    K = O - sec_s - sec_v + (1 + cos(xi)) sec_s sec_v/2, of the angles theta' with tan(theta') = b/r tan(theta).

    h_b: height of the crowns' centres over their vertical half axis; b_r: vertical over horizontal half axis.

    Shapes   angles: numbers or arrays that broadcast, of any library; the result has their shape.
    Units    rad; K: 1.
    Error    rounding; K grows without bound towards theta = pi/2.
    Source   Wanner, Li & Strahler 1995; reciprocal: Lucht, Schaaf & Strahler 2000, IEEE TGRS 38(2):977; see `RossLi`.

    Example
    >>> round(float(gn.remote_sensing.li_sparse_r(0.5, 0.3, 0.0)), 6)
    -0.211578
    """
    return _of(ross_li.li_sparse_r, theta_s, theta_v, phi, h_b, b_r)


@kernel
@checked
def li_dense_r(theta_s: Any, theta_v: Any, phi: Any, h_b: Height = 2.0, b_r: Breadth = 2.5) -> Any:
    """Li-Dense in its reciprocal form, crowns that hide the ground.

    K = (1 + cos(xi)) sec_s sec_v/(sec_s + sec_v - O) - 2, of the angles theta' with tan(theta') = b/r tan(theta).

    h_b: height of the crowns' centres over their vertical half axis; b_r: vertical over horizontal half axis.

    Shapes   angles: numbers or arrays that broadcast, of any library; the result has their shape.
    Units    rad; K: 1.
    Error    rounding; K grows without bound towards theta = pi/2.
    Source   Wanner, Li & Strahler 1995, J. Geophys. Res. 100(D10):21077; see `RossLi`.

    Example
    >>> round(float(gn.remote_sensing.li_dense_r(0.5, 0.3, 0.0)), 6)
    -0.103073
    """
    return _of(ross_li.li_dense_r, theta_s, theta_v, phi, h_b, b_r)


@kernel
@checked
def roujean_volumetric(theta_s: Any, theta_v: Any, phi: Any) -> Any:
    """Roujean's f2, leaves: 4/(3 pi) times `ross_thick`.

    K = 4/(3 pi) ((pi/2 - xi) cos(xi) + sin(xi))/(cos(theta_s) + cos(theta_v)) - 1/3, with xi the phase angle.

    Shapes   angles: numbers or arrays that broadcast, of any library; the result has their shape.
    Units    rad; K: 1.
    Error    rounding; K grows without bound towards theta = pi/2.
    Source   Roujean, Leroy & Deschamps 1992, J. Geophys. Res. 97(D18):20455; see `Roujean`.

    Example
    >>> round(float(gn.remote_sensing.roujean_volumetric(0.5, 0.3, 0.0)), 6)
    0.02375
    """
    return _of(roujean.roujean_volumetric, theta_s, theta_v, phi)


@kernel
@checked
def roujean_geometric(theta_s: Any, theta_v: Any, phi: Any) -> Any:
    """Roujean's f1, diffuse blocks and their shadows.

    K = ((pi - phi) cos(phi) + sin(phi)) t_s t_v/(2 pi) - (t_s + t_v + |t_s - t_v|)/pi, t = tan(theta) as a vector.

    Shapes   angles: numbers or arrays that broadcast, of any library; the result has their shape.
    Units    rad; K: 1.
    Error    rounding; K grows without bound towards theta = pi/2.
    Source   Roujean, Leroy & Deschamps 1992, J. Geophys. Res. 97(D18):20455; see `Roujean`.

    Example
    >>> round(float(gn.remote_sensing.roujean_geometric(0.5, 0.3, 0.0)), 6)
    -0.263291
    """
    return _of(roujean.roujean_geometric, theta_s, theta_v, phi)
