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

from ..formula.fields import CLASSES
from ..formula.parametrised import Parametrised


def _flatten(m: Parametrised) -> tuple[list[Any], tuple]:
    paths = tuple(m.parameters)
    return [p.value for p in m.parameters.values()], (m.with_values(dict.fromkeys(paths)), paths)


def _unflatten(structure: tuple, leaves: Any) -> Parametrised:
    m, paths = structure
    return m.with_values(dict(zip(paths, leaves, strict=True)))


def register() -> None:
    """Make pytrees of all classes known so far; call it again after defining a model of your own."""
    for kind in CLASSES.values():
        if kind not in _REGISTERED:
            jax.tree_util.register_pytree_node(kind, _flatten, _unflatten)
            _REGISTERED.add(kind)


_REGISTERED: set[type] = set()
register()
