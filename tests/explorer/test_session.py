"""The workers of a server, each a process of a few lines here: who is ended, who is asked anew, how many there are."""

import subprocess
import sys
import time
from concurrent.futures import wait

import pytest

from gonio.errors import WorkerError
from gonio.explorer import session
from gonio.explorer.calls import CALLS, PageCall
from gonio.explorer.process import Process
from gonio.explorer.session import Session

WORKER = r"""
import os, struct, sys, threading, time
lock = threading.Lock()

def answer(number, message):
    word, _, seconds = message.partition(b" ")
    if word == b"crash":
        os._exit(3)
    if word == b"sleep":
        time.sleep(float(seconds))
    with lock:
        if word == b"block":
            time.sleep(float(seconds))
        content = str(os.getpid()).encode()
        sys.stdout.buffer.write(struct.pack("<II", number, len(content)) + content)
        sys.stdout.buffer.flush()

while head := sys.stdin.buffer.read(8):
    number, length = struct.unpack("<II", head)
    threading.Thread(target=answer, args=(number, sys.stdin.buffer.read(length)), daemon=True).start()
os._exit(0)
"""


@pytest.fixture
def workers(tmp_path, monkeypatch):
    """A session that finds a call long after 0.2 s, and what it has started; a call may take 60 s, "short" 1 s."""
    started = []

    def start():
        popen = subprocess.Popen(
            [sys.executable, "-I", "-S", "-c", WORKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        started.append(popen)
        return Process(popen.pid, popen.stdin, popen.stdout, popen)

    monkeypatch.setattr(session, "started", start)
    monkeypatch.setattr(session, "BUSY", 0.2)
    monkeypatch.setattr(session, "FULL", 0.6)
    monkeypatch.setattr(session, "IDLE", 2.0)
    monkeypatch.setitem(CALLS, "short", PageCall(lambda shelf: {}, 1.0))
    with Session([], tmp_path) as found:
        yield found, started
    assert all(popen.poll() is not None for popen in started)


def alive(started):
    return [popen for popen in started if popen.poll() is None]


def test_a_time_out_ends_its_call_alone(workers):
    found, started = workers
    slow = found.ask("short", b"sleep 100")
    fit = found.ask("fit", b"sleep 2.5")  # in the same process, and long after the other one is ended
    quick = [found.ask("f", b"now") for _ in range(5)]
    assert len({future.result(30) for future in quick}) == 1
    with pytest.raises(WorkerError, match=r"took more than 1 s and was ended, alone"):
        slow.result(30)
    assert found.ask("f", b"now").result(30)
    assert fit.result(30)
    deadline = time.monotonic() + 10
    while len(alive(started)) > 1 and time.monotonic() < deadline:  # an idle one is ended too
        time.sleep(0.05)
    assert started[0].poll() is not None and len(alive(started)) == 1


def test_quick_calls_go_on_beside_long_ones(workers):
    found, _ = workers
    long = found.ask("check", b"block 5")  # of whom nobody else gets an answer, in the same process
    first, second = (found.ask("f", b"now").result(30) for _ in range(2))
    assert not long.done() and first == second != long.result(30)


def test_there_are_four_workers_at_most_and_who_is_too_many_is_told(workers):
    found, started = workers
    long = []
    for _ in range(3):
        long.append(found.ask("fit", b"sleep 100"))
        time.sleep(0.8)
    assert found.ask("f", b"now").result(30)
    many = found.ask("fit", b"sleep 100")
    with pytest.raises(
        WorkerError, match=r"longer than 0.6 s, and 3 others are computed, as many as at a time; ask again"
    ):
        many.result(30)
    assert found.ask("f", b"now").result(30)
    assert not any(future.done() for future in long) and len(alive(started)) <= 4


def test_what_nobody_waits_for_any_more_is_ended(workers):
    found, started = workers
    found.ask("fit", b"sleep 100").cancel()
    started[0].wait(10)
    assert found.ask("f", b"now").result(30)


def test_a_worker_that_crashes_is_followed_by_another(workers):
    found, _ = workers
    with pytest.raises(WorkerError, match=r"crashed \(exit code 3\)"):
        found.ask("f", b"crash").result(30)
    assert found.ask("f", b"now").result(30)


def test_workers_that_nobody_asks_are_ended(workers, monkeypatch):
    found, started = workers
    monkeypatch.setattr(session, "IDLE", 0.5)
    long = [found.ask("fit", b"sleep 1") for _ in range(2)]
    wait(long)
    time.sleep(1.5)
    assert len(alive(started)) == 1 and int(found.ask("f", b"now").result(30)) in {p.pid for p in alive(started)}


def test_who_waits_when_it_all_ends_is_told(workers):
    found, _ = workers
    late = found.ask("fit", b"sleep 100")
    found.close()
    with pytest.raises(WorkerError, match="ended, with its server"):
        late.result(1)
    with pytest.raises(WorkerError, match="ended, with its server"):
        found.ask("f", b"now")
