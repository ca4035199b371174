"""The simulated MAX2D on the bench: stiff speed control on each wheel, and kinematics of its own to compare with."""

from __future__ import annotations

from math import cos, hypot, sin

import msgspec

from drivers.simulated.max2d import Max2dWorld
from drivers.simulated.world import STEP_S
from profiles.loader import load
from profiles.schema import DriveConfig, PairedSteerGeometry, Profile, SimulationConfig

PROFILE = load("max2d").profile
START = (0.0, 0.0, 0.0)


def vehicle() -> PairedSteerGeometry:
    assert isinstance(PROFILE.vehicle, PairedSteerGeometry)
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
