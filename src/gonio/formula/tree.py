"""Values as trees: their fields and those of their parts, by dotted paths and by names; copies with other numbers.

These are functions of any value with declared fields: what users call of a value are its methods, and nothing else.
What they return is made without a check; `m.replace` is for numbers that somebody typed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, TypeVar

from ..arrays import Fixed
from ..errors import AccessError, NotFoundError, ParameterError
from .exchange import Exchange
from .fields import Channels, Field, Numbers, Param, Part, Table
from .state import Note, immutable
from .text import listed, unknown
from .value import Value

V = TypeVar("V", bound=Value)

Place = tuple[str, Field, Any, Value]
"""A field of a value or of one of its parts: its dotted path, its declaration, its value, and its owner."""

LOCATED_KEPT = 1000
"""Names whose paths are kept for all values of a structure."""


# Looking into a value.


def walk(m: Value, prefix: str = "") -> Iterator[Place]:
    """Every field of a value; each part is followed by its own fields.

    Example
    >>> from gonio.authoring import tree
    >>> for row in tree.walk(gn.Rotated(gn.Lambertian(0.5), 0.3)):
    ...     print(row[0])
    ...
    of
    of.rho
    angle
    """
    for name, field in m.fields.items():
        value: Any = m.__dict__.get(name)  # bound copies hold no tables that are not looked up
        yield prefix + name, field, value, m
        if isinstance(field, Part):
            yield from walk(value, f"{prefix}{name}.")


def numbers(m: Value) -> Iterator[Place]:
    """The fields, of a value and its parts, whose numbers are free: of parameters, channels, wavelengths.

    Example
    >>> from gonio.authoring import tree
    >>> print([path for path, *_ in tree.numbers(gn.GGX(0.1))], [path for path, *_ in tree.numbers(gn.GGX(0.1, 0.4))])
    ['alpha_x'] ['alpha_x', 'alpha_y']
    """
    for path, field, value, owner in walk(m):
        if isinstance(field, Numbers) and field.name not in owner._tied:
            held = owner._numbers_of(field.name, field) if isinstance(field, Exchange) else value
            yield path, field, held, owner


def leaves(m: Value) -> Iterator[Any]:
    """Values of all numbers, for shapes and libraries.

    Example
    >>> from gonio.authoring import tree
    >>> print(*tree.leaves(gn.GGX(0.1, 0.4)))
    0.1 0.4
    """
    return (value for _, _, value, _ in numbers(m))


def leaf_paths(m: Value) -> Iterator[str]:
    """The dotted path of each of `leaves`; "" for one that is no parameter.

    Example
    >>> from gonio.authoring import tree
    >>> print(*tree.leaf_paths(gn.Microfacet(gn.GGX(0.1, 0.4))))
    distribution.alpha_x distribution.alpha_y fresnel.reflectance
    """
    return (path if isinstance(field, Param) else "" for path, field, _, _ in numbers(m))


def holed(m: Value) -> Iterator[Any]:
    """The numbers of parameters of which some are missing.

    Example
    >>> from gonio.authoring import tree
    >>> print(list(tree.holed(gn.Lambertian(0.5))))
    []
    """
    return (value for _, field, value, owner in walk(m) if field.name in owner._holed)


def components(m: Value) -> Iterator[Any]:
    """The parts of a value.

    Example
    >>> from gonio.authoring import tree
    >>> print(*tree.components(gn.Microfacet(gn.GGX(0.1))))
    GGX(alpha_x=0.1) Constant(reflectance=1.0)
    """
    return (m.__dict__[name] for name, field in m.fields.items() if isinstance(field, Part))


def is_oriented(m: Value) -> bool:
    """Whether the class of a value says that it is `oriented`, or that of a part of it.

    Example
    >>> from gonio.authoring import tree
    >>> print(tree.is_oriented(gn.Lambertian(0.5)), tree.is_oriented(gn.Microfacet(gn.GGX(0.1))))
    False True
    """
    return any(map(is_oriented, components(m))) if m._oriented is None else m._oriented


# Names.


def settable(m: Value) -> Iterator[tuple[str, Field, Any]]:
    """Path, declaration and value of everything that `replace` can set: numbers, words and parts.

    Example
    >>> from gonio.authoring import tree
    >>> for path, field, value in tree.settable(gn.Microfacet(gn.GGX(0.1))):
    ...     print(path, value)
    ...
    distribution GGX(alpha_x=0.1)
    distribution.alpha_x 0.1
    distribution.alpha_y 0.1
    fresnel Constant(reflectance=1.0)
    fresnel.reflectance 1.0
    masking height_correlated
    """
    return ((path, f, value) for path, f, value, _ in walk(m) if not isinstance(f, (Table, Channels)))


def _names(m: Value) -> list[str]:
    """The paths of `settable`, each followed by that of its alias, if it has one."""
    paths = []
    for path, field, _ in settable(m):
        paths.append(path)
        if isinstance(field, Param) and field.alias:
            paths.append(path.removesuffix(field.name) + field.alias)
    return paths


def located(m: Value, name: str) -> str:
    """The path that a name stands for: itself, or the only path that ends in it, be it in parts of parts.

    `alpha` stands for `1.distribution.alpha` where nothing else is called so. Raises NotFoundError where nothing
    is, ParameterError where several are.

    Example
    >>> from gonio.authoring import tree
    >>> tree.located(gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1)), "alpha")
    '1.distribution.alpha'
    """
    paths: dict[str, str] = m._alike.setdefault(located, {})
    path = paths.get(name) if isinstance(name, str) else None
    if path is None:
        path = _located(m, name)
        if len(paths) < LOCATED_KEPT:
            paths[name] = path
    return path


def _located(m: Value, name: str) -> str:
    if not isinstance(name, str):
        raise NotFoundError(unknown(type(m).__name__, name, _names(m)))
    head, _, rest = name.partition(".")
    part = m.__dict__.get(head) if isinstance(m.fields.get(head), Part) else None
    if rest and part is not None:
        return f"{head}.{located(part, rest)}"
    if name in m.fields or name in m._aliases():
        return name
    kind, paths = type(m).__name__, _names(m)
    ending = [path for path in paths if path.endswith(f".{name}")]
    if len(ending) > 1:
        raise ParameterError(f"{kind}: {name} stands for several parameters; name one of {listed(ending)}")
    if not ending:
        known = [path for path in paths if not path.isdigit()] or list(m.fields)
        near = [*paths, *(path.rpartition(".")[2] for path in paths)]
        raise NotFoundError(unknown(kind, name, known, near=near))
    return ending[0]


def files_among(kind: type[Value], arguments: Iterable[Any], named: Mapping[str, Any]) -> list[str]:
    """The paths among arguments of the constructor of a class, of files that it would open.

    Example
    >>> from gonio.authoring import tree
    >>> print(tree.files_among(gn.EnvironmentLight, ["studio.exr"], {}))
    ['studio.exr']
    """
    fields, values = kind.fields, [*zip(kind._settable(), arguments, strict=False), *named.items()]
    return [v for name, v in values if isinstance(v, str) and name in fields and fields[name].opens_files]


# Copies.


def rebuilt(m: V, change: Callable[[str, Field, Any], Any], prefix: str = "") -> V:
    """A copy, unchecked, with `change(path, field, value)` for every number; the value itself where that changes none.

    Example
    >>> from gonio.authoring import tree
    >>> print(*tree.leaves(tree.rebuilt(gn.GGX(0.1, 0.4), lambda path, field, value: 0.5 * value)))
    0.05 0.2
    """
    changes: dict[str, Any] = {}
    for name, field in m.fields.items():
        value: Any = m._numbers_of(name, field)
        if name in m._tied:
            new = changes.get(m._tied[name], value)
        elif isinstance(field, Numbers):
            new = change(prefix + name, field, value)
        elif isinstance(field, Part):
            new = rebuilt(value, change, f"{prefix}{name}.")
        else:
            continue
        if new is not value:
            changes[name] = new
    return m._changed(changes) if changes else m


def with_values(m: V, values: dict[str, Any]) -> V:
    """A copy with other numbers, by path, unchecked: for libraries that put values of their own kinds there.

    Example
    >>> from gonio.authoring import tree
    >>> print(tree.with_values(gn.GGX(0.1), {"alpha_x": 0.3}).alpha_x)
    0.3
    """
    return rebuilt(m, lambda path, _, value: values.get(path, value))


def each(m: V, change: Callable[[Any], Any]) -> V:
    """A copy, unchecked, with `change` applied to the value of every parameter, and to wavelengths.

    Example
    >>> from gonio.authoring import tree
    >>> print(*tree.leaves(tree.each(gn.GGX(0.1, 0.4), lambda value: 2.0 * value)))
    0.2 0.8
    """
    return rebuilt(m, lambda _, field, value: value if isinstance(field, Channels) else change(value))


def merged(m: V, merge: Callable[[Any, str], Any]) -> V:
    """A copy, unchecked, with `merge` applied to every number and its way of merging channels for sampling.

    Example
    >>> from gonio.authoring import tree
    >>> print(tree.merged(gn.Lambertian([0.6, 0.1, 0.05]), lambda value, way: value.max()).rho)
    0.6
    """
    return rebuilt(m, lambda _, field, value: merge(value, getattr(field, "sampled", "mean")))


def with_notes(m: V, /, **notes: Any) -> V:
    """A copy with other notes, such as `provenance`; all else is the same.

    Example
    >>> from gonio.authoring import tree
    >>> m = tree.with_notes(gn.Lambertian([0.2, 0.4]), channel_names=(550.0, 650.0))
    >>> print(m.channel_names, m.replace(rho=[0.3, 0.3]).channel_names)
    (550.0, 650.0) (550.0, 650.0)
    """
    for name in notes:
        if not isinstance(m._beside.get(name), Note):
            raise AccessError(f"{type(m).__name__} has no note {name!r}; {name} = note() declares one")
    return m._made_of(m.__dict__, {name: immutable(value) for name, value in notes.items()})


def bind(m: V, convert: Callable[[Any], Any], table: Callable[[Fixed], Any]) -> V:
    """A copy for evaluation, unchecked: `convert` applied to every number, `table` to every lookup table.

    It holds words and state besides, and nothing else: a formula that reads more fails, for no trace knows of it.

    Example
    >>> from gonio.authoring import tree
    >>> print(tree.bind(gn.GGX(0.1, 0.4), np.float32, lambda table: table).alpha_y.dtype)
    float32
    """
    attributes, kept, tied = m.__dict__, m._kept, m._tied
    bound = {"_tied": tied, "_holed": m._holed, "_derived": {}, "_alike": {}, "_is_bound": True}
    for name in ("fields", *m._beside):  # a loop: for a comprehension torch.compile would look at every array
        if name in attributes and not isinstance(m._beside.get(name), Note):
            bound[name] = attributes[name]
    for name, field in m.fields.items():
        if isinstance(field, Numbers):
            value = kept[name] if name in kept else attributes[name]
            bound[name] = bound[tied[name]] if name in tied else convert(value)
        elif isinstance(field, Part):
            bound[name] = bind(attributes[name], convert, table)
        elif not isinstance(field, Table) and name not in kept:
            bound[name] = attributes[name]
    for name, held in kept.items():
        if name not in bound:
            bound[name] = table(held)
    return m._made_of(bound)


def unchecked(kind: type[V], /, **values: Any) -> V:
    """An instance of a class made inside a formula, of numbers that are checked and converted already.

    Example
    >>> from gonio.authoring import tree
    >>> print(tree.unchecked(gn.GGX, alpha_x=0.1, alpha_y=0.4).alpha_y)
    0.4
    """
    return kind._made_of(values, {"_tied": {}, "_derived": {}, "_alike": {}})
