"""User code that a type checker must refuse in every line that says so: run by tests/test_public_face.py."""

from typing import Any

import gonio as gn
from gonio.authoring import Direction, Number, Reflectance, param, typed


@typed
class Layer(Reflectance):
    w: Number = param(0.5, 0.0, 1.0, "single-scattering albedo")
    g: Number = param(0.3, -0.9, 0.9, "mean cosine of the scattering angle")

    def formula(self, wi: Direction, wo: Direction) -> Any:
        return self.w * wi.w  # error: attr-defined


gn.Lambertain(0.5)  # error: attr-defined
gn.Lambertian("0.5")  # error: arg-type
gn.Lambertian(0.5, 0.6)  # error: call-arg
gn.GGX(alfa=1)  # error: call-arg
gn.GGX(alpha=None)  # error: arg-type
gn.Microfacet(gn.Dielectric(1.5))  # error: arg-type
gn.Microfacet(gn.GGX(0.2), gn.GGX(0.2))  # error: arg-type
gn.Microfacet(masking="seperable")  # error: arg-type
gn.PointLight(intensity="bright")  # error: arg-type
gn.EnvironmentLight()  # error: call-arg
gn.EnvironmentLight("sky.exr", invalid="skip")  # error: arg-type
gn.Lambertian(0.5) + 1.0  # error: operator
print(gn.Lambertian(0.5).replace(rho=0.2).rho_s)  # error: attr-defined
gn.material("gold", alfa=0.2)  # error: call-arg
gn.render(0.5, gn.ConstantLight(1.0))  # error: arg-type
print(gn.models()["GGX"].D)  # error: attr-defined
gn.Lambertian(0.5).pdf()  # error: call-arg
gn.radiometry.roughness.alpha_from_perceptoal(0.5)  # error: attr-defined
Layer(0.3, h=0.2)  # error: call-arg
Layer("0.3")  # error: arg-type
Layer(0.3, 0.2, 0.1)  # error: call-arg
