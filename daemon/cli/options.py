"""What the commands on a running daemon share: which daemon, JSON or not, and how a node is named."""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from typing import Annotated

from cyclopts import Parameter

from canhelm.client import Client
from canhelm.errors import UsageError
from daemon.cli.output import Json

Node = Annotated[str, Parameter(help="Node id (1 to 127) or a name from the profile (front_left).")]
Brakes = Annotated[str, Parameter(help="front, rear or all.")]
NoWait = Annotated[bool, Parameter(name="--no-wait", negative=(), help="Hand the motion to the daemon; print its id.")]


@Parameter(name="*")
@dataclass(frozen=True, slots=True)
class Options:
    """Which daemon to ask, and how to print its answer."""

    socket: str | None = None
    """Socket of the daemon."""
    robot: str | None = None
    """Name of the robot, where several daemons run."""
    json: Json = None

    def client(self) -> Client:
        """A connection to the chosen daemon."""
        return Client(self.socket, self.robot)


@Parameter(name="*")
@dataclass(frozen=True, slots=True)
class MotionOptions(Options):
    """Which daemon shall move something, and whether whoever moves it now has to let go."""

    takeover: Annotated[bool, Parameter(negative=())] = False
    """Take the robot over from whoever moves it now; that comes to rest first."""


DEFAULT = Options()
MOTION = MotionOptions()


def agreed(question: str) -> bool:
    """Whether the person at the terminal says yes. Raises UsageError where nobody is there."""
    if not sys.stdin.isatty():
        raise UsageError("nobody is there to agree", remedy="say --yes")
    print(f"{question} [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def node_of(text: str) -> int | str:
    """A node as the daemon takes it: id or name.

    Raises:
        UsageError: a number outside 1..127, or no name at all.
    """
    if re.fullmatch(r"[A-Za-z_][\w.-]*", text):
        return text
    try:
        node = int(text, 0)
    except ValueError:
        raise UsageError(
            f"{text!r} is no node", value=text, remedy="give a node id or a name from the profile"
        ) from None
    if not 1 <= node <= 127:
        raise UsageError(f"node id {node} is out of range", value=node, limit="1 to 127", remedy="give 1 to 127")
    return node
