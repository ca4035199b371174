"""What a role keeps a page from, and which role it is told."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm import protocol
from daemon.api.methods import METHODS
from daemon.api.parameters import Role
from daemon.station.limits import lowered, refusal
from daemon.station.methods import METHODS as OWN


@pytest.mark.parametrize("limit", [Role.WATCH, Role.DRIVE, Role.CONFIGURE])
def test_a_page_may_call_what_its_role_allows_and_nothing_else(limit: Role) -> None:
    may = {name for name in METHODS if refusal(name, limit) is None}
    ranks = list(Role)
    assert may == {name for name, method in METHODS.items() if ranks.index(method.role) <= ranks.index(limit)}


def test_what_writes_files_of_the_station_wants_the_role_drive() -> None:
    wanted = {name for name in OWN if refusal(name, Role.WATCH) is not None}
    assert wanted == {"station.path.write", "station.path.delete", "station.record.start", "station.record.stop"}


@given(st.text())
def test_a_method_that_nobody_knows_is_for_who_may_do_everything(name: str) -> None:
    if name not in METHODS and name not in OWN:
        assert refusal(name, Role.DRIVE) is not None
        assert refusal(name, Role.CONFIGURE) is None


@pytest.mark.parametrize(
    ("daemon", "limit", "told"),
    [
        (Role.CONFIGURE, Role.WATCH, Role.WATCH),
        (Role.CONFIGURE, Role.CONFIGURE, Role.CONFIGURE),
        (Role.WATCH, Role.DRIVE, Role.WATCH),
    ],
)
def test_a_page_is_told_the_lower_role_of_its_own_and_the_stations(daemon: Role, limit: Role, told: Role) -> None:
    message = protocol.parse_message(lowered(protocol.make_result(1, {"role": daemon, "state": "idle"}), limit))
    assert isinstance(message, dict)
    assert message["result"]["role"] == told


@given(st.binary())
def test_whatever_else_a_daemon_says_stays_as_it_is(line: bytes) -> None:
    assert lowered(line + b'"role":', Role.WATCH) == line + b'"role":'
