"""Samples and events for those that asked for them, and what becomes of clients that do not read."""

from __future__ import annotations

import os
import socket

import pytest

from canhelm import protocol
from daemon.api import connection as connection_module
from daemon.api.server import Server
from vcan_tests.daemon.api.raw_client import RawClient, until
from vcan_tests.daemon.fake_backend import FakeBackend

pytestmark = pytest.mark.real_time


async def test_a_subscriber_gets_samples_at_its_rate(client: RawClient) -> None:
    await client.ask("subscribe", rate_hz=50)
    assert [(await client.answer())["method"] for _ in range(3)] == ["status"] * 3


async def test_a_subscriber_gets_events(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("subscribe", rate_hz=0.1)
    backend.events[0]({"severity": "warning", "message": "node 3 lost"})
    answer = await client.answer()
    assert (answer["method"], answer["params"]["message"]) == ("event", "node 3 lost")


async def test_who_has_unsubscribed_gets_nothing_more(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("subscribe", rate_hz=50)
    client.send(protocol.make_request(9, "unsubscribe", {}))
    while (await client.answer()).get("id") != 9:
        pass
    backend.events[0]({"message": "unheard"})
    assert (await client.ask("hello"))["id"] == 1


async def test_a_subscriber_that_stops_reading_loses_samples_then_its_connection(
    server: Server, backend: FakeBackend, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection_module, "STALLED_S", 0.1)
    backend.padding = "x" * 60_000
    deaf = socket.socket(socket.AF_UNIX)
    deaf.connect(os.fspath(server.path))
    deaf.sendall(protocol.make_request(1, "subscribe", {"rate_hz": 50}))
    await until(lambda: server.counters.dropped_clients == 1)
    assert server.counters.lost_samples > 0
    deaf.close()


async def test_a_client_that_never_reads_its_answers_is_dropped(server: Server, backend: FakeBackend) -> None:
    backend.padding = "x" * 60_000
    deaf = socket.socket(socket.AF_UNIX)
    deaf.connect(os.fspath(server.path))
    deaf.sendall(b"".join(protocol.make_request(number, "status", {}) for number in range(60)))
    await until(lambda: server.counters.dropped_clients == 1)
    deaf.close()
