"""`scheduler="processes"`: Pythons at the ends of pipes, which nobody else reaches and which end with their parent."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

import gonio as gn
from gonio.errors import WorkerError
from gonio.fitting import processes
from gonio.fitting.cluster import workers

pytestmark = pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux")

SOURCE = str(Path(gn.__file__).parents[1])

LOOK = f"""
import os, sys
from contextlib import suppress
from pathlib import Path
sys.path.insert(0, {SOURCE!r})

def family(pid):
    tree, parents = {{pid}}, {{}}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
    for _ in parents:
        tree |= {{p for p, parent in parents.items() if parent in tree}}
    return tree

def sockets(pid):
    found = set()
    for one in family(pid):
        for path in Path(f"/proc/{{one}}/fd").glob("*"):
            with suppress(OSError):
                found.add(os.readlink(path))
    return {{x[8:-1] for x in found if x.startswith("socket:")}}

def listening(pid):
    lines = [line.split() for name in ("tcp", "tcp6") for line in Path("/proc/net", name).read_text().splitlines()]
    ours = sockets(pid)
    return [line[1] for line in lines if line[3] == "0A" and line[9] in ours]
"""

FIT = """
import warnings
import numpy as np
import gonio as gn
from gonio.authoring import Reflectance, param

class Paint(Reflectance):
    "Paint."
    rho = param(0.5, 0.0, 1.0, "albedo")

    def formula(self, wi, wo):
        return self.rho / np.pi

seen = []
look = lambda done, total: seen.append((len(family(os.getpid())), len(sockets(os.getpid())), listening(os.getpid())))
# no guard: this script is not run once more
table = gn.fitting.fit_many({"a": gn.Lambertian(0.3)}, {"m": Paint()}, starts=1, scheduler="processes:1", progress=look)
print(table["status"][0], table["rho"][0].round(3), max(n for n, *_ in seen), *{str(rest) for _, *rest in seen})
"""


def script(text, **options):
    return subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, text=True, **options)


@pytest.mark.slow_because("two Pythons of their own import gonio, and one fits")
@pytest.mark.parametrize("given", ["by file", pytest.param("on standard input", marks=pytest.mark.full)])
def test_nothing_listens_and_a_script_needs_no_guard(tmp_path, given):
    """A class of a script is sent with its code."""
    (tmp_path / "script.py").write_text(LOOK + FIT)
    words = [tmp_path / "script.py"] if given == "by file" else ["-"]
    done = subprocess.run(
        [sys.executable, *words], input=LOOK + FIT, capture_output=True, text=True, env={**os.environ}, check=False
    )
    assert done.stdout.splitlines() == ["fitted 0.3 2 [0, []]"], done.stderr


def test_the_check_sees_what_listens():
    scope: dict = {}
    exec(LOOK, scope)
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        assert scope["listening"](os.getpid())


@pytest.mark.slow_because("Pythons of their own import gonio")
def test_processes_hold_no_socket_and_know_no_dask(monkeypatch):
    def refused(*args, **options):
        raise AssertionError("a socket")

    monkeypatch.setattr(socket.socket, "bind", refused)
    monkeypatch.setattr(socket.socket, "connect", refused)
    monkeypatch.setattr(processes, "TRIES", 2)
    links = "[os.readlink(f'/proc/self/fd/{n}') for n in os.listdir('/proc/self/fd')[:-1]]"
    asked = f"(lambda os, sys: ({links}, [*sys.modules]))(__import__('os'), __import__('sys'))"
    with workers("processes:1") as crew:
        [(_, (files, modules), error)] = crew.results(eval, [asked])
        assert error is None and not [x for x in files if x.startswith("socket:")]
        assert not {"distributed", "dask", "multiprocessing.managers"} & {*modules}
        errors = [error for *_, error in crew.results(eval, ["1 / 0", "__import__('os')._exit(3)", "print('x') or 1"])]
    found = {type(error) for error in errors}
    assert found == {ZeroDivisionError, WorkerError, type(None)}
    assert any("ended, 2 times (exit code 3)" in str(error) for error in errors)


RUN = f"""
import sys
sys.path.insert(0, {SOURCE!r})
from gonio.fitting.cluster import workers
job = "(__import__('os').getpid(), __import__('time').sleep(30.0 * {{}}))[0]"
with workers("processes:1") as crew:
    for _, pid, _ in crew.results(eval, [job.format(k) for k in range(4)]):
        print(pid, flush=True)
"""


@pytest.mark.slow_because("Pythons of their own import gonio")
@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGKILL, pytest.param(signal.SIGTERM, marks=pytest.mark.full)])
def test_processes_end_with_their_parent(by):
    """Of Ctrl-C, `kill -9`, and `kill`, in the midst of a job."""
    with script(RUN, stderr=subprocess.DEVNULL) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        parent.send_signal(by)
        assert parent.wait(10.0) != 0
    end = time.monotonic() + 10.0
    with suppress(FileNotFoundError, ProcessLookupError):
        while Path(f"/proc/{child}/stat").read_text().split()[2] != "Z":
            assert time.monotonic() < end
            time.sleep(0.01)
