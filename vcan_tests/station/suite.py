"""``make station-test``: the tests marked ``station``; Chromium is installed where it is missing."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

from vcan_tests.kernel.errors import MissingTool
from vcan_tests.kernel.guest import NO_STATUS, exchange_folder
from vcan_tests.kernel.suite import Part, part_of, pytest_command
from vcan_tests.kernel.tools import require_packages
from vcan_tests.station.browser import CHROMIUM

MARK = "station"
PACKAGES = ["chromium", "fonts-dejavu-core"]
TWO_AT_A_TIME = ["-n", "2", "--dist", "loadfile"]
"""Tests of two files, each with a browser and robots of its own: they wait more than they compute."""
PICTURES = "CANHELM_PICTURES"
"""The folder that pictures are kept in, for the tests that take them."""


def main() -> int:
    """Zero when every test passed and none was skipped."""
    parser = argparse.ArgumentParser(prog="make station-test", description=__doc__)
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="only take the pictures, and keep them there")
    asked, options = parser.parse_known_args()
    try:
        require_chromium()
    except MissingTool as error:
        print(f"make station-test can't run: {error}", file=sys.stderr)
        return NO_STATUS
    part = run(options, asked.pictures)
    print(f"station-test: {part}")
    return 0 if part.good else 1


def require_chromium() -> None:
    """Installs Chromium where it is missing. Raises MissingTool where it can't be installed from here."""
    if not CHROMIUM.exists():
        require_packages(PACKAGES)


def run(options: list[str], pictures: Path | None) -> Part:
    """Run the tests, or those alone that take pictures."""
    chosen = ["vcan_tests/station/test_pictures.py"] if pictures else TWO_AT_A_TIME
    kept = {PICTURES: str(pictures.resolve())} if pictures else {}
    with exchange_folder() as exchange:
        command = pytest_command(MARK, exchange, [*chosen, *options])
        status = subprocess.run(command, env={**os.environ, **kept}).returncode
        return part_of(MARK, version(), status, exchange)


def version() -> str:
    """Which Chromium it is."""
    told = subprocess.run([CHROMIUM, "--version"], capture_output=True, text=True, check=True)
    return told.stdout.strip()


if __name__ == "__main__":
    sys.exit(main())
