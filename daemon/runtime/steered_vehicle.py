"""What vehicles with a steered axle have in common: the steering drive comes last of the drives, its encoder first."""

from __future__ import annotations

from daemon.loops.measurement import Command, Measurement
from daemon.loops.steering_gate import SteeringGate
from daemon.runtime.vehicle import Vehicle
from drivers.contract import Drive, SteeringEncoder
from profiles.schema import Profile
from profiles.steered import SteeredAxle


class SteeredVehicle(Vehicle):
    """A vehicle whose driven wheels and steered axle are limited each by itself.

    Args:
        profile: the robot.
        axle: its steered axle.
        wheels: drives of its wheels.
        steering: drive of the axle.
        encoders: of the axle, and of what else there is.
        wheel_acceleration_m_s2: what the gate allows the wheels; None: what the vehicle may do.

    Attributes:
        arm_m: at which the steering drive's speed counts.
    """

    def __init__(
        self,
        profile: Profile,
        axle: SteeredAxle,
        wheels: tuple[Drive, ...],
        steering: Drive,
        encoders: tuple[SteeringEncoder, ...],
        wheel_acceleration_m_s2: float | None = None,
    ) -> None:
        super().__init__(profile, (*wheels, steering), encoders, (), wheel_acceleration_m_s2)
        self.arm_m = profile.drives[axle.drive].wheel_radius_m
        self._steering_gate = SteeringGate(axle, self.arm_m)

    def gate(
        self, command: Command, measurement: Measurement, previous: Command, dt_s: float
    ) -> tuple[Command, tuple[str, ...]]:
        """The wheels as everywhere, the steering by its own limits."""
        wheels, active = self._gate.apply(_wheels(command), measurement, _wheels(previous), dt_s)
        wanted, before = command.wheel_speed_m_s[-1], previous.wheel_speed_m_s[-1]
        steering, more = self._steering_gate.apply(wanted, measurement.heading_rad[0], before, dt_s)
        return Command((*wheels.wheel_speed_m_s, steering)), (*active, *more)


def _wheels(command: Command) -> Command:
    return Command(command.wheel_speed_m_s[:-1])
