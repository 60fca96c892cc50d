"""What the models share that are another reflectance, seen in a frame of its own."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..formula.direction import HORIZON, Direction, raised, select
from ..formula.warp import cosine_hemisphere, cosine_hemisphere_density


class _Reframed(Reflectance):
    """A reflectance `of` whose directions are turned or mirrored before it sees them; lobe by lobe it stays one."""

    of: Any

    def light_within(self, wi: Direction) -> Direction:
        """wi in the frame of what is inside."""
        raise NotImplementedError

    def light_outside(self, wi: Direction) -> Direction:
        """The inverse of `light_within`."""
        raise NotImplementedError

    def viewer_within(self, wo: Direction) -> Direction:
        """wo in the frame of what is inside."""
        return self.light_within(wo)

    def lobes(self) -> Iterable[tuple[Any, Reflectance]]:
        for weight, lobe in self.of.lobes():
            yield weight, self if lobe is self.of else self._changed({"of": lobe})

    @property
    def channel_names(self) -> tuple | None:  # type: ignore[override]
        """Those of the reflectance inside."""
        return self.of.channel_names

    @property
    def is_delta(self) -> bool:  # type: ignore[override]
        """Whether the reflectance inside is a delta lobe."""
        return self.of.is_delta

    @property
    def seam(self) -> float:  # type: ignore[override]
        """That of the reflectance inside."""
        return self.of.seam

    # Seen from below the horizon of the frame inside nothing is reflected; samples are drawn all the same.

    def warp(self, wo: Direction, u0: Any, u1: Any) -> Direction:
        up, seen = raised(self.viewer_within(wo))
        inside = self.of.warp(seen, u0, u1)
        wi = self.light_outside(inside)
        # What is lost inside is lost: `density` does not count it, though here it may be above the horizon.
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
