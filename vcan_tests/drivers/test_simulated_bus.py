"""The simulated wire: times, arbitration, queues, delivery."""

from __future__ import annotations

import asyncio
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.runtime.clock import VirtualTimeLoop, run_virtual
from drivers.bus.contract import RTR_FLAG
from drivers.bus.wire_time import frame_bits
from drivers.simulated.bus import SimulatedBus
from vcan_tests.drivers.simulated_bus_bench import BIT_S, Frame, listen


def ids(frames: list[Frame]) -> list[int]:
    return [frame[0] for frame in frames]


async def test_a_frame_is_stamped_and_delivered_at_the_end_of_its_last_bit() -> None:
    bus = SimulatedBus()
    sender, port = bus.port("master"), bus.port("node")
    times: list[float] = []
    port.receiver = lambda can_id, data, stamp: times.extend((stamp, asyncio.get_running_loop().time()))
    await asyncio.sleep(1.0)
    sender.send(0x080)
    await asyncio.sleep(0.001)
    assert times[0] == pytest.approx(1.0 + 48e-6)
    assert times[1] == times[0]


class LoopWithoutJumps(VirtualTimeLoop):
    """Every frame gets its timer."""

    def jump_to(self, when: float) -> bool:
        return False


async def busy_wire() -> list[tuple[str, int, float, float]]:
    """Bursts with answers, timers and tasks in between: who saw what, at which stamp, at which time."""
    loop, bus = asyncio.get_running_loop(), SimulatedBus(disturbed=0.1)
    master, node = bus.port("master"), bus.port("node")
    seen: list[tuple[str, int, float, float]] = []

    def answer(can_id: int, data: bytes, stamp: float) -> None:
        seen.append(("node", can_id, stamp, loop.time()))
        node.send(can_id + 0x100, data)
        if can_id % 3 == 0:
            loop.call_soon(lambda: seen.append(("soon", can_id, stamp, loop.time())))

    node.receiver = answer
    master.receiver = lambda can_id, data, stamp: seen.append(("master", can_id, stamp, loop.time()))
    for step in range(40):
        loop.call_at(step * 70e-6, lambda: seen.append(("timer", 0, 0.0, loop.time())))
    for burst in range(8):
        for number in range(12):
            master.send(0x181 + number, bytes((burst, number)))
        await asyncio.sleep(0.3e-3 * burst)
    await asyncio.sleep(0.1)
    return seen


def test_a_burst_that_jumps_runs_like_one_with_a_timer_a_frame() -> None:
    with asyncio.Runner(loop_factory=LoopWithoutJumps) as runner:
        expected = runner.run(busy_wire())
    assert len(expected) > 150
    assert run_virtual(busy_wire()) == expected


async def test_the_bit_rate_scales_the_times() -> None:
    bus = SimulatedBus(bit_rate=125_000)
    sender, frames = bus.port("master"), listen(bus.port("node"))
    sender.send(0x080)
    await asyncio.sleep(0.1)
    assert frames[0][2] == pytest.approx(48 * 8e-6)


async def test_frames_follow_each_other_after_the_intermission() -> None:
    bus = SimulatedBus()
    sender, frames = bus.port("master"), listen(bus.port("node"))
    for _ in range(100):
        sender.send(0x181, bytes(8))
        await asyncio.sleep(0)
    await asyncio.sleep(0.1)
    last = sender.counters.sent
    assert frames[-1][2] == pytest.approx((last * frame_bits(0x181, bytes(8)) - 3) * BIT_S)


async def test_the_sender_does_not_hear_itself() -> None:
    bus = SimulatedBus()
    sender = bus.port("master")
    frames = listen(sender)
    sender.send(0x080)
    await asyncio.sleep(0.1)
    assert frames == []


async def test_the_lowest_identifier_queued_when_the_wire_gets_free_goes_first() -> None:
    bus = SimulatedBus()
    one, two, frames = bus.port("one"), bus.port("two"), listen(bus.port("three"))
    one.send(0x7FF)
    await asyncio.sleep(20e-6)
    one.send(0x300)
    two.send(0x200)
    one.send(0x100)
    await asyncio.sleep(0.1)
    assert ids(frames) == [0x7FF, 0x100, 0x200, 0x300]


async def test_a_frame_queued_during_the_intermission_takes_part_in_the_arbitration() -> None:
    bus = SimulatedBus()
    one, two, frames = bus.port("one"), bus.port("two"), listen(bus.port("three"))
    one.send(0x080)
    one.send(0x300)
    asyncio.get_running_loop().call_at(50e-6, two.send, 0x200)
    await asyncio.sleep(0.1)
    assert ids(frames) == [0x080, 0x200, 0x300]


async def test_a_frame_on_the_wire_is_not_interrupted() -> None:
    bus = SimulatedBus()
    one, two, frames = bus.port("one"), bus.port("two"), listen(bus.port("three"))
    one.send(0x300)
    asyncio.get_running_loop().call_at(1e-6, two.send, 0x200)
    await asyncio.sleep(0.1)
    assert ids(frames) == [0x300, 0x200]


async def test_equal_identifiers_keep_their_order() -> None:
    bus = SimulatedBus()
    sender, frames = bus.port("master"), listen(bus.port("node"))
    for number in range(20):
        sender.send(0x601, bytes([number]))
    await asyncio.sleep(0.1)
    assert [data[0] for _, data, _ in frames] == list(range(20))


async def test_a_data_frame_beats_a_remote_frame_of_its_identifier() -> None:
    bus = SimulatedBus()
    one, two, frames = bus.port("one"), bus.port("two"), listen(bus.port("three"))
    one.send(0x701 | RTR_FLAG)
    two.send(0x701, b"\x05")
    await asyncio.sleep(0.1)
    assert ids(frames) == [0x701, 0x701 | RTR_FLAG]


async def test_answers_are_queued_at_the_end_of_the_frame_they_answer() -> None:
    bus = SimulatedBus()
    master, node = bus.port("master"), bus.port("node")
    frames = listen(master)
    node.receiver = lambda can_id, data, stamp: node.send(0x181, bytes(8))
    master.send(0x080)
    await asyncio.sleep(0.1)
    assert frames[0][2] == pytest.approx((51 + 126 - 3) * BIT_S)


async def test_a_frame_past_its_deadline_is_dropped() -> None:
    bus = SimulatedBus()
    sender, frames = bus.port("master"), listen(bus.port("node"))
    sender.send(0x080)
    sender.send(0x201, b"old", deadline_s=40e-6)
    sender.send(0x202, b"new", deadline_s=60e-6)
    await asyncio.sleep(0.1)
    assert ids(frames) == [0x080, 0x202]
    assert sender.counters.dropped_stale == 1


async def test_a_full_queue_refuses_more() -> None:
    bus = SimulatedBus()
    sender, frames = bus.port("master", depth=3), listen(bus.port("node"))
    for number in range(5):
        sender.send(0x201 + number)
    await asyncio.sleep(0.1)
    assert ids(frames) == [0x201, 0x202, 0x203]
    assert (sender.counters.dropped_full, sender.queue_high_water, sender.queued) == (2, 3, 0)


async def test_a_full_queue_makes_room_by_what_is_stale() -> None:
    bus = SimulatedBus()
    flooding, sender, frames = bus.port("flood"), bus.port("master", depth=2), listen(bus.port("node"))
    for _ in range(10):
        flooding.send(0x001)
    sender.send(0x201, b"old", deadline_s=100e-6)
    sender.send(0x202, b"old", deadline_s=100e-6)
    asyncio.get_running_loop().call_at(200e-6, sender.send, 0x203)
    await asyncio.sleep(0.1)
    assert ids(frames)[-1] == 0x203
    assert (sender.counters.dropped_stale, sender.counters.dropped_full) == (2, 0)


async def test_a_port_gets_only_what_it_accepts() -> None:
    bus = SimulatedBus()
    sender, port = bus.port("master"), bus.port("node")
    frames = listen(port)
    port.accept([0x080, 0x701])
    for can_id in (0x080, 0x201, 0x701 | RTR_FLAG):
        sender.send(can_id)
    await asyncio.sleep(0.1)
    assert ids(frames) == [0x080, 0x701 | RTR_FLAG]
    port.accept([0x201])
    sender.send(0x201)
    await asyncio.sleep(0.1)
    assert ids(frames)[-1] == 0x201


async def test_taps_see_everything_in_the_order_of_the_wire() -> None:
    bus = SimulatedBus()
    one, two = bus.port("one"), bus.port("two")
    seen: list[int] = []
    one.accept([])
    one.taps.append(lambda can_id, data, stamp: seen.append(can_id))
    one.send(0x300)
    one.send(0x200)
    two.send(0x100)
    await asyncio.sleep(0.1)
    assert seen == [0x100, 0x200, 0x300]


async def test_a_pulled_cable_loses_frames_both_ways() -> None:
    bus = SimulatedBus()
    master, node = bus.port("master"), bus.port("node")
    at_master, at_node = listen(master), listen(node)
    node.connected = False
    node.send(0x701, b"\0")
    master.send(0x080)
    await asyncio.sleep(0.1)
    assert (at_master, at_node, node.lost) == ([], [], 1)
    node.connected = True
    master.send(0x080)
    await asyncio.sleep(0.1)
    assert ids(at_node) == [0x080]


async def test_pulling_the_cable_loses_what_is_queued() -> None:
    bus = SimulatedBus()
    master, node = bus.port("master"), bus.port("node")
    frames = listen(master)
    node.send(0x181)
    node.send(0x182)
    asyncio.get_running_loop().call_at(20e-6, setattr, node, "connected", False)
    await asyncio.sleep(0.1)
    assert (frames, node.lost, node.queued) == ([], 2, 0)


async def test_a_closed_port_drops_its_queue_and_may_be_opened_again() -> None:
    bus = SimulatedBus()
    master, node = bus.port("master"), bus.port("node")
    frames = listen(master)
    for can_id in (0x181, 0x182):
        node.send(can_id)
    await node.close()
    await asyncio.sleep(0.1)
    assert (ids(frames), node.queued) == ([0x181], 0)
    await node.open()
    node.send(0x183)
    await asyncio.sleep(0.1)
    assert ids(frames) == [0x181, 0x183]


async def test_a_receiver_that_raises_does_not_stop_the_bus() -> None:
    bus = SimulatedBus()
    sender, broken = bus.port("master"), bus.port("broken")
    reported: list[dict[str, Any]] = []
    asyncio.get_running_loop().set_exception_handler(lambda loop, context: reported.append(context))

    def fail(can_id: int, data: bytes, stamp: float) -> None:
        raise LookupError

    broken.receiver = fail
    frames = listen(bus.port("node"))
    sender.send(0x080)
    sender.send(0x081)
    await asyncio.sleep(0.1)
    assert ids(frames) == [0x080, 0x081]
    assert (len(reported), broken.receiver_errors) == (2, 2)
    assert "broken on vcan0" in reported[0]["message"]


async def test_what_no_frame_can_be_is_refused_at_once() -> None:
    port = SimulatedBus().port("master")
    with pytest.raises(ValueError, match="base frame"):
        port.send(0x181, bytes(9))


async def test_an_instant_bus_takes_no_time_and_lets_no_answer_overtake_what_it_answers() -> None:
    bus = SimulatedBus(instant=True)
    master, node = bus.port("master"), bus.port("node")
    requests: list[Frame] = []

    def answer(can_id: int, data: bytes, stamp: float) -> None:
        requests.append((can_id, data, stamp))
        node.send(0x581, data)

    node.receiver = answer
    answers = listen(master)
    await asyncio.sleep(1.0)
    master.send(0x601, b"\x40")
    await asyncio.sleep(1e-9)
    assert (requests, answers) == ([(0x601, b"\x40", 1.0)], [(0x581, b"\x40", 1.0)])


async def test_statistics_tell_load_and_frames_by_identifier() -> None:
    bus = SimulatedBus(bit_rate=1000)
    sender = bus.port("master")
    for _ in range(5):
        sender.send(0x080)
    sender.send(0x701 | RTR_FLAG)
    await asyncio.sleep(0.5)
    bits = 5 * 51 + frame_bits(0x701 | RTR_FLAG, b"")
    assert dict(bus.frames) == {0x080: 5, 0x701 | RTR_FLAG: 1}
    assert bus.busy_s == pytest.approx(bits * 1e-3)
    assert sender.load() == bus.load() == pytest.approx(bits / 1000)
    assert bus.queue_high_water == 6


TRAFFIC = st.lists(
    st.tuples(st.floats(0.0, 0.002), st.integers(0, 2), st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=40
)


@given(TRAFFIC)
def test_nothing_is_lost_and_no_two_frames_overlap(traffic: list[tuple[float, int, int, bytes]]) -> None:
    bus = SimulatedBus()
    frames: list[Frame] = []

    async def carry() -> None:
        ports = [bus.port(f"node {number}") for number in range(3)]
        ports[0].taps.append(lambda can_id, data, stamp: frames.append((can_id, data, stamp)))
        for when, number, can_id, data in traffic:
            asyncio.get_running_loop().call_at(when, ports[number].send, can_id, data)
        await asyncio.sleep(0.1)

    run_virtual(carry())
    assert sorted(frame[:2] for frame in frames) == sorted(sent[2:] for sent in traffic)
    for earlier, later in pairwise(frames):
        assert later[2] - earlier[2] >= (frame_bits(*later[:2]) - 1e-3) * BIT_S


@pytest.mark.real_time
async def test_in_real_time_wire_times_are_exact_though_the_loop_is_late() -> None:
    bus = SimulatedBus()
    master, node = bus.port("master"), bus.port("node")
    frames: list[Frame] = []

    def ask_again(can_id: int, data: bytes, stamp: float) -> None:
        frames.append((can_id, data, stamp))
        if len(frames) < 50:
            master.send(0x080)

    master.receiver = ask_again
    node.receiver = lambda can_id, data, stamp: node.send(0x181, bytes(8))
    master.send(0x080)
    began = asyncio.get_running_loop().time()
    while asyncio.get_running_loop().time() < began + 0.02:
        pass
    master.send(0x200)
    await asyncio.sleep(0.02)
    assert len(frames) == 51
    gaps = [later[2] - earlier[2] for earlier, later in pairwise(frames)]
    both = (frame_bits(0x080, b"") + frame_bits(0x181, bytes(8))) * BIT_S
    assert gaps[:49] == pytest.approx([both] * 49, abs=1e-8)
    assert frames[-1][2] - began > 0.02
