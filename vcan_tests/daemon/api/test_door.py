"""The API over TCP: a token first, then a client like any other."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path

import pytest
import pytest_asyncio

from canhelm import aio, protocol
from canhelm.client import Client
from canhelm.errors import ConfigError, DaemonNotRunning, PermissionRefused, UsageError
from canhelm.tcp import own_token
from daemon.api import door as door_module
from daemon.api.door import LOOPBACK, MAX_LINE_BYTES, MAX_WAITING, Door
from daemon.api.parameters import Role
from daemon.api.server import Server
from daemon.api.tokens import Tokens
from vcan_tests.daemon.api.raw_client import RawClient, until

pytestmark = pytest.mark.real_time

WATCHES, DRIVES = "w" * 32, "d" * 32
TOKENS = Tokens({WATCHES: Role.WATCH, DRIVES: Role.DRIVE})


@pytest_asyncio.fixture
async def door(server: Server, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Door]:
    monkeypatch.setattr(door_module, "WRONG_S", 0.0)
    door = Door(server, LOOPBACK, 0, TOKENS)
    await door.start()
    yield door
    door.close()


Visit = Callable[[Door], Awaitable[RawClient]]


@pytest_asyncio.fixture
async def visit() -> AsyncIterator[Visit]:
    """Opens connections to the port, and closes them at the end."""
    opened: list[RawClient] = []

    async def visit(door: Door) -> RawClient:
        opened.append(RawClient(*await asyncio.open_connection(LOOPBACK, door.port, limit=1 << 22)))
        return opened[-1]

    yield visit
    for visitor in opened:
        await visitor.close()


def address(door: Door) -> str:
    return f"tcp:{LOOPBACK}:{door.port}"


async def test_who_shows_a_token_has_its_role_and_no_other(door: Door, visit: Visit) -> None:
    visitor = await visit(door)
    assert (await visitor.ask("login", token=WATCHES))["result"] == {"role": "watch"}
    status = (await visitor.ask("status"))["result"]
    assert (status["role"], status["role_remedy"]) == ("watch", "log in with a token for drive")
    error = (await visitor.ask("steer", pair="front", angle_deg=1.0))["error"]
    assert error["message"] == f"steer needs the role drive; a token for watch at {LOOPBACK} has not got it"


async def test_who_drives_over_tcp_holds_a_lease_in_the_name_of_its_token(door: Door, visit: Visit) -> None:
    visitor = await visit(door)
    visitor.send(protocol.make_request(1, "login", {"token": DRIVES}) + protocol.make_request(2, "lease.take", {}))
    assert [(await visitor.answer())["id"] for _ in range(2)] == [1, 2]
    assert door.server.backend.clients == [  # type: ignore[attr-defined]  # the fake backend's
        {"client": f"a token for drive at {LOOPBACK}", "user": f"a token for drive at {LOOPBACK}"}
    ]


async def test_a_wrong_token_is_told_and_hung_up_on(door: Door, visit: Visit, caplog: pytest.LogCaptureFixture) -> None:
    visitor = await visit(door)
    assert (await visitor.ask("login", token="x" * 32))["error"]["data"]["type"] == "PermissionRefused"
    assert await visitor.ended()
    assert [record.message for record in caplog.records] == [f"somebody at {LOOPBACK} showed a wrong token"]


@pytest.mark.parametrize("method", ["status", "stop", "estop", "hello"])
async def test_without_a_token_nothing_is_carried_out(door: Door, visit: Visit, method: str) -> None:
    visitor = await visit(door)
    assert "login" in (await visitor.ask(method))["error"]["message"]
    assert await visitor.ended()
    assert door.server.counters.requests == 0


async def test_a_line_without_an_end_is_hung_up_on(door: Door, visit: Visit) -> None:
    visitor = await visit(door)
    visitor.send(b"x" * (MAX_LINE_BYTES + 1))
    assert await visitor.ended()


async def test_who_says_nothing_is_hung_up_on(door: Door, visit: Visit, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(door_module, "PATIENCE_S", 0.05)
    assert await (await visit(door)).ended()
    assert door.waiting == set()


async def test_strangers_who_wait_take_nobodys_place(door: Door, visit: Visit) -> None:
    for _ in range(MAX_WAITING):
        await visit(door)
    await until(lambda: len(door.waiting) == MAX_WAITING)
    assert await (await visit(door)).ended()
    assert door.server.connections == set()


async def test_a_port_that_is_taken_is_named(door: Door) -> None:
    with pytest.raises(ConfigError, match=f"port {door.port}") as caught:
        await Door(door.server, LOOPBACK, door.port, TOKENS).start()
    assert "--tcp" in str(caught.value.remedy)


async def test_the_clients_log_in_with_the_token_of_the_environment(
    door: Door, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "token").write_text(f"{WATCHES}\n")
    monkeypatch.setenv("CANHELM_TOKEN_FILE", str(tmp_path / "token"))

    def role() -> str:
        with Client(address(door)) as client:
            return str(client.call("hello")["role"])

    assert await asyncio.to_thread(role) == "watch"
    monkeypatch.setenv("CANHELM_TOKEN", DRIVES)
    client = await asyncio.to_thread(protocol.open_socket, address(door))
    client.close()


async def test_the_asyncio_client_speaks_over_tcp_too(door: Door, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CANHELM_TOKEN", DRIVES)
    connection = await asyncio.to_thread(protocol.open_socket, address(door))
    monkeypatch.setattr(protocol, "open_socket", lambda path: connection)
    async with aio.Client(address(door)) as client:
        assert (await client.call("hello"))["role"] == "drive"


async def test_a_client_with_a_wrong_token_learns_so(door: Door, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CANHELM_TOKEN", "x" * 32)
    with pytest.raises(PermissionRefused, match="the token is wrong"):
        await asyncio.to_thread(protocol.open_socket, address(door))


@pytest.mark.parametrize("wrong", ["tcp:", "tcp:host", "tcp:host:port", "tcp:host:0", "tcp::4310", "tcp:host:70000"])
def test_an_address_that_is_none_is_refused(wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CANHELM_TOKEN", DRIVES)
    with pytest.raises(UsageError, match="is no address"):
        protocol.open_socket(wrong)


def test_without_any_token_a_client_is_told_where_to_put_one(monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("CANHELM_TOKEN", "CANHELM_TOKEN_FILE"):
        monkeypatch.delenv(variable, raising=False)
    with pytest.raises(PermissionRefused, match="wants a token") as caught:
        protocol.open_socket("tcp:127.0.0.1:1")
    assert "CANHELM_TOKEN_FILE" in str(caught.value.remedy)


@pytest.fixture
def token_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A file that CANHELM_TOKEN_FILE names, and that is not there yet."""
    monkeypatch.delenv("CANHELM_TOKEN", raising=False)
    monkeypatch.setenv("CANHELM_TOKEN_FILE", str(tmp_path / "token"))
    return tmp_path / "token"


@pytest.mark.parametrize("text", [DRIVES, f"drive {DRIVES}\n", f"\n drive\t{DRIVES}\nwatch {WATCHES}\n"])
def test_a_clients_file_has_a_token_or_lines_of_the_daemons_file(text: str, token_file: Path) -> None:
    token_file.write_text(text)
    assert own_token() == DRIVES


def test_a_file_without_a_token_is_named(token_file: Path) -> None:
    token_file.write_text("\n")
    with pytest.raises(PermissionRefused, match=f"{token_file} has no token"):
        own_token()


def test_a_file_of_a_token_that_is_missing_is_one_sentence(token_file: Path) -> None:
    with pytest.raises(PermissionRefused) as caught:
        own_token()
    assert caught.value.message == f"the token in {token_file} cannot be read: No such file or directory"
    assert "name its file in CANHELM_TOKEN_FILE" in str(caught.value.remedy)


@pytest.mark.parametrize("answer", [b"", b"HTTP/1.0 400 Bad Request\r\n\r\n"])
def test_what_is_no_daemon_is_told(answer: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CANHELM_TOKEN", DRIVES)
    with socket.create_server((LOOPBACK, 0)) as other:

        def serve() -> None:
            connection, _ = other.accept()
            with connection:
                connection.recv(65_536)
                connection.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(DaemonNotRunning):
            protocol.open_socket(f"tcp:{LOOPBACK}:{other.getsockname()[1]}")
        thread.join()
