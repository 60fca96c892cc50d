"""Materials as PyTorch modules: their numbers as `nn.Parameter`s that an optimiser can move."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..errors import DependencyError, NotFoundError

try:
    import torch
except ImportError as error:
    raise DependencyError(f"gonio.bridges.torch needs PyTorch ({error}); pip install 'gonio[torch]'") from error

from ..base.reflectance import Reflectance


class Material(torch.nn.Module):
    """A reflectance whose numbers are trainable: `Material(m)(wi, wo)` is `m.f(wi, wo)` with gradients.

    `trainable` lists the paths of `m.parameters` to train; without it all are. In `state_dict` the dots of a path
    are underscores. `clamp_()` moves the numbers back into their bounds, after a step of the optimiser.
    """

    def __init__(self, m: Reflectance, trainable: Iterable[str] | None = None, dtype: torch.dtype = torch.float32):
        super().__init__()
        self._start = m
        self._names: dict[str, str] = {}
        for path in m.parameters if trainable is None else trainable:
            if path not in m.parameters:
                raise NotFoundError(f"trainable={path!r}: no such parameter; known: {', '.join(m.parameters)}")
            name = path.replace(".", "_")
            self._names[path] = name
            value = m.parameters[path].value
            value = torch.tensor(value.tolist() if hasattr(value, "tolist") else value, dtype=dtype)
            self.register_parameter(name, torch.nn.Parameter(value))

    @property
    def reflectance(self) -> Reflectance:
        """The reflectance at the present values; it shares memory and gradients with the parameters."""
        return self._start.with_values({path: getattr(self, name) for path, name in self._names.items()})

    def forward(self, wi: Any, wo: Any) -> Any:
        """f(wi, wo)."""
        return self.reflectance.f(wi, wo)

    @torch.no_grad()
    def clamp_(self) -> None:
        """Move every number into the bounds of its parameter."""
        for path, name in self._names.items():
            p = self._start.parameters[path]
            getattr(self, name).clamp_(p.low, p.high)
