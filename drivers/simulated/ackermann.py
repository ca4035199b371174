"""A car with front-wheel steering as a rigid body on a level floor, driven by the forces of its four tyres.

In the body's frame (x forward, y left, origin in the centre of mass) the wheels stand at ``(X, Y)``: the rear ones at
``(-a, +-W/2)``, the front ones at ``(L - a, +-W/2)``, turned by the angles d of an ideal linkage: with g the angle of
the axle, each front wheel stands across the line to the point of the rear axle's line that a wheel in the middle would
turn about, ``tan d = L sin g / (L cos g -+ W/2 sin g)``, minus for the left one. A contact point moves along and to the
left of its wheel with::

    v_roll = (vx - w Y) cos d + (vy + w X) sin d        v_lat = (vy + w X) cos d - (vx - w Y) sin d

Mass m and the moment of inertia J about the centre of mass, F the floor's forces in the body's frame::

    m a = sum F        J dw/dt = sum (X F_y - Y F_x)

Wheel loads are quasi-static: they carry the weight and balance the moment of the forces about the centre of mass at its
height. The front wheels roll freely. The steering has inertia of its own about its axes; what it passes on to the body
is left out.
"""

from __future__ import annotations

from math import atan2, cos, sin
from random import Random

from drivers.simulated.body import GRAVITY_M_S2, LOAD_SHIFT_S, BodyWorld, parts_of
from drivers.simulated.motor import WheelDrive
from drivers.simulated.steered_axle import SimulatedSteering
from drivers.simulated.tyre import Contact, require_soft
from drivers.simulated.world import STEP_S
from profiles.schema import Profile, SimulationConfig
from profiles.steered import CarGeometry


class FreeWheel:
    """A wheel without a motor.

    Attributes:
        rim_m_s: speed of its rim.
    """

    __slots__ = ("_per_mass", "_resistance", "rim_m_s")

    def __init__(self, simulation: SimulationConfig, radius_m: float) -> None:
        self._per_mass = radius_m * radius_m / simulation.wheel_inertia_kg_m2
        self._resistance = simulation.tyre.rolling_resistance
        self.rim_m_s = 0.0

    def turn(self, contact_force_n: float, load_n: float, dt_s: float) -> None:
        """Turn for one step by the force of the floor along the wheel; rolling resistance at most stops it."""
        step = dt_s * self._per_mass
        speed, stopping = self.rim_m_s - contact_force_n * step, self._resistance * load_n * step
        self.rim_m_s = speed - stopping if speed > stopping else speed + stopping if speed < -stopping else 0.0

    def stop(self) -> None:
        """Bring the wheel to rest at once."""
        self.rim_m_s = 0.0


class CarWheel:
    """A wheel's place, direction, tyre and load.

    Attributes:
        x_m, y_m: in the body's frame.
        load_n: wheel load.
        force_x_n, force_y_n: force of the floor in the body's frame.
    """

    __slots__ = ("_cos", "_sin", "contact", "force_x_n", "force_y_n", "load_n", "rolling", "x_m", "y_m")

    def __init__(self, x_m: float, y_m: float, rolling: WheelDrive | FreeWheel, contact: Contact) -> None:
        self.x_m, self.y_m = x_m, y_m
        self.rolling = rolling
        self.contact = contact
        self.load_n = self.force_x_n = self.force_y_n = 0.0
        self._cos, self._sin = 1.0, 0.0

    def point(self, direction_rad: float) -> None:
        """Turn to a direction in the body's frame."""
        self._cos, self._sin = cos(direction_rad), sin(direction_rad)

    def roll(self, vx: float, vy: float, yaw_rate: float, dt_s: float) -> None:
        """Roll for one step: deform the tyre, update the force, turn the wheel."""
        point_x, point_y = vx - yaw_rate * self.y_m, vy + yaw_rate * self.x_m
        c, s, contact = self._cos, self._sin, self.contact
        along, across = point_x * c + point_y * s, point_y * c - point_x * s
        contact.deform(self.rolling.rim_m_s, along, across, self.load_n, dt_s)
        force_x, force_y = contact.force_x_n, contact.force_y_n
        self.force_x_n = force_x * c - force_y * s
        self.force_y_n = force_x * s + force_y * c
        self.rolling.turn(force_x, self.load_n, dt_s)


class AckermannWorld(BodyWorld):
    """The car on a level floor.

    Args:
        profile: a car with a simulation section.
        seed: of where within an encoder count each motor shaft stands at the start.
        start: pose of the rear axle's middle (x_m, y_m, yaw_rad).
        step_s: integration step.

    Attributes:
        steering: the steered axle.
        wheels: rear left, rear right, front left, front right.

    Raises:
        ConfigError: the profile has no car or no simulation section, or its tyres are too stiff for the step.
    """

    def __init__(
        self,
        profile: Profile,
        seed: int = 0,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        step_s: float = STEP_S,
    ) -> None:
        vehicle, simulation = parts_of(profile, CarGeometry, "a car", "ackermann")
        _check_stiffness(profile, vehicle, simulation, step_s)
        random, axle = Random(seed), vehicle.steering
        drives = {name: WheelDrive(profile.drives[name], simulation, random.random()) for name in vehicle.wheels}
        self.steering = SimulatedSteering(axle, profile.drives[axle.drive], simulation, random.random())
        radius = profile.drives[vehicle.wheels[0]].wheel_radius_m
        self._free = (FreeWheel(simulation, radius), FreeWheel(simulation, radius))
        half, back, ahead = vehicle.track_m / 2, -vehicle.mass_offset_m, vehicle.wheelbase_m - vehicle.mass_offset_m
        places = ((back, half), (back, -half), (ahead, half), (ahead, -half))
        rolling: tuple[WheelDrive | FreeWheel, ...] = (*drives.values(), *self._free)
        self.wheels = tuple(
            CarWheel(x, y, wheel, Contact(simulation.tyre)) for (x, y), wheel in zip(places, rolling, strict=True)
        )
        x, y, yaw = start
        centre = (x - back * cos(yaw), y - back * sin(yaw), yaw)
        super().__init__({**drives, axle.drive: self.steering.drive}, vehicle.mass_kg, centre, step_s)
        self.contacts = {name: wheel.contact for name, wheel in zip(vehicle.wheels, self.wheels, strict=False)}
        self._encoder = axle.encoder
        self._back_m = back
        self._wheelbase_m, self._half_track_m = vehicle.wheelbase_m, half
        self._yaw_inertia = vehicle.yaw_inertia_kg_m2
        self._spread_load(vehicle)

    def _spread_load(self, vehicle: CarGeometry) -> None:
        """Loads at rest, and how forces at the height of the centre of mass shift them."""
        length, height = vehicle.wheelbase_m, vehicle.centre_of_mass_height_m
        front = vehicle.mass_offset_m / length
        weight = vehicle.mass_kg * GRAVITY_M_S2
        self._still_n = (weight * (1 - front) / 2, weight * front / 2)
        self._shift_x, self._shift_y = height / (2 * length), height / vehicle.track_m
        self._shares = (1 - front, front)
        self._shift_x_n = self._shift_y_n = 0.0
        self._set_loads()

    def _set_loads(self) -> None:
        back, right = self._shift_x_n, self._shift_y_n
        for index, wheel in enumerate(self.wheels):
            axle = index // 2
            along = back if axle == 0 else -back
            aside = right * self._shares[axle]
            wheel.load_n = max(0.0, self._still_n[axle] + along + (aside if index % 2 else -aside))

    @property
    def rear_pose(self) -> tuple[float, float, float]:
        """True pose of the rear axle's middle: x_m, y_m, yaw_rad (unwrapped)."""
        return self._x_m + self._back_m * self._cos, self._y_m + self._back_m * self._sin, self._yaw_rad

    @property
    def slip_ratio(self) -> tuple[float, ...]:
        """True slip ratios of the wheels: (rim speed - rolling speed) over the faster of the two."""
        return tuple(wheel.contact.slip_ratio for wheel in self.wheels)

    @property
    def slip_angle_rad(self) -> tuple[float, ...]:
        """True slip angles of the wheels, positive where the contact point drifts to the left of its heading."""
        return tuple(wheel.contact.slip_angle_rad for wheel in self.wheels)

    def heading_rad(self, pair: str) -> float:
        """True angle of the steered axle, by its encoder's name."""
        if pair != self._encoder:
            raise KeyError(pair)
        return self.steering.angle_rad

    def _step(self) -> None:
        """Integrate one step: forces by the old velocities, then velocities, then positions."""
        dt = self._step_s
        self._steer(dt)
        (vx, vy), rate = self._body_velocity(), self._yaw_rate
        force_x = force_y = moment = 0.0
        for wheel in self.wheels:
            wheel.roll(vx, vy, rate, dt)
            force_x += wheel.force_x_n
            force_y += wheel.force_y_n
            moment += wheel.x_m * wheel.force_y_n - wheel.y_m * wheel.force_x_n
        self._move(force_x, force_y, moment / self._yaw_inertia, dt)
        share = dt / LOAD_SHIFT_S
        self._shift_x_n += (force_x * self._shift_x - self._shift_x_n) * share
        self._shift_y_n += (force_y * self._shift_y - self._shift_y_n) * share
        self._set_loads()

    def _steer(self, dt: float) -> None:
        """Turn the axle, and the front wheels by the linkage."""
        self.steering.turn(dt)
        s, c = sin(self.steering.angle_rad), cos(self.steering.angle_rad)
        length, aside = self._wheelbase_m, self._half_track_m * s
        front_left, front_right = self.wheels[2:]
        front_left.point(atan2(length * s, length * c - aside))
        front_right.point(atan2(length * s, length * c + aside))

    def _step_in_air(self) -> None:
        super()._step_in_air()
        self.steering.follow(self._step_s)

    def _motions(self) -> tuple[float, ...]:
        return (*super()._motions(), self._free[0].rim_m_s, self._free[1].rim_m_s)

    def _come_to_rest(self) -> None:
        super()._come_to_rest()
        for wheel in self._free:
            wheel.stop()


def _check_stiffness(profile: Profile, vehicle: CarGeometry, simulation: SimulationConfig, step_s: float) -> None:
    """Refuse tyres that the step cannot follow.

    What they pull at is a free wheel, which is the lightest, and the body, at which four springs pull.
    """
    radius = profile.drives[vehicle.wheels[0]].wheel_radius_m
    ahead = max(vehicle.mass_offset_m, vehicle.wheelbase_m - vehicle.mass_offset_m)
    body = 4.0 * (1.0 / vehicle.mass_kg + ahead * ahead / vehicle.yaw_inertia_kg_m2)
    mobility = radius * radius / simulation.wheel_inertia_kg_m2 + body
    tyre, load = simulation.tyre, vehicle.mass_kg * GRAVITY_M_S2 / 2.0
    require_soft(tyre, tyre.cornering_stiffness_per_rad * load, mobility, step_s)
