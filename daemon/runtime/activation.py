"""Sockets that the service manager has opened for this process (sd_listen_fds(3))."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from pathlib import Path

FIRST_FD = 3


def inherited_sockets(environment: Mapping[str, str], pid: int) -> dict[Path, socket.socket]:
    """Unix sockets that already listen, by their paths; none where they were meant for another process.

    Args:
        environment: of this process, with LISTEN_PID and LISTEN_FDS.
        pid: its id.
    """
    count = environment.get("LISTEN_FDS", "")
    if environment.get("LISTEN_PID") != str(pid) or not count.isdecimal():
        return {}
    found = {}
    for fd in range(FIRST_FD, FIRST_FD + int(count)):
        os.set_inheritable(fd, False)
        listener = socket.socket(fileno=fd)
        if listener.family == socket.AF_UNIX and listener.type == socket.SOCK_STREAM:
            found[Path(listener.getsockname())] = listener
        else:
            listener.detach()
    return found
