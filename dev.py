"""Set up gonio on a machine that has only Python and pip, and use it.

    python3 dev.py demo    install gonio, write a report about a measured material: gold.html
    python3 dev.py test    install what the tests need, run them; -m full runs those that are left out for their time,
                           --near those of the rooms that were changed and of the rooms above; the rest goes to pytest
    python3 dev.py lint    ruff and mypy, then the tests of pages, examples and the manual
    python3 dev.py lowest  the tests with the lowest versions that pyproject.toml allows; on Python 3.11
    python3 dev.py wheel   build what is published, in dist, and write the report from it where there is no checkout
    python3 dev.py manual  build the manual as web pages, offline search included, in build/manual/html
    python3 dev.py counts  bring tests/house/counts.txt up to date, what calls cost in calls, and show what has changed
    python3 dev.py speed   compare this commit in time with another, whose name follows, by asv: what changed by more
                           than noise
    python3 dev.py docs    bring pages, tables, counts and the stub of types up to date; docs/make.py has options

Everything goes into the virtual environment .venv (.venv-lowest) beside this file, or into the one this is run from.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
import venv
import zipfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parent


def interpreter_of(home: Path) -> Path:
    """Where a virtual environment has its Python."""
    return home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def python(folder: str = ".venv") -> str:
    """The interpreter of the virtual environment, which is made if there is none."""
    if sys.prefix != sys.base_prefix:
        return sys.executable
    home = ROOT / folder
    found = interpreter_of(home)
    if not found.exists():
        print(f"making a virtual environment in {home}", flush=True)
        try:
            venv.create(home, with_pip=True, clear=True)
        except subprocess.CalledProcessError:
            sys.exit("this Python cannot make virtual environments; on Debian and Ubuntu: apt install python3-venv")
    return str(found)


def install(interpreter: str, extras: str) -> None:
    """Install gonio from this folder, unless this very setup is installed already."""
    state = hashlib.sha256((ROOT / "pyproject.toml").read_bytes() + extras.encode()).hexdigest()
    stamp = Path(interpreter).parent / f"gonio-installed-{extras or 'plain'}"
    if stamp.exists() and stamp.read_text() == state:
        return
    what = "gonio" + (f" with the extras {extras}" if extras else "")
    print(f"installing {what} by pip, with what it needs (650 MB on disk; about half a minute) ...", flush=True)
    start = time.monotonic()
    target = f"{ROOT}[{extras}]" if extras else str(ROOT)
    done = subprocess.run([interpreter, "-m", "pip", "install", "--quiet", "--editable", target])
    if done.returncode:
        sys.exit(f"pip could not install {what}: its last lines above say why; is there a connection to PyPI?")
    print(f"installed in {time.monotonic() - start:.0f} s", flush=True)
    stamp.write_text(state)


def run(*command: str | Path, where: Path | None = None) -> int:
    """The exit code of a program."""
    return subprocess.run(list(map(str, command)), cwd=where).returncode


def demo(words: list[str]) -> int:
    """A report about a measured material, in the working directory."""
    interpreter = python()
    install(interpreter, "")
    command = ["report", "gold-metallic-paint", "-o", "gold.html"]
    print("\n$ gonio " + " ".join(command), flush=True)
    code = run(interpreter, "-m", "gonio", *command)
    if code:
        return code
    gonio = Path(interpreter).parent / "gonio"
    here = os.path.relpath(gonio) if gonio.is_relative_to(Path.cwd()) else gonio
    print(f"\nOpen {Path('gold.html').resolve()} in a browser. Next:\n  {here} view gold\n  {here} materials")
    return 0


def test(words: list[str]) -> int:
    """The tests, with pytest's options."""
    interpreter = python()
    install(interpreter, "test")
    return run(interpreter, "-m", "pytest", *words, where=ROOT)


def lowest_versions() -> list[str]:
    """All that pyproject.toml asks for, each in its lowest version; linters, asv and PyTorch, for its size, aside."""
    import tomllib

    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = declared["project"]
    needed = [*declared["build-system"]["requires"], *project["dependencies"]]
    for name, extra in project["optional-dependencies"].items():
        needed += extra if name not in ("lint", "speed", "torch") else []
    return [requirement.replace(">=", "==") for requirement in needed if ">=" in requirement]


def lowest(words: list[str]) -> int:
    """The tests with these versions."""
    interpreter = python(".venv-lowest")
    pip = [interpreter, "-m", "pip", "install", "--quiet"]
    code = run(*pip, "--only-binary", ":all:", *lowest_versions())
    code = code or run(*pip, "--no-deps", "--no-build-isolation", ROOT)
    # Old libraries use what has since been deprecated in those that they need themselves. Python keeps that from
    # users; the commands, tested in this process, print every warning that it lets through.
    return code or run(interpreter, "-m", "pytest", "-W", "ignore::DeprecationWarning", *words, where=ROOT)


def lint(words: list[str]) -> int:
    """Lint and types; then the tests of pages and examples, which build the manual."""
    interpreter = python()
    install(interpreter, "test,lint,docs")
    commands = [["ruff", "check", "."], ["ruff", "format", "--check", "."], ["mypy"], ["pytest", "-m", "texts"]]
    return max([run(interpreter, "-m", *command, where=ROOT) for command in commands])


def wheel(words: list[str]) -> int:
    """The two files that are published; the wheel is built from the other, holds all, and serves without a checkout."""
    builder = python()
    shutil.rmtree(ROOT / "dist", ignore_errors=True)
    code = run(builder, "-m", "pip", "install", "--quiet", "build") or run(builder, "-m", "build", ROOT)
    if code:
        return code
    (built,) = (ROOT / "dist").glob("*.whl")
    with zipfile.ZipFile(built) as archive:
        held = {name for name in archive.namelist() if name.startswith("gonio/")}
    package = ROOT / "src" / "gonio"
    there = {path.relative_to(ROOT / "src").as_posix() for path in package.rglob("*") if path.is_file()}
    missing = sorted(name for name in there - held if "__pycache__" not in name)
    if missing:
        print(f"{built.name} lacks {', '.join(missing)}: pyproject.toml says what is packed")
        return 1
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        scripts = interpreter_of(Path(folder)).parent
        code = run(scripts / "python", "-m", "pip", "install", "--quiet", built)
        return code or run(scripts / "gonio", "report", "gold-metallic-paint", "-o", "gold.html", where=Path(folder))


def script(extras: str, path: str) -> Callable[[list[str]], int]:
    """The task of running a program of this repository, which needs these extras."""

    def task(words: list[str]) -> int:
        interpreter = python()
        install(interpreter, extras)
        return run(interpreter, ROOT / path, *words)

    return task


TASKS = {
    **{task.__name__: task for task in (demo, test, lint, lowest, wheel)},
    "manual": script("docs", "docs/manual/build.py"),
    "counts": script("test", "tests/tools/counting.py"),
    "speed": script("speed", "benchmarks/speed/compare.py"),
    "docs": script("", "docs/make.py"),
}


def main() -> int:
    if sys.version_info < (3, 11):  # noqa: UP036 (an older Python gets this word, not a failure of pip)
        sys.exit(f"gonio needs Python 3.11 or newer; this is {sys.version.split()[0]}: {sys.executable}")
    task = TASKS.get(sys.argv[1] if len(sys.argv) > 1 else "")
    if task is None:
        print(__doc__)
        return 2
    return task(sys.argv[2:])


if __name__ == "__main__":
    sys.exit(main())
