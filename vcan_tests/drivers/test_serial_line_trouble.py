"""The host's serial line in trouble: what it says again and what it must not, noise, and who is to blame."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from random import Random

import pytest

from canhelm.errors import Timeout
from drivers.epos.serial_answers import Answer, make_done_answer, make_read_answer
from drivers.epos.serial_frames import (
    WriteObject,
    make_read_object,
    make_segment_read,
    make_send_nmt,
    make_write_object,
)
from drivers.epos.serial_line import SerialLine
from vcan_tests.drivers.serial_bench import BAUD, BYTE_S, CONTROLWORD, START_ALL, STATUSWORD, Drive, a_line, now

# What is said again, and what is not


class Scripted:
    """A drive that says the next line of a script to each thing that the host says."""

    def __init__(self, *script: bytes) -> None:
        self.heard: list[bytes] = []
        self.host: Callable[[bytes, float], None] | None = None
        self._script = list(script)
        self._free_s = 0.0

    def write(self, data: bytes) -> None:
        self.heard.append(data)
        self._free_s = max(self._free_s, now()) + len(data) * BYTE_S
        for place, byte in enumerate(self._script.pop(0) if self._script else b""):
            end_s = self._free_s + (place + 1) * BYTE_S
            asyncio.get_running_loop().call_at(end_s, self._speak, bytes((byte,)), end_s)

    def _speak(self, data: bytes, stamp_s: float) -> None:
        assert self.host is not None
        self.host(data, stamp_s)


VALUE = make_read_answer(b"\x37\x03")
DONE = make_done_answer()
BAD_CRC = VALUE[:-1] + bytes((VALUE[-1] ^ 1,))
READ_OK = (b"O", b"O\0", VALUE[1:], b"")
WRITE_OK = (b"O", b"O\0", DONE[1:], b"")


def rest_of(frame: bytes) -> list[bytes]:
    return [frame[:1], frame[1:], b"O", b"O"]


@pytest.mark.parametrize(
    "script",
    [
        (b"F", *READ_OK),
        (b"O", b"F", *READ_OK),
        (b"O", b"O\0", BAD_CRC[1:], b"", *READ_OK),
        (b"O", b"O\0", VALUE[1:5], b"", *READ_OK),
        (b"O", b"O\0", b"\x01" + VALUE[2:], b"", *READ_OK),
        (b"O", b"O\0", b"\xff" * 12, b"", *READ_OK),
        (b"", *READ_OK),
        (b"O", b"", *READ_OK),
        (b"O", b"O", *READ_OK),
        (b"N", *READ_OK),
    ],
    ids=[
        "not ready",
        "CRC refused",
        "answer with a wrong CRC",
        "half an answer",
        "answer of another length",
        "answer of no possible length",
        "lost ready acknowledge",
        "lost end acknowledge",
        "lost answer",
        "garbled ready acknowledge",
    ],
)
async def test_a_read_is_repeated_after(script: tuple[bytes, ...]) -> None:
    line = SerialLine(Scripted(*script), BAUD)
    assert (await line.request(STATUSWORD)).data == b"\x37\x03\0\0"
    assert line.retries == 1


@pytest.mark.parametrize(
    "script",
    [(b"F", *WRITE_OK), (b"O", b"F", *WRITE_OK), (b"", *WRITE_OK)],
    ids=["not ready", "CRC refused", "lost ready acknowledge"],
)
async def test_a_write_is_repeated_when_it_certainly_was_not_carried_out(script: tuple[bytes, ...]) -> None:
    drive = Scripted(*script)
    await SerialLine(drive, BAUD).request(CONTROLWORD)
    assert drive.heard[-4:] == rest_of(CONTROLWORD)


@pytest.mark.parametrize(
    "script",
    [
        (b"O", b"", *WRITE_OK),
        (b"O", b"O", *WRITE_OK),
        (b"O", b"O\0", DONE[1:-1], b"", *WRITE_OK),
        (b"O", b"F\0", *WRITE_OK),
    ],
    ids=["lost end acknowledge", "lost answer", "half an answer", "refusal that the drive contradicts"],
)
async def test_a_write_is_not_repeated_when_it_may_have_been_carried_out(script: tuple[bytes, ...]) -> None:
    drive = Scripted(*script)
    with pytest.raises(Timeout, match="may have been carried out"):
        await SerialLine(drive, BAUD).request(CONTROLWORD)
    assert drive.heard.count(CONTROLWORD[:1]) == 1


async def test_a_segment_is_not_asked_for_twice() -> None:
    drive = Scripted(b"O", b"O", *READ_OK)
    with pytest.raises(Timeout):
        await SerialLine(drive, BAUD).request(make_segment_read(0))
    assert len(drive.heard) == 2


@pytest.mark.parametrize(
    "script",
    [
        (b"OO", b"O\0", VALUE[1:], b""),
        (b"O", b"OO\0", VALUE[1:], b""),
        (b"O", b"O\0\0", VALUE[1:], b""),
        (b"O", b"O\0", VALUE[1:] + VALUE[-1:], b""),
        (b"\xaaO", b"\xaaO\xaa\0", VALUE[1:], b""),
    ],
    ids=["ready acknowledge", "end acknowledge", "first byte", "last byte", "noise between the bytes"],
)
async def test_a_doubled_byte_does_no_harm(script: tuple[bytes, ...]) -> None:
    line = SerialLine(Scripted(*script, *READ_OK), BAUD)
    for _ in range(2):
        assert (await line.request(STATUSWORD)).data == b"\x37\x03\0\0"
    assert line.retries == 0


async def test_an_acknowledge_that_comes_before_the_request_can_have_arrived_counts_for_nothing() -> None:
    drive = Scripted(b"OO", b"F", b"O", b"O")
    await SerialLine(drive, BAUD).request(START_ALL)
    assert drive.heard.count(START_ALL[1:]) == 2


async def test_a_drive_that_restarts_need_not_acknowledge() -> None:
    assert await SerialLine(Scripted(b"O"), BAUD).request(make_send_nmt(1, 129)) == Answer()


async def test_a_command_without_acknowledge_may_have_been_carried_out() -> None:
    with pytest.raises(Timeout, match="may have been carried out"):
        await SerialLine(Scripted(b"O"), BAUD).request(START_ALL)


async def test_a_silent_drive_is_told_with_what_to_check() -> None:
    with pytest.raises(Timeout, match="takes no requests") as caught:
        await a_line(Scripted()).request(STATUSWORD)
    assert "0x2002" in str(caught.value.remedy)


async def test_nothing_is_said_for_as_long_as_the_drive_may_wait_for_an_acknowledge() -> None:
    drive = Drive()
    line = a_line(drive)
    drive.mute = True
    waiting = asyncio.ensure_future(line.request(STATUSWORD))
    await asyncio.sleep(0.4)
    drive.mute = False
    assert (await waiting).data == drive.value(1, 0x6041, 0)
    assert now() > 0.7


@pytest.mark.parametrize("stuck", [1, 2, 7, 11])
async def test_a_drive_stuck_in_half_a_frame_is_freed(stuck: int) -> None:
    drive = Drive(frame_timeout_s=None)
    for byte in CONTROLWORD[:stuck]:
        drive.take(byte)
    drive.host = None
    await asyncio.sleep(0.1)
    line = a_line(drive)
    assert (await line.request(STATUSWORD, timeout_s=10.0)).data == drive.value(1, 0x6041, 0)


async def test_a_line_that_babbles_fails_its_requests_and_recovers() -> None:
    drive = Drive()
    line = a_line(drive)

    assert drive.host is not None
    host = drive.host

    async def babble() -> None:
        while now() < 20.0:
            host(b"\x55", now())
            await asyncio.sleep(0.001)

    babbling = asyncio.ensure_future(babble())
    drive.mute = True
    with pytest.raises(Timeout):
        await line.request(STATUSWORD, timeout_s=60.0)
    drive.mute = False
    await babbling
    assert (await line.request(STATUSWORD)).data == drive.value(1, 0x6041, 0)


# Noise


async def test_ten_thousand_noisy_conversations_never_bring_a_wrong_value() -> None:
    """One byte in a hundred is lost, flipped, doubled or delayed, both ways."""
    drive = Drive(share=0.01, seed=16)
    line = a_line(drive)
    dice = Random(16)
    answered = 0
    for turn in range(10_000):
        address = (dice.randrange(1, 6), dice.randrange(0x2000, 0x7000), dice.randrange(4))
        try:
            if turn % 4:
                assert (await line.request(make_read_object(*address))).data == drive.value(*address)
            else:
                data = dice.randbytes(4)
                await line.request(make_write_object(*address, data))
                assert drive.objects[address] == data
        except Timeout:
            continue
        answered += 1
    assert drive.to_host.spoiled > 1000
    assert answered > 9_500


async def test_a_write_over_a_noisy_line_is_carried_out_at_most_once() -> None:
    drive = Drive(share=0.01, seed=5)
    line = a_line(drive)
    for turn in range(2_000):
        with contextlib.suppress(Timeout):
            await line.request(make_write_object(1, 0x2000 + turn, 0, b"\x01"))
    writes = [request for request in drive.carried_out if isinstance(request, WriteObject)]
    assert len(writes) == len(set(writes))


# Who is to blame


async def test_a_line_that_stays_silent_is_to_blame_itself() -> None:
    line = a_line(Scripted())
    for _ in range(2):
        with pytest.raises(Timeout):
            await line.request(make_read_object(1, 0x6041, 0))
    assert "does not answer" in str(line.trouble)


async def test_a_line_that_brings_garbage_is_probably_at_another_baud_rate() -> None:
    line = a_line(Scripted(*[b"\x93\x07"] * 20))
    for _ in range(2):
        with pytest.raises(Timeout):
            await line.request(make_read_object(1, 0x6041, 0))
    assert "nothing understandable" in str(line.trouble)
    assert "another baud rate" in str(line.trouble)


async def test_a_line_that_answers_again_is_no_trouble() -> None:
    unheard, unheard_again, filler = b"", b"", b""
    line = a_line(Scripted(unheard, unheard_again, filler, *READ_OK))
    await line.request(make_read_object(1, 0x6041, 0))
    assert line.retries == 2
    assert line.trouble is None
