"""Materials of pbrt-v4, as lines of its scene files, of reflectances that it holds exactly.

Everything else goes there as a measurement: gn.save(m, "m.bsdf", format="rgl") writes a file for its "measured".
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.reflectance import Reflectance
from ..base.sides import refuse_transmission
from ..declared.arguments import checked
from ..distributions.ggx import GGX
from ..errors import ParameterError
from ..formula.fresnel.conductor import Conductor
from ..models.ideal_specular import IdealSpecular
from ..models.lambertian import Lambertian
from ..models.microfacet import Microfacet
from ..models.smooth_dielectric import SmoothDielectric
from ._terms import most, number, refusal, require_plain, terms, texts

HOLDS = (
    "Lambertian; IdealSpecular of a Conductor; Microfacet of GGX facets (alpha from 1e-3), a Conductor and the masking "
    '"height_correlated"; SmoothDielectric; sums of two that reflect, of which one is '
    "Lambertian or whose weights add up to 1"
)
INSTEAD = 'gn.save(m, "m.bsdf", format="rgl") writes a file for its "measured"'
FIRST, LAST = 360, 830
"""The wavelengths [nm] that pbrt traces; spectra are 0 beyond their own."""


@checked
def text(m: Reflectance, name: str = "gonio") -> str:
    """The lines of a scene file that define a material and name it, to be used by `NamedMaterial "name"`.

    Alphas go over as they are (`remaproughness` is off). Indices are numbers or spectra, for pbrt has no index in RGB:
    `gn.material("gold", wavelengths=...)`. An RGB reflectance becomes a smooth spectrum there, of the same colour.
    A Lambertian surface of pbrt has two sides; a mix chooses one of its two materials at each hit.

    Error    f: rounding; checked against the formulas of "Physically Based Rendering", 4th edition, chapter 9, for
             pbrt itself cannot be installed with pip.
    Raises   ParameterError for anything else, with the list of what pbrt holds.

    Example
    >>> from gonio.bridges import pbrt
    >>> print(pbrt.text(gn.Lambertian([0.6, 0.1, 0.05]), "red"))
    MakeNamedMaterial "red" "string type" [ "diffuse" ] "rgb reflectance" [ 0.6 0.1 0.05 ]
    <BLANKLINE>
    """
    require_plain(m, "pbrt")
    if '"' in name or not name.isprintable():
        raise ParameterError(f"pbrt.text(name={name!r:.60}): expected a name without quotation marks and line breaks")
    parts = terms(m)
    if len(parts) == 1:
        return _line(name, *_material(m, *parts[0]))
    if len(parts) != 2:
        raise refusal(m, "pbrt", HOLDS, INSTEAD)
    for _, part in parts:
        refuse_transmission(part, str(refusal(m, "pbrt", HOLDS, INSTEAD)))
    amount = _amount(m, parts)
    shares = (1.0 - amount, amount)
    lines = [
        _line(f"{name}-{i}", *_material(m, weight / share, part))
        for i, ((weight, part), share) in enumerate(zip(parts, shares, strict=True))
    ]
    both = f'"string materials" [ "{name}-0" "{name}-1" ]'
    return "".join(lines) + _line(name, "mix", both, f'"float amount" [ {texts(amount)[0]} ]')


def _amount(m: Reflectance, parts: list[tuple[Any, Reflectance]]) -> float:
    """The probability of the second material: a Lambertian one takes what is left; its albedo can make up for it."""
    weights = [number(m, "weight", weight) if not isinstance(part, Lambertian) else None for weight, part in parts]
    if weights == [None, None]:
        return 0.5
    amount = weights[1] if weights[1] is not None else 1.0 - float(weights[0] or 0.0)
    if not 0.0 < amount < 1.0:
        raise refusal(m, "pbrt", HOLDS, INSTEAD)
    return amount


def _material(whole: Reflectance, weight: Any, m: Reflectance) -> tuple[str, ...]:
    """The type of a material times a weight, and its parameters."""
    if isinstance(m, Lambertian):
        albedo = np.asarray(weight) * m.rho
        if most(albedo) > 1.0 + 1e-6:
            raise refusal(whole, "pbrt", f"{HOLDS}, whose albedo over its share of the mix is at most 1", INSTEAD)
        return "diffuse", _spectrum(whole, "reflectance", np.minimum(albedo, 1.0))
    if abs(number(whole, "weight", weight) - 1.0) < 1e-6:
        match m:
            case IdealSpecular(reflectance=Conductor() as F):
                return "conductor", *_index(whole, F), '"float roughness" [ 0 ]'
            case Microfacet(distribution=GGX() as D, fresnel=Conductor() as F, masking="height_correlated"):
                u, v = (texts(number(whole, "alpha", x))[0] for x in (D.alpha_x, D.alpha_y))
                alphas = f'"float uroughness" [ {u} ] "float vroughness" [ {v} ] "bool remaproughness" [ false ]'
                return "conductor", *_index(whole, F), alphas
            case SmoothDielectric():
                return "dielectric", f'"float eta" [ {texts(number(whole, "eta", m.eta))[0]} ] "float roughness" [ 0 ]'
    raise refusal(whole, "pbrt", HOLDS, INSTEAD)


def _index(m: Reflectance, F: Conductor) -> tuple[str, str]:
    if m.wavelengths is None and max(np.size(F.eta), np.size(F.k)) > 1:
        raise ParameterError(
            f"{m!r:.60}: an index in RGB, which pbrt has not; expected one number, or a spectrum: "
            f'gn.material("gold", alpha=0.1, wavelengths=np.arange(360.0, 831.0, 10.0))'
        )
    return _spectrum(m, "eta", F.eta), _spectrum(m, "k", F.k)


def _spectrum(m: Reflectance, name: str, value: Any) -> str:
    values = texts(value)
    if len(values) == 1:
        return f'"spectrum {name}" [ {FIRST} {values[0]} {LAST} {values[0]} ]'
    if m.wavelengths is None:
        return f'"rgb {name}" [ {" ".join(values)} ]'
    nodes = [(float(nm), x) for nm, x in zip(m.wavelengths, values, strict=True)]
    before = [(FIRST, nodes[0][1])] if nodes[0][0] > FIRST else []
    after = [(LAST, nodes[-1][1])] if nodes[-1][0] < LAST else []
    return f'"spectrum {name}" [ {" ".join(f"{nm:g} {x}" for nm, x in [*before, *nodes, *after])} ]'


def _line(name: str, kind: str, *parameters: str) -> str:
    return " ".join([f'MakeNamedMaterial "{name}" "string type" [ "{kind}" ]', *parameters]) + "\n"
