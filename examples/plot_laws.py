"""
Two forms of Phong's lobe, and the laws
=======================================

Phong's lobe of 1975 lacks a cosine; with a bounded factor in front of it, it keeps the laws. The checker says which one
breaks what, and the albedo shows why.
"""

import matplotlib.pyplot as plt
import numpy as np

import gonio as gn

models = {"as in 1975": gn.OriginalPhong(0.25, 8.0), "modified": gn.ModifiedPhong(0.8, 8.0)}
theta = np.radians(np.linspace(0.0, 89.0, 60))

figure, ax = plt.subplots(figsize=(7.0, 4.2), layout="constrained")
for name, model in models.items():
    report = gn.check(model, laws=["positivity", "reciprocity", "energy"])
    verdicts = ", ".join(f"{law}: {verdict}" for law, verdict in report.verdicts.items())
    print(f"{name:>10}  {verdicts}")
    ax.plot(np.degrees(theta), gn.albedo(model, gn.direction(theta, 0.0)), label=f"{name}\n{verdicts}", linewidth=2.0)
ax.axhline(1.0, color="gray", linestyle=":")
ax.set(xlabel="angle of incidence [°]", ylabel="albedo: share of the light that leaves again", ylim=(0.0, 2.0))
ax.legend(loc="upper left", fontsize="small")

figure.savefig("laws.png")
