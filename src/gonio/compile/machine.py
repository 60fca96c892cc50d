"""The processor that kernels are compiled for, and the compiler: LLVM IR to machine code, by llvmlite."""

from __future__ import annotations

import importlib.util
import os
import platform
import sys
from functools import cache
from threading import Lock
from typing import Any

from ..errors import DependencyError
from .lanes import FLOAT32

_LOCK = Lock()  # LLVM's target machine serves one thread at a time


@cache
def processor() -> str:
    """What tells this processor from others, without asking LLVM: its name and features."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            lines = file.read(8192).split("\n\n")[0].splitlines()  # the first of several equal ones
        facts = [line for line in lines if line.startswith(("model name", "flags", "Features", "CPU"))]
    except OSError:
        facts = [platform.processor()]
    return " ".join([platform.machine(), sys.platform, *facts])


@cache
def lane_bits() -> int:
    """Bits of the widest vectors that this processor computes with; 0 where it has no fused multiply-add."""
    words = set(processor().split())
    if platform.machine() in ("aarch64", "arm64", "ARM64"):
        return 128
    if {"avx512f", "avx512dq", "avx512vl", "avx512bw"} <= words:
        return 512
    if {"avx2", "fma"} <= words:
        return 256
    if sys.platform.startswith("linux"):
        return 0
    features = _features()
    return 512 if features.get("avx512dq") else 256 if features.get("avx2") and features.get("fma") else 0


def lanes(dtype: str) -> int:
    """How many numbers of a dtype a kernel works on at a time."""
    return lane_bits() // (32 if dtype == FLOAT32 else 64)


def _features() -> dict[str, bool]:
    return dict(_llvm().get_host_cpu_features())


@cache
def _llvm() -> Any:
    try:
        import llvmlite.binding as llvm
    except (ImportError, OSError) as error:
        raise DependencyError(f"kernels need llvmlite, which cannot be imported: {error}") from None
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm


@cache
def _target_machine() -> Any:
    llvm = _llvm()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=_features_text(), opt=2, reloc="pic", codemodel="small"
    )


def _features_text() -> str:
    return _llvm().get_host_cpu_features().flatten()


@cache
def compiler() -> tuple[str, int]:
    """Which llvmlite there is, without importing it: what another has compiled is compiled anew."""
    found = importlib.util.find_spec("llvmlite")
    if found is None or found.origin is None:
        raise DependencyError("kernels need llvmlite, which is not installed")
    return found.origin, os.stat(found.origin).st_mtime_ns


def to_object(text: str) -> bytes:
    """The object file of a module of IR."""
    llvm = _llvm()
    with _LOCK:
        machine = _target_machine()
        module = llvm.parse_assembly(text)
        module.triple = machine.triple
        module.data_layout = str(machine.target_data)
        module.verify()
        options = llvm.create_pipeline_tuning_options()
        builder = llvm.create_pass_builder(machine, options)
        passes = llvm.create_new_function_pass_manager()
        passes.add_instruction_combine_pass()
        passes.add_simplify_cfg_pass()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)
        return machine.emit_object(module)


def to_assembly(text: str) -> str:
    """The assembly of a module of IR, to look at."""
    llvm = _llvm()
    with _LOCK:
        machine = _target_machine()
        return machine.emit_assembly(llvm.parse_assembly(text))


def linked(code: bytes) -> tuple[int, Any]:
    """The address of `kernel` in an object file that LLVM's own loader has put into memory, and what keeps it there."""
    llvm = _llvm()
    with _LOCK:
        empty = llvm.parse_assembly("")
        engine = llvm.create_mcjit_compiler(empty, _own_machine(), use_lmm=True)  # keeps sections within reach
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        return engine.get_function_address("kernel"), engine


def _own_machine() -> Any:
    """A target machine for one engine, which takes it over."""
    llvm = _llvm()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=_features_text(), opt=2, jit=True
    )
