"""JAX."""

from __future__ import annotations

import numpy as np

from ..fixed import Array, Fixed
from ..together import Together


class Jax(Together):
    def fixed(self, value: Fixed, like: Array) -> Array:
        from jax import ensure_compile_time_eval

        with ensure_compile_time_eval():  # inside jit or grad too the kept value is an array, not a tracer
            return super().fixed(value, like)

    def known(self, x: Array) -> np.ndarray | None:
        from jax.core import Tracer

        if isinstance(x, Tracer) or any(device.platform != "cpu" for device in x.devices()):
            return None
        return np.asarray(x)

    def op_to_index(self, x: Array) -> Array:
        return self.module.nan_to_num(x, nan=0.0, posinf=0.0, neginf=0.0).astype("int32")

    def op_stop_gradient(self, x: Array) -> Array:
        from jax.lax import stop_gradient

        return stop_gradient(x)


LIBRARY = Jax("jax.numpy", packages=("jax", "jaxlib"), special="jax.scipy.special", absolute="abs")
