"""Faults of simulated devices that strike one of them at the same time, or one that has no power."""

from __future__ import annotations

import asyncio
from typing import Any

import msgspec
import pytest

from canhelm.errors import UsageError
from drivers.epos.state_machine import State
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.device_faults import Site
from drivers.simulated.faults import Faults
from drivers.simulated.network import SimulatedNetwork
from profiles.faults import Fault
from profiles.loader import load

PROFILE = load("max2d").profile
PART = "front_left"


class Robot:
    """A network that has power, and its faults."""

    def __init__(self) -> None:
        medium = SimulatedBus()
        self.network = SimulatedNetwork(PROFILE, medium, 1)
        self.network.power_on("all")
        self.faults = Faults(Site(self.network, medium), 1)

    def set(self, kind: str, **fields: Any) -> int:
        """A fault of the front left drive; its number."""
        told = self.faults.add(msgspec.convert({"kind": kind, "part": PART, **fields}, Fault))
        return int(told["fault"])

    @property
    def device_type(self) -> object:
        """What the drive says that it is."""
        return self.network.drives[PART].dictionary.getter((0x1000, 0))()


async def test_of_two_lies_about_one_object_the_later_one_is_said_until_it_is_taken_away() -> None:
    robot = Robot()
    truth = robot.device_type
    first, second = robot.set("wrong_identity", value=7), robot.set("wrong_identity", value=8)
    robot.faults.clear(first)
    assert robot.device_type == 8
    robot.faults.clear(second)
    assert robot.device_type == truth


async def test_the_later_one_of_two_lies_takes_the_earlier_one_with_it() -> None:
    robot = Robot()
    truth = robot.device_type
    first, second = robot.set("wrong_identity", value=7), robot.set("wrong_identity", value=8)
    robot.faults.clear(second)
    assert robot.device_type == truth
    assert robot.faults.clear(first) == 1
    assert robot.device_type == truth


async def test_a_power_cycle_gives_no_power_to_a_node_that_had_none() -> None:
    robot = Robot()
    robot.network.power_off(PART)
    robot.set("power_cycle", for_s=0.5)
    await asyncio.sleep(1.0)
    assert not robot.network.drives[PART].powered


async def test_a_communication_that_is_reset_while_its_node_starts_does_not_keep_it_from_starting() -> None:
    robot = Robot()
    robot.network.power_off(PART)
    robot.network.power_on(PART)
    robot.set("communication_reset")
    await asyncio.sleep(1.0)
    assert robot.network.drives[PART].control.state is State.SWITCH_ON_DISABLED


@pytest.mark.parametrize(
    "fault", [{"kind": "disk_full"}, {"kind": "disk_slow", "delay_s": 1.0}, {"kind": "clock_jump", "jump_s": 1.0}]
)
async def test_a_network_without_its_daemon_has_no_computer_to_break(fault: dict[str, Any]) -> None:
    with pytest.raises(UsageError, match="the daemon is in another process"):
        Robot().faults.add(msgspec.convert(fault, Fault))
