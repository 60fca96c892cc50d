"""The page of `gonio view` in headless Chromium on its software renderer: python benchmarks/explorer.py [repeats]

Milliseconds, medians of the repeats with the least and the most. "first picture": from the start of navigation until a
lit sphere of the material is drawn by the GPU; "all views": until everything in sight is. "slider": from a number set
until the GPU has drawn the picture, with 512 x 512 pixels in one view. "dropped": from the drop of a file until it
stands on the page and everything in sight is drawn, upload and reading included. Other work on the machine counts.
"""

from __future__ import annotations

import json
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from urllib.parse import quote

from playwright.sync_api import Browser, Page, sync_playwright
from timing import machine

import gonio as gn
from gonio.catalogue.expressions import expression
from gonio.explorer.page import files

FLAGS = [
    *("--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
]
GLOSSY = "Microfacet(GGX(0.2))"
WHOLE = {"width": 1400, "height": 900}
STEPS = 40

SLIDE = """async ([steps, set]) => {
  const times = [];
  for (let k = 0; k < steps; k++) {
    const before = gonio.lastUpdate;
    if (set === "theta") gonio.setIncidence(20 + k, 0);
    else gonio.setParameter(0, set, 0.1 + (0.3 * k) / steps);
    while (gonio.lastUpdate === before) await new Promise((resolve) => setTimeout(resolve, 1));
    times.push(gonio.lastUpdate.drawn - gonio.lastUpdate.from);
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  return times;
}"""

DROPPED = """async () => {
  const input = document.querySelector("#file");
  const count = gonio.materials.length;
  const from = performance.now();
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(input.files[0]);
  window.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
  while (gonio.materials.length === count) await new Promise((resolve) => setTimeout(resolve, 5));
  await gonio.idle();
  return performance.now() - from;
}"""


def told(name: str, times: Iterable[float], target: float | None) -> None:
    times = sorted(times)
    middle = statistics.median(times)
    verdict = "" if target is None else f"  <= {target:.0f}: {'ok' if middle <= target else 'short'}"
    print(f"{name:46s}{middle:8.0f}  [{times[0]:.0f} {times[-1]:.0f}]{verdict}", flush=True)


def opened(browser: Browser, address: str, size: dict[str, int] = WHOLE, **state: Any) -> Page:
    page = browser.new_context(viewport=size).new_page()
    page.set_default_timeout(120_000)
    page.goto(address + "#" + quote(json.dumps({"materials": [{"text": GLOSSY}], **state})))
    return page


def first(browser: Browser, address: str, **state: Any) -> float:
    """Milliseconds from the start of navigation until everything in sight is drawn."""
    page = opened(browser, address, **state)
    time = page.evaluate("async () => { await gonio.ready; return performance.now(); }")
    page.context.close()
    return time


def slides(browser: Browser, address: str, view: str, path: str, text: str = GLOSSY) -> list[float]:
    page = opened(browser, address, {"width": 900, "height": 700}, views=[view], materials=[{"text": text}])
    page.evaluate("() => gonio.ready")
    testid = {"lit": "sphere", "lobe": "lobe", "slice": "slice"}[view] + "-0"
    box = page.get_by_test_id(testid).bounding_box()
    assert box is not None
    page.set_viewport_size({"width": 900 + 512 - round(box["width"]), "height": 700 + 512 - round(box["height"])})
    page.wait_for_timeout(3000)
    times = page.evaluate(SLIDE, [STEPS, path])
    page.context.close()
    return times


def dropped(browser: Browser, address: str, path: Path) -> float:
    page = opened(browser, address)
    page.evaluate("() => gonio.ready")
    page.wait_for_timeout(1500)
    page.evaluate("""() => {
      const input = document.createElement("input");
      input.type = "file";
      input.id = "file";
      document.body.append(input);
    }""")
    page.locator("#file").set_input_files(path)
    time = page.evaluate(DROPPED)
    page.context.close()
    return time


def main(repeats: int = 5) -> None:
    print(*machine(repeats), sep="\n")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        table = Path(folder) / "table.bsdf"
        gn.convert(expression("Lambertian([0.4, 0.1, 0.05]) + Microfacet(GGX(0.2))"), table, format="rgl")
        merl = Path(folder) / "merl.binary"
        gn.convert(expression("Lambertian([0.4, 0.1, 0.05]) + Microfacet(GGX(0.2))"), merl)
        command = [sys.executable, "-m", "gonio", "view", "--no-browser", "gold", str(table)]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        print(f"Chromium {browser.version}, SwiftShader\n")
        opened(browser, address).evaluate("() => gonio.ready")
        told("first picture", [first(browser, address, views=["lit"]) for _ in range(repeats)], 2000)
        told("all views: lobe, lit, polar, slice", [first(browser, address) for _ in range(repeats)], None)
        for view in ("lit", "lobe", "slice"):
            told(f"slider, GGX, {view}, 512 x 512", slides(browser, address, view, "distribution.alpha_x"), 35)
        told("incidence, GGX, lobe, 512 x 512", slides(browser, address, "lobe", "theta"), 35)
        told("incidence, measured file, lobe, 512 x 512", slides(browser, address, "lobe", "theta", str(table)), 100)
        size = merl.stat().st_size / 1e6
        told(f"dropped, {size:.0f} MB", [dropped(browser, address, merl) for _ in range(repeats)], 3000)
        browser.close()
        server.terminate()
        server.wait()
        page = Path(folder) / "gold.html"
        subprocess.run([sys.executable, "-m", "gonio", "view", "gold", "--export", str(page)], check=True, capture_output=True)
        bundle = sum(len(file.content) for file in files().values())
        print(f"\nexported page of gold {page.stat().st_size / 1e6:.2f} MB; the page's own files {bundle / 1e3:.0f} kB")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
