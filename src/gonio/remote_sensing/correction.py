"""Reflectance factors at the angles of sun and viewer, and their correction to other angles."""

from __future__ import annotations

import math
from typing import Any

from ..arrays import ops
from ..base.angles import direction, numbers_of
from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ..errors import MissingDataWarning, warn
from ..evaluate.labelled import takes_labels
from .kernels import check_angles


@takes_labels(angles=("theta_s", "theta_v", "phi"))
@checked
def brf(m: Reflectance, theta_s: Any, theta_v: Any, phi: Any) -> Any:
    """Bidirectional reflectance factor pi f, of any reflectance.

    Shapes   angles: numbers or arrays that broadcast; result (...[, C]).
    Units    rad; result: 1.
    Error    rounding.
    Source   Schaepman-Strub et al. 2006, Remote Sens. Environ. 103:27 (case 1).

    Example
    >>> round(float(gn.remote_sensing.brf(gn.RossLi(0.2, 0.1, 0.03), 0.5, 0.3, 0.0)), 4)
    0.1992
    """
    theta_s, theta_v, phi = check_angles(theta_s=theta_s, theta_v=theta_v, phi=phi)
    return math.pi * m.f(direction(theta_s, 0.0 * theta_s), direction(theta_v, phi))


@takes_labels(angles=("theta_s",))
@checked
def nbar(m: Reflectance, theta_s: Any) -> Any:
    """Nadir BRDF-adjusted reflectance: the reflectance factor seen from above, with the sun at theta_s.

    MODIS' product MCD43A4 is that at the sun's angle at local noon.

    Shapes   theta_s: a number or an array; result (...[, C]).
    Units    rad; result: 1.
    Error    rounding.
    Source   MODIS user guide of MCD43, V006 (umb.edu/spectralmass).

    Example
    >>> gn.remote_sensing.nbar(gn.RossLi([0.05, 0.3], [0.02, 0.16], [0.01, 0.03]), np.radians(45.0)).round(4)
    array([0.038 , 0.2595])
    """
    theta_s = numbers_of("theta_s", theta_s)
    return brf(m, theta_s, 0.0 * theta_s, 0.0 * theta_s)


@takes_labels(angles=("theta_s", "theta_v", "phi", "to_theta_s"))
@checked
def c_factor(m: Reflectance, theta_s: Any, theta_v: Any, phi: Any, to_theta_s: Any = None) -> Any:
    """The factor from a measured reflectance to one seen from nadir: BRF(to_theta_s, 0, 0)/BRF(theta_s, theta_v, phi).

    normalized = c_factor(...) * measured, with `m` for the shape of the surface's BRDF alone: a factor on it cancels.
    `to_theta_s`: the sun of the normalized reflectance; the measurement's own if it is not given. Where the model gives
    no positive reflectance factor the result is NaN, and a MissingDataWarning says so.

    Shapes   angles: numbers or arrays that broadcast; result (...[, C]).
    Units    rad; result: 1.
    Error    rounding; what it leaves of directional effects depends on how well `m` fits.
    Source   Roy et al. 2016, Remote Sens. Environ. 176:255, as in two descriptions of it.

    Example
    >>> red = gn.RossLi(0.1690, 0.0574, 0.0227)  # Roy et al. 2016: the mean red of the land as Landsat sees it
    >>> round(float(gn.remote_sensing.c_factor(red, np.radians(45.0), np.radians(7.5), 0.0)), 4)
    0.9553
    """
    sun = theta_s if to_theta_s is None else to_theta_s
    theta_s, theta_v, phi, sun = check_angles(theta_s=theta_s, theta_v=theta_v, phi=phi, to_theta_s=sun)
    seen = brf(m, theta_s, theta_v, phi)
    wanted = nbar(m, sun + 0.0 * (theta_s + theta_v + phi))
    lib = ops.library(wanted)  # the sun to correct to may be the only array of another library
    if ops.library(seen) is not lib:
        seen = lib.convert(seen, wanted)
    values, nadir = lib.known(seen), lib.known(wanted)
    if values is not None and nadir is not None and (dark := (values <= 0.0) | (nadir <= 0.0)).any():
        text = (
            f"{int(dark.sum())} of {dark.size} modelled reflectance factors are not positive: no factor there, but NaN"
        )
        warn(text, MissingDataWarning)
    positive = (seen > 0.0) & (wanted > 0.0)
    return ops.where(positive, wanted / ops.where(positive, seen, 1.0 + 0.0 * seen), math.nan)
