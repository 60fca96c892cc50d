"""The nine reflectances of Nicodemus and their factors: a direction, a cone or the hemisphere on either side."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..base.kernels import with_holes
from ..base.light import Light
from ..base.reflectance import Reflectance
from ..base.reradiation import exchanges, warn_of_reradiation
from ..base.sums import lobes_on
from ..declared.arguments import checked
from ..errors import ParameterError
from ..evaluate import batch
from ..evaluate.labelled import takes_labels
from ..numerics.quadrature import Goal, Integrals
from .cones import Cone, Hemisphere
from .factor_between import double_integral, single_integral
from .factor_under_lights import factor_under
from .glows import channels_of, taken_apart
from .illumination import as_lights, check_channels, have_channels
from .maps import Wanted, over_places
from .over_directions import Over
from .over_hemisphere import Integral, check_tolerance, directions, in_double, of_whole, report
from .places import Places


@takes_labels()
@checked
def reflectance(
    m: Reflectance,
    incident: Any = Hemisphere(),  # noqa: B008  (a value without state)
    collected: Any = Hemisphere(),  # noqa: B008  (a value without state)
    sky: Light | Iterable[Light] | None = None,
    tolerance: float = 1e-4,
    return_error: bool = False,
) -> Any:
    """Flux collected over flux that arrives, each in a direction, a cone or the hemisphere.

    rho = 1/Omega_i times the integral of f over Omega_i and Omega_o, the projected solid angles: light that comes
    equally from all of `incident`. With a `sky` of radiance L its light in `incident` is taken instead:
    rho = integral of L f over both, over integral of L over Omega_i.

        incident, collected         name (Nicodemus)                      Schaepman-Strub et al.
        direction, Cone             directional-conical reflectance       case 2
        direction, Hemisphere       directional-hemispherical, `albedo`   case 3, DHR, "black-sky albedo"
        Cone, Cone                  biconical                             case 5
        Cone, Hemisphere            conical-hemispherical                 case 6
        Hemisphere, Cone            hemispherical-conical                 case 8
        Hemisphere, Hemisphere      bihemispherical                       case 9, BHR, "white-sky albedo"

    A single direction collects infinitely little: the other three cases (1, 4, 7) are reflectance factors, see
    `reflectance_factor`.

    Shapes   directions: (..., 3) NumPy arrays; result (...[, C]), or with `return_error` an `Integral` of it and (...).
    Units    1.
    Error    at most `tolerance` times Omega_o/pi (relative where the reflectance factor is above 1), so that small
             cones keep their digits, or a ToleranceWarning. Delta lobes and environment maps: `reflectance_factor`.
    Source   Nicodemus et al. 1977, NBS Monograph 160; Schaepman-Strub et al. 2006, Remote Sens. Environ. 103:27.

    Example
    >>> glossy = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    >>> detector = gn.Cone(gn.direction(0.5, np.pi), np.radians(5.0))
    >>> print(gn.reflectance(glossy, gn.direction(0.5, 0.0), detector).round(5))
    0.00934
    """
    to = _geometry("collected", collected)
    if not isinstance(to, (Cone, Hemisphere)):
        raise ParameterError(
            "reflectance(collected=...): got a direction, which collects infinitely little light; expected Cone or "
            "Hemisphere; reflectance_factor takes directions on both sides"
        )
    R = _factor(_lit(m, sky), incident, to, sky, tolerance)
    share = to.projected / math.pi
    return Integral(R.value * share, R.error * share) if return_error else R.value * share


@takes_labels()
@checked
def reflectance_factor(
    m: Reflectance,
    incident: Any = Hemisphere(),  # noqa: B008  (a value without state)
    collected: Any = Hemisphere(),  # noqa: B008  (a value without state)
    sky: Light | Iterable[Light] | None = None,
    tolerance: float = 1e-4,
    return_error: bool = False,
) -> Any:
    """Flux collected over that from an ideal white Lambertian surface in its place; all nine cases.

    R = pi/(Omega_i Omega_o) times the integral of f over Omega_i and Omega_o, the projected solid angles. Directions
    are the limits of narrow cones: from one to another R = pi f. With a `sky` of radiance L its light in `incident` is
    taken: R = pi/Omega_o times the integral of L f over both, over the integral of L over Omega_i.

        incident    collected: direction        Cone                       Hemisphere
        direction   bidirectional, BRF          directional-conical        directional-hemispherical
        Cone        conical-directional         biconical, CCRF            conical-hemispherical
        Hemisphere  hemispherical-directional,  hemispherical-conical,     bihemispherical
                    HDRF                        HCRF

    Row by row these are cases 1 to 9 of Schaepman-Strub et al. R of a white Lambertian surface is 1, of a mirror in
    small cones it exceeds 1 by far. For a whole hemisphere collected R is the reflectance.

    Shapes   directions: (..., 3) NumPy arrays that broadcast; result (...[, C]), or with `return_error` an `Integral`
             of it and (...).
    Units    1.
    Error    at most `tolerance`, absolute (relative where R is above 1), or a ToleranceWarning. Delta lobes are exact,
             but for the integral of their reflectance over a cone; from a direction to a direction they contribute 0,
             as in `f`. Environment maps are sampled, up to 2^20 times: the error returned is then twice the standard
             error of 16 parts.
    Source   Nicodemus et al. 1977, NBS Monograph 160; Schaepman-Strub et al. 2006, Remote Sens. Environ. 103:27.

    Example
    >>> glossy = gn.Lambertian(0.3) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5))
    >>> print(gn.reflectance_factor(glossy, gn.direction(0.5, 0.0), [0, 0, 1]).round(4))
    0.3229
    >>> print(gn.reflectance_factor(glossy, gn.Hemisphere(), [0, 0, 1]).round(4))
    0.3396
    """
    R = _factor(_lit(m, sky), incident, _geometry("collected", collected), sky, tolerance)
    return R if return_error else R.value


def _lit(m: Reflectance, sky: Any) -> Reflectance:
    """A material that fluoresces as it is under a sky of one spectrum; others as they are."""
    for light in () if sky is None else as_lights(sky):
        check_channels(m.channels or 1, light, channels_of(light))
    if sky is None or not exchanges(m):
        warn_of_reradiation(m, "gn.reflectance(m, sky=light)")
        return m
    spectra = [s for light in as_lights(sky) for s, _ in taken_apart(light.in_numpy(), m.channels or 1)]
    first = spectra[0] / max(spectra[0].max(), 1e-300)
    if any(np.abs(s / max(s.max(), 1e-300) - first).max() > 1e-9 for s in spectra):
        rule = "a factor of fluorescence is that under light of one spectrum; expected such a sky"
        raise ParameterError(f"sky={sky!r:.60}: its spectrum changes with direction, and {rule}, or m.under(E)")
    return m.under(first)


def kept_reflectance(m: Reflectance, tolerance: float) -> Any:
    """The bihemispherical reflectance of f: of fluorescence without the light that leaves at another wavelength."""
    return _factor(m, Hemisphere(), Hemisphere(), None, tolerance).value


def _geometry(name: str, value: Any) -> Any:
    """A cone, the hemisphere, or directions (..., 3)."""
    if isinstance(value, (Cone, Hemisphere)):
        return value
    if isinstance(value, type) or callable(value):
        raise ParameterError(
            f"{name}={value!r:.60}: expected a direction (..., 3), Cone(axis, half_angle) or Hemisphere()"
        )
    return directions(value)


def _factor(m: Reflectance, incident: Any, to: Any, sky: Any, tolerance: float) -> Integral:
    of = _geometry("incident", incident)
    check_tolerance(tolerance)
    if sky is not None and not isinstance(of, (Cone, Hemisphere)):
        raise ParameterError(
            "incident is a direction, without room for a sky; expected Hemisphere or Cone, or a DistantLight as sky"
        )
    wi, wo = (x if isinstance(x, np.ndarray) else None for x in (of, to))
    if wi is not None and wo is not None:
        value = math.pi * m.f(wi, wo)
        return Integral(value, np.zeros(np.shape(value)[: np.ndim(value) - (m.channels is not None)])[()])
    whole, m = m, lobes_on(m, "front")
    w = wi if wi is not None else wo if wo is not None else np.zeros(3)
    shape, fixed = batch.full_shape(m, w.shape[:-1]), in_double(w)
    lights = None if sky is None else [light.in_numpy() for light in as_lights(sky)]
    channels = whole.channels is not None or (lights is not None and have_channels(lights))

    def direct(lobe: Reflectance, number: np.ndarray, places: Places, tolerance: float) -> Integrals:
        nonlocal channels
        here = fixed[number]
        if lights is not None:
            R, coloured = factor_under(lobe, lights, of, to if wo is None else here, places, tolerance)
            channels = channels or coloured
            return R
        if wi is not None:
            return single_integral(lobe, here, places, to, Over(True), Goal(tolerance))
        if wo is not None:
            return single_integral(lobe, here, places, of, Over(False), Goal(tolerance))
        return double_integral(lobe, of, to, places, tolerance)

    sides = (fixed if wi is not None else of), (fixed if wo is not None else to)
    wanted = Wanted(w.shape[:-1], direct, *sides, tolerance, np.ones(len(fixed)), lights is not None)
    R, absent = over_places(m, wanted), with_holes(np.zeros((*shape, 1)), m)
    hidden = np.isnan(absent).any(axis=-1).reshape(-1)
    R = R._replace(missing=np.where(hidden, 0.0, R.missing))
    report(R, tolerance * np.maximum(1.0, np.abs(R.value).max(axis=-1, initial=0.0)))
    value = (R.value.reshape(*shape, R.value.shape[-1]) + absent).astype(w.dtype)
    errors = R.error.reshape(shape)
    if whole is not m:
        value, errors = of_whole(value, errors, whole, w.shape[:-1])
    return Integral(value if channels else value[..., 0][()], errors[()])
