"""A scene: parts, each a shape with a material."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..declared.arguments import checked
from ..declared.notebooks import repr_html
from ..errors import AccessError, ParameterError, shown
from .mesh import Mesh


class Scene:
    """Parts, each with a material: `gn.Scene([gn.scenes.Mesh(...), gn.scenes.Mesh(...)])`. In a picture, `gn.render(m,
    shape=scene)`, those without one have that of the picture.

    Example
    >>> floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
    >>> ceiling = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]], [[0, 1, 2, 3]]
    >>> lit = gn.scenes.Mesh(ceiling, gn.Lambertian(0.8), exitance=1.0)
    >>> scene = gn.Scene([gn.scenes.Mesh(floor, gn.Lambertian(0.5)), lit])
    >>> print(len(scene.parts))
    2
    """

    _repr_html_ = repr_html

    _noun = "a scene: gn.Scene([gn.scenes.Mesh(shape, material)])"

    @checked
    def __init__(self, parts: Any):
        given = list(parts) if isinstance(parts, Sequence) else [parts]
        others = [part for part in given if not isinstance(part, Mesh)]
        if others or not given:
            got = shown(others[0]) if others else "none"
            raise ParameterError(f"Scene: got {got}, expected meshes: gn.scenes.Mesh(file, material)")
        self.parts: tuple[Mesh, ...] = tuple(given)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in vars(self):
            raise AccessError("a Scene is a value and cannot be changed; make a new one")
        object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"Scene({len(self.parts)} parts)"
