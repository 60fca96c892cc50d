"""Materials of MaterialX 1.39, as text of its documents, of reflectances that it defines exactly.

Its nodes of microfacets are not among them: they leave the masking to the renderer, and MaterialX's own shaders give
anisotropic facets one width there and add light that is scattered twice.
"""

from __future__ import annotations

from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from ..base.reflectance import Reflectance
from ..declared.arguments import checked
from ..errors import ParameterError
from ..models.disney_diffuse import DisneyDiffuse
from ..models.eon import EON
from ..models.lambertian import Lambertian
from ..models.open_pbr import OpenPBRGlossyDiffuse, OpenPBRMetal
from ..models.oren_nayar import QualitativeOrenNayar
from ._terms import number, refusal, require_plain, terms, texts

HOLDS = (
    "Lambertian, QualitativeOrenNayar, EON, DisneyDiffuse, weighted sums of these, and, as an open_pbr_surface, "
    "OpenPBRMetal or OpenPBRGlossyDiffuse"
)
INSTEAD = (
    "MaterialX has no nodes for measurements, and its conductor_bsdf, dielectric_bsdf and generalized_schlick_bsdf add "
    "what facets scatter twice; Mitsuba, pbrt and Radiance take files of gn.save"
)


@checked
def text(m: Reflectance, name: str = "gonio") -> str:
    """A document with one material of this name.

    `open_pbr_surface` has the parameters that the specification of OpenPBR gives it: renderers differ in how they
    approximate what it says. The diffuse nodes are formulas.

    Error    f of the diffuse nodes: rounding; checked against the GLSL that MaterialX 1.39.5 ships, and every document
             by its validator.
    Raises   ParameterError for anything else, with the list of what MaterialX defines.

    Example
    >>> from gonio.bridges import materialx
    >>> print(materialx.text(gn.QualitativeOrenNayar(0.5, sigma=0.3), "clay"))
    <?xml version="1.0"?>
    <materialx version="1.39">
      <oren_nayar_diffuse_bsdf name="clay_0" type="BSDF">
        <input name="color" type="color3" value="0.5, 0.5, 0.5" />
        <input name="roughness" type="float" value="0.3" />
      </oren_nayar_diffuse_bsdf>
      <surface name="clay_surface" type="surfaceshader">
        <input name="bsdf" type="BSDF" nodename="clay_0" />
      </surface>
      <surfacematerial name="clay" type="material">
        <input name="surfaceshader" type="surfaceshader" nodename="clay_surface" />
      </surfacematerial>
    </materialx>
    <BLANKLINE>
    """
    require_plain(m, "MaterialX")
    if m.wavelengths is not None:
        raise ParameterError(f"{m!r:.60}: wavelengths; expected RGB, in which MaterialX computes")
    if not name.isidentifier() or not name.isascii():
        raise ParameterError(f"materialx.text(name={name!r:.60}): expected letters, digits and underscores")
    parts = terms(m)
    surface = f"{name}_surface"
    lines = _open_pbr(surface, m) if len(parts) == 1 and np.all(np.asarray(parts[0][0]) == 1.0) else None
    if lines is None:
        lines = [line for i, part in enumerate(parts) for line in _scattering(m, f"{name}_{i}", *part)]
        total = f"{name}_0"
        for i in range(1, len(parts)):
            inputs = {"in1": ("BSDF", total), "in2": ("BSDF", f"{name}_{i}")}
            total = f"{name}_sum{i}"
            lines += _node("add", total, "BSDF", inputs)
        lines += _node("surface", surface, "surfaceshader", {"bsdf": ("BSDF", total)})
    lines += _node("surfacematerial", name, "material", {"surfaceshader": ("surfaceshader", surface)})
    inner = "".join(f"  {line}\n" for line in lines)
    return f'<?xml version="1.0"?>\n<materialx version="1.39">\n{inner}</materialx>\n'


def _scattering(whole: Reflectance, name: str, weight: Any, m: Reflectance) -> list[str]:
    """The node of a term; its colour carries the weight, where f is in proportion to it."""
    kind, roughness = "oren_nayar_diffuse_bsdf", 0.0
    more: dict[str, Any] = {}
    match m:
        case Lambertian():
            pass
        case QualitativeOrenNayar():
            roughness = number(m, "sigma", m.sigma)
        case EON() if np.all(np.asarray(weight) == 1.0):
            roughness, more = number(m, "r", m.r), {"energy_compensation": True}
        case DisneyDiffuse():
            kind, roughness = "burley_diffuse_bsdf", number(m, "roughness", m.roughness)
        case _:
            raise refusal(whole, "MaterialX", HOLDS, INSTEAD)
    color = np.atleast_1d(weight * np.asarray(m.rho))
    return _node(kind, name, "BSDF", {"color": color, "roughness": roughness, **more})


def _open_pbr(name: str, m: Reflectance) -> list[str] | None:
    """The surface shader of OpenPBR's slabs; None for any other reflectance."""
    shared = {"base_weight": 1.0, "base_diffuse_roughness": 0.0}
    numbers, colours = ["specular_weight", "specular_roughness"], ["base_color"]
    match m:
        case OpenPBRMetal():
            numbers.append("specular_roughness_anisotropy")
            colours.append("specular_color")
        case OpenPBRGlossyDiffuse():
            numbers.append("specular_ior")
        case _:
            return None
    shared["base_metalness"] = 1.0 if isinstance(m, OpenPBRMetal) else 0.0
    inputs: dict[str, Any] = {key: np.atleast_1d(getattr(m, key)) for key in colours}
    inputs |= {key: number(m, key, getattr(m, key)) for key in numbers}
    return _node("open_pbr_surface", name, "surfaceshader", inputs | shared)


def _node(kind: str, name: str, result: str, inputs: dict[str, Any]) -> list[str]:
    """A node; inputs are numbers, colours (arrays), truth values, or pairs of a type and the name of a node."""
    rows = []
    for key, value in inputs.items():
        match value:
            case (of, node):
                how = f'type="{of}" nodename={quoteattr(node)}'
            case bool():
                how = f'type="boolean" value="{str(value).lower()}"'
            case float():
                how = f'type="float" value="{texts(value)[0]}"'
            case _:
                how = f'type="color3" value="{", ".join(texts(np.broadcast_to(value, 3)))}"'
        rows.append(f'  <input name="{key}" {how} />')
    return [f'<{kind} name="{name}" type="{result}">', *rows, f"</{kind}>"]
