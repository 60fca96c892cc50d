"""Materials as JAX pytrees: `import gonio.bridges.jax`, then pass materials through jax.grad, jax.jit and jax.tree.

The leaves are the numbers of `m.parameters`, in that order; everything else (classes, options, tables) is structure.
"""

from __future__ import annotations

from typing import Any

from ..errors import DependencyError

try:
    import jax
except ImportError as error:
    raise DependencyError(f"gonio.bridges.jax needs JAX ({error}); pip install 'gonio[jax]'") from error

from ..formula.classes import ON_NEW
from ..formula.parametrised import Parametrised


def _flatten(m: Parametrised) -> tuple[list[Any], tuple[Any, ...]]:
    paths = tuple(m.parameters)
    return [p.value for p in m.parameters.values()], (m.with_values(dict.fromkeys(paths)), paths)


def _unflatten(structure: tuple[Parametrised, tuple[str, ...]], leaves: Any) -> Parametrised:
    m, paths = structure
    return m.with_values(dict(zip(paths, leaves, strict=True)))


def _register(kind: type[Parametrised]) -> None:
    jax.tree_util.register_pytree_node(kind, _flatten, _unflatten)


def _below(kind: type[Parametrised]) -> set[type[Parametrised]]:
    direct = kind.__subclasses__()
    return set(direct).union(*map(_below, direct))


for _kind in _below(Parametrised):
    _register(_kind)
ON_NEW.append(_register)  # and all that are defined from now on
