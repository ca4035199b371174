"""Daemons that are reached over TCP: ``tcp:HOST:PORT`` instead of a path, and a token that is shown first."""

from __future__ import annotations

import os
import socket
from pathlib import Path

from canhelm.errors import DaemonNotRunning, PermissionRefused, UsageError

PREFIX = "tcp:"
_MAX_ANSWER_BYTES = 65_536


def split_address(address: str) -> tuple[str, int]:
    """Host and port of ``tcp:HOST:PORT``. Raises UsageError where it is none."""
    host, _, port = address.removeprefix(PREFIX).rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65_536:
        raise UsageError(f"{address!r} is no address", value=address, remedy="give tcp:HOST:PORT")
    return host.strip("[]"), int(port)


def connected(address: str, timeout_s: float) -> socket.socket:
    """A connection to a daemon.

    Raises:
        UsageError: the address is none.
        DaemonNotRunning: nobody listens there.
    """
    try:
        return socket.create_connection(split_address(address), timeout_s)
    except OSError as error:
        raise DaemonNotRunning(
            f"no daemon answers on {address}: {error.strerror or error}",
            remedy="start it with --tcp PORT --tokens FILE, or look at the network",
        ) from None


def own_token() -> str:
    """The token in CANHELM_TOKEN, or in the file that CANHELM_TOKEN_FILE names.

    Returns:
        Of a file the last word of its first line with any, so that a line of the daemon's file will do.

    Raises:
        PermissionRefused: there is none.
    """
    token, file = os.environ.get("CANHELM_TOKEN"), os.environ.get("CANHELM_TOKEN_FILE")
    if token:
        return token
    remedy = "put it into CANHELM_TOKEN, or name its file in CANHELM_TOKEN_FILE"
    if not file:
        raise PermissionRefused("a daemon that is reached over TCP wants a token", remedy=remedy)
    try:
        lines = Path(file).read_text(encoding="utf-8").strip().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text"
        raise PermissionRefused(f"the token in {file} cannot be read: {reason}", remedy=remedy) from None
    if not lines:
        raise PermissionRefused(f"{file} has no token", remedy="write it, or a line of the daemon's file, into it")
    return lines[0].split()[-1]


def first_line(connection: socket.socket) -> bytes:
    """The first line that comes; what came of it where the other end hangs up. Raises OSError."""
    received = b""
    while b"\n" not in received and len(received) < _MAX_ANSWER_BYTES:
        data = connection.recv(_MAX_ANSWER_BYTES)
        if not data:
            break
        received += data
    return received
