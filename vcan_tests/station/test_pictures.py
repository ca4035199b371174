"""Pictures of each panel at a desktop and on a phone, for the documentation (``make station-pictures``)."""

from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image

from vcan_tests.station.browser import DESKTOP, PANELS, PHONE, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Robot
from vcan_tests.station.suite import PICTURES
from vcan_tests.station.test_paths import PANEL, insert

pytestmark = pytest.mark.station

ROBOTS = ("semitrailer",)
SHOWN_M = 0.5
"""Of the path is driven before the first picture."""
FEWEST_COLOURS = 12
"""A page on which nothing is drawn has fewer."""
LARGEST_BYTES = 150_000


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where pictures are kept: with the documentation where somebody asks for it."""
    kept = Path(os.environ.get(PICTURES, tmp_path))
    kept.mkdir(parents=True, exist_ok=True)
    return kept


def take(operator: Operator, folder: Path, name: str) -> None:
    """Keep what is seen now."""
    file = folder / f"{name}.webp"
    with Image.open(BytesIO(operator.page.screenshot(animations="disabled"))) as picture:
        shown = picture.convert("RGB")
    assert len(shown.getcolors(1 << 24) or ()) >= FEWEST_COLOURS, name
    shown.save(file, lossless=True, method=6)
    assert file.stat().st_size < LARGEST_BYTES, (name, file.stat().st_size)


def begin_to_drive(operator: Operator, robot: Robot) -> None:
    """Draw a path, and have it driven for a while."""
    operator.go_to("paths")
    insert(operator, "line", length="1")
    insert(operator, "arc", radius="1.2", turn="60")
    insert(operator, "line", length="0.5")
    operator.sees(PANEL, "Can be driven")
    operator.page.click("#path-drive")
    robot.comes_to(lambda status: (status["vehicle"]["following"] or {}).get("progress_m", 0.0) > SHOWN_M)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_panels_at_a_desktop(meet: Meet, robot: Robot, folder: Path, scheme: str) -> None:
    operator = meet(**DESKTOP, color_scheme=scheme)
    operator.open(robot.name)
    begin_to_drive(operator, robot)
    panels = [panel for panel in PANELS if panel != "map"] if scheme == "light" else ["paths"]
    for panel in sorted(panels, key=lambda panel: panel != "paths"):
        operator.go_to(panel)
        if panel == "objects":
            operator.page.fill("[data-panel=objects] input[type=search]", "0x6083")
            operator.page.get_by_role("button", name="0x6083").click()
            operator.sees("[data-panel=objects] .value", "rpm/s")
        if panel == "runs":
            robot.comes_to(lambda status: not status["motions"])
            operator.page.get_by_role("button", name="Reload").click()
            operator.page.locator("[data-panel=runs] tbody button").first.click()
            operator.page.wait_for_selector("img.run-picture", state="visible", timeout=60_000)
        operator.catches_up()
        take(operator, folder, f"desktop-{panel}" if scheme == "light" else f"desktop-{panel}-dark")


def test_the_panels_on_a_phone(meet: Meet, robot: Robot, folder: Path) -> None:
    operator = meet(**PHONE)
    operator.open(robot.name)
    begin_to_drive(operator, robot)
    for panel in sorted(PANELS, key=lambda panel: panel not in ("paths", "map")):
        operator.go_to(panel)
        operator.page.evaluate("() => scrollTo(0, 0)")
        operator.catches_up()
        take(operator, folder, f"phone-{panel}")
