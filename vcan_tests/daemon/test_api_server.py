"""The socket server against clients that behave, and against those that do not."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import socket
import stat
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from canhelm import protocol
from canhelm.errors import ConfigError, Refused
from daemon.api import connection as connection_module
from daemon.api import server as server_module
from daemon.api.connection import MAX_MALFORMED, MAX_PENDING
from daemon.api.server import MAX_CLIENTS, RESERVED_CLIENTS, Server
from vcan_tests.daemon.fake_backend import FakeBackend

pytestmark = pytest.mark.real_time


class RawClient:
    """A client that sends what it is told, sense or nonsense."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader = reader
        self.writer = writer

    def send(self, line: bytes) -> None:
        self.writer.write(line)

    async def answer(self) -> dict[str, Any]:
        line = await asyncio.wait_for(self.reader.readline(), 5)
        parsed = protocol.parse_message(line)
        assert isinstance(parsed, dict), line
        return parsed

    async def ask(self, method: str, /, **params: Any) -> dict[str, Any]:
        self.send(protocol.make_request(1, method, params))
        return await self.answer()

    async def close(self) -> None:
        self.writer.close()
        with contextlib.suppress(ConnectionError):
            await self.writer.wait_closed()

    async def ended(self) -> bool:
        try:
            while await asyncio.wait_for(self.reader.read(65536), 5):
                pass
        except ConnectionError:
            pass
        return True


@pytest.fixture
def backend() -> FakeBackend:
    return FakeBackend()


@pytest_asyncio.fixture
async def server(backend: FakeBackend, tmp_path: Path) -> AsyncIterator[Server]:
    server = Server(backend, tmp_path / "robot.sock")
    await server.start()
    yield server
    await server.close()


Connect = Callable[[Server], Awaitable[RawClient]]


@pytest_asyncio.fixture
async def connect() -> AsyncIterator[Connect]:
    """Opens connections, and closes them at the end."""
    opened: list[RawClient] = []

    async def connect(server: Server) -> RawClient:
        opened.append(RawClient(*await asyncio.open_unix_connection(server.path, limit=1 << 22)))
        return opened[-1]

    yield connect
    for client in opened:
        await client.close()


@pytest_asyncio.fixture
async def client(server: Server, connect: Connect) -> RawClient:
    return await connect(server)


async def until(condition: Any) -> None:
    for _ in range(1000):
        if condition():
            return
        await asyncio.sleep(0.005)
    pytest.fail("it did not come true")


# -- requests ---------------------------------------------------------------------------------------------------------


async def test_hello_tells_who_answers(client: RawClient) -> None:
    result = (await client.ask("hello"))["result"]
    assert (result["robot"], result["api_version"], result["role"]) == ("fake", 1, "configure")


async def test_the_schema_lists_methods_with_units_and_errors_with_exit_codes(client: RawClient) -> None:
    result = (await client.ask("api.schema"))["result"]
    methods = {method["name"]: method for method in result["methods"]}
    assert {"name": "angle_deg", "unit": "deg"}.items() <= methods["steer"]["params"][1].items()
    assert {"type": "NodeAbsent", "exit_code": 4}.items() <= {e["type"]: e for e in result["errors"]}[
        "NodeAbsent"
    ].items()


async def test_numbers_that_json_has_no_word_for_are_sent_as_null(client: RawClient) -> None:
    assert (await client.ask("status"))["result"]["nodes"][0]["velocity_rpm"] is None


async def test_an_error_carries_type_node_limit_and_remedy(client: RawClient) -> None:
    error = (await client.ask("motor.enable", node=8))["error"]
    assert error["data"] == {"type": "LimitExceeded", "node": 8, "limit": "8000 rpm", "remedy": "ask for less"}


async def test_a_defect_is_answered_and_counted(client: RawClient, server: Server) -> None:
    error = (await client.ask("motor.reset", node=1))["error"]
    assert (error["code"], server.counters.internal_errors) == (protocol.INTERNAL_ERROR, 1)


async def test_a_request_without_an_id_is_carried_out_and_not_answered(client: RawClient, backend: FakeBackend) -> None:
    client.send(b'{"jsonrpc":"2.0","method":"stop"}\n')
    answer = await client.ask("hello")
    assert answer["id"] == 1
    assert backend.calls[0][0] == "stop"


async def test_an_unknown_method_is_named(client: RawClient) -> None:
    error = (await client.ask("motor.fly"))["error"]
    assert (error["code"], "motor.fly" in error["message"]) == (protocol.METHOD_NOT_FOUND, True)


# -- nonsense ---------------------------------------------------------------------------------------------------------

NONSENSE = [
    b"hello",
    b"\xff\xfe\x00\x01",
    b"[]",
    b"17",
    b"null",
    b'{"id":1}',
    b'{"id":{},"method":"stop"}',
    b'{"id":true,"method":"stop"}',
    b'{"id":1,"method":5}',
    b'{"id":1,"method":"status","params":[1]}',
    b'{"id":1,"method":"status","params":{"a":NaN}}',
    b"[" * 50_000,
    b'{"a":' * 10_000,
    b'{"id":' + b"9" * 10_000 + b',"method":"stop"}',
]


@pytest.mark.parametrize("line", NONSENSE, ids=range(len(NONSENSE)))
async def test_nonsense_is_answered_with_an_error(client: RawClient, server: Server, line: bytes) -> None:
    client.send(line + b"\n")
    assert (await client.answer())["error"]["code"] in (protocol.PARSE_ERROR, protocol.INVALID_REQUEST)
    assert server.counters.malformed == 1
    assert "result" in await client.ask("hello")


async def test_a_line_without_an_end_is_answered_and_hung_up_on(client: RawClient) -> None:
    client.send(b"x" * (protocol.MAX_REQUEST_BYTES + 1))
    assert "longer than" in (await client.answer())["error"]["message"]
    assert await client.ended()


async def test_a_client_that_sends_only_nonsense_is_dropped(client: RawClient, server: Server) -> None:
    client.send(b"x\n" * (MAX_MALFORMED + 1))
    assert await client.ended()
    assert server.counters.dropped_clients == 1


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.binary(max_size=60), max_size=5))
def test_no_bytes_make_the_server_raise(tmp_path_factory: pytest.TempPathFactory, lines: list[bytes]) -> None:
    async def scenario() -> None:
        server = Server(FakeBackend(), tmp_path_factory.mktemp("fuzz") / "s")
        await server.start()
        client = RawClient(*await asyncio.open_unix_connection(server.path))
        client.send(b"\n".join(lines) + b"\n")
        client.send(protocol.make_request(4711, "hello", {}))
        while (await client.answer()).get("id") != 4711:
            pass
        await client.close()
        await server.close()

    with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
        runner.run(scenario())


# -- leases -----------------------------------------------------------------------------------------------------------


async def test_a_motion_is_held_by_the_lease_of_its_connection(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01)
    assert backend.calls[0][2] == "lease-1"


async def test_a_motion_that_is_handed_over_has_no_lease(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01, wait=False)
    assert backend.calls[0][2] is None


async def test_a_motion_without_an_end_cannot_be_handed_over(client: RawClient) -> None:
    error = (await client.ask("motor.velocity", node=1, velocity_rpm=100, wait=False))["error"]
    assert error["data"]["object"] == "duration_s"


async def test_renewals_flow_while_a_motion_waits(client: RawClient, backend: FakeBackend) -> None:
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 100}))
    client.send(protocol.make_request(2, "lease.renew", {}))
    assert (await client.answer()) == {"jsonrpc": "2.0", "id": 2, "result": {"lease": "lease-1"}}


async def test_a_client_that_hangs_up_loses_its_lease(client: RawClient, backend: FakeBackend) -> None:
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 100}))
    await until(lambda: backend.calls)
    client.writer.close()
    await until(lambda: backend.stopped == ["lease-1"])


async def test_closing_the_lease_answers_after_the_motion_has_ended(client: RawClient) -> None:
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 100}))
    client.send(protocol.make_request(2, "lease.close", {}))
    assert [(await client.answer())["id"], (await client.answer())["id"]] == [1, 2]


async def test_a_command_after_a_lease_ran_out_begins_a_new_one(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01)
    backend.close_lease("lease-1")
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01)
    assert backend.calls[1][2] == "lease-2"


# -- limits -----------------------------------------------------------------------------------------------------------


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


async def test_a_client_that_lets_go_of_its_motion_has_not_hung_up(backend: FakeBackend, client: RawClient) -> None:
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 5}))
    await client.ask("hello")
    client.send(protocol.make_request(2, "lease.close", {}))
    await client.answer()
    assert backend.stop_reasons == ["its client ended it"]


# -- subscriptions ----------------------------------------------------------------------------------------------------


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


# -- the socket -------------------------------------------------------------------------------------------------------


async def test_the_socket_is_for_owner_and_group_alone(server: Server) -> None:
    assert stat.S_IMODE(server.path.stat().st_mode) == 0o660


async def test_the_socket_of_a_dead_daemon_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "robot.sock"
    dead = socket.socket(socket.AF_UNIX)
    dead.bind(os.fspath(path))
    dead.close()
    server = Server(FakeBackend(), path)
    await server.start()
    await server.close()


async def test_the_socket_of_a_live_daemon_is_refused(server: Server) -> None:
    with pytest.raises(Refused, match="already answers"):
        await Server(FakeBackend(), server.path).start()


async def test_a_file_is_not_taken_for_a_socket(tmp_path: Path) -> None:
    (tmp_path / "robot.sock").write_text("precious")
    with pytest.raises(ConfigError, match="no socket"):
        await Server(FakeBackend(), tmp_path / "robot.sock").start()


async def test_a_path_that_is_too_long_is_refused_with_the_limit(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="107"):
        await Server(FakeBackend(), tmp_path / ("x" * 120)).start()


async def test_a_server_that_closes_takes_its_socket_away(tmp_path: Path) -> None:
    server = Server(FakeBackend(), tmp_path / "robot.sock")
    await server.start()
    await server.close()
    assert not server.path.exists()


async def test_a_server_that_closes_hangs_up_on_motions(server: Server, connect: Connect, backend: FakeBackend) -> None:
    client = await connect(server)
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 100}))
    await until(lambda: backend.calls)
    await server.close()
    assert await client.ended()


@pytest.mark.parametrize("turns", range(5))
async def test_a_connection_that_is_being_accepted_is_not_lost_by_closing(server: Server, turns: int) -> None:
    with socket.socket(socket.AF_UNIX) as late:
        late.connect(os.fspath(server.path))
        for _ in range(turns):
            await asyncio.sleep(0)
        await server.close()
        for _ in range(5):
            await asyncio.sleep(0)
        late.settimeout(1.0)
        with contextlib.suppress(ConnectionResetError):
            while late.recv(65536):
                pass


def test_a_line_of_the_protocol_is_one_json_object() -> None:
    assert json.loads(protocol.make_request(1, "stop", {})) == {
        "jsonrpc": "2.0",
        "id": 1,
        "method": "stop",
        "params": {},
    }
