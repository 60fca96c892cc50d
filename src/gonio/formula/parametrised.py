"""Values made of declared parameters: what their classes declare, how they are made and changed, their parameters.

What each of them holds is in `value.py`, and functions of all are in `tree.py`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from types import NoneType
from typing import Any, ClassVar, Self

import numpy as np

from ..arrays import Fixed, labels
from ..arrays.labels import Labels
from ..errors import NotFoundError, ParameterError, TooLargeError, UnwrittenError
from . import axes, tree
from .bounds import EVALUATIONS, NESTED
from .classes import ConstructorSignature, Docstring, register, to_write
from .exchange import Exchange
from .fields import Field, Numbers, Ours, Param, Parameter, Part, Table, Wavelengths, subclasses
from .spectrum import Spectrum, as_wavelengths, interpolated
from .state import Beside, derived
from .text import shown, unknown
from .value import Value

_PLAIN = (float, int, np.ndarray, list, tuple, np.float64, np.float32)
"""Types of numbers that are neither masked, nor named, nor of another library."""


class Parametrised(Value):
    """An immutable value made of declared fields: equality, repr, replace, paths and JSON come from the fields.

    A class says more of itself where it names its base; those derived from it say the same, unless they write it anew.

    oriented  whether x and y differ: turning all directions about the normal may change its values; if it does not say,
              whether they do for a part
    costs     of its formulas beside those of its parts, in simple formulas: there is a limit to how many nest
    repeats   how many times its formulas evaluate those of its parts, in other directions each time
    has_text  whether values are written as expressions and as JSON; lobes and tables are not

    Example
    >>> from gonio.authoring import Reflectance, param, tree
    >>> class Grooved(Reflectance, oriented=True):
    ...     "A surface that is brighter along x."
    ...     rho = param(0.5, 0.0, 1.0, "albedo")
    ...
    ...     def formula(self, wi, wo):
    ...         return self.rho * (1.0 + wi.x * wi.x * wo.x * wo.x) / (1.25 * np.pi)
    ...
    >>> print(tree.is_oriented(Grooved()))
    True
    """

    _noun: ClassVar[str] = "a value"
    """What messages call it."""
    _reflects: ClassVar[str] = "gn.Lambertian(0.5)"
    """What messages advise to write where it is given for a reflectance; {} stands for it."""
    _has_text: ClassVar[bool] = True
    _repeats: ClassVar[int] = 1
    """The number of times that formulas of this class evaluate those of its parts, in other directions each time."""

    _costs: ClassVar[int] = 0
    """The cost of the formulas of this class beside their parts, in simple formulas."""
    _lit_behind: ClassVar[Any] = ""
    """Why it cannot be what is lit and seen in front only; nothing where it can."""

    def __init_subclass__(
        cls,
        oriented: bool | None = None,
        costs: int | None = None,
        repeats: int | None = None,
        has_text: bool | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init_subclass__(**kwargs)
        said = {"_oriented": oriented, "_costs": costs, "_repeats": repeats, "_has_text": has_text}
        for name, value in said.items():
            word = name[1:]
            if isinstance(written := vars(cls).get(word), (bool, int)):
                head = f"class {cls.__name__}({cls.__bases__[0].__name__}, {word}={written!r})"
                raise ParameterError(
                    f"class {cls.__name__}: {word} says nothing in its body; write it beside the base: {head}"
                )
            if value is not None:
                setattr(cls, name, value)
        bases = [base for base in cls.__bases__ if issubclass(base, Parametrised)]
        written_here = vars(cls)
        # A field written again keeps its place; one that stands for another attribute of a base has its own.
        kept = [name for base in bases for name in (*base.fields, *(n for n in base._beside if n not in written_here))]
        declared = {name: _declared(cls, name) for name in kept} | written_here
        cls.fields = {name: x for name, x in declared.items() if isinstance(x, Field)}
        cls._beside = {name: x for name, x in declared.items() if isinstance(x, Beside)}
        cls.__doc__ = Docstring(vars(cls).get("__doc__"))  # type: ignore[assignment]  # composed when it is read
        register(cls)

    # How it is made.

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
        axes.lay(self, named)
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

    _unlabelled = derived(axes.unlabelled)
    """The same without names of axes, for computations on plain arrays."""

    def _name_channels(self, whole: Labels) -> None:
        """Take over names of channels. Overridden where there are any."""

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

    # Its numbers.

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
            for path, field, value, _ in tree.numbers(self)
            if isinstance(field, Param)
        }

    def _meant(self, name: str) -> str:
        for path, field, _, _ in tree.walk(self):
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
        return self._with_paths([(name, tree.located(self, name), value) for name, value in every.items()])

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
                alike = alike and value._alike is old._alike
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
        new = self._made_of({n: attributes[n] for n in (*self._beside, "fields") if n in attributes})
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


def _declared(kind: type, name: str) -> Any:
    """The declaration of this name in a class, or in the nearest of its bases that has one."""
    return next(vars(base)[name] for base in kind.__mro__ if name in vars(base))
