"""What coats, maps and rotations share: each is another reflectance, lit and seen through something."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import Any, ClassVar

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..base.results import Hints
from ..formula.direction import HORIZON, Direction, raised, select
from ..formula.state import inferred
from ..formula.warp import cosine_hemisphere, cosine_hemisphere_density


class Wrapper(Reflectance):
    """Another reflectance, changed: that one names the channels."""

    wraps: ClassVar[str] = "of"
    """Name of the part that is wrapped."""

    @property
    def inside(self) -> Any:
        """The wrapped reflectance."""
        return self.__dict__[self.wraps]

    @inferred
    def channel_names(self) -> tuple | None:
        """Those of what is wrapped."""
        return self.inside.channel_names


class WrappedLobe(Wrapper):
    """A lobe of the wrapped reflectance: a delta lobe where that is one, drawn with its seam."""

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        yield 1.0, self

    @property
    def is_delta(self) -> bool:
        return self.inside.is_delta

    @property
    def hints(self) -> Hints:
        return Hints(seam=self.inside.hints.seam)


class Reframed(WrappedLobe):
    """A reflectance `of` whose directions are turned or mirrored before it sees them; lobe by lobe it stays one."""

    of: Any

    @abstractmethod
    def light_within(self, wi: Direction) -> Direction:
        """wi in the frame of the reflectance inside."""

    @abstractmethod
    def light_outside(self, wi: Direction) -> Direction:
        """The inverse of `light_within`."""

    def viewer_within(self, wo: Direction) -> Direction:
        """wo in the frame of the reflectance inside."""
        return self.light_within(wo)

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for weight, lobe in self.of.lobes():
            yield weight, self if lobe is self.of else self._changed({"of": lobe})

    @property
    def polarizes(self) -> bool:
        return self.of.polarizes

    # Seen from below the horizon of the frame inside nothing is reflected; samples are drawn all the same.

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        up, seen = raised(self.viewer_within(wo))
        inside = self.of.warp(seen, u0, u1)
        wi = self.light_outside(inside)
        # Light that is lost inside stays lost: `density` does not count it, though here it may be above the horizon.
        wi = Direction(wi.x, wi.y, ops.where(inside.z > HORIZON, wi.z, -ops.absolute(wi.z)))
        return select(up, wi, cosine_hemisphere(u0, u1))

    def density(self, wi: Direction, wo: Direction) -> Any:
        up, seen = raised(self.viewer_within(wo))
        lit_up, lit = raised(self.light_within(wi))
        inside = ops.where(lit_up, self.of.density(lit, seen), 0.0)
        return ops.where(up, inside, cosine_hemisphere_density(wi))

    def estimate(self, wo: Direction) -> Any:
        up, seen = raised(self.viewer_within(wo))
        return ops.where(up, self.of.estimate(seen), 0.0)

    def mirrored(self, wo: Direction) -> Direction:
        _, seen = raised(self.viewer_within(wo))
        return self.light_outside(self.of.mirrored(seen))
