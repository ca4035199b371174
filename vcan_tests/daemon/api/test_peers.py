"""Who may do what over the socket."""

from __future__ import annotations

import os
import socket

import pytest

from canhelm.errors import PermissionRefused
from daemon.api import peers
from daemon.api.methods import METHODS
from daemon.api.parameters import Role
from daemon.api.peers import Peer, role_of

STRANGER = 54_321


@pytest.mark.parametrize(
    ("groups", "role"),
    [(set(), None), ({"canhelm"}, Role.DRIVE), ({"canhelm-admin"}, Role.CONFIGURE), ({"users"}, None)],
)
def test_groups_give_roles(monkeypatch: pytest.MonkeyPatch, groups: set[str], role: Role | None) -> None:
    monkeypatch.setattr(peers, "_groups_of", lambda uid, gid: groups)
    assert role_of(STRANGER, STRANGER) is role


@pytest.mark.parametrize("uid", [0, os.getuid()])
def test_root_and_the_daemons_own_user_may_do_everything(uid: int) -> None:
    assert role_of(uid, STRANGER) is Role.CONFIGURE


def test_a_user_that_the_system_does_not_know_may_do_nothing() -> None:
    assert role_of(STRANGER, STRANGER) is None


def test_the_kernel_tells_who_the_peer_is() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        assert Peer.of(ours) == Peer(os.getpid(), Role.CONFIGURE)


@pytest.mark.parametrize("method", ["status", "stop", "estop", "sdo.read", "drive.turn", "reset"])
def test_a_driver_may_watch_drive_and_stop(method: str) -> None:
    Peer(1, Role.DRIVE).require(METHODS[method])


@pytest.mark.parametrize(("role", "method", "group"), [
    (Role.DRIVE, "sdo.write", "canhelm-admin"),
    (Role.WATCH, "drive.turn", "canhelm "),
    (None, "status", "canhelm "),
])  # fmt: skip
def test_who_may_not_is_told_the_group(role: Role | None, method: str, group: str) -> None:
    with pytest.raises(PermissionRefused) as caught:
        Peer(1, role).require(METHODS[method])
    assert group in str(caught.value.remedy)
