"""Draw the figure of docs/fits.md: `python docs/figures/fits.py` writes fit.jpg beside this file."""

from __future__ import annotations

from pathlib import Path

import gonio as gn
from gonio.formula import tree

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Fit the model of the page to the example of the manual."""
    data = HERE.parents[1] / "examples" / "ptfe_in_plane.csv"
    found = gn.fit(
        tree.with_notes(gn.load(data), path=data.name), gn.Lambertian() + gn.Microfacet(gn.GGX(), gn.Schlick())
    )
    gn.figures.fit(found, HERE / "fit.jpg")


if __name__ == "__main__":
    main()
