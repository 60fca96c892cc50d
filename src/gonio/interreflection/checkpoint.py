"""The file of a radiosity that goes on where another was ended: the patches, the light of lamps, what rays have met."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np

from ..base.identity import identity
from ..errors import FormatError
from ..scenes.kept import ADVICE, WorkFile
from .patches import Halvings, Patches


class Begun(NamedTuple):
    """What has been found so far: patches, the irradiance (n, C) by lamps, and what the rays of the first m patches
    have met, (m, count), or the factors (n, n) of all pairs."""

    patches: Patches
    direct: np.ndarray
    found: np.ndarray


ARRAYS = ("corners", "part", "face", "places", "lines", "links", "slot", "direct", "found")


class RadiosityCheckpoint(WorkFile):
    """A file of what has been found; one of another scene, or with other settings, is refused."""

    def __init__(self, path: str | os.PathLike[str], faces: Patches, *others: Any):
        what = "scene, patches, method, tolerance and version of gonio"
        super().__init__(path, identity(faces.corners, faces.part, *others), "a radiosity", what)
        self._faces = faces.faces

    def read(self) -> Begun | None:
        """What the file holds; None where there is none."""
        held = self.arrays(ARRAYS)
        if held is None:
            return None
        n = len(held["corners"])
        if held["corners"].shape != (n, 3, 3) or any(len(held[x]) != n for x in ("part", "slot", "direct")):
            raise FormatError(f"{self.path}: a checkpoint whose arrays have the wrong shapes; {ADVICE}")
        corners, part, face, places, *tree, direct, rows = (held[name] for name in ARRAYS)
        return Begun(Patches(self._faces, corners, part, face, places, Halvings(*tree)), direct, rows)

    def keep(self, begun: Begun, is_last: bool) -> None:
        """Write what has been found, unless the last time was just now."""
        p = begun.patches
        arrays = (p.corners, p.part, p.face, p.places, *p.halvings, begun.direct, begun.found)
        self.write(dict(zip(ARRAYS, arrays, strict=True)), is_last)
