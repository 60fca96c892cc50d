"""Dask, whose arrays are computed later, in chunks: `evaluate/labelled.py` runs whole calls on these."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..fixed import Array
from ..interface import Library


class Dask(Library):
    def in_chunks(
        self,
        function: Callable[..., Any],
        arrays: Sequence[Array],
        axes: Sequence[str],
        of: Sequence[str],
        **sizes: int,
    ) -> list[Array]:
        """The results of a function that is called later, on NumPy arrays: chunks of these, which broadcast.

        `axes`: the name of the last axis of each array, which is not cut, or ""; `of`: that of each result, whose
        length is in `sizes`.
        """
        signature = f"{','.join(f'({axis})' for axis in axes)}->{','.join(f'({axis})' for axis in of)}"
        many = len(of) > 1
        out = self.module.apply_gufunc(
            function if many else lambda *chunks: function(*chunks)[0],
            signature,
            *arrays,
            output_sizes=sizes,
            output_dtypes=[float] * len(of) if many else float,
            allow_rechunk=True,
        )
        return list(out) if many else [out]


LIBRARY = Dask("dask.array", packages=("dask",))
