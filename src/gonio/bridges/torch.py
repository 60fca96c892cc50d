"""Materials as PyTorch modules, their numbers as `nn.Parameter`s that an optimizer can move; pictures as tensors."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..errors import DependencyError, NotFoundError
from ..formula import tree

try:
    import torch
except ImportError as error:
    raise DependencyError(f"gonio.bridges.torch needs PyTorch ({error}); pip install 'gonio[torch]'") from error

from ..base.light import Light
from ..base.reflectance import Reflectance
from ..declared.arguments import Seed, checked
from ..formula.texture import Texture
from ..scenes.asked import Samples, Size
from ..scenes.camera import View
from ._pictures import Pictures


class Material(torch.nn.Module):
    """A reflectance whose numbers are trainable: `Material(m)(wi, wo)` is `m.f(wi, wo)` with gradients.

    `trainable` lists the paths of `m.parameters` to train; without it all are. In `state_dict` the dots of a path
    are underscores. `clamp_()` moves the numbers back into their bounds, after a step of the optimizer.
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
            value = value.texels if isinstance(value, Texture) else value
            value = torch.tensor(value.tolist() if hasattr(value, "tolist") else value, dtype=dtype)
            self.register_parameter(name, torch.nn.Parameter(value))

    @property
    def reflectance(self) -> Reflectance:
        """The reflectance at the present values; it shares memory and gradients with the parameters."""
        return tree.with_values(self._start, {path: self._value(path, name) for path, name in self._names.items()})

    def _value(self, path: str, name: str) -> Any:
        start, tensor = self._start.parameters[path].value, getattr(self, name)
        return start.with_texels(tensor) if isinstance(start, Texture) else tensor

    def forward(self, wi: Any, wo: Any, uv: Any = None) -> Any:
        """f(wi, wo), at places uv of a material with textures, whose texels are numbers to be trained too."""
        return self.reflectance.f(wi, wo, uv=uv)

    @torch.no_grad()
    def clamp_(self) -> None:
        """Move every number into the bounds of its parameter."""
        for path, name in self._names.items():
            p = self._start.parameters[path]
            getattr(self, name).clamp_(p.low, p.high)


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
) -> torch.Tensor:
    """The picture of `gn.render` as a tensor (H, W, C), with gradients to tensors among the numbers of m and lights.

    The picture and its derivatives are compiled code, computed together on the processor, in single precision: the
    derivatives are those of `gn.scenes.picture_jacobian` by all numbers that require a gradient, and `backward()` adds
    them up. A number may be a scalar, or one for each channel. Where no tensor requires a gradient, and under
    `torch.no_grad()`, the picture alone is computed. Linear radiance, 0 beside the shape; coverage has no derivative.

    Arguments are those of `gn.render`. The same seed has the same noise in each step of an optimizer. A squared
    difference of a noisy picture is too large by the noise's variance, which an optimizer lowers too: take samples
    enough that this is little.

    Shapes   (H, W, C), on the device of the tensors.
    Error    of samples, as gn.scenes.picture_jacobian's: no bias, for what sampling decides is held; edges of shadows
             stay where they are.
    Raises   ParameterError for numbers outside their bounds (`Material.clamp_`), textures whose texels require a
             gradient, the places and sizes of lights with edges, and lights that are functions.

    Example
    >>> import torch
    >>> from gonio.bridges.torch import render
    >>> rho = torch.tensor([0.2, 0.4, 0.8], requires_grad=True)
    >>> picture = render(gn.Lambertian(rho), gn.ConstantLight(1.0), size=16)
    >>> picture[8, 8].sum().backward()
    >>> print(picture.shape, rho.grad.numpy().round(3))
    torch.Size([16, 16, 3]) [1. 1. 1.]
    """
    settings = {"shape": shape, "size": size, "samples": samples, "seed": seed, "channels": channels, "camera": camera}
    pictures = Pictures(m, lights, _is_tensor, _needs_gradient, _numpy, settings)
    values = [*pictures.numbers.values()]
    by = tuple(i for i, value in enumerate(values) if _needs_gradient(value))
    if by:
        picture: torch.Tensor = _PictureGradient.apply(pictures, by, *values)[0]
        return picture
    tensor = torch.from_numpy(pictures.picture([_numpy(value) for value in values]))
    return tensor.to(values[0].device) if values else tensor


class _PictureGradient(torch.autograd.Function):
    """The picture, and its derivatives, which are constants."""

    @staticmethod
    def forward(pictures: Pictures, by: tuple[int, ...], *values: torch.Tensor) -> tuple[torch.Tensor, ...]:
        picture, slopes = pictures.slopes([_numpy(value) for value in values], by).computed()
        return tuple(torch.from_numpy(x).to(values[by[0]].device) for x in (picture, *slopes))

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: tuple[torch.Tensor, ...]) -> None:
        pictures, ctx.by, *values = inputs
        ctx.matrix = pictures.matrix
        ctx.mark_non_differentiable(*output[1:])
        ctx.save_for_backward(*output[1:], *(values[i] for i in ctx.by))
        ctx.count = len(values)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, gradient: torch.Tensor, *_: Any) -> tuple[Any, ...]:
        count = len(ctx.by)
        slopes, values = ctx.saved_tensors[:count], ctx.saved_tensors[count:]
        if ctx.matrix is not None:
            gradient = gradient @ torch.as_tensor(ctx.matrix, dtype=gradient.dtype, device=gradient.device).T
        gradients: list[Any] = [None] * ctx.count
        for i, slope, value in zip(ctx.by, slopes, values, strict=True):
            each = (gradient.double() * slope).sum(dim=(0, 1))
            gradients[i] = each.sum_to_size(value.shape).to(value)
        return None, None, *gradients


def _is_tensor(value: Any) -> bool:
    return isinstance(value, torch.Tensor)


def _needs_gradient(value: Any) -> bool:
    return _is_tensor(value) and value.requires_grad and torch.is_grad_enabled()


def _numpy(value: torch.Tensor) -> Any:
    return value.detach().cpu().double().numpy()
