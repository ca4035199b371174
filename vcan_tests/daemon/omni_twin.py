"""The simulated Turtle with a stiff speed control on each wheel, for the traction loops alone, without a bus."""

from __future__ import annotations

import math

import msgspec

from daemon.loops.accelerometer import Mounting, Vector
from daemon.loops.planner import PlanarLimits
from daemon.loops.slip_observer import Body, rim_drive
from daemon.loops.traction import TractionTuning
from drivers.simulated.omni import OmniWorld
from profiles.loader import load
from profiles.schema import DriveConfig, FloorPatch, OmniGeometry, Profile
from vcan_tests.daemon.gripping_robot import RobotData
from vcan_tests.daemon.omni_floor import CYCLE_S

RAMP_STEPS = 5
"""Parts of a cycle in which the drives ramp to a new target."""


def turtle(**patches: FloorPatch) -> Profile:
    """The Turtle on a floor with patches."""
    profile = load("turtle").profile
    assert profile.simulation is not None
    return msgspec.structs.replace(profile, simulation=msgspec.structs.replace(profile.simulation, floor=dict(patches)))


def robot_data(profile: Profile) -> RobotData:
    """What the loops know of it, by its profile."""
    vehicle, sensor, limits = _parts(profile), profile.accelerometer, profile.limits
    assert sensor is not None
    drive = next(iter(profile.drives.values()))
    assert profile.traction is not None
    return RobotData(
        PlanarLimits(
            limits.speed_m_s,
            limits.acceleration_m_s2,
            math.radians(limits.yaw_rate_deg_s),
            math.radians(limits.yaw_acceleration_deg_s2),
        ),
        rim_drive(drive, profile.traction),
        Body(vehicle.mass_kg, vehicle.yaw_inertia_kg_m2),
        Mounting(sensor.x_m, sensor.y_m, math.radians(sensor.rotation_deg)),
        TractionTuning(response_s=0.04),
    )


def _parts(profile: Profile) -> OmniGeometry:
    assert isinstance(profile.vehicle, OmniGeometry)
    return profile.vehicle


class SpeedSource:
    """A stiff PI speed controller."""

    def __init__(self, config: DriveConfig) -> None:
        self.target_m_s = 0.0
        self._shaft_per_m_s = config.direction * config.total_ratio / config.wheel_radius_m
        self._most_a = config.output_current_a
        self._sum_a = 0.0

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        error = self.target_m_s * self._shaft_per_m_s - speed_rad_s
        most = self._most_a
        self._sum_a = min(max(self._sum_a + 1.5 * error * dt_s, -most), most)
        return min(max(0.2 * error + self._sum_a, -most), most)


class TwinFloor:
    """The world with the same handles as the small plant of the tests."""

    def __init__(self, profile: Profile, seed: int = 1) -> None:
        self._world = OmniWorld(profile, seed)
        self._sources = [SpeedSource(profile.drives[name]) for name in self._world.wheels]
        for name, source in zip(self._world.wheels, self._sources, strict=True):
            self._world.axes[name].torque_source = source
        self._directions = [profile.drives[name].direction for name in self._world.wheels]
        self._config = profile.accelerometer
        self._now_s = 0.0
        self._waiting: tuple[float, ...] = (0.0, 0.0, 0.0)
        self._world.advance(0.0)
        self._read()

    def roll(self, rim_targets: tuple[float, ...]) -> None:
        """Live through one cycle under the command of the cycle before."""
        wanted, self._waiting = self._waiting, rim_targets
        before = [source.target_m_s for source in self._sources]
        for part in range(1, RAMP_STEPS + 1):
            for source, old, new in zip(self._sources, before, wanted, strict=True):
                source.target_m_s = old + (new - old) * part / RAMP_STEPS
            self._world.advance(self._now_s + CYCLE_S * part / RAMP_STEPS)
        self._now_s += CYCLE_S
        self._read()

    def _read(self) -> None:
        world = self._world
        drives = [wheel.drive for wheel in world.wheels.values()]
        self.rims = [drive.rim_m_s for drive in drives]
        signs = zip(self._directions, drives, strict=True)
        self.currents = [sign * drive.axis.current_a for sign, drive in signs]
        self.slips = list(world.slip_m_s)
        x, y, self.heading = world.pose
        self.place, self.velocity = complex(x, y), complex(*world.velocity[:2])
        self.reading = self._reading()

    def _reading(self) -> Vector:
        sensor, config = self._world.accelerometer, self._config
        assert sensor is not None
        assert config is not None
        zero, scale = config.zero_mv, config.sensitivity_mv_per_m_s2
        return ((sensor.voltage_mv(0) - zero) / scale, (sensor.voltage_mv(1) - zero) / scale)
