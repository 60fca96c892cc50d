"""
A model fitted to a measurement
===============================

A laboratory's table of a white plate, with its uncertainties; the numbers of a model that come nearest to it, and how
sure they are; both in the plane of incidence.
"""

import matplotlib.pyplot as plt
import numpy as np

import gonio as gn

m = gn.load("examples/ptfe_in_plane.csv")
fit = gn.fit(m, gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick()))
print(fit.report())

figure, ax = plt.subplots(figsize=(7.0, 4.5), layout="constrained")
theta_i, phi_i, theta_o, phi_o = m.rows.T  # radians
side = np.degrees(theta_o) * np.where(np.cos(phi_o - phi_i) < 0.0, 1.0, -1.0)  # the mirror's side on the right
for angle, colour in zip((0, 30, 60), ("#0b6477", "#c46a10", "#7a2f8f"), strict=True):
    at = np.isclose(np.degrees(theta_i), angle)
    ax.errorbar(side[at], m.stored[at], 2.0 * m.uncertainty[at], fmt=".", color=colour, label=f"{angle}°")
    ax.plot(side[at], fit.model.f_angles(*m.rows[at].T), color=colour, linewidth=1.0)
ax.set(xlabel="angle of the detector [°]", ylabel="f [1/sr]", title="points: measured, U (k = 2); lines: the model")
ax.legend(title="incidence")

figure.savefig("fit.png")
