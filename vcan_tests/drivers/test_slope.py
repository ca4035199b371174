"""A simulated robot on a tilted floor: it is held, it rolls, and its motors carry its weight down the slope."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator

import msgspec
import pytest

from canhelm.errors import Refused
from daemon.runtime.simulation_commands import SimulationCommands
from drivers.simulated.body import GRAVITY_M_S2, BodyWorld
from drivers.simulated.network import make_world
from drivers.simulated.omni import OmniWorld
from profiles.loader import load
from profiles.schema import Profile
from vcan_tests.drivers.max2d_bench import SpeedSource
from vcan_tests.robot import running_robot

SLOPE_DEG = 5.0
MASS_KG = {"max2d": 28.0, "turtle": 25.0, "ackermann": 6.0, "semitrailer": 11.0}
"""Of the whole robot; the semi-trailer's truck has 5 kg, its trailer 6 kg."""
AHEAD = {
    "max2d": dict.fromkeys(("rear_right", "rear_left", "front_left", "front_right"), 1.0),
    "turtle": {"wheel_1": -0.5, "wheel_2": 1.0, "wheel_3": -0.5},
    "ackermann": {"rear_left": 1.0, "rear_right": 1.0},
    "semitrailer": {"drive": 1.0},
}
"""Rim speed of each driven wheel where the robot moves ahead at 1 m/s."""


def lossless(name: str) -> Profile:
    """The robot with gears that lose nothing: then a motor's current is the force that it makes."""
    profile = load(name).profile
    drives = {key: msgspec.structs.replace(drive, gear_efficiency=1.0) for key, drive in profile.drives.items()}
    return msgspec.structs.replace(profile, drives=drives)


def force_ahead(name: str, speed_m_s: float, slope_deg: float, downhill_deg: float = 180.0) -> float:
    """Force of the motors along the x axis, by their currents [N], in steady driving ahead."""
    profile = lossless(name)
    world = make_world(profile, 1)
    for axis, share in AHEAD[name].items():
        source = SpeedSource(profile.drives[axis])
        source.target_m_s = share * speed_m_s
        world.axes[axis].torque_source = source
    world.advance(0.0)
    world.tilt(math.radians(slope_deg), math.radians(downhill_deg))
    world.advance(4.0)
    return sum(mean_forces(world, profile, name))


def mean_forces(world: BodyWorld, profile: Profile, name: str) -> Iterator[float]:
    sums = dict.fromkeys(AHEAD[name], 0.0)
    for look in range(1000):
        world.advance(4.0 + 0.001 * (look + 1))
        for axis in sums:
            sums[axis] += world.axes[axis].current_a / 1000
    for axis, current_a in sums.items():
        drive = profile.drives[axis]
        force_n = current_a * drive.motor.torque_constant_n_m_a * drive.total_ratio / drive.wheel_radius_m
        yield drive.direction * force_n * AHEAD[name][axis]


@pytest.mark.parametrize("name", AHEAD)
def test_uphill_the_motors_carry_the_weight_down_the_slope_and_downhill_they_are_pushed_by_it(name: str) -> None:
    uphill, downhill = (force_ahead(name, 0.2, SLOPE_DEG, downhill_deg) for downhill_deg in (180.0, 0.0))
    weight_n = MASS_KG[name] * GRAVITY_M_S2 * math.sin(math.radians(SLOPE_DEG))
    assert uphill - downhill == pytest.approx(2.0 * weight_n, rel=0.05)


def test_across_the_slope_the_motors_carry_nothing_of_the_weight() -> None:
    level, across = (force_ahead("ackermann", 0.2, slope_deg, 90.0) for slope_deg in (0.0, 2.0))
    assert across == pytest.approx(level, abs=0.5)


@pytest.mark.parametrize("name", AHEAD)
def test_with_held_motors_it_stays_where_it_is(name: str) -> None:
    profile = load(name).profile
    world = make_world(profile, 1)
    for drive in world.axes:
        world.axes[drive].torque_source = SpeedSource(profile.drives[drive])
    world.advance(0.0)
    world.tilt(math.radians(SLOPE_DEG), 0.0)
    world.advance(10.0)
    assert math.hypot(*world.velocity[:2]) < 1e-3
    assert world.time_s == pytest.approx(10.0, abs=0.01)


def without_friction(name: str) -> Profile:
    """The robot with motors and tyres that roll freely."""
    profile = lossless(name)
    drives = {
        key: msgspec.structs.replace(drive, motor=msgspec.structs.replace(drive.motor, no_load_current_a=0.0))
        for key, drive in profile.drives.items()
    }
    assert profile.simulation is not None
    tyre = msgspec.structs.replace(profile.simulation.tyre, rolling_resistance=0.0)
    simulation = msgspec.structs.replace(profile.simulation, tyre=tyre)
    return msgspec.structs.replace(profile, drives=drives, simulation=simulation)


def test_wheels_that_turn_freely_roll_down_as_their_rotors_let_them() -> None:
    profile = without_friction("ackermann")
    assert profile.simulation is not None
    world = make_world(profile, 1)
    world.advance(0.0)
    world.tilt(math.radians(SLOPE_DEG), 0.0)
    world.advance(2.0)
    drive = profile.drives["rear_left"]
    rotor = drive.total_ratio**2 * drive.motor.rotor_inertia_kg_m2
    turning = 4.0 * profile.simulation.wheel_inertia_kg_m2 + 2.0 * rotor
    mass = MASS_KG["ackermann"] + turning / drive.wheel_radius_m**2
    pull = MASS_KG["ackermann"] * GRAVITY_M_S2 * math.sin(math.radians(SLOPE_DEG)) / mass
    assert world.velocity[0] == pytest.approx(2.0 * pull, rel=0.02)


def test_on_ice_it_slides_however_its_motors_hold() -> None:
    profile = load("max2d").profile
    world = make_world(profile, 1)
    for drive in world.axes:
        world.axes[drive].torque_source = SpeedSource(profile.drives[drive])
    world.advance(0.0)
    for contact in world.contacts.values():
        contact.lay_ice(0.02)
    world.tilt(math.radians(SLOPE_DEG), math.radians(90.0))
    world.advance(2.0)
    slide = GRAVITY_M_S2 * (math.sin(math.radians(SLOPE_DEG)) - 0.02)
    assert world.velocity[1] == pytest.approx(2.0 * slide, rel=0.1)


def test_level_again_it_rolls_on_and_gets_no_faster() -> None:
    world = make_world(without_friction("ackermann"), 1)
    world.advance(0.0)
    world.tilt(math.radians(SLOPE_DEG), 0.0)
    world.advance(1.0)
    rolling = world.velocity[0]
    world.tilt(0.0, 0.0)
    world.advance(2.0)
    assert rolling > 0.01
    assert world.velocity[0] == pytest.approx(rolling, rel=0.02)


def test_an_accelerometer_feels_the_slope_that_it_rests_on() -> None:
    profile = load("turtle").profile
    world = make_world(profile, 1)
    assert isinstance(world, OmniWorld)
    assert world.accelerometer is not None
    for drive in world.axes:
        world.axes[drive].torque_source = SpeedSource(profile.drives[drive])
    world.advance(0.0)
    world.tilt(math.radians(SLOPE_DEG), 0.0)
    world.advance(5.0)
    felt = math.hypot(*world.accelerometer.acceleration_m_s2)
    assert felt == pytest.approx(GRAVITY_M_S2 * math.sin(math.radians(SLOPE_DEG)), rel=0.02)


async def test_a_simulated_robot_is_seen_on_the_floor_that_was_tilted_under_it() -> None:
    async with running_robot() as robot:
        told = await robot.call("simulation.slope", slope_deg=3.0, direction_deg=90.0)
        assert told == {"slope_deg": 3.0, "direction_deg": 90.0}
        assert (await robot.call("simulation.look"))["floor"] == {"slope_deg": 3.0, "direction_deg": 90.0}


async def test_a_robot_at_rest_begins_to_roll_when_its_floor_is_tilted() -> None:
    async with running_robot(without_friction("ackermann"), expect_errors=True) as robot:
        await robot.call("simulation.slope", slope_deg=10.0, direction_deg=0.0)
        await asyncio.sleep(1.0)
        assert robot.app.vehicle.place is not None
        assert robot.app.vehicle.place.x_m > 0.1


async def test_a_robot_whose_wheels_turn_in_the_air_has_no_floor_to_tilt() -> None:
    async with running_robot(load("nxt").profile) as robot:
        with pytest.raises(Refused, match="stands on no floor"):
            await robot.call("simulation.slope", slope_deg=3.0, direction_deg=0.0)


@pytest.mark.parametrize(
    ("method", "params"),
    [("simulation.slope", {"slope_deg": 3.0, "direction_deg": 0.0}), ("simulation.pace", {"factor": 2.0})],
)
async def test_on_a_real_network_it_is_refused(method: str, params: dict[str, float]) -> None:
    async with running_robot() as robot:
        real = SimulationCommands(robot.app.supervisor, None)
        with pytest.raises(Refused, match="this network is real"):
            await real.handlers[method](params, None)
