"""The command ``canhelm``: which commands there are, and what their failures become (exit codes).

Every command is loaded when it is called, so that one does not pay for the others.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from cyclopts import App, CycloptsError, Group
from cyclopts.config import Env

from canhelm import __version__
from canhelm.errors import CanhelmError
from daemon.cli.output import say, say_error

if TYPE_CHECKING:
    from cyclopts import ArgumentCollection

INTERRUPTED = 130

DRIVING = Group("Every day", sort_key=1)
LOOKING = Group("Looking", sort_key=2)
NETWORK = Group("Network and devices", sort_key=3)
SETUP = Group("Daemon and setup", sort_key=4)
EXPERIMENTS = Group("Simulation and experiments", sort_key=5)
FLAGS = Group("Flags", sort_key=6)

COMMANDS: dict[Group, dict[str, str]] = {
    DRIVING: {
        "stop": "daemon.cli.stop:stop",
        "status": "daemon.cli.status:status",
        "steer": "daemon.cli.steer:steer",
        "drive": "daemon.cli.drive:app",
        "motor": "daemon.cli.motor:app",
        "brake": "daemon.cli.brake:app",
        "estop": "daemon.cli.stop:estop",
        "reset": "daemon.cli.stop:reset",
    },
    LOOKING: {
        "monitor": "daemon.cli.monitor:monitor",
        "doctor": "daemon.cli.doctor:doctor",
        "explain": "daemon.cli.explain:explain",
    },
    NETWORK: {
        "nodes": "daemon.cli.nodes:app",
        "nmt": "daemon.cli.nmt:app",
        "sdo": "daemon.cli.sdo:app",
        "config": "daemon.cli.config:app",
        "object": "daemon.cli.object:app",
    },
    SETUP: {
        "run": "daemon.cli.run:run",
        "profile": "daemon.cli.profile:app",
        "version": "daemon.cli.version:version",
        "completion": "daemon.cli.completion:completion",
    },
    EXPERIMENTS: {
        "demo": "daemon.cli.demo:demo",
        "simulate": "daemon.cli.simulate:simulate",
        "sim": "daemon.cli.sim:app",
    },
}
"""Commands by group, in the order of the help; module and function (or a noun's own app) of each."""


class OptionEnv(Env):
    """``CANHELM_OPTION`` for every option; arguments come from the command line alone."""

    def __call__(self, app: App, commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
        """Fill options that the command line did not give."""
        options = [argument for argument in arguments if argument.name.startswith("--")]
        super().__call__(app, commands, type(arguments)(options))


def build_app() -> App:
    """The command line with all its commands, none of them loaded."""
    app = App(
        name="canhelm",
        help="Drive robots with maxon EPOS controllers over CAN, and simulate them.\n\n"
        "Every option can come from the environment: CANHELM_SOCKET, CANHELM_ROBOT, CANHELM_JSON ...\n\n"
        "Example: `canhelm drive turn --rear -15 --front 15 --speed 0.4 --duration 5`",
        help_format="markdown",
        version=__version__,
        config=OptionEnv("CANHELM_", command=False, show=False),
        suppress_keyboard_interrupt=False,
    )
    for flag in ("--help", "--version"):
        app[flag].group = (FLAGS,)
    for group, commands in COMMANDS.items():
        for rank, (name, path) in enumerate(commands.items()):
            app.command(path, name=name, group=group, sort_key=rank)
    return app


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: the arguments; None: those of the process.

    Returns:
        The exit code: 0 done, 1 refused or failed, 2 wrong usage, 3 no daemon, 4 no node, 5 timed out, 6 interlock or
        emergency stop, 7 configuration invalid, 130 interrupted.
    """
    try:
        code = _run(sys.argv[1:] if argv is None else argv)
        sys.stdout.flush()
    except CycloptsError as error:
        say(f"{error} - see: canhelm {' '.join(error.command_chain or ())} --help".replace("  ", " "))
        return 2
    except CanhelmError as error:
        say_error(error)
        return error.exit_code
    except KeyboardInterrupt:
        say("interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def _run(argv: Sequence[str]) -> int:
    app = build_app()
    if not argv or argv[0] in app.help_flags:
        _load_all(app)
    result = app(list(argv), exit_on_error=False, print_error=False, result_action="return_value")
    return result if isinstance(result, int) else 0


def _load_all(app: App) -> None:
    """Load every command: the overview shows the first line of each one's own help."""
    for commands in COMMANDS.values():
        for name in commands:
            app[name]
