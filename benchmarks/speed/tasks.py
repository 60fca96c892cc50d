"""The tasks that are timed, in processor time of one thread: a busy machine changes that least.

asv calls `setup` in a process of its own, then what begins with `time_`; what begins with `timeraw_` gives the text of
a program, and that of its preparation, for a new process each time, which is timed by the clock. What a commit does
not know fails there, and is left out of the comparison.
"""

from __future__ import annotations

import struct
import tempfile
import time
from pathlib import Path

import numpy as np

MILLION = 1_000_000


class _Task:
    timer = time.process_time
    rounds, repeat, warmup_time, sample_time, timeout = 3, (1, 5, 2.0), 0.0, 0.02, 1200

    def setup(self) -> None:
        import gonio as gn

        gn.threads(1)
        self.gn = gn
        self.metal = gn.Microfacet(gn.GGX(0.2), gn.Conductor(0.2, 3.9))
        self.paint = gn.Lambertian([0.3, 0.2, 0.1]) + gn.Microfacet(gn.GGX(0.2), gn.Dielectric(1.5))
        self.one = np.array([0.3, 0.1, 0.9])
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

    def time_f_of_one_direction(self) -> None:
        self.metal.f(self.one, self.one)

    def time_f_of_a_million(self) -> None:
        self.paint.f(self.wi, self.wo)

    def time_pdf_of_a_million(self) -> None:
        self.metal.pdf(self.wi, self.wo)

    def time_sample_of_a_million(self) -> None:
        self.metal.sample(self.wo, self.u)

    def time_replace_and_f(self) -> None:
        self.metal.replace({"distribution.alpha_x": next(self.numbers)}).f(self.one, self.one)

    def time_jacobian(self) -> None:
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


class TimerawFirst:
    number, rounds, repeat, timeout = 1, 3, (2, 5, 10.0), 1200

    def timeraw_import(self) -> tuple[str, str]:
        return "import gonio", "import numpy"

    def timeraw_f(self) -> tuple[str, str]:
        prepared = """
        import os
        os.environ.update(GONIO_CACHE="off", GONIO_THREADS="1")
        import numpy as np, gonio as gn
        m, w = gn.Microfacet(gn.GGX(0.2), gn.Conductor(0.2, 3.9)), np.tile([0.3, 0.1, 0.9], (100, 1))
        """
        return "m.f(w, w)", prepared

    def timeraw_sample(self) -> tuple[str, str]:
        prepared = """
        import os
        os.environ.update(GONIO_CACHE="off", GONIO_THREADS="1")
        import numpy as np, gonio as gn
        m, w = gn.material("gold-metallic-paint"), np.tile([0.3, 0.1, 0.9], (100, 1))
        """
        return "m.sample(w, w[:, :2])", prepared
