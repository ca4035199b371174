"""The second part of ``make vcan-figures``: the journal of one life of the service, and the times of a clean-up.

It boots a guest for that: what it installs and kills is never this machine's.
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from vcan_tests.kernel.guest import exchange_folder, is_guest, run_in_guest
from vcan_tests.kernel.processes import run
from vcan_tests.kernel.suite import build_package
from vcan_tests.kernel.tools import require_tools
from vcan_tests.systemd.bench import PATIENT, PROFILE, SERVICE, Journal, Robot, Witness, told, until

MODULE = "vcan_tests.systemd.figures"
LONGEST_S = 600.0
FRONT_LEFT = 3
"""The drive that carries the front brake on its output."""
BRAKE_OUTPUT = 1 << 12
"""Its bit of the output word; 0 energises the coil and releases the brake."""
BRAKE_CLOSES_S = 0.05
_OUTPUTS = "digital_output_functions_state"
SHIPPED = "schema_version: 1\nextends: robots/max2d\n"


@dataclass(frozen=True)
class CleanUp:
    """Times after `kill -9` while the front pair turns [s].

    Attributes:
        stopped_s: until the last drive was told to stop.
        engaged_s: until the brake was engaged, its closing time included.
        off_s: until the last drive was switched off.
        ready_s: until the service could be asked again.
    """

    stopped_s: float
    engaged_s: float
    off_s: float
    ready_s: float

    def __str__(self) -> str:
        return (
            f"drives told to stop after {self.stopped_s:.2f} s, brake engaged after {self.engaged_s:.2f} s, "
            f"drives off after {self.off_s:.2f} s, ready again after {self.ready_s:.2f} s"
        )


async def one_life(robot: Robot) -> Journal:
    """Start without motor power, drive, lose a drive, recover, stop; the journal of it."""
    robot.clear()
    journal = Journal()
    told("systemctl", "start", SERVICE)
    await until(lambda: robot.show("StatusText").startswith("waiting for"))
    robot.simulate()
    await robot.until_state("idle")
    await robot.drive()
    told("cansend", "vcan0", f"000#81{FRONT_LEFT:02X}")  # what a short loss of its supply does, too
    await until(lambda: robot.show("StatusText").startswith("fault: stopped by a fault that is gone"))
    told("canhelm", "reset")
    await robot.until_state("idle")
    await robot.drive()
    told("systemctl", "stop", SERVICE)
    return journal


async def clean_up_of_a_turning_pair(robot: Robot, folder: Path) -> CleanUp:
    """Kill the daemon while a pair turns, its brake released; by what was on the bus, and by systemd's own words."""
    pid, restarts = robot.pid, robot.restarts
    with Witness(folder) as witness:
        await robot.turn_front_pair()
        killed_s = time.time()
        os.kill(pid, signal.SIGKILL)
        await until(lambda: robot.restarts > restarts and robot.show("ActiveState") == "active")
    assert not witness.written(FRONT_LEFT, _OUTPUTS, killed_s) & BRAKE_OUTPUT, "the brake was engaged before"
    told_to_stop_s = max(witness.answered_s(node, "controlword", killed_s)[0] for node in (1, 2, 3, 4))
    engaged_s = witness.answered_s(FRONT_LEFT, _OUTPUTS, killed_s)[0] + BRAKE_CLOSES_S
    off_s = max(witness.answered_s(node, "controlword", killed_s)[1] for node in (1, 2, 3, 4))
    ready_s = robot.entered_active_s()
    return CleanUp(*(moment_s - killed_s for moment_s in (told_to_stop_s, engaged_s, off_s, ready_s)))


def main() -> int:
    """Measure in a guest; zero when all could be measured."""
    if is_guest():
        asyncio.run(_measure())
        return 0
    require_tools()
    return run(_measure_in_guest())


async def _measure_in_guest() -> int:
    await build_package()
    with exchange_folder() as exchange:
        command = [sys.executable, "-m", MODULE]
        return (await run_in_guest(command, exchange, systemd=True, timeout_s=LONGEST_S)).status


async def _measure() -> None:
    """Print it all."""
    robot = Robot()
    journal = await one_life(robot)
    await journal.has("Deactivated successfully")
    print(journal.read("--output=short", "--no-hostname"))
    with tempfile.TemporaryDirectory() as folder:
        for name, profile in (("with 10 cycles a second", PATIENT), ("as shipped", SHIPPED)):
            robot.clear()
            PROFILE.write_text(profile)
            await robot.begin()
            print(
                f"kill -9 while a pair turns, profile {name}: {await clean_up_of_a_turning_pair(robot, Path(folder))}"
            )


if __name__ == "__main__":
    sys.exit(main())
