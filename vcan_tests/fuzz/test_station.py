"""Any message of a page that may only watch: no line of it that reaches a daemon asks for more."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from canhelm import protocol
from canhelm.errors import CanhelmError
from daemon.api.parameters import Role, validate
from daemon.station.limits import lowered, refusal
from daemon.station.methods import METHODS
from daemon.station.requests import make_line, parse_request
from vcan_tests.fuzz.mutation import damaged, damaged_text
from vcan_tests.fuzz.target import Target, few

LIMIT = Role.WATCH
USUAL = (
    b'{"jsonrpc":"2.0","id":1,"method":"status","params":{}}',
    b'{"jsonrpc":"2.0","id":2,"method":"subscribe","params":{"rate_hz":20}}',
    b'{"jsonrpc":"2.0","id":"x","method":"stop"}',
    b'{"jsonrpc":"2.0","id":3,"method":"drive.set","params":{"speed_m_s":0.3}}',
    b'{"jsonrpc":"2.0","id":4,"method":"status","params":\n{"jsonrpc":"2.0","method":"reset"}\n}',
    b'{"jsonrpc":"2.0","id":5,"method":"status","method":"reset"}',
    b'{"jsonrpc":"2.0","id":6,"method":"sdo.write","params":{"node":1,"object":"0x6081","value":1e400}}',
    b'{"jsonrpc":"2.0","id":7,"method":"station.path.read","params":{"name":"../x"}}',
    b'{"jsonrpc":"2.0","id":8,"method":"station.objects","params":{"device":"epos24_5"}}',
    b'{"jsonrpc":"2.0","id":null,"result":{"role":"configure","nodes":[]}}',
)


def attempt(content: bytes) -> None:
    assert lowered(content, Role.CONFIGURE) == content
    lowered(content, LIMIT)
    try:
        request = parse_request(content.decode(errors="replace"))
    except CanhelmError:
        return
    if refusal(request["method"], LIMIT) is None:
        carry_out(request)


def carry_out(request: dict[str, Any]) -> None:
    try:
        if request["method"] in METHODS:
            validate(METHODS[request["method"]][0], request.get("params", {}))
            return
        line = make_line(request)
    except CanhelmError:
        return
    assert line.count(b"\n") == 1
    heard = protocol.parse_message(line)
    assert isinstance(heard, dict)
    assert refusal(heard["method"], LIMIT) is None


STATION = Target("station", damaged_text(USUAL) | damaged(USUAL) | st.binary(max_size=200), attempt)


@few(300)
@given(STATION.inputs)
def test_no_message_reaches_beyond_its_role(content: bytes) -> None:
    STATION.check(content)
