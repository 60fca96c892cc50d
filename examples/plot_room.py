"""
A room whose walls light each other
===================================

Radiosity of a room with one red and one green wall, lit by a lamp below the ceiling: the white walls take them on.
"""

import matplotlib.pyplot as plt

import gonio as gn


def wall(*corners, colour=(0.75, 0.75, 0.75), exitance=0.0):
    return gn.scenes.Mesh((corners, [[0, 1, 2, 3]]), gn.Lambertian(colour), exitance)


room = gn.Scene([
    wall([0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]),
    wall([0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]),
    wall([0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]),
    wall([0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], colour=(0.65, 0.06, 0.05)),
    wall([1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0], colour=(0.12, 0.45, 0.10)),
    wall([0.35, 0.35, 0.99], [0.35, 0.65, 0.99], [0.65, 0.65, 0.99], [0.65, 0.35, 0.99], exitance=[18, 15, 10]),
])  # fmt: skip
picture = gn.scenes.radiosity(room, patches=8000).image(size=400)

figure, ax = plt.subplots(figsize=(4.5, 4.5), layout="constrained")
ax.imshow((2.5 * picture.pixels).clip(0.0, 1.0) ** (1.0 / 2.2), alpha=picture.alpha)
ax.axis("off")
figure.savefig("room.png")
