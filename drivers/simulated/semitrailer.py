"""A truck with a semi-trailer: two rigid bodies on a level floor that pull at each other at the hitch.

Written in the truck's frame (x forward, y left), all vectors at one moment. Truck: mass m, moment of inertia J about
its centre of mass, yaw rate w; trailer: m', J', w'. The hitch lies at ``a`` from the truck's centre of mass, the
trailer's centre at ``b`` from the hitch. With F, F' the floor's forces on the bodies, M, M' their moments about the
centres, and R the force of the trailer on the truck::

    m A = F + R              J dw/dt = M + a x R
    m' A' = F' - R           J' dw'/dt = M' + b x R
    A' = A + dw/dt x a - w^2 a + dw'/dt x b - w'^2 b

Two equations for R remain. The floor acts at one contact an axle, which stands for its wheels (a differential keeps
the driven ones from steering): the front one is steered, the truck's rear one driven, the trailer's rolls freely. Axle
loads are those at rest; at the speeds of this vehicle they hardly shift. Where truck and trailer touch, the trailer
stops.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import copysign, cos, radians, sin
from random import Random

from drivers.simulated.body import GRAVITY_M_S2, BodyWorld, parts_of
from drivers.simulated.motor import WheelDrive
from drivers.simulated.steered_axle import SimulatedSteering
from drivers.simulated.tyre import Contact, require_soft
from drivers.simulated.world import STEP_S
from profiles.schema import Profile, SimulationConfig
from profiles.steered import SemitrailerGeometry

Pose = tuple[float, float, float]
Vector = tuple[float, float]

ROLLING_AT_M_S = 0.01
"""Speed from which the rolling resistance of a free axle is all there (assumed)."""


class FreeAxle:
    """An axle that rolls without a motor, at the speed of the floor under it.

    Attributes:
        load_n: what stands on it.
        contact: its tyres.
    """

    __slots__ = ("_resistance", "contact", "load_n")

    def __init__(self, simulation: SimulationConfig, load_n: float) -> None:
        self.contact = Contact(simulation.tyre)
        self.load_n = load_n
        self._resistance = simulation.tyre.rolling_resistance

    def roll(self, along_m_s: float, across_m_s: float, dt_s: float) -> Vector:
        """Force of the floor along the axle's heading and to its left [N], for one step."""
        contact = self.contact
        contact.deform(along_m_s, along_m_s, across_m_s, self.load_n, dt_s)
        share = min(max(along_m_s / ROLLING_AT_M_S, -1.0), 1.0)
        return contact.force_x_n - self._resistance * self.load_n * share, contact.force_y_n


class DrivenAxle:
    """The truck's rear axle with its motor; attributes as of :class:`FreeAxle`, and the motor's ``drive``."""

    __slots__ = ("contact", "drive", "load_n")

    def __init__(self, simulation: SimulationConfig, load_n: float, drive: WheelDrive) -> None:
        self.contact = Contact(simulation.tyre)
        self.drive = drive
        self.load_n = load_n

    def roll(self, along_m_s: float, across_m_s: float, dt_s: float) -> Vector:
        """Force of the floor along the axle's heading and to its left [N], for one step."""
        contact, drive = self.contact, self.drive
        contact.deform(drive.rim_m_s, along_m_s, across_m_s, self.load_n, dt_s)
        drive.turn(contact.force_x_n, self.load_n, dt_s)
        return contact.force_x_n, contact.force_y_n


class SemitrailerWorld(BodyWorld):
    """The vehicle on a level floor.

    Args:
        profile: a semi-trailer with a simulation section.
        seed: of where within an encoder count each motor shaft stands at the start.
        step_s: integration step.

    Attributes:
        steering: the steered axle.
        front, rear, trailing: the axles.

    Raises:
        ConfigError: the profile has no semi-trailer or no simulation section, or its tyres are too stiff for the step.
    """

    def __init__(self, profile: Profile, seed: int = 0, step_s: float = STEP_S) -> None:
        vehicle, simulation = parts_of(profile, SemitrailerGeometry, "a semi-trailer", "semitrailer")
        _check_stiffness(vehicle, simulation, step_s)
        random, axle, trailer = Random(seed), vehicle.steering, vehicle.trailer
        drive = WheelDrive(profile.drives[vehicle.wheels[0]], simulation, random.random())
        self.steering = SimulatedSteering(axle, profile.drives[axle.drive], simulation, random.random())
        rear_kg, hitch_kg = vehicle.driven_axle_kg, vehicle.hitch_kg
        front_kg = vehicle.mass_kg + hitch_kg - rear_kg
        self.front = FreeAxle(simulation, front_kg * GRAVITY_M_S2)
        self.rear = DrivenAxle(simulation, rear_kg * GRAVITY_M_S2, drive)
        self.trailing = FreeAxle(simulation, (trailer.mass_kg - hitch_kg) * GRAVITY_M_S2)
        drives = {vehicle.wheels[0]: drive, axle.drive: self.steering.drive}
        self._ahead_m = vehicle.wheelbase_m - vehicle.mass_offset_m
        self._back_m = vehicle.mass_offset_m
        self._hitch_m = -vehicle.mass_offset_m - vehicle.hitch_offset_m
        self._bent_rad = 0.0
        self._trailer_rate = 0.0
        super().__init__(drives, vehicle.mass_kg, (self._back_m, 0.0, 0.0), step_s)
        self.contacts = {vehicle.wheels[0]: self.rear.contact}
        self._geometry = vehicle
        self._stop_rad = radians(trailer.max_bending_deg)
        self._angles: Mapping[str, str] = {axle.encoder: "steering", trailer.encoder: "bending"}

    # --- the truth ---------------------------------------------------------------------------------------------

    @property
    def pose(self) -> Pose:
        """True pose of the truck's rear axle: x_m, y_m, yaw_rad (unwrapped)."""
        return self._x_m - self._back_m * self._cos, self._y_m - self._back_m * self._sin, self._yaw_rad

    @property
    def trailer_pose(self) -> Pose:
        """True pose of the trailer's axle."""
        yaw, length = self._yaw_rad + self._bent_rad, self._geometry.trailer.length_m
        hitch_x, hitch_y = self._x_m + self._hitch_m * self._cos, self._y_m + self._hitch_m * self._sin
        return hitch_x - length * cos(yaw), hitch_y - length * sin(yaw), yaw

    @property
    def bending_rad(self) -> float:
        """True bending angle: the trailer's heading minus the truck's."""
        return self._bent_rad

    @property
    def touching(self) -> bool:
        """Whether truck and trailer touch: the vehicle has jackknifed."""
        return abs(self._bent_rad) >= self._stop_rad

    @property
    def slip_ratio(self) -> tuple[float, ...]:
        """True slip ratio of the driven axle."""
        return (self.rear.contact.slip_ratio,)

    @property
    def slip_angle_rad(self) -> tuple[float, ...]:
        """True slip angles of the front, the driven and the trailer's axle."""
        return tuple(axle.contact.slip_angle_rad for axle in (self.front, self.rear, self.trailing))

    def heading_rad(self, pair: str) -> float:
        """True steering or bending angle, by its encoder's name."""
        return self.steering.angle_rad if self._angles[pair] == "steering" else self._bent_rad

    def place(self, rear_axle: Pose, bending_rad: float = 0.0, steering_rad: float = 0.0) -> None:
        """Put the vehicle, at rest, where it shall begin, as by hand.

        Args:
            rear_axle: pose of the truck's.
            bending_rad, steering_rad: its angles.
        """
        x, y, self._yaw_rad = rear_axle
        self._cos, self._sin = cos(self._yaw_rad), sin(self._yaw_rad)
        self._x_m, self._y_m = x + self._back_m * self._cos, y + self._back_m * self._sin
        self._bent_rad, self.steering.angle_rad = bending_rad, steering_rad
        self._come_to_rest()

    # --- a step ------------------------------------------------------------------------------------------------

    def _step(self) -> None:
        """Integrate one step: forces by the old velocities, then velocities, then positions."""
        dt, geometry, trailer = self._step_s, self._geometry, self._geometry.trailer
        self.steering.turn(dt)
        (vx, vy), rate, trailer_rate = self._body_velocity(), self._yaw_rate, self._trailer_rate
        force_x, force_y, moment = self._truck_forces(vx, vy, rate, dt)
        c, s = cos(self._bent_rad), sin(self._bent_rad)
        pulled_x, pulled_y, turned = self._trailer_forces((vx, vy + rate * self._hitch_m), trailer_rate, (c, s), dt)
        ax, bx, by = self._hitch_m, -trailer.mass_offset_m * c, -trailer.mass_offset_m * s
        m, j, m2, j2 = self._mass_kg, geometry.yaw_inertia_kg_m2, trailer.mass_kg, trailer.yaw_inertia_kg_m2
        right_x = pulled_x / m2 - force_x / m + rate * rate * ax + turned / j2 * by + trailer_rate * trailer_rate * bx
        right_y = pulled_y / m2 - force_y / m - moment / j * ax - turned / j2 * bx + trailer_rate * trailer_rate * by
        k_xx, k_xy = 1 / m + 1 / m2 + by * by / j2, -bx * by / j2
        k_yy = 1 / m + 1 / m2 + ax * ax / j + bx * bx / j2
        determinant = k_xx * k_yy - k_xy * k_xy
        hitch_x = (k_yy * right_x - k_xy * right_y) / determinant
        hitch_y = (k_xx * right_y - k_xy * right_x) / determinant
        self._trailer_rate += (turned + bx * hitch_y - by * hitch_x) / j2 * dt
        self._move(force_x + hitch_x, force_y + hitch_y, (moment + ax * hitch_y) / j, dt)
        self._bend(dt)

    def _truck_forces(self, vx: float, vy: float, rate: float, dt: float) -> tuple[float, float, float]:
        """Force of the floor on the truck, and its moment about the centre of mass."""
        angle, ahead, back = self.steering.angle_rad, self._ahead_m, self._back_m
        c, s = cos(angle), sin(angle)
        side = vy + rate * ahead
        along, across = self.front.roll(vx * c + side * s, side * c - vx * s, dt)
        front_x, front_y = along * c - across * s, along * s + across * c
        rear_x, rear_y = self.rear.roll(vx, vy - rate * back, dt)
        return front_x + rear_x, front_y + rear_y, front_y * ahead - rear_y * back

    def _trailer_forces(self, hitch_m_s: Vector, rate: float, heading: Vector, dt: float) -> tuple[float, float, float]:
        """Force of the floor on the trailer, in the truck's frame, and its moment about the trailer's centre."""
        (vx, vy), (c, s), trailer = hitch_m_s, heading, self._geometry.trailer
        along, across = vx * c + vy * s, vy * c - vx * s - rate * trailer.length_m
        force_along, force_across = self.trailing.roll(along, across, dt)
        arm = trailer.length_m - trailer.mass_offset_m
        return force_along * c - force_across * s, force_along * s + force_across * c, -arm * force_across

    def _bend(self, dt: float) -> None:
        """Turn the hitch; where truck and trailer touch, they turn together from now on."""
        bent = self._bent_rad + (self._trailer_rate - self._yaw_rate) * dt
        if abs(bent) >= self._stop_rad:
            bent, self._trailer_rate = copysign(self._stop_rad, bent), self._yaw_rate
        self._bent_rad = bent

    # --- rest --------------------------------------------------------------------------------------------------

    def _step_in_air(self) -> None:
        super()._step_in_air()
        self.steering.follow(self._step_s)

    def _motions(self) -> tuple[float, ...]:
        return (*super()._motions(), self._trailer_rate)

    def _come_to_rest(self) -> None:
        super()._come_to_rest()
        self._trailer_rate = 0.0


def _check_stiffness(vehicle: SemitrailerGeometry, simulation: SimulationConfig, step_s: float) -> None:
    """Refuse tyres that the step cannot follow.

    What they pull at is the truck's or the trailer's body, at the axle where it gives way most; each may carry all the
    weight.
    """
    trailer = vehicle.trailer
    ahead = max(vehicle.wheelbase_m - vehicle.mass_offset_m, vehicle.mass_offset_m)
    behind = trailer.length_m - trailer.mass_offset_m
    truck = 2.0 / vehicle.mass_kg + 2.0 * ahead * ahead / vehicle.yaw_inertia_kg_m2
    mobility = max(truck, 1.0 / trailer.mass_kg + behind * behind / trailer.yaw_inertia_kg_m2)
    load = (vehicle.mass_kg + trailer.mass_kg) * GRAVITY_M_S2 / 2.0
    tyre = simulation.tyre
    require_soft(tyre, max(tyre.cornering_stiffness_per_rad, tyre.slip_stiffness) * load, mobility, step_s)
