"""Values made of declared parameters: equality, repr, replacing by dotted path, binding for evaluation, JSON."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import is_dataclass
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import Fixed, frozen, ops
from ..bounds import EVALUATIONS, NESTED
from ..errors import NotFoundError, ParameterError
from .fields import Channels, Field, Ours, Param, Parameter, Part, Table, shown
from .registry import json_name, register
from .signature import Docstring, Signature

_BESIDE_FIELDS = {"fields", "_tied", "_kept", "_holed", "_plans", "_identity", "_nested", "_evaluations"}


class Parametrised:
    """An immutable value made of declared fields: equality, repr, replace, paths and JSON come from the fields."""

    fields: dict[str, Field] = {}  # noqa: RUF012  (each class gets its own below)
    oriented: ClassVar[bool] = False
    """Whether x and y differ for this class: turning all directions about the normal may change its values."""

    repeats: ClassVar[int] = 1
    """How often the formulas of this class evaluate those of its parts, each time in other directions."""
    costs: ClassVar[int] = 0
    """How many formulas take the time that those of this class take beside their parts."""
    has_text: ClassVar[bool] = True
    """Whether values of this class are written as expressions and as JSON."""

    __signature__ = Signature()
    _nested = 1
    _evaluations = 1
    _tied: dict[str, str]
    _kept: dict[str, Fixed] = {}  # noqa: RUF012  (each instance with arrays gets its own)
    _holed: frozenset[str] = frozenset()  # names of parameters of which some entries were masked, and are NaN

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        own = {k: v for k, v in vars(cls).items() if isinstance(v, Field)}
        inherited = [vars(base).get("fields", {}) for base in reversed(cls.__mro__[1:])]
        cls.fields = {name: field for fields in (*inherited, own) for name, field in fields.items()}
        cls.__doc__ = Docstring(vars(cls).get("__doc__"))  # type: ignore[assignment]
        register(cls)

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        kind, fields, settable = type(self).__name__, self.fields, self._settable()
        if len(args) > len(settable):
            raise ParameterError(
                f"{kind}: got {len(args)} values, expected at most {len(settable)}: {chr(44).join(settable)}"
            )
        given = dict(zip(settable, args, strict=False))
        aliases = {f.alias: n for n, f in fields.items() if isinstance(f, Param) and f.alias}
        for name, value in kwargs.items():
            target = aliases.get(name, name)
            if target not in fields:
                raise NotFoundError(_unknown(kind, name, [*settable, *aliases]))
            if target in given:
                raise ParameterError(f"{kind}: {target} is given twice")
            given[target] = value
        self._set(given)
        self.validate()

    @classmethod
    def _settable(cls) -> list[str]:
        return [n for n, f in cls.fields.items() if not isinstance(f, (Table, Channels))]

    @classmethod
    def files_among(cls, arguments: Iterable[Any], named: Mapping[str, Any]) -> list[str]:
        """The paths among these arguments: files that making a value of them opens."""
        given = [*zip(cls._settable(), arguments, strict=False), *named.items()]
        return [v for name, v in given if isinstance(v, str) and name in cls.fields and cls.fields[name].opens_files]

    def _set(self, given: dict[str, Any]) -> None:
        tied = {}
        for name, field in self.fields.items():
            value = given.get(name, field.default)
            if isinstance(field, Param) and isinstance(value, str) and value == field.default:
                tied[name] = value
                value = self.__dict__[value]
            elif not (isinstance(field, Table) and value is None):
                value = field.check(type(self).__name__, value)
            self.__dict__[name] = value
        maps = ((n, self.__dict__[n]) for n, f in self.fields.items() if isinstance(f, Param))
        holed = frozenset(n for n, value in maps if isinstance(value, np.ndarray) and np.isnan(value).any())
        self.__dict__.update(_tied=tied, _kept=self._keep(), _holed=holed)
        self._bound()

    def _bound(self) -> None:
        """Count how deep parts are nested, and the formulas to evaluate. Raises ParameterError where it is too much."""
        parts = [self.__dict__[name] for name, field in self.fields.items() if isinstance(field, Part)]
        nested = 1 + max((p._nested for p in parts), default=0)
        evaluations = max(1, self.costs + self.repeats * sum(p._evaluations for p in parts))
        if nested > NESTED:
            raise ParameterError(
                f"{type(self).__name__}: nested {nested} deep, expected at most {NESTED}; write factors as one, a sum "
                f"of sums as one sum"
            )
        if evaluations > EVALUATIONS:
            raise ParameterError(
                f"{type(self).__name__}: as large as a sum of {evaluations} terms, expected at most {EVALUATIONS}; add "
                f"fewer terms, or nest fewer normal maps and coats in one another"
            )
        self.__dict__.update(_nested=nested, _evaluations=evaluations)

    def _keep(self) -> dict[str, Fixed]:
        """Arrays by name, which libraries convert once: tables, flat, and parameters given as NumPy arrays."""
        arrays = {n: (f, self.__dict__[n]) for n, f in self.fields.items() if isinstance(self.__dict__[n], np.ndarray)}
        return {n: Fixed(partial(np.reshape, a, -1) if isinstance(f, Table) else a) for n, (f, a) in arrays.items()}

    def _changed(self, values: dict[str, Any]) -> Self:
        """A copy, unchecked, with other values of fields."""
        new = object.__new__(type(self))
        new.__dict__.update(self.__dict__)
        new.__dict__.update(values)
        new.__dict__.pop("_plans", None)  # hold the numbers as they were
        new.__dict__["_kept"] = {n: kept for n, kept in self._kept.items() if n not in values}
        return new

    @classmethod
    def unchecked(cls, **values: Any) -> Self:
        """An instance made inside a formula, of numbers that are checked and converted already."""
        new = object.__new__(cls)
        new.__dict__.update(values, _tied={})
        return new

    def validate(self) -> None:
        """Rules between fields; raises ParameterError. Overridden where there are any."""

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(
            f"{type(self).__name__} is a value and cannot be changed; use m.replace({name}=...) for a new one"
        )

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{type(self).__name__} is a value and cannot be changed")

    def _free(self) -> Iterator[tuple[str, Field, Any]]:
        """Declared fields with their values, without those that are tied to another."""
        for name, field in self.fields.items():
            if name not in self._tied:
                yield name, field, self.__dict__[name]

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Dotted path -> value, bounds, meaning and unit of every number this depends on."""
        found: dict[str, Parameter] = {}
        for name, field, value in self._free():
            if isinstance(field, Param):
                found[name] = Parameter(value, field.low, field.high, field.doc, field.unit)
            elif isinstance(field, Part):
                found.update({f"{name}.{path}": p for path, p in value.parameters.items()})
        return found

    def settable(self, prefix: str = "") -> Iterator[tuple[str, Field, Any]]:
        """Path, declaration and value of everything that `replace` can set: numbers, words and pieces."""
        for name, field in self.fields.items():
            if isinstance(field, (Table, Channels)):
                continue
            value = self.__dict__[name]
            yield prefix + name, field, value
            if isinstance(value, Parametrised):
                yield from value.settable(f"{prefix}{name}.")

    def replace(self, changes: dict[str, Any] | None = None, /, **kwargs: Any) -> Self:
        """A copy with other values; keys are the paths of `parameters`, or names of options and parts.

        `m.replace(alpha=0.3)`, `m.replace({"1.distribution.alpha_x": 0.3})`.
        """
        grouped: dict[str, Any] = {}
        for path, value in {**(changes or {}), **kwargs}.items():
            head, _, rest = path.partition(".")
            if rest:
                grouped.setdefault(head, {})[rest] = value
            else:
                grouped[head] = value
        return self._replaced(grouped)

    def _replaced(self, grouped: dict[str, Any]) -> Self:
        kind = type(self).__name__
        aliases = {f.alias: n for n, f in self.fields.items() if isinstance(f, Param) and f.alias}
        values = {name: self._as_given(name) for name, _, _ in self._free()}
        values.update(self._tied)
        for head, value in grouped.items():
            name = aliases.get(head, head)
            if head in aliases and name in grouped:
                raise ParameterError(f"{kind}: {name} is given twice")
            if name not in self.fields:
                raise NotFoundError(_unknown(kind, head, list(self.parameters) or list(self.fields)))
            child = self.__dict__[name]
            if isinstance(value, dict) and isinstance(child, Parametrised):
                value = child.replace(value)
            elif isinstance(value, dict):
                raise NotFoundError(_unknown(kind, f"{head}.{next(iter(value))}", list(self.parameters)))
            values[name] = value
            if head in aliases:
                values.update({n: f.default for n, f in self.fields.items() if f.default == name})
        new = object.__new__(type(self))
        new.__dict__.update({k: v for k, v in self.__dict__.items() if k not in self.fields and k != "_plans"})
        new._set(values)
        new.validate()
        if any(isinstance(self.fields.get(name), Table) for name in grouped):
            new.__dict__.pop("_identity", None)
        else:
            tables = {n: k for n, k in self._kept.items() if not isinstance(self.fields.get(n), (Param, Channels))}
            new._kept.update(tables)  # with what was made of them
        return new

    def _as_given(self, name: str) -> Any:
        """The value of a field, for `_set` to take as it is."""
        value = self.__dict__[name]
        if name in self._holed:
            return np.ma.masked_invalid(value)
        return Ours(value) if isinstance(self.fields[name], Table) and value is not None else value

    def with_values(self, values: dict[str, Any]) -> Self:
        """A copy with other numbers, by path, unchecked: for libraries that pass their own kinds of value through."""
        changes = {}
        for name, field, child in self._free():
            if isinstance(field, Param) and name in values:
                changes[name] = values[name]
            elif isinstance(field, Part):
                below = {p.partition(".")[2]: v for p, v in values.items() if p.partition(".")[0] == name}
                changes[name] = child.with_values(below)
        for name, source in self._tied.items():
            if source in changes:
                changes[name] = changes[source]
        return self._changed(changes)

    def bind(self, convert: Callable[[Any], Any], table: Callable[[Fixed], Any]) -> Self:
        """A copy for evaluation, unchecked: `convert` applied to every number, `table` to every lookup table."""
        changes: dict[str, Any] = {}
        for name, field in self.fields.items():
            if isinstance(field, (Param, Channels)):
                tied = name in self._tied
                value = self._kept[name] if name in self._kept else self.__dict__[name]
                changes[name] = changes[self._tied[name]] if tied else convert(value)
            elif isinstance(field, Part):
                changes[name] = self.__dict__[name].bind(convert, table)
        for name, kept in self._kept.items():
            if name not in changes:
                changes[name] = table(kept)
        return self._changed(changes)

    def each(self, change: Callable[[Any], Any]) -> Self:
        """A copy, unchecked, with `change` applied to the value of every parameter."""
        changes = {}
        for name, field in self.fields.items():
            if isinstance(field, Param):
                changes[name] = change(self.__dict__[name])
            elif isinstance(field, Part):
                changes[name] = self.__dict__[name].each(change)
        return self._changed(changes)

    def merged(self, merge: Callable[[Any, str], Any]) -> Self:
        """A copy, unchecked, with `merge` applied to every number and its way of merging channels for sampling."""
        changes = {}
        for name, field in self.fields.items():
            if isinstance(field, Param):
                changes[name] = merge(self.__dict__[name], field.sampled)
            elif isinstance(field, Channels):
                changes[name] = merge(self.__dict__[name], "mean")
            elif isinstance(field, Part):
                changes[name] = self.__dict__[name].merged(merge)
        if all(value is self.__dict__[name] for name, value in changes.items()):
            return self
        return self._changed(changes)

    def leaves(self) -> Iterator[Any]:
        """Values of all numbers, for shapes and libraries."""
        for _, field, value in self._free():
            if isinstance(field, (Param, Channels)):
                yield value
            elif isinstance(field, Part):
                yield from value.leaves()

    def leaf_paths(self) -> Iterator[str]:
        """The dotted path of each of `leaves`; "" for one that is no parameter."""
        for name, field, value in self._free():
            if isinstance(field, (Param, Channels)):
                yield name if isinstance(field, Param) else ""
            elif isinstance(field, Part):
                yield from (path and f"{name}.{path}" for path in value.leaf_paths())

    def holed(self) -> Iterator[Any]:
        """The numbers of parameters of which some are missing."""
        for name, field in self.fields.items():
            if name in self._holed:
                yield self.__dict__[name]
            elif isinstance(field, Part):
                yield from self.__dict__[name].holed()

    def is_oriented(self) -> bool:
        """Whether this, or a part of it, is `oriented`."""
        parts = (self.__dict__[name] for name, field in self.fields.items() if isinstance(field, Part))
        return self.oriented or any(p.is_oriented() for p in parts)

    def identity(self) -> object | None:
        """Something that this shares with its copies alone, if formulas may depend on more than declared fields."""
        if self.__dict__.keys() <= self.fields.keys() | _BESIDE_FIELDS:
            return None
        return self.__dict__.setdefault("_identity", object())

    def _key(self) -> tuple:
        return tuple((n, self.__dict__[n]) for n, _, _ in self._free())

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        mine, theirs = self._key(), other._key()
        return len(mine) == len(theirs) and all(
            a[0] == b[0] and _same(a[1], b[1]) for a, b in zip(mine, theirs, strict=True)
        )

    def __hash__(self) -> int:
        return hash((type(self), *(v for _, v in self._key() if isinstance(v, (float, str, Parametrised)))))

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in self.__dict__.items() if k not in ("_kept", "_plans", "_identity")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(freeze(state))  # pickles and deep copies forget it
        self.__dict__["_kept"] = self._keep()

    def __repr__(self) -> str:
        shown = [f"{n}={literal(v)}" for n, f, v in self._free() if not isinstance(f, (Table, Channels))]
        return f"{type(self).__name__}({', '.join(shown)})"

    def to_json(self) -> dict[str, Any]:
        """This value as JSON data: its class by name, its fields as numbers, lists, words and further objects."""
        if self._holed:
            raise ParameterError(
                f"{type(self).__name__}({next(iter(self._holed))}): masked numbers have no JSON form; fill them in"
            )
        values = {n: _json(v) for n, f, v in self._free() if not isinstance(f, (Table, Channels))}
        return {**json_name(type(self)), **values}


def freeze(data: Any) -> Any:
    """The same, with all arrays in it read-only: in dictionaries, lists, tuples and records."""
    if isinstance(data, dict) or is_dataclass(data):
        for x in (data if isinstance(data, dict) else vars(data)).values():
            freeze(x)
    elif isinstance(data, (list, tuple)):
        for x in data:
            freeze(x)
    return frozen(data)


def _is_named(kind: type[Parametrised]) -> bool:
    return kind.has_text and Parametrised not in kind.__bases__


def _same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    if ops.library_of_type(type(a)) is None or ops.library_of_type(type(b)) is None:
        return type(a) is type(b) and bool(a == b)
    return type(a) is type(b) and np.array_equal(ops.to_numpy(a), ops.to_numpy(b), equal_nan=True)


def literal(value: Any) -> str:
    """A value as it is written in a material expression."""
    if isinstance(value, np.ndarray):
        return repr(value.tolist()) if value.size <= 64 else f"array{value.shape}"
    return repr(value)


def _json(value: Any) -> Any:
    if isinstance(value, Parametrised):
        return value.to_json()
    if isinstance(value, (list, tuple)):
        return [_json(v) for v in value]
    return value if ops.library_of_type(type(value)) is None else ops.to_numpy(value).tolist()


def _unknown(owner: str, name: Any, known: list[str], what: str = "parameter") -> str:
    close = difflib.get_close_matches(name[:60] if isinstance(name, str) else "", known, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else "."
    return f"{owner} has no {what} {shown(name)}{hint} Known: {listed(known)}"


def listed(known: Sequence[str]) -> str:
    """Names in a message, of very many the first."""
    return ", ".join(known) if len(known) <= 100 else f"{', '.join(known[:100])} ... ({len(known)} in all)"
