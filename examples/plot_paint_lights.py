"""
A measured paint under three lights
===================================

A material is one thing, its appearance another: the same gold paint, a published fit of a measurement, under a lamp,
under the sun and a clear sky, and in a studio.
"""

import matplotlib.pyplot as plt

import gonio as gn

paint = gn.material("gold-metallic-paint")
lights = {
    "a lamp": gn.DiskLight([-1.0, -1.5, 2.5], [1.0, 1.5, -2.5], radius=0.5, radiance=30.0),
    "sun and sky": [gn.SunLight([-0.6, -0.6, 0.6], 3.0), gn.CIESky(12, sun=[-0.6, -0.6, 0.6], zenith=0.3)],
    "a studio": gn.EnvironmentLight.studio(),
}

figure, axes = plt.subplots(1, 3, figsize=(9.0, 3.3), layout="constrained")
for ax, (name, light) in zip(axes, lights.items(), strict=True):
    picture = gn.render(paint, light, size=320, samples=64)
    ax.imshow((2.0 * picture.pixels).clip(0.0, 1.0) ** (1.0 / 2.2), alpha=picture.alpha)
    ax.set_title(name)
    ax.axis("off")

figure.savefig("paint_lights.png")
