"""What the role of a page keeps it from, and what it is told instead of the role that the station has."""

from __future__ import annotations

from typing import Final

from canhelm import protocol
from canhelm.errors import PermissionRefused
from daemon.api.methods import METHODS as DAEMON_METHODS
from daemon.api.parameters import Role
from daemon.station.methods import METHODS as OWN_METHODS

_HIGHER: Final = {limit: tuple(Role)[rank + 1 :] for rank, limit in enumerate(Role)}
"""Roles that may do more, the next one first."""


def refusal(name: str, limit: Role) -> PermissionRefused | None:
    """Why a page may not call a method; None where it may.

    Args:
        name: of the method; one that this station does not know could do anything.
        limit: the most that the page may do.
    """
    method = OWN_METHODS[name][0] if name in OWN_METHODS else DAEMON_METHODS.get(name)
    needed = method.role if method else Role.CONFIGURE
    if needed not in _HIGHER[limit]:
        return None
    told = f"{name[:80]} needs the role {needed}, and this page has {limit}"
    return PermissionRefused(told, remedy=_way_to(needed))


def lowered(line: bytes, limit: Role) -> bytes:
    """What a page is told of what the daemon says to the station: its own role, and how it gets the next one.

    Args:
        line: an answer to ``hello`` or ``status``, a sample of the status, or something else, which stays as it is.
        limit: the most that the page may do.
    """
    if limit is Role.CONFIGURE or b'"role":' not in line:
        return line
    message = protocol.parse_message(line)
    told = message.get("result", message.get("params")) if isinstance(message, dict) else None
    if isinstance(message, str) or not isinstance(told, dict) or told.get("role") not in _HIGHER[limit]:
        return line
    told["role"] = limit.value
    told["role_remedy"] = _way_to(_HIGHER[limit][0])
    return protocol.make_message(message)


def _way_to(role: Role) -> str:
    return f"log in with a token for {role}"
