from __future__ import annotations

from math import pi

import msgspec
import pytest

from drivers.simulated.motor import WheelDrive
from profiles.loader import load
from profiles.schema import DriveConfig, SimulationConfig

DT_S = 0.001
LOAD_N = 70.0
PROFILE = load("max2d").profile
LEFT = PROFILE.drives["front_left"]
RIGHT = PROFILE.drives["front_right"]


def simulation() -> SimulationConfig:
    assert PROFILE.simulation is not None
    return PROFILE.simulation


def without_rolling_resistance() -> SimulationConfig:
    tyre = msgspec.structs.replace(simulation().tyre, rolling_resistance=0.0)
    return msgspec.structs.replace(simulation(), tyre=tyre)


class ConstantCurrent:
    """A power stage that always demands the same current."""

    def __init__(self, current_a: float) -> None:
        self.current_a = current_a

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        return self.current_a


def run(config: DriveConfig, current_a: float, contact_force_n: float = 0.0, time_s: float = 5.0) -> WheelDrive:
    drive = WheelDrive(config, without_rolling_resistance())
    drive.axis.torque_source = ConstantCurrent(current_a)
    for _ in range(round(time_s / DT_S)):
        drive.ask(DT_S)
        drive.turn(contact_force_n, LOAD_N, DT_S)
    return drive


def rpm(drive: WheelDrive) -> float:
    return drive.axis.speed_rad_s * 30.0 / pi


def test_the_motor_meets_its_published_load_point() -> None:
    lossless = msgspec.structs.replace(LEFT, gear_efficiency=1.0)
    force = 0.0482 * LEFT.total_ratio / LEFT.wheel_radius_m
    drive = run(lossless, current_a=10.0, contact_force_n=force)
    assert rpm(drive) == pytest.approx(10400.0, rel=0.01)
    assert drive.axis.current_a == pytest.approx(2.64, rel=0.01)


@pytest.mark.parametrize("sense", [1, -1])
def test_without_load_only_the_no_load_current_flows(sense: int) -> None:
    lossless = msgspec.structs.replace(LEFT, gear_efficiency=1.0)
    drive = run(lossless, current_a=sense * 5.0)
    assert drive.axis.current_a == pytest.approx(sense * LEFT.motor.no_load_current_a, rel=1e-3)


def test_less_than_the_no_load_current_does_not_move_the_wheel() -> None:
    drive = run(LEFT, current_a=0.9 * LEFT.motor.no_load_current_a)
    assert drive.wheel_rad_s == 0.0


def test_a_mirrored_motor_turns_backward_while_the_wheel_rolls_forward() -> None:
    drive = run(RIGHT, current_a=-1.0, time_s=0.1)
    assert drive.axis.speed_rad_s < 0.0 < drive.rim_m_s


def test_the_shaft_turns_by_the_whole_ratio() -> None:
    drive = run(LEFT, current_a=1.0, time_s=0.5)
    assert drive.axis.speed_rad_s == pytest.approx(28.0 * drive.rim_m_s / 0.10)


@pytest.mark.parametrize(("needed", "moves"), [(0.98, True), (1.02, False)])
def test_the_gear_lets_its_efficiency_of_the_torque_through(needed: float, moves: bool) -> None:
    current = 2.0
    torque = (
        LEFT.total_ratio
        * LEFT.motor.torque_constant_n_m_a
        * (LEFT.gear_efficiency * current - LEFT.motor.no_load_current_a)
    )
    drive = run(LEFT, current, contact_force_n=needed * torque / LEFT.wheel_radius_m, time_s=0.05)
    assert (drive.wheel_rad_s > 0.0) is moves


def test_a_wheel_that_drives_its_motor_feels_the_gear_loss_on_top() -> None:
    current = -1.0
    holding = (
        LEFT.total_ratio
        * LEFT.motor.torque_constant_n_m_a
        * (-current / LEFT.gear_efficiency + LEFT.motor.no_load_current_a)
    )
    drive = WheelDrive(LEFT, without_rolling_resistance())
    drive.axis.torque_source = ConstantCurrent(current)
    drive.wheel_rad_s = 5.0
    for _ in range(100):
        drive.ask(DT_S)
        drive.turn(-holding / LEFT.wheel_radius_m, LOAD_N, DT_S)
    assert drive.wheel_rad_s == pytest.approx(5.0)


def test_friction_stops_a_free_wheel_exactly() -> None:
    drive = WheelDrive(LEFT, simulation())
    drive.wheel_rad_s = -0.5
    for _ in range(1000):
        drive.turn(0.0, LOAD_N, DT_S)
    assert drive.wheel_rad_s == 0.0
    assert drive.axis.speed_rad_s == 0.0


def test_supply_and_back_emf_limit_the_current() -> None:
    drive = WheelDrive(LEFT, simulation())
    drive.axis.torque_source = ConstantCurrent(100.0)
    drive.ask(DT_S)
    drive.turn(0.0, LOAD_N, DT_S)
    assert drive.axis.current_a == pytest.approx(24.0 / 1.2)


def test_a_motor_pulled_beyond_its_no_load_speed_brakes_without_a_demand() -> None:
    drive = WheelDrive(LEFT, simulation())
    drive.wheel_rad_s = 60.0
    for _ in range(2):
        drive.turn(0.0, LOAD_N, DT_S)
    assert drive.axis.current_a < 0.0


def test_a_changed_demand_is_noticed() -> None:
    drive = WheelDrive(LEFT, simulation())
    drive.axis.torque_source = ConstantCurrent(0.5)
    assert [drive.ask(DT_S), drive.ask(DT_S)] == [True, False]


def test_the_shaft_starts_within_one_count() -> None:
    drive = WheelDrive(LEFT, simulation(), phase=0.5)
    assert drive.axis.position_rad == pytest.approx(pi / 2000)
