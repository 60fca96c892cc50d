"""The page on paper: a PDF, printed by a browser of this machine without a window and without a network."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from ...errors import DependencyError, WriteError

NAMES = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"),
    *("msedge", "microsoft-edge", "microsoft-edge-stable", "brave-browser"),
)
"""Programs that print pages, by name."""

PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
    r"C:\Program Files\Microsoft\Edge\Application\msedge.exe",
)
"""Where they stand on systems that do not look for them by name."""

SECONDS = 120
"""How long a page may take to be printed."""

FLAGS = (
    *("--headless", "--disable-gpu", "--no-first-run", "--no-default-browser-check", "--disable-extensions"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic"),
    *("--host-resolver-rules=MAP * ~NOTFOUND", "--no-pdf-header-footer", "--print-to-pdf-no-header"),
)
"""Without a window, without a network, without what people have set up."""


def found() -> str:
    """The browser. Raises DependencyError where there is none."""
    for name in NAMES:
        if path := shutil.which(name):
            return path
    for place in PLACES:
        if os.path.isfile(place):
            return place
    raise DependencyError(
        "a PDF of the report needs Chromium, Chrome or Edge, and none of them is found; install one, or write .html "
        "and print it from any browser"
    )


def print_page(page: str, final: Path, browser: str) -> None:
    """Print a page into a PDF file."""
    with TemporaryDirectory(prefix="gonio-report-", ignore_cleanup_errors=True) as folder:
        source, printed = Path(folder) / "report.html", Path(folder) / "report.pdf"
        source.write_text(page, encoding="utf-8")
        is_root = hasattr(os, "geteuid") and os.geteuid() == 0
        flags = [*FLAGS, f"--user-data-dir={folder}/profile", *(["--no-sandbox"] if is_root else [])]
        command = [browser, *flags, f"--print-to-pdf={printed}", source.as_uri()]
        try:
            done = subprocess.run(command, capture_output=True, timeout=SECONDS, stdin=subprocess.DEVNULL)
        except subprocess.TimeoutExpired:
            raise WriteError(
                f"{browser}: not done within {SECONDS} s; write .html and print it from a browser"
            ) from None
        except OSError as error:
            raise DependencyError(
                f"{browser}: cannot be started: {error.strerror}; install Chromium or Chrome"
            ) from None
        if not printed.is_file() or not printed.read_bytes().startswith(b"%PDF"):
            said = done.stderr.decode(sys.getdefaultencoding(), "replace").strip().splitlines()
            why = f": {said[-1]:.200}" if said else ""
            raise WriteError(f"{browser} printed no PDF{why}; write .html and print it from a browser")
        shutil.copyfile(printed, final)
