from __future__ import annotations

from math import cos, degrees, hypot, sin

import msgspec
import pytest

from drivers.simulated.max2d import Max2dWorld
from vcan_tests.drivers.max2d_bench import PROFILE, Robot, contact_points, simulation, vehicle, with_tyre


def steer_front(robot: Robot, rim_m_s: float, for_s: float) -> None:
    robot.world.set_brake("front", engaged=False)
    robot.roll(0.0, 0.0, -rim_m_s, rim_m_s, for_s=for_s)


def test_a_released_pair_turns_with_its_rim_speed_over_the_offset() -> None:
    robot = Robot()
    steer_front(robot, 0.1, for_s=0.5)
    before = robot.world.heading_rad("front")
    steer_front(robot, 0.1, for_s=0.3)
    rate = (robot.world.heading_rad("front") - before) / 0.3
    assert rate == pytest.approx(0.1 / vehicle().contact_offset_m, rel=0.03)


def test_the_braked_pair_keeps_its_heading_meanwhile() -> None:
    robot = Robot(headings=(0.3, 0.0))
    steer_front(robot, 0.15, for_s=0.8)
    assert robot.world.heading_rad("rear") == 0.3


def test_the_body_stays_where_it_is_while_a_pair_turns() -> None:
    robot = Robot()
    steer_front(robot, 0.1, for_s=0.8)
    x, y, yaw = robot.world.pose
    assert hypot(x, y) < 0.005
    assert abs(degrees(yaw)) < 1.0


def test_a_braked_pair_does_not_turn_however_its_wheels_pull() -> None:
    robot = Robot()
    robot.roll(0.0, 0.0, -0.1, 0.1, for_s=0.5)
    assert robot.world.heading_rad("front") == 0.0


def test_a_weak_brake_slips() -> None:
    weak = msgspec.structs.replace(simulation(), brake_holding_torque_n_m=1.0)
    robot = Robot(msgspec.structs.replace(PROFILE, simulation=weak))
    robot.roll(0.0, 0.0, -0.15, 0.15, for_s=0.5)
    assert robot.world.heading_rad("front") > 0.05


@pytest.mark.parametrize("engaged", [True, False])
def test_a_turning_pair_gives_its_angular_momentum_to_the_body(engaged: bool) -> None:
    world = Max2dWorld(with_tyre(friction=1e-9))
    world.advance(0.0)
    world.set_brake("rear", engaged=engaged)
    world.pairs["rear"].rate_rad_s = 1.0
    world.advance(1.0)
    share = simulation().steering_inertia_kg_m2 / vehicle().yaw_inertia_kg_m2
    assert world.pairs["rear"].rate_rad_s == 0.0
    assert world.velocity[2] == pytest.approx(share, rel=1e-3)


def test_the_moment_on_the_body_is_that_of_the_forces_at_the_contact_points() -> None:
    robot = Robot(headings=(-0.3, 0.5))
    robot.speed_up(0.5, 0.3, 0.35, 0.55)
    for name, points in (("rear", slice(0, 2)), ("front", slice(3, 1, -1))):
        pair = robot.world.pairs[name]
        c, s = cos(pair.heading_rad), sin(pair.heading_rad)
        moment = 0.0
        for (x, y), wheel in zip(contact_points(-0.3, 0.5)[points], (pair.right, pair.left), strict=True):
            along, aside = wheel.contact.force_x_n, wheel.contact.force_y_n
            moment += x * (along * s + aside * c) - y * (along * c - aside * s)
        assert pair.yaw_moment_n_m + pair.passed_n_m == pytest.approx(moment, abs=1e-9)


def test_an_engaged_brake_stops_a_turning_pair_at_once() -> None:
    robot = Robot()
    steer_front(robot, 0.15, for_s=0.5)
    robot.world.set_brake("front", engaged=True)
    robot.roll(0.0, 0.0, -0.15, 0.15, for_s=0.01)
    assert robot.world.pairs["front"].rate_rad_s == 0.0


@pytest.mark.parametrize("side", [1, -1])
def test_a_pair_ends_at_its_stop(side: int) -> None:
    robot = Robot()
    steer_front(robot, side * 0.15, for_s=1.5)
    assert side * degrees(robot.world.heading_rad("front")) == pytest.approx(vehicle().max_heading_deg, abs=0.2)


def test_a_pair_comes_back_from_its_stop() -> None:
    robot = Robot()
    steer_front(robot, 0.15, for_s=1.5)
    steer_front(robot, -0.15, for_s=0.8)
    assert degrees(robot.world.heading_rad("front")) < 60.0


def test_equal_speeds_of_a_released_pair_push_the_body_and_do_not_steer() -> None:
    robot = Robot()
    robot.world.set_brake("front", engaged=False)
    robot.roll(0.0, 0.0, 0.05, 0.05, for_s=0.5)
    assert abs(degrees(robot.world.heading_rad("front"))) < 0.01
