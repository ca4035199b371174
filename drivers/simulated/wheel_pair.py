"""Two wheels that steer together, as a rigid body between the floor's forces and the robot's body.

In the body's frame (x forward, y left, origin in the centre) the steering axes stand at ``(X, Y) = (-+l/2, -+h/2)``.
In the frame that turns with a pair, a contact point lies at ``(B, A)`` from its steering axis: ``B = +b`` in front and
``-b`` at the rear, ``A = +a`` left and ``-a`` right. A belt couples both wheels of a pair: one heading p, relative to
the body and counter-clockwise positive, stands for both. With the body's velocity ``(vx, vy)``, its yaw rate w and the
pair's rate of turn in space ``W = w + dp/dt``, a contact point moves along and to the left of the heading with::

    v_roll = (vx - w Y) cos p + (vy + w X) sin p - W A
    v_lat  = (vy + w X) cos p - (vx - w Y) sin p + W B

The force of the floor does work on this velocity. It reaches the body through the bearing of its steering axis; its
moment about that axis turns the pair::

    I (dw/dt + d2p/dt2) = N - Q        N = sum (B F_lat - A F_roll)

I is the moment of inertia of the pair about its axes, Q the torque that brake, dry friction and stop pass on to the
body. Q is what would keep the pair from turning during a step of length h, ``N + I (dp/dt) / h``, cut to what brake and
friction can hold. A pair that is held passes everything on and moves with the body.

The wheels' spin does not steer, and a contact patch that turns on the spot has no drilling moment of its own: that is
part of the steering axes' dry friction.
"""

from __future__ import annotations

from math import copysign, cos, inf, radians, sin

from drivers.simulated.motor import WheelDrive
from drivers.simulated.tyre import Contact
from profiles.schema import PairedSteerGeometry, SimulationConfig


class Wheel:
    """One wheel: tyre, motor with gear, load."""

    __slots__ = ("contact", "drive", "load_n")

    def __init__(self, drive: WheelDrive, contact: Contact, load_n: float) -> None:
        self.drive = drive
        self.contact = contact
        self.load_n = load_n

    def roll(self, roll_m_s: float, lateral_m_s: float, dt_s: float) -> None:
        """Roll for one step, with the velocity of the contact point along and to the left of the heading."""
        drive, contact, load = self.drive, self.contact, self.load_n
        contact.deform(drive.rim_m_s, roll_m_s, lateral_m_s, load, dt_s)
        drive.turn(contact.force_x_n, load, dt_s)


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

    def contact_points(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where the right and the left wheel touch the floor, in the body's frame."""
        c, s, lead, arm = self._cos, self._sin, self._lead_m, self._arm_m
        x, y = self.offset_m + lead * c, lead * s
        out_x, out_y = -arm * s, arm * c + self._half_track_m
        return (x - out_x, y - out_y), (x + out_x, y + out_y)

    def roll(self, vx: float, vy: float, yaw_rate: float, dt_s: float) -> None:
        """Roll both wheels for one step: deform the tyres, turn the wheels, sum the forces on the body."""
        c, s = self._cos, self._sin
        track = yaw_rate * self._half_track_m
        side = vy + yaw_rate * self.offset_m
        turning = yaw_rate + self.rate_rad_s
        swing = turning * self._arm_m + track * c
        along = vx * c + side * s
        across = side * c - vx * s + turning * self._lead_m
        self.right.roll(along + swing, across - track * s, dt_s)
        self.left.roll(along - swing, across + track * s, dt_s)
        right, left = self.right.contact, self.left.contact
        force_roll = right.force_x_n + left.force_x_n
        force_lat = right.force_y_n + left.force_y_n
        ahead = right.force_x_n - left.force_x_n
        self.force_x_n = force_roll * c - force_lat * s
        self.force_y_n = force_y = force_roll * s + force_lat * c
        difference_x = ahead * c - (right.force_y_n - left.force_y_n) * s
        self.yaw_moment_n_m = self.offset_m * force_y + self._half_track_m * difference_x
        self._push_n_m = self._lead_m * force_lat + self._arm_m * ahead + self.inertia_kg_m2 * self.rate_rad_s / dt_s

    def hold(self) -> None:
        """Decide whether the pair turns in this step, and what torque it passes on to the body."""
        push = self._push_n_m
        limit = self._holding_n_m
        if abs(self.heading_rad) >= self._stop_rad and push * self.heading_rad > 0.0:
            limit = inf
        if -limit <= push <= limit:
            self.held, self.passed_n_m, self.rate_rad_s = True, push, 0.0
        else:
            self.held, self.passed_n_m = False, copysign(limit, push)

    def turn(self, yaw_acceleration: float, dt_s: float) -> None:
        """Turn a pair that is not held for one step."""
        rate = ((self._push_n_m - self.passed_n_m) / self.inertia_kg_m2 - yaw_acceleration) * dt_s
        self.rate_rad_s = rate
        self.place(self.heading_rad + rate * dt_s)
