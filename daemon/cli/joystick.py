"""``canhelm drive joystick``: a gamepad at this machine drives a robot whose daemon may be anywhere."""

from __future__ import annotations

import asyncio
import shutil
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from canhelm.aio import Client
from canhelm.errors import NodeAbsent, PermissionRefused
from daemon.cli.motion import CLEAR_LINE, INTERRUPTED, takeover_text
from daemon.cli.options import MotionOptions
from daemon.cli.output import say, show, wants_json, words
from daemon.gamepad.driver import PERIOD_S, VALID_FOR_MS, PadDriver
from daemon.gamepad.mapping import Mapping
from daemon.gamepad.pad import opened
from daemon.gamepad.pads import PadInfo, choose_pad, list_pads, no_pad_remedy, require_parts

if TYPE_CHECKING:
    from rich.table import Table

RETRY_S = 1.0
"""Between two looks for a pad that has gone."""
LATE_S = PERIOD_S + VALID_FOR_MS / 1e3
"""What a lost link adds to the time in which the robot is at rest."""


def show_pads(json: bool | None) -> int:
    """Print the pads of this machine; the exit code."""
    pads = [asdict(pad) for pad in list_pads()]
    if not pads:
        say(f"no gamepad is here; {no_pad_remedy()}")
        if not wants_json(json):
            return 0
    show(pads, _table, json)
    return 0


def _table(pads: Sequence[dict[str, Any]]) -> Table:
    from rich.table import Table

    grid = Table(box=None, header_style="bold", padding=(0, 2, 0, 0))
    for column in ("name", "path", "by", "readable", "axes", "buttons"):
        grid.add_column(column)
    for pad in pads:
        readable = "yes" if pad["readable"] else f"no: {pad['remedy']}"
        grid.add_row(pad["name"], pad["path"], pad["connection"], readable, words(pad["axes"]), words(pad["buttons"]))
    return grid


def drive_joystick(wanted: str | None, options: MotionOptions) -> int:
    """Drive until interrupted; the exit code.

    Args:
        wanted: name or path of the pad; None: the first one.
        options: which daemon, and whether to take the robot over.

    Raises:
        CanhelmError: no pad that can be read and has what the profile names, or the daemon is lost.
    """
    try:
        asyncio.run(_drive(wanted, options))
    except asyncio.CancelledError:
        _tell("interrupted: the motion was stopped")
    return INTERRUPTED


async def _drive(wanted: str | None, options: MotionOptions) -> None:
    task = asyncio.current_task()
    assert task is not None
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, task.cancel)
    pad = choose_pad(wanted)
    async with Client(options.socket, options.robot) as client:
        mapping = Mapping(await client.call("drive.gamepad"))
        driver = PadDriver(client, mapping, _tell, _draw)
        if options.takeover:
            say(takeover_text(await client.call("lease.take")))
        while True:
            _greet(pad, mapping)
            try:
                with opened(pad) as reading:
                    await driver.drive(reading)
            except OSError as error:
                _tell(f"{pad.path} cannot be read: {error.strerror}")
            pad = await _returned(pad.name)


def _greet(pad: PadInfo, mapping: Mapping) -> None:
    """Say what the pad does. Raises UsageError where it lacks something."""
    buttons, sticks = mapping.buttons, mapping.sticks
    wanted = {button for button in (buttons.dead_man, buttons.stop, buttons.emergency_stop) if button}
    require_parts(pad, {stick.axis for stick in sticks.values()}, wanted)
    say(f"{pad.name}: {mapping.legend()}")
    say(
        f"hold {buttons.dead_man} to drive; let go of it and the robot is at rest within {mapping.rest_s:.1f} s, "
        f"if the link to it is lost within {mapping.rest_s + LATE_S:.1f} s"
    )


async def _returned(name: str) -> PadInfo:
    """The pad of this name, once it is there again."""
    say(f"waiting for {name}")
    while True:
        await asyncio.sleep(RETRY_S)
        with suppress(NodeAbsent, PermissionRefused):  # udev may be about to let this user read it
            return choose_pad(name)


def _tell(sentence: str) -> None:
    """A sentence for people, on a line of its own."""
    if sys.stderr.isatty():
        print(CLEAR_LINE, end="", file=sys.stderr)
    say(sentence)


def _draw(commands: str) -> None:
    """What is commanded, on one line of a terminal that changes; nothing off a terminal."""
    if sys.stderr.isatty():
        width = shutil.get_terminal_size().columns - 1
        print(f"{CLEAR_LINE}{commands[:width]}", end="", file=sys.stderr, flush=True)
