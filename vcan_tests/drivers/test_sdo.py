"""SDO client: codec, and transfers against a hand-written server."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import Aborted, DeviceFault, NodeAbsent, Timeout, UsageError
from drivers.canopen.counters import CanopenCounters
from drivers.canopen.sdo import SdoClient
from drivers.canopen.sdo_frames import (
    AnswerKind,
    make_abort,
    make_download,
    make_download_segment,
    make_upload,
    make_upload_segment,
    parse_answer,
)
from drivers.epos.objects import OBJECTS

STATUSWORD = OBJECTS["statusword"]
DEVICE_NAME = OBJECTS["device_name"]

indices = st.integers(0, 0xFFFF)
subs = st.integers(0, 0xFF)


def answer(text: str) -> bytes:
    return bytes.fromhex(text)


class Server:
    """Answers requests of one client as a test tells it; without instructions it stays silent."""

    def __init__(self) -> None:
        self.requests: list[bytes] = []
        self.script: list[bytes | Callable[[bytes], bytes]] = []
        self.counters = CanopenCounters()
        self.client = SdoClient(3, "front_left", self.send, 0.25, self.counters)

    def send(self, can_id: int, data: bytes, deadline_s: float) -> None:
        assert can_id == 0x603
        self.requests.append(data)
        if self.script:
            reply = self.script.pop(0)
            self.say(reply if isinstance(reply, bytes) else reply(data))

    def say(self, data: bytes) -> None:
        asyncio.get_running_loop().call_soon(self.client.receive, 0x583, data, 0.0)


# --- codec -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("frame", "expected"),
    [
        (make_upload(0x6041, 0), "40 41 60 00 00 00 00 00"),
        (make_download(0x6040, 0, b"\x0f\x00"), "2B 40 60 00 0F 00 00 00"),
        (make_download(0x6060, 0, b"\x03"), "2F 60 60 00 03 00 00 00"),
        (make_download(0x607A, 0, (100000).to_bytes(4, "little")), "23 7A 60 00 A0 86 01 00"),
        (make_download(0x1008, 0, b"ABCDEFG"), "21 08 10 00 07 00 00 00"),
        (make_upload_segment(1), "70 00 00 00 00 00 00 00"),
        (make_download_segment(b"XYZ", 1, True), "19 58 59 5A 00 00 00 00"),
        (make_abort(0x1008, 0, 0x05040000), "80 08 10 00 00 00 04 05"),
    ],
)
def test_requests_are_the_bytes_of_cia_301(frame: bytes, expected: str) -> None:
    assert frame == bytes.fromhex(expected)


@given(st.binary(max_size=12))
def test_whatever_comes_as_an_answer_is_parsed_or_refused(data: bytes) -> None:
    parsed = parse_answer(data)
    assert parsed is None or len(data) == 8


@given(indices, subs, st.binary(min_size=1, max_size=4))
def test_an_expedited_answer_gives_address_and_value(index: int, sub: int, value: bytes) -> None:
    command = 0x43 | (4 - len(value)) << 2
    parsed = parse_answer(bytes((command, index & 0xFF, index >> 8, sub)) + value.ljust(4, b"\0"))
    assert parsed is not None
    assert (parsed.address, parsed.data, parsed.last) == ((index, sub), value, True)


@given(st.binary(max_size=7), st.integers(0, 1), st.booleans())
def test_a_segment_gives_its_bytes_back(chunk: bytes, toggle: int, last: bool) -> None:
    # upload and download segments share their layout
    parsed = parse_answer(make_download_segment(chunk, toggle, last))
    assert parsed is not None
    assert (parsed.kind, parsed.data, parsed.toggle, parsed.last) == (AnswerKind.UPLOAD_SEGMENT, chunk, toggle, last)


# --- client ----------------------------------------------------------------------------------------------------------


async def test_an_expedited_read_gives_the_value_in_its_type() -> None:
    server = Server()
    server.script = [answer("4B 41 60 00 37 03 00 00")]
    assert await server.client.read(STATUSWORD) == 0x0337


async def test_an_answer_without_a_length_is_cut_to_the_type() -> None:
    server = Server()
    server.script = [answer("42 41 60 00 37 03 AA BB")]
    assert await server.client.read(STATUSWORD) == 0x0337


async def test_a_segmented_read_joins_the_segments() -> None:
    server = Server()
    server.script = [
        answer("41 08 10 00 0A 00 00 00"),
        answer("00 45 50 4F 53 20 32 34"),
        answer("19 2F 35 21 00 00 00 00"),
    ]
    assert await server.client.read(DEVICE_NAME) == "EPOS 24/5!"


async def test_a_segmented_write_sends_all_segments() -> None:
    server = Server()
    server.script = [
        answer("60 0C 20 01 00 00 00 00"),
        answer("20 00 00 00 00 00 00 00"),
        answer("30 00 00 00 00 00 00 00"),
    ]
    await server.client.write((0x200C, 1), b"12345678")
    assert server.requests[1:] == [answer("00 31 32 33 34 35 36 37"), answer("1D 38 00 00 00 00 00 00")]


async def test_an_abort_says_node_object_words_and_cure() -> None:
    server = Server()
    server.script = [answer("80 41 60 00 02 00 01 06")]
    with pytest.raises(Aborted, match=r"node 3 \(front_left\).*0x6041 \(statusword\).*read-only") as caught:
        await server.client.write(STATUSWORD, 1)
    assert caught.value.remedy
    assert (caught.value.node, caught.value.object, caught.value.value) == (3, "0x6041", 0x06010002)


async def test_an_unknown_abort_code_is_given_as_a_number() -> None:
    server = Server()
    server.script = [answer("80 41 60 00 78 56 34 12")]
    with pytest.raises(Aborted, match="0x12345678"):
        await server.client.read(STATUSWORD)


async def test_a_silent_node_is_absent_after_the_time_out() -> None:
    server = Server()
    with pytest.raises(NodeAbsent, match=r"node 3 .* did not answer within 250 ms"):
        await server.client.read(STATUSWORD)
    assert asyncio.get_running_loop().time() == pytest.approx(0.25)


async def test_a_late_answer_is_dropped_and_counted() -> None:
    server = Server()
    with pytest.raises(NodeAbsent):
        await server.client.read(STATUSWORD)
    server.say(answer("4B 41 60 00 37 03 00 00"))
    await asyncio.sleep(0)
    assert server.counters.late_answers == 1


async def test_an_answer_about_another_object_is_dropped() -> None:
    server = Server()
    server.script = [answer("4B 40 60 00 0F 00 00 00")]
    reading = asyncio.ensure_future(server.client.read(STATUSWORD))
    await asyncio.sleep(0.1)
    server.say(answer("4B 41 60 00 37 03 00 00"))
    assert await reading == 0x0337
    assert server.counters.late_answers == 1


async def test_a_segment_with_the_wrong_toggle_is_dropped() -> None:
    server = Server()
    server.script = [answer("41 08 10 00 04 00 00 00"), answer("17 45 50 4F 53 00 00 00")]
    reading = asyncio.ensure_future(server.client.read(DEVICE_NAME))
    await asyncio.sleep(0.1)
    server.say(answer("07 45 50 4F 53 00 00 00"))
    assert await reading == "EPOS"


async def test_answers_that_stop_midway_time_out_and_the_transfer_is_aborted() -> None:
    server = Server()
    server.script = [answer("41 08 10 00 0A 00 00 00")]
    with pytest.raises(Timeout, match="middle of a transfer"):
        await server.client.read(DEVICE_NAME)
    assert server.requests[-1] == make_abort(0x1008, 0, 0x05040000)


async def test_a_request_without_any_answer_is_aborted_since_the_server_may_have_understood_another_one() -> None:
    server = Server()
    with pytest.raises(NodeAbsent):
        await server.client.read(STATUSWORD)
    assert server.requests == [make_upload(0x6041, 0), make_abort(0x6041, 0, 0x05040000)]


async def test_two_calls_at_once_wait_for_each_other() -> None:
    server = Server()

    def reply(request: bytes) -> bytes:
        return b"\x4b" + request[1:4] + request[1:3] + b"\0\0"

    server.script = [reply, reply]
    values = await asyncio.gather(server.client.read(STATUSWORD), server.client.read(OBJECTS["controlword"]))
    assert list(values) == [0x6041, 0x6040]


async def test_a_cancelled_call_leaves_the_queue_usable() -> None:
    server = Server()
    reading = asyncio.ensure_future(server.client.read(STATUSWORD))
    await asyncio.sleep(0.01)
    reading.cancel()
    server.script = [answer("4B 41 60 00 37 03 00 00")]
    assert await server.client.read(STATUSWORD) == 0x0337


async def test_garbage_on_the_answer_id_is_counted_and_the_call_goes_on() -> None:
    server = Server()
    server.script = [b"\x4b\x41"]
    reading = asyncio.ensure_future(server.client.read(STATUSWORD))
    await asyncio.sleep(0.1)
    server.say(answer("4B 41 60 00 37 03 00 00"))
    assert await reading == 0x0337
    assert server.counters.malformed == 1


async def test_a_value_of_the_wrong_length_is_a_device_fault() -> None:
    server = Server()
    server.script = [answer("43 41 60 00 37 03 00 00")]
    with pytest.raises(DeviceFault, match=r"answered 4 bytes .* expected 2"):
        await server.client.read(STATUSWORD)


@pytest.mark.parametrize("value", [-1, 70000, "text"])
async def test_a_value_that_does_not_fit_is_not_sent(value: int | str) -> None:
    server = Server()
    with pytest.raises(UsageError, match="controlword"):
        await server.client.write(OBJECTS["controlword"], value)
    assert server.requests == []


async def test_a_node_that_restarts_ends_the_transfer_at_once() -> None:
    server = Server()
    reading = asyncio.ensure_future(server.client.read(STATUSWORD))
    await asyncio.sleep(0.01)
    server.client.give_up("restarted")
    with pytest.raises(NodeAbsent, match="restarted"):
        await reading


async def test_an_endless_upload_is_stopped() -> None:
    server = Server()
    toggles = iter(range(100_000))
    server.script = [
        answer("41 1B 20 00 00 00 00 00"),
        *[lambda _: bytes((next(toggles) % 2 << 4,)) + b"7bytes."] * 9500,
    ]
    with pytest.raises(DeviceFault, match="more than 65536 bytes"):
        await server.client.read((0x201B, 0))


@given(st.lists(st.binary(max_size=10), max_size=5))
def test_frames_that_nobody_asked_for_are_all_counted(frames: list[bytes]) -> None:
    counters = CanopenCounters()
    client = SdoClient(3, "", lambda *_: None, 0.25, counters)
    for data in frames:
        client.receive(0x583, data, 0.0)
    assert counters.malformed + counters.late_answers == len(frames)
