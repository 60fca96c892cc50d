"""
Colours of a soap film
======================

Two surfaces of a film reflect waves that interfere: the colour depends on the thickness and on the angle. Reflectances
at 81 wavelengths become colours in daylight.
"""

import matplotlib.pyplot as plt
import numpy as np

import gonio as gn

nm = np.linspace(380.0, 780.0, 81)
thickness = np.linspace(50.0, 900.0, 120)
theta = np.radians(np.linspace(0.0, 70.0, 90))

colours = [
    gn.colour.to_colour(gn.ThinFilm(1.33, thickness=d, substrate=1.0).at(nm).F(np.cos(theta)[:, None]), nm)
    for d in thickness
]
shown = np.clip(4.0 * np.stack(colours, axis=1), 0.0, 1.0) ** (1.0 / 2.2)  # four times as bright as it is

figure, ax = plt.subplots(figsize=(7.0, 4.2), layout="constrained")
ax.imshow(shown, origin="lower", aspect="auto", extent=(50.0, 900.0, 0.0, 70.0), interpolation="bilinear")
ax.set(xlabel="thickness of the film [nm]", ylabel="angle of incidence [°]", title="water, n = 1.33, between air")

figure.savefig("thin_film.png")
