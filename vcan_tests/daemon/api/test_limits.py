"""However many clients and requests there are, the robot can be stopped."""

from __future__ import annotations

import pytest

from canhelm import protocol
from daemon.api import server as server_module
from daemon.api.connection import MAX_PENDING
from daemon.api.server import MAX_CLIENTS, RESERVED_CLIENTS, Server
from vcan_tests.daemon.api.raw_client import Connect, RawClient
from vcan_tests.daemon.fake_backend import FakeBackend

pytestmark = pytest.mark.real_time


async def test_too_many_pending_requests_are_refused_but_stop_is_not(client: RawClient, backend: FakeBackend) -> None:
    for number in range(MAX_PENDING + 1):
        client.send(protocol.make_request(number, "motor.velocity", {"node": 1, "velocity_rpm": 1}))
    assert (await client.answer())["error"]["data"]["limit"] == MAX_PENDING
    assert "result" in await client.ask("stop")


async def test_a_crowd_of_clients_leaves_room_to_stop(server: Server, connect: Connect) -> None:
    for _ in range(MAX_CLIENTS):
        await connect(server)
    late = await connect(server)
    assert "too many clients" in (await late.ask("status"))["error"]["message"]
    assert "result" in await late.ask("stop")


async def test_however_many_clients_there_are_one_more_can_stop_the_robot(server: Server, connect: Connect) -> None:
    for _ in range(MAX_CLIENTS + 2 * RESERVED_CLIENTS):
        await connect(server)
    late = await connect(server)
    assert "result" in await late.ask("estop")
    assert len(server.connections) == MAX_CLIENTS + RESERVED_CLIENTS


async def test_the_longest_idle_client_makes_room_for_a_new_one_and_is_told_so(
    server: Server, backend: FakeBackend, connect: Connect, monkeypatch: pytest.MonkeyPatch
) -> None:
    subscriber, idle = await connect(server), await connect(server)
    await subscriber.ask("subscribe", rate_hz=0.1)
    await idle.ask("hello")
    for _ in range(MAX_CLIENTS - 2):
        await (await connect(server)).ask("hello")
    monkeypatch.setattr(server_module, "IDLE_S", 0.0)
    backend.lease_timeout_s = 0.0
    assert "result" in await (await connect(server)).ask("status")
    assert "too many clients" in (await idle.answer())["error"]["message"]
    assert await idle.ended()
    assert "result" in await subscriber.ask("hello")


async def test_a_crowd_is_logged_once(server: Server, connect: Connect, caplog: pytest.LogCaptureFixture) -> None:
    for _ in range(MAX_CLIENTS + 2 * RESERVED_CLIENTS):
        await connect(server)
    assert [record.message for record in caplog.records if "too many" in record.message] == [
        f"too many clients ({MAX_CLIENTS}): the longest idle one is hung up on for each new one"
    ]
