"""Faults of frames on the simulated bus: which frames they strike, and what becomes of them."""

from __future__ import annotations

import asyncio
from typing import Any

import msgspec
import pytest

from daemon.runtime.clock import run_virtual
from drivers.bus.contract import RTR_FLAG
from drivers.simulated.bus import SimulatedBus, SimulatedPort
from drivers.simulated.device_faults import Site
from drivers.simulated.faults import Faults
from drivers.simulated.network import SimulatedNetwork
from profiles.faults import Fault
from profiles.loader import load
from vcan_tests.drivers.simulated_bus_bench import Frame, listen

PROFILE = load("max2d").profile


class Line:
    """A bus with a network that has no power, a sender, and somebody who listens."""

    def __init__(self, seed: int = 1) -> None:
        self.medium = SimulatedBus()
        self.sender: SimulatedPort = self.medium.port("sender")
        self.frames: list[Frame] = listen(self.medium.port("listener"))
        self.faults = Faults(Site(SimulatedNetwork(PROFILE, self.medium, 1), self.medium), seed)

    def set(self, kind: str, **fields: Any) -> dict[str, Any]:
        return self.faults.add(msgspec.convert({"kind": kind, **fields}, Fault))

    async def send(self, *frames: tuple[int, bytes]) -> list[tuple[int, bytes]]:
        """What arrives, in order, of frames sent one after the other."""
        for can_id, data in frames:
            self.sender.send(can_id, data)
        await asyncio.sleep(0.01 * (1 + len(frames)))
        return [(can_id, data) for can_id, data, _ in self.frames]

    async def numbered(self, count: int, can_id: int = 0x181) -> list[int]:
        return [data[0] for _, data in await self.send(*((can_id, bytes([n])) for n in range(count)))]


async def test_no_fault_costs_nothing_on_the_way_of_a_frame() -> None:
    line = Line()
    assert line.medium.faults is None
    line.set("lose", times=1)
    assert line.medium.faults is not None
    assert await line.numbered(3) == [1, 2]
    assert line.medium.faults is None


@pytest.mark.parametrize(
    ("kind", "fields", "arrive"),
    [
        ("lose", {"nth": 2}, [0, 2, 3]),
        ("lose", {"times": 2}, [2, 3]),
        ("lose", {"at_frame": 3}, [0, 1]),
        ("lose", {"cob_id": 0x182}, [0, 1, 2, 3]),
        ("duplicate", {"nth": 2}, [0, 1, 1, 2, 3]),
        ("reorder", {"nth": 2}, [0, 2, 1, 3]),
        ("delay", {"nth": 2, "delay_s": 0.02}, [0, 2, 3, 1]),
    ],
)
async def test_frames_are_struck_as_the_fault_says(kind: str, fields: dict[str, Any], arrive: list[int]) -> None:
    line = Line()
    line.set(kind, **fields)
    assert await line.numbered(4) == arrive


async def test_a_delayed_frame_carries_the_time_at_which_it_comes() -> None:
    line = Line()
    line.set("delay", delay_s=0.5)
    line.sender.send(0x181, b"x")
    await asyncio.sleep(1.0)
    ((_, _, stamp_s),) = line.frames
    assert 0.5 < stamp_s < 0.501


async def test_a_corrupted_frame_has_one_wrong_bit() -> None:
    line = Line()
    line.set("corrupt")
    ((_, data),) = await line.send((0x181, bytes(8)))
    assert int.from_bytes(data, "little").bit_count() == 1


async def test_frames_without_data_are_not_corrupted() -> None:
    line = Line()
    line.set("corrupt")
    assert await line.send((0x080, b""), (0x701 | RTR_FLAG, b"")) == [(0x080, b""), (0x701 | RTR_FLAG, b"")]


@pytest.mark.parametrize(
    ("kind", "sent", "arrives"),
    [
        ("pdo_short", (0x181, b"abc"), b"ab"),
        ("pdo_long", (0x201, b"abc"), b"abc\0"),
        ("pdo_long", (0x181, bytes(8)), bytes(8)),
        ("pdo_short", (0x581, bytes(8)), bytes(8)),
        ("pdo_short", (0x701, b"a"), b"a"),
    ],
)
async def test_only_pdos_change_their_length(kind: str, sent: tuple[int, bytes], arrives: bytes) -> None:
    line = Line()
    line.set(kind)
    assert await line.send(sent) == [(sent[0], arrives)]


NODE_3 = [(0x000, b"\x01\x03"), (0x083, bytes(8)), (0x183, b"a"), (0x203, b"a"), (0x583, bytes(8)), (0x603, bytes(8))]
OTHERS = [(0x000, b"\x01\x04"), (0x080, b""), (0x184, b"a"), (0x704 | RTR_FLAG, b"")]


async def test_the_frames_of_a_node_are_those_from_it_and_to_it() -> None:
    line = Line()
    line.set("lose", part="front_left")
    assert sorted(await line.send(*NODE_3, *OTHERS)) == sorted(OTHERS)


async def test_the_frames_of_an_object_are_the_sdo_frames_that_name_it() -> None:
    line = Line()
    line.set("lose", object="0x6041")
    asked, other = bytes.fromhex("4041600000000000"), bytes.fromhex("4040600000000000")
    kept = [(0x603, other), (0x183, asked)]
    assert sorted(await line.send((0x603, asked), (0x583, asked), *kept)) == sorted(kept)


async def test_a_fault_begins_and_ends_at_its_times() -> None:
    line = Line()
    line.set("lose", at_s=1.0, for_s=1.0)
    states = []
    for number in range(3):
        line.sender.send(0x181, bytes([number]))
        await asyncio.sleep(0.5)
        states.append(line.faults.told()[0]["state"])
        await asyncio.sleep(0.6)
    assert ([data[0] for _, data, _ in line.frames], states) == ([0, 2], ["waiting", "acting", "over"])


async def test_what_a_fault_has_struck_is_counted() -> None:
    line = Line()
    line.set("lose", cob_id=0x182)
    number = line.set("lose", probability=0.5, times=3)["fault"]
    await line.numbered(30)
    first, second = line.faults.told()
    assert (first["struck"], first["state"]) == (0, "acting")
    assert (second["fault"], second["struck"], second["state"]) == (number, 3, "over")


async def test_cleared_faults_strike_no_more() -> None:
    line = Line()
    line.set("lose")
    line.set("lose", at_frame=2)
    assert line.faults.clear() == 2
    assert await line.numbered(3) == [0, 1, 2]
    assert (line.faults.told(), line.medium.faults) == ([], None)


@pytest.mark.parametrize(("seeds", "same"), [((3, 3), True), ((3, 4), False)])
def test_which_frames_are_struck_follows_from_the_seed(seeds: tuple[int, int], same: bool) -> None:
    async def run(seed: int) -> list[int]:
        line = Line(seed)
        line.set("lose", probability=0.3)
        return await line.numbered(50)

    assert (run_virtual(run(seeds[0])) == run_virtual(run(seeds[1]))) is same
