"""The sockets of the CiA 309-3 gateway: many clients, and clients that misbehave."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import socket
import stat
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import replace
from pathlib import Path

import pytest
import pytest_asyncio

from canhelm import protocol
from canhelm.errors import ConfigError, Refused
from daemon.api import gateway309 as gateway_module
from daemon.api.gateway309 import LOOPBACK, MAX_CLIENTS, Gateway309
from daemon.api.gateway309_session import Session
from daemon.api.gateway309_text import MAX_LINE_BYTES
from daemon.api.parameters import Role
from daemon.api.peers import Peer, Rights
from daemon.app import App, GatewayAccess
from drivers.contract import NodeState
from profiles.loader import load
from vcan_tests.daemon.gateway309_rules import ANSWER, Heard, cocomm

pytestmark = pytest.mark.real_time


class Client:
    """A client that sends what it is told."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader = reader
        self.writer = writer

    def send(self, *lines: bytes) -> None:
        self.writer.write(b"".join(line + b"\n" for line in lines))

    async def answer(self) -> bytes:
        """The next answer, which must be well formed."""
        answer = await asyncio.wait_for(self.reader.readuntil(b"\r\n"), 5)
        assert ANSWER.fullmatch(answer), answer
        return answer

    async def ask(self, line: bytes) -> bytes:
        self.send(line)
        return await self.answer()

    async def ended(self) -> bool:
        with contextlib.suppress(ConnectionError):
            while await asyncio.wait_for(self.reader.read(65536), 5):
                pass
        return True

    async def close(self) -> None:
        self.writer.close()
        with contextlib.suppress(ConnectionError):
            await self.writer.wait_closed()


@pytest.fixture
def app(tmp_path: Path) -> App:
    """A daemon whose bus is not open: every node is silent."""
    return App(load("max2d").profile, gateway=GatewayAccess(tmp_path / "robot.309.sock", tcp_port=0, writable=True))


@pytest_asyncio.fixture
async def gateway(app: App) -> AsyncIterator[Gateway309]:
    assert app.gateway is not None
    await app.gateway.start()
    yield app.gateway
    await app.gateway.close()
    assert app.gateway.counters.internal_errors == 0


Connect = Callable[[], Awaitable[Client]]


@pytest_asyncio.fixture
async def connect(gateway: Gateway309) -> AsyncIterator[Connect]:
    """Opens connections, and closes them at the end."""
    opened: list[Client] = []

    async def connect() -> Client:
        opened.append(Client(*await asyncio.open_unix_connection(gateway.path)))
        return opened[-1]

    yield connect
    for client in opened:
        await client.close()


async def until(condition: Callable[[], bool]) -> None:
    for _ in range(1000):
        if condition():
            return
        await asyncio.sleep(0.005)
    pytest.fail("it did not come true")


# -- clients ----------------------------------------------------------------------------------------------------------


async def test_clients_at_once_get_their_own_answers(tmp_path: Path) -> None:
    app = App(load("max2d").profile, gateway=GatewayAccess(tmp_path / "robot.309.sock"))

    async def talk(number: int) -> None:
        node = 1 + number % 4
        client = Client(*await asyncio.open_unix_connection(tmp_path / "robot.309.sock"))
        assert await client.ask(b"[%d] set node %d" % (number, node)) == b"[%d] OK\r\n" % number
        client.send(*(b"[%d] r 0x1014 0 u32" % (100 * number + count) for count in range(20)))
        for count in range(20):
            assert await client.answer() == b"[%d] %d\r\n" % (100 * number + count, 0x80 + node)
        await client.close()

    await app.start()
    try:
        await until(lambda: all(device.node_state is NodeState.READY for device in app.devices.by_node.values()))
        await asyncio.gather(*(talk(number) for number in range(1, 9)))
    finally:
        await app.close()


async def test_a_slow_request_of_one_client_keeps_no_other_waiting(connect: Connect) -> None:
    slow, quick = await connect(), await connect()
    slow.send(b"[1] set sdo_timeout 50", b"[1] 99 r 0x1000 0")
    assert await slow.answer() == b"[1] OK\r\n"
    assert await quick.ask(b"[2] led") == b"[2] waiting\r\n"
    assert (await slow.answer()).startswith(b"[1] ERROR:0x05040000")


async def test_requests_sent_at_once_are_answered_in_their_order(connect: Connect) -> None:
    client = await connect()
    client.send(b"[1] set sdo_timeout 20", b"[2] 99 r 0x1000 0", b"[3] led", b"", b"[4] 0x63 r 0x1000 0", b"[5] led")
    heads = [(await client.answer())[:3] for _ in range(6)]
    assert heads == [b"[1]", b"[2]", b"[3]", b"\r\n", b"[4]", b"[5]"]


async def test_a_request_may_come_in_pieces(connect: Connect) -> None:
    client = await connect()
    for piece in (b"[", b"1] l", b"ed", b"\r"):
        client.writer.write(piece)
        await asyncio.sleep(0.005)
    assert await client.ask(b"") == b"[1] waiting\r\n"


@pytest.mark.parametrize("line", [b"[1] help", b"[1] set node 4", b"[1] foo", b"[1] 4 reset"])
async def test_cocomm_understands_what_its_first_read_returns(gateway: Gateway309, line: bytes) -> None:
    with socket.socket(socket.AF_UNIX) as client:
        client.setblocking(False)
        loop = asyncio.get_running_loop()
        await loop.sock_connect(client, os.fspath(gateway.path))
        await loop.sock_sendall(client, line + b"\n")
        heard = cocomm(await loop.sock_recv(client, 1000))
    assert heard.kind == {b"help": "value", b"set": "ok"}.get(line.split()[1], "error")
    assert heard != Heard("value")


# -- clients that misbehave -------------------------------------------------------------------------------------------


async def test_a_line_that_is_too_long_is_answered_once_and_the_next_one_read(connect: Connect) -> None:
    client = await connect()
    client.send(b"[7] 4 w 0x1F50 1 hex " + b"00" * 3 * MAX_LINE_BYTES, b"[8] led")
    assert (await client.answer()).startswith(b"[7] ERROR:101")
    assert await client.answer() == b"[8] waiting\r\n"


async def test_bytes_that_mean_nothing_are_answered(connect: Connect) -> None:
    client = await connect()
    assert (await client.ask(bytes(byte for byte in range(256) if byte != 10))).startswith(b"[0] ERROR:101")


async def test_a_client_that_sends_no_more_gets_the_answers_to_what_it_sent(connect: Connect) -> None:
    client = await connect()
    client.send(b"[1] led", b"[2] led")
    client.writer.write(b"[3] led without an end")
    client.writer.write_eof()
    assert await asyncio.wait_for(client.reader.read(), 5) == b"[1] waiting\r\n[2] waiting\r\n"


async def test_a_client_that_hangs_up_leaves_no_trace(connect: Connect, gateway: Gateway309) -> None:
    client = await connect()
    client.send(b"[1] set sdo_timeout 50", *(b"[1] 99 r 0x1000 0",) * 20)
    await until(lambda: gateway.counters.requests == 2)
    client.writer.transport.abort()
    await until(lambda: gateway.counters.clients == 0)
    assert gateway.counters.requests < 5


async def test_a_client_that_never_reads_its_answers_is_dropped(
    gateway: Gateway309, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gateway_module, "STALLED_S", 0.1)
    reader, writer = await asyncio.open_unix_connection(gateway.path)
    writer.transport.pause_reading()  # type: ignore[attr-defined]  # typeshed knows no reading of a writer's transport
    for _ in range(100):
        writer.write(b"[1] help\n" * 100)
    await until(lambda: gateway.counters.dropped_clients == 1)
    writer.transport.abort()
    assert reader.at_eof() is False


async def test_many_lines_at_once_leave_turns_for_others(connect: Connect, gateway: Gateway309) -> None:
    flood = await connect()
    flood.writer.write(b"\n" * 5_000)
    most = 0
    while gateway.counters.requests < 5_000:
        before = gateway.counters.requests
        await asyncio.sleep(0)
        most = max(most, gateway.counters.requests - before)
    assert most <= 2


async def test_a_crowd_is_turned_away(connect: Connect, gateway: Gateway309) -> None:
    for _ in range(MAX_CLIENTS):
        await (await connect()).ask(b"[1] led")
    late = await connect()
    assert b"too many clients" in await late.answer()
    assert await late.ended()


async def test_a_defect_is_answered_and_counted(
    gateway: Gateway309, connect: Connect, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def broken(self: Session, line: bytes) -> bytes:
        raise ZeroDivisionError

    monkeypatch.setattr(Session, "answer", broken)
    with caplog.at_level(logging.CRITICAL):
        assert (await (await connect()).ask(b"[1] led")).startswith(b"[0] ERROR:102")
    assert gateway.counters.internal_errors == 1
    gateway.counters.internal_errors = 0


# -- who may do what --------------------------------------------------------------------------------------------------


async def test_over_tcp_a_client_may_only_read(gateway: Gateway309) -> None:
    client = Client(*await asyncio.open_connection(LOOPBACK, gateway.tcp_port))
    await client.ask(b"[1] set sdo_timeout 10")
    assert (await client.ask(b"[2] 99 r 0x1000 0")).startswith(b"[2] ERROR:0x05040000")
    assert (await client.ask(b"[3] 0 start")).startswith(b"[3] ERROR:100")
    await client.close()


async def test_nobody_writes_unless_the_daemon_was_told_so(app: App, tmp_path: Path) -> None:
    gateway = Gateway309(app.supervisor, tmp_path / "read.309.sock")
    await gateway.start()
    client = Client(*await asyncio.open_unix_connection(gateway.path))
    assert b"--gateway-write" in await client.ask(b"[1] 0 start")
    await client.close()
    await gateway.close()


@pytest.mark.parametrize(("role", "line"), [("watch", b"[1] 99 w 0x1017 0 u16 1"), ("drive", b"[1] 0 stop")])
async def test_only_who_may_configure_writes(
    connect: Connect, monkeypatch: pytest.MonkeyPatch, role: str, line: bytes
) -> None:
    monkeypatch.setattr(Rights, "peer", lambda rights, connection: replace(Peer.nobody(), role=Role(role)))
    assert (await (await connect()).ask(line)).startswith(b"[1] ERROR:100 #writing needs the role configure")


async def test_who_may_not_watch_is_turned_away(connect: Connect, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Rights, "peer", lambda rights, connection: Peer.nobody())
    client = await connect()
    assert b"the gateway needs the role watch" in await client.answer()
    assert await client.ended()


# -- the socket -------------------------------------------------------------------------------------------------------


async def test_the_socket_is_for_owner_and_group_alone(gateway: Gateway309) -> None:
    assert stat.S_IMODE(gateway.path.stat().st_mode) == 0o660


async def test_a_gateway_that_closes_hangs_up_and_takes_its_socket_away(gateway: Gateway309, connect: Connect) -> None:
    busy, idle = await connect(), await connect()
    busy.send(b"[1] 99 r 0x1000 0")
    await idle.ask(b"[2] led")
    await gateway.close()
    assert await busy.ended()
    assert await idle.ended()
    assert not gateway.path.exists()


async def test_the_socket_of_a_live_gateway_is_refused(gateway: Gateway309, app: App) -> None:
    with pytest.raises(Refused, match="--gateway PATH"):
        await Gateway309(app.supervisor, gateway.path).start()


async def test_a_port_that_is_taken_is_named(gateway: Gateway309, app: App, tmp_path: Path) -> None:
    other = Gateway309(app.supervisor, tmp_path / "other.309.sock", tcp_port=gateway.tcp_port)
    with pytest.raises(ConfigError, match=f"port {gateway.tcp_port}"):
        await other.start()
    await other.close()
    assert not other.path.exists()


def test_a_gateway_is_not_taken_for_a_daemon(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(protocol, "SYSTEM_FOLDER", tmp_path / "none")
    (tmp_path / "canhelm").mkdir()
    with contextlib.ExitStack() as stack:
        for name in ("max2d.sock", "max2d.309.sock"):
            listener = stack.enter_context(socket.socket(socket.AF_UNIX))
            listener.bind(os.fspath(tmp_path / "canhelm" / name))
            listener.listen()
        assert [path.name for path in protocol.find_sockets()] == ["max2d.sock"]
