"""Damaged files that a coverage-guided fuzzer finds: `python benchmarks/fuzz_guided.py [SECONDS [FORMAT...]]`.

Needs atheris (libFuzzer for Python; not among gonio's extras). Every format's minimal valid file is what it starts
from, SECONDS (60 by default) for each, in a process of its own: mutations that reach lines not reached before are
mutated further. As in fuzz.py only `gonio.Error` may be raised, within 5 seconds and a bounded amount of memory.
Results are in benchmarks/fuzz_guided.txt; what is found becomes a test of its format.
"""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ["GONIO_ENGINE"] = "numpy"  # a kernel for every damaged table would take the time
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests" / "tools"))
ONE = "--one"
"""First argument of the processes that this program starts: a folder and libFuzzer's options follow."""


def one(arguments: list[str]) -> None:
    """Fuzz a format whose minimal file is in a folder, until libFuzzer ends the process."""
    import atheris

    with atheris.instrument_imports(include=["gonio"]):
        from fuzzing import reading

        import gonio as gn
        from gonio.formats import formats

        formats()
    path = Path(arguments[0]) / "damaged"

    def test(data: bytes) -> None:
        path.write_bytes(data)
        with reading(len(data)), contextlib.suppress(gn.Error):
            gn.load(path)

    atheris.Setup([sys.argv[0], *arguments[1:]], test)
    atheris.Fuzz()


def main(arguments: list[str]) -> None:
    """Fuzz each format and write what came of it."""
    from seeds import SEEDS

    seconds = int(arguments[0]) if arguments else 60
    names = arguments[1:] or sorted(SEEDS)
    lines = []
    for name in names:
        with TemporaryDirectory(dir="/dev/shm") as folder:
            corpus = Path(folder) / "corpus"
            corpus.mkdir()
            seed = SEEDS[name]()
            (corpus / "seed").write_bytes(seed)
            options = [f"-max_total_time={seconds}", f"-max_len={2 * len(seed) + 256}", f"-artifact_prefix={folder}/"]
            done = subprocess.run(
                [sys.executable, __file__, ONE, folder, str(corpus), *options, "-rss_limit_mb=4096", "-timeout=5"],
                capture_output=True,
                text=True,
                errors="replace",
                check=False,
            )
            said = done.stdout + done.stderr
            runs = re.findall(r"^#(\d+)\t.*cov: (\d+)", said, re.MULTILINE)
            tried, covered = runs[-1] if runs else ("0", "0")
            found = re.findall(r"^\w+(?:\.\w+)*(?:Error|Exception): .*", said, re.MULTILINE)
            crashes = [p for p in Path(folder).iterdir() if p.name.startswith(("crash-", "timeout-", "oom-"))]
            line = (
                f"{name:24} {tried:>8} tried, {covered:>6} branches, {len(crashes)} findings {'; '.join(found)[:200]}"
            )
            lines.append(line.rstrip())
            print(lines[-1], flush=True)
            for crash in crashes:
                print("   ", crash.read_bytes()[:2000], flush=True)
    if len(names) == len(SEEDS):
        (HERE / "fuzz_guided.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    one(sys.argv[2:]) if sys.argv[1:2] == [ONE] else main(sys.argv[1:])
