"""The system's Chromium, driven by Playwright, for tests of pages; ``conftest.py`` of tests/view and tests/web make its fixtures known."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

CHROMIUM = Path("/usr/bin/chromium")
FLAGS = (  # WebGL2 by software; nothing that asks a network by itself
    "--headless=new --no-sandbox --disable-gpu-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic "
    "--no-first-run --disable-background-networking --disable-component-update --disable-sync --disable-dev-shm-usage"
)

Answer = TypeVar("Answer")


def until(question: Callable[[], Answer], what: str, seconds: float = 60.0) -> Answer:
    """Wait until the question's answer is true, and return it (a page's policy forbids Playwright's own way, which is eval)."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if answer := question():
            return answer
        time.sleep(0.05)
    raise AssertionError(f"the page did not show {what} within {seconds:g} s")


@dataclass(kw_only=True)
class Tab:
    """A page and what it said. complaints : of the console (warnings, errors) and uncaught ones. asked : addresses of its requests."""

    page: "Page"
    complaints: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    @property
    def schemes(self) -> set[str]:
        """Of the addresses that were asked for."""
        return {address.split(":")[0] for address in self.asked}


@pytest.fixture(scope="module")
def browser() -> Iterator["Browser"]:
    """A headless Chromium with a fresh profile; one for each module, since Playwright's event loop runs as long as it lives."""
    if not CHROMIUM.exists():
        pytest.skip(f"no browser: {CHROMIUM} comes with Debian's package chromium")
    api = pytest.importorskip("playwright.sync_api", reason="no playwright: pip install 'rille[dev]'")
    with api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS.split())
        yield found
        found.close()


@pytest.fixture
def tab(browser: "Browser") -> Iterator[Tab]:
    """An empty page of 1280 x 720 pixels."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.set_default_timeout(60_000)
    found = Tab(page=context.new_page())
    found.page.on("console", lambda message: found.complaints.append(message.text) if message.type in ("error", "warning") else None)
    found.page.on("pageerror", lambda error: found.complaints.append(str(error)))
    found.page.on("request", lambda request: found.asked.append(request.url))
    yield found
    context.close()
