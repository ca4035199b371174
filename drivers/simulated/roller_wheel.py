"""An omni-wheel on the floor: its rim grips along the wheel, its rollers roll freely across it.

Along the wheel the contact is the tyre of :mod:`drivers.simulated.tyre` in one direction: bristles bent by ``x`` [m],

    dx/dt = u - v_roll - |u| x / sigma        u: speed of the rim

and the brush model's force ``F = k d (1 - q + q**2/3)`` with ``q = k |d| / (3 mu F_z)``, ``mu F_z`` from ``q = 1`` on,
where ``k = C_x F_z / sigma``. Across it nothing but the rollers' rolling resistance acts. The coefficient of friction
``mu`` is the floor's at the contact point, and may change from step to step.
"""

from __future__ import annotations

from math import atan, cos, inf, radians, sin

from drivers.simulated.motor import WheelDrive
from drivers.simulated.tyre import DAMPING_S, SLOWEST_REFERENCE_M_S
from profiles.schema import OmniWheelGeometry, SimulationConfig

_ROLLER_SPEED_M_S = 0.01
"""Speed across the wheel from which the rollers' resistance is all there (assumed)."""


class RollerWheel:
    """One wheel: contact, motor with gear, load.

    Args:
        geometry: where it rolls.
        simulation: tyre and rollers.
        drive: its motor.

    Attributes:
        x_m, y_m: contact point in the robot's frame.
        load_n: wheel load.
        force_x_n, force_y_n: force of the floor in the robot's frame.
        slip_m_s: rim speed less rolling speed, in the last step.
        sliding: whether its bristles slid in the last step: it asked for more than friction holds.
    """

    __slots__ = (
        "_cos",
        "_deflection",
        "_ice",
        "_lateral_m_s",
        "_per_friction_m",
        "_rim_m_s",
        "_roller_resistance",
        "_sin",
        "_stiffness",
        "_travel_m",
        "drive",
        "force_x_n",
        "force_y_n",
        "load_n",
        "sliding",
        "slip_m_s",
        "x_m",
        "y_m",
    )

    def __init__(self, geometry: OmniWheelGeometry, simulation: SimulationConfig, drive: WheelDrive) -> None:
        angle = radians(geometry.direction_deg)
        self._cos, self._sin = cos(angle), sin(angle)
        self.x_m, self.y_m = geometry.lever_m * self._sin, -geometry.lever_m * self._cos
        self._travel_m = simulation.tyre.relaxation_length_m
        self._stiffness = simulation.tyre.slip_stiffness / self._travel_m
        self._per_friction_m = 3.0 / self._stiffness
        self._roller_resistance = simulation.roller_resistance
        self.drive = drive
        self.load_n = self.force_x_n = self.force_y_n = 0.0
        self._deflection = self._rim_m_s = self._lateral_m_s = self.slip_m_s = 0.0
        self.sliding = False
        self._ice = inf

    def lay_ice(self, friction: float) -> None:
        """From now on there is at most this friction, whatever the floor has; infinity takes the ice away."""
        self._ice = friction

    @property
    def slip_ratio(self) -> float:
        """(rim speed - rolling speed) over the faster of the two, in the last step."""
        rim = self._rim_m_s
        return self.slip_m_s / max(abs(rim), abs(rim - self.slip_m_s), SLOWEST_REFERENCE_M_S)

    @property
    def slip_angle_rad(self) -> float:
        """Angle from the wheel's direction to the motion of its contact point, which its rollers leave free."""
        return atan(self._lateral_m_s / max(abs(self._rim_m_s - self.slip_m_s), SLOWEST_REFERENCE_M_S))

    def roll(self, vx: float, vy: float, yaw_rate: float, friction: float, dt_s: float) -> None:
        """Roll for one step: bend the bristles, update the forces, turn the wheel.

        Args:
            vx, vy: velocity of the robot's centre in its frame.
            yaw_rate: of the robot.
            friction: coefficient at the contact point.
            dt_s: length of the step.
        """
        friction = min(friction, self._ice)
        point_x, point_y = vx - yaw_rate * self.y_m, vy + yaw_rate * self.x_m
        c, s = self._cos, self._sin
        lateral = point_y * c - point_x * s
        rim = self._rim_m_s = self.drive.rim_m_s
        self.slip_m_s = rim - (point_x * c + point_y * s)
        self._lateral_m_s = lateral
        along = self._grip(rim, friction, dt_s)
        share = min(max(lateral / _ROLLER_SPEED_M_S, -1.0), 1.0)
        across = -min(self._roller_resistance, friction) * self.load_n * share
        self.force_x_n = along * c - across * s
        self.force_y_n = along * s + across * c
        self.drive.turn(along, self.load_n, dt_s)

    def _grip(self, rim: float, friction: float, dt_s: float) -> float:
        """Force along the wheel."""
        old = self._deflection
        x = (old + self.slip_m_s * dt_s) / (1.0 + abs(rim) * dt_s / self._travel_m)
        bent = x + (x - old) * (DAMPING_S / dt_s)
        limit_m = friction * self._per_friction_m
        self.sliding = abs(bent) >= limit_m
        self._deflection = min(max(x, -limit_m), limit_m)
        if self.sliding:
            return friction * self.load_n if bent > 0.0 else -friction * self.load_n
        q = abs(bent) / limit_m
        return self.load_n * self._stiffness * (1.0 - q + q * q / 3.0) * bent
