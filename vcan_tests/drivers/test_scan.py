"""The scan of a bus: who answers, who is stopped, two nodes with one id."""

from __future__ import annotations

import asyncio

import pytest

from drivers.bus.contract import RTR_FLAG
from drivers.canopen.codes import NmtState
from drivers.canopen.scan import BusWatch, FoundNode, NodeScan
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.encoder import SimulatedEncoder
from profiles.schema import EncoderConfig
from vcan_tests.drivers.bench import Bench, bench


async def scan(b: Bench) -> dict[int, FoundNode]:
    return {found.node: found for found in await NodeScan(b.master).run()}


async def test_a_scan_finds_every_node_and_no_other() -> None:
    async with bench() as b:
        found = await scan(b)
        assert {node: entry.name for node, entry in found.items()} == {
            1: "rear_right",
            2: "rear_left",
            3: "front_left",
            4: "front_right",
            5: "rear",
            6: "front",
        }
        assert (found[1].device_name, found[1].numbers["device_type"]) == ("EPOS", 0x00200192)
        assert found[6].numbers["serial_number"] == 0x20260006


async def test_a_scan_tells_the_states_and_loses_no_node() -> None:
    async with bench() as b:
        found = await scan(b)
        await asyncio.sleep(1.0)
        assert {entry.sighting.state for entry in found.values()} == {NmtState.OPERATIONAL}
        assert (b.master.counters.toggle_errors, b.master.counters.nodes_lost) == (0, 0)
        assert not any(entry.sighting.two_nodes for entry in found.values())


async def test_a_scan_of_a_range_asks_nobody_else() -> None:
    async with bench() as b:
        asked: set[int] = set()
        b.intruder.taps.append(lambda can_id, data, stamp: asked.add(can_id))
        assert [found.node for found in await NodeScan(b.master).run(range(5, 10))] == [5, 6]
        assert {can_id & 0x7F for can_id in asked if can_id & 0x780 == 0x600} == {5, 6, 7, 8, 9}


def stranger(b: Bench, node: int) -> SimulatedEncoder:
    """An encoder that the profile does not know, switched on."""
    config = EncoderConfig(node=node, counts_per_turn=4096)
    encoder = SimulatedEncoder(b.medium.port(f"node {node}"), config, "front", b.network.world, 0.05)
    encoder.power_on()
    return encoder


async def test_a_stopped_node_is_found_by_its_guarding_answer() -> None:
    async with bench(powered=False) as b:
        stranger(b, 40)
        await asyncio.sleep(0.1)
        b.intruder.send(0x000, bytes((2, 40)))
        await asyncio.sleep(0.001)
        found = (await NodeScan(b.master).run([40]))[0]
        assert (found.answers, found.sighting.state) == (False, NmtState.STOPPED)


async def test_two_nodes_with_one_id_are_found_by_their_doubled_answers() -> None:
    async with bench() as b:
        stranger(b, 5)
        await asyncio.sleep(1.0)
        found = await scan(b)
        assert [node for node, entry in found.items() if entry.sighting.two_nodes] == [5]


async def test_a_scan_does_not_start_the_life_guarding_of_a_node_that_nobody_guards() -> None:
    async with bench(powered=False) as b:
        stranger(b, 40).dictionary.values |= {(0x100C, 0): 100, (0x100D, 0): 2}
        await asyncio.sleep(0.1)
        requests: list[int] = []
        b.intruder.taps.append(lambda can_id, data, stamp: requests.append(can_id))
        assert [found.sighting.state for found in await NodeScan(b.master).run([40])] == [None]
        assert 0x728 | RTR_FLAG not in requests


# --- the watch -------------------------------------------------------------------------------------------------------


def watch() -> BusWatch:
    return BusWatch(SimulatedBus().port("watch"))


READ, ANSWER = bytes.fromhex("4000100000000000"), bytes.fromhex("4300100096010100")
OTHER = bytes.fromhex("4300100092012000")


def test_one_answer_to_each_request_is_one_node() -> None:
    w = watch()
    for moment in range(5):
        w.see(0x605, READ, moment)
        w.see(0x585, ANSWER, moment + 0.001)
    assert not w.of(5).two_nodes


def test_two_answers_to_each_request_are_two_nodes() -> None:
    w = watch()
    for moment in range(2):
        w.see(0x605, READ, moment)
        w.see(0x585, ANSWER, moment + 0.001)
        w.see(0x585, OTHER, moment + 0.002)
    assert (w.of(5).two_nodes, w.of(5).doubled, w.of(5).differing) == (True, 2, 2)


def test_a_single_late_answer_is_not_a_second_node() -> None:
    w = watch()
    w.see(0x605, READ, 0.0)
    w.see(0x605, READ, 0.1)
    w.see(0x585, ANSWER, 0.101)
    w.see(0x585, ANSWER, 0.102)
    assert not w.of(5).two_nodes


def test_a_heartbeat_is_not_a_second_guarding_answer() -> None:
    w = watch()
    w.see(0x705 | RTR_FLAG, b"", 0.0)
    for moment in range(5):
        w.see(0x705, b"\x05", 0.001 + moment)
    assert (w.of(5).state, w.of(5).two_nodes) == (5, False)


def test_doubled_boot_ups_are_two_nodes() -> None:
    w = watch()
    w.see(0x705, b"\0", 0.0)
    w.see(0x705, b"\0", 0.001)
    assert w.of(5).two_nodes


def test_the_segments_of_a_block_are_not_answers_of_two_nodes() -> None:
    w = watch()
    w.see(0x605, b"\xa3" + bytes(7), 0.0)
    for number in range(1, 9):
        w.see(0x585, bytes((number,)) + bytes(7), 0.001 * number)
    assert not w.of(5).two_nodes


@pytest.mark.parametrize("data", [b"", b"\x05\x05", b"\x7f" * 8])
def test_garbage_disturbs_nothing(data: bytes) -> None:
    w = watch()
    for can_id in (0x000, 0x080, 0x580, 0x585, 0x605, 0x705, 0x7E4):
        w.see(can_id, data, 0.0)
    assert not any(sighting.two_nodes for sighting in w.sightings.values())
