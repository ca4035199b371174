"""``canhelm setup``: commissioning of a robot with a person beside it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number

from canhelm.aio import Client
from daemon.cli.motion import INTERRUPTED
from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import say, say_warning, show
from daemon.cli.own_profile import own_profile
from daemon.cli.terminal import Terminal

if TYPE_CHECKING:
    from daemon.commissioning.wheels import Findings, Values
    from profiles.loader import LoadedProfile

Current = Annotated[int, Parameter(validator=Number(gte=50, lte=5000), help="Highest current meanwhile [mA].")]


def setup(what: str = "all", /, *, current: Current = 500, options: Options = DEFAULT) -> int:
    """Look at every wheel, pair and brake, one at a time, and put what is found into the profile's side file.

    The wheels are in the air, the current is capped. Every write is shown before, and undone on Ctrl-C.

    Example: `canhelm setup all`

    Args:
        what: A wheel by its drive's name or node id, `pairs` for encoders and brakes of wheel pairs, or `all`.
    """
    try:
        return asyncio.run(_setup(what, current, Terminal(), options))
    except (EOFError, KeyboardInterrupt):
        say("broken off: the drives are as they were, and the profile, too")
        return INTERRUPTED


async def _setup(what: str, current_ma: int, person: Terminal, options: Options) -> int:
    from daemon.commissioning.session import changes_of, commission

    async with Client(options.socket, options.robot) as daemon:
        loaded = own_profile(await daemon.status())
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
