"""Named axes of the maps in a value: all maps, those of parts too, have the same axes in the same order."""

from __future__ import annotations

from typing import Any, TypeVar

from ..arrays import frozen, labels
from ..arrays.labels import Labels
from ..errors import ParameterError
from . import tree
from .fields import Param, Part
from .value import Value

V = TypeVar("V", bound=Value)


def lay(m: Any, named: dict[str, Labels]) -> None:
    """Give all maps of a value that is made, those of parts too, the same axes, where any of them have names.

    `named`: parameters, with their axes.
    """
    parts = {n: m.__dict__[n] for n, field in m.fields.items() if isinstance(field, Part)}
    part_labels = {n: part._labels for n, part in parts.items() if part._labels is not None}
    if not named and not part_labels:
        return
    class_name, attributes = type(m).__name__, m.__dict__
    whole = labels.union([*named.values(), *part_labels.values()], class_name, ParameterError)
    for name, of in named.items():
        attributes[name] = frozen(whole.laid(attributes[name], of))
    for name, of in part_labels.items():
        attributes[name] = _laid(parts[name], whole, of)
    attributes.update({name: attributes[target] for name, target in m._tied.items()})
    for path, _, value, owner in tree.numbers(m):
        if getattr(value, "ndim", 0) > 1 and owner._labels is None and (owner is not m or path not in named):
            rule = f"a map without names for its axes, beside {', '.join(map(str, whole.dims)) or 'named channels'}"
            raise ParameterError(f"{class_name}: {path} is {rule}; expected a DataArray for each map, or for none")
    attributes["_labels"] = whole
    m._name_channels(whole)


def _laid(m: V, whole: Labels, of: Labels) -> V:
    """A copy whose maps have the axes of a whole that this is a part of; their own are `of`."""
    changes: dict[str, Any] = {}
    for name, field in m.fields.items():
        value = m.__dict__[name]
        if isinstance(field, Part):
            changes[name] = value if value._labels is None else _laid(value, whole, of)
        elif isinstance(field, Param):
            changes[name] = frozen(whole.laid(value, of))
    new = m._changed(changes)
    new.__dict__.update(_labels=whole)
    new.__dict__["_kept"] = new._keep()
    return new


def unlabelled(m: V) -> V:
    """The same without names of axes, for computations on plain arrays."""
    if m._labels is None:
        return m
    parts = {n: m.__dict__[n]._unlabelled for n, field in m.fields.items() if isinstance(field, Part)}
    return m._made_of(m.__dict__, parts, {"_labels": None})
