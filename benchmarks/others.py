"""The engines that gonio is measured against, each prepared to do the same work in the way it does it best."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from timing import THREADS, Engine

CHILD = Path(__file__).parent / "child.py"

Call = Callable[[], Any]


def use_two_threads() -> None:
    """Two threads for every engine that can be told; two processors for all of them."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:THREADS])
    for name, function in (("drjit", "set_thread_count"), ("torch", "set_num_threads")):
        try:
            getattr(__import__(name), function)(THREADS)
        except ImportError:
            continue


# Mitsuba, on its own evaluated arrays: one array per component. `evaluated` returns interactions seen from `w`.


def _plugin(variant: str, plugin: dict) -> tuple[Any, Any, Any]:
    import drjit as dr
    import mitsuba as mi

    mi.set_variant(variant)
    return mi, dr, mi.load_dict(plugin)


def _vectors(dr: Any, kind: Any, w: np.ndarray) -> Any:
    v = kind(np.ascontiguousarray(w.T, dtype=np.float32))
    dr.eval(v)
    dr.sync_thread()
    return v


def _interaction(mi: Any, dr: Any, w: np.ndarray) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, len(w))
    si.wi = _vectors(dr, mi.Vector3f, w)
    return si


def mitsuba_eval(variant: str, plugin: dict, w: np.ndarray, to: np.ndarray, target: float | None, name="") -> Engine:
    """`bsdf.eval` for si.wi = w and wo = to; it includes the cosine of `to`, which gonio's f does not."""

    def build() -> Call:
        mi, dr, bsdf = _plugin(variant, plugin)
        context, si, wo = mi.BSDFContext(), _interaction(mi, dr, w), _vectors(dr, mi.Vector3f, to)

        def call() -> Any:
            value = bsdf.eval(context, si, wo)
            dr.eval(value)
            dr.sync_thread()
            return value

        return call

    return Engine(name or "Mitsuba eval", build, target, lambda value: np.array(value).T / to[:, 2:])


def mitsuba_pdf(variant: str, plugin: dict, w: np.ndarray, to: np.ndarray, target: float | None) -> Engine:
    """`bsdf.pdf` for si.wi = w and wo = to."""

    def build() -> Call:
        mi, dr, bsdf = _plugin(variant, plugin)
        context, si, wo = mi.BSDFContext(), _interaction(mi, dr, w), _vectors(dr, mi.Vector3f, to)

        def call() -> Any:
            value = bsdf.pdf(context, si, wo)
            dr.eval(value)
            dr.sync_thread()
            return value

        return call

    return Engine("Mitsuba pdf", build, target, lambda value: np.array(value))


def mitsuba_sample(variant: str, plugin: dict, w: np.ndarray, u: np.ndarray, target: float | None) -> Engine:
    """`bsdf.sample` for si.wi = w: directions, weights and densities are stored."""

    def build() -> Call:
        mi, dr, bsdf = _plugin(variant, plugin)
        context, si, u2 = mi.BSDFContext(), _interaction(mi, dr, w), _vectors(dr, mi.Point2f, u)
        u1 = mi.Float(np.ascontiguousarray(u[::-1, 0], dtype=np.float32))
        dr.eval(u1)

        def call() -> Any:
            sample, weight = bsdf.sample(context, si, u1, u2)
            dr.eval(sample.wo, sample.pdf, weight)
            dr.sync_thread()
            return weight

        return call

    return Engine("Mitsuba sample", build, target, lambda weight: np.array(weight).mean(axis=-1))


def mitsuba_albedo(variant: str, plugin: dict, w: np.ndarray, samples: int) -> Call:
    """A call that returns the albedos (n,) for directions w (n, 3), by `samples` samples of each, anew every time."""
    mi, dr, bsdf = _plugin(variant, plugin)
    context, si = mi.BSDFContext(), _interaction(mi, dr, np.repeat(w, samples, axis=0))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, samples * len(w))

    def call() -> np.ndarray:
        _, weight = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d())
        total = dr.block_sum(weight[0], samples)
        sampler.schedule_state()
        dr.eval(total)
        dr.sync_thread()
        return total.numpy() / samples

    return call


# gonio's own formulas in array libraries, from NumPy arrays to stored results.


def drjit_f(m: Any, wi: np.ndarray, wo: np.ndarray, target: float | None, kind: str) -> Engine:
    """m.f on Dr.Jit arrays made from the NumPy arrays in the timed part; its Array3f holds a component per array.

    Dr.Jit takes NumPy's memory over without copying, and gives its results back in the same way.
    """

    def build() -> Call:
        import drjit as dr
        from drjit import llvm

        def vectors(w: np.ndarray) -> Any:
            return llvm.TensorXf(w) if kind == "TensorXf" else dr.unravel(llvm.Array3f, llvm.Float(w.reshape(-1)))

        def call() -> Any:
            value = m.f(vectors(wi), vectors(wo))
            dr.eval(value)
            dr.sync_thread()
            planar = kind == "Array3f" and dr.depth_v(value) > 1
            return [c.numpy() for c in value] if planar else value.numpy()

        return call

    return Engine(f"Dr.Jit {kind}, m.f", build, target, lambda v: np.stack(v, -1) if isinstance(v, list) else v)


def torch_f(m: Any, wi: np.ndarray, wo: np.ndarray, target: float | None) -> Engine:
    """torch.compile(m.f) in one graph, on tensors that share the memory of the NumPy arrays."""

    def build() -> Call:
        import torch

        tensors, f = (torch.from_numpy(wi), torch.from_numpy(wo)), torch.compile(m.f, fullgraph=True)

        def call() -> Any:
            with torch.inference_mode():
                return f(*tensors)

        return call

    return Engine("torch.compile(m.f)", build, target, lambda value: value.numpy())


def jax_f(m: Any, wi: np.ndarray, wo: np.ndarray, target: float | None) -> Engine:
    """jax.jit(m.f) called with the NumPy arrays, until the result is stored."""

    def build() -> Call:
        import jax

        f = jax.jit(m.f)
        return lambda: f(wi, wo).block_until_ready()

    return Engine("jax.jit(m.f)", build, target, np.asarray)


def numpy_f(m: Any, wi: np.ndarray, wo: np.ndarray, target: float | None, blocks: bool) -> Engine:
    """m.f without a compiled engine, in a process of its own that waits when it is not its turn.

    With `blocks` as gonio runs without its engine, in blocks on all threads; without, as one would write the formula
    down in NumPy: whole arrays, one thread. The time includes a message there and back, some 0.1 ms.
    """

    def build() -> Call:
        command = [sys.executable, str(CHILD), "numpy", "blocks" if blocks else "whole"]
        environment = {**os.environ, "GONIO_ENGINE": "numpy"}
        child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)
        assert child.stdin is not None and child.stdout is not None
        to_child, from_child = child.stdin, child.stdout
        pickle.dump((m, wi, wo), to_child)

        def call() -> None:
            to_child.write(b"\n")
            to_child.flush()
            if not from_child.readline():
                raise RuntimeError("the child process ended")

        weakref.finalize(call, child.kill)
        return call

    return Engine("NumPy, blocks and threads" if blocks else "plain NumPy", build, target)
