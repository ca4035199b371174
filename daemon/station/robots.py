"""Which robots the station offers, where their daemons listen and where their files are."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from canhelm import protocol
from canhelm.errors import DaemonNotRunning, UsageError
from daemon.runs import store


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot that pages may be connected to.

    Attributes:
        name: of the robot.
        socket: of its daemon; there need not be one now.
        folder: of its state, with its runs and paths; need not be there yet.
    """

    name: str
    socket: Path
    folder: Path


class Robots:
    """The robots of this machine.

    Args:
        names: of those that are offered; none: every robot that has a socket.

    Raises:
        UsageError: a name is none.
    """

    def __init__(self, names: Collection[str] = ()) -> None:
        self._names = tuple(dict.fromkeys(names))
        for name in self._names:
            _socket(name)

    def find(self, name: str) -> Robot:
        """A robot by its name.

        Raises:
            UsageError: the name is none.
            DaemonNotRunning: there is no such robot, or this station does not offer it.
        """
        socket = _socket(name)
        if self._names and name not in self._names:
            raise DaemonNotRunning(f"this station has no robot {name}", remedy=f"choose {' or '.join(self._names)}")
        return Robot(name, socket, _state_folder(name, socket))

    async def told(self) -> list[dict[str, object]]:
        """Name of each robot, and whether its daemon answers."""
        sockets = {name: _socket(name) for name in self._names} or _sockets()
        live = await asyncio.to_thread(lambda: [protocol.is_live(socket) for socket in sockets.values()])
        return [{"name": name, "alive": alive} for name, alive in zip(sockets, live, strict=True)]


def _socket(name: str) -> Path:
    """Where a robot's daemon listens. Raises UsageError for what is no name."""
    if not name:
        raise UsageError("a robot has a name", remedy="give it with --robot")
    return protocol.choose_socket(robot=name)


def _sockets() -> dict[str, Path]:
    """Sockets by the names of their robots; a service's goes before a person's."""
    folders = (protocol.user_folder(), protocol.SYSTEM_FOLDER)
    found = {path.stem: path for folder in folders for path in _sockets_in(folder)}
    return dict(sorted(found.items()))


def _sockets_in(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.glob("*.sock") if _is_api(path)]
    except OSError:
        return []


def _is_api(path: Path) -> bool:
    return not path.name.endswith(protocol.GATEWAY_SUFFIX) and path.is_socket()


def _state_folder(name: str, socket: Path) -> Path:
    if socket.parent == protocol.SYSTEM_FOLDER:
        return store.SYSTEM_FOLDER / name
    person = {key: value for key, value in os.environ.items() if key != "STATE_DIRECTORY"}
    return store.own_folder(name, person).parent
