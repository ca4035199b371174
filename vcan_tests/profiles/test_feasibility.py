"""What mass, tyres, motors, supply and bus allow."""

from __future__ import annotations

import math
from dataclasses import replace

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from profiles import feasibility
from profiles.feasibility import Load, max_acceleration_m_s2, max_deceleration_m_s2, max_speed_m_s
from profiles.loader import load
from profiles.schema import DriveConfig
from vcan_tests.profiles.conftest import Mistakes, Robot

LOAD = Load(mass_kg=7.0, weight_n=7.0 * 9.81, wheel_inertia_kg_m2=0.008, friction=0.8, rolling_resistance=0.015)


@pytest.fixture(scope="module")
def drive() -> DriveConfig:
    """One wheel of the MAX2D."""
    return load("max2d").profile.drives["rear_left"]


@pytest.mark.parametrize(
    ("yaml", "mistake"),
    [
        (
            "quick_stop_m_s2: 2.4",
            "quick_stop_m_s2: is 2.4 m/s^2, mass, tyre and current allow 2.31 m/s^2; write at most 2.31",
        ),
        ("acceleration_m_s2: 2.2", "acceleration_m_s2: is 2.2 m/s^2, mass, tyre and current allow 2.19 m/s^2;"),
        ("max_speed_m_s: 3.5", "max_speed_m_s: is 3.5 m/s, 24 V allow 3.44 m/s; write at most 3.44"),
        ("output_current_a: 5.3", "output_current_a: is 5.3 A, twice the continuous is 5.28 A; write at most 5.28"),
        ("continuous_current_a: 2.7", "continuous_current_a: is 2.7 A, the motor carries 2.64 A; write at most 2.64"),
    ],
)
def test_a_drive_that_asks_for_too_much_is_told_what_is_possible(mistakes: Mistakes, yaml: str, mistake: str) -> None:
    assert f"drives.rear_left.{mistake}" in mistakes(f"drives: {{rear_left: {{{yaml}}}}}")[0]


@pytest.mark.parametrize(
    ("yaml", "mistake"),
    [
        ("limits: {speed_m_s: 2.5}", "limits.speed_m_s: is 2.5 m/s, the wheels' limit is 2 m/s; write at most 2"),
        ("limits: {wheel_speed_m_s: 2.5}", "limits.wheel_speed_m_s: is 2.5 m/s, drive rear_right allows 2 m/s;"),
        (
            "limits: {acceleration_m_s2: 1.6}",
            "limits.acceleration_m_s2: is 1.6 m/s^2, drive rear_right allows 1.4 m/s^2;",
        ),
        ("limits: {steering_rim_speed_m_s: 3}", "limits.steering_rim_speed_m_s: is 3 m/s, the wheels' limit is 2 m/s;"),
        ("limits: {heading_deg: 88}", "limits.heading_deg: is 88 deg, the stops are at 88 deg; write less than 88"),
        (
            "limits: {heading_tolerance_deg: 0.05}",
            "limits.heading_tolerance_deg: is 0.05 deg, one count of the encoder is",
        ),
        ("network: {bit_rate: 20000}", "network.cycle_hz: is 100 Hz, the bit rate allows 11.2 Hz; write at most 11.2"),
        ("simulation: {supply_voltage_v: 12}", "max_speed_m_s: is 2 m/s, 12 V allow 1.42 m/s; write at most 1.42"),
        (
            "simulation: {tyre: {friction: 0.1}}",
            "quick_stop_m_s2: is 1.4 m/s^2, mass, tyre and current allow 0.981 m/s^2;",
        ),
    ],
)
def test_a_limit_that_cannot_be_kept_is_told_what_is_possible(mistakes: Mistakes, yaml: str, mistake: str) -> None:
    assert [found for found in mistakes(yaml) if mistake in found]


def test_the_largest_permitted_value_is_permitted(robot: Robot) -> None:
    assert robot("drives: {rear_left: {quick_stop_m_s2: 2.31}}").profile.drives["rear_left"].quick_stop_m_s2 == 2.31


def test_without_tyre_data_a_warning_says_what_is_not_checked(robot: Robot) -> None:
    assert "ramps are not checked against friction" in robot("simulation: ").warnings[0]


def test_the_quick_stop_of_the_max2d_by_hand(drive: DriveConfig) -> None:
    force_n = 0.0191 * (5.0 - 0.12) * 28 * 0.75 / 0.1
    mass_kg = 7.0 + (0.008 + 28**2 * 8.5e-6) / 0.1**2
    assert max_deceleration_m_s2(drive, LOAD) == pytest.approx(force_n / mass_kg)


def test_rolling_resistance_costs_acceleration(drive: DriveConfig) -> None:
    rolling = 0.015 * 7.0 * 9.81 / feasibility.moved_mass_kg(drive, LOAD)
    assert max_deceleration_m_s2(drive, LOAD) - max_acceleration_m_s2(drive, LOAD) == pytest.approx(rolling)


def test_a_slippery_floor_limits_the_quick_stop(drive: DriveConfig) -> None:
    assert max_deceleration_m_s2(drive, replace(LOAD, friction=0.05)) == pytest.approx(0.05 * 9.81)


def test_speed_is_where_back_emf_and_winding_use_the_supply_up(drive: DriveConfig) -> None:
    motor_rad_s = max_speed_m_s(drive, 24.0) * drive.total_ratio / drive.wheel_radius_m
    assert motor_rad_s * 0.0191 + 1.2 * 2.64 == pytest.approx(0.9 * 24.0)


def test_no_drive_turns_its_motor_faster_than_its_object_allows(drive: DriveConfig) -> None:
    fast = msgspec.structs.replace(drive, motor=msgspec.structs.replace(drive.motor, torque_constant_n_m_a=0.001))
    motor_rad_s = max_speed_m_s(fast, 24.0) * fast.total_ratio / fast.wheel_radius_m
    assert motor_rad_s * 60 / math.tau == pytest.approx(25_000)


@given(st.floats(0.1, 100), st.floats(0.01, 2))
def test_more_mass_never_allows_a_steeper_ramp(mass_kg: float, friction: float) -> None:
    drive = load("max2d").profile.drives["rear_left"]
    light = replace(LOAD, mass_kg=mass_kg, friction=friction)
    heavy = replace(light, mass_kg=2 * mass_kg)
    assert max_deceleration_m_s2(drive, heavy) <= max_deceleration_m_s2(drive, light)
