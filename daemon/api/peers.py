"""Who is at the other end of the socket, and what they may do.

The daemon's own user and root may do everything. Where the groups ``canhelm`` and ``canhelm-admin`` exist, members of
the first may watch, drive and stop, members of the second may configure too; others may do nothing.
"""

from __future__ import annotations

import grp
import os
import pwd
import socket
import struct
from dataclasses import dataclass

from canhelm.errors import PermissionRefused
from daemon.api.parameters import Method, Role

USERS = "canhelm"
ADMINS = "canhelm-admin"
_RANK = {Role.WATCH: 1, Role.DRIVE: 2, Role.CONFIGURE: 3}
_CREDENTIALS = struct.Struct("3i")


@dataclass(frozen=True, slots=True)
class Peer:
    """A process that has opened the socket.

    Attributes:
        pid: its process id, 0 where unknown.
        role: the most it may do; None: nothing.
    """

    pid: int
    role: Role | None

    @classmethod
    def nobody(cls) -> Peer:
        """A peer that is not known yet."""
        return cls(0, None)

    @classmethod
    def of(cls, connection: socket.socket) -> Peer:
        """The peer of a connected Unix socket, from the kernel's credentials (unix(7), SO_PEERCRED)."""
        raw = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        pid, uid, gid = _CREDENTIALS.unpack(raw)
        return cls(pid, role_of(uid, gid))

    def require(self, method: Method) -> None:
        """Raise PermissionRefused unless this peer may call a method."""
        if self.role is None or _RANK[self.role] < _RANK[method.role]:
            group = ADMINS if method.role is Role.CONFIGURE else USERS
            raise PermissionRefused(
                f"this user may not call {method.name}",
                remedy=f"join the group: sudo usermod -aG {group} $USER, then log in again",
            )


def role_of(uid: int, gid: int) -> Role | None:
    """What a user may do, by the groups the system lists for it."""
    if uid in (0, os.getuid()):
        return Role.CONFIGURE
    groups = _groups_of(uid, gid)
    if ADMINS in groups:
        return Role.CONFIGURE
    return Role.DRIVE if USERS in groups else None


def _groups_of(uid: int, gid: int) -> set[str]:
    try:
        numbers = os.getgrouplist(pwd.getpwuid(uid).pw_name, gid)
    except KeyError:
        numbers = [gid]
    names = set()
    for number in numbers:
        try:
            names.add(grp.getgrgid(number).gr_name)
        except KeyError:
            continue
    return names
