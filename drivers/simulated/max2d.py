"""The MAX2D as a rigid body on a level floor, driven by the forces of its four tyres.

With the velocities and torques of :mod:`drivers.simulated.wheel_pair`, mass m, the moment of inertia J of the whole
robot about its centre, and I of one pair about its steering axes (Lagrange with the coordinates x, y, yaw and the two
headings; the wheels' static moments about the axes cancel within a pair, save for the few millimetres of b)::

    m a = sum F
    (J - 2 I) dw/dt = sum (X F_y - Y F_x) + sum Q

A held pair has ``Q = N - I dw/dt``, so its inertia moves to the left side and its whole moment N acts on the body.
Wheel loads are quasi-static: a quarter of the weight, shifted by the body's acceleration and the height of its centre
of mass.
"""

from __future__ import annotations

from math import hypot
from random import Random

from canhelm.errors import ConfigError
from drivers.simulated.body import GRAVITY_M_S2, LOAD_SHIFT_S, BodyWorld, parts_of
from drivers.simulated.floor import Floor
from drivers.simulated.motor import WheelDrive
from drivers.simulated.tyre import Contact, require_soft
from drivers.simulated.wheel_pair import Pair, Wheel
from drivers.simulated.world import STEP_S
from profiles.schema import PairedSteerGeometry, Profile, SimulationConfig


class Max2dWorld(BodyWorld):
    """The MAX2D on a level floor.

    Args:
        profile: a robot with a paired-steer vehicle and a simulation section.
        seed: decides where within an encoder count each motor shaft stands at the start.
        start: pose of the centre (x_m, y_m, yaw_rad).
        step_s: integration step.

    Raises:
        ConfigError: the profile has no paired-steer vehicle or no simulation section, its tyres are too stiff for the
            step, or the robot would tip over before it slides.
    """

    def __init__(
        self,
        profile: Profile,
        seed: int = 0,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        step_s: float = STEP_S,
    ) -> None:
        vehicle, simulation = parts_of(profile, PairedSteerGeometry, "a vehicle with paired steering", "max2d")
        _check_stiffness(profile, vehicle, simulation, step_s)
        _check_tipping(vehicle, simulation)
        random = Random(seed)
        load = vehicle.mass_kg * GRAVITY_M_S2 / 4.0
        self.wheels = {
            name: Wheel(WheelDrive(profile.drives[name], simulation, random.random()), Contact(simulation.tyre), load)
            for name in vehicle.wheels
        }
        """Wheels by the names of their drives, in the order rear right, rear left, front left, front right."""
        drives = {name: wheel.drive for name, wheel in self.wheels.items()}
        super().__init__(drives, vehicle.mass_kg, start, step_s)
        self.contacts = {name: wheel.contact for name, wheel in self.wheels.items()}
        rear_right, rear_left, front_left, front_right = self.wheels.values()
        self._rear = Pair(vehicle, simulation, -1, rear_right, rear_left)
        self._front = Pair(vehicle, simulation, 1, front_right, front_left)
        self.pairs = dict(zip(vehicle.encoders, (self._rear, self._front), strict=True))
        """Wheel pairs by the names of their encoders."""
        self._pairs = (self._rear, self._front)
        steering = dict(zip(vehicle.brakes, (self._rear, self._front), strict=True))
        braked: dict[str, Pair | WheelDrive] = {
            name: steering[name] if brake.kind == "steering" else self.wheels[brake.drive].drive
            for name, brake in profile.brakes.items()
        }
        self._fit_brakes(profile, braked)
        self._floor = Floor(simulation.tyre.friction, simulation.floor) if simulation.floor else None
        self._yaw_inertia = vehicle.yaw_inertia_kg_m2
        self._mean_load_n = load
        height = vehicle.centre_of_mass_height_m
        width = vehicle.pivot_track_m + 2.0 * vehicle.contact_offset_m
        self._shift_x = height / (2.0 * vehicle.wheelbase_m)
        self._shift_y = height / (2.0 * width)
        self._shift_x_n = self._shift_y_n = 0.0

    @property
    def slip_ratio(self) -> tuple[float, ...]:
        """True slip ratios of wheels 1 to 4: (rim speed - rolling speed) over the faster of the two."""
        return tuple(wheel.contact.slip_ratio for wheel in self.wheels.values())

    @property
    def slip_angle_rad(self) -> tuple[float, ...]:
        """True slip angles of wheels 1 to 4, positive where the contact point drifts to the left of its heading."""
        return tuple(wheel.contact.slip_angle_rad for wheel in self.wheels.values())

    @property
    def slip_m_s(self) -> tuple[float, ...]:
        """True rim speeds less rolling speeds of wheels 1 to 4."""
        return tuple(wheel.contact.slip_m_s for wheel in self.wheels.values())

    def heading_rad(self, pair: str) -> float:
        """True heading of a wheel pair by its encoder's name."""
        return self.pairs[pair].heading_rad

    def set_heading(self, pair: str, heading_rad: float) -> None:
        """Put a wheel pair at a heading, as by hand before the start."""
        self.pairs[pair].place(heading_rad)

    def _step(self) -> None:
        """Integrate one step: forces by the old velocities, then velocities, then positions."""
        dt = self._step_s
        rear, front = self._rear, self._front
        if self._floor is not None:
            self._feel(self._floor)
        vx, vy = self._body_velocity()
        rear.roll(vx, vy, self._yaw_rate, dt)
        front.roll(vx, vy, self._yaw_rate, dt)
        force_x = rear.force_x_n + front.force_x_n
        force_y = rear.force_y_n + front.force_y_n
        self._move(force_x, force_y, self._turn_pairs(dt), dt)
        self._shift_loads(force_x, force_y, dt)

    def _feel(self, floor: Floor) -> None:
        """Each wheel stands on the friction of its place and time."""
        c, s, time_s = self._cos, self._sin, self.time_s
        for pair in self._pairs:
            for wheel, (x, y) in zip((pair.right, pair.left), pair.contact_points(), strict=True):
                wheel.contact.stand_on(floor.friction(self._x_m + x * c - y * s, self._y_m + x * s + y * c, time_s))

    def _turn_pairs(self, dt: float) -> float:
        """Yaw acceleration of the body with the pairs that are held, and turning of the pairs that are not."""
        inertia = self._yaw_inertia
        moment = 0.0
        turning = []
        for pair in self._pairs:
            pair.hold()
            moment += pair.yaw_moment_n_m + pair.passed_n_m
            if not pair.held:
                inertia -= pair.inertia_kg_m2
                turning.append(pair)
        acceleration = moment / inertia
        for pair in turning:
            pair.turn(acceleration, dt)
        return acceleration

    def _shift_loads(self, force_x: float, force_y: float, dt: float) -> None:
        """Let the wheel loads follow the body's acceleration: back when speeding up, outward in a bend."""
        share = dt / LOAD_SHIFT_S
        self._shift_x_n += (force_x * self._shift_x - self._shift_x_n) * share
        self._shift_y_n += (force_y * self._shift_y - self._shift_y_n) * share
        back, right, mean = self._shift_x_n, self._shift_y_n, self._mean_load_n
        rear, front = self._rear, self._front
        rear.right.load_n = mean + back + right
        rear.left.load_n = mean + back - right
        front.left.load_n = mean - back - right
        front.right.load_n = mean - back + right

    def _motions(self) -> tuple[float, ...]:
        return (*super()._motions(), self._rear.rate_rad_s, self._front.rate_rad_s)

    def _come_to_rest(self) -> None:
        """Set every speed to zero."""
        super()._come_to_rest()
        self._rear.rate_rad_s = self._front.rate_rad_s = 0.0


def _rim_mobility(profile: Profile, vehicle: PairedSteerGeometry, simulation: SimulationConfig) -> float:
    """Acceleration at a rim per force [1/kg]: of the lightest wheel, of a pair about its axes, of the body."""
    wheels = (profile.drives[name] for name in vehicle.wheels)
    lightest = min(
        (simulation.wheel_inertia_kg_m2 + drive.total_ratio**2 * drive.motor.rotor_inertia_kg_m2)
        / drive.wheel_radius_m**2
        for drive in wheels
    )
    pair = 2.0 * vehicle.contact_offset_m**2 / simulation.steering_inertia_kg_m2
    return 1.0 / lightest + pair + 4.0 / vehicle.mass_kg


def _check_stiffness(
    profile: Profile, vehicle: PairedSteerGeometry, simulation: SimulationConfig, step_s: float
) -> None:
    """Refuse tyres that the step cannot follow, at a quarter of the weight."""
    tyre, load = simulation.tyre, vehicle.mass_kg * GRAVITY_M_S2 / 4.0
    require_soft(tyre, tyre.cornering_stiffness_per_rad * load, _rim_mobility(profile, vehicle, simulation), step_s)


def _check_tipping(vehicle: PairedSteerGeometry, simulation: SimulationConfig) -> None:
    """Refuse a centre of mass so high that full friction would lift a wheel."""
    width = vehicle.pivot_track_m + 2.0 * vehicle.contact_offset_m
    highest = 0.5 / (simulation.tyre.friction * hypot(1.0 / vehicle.wheelbase_m, 1.0 / width))
    if vehicle.centre_of_mass_height_m > highest:
        raise ConfigError(
            "the simulated robot would lift a wheel before it slides, which the simulation cannot do",
            object="vehicle.centre_of_mass_height_m",
            value=vehicle.centre_of_mass_height_m,
            limit=highest,
            remedy=f"set at most {highest:.3f} m, or less tyre friction",
        )
