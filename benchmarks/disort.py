"""What DISORT says of light that media reflect: python benchmarks/disort.py, written into tests/layers/disort.tsv.

PythonicDISORT 1.8 (`pip install PythonicDISORT`; Ho & Pincus 2024, "PythonicDISORT: A Python reimplementation of the
Discrete Ordinate Radiative Transfer package DISORT", JOSS 9(103):6442), with Nakajima & Tanaka's corrections, over a
black surface. The cosines that are seen are nodes of its own rule, those nearest to the wanted ones.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

OUT = Path(__file__).resolve().parent.parent / "tests" / "layers" / "disort.tsv"
ALBEDO, STREAMS = 0.95, {0.0: 64, 0.5: 64, -0.5: 64, 0.8: 96, -0.8: 96, 0.9: 128, 0.95: 160, -0.95: 160}
DEPTHS = (0.003, 0.1, 1.0, 50.0)
LIT, SEEN, AZIMUTHS = (0.05, 0.3, 1.0), (0.04, 0.1, 0.35, 0.97), (0.0, 1.0, np.pi)


def main() -> None:
    from PythonicDISORT.pydisort import pydisort

    lines = [
        "# PythonicDISORT 1.8: f [1/sr] of a medium over black; benchmarks/disort.py",
        "depth\talbedo\tg\tmu_i\tmu_o\tphi\tf",
    ]
    for g, streams in STREAMS.items():
        legendre = g ** np.arange(2 * streams)
        for depth in DEPTHS:
            for mu_i in LIT:
                corrected = {"f_arr": legendre[streams], "NT_cor": g != 0.0}
                found = pydisort(depth, ALBEDO, streams, legendre, mu_i, 1.0, 0.0, NLeg=streams, **corrected)
                mu, u = found[0], found[-1]  # NFourier is as many as streams
                for phi in AZIMUTHS:
                    radiance = u(0.0, np.pi - phi)[: streams // 2]  # its azimuths are those that light goes along
                    for mu_o in SEEN:
                        k = int(np.abs(mu[: streams // 2] - mu_o).argmin())
                        f = float(np.ravel(radiance[k])[0]) / mu_i
                        lines.append("\t".join(f"{x:.7g}" for x in (depth, ALBEDO, g, mu_i, mu[k], phi, f)))
    OUT.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
