"""SDO block transfer: frames, the client against the simulated server, against a scripted one, and over a bad wire."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable
from functools import partial

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from canhelm.errors import Aborted, CanhelmError, DeviceFault, NodeAbsent, Timeout
from daemon.runtime.clock import run_virtual
from drivers.canopen.counters import CanopenCounters
from drivers.canopen.objects import Access, DataType, ObjectDef, ObjectTable
from drivers.canopen.sdo import SdoClient
from drivers.canopen.sdo_block import (
    BLOCK_FROM_BYTES,
    block_crc,
    make_block_answer,
    make_block_download,
    make_block_upload,
    make_download_end,
    make_segment,
    make_upload_end,
    make_upload_start,
    parse_block_answer,
    parse_download_end,
    parse_download_initiated,
    parse_segment,
    parse_upload_end,
    parse_upload_initiated,
)
from drivers.canopen.sdo_frames import make_abort
from drivers.simulated.dictionary import SimulatedDictionary
from drivers.simulated.sdo_block_server import BlockServer
from drivers.simulated.sdo_server import SdoServer

BLOB = (0x2004, 0)
TABLE = ObjectTable(
    (
        ObjectDef(0x2004, 0, "blob", DataType.DOMAIN, Access.RW, ""),
        ObjectDef(0x2005, 0, "fixed", DataType.DOMAIN, Access.RO, ""),
    )
)
LONG = bytes(range(256)) * 4
TIMEOUT_S = 0.1

Wire = Callable[[bytes], list[bytes]]


def perfect(data: bytes) -> list[bytes]:
    return [data]


class Link:
    """A client and a simulated server, joined by wires that may lose and double frames."""

    def __init__(self, *, blocks: bool = True, there: Wire = perfect, back: Wire = perfect) -> None:
        self.dictionary = SimulatedDictionary(TABLE, 3, {})
        self.server = SdoServer(self.dictionary, BlockServer(self.dictionary, self._answer) if blocks else None)
        self.counters = CanopenCounters()
        self.client = SdoClient(3, "front_left", self._send, TIMEOUT_S, self.counters, 0.0003)
        self.requests: list[bytes] = []
        self._there = there
        self._back = back

    def _send(self, can_id: int, data: bytes, deadline_s: float) -> None:
        self.requests.append(data)
        for copy in self._there(data):
            answer = self.server.answer(copy)
            if answer is not None:
                self._answer(answer)

    def _answer(self, data: bytes) -> None:
        for copy in self._back(data):
            asyncio.get_running_loop().call_soon(self.client.receive, 0x583, copy, 0.0)

    def blocks_used(self) -> bool:
        return any(data[0] in (0xA4, 0xC6) for data in self.requests)


class Script:
    """A server that answers as a test tells it, one answer (or several) a request."""

    def __init__(self, *answers: str) -> None:
        self.requests: list[bytes] = []
        self.answers = [bytes.fromhex(text) for text in answers]
        self.client = SdoClient(3, "", self._send, TIMEOUT_S, CanopenCounters(), 0.0)

    def _send(self, can_id: int, data: bytes, deadline_s: float) -> None:
        self.requests.append(data)
        if self.answers and data[0] != 0x80:
            answer = self.answers.pop(0)
            for start in range(0, len(answer), 8):
                asyncio.get_running_loop().call_soon(self.client.receive, 0x583, answer[start : start + 8], 0.0)


# --- frames ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("frame", "expected"),
    [
        (make_block_download(0x1F50, 1, 300), "C6 50 1F 01 2C 01 00 00"),
        (make_block_upload(0x1008, 0, 127), "A4 08 10 00 7F 00 00 00"),
        (make_upload_start(), "A3 00 00 00 00 00 00 00"),
        (make_segment(1, b"ABCDEFG", False), "01 41 42 43 44 45 46 47"),
        (make_segment(5, b"XY", True), "85 58 59 00 00 00 00 00"),
        (make_block_answer(5, 32), "A2 05 20 00 00 00 00 00"),
        (make_download_end(300, 0x1234), "C5 34 12 00 00 00 00 00"),
        (make_download_end(301, 0x1234), "C1 34 12 00 00 00 00 00"),
        (make_upload_end(), "A1 00 00 00 00 00 00 00"),
    ],
)
def test_frames_are_the_bytes_of_cia_301(frame: bytes, expected: str) -> None:
    assert frame == bytes.fromhex(expected)


def test_the_checksum_is_the_one_of_cia_301() -> None:
    assert block_crc(b"123456789") == 0x31C3


@given(st.integers(1, 127), st.binary(min_size=7, max_size=7), st.booleans())
def test_a_segment_reads_as_it_is_written(number: int, chunk: bytes, last: bool) -> None:
    assert parse_segment(make_segment(number, chunk, last)) == (number, last, chunk)


@given(st.binary(max_size=10))
def test_whatever_comes_is_parsed_or_refused(data: bytes) -> None:
    for parse in (
        partial(parse_download_initiated, BLOB),
        partial(parse_upload_initiated, BLOB),
        parse_segment,
        parse_block_answer,
        parse_upload_end,
        parse_download_end,
    ):
        assert parse(data) is None or len(data) == 8


# --- against the simulated server ------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=60)
@given(st.binary(max_size=3000))
def test_what_is_written_is_read_back_whatever_its_length(data: bytes) -> None:
    async def exchange() -> bytes:
        link = Link()
        await link.client.write_raw(BLOB, data)
        read = await link.client.read_raw(BLOB)
        assert link.blocks_used() == (len(data) >= BLOCK_FROM_BYTES)
        assert link.counters == CanopenCounters()
        return read

    assert run_virtual(exchange()) == data


async def test_a_server_without_block_transfer_is_asked_once_and_served_in_segments() -> None:
    link = Link(blocks=False)
    await link.client.write_raw(BLOB, LONG)
    assert await link.client.read_raw(BLOB) == LONG
    assert [data[0] for data in link.requests if data[0] in (0xA4, 0xC6)] == [0xC6]


async def test_a_read_falls_back_on_segments_too() -> None:
    link = Link(blocks=False)
    link.dictionary.values[BLOB] = LONG
    assert await link.client.read_raw(BLOB) == LONG
    assert not link.client.blocks


async def test_another_refusal_is_no_reason_to_try_segments() -> None:
    link = Link()
    with pytest.raises(Aborted) as refusal:
        await link.client.write_raw((0x2005, 0), LONG)
    assert refusal.value.value == 0x06010002
    assert link.client.blocks


async def test_a_refused_write_leaves_the_client_usable() -> None:
    link = Link()
    with pytest.raises(Aborted):
        await link.client.write_raw((0x2222, 0), LONG)
    await link.client.write_raw(BLOB, b"short")
    assert await link.client.read_raw(BLOB) == b"short"


def losing(doomed: int) -> Wire:
    """A wire that loses one frame, by its number from 1 on."""
    count = 0

    def wire(data: bytes) -> list[bytes]:
        nonlocal count
        count += 1
        return [] if count == doomed else [data]

    return wire


@pytest.mark.parametrize("doomed", range(2, 30))
async def test_a_segment_that_is_lost_on_the_way_back_is_sent_again(doomed: int) -> None:
    link = Link(back=losing(doomed + 1))
    link.dictionary.values[BLOB] = LONG
    assert await link.client.read_raw(BLOB) == LONG


@pytest.mark.parametrize("doomed", range(2, 30))
async def test_a_segment_that_is_lost_on_the_way_there_is_sent_again(doomed: int) -> None:
    link = Link(there=losing(doomed))
    await link.client.write_raw(BLOB, LONG)
    assert link.dictionary.values[BLOB] == LONG


@pytest.mark.parametrize("seed", range(40))
async def test_over_a_bad_wire_a_value_is_right_or_an_error(seed: int) -> None:
    source = random.Random(seed)

    def bad(data: bytes) -> list[bytes]:
        return [data] * source.choices((0, 1, 2), (1, 97, 2))[0]

    link = Link(there=bad, back=bad)
    link.dictionary.values[BLOB] = LONG
    for _ in range(4):
        try:
            read = await link.client.read_raw(BLOB)
        except CanhelmError:
            continue
        assert read == LONG


async def test_a_damaged_value_is_refused_by_the_server() -> None:
    def damage(data: bytes) -> list[bytes]:
        return [data[:7] + b"?"] if data[0] == 5 else [data]

    link = Link(there=damage)
    with pytest.raises(Aborted) as refusal:
        await link.client.write_raw(BLOB, LONG)
    assert refusal.value.value == 0x05040004
    assert link.dictionary.values[BLOB] == b""


async def test_a_damaged_value_is_refused_by_the_client() -> None:
    def damage(data: bytes) -> list[bytes]:
        return [data[:7] + b"?"] if data[0] == 5 else [data]

    link = Link(back=damage)
    link.dictionary.values[BLOB] = LONG
    with pytest.raises(DeviceFault, match="does not match its checksum"):
        await link.client.read_raw(BLOB)
    assert link.requests[-1] == make_abort(*BLOB, 0x05040004)


# --- against a scripted server ---------------------------------------------------------------------------------------

SIZED = "41 04 20 00 80 00 00 00"
ROUND = "C6 04 20 00 80 00 00 00"


async def test_a_server_may_answer_a_block_upload_in_segments() -> None:
    segments = ["00" + "55" * 7, "10" + "55" * 7] * 9 + ["0B" + "55" * 2 + "00" * 5]
    script = Script(SIZED, SIZED, *segments)
    assert await script.client.read_raw(BLOB) == b"\x55" * 128
    assert not script.client.blocks


async def test_a_server_that_acknowledges_more_than_was_sent_is_stopped() -> None:
    script = Script("A4 04 20 00 01 00 00 00", "A2 02 01 00 00 00 00 00")
    with pytest.raises(DeviceFault, match="acknowledges 2 of 1"):
        await script.client.write_raw(BLOB, LONG)
    assert script.requests[-1] == make_abort(*BLOB, 0x05040003)


async def test_a_server_that_wants_blocks_of_nothing_is_stopped() -> None:
    script = Script("A4 04 20 00 00 00 00 00")
    with pytest.raises(DeviceFault, match="blocks of 0 segments"):
        await script.client.write_raw(BLOB, LONG)


async def test_a_server_that_never_acknowledges_anything_is_given_up() -> None:
    script = Script("A4 04 20 00 01 00 00 00", *["A2 00 01 00 00 00 00 00"] * 3)
    with pytest.raises(DeviceFault, match="acknowledges 0 of 1"):
        await script.client.write_raw(BLOB, LONG)


async def test_a_length_other_than_announced_is_a_fault() -> None:
    script = Script(SIZED, ROUND, "81" + "00" * 7, "C1" + "00" * 7)
    with pytest.raises(DeviceFault, match="announced 128 bytes and sent 7"):
        await script.client.read_raw(BLOB)


async def test_silence_before_anything_means_an_absent_node() -> None:
    with pytest.raises(NodeAbsent, match="100 ms"):
        await Script().client.write_raw(BLOB, LONG)


async def test_silence_in_the_middle_times_out_and_the_transfer_is_aborted() -> None:
    script = Script("A4 04 20 00 20 00 00 00")
    with pytest.raises(Timeout, match="middle of a transfer"):
        await script.client.write_raw(BLOB, LONG)
    assert script.requests[-1] == make_abort(*BLOB, 0x05040000)


async def test_a_node_that_restarts_ends_the_transfer_at_once() -> None:
    script = Script("A4 04 20 00 20 00 00 00")
    writing = asyncio.ensure_future(script.client.write_raw(BLOB, LONG))
    await asyncio.sleep(0.01)
    script.client.give_up("restarted")
    with pytest.raises(NodeAbsent, match="restarted"):
        await writing


async def test_a_cancelled_transfer_is_aborted() -> None:
    script = Script("A4 04 20 00 20 00 00 00")
    writing = asyncio.ensure_future(script.client.write_raw(BLOB, LONG))
    await asyncio.sleep(0.01)
    writing.cancel()
    await asyncio.wait([writing])
    assert script.requests[-1] == make_abort(*BLOB, 0x05040000)


@given(st.lists(st.binary(min_size=8, max_size=8), max_size=30))
def test_whatever_comes_the_block_server_answers_or_keeps_silent(requests: list[bytes]) -> None:
    async def serve() -> None:
        link = Link()
        for request in requests:
            answer = link.server.answer(request)
            assert answer is None or len(answer) == 8
        link.server.reset()

    run_virtual(serve())
