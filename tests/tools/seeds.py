"""Minimal valid files, one per format (more where a format has kinds): what the fuzz campaign damages.

`SEEDS`: the format's NAME, and a word for its kind, -> a function that gives the bytes.
"""

from __future__ import annotations

import importlib.util
import io
import tempfile
from collections.abc import Callable
from pathlib import Path
from zipfile import ZipFile, ZipInfo

import numpy as np
from optical_files import SEEDS as OPTICAL
from text_files import SEEDS as TEXT
from xlsx_files import workbook

import gonio as gn


def saved(m: gn.Reflectance, suffix: str, **options: object) -> bytes:
    """What `gonio.save` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"seed{suffix}"
        gn.save(m, path, **options)
        return path.read_bytes()


def _merl() -> bytes:
    """A header and a few cells: the shortest valid file has 35 MB."""
    return np.array([90, 90, 180], "<i4").tobytes() + np.linspace(0.0, 1.0, 64).astype("<f8").tobytes()


def _rgl() -> bytes:
    from rgl_files import synthetic

    from gonio.formats._reading import tensor_file

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "seed.bsdf"
        tensor_file.write(path, synthetic(n_theta=3, n=4, n_ndf=4))
        return path.read_bytes()


def _material() -> bytes:
    return saved(0.5 * gn.Lambertian([0.1, 0.2, 0.3]) + gn.Microfacet(gn.GGX(0.1), gn.Dielectric(1.5)), ".json")


def _kaist() -> bytes:
    from binary_files import polarized

    from gonio.formats._reading import tensor_file

    return tensor_file.serialize(polarized(counts=(2, 3, 3), wavelengths=(450, 550)))


def _utia() -> bytes:
    return np.linspace(0.0, 1.0, 3 * 288**2).astype("<f8").tobytes()


def _utia_picture() -> bytes:
    """The same numbers everywhere: few bytes, all packed."""
    from gonio.pictures.image import Image

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "seed.exr"
        Image(np.full((288, 288, 3), 0.25, "f4")).save(path)
        return path.read_bytes()


def _bispectral() -> bytes:
    """Two wavelengths, 2 x 3 pixels."""
    matrix = np.array([[0.25, 0.0], [0.5, 0.75]]) * np.linspace(0.5, 1.0, 6).reshape(2, 3, 1, 1)
    ink = gn.Donaldson(matrix, wavelengths=[400.0, 550.0])
    return saved(ink, ".exr", format="bispectral EXR")


def _csail() -> bytes:
    from binary_files import ngan

    return b"".join(a.tobytes() for a in ngan((2, 2, 4, 3), holes=0.2))


def _curet() -> bytes:
    from binary_files import curet_table, lambertian_table

    return curet_table(lambertian_table(1))


def _scatfun(packed: bool) -> bytes:
    import gzip

    from binary_files import random_layered

    return gzip.compress(random_layered(3)) if packed else random_layered(1)


def _neural() -> bytes:
    from binary_files import random_network

    return saved(random_network(), ".h5")


def small_grid() -> gn.Gridded:
    """A grid with all that one can have: channels, uncertainty, a hole, a period, things known."""
    values = np.linspace(0.1, 0.9, 3 * 2 * 4 * 2, dtype="f4").reshape(3, 2, 4, 2)
    values[2, 1, 3] = np.nan
    return gn.Gridded(
        "half_difference",
        {"theta_h": [0.0, 0.1, 0.5], "theta_d": [0.2, 1.0], "phi_d": [0.0, 0.8, 1.6, 2.4]},
        values,
        uncertainty=0.01 * values,
        channels=["R", "é"],
        periods={"phi_d": np.pi},
        outside="missing",
        interpolation="nearest",
        about={"sample": "paper", "counts": (1, 2), "offsets": np.arange(3.0)},
    )


def small_rows(**options: object) -> gn.Scattered:
    """Rows of two wavelengths at pairs in no grid."""
    theta_i, phi_i = np.radians([0.0, 30.0, 45.0, 45.0, 70.0]), np.zeros(5)
    theta_o, phi_o = np.radians([10.0, 30.0, 0.0, 45.0, 20.0]), np.radians([0.0, 180.0, 0.0, 180.0, 90.0])
    values = np.array([[0.31, 0.3], [0.32, 0.31], [0.3, 0.29], [0.36, 0.35], [0.28, 0.27]])
    more = {"channels": [450.0, 633.5], **options}
    return gn.Scattered(theta_i, phi_i, theta_o, phi_o, values, **more)


MUELLER_NAMES = [f"f_r{i}{j}/f_r11" for i in range(1, 5) for j in range(1, 5)][1:]


def mueller_table() -> bytes:
    """Three pairs in the layout of NIST's tables; the first is in its table for PTFE."""
    elements = [f"{0.01 * k:g}" for k in range(1, 16)]
    rows = [["0.532", *pair, f, *elements] for pair, f in ((("-0.001", "0", "80.0258", "-156.038"), "2.65E-01"),)]
    rows += [["0.532", "-75", "0", "10", "20", "0.25", *elements], ["0.532", "30", "0", "0", "0", "0.32", *elements]]
    names = ["lambda", "thetai", "phi", "thetar", "phir", "f_r11", *MUELLER_NAMES]
    return "\n".join([",".join(names), *map(",".join, rows), ""]).encode()


def zarr3() -> bytes:
    """A measurement in Zarr 3, which is read only."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "m.zarr"
        grid = small_grid()
        m = gn.Gridded("half_difference", grid.axes, grid.stored, channels=[450.0, 650.0])
        gn.tables.to_dataset(m).to_zarr(folder, zarr_format=3, consolidated=False)
        packed = io.BytesIO()
        with ZipFile(packed, "w") as file:
            for path in sorted(p for p in folder.rglob("*") if p.is_file()):
                file.writestr(ZipInfo(path.relative_to(folder).as_posix()), path.read_bytes())
        return packed.getvalue()


def mcd43(bands: tuple[str, ...] = ("Band1", "vis"), days: int = 3, pixels: int = 1, **attributes: object) -> bytes:
    """Kernel weights as MCD43A1 has them in netCDF-4: 16-bit integers with a scale and a fill value."""
    import xarray

    held = {}
    for k, band in enumerate(bands):
        weights = (
            np.full((days, pixels, pixels, 3), [100 + k, 50, 20], "i2")
            + np.arange(days, dtype="i2")[:, None, None, None]
        )
        weights[0] = 32767
        packed = {"scale_factor": 0.001, "add_offset": 0.0, "_FillValue": np.int16(32767), **attributes}
        held[f"BRDF_Albedo_Parameters_{band}"] = (("time", "y", "x", "param"), weights, packed)
        quality = np.zeros((days, pixels, pixels), "u1")
        held[f"BRDF_Albedo_Band_Mandatory_Quality_{band}"] = (("time", "y", "x"), quality)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "seed.nc"
        xarray.Dataset(held, {"time": ("time", np.arange(days))}).to_netcdf(path, engine="h5netcdf")
        return path.read_bytes()


def mcd43_tile(
    shape: tuple[int, int] = (3, 2), missing: bool = True, flat: bool = False, **attributes: object
) -> bytes:
    """The same in HDF4, made up: f_iso = 0.1 + 0.01 k + 0.001 (y + x) of band k, row y, column x.

    `missing`: the first pixel holds no data; `flat`: parameters without an axis of their own. Needs pyhdf.
    """
    from pyhdf.SD import SD, SDC

    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "seed.hdf")
        file = SD(path, SDC.WRITE | SDC.CREATE | SDC.TRUNC)
        file.attr("CoreMetadata.0").set(SDC.CHAR, "GROUP = INVENTORYMETADATA")
        for k, band in enumerate(("Band1", "Band4")):
            y, x = np.mgrid[: shape[0], : shape[1]]
            weights = np.stack([100 + 10 * k + y + x, 50 + 0 * y, 20 + 0 * y], axis=-1).astype("i2")
            if missing:
                weights[0, 0] = 32767
            weights = weights[..., 0] if flat else weights
            held = file.create(f"BRDF_Albedo_Parameters_{band}", SDC.INT16, weights.shape)
            held.setcompress(SDC.COMP_DEFLATE, 6)
            for name, value in {"scale_factor": 0.001, "add_offset": 0.0, **attributes}.items():
                held.attr(name).set(SDC.CHAR if isinstance(value, str) else SDC.FLOAT64, value)
            held.attr("_FillValue").set(SDC.INT16, 32767)
            held[:] = weights
            held.endaccess()
            quality = file.create(f"BRDF_Albedo_Band_Mandatory_Quality_{band}", SDC.UINT8, shape)
            quality[:] = np.full(shape, k, "u1")
            quality.endaccess()
        file.end()
        return Path(path).read_bytes()


ZERNIKE = b"""1, 1, 0, 0, 0, 0, 0, 2.0
1, 1, 1, 1, 1, 1, 0, -0.4
1, 1, 2, 0, 0, 0, 0, 0.2
2, 2, 0, 0, 0, 0, 0, 0.1
1, 2, 2, 2, 2, -2, 0, 0.05
"""
BRF_TABLE = b"""BRF Values
a panel
src_z\tsrc_a\tview_z\tview_a\t450.5nm\t633nm
  0.000\t  0.000\t 45.000\t180.000\t0.99\t1.01
 12.000\t  0.000\t  0.000\t  0.000\t1.05\t1.06
 45.000\t  0.000\t 45.000\t180.000\t1.06\t1.08
"""


def _klems() -> bytes:
    from window_xml_texts import tiny

    return tiny().encode()


def _tensor_tree() -> bytes:
    from window_xml_texts import tree3

    return tree3().encode()


def _excel() -> bytes:
    rows = [[30.0, 10.0, 180.0, 0.31], [30.0, 45.0, 180.0, 0.35], [30.0, 60.0, 180.0, None]]
    return workbook({"Data": [["Instrument", "by hand"], ["AOI (deg)", "theta_r (deg)", "dphi (deg)", "BRDF"], *rows]})


SEEDS: dict[str, Callable[[], bytes]] = {
    "netCDF": lambda: saved(small_grid(), ".nc"),
    "netCDF rows": lambda: saved(small_rows(), ".nc"),
    "Zarr": lambda: saved(small_grid(), ".zip"),
    "Zarr 3": zarr3,
    "BiRD": lambda: saved(small_rows(uncertainty=0.01), ".brdf", format="BiRD"),
    "OpenMATERIAL": lambda: saved(small_rows(), ".xompt"),
    "NIST Mueller": mueller_table,
    "Zernike": lambda: ZERNIKE,
    "BRF table": lambda: BRF_TABLE,
    "reflectance spectrum": lambda: (
        b"wavelength (nm) reflectance u\n350 0.9878 0.0053\n351 0.9889 0.0053\n352 0.9872 0.0053\n"
    ),
    "MCD43A1": mcd43,
    "MERL": _merl,
    "RGL": _rgl,
    "KAIST": _kaist,
    "UTIA": _utia,
    "UTIA picture": _utia_picture,
    "bispectral EXR": _bispectral,
    "CSAIL": _csail,
    "CUReT": _curet,
    "CUReT Oren-Nayar": lambda: b"1 0.5 0.3 0.8\n",
    "SCATFUN": lambda: _scatfun(packed=False),
    "SCATFUN gzip": lambda: _scatfun(packed=True),
    "Neural-BRDF": _neural,
    "gonio JSON": _material,
    "Excel": _excel,
    **OPTICAL,
    **TEXT,
    "WINDOW XML": _klems,
    "WINDOW XML tree": _tensor_tree,
}
if importlib.util.find_spec("pyhdf"):
    SEEDS["MCD43A1 tile"] = lambda: mcd43_tile((1, 1), missing=False)
