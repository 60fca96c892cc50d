"""The processor that kernels are compiled for, and the compiler: LLVM IR to machine code, by llvmlite."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import sys
from functools import cache
from threading import RLock
from typing import Any

from ...errors import DependencyError, ParameterError
from .. import elf
from .lanes import FLOAT32
from .roots import Times

LOCK = RLock()
"""The lock held while a kernel is compiled: LLVM's target machine serves one thread at a time. A fork waits for it,
since in the child nobody would release the locks of another thread: this one, LLVM's, or a module's being imported."""
if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=LOCK.acquire, after_in_parent=LOCK.release, after_in_child=LOCK.release)

_ENDS = 1 << 14  # bytes at either end of LLVM's library


@cache
def processor() -> str:
    """The identity of this processor: its name and features, as LLVM or else the system names them, and what part of
    its vectors is used (GONIO_LANES)."""
    limit = [] if lane_bits() == _own_bits() else [f"{lane_bits()} bits"]
    return " ".join([platform.machine(), sys.platform, *_facts(), *limit])


@cache
def _facts() -> tuple[str, ...]:
    return _cpuinfo() or (_llvm().get_host_cpu_name(), _features_text())


@cache
def _cpuinfo() -> tuple[str, ...]:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            lines = file.read(8192).split("\n\n")[0].splitlines()  # the first of several equal ones
    except OSError:
        return ()
    return tuple(line for line in lines if line.startswith(("model name", "flags", "Features", "CPU")))


@cache
def lane_bits() -> int:
    """Bits of the widest vectors that kernels compute with; 0 where the processor has no fused multiply-add."""
    return min(_own_bits(), 32 * _most_lanes())


@cache
def _most_lanes() -> int:
    """GONIO_LANES: float32 numbers in a vector at most, for kernels like those of a processor with shorter vectors."""
    text = os.environ.get("GONIO_LANES", "")
    if text not in ("", "4", "8", "16"):
        raise ParameterError(f"GONIO_LANES={text!r}: expected 4, 8 or 16, float32 numbers in a vector; or unset it")
    return int(text or 16)


def optimizes() -> bool:
    """Whether machine code is made to run fast; with GONIO_OPTIMIZE=off it is made fast instead."""
    text = os.environ.get("GONIO_OPTIMIZE", "")
    if text not in ("", "off"):
        raise ParameterError(f"GONIO_OPTIMIZE={text!r}: expected off, code that is made quickly; or unset it")
    return not text


@cache
def _own_bits() -> int:
    words = set(" ".join(_facts()).split())
    if platform.machine() in ("aarch64", "arm64", "ARM64"):
        return 128
    if {"avx512f", "avx512dq", "avx512vl", "avx512bw"} <= words:
        return 512
    if {"avx2", "fma"} <= words:
        return 256
    if _cpuinfo():
        return 0
    features = _llvm().get_host_cpu_features()
    return 512 if features.get("avx512dq") else 256 if features.get("avx2") and features.get("fma") else 0


_ROOTS = {"znver4": Times(10.0, 6.0, 1.8), "znver5": Times(10.0, 6.0, 0.9)}
"""Times of processors by LLVM's names for them; those of Zen 4 are measured."""
_OTHER_ROOTS = Times(18.0, 10.0, 0.9)


def root_times(dtype: str) -> Times | None:
    """What roots take in vectors of AVX-512; None where they are not estimated, or the processor's own are as quick."""
    name = _llvm().get_host_cpu_name()
    if lane_bits() < 512 or (dtype != FLOAT32 and name in _ROOTS):
        return None
    return _ROOTS.get(name, _OTHER_ROOTS)


def is_x86() -> bool:
    """Whether this processor is one of x86's, of 64 bits."""
    return platform.machine() in ("x86_64", "AMD64")


def lanes(dtype: str) -> int:
    """Numbers of a dtype that one vector holds."""
    return lane_bits() // (32 if dtype == FLOAT32 else 64)


@cache
def _llvm() -> Any:
    try:
        import llvmlite.binding as llvm

        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
    except (ImportError, OSError, AttributeError, RuntimeError, TypeError, ValueError) as error:  # half installed, say
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise DependencyError(f"kernels need llvmlite, which cannot be loaded ({reason})") from None
    return llvm


@cache
def _target_machine(level: int) -> Any:
    return _new_machine(opt=level, reloc="pic", codemodel="small")


ALIKE = frozenset({"haswell", "skylake", "alderlake", "skylake-avx512", "icelake-server", "sapphirerapids"})
"""Processors, by LLVM's names, for which its levels 1 and 2 make the same code of kernels, byte by byte. For AMD's the
second puts instructions into another order, after registers are known."""


def _level() -> int:
    """LLVM's level: the least of those that make the best code for this processor."""
    if not optimizes():
        return 0
    return 1 if _llvm().get_host_cpu_name() in ALIKE else 2


def _new_machine(**options: Any) -> Any:
    llvm = _llvm()
    target, features = llvm.Target.from_default_triple(), _features_text()
    if lane_bits() < 512:
        features = ",".join("-" + f[1:] if f[1:].startswith(("avx512", "avx10")) else f for f in features.split(","))
    return target.create_target_machine(cpu=llvm.get_host_cpu_name(), features=features, **options)


def _features_text() -> str:
    return _llvm().get_host_cpu_features().flatten()


@cache
def compiler() -> str:
    """The version of llvmlite, read from its files without an import; "" where they do not tell.

    LLVM's library is too long to be read whole. Its beginning has the linker's hash of it (a build id, a UUID) and
    the places of its segments, its end those of its sections. Raises DependencyError where there is no llvmlite.
    """
    spec = importlib.util.find_spec("llvmlite")
    if spec is None or spec.origin is None:
        raise DependencyError("kernels need llvmlite, which is not installed")
    home, total = os.path.dirname(spec.origin), hashlib.sha256()
    folder = os.path.join(home, "binding")
    try:
        with open(os.path.join(home, "_version.py"), "rb") as file:
            total.update(file.read())
        libraries = sorted(name for name in os.listdir(folder) if name.endswith((".so", ".dylib", ".dll")))
        for name in libraries:
            with open(os.path.join(folder, name), "rb", buffering=0) as library:
                size = library.seek(0, os.SEEK_END)
                total.update(size.to_bytes(8, "little"))
                for start in (0, max(size - _ENDS, 0)):
                    library.seek(start)
                    total.update(library.read(_ENDS))
    except OSError:
        return ""
    return total.hexdigest() if libraries else ""


def to_object(text: str) -> bytes:
    """The object file of a module of IR."""
    llvm = _llvm()
    with LOCK:
        machine = _target_machine(_level())
        module = llvm.parse_assembly(text)
        module.triple = machine.triple
        module.data_layout = str(machine.target_data)
        module.verify()
        if optimizes():
            builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options())
            passes = llvm.create_new_function_pass_manager()
            passes.add_instruction_combine_pass()
            passes.add_simplify_cfg_pass()
            for function in module.functions:
                if not function.is_declaration:
                    passes.run(function, builder)
        return machine.emit_object(module)


def to_assembly(text: str) -> str:
    """The assembly language of a module of IR, for people to read."""
    llvm = _llvm()
    with LOCK:
        machine = _target_machine(_level())
        return machine.emit_assembly(llvm.parse_assembly(text))


def linked(code: bytes) -> tuple[int, Any] | None:
    """The address of `kernel` in an object file that LLVM's loader has put into memory, and the object that keeps it;
    None where it has none. Raises EngineError where no code may be run."""
    elf.require_executable()
    llvm = _llvm()
    with LOCK:
        empty = llvm.parse_assembly("")
        target = _new_machine(opt=_level(), jit=True)
        engine = llvm.create_mcjit_compiler(empty, target, use_lmm=True)  # keeps sections within reach
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        address = engine.get_function_address("kernel")
    return (address, engine) if address else None
