"""What a virtual measurement says of itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..declared.notebooks import repr_html


class Measurement(NamedTuple):
    """How a virtual measurement went, by the direction of incidence: arrays (theta_i, phi_i); it prints as a table.

    theta_i, phi_i  [rad]
    error           mean standard uncertainty of the cells over mean f, both weighted with projected solid angle
    target          what was asked for
    surfaces        independent surfaces (or shifts of the rays on one, or parts of one) that the error is from
    rays            rays on each of them
    reflected       share of the light that left, mean over the channels
    unfinished      share that met the surface more often than it was followed
    lost            share lost by rounding
    seconds         time of all rays
    notes           what the numbers hold for
    """

    theta_i: np.ndarray
    phi_i: np.ndarray
    error: np.ndarray
    target: float
    surfaces: np.ndarray
    rays: int
    reflected: np.ndarray
    unfinished: np.ndarray
    lost: np.ndarray
    seconds: float
    notes: tuple[str, ...]

    @property
    def rays_per_second(self) -> float:
        """Rays from the source a second, each followed through all its bounces.

        Example
        >>> m = gn.gonioreflectometer(gn.surfaces.v_grooves(0.6), theta_i=0.5, cells=(9, 12), rays=1 << 12)
        >>> print(m.report.rays_per_second > 1000)
        True
        """
        return float(self.surfaces.sum()) * self.rays / self.seconds

    def __str__(self) -> str:
        head = f"{'theta_i':>8}{'phi_i':>8}{'surfaces':>10}{'reflected':>11}{'unfinished':>12}{'lost':>9}{'error':>9}"
        lines = [head]
        for place in np.ndindex(self.error.shape):
            theta, phi = np.degrees(self.theta_i[place[0]]), np.degrees(self.phi_i[place[1]])
            lines.append(
                f"{theta:7.1f}°{phi:7.1f}°{self.surfaces[place]:10d}{self.reflected[place]:11.5f}"
                f"{self.unfinished[place]:12.1e}{self.lost[place]:9.0e}{100.0 * self.error[place]:8.2f}%"
            )
        speed = f"{self.rays_per_second / 1e6:.1f} million rays a second, {self.rays} on each surface"
        return "\n".join([*lines, speed, *self.notes])

    def _repr_html_(self) -> str | None:
        return repr_html(self)
