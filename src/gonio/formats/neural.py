"""Neural-BRDF's `.h5`: weights of a small network that was fitted to a MERL measurement, as Keras keeps them.

HDF5 with the datasets kernel:0 and bias:0 of dense_1 (6, 21), dense_2 (21, 21) and dense_3 (21, 3), f32: 675 numbers.
Known from the sources of asztr's Neural-BRDF, and checked against three of its published files.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..arrays import frozen, ops
from ..errors import FormatError, ParameterError, needed
from ..files import replacing
from ..formula.direction import Direction, half_difference
from ..formula.fields import Table, channels, table
from ..formula.state import derived
from ..tables.drawing import Sampled

if TYPE_CHECKING:
    import xarray

NAME = "Neural-BRDF"
SUFFIXES = (".h5",)
DESCRIPTION = "weights of a network fitted to a MERL measurement (Sztrajman et al. 2021)"
ORACLE = "real files: the formula in NumPy, and published fits of the same materials"
NO_LAYOUT = "weights of a network, no table"

MAGIC = b"\x89HDF\r\n\x1a\n"
LARGEST = 1 << 22  # most bytes that such a file has; published ones have 18 736
SHAPES = ((6, 21), (21, 21), (21, 3))


class Neural(Sampled):
    """f = exp(W3 relu(W2 relu(W1 x + b1) + b2) + b3) - 1, x = (sin(theta_h), 0, cos(theta_h), d).

    d = (sin(theta_d) cos(phi_d), sin(theta_d) sin(phi_d), cos(theta_d)): wi as seen from the half vector, as in MERL's
    angles. f can be negative, down to -1 (the authors' renderer makes such values 0), and is not reciprocal, as the
    network was not made so.

    Sampling: see `Sampled`.

    Shapes   kernels: (6, 21), (21, 21), (21, 3), biases: (21,), (21,), (3,). f: (..., 3), RGB.
    Units    f: 1/sr.
    Error    rounding; float32 against float64: 2e-6 of the largest f.
    Source   Sztrajman, Rainer, Ritschel & Weyrich 2021, "Neural BRDF representation and importance sampling",
             Computer Graphics Forum 40(6).
    """

    format = NAME
    quantity = "weights of a network"
    breaks: ClassVar[dict[str, str]] = {
        "positivity": "nothing keeps the fitted network above 0",
        "reciprocity": "nothing makes the fitted network reciprocal",
        "energy": "nothing keeps the fitted network below what a surface can reflect",
        "furnace": "nothing keeps the fitted network below what a surface can reflect",
    }

    kernel_1 = table("W1, by input and neuron")
    bias_1 = table("b1")
    kernel_2 = table("W2")
    bias_2 = table("b2")
    kernel_3 = table("W3")
    bias_3 = table("b3")
    channel = channels("red, green, blue")
    channel_names = ("R", "G", "B")

    def __init__(self, kernels: Sequence[np.ndarray], biases: Sequence[np.ndarray], path: str = ""):
        for k, (kernel, bias, shape) in enumerate(zip(kernels, biases, SHAPES, strict=True), start=1):
            if np.shape(kernel) != shape or np.shape(bias) != shape[1:]:
                got = f"layer {k} has shapes {np.shape(kernel)}, {np.shape(bias)}"
                raise ParameterError(f"Neural: {got}, expected {shape}, {shape[1:]}")
        layers = {f"kernel_{k}": ops.numbers(x).astype("f4") for k, x in enumerate(kernels, start=1)}
        layers |= {f"bias_{k}": ops.numbers(x).astype("f4") for k, x in enumerate(biases, start=1)}
        super().__init__(path, {"weights": sum(x.size for x in layers.values())}, **layers, channel=3)

    @derived
    def values(self) -> np.ndarray:
        """All weights and biases, in the order of the fields."""
        tables = (self.__dict__[name] for name, field in self.fields.items() if isinstance(field, Table))
        return frozen(np.concatenate([x.ravel() for x in tables]))

    @property
    def valid(self) -> np.ndarray:
        """True where a weight is a number."""
        return np.isfinite(self.values)

    @property
    def data(self) -> xarray.Dataset:
        """Kernels and biases."""
        import xarray

        variables: dict[str, Any] = {}
        for k in (1, 2, 3):
            variables[f"kernel_{k}"] = ((f"layer_{k - 1}", f"layer_{k}"), self.__dict__[f"kernel_{k}"])
            variables[f"bias_{k}"] = ((f"layer_{k}",), self.__dict__[f"bias_{k}"])
        return xarray.Dataset(variables, attrs={"quantity": self.quantity, "source": self.path})

    def formula(self, wi: Direction, wo: Direction) -> Any:
        theta_h, theta_d, phi_d = half_difference(wi, wo)
        s = ops.sin(theta_d)
        x = [ops.sin(theta_h), 0.0, ops.cos(theta_h), s * ops.cos(phi_d), s * ops.sin(phi_d), ops.cos(theta_d)]
        values = self.__dict__
        layers = [(values[f"kernel_{k}"], values[f"bias_{k}"], width) for k, (_, width) in enumerate(SHAPES, start=1)]
        return ops.exp(ops.network(layers, x, ops.to_index(self.channel))) - 1.0


def matches(head: bytes, size: int) -> bool:
    """Whether a file that starts so can be one of these: a small HDF5 file in which Keras' layers are named."""
    return head.startswith(MAGIC) and size <= LARGEST and (b"dense_1" in head or b"keras" in head)


def read(path: Path) -> Neural:
    """The network in a file. Raises FormatError where its layers are others."""
    with needed(f"{path}: reading HDF5 needs h5py", "install it with: pip install h5py"):
        import h5py
    if (size := Path(path).stat().st_size) > LARGEST:
        raise FormatError(f"{path}: {size} bytes, expected a few weights, in at most {LARGEST}")
    try:
        with h5py.File(path, "r") as file:
            kernels, biases = zip(*(_layer(file, k, shape) for k, shape in enumerate(SHAPES, start=1)), strict=True)
    except (FileNotFoundError, MemoryError):
        raise
    except Exception as error:  # h5py raises any of damaged files
        raise FormatError(f"{path}: damaged, or no network of 6, 21, 21 and 3 neurons: {error}") from None
    return Neural(kernels, biases, str(path))


def _layer(file: Any, k: int, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Kernel and bias of a layer; types and shapes are compared before anything is read, and no other file is."""
    arrays = []
    for what, expected in (("kernel:0", shape), ("bias:0", shape[1:])):
        at = file
        for name in (f"dense_{k}", f"dense_{k}", what):
            if type(at.get(name, getlink=True)).__name__ != "HardLink":
                raise FormatError(f"dense_{k}: {name} is missing, or in another file")
            at = at[name]
        if at.shape != expected or at.dtype.kind != "f" or at.external or at.is_virtual:
            raise FormatError(f"dense_{k}/{what}: {at.dtype} of shape {at.shape}, expected floats of shape {expected}")
        arrays.append(at[()].astype("f4"))
    return arrays[0], arrays[1]


def write(m: Neural, path: Path) -> None:
    """Write the weights in the same layout. Raises ParameterError for other materials."""
    import h5py

    if not isinstance(m, Neural):
        raise ParameterError(f"{m!r:.80}: expected a Neural-BRDF; other materials are not fitted here")
    content = io.BytesIO()  # the library does not survive a full disk
    with h5py.File(content, "w") as file:
        names = [f"dense_{k}" for k in (1, 2, 3)]
        file.attrs["layer_names"] = np.array([*names, "lambda_1"], "S8")
        for k, name in enumerate(names, start=1):
            group = file.create_group(name)
            group.attrs["weight_names"] = np.array([f"{name}/kernel:0", f"{name}/bias:0"], "S16")
            for what in ("kernel", "bias"):
                group.create_dataset(f"{name}/{what}:0", data=m.__dict__[f"{what}_{k}"])
        file.create_group("lambda_1").attrs["weight_names"] = np.empty(0)
    with replacing(path) as temporary:
        temporary.write_bytes(content.getbuffer())
