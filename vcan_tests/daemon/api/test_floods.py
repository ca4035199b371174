"""A client that asks for too much is refused and slowed down; nobody else notices."""

from __future__ import annotations

import asyncio
import itertools
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm import protocol
from canhelm.protocol import MAX_REQUEST_BYTES
from daemon.api.connection import FAREWELL_S, LINES_A_TURN, Connection
from daemon.api.metering import BYTES_PER_S, REFUSED_PER_S, REQUESTS_PER_S, Allowance
from vcan_tests.docs.virtual_daemon import OpenServer, Wire
from vcan_tests.robot import Robot, running_robot

FLOOD = 5000
CHUNK_BYTES = 65_536
PERIOD_S = 0.01
"""Of the control cycle."""
FORWARD = {"speed_m_s": 0.3, "direction_deg": 0.0, "valid_for_ms": 200}


class Talker(Wire):
    """A client on virtual time, whose bytes wait in a buffer as long as the daemon does not read."""

    def __init__(self, server: OpenServer) -> None:
        self._ends = socket.socketpair()
        super().__init__(self._ends[0])
        self.answers: list[dict[str, Any]] = []
        self._wanted = 0
        self._heard = asyncio.Event()
        self._unread = bytearray()
        self._paused = False
        self.connection = Connection(server)
        self.connection.connection_made(self)

    def write(self, data: bytes | bytearray | memoryview) -> None:
        for line in bytes(data).splitlines():
            answer = protocol.parse_message(line)
            assert isinstance(answer, dict)
            self.answers.append(answer)
        if len(self.answers) >= self._wanted:
            self._heard.set()

    def pause_reading(self) -> None:
        self._paused = True

    def resume_reading(self) -> None:
        self._paused = False
        asyncio.get_running_loop().call_soon(self._deliver)

    def say(self, data: bytes) -> None:
        self._unread += data
        self._deliver()

    def _deliver(self) -> None:
        if self._unread and not self._paused and not self.is_closing():
            chunk = bytes(self._unread[:CHUNK_BYTES])
            del self._unread[:CHUNK_BYTES]
            self.connection.data_received(chunk)

    async def until_answered(self, count: int) -> list[dict[str, Any]]:
        """Wait for so many answers altogether."""
        self._wanted = count
        self._heard.clear()
        if len(self.answers) < count:
            async with asyncio.timeout(60.0):
                await self._heard.wait()
        return self.answers

    async def ask(self, method: str, /, **params: Any) -> dict[str, Any]:
        self.say(protocol.make_request(0, method, params))
        return (await self.until_answered(len(self.answers) + 1))[-1]

    def hang_up(self) -> None:
        self.connection.connection_lost(None)
        for end in self._ends:
            end.close()


@asynccontextmanager
async def flooded(*lines: bytes) -> AsyncIterator[tuple[Robot, OpenServer, Talker, Talker]]:
    """A robot, its server, a client that has just sent all these lines at once, and one that has not."""
    async with running_robot() as robot:
        server = OpenServer(robot.app.service, Path("virtual"))
        flooder, other = Talker(server), Talker(server)
        flooder.say(b"".join(lines))
        yield robot, server, flooder, other
        flooder.hang_up()
        other.hang_up()


def requests(method: str, count: int = FLOOD, /, **params: Any) -> list[bytes]:
    return [protocol.make_request(number, method, params) for number in range(1, count + 1)]


def results(answers: list[dict[str, Any]]) -> int:
    return sum("result" in answer for answer in answers)


@given(st.lists(st.tuples(st.floats(0.0, 0.2), st.floats(0.1, 5.0)), max_size=200))
def test_no_more_is_allowed_than_the_rate_and_what_was_saved(asked: list[tuple[float, float]]) -> None:
    now_s, taken, allowance = 0.0, 0.0, Allowance(10.0, 0.0)
    for later_s, amount in asked:
        now_s += later_s
        if not allowance.lacking_s(amount, now_s):
            allowance.take(amount)
            taken += amount
    assert taken <= 10.0 * (1.0 + now_s) + 1e-6


@given(st.floats(0.1, 10.0))
def test_what_is_lacking_is_there_after_the_time_that_is_told(amount: float) -> None:
    allowance = Allowance(10.0, 0.0)
    allowance.take(10.0)
    wait_s = allowance.lacking_s(amount, 0.0)
    assert allowance.lacking_s(amount, wait_s) < 1e-9


async def test_who_waits_for_each_answer_is_slowed_down_and_never_refused() -> None:
    async with flooded() as (_, _, client, _):
        begun_s = asyncio.get_running_loop().time()
        for _ in range(3 * REQUESTS_PER_S):
            assert "result" in await client.ask("hello")
        assert asyncio.get_running_loop().time() - begun_s >= 2.0


async def test_a_flood_is_refused_with_the_limit_and_every_request_of_it_is_answered() -> None:
    async with flooded(*requests("hello")) as (_, server, flooder, _):
        answers = await flooder.until_answered(FLOOD)
        refused = [answer for answer in answers if "error" in answer]
        assert {answer["error"]["data"]["limit"] for answer in refused} == {
            f"{REQUESTS_PER_S} requests or {BYTES_PER_S} bytes a second"
        }
        assert len(refused) == server.counters.refused == FLOOD - results(answers)
        assert sorted(answer["id"] for answer in answers) == list(range(1, FLOOD + 1))


async def test_no_more_of_a_flood_is_carried_out_than_the_rate_permits() -> None:
    async with flooded(*requests("hello")) as (_, _, flooder, _):
        begun_s = asyncio.get_running_loop().time()
        carried_out = results(await flooder.until_answered(FLOOD))
        took_s = asyncio.get_running_loop().time() - begun_s
        assert took_s > (FLOOD - carried_out) / REFUSED_PER_S * 0.99
        assert REQUESTS_PER_S <= carried_out <= REQUESTS_PER_S * (1.0 + took_s) + 1


async def test_long_lines_are_limited_by_their_bytes() -> None:
    line = protocol.make_request(1, "hello", {"padding": "x" * 60_000})
    count = 4 * BYTES_PER_S // len(line)
    async with flooded(*[line] * count) as (_, server, flooder, _):
        await flooder.until_answered(count)
        assert server.counters.refused > count // 2


async def test_a_stop_at_the_end_of_a_flood_is_carried_out() -> None:
    async with flooded(*requests("status"), *requests("stop", 1)) as (_, _, flooder, _):
        assert "result" in (await flooder.until_answered(FLOOD + 1))[-1]


async def test_others_are_answered_at_once_while_somebody_floods() -> None:
    async with flooded(*requests("hello")) as (_, _, _, other):
        begun_s = asyncio.get_running_loop().time()
        for _ in range(20):
            assert "result" in await other.ask("status")
        assert asyncio.get_running_loop().time() - begun_s < 20 * 0.002


async def test_between_two_control_cycles_only_few_lines_of_a_flood_are_looked_at() -> None:
    async with flooded(*requests("hello")) as (robot, _, flooder, _):
        seen = [len(flooder.answers)]
        robot.app.supervisor.observers.append(lambda: seen.append(len(flooder.answers)))
        await flooder.until_answered(FLOOD)
        most = max(after - before for before, after in itertools.pairwise(seen))
        assert most <= REQUESTS_PER_S + PERIOD_S * (REQUESTS_PER_S + REFUSED_PER_S) + LINES_A_TURN
        assert sorted(after - before for before, after in itertools.pairwise(seen))[-2] <= 3 * LINES_A_TURN
        assert robot.app.service.status()["cycle"]["late_cycles"] == 0


async def test_commands_of_a_flood_that_nobody_sends_any_more_are_not_carried_out_for_long() -> None:
    async with flooded(*requests("drive.set", FLOOD, **FORWARD)) as (robot, _, flooder, _):
        await flooder.until_answered(FLOOD)
        took_s = await robot.until(lambda: robot.speed_m_s < 0.01, 5.0)
        assert took_s < 1.0


async def test_who_flooded_may_ask_again_after_a_second() -> None:
    async with flooded(*requests("hello")) as (_, _, flooder, _):
        await flooder.until_answered(FLOOD)
        await asyncio.sleep(1.0)
        flooder.say(b"".join(requests("hello", REQUESTS_PER_S)))
        assert results((await flooder.until_answered(FLOOD + REQUESTS_PER_S))[FLOOD:]) == REQUESTS_PER_S


async def test_who_floods_and_comes_back_finds_no_more_than_was_left() -> None:
    async with flooded() as (_, server, _, _):
        first = Talker(server)
        first.say(b"".join(requests("hello", REQUESTS_PER_S)))
        await first.until_answered(REQUESTS_PER_S)
        first.hang_up()
        again = Talker(server)
        again.say(b"".join(requests("hello")))
        carried_out = results(await again.until_answered(FLOOD))
        again.hang_up()
        assert carried_out < REQUESTS_PER_S * FLOOD / REFUSED_PER_S


@pytest.mark.parametrize("end", [b"\n", b""])
@pytest.mark.parametrize("length", [MAX_REQUEST_BYTES + 1, 100_000, 300_000])
async def test_a_line_that_is_too_long_is_answered_with_the_limit_and_then_hung_up_on(length: int, end: bytes) -> None:
    async with flooded(b" " * length + end) as (_, server, client, _):
        answer = (await client.until_answered(1))[0]
        assert answer["error"]["message"] == f"a line is longer than {MAX_REQUEST_BYTES} bytes"
        client.say(protocol.make_request(1, "hello", {}))
        await asyncio.sleep(2 * FAREWELL_S)
        assert (len(client.answers), client.is_closing()) == (1, True)
        assert server.counters.malformed == 1


async def test_the_longest_line_is_carried_out() -> None:
    async with flooded(protocol.make_request(1, "hello", {}).rstrip().ljust(MAX_REQUEST_BYTES) + b"\n") as robot:
        assert "result" in (await robot[2].until_answered(1))[0]


async def test_a_client_without_a_place_is_told_when_one_gets_free() -> None:
    async with flooded() as (_, _, idle, late):
        await asyncio.sleep(0.5)
        late.connection.crowded = True
        late.say(protocol.make_request(1, "status", {}))
        await idle.ask("subscribe", rate_hz=0.1)
        late.say(protocol.make_request(2, "status", {}))
        first, second = (answer["error"]["data"]["remedy"] for answer in await late.until_answered(2))
        assert "a place gets free in 1.5 s" in first
        assert "a place gets free in 2.0 s" in second
