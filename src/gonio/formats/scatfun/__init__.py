"""SCATFUN: the Fourier BSDF of layered materials that layerlab writes and pbrt renders, `.bsdf`, also gzipped."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from ...arrays import ops
from ...base.angles import direction
from ...base.reflectance import Reflectance
from ...declared.arguments import ABOVE_ZERO, Declared
from ...errors import ParameterError, expect_one_of
from ...files import replacing
from ...formula.direction import Direction
from ...formula.fields import Ours, channels, kept, table
from ...formula.state import Held, note, state
from ...formula.table_warp import bracket
from ...models._quarters import quarters
from ...models.sheet import Sheet
from ...tables.axes import fits
from ...tables.drawing import Sampled
from .._reading.large_tables import expect_channels
from .._reading.tensor_file import opened
from .._sides import Side, joined, read_as, wanted
from .contents import GZIP, MAGIC, inflated, parse, serialize

if TYPE_CHECKING:
    import xarray

NAME = "SCATFUN"
SUFFIXES = (".bsdf", ".bsdf.gz")
SHARED_SUFFIX = True
DESCRIPTION = "Fourier BSDF of layered materials (layerlab, pbrt-v3), also gzipped"
ORACLE = "real file, and the Beckmann conductor that it was computed from"
NO_LAYOUT = "Fourier series by cosines, no angles"

SAMPLES, LEAST_SAMPLES = 8, 32
"""Intervals of the tables that are looked up, along half a circle: per order, and at least."""

TOGETHER = 1 << 17
"""Samples that are computed at once."""

TRANSMITS = True
SIGNS = {"front": (1.0, 1.0), "back": (-1.0, -1.0), "forward": (1.0, -1.0), "backward": (-1.0, 1.0)}
"""Of each part of a `Sheet` where light and viewer are: 1 in front."""

FEW_ORDERS = 64  # orders that are tried first, when a material is written
Y, R, B = 1.39829, -0.297375, -0.100913  # green from luminance, red and blue, as pbrt has it


class Scatfun(Sampled):
    """f = 1/cos(theta_i) sum_k a_k(mu_i, mu_o) cos(k phi), mu_i = -cos(theta_i), mu_o = cos(theta_o).

    phi = phi_o - phi_i - pi is 0 in the forward direction. The a_k are Catmull-Rom splines along mu_i and mu_o through
    the nodes of the file, as in pbrt. The sum of a series is looked up for each of 4 x 4 nodes in a table over phi, of
    8 entries per order, cubic between these: at nodes and entries it is exact. Three channels are luminance, red and
    blue; green follows. Where the series rings below 0 it is kept as it is (pbrt makes it 0).
    A file has four quarters: light from in front or behind, reflected or transmitted. f is that of `side`, a part of a
    `Sheet`; all of them are kept, and written. Transmitted radiance is n_o^2/n_i^2 of the series, by
    the file's eta. A `Sheet` has the index 1 even so: with another eta its laws, transmittance and samples count
    radiance, and f/n_o^2 is what is reciprocal.

    Sampling: see `Sampled`.

    Shapes   f: (...) for one channel, (..., 3), RGB, for three.
    Units    f: 1/sr.
    Error    against the splines and sums themselves, of the largest f cos(theta_i) of the file: 5e-6 for a real file
             with 172 orders; 1e-4 of the amplitude for the highest order alone. At the nodes of that file, beside the
             Beckmann conductor that its metadata name, f differs by 2e-4 (median) to 2e-2 (99th percentile) where it is
             above 1 % of its largest.
    Source   Jakob, d'Eon, Jakob & Marschner 2014, "A comprehensive framework for rendering layered materials",
             ACM TOG 33(4):118; Pharr, Jakob & Humphreys 2016, "Physically based rendering", section 8.6.
    """

    format = NAME
    quantity = "brdf * cos(theta_i)"
    breaks: ClassVar[dict[str, str]] = {
        "positivity": "a Fourier series that ends somewhere rings about 0",
        "reciprocity": "splines interpolate f cos(theta_i), which is not symmetric, and end at 0 on the horizon",
        "energy": "splines may lie above what they interpolate",
        "furnace": "splines may lie above what they interpolate",
    }

    mu_i = table("nodes of -cos(theta_i)")
    mu_o = table("nodes of cos(theta_o)")
    first = table("where the samples of a pair of nodes begin")
    steps = table("intervals between them along half a circle")
    samples = table("sums of the series, by pair of nodes, phi and channel")
    channel = channels("red, green, blue")

    parts: dict[str, Any] = note()
    """The parts of the file, as `parse` finds them."""
    nodes: tuple[int, int] = state()
    signs: tuple[float, float] = state()
    """Of cos(theta_i) and cos(theta_o) in the file: -1 for light and viewer behind."""
    scale: float = state()
    width: int = state()

    def __init__(self, parts: Mapping[str, Any], side: str = "front", path: str = ""):
        expect_one_of(SIGNS, "side", side)
        parts = Held({n: kept(x) if isinstance(x, (np.ndarray, Ours)) else x for n, x in parts.items()})
        width, mu, signs, scale = parts["channels"], parts["mu"].astype(float), SIGNS[side], 1.0
        if signs[0] != signs[1] and parts["eta"] > 0.0:
            scale = float(parts["eta"]) ** (2.0 if side == "forward" else -2.0)
        at_i, at_o = _beyond(mu, -signs[0]), _beyond(mu, signs[1])
        first, steps, samples = _sampled(parts["coefficients"], parts["places"][at_o, at_i], width)
        about = {"side": side, "eta": parts["eta"], "alpha": parts["alpha"]}
        about["metadata"] = parts["metadata"].decode("utf-8", "replace")
        names, nodes = ("R", "G", "B") if width == 3 else None, (len(mu[at_i]), len(mu[at_o]))
        self._hold(parts=parts, signs=signs, scale=scale, nodes=nodes, width=width, channel_names=names)
        tables = {"mu_i": mu[at_i], "mu_o": mu[at_o], "first": first, "steps": steps, "samples": Ours(samples)}
        super().__init__(path, about, **tables, channel=3 if width == 3 else 0.0)

    @property
    def values(self) -> np.ndarray:
        """The coefficients of the series of all pairs of nodes, one after the other, as in the file."""
        return np.asarray(self.parts["coefficients"])

    @property
    def valid(self) -> np.ndarray:
        """True where a coefficient is a number."""
        return np.isfinite(self.parts["coefficients"])

    @property
    def data(self) -> xarray.Dataset:
        """The parts of the file, coefficients one after the other as they are stored; see `places`."""
        import xarray

        pairs, places = ("mu_o", "mu_i"), self.parts["places"]
        variables = {
            "coefficients": ("coefficient", self.parts["coefficients"], {"units": "sr-1", "long_name": self.quantity}),
            "offset": (pairs, places[..., 0], {"units": "1", "long_name": "first coefficient"}),
            "length": (pairs, places[..., 1], {"units": "1", "long_name": "orders, per channel"}),
            "cdf": (pairs, self.parts["cdf"], {"units": "sr-1", "long_name": "integral of order 0 along mu_i"}),
        }
        nodes = {n: (n, self.parts["mu"], {"units": "1", "long_name": "cosine"}) for n in pairs}
        return xarray.Dataset(variables, nodes, {"quantity": self.quantity, "source": self.path, **self.about})

    def formula(self, wi: Direction, wo: Direction) -> Any:
        across = ops.absolute(wi.x * wo.y - wi.y * wo.x)
        along = wi.x * wo.x + wi.y * wo.y
        flat = along * along + across * across < 1e-30
        turn = ops.arctan2(across, ops.where(flat, 1.0, -along)) * (1.0 / np.pi)
        number, width = ops.to_index(self.channel), self.width
        total = 0.0 * turn + 0.0 * self.channel
        columns = _spline(self.mu_i, self.nodes[0], -self.signs[0] * wi.z)
        for o, v in _spline(self.mu_o, self.nodes[1], self.signs[1] * wo.z):
            for i, u in columns:
                pair = o * self.nodes[0] + i
                steps = ops.take(self.steps, pair)
                x = turn * steps
                start = ops.minimum(ops.floor(x), steps - 1.0)
                entry = (ops.to_index(ops.take(self.first, pair)) + ops.to_index(start)) * width + number
                total = total + u * v * _cubic(x - start, [ops.take(self.samples, entry + k * width) for k in range(4)])
        return total * self.scale / wi.z if self.scale != 1.0 else total / wi.z


def _spline(nodes: Any, count: int, x: Any) -> list[tuple[Any, Any]]:
    """Numbers and weights of the four nodes that a Catmull-Rom spline takes at x; at its ends, twice the same one."""
    (i, _), (_, t) = bracket(nodes, count, x)
    near = [ops.maximum(i - 1, 0), i, i + 1, ops.minimum(i + 2, count - 1)]
    at = [ops.take(nodes, k) for k in near]
    rise, fall = t * (t - 1.0) * (t - 1.0), t * t * (t - 1.0)
    before = rise * (at[2] - at[1]) / (at[2] - at[0])
    after = fall * (at[2] - at[1]) / (at[3] - at[1])
    step = t * t * (3.0 - 2.0 * t)
    return list(zip(near, (-before, 1.0 - step - after, step + before, after), strict=True))


def _cubic(t: Any, values: list[Any]) -> Any:
    """At t in [0, 1] between the second and the third of four values with equal steps: of degree 3 through them all."""
    a, b, c, d = values
    return (
        b + t * (c - b) + t * (t - 1.0) * ((c + a - 2.0 * b) * (2.0 - t) + (d + b - 2.0 * c) * (1.0 + t)) * (1.0 / 6.0)
    )


def _beyond(mu: np.ndarray, sign: float) -> slice:
    """The nodes that splines need where mu has this sign."""
    if sign > 0.0:
        return slice(max(int(np.searchsorted(mu, 0.0, "right")) - 2, 0), None)
    return slice(0, int(np.searchsorted(mu, 0.0, "left")) + 2)


def _sampled(coefficients: np.ndarray, places: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each pair of nodes, where its samples start and their number of steps; the samples (entry, channel).

    Each row of samples has one entry more at both ends. The first row is that of pairs without coefficients: zeros.
    """
    offsets, lengths = places.reshape(-1, 2).astype(np.int64).T
    steps = np.where(lengths > 1, np.maximum(SAMPLES * (lengths - 1), LEAST_SAMPLES), 1)
    entries = np.where(lengths > 0, steps + 3, 0)
    first = np.where(lengths > 0, 4 + np.cumsum(entries) - entries, 0)
    samples = np.zeros((4 + int(entries.sum()), width), np.float32)
    for length in np.unique(lengths[lengths > 0]):
        pairs = np.flatnonzero(lengths == length)
        count = int(steps[pairs[0]])
        pieces = min(len(pairs), 1 + 2 * len(pairs) * width * count // TOGETHER)
        for some in np.array_split(pairs, pieces):
            series = coefficients[offsets[some, None] + np.arange(width * length)].reshape(-1, width, length)
            colours = _colours(np.moveaxis(_summed(series.astype(float), count), 1, 0))
            samples[first[some, None] + np.arange(count + 3)] = np.moveaxis(colours, 0, -1)
    return first.astype(float), steps.astype(float), samples


def _summed(series: np.ndarray, steps: int) -> np.ndarray:
    """Cosine series (..., orders) at -1 to steps + 1 steps, of which `steps` are half a circle."""
    whole = np.fft.irfft(series * steps, 2 * steps)
    whole += series[..., :1] * 0.5  # irfft halves order 0, which all others have twice
    return whole[..., np.arange(-1, steps + 2) % (2 * steps)]


def _colours(series: np.ndarray) -> np.ndarray:
    """Red, green and blue of luminance, red and blue; one channel stays as it is."""
    if len(series) == 1:
        return series
    luminance, red, blue = series
    return np.stack([red, Y * luminance + R * red + B * blue, blue])


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these, perhaps gzipped."""
    if head.startswith(GZIP):
        try:
            head = zlib.decompressobj(zlib.MAX_WBITS | 16).decompress(head, len(MAGIC))
        except zlib.error:
            return False
    return head.startswith(MAGIC[:-1])


def read(path: Path, side: Side = None) -> Scatfun | Sheet:
    """The material of a file, or a `Sheet` of all that it holds. Raises FormatError for damage."""
    with opened(path) as file:
        parts = parse(inflated(file.read(), str(path)), str(path))
    ours = {n: Ours(x) if isinstance(x, np.ndarray) else x for n, x in parts.items()}
    names = wanted(_held(parts) or ["front"], side, path)
    return joined({name: Scatfun(ours, name, str(path)) for name in names}, side)


def write(
    m: Reflectance,
    path: Path,
    nodes: Annotated[int, Declared("cosines of either sign that series are held for", 4, 2048)] = 64,
    orders: Annotated[int, Declared("most terms of a series", 1, 65536)] = 1024,
    tolerance: Annotated[
        float, Declared("a series ends where the rest is less than this share of its mean", ABOVE_ZERO, 1.0)
    ] = 1e-4,
) -> None:
    """Write f cos(theta_i) as Fourier series; a Scatfun is written as it was read, bit by bit.

    Files whose name ends in .gz are compressed. Raises ParameterError for anisotropic materials, delta lobes, holes,
    and other than 1 or 3 channels, which no such file can hold.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.bsdf", format="SCATFUN")
    >>> print(gn.load("white.bsdf").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    data = serialize(_as_it_was(m) or _fitted(m, nodes, orders, tolerance))
    with replacing(path) as temporary:
        temporary.write_bytes(gzip.compress(data, mtime=0) if str(path).endswith(".gz") else data)


def _as_it_was(m: Reflectance) -> dict[str, Any] | None:
    """The parts of the file that a material was read from, if it is all of that."""
    parts = [*read_as(m)]
    files = [x.parts for x, places in parts if isinstance(x, Scatfun) and x.signs in [SIGNS[q] for q in places]]
    if len(files) < len(parts) or not (parts[0][0] is m or {*quarters(m)} == {*_held(files[0])}):
        return None
    return files[0] if all(file is files[0] or serialize(file) == serialize(files[0]) for file in files[1:]) else None


def _held(parts: Mapping[str, Any]) -> list[str]:
    """The parts of a `Sheet` that a file has series of."""
    mu, held = parts["mu"], parts["places"][..., 1] > 0
    return [name for name, (i, o) in SIGNS.items() if held[np.ix_(o * mu > 0.0, -i * mu > 0.0)].any()]


def _fitted(m: Reflectance, nodes: int, orders: int, tolerance: float) -> dict[str, Any]:
    """The parts of a file that holds m."""
    parts_by_quarter = quarters(m)
    widths = {expect_channels(part, NAME) for part in parts_by_quarter.values()}
    if len(widths) > 1:
        raise ParameterError(f"{m!r:.80}: its parts have 1 and 3 channels; expected as many of each")
    (width,) = widths
    if not all(part.is_isotropic() for part in parts_by_quarter.values()):
        raise ParameterError(f"{m!r:.80}: is anisotropic, and SCATFUN files hold isotropic materials only")
    above, (half, count) = _cosines(nodes), (nodes, 2 * nodes + 2)
    mu = np.concatenate([-above[::-1], [0.0, 0.0], above]).astype("<f4")
    theta = np.arccos(above)
    places, means = np.zeros((count, count, 2), "<u4"), np.zeros((count, count))
    pieces, at = [np.empty(0, "<f4")], 0
    for quarter, part in parts_by_quarter.items():
        sign_i, sign_o = SIGNS[quarter]
        columns = np.arange(half) if sign_i > 0.0 else count - half + np.arange(half)
        for o in range(half):
            row = count - half + o if sign_o > 0.0 else half - 1 - o
            series, lengths = _series(part, theta[::-1] if sign_i > 0.0 else theta, theta[o], width, orders, tolerance)
            for i, length in zip(columns, lengths, strict=True):
                places[row, i] = at, length
                at += width * length
            pieces += [s[:, :length].astype("<f4").reshape(-1) for s, length in zip(series, lengths, strict=True)]
            means[row, columns] = series[:, 0, 0]
    parts: dict[str, Any] = {"mu": mu, "positions": np.empty(0, "<f4"), "places": places}
    parts |= {"cdf": _integrals(mu.astype(float), means).astype("<f4"), "coefficients": np.concatenate(pieces)}
    parts |= {"metadata": f"{m!r:.4000}".encode(), "channels": width, "orders": int(places[..., 1].max())}
    return {**parts, "eta": 1.0, "alpha": (0.0, 0.0), "unused": bytes(8)}


def _series(
    m: Reflectance, theta_i: np.ndarray, theta_o: float, width: int, orders: int, tolerance: float
) -> tuple[np.ndarray, list[int]]:
    """f cos(theta_i) as cosine series (theta_i, channel, order), channels as stored; how many orders each needs."""
    count = min(FEW_ORDERS, orders)
    while True:
        fits(2.0 * count * len(theta_i), f"nodes={len(theta_i)}, orders={count}")
        phi = np.pi * np.arange(2 * count) / count
        wi, wo = direction(theta_i[:, None], phi + np.pi), direction(theta_o, 0.0)
        values = m.f(wi, wo).reshape(len(theta_i), 2 * count, width) * wi[..., 2:]
        if not np.isfinite(values).all():
            raise ParameterError(f"{m!r:.80}: has holes, which SCATFUN files cannot hold; fill them first")
        series = np.fft.rfft(np.moveaxis(values, -1, 1)).real[..., :count] / count
        series[..., 0] *= 0.5
        if width == 3:
            red, green, blue = np.moveaxis(series, 1, 0)
            series = np.stack([(green - R * red - B * blue) / Y, red, blue], axis=1)
        beyond = np.cumsum(np.abs(series[..., ::-1]), axis=-1)[..., ::-1]
        lengths = (beyond > tolerance * np.abs(series[..., :1])).any(axis=1).sum(axis=1)
        if lengths.max() < count or count == orders:
            return series, lengths.tolist()
        count = min(2 * count, orders)


def _cosines(count: int) -> np.ndarray:
    """Increasing cosines in (0, 1], dense at both ends: half of a Gauss-Lobatto rule's, of float32."""
    from scipy.special import roots_gegenbauer

    inner, _ = roots_gegenbauer(2 * count - 2, 1.5)  # real, which the roots of a NumPy polynomial need not be
    return np.append(np.sort(inner[inner > 0.0]), 1.0).astype("<f4").astype(float)


def _integrals(mu: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Integrals along the last axis, from the first node to each, of the spline that `_spline` evaluates."""
    after, before = np.minimum(np.arange(2, len(mu) + 1), len(mu) - 1), np.maximum(np.arange(-1, len(mu) - 2), 0)
    width, f0, f1 = np.diff(mu), values[:, :-1], values[:, 1:]
    safe = np.where(width > 0.0, width, 1.0)
    rise = safe * (f1 - values[:, before]) / np.where(width > 0.0, mu[1:] - mu[before], 1.0)
    fall = safe * (values[:, after] - f0) / np.where(width > 0.0, mu[after] - mu[:-1], 1.0)
    pieces = width * (0.5 * (f0 + f1) + (rise - fall) / 12.0)
    return np.concatenate([np.zeros((len(values), 1)), np.cumsum(pieces, axis=1)], axis=1)
