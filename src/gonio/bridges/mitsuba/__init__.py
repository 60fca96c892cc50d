"""Any reflectance as a BSDF of Mitsuba 3: `gonio.bridges.mitsuba.bsdf(m)`, or in a scene's XML after `register()`.

`scene(m, lights)` is what `gn.render` shows, for Mitsuba.

The traced formula is carried out with Mitsuba's own numbers, so that it becomes part of Mitsuba's kernels and can be
differentiated there. `text(m)` is the XML of Mitsuba's own plugin, of materials that one of them holds exactly.
Mitsuba is imported when it is used; docs/mitsuba.md says what goes over.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ...base.calls import disperses
from ...base.light import Light
from ...base.reflectance import Reflectance
from ...base.textured import require_numbers
from ...declared.arguments import checked
from ...errors import ParameterError, needed
from ...lights.environment import EnvironmentLight
from ...scenes.asked import Samples, Size
from ...scenes.camera import View
from ...scenes.scene import Scene

VARIANTS = ("llvm_ad_rgb", "llvm_ad_mono", "llvm_ad_spectral", "cuda_ad_rgb", "cuda_ad_mono", "cuda_ad_spectral")
"""Those that can be used: Dr.Jit compiles the formula. Scalar variants would call Python for every ray; polarized ones
need Mueller matrices in Mitsuba's frames."""


@checked
def bsdf(m: Reflectance) -> Any:
    """A reflectance as an `mi.BSDF` of the variant that is set, for `mi.load_dict({"type": "sphere", "bsdf": ...})`.

    Parameters are those of `m.parameters`, with underscores for dots: `mi.traverse(scene)` finds `distribution.alpha_x`
    as `..._distribution_alpha_x`. One number per parameter, or one per channel; a measurement's holes are black.

    Error    that of float32; values agree with `m.f` within 2e-5, but for the last digits of narrow lobes.
    Raises   DependencyError without Mitsuba; ParameterError for variants that cannot be used (`VARIANTS` can), maps,
             fluorescence, and glass whose channels refract to different directions; TraceError for formulas that
             cannot be traced.

    Example
    >>> import gonio.bridges.mitsuba
    >>> import mitsuba as mi
    >>> mi.set_variant("llvm_ad_rgb")
    >>> gold = gonio.bridges.mitsuba.bsdf(gn.Microfacet(gn.GGX(0.2), 0.9))
    >>> print(*mi.traverse(gold).keys())
    distribution_alpha_x fresnel_reflectance
    """
    mi = _mitsuba()
    _require_ordinary(m)
    from .plugin import kind

    return kind(mi.variant())(mi.Properties("gonio"), m)


@checked
def scene(
    m: Reflectance | Scene,
    lights: Light | Iterable[Light] | None = None,
    shape: Any = "sphere",
    size: Size = 512,
    samples: Samples = 32,
    camera: View | None = None,
    ground: Reflectance | None = None,
) -> dict[str, Any]:
    """What `gn.render` shows, with the same arguments, as a dictionary: `mi.render(mi.load_dict(scene(m, lights)))`.

    Its integrator is Mitsuba's `direct`, which gives the picture of `gn.render`. `found["integrator"] = {"type":
    "path"}` has light go on from one part to another. Parts with `exitance` are emitters there, and are seen; then all
    lights are, as `hide_emitters` holds for all. The ground is a square, 10^4 times as large as what stands on it.
    Lamps are bodies there, which stand before other lights. Pixels are those of `gn.render` times its alpha.

    Error    the noise of both, and Mitsuba's single precision: means of pictures agree within 0.2 %.
    Raises   as `bsdf`; ParameterError for lights and cameras that Mitsuba has no equal of, with the list of those that
             it has, and for anisotropic materials on disks, cylinders and meshes without uv, whose tangents are other
             ones there.

    Example
    >>> import gonio.bridges.mitsuba
    >>> import mitsuba as mi
    >>> mi.set_variant("llvm_ad_rgb")
    >>> found = gonio.bridges.mitsuba.scene(gn.material("gold"), gn.ConstantLight(1.0), size=16, samples=4)
    >>> print(found["shape"]["type"], found["light_0"]["type"], mi.render(mi.load_dict(found)).shape)
    sphere constant (16, 16, 3)
    """
    mi = _mitsuba()
    from ...integrals.illumination import as_lights
    from ...scenes.rendering import default_light
    from .scenes import SceneWriter, dictionary

    if isinstance(m, Scene):
        if shape != "sphere":
            raise ParameterError(f"mitsuba.scene: a scene, and shape={shape!r:.60}; expected the scene alone")
        material, shape = None, m
    else:
        material = m
    if lights is None:
        lights = EnvironmentLight.studio() if material is None else default_light(material)
    return dictionary(SceneWriter(mi, bsdf), material, shape, as_lights(lights), camera, ground, size, samples)


@checked
def register(name: str = "gonio") -> None:
    """Make scenes of the variant that is set know materials of gonio: <bsdf type="gonio"> with a string `material`.

    The string is what the command line takes: the name of a built-in material, a file, or an expression.

    Example
    >>> import gonio.bridges.mitsuba
    >>> import mitsuba as mi
    >>> mi.set_variant("llvm_ad_rgb")
    >>> gonio.bridges.mitsuba.register()
    >>> paint = mi.load_dict({"type": "gonio", "material": "gold-metallic-paint"})
    """
    mi = _mitsuba()
    mi.register_bsdf(name, _from_scene)


def _from_scene(props: Any) -> Any:
    from ...catalogue.typed import as_typed
    from .plugin import kind

    if "material" not in props:
        raise ParameterError(
            'a bsdf of type "gonio" without material; expected <string name="material" value="gold"/>: the name of a '
            "built-in material, a file, or an expression"
        )
    m = as_typed(str(props["material"]))
    mi = _mitsuba()
    _require_ordinary(m)
    return kind(mi.variant())(props, m)


@checked
def text(m: Reflectance, name: str = "gonio") -> str:
    """The XML of a BSDF with this id that needs no gonio: of Mitsuba's own plugins, for what they hold exactly.

    Channels in RGB are meant for RGB variants, wavelengths for spectral ones.

    Error    f: 2e-6; of Beckmann facets 0.6 %, mean 0.04 %, for Mitsuba approximates their masking.
    Raises   ParameterError for anything else, with the list of what Mitsuba's plugins hold.

    Example
    >>> import gonio.bridges.mitsuba
    >>> print(gonio.bridges.mitsuba.text(gn.Lambertian([0.5, 0.25, 0.125]), "paint"))
    <bsdf version="3.0.0" id="paint" type="diffuse">
        <rgb name="reflectance" value="0.5, 0.25, 0.125"/>
    </bsdf>
    <BLANKLINE>
    """
    from .own import xml

    return xml(m, name)


def _mitsuba() -> Any:
    """Mitsuba, with a variant set that can be used."""
    with needed("gonio.bridges.mitsuba needs Mitsuba", "pip install 'gonio[mitsuba]'"):
        import mitsuba as mi
    variant = mi.variant()
    if variant not in VARIANTS:
        raise ParameterError(
            f'mitsuba: variant {variant}; expected one of {", ".join(VARIANTS)}: mi.set_variant("llvm_ad_rgb")'
        )
    return mi


def _require_ordinary(m: Reflectance) -> None:
    require_numbers(m, "mitsuba.bsdf")
    if m.fluoresces:
        raise ParameterError(
            f"mitsuba.bsdf: {m!r:.60} fluoresces, and light keeps its wavelength there; expected an ordinary material: "
            f"m.under(light)"
        )
    if disperses(m):
        raise ParameterError(
            f"mitsuba.bsdf: {m!r:.60} refracts each channel to another direction; expected one index: m.at(550.0)"
        )
