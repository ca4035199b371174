"""Strangers who speak no HTTP, or no WebSocket: turned away, without a traceback, and nobody else notices."""

from __future__ import annotations

import asyncio
import contextlib
import random

import pytest

from vcan_tests.daemon.station.visitor import Visitor

pytestmark = pytest.mark.real_time

UPGRADE = (
    b"GET /ws/fake HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


def request(line: str, *headers: str) -> bytes:
    return "\r\n".join((line, "Host: localhost", *headers, "", "")).encode("latin-1")


GARBAGE = {
    "zeros": bytes(1000),
    "noise": random.Random(1).randbytes(5000),
    "no host": b"GET / HTTP/1.1\r\n\r\n",
    "two hosts": b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: robots.example\r\n\r\n",
    "no length": request("POST /login HTTP/1.1", "Content-Length: -3"),
    "half a body": request("POST /login HTTP/1.1", "Content-Length: 100") + b"abc",
    "endless line": request(f"GET /{'a' * 100_000} HTTP/1.1"),
    "no chunk": request("POST /login HTTP/1.1", "Transfer-Encoding: chunked") + b"zz\r\n",
    "no cookie": request("GET /session HTTP/1.1", "Cookie: \xff\xfe=;;;="),
    "no path": request("GET /ws/\xff HTTP/1.1"),
    "half an upgrade": request("GET /ws/fake HTTP/1.1", "Upgrade: websocket", "Connection: Upgrade"),
    "not masked": UPGRADE + b"\x81\x05hello",
    "no frame": UPGRADE + random.Random(2).randbytes(3000),
    "endless frame": UPGRADE + b"\x89\xff" + b"\xff" * 20,
    "no compression": UPGRADE + b"\xc1\x85\0\0\0\0abcde",
}


@pytest.mark.parametrize("garbage", GARBAGE)
async def test_a_stranger_is_turned_away_without_a_traceback(
    visitor: Visitor, caplog: pytest.LogCaptureFixture, garbage: str
) -> None:
    host, _, port = visitor.url.removeprefix("http://").partition(":")
    reader, writer = await asyncio.open_connection(host, int(port))
    writer.write(GARBAGE[garbage])
    writer.write_eof()
    with contextlib.suppress(ConnectionError):
        async with asyncio.timeout(10.0):
            await reader.read()
    writer.close()
    assert (await visitor.get("/session")).status == 200
    assert [record.getMessage() for record in caplog.records if record.exc_info] == []


async def test_many_who_hang_up_at_once_leave_no_traceback(visitor: Visitor, caplog: pytest.LogCaptureFixture) -> None:
    host, _, port = visitor.url.removeprefix("http://").partition(":")
    for _ in range(100):
        _, writer = await asyncio.open_connection(host, int(port))
        writer.write(UPGRADE)
        writer.transport.abort()
    assert (await visitor.get("/session")).status == 200
    assert [record.getMessage() for record in caplog.records if record.exc_info] == []
