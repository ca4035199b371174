"""Any bytes on an RS-232 line to an EPOS, on either side, in both framings: each end goes on and understands again."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from functools import partial

from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import CanhelmError
from daemon.runtime.clock import run_virtual
from drivers.epos.serial_answers import (
    make_can_frame_answer,
    make_done_answer,
    make_read_answer,
    make_segment_answer,
)
from drivers.epos.serial_frames import (
    make_initiate_segmented_read,
    make_initiate_segmented_write,
    make_read_object,
    make_request_can_frame,
    make_segment_read,
    make_segment_write,
    make_send_can_frame,
    make_send_nmt,
    make_write_object,
)
from drivers.epos.serial_frames_v2 import restuffed
from drivers.epos.serial_handshake import Exchange, Handshake
from drivers.epos.serial_handshake_v2 import StuffedExchange
from drivers.epos.serial_line import SerialLine
from vcan_tests.drivers import serial_bench
from vcan_tests.drivers.serial_bench import BAUD, BYTE_S
from vcan_tests.drivers.simulated_serial_bench import SerialBench
from vcan_tests.fuzz.mutation import damaged
from vcan_tests.fuzz.pieces import make_pieces, parse_pieces
from vcan_tests.fuzz.target import Target, few

PAUSE_S = 0.005
SILENCE_S = 0.6
"""What a drive takes for the end of an exchange."""
RECOVERY_S = 10.0
MOST_PIECES = 16
STATUSWORD = make_read_object(0, 0x6041, 0)
REQUESTS = (
    STATUSWORD,
    make_read_object(3, 0x6064, 0),
    make_read_object(99, 0x1000, 0),
    make_write_object(0, 0x6040, 0, b"\x06\x00"),
    make_write_object(4, 0x6083, 0, b"\xe8\x03\x00\x00"),
    make_initiate_segmented_read(0, 0x1008, 0),
    make_segment_read(0),
    make_segment_read(1),
    make_initiate_segmented_write(0, 0x2071, 1, 4),
    make_segment_write(b"abcd", 0),
    make_send_nmt(0, 1),
    make_send_nmt(2, 128),
    make_send_can_frame(0x80, b""),
    make_send_can_frame(0x201, bytes(8)),
    make_request_can_frame(0x703, 1),
)
ANSWERS = (
    make_read_answer(b"\x37\x03"),
    make_read_answer(b"", 0x0602_0000),
    make_done_answer(),
    make_done_answer(0x0504_0000),
    make_segment_answer(b"EPOS", 0, more=True),
    make_can_frame_answer(bytes(8)),
)


def said_by_host(frame: bytes) -> list[bytes]:
    """One exchange of the first generation, as the host says its part."""
    return [frame[:1], frame[1:], b"O", b"O"]


def said_by_drive(frame: bytes) -> list[bytes]:
    return [b"O", b"O" + frame[:1], frame[1:], b""]


def conversations(frames: tuple[bytes, ...], split: Callable[[bytes], list[bytes]]) -> st.SearchStrategy[bytes]:
    """Pieces of conversations: right ones, such with damaged frames or missing pieces, and noise."""
    usual = (st.sampled_from(frames) | damaged(frames)).filter(len).map(split)
    noise = st.binary(max_size=40) | st.sampled_from((b"", b"O", b"F", b"\0", b"\x90\x02", b"\x90"))
    exchanges = st.lists(usual | noise.map(lambda piece: [piece]), min_size=1, max_size=MOST_PIECES // 2)
    return exchanges.map(lambda found: make_pieces([piece for pieces in found for piece in pieces][:MOST_PIECES]))


# -- the drive hears anything -----------------------------------------------------------------------------------------


def attempt_drive(content: bytes) -> None:
    run_virtual(disturbed_drive(parse_pieces(content)))


async def disturbed_drive(pieces: list[bytes]) -> None:
    bench = await SerialBench.booted()
    for piece in pieces:
        bench.write(piece)
        await asyncio.sleep(len(piece) * BYTE_S + PAUSE_S if piece else SILENCE_S)
    await asyncio.sleep(2 * SILENCE_S)
    bench.heard.clear()
    assert len((await bench.ask(STATUSWORD)).data) == 4
    await bench.network.close()


DRIVE = Target("rs232-drive", conversations(REQUESTS, said_by_host), attempt_drive)


@few(30)
@given(DRIVE.inputs)
def test_a_drive_that_heard_anything_answers_the_next_request(content: bytes) -> None:
    DRIVE.check(content)


# -- the host hears anything ------------------------------------------------------------------------------------------


class Mumbler:
    """Says a piece to each thing that the host says; when it has said all, ``sane`` answers in its place."""

    def __init__(self, pieces: list[bytes], sane: Answer) -> None:
        self.host: Callable[[bytes, float], None] | None = None
        self._pieces = pieces
        self._sane = sane

    def write(self, data: bytes) -> None:
        if self._pieces:
            asyncio.get_running_loop().call_later(PAUSE_S, self.speak, self._pieces.pop(0))
        else:
            self._sane(self, data)

    def speak(self, data: bytes) -> None:
        if self.host is not None and data:
            self.host(data, asyncio.get_running_loop().time())


Answer = Callable[[Mumbler, bytes], None]


def sane_drive() -> Answer:
    """A drive with the handshake of the first generation."""
    drive = serial_bench.Drive(BAUD)

    def write(mumbler: Mumbler, data: bytes) -> None:
        drive.host = mumbler.host
        drive.write(data)

    return write


def sane_later_drive() -> Answer:
    """A drive with the framing of later ones, which answers everything alike."""

    def write(mumbler: Mumbler, _: bytes) -> None:
        asyncio.get_running_loop().call_later(PAUSE_S, mumbler.speak, restuffed(ANSWERS[0]))

    return write


def attempt_host(exchange: Callable[[int], Exchange], sane: Callable[[], Answer], content: bytes) -> None:
    run_virtual(disturbed_host(exchange(BAUD), sane, parse_pieces(content)))


async def disturbed_host(exchange: Exchange, sane: Callable[[], Answer], pieces: list[bytes]) -> None:
    """Every request has an end, and once the drive is sane one is answered."""
    line = SerialLine(Mumbler(pieces, sane()), BAUD, exchange=exchange)
    async with asyncio.timeout(len(REQUESTS) * RECOVERY_S):
        await asyncio.gather(*(line.request(frame) for frame in REQUESTS), return_exceptions=True)
        while pieces:
            with contextlib.suppress(CanhelmError):
                await line.request(STATUSWORD)
    async with asyncio.timeout(RECOVERY_S):
        assert len((await line.request(STATUSWORD)).data) == 4


HOST = Target("rs232-host", conversations(ANSWERS, said_by_drive), partial(attempt_host, Handshake, sane_drive))
LATER_HOST = Target(
    "rs232-later",
    conversations(tuple(map(restuffed, ANSWERS)), lambda frame: [frame]),
    partial(attempt_host, StuffedExchange, sane_later_drive),
)


@few(30)
@given(HOST.inputs)
def test_a_host_that_heard_anything_ends_its_requests_and_asks_again(content: bytes) -> None:
    HOST.check(content)


@few(30)
@given(LATER_HOST.inputs)
def test_so_does_a_host_in_the_framing_of_later_drives(content: bytes) -> None:
    LATER_HOST.check(content)
