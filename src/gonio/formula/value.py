"""Immutable values: their attributes, of which nothing can be changed; equality, repr, pickles and JSON."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, Self

import numpy as np

from ..arrays import Fixed, ops
from ..arrays.labels import Labels
from ..declared.namespace import places_of, value_at
from ..declared.notebooks import repr_html
from ..errors import AccessError, ParameterError, suggestion
from .classes import json_name
from .exchange import Exchange
from .fields import Channels, Field, Param, Table, Wavelengths
from .spectrum import Spectrum
from .state import Beside, State, freeze
from .text import literal
from .texture import Texture


class Value:
    """An immutable value of declared fields, with declared state and notes beside them."""

    _repr_html_ = repr_html

    fields: dict[str, Field] = {}  # noqa: RUF012  (each class gets its own)

    _beside: ClassVar[dict[str, Beside]] = {}
    """The declarations made with `state` and `note`."""
    _declares: ClassVar[Mapping[str, str]] = {}
    """Arguments of the constructor that are no fields -> their annotations."""
    _known_elsewhere: ClassVar[dict[str, str]] = {}
    """Names that other programs have for something -> what it is here, for messages."""
    _oriented: ClassVar[bool | None] = None
    """Whether x and y differ for this class: turning all directions about the normal may change its values. None: they
    do where they differ for a part."""

    _is_bound = False
    """Whether this is a copy for formulas, which holds the numbers they compute with and no notes."""
    _labels: Labels | None = None
    """The names of the axes of parameters, where some were given as arrays that have them: all maps have these axes."""
    _lazy = False
    """Whether parameters are computed later, by Dask."""
    _tied: dict[str, str]
    _kept: dict[str, Fixed] = {}  # noqa: RUF012  (each instance with arrays gets its own)
    _holed: frozenset[str] = frozenset()  # names of parameters of which some entries were masked, and are NaN
    _derived: dict[Any, Any]
    """Derived values, by the functions that compute them: shared by copies that differ in notes alone."""
    _alike: dict[Any, Any]
    """The same for what follows from the structure and from the shapes of numbers alone: shared by copies with other
    numbers."""

    def _hold(self, **attributes: Any) -> None:
        """Set declared state and notes, or a field as it is; for constructors alone."""
        for name, value in attributes.items():
            if isinstance(self._beside.get(name), State):
                hash(value)  # raises TypeError where it cannot be the key of a trace
            elif name in self.fields:
                self._kept.pop(name, None)
            elif name not in self._beside:
                raise AttributeError(f"{type(self).__name__} declares no {name!r}; write {name} = state() or note()")
            self.__dict__[name] = value

    def _given(self, name: str) -> Any:
        """State or a note that this very value was given; None where it is a default, or inferred."""
        return self.__dict__.get(name)

    def _keep(self) -> dict[str, Fixed]:
        """Arrays by name, which libraries convert once: tables, flat, and parameters given as NumPy arrays."""
        arrays = {n: (f, self.__dict__[n]) for n, f in self.fields.items() if isinstance(self.__dict__[n], np.ndarray)}
        return {n: Fixed(f.kept(a)) for n, (f, a) in arrays.items()}

    @classmethod
    def _made_of(cls, *attributes: dict[str, Any]) -> Self:
        """An instance with these attributes, unchecked."""
        new = object.__new__(cls)
        for some in attributes:
            new.__dict__.update(some)
        return new

    def _changed(self, values: dict[str, Any], kept: dict[str, Fixed] | None = None) -> Self:
        """A copy, unchecked, with other values of fields; `kept`: all arrays that libraries convert once."""
        kept = {n: x for n, x in self._kept.items() if n not in values} if kept is None else kept
        attributes = self.__dict__
        if not self._is_bound:  # bound copies hold tables by names of their own
            names = ("_tied", "_holed", "_labels", "_lazy", "fields", *self.fields, *self._beside)
            attributes = {n: attributes[n] for n in names if n in attributes}
        return self._made_of(attributes, values, {"_kept": kept, "_derived": {}, "_alike": {}})

    def _free(self) -> Iterator[tuple[str, Field, Any]]:
        """Declared fields with their values, without fields that are tied to another."""
        return ((name, field, self.__dict__[name]) for name, field in self.fields.items() if name not in self._tied)

    def _numbers_of(self, name: str, field: Field) -> Any:
        """The value of a field as formulas have it: of a matrix its diagonal."""
        if isinstance(field, Exchange) and name in self._kept:
            return self._kept[name].numbers
        return self.__dict__.get(name)

    @classmethod
    @cache
    def _aliases(cls) -> dict[str, str]:
        return {f.alias: n for n, f in cls.fields.items() if isinstance(f, Param) and f.alias}

    @classmethod
    @cache
    def _settable(cls) -> list[str]:
        return [n for n, f in cls.fields.items() if not isinstance(f, (Table, Channels, Wavelengths))]

    if not TYPE_CHECKING:  # to a type checker there are no such attributes

        def __getattr__(self, name: str) -> Any:
            """Called for what is not found: says which name was likely meant."""
            kind = type(self)
            if name == "_derived":
                raise AccessError(f"{kind.__name__} is not made yet: its __init__ ends with super().__init__(...)")
            if name.startswith("_") or hasattr(kind, name):  # protocols ask for many; a property has failed itself
                return object.__getattribute__(self, name)
            raise AccessError(f"{kind.__name__} has no attribute {name!r}{self._meant(name)}")

        def __call__(self, *args: Any, **kwargs: Any) -> NoReturn:
            raise ParameterError(f"{type(self).__name__} is no function{self._meant('__call__')}")

    def _meant(self, name: str) -> str:
        """The end of a message about an unknown name: "; write m.f(wi, wo)"."""
        if name in self._known_elsewhere:
            return f"; write {self._known_elsewhere[name]}"
        for place in places_of(name):  # of a public function
            needed = _needed(value_at(place))
            if needed[:1] == ["m"]:
                return f"; write {place}({', '.join(needed)})"
        return suggestion(name, [n for n in (*dir(self), *self.fields) if not n.startswith("_")])

    def __setattr__(self, name: str, value: Any) -> None:
        kind = type(self).__name__
        raise AccessError(f"{kind} is a value and cannot be changed; use m.replace({name}=...) for a new one")

    def __delattr__(self, name: str) -> None:
        raise AccessError(f"{type(self).__name__} is a value and cannot be changed")

    def _key(self) -> tuple[Any, ...]:
        return tuple((n, v) for n, _, v in self._free())

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        mine, theirs = dict(self._key()), dict(other._key())
        return mine.keys() == theirs.keys() and all(_same(value, theirs[name]) for name, value in mine.items())

    def __hash__(self) -> int:
        return hash((type(self), *(v for _, v in self._key() if isinstance(v, (float, str, Value)))))

    def __getstate__(self) -> dict[str, Any]:
        return {n: v for n, v in self.__dict__.items() if n not in ("_kept", "_derived", "_alike")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(freeze(state), _derived={}, _alike={})  # pickles and deep copies forget them
        self.__dict__["_kept"] = self._keep()

    def _written(self) -> dict[str, Any]:
        """What `repr` and JSON say of this value, by name: the free fields, without wavelengths that are not known."""
        free = ((n, v) for n, f, v in self._free() if not isinstance(f, (Table, Channels)))
        return {n: v for n, v in free if not (v is None and isinstance(self.fields[n], Wavelengths))}

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{n}={literal(v)}' for n, v in self._written().items())})"

    def to_json(self) -> dict[str, Any]:
        """This value as JSON data: its class by name, its fields as numbers, lists, words and further objects.

        Example
        >>> print((0.8 * gn.Lambertian(0.5)).to_json())
        {'type': 'Scaled', 'weight': 0.8, 'of': {'type': 'Lambertian', 'rho': 0.5}}
        """
        if self._holed:
            raise ParameterError(
                f"{type(self).__name__}({next(iter(self._holed))}): masked numbers have no JSON form; fill them in"
            )
        return {**json_name(type(self)), **{n: _json(v) for n, v in self._written().items()}}


def _needed(function: Any) -> list[str]:
    """The names of the arguments that a function does not do without; none of something else."""
    if not inspect.isfunction(function):
        return []
    parameters = inspect.signature(function).parameters.values()
    return [p.name for p in parameters if p.default is p.empty and p.kind is not p.VAR_KEYWORD]


def _same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    if ops.library_of_type(type(a)) is None and ops.library_of_type(type(b)) is None:
        return bool(a == b)
    if type(a) is not type(b):
        return False
    x, y = ops.to_numpy(a), ops.to_numpy(b)
    return np.array_equal(x, y, equal_nan=x.dtype.kind in "fc")  # words have no NaN to look for


def _json(value: Any) -> Any:
    if isinstance(value, (Value, Spectrum, Texture)):
        return value.to_json()
    if isinstance(value, (list, tuple)):
        return [_json(v) for v in value]
    return value if ops.library_of_type(type(value)) is None else ops.to_numpy(value).tolist()
