"""Values made of declared parameters: equality, repr, replacing by dotted path, binding for evaluation."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from types import NoneType
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import Fixed, frozen, labels
from ..arrays.labels import Labels
from ..bounds import EVALUATIONS, NESTED
from ..errors import NotFoundError, ParameterError, UnwrittenError
from .classes import Docstring, Signature, register
from .fields import Channels, Field, Ours, Param, Parameter, Part, Table, subclasses
from .state import Beside, Note, derived
from .text import listed, shown, unknown
from .value import Value

Place = tuple[str, Field, Any, "Parametrised"]
"""A field of a value or of one of its parts: its dotted path, its declaration, its value, and its owner."""


LOCATED_KEPT = 1000
"""Names whose paths are kept for all values of a structure."""

_PLAIN = (float, int, np.ndarray, list, tuple, np.float64, np.float32)
"""Types of numbers that are neither masked, nor named, nor of another library."""


class Parametrised(Value):
    """An immutable value made of declared fields: equality, repr, replace, paths and JSON come from the fields."""

    noun: ClassVar[str] = "a value"
    """What messages call it."""
    reflects: ClassVar[str] = "gn.Lambertian(0.5)"
    """What messages advise to write where it is given for a reflectance; {} stands for it."""
    _labels: Labels | None = None
    """The names of the axes of parameters, where some were given as arrays that have them: all maps have these axes."""

    _lazy: bool = False
    """Whether parameters are computed later, by Dask."""

    oriented: ClassVar[bool] = False
    """Whether x and y differ for this class: turning all directions about the normal may change its values."""

    repeats: ClassVar[int] = 1
    """The number of times that formulas of this class evaluate those of its parts, in other directions each time."""
    costs: ClassVar[int] = 0
    """The cost of the formulas of this class beside their parts, in simple formulas."""
    has_text: ClassVar[bool] = True
    """Whether values of this class are written as expressions and as JSON."""

    __signature__ = Signature()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        bases = [base for base in cls.__bases__ if issubclass(base, Parametrised)]
        inherited = {name: _declared(cls, name) for base in bases for name in (*base.fields, *base.beside)}
        declared = inherited | vars(cls)
        cls.fields = {name: x for name, x in declared.items() if isinstance(x, Field)}
        cls.beside = {name: x for name, x in declared.items() if isinstance(x, Beside)}
        cls.__doc__ = Docstring(vars(cls).get("__doc__"))  # type: ignore[assignment]
        register(cls)

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        kind, fields, settable = type(self).__name__, self.fields, self._settable()
        if missing := self.unwritten():
            finished = subclasses(type(self))
            advice = f"use one of {finished}" if finished else "; ".join(_to_write(type(self), x) for x in missing)
            raise ParameterError(f"{kind}(): an abstract base, without {' and '.join(missing)}; {advice}")
        if len(args) > len(settable):
            names = ", ".join(settable)
            raise ParameterError(f"{kind}: got {len(args)} values, expected at most {len(settable)}: {names}")
        values, aliases = dict(zip(settable, args, strict=False)), self._aliases()
        for name, value in kwargs.items():
            target = aliases.get(name, name)
            if target not in fields:
                known = [*settable, *aliases]
                raise NotFoundError(unknown(kind, name, known) + self._of_a_part(name))
            if target in values:
                raise ParameterError(f"{kind}: {target} is given twice")
            values[target] = value
        self._set(values)
        self.validate()

    @classmethod
    @cache
    def unwritten(cls) -> list[str]:
        """The abstract methods that neither this class nor a base of it writes: those of an abstract base.

        Example
        >>> print(gn.Reflectance.unwritten(), gn.Lambertian.unwritten())
        ['formula'] []
        """
        names = [n for kind in cls.__mro__ for n, x in vars(kind).items() if getattr(x, "__isabstractmethod__", False)]
        return [name for name in names if getattr(getattr(cls, name), "__isabstractmethod__", False)]

    @classmethod
    @cache
    def _settable(cls) -> list[str]:
        return [n for n, f in cls.fields.items() if not isinstance(f, (Table, Channels))]

    @classmethod
    @cache
    def _aliases(cls) -> dict[str, str]:
        return {f.alias: n for n, f in cls.fields.items() if isinstance(f, Param) and f.alias}

    @classmethod
    def files_among(cls, arguments: Iterable[Any], named: Mapping[str, Any]) -> list[str]:
        """The paths among these arguments, of files that the constructor would open.

        Example
        >>> print(gn.EnvironmentLight.files_among(["studio.exr"], {}))
        ['studio.exr']
        """
        values = [*zip(cls._settable(), arguments, strict=False), *named.items()]
        return [v for name, v in values if isinstance(v, str) and name in cls.fields and cls.fields[name].opens_files]

    def _meant(self, name: str) -> str:
        for path, field, _, _ in self.walk():
            if name in (field.name, getattr(field, "alias", None)) and isinstance(field, Param):
                return f"; write m.parameters[{path!r}].value"
        return super()._meant(name)

    def _set(self, values: dict[str, Any], **own: dict[str, Field]) -> None:
        """Check and store values of fields, or their defaults. `own`: `fields=...`, where they are not the class's."""
        self.__dict__.update(own)
        attributes, tied, holed, named = self.__dict__, {}, set(), {}
        for name, field in self.fields.items():
            value = values.get(name, field.default)
            if isinstance(field, Param) and isinstance(value, str) and value == field.default:
                tied[name] = value
                value = attributes[value]
            elif not (isinstance(field, Table) and value is None):
                if isinstance(field, Param) and labels.is_named(value):
                    value, named[name] = labels.taken(value, f"{type(self).__name__}({name})", ParameterError)
                value = field.check(type(self).__name__, value)
            attributes[name] = value
            if isinstance(field, Param) and isinstance(value, np.ndarray) and np.isnan(value).any():
                holed.add(name)
        attributes.update(_tied=tied)
        if any(labels.is_lazy(v) or getattr(v, "_lazy", False) for v in attributes.values()):
            attributes["_lazy"] = True
        self._lay(named)
        attributes.update(_holed=frozenset(holed), _derived={}, _alike={}, _kept=self._keep())
        self._check_size()

    def _lay(self, named: dict[str, Labels]) -> None:
        """Give all maps, those of parts too, the same axes in the same order, where any of them have names.

        `named`: parameters, with their axes.
        """
        parts = {n: self.__dict__[n] for n, field in self.fields.items() if isinstance(field, Part)}
        own = {n: part._labels for n, part in parts.items() if part._labels is not None}
        if not named and not own:
            return
        kind, attributes = type(self).__name__, self.__dict__
        whole = labels.union([*named.values(), *own.values()], kind, ParameterError)
        for name, of in named.items():
            attributes[name] = frozen(whole.laid(attributes[name], of))
        for name, of in own.items():
            attributes[name] = parts[name]._laid(whole, of)
        attributes.update({name: attributes[target] for name, target in self._tied.items()})
        for path, _, value, owner in self._numbers():
            if getattr(value, "ndim", 0) > 1 and owner._labels is None and (owner is not self or path not in named):
                rule = f"a map without names for its axes, beside {', '.join(map(str, whole.dims)) or 'named channels'}"
                raise ParameterError(f"{kind}: {path} is {rule}; expected a DataArray for each map, or for none")
        attributes["_labels"] = whole
        self._name_channels(whole)

    def _laid(self, whole: Labels, of: Labels) -> Self:
        """A copy whose maps have the axes of a whole that this is a part of; their own are `of`."""
        changes: dict[str, Any] = {}
        for name, field in self.fields.items():
            value = self.__dict__[name]
            if isinstance(field, Part):
                changes[name] = value if value._labels is None else value._laid(whole, of)
            elif isinstance(field, Param):
                changes[name] = frozen(whole.laid(value, of))
        new = self._changed(changes)
        new.__dict__.update(_labels=whole)
        new.__dict__["_kept"] = new._keep()
        return new

    def _name_channels(self, whole: Labels) -> None:
        """Take over names of channels. Overridden where there are any."""

    @derived
    def unlabelled(self) -> Self:
        """The same without names of axes, for computations on plain arrays.

        Example
        >>> import xarray
        >>> field = gn.Lambertian(xarray.DataArray([0.2, 0.4], dims="x"))
        >>> for m in (field, field.unlabelled):
        ...     print(type(m.f_angles(0.3, 0.0, 0.5, 1.0)).__name__)
        ...
        DataArray
        ndarray
        """
        if self._labels is None:
            return self
        parts = {n: self.__dict__[n].unlabelled for n, field in self.fields.items() if isinstance(field, Part)}
        return self._made_of(self.__dict__, parts, {"_labels": None})

    def _components(self) -> Iterator[Parametrised]:
        """The parts of this value."""
        return (self.__dict__[name] for name, field in self.fields.items() if isinstance(field, Part))

    @derived
    def _size(self) -> tuple[int, int]:
        """The depth of nested parts, and the number of formulas to evaluate."""
        sizes = [part._size for part in self._components()]
        evaluations = self.costs + self.repeats * sum(n for _, n in sizes)
        return 1 + max((depth for depth, _ in sizes), default=0), max(1, evaluations)

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

    def _check_size(self) -> None:
        """Raises ParameterError where parts are nested too deep, or there are too many formulas."""
        nested, evaluations = self._size
        if nested > NESTED:
            excess = f"nested {nested} deep, expected at most {NESTED}; write factors as one, a sum of sums as one sum"
            raise ParameterError(f"{type(self).__name__}: {excess}")
        if evaluations > EVALUATIONS:
            excess = f"as large as a sum of {evaluations} terms, expected at most {EVALUATIONS}; add fewer terms"
            raise ParameterError(f"{type(self).__name__}: {excess}, or nest fewer normal maps and coats in one another")

    def _changed(self, values: dict[str, Any], kept: dict[str, Fixed] | None = None) -> Self:
        """A copy, unchecked, with other values of fields; `kept`: all arrays that libraries convert once."""
        kept = {n: x for n, x in self._kept.items() if n not in values} if kept is None else kept
        attributes = self.__dict__
        if not self.is_bound:  # bound copies hold tables by names of their own
            names = ("_tied", "_holed", "_labels", "_lazy", "fields", *self.fields, *self.beside)
            attributes = {n: attributes[n] for n in names if n in attributes}
        return self._made_of(attributes, values, {"_kept": kept, "_derived": {}, "_alike": {}})

    @classmethod
    def unchecked(cls, **values: Any) -> Self:
        """An instance made inside a formula, of numbers that are checked and converted already.

        Example
        >>> print(gn.GGX.unchecked(alpha_x=0.1, alpha_y=0.4).alpha_y)
        0.4
        """
        return cls._made_of(values, {"_tied": {}, "_derived": {}, "_alike": {}})

    def validate(self) -> None:
        """Rules between fields; raises ParameterError. Overridden where there are any."""

    def _lacks(self, method: str) -> UnwrittenError:
        """The error of a call that needs a method which the class of this value does not write."""
        kind = type(self)
        return UnwrittenError(f"{kind.__name__} has no {method}, which this needs; {_to_write(kind, method)}")

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
        """The fields, of this value and its parts, whose numbers are free: parameters and channel numbers."""
        for path, field, value, owner in self.walk():
            if isinstance(field, (Param, Channels)) and field.name not in owner._tied:
                yield path, field, value, owner

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

    def located(self, name: str) -> str:
        """The path that a name stands for: itself, or the only path that ends in it, be it in parts of parts.

        `alpha` stands for `1.distribution.alpha` where nothing else is called so. Raises NotFoundError where nothing
        is, ParameterError where several are.

        Example
        >>> (gn.Lambertian(0.2) + gn.Microfacet(gn.GGX(0.1))).located("alpha")
        '1.distribution.alpha'
        """
        paths: dict[str, str] = self.alike.setdefault(Parametrised.located, {})
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

    @classmethod
    def _of_a_part(cls, name: str) -> str:
        """A hint, where a part that the class has by default knows a name that the class does not."""
        for part_name, field in cls.fields.items():
            if isinstance(field, Part) and field.default is not None:
                part = field.check(cls.__name__, field.default)
                if name in part.fields or name in part._aliases():
                    return f"; write {part_name}={type(part).__name__}({name}=...)"
        return ""

    def replace(self, changes: dict[str, Any] | None = None, /, **kwargs: Any) -> Self:
        """A copy with other values, by name: the name of a parameter, an alias, an option or a part, or its path.

        `m.replace(alpha=0.3)`, `m.replace({"1.distribution.alpha_x": 0.3})`. A name reaches into parts: it stands for
        the only path that ends in it. Raises ParameterError where there are several, NotFoundError where there is none.

        Example
        >>> gn.material("gold").replace(alpha=0.3).parameters["distribution.alpha_x"].value
        0.3
        """
        if not isinstance(changes, (Mapping, NoneType)) or not all(isinstance(path, str) for path in changes or ()):
            rule = 'expected a dictionary such as {"1.distribution.alpha_x": 0.3}, or names: m.replace(rho=0.3)'
            raise ParameterError(f"replace({shown(changes)}): {rule}")
        every = {**(changes or {}), **kwargs}
        return self._with_paths([(name, self.located(name), value) for name, value in every.items()])

    def _with_paths(self, changes: Iterable[tuple[str, str, Any]]) -> Self:
        """A copy with other values, each given by the name that messages call it, and its path."""
        grouped: dict[str, Any] = {}
        for name, path, value in changes:
            head, _, rest = path.partition(".")
            inner = grouped.setdefault(head, {}) if rest else grouped
            if not isinstance(inner, dict) or (rest or head) in inner:
                raise ParameterError(f"{type(self).__name__}: {name} is given twice")
            inner[rest or head] = value
        return self._replaced(grouped)

    def _replaced(self, grouped: dict[str, Any]) -> Self:
        kind, aliases = type(self).__name__, self._aliases()
        changes: dict[str, Any] = {}
        for head, value in grouped.items():
            name = aliases.get(head, head)
            if head in aliases and name in grouped:
                raise ParameterError(f"{kind}: {name} is given twice")
            if isinstance(value, dict) and isinstance(self.fields[name], Part):
                value = self.__dict__[name]._with_paths([(path, path, x) for path, x in value.items()])
            changes[name] = value
            if head in aliases:
                tied = {n: f.default for n, f in self.fields.items() if f.default == name and n not in grouped}
                changes.update(tied)
        new = self._renumbered(changes)
        return self._remade(changes) if new is None else new

    def _renumbered(self, changes: dict[str, Any]) -> Self | None:
        """A copy with other plain numbers, of its own and of its parts: nothing else has to be looked at again, as a
        fit needs it at every step. None where there is more to do."""
        attributes, fields, tied = self.__dict__, self.fields, self._tied
        if self._labels is not None or self._lazy or self._holed or type(self)._keep is not Value._keep:
            return None
        kind, alike, ties = type(self).__name__, True, tied
        values: dict[str, Any] = {}
        for name, value in changes.items():
            field, old = fields[name], attributes[name]
            if isinstance(field, Part):
                value = values[name] = field.check(kind, value)
                if value._labels is not None or value._lazy:
                    return None
                alike = alike and value.alike is old.alike
            elif isinstance(field, Param) and type(value) in _PLAIN:
                value = values[name] = field.check(kind, value)
                alike = alike and type(value) is type(old) and (type(value) is float or value.shape == old.shape)
                if name in ties:
                    ties = {n: target for n, target in ties.items() if n != name}
            elif isinstance(field, Param) and isinstance(value, str) and value == field.default:
                ties = ties | {name: value}
            else:
                return None
        if ties is not tied:
            ties = {name: ties[name] for name in fields if name in ties}
            alike = alike and ties == tied
        for name, target in ties.items():
            values[name] = values[target] if target in values else attributes[target]
        kept = {name: x for name, x in self._kept.items() if name not in values} if self._kept else {}
        for name, value in values.items():
            if isinstance(value, np.ndarray):
                kept[name] = Fixed(value)
        new = self._changed(values, kept)
        new.__dict__["_tied"] = ties
        if alike:
            new.__dict__["_alike"] = self._alike
        else:
            new._check_size()
        new.validate()
        return new

    def _remade(self, changes: dict[str, Any]) -> Self:
        """A copy with other values, all of which are checked."""
        values = {name: self._argument(name) for name, _, _ in self._free()} | self._tied | changes
        attributes = self.__dict__
        new = self._made_of({n: attributes[n] for n in (*self.beside, "fields") if n in attributes})
        new._set(values)
        new.validate()
        if not any(isinstance(self.fields.get(name), Table) for name in changes):  # tables, as libraries converted them
            numbers = (Param, Channels)
            new._kept.update({n: x for n, x in self._kept.items() if not isinstance(self.fields.get(n), numbers)})
        return new

    def _argument(self, name: str) -> Any:
        """The value of a field, as `_set` takes it without a copy."""
        value = self.__dict__[name]
        if self._labels is not None and getattr(value, "ndim", 0) > 1:
            return self._labels.of_map(value)
        if name in self._holed:
            return np.ma.masked_invalid(value)
        return Ours(value) if isinstance(self.fields[name], Table) and value is not None else value

    def rebuilt(self, change: Callable[[str, Field, Any], Any], prefix: str = "") -> Self:
        """A copy, unchecked, with `change(path, field, value)` for every number; itself where that changes none.

        Example
        >>> print(*gn.GGX(0.1, 0.4).rebuilt(lambda path, field, value: 0.5 * value).leaves())
        0.05 0.2
        """
        changes: dict[str, Any] = {}
        for name, field in self.fields.items():
            value: Any = self.__dict__.get(name)
            if name in self._tied:
                new = changes.get(self._tied[name], value)
            elif isinstance(field, (Param, Channels)):
                new = change(prefix + name, field, value)
            elif isinstance(field, Part):
                new = value.rebuilt(change, f"{prefix}{name}.")
            else:
                continue
            if new is not value:
                changes[name] = new
        return self._changed(changes) if changes else self

    def with_values(self, values: dict[str, Any]) -> Self:
        """A copy with other numbers, by path, unchecked: for libraries that put values of their own kinds there.

        Example
        >>> print(gn.GGX(0.1).with_values({"alpha_x": 0.3}).alpha_x)
        0.3
        """
        return self.rebuilt(lambda path, _, value: values.get(path, value))

    def each(self, change: Callable[[Any], Any]) -> Self:
        """A copy, unchecked, with `change` applied to the value of every parameter.

        Example
        >>> print(*gn.GGX(0.1, 0.4).each(lambda value: 2.0 * value).leaves())
        0.2 0.8
        """
        return self.rebuilt(lambda _, field, value: change(value) if isinstance(field, Param) else value)

    def merged(self, merge: Callable[[Any, str], Any]) -> Self:
        """A copy, unchecked, with `merge` applied to every number and its way of merging channels for sampling.

        Example
        >>> print(gn.Lambertian([0.6, 0.1, 0.05]).merged(lambda value, way: value.max()).rho)
        0.6
        """
        return self.rebuilt(lambda _, field, value: merge(value, getattr(field, "sampled", "mean")))

    def bind(self, convert: Callable[[Any], Any], table: Callable[[Fixed], Any]) -> Self:
        """A copy for evaluation, unchecked: `convert` applied to every number, `table` to every lookup table.

        It holds words and state besides, and nothing else: a formula that reads more fails, for no trace knows of it.

        Example
        >>> print(gn.GGX(0.1, 0.4).bind(np.float32, lambda table: table).alpha_y.dtype)
        float32
        """
        attributes, kept, tied = self.__dict__, self._kept, self._tied
        bound = {"_tied": tied, "_holed": self._holed, "_derived": {}, "_alike": {}, "is_bound": True}
        for name in ("fields", *self.beside):  # a loop: for a comprehension torch.compile would look at every array
            if name in attributes and not isinstance(self.beside.get(name), Note):
                bound[name] = attributes[name]
        for name, field in self.fields.items():
            if isinstance(field, (Param, Channels)):
                value = kept[name] if name in kept else attributes[name]
                bound[name] = bound[tied[name]] if name in tied else convert(value)
            elif isinstance(field, Part):
                bound[name] = attributes[name].bind(convert, table)
            elif not isinstance(field, Table) and name not in kept:
                bound[name] = attributes[name]
        for name, numbers in kept.items():
            if name not in bound:
                bound[name] = table(numbers)
        return self._made_of(bound)

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


def _to_write(kind: type, method: str) -> str:
    """What to write in a class: "write def formula(self, wi, wo) in it: f [1/sr] for directions above ..."."""
    function = getattr(kind, method, None)
    if not inspect.isfunction(function):
        return f"write {method} in the class"
    arguments, doc = ", ".join(inspect.signature(function).parameters), (function.__doc__ or "").partition("\n\n")[0]
    return f"write def {method}({arguments}) in the class: {' '.join(doc.split())}"


def _declared(kind: type, name: str) -> Any:
    """The declaration of this name in a class, or in the nearest of its bases that has one."""
    return next(vars(base)[name] for base in kind.__mro__ if name in vars(base))
