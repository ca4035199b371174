"""The command ``canhelm``: which commands there are, and what their failures become (exit codes).

Every command is loaded when it is called, so that one does not pay for the others.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, get_args

from cyclopts import App, CoercionError, CycloptsError, Group, Token

from canhelm import __version__
from canhelm.errors import CanhelmError, UsageError
from daemon.cli.output import say, say_error

if TYPE_CHECKING:
    from cyclopts import Argument, ArgumentCollection

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
        "encoder": "daemon.cli.encoder:app",
        "nxt": "daemon.cli.nxt:app",
        "estop": "daemon.cli.stop:estop",
        "reset": "daemon.cli.stop:reset",
    },
    LOOKING: {
        "monitor": "daemon.cli.monitor:monitor",
        "doctor": "daemon.cli.doctor:doctor",
        "explain": "daemon.cli.explain:explain",
        "runs": "daemon.cli.runs:runs",
        "plot": "daemon.cli.plot:plot",
        "record": "daemon.cli.record:record",
        "replay": "daemon.cli.replay:replay",
        "station": "daemon.cli.station:station",
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
        "make-safe": "daemon.cli.make_safe:make_safe",
        "profile": "daemon.cli.profile:app",
        "setup": "daemon.cli.setup:setup",
        "calibrate": "daemon.cli.calibrate:app",
        "version": "daemon.cli.version:version",
        "completion": "daemon.cli.completion:completion",
    },
    EXPERIMENTS: {
        "demo": "daemon.cli.demo:demo",
        "simulate": "daemon.cli.simulate:simulate",
        "sim": "daemon.cli.sim:app",
        "campaign": "daemon.cli.campaign:app",
    },
}
"""Commands by group, in the order of the help; module and function (or a noun's own app) of each."""
NOUNS = {name for commands in COMMANDS.values() for name, path in commands.items() if path.endswith(":app")}
"""Commands that do nothing without another word."""


URGENT = (("stop",), ("estop",))
"""Commands that no bad value in the environment keeps from being carried out."""
ENVIRONMENT = "CANHELM_"


CHOOSING = ("--socket", "--robot")
"""Options that choose a daemon: where one of them is given, the environment does not add the other."""


def from_environment(app: App, commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
    """``CANHELM_OPTION`` for every option that the command line did not give; an empty one counts as not given."""
    choosing = [argument for argument in arguments if argument.name in CHOOSING]
    for argument in arguments:
        variable = ENVIRONMENT + argument.name.removeprefix("--").upper().replace("-", "_")
        value = os.environ.get(variable)
        if not value or argument.tokens or not argument.name.startswith("--"):
            continue
        if argument.name in CHOOSING and any(other.tokens for other in choosing):
            continue
        argument.append(Token(keyword=variable, value=value, source="env"))
        if commands in URGENT and not _is_valid(argument):
            argument.tokens.clear()
            say(f"{variable}={value} makes no sense and is ignored")


def _is_valid(argument: Argument) -> bool:
    try:
        argument.convert()
    except CoercionError:
        return False
    return True


def refuse_fractions(app: App, commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
    """Raise CoercionError for a fraction where a whole number is asked for; cyclopts would round it."""
    for argument in arguments:
        if int in (argument.hint, *get_args(argument.hint)):
            for token in argument.tokens:
                if "." in token.value:
                    raise CoercionError(argument=argument, token=token, target_type=int)


def build_app() -> App:
    """The command line with all its commands, none of them loaded."""
    app = App(
        name="canhelm",
        help="Drive robots with maxon EPOS controllers over CAN, and simulate them.\n\n"
        "Every option can come from the environment: CANHELM_SOCKET, CANHELM_ROBOT, CANHELM_JSON ...\n\n"
        "Example: `canhelm drive turn --rear -15 --front 15 --speed 0.4 --duration 5`",
        help_format="markdown",
        version=__version__,
        config=(from_environment, refuse_fractions),
        suppress_keyboard_interrupt=False,
    )
    for flag in ("--help", "--version"):
        app[flag].group = (FLAGS,)
    for group, commands in COMMANDS.items():
        for rank, (name, path) in enumerate(commands.items()):
            app.command(path, name=name, group=group, sort_key=rank)
    return app


def whole_app() -> App:
    """The command line with every command loaded: the overview shows the first line of each one's own help."""
    app = build_app()
    for commands in COMMANDS.values():
        for name in commands:
            app[name]
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
    except (BrokenPipeError, SystemExit):  # rich ends the process where its reader has hung up
        _throw_output_away()
        return 0
    except OSError as error:
        _throw_output_away()
        say(f"cannot write {error.filename or 'the output'}: {error.strerror or error}")
        return CanhelmError.exit_code
    return code


def _throw_output_away() -> None:
    """What is still buffered cannot be written either; Python would try once more at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(argv: Sequence[str]) -> int:
    if list(argv) == ["--version"]:
        print(__version__)  # cyclopts would load rich for it
        return 0
    app = build_app()
    if not argv or argv[0] in app.help_flags:
        app = whole_app()
    result = app(list(argv), exit_on_error=False, print_error=False, result_action="return_value")
    if len(argv) == 1 and argv[0] in NOUNS:
        return UsageError.exit_code  # it has shown its help
    return result if isinstance(result, int) else 0
