"""Sessions: what begins one, how many there are, and what a wrong token costs."""

from __future__ import annotations

import asyncio

import pytest

from canhelm.errors import CanhelmError, PermissionRefused, Refused
from daemon.api.parameters import Role
from daemon.api.tokens import SHORTEST, Tokens
from daemon.station import sessions
from daemon.station.sessions import Sessions

TOKEN = "d" * SHORTEST


@pytest.fixture
def guarded() -> Sessions:
    return Sessions(Tokens({TOKEN: Role.DRIVE}))


def test_without_tokens_everybody_may_do_what_the_station_may() -> None:
    assert Sessions(None).role_of(None) is Role.CONFIGURE


async def test_a_token_begins_sessions_with_its_role(guarded: Sessions) -> None:
    first, second = [await guarded.begin(TOKEN, "here") for _ in range(2)]
    assert first != second
    assert (guarded.role_of(first), guarded.role_of(second)) == (Role.DRIVE, Role.DRIVE)


@pytest.mark.parametrize("session", [None, "", TOKEN, "anything"])
def test_nothing_else_is_a_session(guarded: Sessions, session: str | None) -> None:
    assert guarded.role_of(session) is None


async def test_a_session_that_has_ended_is_none(guarded: Sessions) -> None:
    session = await guarded.begin(TOKEN, "here")
    guarded.end(session)
    assert guarded.role_of(session) is None


async def test_the_oldest_session_makes_room(guarded: Sessions, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "MAX_SESSIONS", 2)
    begun = [await guarded.begin(TOKEN, "here") for _ in range(3)]
    assert [guarded.role_of(session) for session in begun] == [None, Role.DRIVE, Role.DRIVE]


async def test_of_many_wrong_tokens_few_wait_and_the_others_are_refused(guarded: Sessions) -> None:
    begun_s = asyncio.get_running_loop().time()
    tried = await asyncio.gather(*(_try(guarded) for _ in range(100)))
    assert sum(type(error) is PermissionRefused for error in tried) == sessions.MAX_WAITING
    assert sum(type(error) is Refused for error in tried) == 100 - sessions.MAX_WAITING
    assert asyncio.get_running_loop().time() - begun_s == pytest.approx(sessions.WRONG_S)


async def test_a_right_token_does_not_wait_for_wrong_ones(guarded: Sessions) -> None:
    wrong = [asyncio.create_task(_try(guarded)) for _ in range(100)]
    await asyncio.sleep(0)
    begun_s = asyncio.get_running_loop().time()
    await guarded.begin(TOKEN, "here")
    assert asyncio.get_running_loop().time() == begun_s
    await asyncio.gather(*wrong)


async def _try(guarded: Sessions) -> CanhelmError | None:
    try:
        await guarded.begin("x" * SHORTEST, "somewhere")
    except CanhelmError as error:
        return error
    return None
