"""User code that a type checker must accept: run by tests/test_public_face.py through `mypy --strict`."""

from typing import Any, Literal

import numpy as np

import gonio as gn
from gonio.authoring import (
    Direction,
    Distribution,
    Fresnel,
    Number,
    Reflectance,
    dot,
    half_vector,
    ops,
    option,
    param,
    part,
    typed,
)
from gonio.testing import assert_lawful, each_law


class Plain(Reflectance):
    """A model whose constructor takes anything, to a type checker."""

    rho = param(0.5, 0.0, 1.0, "albedo")
    distribution = part(Distribution, gn.GGX(0.2), "distribution of the facets' normals")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.rho * self.distribution.D(half_vector(wi, wo)) / np.pi


@typed
class Layer(Reflectance):
    """A model whose constructor is checked."""

    w: Number = param(0.5, 0.0, 1.0, "single-scattering albedo")
    g: Number = param(0.3, -0.9, 0.9, "mean cosine of the scattering angle")
    phase: Literal["forward", "both"] = option("forward", "both", doc="which lobes of the phase function")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        d = 1.0 + self.g * (self.g + 2.0 * dot(wi, wo))
        return self.w / (d * ops.sqrt(d) * (wi.z + wo.z))


class Half(Fresnel):
    """A Fresnel term."""

    def F(self, cos_theta: Any) -> Any:
        return 0.5 + 0.0 * cos_theta


@each_law
def test_plain(law: str) -> None:
    assert_lawful(Plain(0.3), laws=[law])


def materials() -> list[gn.Reflectance]:
    mine = [Plain(0.3), Plain(rho=[0.1, 0.2, 0.3]), Layer(0.3, g=0.8), Layer(np.ones(3), phase="both")]
    glossy = gn.Microfacet(gn.GGX(alpha=0.3), gn.Dielectric([1.5, 1.6, 1.7]), masking="separable")
    mirrors = gn.Microfacet(gn.GGX(0.1, 0.4), 0.9)
    terms = [gn.Lambertian(0.5) + 0.3 * glossy, mirrors * np.array([0.1, 0.2, 0.3]), gn.Microfacet(fresnel=Half())]
    return [*mine, *terms, gn.material("gold", alpha=0.2), gn.expression("Lambertian(0.2)")]


def numbers(m: gn.Reflectance) -> float:
    wi, wo = gn.direction(0.7, 0.0), gn.direction(0.4, 2.5)
    sample: gn.results.Sample = m.sample(wo, np.random.default_rng(1).random((10, 2)))
    report = gn.check(m.replace(rho=0.2), laws=["reciprocity"])
    total = gn.albedo(m, wi) + gn.reflectance(m, wi, gn.Cone(wo, 0.1)) + gn.remote_sensing.white_sky_albedo(m)
    return float(total + sample.weight.mean()) if report.passed else 0.0


def lights(m: gn.Reflectance) -> None:
    panel = gn.EnvironmentLight(np.ones((4, 8, 3)), scale=2.0, invalid="zero")
    for light in (gn.ConstantLight(1.0), gn.PointLight((0, 0, 2), intensity=8.0), panel, gn.FunctionLight(lambda w: w)):
        gn.render(m, light).save("sphere.png")


def contents() -> list[str]:
    kinds: list[type[gn.Reflectance]] = list(gn.models().values())
    facets: type[gn.authoring.Distribution] = gn.distributions()["GGX"]
    return [facets.__name__, *(k.__name__ for k in kinds), *gn.lights(), *gn.fresnel_terms(), *gn.formats()]


def files(path: str) -> None:
    m = gn.load(path)
    gn.save(m, "copy.json")
    print(gn.cite(m), gn.radiometry.roughness.alpha_from_perceptual(0.5), gn.materials()[0].name)
