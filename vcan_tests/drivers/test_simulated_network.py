"""The simulated network of the MAX2D as a bare master sees it."""

from __future__ import annotations

import asyncio
from typing import cast

import pytest

from daemon.runtime.clock import VirtualTimeLoop
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.network import SimulatedNetwork
from profiles.loader import load
from vcan_tests.drivers.epos_bench import RawMaster

PROFILE = load("max2d").profile
DRIVES = (1, 2, 3, 4)


class NetworkBench:
    """The network with a raw master on its bus."""

    def __init__(self, seed: int = 1) -> None:
        self.medium = SimulatedBus()
        self.network = SimulatedNetwork(PROFILE, self.medium, seed)
        self.master = RawMaster(self.medium)

    @classmethod
    async def booted(cls) -> NetworkBench:
        """A network that has power and has booted."""
        bench = cls()
        bench.network.power_on()
        await asyncio.sleep(0.2)
        return bench

    async def drive(self, speed_rpm: int) -> None:
        """Enable all drives in mode 3, each towards rolling forward."""
        for node in DRIVES:
            config = next(config for config in PROFILE.drives.values() if config.node == node)
            await self.master.u8(node, 0x6060, 0, 3)
            await self.master.u32(node, 0x60FF, 0, config.direction * speed_rpm)
            for word in (0x06, 0x0F):
                await self.master.u16(node, 0x6040, 0, word)

    def boots(self) -> set[int]:
        """Nodes whose boot-up message was heard."""
        return {can_id - 0x700 for can_id, data in self.master.heard if 0x700 < can_id < 0x780 and data == b"\0"}


async def test_every_node_of_the_profile_boots_in_its_time() -> None:
    bench = await NetworkBench.booted()
    assert bench.boots() == {1, 2, 3, 4, 5, 6}
    assert all(0.05 < time_s < 0.151 for time_s in bench.master.times_s)


async def test_nothing_is_heard_without_power() -> None:
    bench = NetworkBench()
    await asyncio.sleep(1.0)
    assert bench.master.heard == []


async def test_the_seed_decides_the_boot_delays() -> None:
    delays = [[drive.boot_delay_s for drive in NetworkBench(seed).network.drives.values()] for seed in (1, 1, 2)]
    assert delays[0] == delays[1] != delays[2]


async def test_a_node_is_found_by_name_and_by_id() -> None:
    network = NetworkBench().network
    assert network.node("front_left") is network.node(3) is network.node("3") is network.drives["front_left"]
    with pytest.raises(KeyError):
        network.node("nobody")


async def test_one_node_is_switched_off_and_on() -> None:
    bench = await NetworkBench.booted()
    bench.master.heard.clear()
    bench.network.power_off("front_left")
    bench.network.power_on(3)
    await asyncio.sleep(0.2)
    assert bench.boots() == {3}


async def test_the_robot_drives_forward() -> None:
    bench = await NetworkBench.booted()
    await bench.drive(1337)  # 1337 rpm / 28 * 2 pi * 0.1 m = 0.5 m/s
    await asyncio.sleep(2.0)
    speed, sideways, _ = bench.network.world.velocity
    assert speed == pytest.approx(0.5, rel=0.01)
    assert abs(sideways) < 0.01


async def test_faults_are_noticed_while_nobody_looks() -> None:
    bench = await NetworkBench.booted()
    await bench.drive(1000)
    await bench.master.u16(1, 0x100C, 0, 50)
    await bench.master.u8(1, 0x100D, 0, 2)
    await bench.master.guard(1)
    bench.master.heard.clear()
    await asyncio.sleep(2.0)
    assert [data[:2].hex() for data in bench.master.of(0x081)] == ["3081"]
    assert await bench.master.read(1, 0x6041) & 0x417F == 0x108


async def test_brakes_are_engaged_without_power_and_follow_their_output() -> None:
    bench = await NetworkBench.booted()
    brakes = bench.network.brakes
    assert all(brake.engaged for brake in brakes.values())
    await bench.master.u16(1, 0x2078, 1, 0x1000)
    await bench.master.u16(1, 0x2078, 2, 0x1000)
    await asyncio.sleep(0.1)
    assert brakes["rear"].engaged
    await bench.master.u16(1, 0x2078, 1, 0)
    await asyncio.sleep(0.1)
    assert (brakes["rear"].engaged, brakes["front"].engaged) == (False, True)


async def test_a_released_brake_engages_when_its_drive_loses_power() -> None:
    bench = await NetworkBench.booted()
    await bench.master.u16(3, 0x2078, 2, 0x1000)
    await asyncio.sleep(0.1)
    assert not bench.network.brakes["front"].engaged
    bench.network.power_off(3)
    await asyncio.sleep(0.1)
    assert bench.network.brakes["front"].engaged


async def test_a_released_pair_turns_by_opposite_wheel_speeds_and_its_encoder_sees_it() -> None:
    bench = await NetworkBench.booted()
    await bench.master.u16(3, 0x2078, 2, 0x1000)
    await asyncio.sleep(0.1)
    for node in DRIVES:
        await bench.master.u8(node, 0x6060, 0, 3)
        await bench.master.u32(node, 0x60FF, 0, {3: -200, 4: -200}.get(node, 0))  # left back, mirrored right forward
        for word in (0x06, 0x0F):
            await bench.master.u16(node, 0x6040, 0, word)
    await asyncio.sleep(0.5)
    counts = await bench.master.read(6, 0x6004)
    heading = bench.network.world.heading_rad("front")
    assert heading > 0.2
    assert counts == pytest.approx(2048 + heading / 6.283185307 * 4096, abs=3)


async def test_a_network_at_rest_sets_no_timers() -> None:
    bench = await NetworkBench.booted()
    await bench.drive(500)
    await asyncio.sleep(1.0)
    for node in DRIVES:
        await bench.master.u16(node, 0x6040, 0, 0)
    await asyncio.sleep(20.0)
    assert not bench.network.world.moving
    loop = cast(VirtualTimeLoop, asyncio.get_running_loop())
    assert [timer for _, _, timer in loop._timers if not timer.cancelled()] == []


async def test_a_closed_network_is_silent() -> None:
    bench = await NetworkBench.booted()
    await bench.network.close()
    bench.master.heard.clear()
    await bench.master.send(0x601, "4000100000000000")
    await asyncio.sleep(1.0)
    assert bench.master.heard == []


async def test_two_runs_with_one_seed_are_the_same_to_the_bit() -> None:
    logs = []
    for _ in range(2):
        bench = await NetworkBench.booted()
        await bench.drive(800)
        for _ in range(50):
            await bench.master.read(1, 0x6078)
        logs.append([data for _, data in bench.master.heard])
        await bench.network.close()
    assert logs[0] == logs[1]
