"""A robot on omni-wheels as a rigid body on a level floor, driven by the forces of its wheels' rims.

With the contact points (X, Y) in the robot's frame, mass m and the moment of inertia J about the centre::

    m a = sum F        J dw/dt = sum (X F_y - Y F_x)

Wheel loads N are quasi-static: they carry the weight, and balance the moment of the floor's forces about the centre of
mass at height h: ``sum N = m g``, ``sum X N = -h sum F_x``, ``sum Y N = -h sum F_y``. With more than three wheels they
are the smallest ones that do.
"""

from __future__ import annotations

from operator import mul
from random import Random

from canhelm.errors import ConfigError
from drivers.simulated.accelerometer import SimulatedAccelerometer
from drivers.simulated.body import GRAVITY_M_S2, LOAD_SHIFT_S, BodyWorld, parts_of
from drivers.simulated.floor import Floor
from drivers.simulated.motor import WheelDrive
from drivers.simulated.roller_wheel import RollerWheel
from drivers.simulated.tyre import require_soft
from drivers.simulated.world import STEP_S
from profiles.schema import OmniGeometry, Profile, SimulationConfig

LEAST_SPREAD_M4 = 1e-9
"""Smallest determinant of the contact points' sums that counts as no line."""


class OmniWorld(BodyWorld):
    """The robot on a level floor.

    Args:
        profile: a robot with omni-wheels and a simulation section.
        seed: of where within an encoder count each motor shaft stands at the start, and of the accelerometer's noise.
        start: pose of the centre (x_m, y_m, yaw_rad).
        step_s: integration step.

    Attributes:
        wheels: by the names of their drives.
        floor: its friction.
        accelerometer: None where the profile has none.

    Raises:
        ConfigError: the profile has no omni-wheels or no simulation section, or its tyres are too stiff for the step.
    """

    def __init__(
        self,
        profile: Profile,
        seed: int = 0,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        step_s: float = STEP_S,
    ) -> None:
        vehicle, simulation = parts_of(profile, OmniGeometry, "a robot on omni-wheels", "turtle")
        random = Random(seed)
        self.wheels = {
            name: RollerWheel(geometry, simulation, WheelDrive(profile.drives[name], simulation, random.random()))
            for name, geometry in vehicle.wheels.items()
        }
        drives = {name: wheel.drive for name, wheel in self.wheels.items()}
        super().__init__(drives, vehicle.mass_kg, start, step_s)
        _check_stiffness(profile, vehicle, simulation, step_s)
        self.contacts = self.wheels
        self.floor = Floor(simulation.tyre.friction, simulation.floor)
        config, noise = profile.accelerometer, simulation.accelerometer_noise_m_s2
        self.accelerometer = SimulatedAccelerometer(config, noise, random.getrandbits(32)) if config else None
        self._rolling = tuple(self.wheels.values())
        self._yaw_inertia = vehicle.yaw_inertia_kg_m2
        self._fit_brakes(profile, {name: drives[brake.drive] for name, brake in profile.brakes.items()})
        self._spread_load(vehicle)

    def _spread_load(self, vehicle: OmniGeometry) -> None:
        """Loads at rest, and how the floor's forces shift them."""
        weight, height = vehicle.mass_kg * GRAVITY_M_S2, vehicle.centre_of_mass_height_m
        rows = [(1.0, wheel.x_m, wheel.y_m) for wheel in self._rolling]
        self._loads = [(weight * a, -height * b, -height * c) for a, b, c in _smallest(rows)]
        self._shift_x_n = self._shift_y_n = 0.0
        for wheel, (load, _, _) in zip(self._rolling, self._loads, strict=True):
            wheel.load_n = load

    @property
    def slip_ratio(self) -> tuple[float, ...]:
        """True slip ratios of the wheels, along their directions."""
        return tuple(wheel.slip_ratio for wheel in self._rolling)

    @property
    def slip_angle_rad(self) -> tuple[float, ...]:
        """Angles from the wheels' directions to the motions of their contact points; rollers make any of them free."""
        return tuple(wheel.slip_angle_rad for wheel in self._rolling)

    @property
    def slip_m_s(self) -> tuple[float, ...]:
        """True rim speeds less rolling speeds of the wheels."""
        return tuple(wheel.slip_m_s for wheel in self._rolling)

    @property
    def sliding(self) -> tuple[bool, ...]:
        """Whether each wheel asks the floor for more than friction holds."""
        return tuple(wheel.sliding for wheel in self._rolling)

    def heading_rad(self, pair: str) -> float:
        """Raises KeyError: there are no wheel pairs."""
        raise KeyError(pair)

    def _step(self) -> None:
        """Integrate one step: forces by the old velocities, then velocities, then positions."""
        dt, time_s = self._step_s, self.time_s
        (vx, vy), rate = self._body_velocity(), self._yaw_rate
        x_m, y_m, c, s = self._x_m, self._y_m, self._cos, self._sin
        friction = self.floor.friction
        force_x = force_y = moment = 0.0
        for wheel in self._rolling:
            x, y = wheel.x_m, wheel.y_m
            wheel.roll(vx, vy, rate, friction(x_m + x * c - y * s, y_m + x * s + y * c, time_s), dt)
            force_x += wheel.force_x_n
            force_y += wheel.force_y_n
            moment += x * wheel.force_y_n - y * wheel.force_x_n
        self._move(force_x, force_y, moment / self._yaw_inertia, dt)
        self._shift_loads(force_x, force_y, dt)
        if self.accelerometer is not None:
            pull = (self._pull_x, self._pull_y)
            self.accelerometer.follow(self._world_vx, self._world_vy, self._yaw_rate, self._cos, self._sin, dt, pull)

    def _shift_loads(self, force_x: float, force_y: float, dt: float) -> None:
        """Let the wheel loads follow the body's acceleration; a wheel does not pull at the floor."""
        share = dt / LOAD_SHIFT_S
        self._shift_x_n += (force_x - self._shift_x_n) * share
        self._shift_y_n += (force_y - self._shift_y_n) * share
        for wheel, (load, by_x, by_y) in zip(self._rolling, self._loads, strict=True):
            wheel.load_n = max(0.0, load + by_x * self._shift_x_n + by_y * self._shift_y_n)

    def _come_to_rest(self) -> None:
        super()._come_to_rest()
        if self.accelerometer is not None:
            self.accelerometer.rest(self._cos, self._sin, (self._pull_x, self._pull_y))


def _smallest(rows: list[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """``rows (rows^T rows)^-1``: times three sums, the smallest numbers, one a row, that have these sums over the rows.

    The wheels touch the floor at three points or more that are on no line, so the matrix has an inverse.
    """
    a, b, c = zip(*rows, strict=True)
    (aa, ab, ac), (_, bb, bc), (_, _, cc) = ([sum(map(mul, one, other)) for other in (a, b, c)] for one in (a, b, c))
    xx, xy, xz = bb * cc - bc * bc, ac * bc - ab * cc, ab * bc - ac * bb
    yy, yz, zz = aa * cc - ac * ac, ab * ac - aa * bc, aa * bb - ab * ab
    determinant = aa * xx + ab * xy + ac * xz
    if determinant < LEAST_SPREAD_M4:
        raise ConfigError(
            "the simulated robot would fall over: its wheels touch the floor on a line",
            object="vehicle.wheels",
            remedy="check their directions and levers",
        )
    inverse = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    return [
        (
            sum(map(mul, row, inverse[0])) / determinant,
            sum(map(mul, row, inverse[1])) / determinant,
            sum(map(mul, row, inverse[2])) / determinant,
        )
        for row in rows
    ]


def _check_stiffness(profile: Profile, vehicle: OmniGeometry, simulation: SimulationConfig, step_s: float) -> None:
    """Refuse tyres that the step cannot follow.

    What they pull at is one wheel, and the body at the wheel's rim, where all wheels' springs may pull together.
    """
    wheels, lever_m = len(vehicle.wheels), max(abs(wheel.lever_m) for wheel in vehicle.wheels.values())
    body = wheels * (1.0 / vehicle.mass_kg + lever_m * lever_m / vehicle.yaw_inertia_kg_m2)
    rim = max(
        drive.wheel_radius_m**2
        / (simulation.wheel_inertia_kg_m2 + drive.total_ratio**2 * drive.motor.rotor_inertia_kg_m2)
        for drive in profile.drives.values()
    )
    tyre, load = simulation.tyre, vehicle.mass_kg * GRAVITY_M_S2 / wheels
    require_soft(tyre, tyre.slip_stiffness * load, rim + body, step_s)
