"""Making a value: the arguments of its constructor checked and stored, axes laid out, its size; copies, unchecked."""

from __future__ import annotations

import inspect
from functools import cache
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import frozen, labels
from ..arrays.labels import Labels
from ..errors import NotFoundError, ParameterError, TooLargeError
from . import tree
from .bounds import EVALUATIONS, NESTED
from .classes import ConstructorSignature
from .fields import Field, Param, Part, Table, subclasses
from .state import derived
from .text import shown, unknown
from .value import Value


class Made(Value):
    """A value as constructors make it."""

    _repeats: ClassVar[int] = 1
    """The number of times that formulas of this class evaluate those of its parts, in other directions each time."""

    _costs: ClassVar[int] = 0
    """The cost of the formulas of this class beside their parts, in simple formulas."""

    __signature__ = ConstructorSignature()

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        class_name, fields, settable = type(self).__name__, self.fields, self._settable()
        if missing := self._unwritten():
            finished = subclasses(type(self))
            advice = f"use one of {finished}" if finished else "; ".join(to_write(type(self), x) for x in missing)
            raise ParameterError(f"{class_name}(): an abstract base, without {' and '.join(missing)}; {advice}")
        if len(args) > len(settable):
            names = ", ".join(settable)
            raise ParameterError(f"{class_name}: got {len(args)} values, expected at most {len(settable)}: {names}")
        declared = {n: kwargs.pop(n) for n in self._declares if n in kwargs and n not in fields}
        values, aliases = dict(zip(settable, args, strict=False)), self._aliases()
        for name, value in kwargs.items():
            target = aliases.get(name, name)
            if target not in fields:
                allowed = [*settable, *aliases]
                raise NotFoundError(unknown(class_name, name, allowed) + self._of_a_part(name))
            if target in values:
                raise ParameterError(f"{class_name}: {target} is given twice")
            values[target] = value
        self._set(values)
        self.validate()
        self._take(declared)

    def _take(self, declared: dict[str, Any]) -> None:
        """Become what arguments that are no fields say, see `_declares`; for constructors alone."""
        arguments = {name: value for name, value in declared.items() if value is not None}
        if arguments:
            attributes = dict(self._declared(**arguments).__dict__)
            self.__dict__.clear()
            self.__dict__.update(attributes)

    def _declared(self, **arguments: Any) -> Self:
        """A copy that arguments which are no fields have changed."""
        return self

    @classmethod
    @cache
    def _unwritten(cls) -> list[str]:
        """The abstract methods that neither this class nor a base of it writes: those of an abstract base."""
        names = [n for base in cls.__mro__ for n, x in vars(base).items() if getattr(x, "__isabstractmethod__", False)]
        return [name for name in names if getattr(getattr(cls, name), "__isabstractmethod__", False)]

    @classmethod
    def _of_a_part(cls, name: str) -> str:
        """A hint, where a part that the class has by default knows a name that the class does not."""
        for part_name, field in cls.fields.items():
            if isinstance(field, Part) and field.default is not None:
                part = field.check(cls.__name__, field.default)
                if name in part.fields or name in part._aliases():
                    return f"; write {part_name}={type(part).__name__}({name}=...)"
        return ""

    def _set(self, values: dict[str, Any], **changes: dict[str, Field]) -> None:
        """Check and store values of fields, or their defaults. `changes`: `fields=...`, if not the class's own."""
        self.__dict__.update(changes)
        attributes, tied, holed, named = self.__dict__, {}, set(), {}
        for name, field in self.fields.items():
            value = values.get(name, field.default)
            if isinstance(field, Param) and isinstance(value, str) and value == field.default:
                tied[name] = value
                value = attributes[value]
            elif not (isinstance(field, Table) and value is None):
                if isinstance(field, Param) and labels.is_named(value):
                    value, named[name] = labels.taken(value, f"{type(self).__name__}({name})", ParameterError)
                value = self._fitting(field, value)
            attributes[name] = value
            if isinstance(field, Param) and isinstance(value, np.ndarray) and np.isnan(value).any():
                holed.add(name)
        attributes.update(_tied=tied)
        if any(labels.is_lazy(v) or getattr(v, "_lazy", False) for v in attributes.values()):
            attributes["_lazy"] = True
        self._lay(named)
        attributes.update(_holed=frozenset(holed), _derived={}, _alike={}, _kept=self._keep())
        self._check_size()

    def _fitting(self, field: Field, value: Any) -> Any:
        """The value of a field, checked. Raises TooLargeError where there is no memory for it."""
        class_name = type(self).__name__
        try:
            return field.check(class_name, value)
        except TooLargeError:
            raise
        except MemoryError:
            argument = f"{class_name}({field.name}={shown(value)})"
            raise TooLargeError(f"{argument}: no memory for it; expected fewer numbers") from None

    def _lay(self, named: dict[str, Labels]) -> None:
        """Give all maps, those of parts too, the same axes in the same order, where any of them have names.

        `named`: parameters, with their axes.
        """
        parts = {n: self.__dict__[n] for n, field in self.fields.items() if isinstance(field, Part)}
        part_labels = {n: part._labels for n, part in parts.items() if part._labels is not None}
        if not named and not part_labels:
            return
        class_name, attributes = type(self).__name__, self.__dict__
        whole = labels.union([*named.values(), *part_labels.values()], class_name, ParameterError)
        for name, of in named.items():
            attributes[name] = frozen(whole.laid(attributes[name], of))
        for name, of in part_labels.items():
            attributes[name] = parts[name]._laid(whole, of)
        attributes.update({name: attributes[target] for name, target in self._tied.items()})
        for path, _, value, owner in tree.numbers(self):
            if getattr(value, "ndim", 0) > 1 and owner._labels is None and (owner is not self or path not in named):
                rule = f"a map without names for its axes, beside {', '.join(map(str, whole.dims)) or 'named channels'}"
                raise ParameterError(f"{class_name}: {path} is {rule}; expected a DataArray for each map, or for none")
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
    def _unlabelled(self) -> Self:
        """The same without names of axes, for computations on plain arrays."""
        if self._labels is None:
            return self
        parts = {n: self.__dict__[n]._unlabelled for n, field in self.fields.items() if isinstance(field, Part)}
        return self._made_of(self.__dict__, parts, {"_labels": None})

    @derived
    def _size(self) -> tuple[int, int]:
        """The depth of nested parts, and the number of formulas to evaluate."""
        sizes = [part._size for part in tree.components(self)]
        evaluations = self._costs + self._repeats * sum(n for _, n in sizes)
        return 1 + max((depth for depth, _ in sizes), default=0), max(1, evaluations)

    def _check_size(self) -> None:
        """Raises ParameterError where parts are nested too deep, or there are too many formulas."""
        nested, evaluations = self._size
        if nested > NESTED:
            excess = f"nested {nested} deep, expected at most {NESTED}; write factors as one, a sum of sums as one sum"
            raise ParameterError(f"{type(self).__name__}: {excess}")
        if evaluations > EVALUATIONS:
            excess = f"as large as a sum of {evaluations} terms, expected at most {EVALUATIONS}; add fewer terms"
            raise ParameterError(f"{type(self).__name__}: {excess}, or nest fewer normal maps and coats in one another")

    def validate(self) -> None:
        """Rules between fields; raises ParameterError. Overridden where there are any."""


def to_write(cls: type, method: str) -> str:
    """What to write in a class: "write def formula(self, wi, wo) in it: f [1/sr] for directions above ..."."""
    function = getattr(cls, method, None)
    if not inspect.isfunction(function):
        return f"write {method} in the class"
    arguments, doc = ", ".join(inspect.signature(function).parameters), (function.__doc__ or "").partition("\n\n")[0]
    return f"write def {method}({arguments}) in the class: {' '.join(doc.split())}"
