"""KAIST's `.pbsdf`: polarimetric measurements, Mueller matrices on half and difference angles and five wavelengths.

A tensor file (see `tensor_file`) with the fields theta_h, theta_d, phi_d, f32 (1, n) [rad], wvls u16 [nm], and M
f32 (phi_d, theta_d, theta_h, wavelength, 4, 4), without a cosine, NaN for no data; published files are 361 x 91 x 91 x
5 and 957 MB. An empty axis, f32 (0, n), stands for even nodes. phi_d is the azimuth of wi, to the light. Checked
against Mitsuba's `measured_polarized` on files written here; no published file was at hand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from ..arrays.kinds import with_channels
from ..base.map_shape import map_shape
from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import FormatError, ParameterError, held_by
from ..formula.fields import kept
from ..formula.state import Held, note
from ..polarization import to_frames
from ..tables.nodes import above, f_at
from ..tables.polarimetric import KEPT, Polarimetric
from ._layout import CHANNEL, FileAxis, Layout
from ._reading import tensor_file
from ._reading.large_tables import Unscanned
from ._reading.tensor_file import FieldInFile, expect

if TYPE_CHECKING:
    import xarray

NAME = "KAIST"
SUFFIXES = (".pbsdf",)
DESCRIPTION = "polarimetric BRDFs of the KAIST database, Mueller matrices (Baek et al. 2020)"
ORACLE = "Mitsuba `measured_polarized`, on own files"

ENDS = {"theta_h": (0.0, 0.5), "theta_d": (0.0, 0.5), "phi_d": (-1.0, 1.0)}
"""First and last node of each axis [pi rad]."""
LAYOUT = Layout("half_difference", {**{name: FileAxis(name) for name in reversed(ENDS)}, "wvls": CHANNEL})
AXES = tuple(ENDS)
WAVELENGTHS = (450, 500, 550, 600, 650)
RESOLUTION = (91, 46, 73)


class KAIST(Polarimetric, Unscanned):
    """Polarimetric BRDF of an isotropic material: f is M00 at each wavelength, linear in theta_h, theta_d and phi_d.

    f is constant beyond the outermost nodes. Nodes without data (NaN) are left out and the weights of the others
    renormalized; Mitsuba has 0 for pairs with such a node around them.

    matrices  the stored Mueller matrices (phi_d, theta_d, theta_h, wavelength, 4, 4) [1/sr], read from the file each
              time they are asked for; FormatError if it has changed, NotFoundError if it is gone. Stokes vectors are in
              the axes of the facet: x lies across the plane of wi and wo, y = k x x, on both sides alike.
    mueller   the matrix of any pair, each element interpolated as f is, in the axes of the surface. Matrices that no
              passage of light can have are kept as they are: see `gonio.check`'s law of realizability.

    Sampling: see `Sampled`.

    Shapes   f: (..., wavelengths).
    Units    f: 1/sr; wavelengths (`channel_names`): nm.
    Error    against Mitsuba 3.9.1 `measured_polarized` (float32), 2000 pairs of a file of random numbers without NaN:
             7e-6 of the largest f. Memory: 4 bytes per node and wavelength, 8 more once f is asked for: 0.18 GB for a
             published file; 128 more once `mueller` is: 1.9 GB.
    Source   Baek et al. 2020, "Image-based acquisition and modeling of polarimetric reflectance", ACM TOG 39(4):139.
    """

    format = NAME
    breaks: ClassVar[dict[str, str]] = Unscanned.breaks | {"realizability": KEPT}
    fields_stored: dict[str, np.ndarray | FieldInFile] = note()
    """The fields of the file, in their order."""

    def __init__(self, fields: Mapping[str, Any], path: str = ""):
        """From the fields of a tensor file. Raises FormatError where they do not fit each other."""
        where = path or "KAIST fields"
        stored = Held({name: a if isinstance(a, FieldInFile) else kept(a) for name, a in fields.items()})
        wavelengths = tensor_file.as_array(expect(stored, where, "wvls", (None,), "uint16")).astype(float)
        if (np.diff(wavelengths) <= 0.0).any():
            raise FormatError(f"{where}: wvls is {wavelengths[:8]}, expected increasing wavelengths [nm]")
        M = expect(stored, where, "M", (None, None, None, len(wavelengths), 4, 4))
        empty = [name for name in AXES if name in stored and 0 in stored[name].shape]
        nodes = {
            name: np.pi * np.linspace(*ENDS[name], count) if name in empty else _nodes(stored, where, name)
            for name, count in zip(AXES, M.shape[2::-1], strict=True)
        }
        expect(stored, where, "M", (*(len(nodes[name]) for name in reversed(AXES)), len(wavelengths), 4, 4))
        about: dict[str, Any] = {name: len(x) for name, x in nodes.items()}
        if empty:
            about["nodes"] = (
                f"{', '.join(empty)} empty in the file, taken as even from end to end, as Mitsuba takes all"
            )
        self._hold(fields_stored=stored)
        f = LAYOUT.table(_first_elements(M), False)
        with held_by(where):
            super().__init__("half_difference", nodes, f, tuple(wavelengths.tolist()), path=path, about=about)

    @property
    def matrices(self) -> np.ndarray:
        """The Mueller matrices, as stored."""
        return tensor_file.as_array(self.fields_stored["M"])

    def facet_matrices(self) -> np.ndarray:
        return LAYOUT.table(self.matrices, False)

    @property
    def data(self) -> xarray.Dataset:
        """As a Gridded's, with `mueller` by phi_d, theta_d, theta_h, wavelength and Stokes component."""
        dims = ("phi_d", "theta_d", "theta_h", "wavelength", "stokes_o", "stokes_i")
        long_name = {"units": "sr-1", "long_name": "Mueller matrix of the BRDF"}
        return super().data.assign(mueller=(dims, self.matrices, long_name))


def _first_elements(M: np.ndarray | FieldInFile) -> np.ndarray:
    """M00 of all matrices."""
    if not isinstance(M, FieldInFile):
        return M[..., 0, 0]
    first = np.empty(M.shape[:-2], M.dtype)
    for k, row in enumerate(M.rows()):
        first[k] = row[..., 0, 0]
    return first


def _nodes(fields: Mapping[str, Any], where: str, name: str) -> np.ndarray:
    """Nodes of an axis [rad], made even if they are but for the rounding of float32."""
    shape = (1, None) if name in fields and fields[name].ndim == 2 else (None,)
    exact = tensor_file.as_array(expect(fields, where, name, shape)).reshape(-1).astype(float)
    even = np.linspace(exact[0], exact[-1], len(exact))
    return even if np.abs(even - exact).max() <= 1e-6 else exact


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: a tensor file with such fields."""
    return head.startswith(tensor_file.MAGIC) and b"theta_h" in head and b"wvls" in head


def read(path: Path) -> KAIST:
    """The measurement in a file: M00 of all matrices, which is f; the other elements stay in the file."""
    with tensor_file.opened(path) as file:
        stamp = tensor_file.stamp(file)
        fields = {
            n: FieldInFile(str(path), stamp, e) for n, e in tensor_file.entries(file, stamp[0], str(path)).items()
        }
    return KAIST(fields, str(path))


def write(
    m: Reflectance,
    path: Path,
    resolution: Annotated[
        Sequence[int] | None, Declared("nodes of theta_h, theta_d and phi_d", 2, lengths=(3,), usual=RESOLUTION)
    ] = None,
) -> None:
    """Write the Mueller matrices, f as M00; a KAIST is written with all its fields, bit by bit, unless `resolution` is
    given.

    A material without wavelengths gets the same f at 450 to 650 nm. NaN stands for pairs below the horizon. Raises
    ParameterError for materials that are anisotropic, coloured without wavelengths, or have a delta lobe or maps.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.pbsdf", resolution=(5, 5, 5))
    >>> m = gn.load("white.pbsdf")
    >>> print(m.channel_names, m.f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    (450.0, 500.0, 550.0, 600.0, 650.0) [0.1592 0.1592 0.1592 0.1592 0.1592]
    """
    if isinstance(m, KAIST) and resolution is None:
        tensor_file.write(path, m.fields_stored)
    else:
        tensor_file.write(path, _tabulated(m, resolution or RESOLUTION))


def _tabulated(m: Reflectance, resolution: Sequence[int]) -> dict[str, np.ndarray]:
    names = m.channel_names
    spectral = names is not None and all(isinstance(x, (int, float)) and 0 < x < 65536 and x == int(x) for x in names)
    if m.has_delta or not m.is_isotropic() or map_shape(m) or not (spectral or m.channels in (None, 1)):
        raise ParameterError(
            f"{m!r:.80}: KAIST files hold isotropic materials at whole wavelengths [nm], or gray ones, without delta "
            f"lobes or maps; convert colours to wavelengths, leave out what is more"
        )
    ends = zip(ENDS.values(), resolution, strict=True)
    axes = [np.linspace(a, b, n, dtype="f4") * np.float32(np.pi) for (a, b), n in ends]
    wavelengths = np.array(names if spectral else WAVELENGTHS, "u2")
    M = np.zeros((*resolution[::-1], len(wavelengths), 4, 4), "f4")
    for part, (wi, wo) in LAYOUT.blocks({name: x.astype(float) for name, x in zip(AXES, axes, strict=True)}):
        if m.polarizes:
            facet = to_frames(m.mueller(wi, wo), wi, wo, "facet")
            M[part] = facet if facet.ndim == 6 else facet[:, :, :, None]
        M[part][~above(wi, wo)] = np.nan
        M[part, ..., 0, 0] = with_channels(f_at(m, wi, wo), 3)
    return {**{n: x[None] for n, x in zip(AXES, axes, strict=True)}, "wvls": wavelengths, "M": M}
