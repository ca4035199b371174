"""``canhelm make-safe``: clean up behind a daemon that has died."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from canhelm.errors import CanhelmError, NodeAbsent, Timeout
from daemon.cli.output import say, say_error, say_warning

if TYPE_CHECKING:
    from drivers.canopen.master import Master
    from profiles.schema import DriveConfig, Profile

LONGEST_S = 8.0
"""What is not done by then is left."""


def make_safe(*, profile: str, bus: str) -> int:
    """Stop all drives, engage their brakes and switch them off, after the daemon was killed. Not beside a running one.

    The service does it at its every end; nothing changes where the daemon has ended in order.

    Example: `canhelm make-safe --profile max2d --bus socketcan:can0`

    Args:
        profile: Name of a profile, or a YAML file.
        bus: The bus of the daemon: `socketcan:can0` or `rs232:/dev/ttyS0@115200`.
    """
    from daemon.cli.run import simulates
    from profiles.loader import load

    if simulates(bus):
        say("the network was simulated and has gone with its daemon")
        return 0
    return asyncio.run(_within_time(load(profile).profile, bus))


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
    try:
        await master.start()
        return await secure(master, wire.profile)
    except CanhelmError as error:
        say_warning(f"no drive can be reached: {error}")
        return 0
    finally:
        await master.close()


async def secure(master: Master, profile: Profile) -> int:
    """Make every drive of a profile safe, all at once.

    Args:
        master: of their bus, started.
        profile: the robot.

    Returns:
        The exit code: 0 where each drive that answers is safe now.
    """
    names = tuple(profile.drives)
    found = await asyncio.gather(*(_secure(master, profile, name) for name in names), return_exceptions=True)
    failures = [error for error in found if error is not None]
    for error in failures:
        if not isinstance(error, CanhelmError):
            raise error
        say_warning(str(error)) if isinstance(error, NodeAbsent) else say_error(error)
    say(f"{len(names) - len(failures)} of {len(names)} drives are at rest and off, their brakes engaged")
    return int(not all(isinstance(error, NodeAbsent) for error in failures))


async def _secure(master: Master, profile: Profile, name: str) -> None:
    from drivers.epos.make_safe import make_safe as make_drive_safe

    config: DriveConfig = profile.drives[name]
    brakes = [brake for brake in profile.brakes.values() if brake.drive == name]
    await make_drive_safe(master.sdo(config.node), config, brakes, f"node {config.node} ({name})")
