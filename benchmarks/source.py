"""How near source texts come to gonio's own values: python benchmarks/source.py [--out FILE]

`gn.engine.shader_source` of every model, as the manual draws it, compiled and run: C by cc; CUDA, HLSL and OSL by g++
with a few lines of C++ in place of their own compilers; GLSL (WebGL 2) and WGSL (WebGPU) by headless Chromium on
SwiftShader, that is, on the processor. 192 pairs of directions for each model; the largest difference from gonio's
float32 values: relative to the value, or to a thousandth of the largest one, for a sampled direction absolute; of
weight and density of a sample times its cosine. Polarizing models alone have `mueller`.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from timing import machine

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "tools"))
import source_browser as on_page
import source_cases as cases
import source_compilers as compilers

FUNCTIONS = ("f", "pdf", "sample", "mueller")
HEADINGS = ("f", "pdf", "sample: wi", "sample: weight", "sample: pdf", "mueller")
Run = Callable[[Sequence[cases.Case]], list[list[np.ndarray]]]


def largest(language: str, run: Run) -> dict[str, tuple[float, str]]:
    """By heading, the largest error and the model that has it."""
    made = [
        cases.case(m, language, [word for word in FUNCTIONS if word != "mueller" or m.polarizes], name)
        for name, m in cases.models().items()
    ]
    worst: dict[str, tuple[float, str]] = {}
    for case, results in zip(made, run(made), strict=True):
        for call, result in zip(case.calls, results, strict=True):
            for name, error in cases.errors(call, result):
                heading = f"sample: {name}" if call.function == "sample" else call.function
                worst[heading] = max(worst.get(heading, (0.0, "")), (error, case.source.name))
    return worst


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    out = parser.parse_args().out
    count = len(cases.models())
    lines = [*machine(1)[:2], "", f"{count} models; the largest difference, and the model that has it.", ""]
    lines.append(f"{'':5}" + "".join(f"{h:>33}" for h in HEADINGS))

    def add(language: str, run: Run) -> None:
        worst = largest(language, run)
        cells = [f"{worst[h][1]} {worst[h][0]:.1e}" for h in HEADINGS]
        lines.append(f"{language:5}" + "".join(f"{cell:>33}" for cell in cells))
        print(lines[-1], flush=True)

    print(*lines, sep="\n", flush=True)
    for language in compilers.COMPILERS:
        with tempfile.TemporaryDirectory() as folder:
            add(language, lambda made, folder=folder: compilers.run(made, Path(folder)))
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser: Any = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=on_page.FLAGS)
        page = on_page.opened(browser)
        for language in ("glsl", "wgsl"):
            add(language, lambda made: [on_page.run(page, case) for case in made])
        browser.close()
    if out is not None:
        out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
