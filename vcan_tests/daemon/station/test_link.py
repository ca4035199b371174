"""A page and a daemon talk through the station: what goes through, what does not, and what happens when one goes."""

from __future__ import annotations

import asyncio
import contextlib
from base64 import b64encode
from random import Random
from typing import Any

import pytest
from aiohttp import WSCloseCode

from canhelm import protocol
from daemon.api.parameters import Role
from daemon.api.server import Server
from daemon.station import link
from vcan_tests.daemon.api.raw_client import until
from vcan_tests.daemon.fake_backend import FakeBackend
from vcan_tests.daemon.station.conftest import TOKENS
from vcan_tests.daemon.station.visitor import Page, Visit, Visitor

pytestmark = pytest.mark.real_time

MOVE: dict[str, Any] = {"node": 1, "velocity_rpm": 10}
NAMED = 1
"""Requests with which the station tells the daemon what people call a page."""


async def test_a_request_gets_the_answer_of_the_daemon(visitor: Visitor) -> None:
    page = await visitor.open()
    answer = await page.ask("hello")
    assert (answer["result"]["robot"], answer["result"]["role"]) == ("fake", "configure")


async def test_a_page_has_the_name_that_the_station_gives_it(visitor: Visitor) -> None:
    page = await visitor.open()
    refused = await page.ask("client.name", name="somebody else")
    assert refused["error"]["message"] == "the station names its pages"
    assert (await page.ask("hello"))["result"]["name"] == "a page at 127.0.0.1"


async def test_an_error_of_the_daemon_comes_as_it_is(visitor: Visitor) -> None:
    page = await visitor.open()
    answer = await page.ask("motor.enable", node=7)
    assert answer["error"]["data"] == {"type": "NodeAbsent", "node": 7, "remedy": "check its power"}


async def test_samples_and_events_come_to_who_subscribes(visitor: Visitor, backend: FakeBackend) -> None:
    page = await visitor.open()
    await page.ask("subscribe", rate_hz=50)
    sample = await page.hear(lambda message: message.get("method") == "status")
    backend.events[0]({"severity": "info", "message": "a word"})
    event = await page.hear(lambda message: message.get("method") == "event")
    assert (sample["params"]["robot"], event["params"]["message"]) == ("fake", "a word")


async def test_each_page_has_a_lease_of_its_own(visitor: Visitor, backend: FakeBackend) -> None:
    first, second = await visitor.open(), await visitor.open()
    await first.send("motor.velocity", **MOVE)
    await until(lambda: len(backend.calls) == 1)
    await second.send("motor.velocity", **MOVE)
    await until(lambda: len(backend.calls) == 2)
    assert len({lease for _, _, lease in backend.calls}) == 2


async def test_what_a_page_moves_stops_when_it_is_closed(visitor: Visitor, backend: FakeBackend) -> None:
    page = await visitor.open()
    await page.send("motor.velocity", **MOVE)
    await until(lambda: backend.calls)
    await page.socket.close()
    await until(lambda: backend.stopped)
    assert backend.stop_reasons == ["its client hung up"]


async def test_what_a_page_moves_stops_when_its_lease_runs_out(visitor: Visitor, backend: FakeBackend) -> None:
    page = await visitor.open()
    await page.send("motor.velocity", **MOVE)
    await asyncio.to_thread(backend.ran_out.wait, 5.0)
    assert backend.stopped


async def test_a_move_that_hung_in_the_network_does_not_reach_the_daemon(
    visitor: Visitor, backend: FakeBackend
) -> None:
    page = await visitor.open()
    page.sent_ms = 10_000.0
    await page.ask("hello")
    page.sent_ms = 2_000.0
    answer = await page.ask("motor.velocity", **MOVE)
    assert "on its way for" in answer["error"]["message"]
    assert not backend.calls


async def test_a_stop_that_is_sent_last_is_carried_out(visitor: Visitor, backend: FakeBackend) -> None:
    page = await visitor.open()
    await page.send("stop")
    await page.socket.close()
    await until(lambda: backend.calls)
    assert backend.calls[0][0] == "stop"


# -- roles ------------------------------------------------------------------------------------------------------------


async def page_of(guest: Visitor, role: Role) -> Page:
    await guest.login(TOKENS[role])
    return await guest.open()


@pytest.mark.parametrize(
    ("role", "method"),
    [
        (Role.WATCH, "reset"),
        (Role.WATCH, "drive.set"),
        (Role.WATCH, "station.path.write"),
        (Role.DRIVE, "sdo.write"),
        (Role.DRIVE, "a.method.to.come"),
    ],
)
async def test_a_request_above_the_role_of_the_page_does_not_reach_the_daemon(
    guest: Visitor, backend: FakeBackend, daemon: Server, role: Role, method: str
) -> None:
    page = await page_of(guest, role)
    error = (await page.ask(method))["error"]
    assert error["data"]["type"] == "PermissionRefused"
    assert "log in with a token for" in error["data"]["remedy"]
    assert (backend.calls, daemon.counters.requests) == ([], NAMED)


async def test_two_requests_in_one_message_are_not_two_lines(
    guest: Visitor, backend: FakeBackend, daemon: Server
) -> None:
    page = await page_of(guest, Role.WATCH)
    hidden = '{"jsonrpc":"2.0","id":2,"method":"reset","params":{}}'
    await page.socket.send_str(f'{{"jsonrpc":"2.0","id":1,"method":"status","x":\n{hidden}\n}}')
    await page.hear(lambda message: message.get("id") == 1)
    await page.ask("status")
    assert (backend.calls, daemon.counters.requests, daemon.counters.malformed) == ([], NAMED + 2, 0)


async def test_who_watches_may_stop(guest: Visitor) -> None:
    page = await page_of(guest, Role.WATCH)
    assert "result" in await page.ask("stop")


async def test_a_page_is_told_its_own_role_and_the_way_to_the_next(guest: Visitor) -> None:
    page = await page_of(guest, Role.WATCH)
    hello, status = (await page.ask("hello"))["result"], (await page.ask("status"))["result"]
    await page.ask("subscribe", rate_hz=50)
    sample = (await page.hear(lambda message: message.get("method") == "status"))["params"]
    assert [told["role"] for told in (hello, status, sample)] == ["watch"] * 3
    assert sample["role_remedy"] == "log in with a token for drive"


# -- methods of the station -------------------------------------------------------------------------------------------


async def test_the_station_answers_its_own_methods(visitor: Visitor, daemon: Server) -> None:
    page = await visitor.open()
    assert (await page.ask("station.paths"))["result"] == {"paths": []}
    assert daemon.counters.requests == NAMED


@pytest.mark.parametrize(
    ("method", "params", "told"),
    [
        ("station.nothing", {}, "no method"),
        ("station.path.read", {}, "name is missing"),
        ("station.path.read", {"name": 3}, "is not a string"),
        ("station.path.read", {"name": "../../etc/passwd"}, "name"),
        ("station.objects", {"device": "toaster"}, "no object dictionary"),
    ],
)
async def test_nonsense_to_the_station_is_refused_with_a_reason(
    visitor: Visitor, method: str, params: dict[str, Any], told: str
) -> None:
    page = await visitor.open()
    assert told in (await page.ask(method, **params))["error"]["message"]


# -- nonsense ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "",
        "\n",
        "nonsense",
        "[]",
        "3",
        '{"method": 3}',
        '{"method": ["stop"]}',
        '{"method": "status", "id": {}}',
        '{"method": "status", "params": 3}',
        '{"method": "station.paths", "params": []}',
        '{"id": NaN, "method": "status"}',
        '{"a":' * 5000,
        '{"id": 1, "method": "status", "x": ' + "[" * 900 + "]" * 900 + "}",
        '{"method": "status", "x": "' + "\u00e9" * 30_000 + '"}',
    ],
)
async def test_nonsense_is_answered_and_the_page_goes_on(visitor: Visitor, text: str) -> None:
    page = await visitor.open()
    await page.socket.send_str(text)
    answer = await page.hear(lambda message: "error" in message or "result" in message)
    assert (await page.ask("hello"))["result"]["robot"] == "fake", answer


async def test_bytes_are_answered_as_nonsense(visitor: Visitor) -> None:
    page = await visitor.open()
    await page.socket.send_bytes(b"\xff\x00")
    assert (await page.hear(lambda message: "error" in message))["error"]["code"] == protocol.INVALID_REQUEST


async def test_a_page_that_sends_nothing_else_is_hung_up_on(visitor: Visitor) -> None:
    page = await visitor.open()
    for _ in range(link.MAX_MALFORMED):
        await page.socket.send_str("nonsense")
    assert await page.closed() == (WSCloseCode.POLICY_VIOLATION, "this page sends nonsense")


async def test_a_message_that_is_too_long_ends_its_page_alone(visitor: Visitor) -> None:
    page, other = await visitor.open(), await visitor.open()
    with contextlib.suppress(ConnectionError):
        await page.socket.send_str("x" * 10_000_000)
    assert (await page.closed())[0] in (WSCloseCode.MESSAGE_TOO_BIG, None)
    assert "result" in await other.ask("hello")


async def test_a_thousand_requests_at_once_are_all_answered(visitor: Visitor) -> None:
    page = await visitor.open()
    requests = {await page.send("hello") for _ in range(1000)}
    while requests:
        message = await page.hear(lambda message: "id" in message)
        requests.discard(message["id"])


# -- who goes ---------------------------------------------------------------------------------------------------------


async def test_a_robot_without_a_daemon_is_told_by_the_code_of_the_close(visit: Visit) -> None:
    page = await (await visit()).open("nobody")
    code, reason = await page.closed()
    assert (code, reason[:20]) == (link.NO_DAEMON, "no daemon answers on")


@pytest.mark.parametrize("robot", ["..%2Ffake", "%00", "a" * 300, "fake.309"])
async def test_a_name_that_is_no_robot_is_told_likewise(visitor: Visitor, robot: str) -> None:
    page = await visitor.open(robot)
    assert (await page.closed())[0] == link.NO_DAEMON


async def test_a_daemon_that_ends_is_told_and_its_successor_answers(
    visitor: Visitor, daemon: Server, backend: FakeBackend
) -> None:
    page = await visitor.open()
    await page.ask("hello")
    await daemon.close()
    assert await page.closed() == (link.NO_DAEMON, "the daemon of fake hung up")
    successor = Server(backend, daemon.path)
    await successor.start()
    page = await visitor.open()
    assert "result" in await page.ask("hello")
    await page.socket.close()
    await successor.close()


async def test_a_daemon_that_says_farewell_is_passed_on(visitor: Visitor, daemon: Server) -> None:
    page = await visitor.open()
    await page.ask("hello")
    next(iter(daemon.connections)).dismiss()
    assert await page.closed() == (link.NO_DAEMON, "too many clients")


async def test_no_name_of_a_person_is_cut_within_a_letter(visitor: Visitor) -> None:
    page = await visitor.open("\u00e9" * 200)
    assert "\ufffd" not in (await page.closed())[1]


async def test_a_page_that_stops_reading_is_hung_up_on_and_others_are_not(
    visitor: Visitor, backend: FakeBackend, daemon: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(link, "STALLED_S", 0.5)
    backend.padding = b64encode(Random(1).randbytes(45_000)).decode()
    deaf, other = await visitor.open(), await visitor.open()
    await deaf.send("subscribe", rate_hz=50)
    await until(lambda: len(daemon.connections) == 2)
    await until(lambda: len(daemon.connections) == 1)
    assert (await other.ask("hello"))["result"]["robot"] == "fake"


async def test_a_page_that_does_not_read_its_answers_is_hung_up_on(
    visitor: Visitor, backend: FakeBackend, daemon: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("daemon.station.outbox.MAX_UNSENT_BYTES", 200_000)
    page = await visitor.open()
    await page.ask("hello")
    with contextlib.suppress(ConnectionError):
        while daemon.connections:
            await page.send("api.schema")
            await asyncio.sleep(0)
    await until(lambda: not daemon.connections)
