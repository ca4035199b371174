from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from random import Random

import pytest

from canhelm.errors import Aborted, BusOff, CanhelmError, NotReady, Timeout
from drivers.epos.serial_answers import Answer, make_done_answer, make_read_answer
from drivers.epos.serial_conversation import Transport
from drivers.epos.serial_frames import (
    SendNmt,
    WriteObject,
    make_read_object,
    make_request_can_frame,
    make_segment_read,
    make_send_nmt,
    make_write_object,
)
from drivers.epos.serial_line import QUEUE_DEPTH, SerialLine
from vcan_tests.drivers.serial_bench import DEAD_NODE, Drive

BAUD = 115200
BYTE_S = 10 / BAUD
STATUSWORD = make_read_object(1, 0x6041, 0)
POSITION = make_read_object(1, 0x6064, 0)
CONTROLWORD = make_write_object(1, 0x6040, 0, b"\x06\x00")
START_ALL = make_send_nmt(0, 1)
DEAD = make_read_object(DEAD_NODE, 0x6041, 0)


def now() -> float:
    return asyncio.get_running_loop().time()


def a_line(drive: Transport) -> SerialLine:
    return SerialLine(drive, BAUD, "ttyTEST")


# Without trouble


async def test_a_read_brings_the_value() -> None:
    drive = Drive()
    assert (await a_line(drive).request(STATUSWORD)).data == drive.value(1, 0x6041, 0)


async def test_a_read_takes_its_bytes_and_the_drives_own_time() -> None:
    """22 of 24: the drive works while it acknowledges, and the host's last acknowledge is still on the wire."""
    drive = Drive()
    line = a_line(drive)
    await line.request(STATUSWORD)
    assert now() == pytest.approx(22 * BYTE_S + drive.answering_s)


async def test_a_write_arrives() -> None:
    drive = Drive()
    await a_line(drive).request(CONTROLWORD)
    assert drive.objects[1, 0x6040, 0] == b"\x06\0\0\0"


async def test_a_command_without_answer_ends_with_its_acknowledge() -> None:
    drive = Drive()
    assert await a_line(drive).request(START_ALL) == Answer()
    assert drive.carried_out == [SendNmt(0, 1)]


async def test_a_requested_can_frame_comes() -> None:
    assert (await a_line(Drive()).request(make_request_can_frame(0x701, 1))).data == b"\0"


async def test_an_abort_code_is_raised_in_words() -> None:
    with pytest.raises(Aborted, match="SDO time-out") as caught:
        await a_line(Drive()).request(DEAD)
    assert (caught.value.node, caught.value.object, caught.value.value) == (DEAD_NODE, "0x6041", 0x0504_0000)


async def test_an_abort_code_of_maxons_own_is_known() -> None:
    with pytest.raises(Aborted, match="illegal RS-232 command"):
        await a_line(Drive()).request(make_segment_read(0))


async def test_requests_go_one_at_a_time_in_their_order() -> None:
    drive = Drive()
    line = a_line(drive)
    reads = [make_read_object(1, 0x2000 + turn, 0) for turn in range(20)]
    answers = await asyncio.gather(*(line.request(read) for read in reads))
    assert [answer.data for answer in answers] == [drive.value(1, 0x2000 + turn, 0) for turn in range(20)]


async def test_an_urgent_request_goes_before_those_that_wait() -> None:
    line = a_line(Drive())
    order: list[str] = []
    for name, urgent in (("running", False), ("waiting", False), ("urgent", True)):
        line.submit(STATUSWORD, lambda _, name=name: order.append(name), urgent=urgent)  # type: ignore[misc]
    await asyncio.sleep(1.0)
    assert order == ["running", "urgent", "waiting"]


async def test_back_to_back_reads_keep_the_line_busy_but_for_the_drives_own_time() -> None:
    drive = Drive()
    line = a_line(drive)
    for _ in range(100):
        await line.request(STATUSWORD)
    assert line.utilisation() == pytest.approx(24 * BYTE_S / (23 * BYTE_S + drive.answering_s), rel=0.01)
    assert line.own_idle_share() == 0.0


async def test_time_in_which_nothing_is_asked_is_the_hosts_own() -> None:
    line = a_line(Drive())
    for _ in range(10):
        await line.request(STATUSWORD)
        await asyncio.sleep(0.1)
    assert line.own_idle_share() == pytest.approx(0.9 * 0.1 * 10 / now(), rel=0.01)


# Deadlines and queues


async def test_a_request_fails_at_its_deadline_though_the_gateway_still_waits_for_a_dead_node() -> None:
    with pytest.raises(Timeout, match="not answered in time"):
        await a_line(Drive()).request(DEAD, timeout_s=0.1)
    assert now() == pytest.approx(0.1)


async def test_a_late_answer_is_not_taken_for_the_next_requests() -> None:
    drive = Drive()
    line = a_line(drive)
    with pytest.raises(Timeout):
        await line.request(DEAD, timeout_s=0.1)
    assert (await line.request(STATUSWORD)).data == drive.value(1, 0x6041, 0)
    assert (line.late_answers, line.counters.resyncs) == (1, 0)


async def test_a_request_whose_turn_does_not_come_is_never_sent() -> None:
    drive = Drive()
    line = a_line(drive)
    blocked = asyncio.ensure_future(line.request(make_read_object(DEAD_NODE, 0x1000, 0)))
    await asyncio.sleep(0)
    with pytest.raises(Timeout, match="was not sent"):
        await line.request(CONTROLWORD, timeout_s=0.2)
    with pytest.raises(Aborted):
        await blocked
    await asyncio.sleep(2.0)
    assert len(drive.carried_out) == 1


async def test_a_request_that_comes_after_its_deadline_is_never_sent() -> None:
    drive = Drive()
    with pytest.raises(Timeout, match="was not sent"):
        await a_line(drive).request(CONTROLWORD, timeout_s=0.0)
    assert drive.to_drive.sent == 0


async def test_no_callback_comes_from_within_the_call() -> None:
    line = a_line(Drive())
    results: list[Answer | CanhelmError] = []
    line.submit(STATUSWORD, results.append, now())
    line.lose("Input/output error")
    line.submit(STATUSWORD, results.append)
    assert results == []
    await asyncio.sleep(0)
    assert [type(result) for result in results] == [Timeout, BusOff]


async def test_a_full_queue_refuses_more() -> None:
    line = a_line(Drive())
    results: list[Answer | CanhelmError] = []
    for _ in range(QUEUE_DEPTH + 2):
        line.submit(STATUSWORD, results.append)
    await asyncio.sleep(0)
    assert [type(result) for result in results] == [NotReady]


async def test_a_caller_that_gives_up_does_not_stop_the_line() -> None:
    drive = Drive()
    line = a_line(drive)
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(line.request(DEAD), 0.1)
    assert (await line.request(STATUSWORD)).data == drive.value(1, 0x6041, 0)


async def test_a_callback_that_fails_does_not_stop_the_line() -> None:
    asyncio.get_running_loop().set_exception_handler(lambda *_: None)

    def fail(_: object) -> None:
        raise ValueError

    drive = Drive()
    line = a_line(drive)
    line.submit(STATUSWORD, fail)
    assert (await line.request(POSITION)).data == drive.value(1, 0x6064, 0)


# Trouble


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


# The device below


async def test_a_device_that_vanishes_fails_everything_that_waits() -> None:
    drive = Drive()
    line = a_line(drive)
    waiting = [asyncio.ensure_future(line.request(STATUSWORD)) for _ in range(3)]
    await asyncio.sleep(0.001)
    line.lose("Input/output error")
    results = await asyncio.gather(*waiting, return_exceptions=True)
    assert [type(result) for result in results] == [BusOff] * 3


async def test_a_line_that_is_down_refuses_at_once() -> None:
    line = a_line(Drive())
    line.lose("Input/output error")
    with pytest.raises(BusOff):
        await line.request(STATUSWORD)
    assert now() == 0.0


async def test_a_device_that_is_back_is_used_again() -> None:
    line = a_line(Drive())
    line.lose("Input/output error")
    drive = Drive()
    line.attach(drive)
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
