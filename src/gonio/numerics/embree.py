"""Rays and triangles by Embree 4, through the library that the package embreex brings: a scene and the addresses of
functions that take packets of 16 rays, which compiled kernels call (`ops.nearest`, `ops.blocked`).
"""

from __future__ import annotations

import ctypes
from ctypes import c_int, c_size_t, c_uint, c_void_p, py_object
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import DependencyError, ParameterError, ShapeError
from ..machine.caches import at_end

PIECES = 4
"""Numbers that an address is handed to kernels as, of 16 bits each: any dtype holds them."""

_PADDING = 16  # bytes behind the last vertex that Embree may read
_VERSION, _TRIANGLES, _INDEX, _VERTEX, _UINT3, _FLOAT3, _ROBUST = 0, 0, 0, 1, 0x5003, 0x9003, 4


@cache
def _library() -> Any:
    """Embree, loaded. Raises DependencyError where the package embreex, or a library in it that fits, is missing."""
    spec = find_spec("embreex")
    if spec is None or spec.origin is None:
        raise DependencyError("rays on triangles need the package embreex: pip install embreex")
    package = Path(spec.origin).parent
    folders = (package.parent / "embreex.libs", package / ".dylibs", package)
    paths = [path for folder in folders for path in sorted(folder.glob("*embree4*")) if path.suffix != ".pyd"]
    if not paths:
        raise DependencyError(f"no library named embree4 beside {package}; reinstall embreex: pip install embreex")
    library = ctypes.CDLL(str(paths[0]))
    for name, result, arguments in (
        ("rtcNewDevice", c_void_p, (ctypes.c_char_p,)),
        ("rtcGetDeviceProperty", ctypes.c_ssize_t, (c_void_p, c_int)),
        ("rtcGetDeviceError", c_int, (c_void_p,)),
        ("rtcNewScene", c_void_p, (c_void_p,)),
        ("rtcSetSceneFlags", None, (c_void_p, c_int)),
        ("rtcNewGeometry", c_void_p, (c_void_p, c_int)),
        ("rtcSetSharedGeometryBuffer", None, (c_void_p, c_int, c_uint, c_int, c_void_p, *[c_size_t] * 3)),
        ("rtcCommitGeometry", None, (c_void_p,)),
        ("rtcAttachGeometry", c_uint, (c_void_p, c_void_p)),
        ("rtcReleaseGeometry", None, (c_void_p,)),
        ("rtcCommitScene", None, (c_void_p,)),
        ("rtcReleaseScene", None, (c_void_p, py_object)),  # what calls it when a scene's owner goes, which it ignores
    ):
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


@cache
def _device() -> int:
    library = _library()
    device: int | None = library.rtcNewDevice(None)
    if not device:
        raise DependencyError(f"Embree makes no device on this processor: error {library.rtcGetDeviceError(None)}")
    version = library.rtcGetDeviceProperty(device, _VERSION)
    if version // 10000 != 4:
        raise DependencyError(f"embreex brings Embree {version // 10000}; expected Embree 4: pip install -U embreex")
    return device


class EmbreeTriangles:
    """Triangles that rays may be shot at: vertices (V, 3), and three numbers of vertices of each triangle (N, 3).

    `robust`: no ray passes between two triangles that share an edge, at some cost in speed.
    Computed in float32. Raises DependencyError where Embree is missing, ShapeError and ParameterError for no triangles.
    """

    def __init__(self, vertices: Any, triangles: Any, robust: bool = False):
        vertices, triangles = np.asarray(vertices, np.float32), np.asarray(triangles)
        for name, x in (("vertices", vertices), ("triangles", triangles)):
            if x.ndim != 2 or x.shape[1] != 3 or not len(x):
                raise ShapeError(f"{name}: got shape {x.shape}, expected (n, 3) with at least one row")
        if triangles.dtype.kind not in "iu":
            raise ParameterError(f"triangles: got dtype {triangles.dtype}, expected whole numbers of vertices")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            bad = int(triangles.min() if triangles.min() < 0 else triangles.max())
            raise ParameterError(f"triangles: vertex number {bad}, expected 0 to {len(vertices) - 1}")
        if not np.isfinite(vertices).all():
            raise ParameterError("vertices: some are NaN or infinite; expected numbers")
        self._vertices = np.zeros(3 * len(vertices) + _PADDING // 4, np.float32)
        self._vertices[: 3 * len(vertices)] = vertices.reshape(-1)
        self._triangles = np.ascontiguousarray(triangles, np.uint32)
        library, device = _library(), _device()
        scene = library.rtcNewScene(device)
        at_end(self, library.rtcReleaseScene, scene)
        library.rtcSetSceneFlags(scene, _ROBUST if robust else 0)
        geometry = library.rtcNewGeometry(device, _TRIANGLES)
        for buffer, form, array, count in (
            (_VERTEX, _FLOAT3, self._vertices, len(vertices)),
            (_INDEX, _UINT3, self._triangles, len(triangles)),
        ):
            library.rtcSetSharedGeometryBuffer(geometry, buffer, 0, form, array.ctypes.data, 0, 12, count)
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(scene, geometry)
        library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(scene)
        error = library.rtcGetDeviceError(device)
        if error:
            raise ParameterError(f"Embree makes no scene of {len(triangles)} triangles: error {error}")
        functions = (ctypes.cast(f, c_void_p).value for f in (library.rtcIntersect16, library.rtcOccluded16))
        self._addresses = [*functions, scene]

    @property
    def handle(self) -> np.ndarray:
        """The numbers for `ops.nearest` and `ops.blocked`, to be given to formulas as a table: `Fixed(mesh.handle)`.

        The array keeps the triangles; a copy of its numbers does not.
        """
        pieces = [float((a >> 16 * k) & 0xFFFF) for a in self._addresses for k in range(PIECES)]
        handle = np.array(pieces).view(_Handle)
        handle.owner = self
        return handle


class _Handle(np.ndarray):
    """Numbers that keep what they stand for."""

    owner: Any = None
