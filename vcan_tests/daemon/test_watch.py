"""Which silence stops the vehicle, and whom it blames."""

from __future__ import annotations

import math

import pytest

from daemon.app import App
from daemon.runtime.watch import DeviceWatch
from drivers.bus.contract import Bus
from drivers.canopen.master import NodeEvent
from drivers.contract import NodeState
from drivers.devices import Devices
from drivers.simulated.bus import SimulatedBus
from profiles.loader import load

PERIOD_S = 0.01


@pytest.fixture
def devices() -> Devices:
    """All six nodes of a MAX2D, ready, read at 1.000 s."""
    devices = App(load("max2d").profile).devices
    for device in devices.by_node.values():
        device.node_state = NodeState.READY
        device.reading_time_s = 1.0
    return devices


def interface(down: str | None = None) -> Bus:
    """An interface that nobody uses, and what is wrong with it."""
    bus = SimulatedBus(1_000_000, "can0").port("master")
    bus.down = down
    return bus


def watching(devices: Devices, *looks_s: float, down: str | None = None) -> str:
    """What is found at the last look.

    Args:
        looks_s: when it is looked.
        down: what is wrong with the interface.
    """
    watch = DeviceWatch(devices, PERIOD_S, interface(down))
    faults = [watch.look(now_s, powered=True) for now_s in looks_s]
    return str(faults[-1])


def test_a_node_that_was_read_lately_is_not_silent(devices: Devices) -> None:
    assert watching(devices, 1.0, 1.01, 1.02, 1.03, 1.04) == "None"


def test_a_silent_node_is_to_be_looked_for_on_the_cable(devices: Devices) -> None:
    watch = DeviceWatch(devices, PERIOD_S, interface())
    for number in range(7):
        devices.by_node[2].reading_time_s = now_s = 1.0 + PERIOD_S * number
        told = str(watch.look(now_s, powered=True))
    assert "node 1 (rear_right) is silent; stop commanded 60 ms after its last reading (check its power" in told


def test_where_no_node_answers_the_cable_is_to_be_looked_at_first(devices: Devices) -> None:
    told = watching(devices, *(1.0 + PERIOD_S * number for number in range(7)))
    assert "no node answers; stop commanded 60 ms after its last reading (check the cable to the robot" in told


def test_where_the_interface_is_down_no_node_is_blamed(devices: Devices) -> None:
    told = watching(devices, *(1.0 + PERIOD_S * number for number in range(7)), down="bus-off")
    assert told.startswith("can0 does not work: bus-off; stop commanded 60 ms after its last reading")


def test_a_pause_of_the_daemon_alone_makes_no_node_silent(devices: Devices) -> None:
    assert watching(devices, 1.0, 1.25, 1.26) == "None"


def test_cycles_that_may_be_slow_are_not_late(devices: Devices) -> None:
    watch = DeviceWatch(devices, PERIOD_S, interface(), late_after_cycles=3.0)
    faults = [watch.look(1.0 + 5 * PERIOD_S * number, powered=True) for number in range(7)]
    assert faults[-1] is not None
    assert "late" not in faults[-1].message


def test_a_daemon_that_was_late_itself_says_so(devices: Devices) -> None:
    told = watching(devices, 1.0, *(1.07 + PERIOD_S * number for number in range(7)))
    assert "the daemon itself was 60 ms late meanwhile (look for what loads this machine" in told


def test_a_lateness_before_the_last_reading_is_no_excuse(devices: Devices) -> None:
    told = watching(devices, 0.9, 0.98, 0.99, *(1.0 + PERIOD_S * number for number in range(7)))
    assert "late" not in told


@pytest.mark.parametrize("read_s", [-math.inf, 2.0])
def test_a_reading_of_another_life_says_nothing_of_how_soon_the_stop_came(devices: Devices, read_s: float) -> None:
    devices.by_node[1].reading_time_s = read_s
    event = NodeEvent(100.0, 1, "rear_right", "lost", "error", "node 1 is lost", "check the cable")
    assert str(DeviceWatch(devices, PERIOD_S, interface()).lost(event)) == "node 1 is lost (check the cable)"


def test_a_lost_node_is_not_blamed_for_the_daemons_lateness_either(devices: Devices) -> None:
    watch = DeviceWatch(devices, PERIOD_S, interface())
    for now_s in (1.0, 1.25):
        watch.look(now_s, powered=False)
    event = NodeEvent(1.26, 1, "rear_right", "lost", "error", "node 1 is lost", "check the cable")
    assert "stop commanded 260 ms after its last reading; the daemon itself was 240 ms late" in str(watch.lost(event))
