"""Source texts in C, and in languages near it that a few lines of C++ stand in for, compiled and called by ctypes."""

from __future__ import annotations

import ctypes
import re
import subprocess
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from source_cases import Case
from source_wrappers import body, parameters, wrapped

VECTORS = """#include <cmath>
#include <cstring>
#include <algorithm>
using namespace std;
typedef unsigned int uint;
struct float2 { float x, y; float2() {} float2(float x, float y) : x(x), y(y) {} };
struct float3 { float x, y, z; float3() {} float3(float x, float y, float z) : x(x), y(y), z(z) {} };
struct float4 { float x, y, z, w; float4() {} float4(float x, float y, float z, float w) : x(x), y(y), z(z), w(w) {} };
static int clamp(int x, int low, int high) { return x < low ? low : x > high ? high : x; }
"""
HLSL = """static float asfloat(uint i) { float x; memcpy(&x, &i, 4); return x; }
"""
CUDA = """#define __device__
static float2 make_float2(float x, float y) { return float2(x, y); }
static float3 make_float3(float x, float y, float z) { return float3(x, y, z); }
static float4 make_float4(float x, float y, float z, float w) { return float4(x, y, z, w); }
static float __int_as_float(int i) { float x; memcpy(&x, &i, 4); return x; }
static float erfinvf(float y)
{
    double x = 0, z = y < 0 ? -(double)y : (double)y; // Halley's steps from above or below
    for (int i = 0; i < 60; i++) {
        double d = (erf(x) - z) / (1.1283791670955126 * exp(-x * x));
        x -= d / (1 + x * d);
    }
    return (float)(y < 0 ? -x : x);
}
"""
OSL = """
struct vector {
    float v[3];
    vector() {}
    vector(float x, float y, float z) { v[0] = x; v[1] = y; v[2] = z; }
    float &operator[](int i) { return v[i]; }
    float operator[](int i) const { return v[i]; }
};
struct Picture { const char *name; const float *texels; int width, height; };
static Picture pictures[64];
static int held = 0;
extern "C" void hold(const char *name, const float *texels, int width, int height)
{
    Picture given = {name, texels, width, height};
    pictures[held++] = given;
}
static float texture(const char *name, float s, float t, const char *, const char *, const char *, float)
{
    for (int i = 0; i < held; i++)
        if (!strcmp(pictures[i].name, name) && s > 0 && s < 1 && t > 0 && t < 1) {
            int column = (int)floor(s * (float)pictures[i].width), row = (int)floor(t * (float)pictures[i].height);
            return pictures[i].texels[row * pictures[i].width + column];
        }
    return NAN;
}
"""
NUMBER = re.compile(r"(?<![\w.])(\d+\.\d+(?:e[+-]?\d+)?)(?![\w.])")


def _from_hlsl(text: str) -> str:
    text = re.sub(r"Buffer<float> (\w+) : register\(t\d+\);", r"const float *\1;", text)
    text = re.sub(r"\bout (\w+ \w+\[)", r"\1", text)
    return NUMBER.sub(r"\1f", re.sub(r"\bout (\w+) (\w+)", r"\1 &\2", text))


def _from_osl(text: str) -> str:
    text = re.sub(r"\boutput (\w+ \w+\[)", r"\1", text)
    return NUMBER.sub(r"\1f", re.sub(r"\boutput (\w+) (\w+)", r"\1 &\2", text))


class Compiler(NamedTuple):
    """How a language is compiled: the program and its flags, the suffix, what stands before a text, and its changes."""

    command: tuple[str, ...]
    suffix: str
    before: str = ""
    changed: Callable[[str], str] = str


_CPP = ("g++", "-std=c++11", "-Wall", "-Wextra", "-Wno-unused-function", "-Wno-unused-parameter")
COMPILERS = {
    "c": Compiler(("cc", "-std=c99", "-Wall", "-Wextra", "-Wshadow", "-pedantic"), ".c"),
    "cuda": Compiler(_CPP, ".cpp", VECTORS + CUDA),
    "hlsl": Compiler(_CPP, ".cpp", VECTORS + HLSL, _from_hlsl),
    "osl": Compiler(_CPP, ".cpp", VECTORS + OSL, _from_osl),
}


def run(cases: Sequence[Case], folder: Path, *more: str) -> list[list[np.ndarray]]:
    """The results of every call of every case, all of one language: (PAIRS, numbers)."""
    compiler = COMPILERS[cases[0].source.language]
    outside = "" if compiler.suffix == ".c" else 'extern "C" '
    texts: dict[str, str] = {}  # equal texts are compiled once
    runs: list[list[str]] = []
    for case in cases:
        text = compiler.changed(body(case.source.text))
        texts.setdefault(text, "")
        names = []
        for call in case.calls:
            name = f"run_{case.source.name}_{call.function}"
            names.append(name)
            if name in texts[text]:
                continue
            sizes = [values.shape[1] for values in call.arguments]
            lines, results = wrapped(case, call, partial(_entry, sizes), "p[{}]".format)
            stored = [f"o[{len(results)} * i + {i}] = {x};" for i, x in enumerate(results)]
            texts[text] += "\n".join(
                [
                    f"{outside}void {name}(int n, const float *a, const float *b, const float *p, float *o)",
                    "{",
                    "for (int i = 0; i < n; i++) {",
                    *lines,
                    *stored,
                    "}",
                    "(void)p;",
                    "}\n",
                ]
            )
        runs.append(names)
    file = folder / f"source{len([*folder.iterdir()])}{compiler.suffix}"  # libraries are known by their paths
    file.write_text(compiler.before + "\n".join(text + wrappers for text, wrappers in texts.items()))
    library = file.with_suffix(".so")
    command = [*compiler.command, "-Werror", "-O0", "-ffp-contract=off", *more, "-shared", "-fPIC"]
    done = subprocess.run([*command, "-o", library, file, "-lm"], capture_output=True, text=True)
    assert not done.returncode, f"{file}: {done.stderr[:4000]}"
    loaded = ctypes.CDLL(str(library))
    kept = [_with_tables(loaded, case) for case in cases]
    found = [
        [_called(loaded, name, case, k) for k, name in enumerate(names)]
        for case, names in zip(cases, runs, strict=True)
    ]
    del kept
    return found


def _entry(sizes: Sequence[int], argument: int, component: int) -> str:
    return f"{'ab'[argument]}[{sizes[argument]} * i + {component}]"


def _with_tables(loaded: ctypes.CDLL, case: Case) -> list[np.ndarray]:
    """Bring the tables of a text; they must be kept as long as it is called."""
    from gonio.compile.source.languages.osl import WIDTH

    kept = []
    for table in case.source.tables:
        values = np.ascontiguousarray(table.values, np.float32)
        if case.source.language == "osl":
            rows = -(-len(values) // WIDTH)
            values = np.pad(values, (0, rows * WIDTH - len(values)))
            name = ctypes.create_string_buffer(f"{table.name}.exr".encode())
            loaded.hold(name, values.ctypes.data_as(ctypes.c_void_p), WIDTH, rows)
            kept.append(name)
        else:
            ctypes.c_void_p.in_dll(loaded, table.name).value = values.ctypes.data
        kept.append(values)
    return kept


def _called(loaded: ctypes.CDLL, name: str, case: Case, k: int) -> np.ndarray:
    call = case.calls[k]
    given = [np.ascontiguousarray(x, np.float32) for x in (*call.arguments, parameters(case))]
    found = np.full((len(given[0]), sum(call.widths.values())), np.nan, np.float32)
    getattr(loaded, name)(len(found), *(x.ctypes.data_as(ctypes.c_void_p) for x in (*given, found)))
    return found
