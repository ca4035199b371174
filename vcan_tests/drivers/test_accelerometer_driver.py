"""The accelerometer at the analog inputs of a drive, over the simulated bus."""

from __future__ import annotations

import asyncio

import pytest

from drivers.epos.codec import TPDO2
from drivers.epos.drive import EposDrive
from drivers.epos.objects import OBJECTS
from profiles.loader import load
from vcan_tests.robot import running_robot

TURTLE = load("turtle").profile


async def test_voltages_become_accelerations_of_the_sensors_axes() -> None:
    async with running_robot(TURTLE) as robot:
        drive = robot.network.drives["wheel_1"]
        drive.set_analog_input(1, 2700)
        drive.set_analog_input(2, 2450)
        await asyncio.sleep(0.03)
        sensor = robot.app.devices.accelerometer
        assert sensor is not None
        assert sensor.acceleration_m_s2 == pytest.approx((2.0, -0.5))


async def test_the_reading_belongs_to_the_cycle_whose_step_it_serves() -> None:
    async with running_robot(TURTLE) as robot:
        ages: list[float] = []
        drive = robot.app.devices.by_node[1]
        assert isinstance(drive, EposDrive)

        def look() -> None:
            ages.append(drive.analog_time_s - drive.reading_time_s)

        robot.app.supervisor.observers.append(look)
        await asyncio.sleep(0.2)
        assert all(0.0 < age < 0.002 for age in ages)
        assert robot.app.cycle.counters.incomplete == 0


async def test_a_reading_that_no_longer_comes_is_none() -> None:
    async with running_robot(TURTLE, expect_errors=True) as robot:
        sensor = robot.app.devices.accelerometer
        assert sensor is not None
        await robot.app.master.sdo(1).write(OBJECTS.by_address[0x1801, 1], 0x8000_0281)
        await asyncio.sleep(0.2)
        assert sensor.acceleration_m_s2 is None
        assert robot.app.vehicle.status()["acceleration_m_s2"] is None


async def test_a_frame_of_the_wrong_length_is_counted_and_dropped() -> None:
    async with running_robot(TURTLE, expect_errors=True) as robot:
        port = robot.app.medium.port("liar") if robot.app.medium else None
        assert port is not None
        await port.open()
        port.send(0x281, TPDO2.pack(1, 2, 0) + b"\x00")
        await asyncio.sleep(0.01)
        assert robot.app.master.counters.malformed == 1
        await port.close()
