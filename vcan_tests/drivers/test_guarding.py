"""Node guarding: the rules of one guard, and nodes that are lost."""

from __future__ import annotations

import asyncio

from drivers.bus.contract import RTR_FLAG
from drivers.canopen.guarding import Guard
from drivers.canopen.pacing import Pacing
from drivers.contract import NodeState
from vcan_tests.drivers.bench import bench


class Watch:
    """A guard of node 3 with a guard time of 100 ms, called every 10 ms."""

    def __init__(self, armed_s: float = 0.0) -> None:
        self.requests: list[float] = []
        self.lost_at: list[float] = []
        self.awaited_s: list[float] = []
        self.now_s = armed_s
        self.guard = Guard(3, 0.1, self._request, self._on_lost, Pacing(1_000_000))
        self.guard.arm(armed_s)

    def _request(self, can_id: int) -> None:
        assert can_id == RTR_FLAG | 0x703
        self.requests.append(round(self.now_s, 3))

    def _on_lost(self, awaited_s: float) -> None:
        self.lost_at.append(round(self.now_s, 3))
        self.awaited_s.append(round(awaited_s, 3))

    def run(self, until_s: float) -> None:
        while self.now_s < until_s - 1e-9:
            self.now_s += 0.01
            self.guard.due(self.now_s)


def test_a_node_that_answers_is_asked_once_a_guard_time() -> None:
    watch = Watch()
    for cycle in range(5):
        watch.run(0.01 + 0.1 * cycle)
        watch.guard.answer(cycle % 2)
    assert watch.requests == [0.01, 0.1, 0.2, 0.3, 0.4]


def test_nodes_that_booted_one_after_the_other_are_asked_in_the_same_cycle() -> None:
    first, second = Watch(), Watch(armed_s=0.23)
    for watch in (first, second):
        for cycle in range(6):
            watch.run(0.1 * cycle + 0.05)
            watch.guard.answer(cycle % 2)
    assert first.requests[-2:] == second.requests[-2:]


def test_a_node_that_dies_after_an_answer_is_lost_within_two_guard_times() -> None:
    watch = Watch()
    watch.run(0.01)
    watch.guard.answer(0)
    watch.run(1.0)
    assert watch.requests == [0.01, 0.1, 0.15]
    assert (watch.lost_at, watch.awaited_s) == ([0.18], [0.08])


def test_an_answer_to_the_repeated_request_is_good() -> None:
    watch = Watch()
    watch.run(0.05)
    watch.guard.answer(0)
    watch.run(0.1)
    assert not watch.lost_at


def test_a_toggle_bit_that_does_not_alternate_is_noticed() -> None:
    watch = Watch()
    assert [watch.guard.answer(toggle) for toggle in (1, 0, 0, 1)] == [True, True, False, True]


def test_a_pause_of_the_program_loses_no_node() -> None:
    watch = Watch()
    watch.run(0.01)
    watch.now_s = 2.0  # the answer waits unread
    watch.guard.due(watch.now_s)
    assert not watch.lost_at


def test_a_pause_of_the_program_does_not_count_as_silence_of_the_node() -> None:
    watch = Watch()
    watch.run(0.01)
    watch.now_s = 98.0
    watch.run(98.2)
    assert watch.awaited_s == [0.08]


def test_a_node_that_a_gateway_awaits_in_vain_is_lost_at_once_and_only_once() -> None:
    watch = Watch()
    watch.run(0.05)
    watch.guard.lose(watch.now_s)
    watch.guard.lose(98.0)
    assert (watch.lost_at, watch.awaited_s) == ([0.05], [0.04])


def test_a_node_that_was_not_asked_when_it_was_lost_was_awaited_for_no_time() -> None:
    watch = Watch()
    watch.run(0.05)
    watch.guard.answer(0)
    watch.guard.lose(98.0)
    assert watch.awaited_s == [0.0]


def test_a_guard_that_is_not_armed_asks_nothing() -> None:
    watch = Watch()
    watch.guard.disarm()
    watch.run(1.0)
    assert watch.requests == []


async def test_a_drive_without_power_is_lost_with_the_time_measured() -> None:
    async with bench() as b:
        b.network.power_off(3)
        off_s = asyncio.get_running_loop().time()
        await asyncio.sleep(0.3)
        lost = next(event for event in b.events if event.kind == "lost")
        assert lost.time_s - off_s <= 2 * b.profile.network.guard_time_ms / 1e3
        assert "no guarding answer for" in lost.message
        fault = b.drive().fault
        assert fault is not None
        assert fault.message == lost.message


async def test_a_lost_drive_is_ready_again_when_its_power_is_back() -> None:
    async with bench() as b:
        b.network.power_off(3)
        await asyncio.sleep(3.0)
        b.network.power_on(3)
        await asyncio.sleep(0.5)
        assert b.drive().node_state is NodeState.READY
        assert b.drive().fault is None
        assert b.kinds(3)[-4:] == ["lost", "waiting", "boot_up", "ready"]


async def test_a_pulled_cable_is_survived() -> None:
    async with bench() as b:
        b.port.connected = False
        await asyncio.sleep(2.0)
        assert {device.node_state for device in b.devices.by_node.values()} == {NodeState.ABSENT}
        b.port.connected = True
        await asyncio.sleep(2.0)
        assert {device.node_state for device in b.devices.by_node.values()} == {NodeState.READY}
        assert [device.fault for device in b.devices.by_node.values()] == [None] * 6


async def test_a_cycle_that_hangs_guards_nobody_and_the_drives_notice() -> None:
    async with bench() as b:
        b.cycle.stop()
        await asyncio.sleep(1.0)
        fault = b.drive().fault
        assert fault is not None
        assert fault.code == 0x8130


async def test_a_node_that_does_not_toggle_is_told_once_and_counted() -> None:
    async with bench() as b:
        b.network.node(3).power_off()
        for _ in range(4):
            b.intruder.send(0x703, b"\x05")
            await asyncio.sleep(0.02)
        assert b.kinds(3).count("toggle") == 1
        assert b.master.counters.toggle_errors >= 3
