"""Starting the process of the worker, whose standard input and output are pipes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from typing import IO, NamedTuple, NoReturn


class Process(NamedTuple):
    """A process that was started, and the ends of its pipes."""

    pid: int
    requests: IO[bytes]
    answers: IO[bytes]
    popen: subprocess.Popen[bytes] | None

    def kill(self) -> None:
        """End it. It must not have been waited for."""
        os.kill(self.pid, getattr(signal, "SIGKILL", signal.SIGTERM))

    def wait(self) -> int:
        """Its exit code, below 0 for a signal, as soon as it has ended."""
        if self.popen is not None:
            return self.popen.wait()
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


def started() -> Process:
    """A worker. A process without threads forks, which takes no time to import gonio once more."""
    if sys.platform == "linux" and threading.active_count() == 1:
        return _forked()
    popen = subprocess.Popen(command(), stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True)
    assert popen.stdin is not None and popen.stdout is not None
    return Process(popen.pid, popen.stdin, popen.stdout, popen)


def command() -> list[str]:
    """The command line of a worker, which imports from where this process does, and from no other folder."""
    code = f"import sys; sys.path[:] = {sys.path!r}; from gonio.explorer.worker import main; main()"
    return [sys.executable, "-P", "-c", code]


def _forked() -> Process:
    requests_in, requests_out = os.pipe()
    answers_in, answers_out = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(requests_out)
        os.close(answers_in)
        _work(requests_in, answers_out)
    os.close(requests_in)
    os.close(answers_out)
    return Process(pid, os.fdopen(requests_out, "wb"), os.fdopen(answers_in, "rb"), None)


def _work(requests: int, answers: int) -> NoReturn:
    """Be a worker; the forked process must not come back."""
    try:
        os.setsid()  # Ctrl-C is the server's affair
        os.dup2(requests, 0)
        os.dup2(answers, 1)
        os.close(requests)
        os.close(answers)
        from .worker import main

        main()
    finally:
        os._exit(1)
