"""What `gonio view` and `gonio report` take: `python benchmarks/explorer.py`; see explorer.txt.

A headless Chromium draws by its software renderer. First paint: from the start of the command to the first content of
the page, its header. Four views drawn: until their pictures are there too, and of the page alone. Slider to picture:
from an input event to the last pixel of a lit sphere of 512 x 512, one point light, median of 40 events. Dropped:
measurements as files, from the drop to their picture, onto a page that has been open for 5 s; timed in the page, for
what hands them over here takes seconds itself. The first report compiles kernels, which the second finds; the bytecode
of Python is on disk, as pip leaves it.
"""

from __future__ import annotations

import compileall
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from playwright.sync_api import sync_playwright
from timing import machine

import gonio as gn
from gonio.formats import merl

FLAGS = [
    *("--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
]
EVENTS = 40
MIXED = "Lambertian([0.4, 0.1, 0.05]) + Microfacet(GGX(0.2))"


def started(*materials: str) -> tuple[subprocess.Popen[str], str, float]:
    """The command, the page's address, and when it was started."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "gonio", "view", "--no-browser", *materials]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    return server, server.stdout.readline().strip(), start


def opened(browser: Any, address: str, **state: Any) -> Any:
    page = browser.new_context(viewport={"width": 1400, "height": 900}).new_page()
    page.goto(address + "#" + quote(json.dumps(state)))
    page.evaluate("() => gonio.ready")
    return page


SLIDE = """async ([events, path, low, high]) => {
  const times = [];
  for (let i = 0; i < events; i++) {
    const before = gonio.lastUpdate.drawn;
    const from = performance.now();
    gonio.setParameter(0, path, low + (high - low) * i / events);
    while (gonio.lastUpdate.drawn === before) await new Promise((resolve) => setTimeout(resolve, 0));
    times.push(gonio.lastUpdate.drawn - from);
    await new Promise((resolve) => setTimeout(resolve, 60));
  }
  return times;
}"""

TURN = """async (events) => {
  const times = [];
  for (let i = 0; i < events; i++) {
    const before = gonio.lastUpdate.drawn;
    const from = performance.now();
    gonio.setIncidence(20 + i, 0);
    while (gonio.lastUpdate.drawn === before) await new Promise((resolve) => setTimeout(resolve, 0));
    times.push(gonio.lastUpdate.drawn - from);
    await new Promise((resolve) => setTimeout(resolve, 60));
  }
  return times;
}"""

PAINT = "() => performance.getEntriesByName('first-contentful-paint')[0].startTime / 1000"

LISTEN = """() => document.addEventListener("change", () => (window.begun = performance.now()), true)"""

DRAWN = """async () => {
  while (gonio.materials.length < 2) await new Promise((resolve) => setTimeout(resolve, 5));
  await gonio.idle();
  return performance.now() - window.begun;
}"""

REST = 5000
"""Milliseconds that the page has been open when a file is dropped."""

LIT = {"width": 774, "height": 686}
"""A window whose lit sphere has 512 x 512 pixels."""

CANVAS = "() => { const c = document.querySelector('[data-testid=sphere-0]'); return [c.width, c.height]; }"


def spread(times: list[float]) -> str:
    low, middle, high = np.percentile(times[3:], [25, 50, 75])
    return f"median {middle:.1f} ms [{low:.1f} {high:.1f}]"


def files(folder: Path) -> list[Path]:
    """A table of 20 MB, which netCDF packs into 14, and one in MERL's own size, 35 MB."""
    m = gn.expression(MIXED)
    netcdf, binary = folder / "table.nc", folder / "large.binary"
    gn.save(gn.tables.tabulate(m, resolution=(90, 90, 103)), netcdf)
    gn.save(gn.tables.tabulate(m, resolution=(90, 90, 180)), binary, format=merl.NAME)
    return [netcdf, binary]


def main() -> None:
    print(*machine(1), sep="\n")
    compileall.compile_dir(Path(gn.__file__).parent, quiet=2)
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        print(browser.version and f"Chromium {browser.version}, software renderer (SwiftShader)\n")
        first, alone, content = [], [], []
        for _ in range(5):
            server, address, start = started("gold")
            begun = time.perf_counter()
            page = opened(browser, address, materials=[{"text": "gold"}])
            first.append(time.perf_counter() - start)
            alone.append(time.perf_counter() - begun)
            content.append(begun - start + page.evaluate(PAINT))
            page.context.close()
            server.terminate()
            server.wait()
        for what, times in (
            ("first paint, from the start of the command", content),
            ("four views drawn, the same", first),
            ("four views drawn, from the page's opening", alone),
        ):
            print(f"{what:45}{np.median(times):.2f} s (of 5: {min(times):.2f} to {max(times):.2f})")

        server, address, _ = started("gold")
        page = opened(browser, address, materials=[{"text": "gold"}], views=["lit"])
        page.set_viewport_size(LIT)
        page.wait_for_timeout(2000)
        size = page.evaluate(CANVAS)
        times = page.evaluate(SLIDE, [EVENTS, "distribution.alpha_x", 0.05, 0.4])
        print(f"{f'slider to picture, gold, {size[0]} x {size[1]}':45}{spread(times)}")
        page.context.close()
        page = opened(browser, address, materials=[{"text": "Microfacet(GGX(0.2))"}], views=["lit"])
        page.set_viewport_size(LIT)
        page.wait_for_timeout(2000)
        times = page.evaluate(SLIDE, [EVENTS, "distribution.alpha_x", 0.05, 0.4])
        print(f"{f'slider to picture, GGX, {size[0]} x {size[1]}':45}{spread(times)}")
        page.context.close()
        server.terminate()
        for file in files(folder):
            server, address, _ = started("gold")
            page = opened(browser, address, materials=[{"text": "gold"}], views=["lit"])
            page.wait_for_timeout(REST)
            page.evaluate(LISTEN)
            page.locator("input[type=file]").first.set_input_files(str(file))
            seconds = page.evaluate(DRAWN) / 1000.0
            what = f"file of {file.stat().st_size / 1e6:.0f} MB ({file.suffix}) dropped and shown"
            print(f"{what:45}{seconds:.2f} s")
            page.context.close()
            server.terminate()

        server, address, _ = started(str(file))
        page = opened(browser, address, views=["lobe"])
        page.set_viewport_size(LIT)
        page.wait_for_timeout(2000)
        print(f"{'incidence to lobe, the measured file':45}{spread(page.evaluate(TURN, EVENTS))}")
        page.context.close()
        server.terminate()
        browser.close()

        for material, kind in (("gold-metallic-paint", "a built-in material"), ("gold", "a metal")):
            page_file, report = folder / "page.html", folder / "report.html"
            export, write = ["view", "--export", page_file, material], ["report", material, "-o", report]
            subprocess.run([sys.executable, "-m", "gonio", *export], check=True, capture_output=True)
            took = []
            for environment in (os.environ | {"GONIO_CACHE_DIR": str(folder / f"cache-{material}")},) * 2:
                begun = time.perf_counter()
                command = [sys.executable, "-m", "gonio", *write]
                subprocess.run(command, check=True, capture_output=True, env=environment)
                took.append(time.perf_counter() - begun)
            sizes = [x.stat().st_size / 1e6 for x in (page_file, report)]
            words = f"explorer exported {sizes[0]:.2f} MB; report {sizes[1]:.2f} MB"
            print(f"{kind}: {words}, {took[0]:.1f} s at first, then {took[1]:.1f} s")


if __name__ == "__main__":
    main()
