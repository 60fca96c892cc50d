"""Built-in materials: published fits of the MERL measurements, metals and dielectrics by refractive index."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, overload

import numpy as np

from ..arrays import ops
from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ..declared.contents import columns
from ..declared.notebooks import repr_html
from ..distributions.ggx import GGX
from ..errors import NotFoundError, ParameterError
from ..formula import tree
from ..formula.fresnel.conductor import Conductor
from ..formula.fresnel.dielectric import Dielectric
from ..formula.spectrum import Spectrum
from ..models.abc import ABC
from ..models.ideal_specular import IdealSpecular
from ..models.lambertian import Lambertian
from ..models.microfacet import Microfacet
from ..pictures.colour import observer
from .index_file import SUFFIXES, Spectra, read
from .rgb_index import rgb_index

POLISHED = 0.1
"""Default slope scale alpha of metals and dielectrics: visibly polished, not a mirror."""

TRANSPARENT = 1e-3
"""Extinction k up to which a substance is a dielectric."""

FIT, METAL, DIELECTRIC = "measured fit", "metal", "dielectric"


@dataclass(frozen=True)
class Entry:
    """One built-in material, as `materials` lists it."""

    _repr_html_ = repr_html

    name: str
    kind: str
    description: str
    source: str
    aliases: tuple[str, ...] = ()


class Entries(list[Entry]):
    """Built-in materials; they print with a line for each.

    Example
    >>> entries = gn.materials()
    >>> print([e.source.split(",")[0] for e in entries if e.name == "gold"])
    ['Johnson & Christy 1972']
    """

    def __repr__(self) -> str:
        return columns((e.name, f"{e.kind}, {e.description}") for e in self)


_FIT_SOURCE = (
    "Löw, Kronander, Ynnerman & Unger 2012, doi:10.1145/2077341.2077350, fitted to the measurements of "
    "Matusik, Pfister, Brand & McMillan 2003, doi:10.1145/882262.882343"
)

# Two metals share their name with a measured sample. The plain name means the sample, as in the database and in all of
# its literature; the names of the metal are its symbol and "pure-...".
_SUBSTANCES = {
    "Ag": (METAL, ("silver",), "Johnson & Christy 1972, doi:10.1103/PhysRevB.6.4370"),
    "Al": (METAL, ("pure-aluminium", "pure-aluminum"), "Rakić 1995, doi:10.1364/AO.34.004755"),
    "Au": (METAL, ("gold",), "Johnson & Christy 1972, doi:10.1103/PhysRevB.6.4370"),
    "Cr": (METAL, ("chromium",), "Johnson & Christy 1974, doi:10.1103/PhysRevB.9.5056"),
    "Cu": (METAL, ("copper",), "Johnson & Christy 1972, doi:10.1103/PhysRevB.6.4370"),
    "Fe": (METAL, ("iron",), "Johnson & Christy 1974, doi:10.1103/PhysRevB.9.5056"),
    "H2O": (DIELECTRIC, ("water",), "Daimon & Masumura 2007, doi:10.1364/AO.46.003811"),
    "MgF2": (DIELECTRIC, ("magnesium-fluoride",), "Dodge 1984, doi:10.1364/AO.23.001980"),
    "Ni": (METAL, ("pure-nickel",), "Johnson & Christy 1974, doi:10.1103/PhysRevB.9.5056"),
    "SiO2": (DIELECTRIC, ("silica", "fused-silica"), "Malitson 1965, doi:10.1364/JOSA.55.001205"),
    "Ti": (METAL, ("titanium",), "Johnson & Christy 1974, doi:10.1103/PhysRevB.9.5056"),
    "TiO2": (DIELECTRIC, ("titanium-dioxide", "titania"), "Siefke et al. 2016, doi:10.1002/adom.201600250"),
    "W": (METAL, ("tungsten",), "Rakić et al. 1998, doi:10.1364/AO.37.005271"),
}
_DATABASE = "; table: Polyanskiy 2024, doi:10.1038/s41597-023-02898-2"

_FIT_ALIASES = {"aluminium": "aluminum", "aventurnine": "aventurine", "silicon-nitrade": "silicon-nitride"}
_FAMILIES = {  # by the first of these words in the name of a fit
    "color-changing-paint": "colour-changing paint",
    "metallic-paint": "metallic paint",
    "two-layer": "metallic, two layers",
    "paint": "paint",
    "latex": "latex",
    "fabric": "fabric",
    "felt": "felt",
    "phenolic": "phenolic resin",
    "rubber": "rubber",
    "bball": "diffuse ball",
    **dict.fromkeys(("obsidian", "marble", "jasper", "aventurnine", "hematite"), "polished stone"),
    **dict.fromkeys(("alumina", "nitrade"), "ceramic"),
    "carbide": "hard metal",
    **dict.fromkeys(("bronze", "aluminium", "brass", "chrome", "nickel", "steel", "ss440"), "metal"),
    **dict.fromkeys(("plastic", "acrylic", "delrin", "nylon", "polyethylene", "foam", "pvc", "teflon"), "plastic"),
    **dict.fromkeys(("cherry", "maple", "fruitwood", "pine", "natural", "oak", "walnut"), "stained wood"),
}


def materials() -> Entries:
    """All built-in materials: metals, dielectrics and measured fits; `material` makes one by name.

    Example
    >>> metals = [e.name for e in gn.materials() if e.kind == "metal"]
    >>> print("gold" in metals, "water" in metals)
    True False
    """
    return Entries(_entries())


@checked
def material(name: str, *, alpha: float | None = None, wavelengths: Any = None) -> Reflectance:
    """The built-in material of a name, an ordinary model: `material("brass")`, `material("Au", alpha=0.2)`.

    A measured fit is `Lambertian(rho) + ABC(A, B, C, eta)` in linear RGB. A metal or dielectric is a microfacet surface
    (GGX) with the exact Fresnel reflectance of its refractive index: `Conductor`, or `Dielectric` if k is below 0.001
    (which changes the reflectance by 1e-6). Dielectrics reflect at the surface only; light from inside is left out.

    alpha        slope scale of a metal or dielectric, by default 0.1; 0 is a mirror, `IdealSpecular`
    wavelengths  [nm] of the channels of a metal or dielectric, interpolated linearly in the table; a number gives no
                 channel axis. By default linear RGB, of the reflectance integrated over the spectrum (D65, CIE 1931):
                 n and k of each channel are those that reflect so, within 0.0014 at any angle (copper's red: 0.0031;
                 gold's, 1.04 and thus not within sRGB, is held at 0.975). `[630, 532, 465]` takes three wavelengths.

    Case does not matter, spaces and underscores count as hyphens, and symbols name substances too. `aluminium` and
    `nickel` are the measured samples; the metals by refractive index are `pure-aluminium` or `Al`, and `pure-nickel` or
    `Ni`.

    Raises NotFoundError for an unknown name; ParameterError for wavelengths outside the table (nothing is extrapolated)
    and for options of a measured fit, which has none.

    Example
    >>> print(gn.material("gold", alpha=0).delta_reflectance([0, 0, 1]).round(3))
    [0.975 0.729 0.364]
    >>> print(gn.material("gold", alpha=0, wavelengths=[630, 532, 465]).delta_reflectance([0, 0, 1]).round(3))
    [0.942 0.704 0.404]
    >>> print(gn.albedo(gn.material("brass"), [0, 0, 1]).round(3))
    [0.129 0.092 0.052]
    """
    entry = find(name)
    if entry is None:
        raise NotFoundError(f"no built-in material {name!r}{hint(name)}; `gonio materials` lists all")
    if entry.kind == FIT:
        if alpha is not None or wavelengths is not None:
            pure = f"pure-{entry.name}"
            other = f"; {pure} is the metal by refractive index and has them" if find(pure) else ""
            raise ParameterError(
                f"material({name!r}): a measured fit has no options alpha and wavelengths; change it by "
                f"replace(...){other}"
            )
        r = _fits()[entry.name]
        return Lambertian(r[:3]) + tree.with_notes(ABC(r[3:6], r[6], r[7], r[8]), _numbers_from=entry.source)
    return _polished(entry, POLISHED if alpha is None else alpha, wavelengths)


def find(name: str) -> Entry | None:
    """The entry of a name or alias, or None."""
    return _by_name().get(_plain(name))


def hint(name: str) -> str:
    """A hint after an unknown name: "; nearest: gold, ...", or "" if no name is similar."""
    plain, by_name = _plain(name), _by_name()
    similar = difflib.get_close_matches(plain, by_name, n=5, cutoff=0.6)
    similar += [k for k in by_name if plain and (plain in k or k in plain.split("-"))]
    names = list(dict.fromkeys(by_name[k].name for k in similar))[:4]
    return f"; nearest: {', '.join(names)}" if names else ""


@overload
def refractive_index(substance: str | Path) -> Spectra: ...
@overload
def refractive_index(substance: str | Path, wavelengths: Any) -> tuple[Any, Any]: ...
@checked
def refractive_index(substance: str | Path, wavelengths: Any = None) -> tuple[Any, Any]:
    """Refractive index n and extinction k of a substance, n + ik, by name or symbol ("gold", "Au"), or of a file.

    A file is one of refractiveindex.info (`Johnson.yml`): tables of n, k or nk, or a dispersion formula, 1 to 9.
    Without wavelengths n and k are spectra, which parameters may be:
    `gn.Conductor(*gn.spectra.refractive_index("gold"))`.

    Shapes   wavelengths: any; n, k: the same.
    Units    wavelengths: nm, in vacuum or air as in the source; n, k: 1.
    Error    that of the measurement: about 0.02 in n for metals. Linear interpolation between the rows of the table
             adds at most 1e-5 for H2O, MgF2, SiO2; formulas of files are exact.
    Source   per substance, see `materials`; database: Polyanskiy 2024, doi:10.1038/s41597-023-02898-2.

    Raises NotFoundError for a name that is no substance, ParameterError outside the range of the table, FormatError for
    a file that is damaged.

    Example
    >>> n, k = gn.spectra.refractive_index("gold", [450.0, 550.0, 650.0])
    >>> print(n.round(3), k.round(3))
    [1.383 0.424 0.156] [1.916 2.472 3.602]
    """
    spectra = _spectra_of(substance)
    if wavelengths is None:
        return spectra
    try:
        at = np.asarray(ops.numbers(wavelengths), dtype=float)
        missing = np.ma.getmaskarray(wavelengths) if ops.is_masked(wavelengths) else np.zeros(at.shape, bool)
    except ValueError:
        raise ParameterError(f"wavelengths={wavelengths!r:.60}: expected numbers [nm]") from None
    low, high = (reach(x.wavelengths[end] for x in spectra) for reach, end in ((max, 0), (min, -1)))
    outside = ~((at >= low) & (at <= high)) & ~missing
    if outside.any():
        got = at[outside].flat[0]
        micrometres = f"; in micrometres? 1000 * {got:g} is in nm" if low <= 1000.0 * got <= high else ""
        raise ParameterError(
            f"{substance} at {got:g} nm: outside the table, which holds {low:g} to {high:g} nm; nothing is "
            f"extrapolated{micrometres}"
        )
    n, k = (np.where(missing, math.nan, x.at(np.where(missing, low, at))) for x in spectra)
    return (n, k) if at.ndim else (float(n), float(k))


def _spectra_of(substance: str | Path) -> Spectra:
    if isinstance(substance, Path) or substance.endswith(SUFFIXES):
        return read(substance)
    entry = find(substance)
    if entry is None or entry.kind == FIT:
        substances = ", ".join(f"{e.name} ({_symbol(e)})" for e in materials() if e.kind != FIT)
        raise NotFoundError(
            f"no refractive index of {substance!r}; expected one of {substances}, or the path of a .yml file"
        )
    nm, n, k = _indices()[_symbol(entry)].T
    return Spectra(Spectrum(nm, n), Spectrum(nm, k))


def _polished(entry: Entry, alpha: Any, wavelengths: Any) -> Reflectance:
    n, k = _rgb_index(entry) if wavelengths is None else refractive_index(entry.name, wavelengths)
    if np.ndim(n) > 1 or np.size(n) == 0:
        raise ParameterError(f"wavelengths: got shape {np.shape(n)}, expected a number or a list of numbers [nm]")
    fresnel = Conductor(n, k) if np.any(np.asarray(k) > TRANSPARENT) else Dielectric(n)
    mirror = isinstance(alpha, (int, float)) and alpha == 0
    m: Reflectance = IdealSpecular(fresnel) if mirror else Microfacet(GGX(alpha), fresnel)
    if wavelengths is not None and np.ndim(n):
        m = tree.with_notes(m, channel_names=tuple(float(w) for w in wavelengths))
    return tree.with_notes(m, _numbers_from=entry.source)


@cache
def _rgb_index(entry: Entry) -> tuple[Any, Any]:
    """n and k of linear RGB, to six decimals: the same on every machine."""
    wavelengths, _ = observer()
    n, k = rgb_index(wavelengths, *refractive_index(entry.name, wavelengths), opaque=entry.kind == METAL)
    return n.round(6), k.round(6)


def _plain(name: str) -> str:
    return str(name).strip().lower().replace("_", "-").replace(" ", "-")


def _symbol(entry: Entry) -> str:
    return entry.aliases[0]


@cache
def _entries() -> tuple[Entry, ...]:
    entries = []
    for symbol, (kind, (name, *aliases), source) in _SUBSTANCES.items():
        description = f"{symbol}, by {'complex ' if kind == METAL else ''}refractive index"
        entries.append(Entry(name, kind, description, source + _DATABASE, (symbol, *aliases)))
    entries.sort(key=lambda e: (e.kind != METAL, e.name))
    pure = {e.name.removeprefix("pure-"): e.name for e in entries if e.name.startswith("pure-")}
    for name in _fits():
        description = next(family for word, family in _FAMILIES.items() if word in name)
        if name in pure:
            description += f"; as an ideal metal: {pure[name]}"
        respelled = (_FIT_ALIASES[name],) if name in _FIT_ALIASES else ()
        entries.append(Entry(name, FIT, description, _FIT_SOURCE, respelled))
    return tuple(entries)


@cache
def _by_name() -> dict[str, Entry]:
    return {_plain(name): e for e in _entries() for name in (e.name, *e.aliases)}


def _rows(file: str) -> list[list[str]]:
    """The rows of a table of the package, split at tabs, without comments and header."""
    text = (resources.files("gonio") / "data" / file).read_text(encoding="utf-8")
    return [line.split("\t") for line in text.splitlines() if line and not line.startswith("#")][1:]


@cache
def _fits() -> dict[str, list[float]]:
    """Name -> rho (3), A (3), B, C, eta."""
    return {name: [float(x) for x in numbers] for name, *numbers in _rows("merl_abc.tsv")}


@cache
def _indices() -> dict[str, np.ndarray]:
    """Symbol -> rows (wavelength [nm], n, k)."""
    rows_of: dict[str, list[list[float]]] = {}
    for symbol, *numbers in _rows("refractive_index.tsv"):
        rows_of.setdefault(symbol, []).append([float(x) for x in numbers])
    return {symbol: np.array(rows) for symbol, rows in rows_of.items()}
