"""A fluorescent material under light of one spectrum, as an ordinary reflectance; and what both directions of sums over
wavelengths share."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ..arrays import Fixed, ops
from ..errors import ParameterError
from ..formula import tree
from ..formula.direction import Direction
from ..formula.exchange import Exchange
from ..formula.fields import Field, channels, param, part
from ..formula.mueller import Mueller
from ..formula.state import inferred, state
from ..formula.text import shown
from .reflectance import Reflectance
from .reradiation import require_passed_on, require_wavelengths


class _OverBands(Reflectance):
    """A sum over the wavelengths of one side of a bispectral matrix; the channel is the wavelength of the other.

    Formulas know the numbers of their own channel alone. Those of all channels stand in a table here.
    """

    of = part(Reflectance, None, "the fluorescent material", sides="any")
    channel = channels("number of the wavelength")

    varying: tuple[str, ...] = state(())
    """Paths of the numbers that differ by wavelength."""
    matrices: tuple[str, ...] = state(())
    """Paths of matrices between wavelengths."""
    coats: tuple[str, ...] = state(())
    """Paths of coats within which light goes to and fro."""
    bands: int = state(1)
    table: Any
    fluoresces = False

    def validate(self) -> None:
        kind, count = type(self).__name__, self.of.channels
        require_passed_on(self.of)
        if count is None:
            raise ParameterError(f"{kind}({self.of!r:.60}): it has no channel axis; expected wavelengths: m.at([...])")
        numbers = {path: x for path, _, x, _ in tree.numbers(self.of)}
        if others := [path for path, x in numbers.items() if not isinstance(x, (float, np.ndarray)) or np.ndim(x) > 1]:
            raise ParameterError(
                f"{kind}: {others[0]} is {shown(numbers[others[0]])}; expected a number, or a NumPy array of one for "
                f"each wavelength (of a map the material at one place)"
            )
        require_wavelengths(self.of)
        matrices = [path for path, field, _, _ in tree.walk(self.of) if isinstance(field, Exchange)]
        varying = [path for path, x in numbers.items() if np.size(x) > 1 and path not in matrices]
        matrices = [path for path in matrices if np.size(numbers[path]) > 1]
        coats: list[str] = []
        self.of._with_rounds(lambda path, _: coats.append(path))
        self._hold(coats=tuple(coats))
        self._hold(varying=tuple(varying), matrices=tuple(matrices), bands=count, channel=np.arange(count, dtype=float))
        self._kept["table"] = Fixed(self._table)

    def _keep(self) -> dict[str, Fixed]:
        return super()._keep() | ({"table": Fixed(self._table)} if "bands" in self.__dict__ else {})

    def _without_slopes(self, prefix: str = "") -> Iterator[str]:
        return (f"{prefix}of.{path}" for path in self.coats)

    def _table(self) -> np.ndarray:
        """Rows of C: the weights of the wavelengths that are summed over, what varies, and matrices [summed, own]."""
        rows = [np.broadcast_to(self._weights(), self.bands)]
        values = {path: (owner.__dict__[f.name], x) for path, f, x, owner in tree.numbers(self.of)}
        rows += [values[path][1] for path in self.varying]
        for path in self.matrices:
            rows += list(self._summed_first(Exchange.between(values[path][0])))
        rounds: dict[str, Any] = {}
        self.of._with_rounds(lambda path, coat: rounds.setdefault(path, coat.to_and_fro(self.bands)))
        rows += [row for path in self.coats for row in self._summed_first(rounds[path])]
        return np.concatenate(rows)

    @abstractmethod
    def _weights(self) -> Any:
        """A number for each of the wavelengths that are summed over."""

    @abstractmethod
    def _summed_first(self, matrix: np.ndarray) -> np.ndarray:
        """A matrix [o, i], or turned about, so that its first axis is the one that is summed over."""

    @abstractmethod
    def _pair(self, own: Reflectance, summed: Reflectance) -> tuple[Reflectance, Reflectance]:
        """The material at the wavelength that leaves, and at the one that arrives."""

    def _total(self, wi: Direction, wo: Direction) -> Any:
        """The sum of what is re-radiated, [1/sr]."""
        total = 0.0
        for band in range(self.bands):
            out, light = self._pair(self._at_pair(band, False), self._at_pair(band, True))
            total = total + ops.take(self.table, band) * out.reradiated(light, wi, wo)
        return total

    def _at_pair(self, band: int, summed: bool) -> Reflectance:
        """The material for a pair of wavelengths: with the numbers of this channel, or of the band that is summed."""

        def chosen(path: str, field: Field, value: Any) -> Any:
            if path in self.matrices:
                return self._between(self.matrices.index(path), band)
            if isinstance(field, Exchange):
                return 0.0
            if summed and path in self.varying:
                return ops.take(self.table, (1 + self.varying.index(path)) * self.bands + band)
            return value

        made: Reflectance = tree.rebuilt(self.of, chosen)
        return made._with_rounds(lambda path, _: self._between(len(self.matrices) + self.coats.index(path), band))

    def _between(self, matrix: int, band: int) -> Any:
        """The element of a matrix of the table for this channel and a band that is summed."""
        row = 1 + len(self.varying) + matrix * self.bands + band
        return ops.take(self.table, ops.to_index(self.channel + float(row * self.bands)))


class UnderLight(_OverBands):
    """A fluorescent material under light of a spectrum E: f(wi, wo) = sum_i F[o, i](wi, wo) E_i / seen_o.

    An ordinary reflectance, which sends back of every wavelength what the fluorescent one does under this light:
    `m.under(E)`, where `seen` is E. It holds for light of this spectrum alone, from every direction.

    Shapes   light, seen: numbers or (C,), C wavelengths of the material.
    Units    light, seen: irradiance of a band, in the same unit, any; f: 1/sr.
    Error    rounding. Samples of the fluorescent light are drawn by cosine.
    Source   radiance factors of fluorescent materials: CIE 182:2007; the matrix: Donaldson 1954, Br. J. Appl. Phys.
             5:210.

    Example
    >>> ink = gn.Donaldson([[0.2, 0.0], [0.3, 0.6]], wavelengths=[400.0, 550.0])
    >>> for E in ([1.0, 1.0], [5.0, 1.0]):
    ...     print(gn.albedo(gn.UnderLight(ink, E, E), [0, 0, 1]).round(3))
    ...
    [0.2 0.9]
    [0.2 2.1]
    """

    breaks = {  # noqa: RUF012  (nobody changes it: declared in the base)
        "energy": "light of other wavelengths leaves at this one",
        "furnace": "light of other wavelengths leaves at this one",
        "cavity": "light of other wavelengths leaves at this one",
        "reciprocity": "light arrives at other wavelengths than it leaves at, with other numbers of a coat",
    }

    light = param(1.0, 0.0, 1e30, "spectrum of the light: irradiance per band, in any unit")
    seen = param(1.0, 1e-30, 1e30, "spectrum of the light for which f is")

    def validate(self) -> None:
        if self.of.sides != "front" and not isinstance(self, _Glow):
            raise ParameterError(
                f"UnderLight(of={self.of!r:.60}): transmits light; expected a reflectance lit and seen in front only"
            )
        super().validate()

    @inferred
    def channel_names(self) -> tuple[Any, ...] | None:
        """Those of the material."""
        names: tuple[Any, ...] | None = self.of.channel_names
        return names

    def _weights(self) -> Any:
        return self.light

    def _summed_first(self, matrix: np.ndarray) -> np.ndarray:
        return matrix.T

    def _pair(self, own: Reflectance, summed: Reflectance) -> tuple[Reflectance, Reflectance]:
        return own, summed

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return (self.light * self.of.formula(wi, wo) + self._total(wi, wo)) / self.seen

    def polarized(self, wi: Direction, wo: Direction) -> Mueller:
        # What keeps its wavelength is polarized as by the material; fluorescence is not.
        glow = Mueller.depolarizer(self._total(wi, wo) / self.seen)
        both: Mueller = self.of.polarized(wi, wo) * (self.light / self.seen) + glow
        return both

    @property
    def polarizes(self) -> bool:
        return bool(self.of.polarizes)

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for weight, lobe in self.of.lobes():
            yield weight * self.light / self.seen, lobe
        if self.of.fluoresces:
            yield 1.0, _Glow._made_of(self.__dict__, {"_derived": {}, "_alike": {}})


class _Glow(UnderLight):
    """The light of other wavelengths, which leaves in front."""

    lobes, polarized, polarizes = Reflectance.lobes, Reflectance.polarized, False

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self._total(wi, wo) / self.seen


def glow(m: Reflectance, light: Any, seen: Any) -> Reflectance:
    """What a material re-radiates under light, irradiances (C,) of its bands, over those of the light `seen` (C,)."""
    return _Glow(m, light, seen)
