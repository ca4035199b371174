"""The profile of a robot on omni-wheels, and the checks that are for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from profiles.loader import ProfileError, load
from profiles.schema import OmniGeometry
from vcan_tests.profiles.conftest import Mistakes


@pytest.fixture
def head() -> str:
    """Of a robot that extends the turtle; what a test adds begins on line 3."""
    return "schema_version: 1\nextends: turtle\n"


def test_the_turtles_wheels_roll_as_its_report_says() -> None:
    vehicle = load("turtle").profile.vehicle
    assert isinstance(vehicle, OmniGeometry)
    assert [(name, wheel.direction_deg) for name, wheel in vehicle.wheels.items()] == [
        ("wheel_1", 240),
        ("wheel_2", 0),
        ("wheel_3", 120),
    ]


@pytest.mark.parametrize(
    ("yaml", "mistake"),
    [
        ("vehicle: {type: hovercraft}", "vehicle.type: is 'hovercraft'; write type: with one of paired_steer, omni"),
        ("vehicle: {wheels: {wheel_9: {direction_deg: 0, lever_m: 1}}}", "vehicle.wheels.wheel_9: drives has no"),
        ("vehicle: {wheels: {wheel_1: {lever_m: -0.4}}}", "vehicle.wheels: leave a motion of the robot undetermined"),
        ("vehicle: {wheels: {wheel_2: {lever_m: nought}}}", "vehicle.wheels.wheel_2.lever_m: is 'nought'; write a"),
        ("accelerometer: {drive: wheel_2}", "accelerometer.drive: wheel_2 does not tell its analog inputs; write"),
        ("accelerometer: {drive: wheel_9}", "accelerometer.drive: drives has no 'wheel_9'; use one of: wheel_1"),
        ("limits: {yaw_rate_deg_s: 300}", "limits.yaw_rate_deg_s: is 300 deg/s, what the wheels' limit leaves"),
        ("drives: {wheel_1: {acceleration_m_s2: 3.2}}", "drives.wheel_1.acceleration_m_s2: is 3.2 m/s^2, mass, tyre"),
        ("simulation: {tyre: {friction: 0.2}}", "drives.wheel_1.acceleration_m_s2: is 2.4 m/s^2, mass, tyre and"),
        ("accelerometer: null", "traction: the currents of wheel_1 tell no slip while it ramps by itself; write mode:"),
        ("simulation: {floor: {ice: {friction: -1}}}", "simulation.floor.ice.friction: is -1; write a number from 0"),
    ],
)
def test_what_does_not_fit_is_a_mistake_at_its_place(mistakes: Mistakes, yaml: str, mistake: str) -> None:
    assert [found for found in mistakes(yaml) if f": {mistake}" in found]


def test_a_vehicle_needs_the_limits_of_its_type(tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    path.write_text("schema_version: 1\nextends: max2d\nvehicle: {extends: vehicles/turtle, type: omni}\n")
    with pytest.raises(ProfileError, match="yaw_rate_deg_s: is missing, a vehicle of type omni needs it; write"):
        load(path)


def test_a_faster_cycle_than_the_bus_carries_counts_the_accelerometers_frame(mistakes: Mistakes) -> None:
    assert "network.cycle_hz: is 800 Hz, the bit rate allows 7" in mistakes("network: {cycle_hz: 800}")[0]
