"""Values made of declared parameters: equality, repr, replacing by dotted path, binding for evaluation.

How they are made is in `_making.py`, and how one looks into them in `_tree.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import NoneType
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import Fixed
from ..errors import ParameterError, UnwrittenError
from ._making import Made, to_write
from .classes import Docstring, register
from .exchange import Exchange
from .fields import Channels, Field, Numbers, Ours, Param, Part, Table, Wavelengths
from .spectrum import Spectrum, as_wavelengths, interpolated
from .state import Beside, Note
from .text import shown
from .value import Value

_PLAIN = (float, int, np.ndarray, list, tuple, np.float64, np.float32)
"""Types of numbers that are neither masked, nor named, nor of another library."""


class Parametrised(Made):
    """An immutable value made of declared fields: equality, repr, replace, paths and JSON come from the fields."""

    noun: ClassVar[str] = "a value"
    """What messages call it."""
    reflects: ClassVar[str] = "gn.Lambertian(0.5)"
    """What messages advise to write where it is given for a reflectance; {} stands for it."""
    has_text: ClassVar[bool] = True
    """Whether values of this class are written as expressions and as JSON."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        bases = [base for base in cls.__bases__ if issubclass(base, Parametrised)]
        own = vars(cls)
        # A field written again keeps its place; one that stands for another attribute of a base has its own.
        kept = [name for base in bases for name in (*base.fields, *(n for n in base.beside if n not in own))]
        declared = {name: _declared(cls, name) for name in kept} | own
        cls.fields = {name: x for name, x in declared.items() if isinstance(x, Field)}
        cls.beside = {name: x for name, x in declared.items() if isinstance(x, Beside)}
        cls.__doc__ = Docstring(vars(cls).get("__doc__"))  # type: ignore[assignment]  # composed when it is read
        register(cls)

    def _meant(self, name: str) -> str:
        for path, field, _, _ in self.walk():
            if name in (field.name, getattr(field, "alias", None)) and isinstance(field, Param):
                return f"; write m.parameters[{path!r}].value"
        return super()._meant(name)

    def at(self, wavelengths: Any) -> Self:
        """A copy with the numbers at wavelengths [nm]: of spectra, of formulas that know the wavelength, of tables.

        `m.at([450.0, 550.0, 650.0])` has a channel for each, and declares them; `m.at(550.0)` has no channel axis.
        Numbers of a material that has wavelengths are interpolated between these. Nothing is extrapolated: raises
        ParameterError outside a spectrum, where its numbers are out of bounds, and for channels without wavelengths,
        such as RGB.

        Example
        >>> paint = gn.Lambertian(gn.Spectrum([400.0, 700.0], [0.2, 0.8]))
        >>> print(gn.albedo(paint.at([450.0, 650.0]), [0, 0, 1]).round(3), paint.at(550.0).rho)
        [0.3 0.7] 0.5
        """
        return self._at(as_wavelengths(f"at({shown(wavelengths)})", wavelengths), None)

    def _at(self, wavelengths: Any, known: np.ndarray | None) -> Self:
        """See `at`; `known`: the wavelengths of channels, of the reflectance that this is a part of."""
        changes: dict[str, Any] = {}
        for name, field in self.fields.items():
            value = self.__dict__[name]
            if name in self._tied:
                continue
            if isinstance(field, Part):
                new = value._at(wavelengths, known)
            elif isinstance(field, Wavelengths):
                new = wavelengths
            elif isinstance(field, Exchange):
                new = field.at(f"{type(self).__name__}.{name}", value, known, wavelengths)
            elif isinstance(field, Param):
                new = interpolated(f"{type(self).__name__}.{name}", value, known, wavelengths)
                if isinstance(value, Spectrum):
                    field.check_at(type(self).__name__, new, wavelengths)
            else:
                continue
            if new is not value:
                changes[name] = new
        return self._with_paths([(name, name, value) for name, value in changes.items()]) if changes else self

    def _lacks(self, method: str) -> UnwrittenError:
        """The error of a call that needs a method which the class of this value does not write."""
        kind = type(self)
        return UnwrittenError(f"{kind.__name__} has no {method}, which this needs; {to_write(kind, method)}")

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
        if not any(
            name in self.fields and self.fields[name].is_table for name in changes
        ):  # as libraries converted them
            new._kept.update({n: x for n, x in self._kept.items() if not isinstance(self.fields.get(n), Numbers)})
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
            value: Any = self._numbers_of(name, field)
            if name in self._tied:
                new = changes.get(self._tied[name], value)
            elif isinstance(field, Numbers):
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
        """A copy, unchecked, with `change` applied to the value of every parameter, and to wavelengths.

        Example
        >>> print(*gn.GGX(0.1, 0.4).each(lambda value: 2.0 * value).leaves())
        0.2 0.8
        """
        return self.rebuilt(lambda _, field, value: value if isinstance(field, Channels) else change(value))

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
            if isinstance(field, Numbers):
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


def _declared(kind: type, name: str) -> Any:
    """The declaration of this name in a class, or in the nearest of its bases that has one."""
    return next(vars(base)[name] for base in kind.__mro__ if name in vars(base))
