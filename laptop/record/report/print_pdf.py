"""Printing of a page to PDF by an installed Chromium."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from laptop.system import platforms
from shared.arm_description import ArmError

BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"),
    *("msedge", "microsoft-edge", "chromium-headless-shell"),
)
"""Names of programs that can print so."""
BROWSER_PATHS = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
"""Paths of such programs on systems that do not put them on the PATH."""
PRINT_TIMEOUT = 120.0
"""Longest time that printing may take, s."""


class CannotPrint(ArmError, OSError):
    """No browser is there, or it does not print."""


def find_browser() -> str:
    """Return the program that prints.

    Raises:
        CannotPrint: there is none.
    """
    found = [*filter(None, map(shutil.which, BROWSERS)), *filter(os.path.exists, BROWSER_PATHS)]
    if not found:
        raise CannotPrint(
            "there is no Chromium, Chrome or Edge to make a PDF; install one, or open the HTML in "
            "any browser and print it from there"
        )
    return found[0]


def print_pdf(html: str, out: Path, browser: str) -> None:
    """Print a page without external files, in its own style.

    Raises:
        CannotPrint: the browser does not, or the file cannot be written.
    """
    with tempfile.TemporaryDirectory() as folder:
        page, made = Path(folder) / "page.html", Path(folder) / "page.pdf"
        page.write_text(html, encoding="utf-8")
        args = [
            *(browser, "--headless", "--disable-gpu", "--no-first-run", "--no-pdf-header-footer"),
            *(f"--user-data-dir={folder}/profile", f"--print-to-pdf={made}"),
            *(["--no-sandbox"] if platforms.is_root() else []),
            page.as_uri(),
        ]
        try:
            subprocess.run(args, capture_output=True, timeout=PRINT_TIMEOUT, check=False)
        except (OSError, subprocess.TimeoutExpired):
            raise CannotPrint(f"{browser} did not start, or did not end; print the HTML") from None
        if not _is_pdf(made):
            raise CannotPrint(
                f"{browser} has printed nothing; open the HTML in a browser and print it from there"
            )
        try:
            shutil.copyfile(made, out)
        except OSError as error:
            raise CannotPrint(
                f"cannot write {out}: {error.strerror}; give another file with --to"
            ) from None


def _is_pdf(file: Path) -> bool:
    """Return whether a file is there that begins and ends as a PDF."""
    try:
        content = file.read_bytes()
    except OSError:
        return False
    return content.startswith(b"%PDF-") and b"%%EOF" in content[-1024:]
