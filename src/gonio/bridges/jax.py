"""Materials as JAX pytrees: `import gonio.bridges.jax`, then pass materials through jax.grad, jax.jit and jax.tree.

The leaves are the numbers of `m.parameters`, in that order, of textures their texels; everything else (classes,
options, tables) is structure. `render` makes pictures that JAX differentiates.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..errors import DependencyError
from ..formula import tree

try:
    import jax
    import jax.numpy as jnp
except ImportError as error:
    raise DependencyError(f"gonio.bridges.jax needs JAX ({error}); pip install 'gonio[jax]'") from error

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..declared.arguments import Seed, checked
from ..formula.classes import ON_NEW
from ..formula.parametrised import Parametrised
from ..formula.texture import Texture
from ..scenes.asked import Samples, Size
from ..scenes.camera import View
from ._pictures import Pictures


def _flatten(m: Parametrised) -> tuple[list[Any], tuple[Any, ...]]:
    paths = tuple(m.parameters)
    return [p.value for p in m.parameters.values()], (tree.with_values(m, dict.fromkeys(paths)), paths)


def _unflatten(structure: tuple[Parametrised, tuple[str, ...]], leaves: Any) -> Parametrised:
    m, paths = structure
    return tree.with_values(m, dict(zip(paths, leaves, strict=True)))


def _register(kind: type[Parametrised]) -> None:
    jax.tree_util.register_pytree_node(kind, _flatten, _unflatten)


def _below(kind: type[Parametrised]) -> set[type[Parametrised]]:
    direct = kind.__subclasses__()
    return set(direct).union(*map(_below, direct))


def _texels(texture: Texture) -> tuple[list[Any], tuple[Any, ...]]:
    return [texture.texels], (texture.filter, texture.wrap, texture.path)


def _texture(structure: tuple[Any, ...], texels: Any) -> Texture:
    new = Texture.__new__(Texture)
    new.__setstate__(dict(zip(("texels", "filter", "wrap", "path"), (*texels, *structure), strict=True)))
    return new


jax.tree_util.register_pytree_node(Texture, _texels, _texture)
for _kind in _below(Parametrised):
    _register(_kind)
ON_NEW.append(_register)  # and all that are defined from now on


@checked
def render(
    m: Reflectance,
    lights: Light | Iterable[Light] | None = None,
    shape: Any = "sphere",
    size: Size = 512,
    samples: Samples = 32,
    seed: Seed = 0,
    channels: Any = None,
    camera: View | None = None,
) -> jax.Array:
    """The picture of `gn.render` as an array (H, W, C), a function of the JAX arrays among the numbers of m and lights.

    It may stand within jax.jit, jax.grad, jax.jvp and jax.vmap: the picture and its derivatives are compiled code that
    JAX calls back (`jax.pure_callback`), on the processor, in single precision. The derivatives are those of
    `gn.scenes.picture_jacobian`, by those numbers alone that JAX differentiates by, and of the first order. A number
    may be a scalar, or one for each channel. Linear radiance, 0 beside the shape; the coverage has no derivative.

    Arguments are those of `gn.render`, and are known when the function is compiled: but for the numbers they are
    structure. The same seed has the same noise in each step of an optimizer. A squared difference of a noisy picture is
    too large by the noise's variance, which an optimizer lowers too: take samples enough that this is little.

    Shapes   (H, W, C).
    Error    of samples, as gn.scenes.picture_jacobian's: no bias, for what sampling decides is held; edges of shadows
             stay where they are.
    Raises   ParameterError for numbers outside their bounds (within jax.jit, JAX' own error with the same text),
             textures whose texels JAX traces, the places and sizes of lights with edges, and lights that are functions.

    Example
    >>> import jax
    >>> import gonio.bridges.jax
    >>> def brightness(rho):
    ...     return gonio.bridges.jax.render(gn.Lambertian(rho), gn.ConstantLight(1.0), size=16)[8, 8, 0]
    ...
    >>> print(round(float(jax.jit(jax.grad(brightness))(0.5)), 3))
    1.0
    """
    settings = {"shape": shape, "size": size, "samples": samples, "seed": seed, "channels": channels, "camera": camera}
    pictures = Pictures(m, lights, _is_array, _is_traced, np.asarray, settings)
    values = tuple(map(_inexact, pictures.numbers.values()))
    if not any(map(_is_traced, values)):
        return jnp.asarray(pictures.picture(values))
    return _picture(pictures, values)


def _picture(pictures: Pictures, values: tuple[Any, ...]) -> jax.Array:
    job, matrix = pictures.slopes(None, ()).job, pictures.matrix
    size = pictures.settings["size"]

    def called(values: Sequence[Any], by: tuple[int, ...] | None) -> Any:
        """The picture, and its derivatives by some numbers, as JAX calls them back."""

        def found(*numbers: Any) -> tuple[np.ndarray, ...]:
            if by is None:
                return (pictures.picture(numbers),)
            picture, slopes = pictures.slopes(numbers, by).computed()
            return picture, *slopes

        counts = (job.channels, *(job.own for _ in by or ()))
        shapes = tuple(jax.ShapeDtypeStruct((size, size, n), jnp.float32) for n in counts)  # type: ignore[no-untyped-call]  # JAX's own
        return jax.pure_callback(found, shapes, *values, vmap_method="sequential")

    @jax.custom_jvp
    def picture(*values: Any) -> Any:
        return called(values, None)[0]

    @partial(picture.defjvp, symbolic_zeros=True)
    def _(values: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[Any, Any]:
        by = tuple(i for i, x in enumerate(tangents) if not isinstance(x, jax.custom_derivatives.SymbolicZero))
        pictures.slopes(None, by)  # what cannot be derived by is an error now
        found, *slopes = called(values, by)
        total = sum(slope * jnp.asarray(tangents[i], slope.dtype) for i, slope in zip(by, slopes, strict=True))
        return found, total if matrix is None else total @ matrix.astype(np.float32)

    found: jax.Array = picture(*values)
    return found


def _is_array(value: Any) -> bool:
    return isinstance(value, jax.Array)


def _is_traced(value: Any) -> bool:
    return isinstance(value, jax.core.Tracer)


def _inexact(value: jax.Array) -> jax.Array:
    return value if jnp.issubdtype(value.dtype, jnp.inexact) else value.astype(float)
