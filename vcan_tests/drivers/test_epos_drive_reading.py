"""What the EPOS driver makes of its wheel's units and of what the drive sends."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import UsageError
from drivers.canopen.master import Master
from drivers.contract import DriveState
from drivers.epos.codec import TPDO1
from drivers.epos.drive import EposDrive
from drivers.epos.objects import OBJECTS
from drivers.epos.units import WheelUnits
from drivers.simulated.bus import SimulatedBus
from vcan_tests.drivers.bench import bench, max2d

CONFIG = max2d().drives["front_left"]
DISABLED = 0x0140


def lonely_drive() -> EposDrive:
    """A drive without a network, fed by hand."""
    return EposDrive(Master(SimulatedBus().port("master"), max2d().network), "front_left", CONFIG)


def feed(drive: EposDrive, time_s: float, position_qc: int, statusword: int = DISABLED) -> None:
    position_qc = (position_qc + 2**31) % 2**32 - 2**31
    receiver = drive.master.bus.receiver
    assert receiver is not None
    receiver(0x183, TPDO1.pack(statusword, position_qc, 0), time_s)


def test_a_turn_of_the_wheel_is_gear_times_encoder() -> None:
    units = WheelUnits.of(CONFIG)
    circumference_m = 2 * math.pi * CONFIG.wheel_radius_m
    assert circumference_m / units.m_per_qc == pytest.approx(14 * 2 * 2000)
    assert circumference_m * units.rpm_per_m_s == pytest.approx(60 * 14 * 2)


def test_a_mirrored_motor_turns_the_other_way() -> None:
    mirrored = WheelUnits.of(msgspec.structs.replace(CONFIG, direction=-1))
    assert mirrored.rpm_per_m_s == -WheelUnits.of(CONFIG).rpm_per_m_s


@given(st.floats(-5, 5))
def test_speeds_at_rim_and_motor_are_inverse(speed_m_s: float) -> None:
    drive = lonely_drive()
    assert drive.speed_from_rpm(drive.rpm_from_speed(speed_m_s)) == pytest.approx(speed_m_s)


@given(st.integers(-(2**31), 2**31 - 1), st.lists(st.integers(-900, 900), min_size=1, max_size=20))
def test_travel_is_the_sum_of_the_steps_over_every_wrap(start_qc: int, steps: list[int]) -> None:
    drive = lonely_drive()
    feed(drive, 0.0, start_qc)
    position = start_qc
    for number, step in enumerate(steps, 1):
        position += step
        feed(drive, 0.01 * number, position)
    assert drive.position_m == pytest.approx(sum(steps) * WheelUnits.of(CONFIG).m_per_qc)


def test_speed_is_the_difference_over_two_intervals() -> None:
    drive = lonely_drive()
    for number in range(4):
        feed(drive, 0.01 * number, 100 * number)
    assert drive.speed_m_s == pytest.approx(100 * WheelUnits.of(CONFIG).m_per_qc / 0.01)


def test_a_new_reference_is_no_travel() -> None:
    drive = lonely_drive()
    for number, position in enumerate((0, 100, 200, 500_000, 500_100, 500_200)):
        feed(drive, 0.01 * number, position)
    assert drive.position_m == pytest.approx(400 * WheelUnits.of(CONFIG).m_per_qc)
    assert abs(drive.speed_m_s) < 0.2


def test_a_reading_without_a_known_state_is_unknown() -> None:
    drive = lonely_drive()
    feed(drive, 0.0, 0, 0x0041)
    assert drive.state is DriveState.UNKNOWN


@given(st.binary(max_size=12))
def test_no_frame_on_its_identifier_raises(data: bytes) -> None:
    drive = lonely_drive()
    receiver = drive.master.bus.receiver
    assert receiver is not None
    receiver(0x183, data, 0.0)
    assert drive.master.counters.malformed == (len(data) != 8)


async def test_status_is_plain_data() -> None:
    async with bench() as b:
        status: dict[str, Any] = b.drive().status()
        assert msgspec.json.decode(msgspec.json.encode(status)) == status
        assert {"node", "name", "node_state", "state", "velocity_rpm", "speed_m_s", "current_a", "fault"} <= set(status)


async def test_text_is_no_number() -> None:
    async with bench() as b:
        with pytest.raises(UsageError, match="no number"):
            await b.drive().sdo.read_int(OBJECTS["device_name"])
