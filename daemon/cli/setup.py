"""``canhelm setup``: commissioning of a robot with a person beside it."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number

from canhelm.aio import Client
from canhelm.errors import CanhelmError, DaemonNotRunning
from canhelm.protocol import RENEW_PERIOD_S
from daemon.cli.motion import INTERRUPTED
from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import say, say_warning, show
from daemon.cli.own_profile import own_profile
from daemon.cli.terminal import Terminal

if TYPE_CHECKING:
    from daemon.commissioning.wheels import Findings, Values
    from profiles.loader import LoadedProfile

Current = Annotated[int, Parameter(validator=Number(gte=50, lte=5000), help="Highest current meanwhile [mA].")]

BREAKING_OFF = (signal.SIGTERM, signal.SIGHUP)


def setup(what: str = "all", /, *, current: Current = 500, options: Options = DEFAULT) -> int:
    """Look at every wheel, pair and brake, one at a time, and put what is found into the profile's side file.

    The wheels are in the air, the current is capped. Every write is shown before, and undone on Ctrl-C.

    Example: `canhelm setup all`

    Args:
        what: A wheel by its drive's name or node id, `pairs` for encoders and brakes of wheel pairs, or `all`.
    """
    try:
        return asyncio.run(_setup(what, current, options))
    except (EOFError, KeyboardInterrupt, asyncio.CancelledError):
        say("broken off: the drives are as they were, and the profile, too")
        return INTERRUPTED


async def _setup(what: str, current_ma: int, options: Options) -> int:
    from daemon.commissioning.session import changes_of, chosen_wheels, commission

    async with Client(options.socket, options.robot) as client:
        loaded = own_profile(await client.status())
        chosen_wheels(loaded.profile, what)
        person = Terminal()
        with _signals_break_off():
            async with HeldDaemon(client) as daemon:
                findings = await commission(daemon, person, loaded.profile, what, current_ma)
    changes = changes_of(loaded.profile, findings.values)
    show(_result(findings, changes), _told, options.json)
    if findings.unsolved:
        for sentence in findings.unsolved:
            say_warning(f"to be mended: {sentence}")
        say("nothing was written: mend it, then begin again")
        return 1
    if changes:
        await write_changes(loaded, findings.values, person)
    return 0


@contextmanager
def _signals_break_off() -> Iterator[None]:
    """SIGTERM, and SIGHUP where the terminal is gone, do as Ctrl-C does."""
    loop, task = asyncio.get_running_loop(), asyncio.current_task()
    assert task is not None
    for number in BREAKING_OFF:
        loop.add_signal_handler(number, task.cancel)
    try:
        yield
    finally:
        for number in BREAKING_OFF:
            loop.remove_signal_handler(number)


class HeldDaemon:
    """The daemon, told twice a second that the setup goes on; nothing is asked of it once it has given that up.

    Use as ``async with HeldDaemon(client) as daemon``.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._renewing: asyncio.Task[None]

    async def __aenter__(self) -> HeldDaemon:
        self._renewing = asyncio.create_task(self._renew())
        return self

    async def __aexit__(self, *_: object) -> None:
        self._renewing.cancel()
        await asyncio.wait([self._renewing])

    async def _renew(self) -> None:
        """Ends at the first refusal, which the next call then meets by itself."""
        with suppress(CanhelmError):
            while True:
                await asyncio.sleep(RENEW_PERIOD_S)
                await self._client.call("lease.renew")

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """Call a method.

        Raises:
            Refused: the setup is over for the daemon: this program stood still, and its lease ran out.
            DaemonNotRunning: the daemon has gone, and could not put the limits back if it was killed.
        """
        try:
            if method != "stop":
                await self._client.call("lease.renew")
            return await self._client.call(method, **params)
        except DaemonNotRunning as error:
            remedy = "start it again: it writes the profile's limits into every drive before it is ready"
            raise DaemonNotRunning(f"{error.message}: current limits may still be lowered", remedy=remedy) from None


def _result(findings: Findings, changes: dict[str, tuple[Any, Any]]) -> dict[str, Any]:
    return {
        "wrong": findings.wrong,
        "unsolved": findings.unsolved,
        "changes": {name: {"was": old, "new": new} for name, (old, new) in changes.items()},
    }


def _told(result: dict[str, Any]) -> str:
    """What was found, for a terminal; changes and what is to be mended are told by themselves."""
    return "\n".join(result["wrong"]) or "nothing is wired otherwise than the profile says"


async def write_changes(loaded: LoadedProfile, values: Values, person: Terminal) -> None:
    """Show what would be written into the side file, and write it where the person agrees.

    Args:
        loaded: the profile.
        values: by their keys.
        person: who agrees.

    Raises:
        ConfigError: it cannot be written.
        EOFError: nobody is there any more.
    """
    from daemon.commissioning.dialogue import agrees, preview
    from daemon.commissioning.session import changes_of
    from profiles.side_file import write_values

    say(f"the side file of {loaded.path} gets:")
    for line in preview(changes_of(loaded.profile, values)):
        say(line)
    if await agrees(person, "write it?"):
        say(f"written into {write_values(loaded.path, values)}; start the daemon anew")
    else:
        say("nothing was written")
