"""The simulated robot on omni-wheels: its own derivation against the loops' kinematics, ice, accelerometer, rest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import pytest

from canhelm.errors import ConfigError
from daemon.loops.omni import OmniKinematics, OmniWheel
from drivers.simulated.floor import Floor
from drivers.simulated.omni import OmniWorld
from profiles.loader import load
from profiles.schema import FloorPatch, OmniGeometry, OmniWheelGeometry, Profile

PROFILE = load("turtle").profile
KGF = 9.81


@dataclass
class Servo:
    """A torque source that holds a shaft speed."""

    target_rad_s: float

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        """Proportional."""
        return max(-6.9, min(6.9, 0.1 * (self.target_rad_s - speed_rad_s)))


@dataclass
class Current:
    """A torque source of constant current."""

    current_a: float

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        """As given."""
        return self.current_a


def vehicle(profile: Profile) -> OmniGeometry:
    assert isinstance(profile.vehicle, OmniGeometry)
    return profile.vehicle


def kinematics(profile: Profile) -> OmniKinematics:
    wheels = vehicle(profile).wheels.values()
    return OmniKinematics([OmniWheel(math.radians(wheel.direction_deg), wheel.lever_m) for wheel in wheels])


def rolling(world: OmniWorld, profile: Profile, speeds: tuple[float, ...]) -> None:
    """Let the wheels' rims go at these speeds."""
    for (name, axis), speed in zip(world.axes.items(), speeds, strict=True):
        drive = profile.drives[name]
        axis.torque_source = Servo(drive.direction * drive.total_ratio * speed / drive.wheel_radius_m)
    world.advance(0.0)


def with_floor(**patch: float | str) -> Profile:
    assert PROFILE.simulation is not None
    ice = msgspec.convert(
        {"x_m": 0.0, "y_m": 0.0, "length_m": 1.0, "width_m": 1.0, "friction": 0.02} | patch, FloorPatch
    )
    return msgspec.structs.replace(PROFILE, simulation=msgspec.structs.replace(PROFILE.simulation, floor={"ice": ice}))


def individual() -> Profile:
    """Three wheels of their own radii and levers, at odd angles."""
    wheels = {
        "wheel_1": OmniWheelGeometry(direction_deg=230, lever_m=0.22),
        "wheel_2": OmniWheelGeometry(direction_deg=5, lever_m=0.17),
        "wheel_3": OmniWheelGeometry(direction_deg=110, lever_m=0.2),
    }
    drives = {
        name: msgspec.structs.replace(drive, wheel_radius_m=radius)
        for (name, drive), radius in zip(PROFILE.drives.items(), (0.048, 0.05, 0.053), strict=True)
    }
    return msgspec.structs.replace(
        PROFILE, drives=drives, vehicle=msgspec.structs.replace(vehicle(PROFILE), wheels=wheels)
    )


@pytest.mark.parametrize("motion", [(0.5, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 1.0), (0.3, -0.2, 0.6)])
@pytest.mark.parametrize("profile", [PROFILE, individual()], ids=["turtle", "individual"])
def test_the_body_moves_as_the_loops_kinematics_say_of_its_rims(
    profile: Profile, motion: tuple[float, float, float]
) -> None:
    world = OmniWorld(profile)
    rolling(world, profile, kinematics(profile).wheel_speeds(motion))
    world.advance(1.5)
    rims = [wheel.drive.rim_m_s for wheel in world.wheels.values()]
    assert kinematics(profile).body_motion(rims) == pytest.approx(world.velocity, abs=0.015)
    assert world.velocity == pytest.approx(motion, abs=0.1)


def test_rollers_let_a_wheel_be_pushed_across() -> None:
    """Wheel 2 stands still while the others drive the robot to the left, exactly across it."""
    world = OmniWorld(PROFILE)
    rolling(world, PROFILE, kinematics(PROFILE).wheel_speeds((0.0, 0.5, 0.0)))
    world.advance(1.0)
    assert world.velocity[1] > 0.45
    assert world.wheels["wheel_2"].drive.rim_m_s == pytest.approx(0.0, abs=1e-3)


def test_the_loads_carry_the_weight_and_shift_back_when_it_speeds_up() -> None:
    world = OmniWorld(PROFILE)
    world.axes["wheel_3"].torque_source, world.axes["wheel_1"].torque_source = Current(-2.0), Current(-2.0)
    world.axes["wheel_2"].torque_source = Current(4.0)
    world.advance(0.0)
    world.advance(0.3)
    loads = {name: wheel.load_n for name, wheel in world.wheels.items()}
    assert sum(loads.values()) == pytest.approx(25 * KGF)
    height_m, acceleration = 0.15, world.velocity[0] / 0.3
    assert acceleration > 0.5
    moment = 0.2 * math.sin(math.radians(60)) * (loads["wheel_1"] - loads["wheel_3"])
    assert moment == pytest.approx(25 * height_m * acceleration, rel=0.03)


def test_a_wheel_never_pulls_more_than_friction_holds_and_slides_on_ice() -> None:
    world = OmniWorld(with_floor())
    rolling(world, PROFILE, kinematics(PROFILE).wheel_speeds((1.0, 0.0, 0.0)))
    world.advance(0.2)
    assert world.sliding == (True, True, True)
    for wheel in world.wheels.values():
        assert math.hypot(wheel.force_x_n, wheel.force_y_n) <= 0.02 * wheel.load_n * math.sqrt(2) + 1e-9
    assert world.velocity[0] < 0.02 * KGF * 1.5 * 0.2
    assert world.slip_m_s[1] > 0.3


def test_ice_is_where_and_when_it_is_said_to_be() -> None:
    patches = {
        "first": FloorPatch(x_m=1.0, y_m=0.0, length_m=2.0, width_m=1.0, friction=0.1, from_s=1.0, until_s=2.0),
        "top": FloorPatch(shape="ellipse", x_m=1.0, y_m=0.0, length_m=1.0, width_m=1.0, friction=0.05),
    }
    floor = Floor(0.7, patches)
    assert floor.friction(1.0, 0.49, 0.0) == 0.05
    assert floor.friction(1.4, 0.4, 1.5) == 0.1
    assert [floor.friction(1.9, 0.4, time) for time in (0.9, 1.0, 1.9, 2.0)] == [0.7, 0.1, 0.1, 0.7]
    assert floor.friction(1.0, 0.51, 1.5) == 0.7


def test_the_accelerometer_feels_the_centripetal_acceleration_of_its_place() -> None:
    """At (0.05, 0.15), its x axis to the left: -w^2 0.15 along it, +w^2 0.05 along its y axis, which looks backward."""
    world = OmniWorld(PROFILE)
    rolling(world, PROFILE, kinematics(PROFILE).wheel_speeds((0.0, 0.0, 2.0)))
    world.advance(1.5)
    rate = world.velocity[2]
    assert world.accelerometer is not None
    assert world.accelerometer.acceleration_m_s2 == pytest.approx((-0.15 * rate**2, 0.05 * rate**2), abs=0.01)


def test_the_accelerometers_voltage_has_its_noise_by_seed() -> None:
    def voltages(seed: int) -> list[float]:
        sensor = OmniWorld(PROFILE, seed).accelerometer
        assert sensor is not None
        return [sensor.voltage_mv(0) for _ in range(200)]

    assert voltages(1) == voltages(1) != voltages(2)
    mean = sum(voltages(1)) / 200
    assert mean == pytest.approx(2500, abs=1.0)
    assert math.sqrt(sum((value - mean) ** 2 for value in voltages(1)) / 200) == pytest.approx(3.0, rel=0.2)


def test_it_comes_to_rest_exactly_and_then_costs_nothing() -> None:
    world = OmniWorld(PROFILE)
    rolling(world, PROFILE, (0.2, 0.1, -0.1))
    world.advance(0.5)
    assert world.moving
    for axis in world.axes.values():
        axis.torque_source = None
    world.advance(20.0)
    assert not world.moving
    assert world.velocity == (0.0, 0.0, 0.0)


def test_wheels_on_a_line_are_refused() -> None:
    wheels = {
        "wheel_1": OmniWheelGeometry(direction_deg=0, lever_m=0.2),
        "wheel_2": OmniWheelGeometry(direction_deg=180, lever_m=0.2),
        "wheel_3": OmniWheelGeometry(direction_deg=90, lever_m=0.0),
    }
    profile = msgspec.structs.replace(PROFILE, vehicle=msgspec.structs.replace(vehicle(PROFILE), wheels=wheels))
    with pytest.raises(ConfigError, match="fall over"):
        OmniWorld(profile)


def test_tyres_that_are_too_stiff_for_the_step_are_refused() -> None:
    with pytest.raises(ConfigError, match="too stiff"):
        OmniWorld(PROFILE, step_s=0.01)


def test_another_vehicle_is_refused() -> None:
    with pytest.raises(ConfigError, match="omni-wheels"):
        OmniWorld(load("max2d").profile)
