"""Weights of the Ross-Li kernels by least squares, with what the angles of the measurements leave uncertain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import labels, ops
from ..arrays.labels import Labels, is_named
from ..declared.arguments import checked
from ..errors import ArrayTypeError, MissingDataWarning, ParameterError, ShapeError, expect_one_of, warn
from ..models.ross_li import GEOMETRIC, VOLUMETRIC, RossLi
from . import kernels
from .kernels import check_angles

SINGULAR = 1e-8
"""Ratio of the kernels' smallest to their largest singular value below which angles do not tell them apart."""
NAMES = ("f_iso", "f_vol", "f_geo")


@dataclass(frozen=True, eq=False)
class KernelFit:
    """Weights of kernels that fit measured reflectance factors, and their uncertainty.

    weights   (3, ...) f_iso, f_vol, f_geo; NaN where there were too few rows, or their angles too much alike
    inverse   (..., 3, 3) M^-1, M = sum of k k^T/u^2 over the rows, k = (1, K_vol, K_geo); u = 1 where it is not known
    rmse      (...) root of the sum of squared residuals over rows less 3: the noise, seen from the fit
    rows      (...) number of rows that count
    """

    weights: Any
    inverse: Any
    rmse: Any
    rows: Any
    known_noise: bool
    """Whether the uncertainty of the rows was given; else `rmse` stands for it."""
    volumetric: str
    geometric: str

    @property
    def model(self) -> RossLi:
        """The surface with these weights. Raises ParameterError where they are out of its bounds."""
        words = {"volumetric": self.volumetric, "geometric": self.geometric}
        if is_named(self.weights):
            return RossLi(**{name: self.weights.sel(weight=name, drop=True) for name in NAMES}, **words)
        return RossLi(**{n: np.ma.masked_invalid(w) for n, w in zip(NAMES, self.weights, strict=True)}, **words)

    @property
    def uncertainty(self) -> Any:
        """Standard uncertainties (3, ...) of the weights."""
        return self._like_weights(
            np.sqrt(np.moveaxis(np.diagonal(self._inverse, axis1=-2, axis2=-1), -1, 0)) * self._noise
        )

    def linear(self, k: Any) -> tuple[Any, Any]:
        """The value of k_iso f_iso + k_vol f_vol + k_geo f_geo, and its standard uncertainty, each (...).

        `k`: three numbers. (1, K_vol, K_geo) at some angles give the reflectance factor there, (1, 0.189184, -1.377622)
        the white-sky albedo of MODIS' kernels.

        Source   linear propagation; the numbers: MODIS user guide of MCD43, V006.
        """
        k = self._three(k)
        weights = np.asarray(self.weights)
        value, spread = np.tensordot(k, weights, 1), np.sqrt(self.weight_of_determination(k)) * self._noise
        if is_named(self.weights):
            empty = self.weights.isel(weight=0, drop=True)
            return empty.copy(data=value), empty.copy(data=spread)
        return value, spread

    def weight_of_determination(self, k: Any) -> np.ndarray:
        """k^T M^-1 k (...): how much the angles of the rows amplify the variance of their noise in `linear(k)`.

        Below 1 the rows average noise out. With u given it is the variance itself.

        Source   linear propagation; MODIS' user guide of MCD43A2 calls it so: a noise amplification factor that says
                 how well the angles suit.
        """
        k = self._three(k)
        return np.einsum("i,...ij,j->...", k, self._inverse, k)

    @property
    def _inverse(self) -> np.ndarray:
        return np.asarray(self.inverse)

    @property
    def _noise(self) -> Any:
        return 1.0 if self.known_noise else np.asarray(self.rmse)

    def _like_weights(self, values: np.ndarray) -> Any:
        return self.weights.copy(data=values) if is_named(self.weights) else values

    @staticmethod
    def _three(k: Any) -> np.ndarray:
        numbers = np.asarray(k, dtype=float)
        if numbers.shape != (3,):
            raise ShapeError(f"k: got shape {numbers.shape}, expected three numbers (k_iso, k_vol, k_geo)")
        return numbers


@checked
def fit_kernels(
    theta_s: Any,
    theta_v: Any,
    phi: Any,
    brf: Any,
    u: Any = None,
    volumetric: str = "ross_thick",
    geometric: str = "li_sparse_r",
) -> KernelFit:
    """The weights f_iso, f_vol, f_geo for which BRF = f_iso + f_vol K_vol + f_geo K_geo is nearest to measured rows.

    Least squares, weighted by 1/u^2 where standard uncertainties u are known. Rows that are NaN are left out, and
    weights may be negative. Reflectance factors are pi f: radiance over that of a white Lambertian surface.

    Shapes   brf: (N, ...), a fit for each of ..., such as (N,), (N, C), (N, y, x, C); angles: (N,), or broadcast with
             brf; u: a number, (N,) or like brf. Arrays of xarray: their first axis holds the rows, and what is left of
             their axes stays.
    Units    rad; others: 1.
    Error    rounding: QR decomposition, not normal equations.
    Source   Lucht, Schaaf & Strahler 2000, IEEE TGRS 38(2):977, without their limits on weights.

    Example
    >>> sun, view, phi = np.radians([[30, 30, 45, 45, 60], [0, 40, 20, 60, 30], [0, 180, 0, 90, 180]])
    >>> measured = gn.remote_sensing.brf(gn.RossLi(0.2, 0.1, 0.03), sun, view, phi)
    >>> gn.remote_sensing.fit_kernels(sun, view, phi, measured).weights.round(6)
    array([0.2 , 0.1 , 0.03])
    """
    expect_one_of(VOLUMETRIC, "volumetric", volumetric)
    expect_one_of(GEOMETRIC, "geometric", geometric)
    inputs = {"brf": brf, "theta_s": theta_s, "theta_v": theta_v, "phi": phi, "u": u}
    for name, x in inputs.items():
        if x is None and name != "u":
            raise ArrayTypeError(f"{name}: got None, expected (N, ...), a row for each pair of angles")
    values, frame = _plain({name: x for name, x in inputs.items() if x is not None})
    measured = values.pop("brf")
    spread = values.pop("u", None)
    values = {name: _beside(measured, name, x) for name, x in values.items()}
    check_angles(**values)
    count = measured.shape[0]
    vol, geo = (getattr(kernels, name)(**values) for name in (volumetric, geometric))
    vol, geo = np.broadcast_arrays(vol, geo)
    if (np.abs(measured[np.isfinite(measured)]) > 4.0).any():
        top = float(np.nanmax(np.abs(measured)))
        raise ParameterError(
            f"brf: reaches {top:g}; expected reflectance factors, of which a white surface has 1; in percent?"
        )
    used = np.isfinite(measured) & np.isfinite(vol) & np.isfinite(geo)
    root = np.where(used, 1.0, 0.0)
    if spread is not None:
        spread = _beside(measured, "u", spread)
        if not (spread > 0.0).all():
            raise ParameterError("u: expected standard uncertainties above 0; leave rows out by NaN in brf")
        root = root / spread
    rows = used.sum(axis=0)
    if count < 3 or not (rows >= 3).any():
        raise ParameterError(
            f"brf: {int(rows.max(initial=0))} rows that are numbers, expected at least 3 for three weights"
        )
    design = np.stack([np.ones_like(vol), vol, geo], axis=-1)
    design = np.moveaxis(np.where(used[..., None], design, 0.0) * root[..., None], 0, -2)
    target = np.moveaxis(np.where(used, measured, 0.0) * root, 0, -1)
    q, r = np.linalg.qr(design)
    singular = np.linalg.svd(r, compute_uv=False)
    solved = (rows >= 3) & (singular[..., -1] > SINGULAR * singular[..., 0])
    if not solved.any():
        raise ParameterError(
            "angles: they do not tell the kernels apart; expected rows of different sun or view angles"
        )
    if not solved.all():
        text = f"{int((~solved).sum())} of {solved.size} fits have too few rows, or too similar angles"
        warn(f"{text}: their weights are NaN", MissingDataWarning)
    r = np.where(solved[..., None, None], r, np.eye(3))
    inverse_r = np.linalg.inv(r)
    weights = np.einsum("...ij,...kj,...k->...i", inverse_r, q, target)
    weights = np.moveaxis(np.where(solved[..., None], weights, np.nan), -1, 0)
    residual = np.where(used, measured - (weights[0] + weights[1] * vol + weights[2] * geo), 0.0)
    free = np.where(rows > 3, rows - 3.0, np.nan)
    rmse = np.sqrt((residual * residual).sum(axis=0) / free)
    inverse = np.where(solved[..., None, None], inverse_r @ np.swapaxes(inverse_r, -1, -2), np.nan)
    return KernelFit(*_named(frame, weights, inverse, rmse, rows), u is not None, volumetric, geometric)


def _plain(inputs: dict[str, Any]) -> tuple[dict[str, np.ndarray], Labels | None]:
    """The inputs as NumPy arrays, the rows' axis first; the labels of the other axes where they have names."""
    if not any(map(is_named, inputs.values())):
        try:
            numbers = {name: np.asarray(ops.numbers(x), dtype=float) for name, x in inputs.items()}
        except ValueError as error:
            raise ArrayTypeError(f"fit_kernels: got {error}; expected arrays of numbers") from None
        if not numbers["brf"].ndim:
            raise ShapeError("brf: got one number, expected (N, ...), a row for each pair of angles")
        return numbers, None
    named = {name: labels.data_array(x, name) for name, x in inputs.items() if is_named(x)}
    if "brf" not in named:
        raise ArrayTypeError("brf: a plain array beside arrays with named axes; expected names for all, or for none")
    if not named["brf"].ndim:
        raise ShapeError("brf: got one number, expected an array whose first axis holds the rows")
    row = named["brf"].dims[0]
    whole = labels.union([Labels(x) for x in named.values()], "fit_kernels")
    dims = [d for d in whole.frame.dims if d != row]
    numbers = {}
    for name, x in inputs.items():
        if name not in named:
            numbers[name] = np.asarray(ops.numbers(x), dtype=float)
            if numbers[name].ndim:
                raise ArrayTypeError(f"{name}: a plain array beside arrays with named axes; expected names for all")
            continue
        array = named[name]
        order = [d for d in (row, *dims) if d in array.dims]
        values = np.asarray(array.transpose(*order).values, dtype=float)
        numbers[name] = values[tuple(slice(None) if d in array.dims else None for d in (row, *dims))]
    numbers["brf"] = np.broadcast_to(numbers["brf"], [whole.frame.sizes[d] for d in (row, *dims)])
    return numbers, Labels(whole.frame.isel({row: 0}, drop=True))


def _beside(measured: np.ndarray, name: str, x: np.ndarray) -> np.ndarray:
    """Angles or uncertainties (N,), or like the measured values, broadcast to these."""
    rows = x.ndim == 1 and x.shape != (1,) and measured.ndim > 1
    try:
        return np.broadcast_to(x.reshape(-1, *[1] * (measured.ndim - 1)) if rows else x, measured.shape)
    except ValueError:
        raise ShapeError(f"{name}: got shape {x.shape}, expected ({len(measured)},) or {measured.shape}") from None


def _named(frame: Labels | None, weights: Any, inverse: Any, rmse: Any, rows: Any) -> tuple[Any, Any, Any, Any]:
    if frame is None:
        return weights, inverse, rmse, rows
    import xarray

    def made(values: Any, before: tuple[str, ...] = (), after: tuple[str, ...] = ()) -> Any:
        return xarray.DataArray(values, dims=(*before, *frame.frame.dims, *after), coords=frame.frame.coords)

    weights = made(weights, ("weight",)).assign_coords(weight=list(NAMES))
    return weights, made(inverse, (), ("weight", "other_weight")), made(rmse), made(rows)
