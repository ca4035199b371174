"""What the socket answers to requests, and to what is none."""

from __future__ import annotations

import asyncio
import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from canhelm import protocol
from daemon.api.connection import MAX_MALFORMED
from daemon.api.server import Server
from vcan_tests.daemon.api.raw_client import RawClient
from vcan_tests.daemon.fake_backend import FakeBackend

pytestmark = pytest.mark.real_time


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


def test_a_line_of_the_protocol_is_one_json_object() -> None:
    assert json.loads(protocol.make_request(1, "stop", {})) == {
        "jsonrpc": "2.0",
        "id": 1,
        "method": "stop",
        "params": {},
    }
