"""Integra's diffuse distributions, `.ddr` and `.ddt`: grids about the mirror direction.

Words and numbers over any number of lines; lines that begin with `;;` are comments. `TypeSym` names the symmetry of the
azimuths, `TypeColorModel` BW, RGB or spectral, `TypeData` the quantity: Luminance is pi f, Intensity f cos(theta_o),
each times the block's `kbdf`; Relative ones are scaled so that the directional-hemispherical reflectance is `kbdf`.
`sigma`, `psi` are theta and phi of wi, `theta`, `phi` those of wo about the mirror direction, or about `sigmaT`, in
degrees; lists begin with their length. Then per channel `bw`, `red`, `gre`, `blu` or `wl` nm: `kbdf` and numbers by
psi, sigma; `def` and numbers by psi, sigma, phi, theta; `enddef`. Integra's specification was not seen: this follows
libbsdf's DdrReader and DdrWriter. Checked against its own generator only. `.ddt` files look the same and are
transmission, about the direction straight behind the light, with azimuths of the front as libbsdf has them; they name
no side, and hold for both alike.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..base.measured import tabular_shape
from ..base.reflectance import Reflectance
from ..declared.arguments import Declared
from ..errors import ParameterError, held_by
from ..formula import tree
from ..formula.direction import HORIZON
from ..models._quarters import sheet_of
from ..models.sheet import Sheet
from ..tables.angle_systems import SYSTEMS
from ..tables.axes import fits
from ..tables.gridded import Gridded
from ..tables.nodes import channels_named, own_nodes
from ._layout import CHANNEL, FileAxis, Layout
from ._optical.angle_tables import as_lit
from ._reading import plain_text
from ._rows import libbsdf_grids
from ._sides import same_from_both

NAME = "Integra"
SUFFIXES = (".ddr", ".ddt")
DESCRIPTION = "grid about the mirror direction, .ddt of transmission (Integra Diffuse Distribution, libbsdf)"
ORACLE = "own generator only"
TRANSMITS = True

SYMMETRIES = ("axisymmetrical", "dirsymmetrical", "planesymmetrical", "asymmetrical")
QUANTITIES = {"luminance": "reflectance factor", "intensity": "brdf * cos(theta_o)"}
CHANNELS = {"bw": "BW", "red": "R", "gre": "G", "green": "G", "blu": "B", "blue": "B", "wl": ""}
LAYOUT = Layout(
    "specular",
    {
        "psi": FileAxis("phi_i"),
        "sigma": FileAxis("theta_i"),
        "phi": FileAxis("azimuth", 180.0, around=True),
        "theta": FileAxis("radial"),
        "channel": CHANNEL,
    },
    decimals=10,
)
ANGLES = tuple(word for word in LAYOUT.axes if word != "channel")
GRAZING = 0.01
"""Cosine of the direction that a node below the horizon has its f from: nearer to it some measurements have no end."""

RESOLUTION = (18, 61, 37)
"""Numbers of nodes of theta_i, radial and azimuth of a written model."""

_TYPE = re.compile(r"\bType(Sym|Data|ColorModel)[ \t]+\w+", re.IGNORECASE)


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: lines TypeSym, TypeData or TypeColorModel, two of them."""
    return len({word.lower() for word in _TYPE.findall(plain_text.start(head))}) >= 2


class _Words:
    """The words of a file, one after the other; `left` are those of the current line."""

    def __init__(self, path: Path):
        self.lines = plain_text.read(path, comment=";;")
        self.left: list[str] = []

    def next(self) -> str | None:
        while not self.left:
            line = self.lines.next()
            if line is None:
                return None
            self.left = plain_text.split(line.partition(";;")[0])
        return self.left.pop(0)

    def take(self, expected: str) -> str:
        word = self.next()
        if word is None:
            raise self.lines.cut_short(expected)
        return word

    def numbers(self, count: int, expected: str) -> np.ndarray:
        first = [self.lines.float(word, expected) for word in self.left[:count]]
        del self.left[:count]
        if self.left:
            return np.array(first)
        return np.concatenate([first, self.lines.numbers(count - len(first), expected)])

    def one_of(self, *choices: str) -> str:
        expected = f"one of {', '.join(choices)}"
        word = self.take(expected)
        if word.lower() not in choices:
            raise self.lines.fault(word, expected)
        return word.lower()


def read(path: Path) -> Gridded | Sheet:
    """The measurement in a file; one about `sigmaT` becomes `Scattered`, transmission (`.ddt`) a `Sheet`, both ways.

    Raises FormatError, with the line, for a damaged file.
    """
    words = _Words(path)
    header, lists, about = _header(words)
    shape = tuple(len(lists[name]) for name in ANGLES)
    blocks = []
    while (word := words.next()) is not None:
        if word.lower() not in CHANNELS:
            raise words.lines.fault(word, f"one of {', '.join(CHANNELS)}")
        blocks.append(_channel(words, word.lower(), shape))
    m = _material(words.lines, header, lists, blocks, about)
    return m if not _is_transmission(path) else sheet_of(dict.fromkeys(("forward", "backward"), as_lit(m)))


def _is_transmission(path: Path) -> bool:
    return Path(path).suffix.lower() == ".ddt"


def _header(words: _Words) -> tuple[dict[str, str], dict[str, np.ndarray], dict[str, str]]:
    """The types, the lists [degrees], and unknown entries."""
    header = {"symmetry": "planesymmetrical", "colour": "", "data": "luminance", "scale": "absolute"}
    lists: dict[str, np.ndarray] = {}
    about: dict[str, str] = {}
    while (word := words.take("a list or a channel")).lower() not in CHANNELS:
        key = word.lower()
        if key == "typesym":
            header["symmetry"] = words.one_of(*SYMMETRIES)
            if words.left[:1] in (["4D"], ["4d"]):
                words.next()
        elif key == "typecolormodel":
            header["colour"] = words.one_of("rgb", "spectral", "bw")
            if header["colour"] == "spectral":
                header["count"] = words.take("the number of wavelengths")
        elif key == "typedata":
            header["data"], header["scale"] = words.one_of(*QUANTITIES), words.one_of("absolute", "relative")
        elif key in (*ANGLES, "sigmat"):
            if key in lists:
                raise words.lines.fault(word, "each list once")
            count = words.take("a length") if key != "sigmat" else str(len(lists.get("sigma", ())))
            lists[key] = words.numbers(words.lines.count(count), f"angles of {word}")
        else:
            about[word], words.left = " ".join(words.left), []
    words.left.insert(0, word)
    lists.setdefault("psi", np.zeros(1))
    if header["symmetry"] == "axisymmetrical":
        lists.setdefault("phi", np.zeros(1))
    for name in ANGLES:
        if not len(lists.get(name, ())) or not (np.diff(lists[name]) > 0.0).all():
            raise words.lines.fault(word, f"a list {name} of rising angles before it")
    return header, lists, about


def _channel(words: _Words, channel_type: str, shape: tuple[int, ...]) -> tuple[str | float, np.ndarray, np.ndarray]:
    """Name, values (psi, sigma, phi, theta) and kbdf (psi, sigma) of a channel."""
    name: str | float = CHANNELS[channel_type]
    if channel_type == "wl":
        name = words.lines.float(words.take("a wavelength"), "a wavelength [nm]")
    scale = np.ones(shape[:2])
    if words.one_of("kbdf", "def") == "kbdf":
        scale = words.numbers(shape[0] * shape[1], "numbers of kbdf").reshape(shape[:2])
        words.one_of("def")
    count = math.prod(shape)
    table = words.numbers(count, "values by psi, sigma, phi, theta").reshape(shape)
    end = words.next()
    if end is not None and end.lower() != "enddef":
        raise words.lines.fault(end, f"enddef after {count} values")
    return name, table, scale


def _channels(lines: plain_text.Lines, header: dict[str, str], names: list) -> list[str | float]:
    """The channels in their order. Raises FormatError for missing and repeated ones."""
    expected = {"rgb": ["R", "G", "B"], "bw": ["BW"]}.get(header["colour"], names)
    if header["colour"] == "spectral" and str(len(names)) != header["count"]:
        raise lines.fault(f"{len(names)} channels", f"{header['count']} wavelengths")
    if sorted(map(str, names)) != sorted(map(str, expected)) or len(set(names)) < len(names):
        raise lines.fault(f"channels {names}", f"{header['colour'] or 'channels'} {expected}, each once")
    return expected


def _material(
    lines: plain_text.Lines, header: dict[str, str], lists: dict[str, np.ndarray], blocks: list, about: dict[str, str]
) -> Gridded:
    """The measurement of blocks of a name, values and kbdf each."""
    names = [name for name, *_ in blocks]
    channels = _channels(lines, header, names)
    values, kbdf = (np.stack([blocks[names.index(c)][k] for c in channels], axis=-1) for k in (1, 2))
    relative, oriented = header["scale"] == "relative", len(lists["psi"]) > 1 or bool(lists["psi"].any())
    values = values if relative else values * kbdf[:, :, None, None]
    axes, values, mirrored = LAYOUT.read(lists, values, header["symmetry"] == "planesymmetrical", oriented)
    gray = channels == ["BW"]
    values = np.ascontiguousarray(values[..., 0] if gray else values)
    options: dict[str, Any] = {"quantity": QUANTITIES[header["data"]], "path": lines.path, "about": about}
    options |= {"channels": None if gray else tuple(channels), "mirrored": mirrored}
    with held_by(lines.path):
        m = Gridded("specular", axes, values, **options)
    if relative:
        m = _scaled(m, kbdf.transpose(1, 0, 2))
    centres = lists.get("sigmat", lists["sigma"])
    if np.array_equal(centres, lists["sigma"]):
        return m
    return libbsdf_grids.offset(m.axes, m.brdf(), np.radians(centres), options["channels"], lines.path, about)


def _scaled(m: Gridded, albedo: np.ndarray) -> Gridded:
    """The same, scaled to these directional-hemispherical reflectances (theta_i, phi_i, channel)."""
    (radial, d_radial), (azimuth, d_azimuth) = _between(m, "radial"), _between(m, "azimuth")
    factor = np.empty((len(m.axes["theta_i"]), albedo.shape[1], albedo.shape[2]))
    for i, theta_i in enumerate(m.axes["theta_i"]):
        for j, phi_i in enumerate(m.axes.get("phi_i", np.zeros(1))):
            wi, wo = SYSTEMS["specular"].pairs(theta_i, radial[:, None], azimuth, phi_i)
            projected = (np.sin(radial) * d_radial)[:, None] * d_azimuth * np.maximum(wo[..., 2], 0.0)
            f = m.f(np.broadcast_to(wi, wo.shape), wo).reshape(*projected.shape, -1)
            factor[i, j] = albedo[i, j] / np.nansum(f * projected[..., None], axis=(0, 1))
    if m.channel_names is None:
        factor = factor[..., 0]
    return m.with_brdf(m.brdf() * (factor[:, 0] if len(m.axes) == 3 else factor)[:, None, None])


def _between(m: Gridded, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Midpoints and widths of eighths of the intervals between nodes of an axis, and up to its ends."""
    ends = (0.0, np.pi) if name == "radial" else (m.axes[name][0], m.axes[name][0] + 2.0 * np.pi)
    nodes = np.unique([*ends, *m.axes[name]])
    width = np.repeat(np.diff(nodes) / 8.0, 8)
    return np.repeat(nodes[:-1], 8) + (np.tile(np.arange(8), len(nodes) - 1) + 0.5) * width, width


def write(
    m: Reflectance,
    path: Path,
    resolution: Annotated[
        Sequence[int] | None, Declared("nodes of theta_i, radial and azimuth", 2, lengths=(3,), usual=RESOLUTION)
    ] = None,
) -> None:
    """Write the grid of a measurement about the mirror direction; for others, and where `resolution` is given, f at
    such a grid, with f at the horizon for nodes below it.

    Transmission, the same from both sides, is a file `.ddt` of its own. f cos(theta_o) stays that, other quantities
    become pi f. Lost: uncertainties, and the interpolation. Raises
    ParameterError for data with holes, delta lobes, maps, and channels other than one, RGB or wavelengths.

    Example
    >>> gn.save(gn.Lambertian(0.5), "white.ddr")
    >>> print(gn.load("white.ddr").f_angles(0.3, 0.0, 0.5, 1.0).round(4))
    0.1592
    """
    parts = same_from_both(m, NAME)
    if _is_transmission(path) and {*parts} == {"forward"}:
        m = as_lit(parts["forward"])
    elif _is_transmission(path) or parts.get("front") is not m:
        rule = ".ddt files are transmission, .ddr files reflection in front; save each in a file of its own"
        raise ParameterError(f"{path}: {m!r:.80}: {rule}")
    if isinstance(m, Gridded) and m.parameterization == "specular" and resolution is None:
        table = m
    else:
        table = _sampled(m, resolution)
    values = table.stored if table.quantity in QUANTITIES.values() else np.pi * table.brdf()
    if not np.isfinite(values).all():
        raise ParameterError(f"{m!r:.80}: has nodes without data, which the format cannot say; fill them first")
    plain_text.write(path, _lines(table, values, *_channel_words(m, table.channel_names)))


def _lines(table: Gridded, values: np.ndarray, colour: str, heads: list[str]) -> Iterator[str]:
    """The lines of a file; `heads` are the first words of the channels."""
    values = values if table.channel_names is not None else values[..., None]
    angles, values = LAYOUT.written(table.axes, values, table.is_mirrored)
    source = next(iter(str(table.about.get("Source", "")).split()), "Measured")
    symmetry = "PlaneSymmetrical" if table.is_mirrored else "ASymmetrical" + " 4D" * tree.is_oriented(table)
    data = "Intensity" if table.quantity == QUANTITIES["intensity"] else "Luminance"
    yield f"Source {source}\nTypeSym {symmetry}\nTypeColorModel {colour}\nTypeData {data} Absolute\n"
    for name, nodes in angles.items():
        if name != "psi" or tree.is_oriented(table):
            yield f"{name} {len(nodes)}\n{' '.join(map(plain_text.number, nodes))}\n"
    for k, head in enumerate(heads):
        ones = " ".join(["1"] * math.prod(values.shape[:2]))
        yield f"{head}\nkbdf\n{ones}\ndef\n"
        yield from plain_text.join(values[..., k].reshape(-1, values.shape[3]))
        yield "enddef\n"


def _channel_words(m: Reflectance, names: tuple | None) -> tuple[str, list[str]]:
    """The value of TypeColorModel, and the first words of the channels."""
    if names is None:
        return "BW", ["bw"]
    if names == ("R", "G", "B"):
        return "RGB", ["red", "gre", "blu"]
    if any(isinstance(n, str) for n in names):
        raise ParameterError(f"{m!r:.80}: has channels {names}, expected one, R, G, B or wavelengths [nm]")
    return f"spectral {len(names)}", [f"wl {plain_text.number(n)}" for n in names]


def _sampled(m: Reflectance, resolution: Sequence[int] | None) -> Gridded:
    """f at so many nodes; by default the incidences are those of a measurement."""
    tabular_shape(m)
    nodes = resolution or RESOLUTION
    quarters = {
        "theta_i": np.arange(nodes[0]) / nodes[0],
        "radial": 2.0 * (np.arange(nodes[1]) / (nodes[1] - 1)) ** 2,
        "azimuth": np.linspace(0.0, 4.0, nodes[2]),
    }
    axes = {name: np.radians(np.round(90.0 * x, 6)) for name, x in quarters.items()}
    if resolution is None:
        axes["theta_i"] = own_nodes(m).get("theta_i", axes["theta_i"])
    if not m.is_isotropic():
        axes["phi_i"] = axes["azimuth"][:-1]
    fits(math.prod(map(len, axes.values())), f"resolution={tuple(nodes)}")
    wi, wo = SYSTEMS["specular"].pairs(*np.meshgrid(*axes.values(), indexing="ij"))
    wo = np.concatenate([wo[..., :2], np.where(wo[..., 2:] > HORIZON, wo[..., 2:], GRAZING)], axis=-1)
    f = m.f(wi, wo / np.linalg.norm(wo, axis=-1, keepdims=True))
    names = None if f.ndim == len(axes) else m.channel_names or channels_named(f.shape[-1])
    return Gridded("specular", axes, np.pi * f, quantity="reflectance factor", channels=names)
