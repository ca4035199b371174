"""Who may do what over the socket."""

from __future__ import annotations

import grp
import os
import pwd
import socket
from dataclasses import replace
from pathlib import Path

import pytest

from canhelm.errors import UsageError
from daemon.api import peers
from daemon.api.listeners import make_acl, open_listener
from daemon.api.methods import METHODS
from daemon.api.parameters import Role
from daemon.api.peers import Groups, Peer, Rights, command_of

STRANGER = 54_321
DAEMON = 54_322
NUMBERS = {"lookers": 7001, "drivers": 7002, "admins": 7003}
NAMED = Groups("lookers", "drivers", "admins")


@pytest.fixture
def rights(monkeypatch: pytest.MonkeyPatch) -> Rights:
    """Three groups of the system, and a daemon that is neither root nor the tests' user."""

    def getgrnam(name: str) -> grp.struct_group:
        return grp.struct_group((name, "x", NUMBERS[name], []))

    def getgrgid(number: int) -> grp.struct_group:
        return grp.struct_group(({found: name for name, found in NUMBERS.items()}[number], "x", number, []))

    monkeypatch.setattr(grp, "getgrnam", getgrnam)
    monkeypatch.setattr(grp, "getgrgid", getgrgid)
    monkeypatch.setattr(os, "getuid", lambda: DAEMON)
    return Rights(NAMED)


def peer_in(rights: Rights, *groups: str) -> Peer:
    """A stranger in these groups, and in one that nobody knows."""
    numbers = frozenset((STRANGER, *(NUMBERS[group] for group in groups)))
    return Peer(1, STRANGER, numbers, rights.role_of(STRANGER, numbers))


@pytest.mark.parametrize(
    ("groups", "role"),
    [
        ((), Role.STOP),
        (("lookers",), Role.WATCH),
        (("drivers",), Role.DRIVE),
        (("admins",), Role.CONFIGURE),
        (("lookers", "drivers"), Role.DRIVE),
        (("admins", "lookers"), Role.CONFIGURE),
    ],
)
def test_the_highest_group_of_a_peer_counts(rights: Rights, groups: tuple[str, ...], role: Role) -> None:
    assert peer_in(rights, *groups).role is role


@pytest.mark.parametrize("uid", [0, DAEMON])
def test_root_and_the_daemons_own_user_may_do_everything(rights: Rights, uid: int) -> None:
    assert rights.role_of(uid, {STRANGER}) is Role.CONFIGURE


def test_a_group_that_the_system_does_not_have_gives_nobody_anything() -> None:
    rights = Rights(Groups("no-such-lookers", "no-such-drivers", "no-such-admins"))
    assert rights.numbers == []


def test_the_usual_groups_may_be_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peers, "_number", {grp.getgrgid(os.getgid()).gr_name: os.getgid()}.get)
    Groups().require()
    Groups(drive=grp.getgrgid(os.getgid()).gr_name).require()
    with pytest.raises(UsageError, match="no-such-admins"):
        Groups(configure="no-such-admins").require()


def test_the_kernel_tells_user_and_groups_of_a_peer() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        peer = Rights().peer(ours)
    assert (peer.pid, peer.uid) == (os.getpid(), os.getuid())
    assert peer.groups == {os.getgid(), *os.getgroups()}
    assert peer.user == pwd.getpwuid(os.getuid()).pw_name


@pytest.mark.parametrize("role", Role)
def test_each_role_may_do_what_those_before_it_may_and_nothing_else(rights: Rights, role: Role) -> None:
    peer = replace(peer_in(rights), role=role)
    refused = {each for each in Role if rights.refusal(peer, each, "it") is not None}
    assert refused == set(list(Role)[list(Role).index(role) + 1 :])


def test_a_refusal_tells_the_role_its_groups_those_of_the_user_and_the_remedy(
    rights: Rights, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Peer, "user", "alice")
    peer = Peer(1, STRANGER, frozenset({NUMBERS["lookers"]}), Role.WATCH)
    refusal = rights.refusal(peer, Role.DRIVE, "drive.turn")
    assert refusal is not None
    assert refusal.message == (
        "drive.turn needs the role drive, which the group drivers or admins gives; alice is in lookers"
    )
    assert refusal.remedy == "sudo usermod -aG drivers alice, then log in again"


def test_a_refusal_tells_how_to_make_a_group_that_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Peer, "user", "alice")
    rights = Rights(Groups(drive="no-such-drivers"))
    refusal = rights.refusal(Peer.nobody(), Role.DRIVE, "drive.turn")
    assert refusal is not None
    assert str(refusal.remedy).startswith("sudo groupadd --system no-such-drivers, start the daemon anew; sudo usermod")


@pytest.mark.parametrize(("group", "next_one"), [("lookers", "drivers"), ("drivers", "admins")])
def test_the_way_to_the_next_role_is_its_group(
    rights: Rights, group: str, next_one: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Peer, "user", "alice")
    assert rights.way_up(peer_in(rights, group)) == f"sudo usermod -aG {next_one} alice, then log in again"


def test_for_who_has_shown_a_token_the_way_to_the_next_role_is_another_one(rights: Rights) -> None:
    peer = replace(peer_in(rights), role=Role.DRIVE, name="a token for drive at 127.0.0.1")
    assert rights.way_up(peer) == "log in with a token for configure"


def test_there_is_no_way_up_for_who_may_do_everything(rights: Rights) -> None:
    assert rights.way_up(peer_in(rights, "admins")) is None


@pytest.mark.parametrize("method", ["hello", "stop", "estop"])
def test_whoever_may_open_the_socket_may_stop_the_robot(method: str) -> None:
    assert METHODS[method].role is Role.STOP


@pytest.mark.parametrize("name", [name for name in METHODS if name not in ("hello", "stop", "estop")])
def test_nothing_else_is_for_everybody(name: str) -> None:
    assert METHODS[name].role is not Role.STOP


@pytest.mark.parametrize("name", [name for name, method in METHODS.items() if method.needs_lease])
def test_whatever_moves_something_needs_a_driver_at_least(name: str) -> None:
    assert METHODS[name].role in (Role.DRIVE, Role.CONFIGURE)


def test_the_command_of_a_process_is_told_without_its_interpreter() -> None:
    assert not command_of(os.getpid()).startswith("python")
    assert command_of(2**22 + 1) == "unknown command"


def test_the_groups_may_open_the_socket_and_nobody_else(tmp_path: Path) -> None:
    mine = grp.getgrgid(os.getgid()).gr_name
    rights = Rights(Groups(mine, mine, mine))
    listener = open_listener(tmp_path / "robot.sock", rights)
    listener.close()
    assert os.getxattr(tmp_path / "robot.sock", "system.posix_acl_access") == make_acl([os.getgid()])


def test_an_access_control_list_is_as_the_kernel_wants_it() -> None:
    assert make_acl([101, 100]).hex(" ", 8) == (
        "02000000 01000600ffffffff 04000600ffffffff 0800060064000000 0800060065000000 10000600ffffffff 20000000ffffffff"
    )
