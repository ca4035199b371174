"""A person at the page: one Chromium for all tests, a new context for each, and a look at what went wrong in it.

Playwright is imported when a browser is asked for: where it is missing, the other tests are collected all the same.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, Request, Response, WebSocket

CHROMIUM = Path("/usr/bin/chromium")
ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
DESKTOP: dict[str, Any] = {"viewport": {"width": 1280, "height": 800}}
PHONE: dict[str, Any] = {
    "viewport": {"width": 390, "height": 844},
    "device_scale_factor": 2,
    "has_touch": True,
    "is_mobile": True,
}
PANELS = ("drive", "map", "devices", "events", "objects", "paths", "runs", "simulation")
TIMEOUT_S = 30.0
CONNECTED = "^connected$"
"""What ``#connection`` says of a robot whose values come."""
READY_TO_DRIVE = "() => document.querySelectorAll('.stick:not([aria-disabled]), #slider-speed:enabled').length === 2"
CAUGHT_UP = """async pause_ms => {
    const { station } = await import("/page/station.js");
    const pause = () => new Promise(done => setTimeout(done, pause_ms));
    await pause();
    for (let frames = 0; frames < 2; frames++) await new Promise(requestAnimationFrame);
    const answered = () => station.call("status").catch(() => pause().then(answered));
    await answered();
}"""
PAUSE_MS = 300.0
"""By the page's own clock: longer than it lets pass between two set-points, and between two looks at its values."""


@contextmanager
def chromium(*more: str) -> Iterator[Browser]:
    """A headless Chromium with a new folder for its data, while the ``with`` block lasts.

    Args:
        more: arguments of its command line.
    """
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*ARGUMENTS, *more])
        yield browser
        browser.close()


class Operator:
    """One person with the page open in a context of their own.

    Args:
        browser: to open the context in.
        url: of the page.
        options: of the context, as ``DESKTOP``.

    Attributes:
        page: the page.
        context: its context.
        problems: what went wrong in it.
    """

    def __init__(self, browser: Browser, url: str, **options: Any) -> None:
        self.url = url
        self.problems: list[str] = []
        self._expected: list[str] = []
        self.context: BrowserContext = browser.new_context(**(options or DESKTOP))
        self.context.set_default_timeout(TIMEOUT_S * 1e3)
        self.page: Page = self.context.new_page()
        self._watch(self.page)

    def _watch(self, page: Page) -> None:
        page.on("console", self._on_console)
        page.on("pageerror", lambda error: self.problems.append(f"page error: {error}"))
        page.on("requestfailed", lambda request: self.problems.append(f"failed: {request.url}: {request.failure}"))
        page.on("request", self._on_request)
        page.on("response", self._on_response)
        page.on("websocket", self._on_socket)

    def _on_console(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            self.problems.append(f"console {message.type}: {message.text} {message.location.get('url', '')}")

    def _on_request(self, request: Request) -> None:
        self._require_own(request.url)

    def _on_response(self, response: Response) -> None:
        if response.status >= 400:
            self.problems.append(f"{response.status}: {response.url}")

    def _on_socket(self, socket: WebSocket) -> None:
        self._require_own(socket.url)

    def _require_own(self, url: str) -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("data", "blob") and parts.netloc != urlsplit(self.url).netloc:
            self.problems.append(f"leaves the station: {url}")

    def expects(self, *patterns: str) -> None:
        """From now on what matches one of these is no problem."""
        self._expected += patterns

    def unexpected(self) -> list[str]:
        """The problems that nobody has expected."""
        return [what for what in self.problems if not any(re.search(pattern, what) for pattern in self._expected)]

    # -- what a person does -------------------------------------------------------------------------------------------

    def open(self, robot: str | None = None) -> None:
        """Open the page, and choose a robot."""
        self.page.goto(self.url)
        if robot is not None:
            self.choose(robot)

    def choose(self, robot: str) -> None:
        """Choose a robot; returns when the page shows its state."""
        self.page.wait_for_selector(f"#robot option[value='{robot}']", state="attached")
        self.expects("WebSocket is closed before the connection is established")  # that of the robot shown before
        self.page.select_option("#robot", robot)
        self.sees("#connection", CONNECTED)

    def go_to(self, panel: str) -> None:
        """Open a panel by its tab; returns when it shows."""
        self.page.click(f"nav a[href='#{panel}']")
        self.page.wait_for_selector(f"[data-panel={panel}]", state="visible")

    def take_seat(self) -> None:
        """Open the panel for driving; returns when it knows how this vehicle is driven, and lets somebody drive."""
        self.go_to("drive")
        self.until(lambda: self.page.evaluate(READY_TO_DRIVE), lambda: f"not to be driven: {self.text('#why-drive')}")

    def text(self, selector: str) -> str:
        """What stands in an element."""
        return str(self.page.inner_text(selector))

    def sees(self, selector: str, words: str, within_s: float = TIMEOUT_S) -> None:
        """Wait until these words, a regular expression in any case, stand in an element."""
        self.until(
            lambda: re.search(words, self.text(selector), re.IGNORECASE),
            lambda: f"{selector} says {self.text(selector)!r}, not {words!r}",
            within_s,
        )

    def until(self, condition: Callable[[], object], told: Callable[[], str], within_s: float = TIMEOUT_S) -> None:
        """Look again and again until something is so, while the page goes on."""
        deadline = time.monotonic() + within_s
        while not condition():
            assert time.monotonic() < deadline, told()
            self.page.wait_for_timeout(20.0)

    def comes_to(self, look: Callable[[], object], wanted: object) -> None:
        """Look at the page again and again until this is what is found."""
        self.until(lambda: look() == wanted, lambda: f"found {look()!r}, not {wanted!r}")

    def catches_up(self) -> None:
        """Wait until the page has done what it does of what went before, and the daemon has answered all of it.

        Whoever asserts that something has not happened waits for this first.
        """
        self.page.evaluate(CAUGHT_UP, PAUSE_MS)

    def pulls(self, selector: str, right: float, up: float) -> None:
        """Press on the middle of an element and pull, in parts of half its size; the button stays down."""
        box = self.page.locator(selector).bounding_box()
        assert box is not None, selector
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x + right * box["width"] / 2, y - up * box["height"] / 2, steps=4)

    def close(self) -> None:
        """Close the page and its context."""
        self.context.close()
