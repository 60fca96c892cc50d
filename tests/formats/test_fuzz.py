"""Damaged files of every format, of a campaign's corpus: only `gonio.Error`, soon, in bounded memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fuzz_trials import TRIALS
from fuzzing import outcome, outcome_of
from fuzzing_texts import SEEDS as TEXTS
from libraries import thinned
from seeds import SEEDS

import gonio as gn
from gonio.evaluate import planning
from gonio.formats import formats

CORPUS = Path(__file__).parent / "corpus"


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    """No kernels: one for every damaged table would take the time, and LLVM more memory than files may."""
    monkeypatch.setattr(planning, "available", lambda: False)


def numbers(name: str) -> list[int]:
    file = CORPUS / f"{name.replace(' ', '_').replace('/', '_')}.txt"
    return np.loadtxt(file, dtype=int, ndmin=1).tolist() if file.exists() else list(range(20))


SLOW = {"netCDF", "netCDF rows", "Zarr", "Zarr 3"}
"""Of which an eighth of all files is read where `full` is left out, of others a third."""
PARTS = [(name, part, parts) for name in TRIALS for parts in [8 if name in SLOW else 3] for part in range(parts)]


@pytest.mark.slow_because("every file that once did harm, and twenty more")
@pytest.mark.parametrize(("name", "part", "parts"), thinned(PARTS, [case for case in PARTS if case[1] == 0]))
def test_damaged_files(name, part, parts, tmp_path):
    trial = TRIALS[name](tmp_path / "damaged")
    for number in numbers(name)[part::parts]:
        trial(number)


RUNS = (b" ", b"# ", b"1", b"-", b"a", b"<", b'"', b":", b",", b"\n", b"(", b".")


@pytest.mark.parametrize("everywhere", [False, pytest.param(True, marks=pytest.mark.full)])
@pytest.mark.parametrize("name", SEEDS)
def test_long_runs_of_one_character(name, everywhere, tmp_path):
    """What an expression that goes back over what it has matched does not come to an end with: each character at one
    place, or at all of them."""
    seed, length = SEEDS[name]()[:5000], 100_000 if everywhere else 30_000
    places = (1, len(seed), len(seed) // 3, 0, 2 * len(seed) // 3)
    for k, run in enumerate(RUNS):
        for at in places if everywhere else [places[k % 5]]:
            outcome(seed[:at] + run * (length // len(run)) + seed[at:], tmp_path / "long")


@pytest.mark.parametrize("everywhere", [False, pytest.param(True, marks=pytest.mark.full)])
@pytest.mark.parametrize("name", TEXTS)
def test_long_runs_in_luminaires_and_height_maps(name, everywhere, tmp_path):
    make, suffix, read = TEXTS[name]
    seed, length, path = make(), 100_000 if everywhere else 30_000, (tmp_path / "long").with_suffix(suffix)
    for k, run in enumerate((*RUNS, b"\t", b";", b"\0", b"1 ", b"1,")):
        for at in (0, 1, len(seed) // 3, len(seed)) if everywhere else [(0, len(seed) // 3, len(seed))[k % 3]]:
            path.write_bytes(seed[:at] + run * (length // len(run)) + seed[at:])
            outcome_of(lambda: read(path), length)


@pytest.mark.parametrize("data", [b",", b",\n1 2\n", b";;\n400 0.5 9 9\n,\n", b"\xff\xfe", b"\n", b""])
def test_hardly_anything(data, tmp_path):
    """Files that coverage-guided mutation found, and what is like them."""
    path = tmp_path / "a"
    path.write_bytes(data)
    with pytest.raises(gn.Error, match="not a known format"):
        gn.load(path)


def test_every_format_has_a_seed():
    missing = [m.NAME for m in formats() if not any(name.startswith(m.NAME) for name in SEEDS)]
    assert not missing, f"add a minimal file of {missing} to tests/tools/seeds.py"
