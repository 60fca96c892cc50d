"""The tasks that are timed, in processor time of one thread: a busy machine changes that least.

asv calls `setup` in a process of its own, then what begins with `time_`. What a commit does not know fails there, and
is left out of the comparison.
"""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

MILLION = 1_000_000
CALLS = 1000
"""Calls in a row of what takes microseconds: asv runs `setup` before each sample, so that one would be cold."""


class _Task:
    timer = time.process_time
    rounds, repeat, warmup_time, sample_time, timeout = 3, (2, 7, 2.0), 0.1, 0.05, 1200

    def setup(self) -> None:
        import gonio as gn

        gn.engine.threads(1)
        self.gn = gn
        self.metal = gn.Microfacet(gn.GGX(0.2), gn.Conductor(0.2, 3.9))
        self.paint = gn.Lambertian([0.3, 0.2, 0.1]) + gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
        self.one = gn.direction(0.3, 0.1)
        self.prepare()  # compiles, too

    def prepare(self) -> None:
        raise NotImplementedError

    def directions(self, count: int, seed: int = 1) -> np.ndarray:
        """Directions (count, 3) above the horizon."""
        u = np.random.default_rng(seed).random((count, 2))
        return self.gn.direction(np.arccos(np.sqrt(u[:, 0])), 2.0 * np.pi * u[:, 1])


class Evaluation(_Task):
    def prepare(self) -> None:
        self.wi, self.wo = (self.directions(MILLION, seed).astype(np.float32) for seed in (1, 2))
        self.u = np.random.default_rng(3).random((MILLION, 2), np.float32)
        self.numbers = iter(np.linspace(0.2, 0.8, MILLION).tolist())
        self.metal.f(self.one, self.one), self.metal.pdf(self.wi, self.wo), self.metal.sample(self.wo, self.u)
        self.paint.f(self.wi, self.wo), self.metal.jacobian(self.one, self.one)

    def time_thousand_calls_of_f(self) -> None:
        for _ in range(CALLS):
            self.metal.f(self.one, self.one)

    def time_f_of_a_million(self) -> None:
        self.paint.f(self.wi, self.wo)

    def time_pdf_of_a_million(self) -> None:
        self.metal.pdf(self.wi, self.wo)

    def time_sample_of_a_million(self) -> None:
        self.metal.sample(self.wo, self.u)

    def time_thousand_calls_of_replace_and_f(self) -> None:
        for _ in range(CALLS):
            self.metal.replace({"distribution.alpha_x": next(self.numbers)}).f(self.one, self.one)

    def time_thousand_calls_of_jacobian(self) -> None:
        for _ in range(CALLS):
            self.metal.jacobian(self.one, self.one)


class Integrals(_Task):
    def prepare(self) -> None:
        self.w = self.directions(1000)
        self.lights = [self.gn.DistantLight([0.0, 0.6, 0.8]), self.gn.ConstantLight(1.0)]
        self.time_albedo_of_a_thousand(), self.time_reflected_radiance()

    def time_albedo_of_a_thousand(self) -> None:
        self.gn.albedo(self.metal, self.w)

    def time_reflected_radiance(self) -> None:
        self.gn.reflected_radiance(self.metal, self.lights, self.one)


class Pictures(_Task):
    def prepare(self) -> None:
        self.lights = [self.gn.DistantLight([0.0, 0.6, 0.8]), self.gn.ConstantLight(1.0)]
        self.gn.render(self.metal, self.lights, size=16, samples=4)

    def time_render_of_256_by_256(self) -> None:
        self.gn.render(self.metal, self.lights, size=256, samples=4)


class Fits(_Task):
    def prepare(self) -> None:
        wi, wo = self.directions(100_000, 1), self.directions(100_000, 2)
        self.data = wi, wo, self.paint.f(wi, wo)
        self.model = self.gn.Lambertian(0.5) + self.gn.Microfacet(self.gn.GGX(0.4), self.gn.Dielectric(1.5))
        self.time_fit_of_a_hundred_thousand()

    def time_fit_of_a_hundred_thousand(self) -> None:
        self.gn.fit(self.data, self.model)


class Files(_Task):
    def prepare(self) -> None:
        self.path = Path(tempfile.mkdtemp()) / "made.binary"
        shape = (90, 90, 180)
        values = np.linspace(1.0, 2.0, 3 * int(np.prod(shape)))
        self.path.write_bytes(struct.pack("<3i", *shape) + values.astype("<f8").tobytes())

    def teardown(self) -> None:
        self.path.unlink()
        self.path.parent.rmdir()

    def time_load_of_a_merl_file(self) -> None:
        self.gn.load(self.path)


def _of_children() -> float:
    """Seconds of processor time that child processes have taken."""
    spent = os.times()
    return spent.children_user + spent.children_system


class First:
    """What a new process takes, Python's own start and NumPy's import included."""

    timer = staticmethod(_of_children)
    number, rounds, repeat, warmup_time, timeout = 1, 3, (3, 5, 10.0), 0.0, 1200

    def run(self, text: str = "") -> None:
        environment = os.environ | {"GONIO_CACHE": "off", "GONIO_THREADS": "1"}
        text = f"import numpy as np, gonio as gn; w = np.tile(gn.direction(0.3, 0.1), (100, 1)); {text}"
        subprocess.run([sys.executable, "-c", text], env=environment, check=True)

    def time_import(self) -> None:
        self.run()

    def time_f(self) -> None:
        self.run("gn.Microfacet(gn.GGX(0.2), gn.Conductor(0.2, 3.9)).f(w, w)")

    def time_sample_of_paint(self) -> None:
        self.run("gn.material('gold-metallic-paint').sample(w, abs(w[:, :2]))")
