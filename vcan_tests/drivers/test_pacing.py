"""What configures nodes leaves room on the wire."""

from __future__ import annotations

import asyncio

import pytest

from drivers.canopen.pacing import NODES_AT_ONCE, PACE_BITS, Pacing
from drivers.contract import NodeState
from vcan_tests.drivers.bench import bench

BIT_RATE = 500_000
PACE_S = PACE_BITS / BIT_RATE


async def begin_of_transfer(pacing: Pacing) -> float:
    await pacing.give_way()
    return asyncio.get_running_loop().time()


async def test_transfers_to_different_nodes_begin_one_after_the_other() -> None:
    pacing = Pacing(BIT_RATE)
    begun_s = asyncio.get_running_loop().time()
    begins_s = await asyncio.gather(*(begin_of_transfer(pacing) for _ in range(3)))
    assert begins_s == pytest.approx([begun_s, begun_s + PACE_S, begun_s + 2 * PACE_S])


async def test_a_transfer_after_a_pause_begins_at_once() -> None:
    pacing = Pacing(BIT_RATE)
    await pacing.give_way()
    await asyncio.sleep(1.0)
    now_s = asyncio.get_running_loop().time()
    assert await begin_of_transfer(pacing) == now_s


async def test_no_transfer_begins_before_every_guard_request_is_answered() -> None:
    pacing = Pacing(BIT_RATE)
    pacing.guard_asked(1)
    pacing.guard_asked(2)
    transfer = asyncio.create_task(pacing.give_way())
    pacing.guard_over(1)
    await asyncio.sleep(1.0)
    assert not transfer.done()
    pacing.guard_over(2)
    await asyncio.wait_for(transfer, PACE_S)


async def test_a_node_that_is_lost_keeps_no_other_from_being_configured() -> None:
    async with bench() as b:
        b.network.encoders["front"].power_off()
        b.network.drives["front_left"].power_off()
        await asyncio.sleep(0.05)
        b.network.drives["front_left"].power_on()
        await asyncio.sleep(1.0)
        assert b.encoder().node_state is NodeState.ABSENT
        assert b.drive().node_state is NodeState.READY


async def test_a_node_whose_turn_has_not_come_says_that_it_waits() -> None:
    async with bench(powered=False) as b:
        for _ in range(NODES_AT_ONCE):
            await b.master.pacing.turns.acquire()
        b.network.power_on()
        await asyncio.sleep(2.0 * b.profile.network.boot_deadline_s)
        assert b.drive().status_sentence == "node 3 (front_left): waiting until other nodes are configured"
        b.master.pacing.turns.release()
        await asyncio.sleep(1.0)
        assert {device.node_state for device in b.devices.by_node.values()} == {NodeState.READY}
