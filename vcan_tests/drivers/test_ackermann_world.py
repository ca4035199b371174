"""The simulated car's body: rest, straight driving, steady circles, stops, against rigid-body results."""

from __future__ import annotations

import math

import msgspec
import pytest

from canhelm.errors import ConfigError
from drivers.simulated.ackermann import AckermannWorld
from profiles.loader import load

PROFILE = load("ackermann").profile


class Speed:
    """Drives a motor at a speed by a stiff regulator, whatever resists."""

    def __init__(self, speed_rad_s: float) -> None:
        self.speed_rad_s = speed_rad_s

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        return 0.3 * (self.speed_rad_s - speed_rad_s)


def steered(steering_rad_s: float, steering_s: float) -> AckermannWorld:
    """A car whose steering was turned for a time and is held."""
    world, steering = AckermannWorld(PROFILE), Speed(100.0 * steering_rad_s)
    world.axes["steering"].torque_source = steering
    world.advance(0.0)
    world.advance(steering_s)
    steering.speed_rad_s = 0.0
    world.advance(steering_s + 0.5)
    return world


def rolling(world: AckermannWorld, left_m_s: float, right_m_s: float, looks: int = 1, time_s: float = 6.0) -> None:
    """Roll the rear wheels for a time."""
    begin_s = world.time_s
    world.axes["rear_left"].torque_source = Speed(21.0 * left_m_s / 0.1)
    world.axes["rear_right"].torque_source = Speed(-21.0 * right_m_s / 0.1)
    for look in range(looks):
        world.advance(begin_s + time_s * (look + 1) / looks)


def test_a_car_without_power_stays_where_it_is() -> None:
    world = AckermannWorld(PROFILE, start=(1.0, 2.0, 0.5))
    world.advance(0.0)
    world.advance(5.0)
    assert world.rear_pose == pytest.approx((1.0, 2.0, 0.5))
    assert not world.moving


def test_the_wheels_carry_the_weight() -> None:
    loads = [wheel.load_n for wheel in AckermannWorld(PROFILE).wheels]
    assert sum(loads) == pytest.approx(6.0 * 9.81)
    assert (loads[2] + loads[3]) * 0.45 == pytest.approx(6.0 * 9.81 * 0.2)


def test_straight_wheels_roll_straight() -> None:
    world = steered(0.0, 0.0)
    rolling(world, 0.5, 0.5)
    x, y, yaw = world.rear_pose
    assert world.velocity == pytest.approx((0.5, 0.0, 0.0), abs=0.01)
    assert (y, yaw) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert x > 2.5


@pytest.mark.parametrize("side", [1, -1])
def test_slowly_it_turns_about_the_point_where_all_axles_meet(side: int) -> None:
    world = steered(side * 1.0, 0.35)
    radius = 0.45 / math.tan(world.steering.angle_rad)
    rolling(world, 0.2 * (1 - 0.175 / radius), 0.2 * (1 + 0.175 / radius))
    forward, _, rate = world.velocity
    assert forward / rate == pytest.approx(radius, rel=0.01)
    assert max(map(abs, world.slip_angle_rad)) < math.radians(0.5)


def test_a_fast_car_drifts_outward_as_far_as_its_tyres_need() -> None:
    """In a steady turn the lateral forces are m v^2 / R, each tyre's its cornering stiffness times its slip angle."""
    world = steered(0.3, 0.5)
    radius = 0.45 / math.tan(world.steering.angle_rad)
    rolling(world, 1.5 * (1 - 0.175 / radius), 1.5 * (1 + 0.175 / radius))
    forward, _, rate = world.velocity
    lateral = -10.0 * sum(w.load_n * a for w, a in zip(world.wheels, world.slip_angle_rad, strict=True))
    assert lateral == pytest.approx(6.0 * forward * rate, rel=0.1)


def test_the_steering_stands_at_its_stop() -> None:
    assert math.degrees(steered(2.0, 2.0).heading_rad("steering_angle")) == pytest.approx(48.0)


def test_a_car_whose_motors_lose_power_comes_to_rest() -> None:
    world = steered(0.0, 0.0)
    rolling(world, 0.5, 0.5)
    for axis in world.axes.values():
        axis.torque_source = None
    world.advance(30.0)
    assert world.velocity == (0.0, 0.0, 0.0)
    assert not world.moving


def test_the_past_does_not_depend_on_the_number_of_looks() -> None:
    once, often = steered(1.0, 0.2), steered(1.0, 0.2)
    rolling(once, 0.3, 0.35)
    rolling(often, 0.3, 0.35, looks=60)
    assert once.rear_pose == often.rear_pose


def test_tyres_that_the_step_cannot_follow_are_refused() -> None:
    assert PROFILE.simulation is not None
    tyre = msgspec.structs.replace(PROFILE.simulation.tyre, relaxation_length_m=0.001)
    simulation = msgspec.structs.replace(PROFILE.simulation, tyre=tyre)
    with pytest.raises(ConfigError, match="too stiff"):
        AckermannWorld(msgspec.structs.replace(PROFILE, simulation=simulation))


def test_another_vehicle_is_refused() -> None:
    with pytest.raises(ConfigError, match="cannot be simulated as a car"):
        AckermannWorld(load("turtle").profile)


@pytest.mark.parametrize("name", ["rear", "front"])
def test_it_has_no_pairs_and_no_brakes(name: str) -> None:
    world = AckermannWorld(PROFILE)
    with pytest.raises(KeyError):
        world.heading_rad(name)
    with pytest.raises(KeyError):
        world.set_brake(name, engaged=True)
