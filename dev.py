"""Set up gonio on a machine that has only Python and pip, and use it.

    python3 dev.py demo    install gonio, write a report about a measured material: gold.html
    python3 dev.py test    install what the tests need, run them; -m full runs those that are left out for their time
    python3 dev.py lowest  the tests with the lowest versions that pyproject.toml allows; on Python 3.11
    python3 dev.py lint    ruff and mypy
    python3 dev.py manual  build the manual as web pages, offline search included, in build/manual/html
    python3 dev.py counts  bring tests/house/counts.txt up to date, what calls cost in calls, and show what has changed
    python3 dev.py speed BASE    compare this commit with another in time, by asv: what has changed by more than noise
    python3 dev.py docs    bring pages, tables, counts and the stub of types up to date; docs/make.py has options

Everything goes into the virtual environment .venv (.venv-lowest) beside this file, or into the one this is run from.
"""

import hashlib
import os
import subprocess
import sys
import time
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent


def python(folder: str) -> str:
    """The interpreter of the virtual environment, which is made if there is none."""
    if sys.prefix != sys.base_prefix:
        return sys.executable
    home = ROOT / folder
    found = home / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
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


def lowest() -> list[str]:
    """All that pyproject.toml asks for, each in its lowest version; linters, asv and PyTorch, for its size, aside."""
    import tomllib

    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = declared["project"]
    needed = [*declared["build-system"]["requires"], *project["dependencies"]]
    for name, extra in project["optional-dependencies"].items():
        needed += extra if name not in ("lint", "speed", "torch") else []
    return [requirement.replace(">=", "==") for requirement in needed if ">=" in requirement]


def main() -> int:
    if sys.version_info < (3, 11):  # noqa: UP036 (an older Python gets this word, not a failure of pip)
        sys.exit(f"gonio needs Python 3.11 or newer; this is {sys.version.split()[0]}: {sys.executable}")
    task = sys.argv[1] if len(sys.argv) > 1 else ""
    if task not in ("demo", "test", "lowest", "lint", "manual", "counts", "speed", "docs"):
        print(__doc__)
        return 2
    interpreter = python(".venv-lowest" if task == "lowest" else ".venv")
    if task == "demo":
        install(interpreter, "")
        command = ["report", "gold-metallic-paint", "-o", "gold.html"]
        print("\n$ gonio " + " ".join(command), flush=True)
        code = subprocess.run([interpreter, "-m", "gonio", *command]).returncode
        if code:
            return code
        gonio = Path(interpreter).parent / "gonio"
        here = os.path.relpath(gonio) if gonio.is_relative_to(Path.cwd()) else gonio
        print(f"\nOpen {Path('gold.html').resolve()} in a browser. Next:\n  {here} view gold\n  {here} materials")
        return 0
    if task == "test":
        install(interpreter, "test")
        return subprocess.run([interpreter, "-m", "pytest", *sys.argv[2:]], cwd=ROOT).returncode
    if task == "lowest":
        pip = [interpreter, "-m", "pip", "install", "--quiet"]
        subprocess.run([*pip, "--only-binary", ":all:", *lowest()], check=True)
        subprocess.run([*pip, "--no-deps", "--no-build-isolation", str(ROOT)], check=True)
        # Old libraries use what has since been deprecated in those that they need themselves. Python keeps that from
        # users; the commands, tested in this process, print every warning that it lets through.
        tests = [interpreter, "-m", "pytest", "-W", "ignore::DeprecationWarning", *sys.argv[2:]]
        return subprocess.run(tests, cwd=ROOT).returncode
    if task == "manual":
        install(interpreter, "docs")
        return subprocess.run([interpreter, str(ROOT / "docs" / "manual" / "build.py"), *sys.argv[2:]]).returncode
    if task == "counts":
        install(interpreter, "test")
        return subprocess.run([interpreter, str(ROOT / "tests" / "tools" / "counting.py")]).returncode
    if task == "speed":
        install(interpreter, "speed")
        compare = str(ROOT / "benchmarks" / "speed" / "compare.py")
        return subprocess.run([interpreter, compare, *sys.argv[2:]]).returncode
    if task == "docs":
        install(interpreter, "")
        return subprocess.run([interpreter, str(ROOT / "docs" / "make.py"), *sys.argv[2:]]).returncode
    install(interpreter, "test,lint")
    codes = [
        subprocess.run([interpreter, "-m", *command], cwd=ROOT).returncode
        for command in (["ruff", "check", "."], ["ruff", "format", "--check", "."], ["mypy"])
    ]
    return max(codes)


if __name__ == "__main__":
    sys.exit(main())
