"""Shapes to render, a function each, in a file of its name; z of the world is up.

A shape takes the origin and the direction of rays, on components, and gives the `Hit` where they first meet it. It lies
within the unit sphere round the origin, at which the camera looks along +y, x to the right, and is convex. `LOW` in its
file is its least z. It is found by being here.
"""

from __future__ import annotations

from ...declared import discover
from ..hit import Shape

SHAPES: dict[str, Shape] = discover.functions(__name__)
"""Name -> function."""

LOWEST: dict[str, float] = {name: module.LOW for name, module in discover.by_name(__name__).items()}
"""Name -> its least z."""
