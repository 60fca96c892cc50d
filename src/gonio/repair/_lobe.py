"""A Lambertian plus a GGX lobe fitted to a table, to continue measurements beyond their largest angles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..distributions.ggx import GGX
from ..errors import ParameterError
from ..formula.fresnel.schlick import Schlick
from ..models.microfacet import Microfacet
from ._cells import Cells, evaluated

MOST = 20_000
"""Largest number of cells in a fit; of more, evenly picked ones."""


def fitted_lobe(cells: Cells, use: np.ndarray) -> tuple[Callable, dict[str, float]]:
    """kd/pi + ks D F G/(4 cos cos) fitted to the cells to use: a function (wi, wo) -> (..., C), and figures.

    Each channel has its own kd, ks >= 0; alpha and f0 are common. The fit minimises differences relative to |f|, or to
    a tenth of a channel's mean |f| where that is larger.
    """
    from scipy.optimize import least_squares, nnls

    use = use & cells.up & np.isfinite(cells.f).all(axis=-1)
    if use.sum() < 4:
        raise ParameterError(f"method='model': only {int(use.sum())} cells to fit to; expected at least 4")
    wi, wo, f = cells.wi[use], cells.wo[use], cells.f[use]
    few = np.unique(np.linspace(0, len(f) - 1, MOST).astype(int))
    wi, wo, f = wi[few], wo[few], f[few]
    weight = 1.0 / np.maximum(np.abs(f), 0.1 * np.abs(f).mean(axis=0) + 1e-30)

    def parts(x: np.ndarray, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        lobe = Microfacet(GGX(float(np.exp(x[0]))), Schlick(float(x[1])))
        glossy = evaluated(lobe, wi, wo)[..., 0]
        return np.stack([np.full(glossy.shape, 1.0 / np.pi), glossy], axis=-1)

    def amounts(columns: np.ndarray) -> np.ndarray:
        return np.stack([nnls(columns * w[:, None], v * w)[0] for w, v in zip(weight.T, f.T, strict=True)], axis=-1)

    def residual(x: np.ndarray) -> np.ndarray:
        columns = parts(x, wi, wo)
        return ((columns @ amounts(columns) - f) * weight).ravel()

    starts = [np.array([np.log(alpha), 0.1]) for alpha in (0.05, 0.2, 0.6)]
    best = min(starts, key=lambda x: float(np.sum(residual(x) ** 2)))
    fit = least_squares(residual, best, bounds=([np.log(0.005), 0.0], [0.0, 1.0]), x_scale=[1.0, 0.3])
    k = amounts(parts(fit.x, wi, wo))
    figures = {"alpha": np.exp(fit.x[0]), "f0": fit.x[1], "fit": np.sqrt(np.mean(fit.fun**2))}
    return lambda wi, wo: parts(fit.x, wi, wo) @ k, {name: float(x) for name, x in figures.items()}
