"""Who is at the other end of the socket, and what they may do.

The daemon's own user and root may do everything, others what the groups of their process give them. The kernel tells
user and groups of a peer (unix(7)): no name service that is slow keeps the control cycle waiting for that.
"""

from __future__ import annotations

import grp
import os
import pwd
import socket
import struct
from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from canhelm.errors import PermissionRefused, UsageError
from canhelm.protocol import DRIVERS
from daemon.api.parameters import Role

_CREDENTIALS = struct.Struct("3i")
_SO_PEERGROUPS = 59
"""Since Linux 4.13 (asm-generic/socket.h)."""
_GROUPS_BYTES = 1024
"""What Python asks for at most: 256 groups."""
_RANK = {role: rank for rank, role in enumerate(Role)}
_COMMAND_LENGTH = 80
_NAME_LENGTH = 60


@dataclass(frozen=True, slots=True)
class Groups:
    """Names of the groups whose members may use a robot; members of each may do what those before it may."""

    watch: str = "canhelm-watch"
    drive: str = DRIVERS
    configure: str = "canhelm-admin"

    def require(self) -> None:
        """Raise UsageError where one that somebody has named is not there; the usual ones may be missing."""
        for field in fields(self):
            name = getattr(self, field.name)
            if name != field.default and _number(name) is None:
                raise UsageError(
                    f"--{field.name}-group: there is no group {name!r}",
                    value=name,
                    remedy=f"sudo groupadd --system {name}, or correct the name",
                )


@dataclass(frozen=True, slots=True)
class Peer:
    """A process that has opened the socket.

    Attributes:
        pid: its process id, 0 where unknown.
        uid: its user.
        groups: its groups.
        role: the most it may do.
        name: of one that came over the network, for people.
        label: what it calls itself, for people; empty where it does not.
    """

    pid: int
    uid: int
    groups: frozenset[int]
    role: Role
    name: str = ""
    label: str = ""

    @classmethod
    def nobody(cls) -> Peer:
        """A peer that is not known yet."""
        return cls(0, -1, frozenset(), Role.STOP)

    @property
    def user(self) -> str:
        """Name of its user."""
        return self.name or _user(self.uid)

    def details(self) -> dict[str, Any]:
        """User, process id and command, for status."""
        label = {"name": self.label} if self.label else {}
        process = {} if self.name else {"pid": self.pid, "command": self._command}
        return {**label, "user": self.user, **process}

    def called(self, label: str) -> Peer:
        """The same peer by a name of its own. Raises UsageError where people could not read that."""
        if not 0 < len(label) <= _NAME_LENGTH or not label.isprintable():
            remedy = f"give 1 to {_NAME_LENGTH} printable characters"
            raise UsageError("client.name: this is no name for a client", object="name", remedy=remedy)
        return replace(self, label=label)

    def told(self) -> str:
        """The same for messages."""
        told = self.name or f"{self.user} (pid {self.pid}: {self._command})"
        return f"{self.label} by {told}" if self.label else told

    def signed(self, method: str, params: dict[str, Any]) -> dict[str, Any]:
        """The parameters of what it asks for; a stop without a reason gets one that says by whom it is."""
        if method != "stop" or params["reason"]:
            return params
        return {**params, "reason": f"commanded by {self.told()}"}

    @property
    def _command(self) -> str:
        return command_of(self.pid)


class Rights:
    """Which groups give which role.

    Args:
        groups: their names. They are looked up here alone; one that the system does not have gives nothing.
    """

    def __init__(self, groups: Groups | None = None) -> None:
        names = groups or Groups()
        self._names = {Role.WATCH: names.watch, Role.DRIVE: names.drive, Role.CONFIGURE: names.configure}
        found = {role: _number(name) for role, name in self._names.items()}
        self._numbers = {role: number for role, number in found.items() if number is not None}

    @property
    def driving(self) -> str:
        """The group whose members drive."""
        return self._names[Role.DRIVE]

    @property
    def numbers(self) -> list[int]:
        """Ids of the groups that there are."""
        return sorted(set(self._numbers.values()))

    def peer(self, connection: socket.socket) -> Peer:
        """The peer of a connected Unix socket."""
        raw = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        pid, uid, gid = _CREDENTIALS.unpack(raw)
        groups = frozenset((gid, *_further_groups(connection)))
        return Peer(pid, uid, groups, self.role_of(uid, groups))

    def role_of(self, uid: int, groups: Collection[int]) -> Role:
        """What a user in these groups may do."""
        if uid in (0, os.getuid()):
            return Role.CONFIGURE
        held = [role for role, number in self._numbers.items() if number in groups]
        return max(held, key=_RANK.__getitem__, default=Role.STOP)

    def refusal(self, peer: Peer, role: Role, what: str) -> PermissionRefused | None:
        """Why a peer may not do something; None where it may.

        Args:
            peer: who wants it.
            role: the least one that will do.
            what: needs it, for people.
        """
        if _RANK[peer.role] >= _RANK[role]:
            return None
        remedy = self._remedy(role, peer)
        if peer.name:
            return PermissionRefused(f"{what} needs the role {role}; {peer.name} has not got it", remedy=remedy)
        giving = " or ".join(name for other, name in self._names.items() if _RANK[other] >= _RANK[role])
        has = ", ".join(sorted(map(_group, peer.groups)))
        return PermissionRefused(
            f"{what} needs the role {role}, which the group {giving} gives; {peer.user} is in {has}",
            remedy=remedy,
        )

    def way_up(self, peer: Peer) -> str | None:
        """How a peer gets the next role; None for one that may do everything."""
        higher = [role for role in Role if _RANK[role] > _RANK[peer.role]]
        return self._remedy(higher[0], peer) if higher else None

    def _remedy(self, role: Role, peer: Peer) -> str:
        if peer.name:
            return f"log in with a token for {role}"
        group = self._names[role]
        join = f"sudo usermod -aG {group} {peer.user}, then log in again"
        return join if role in self._numbers else f"sudo groupadd --system {group}, start the daemon anew; {join}"


def command_of(pid: int) -> str:
    """The command line of a process, for people."""
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes()[:4096].decode(errors="replace").split("\0")
    except OSError:
        return "unknown command"
    if len(words) > 1 and Path(words[0]).name.startswith("python"):
        del words[: 2 if words[1] == "-m" else 1]
    told = " ".join([Path(word).name for word in words[:1]] + words[1:]).strip()
    return "".join(sign for sign in told if sign.isprintable())[:_COMMAND_LENGTH]


def _further_groups(connection: socket.socket) -> tuple[int, ...]:
    try:
        raw = connection.getsockopt(socket.SOL_SOCKET, _SO_PEERGROUPS, _GROUPS_BYTES)
    except OSError:  # an older kernel, or more groups than fit: the user's main one counts
        return ()
    return struct.unpack(f"{len(raw) // 4}I", raw)


def _number(group: str) -> int | None:
    try:
        return grp.getgrnam(group).gr_gid
    except KeyError:
        return None


@lru_cache(maxsize=256)
def _group(number: int) -> str:
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)


@lru_cache(maxsize=256)
def _user(number: int) -> str:
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return f"user {number}"
