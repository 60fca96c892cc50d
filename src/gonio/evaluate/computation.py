"""Computations over several values at once: a material, lights, maps and numbers, with named inputs and results.

A formula of one reflectance is evaluated by `batch.run`. An estimator of light, or a walk over a surface, is a kernel
of several values: `composite` makes one of them, and a `Computation` names what goes in and what comes out. It is
compiled once for a structure; numbers, tables and arrays are arguments.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..arrays import Fixed
from ..arrays.kinds import SUMMED, TOTAL, VALUE
from ..errors import ArrayTypeError, NotFoundError, ParameterError
from ..formula import tree
from ..formula.fields import Field, param, part, table
from ..formula.parametrised import Parametrised
from ..formula.state import state
from ..formula.text import listed
from . import batch
from .tracing import Kernel, Task


class _Composite(Parametrised, has_text=False):
    """Values of any classes as one; formulas find each under its name."""

    _noun = "a composite"
    names: tuple[str, ...] = state(())

    def __init__(self, values: Mapping[str, Any]):
        fields, given = dict[str, Field](), dict[str, Any]()
        for name, value in values.items():
            if isinstance(value, (list, tuple)) and value and all(isinstance(x, Parametrised) for x in value):
                value = _Composite({str(i): x for i, x in enumerate(value)})
            if isinstance(value, Parametrised):
                fields[name] = part(Parametrised, None, name, sides="any")
            elif isinstance(value, Fixed):
                fields[name] = table(name)
            else:
                fields[name] = param(0.0, -math.inf, math.inf, name)
            fields[name].name = name
            given[name] = None if isinstance(value, Fixed) else value
        self._hold(names=tuple(values))
        self._set(given, fields=fields)
        self._kept.update({name: value for name, value in values.items() if isinstance(value, Fixed)})

    @property
    def parts(self) -> tuple[Any, ...]:
        """The values in their order."""
        return tuple(self.__dict__[name] for name in self.fields)


def composite(**values: Any) -> Parametrised:
    """Several values as one, for a `Computation`: its kernel reads them as `scene.material`, `scene.sun`, ...

    A value is a reflectance, a light or anything else that is made of declared parameters; a list of such (the kernel
    goes through `scene.lights.parts`); a number or an array (..., C), whose last axis is the channel axis; or a
    `Fixed` array for `ops.take`, flat, converted once for all composites that hold it.

    Example
    >>> from gonio.evaluate.computation import composite
    >>> scene = composite(material=gn.Lambertian(0.5), radiance=2.0)
    >>> print(scene.material.rho, scene.radiance)
    0.5 2.0
    """
    return _Composite(values)


class Computation:
    """A kernel with named inputs and results, over any composite.

    `kernel(scene, mean, *inputs)` is written on components, as formulas are: no axes, no channels, functions of `ops`
    alone. `scene` has the numbers of one channel; `mean` has them merged over the channels, for what must be the same
    in all of them, such as sampling. Each input is a tuple of components, in the order of `inputs`. It gives a tuple
    of the results, in the order of `results`.

    `inputs`: name -> the length of its vectors, the last axis of its array. The other axes broadcast against each
    other, and nothing is copied: pixels (P, 1, 9) and the points of each (1, S, 6) make a batch (P, S). What depends
    on pixels alone is computed once for all their points.

    `results`: name -> kind (`arrays/kinds.py`). `VALUE`, `SCALAR` and `VECTOR` are stored for each element of the
    batch. These are sums over its last axis, in double precision: `TOTAL` of a value, for each channel, `COUNT` of a
    number without channels, `SQUARE` the square of the total of a value.

    A trace and machine code belong to the classes and options in the composite, to the layouts of the arrays and to the
    number of channels; other numbers, tables and sizes compile nothing. PyTorch, JAX and Dr.Jit (tensors) run the
    kernel on arrays of their own, with their own derivatives.

    Example
    >>> from gonio.arrays.kinds import COUNT, TOTAL
    >>> from gonio.evaluate.computation import Computation, composite
    >>> def kernel(scene, mean, pixel, point):
    ...     return scene.gain * pixel[0] * point[0], 1.0 * (point[0] > 0.5)
    ...
    >>> sums = Computation(kernel, {"pixel": 1, "point": 1}, {"light": TOTAL, "bright": COUNT})
    >>> found = sums(composite(gain=[1.0, 2.0]), pixel=np.ones((3, 1, 1)), point=np.array([[[0.2], [0.6]]]))
    >>> print(found["light"], found["bright"])
    [[0.8 1.6]
     [0.8 1.6]
     [0.8 1.6]] [1. 1. 1.]
    """

    def __init__(self, kernel: Kernel, inputs: Mapping[str, int], results: Mapping[str, str]):
        self.kernel, self.inputs, self.results = kernel, dict(inputs), dict(results)
        self._task = Task(kernel, tuple(results.values()), tuple(inputs.values()))

    def __call__(self, scene: Parametrised, **arrays: Any) -> dict[str, Any]:
        """The results by name, for arrays of the inputs by name."""
        found = batch.compute(self._task, scene, self._ordered(arrays))
        return dict(zip(self.results, found, strict=True))

    def add(self, sums: Mapping[str, np.ndarray], scene: Parametrised, **arrays: Any) -> None:
        """Add to the arrays `sums`, by name, what the results come to: float64, in one piece of memory.

        For passes over the same pixels with other points each. `SQUARE` beside `TOTAL` tells how much the passes
        differ: after n of them the standard error of the mean pass is sqrt((square/n - (total/n)^2) / (n - 1)).
        Raises ParameterError unless all results are sums, ShapeError and ArrayTypeError for arrays that cannot take
        them.
        """
        if not SUMMED.issuperset(self._task.kinds):
            kept = [name for name, kind in self.results.items() if kind not in SUMMED]
            raise ParameterError(f"add: {listed(kept)} is stored for each element; expected sums alone; call instead")
        missing = [name for name in self.results if name not in sums]
        if missing:
            raise NotFoundError(
                f"add: no array for {listed(missing)}; expected one for each of {listed([*self.results])}"
            )
        into = [sums[name] for name in self.results]
        for name, x in zip(self.results, into, strict=True):
            if not isinstance(x, np.ndarray) or x.dtype != np.float64 or not x.flags.carray:
                what = f"{x.dtype} array" if isinstance(x, np.ndarray) else type(x).__name__
                rule = "expected one of float64, in one piece, that may be written to: numpy.zeros(shape)"
                raise ArrayTypeError(f"add: {name} is a {what}; {rule}")
        batch.compute(self._task._replace(adds=True), scene, self._ordered(arrays), into)

    def derivatives(self, scene: Parametrised, by: Sequence[str], **arrays: Any) -> tuple[dict[str, Any], list[Any]]:
        """The results, and the derivatives of the first one by parameters, in the same pass over the batch.

        `by`: paths of parameters, such as "material.distribution.alpha_x". A derivative has the shape and the kind of
        the result: that of each channel by the number of that channel, or by the one number of all channels. `mean` is
        held; where there is no channel axis it is the scene itself, so that kernels call `ops.stop_gradient` on what
        sampling decides. NumPy arrays only. Raises TraceError where the kernel cannot be traced.
        """
        kind = self._task.kinds[0]
        if kind not in (VALUE, TOTAL):
            rule = f"the first result is of kind {kind}; expected {VALUE} or {TOTAL}"
            raise ParameterError(f"derivatives: {rule}")
        paths = list(tree.leaf_paths(scene))
        wanted = [tree.located(scene, path) for path in by]
        unknown = [path for path in wanted if path not in paths]
        if unknown:
            raise NotFoundError(f"derivatives(by={listed(unknown)}): no number; expected some of {listed(paths)}")
        task = self._task.derivatives(tuple(paths.index(path) for path in wanted), ())
        found = batch.compute(task, scene, self._ordered(arrays))
        count = len(self.results)
        return dict(zip(self.results, found[:count], strict=True)), found[count:]

    def _ordered(self, arrays: Mapping[str, Any]) -> list[Any]:
        if arrays.keys() != self.inputs.keys():
            raise NotFoundError(f"got the inputs {listed([*arrays]) or 'none'}; expected {listed([*self.inputs])}")
        return [arrays[name] for name in self.inputs]
