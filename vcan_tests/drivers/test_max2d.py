from __future__ import annotations

import json
from itertools import pairwise
from math import cos, radians, sin
from pathlib import Path

import msgspec
import pytest

from canhelm.errors import ConfigError
from drivers.simulated.max2d import Max2dWorld
from drivers.simulated.world import STEP_S, World
from vcan_tests.drivers.max2d_bench import PROFILE, Robot, SpeedSource, turning_speeds, with_tyre

VECTORS = Path(__file__).parents[1] / "vectors" / "seed001_turning.json"


def test_the_world_fulfils_its_contract() -> None:
    world: World = Max2dWorld(PROFILE)
    assert set(world.axes) == set(PROFILE.drives)


def test_a_profile_without_a_vehicle_is_refused() -> None:
    with pytest.raises(ConfigError, match="vehicle and simulation"):
        Max2dWorld(msgspec.structs.replace(PROFILE, vehicle=None))


def test_tyres_too_stiff_for_the_step_are_refused_with_the_shortest_relaxation_length() -> None:
    with pytest.raises(ConfigError, match="too stiff") as refusal:
        Max2dWorld(with_tyre(relaxation_length_m=0.001))
    assert isinstance(refusal.value.limit, float)
    Max2dWorld(with_tyre(relaxation_length_m=refusal.value.limit))


def test_the_stiffest_accepted_tyre_still_comes_to_rest() -> None:
    with pytest.raises(ConfigError) as refusal:
        Max2dWorld(with_tyre(relaxation_length_m=0.001))
    robot = Robot(with_tyre(relaxation_length_m=refusal.value.limit), headings=(-0.2, 0.3))
    robot.speed_up(0.5, 0.3, 0.35, 0.55)
    robot.roll(*[0.0] * 4, for_s=1.0)
    robot.power_off()
    robot.roll(*[0.0] * 4, for_s=4.0)
    assert not robot.world.moving


def test_a_robot_that_would_tip_over_is_refused() -> None:
    with pytest.raises(ConfigError, match="lift a wheel"):
        Max2dWorld(with_tyre(friction=1.5))


@pytest.mark.parametrize("heading", [0.0, radians(60), radians(-85)])
def test_a_straight_drive_goes_straight(heading: float) -> None:
    robot = Robot(headings=(heading, heading))
    robot.speed_up(*[1.0] * 4)
    robot.roll(*[1.0] * 4, for_s=2.0)
    x, y, yaw = robot.world.pose
    along, aside = x * cos(heading) + y * sin(heading), y * cos(heading) - x * sin(heading)
    assert along > 2.0
    assert abs(aside) < 0.001 * along
    assert abs(yaw) < 1e-3


def test_the_commanded_speed_is_reached_within_the_slip_of_rolling() -> None:
    robot = Robot()
    robot.speed_up(*[1.0] * 4)
    robot.roll(*[1.0] * 4, for_s=2.0)
    assert robot.world.velocity == pytest.approx((1.0, 0.0, 0.0), abs=2e-3)


@pytest.mark.parametrize("friction", [0.4, 0.7, 1.0])
def test_figure_4_16_is_driven_on_a_slightly_wider_circle(friction: float) -> None:
    radius, speeds = turning_speeds(rear=0.15, front=-0.3, speed_m_s=1.0)
    robot = Robot(with_tyre(friction=friction), headings=(0.15, -0.3))
    robot.speed_up(*speeds, within_s=1.5)
    robot.roll(*speeds, for_s=2.0)
    assert 1.02 < robot.driven_radius() / radius < 1.045


@pytest.mark.parametrize("friction", [0.4, 0.7, 1.0])
def test_figure_4_15_is_driven_on_a_wider_circle(friction: float) -> None:
    case = next(
        case["output"]
        for case in json.loads(VECTORS.read_text())["cases"]
        if case["input"] == {"alpha12": -0.35, "alpha34": -0.35, "v": 0.5}
    )
    robot = Robot(with_tyre(friction=friction), headings=(-0.35, 0.35))
    robot.speed_up(*case["wheel_speed"])
    robot.roll(*case["wheel_speed"], for_s=2.0)
    assert 1.045 < robot.driven_radius() / case["R_center"] < 1.08


def test_a_bend_to_the_left_mirrors_a_bend_to_the_right() -> None:
    left, right = Robot(headings=(-0.2, 0.3)), Robot(headings=(0.2, -0.3))
    left.speed_up(0.5, 0.3, 0.35, 0.55)
    right.speed_up(0.3, 0.5, 0.55, 0.35)
    x, y, yaw = left.world.pose
    assert right.world.pose == pytest.approx((x, -y, -yaw), abs=1e-9)


def test_the_start_pose_moves_the_whole_drive() -> None:
    here, there = Robot(headings=(-0.2, 0.3)), Robot(headings=(-0.2, 0.3), start=(1.0, 2.0, radians(90)))
    for robot in (here, there):
        robot.speed_up(0.5, 0.3, 0.35, 0.55)
    x, y, yaw = here.world.pose
    assert there.world.pose == pytest.approx((1.0 - y, 2.0 + x, yaw + radians(90)), abs=1e-9)


def test_a_robot_without_power_rolls_out_to_exact_rest() -> None:
    robot = Robot(headings=(-0.1, 0.1))
    robot.speed_up(*[0.6] * 4)
    robot.power_off()
    robot.roll(*[0.0] * 4, for_s=4.0)
    assert robot.world.velocity == (0.0, 0.0, 0.0)
    assert not robot.world.moving


def test_kinetic_energy_only_falls_without_power() -> None:
    robot = Robot(headings=(-0.3, 0.3))
    robot.speed_up(0.7, 0.4, 0.4, 0.7)
    robot.power_off()
    energies = []
    for _ in range(100):
        energies.append(robot.kinetic_energy())
        robot.roll(*[0.0] * 4, for_s=0.01)
    assert all(after <= before + 1e-3 for before, after in pairwise(energies))


def test_no_energy_comes_from_nothing() -> None:
    robot = Robot(headings=(0.5, -0.5))
    robot.world.set_brake("front", engaged=False)
    work = 0.0
    for step in range(1500):
        robot.roll(*((1.5, -1.0, 0.8, -1.5) if step // 150 % 2 else (-1.5, 1.0, 1.5, 0.4)), for_s=0.001)
        for name, axis in robot.world.axes.items():
            work += axis.current_a * PROFILE.drives[name].motor.torque_constant_n_m_a * axis.speed_rad_s * 0.001
        assert robot.kinetic_energy() <= work + 0.01


def test_a_quarter_of_the_step_drives_the_same_way() -> None:
    coarse, fine = Robot(headings=(-0.2, 0.3)), Robot(headings=(-0.2, 0.3), step_s=STEP_S / 4)
    for robot in (coarse, fine):
        robot.speed_up(0.9, 0.6, 0.65, 0.95)
        robot.roll(0.9, 0.6, 0.65, 0.95, for_s=1.0)
    assert coarse.world.pose == pytest.approx(fine.world.pose, abs=2e-3)


def test_violent_reversals_stay_finite_and_end_at_rest() -> None:
    robot = Robot(headings=(1.0, -1.0))
    for number in range(40):
        robot.world.set_brake("front" if number % 2 else "rear", engaged=number % 3 == 0)
        robot.roll(*((3.0, -3.0, 3.0, -3.0) if number % 2 else (-3.0, 3.0, 3.0, -3.0)), for_s=0.05)
    robot.power_off()
    robot.roll(*[0.0] * 4, for_s=10.0)
    assert robot.world.velocity == (0.0, 0.0, 0.0)


def test_the_number_of_calls_does_not_matter() -> None:
    often, once = Robot(headings=(-0.2, 0.3)), Robot(headings=(-0.2, 0.3))
    for _ in range(900):
        often.roll(0.5, 0.3, 0.35, 0.55, for_s=1 / 900)
    once.roll(0.5, 0.3, 0.35, 0.55, for_s=1.0)
    assert often.world.pose == once.world.pose


class Counting(SpeedSource):
    calls = 0

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        self.calls += 1
        return super().current_demand(speed_rad_s, position_rad, dt_s)


def test_a_torque_source_is_asked_once_a_step_even_at_rest() -> None:
    world = Max2dWorld(PROFILE)
    source = Counting(PROFILE.drives["rear_left"])
    world.axes["rear_left"].torque_source = source
    world.advance(0.0)
    world.advance(1.0)
    assert not world.moving
    assert source.calls == 1000


def test_rest_without_power_is_skipped_in_one_go() -> None:
    world = Max2dWorld(PROFILE)
    world.advance(0.0)
    world.advance(1e8)
    assert world.pose == (0.0, 0.0, 0.0)


def test_a_new_demand_wakes_the_world_at_the_step_it_was_made() -> None:
    early, late = Robot(), Robot()
    late.roll(*[0.0] * 4, for_s=100.0)
    for robot in (early, late):
        robot.roll(*[0.3] * 4, for_s=1.0)
    assert late.world.pose == pytest.approx(early.world.pose, abs=1e-12)


def test_a_mirrored_drive_counts_backward_when_the_robot_goes_forward() -> None:
    robot = Robot()
    robot.roll(*[0.3] * 4, for_s=1.0)
    assert robot.world.axes["front_right"].position_rad < 0.0 < robot.world.axes["front_left"].position_rad


def test_equal_seeds_make_equal_worlds() -> None:
    first, second, other = (Max2dWorld(PROFILE, seed=seed) for seed in (7, 7, 8))
    shafts = [[axis.position_rad for axis in world.axes.values()] for world in (first, second, other)]
    assert shafts[0] == shafts[1] != shafts[2]


def test_a_wheel_that_drifts_left_has_a_positive_slip_angle_and_a_force_to_the_right() -> None:
    robot = Robot(headings=(-0.2, -0.2))
    robot.speed_up(*[0.5] * 4)
    robot.world.set_heading("front", -0.3)
    robot.roll(*[0.5] * 4, for_s=0.02)
    contact = robot.world.wheels["front_left"].contact
    assert contact.slip_angle_rad > 0.02
    assert contact.force_y_n < -1.0


def test_a_spinning_wheel_has_a_positive_slip_ratio() -> None:
    robot = Robot(with_tyre(friction=0.1))
    robot.roll(2.0, 0.0, 0.0, 0.0, for_s=0.2)
    assert robot.world.slip_ratio[0] > 0.1
