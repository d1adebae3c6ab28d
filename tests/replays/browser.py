"""Chromium for tests of pages, with software WebGL; and what a page logs and asks for."""

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

FLAGS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
NAMES = ("chromium", "chromium-browser", "google-chrome")


def executable() -> str | None:
    """A Chromium that is installed; None leaves it to Playwright's own."""
    return next(filter(None, map(shutil.which, NAMES)), None)


@contextmanager
def chromium() -> Iterator[Any]:
    """A browser; skips the test where there is none."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no browser tests without Playwright: pip install playwright"
    )
    with playwright.sync_playwright() as started:
        path = executable() or started.chromium.executable_path
        if not Path(path).exists():
            pytest.skip(f"no browser tests without Chromium: none of {NAMES}, nor {path}")
        browser = started.chromium.launch(executable_path=path, args=list(FLAGS))
        yield browser
        browser.close()


class Watched:
    """A page with all that it logs, and all that it asks the network for."""

    def __init__(self, browser: Any, width: int, height: int) -> None:
        self.page = browser.new_page(viewport={"width": width, "height": height})
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", self._logged)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))

    def _logged(self, message: Any) -> None:
        if message.type in ("error", "warning"):
            self.complaints.append(message.text)

    def open(self, file: Path) -> Any:
        """The page of a file, once it is ready."""
        self.page.goto(file.as_uri())
        wait_until(self.page, "window.rigidReplay !== undefined")
        return self.page


def wait_until(page: Any, claim: str, seconds: float = 20.0) -> None:
    """Wait for a claim; Playwright's own waiting evaluates text, which the page forbids."""
    end = time.monotonic() + seconds
    while not page.evaluate(claim):
        assert time.monotonic() < end, claim
        page.wait_for_timeout(50)
