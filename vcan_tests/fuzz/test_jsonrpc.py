"""Any requests to the daemon of a running robot: each is answered once, nothing fails inside, and it still stops."""

from __future__ import annotations

import asyncio
import socket
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from canhelm import protocol
from daemon.api.connection import Connection
from daemon.api.methods import METHODS
from daemon.api.parameters import Method, Param
from daemon.runtime.clock import run_virtual
from profiles.loader import load
from profiles.path_file import SHIPPED, load_path_file
from profiles.schema import Profile
from vcan_tests.docs.virtual_daemon import OpenServer, Wire
from vcan_tests.fuzz.mutation import VALUES, WORDS, as_json, damaged, damaged_value
from vcan_tests.fuzz.target import Target, few
from vcan_tests.robot import Robot, running_robot

ROBOTS = ("max2d", "ackermann", "semitrailer_lab", "turtle", "nxt")
PAUSE_S = 0.05
LEASE_S = 2.0
"""A lease that nobody renews has run out by then."""
ALL_OVER_S = 60.0
MOST_LINES = 20


# -- requests ---------------------------------------------------------------------------------------------------------


@cache
def names(robot: str) -> tuple[Any, ...]:
    """What a request may call the parts of a robot."""
    profile = profile_of(robot)
    parts = (*profile.drives, *profile.encoders, *profile.brakes, *profile.bricks)
    return (*parts, *range(1, 8), "all", "front", "controlword", "0x6041", "0x1018/1", "0x1010/1", "wheel_left")


@cache
def profile_of(robot: str) -> Profile:
    return load(robot).profile


@cache
def paths() -> tuple[Any, ...]:
    return tuple(msgspec.to_builtins(load_path_file(path).spec) for path in sorted(SHIPPED.glob("*.yaml")))


LISTS = (
    ["line 0.1", "bend 0.2 45", "bend 0.2 90 right back"],
    [{"bearing_deg": 10.0, "reflector": "a"}, {"bearing_deg": -70}, {"bearing_deg": 130}],
)


def valid(param: Param, robot: str) -> st.SearchStrategy[Any]:
    """Values that a parameter takes, or nearly."""
    if param.choices:
        return st.sampled_from(param.choices)
    low, high = param.minimum, param.maximum
    kinds: dict[str, st.SearchStrategy[Any]] = {
        "number": st.floats(-5.0 if low is None else low, 5.0 if high is None else high)
        | st.sampled_from([edge for edge in (low, high, 0, 1, -1, 1e15, -1e14, 1e-9) if edge is not None]),
        "integer": st.integers(-9 if low is None else int(low), 9 if high is None else int(high)),
        "boolean": st.booleans(),
        "string": st.sampled_from([word for word in names(robot) if isinstance(word, str)]),
        "node": st.sampled_from(names(robot)),
        "value": st.integers(0, 2**32) | st.sampled_from(names(robot)),
        "values": st.dictionaries(st.sampled_from(("0x6083", "0x2078/2", "0x607F")), st.integers(0, 2**31), max_size=3),
        "object": st.sampled_from(paths()),
        "list": st.sampled_from(LISTS),
    }
    return kinds[param.type]


@st.composite
def requests(draw: st.DrawFn, robot: str) -> bytes:
    """A request with parameters that make sense, or with one part of it that does not."""
    method = draw(st.sampled_from(tuple(METHODS.values())))
    given_ones = [param for param in method.params if param.required or draw(st.booleans())]
    params = {param.name: draw(_value(param, method, robot)) for param in given_ones}
    request = {"jsonrpc": "2.0", "id": draw(st.integers(0, 99)), "method": method.name, "params": params}
    if draw(st.integers(0, 9)) == 0:
        request = draw(damaged_value(request))
    line = as_json(request).replace(b"\n", b"")
    return draw(damaged([line])) if draw(st.integers(0, 9)) == 0 else line


def _value(param: Param, method: Method, robot: str) -> st.SearchStrategy[Any]:
    good = valid(param, robot)
    return st.one_of(good, good, good, good.flatmap(damaged_value), st.sampled_from(WORDS), VALUES)


@st.composite
def conversations(draw: st.DrawFn) -> bytes:
    """Lines of one client, the first of which names the robot whose daemon it is."""
    robot = draw(st.sampled_from(ROBOTS))
    lines = draw(st.lists(requests(robot), min_size=1, max_size=MOST_LINES))
    return b"\n".join((robot.encode(), *lines))


# -- the daemon -------------------------------------------------------------------------------------------------------


class Client(Wire):
    """A client that hears everything and says what it is told."""

    def __init__(self, server: OpenServer) -> None:
        self._ends = socket.socketpair()
        super().__init__(self._ends[0])
        self.heard = bytearray()
        self.connection = Connection(server)
        self.connection.connection_made(self)

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.heard += data

    def say(self, line: bytes) -> None:
        if not self.is_closing():
            self.connection.data_received(line + b"\n")

    def hang_up(self) -> None:
        self.connection.connection_lost(None)
        for end in self._ends:
            end.close()

    def answers(self) -> list[dict[str, Any]]:
        """What came, but for notifications. Every line is a message."""
        messages = [protocol.parse_message(line) for line in bytes(self.heard).splitlines()]
        assert all(isinstance(message, dict) for message in messages), messages
        return [message for message in messages if isinstance(message, dict) and "method" not in message]


def attempt(content: bytes) -> None:
    first, _, rest = content.partition(b"\n")
    robot = first.decode("latin-1")
    run_virtual(asked(robot if robot in ROBOTS else ROBOTS[0], rest.split(b"\n")))


async def asked(name: str, lines: list[bytes]) -> None:
    async with running_robot(profile_of(name), expect_errors=True) as robot:
        server = OpenServer(robot.app.service, Path("virtual"))
        client = Client(server)
        for line in lines:
            client.say(line)
            await asyncio.sleep(PAUSE_S)
        await asyncio.sleep(LEASE_S)
        await stops(robot, server)
        answers = Counter(repr(answer.get("id")) for answer in client.answers())
        assert client.is_closing() or answers == Counter(map(repr, expected(lines)))
        client.hang_up()


async def stops(robot: Robot, server: OpenServer) -> None:
    """Whatever was asked before: the emergency stop is carried out, and nothing is under way any more."""
    client = Client(server)
    client.say(protocol.make_request(1, "estop", {}))
    if server.tasks:
        _, left = await asyncio.wait(server.tasks, timeout=ALL_OVER_S)
        assert not left
    await asyncio.sleep(PAUSE_S)
    (answer,) = client.answers()
    assert answer["result"]["state"] == "estop", answer
    client.hang_up()


def expected(lines: list[bytes]) -> list[Any]:
    """Ids of the answers to some lines, as JSON-RPC 2.0 wants them: null for a line that is no request."""
    ids: list[Any] = []
    for line in filter(bytes.strip, lines):
        message = protocol.parse_message(line)
        if isinstance(message, str):
            ids.append(None)
            continue
        asked_by = message.get("id")
        fit = isinstance(asked_by, int | str | None) and not isinstance(asked_by, bool)
        sane = fit and isinstance(message.get("method"), str) and isinstance(message.get("params", {}), dict)
        if "id" in message or not sane:
            ids.append(asked_by if fit else None)
    return ids


JSONRPC = Target("jsonrpc", conversations(), attempt)


@few(8)
@given(JSONRPC.inputs)
def test_whatever_a_client_asks_is_answered_once_and_the_robot_still_stops(content: bytes) -> None:
    JSONRPC.check(content)
