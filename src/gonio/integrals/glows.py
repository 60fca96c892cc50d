"""What a fluorescent material re-radiates under lights, as ordinary reflectances under lights of one channel.

The light of a wavelength that leaves is a sum over those that arrive, so of a light L_i = s_i L it is what a
reflectance sum_i F[o, i] s_i makes of L. Where the wavelengths of a light come from different directions, as in a
coloured environment, there is such a reflectance for each of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..base.light import Light
from ..base.one_channel import of_channel
from ..base.reflectance import Reflectance
from ..base.reradiation import exchanges
from ..base.under_light import glow
from ..evaluate import batch
from ..formula import bands, tree


def glows(
    m: Reflectance, lights: Sequence[Light], power: np.ndarray | None = None
) -> list[tuple[Reflectance, list[Light]]]:
    """Reflectances, each under lights, whose radiances are together what is re-radiated under all lights: none of a
    material without fluorescence, or of a single wavelength.

    `power` (C,): the energy of light in the band of each channel where its number is 1; if not given the same in all.
    """
    if not exchanges(m):
        return []
    unit = np.ones(m.channels or 1) if power is None else power
    found: dict[bytes, tuple[np.ndarray, list[Light]]] = {}
    for light in lights:
        for spectrum, plain in taken_apart(light, len(unit)):
            arrives = spectrum * unit
            if arrives.any():
                found.setdefault(arrives.tobytes(), (arrives, []))[1].append(plain)
    return [(glow(m, arrives, unit), plain) for arrives, plain in found.values()]


def widths(m: Reflectance) -> np.ndarray:
    """The widths [nm] (C,) of a material's bands: the energy in each of light of 1 per nanometre."""
    ends = bands.edges(np.asarray(m.wavelengths))
    found: np.ndarray = ends[:, 1] - ends[:, 0]
    return found


def taken_apart(light: Light, channels: int) -> Iterator[tuple[np.ndarray, Light]]:
    """Spectra (C,) and lights of one channel, whose products are together the light."""
    several = [(path, field, x) for path, field, x, _ in tree.numbers(light) if np.ndim(x) and np.shape(x)[-1] > 1]
    if not several and light.is_formula():
        yield np.ones(channels), light
        return
    if len(several) == 1 and isinstance(several[0][2], np.ndarray):
        path, field, x = several[0]
        # Light is in proportion to its only number in watts.
        if getattr(field, "unit", "").startswith("W") and x.shape == (channels,):
            yield x.astype(float), tree.with_values(light, {path: 1.0})
            return
    lit = channels_of(light)
    if lit == 1:
        yield np.ones(channels), light
        return
    for i in range(lit):
        yield np.eye(channels)[i], of_channel(light, i)


def channels_of(light: Light) -> int:
    """How many channels a light has, 1 without a channel axis."""
    return (batch.channels(light) or 1) if light.is_formula() else int(light.incident(_UP).shape[-1])


_UP = np.array([[0.0, 0.0, 1.0]])
