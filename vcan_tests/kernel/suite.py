"""``make vcan-test``: the tests marked ``vcan`` on a kernel's CAN bus, beside those marked ``systemd`` under a systemd.

Where the running kernel has vcan, the first part runs on it. A machine that can do neither fails; nothing is skipped.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO
from xml.etree import ElementTree

from vcan_tests.kernel import running
from vcan_tests.kernel.errors import MissingTool
from vcan_tests.kernel.fetch import fetch_udev
from vcan_tests.kernel.guest import NO_STATUS, TIMED_OUT, exchange_folder, run_in_guest
from vcan_tests.kernel.processes import run, run_to_end
from vcan_tests.kernel.tools import require_tools

MARKS = ("vcan", "systemd")
WHY = {TIMED_OUT: ", ended by the time-out", NO_STATUS: ", the guest died"}


@dataclass(frozen=True)
class Part:
    """What came of the tests of one mark."""

    mark: str
    kernel: str
    status: int
    passed: int
    failed: int
    skipped: int

    @property
    def good(self) -> bool:
        """Whether there was a test and all passed: a skipped test proves nothing."""
        return self.status == 0 and self.passed > 0 and self.skipped == 0

    def __str__(self) -> str:
        failed = f", {self.failed} FAILED" if self.failed else ""
        skipped = f"{self.skipped} SKIPPED" if self.skipped else "none skipped"
        ending = "" if self.good else f" (exit status {self.status}{WHY.get(self.status, '')})"
        return f"{self.mark} tests on {self.kernel}: {self.passed} passed{failed}, {skipped}{ending}"


def main() -> int:
    """Zero when every test passed and none was skipped."""
    parser = argparse.ArgumentParser(prog="make vcan-test", description=__doc__)
    parser.add_argument("--mark", choices=MARKS, action="append", help="only this part")
    parser.add_argument("--timeout", type=float, default=900.0, metavar="S", help="seconds that a part may take")
    asked, pytest_options = parser.parse_known_args()
    try:
        require_tools()
        parts = run(run_parts(asked.mark or MARKS, asked.timeout, pytest_options))
    except MissingTool as error:
        print(f"make vcan-test can't run: {error}", file=sys.stderr)
        return NO_STATUS
    print(*(f"vcan-test: {part}" for part in parts), sep="\n")
    return 0 if all(part.good for part in parts) else 1


async def run_parts(marks: Sequence[str], timeout_s: float, pytest_options: list[str]) -> list[Part]:
    """Runs the parts side by side, as far as there are processors; what the second one says comes behind the first."""
    processors = asyncio.Semaphore(len(os.sched_getaffinity(0)))

    async def run_in_turn(mark: str, output: IO[bytes] | None) -> Part:
        async with processors:
            return await run_part(mark, timeout_s, pytest_options, output)

    with tempfile.TemporaryFile() as said:
        parts = await asyncio.gather(*map(run_in_turn, marks, (None, said)))
        said.seek(0)
        shutil.copyfileobj(said, sys.stdout.buffer)
    return parts


async def run_part(mark: str, timeout_s: float, pytest_options: list[str], output: IO[bytes] | None) -> Part:
    """Runs the tests of one mark: the service's always in a guest, so that they can't harm this machine."""
    if mark == "vcan" and running.has_vcan():
        return await run_here(mark, timeout_s, pytest_options, output)
    if mark == "systemd":
        await build_package()
        fetch_udev()
    print(f"booting the user-mode kernel for the {mark} tests", flush=True)
    command = pytest_command(mark, Path("/run/guest"), pytest_options)
    with exchange_folder() as exchange:
        systemd = mark == "systemd"
        outcome = await run_in_guest(command, exchange, systemd=systemd, timeout_s=timeout_s, output=output)
        return part_of(mark, f"the user-mode kernel {outcome.kernel}", outcome.status, exchange)


async def build_package() -> None:
    """Builds the package that the service's tests install, on this side, as a guest has no network.

    Raises:
        MissingTool: it can't be built here.
    """
    print("building the Debian package, if it is not there", flush=True)
    if await run_to_end(["make", "--silent", "deb"], timeout_s=None):
        raise MissingTool("the package for the tests of the service can't be built: see what `make deb` says")


async def run_here(mark: str, timeout_s: float, pytest_options: list[str], output: IO[bytes] | None) -> Part:
    """Runs the tests of one mark on the running kernel."""
    kernel = f"the running kernel {os.uname().release}"
    print(f"{mark} tests on {kernel}", flush=True)
    with exchange_folder() as exchange, running.buses_up():
        command = pytest_command(mark, exchange, pytest_options)
        ended = await run_to_end(command, timeout_s, output=output)
        return part_of(mark, kernel, TIMED_OUT if ended is None else ended, exchange)


def pytest_command(mark: str, exchange: Path, options: list[str]) -> list[str]:
    """The call of pytest, with a report to count from. Two guests may run at once, so there is no common cache."""
    pytest = [sys.executable, "-m", "pytest", "-m", mark, "-p", "no:cacheprovider"]
    chosen = any(Path(option.partition("::")[0]).exists() for option in options)
    return [*pytest, f"--junit-xml={exchange}/report.xml", *options, *([] if chosen else [f"vcan_tests/{mark}"])]


def part_of(mark: str, kernel: str, status: int, exchange: Path) -> Part:
    """Counts the tests in pytest's report; there is none when pytest did not come to its end."""
    report = exchange / "report.xml"
    if not report.exists():
        return Part(mark, kernel, status, 0, 0, 0)
    total, failed, errors, skipped = (
        sum(int(suite.get(count, 0)) for suite in ElementTree.parse(report).iter("testsuite"))
        for count in ("tests", "failures", "errors", "skipped")
    )
    return Part(mark, kernel, status, total - failed - errors - skipped, failed + errors, skipped)


if __name__ == "__main__":
    sys.exit(main())
