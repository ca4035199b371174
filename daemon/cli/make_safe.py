"""``canhelm make-safe``: clean up behind a daemon that has died."""

from __future__ import annotations

import asyncio
import os
from typing import TYPE_CHECKING

from canhelm.errors import CanhelmError, NodeAbsent, Timeout
from daemon.cli.output import say, say_error, say_warning

if TYPE_CHECKING:
    from collections.abc import Mapping

    from drivers.canopen.master import Master
    from drivers.devices import Connect
    from profiles.schema import Profile

SETTLING_S = 0.3
"""Time that wheels and body are given beyond the longest ramp."""
BRICK_WITHIN_S = 2.5
LONGEST_S = 8.0
"""What is not done by then is left."""


def make_safe(*, profile: str, bus: str) -> int:
    """Stop all drives, engage their brakes and switch them off, after the daemon was killed. Not beside a running one.

    The service does it at its every end, with the profile that the daemon had; nothing changes where the daemon has
    ended in order.

    Example: `canhelm make-safe --profile max2d --bus socketcan:can0`

    Args:
        profile: Name of a profile, or a YAML file.
        bus: The bus of the daemon: `socketcan:can0` or `rs232:/dev/ttyS0@115200`.
    """
    from daemon.cli.run import simulates

    if simulates(bus):
        say("the network was simulated and has gone with its daemon")
        return 0
    return asyncio.run(_within_time(_robot(profile), bus))


def _robot(named: str) -> Profile:
    """The profile that the daemon had, else that of this name; reading files and checking them takes its time."""
    from profiles.kept import kept, runtime_folder

    folder = runtime_folder(os.environ)
    robot = kept(folder) if folder else None
    if robot is None:
        from profiles.loader import load

        robot = load(named).profile
    return robot


async def _within_time(profile: Profile, spec: str) -> int:
    try:
        async with asyncio.timeout(LONGEST_S):
            return await _on_bus(profile, spec)
    except TimeoutError:
        say_error(Timeout(f"not done within {LONGEST_S:g} s", remedy="take the motor power away"))
        return Timeout.exit_code


async def _on_bus(profile: Profile, spec: str) -> int:
    from daemon.wires import make_wire
    from drivers.canopen.master import Master

    wire = make_wire(spec, profile, 0)
    master = Master(wire.bus, wire.profile.network)
    bricks = asyncio.create_task(stop_bricks(wire.bricks))
    try:
        await master.start()
        return await secure(master, wire.profile) if profile.drives else 0
    except CanhelmError as error:
        say_warning(f"no drive can be reached: {error}")
        return 0
    finally:
        await master.close()
        await bricks


async def stop_bricks(ways: Mapping[str, Connect]) -> None:
    """Connect to each brick, which stops its motors, and let it go."""
    from drivers.nxt.brick import Brick

    for name, connect in ways.items():
        brick = Brick(name, connect)
        brick.start()
        try:
            async with asyncio.timeout(BRICK_WITHIN_S):
                await brick.wait_ready()
            say(f"the motors of brick {name} are stopped")
        except TimeoutError:
            say_warning(f"brick {name} cannot be reached: {brick.status_sentence}")
        await brick.close()


async def secure(master: Master, profile: Profile) -> int:
    """Stop every drive of a profile, and switch them off when all are at rest.

    Args:
        master: of their bus, started.
        profile: the robot.

    Returns:
        The exit code: 0 where each drive that answers is safe now.
    """
    drives = [_Left(master, profile, name) for name in profile.drives]
    await asyncio.gather(*(drive.stop() for drive in drives))
    ramp_s = max(drive.ramp_s for drive in drives)
    await asyncio.sleep(ramp_s + SETTLING_S if ramp_s else 0.0)
    await asyncio.gather(*(drive.switch_off() for drive in drives))
    safe = [drive for drive in drives if drive.failure is None]
    for drive in drives:
        if isinstance(drive.failure, NodeAbsent):
            say_warning(str(drive.failure))
        elif drive.failure is not None:
            say_error(drive.failure)
    say(f"{len(safe)} of {len(drives)} drives are stopped and off, their brakes engaged")
    return int(any(drive.failure and not isinstance(drive.failure, NodeAbsent) for drive in drives))


class _Left:
    """A drive that was left behind; what fails first ends the work on it."""

    def __init__(self, master: Master, profile: Profile, name: str) -> None:
        self.failure: CanhelmError | None = None
        self.ramp_s = 0.0
        self._config = profile.drives[name]
        self._brakes = [brake for brake in profile.brakes.values() if brake.drive == name]
        self._who = f"node {self._config.node} ({name})"
        master.names[self._config.node] = name
        self._sdo = master.sdo(self._config.node)

    async def stop(self) -> None:
        from drivers.epos import make_safe

        try:
            self.ramp_s = await make_safe.stop(self._sdo, self._config, self._brakes)
        except CanhelmError as error:
            self.failure = error

    async def switch_off(self) -> None:
        from drivers.epos import make_safe

        try:
            if self.failure is None:
                speed_m_s = await make_safe.switch_off(self._sdo, self._config, self._who)
                if speed_m_s > make_safe.AT_REST_M_S:
                    say_warning(f"{self._who} rolls on at {speed_m_s:.2f} m/s without torque")
        except CanhelmError as error:
            self.failure = error
