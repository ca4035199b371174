"""Body and wheel pairs of the MAX2D as rigid bodies on a plane, driven by the forces of the four tyres.

Symbols, in the body's frame (x forward, y left, origin in the centre): velocity ``(vx, vy)``, yaw rate ``w``, and per
pair its heading ``p`` and rate ``dp/dt`` relative to the body. Steering axes stand at ``(X, Y) = (-+l/2, -+h/2)``. In
the frame that turns with a pair, a contact point lies at ``(B, A)`` from its steering axis: ``B = +b`` in front and
``-b`` at the rear, ``A = +a`` left and ``-a`` right. A belt couples both wheels of a pair, so one heading is enough.

Velocity of a contact point along and left of the heading, with the pair's rate of turn in space ``W = w + dp/dt``::

    v_roll = (vx - w Y) cos p + (vy + w X) sin p - W A
    v_lat  = (vy + w X) cos p - (vx - w Y) sin p + W B

Equations of motion (Lagrange with the coordinates x, y, yaw, p_rear, p_front). ``J`` is the moment of inertia of the
whole robot, ``I`` that of one pair about its axes; the wheels' static moments about the axes cancel within a pair, save
for the few millimetres of b. Every contact force F = (F_roll, F_lat) does work on the velocity of its contact point::

    m a = sum F
    I (dw/dt + d2p/dt2) = N - Q                        N = sum (B F_lat - A F_roll)
    (J - 2 I) dw/dt = sum (X F_y - Y F_x) + sum Q

So a force reaches the body through the bearing of its steering axis, and its moment about that axis, N, either turns
the pair or is passed on to the body as Q, the torque of brake, dry friction and stop. Q is what would keep the pair
from turning during a step of length h, ``N + I (dp/dt) / h``, cut to what brake and friction can hold: a held pair has
``dp/dt = 0`` and passes everything on, so its I moves with the body and the body's inertia is J.

The wheels' moment of spin does not steer, and a contact patch that turns on the spot has no drilling moment of its
own; take that as part of the steering axes' dry friction.
"""

from __future__ import annotations

from math import copysign, cos, inf, radians, sin
from random import Random

from canhelm.errors import ConfigError
from drivers.simulated.motor import WheelDrive
from drivers.simulated.tyre import Contact
from drivers.simulated.world import STEP_S, Axis
from profiles.schema import BrakeConfig, PairedSteerGeometry, Profile, SimulationConfig

GRAVITY_M_S2 = 9.81
LOAD_SHIFT_S = 0.05
"""Time constant with which wheel loads follow the body's acceleration (assumed)."""
REST_SPEED = 1e-5
"""Speed [m/s, rad/s] below which a motion counts as rest."""
REST_STEPS = 50
"""Steps at rest, half a swing of the body on its tyres, after which the world stands still."""


class Wheel:
    """One wheel: tyre, motor with gear, load."""

    __slots__ = ("contact", "drive", "load_n")

    def __init__(self, drive: WheelDrive, contact: Contact, load_n: float) -> None:
        self.drive = drive
        self.contact = contact
        self.load_n = load_n


class Pair:
    """Two wheels that steer together: one heading, one brake.

    Args:
        geometry: geometry of the vehicle.
        simulation: inertia, friction and brake of the pair.
        side: +1 for the front pair, -1 for the rear pair.
        right: the right wheel.
        left: the left wheel.
    """

    __slots__ = (
        "_arm_m",
        "_brake_n_m",
        "_cos",
        "_friction_n_m",
        "_half_track_m",
        "_holding_n_m",
        "_lead_m",
        "_push_n_m",
        "_sin",
        "_stop_rad",
        "force_x_n",
        "force_y_n",
        "heading_rad",
        "held",
        "inertia_kg_m2",
        "left",
        "offset_m",
        "passed_n_m",
        "rate_rad_s",
        "right",
        "yaw_moment_n_m",
    )

    def __init__(
        self, geometry: PairedSteerGeometry, simulation: SimulationConfig, side: int, right: Wheel, left: Wheel
    ) -> None:
        self.right = right
        self.left = left
        self.heading_rad = 0.0
        self.rate_rad_s = 0.0
        """Rate of turn relative to the body."""
        self.held = True
        """Whether brake, friction or stop kept the pair from turning in the last step."""
        self.inertia_kg_m2 = simulation.steering_inertia_kg_m2
        self.offset_m = side * geometry.wheelbase_m / 2.0
        self.force_x_n = 0.0
        self.force_y_n = 0.0
        self.yaw_moment_n_m = 0.0
        """Moment of the bearings' forces about the body's centre."""
        self.passed_n_m = 0.0
        """Torque about the steering axes that is passed on to the body."""
        self._arm_m = geometry.contact_offset_m
        self._lead_m = side * geometry.contact_lead_m
        self._half_track_m = geometry.pivot_track_m / 2.0
        self._stop_rad = radians(geometry.max_heading_deg)
        self._friction_n_m = simulation.steering_friction_n_m
        self._brake_n_m = simulation.brake_holding_torque_n_m
        self._holding_n_m = self._friction_n_m
        self._push_n_m = 0.0
        self._cos = 1.0
        self._sin = 0.0

    def set_brake(self, engaged: bool) -> None:
        """Engage or release the pair's brake."""
        self._holding_n_m = self._friction_n_m + (self._brake_n_m if engaged else 0.0)

    def place(self, heading_rad: float) -> None:
        """Put the pair at a heading."""
        self.heading_rad = heading_rad
        self._cos = cos(heading_rad)
        self._sin = sin(heading_rad)

    def roll(self, vx: float, vy: float, yaw_rate: float, dt_s: float) -> None:
        """Roll both wheels for one step: deform the tyres, turn the wheels, sum the forces on the body."""
        c, s = self._cos, self._sin
        track = yaw_rate * self._half_track_m
        side = vy + yaw_rate * self.offset_m
        turning = yaw_rate + self.rate_rad_s
        swing = turning * self._arm_m + track * c
        along = vx * c + side * s
        across = side * c - vx * s + turning * self._lead_m
        right_x, right_y = _roll_wheel(self.right, along + swing, across - track * s, dt_s)
        left_x, left_y = _roll_wheel(self.left, along - swing, across + track * s, dt_s)
        force_roll = right_x + left_x
        force_lat = right_y + left_y
        ahead = right_x - left_x
        self.force_x_n = force_roll * c - force_lat * s
        self.force_y_n = force_y = force_roll * s + force_lat * c
        difference_x = ahead * c - (right_y - left_y) * s
        self.yaw_moment_n_m = self.offset_m * force_y + self._half_track_m * difference_x
        self._push_n_m = self._lead_m * force_lat + self._arm_m * ahead + self.inertia_kg_m2 * self.rate_rad_s / dt_s

    def hold(self) -> None:
        """Decide whether the pair turns in this step, and what torque it passes on to the body."""
        push = self._push_n_m
        limit = self._holding_n_m
        if abs(self.heading_rad) >= self._stop_rad and push * self.heading_rad > 0.0:
            limit = inf
        self.held = -limit <= push <= limit
        self.passed_n_m = push if self.held else copysign(limit, push)

    def turn(self, yaw_acceleration: float, dt_s: float) -> None:
        """Turn the pair for one step unless it is held."""
        if self.held:
            self.rate_rad_s = 0.0
            return
        rate = ((self._push_n_m - self.passed_n_m) / self.inertia_kg_m2 - yaw_acceleration) * dt_s
        self.rate_rad_s = rate
        self.place(self.heading_rad + rate * dt_s)


def _roll_wheel(wheel: Wheel, roll_m_s: float, lateral_m_s: float, dt_s: float) -> tuple[float, float]:
    """Roll one wheel for one step; returns the floor's force on it along and left of its heading [N]."""
    drive, contact, load = wheel.drive, wheel.contact, wheel.load_n
    contact.deform(drive.rim_m_s, roll_m_s, lateral_m_s, load, dt_s)
    force = contact.force_x_n
    drive.turn(force, load, dt_s)
    return force, contact.force_y_n


class Max2dWorld:
    """The MAX2D on a level floor; a :class:`drivers.simulated.world.World` that also tells the truth to tests.

    Args:
        profile: a robot with a paired-steer vehicle and a simulation section.
        seed: decides where within an encoder count each motor shaft stands at the start.
        start: pose of the centre (x_m, y_m, yaw_rad).
        step_s: integration step.

    Raises:
        ConfigError: the profile has no paired-steer vehicle or no simulation section.
    """

    def __init__(
        self,
        profile: Profile,
        seed: int = 0,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        step_s: float = STEP_S,
    ) -> None:
        vehicle, simulation = _parts_of(profile)
        random = Random(seed)
        load = vehicle.mass_kg * GRAVITY_M_S2 / 4.0
        self.wheels = {
            name: Wheel(WheelDrive(profile.drives[name], simulation, random.random()), Contact(simulation.tyre), load)
            for name in vehicle.wheels
        }
        """Wheels by the names of their drives, in the order rear right, rear left, front left, front right."""
        self.axes: dict[str, Axis] = {name: wheel.drive.axis for name, wheel in self.wheels.items()}
        rear_right, rear_left, front_left, front_right = self.wheels.values()
        self._rear = Pair(vehicle, simulation, -1, rear_right, rear_left)
        self._front = Pair(vehicle, simulation, 1, front_right, front_left)
        self.pairs = dict(zip(vehicle.encoders, (self._rear, self._front), strict=True))
        """Wheel pairs by the names of their encoders."""
        self._braked = dict(zip(vehicle.brakes, (self._rear, self._front), strict=True))
        for name, pair in self._braked.items():
            pair.set_brake(_engaged_without_power(profile.brakes[name]))
        self._drives = tuple(wheel.drive for wheel in self.wheels.values())
        self._place_body(vehicle, start)
        self._step_s = step_s
        self._origin_s: float | None = None
        self._steps_done = 0
        self._quiet_steps = REST_STEPS

    def _place_body(self, vehicle: PairedSteerGeometry, start: tuple[float, float, float]) -> None:
        self._mass_kg = vehicle.mass_kg
        self._yaw_inertia = vehicle.yaw_inertia_kg_m2
        self._x_m, self._y_m, self._yaw_rad = start
        self._cos, self._sin = cos(self._yaw_rad), sin(self._yaw_rad)
        self._world_vx = self._world_vy = self._yaw_rate = 0.0
        self._mean_load_n = vehicle.mass_kg * GRAVITY_M_S2 / 4.0
        height = vehicle.centre_of_mass_height_m
        width = vehicle.pivot_track_m + 2.0 * vehicle.contact_offset_m
        self._shift_x = height / (2.0 * vehicle.wheelbase_m)
        self._shift_y = height / (2.0 * width)
        self._shift_x_n = self._shift_y_n = 0.0

    @property
    def moving(self) -> bool:
        """False while everything is at rest and every torque source repeats its demand."""
        return self._quiet_steps < REST_STEPS

    @property
    def pose(self) -> tuple[float, float, float]:
        """True pose of the centre: x_m, y_m, yaw_rad (unwrapped)."""
        return self._x_m, self._y_m, self._yaw_rad

    @property
    def velocity(self) -> tuple[float, float, float]:
        """True velocity in the body's frame: forward m/s, left m/s, yaw rate rad/s."""
        vx, vy = self._body_velocity()
        return vx, vy, self._yaw_rate

    @property
    def max_slip_ratio(self) -> float:
        """Largest slip ratio of any wheel since the last ``reset_statistics``."""
        return max(wheel.contact.max_slip_ratio for wheel in self.wheels.values())

    def heading_rad(self, pair: str) -> float:
        """True heading of a wheel pair by its encoder's name."""
        return self.pairs[pair].heading_rad

    def set_heading(self, pair: str, heading_rad: float) -> None:
        """Put a wheel pair at a heading, as by hand before the start."""
        self.pairs[pair].place(heading_rad)

    def set_brake(self, name: str, engaged: bool) -> None:
        """Engage or release a steering brake from the last advanced time on."""
        self._braked[name].set_brake(engaged)
        self._quiet_steps = 0

    def reset_statistics(self) -> None:
        """Forget the largest slips."""
        for wheel in self.wheels.values():
            wheel.contact.reset_statistics()

    def advance(self, now_s: float) -> None:
        """Integrate up to ``now_s``; the first call sets the origin of time."""
        if self._origin_s is None:
            self._origin_s = now_s
        steps = int((now_s - self._origin_s) / self._step_s + 1e-6)
        while self._steps_done < steps:
            if self._ask_sources():
                self._quiet_steps = 0
            elif self._quiet_steps >= REST_STEPS:
                self._steps_done = steps
                return
            self._step()
            self._steps_done += 1
            self._quiet_steps = self._quiet_steps + 1 if self._is_slow() else 0
            if self._quiet_steps == REST_STEPS:
                self._come_to_rest()

    def _ask_sources(self) -> bool:
        """Ask every drive for its demand; True when one of them changed."""
        step = self._step_s
        changed = False
        for drive in self._drives:
            if drive.ask(step):
                changed = True
        return changed

    def _step(self) -> None:
        """Integrate one step: forces by the old velocities, then velocities, then positions."""
        dt = self._step_s
        rear, front = self._rear, self._front
        vx, vy = self._body_velocity()
        rear.roll(vx, vy, self._yaw_rate, dt)
        front.roll(vx, vy, self._yaw_rate, dt)
        force_x = rear.force_x_n + front.force_x_n
        force_y = rear.force_y_n + front.force_y_n
        self._turn_body(dt)
        c, s = self._cos, self._sin
        per_mass = dt / self._mass_kg
        self._world_vx += (force_x * c - force_y * s) * per_mass
        self._world_vy += (force_x * s + force_y * c) * per_mass
        self._x_m += self._world_vx * dt
        self._y_m += self._world_vy * dt
        if self._yaw_rate != 0.0:
            self._yaw_rad += self._yaw_rate * dt
            self._cos, self._sin = cos(self._yaw_rad), sin(self._yaw_rad)
        self._shift_loads(force_x, force_y, dt)

    def _turn_body(self, dt: float) -> None:
        """Yaw acceleration of the body with the pairs that are held, and turning of the pairs that are not."""
        inertia = self._yaw_inertia
        moment = 0.0
        for pair in (self._rear, self._front):
            pair.hold()
            moment += pair.yaw_moment_n_m + pair.passed_n_m
            if not pair.held:
                inertia -= pair.inertia_kg_m2
        acceleration = moment / inertia
        self._rear.turn(acceleration, dt)
        self._front.turn(acceleration, dt)
        self._yaw_rate += acceleration * dt

    def _shift_loads(self, force_x: float, force_y: float, dt: float) -> None:
        """Let the wheel loads follow the body's acceleration: back when speeding up, outward in a bend."""
        share = dt / LOAD_SHIFT_S
        self._shift_x_n += (force_x * self._shift_x - self._shift_x_n) * share
        self._shift_y_n += (force_y * self._shift_y - self._shift_y_n) * share
        back, right, mean = self._shift_x_n, self._shift_y_n, self._mean_load_n
        self._rear.right.load_n = mean + back + right
        self._rear.left.load_n = mean + back - right
        self._front.left.load_n = mean - back - right
        self._front.right.load_n = mean - back + right

    def _body_velocity(self) -> tuple[float, float]:
        """Velocity of the centre, forward and left [m/s]."""
        c, s = self._cos, self._sin
        return self._world_vx * c + self._world_vy * s, self._world_vy * c - self._world_vx * s

    def _is_slow(self) -> bool:
        """Whether nothing moves faster than what counts as rest."""
        if not (-REST_SPEED < self._world_vx < REST_SPEED and -REST_SPEED < self._world_vy < REST_SPEED):
            return False
        motions = (self._yaw_rate, self._rear.rate_rad_s, self._front.rate_rad_s, *(d.rim_m_s for d in self._drives))
        return all(-REST_SPEED < motion < REST_SPEED for motion in motions)

    def _come_to_rest(self) -> None:
        """Take the last imperceptible motion away."""
        self._world_vx = self._world_vy = self._yaw_rate = 0.0
        self._rear.rate_rad_s = self._front.rate_rad_s = 0.0
        for drive in self._drives:
            drive.stop()


def _parts_of(profile: Profile) -> tuple[PairedSteerGeometry, SimulationConfig]:
    """The sections of the profile that the physics needs."""
    if profile.vehicle is None or profile.simulation is None:
        raise ConfigError(
            f"profile {profile.name} cannot be simulated as a vehicle: it needs the sections vehicle and simulation",
            object="simulation" if profile.simulation is None else "vehicle",
            remedy="add them, or start from a profile that has them: canhelm profile new NAME --extends max2d",
        )
    return profile.vehicle, profile.simulation


def _engaged_without_power(brake: BrakeConfig) -> bool:
    """Whether the brake's spring engages it while nothing energises it."""
    return brake.energise_to_release
