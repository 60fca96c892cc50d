"""How much light a GGX surface of perfect mirrors loses by counting the first reflection only: 1 - E(mu, alpha).

E is the albedo of `Microfacet(GGX(alpha))`, which has the height-correlated masking. It has a closed form at alpha = 1
only, 1 - E = mu ln(1 + 1/mu), so that a fit stands here: tests/models/test_artist.py holds it to an integral.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any

from ..arrays import ops

# What remains of 1 - E divided by its limits, proportional to mu at grazing and to (alpha/mu)^2 where the surface is
# smooth: coefficients of T_j(1 - 2 sqrt(alpha)) T_i(2 sqrt(x) - 1), x = mu (1 + alpha)/(mu + alpha), a row for each j.
_LOST = (
    (1.63250, -0.21518, 0.46047, -0.32325, 0.02600, -0.11189, 0.02601, -0.00960, 0.01123, 0.00464),
    (-1.71389, 1.10843, -0.75104, 0.28983, -0.30266, 0.10923, -0.07945, 0.05721, -0.00894, 0.01320),
    (0.73913, -0.71845, 0.24898, -0.23267, 0.11142, -0.05426, 0.05508, -0.00931, 0.01460, -0.00019),
    (-0.15434, 0.27430, -0.05508, 0.09196, -0.02495, 0.03169, -0.01166, 0.00772, -0.00285, 0.00019),
    (0.00365, -0.03850, 0.01963, -0.00368, 0.00621, -0.00654, -0.00307, -0.00359, -0.00175),
    (-0.00456, 0.00743, -0.01613, 0.00553, -0.01109, 0.00286, -0.00508),
    (0.00036, 0.00382, -0.00084, 0.00150, -0.00085, 0.00071),
    (0.00128, -0.00139, 0.00228, -0.00073, 0.00110),
)
_LOST_ON_AVERAGE = (1.05247, 0.09108, -0.11288, 0.00193, 0.00461, -0.00150, 0.00016, 0.00044)
# The difference between mu and the cosine to the facets that are met: the same with 2 x - 1 for 2 sqrt(x) - 1.
_MET = (
    (0.41723, -0.51761, -0.32032, -0.14311, -0.06985, -0.03802, -0.02123, -0.01133, -0.00579, -0.00190),
    (0.23867, 0.19417, 0.00543, -0.03257, -0.03613, -0.03067, -0.02055, -0.01326, -0.00820, -0.00345),
    (0.15057, 0.25839, 0.22665, 0.14417, 0.07207, 0.03102, 0.01040, 0.00117, -0.00220, -0.00127),
    (0.05616, 0.10171, 0.13021, 0.11535, 0.08621, 0.05824, 0.03625, 0.01910, 0.00737, 0.00147),
    (-0.02520, -0.05656, -0.02842, -0.00779, 0.00294, 0.00631, 0.00534, 0.00256, 0.00048),
    (-0.03500, -0.07363, -0.06012, -0.04322, -0.02669, -0.01331, -0.00477, -0.00093),
    (-0.00335, -0.00983, -0.00879, -0.00740, -0.00496, -0.00247, -0.00071),
    (0.00504, 0.00776, 0.00567, 0.00280, 0.00062),
)
_SCHLICK_ON_AVERAGE = (0.02356, 0.02558, 0.00292, -0.00332, -0.00163, 0.00007, 0.00035, 0.00014)


def lost(mu: Any, alpha: Any) -> Any:
    """1 - E(mu, alpha): the share of light that a first reflection loses, for mirrors; mu 1e-6 to 1, alpha 1e-3 to 1.

    Error    absolute 5e-4, root mean square 2e-4; positive.
    Source   least squares on 1900 points, against integrals in the slopes of the facets.
    """
    across = mu + alpha
    x, rest = mu / across, alpha / across
    v = rest * (1.0 - mu) / (1.0 + ops.sqrt(x * (1.0 + alpha)))  # 1 - sqrt(x (1 + alpha))
    return x * rest * rest * (1.0 + mu * mu) * chebyshev2(_LOST, v, ops.sqrt(alpha))


def lost_on_average(alpha: Any) -> Any:
    """1 - E_avg(alpha), E_avg = 2 integral of E mu over [0, 1]: within 2e-4, relative, of that integral of `lost`."""
    return alpha * alpha * ops.log(1.0 + 1.0 / alpha) * chebyshev(_LOST_ON_AVERAGE, ops.sqrt(alpha))


def schlick_share(mu: Any, alpha: Any) -> Any:
    """B(mu, alpha): the albedo of `Microfacet(GGX(alpha), Schlick(0))`; with F0 it is F0 (E - B) + B, exactly.

    Range, error and source as for `lost`.
    """
    steeper = chebyshev2(_MET, alpha * (1.0 - mu) / (mu + alpha), ops.sqrt(alpha))
    m = ops.maximum(1.0 - mu - alpha * alpha / (mu + alpha) * ops.log(1.0 + 1.0 / alpha) * steeper, 0.0)
    return (1.0 - lost(mu, alpha)) * m * m * m * m * m


def entering(mu: Any, alpha: Any, F0: Any) -> Any:
    """1 - E(mu), what `Microfacet(GGX(alpha), Schlick(F0))` does not reflect: E = F0 (E_1 - B) + B."""
    return F0 * lost(mu, alpha) + (1.0 - F0) * (1.0 - schlick_share(mu, alpha))


def schlick_share_on_average(alpha: Any) -> Any:
    """B_avg(alpha) = 2 integral of B mu over [0, 1]: within 4e-5 of that integral of `schlick_share`."""
    return chebyshev(_SCHLICK_ON_AVERAGE, ops.sqrt(alpha))


def chebyshev(coefficients: Sequence[Any], v: Any) -> Any:
    """Sum of coefficients[i] T_i(1 - 2v), v in [0, 1], by Clenshaw's recurrence in a form that is exact near v = 0."""
    sums = list(accumulate(reversed(coefficients)))  # what remains at v = 0, last coefficients first
    t = -4.0 * v
    extra: Any = 0.0
    later: Any = 0.0
    for at_0 in sums[:-1]:
        extra = extra + t * later
        later = later + (at_0 + extra)
    return sums[-1] + (extra + 0.5 * t * later)


def chebyshev2(rows: Sequence[Sequence[float]], v: Any, w: Any) -> Any:
    """Sum of rows[j][i] T_i(1 - 2v) T_j(1 - 2w); the sums over w first, once for all v where w is a number."""
    columns = [[row[i] for row in rows if i < len(row)] for i in range(len(rows[0]))]
    return chebyshev([chebyshev(column, w) for column in columns], v)
