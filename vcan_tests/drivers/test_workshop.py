"""A simulated robot in the workshop: on blocks, turned and pushed by hand, looked at; drives from the factory."""

from __future__ import annotations

import asyncio

import msgspec
import pytest

from drivers.simulated.bus import SimulatedBus
from drivers.simulated.network import SimulatedNetwork
from drivers.simulated.workshop import Workshop
from profiles.loader import load
from vcan_tests.robot import running_robot

MAX2D = load("max2d").profile


def workshop() -> Workshop:
    """The MAX2D, without power, on the floor."""
    return Workshop(MAX2D, SimulatedNetwork(MAX2D, SimulatedBus(), 1))


async def test_wheels_in_the_air_turn_and_the_robot_stays() -> None:
    async with running_robot() as robot:
        await robot.call("simulation.lift", lifted=True)
        before = (await robot.call("simulation.look"))["wheel_deg"]
        await robot.call("motor.velocity", node="rear_left", wheel_speed_m_s=0.1, duration_s=2.0)
        after = (await robot.call("simulation.look"))["wheel_deg"]
        turned = {name: after[name] - before[name] for name in after}
        assert turned["rear_left"] == pytest.approx(115.0, abs=5.0)
        assert [turned[name] for name in turned if name != "rear_left"] == [0.0, 0.0, 0.0]
        assert robot.network.world.pose == (0.0, 0.0, 0.0)


async def test_a_wheel_is_turned_by_hand_only_in_the_air() -> None:
    shop = workshop()
    assert await shop.turn("rear_left", 90.0) == 0.0
    shop.lift(True)
    before = shop.look()["wheel_deg"]["rear_left"]
    assert await shop.turn("rear_left", 90.0) == pytest.approx(90.0, abs=0.1)
    assert shop.look()["wheel_deg"]["rear_left"] - before == pytest.approx(90.0, abs=0.1)


async def test_a_pair_gives_way_only_when_its_brake_is_released() -> None:
    async with running_robot() as robot:
        assert (await robot.call("simulation.hand", name="front", angle_deg=20.0))["turned_deg"] == 0.0
        await robot.call("brake.release", pair="front")
        assert (await robot.call("simulation.hand", name="front", angle_deg=20.0))["turned_deg"] == 20.0
        assert (await robot.call("simulation.hand", name="rear", angle_deg=20.0))["turned_deg"] == 0.0


async def test_a_drive_from_the_factory_has_node_id_1_and_knows_no_motor() -> None:
    assert MAX2D.simulation is not None
    simulation = msgspec.structs.replace(MAX2D.simulation, factory=("front_left",))
    network = SimulatedNetwork(msgspec.structs.replace(MAX2D, simulation=simulation), SimulatedBus(), 1)
    network.power_on()
    await asyncio.sleep(0.3)
    new, old = network.drives["front_left"], network.drives["rear_left"]
    assert (new.node_id, old.node_id) == (1, 2)
    assert (new.dictionary.number("motor_type"), old.dictionary.number("motor_type")) == (10, 11)
    await network.close()
