"""The law of a robot on four mecanum wheels: front left, front right, rear left, rear right.

Seen from above, the rollers' axes form an X. A wheel's rim speed is what the floor asks of it along its rollers' axis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from daemon.loops.measurement import Command, Measurement
from daemon.loops.own_vehicle import OwnVehicle, Twist
from profiles.schema import Limits


class Mecanum(OwnVehicle):
    """Drives in every direction and turns at the same time."""

    wheels = 4
    parameters = ("half_length_m", "half_width_m", "mass_kg", "yaw_inertia_kg_m2")

    def __init__(self, given: Mapping[str, float], limits: Limits) -> None:
        super().__init__(given, limits)
        wrong = [f"{name} is {given[name]:g}" for name in self.parameters if not given[name] > 0]
        if wrong:
            raise ValueError(f"{', '.join(wrong)}, and has to be above 0")
        self.arm_m = given["half_length_m"] + given["half_width_m"]

    def step(self, measurement: Measurement, target: Twist | None, dt_s: float) -> Command:
        """The wheels' speeds for the target; the gate makes ramps of them."""
        x, y, turn = target or (0.0, 0.0, 0.0)
        turn *= self.arm_m
        return Command((x - y - turn, x + y + turn, x + y - turn, x - y + turn))

    def body_motion(self, rolled: Sequence[float], heading_rad: Sequence[float]) -> Twist:
        """The least-squares answer to the four equations of ``step``."""
        a, b, c, d = rolled
        return Twist((a + b + c + d) / 4, (b + c - a - d) / 4, (b + d - a - c) / (4 * self.arm_m))

    def objection(self, twist: Twist) -> str:
        """Refuse what would turn a wheel faster than it may."""
        fastest = abs(twist.forward_m_s) + abs(twist.left_m_s) + abs(twist.yaw_rate_rad_s) * self.arm_m
        allowed = self.limits.wheel_speed_m_s
        return f"a wheel would roll at {fastest:.2f} m/s, it may {allowed:g}" if fastest > allowed else ""
