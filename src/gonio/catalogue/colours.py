"""Colours of spectra, and spectra of colours and of lights: by colour-science, where gonio's own tables do not do."""

from __future__ import annotations

import re
import warnings
from functools import cache
from typing import Any

import numpy as np

from ..arrays import ops
from ..base.measured import Measured
from ..base.reflectance import Reflectance
from ..base.textured import require_numbers
from ..declared.arguments import checked
from ..errors import NotFoundError, ParameterError, ShapeError, needed, shown, suggestion
from ..formula import tree
from ..formula.blackbody import Blackbody
from ..formula.fields import Param, Part
from ..formula.parametrised import Parametrised
from ..formula.spectrum import Spectrum, as_wavelengths
from ..pictures.colour import LONGEST, RGB_OF_XYZ, SHORTEST, WHITE, matrix_of, observer, transformed

OBSERVERS = {
    "1931": "CIE 1931 2 Degree Standard Observer",
    "1964": "CIE 1964 10 Degree Standard Observer",
    "2015": "CIE 2015 2 Degree Standard Observer",
    "2015-10": "CIE 2015 10 Degree Standard Observer",
}


def library() -> Any:
    """colour-science, imported when it is first needed. Raises DependencyError where it is not installed."""
    with warnings.catch_warnings(), np.printoptions():  # it warns of what it lacks, and changes how arrays are printed
        warnings.simplefilter("ignore")  # of what it lacks itself
        with needed("this needs colour-science", "pip install 'gonio[spectra]'"):
            import colour
    return colour


@checked
def illuminant(name: str) -> Spectrum:
    """The relative power of a standard light by wavelength: 100 at 560 nm, or as its table has it.

    "A", "B", "C", "E", "D50" to "D75", "FL1" to "FL12" and "FL3.1" to "FL3.15" (fluorescent lamps), "HP1" to "HP5",
    "LED-B1" and others, "ID65"; "D5600" is daylight of 5600 K, for 4000 to 25000 K. Needs colour-science.

    Shapes   every 1 or 5 nm, from 300 or 380 to 780 nm, with straight lines in between.
    Units    wavelengths: nm; power: relative.
    Error    that of the CIE's tables.
    Source   CIE 015:2018, tables of colour-science.

    Raises NotFoundError for another name, DependencyError without colour-science.

    Example
    >>> tungsten = gn.spectra.illuminant("A")
    >>> print(tungsten.at([450.0, 560.0, 650.0]).round(1))
    [ 33.1 100.  165. ]
    """
    colour = library()
    tables = colour.SDS_ILLUMINANTS
    word = name.strip().upper()
    word = f"FL{word[1:]}" if re.fullmatch(r"F\d[\d.]*", word) else word
    daylight = re.fullmatch(r"D(\d{4,5})K?", word)
    if daylight and 4000 <= int(daylight[1]) <= 25000:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the same, where it looks for a table
            table = colour.sd_CIE_illuminant_D_series(colour.temperature.CCT_to_xy_CIE_D(int(daylight[1])))
    else:
        by_word = {key.upper(): key for key in tables}
        if word not in by_word:
            known = [key for key in tables if not key.startswith("ISO")]
            raise NotFoundError(f"no illuminant {shown(name)}{suggestion(name, known)}; known: {', '.join(known)}")
        table = tables[by_word[word]]
    return Spectrum(table.wavelengths, table.values)


@checked
def blackbody(temperature: float) -> Blackbody:
    r"""The spectral radiance of a black body, $L = (2hc^2/\lambda^5) / (e^{hc/(\lambda kT)} - 1)$, at every wavelength.

    Shapes   `wavelengths`, of plots and means over bands: 10 nm to 1 mm, each nanometre from 300 to 830 nm among them.
    Units    temperature: K; wavelengths: nm; radiance: W m-2 sr-1 nm-1.
    Error    rounding. Means over bands have straight lines between `wavelengths`: 2e-5 of the value at most where it is
             above 1e-3 of its maximum.
    Source   Planck's law; h, c, k of the SI.

    Example
    >>> sun, candle = gn.spectra.blackbody(5772.0), gn.spectra.blackbody(1900.0)
    >>> print(sun.at(500.0).round(), (candle.at(650.0) / candle.at(450.0)).round(1))
    26239.0 28.2
    >>> print((1e3 * gn.spectra.blackbody(300.0).at(10000.0)).round(3))  # W m-2 sr-1 um-1
    9.924
    """
    return Blackbody(temperature)


@cache
def _matching(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths, and the colour-matching functions of an observer (N, 3)."""
    table = library().MSDS_CMFS[OBSERVERS[name]]
    return table.wavelengths, table.values


def _weights(wavelengths: Any, light: Any, by: str) -> np.ndarray:
    """Matrix (C, 3) that turns reflectance at wavelengths into X, Y, Z under a light; white has Y = 1."""
    if light is None and by == "1931":
        return matrix_of(wavelengths, *observer())
    power = light if isinstance(light, Spectrum) else illuminant("D65" if light is None else light)
    nm, matching = _matching(by)
    low, high = power.wavelengths[[0, -1]]
    if low > 420.0 or high < 680.0:
        raise ParameterError(f"illuminant: a spectrum of {low:g} to {high:g} nm; expected the visible, 420 to 680 nm")
    inside = (nm >= low) & (nm <= high)
    weighted = matching[inside] * power.at(nm[inside])[:, None]
    brightness = np.trapezoid(weighted[:, 1], nm[inside])
    if not brightness > 0.0:
        raise ParameterError("illuminant: no light in the visible; expected a spectrum above 0 there")
    return matrix_of(wavelengths, nm[inside], weighted / brightness)


@checked
def to_colour(
    values: Any,
    wavelengths: Any,
    illuminant: str | Spectrum | None = None,
    space: str = "sRGB",
    observer: str = "1931",
    adaptation: str | None = "Bradford",
) -> np.ndarray:
    """The colour of reflectances by wavelength, under a light.

    illuminant   a name that `gonio.spectra.illuminant` knows, or a spectrum; by default daylight, D65. For the colour
                 of light itself take its spectrum for `values`, and "E", of equal power
    space        "sRGB", or another RGB space of colour-science, linear (not encoded); "XYZ", white having Y = 1; "Lab"
    observer     "1931" (2 degrees), "1964" (10 degrees), "2015", "2015-10"
    adaptation   how an eye gets used to the light, by which white paper stays white: "Bradford", "CAT02", "CAT16", "Von
                 Kries" ...; None for an eye that stays used to the space's own white. For "XYZ" and "Lab" there is none

    Reflectance goes in straight lines from wavelength to wavelength, and keeps its value beyond the outermost ones. All
    but the defaults and "XYZ" under D65 needs colour-science.

    Shapes   values: (..., C); wavelengths: (C,), C > 1; result (..., 3).
    Units    wavelengths: nm; values: 1.
    Error    rounding, of the integral over straight lines; against colour-science's sums at 5 nm, for the metals of
             `materials`, a difference of 0.017 (CIEDE2000).
    Source   CIE 015:2018; ASTM E308.

    Raises ParameterError for wavelengths wholly outside the visible, 380 to 780 nm.

    Example
    >>> nm = np.arange(380.0, 781.0, 5.0)
    >>> R = gn.material("copper", alpha=0, wavelengths=nm).delta_reflectance([0, 0, 1])
    >>> print(gn.colour.to_colour(R, nm).round(3), gn.colour.to_colour(R, nm, "A").round(3))
    [0.932 0.623 0.522] [1.003 0.629 0.525]
    """
    nm = as_wavelengths(f"to_colour(wavelengths={shown(wavelengths)})", wavelengths)
    try:
        R = np.asarray(ops.numbers(values), dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(f"to_colour(values={shown(values)}): expected numbers (..., C)") from None
    if np.ndim(nm) == 0 or len(nm) < 2 or R.shape[-1:] != nm.shape:
        got = f"got shapes {R.shape} and {np.shape(nm)}"
        raise ShapeError(f"to_colour: {got}; expected values (..., C) at C wavelengths, two at least")
    if nm.max() < SHORTEST or nm.min() > LONGEST:
        reach = f"{nm.min():g} to {nm.max():g} nm"
        raise ParameterError(f"to_colour: {reach} is wholly outside the visible, {SHORTEST:g} to {LONGEST:g} nm")
    if observer not in OBSERVERS:
        raise ParameterError(f"to_colour(observer={shown(observer)}): expected one of {', '.join(OBSERVERS)}")
    weights = _weights(nm, illuminant, observer)
    white = weights.sum(axis=0)
    if space == "XYZ":
        return transformed(R, weights)
    if space == "sRGB" and illuminant is None and observer == "1931":
        return transformed(R, weights @ RGB_OF_XYZ.T)
    colour = library()
    if space == "Lab":
        return np.asarray(colour.XYZ_to_Lab(transformed(R, weights), colour.XYZ_to_xy(white)))
    if space not in colour.RGB_COLOURSPACES:
        known = list(colour.RGB_COLOURSPACES)
        raise NotFoundError(f"no RGB space {shown(space)}{suggestion(space, known)}; or XYZ, Lab")
    target = colour.RGB_COLOURSPACES[space]
    own = WHITE if space == "sRGB" else colour.xy_to_XYZ(target.whitepoint)
    to_rgb = RGB_OF_XYZ if space == "sRGB" else target.matrix_XYZ_to_RGB
    if adaptation is not None:
        if adaptation not in colour.CHROMATIC_ADAPTATION_TRANSFORMS:
            known = list(colour.CHROMATIC_ADAPTATION_TRANSFORMS)
            raise NotFoundError(f"no adaptation {shown(adaptation)}{suggestion(adaptation, known)}; or None")
        adapted = colour.adaptation.matrix_chromatic_adaptation_VonKries(white, own, transform=adaptation)
        to_rgb = to_rgb @ adapted
    return transformed(R, weights @ to_rgb.T)


@checked
def colour_difference(a: Any, b: Any, space: str = "sRGB") -> Any:
    """The difference of two colours as eyes see it, CIEDE2000: 1 is about the least that is noticed.

    Shapes   a, b: (..., 3), broadcast against each other; result (...).
    Units    a, b: linear sRGB, XYZ with a white of Y = 1 under D65, or Lab, as `space` says.
    Source   CIE 142-2001, by colour-science, which this needs.

    Example
    >>> print(gn.colour.colour_difference([0.5, 0.5, 0.5], [0.51, 0.5, 0.5]).round(2))
    0.89
    """
    if space not in ("sRGB", "XYZ", "Lab"):
        raise ParameterError(f"colour_difference(space={shown(space)}): expected sRGB, XYZ or Lab")
    colour, labs = library(), []
    for given in (a, b):
        try:
            c = np.asarray(ops.numbers(given), dtype=float)
        except (TypeError, ValueError):
            raise ParameterError(f"colour_difference({shown(given)}): expected numbers (..., 3)") from None
        if c.shape[-1:] != (3,):
            raise ShapeError(f"colour_difference: got shape {c.shape}, expected (..., 3)")
        if space != "Lab":
            xyz = transformed(c, np.linalg.inv(RGB_OF_XYZ).T) if space == "sRGB" else c
            c = np.asarray(colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(WHITE)))
        labs.append(c)
    difference = np.asarray(colour.delta_E(*np.broadcast_arrays(*labs), method="CIE 2000"))
    return difference[()]


@cache
def basis() -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths, and the spectra (N, 3) of red, green and blue, which add up to 1."""
    table = library().recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019
    return table.wavelengths, table.values / table.values.sum(axis=-1, keepdims=True)


@checked
def upsampled(m: Reflectance) -> Reflectance:
    """A material in linear RGB as one with spectra, which `at` binds to wavelengths: `gn.spectra.upsampled(m).at(nm)`.

    Every number per channel becomes a spectrum: a mean of the three with the weights of a basis, which add up to 1.
    Where f is linear in the numbers (albedos, weights, tables), its colour under daylight (D65) is that of the RGB. A
    table becomes a sum of three.

    Error    in linear RGB, at 380 to 780 nm by 5 nm: 1.2e-3; by 10 nm: 1e-2. Numbers in which f is not linear (widths,
             indices) give colours that differ more.
    Source   Mallett & Yuksel 2019, "Spectral primary decomposition for rendering with sRGB reflectance", EGSR; their
             basis by colour-science, which this needs.

    Raises ParameterError for channels that are no RGB, and for maps.

    Example
    >>> nm = np.arange(380.0, 781.0, 5.0)
    >>> red = gn.spectra.upsampled(gn.Lambertian([0.6, 0.1, 0.05])).at(nm)
    >>> print(gn.colour.to_colour(gn.albedo(red, [0, 0, 1]), nm).round(3))
    [0.6  0.1  0.05]
    """
    if m.channels in (None, 1):
        return m
    require_numbers(m, "upsampled")
    if m.channels != 3 or m.channel_names not in (None, ("R", "G", "B")):
        raise ParameterError(f"upsampled({m!r:.60}): channels {m.channel_names}; expected linear RGB")
    new = tree.with_notes(_upsampled(m), channel_names=None)
    assert isinstance(new, Reflectance)
    return new


def _upsampled(value: Any) -> Any:
    if isinstance(value, Measured):
        return _of_table(value)
    changes: dict[str, Any] = {}
    for name, field in value.fields.items():
        old = value.__dict__[name]
        if name in value._tied:
            continue
        if isinstance(field, Part) and isinstance(old, Parametrised):
            new = _upsampled(old)
        elif isinstance(field, Param) and np.ndim(old) and np.shape(old)[-1] == 3:
            if np.ndim(old) > 1:
                raise ParameterError(f"upsampled: {type(value).__name__}.{name} is a map; expected no maps")
            nm, spectra = basis()
            numbers = np.asarray(ops.numbers(old), dtype=float)
            new = Spectrum(nm, np.clip(spectra @ numbers, numbers.min(), numbers.max()))
        else:
            continue
        if new is not old:
            changes[name] = new
    return value._with_paths([(name, name, x) for name, x in changes.items()]) if changes else value


def _of_table(table: Measured) -> Reflectance:
    """A sum of three tables, each times a spectrum."""
    if table.channels in (None, 1):
        return table
    grid = table.as_grid()
    if grid is None or table.channels != 3:
        raise ParameterError(
            f"upsampled: {table!r:.60} is no grid in RGB; gn.spectra.upsampled(gn.tables.tabulate(m)) of it is"
        )
    nm, spectra = basis()
    u = grid.uncertainty
    terms = [
        Spectrum(nm, weight) * grid.with_table(grid.stored[..., c], None if u is None else u[..., c], channels=None)
        for c, weight in enumerate(spectra.T)
    ]
    total: Reflectance = sum(terms[1:], terms[0])
    return total
