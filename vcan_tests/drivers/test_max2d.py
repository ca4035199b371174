from __future__ import annotations

import json
from itertools import pairwise
from math import cos, degrees, hypot, radians, sin
from pathlib import Path

import msgspec
import pytest

from canhelm.errors import ConfigError
from drivers.simulated.max2d import Max2dWorld
from drivers.simulated.world import STEP_S, World
from profiles.loader import load
from profiles.schema import DriveConfig, PairedSteerGeometry, Profile, SimulationConfig

PROFILE = load("max2d").profile
VECTORS = Path(__file__).parents[1] / "vectors" / "seed001_turning.json"
START = (0.0, 0.0, 0.0)


def vehicle() -> PairedSteerGeometry:
    assert PROFILE.vehicle is not None
    return PROFILE.vehicle


def simulation() -> SimulationConfig:
    assert PROFILE.simulation is not None
    return PROFILE.simulation


def with_tyre(**values: float) -> Profile:
    tyre = msgspec.structs.replace(simulation().tyre, **values)
    return msgspec.structs.replace(PROFILE, simulation=msgspec.structs.replace(simulation(), tyre=tyre))


class SpeedSource:
    """A stiff PI speed controller: as near to a commanded wheel speed as the motor allows."""

    def __init__(self, config: DriveConfig) -> None:
        self.target_m_s = 0.0
        self._shaft_per_m_s = config.direction * config.total_ratio / config.wheel_radius_m
        self._sum_a = 0.0

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        error = self.target_m_s * self._shaft_per_m_s - speed_rad_s
        self._sum_a = min(max(self._sum_a + 0.5 * error * dt_s, -5.0), 5.0)
        return min(max(0.05 * error + self._sum_a, -5.0), 5.0)


class Robot:
    """The simulated MAX2D with a speed source on each wheel."""

    def __init__(
        self,
        profile: Profile = PROFILE,
        headings: tuple[float, float] = (0.0, 0.0),
        start: tuple[float, float, float] = START,
        step_s: float = STEP_S,
    ) -> None:
        self.world = Max2dWorld(profile, seed=1, start=start, step_s=step_s)
        self.sources = [SpeedSource(profile.drives[name]) for name in vehicle().wheels]
        for name, source in zip(vehicle().wheels, self.sources, strict=True):
            self.world.axes[name].torque_source = source
        self.world.set_heading("rear", headings[0])
        self.world.set_heading("front", headings[1])
        self.now_s = 0.0
        self.world.advance(0.0)

    def roll(self, *speeds_m_s: float, for_s: float) -> None:
        for source, speed in zip(self.sources, speeds_m_s, strict=True):
            source.target_m_s = speed
        self.now_s += for_s
        self.world.advance(self.now_s)

    def speed_up(self, *speeds_m_s: float, within_s: float = 1.0) -> None:
        for part in range(1, 51):
            self.roll(*(speed * part / 50 for speed in speeds_m_s), for_s=within_s / 50)

    def power_off(self) -> None:
        for axis in self.world.axes.values():
            axis.torque_source = None

    def kinetic_energy(self) -> float:
        vx, vy, yaw_rate = self.world.velocity
        energy = vehicle().mass_kg * (vx * vx + vy * vy) + vehicle().yaw_inertia_kg_m2 * yaw_rate**2
        for name, wheel in self.world.wheels.items():
            config = PROFILE.drives[name]
            reflected = config.total_ratio**2 * config.motor.rotor_inertia_kg_m2
            energy += (simulation().wheel_inertia_kg_m2 + reflected) * wheel.drive.wheel_rad_s**2
        return energy / 2.0

    def driven_radius(self) -> float:
        vx, vy, yaw_rate = self.world.velocity
        return hypot(vx, vy) / abs(yaw_rate)


def contact_points(rear: float, front: float) -> list[tuple[float, float]]:
    """Contact points of wheels 1 to 4."""
    car = vehicle()
    points = []
    for ahead, left in ((-1, -1), (-1, 1), (1, 1), (1, -1)):
        heading = front if ahead > 0 else rear
        lead, out = ahead * car.contact_lead_m, left * car.contact_offset_m
        x = ahead * car.wheelbase_m / 2 + lead * cos(heading) - out * sin(heading)
        y = left * car.pivot_track_m / 2 + lead * sin(heading) + out * cos(heading)
        points.append((x, y))
    return points


def turning_speeds(rear: float, front: float, speed_m_s: float) -> tuple[float, list[float]]:
    """Radius of the centre and wheel speeds about the mean of both sides' intersections of axle lines (speed > 0)."""
    points = contact_points(rear, front)
    along = [(-sin(heading), cos(heading)) for heading in (rear, rear, front, front)]
    crossings = [_crossing(points[i], along[i], points[j], along[j]) for i, j in ((0, 3), (1, 2))]
    x, y = (sum(values) / 2 for values in zip(*crossings, strict=True))
    radius = hypot(x, y)
    return radius, [speed_m_s / radius * hypot(px - x, py - y) for px, py in points]


def _crossing(
    p: tuple[float, float], u: tuple[float, float], q: tuple[float, float], v: tuple[float, float]
) -> tuple[float, float]:
    """Where the lines p + t u and q + t v cross."""
    t = ((q[0] - p[0]) * v[1] - (q[1] - p[1]) * v[0]) / (u[0] * v[1] - u[1] * v[0])
    return p[0] + t * u[0], p[1] + t * u[1]


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


def test_rest_is_skipped_in_one_go() -> None:
    world = Max2dWorld(PROFILE)
    source = Counting(PROFILE.drives["rear_left"])
    world.axes["rear_left"].torque_source = source
    world.advance(0.0)
    world.advance(3600.0)
    assert source.calls == 1


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


def test_slip_statistics_start_anew() -> None:
    robot = Robot()
    robot.roll(*[2.0] * 4, for_s=0.3)
    assert robot.world.max_slip_ratio > 0.05
    robot.world.reset_statistics()
    assert (robot.world.max_slip_ratio, robot.world.max_slip_angle_rad) == (0.0, 0.0)
