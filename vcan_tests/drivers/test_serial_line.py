"""The host's serial line to a drive that answers: values, times, the order of requests, and a device that goes."""

from __future__ import annotations

import asyncio

import pytest

from canhelm.errors import Aborted, BusOff, CanhelmError, NotReady, Timeout
from drivers.epos.serial_answers import Answer
from drivers.epos.serial_frames import SendNmt, make_read_object, make_request_can_frame, make_segment_read
from drivers.epos.serial_line import QUEUE_DEPTH
from vcan_tests.drivers.serial_bench import BYTE_S, CONTROLWORD, DEAD_NODE, START_ALL, STATUSWORD, Drive, a_line, now

POSITION = make_read_object(1, 0x6064, 0)
DEAD = make_read_object(DEAD_NODE, 0x6041, 0)


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
