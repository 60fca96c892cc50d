"""Looking into a value: its fields and those of its parts, by dotted paths and by names."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any, ClassVar

from ..arrays.labels import Labels
from ..errors import NotFoundError, ParameterError
from .exchange import Exchange
from .fields import Channels, Field, Numbers, Param, Parameter, Part, Table
from .text import listed, unknown
from .value import Value

Place = tuple[str, Field, Any, "Tree"]
"""A field of a value or of one of its parts: its dotted path, its declaration, its value, and its owner."""

LOCATED_KEPT = 1000
"""Names whose paths are kept for all values of a structure."""


class Tree(Value):
    """A value as a tree: its fields, and parts that have fields of their own."""

    _labels: Labels | None = None
    """The names of the axes of parameters, where some were given as arrays that have them: all maps have these axes."""

    oriented: ClassVar[bool] = False
    """Whether x and y differ for this class: turning all directions about the normal may change its values."""

    def walk(self, prefix: str = "") -> Iterator[Place]:
        """Every field of this value; each part is followed by its own fields.

        Example
        >>> for row in gn.Rotated(gn.Lambertian(0.5), 0.3).walk():
        ...     print(row[0])
        ...
        of
        of.rho
        angle
        """
        for name, field in self.fields.items():
            value: Any = self.__dict__.get(name)  # bound copies hold no tables that are not looked up
            yield prefix + name, field, value, self
            if isinstance(field, Part):
                yield from value.walk(f"{prefix}{name}.")

    def _numbers(self) -> Iterator[Place]:
        """The fields, of this value and its parts, whose numbers are free: of parameters, channels, wavelengths."""
        for path, field, value, owner in self.walk():
            if isinstance(field, Numbers) and field.name not in owner._tied:
                held = owner._numbers_of(field.name, field) if isinstance(field, Exchange) else value
                yield path, field, held, owner

    def _numbers_of(self, name: str, field: Field) -> Any:
        """The value of a field as formulas have it: of a matrix its diagonal."""
        if isinstance(field, Exchange) and name in self._kept:
            return self._kept[name].numbers
        return self.__dict__.get(name)

    def _components(self) -> Iterator[Any]:
        """The parts of this value."""
        return (self.__dict__[name] for name, field in self.fields.items() if isinstance(field, Part))

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Dotted path -> value, bounds, meaning and unit of every number this depends on.

        Example
        >>> for path, p in gn.Microfacet(gn.GGX(0.1)).parameters.items():
        ...     print(path, p.value, p.low, p.high)
        ...
        distribution.alpha_x 0.1 0.001 1.0
        fresnel.reflectance 1.0 0.0 1.0
        """
        return {
            path: Parameter(value, field.low, field.high, field.doc, field.unit)
            for path, field, value, _ in self._numbers()
            if isinstance(field, Param)
        }

    def settable(self) -> Iterator[tuple[str, Field, Any]]:
        """Path, declaration and value of everything that `replace` can set: numbers, words and parts.

        Example
        >>> for path, field, value in gn.Microfacet(gn.GGX(0.1)).settable():
        ...     print(path, value)
        ...
        distribution GGX(alpha_x=0.1)
        distribution.alpha_x 0.1
        distribution.alpha_y 0.1
        fresnel Constant(reflectance=1.0)
        fresnel.reflectance 1.0
        masking height_correlated
        """
        return ((path, f, value) for path, f, value, _ in self.walk() if not isinstance(f, (Table, Channels)))

    def _names(self) -> list[str]:
        """The paths of `settable`, each followed by that of its alias, if it has one."""
        paths = []
        for path, field, _ in self.settable():
            paths.append(path)
            if isinstance(field, Param) and field.alias:
                paths.append(path.removesuffix(field.name) + field.alias)
        return paths

    @classmethod
    @cache
    def _aliases(cls) -> dict[str, str]:
        return {f.alias: n for n, f in cls.fields.items() if isinstance(f, Param) and f.alias}

    def located(self, name: str) -> str:
        """The path that a name stands for: itself, or the only path that ends in it, be it in parts of parts.

        `alpha` stands for `1.distribution.alpha` where nothing else is called so. Raises NotFoundError where nothing
        is, ParameterError where several are.

        Example
        >>> (gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1))).located("alpha")
        '1.distribution.alpha'
        """
        paths: dict[str, str] = self.alike.setdefault(Tree.located, {})
        path = paths.get(name) if isinstance(name, str) else None
        if path is None:
            path = self._located(name)
            if len(paths) < LOCATED_KEPT:
                paths[name] = path
        return path

    def _located(self, name: str) -> str:
        if not isinstance(name, str):
            raise NotFoundError(unknown(type(self).__name__, name, self._names()))
        head, _, rest = name.partition(".")
        part = self.__dict__.get(head) if isinstance(self.fields.get(head), Part) else None
        if rest and part is not None:
            return f"{head}.{part.located(rest)}"
        if name in self.fields or name in self._aliases():
            return name
        kind, paths = type(self).__name__, self._names()
        ending = [path for path in paths if path.endswith(f".{name}")]
        if len(ending) > 1:
            raise ParameterError(f"{kind}: {name} stands for several parameters; name one of {listed(ending)}")
        if not ending:
            known = [path for path in paths if not path.isdigit()] or list(self.fields)
            near = [*paths, *(path.rpartition(".")[2] for path in paths)]
            raise NotFoundError(unknown(kind, name, known, near=near))
        return ending[0]

    def leaves(self) -> Iterator[Any]:
        """Values of all numbers, for shapes and libraries.

        Example
        >>> print(*gn.GGX(0.1, 0.4).leaves())
        0.1 0.4
        """
        return (value for _, _, value, _ in self._numbers())

    def leaf_paths(self) -> Iterator[str]:
        """The dotted path of each of `leaves`; "" for one that is no parameter.

        Example
        >>> print(*gn.Microfacet(gn.GGX(0.1, 0.4)).leaf_paths())
        distribution.alpha_x distribution.alpha_y fresnel.reflectance
        """
        return (path if isinstance(field, Param) else "" for path, field, _, _ in self._numbers())

    def holed(self) -> Iterator[Any]:
        """The numbers of parameters of which some are missing.

        Example
        >>> print(list(gn.Lambertian(0.5).holed()))
        []
        """
        return (value for _, field, value, owner in self.walk() if field.name in owner._holed)

    def is_oriented(self) -> bool:
        """Whether this, or a part of it, is `oriented`.

        Example
        >>> print(gn.Lambertian(0.5).is_oriented(), gn.Microfacet(gn.GGX(0.1)).is_oriented())
        False True
        """
        return self.oriented or any(part.is_oriented() for part in self._components())

    @property
    def alike(self) -> dict[Any, Any]:
        """What follows from the structure and from the shapes of numbers alone, by the functions that find it: one
        dictionary for all copies with other numbers.

        Example
        >>> m = gn.Microfacet(gn.GGX(0.1))
        >>> print(m.replace(alpha=0.2).alike is m.alike, m.replace(alpha=[0.1, 0.2]).alike is m.alike)
        True False
        """
        return self._alike
