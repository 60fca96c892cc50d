"""Walthall's polynomial in the angles, in Nilson and Kuusk's reciprocal form."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import Direction, polar_angle
from ..formula.fields import param


class Walthall(Reflectance):
    """Polynomial in the angles: BRF = a0 + a1 (theta_i^2 + theta_o^2) + a2 theta_i^2 theta_o^2 + a3 theta_i theta_o
    cos(phi_o - phi_i), and f = BRF/pi.

    Walthall's own polynomial of 1985, a theta_o^2 + b theta_o cos(phi) + c for one position of the sun, is not
    reciprocal; this is Nilson and Kuusk's form for all. Order of the coefficients differs: 6S calls them c, a', a, b.

    Looks    `Walthall(0.2, 0.02, 0, 0.02)` is a field, a little brighter back to the light; `Walthall(0.2, 0.1)`
             brightens towards the rim.
    Shapes   a0, a1, a2, a3: numbers or (..., C).
    Units    f: 1/sr; a0: 1 (the BRF at the zenith), a1 and a3: 1/rad^2, a2: 1/rad^4.
    Error    rounding.
    Source   Walthall, Norman, Welles, Campbell & Blad 1985, Appl. Opt. 24(3):383; reciprocal: Nilson & Kuusk 1989,
             Remote Sens. Environ. 27:157. Equations as in the code of 6S, and for all suns by symmetry.

    Example
    >>> field = gn.Walthall(a0=0.2, a1=0.02, a2=0.0, a3=0.02)
    >>> print((np.pi * field.f_angles(0.7, 0.0, 0.7, [0.0, np.pi])).round(4))
    [0.2294 0.2098]
    """

    a0 = param(0.2, 0.0, 2.0, "constant: the BRF at the zenith")
    a1 = param(0.02, -1.0, 1.0, "of theta_i^2 + theta_o^2", unit="rad-2")
    a2 = param(0.0, -1.0, 1.0, "of theta_i^2 theta_o^2", unit="rad-4")
    a3 = param(0.02, -1.0, 1.0, "of theta_i theta_o cos(phi)", unit="rad-2")

    breaks: ClassVar[dict[str, str]] = {
        "positivity": "a polynomial of free coefficients: a0 = 0.1, a3 = 0.1 gives -0.03 at 65 degrees, forward",
        "energy": "a polynomial of free coefficients: a0 = 2 alone reflects twice the light that arrives",
    }

    def formula(self, wi: Direction, wo: Direction) -> Any:
        ti, to = polar_angle(wi), polar_angle(wo)
        ti2, to2 = ti * ti, to * to
        across = _per_sine(wi, ti) * _per_sine(wo, to) * (wi.x * wo.x + wi.y * wo.y)
        total = self.a0 + self.a1 * (ti2 + to2) + self.a2 * ti2 * to2 + self.a3 * across
        return total * (1.0 / math.pi)

    def estimate(self, wo: Direction) -> Any:
        spread = ops.absolute(self.a1) + ops.absolute(self.a2) + ops.absolute(self.a3)
        theta = polar_angle(wo)
        white = self.a0 + self.a1 * (0.7 + theta * theta) + self.a2 * 0.7 * theta * theta
        return ops.maximum(white, 0.1 * (self.a0 + spread))


def _per_sine(w: Direction, theta: Any) -> Any:
    """theta/sin(theta)."""
    flat = theta < 1e-4
    safe = ops.where(flat, 1.0, theta)
    return ops.where(flat, 1.0, safe / ops.sin(safe))
