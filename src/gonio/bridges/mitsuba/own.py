"""The XML of Mitsuba's own plugins, of materials that they hold exactly."""

from __future__ import annotations

from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from ...base.reflectance import Reflectance
from ...base.sides import refuse_transmission
from ...distributions.beckmann import Beckmann
from ...distributions.ggx import GGX
from ...formula.fresnel.conductor import Conductor
from ...formula.fresnel.constant import Constant
from ...models.disney_principled import DisneyPrincipled
from ...models.ideal_specular import IdealSpecular
from ...models.lambertian import Lambertian
from ...models.microfacet import Microfacet
from ...models.rough_dielectric import RoughDielectric
from ...models.smooth_dielectric import SmoothDielectric
from .._terms import most, number, refusal, require_plain, terms, texts

HOLDS = (
    "Lambertian; IdealSpecular of a Conductor or a constant; Microfacet of GGX or Beckmann facets, a Conductor or a "
    'constant, masking "separable"; RoughDielectric of such facets; SmoothDielectric; '
    'DisneyPrincipled(metallic=1, clearcoat=0, masking="anisotropic"); weighted sums of two of these that reflect'
)
INSTEAD = 'gn.save(m, "m.bsdf", format="rgl") writes a file for its `measured`, and register() makes it know any'


def xml(m: Reflectance, name: str) -> str:
    """The BSDF as XML."""
    require_plain(m, "Mitsuba")
    lines = _summed(m, terms(m))
    lines[0] = lines[0].replace("<bsdf ", f'<bsdf version="3.0.0" id={quoteattr(name)} ', 1)
    return "\n".join(lines) + "\n"


def _summed(m: Reflectance, parts: list[tuple[Any, Reflectance]]) -> list[str]:
    if len(parts) == 1:
        return _plugin(m, *parts[0])
    if len(parts) != 2:
        raise refusal(m, "Mitsuba", HOLDS, INSTEAD)
    for _, part in parts:
        refuse_transmission(part, str(refusal(m, "Mitsuba", HOLDS, INSTEAD)))
    # (1 - w) times the first and w times the second: each then has its factor over its share.
    factors = [most(weight) * _factor(part) for weight, part in parts]
    if sum(factors) > 1.0 + 1e-6:
        raise refusal(m, "Mitsuba", f"{HOLDS}, whose largest factors add up to at most 1", INSTEAD)
    w = factors[1] / sum(factors) if sum(factors) > 0.0 else 0.5
    shares = [1.0 - w, w]
    inner = [_plugin(m, weight / max(share, 1e-30), part) for (weight, part), share in zip(parts, shares, strict=True)]
    return (
        ['<bsdf type="blendbsdf">', f'    <float name="weight" value="{texts(w)[0]}"/>']
        + [f"    {line}" for lines in inner for line in lines]
        + ["</bsdf>"]
    )


def _factor(m: Reflectance) -> float:
    """The largest number that f of a term is in proportion to: the plugin takes it times its weight, up to 1."""
    match m:
        case Lambertian():
            return most(m.rho)
        case IdealSpecular(reflectance=Constant() as F) | Microfacet(fresnel=Constant() as F):
            return most(F.reflectance)
    return 1.0


def _plugin(whole: Reflectance, weight: Any, m: Reflectance) -> list[str]:
    """The plugin of one term times a weight."""

    def colour(name: str, value: Any) -> str:
        return _colour(whole, name, value)

    match m:
        case Lambertian():
            return _bsdf("diffuse", colour("reflectance", np.asarray(weight) * m.rho))
        case IdealSpecular(reflectance=Conductor() as F):
            return _bsdf("conductor", *_index(whole, F), colour("specular_reflectance", weight))
        case IdealSpecular(reflectance=Constant() as F):
            return _bsdf("conductor", _NONE, colour("specular_reflectance", np.asarray(weight) * F.reflectance))
        case Microfacet(distribution=GGX() | Beckmann() as D, masking="separable", fresnel=Conductor() as F):
            return _bsdf("roughconductor", *_facets(m, D), *_index(whole, F), colour("specular_reflectance", weight))
        case Microfacet(distribution=GGX() | Beckmann() as D, masking="separable", fresnel=Constant() as F):
            factor = colour("specular_reflectance", np.asarray(weight) * F.reflectance)
            return _bsdf("roughconductor", *_facets(m, D), _NONE, factor)
        case DisneyPrincipled(masking="anisotropic") if _metallic(m):
            names = ("roughness", "anisotropic")
            numbers = [_float(name, number(m, name, getattr(m, name))) for name in names]
            if most(weight) == 1.0 == float(np.min(weight)):
                return _bsdf("principled", colour("base_color", m.base_color), _float("metallic", 1.0), *numbers)
    if float(np.min(weight)) == 1.0 == most(weight):
        match m:
            case RoughDielectric(distribution=GGX() | Beckmann() as D):
                return _bsdf("roughdielectric", *_facets(m, D), *_glass(m))
            case SmoothDielectric():
                return _bsdf("dielectric", *_glass(m))
    raise refusal(whole, "Mitsuba", HOLDS, INSTEAD)


_NONE = '<string name="material" value="none"/>'


def _metallic(m: DisneyPrincipled) -> bool:
    return float(np.min(m.metallic)) == 1.0 and most(m.clearcoat) == 0.0


def _bsdf(kind: str, *inner: str) -> list[str]:
    return [f'<bsdf type="{kind}">', *(f"    {line}" for line in inner), "</bsdf>"]


def _float(name: str, value: float) -> str:
    return f'<float name="{name}" value="{texts(value)[0]}"/>'


def _facets(m: Reflectance, D: GGX | Beckmann) -> list[str]:
    kind = "ggx" if isinstance(D, GGX) else "beckmann"
    alphas = [_float(name, number(m, name, x)) for name, x in (("alpha_u", D.alpha_x), ("alpha_v", D.alpha_y))]
    return [f'<string name="distribution" value="{kind}"/>', *alphas]


def _glass(m: Any) -> list[str]:
    return [_float("int_ior", number(m, "eta", m.eta)), _float("ext_ior", 1.0)]


def _index(whole: Reflectance, F: Conductor) -> list[str]:
    return [_colour(whole, "eta", F.eta), _colour(whole, "k", F.k)]


def _colour(m: Reflectance, name: str, value: Any) -> str:
    """A number, a colour, or a spectrum at the wavelengths of the material."""
    values = texts(value)
    if len(values) == 1:
        return f'<spectrum name="{name}" value="{values[0]}"/>'
    if m.wavelengths is None:
        return f'<rgb name="{name}" value="{", ".join(values)}"/>'
    pairs = ", ".join(f"{nm:g}:{x}" for nm, x in zip(m.wavelengths, values, strict=True))
    return f'<spectrum name="{name}" value="{pairs}"/>'
