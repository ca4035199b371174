"""``canhelm calibrate straight`` and ``square``: wheel radius and track by measured ways."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

from canhelm.aio import Client
from daemon.cli.motion import INTERRUPTED
from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import say
from daemon.cli.own_profile import own_profile
from daemon.cli.setup import write_changes
from daemon.cli.terminal import Terminal

if TYPE_CHECKING:
    from daemon.commissioning.dialogue import Daemon, Person
    from daemon.commissioning.wheels import Values
    from profiles.schema import Profile

    Measure = Callable[[Daemon, Person, Profile], Awaitable[Values]]


def straight(*, options: Options = DEFAULT) -> int:
    """Radius of the wheels, from a straight that you drive and measure by a tape.

    Example: `canhelm calibrate straight`
    """
    from daemon.commissioning.scale import straight as measure

    return _calibrate(measure, options)


def square(*, options: Options = DEFAULT) -> int:
    """Track, or levers of omni-wheels, from a square that you drive; the straight comes first.

    Example: `canhelm calibrate square`
    """
    from daemon.commissioning.scale import square as measure

    return _calibrate(measure, options)


def _calibrate(measure: Measure, options: Options) -> int:
    try:
        asyncio.run(_measured(measure, Terminal(), options))
    except (EOFError, KeyboardInterrupt):
        say("broken off: the profile is as it was")
        return INTERRUPTED
    return 0


async def _measured(measure: Measure, person: Terminal, options: Options) -> None:
    from daemon.commissioning.session import changes_of

    async with Client(options.socket, options.robot) as daemon:
        loaded = own_profile(await daemon.status())
        values = await measure(daemon, person, loaded.profile)
    if any(new != old for old, new in changes_of(loaded.profile, values).values()):
        await write_changes(loaded, values, person)
    else:
        say("the profile fits: nothing has to be written")
